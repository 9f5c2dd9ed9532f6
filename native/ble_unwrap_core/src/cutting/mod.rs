//! Where a surface is cut into charts.
//!
//! The state is a [cutting](state): which chart has which face, and so which edges are seams. Every [move](moves) proposes an
//! [edit]: edges to open, edges to glue. A [trial](mod@trial) flattens what an edit changes, and the [search](mod@search)
//! makes the edits that come to something. Charts come from patches that are [divided](mod@divide) until each can be
//! flattened; on a large component this happens on a [coarse mesh](level) first.

mod alike;
mod atlas_limit;
mod attempt;
mod border;
mod charted;
mod component;
mod copied;
mod cost;
mod divide;
mod edit;
mod folded;
mod history;
mod level;
mod measured;
mod merged;
mod moves;
mod originals;
mod rigid_motion;
mod search;
mod state;
mod symmetric;
mod touch_up;
mod trial;
mod whole;

use std::cmp::Reverse;
use std::sync::Arc;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::cache::{self, Fingerprint, Kind, Run};
use crate::charts::{Chart, Patch};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{self, FaceId, Groups, Surface, TriMesh};
use crate::packing::PackSettings;
use crate::progress::Cancelled;
use crate::segmentation;
use crate::settings::{ChartScale, LimitOver, Moves, Settings, Stack, Style};

use alike::{Alike, Placed, alike};
use atlas_limit::join_within_atlas;
use charted::Charted;
use folded::{Components, folded};
use moves::across::cut_across;

pub(crate) use cost::Price;
pub(crate) use divide::divide;
pub(crate) use moves::fold::Cover;
pub(crate) use originals::{Described, Originals};
pub(crate) use touch_up::touch_up;

/// The charts of a component, and how they came about.
type Made = (Vec<Chart>, Rungs);

/// Cuts a surface into charts under the stretch limit of `settings`, sorted by lowest face. `components` holds the
/// faces of each connected piece, ascending, `positions` says where the vertices of different pieces are beside each
/// other, in units of the mesh, and `visibility` how far each vertex can be seen, where that matters. Where charts are
/// to be stacked, tells what is a copy of what, too. `cover` tells how much of the texture some charts cover, where that is asked.
///
/// # Errors
/// The caller cancelled, or there is not enough memory.
pub(crate) fn cut(
    surface: &Surface,
    components: &Groups<FaceId>,
    positions: &[Point3<f64>],
    visibility: Option<&[f32]>,
    cover: &Cover<'_>,
    settings: &Settings,
    run: &Run<'_>,
) -> Result<(Vec<Chart>, Rungs, Originals), Cancelled> {
    let mesh = &match visibility {
        Some(visibility) => cost::weighed(&surface.mesh, components, visibility, settings),
        None => Arc::clone(&surface.mesh),
    };
    let polygon = &surface.polygon;
    let charted = Charted::new(run.progress, mesh.face_count());
    let patch_of = |component: usize| whole(mesh, polygon, components.group(component));
    let of_component = |component: usize| {
        let patch = with_unrolling_parts(patch_of(component), settings);
        charts_of(&patch, components.group(component), settings, &charted, run)
    };
    let placed = |component: usize| {
        // Without the weights of what can be seen: parts are alike wherever they are hidden, if seams there are wished alike.
        let patch = whole(&surface.mesh, polygon, components.group(component));
        let mut place = vec![Point3::origin(); patch.mesh.vertex_count()];
        for (f, local) in components.group(component).iter().zip(patch.mesh.triangles()) {
            for (v, local) in mesh.triangle(*f).iter().zip(local) {
                place[local.index()] = positions[v.index()];
            }
        }
        Placed { patch, positions: place }
    };
    let likes = alike(components, &placed, settings, run.progress)?;
    // The largest first, so that no long one starts last.
    let mut order: Vec<usize> = (0..components.len()).collect();
    order.sort_by_key(|&component| Reverse(components.group(component).len()));
    let (copies, originals): (Vec<usize>, Vec<usize>) = order.into_iter().partition(|&c| likes[c].is_some());
    let mut made: Vec<Option<Arc<Made>>> = vec![None; components.len()];
    let in_parallel = |which: Vec<usize>, of: &(dyn Fn(usize) -> Result<Arc<Made>, Cancelled> + Sync)| {
        let found: Vec<_> = which.into_par_iter().with_max_len(1).map(|component| (component, of(component))).collect();
        found.into_iter().map(|(component, found)| Ok((component, found?))).collect::<Result<Vec<_>, Cancelled>>()
    };
    for (component, found) in in_parallel(originals, &of_component)? {
        made[component] = Some(found);
    }
    // Elsewhere nothing is copied.
    let stacks =
        settings.stack != Stack::Off && settings.moves == Moves::All && settings.limit_over == LimitOver::Chart;
    let mut rungs = Rungs::default();
    if stacks {
        // Before they are copied, so that copies are cut as their originals are, and take no place of their own.
        across_originals(mesh, polygon, components, &mut made, settings, &mut rungs, run)?;
    }
    // A copy may be the original of its mirror image: round by round, and each round makes some.
    let mut open = copies;
    while !open.is_empty() {
        let is_made = |like: &Option<Alike>| like.as_ref().is_none_or(|like| made[like.original].is_some());
        let (ready, later): (Vec<usize>, Vec<usize>) = open.into_iter().partition(|&c| is_made(&likes[c]));
        let copied = in_parallel(ready, &|component| {
            run.progress.check()?;
            let original = likes[component].as_ref().and_then(|like| Some((like, made[like.original].as_ref()?)));
            let Some((like, charts)) = original else { return of_component(component) };
            let [there, here] = [like.original, component].map(|c| (patch_of(c), components.group(c)));
            let copied = like.charts((&there.0, there.1), &charts.0, (&here.0, here.1), settings, run)?;
            let Some(copied) = copied else { return of_component(component) };
            charted.add(components.group(component).len() as f64, 1.0);
            Ok(Arc::new(copied))
        })?;
        for (component, found) in copied {
            made[component] = Some(found);
        }
        open = later;
    }
    let originals = if stacks {
        originals_of(mesh.face_count(), components, &likes, &made, &patch_of, settings, run)?
    } else {
        Originals::default()
    };
    let is_by_halves = |made: &Option<Arc<Made>>| made.as_ref().is_some_and(|made| made.1.has(Rung::Mirrored));
    let by_halves: Vec<bool> = made.iter().map(is_by_halves).collect();
    let mut charts = Vec::new();
    for component in made.into_iter().flatten() {
        rungs.add(&component.1);
        match Arc::try_unwrap(component) {
            Ok((more, _)) => charts.extend(more),
            Err(kept) => charts.extend_from_slice(&kept.0),
        }
    }
    if settings.limit_over == LimitOver::Atlas && settings.moves >= Moves::Join {
        charts = join_within_atlas(mesh, polygon, charts, settings, &mut rungs, run)?;
    }
    if settings.limit_over == LimitOver::Atlas {
        charts = touch_up(charts, &Price::new(mesh, settings), settings, &mut rungs, run.progress)?;
    }
    if stacks {
        charts.sort_by_key(|chart| chart.patch.faces.iter().min().copied());
    } else if settings.moves == Moves::All {
        charts = cut_across(mesh, polygon, charts, settings, &mut rungs, run)?;
        if folded::is_wanted(settings) {
            let components = Components { faces: components, likes: &likes, by_halves: &by_halves };
            charts = folded(mesh, polygon, &components, &patch_of, charts, cover, settings, &mut rungs, run)?;
        }
    }
    Ok((charts, rungs, originals))
}

/// What is a copy of what: of components, and where mirrored halves are to be stacked of the halves of those that were
/// charted so.
fn originals_of(
    face_count: usize,
    components: &Groups<FaceId>,
    likes: &[Option<Alike>],
    made: &[Option<Arc<Made>>],
    patch_of: &(impl Fn(usize) -> Patch + Sync),
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Originals, Cancelled> {
    let mut originals = Originals::of(face_count, components, likes);
    if settings.stack != Stack::Mirrored {
        return Ok(originals);
    }
    let is_by_halves = |c: &usize| likes[*c].is_none() && made[*c].as_ref().is_some_and(|m| m.1.has(Rung::Mirrored));
    let by_halves: Vec<usize> = (0..components.len()).filter(is_by_halves).collect();
    let mirror = |&component: &usize| {
        let patch = patch_of(component);
        Ok((component, mesh::mirror(&patch.mesh, &patch.polygon, run.progress)?))
    };
    let found: Vec<Result<_, Cancelled>> = by_halves.par_iter().map(mirror).collect();
    for found in found {
        if let (component, Some(mirror)) = found? {
            originals.add_halves(&mirror, components.group(component));
        }
    }
    Ok(originals)
}

/// Cuts those charts across that are too long for the texture, of the components that have any yet.
fn across_originals(
    mesh: &TriMesh,
    polygon: &[u32],
    components: &Groups<FaceId>,
    made: &mut [Option<Arc<Made>>],
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<(), Cancelled> {
    // Each face is in one.
    let mut component_of = vec![0; mesh.face_count()];
    for (component, faces) in (0..components.len()).map(|c| (c, components.group(c))) {
        faces.iter().for_each(|f| component_of[f.index()] = component);
    }
    let charts: Vec<Chart> = made.iter().flatten().flat_map(|made| made.0.iter().cloned()).collect();
    let charts = cut_across(mesh, polygon, charts, settings, rungs, run)?;
    let mut cut: Vec<Vec<Chart>> = vec![Vec::new(); made.len()];
    for chart in charts {
        let Some(first) = chart.patch.faces.first() else { continue };
        cut[component_of[first.index()]].push(chart);
    }
    for (made, charts) in made.iter_mut().zip(cut) {
        if let Some(made) = made {
            *made = Arc::new((charts, made.1.clone()));
        }
    }
    Ok(())
}

/// A component as a mesh of its own, which a connected surface is already.
fn whole(mesh: &Arc<TriMesh>, polygon: &[u32], faces: &[FaceId]) -> Patch {
    if faces.len() == mesh.face_count() {
        return Patch::whole(Arc::clone(mesh), polygon.to_vec());
    }
    let (part, _) = mesh.submesh(faces, |_| false);
    Patch::whole(Arc::new(part), faces.iter().map(|f| polygon[f.index()]).collect())
}

/// A component with its parts that unroll between hard edges, of which the paper's presets know nothing.
fn with_unrolling_parts(whole: Patch, settings: &Settings) -> Patch {
    if settings.moves != Moves::All || settings.style == Style::Organic {
        return whole;
    }
    let parts = segmentation::unrolling_parts(&whole.mesh, &whole.polygon, settings.style == Style::Hard);
    if parts.is_empty() {
        return whole;
    }
    let mesh = Arc::unwrap_or_clone(whole.mesh).with_parts(parts);
    Patch { mesh: Arc::new(mesh), ..whole }
}

/// The charts of a component, which is `faces` of the surface, or what they were under the same settings but for those of
/// later stages.
fn charts_of(
    whole: &Patch,
    faces: &[FaceId],
    settings: &Settings,
    charted: &Charted<'_>,
    run: &Run<'_>,
) -> Result<Arc<Made>, Cancelled> {
    let input = |f: &mut Fingerprint| {
        f.mesh(&whole.mesh);
        f.numbers(&whole.polygon);
        // They are named in the result.
        f.indices(faces.iter().map(|face| face.index()));
        f.settings(&Settings {
            chart_scale: ChartScale::Uniform,
            stack: Stack::Off,
            packing: PackSettings::default(),
            ..settings.clone()
        });
    };
    let bytes = |made: &Made| made.0.iter().map(|c| cache::bytes_of(&c.patch.mesh) + 24 * c.uv.len()).sum();
    let found = || {
        let charts = || component::charts(whole, faces, settings, charted, run);
        run.recall(Kind::Charts, input, bytes, charts)
    };
    // Under a limit over the atlas charts are still to be joined.
    if settings.limit_over == LimitOver::Atlas {
        return found();
    }
    // Before they are copied, so that copies are alike.
    let touched = || {
        let (charts, mut rungs) = Made::clone(&*found()?);
        let price = Price::new(&whole.mesh, settings);
        Ok((touch_up(charts, &price, settings, &mut rungs, run.progress)?, rungs))
    };
    run.recall(Kind::TouchedUp, input, bytes, touched)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces::turned;
    use crate::progress::Progress;

    #[test]
    fn what_is_finely_divided_comes_apart_at_its_edges_at_once() {
        // Three cones that meet at 36°, of which no two together unroll, and two caps.
        let (mesh, polygon) = turned(96, &[[1.0, 0.0], [0.6, 1.0], [0.9, 2.2], [0.5, 3.2]]);
        let settings = Settings::default();
        let whole = with_unrolling_parts(Patch::whole(Arc::new(mesh), polygon), &settings);
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let price = Price::new(&whole.mesh, &settings);
        let charting = divide(vec![whole], &price, &settings, &|_| (), &run).expect("not cancelled");
        assert_eq!(charting.charts.len(), 5);
        assert!(charting.charts.iter().all(|chart| chart.l2 < 1.001));
        assert_eq!(charting.refused.len(), 1, "only the whole was looked at in vain");
    }
}
