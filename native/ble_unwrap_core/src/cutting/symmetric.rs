//! A mirrored surface: one half is charted, the other gets the mirror images of its charts, and charts that meet their own image in
//! the mirror plane are joined there.
//!
//! So every seam has a mirror image that is a seam, and the work is done once. What is joined in the plane stays symmetric: of
//! its cuts only those in the plane itself are closed.

use std::sync::Arc;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{self, FaceId, HalfedgeId, Mirror};
use crate::progress::Cancelled;
use crate::settings::{LimitOver, Moves, Settings, Symmetry};

use super::attempt;
use super::copied::copied;
use super::cost::{self, Price};
use super::edit::Edit;
use super::history::{History, MoveKind};
use super::merged::Merged;
use super::moves::face::Face;
use super::moves::join::{Join, Which};
use super::moves::partial_join::PartialJoin;
use super::moves::zip::Zip;
use super::moves::{Move, Proposal, Site, Start};
use super::search::search;
use super::state::{ChartId, Cutting};

/// Halves may be joined along any of so many runs of their border alone: a tube has two.
const MOST_ALONE: usize = 2;

/// A patch that has a mirror plane.
pub(super) struct Mirrored {
    mirror: Mirror,
    /// Where triangles have to be taken together for it.
    merged: Option<Merged>,
}

/// The mirror plane of a patch, if it is to be charted by halves. A large one is not looked at for whether it is better left in one piece.
pub(super) fn mirrored(
    patch: &Patch,
    is_large: bool,
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Option<Mirrored>, Cancelled> {
    // Guides say where to cut, and a limit over the atlas joins charts across the plane as it likes.
    let is_wanted = settings.symmetry == Symmetry::Auto
        && settings.moves == Moves::All
        && settings.limit_over == LimitOver::Chart
        && !patch.mesh.has_guides();
    // What unrolls does so in its own way.
    if !is_wanted || attempt::unrolls(patch, settings, run) {
        return Ok(None);
    }
    let mirrored = look_for_mirror(patch, run)?;
    let may_stay_whole =
        || !attempt::comes_apart(patch, settings) && attempt::may_be_chart(patch.mesh.topology(), settings);
    if mirrored.is_some() && !is_large && may_stay_whole() {
        // What needs no cut gets none.
        let stretch_limit = Price::new(&patch.mesh, settings).limit(patch, settings);
        let worth_it = Settings { stretch_limit, ..settings.clone() };
        if attempt::embedded(patch, &worth_it, &mut Rungs::default(), run)?.is_some() {
            return Ok(None);
        }
    }
    Ok(mirrored)
}

fn look_for_mirror(patch: &Patch, run: &Run<'_>) -> Result<Option<Mirrored>, Cancelled> {
    if let Some(mirror) = mesh::mirror(&patch.mesh, &patch.polygon, run.progress)? {
        return Ok(Some(Mirrored { mirror, merged: None }));
    }
    let Some(label) = mesh::mirrored_polygons(&patch.mesh, &patch.polygon, run.progress)? else { return Ok(None) };
    let merged = Merged::new(patch, &label);
    let mirror = mesh::mirror(&merged.whole.mesh, &merged.whole.polygon, run.progress)?;
    Ok(mirror.map(|mirror| Mirrored { mirror, merged: Some(merged) }))
}

/// For each face of a patch that was charted by halves the mirror images of its sides; none for sides that have none, which are never cut. `None` where the
/// patch has no mirror plane.
pub(super) fn images(patch: &Patch, run: &Run<'_>) -> Result<Option<Vec<[HalfedgeId; 3]>>, Cancelled> {
    let Some(Mirrored { mirror, merged }) = look_for_mirror(patch, run)? else { return Ok(None) };
    let image = |h: HalfedgeId| mirror.likeness.image(h);
    let Some(merged) = merged else {
        return Ok(Some(patch.mesh.faces().map(|f| f.halfedges().map(image)).collect()));
    };
    let mut images = vec![[HalfedgeId::NONE; 3]; patch.mesh.face_count()];
    for f in merged.whole.mesh.faces() {
        let of_patch = |h: HalfedgeId| if h.is_none() { h } else { merged.face(h.face()).halfedge(h.slot()) };
        images[merged.face(f).index()] = f.halfedges().map(|h| of_patch(image(h)));
    }
    Ok(Some(images))
}

/// How the half of a patch is charted, given with the names of its faces.
pub(super) type OfHalf<'a> = dyn Fn(&Patch, &[FaceId], &Settings) -> Result<(Vec<Chart>, Rungs), Cancelled> + 'a;

/// The charts of a mirrored patch; `None` where the images of charts are none, since polygons there are divided into other triangles.
pub(super) fn charts(
    patch: &Patch,
    mirrored: &Mirrored,
    is_large: bool,
    settings: &Settings,
    of_half: &OfHalf<'_>,
    run: &Run<'_>,
) -> Result<Option<(Vec<Chart>, Rungs)>, Cancelled> {
    let Mirrored { mirror, merged } = mirrored;
    let Some(merged) = merged else { return by_halves(patch, mirror, is_large, settings, of_half, run) };
    let made = by_halves(&merged.whole, mirror, is_large, settings, of_half, run)?;
    Ok(made.map(|(charts, rungs)| (charts.iter().map(|chart| merged.chart_of(patch, chart)).collect(), rungs)))
}

fn by_halves(
    whole: &Patch,
    mirror: &Mirror,
    is_large: bool,
    settings: &Settings,
    of_half: &OfHalf<'_>,
    run: &Run<'_>,
) -> Result<Option<(Vec<Chart>, Rungs)>, Cancelled> {
    let even = Arc::new(mirror.with_even_seam_weights(&whole.mesh));
    let whole = &Patch::whole(even, whole.polygon.clone());
    let (mesh, polygon) = (&whole.mesh, &whole.polygon);
    let faces = mirror.first_half();
    let half = Patch::of_surface(mesh, polygon, faces.clone());
    let half = Patch::whole(half.mesh, half.polygon);
    // Seams and stretch weigh against each other as on the whole, of which a root of the area is longer.
    let stretch_price = settings.stretch_price * 0.5_f64.sqrt();
    // Further planes of the half are left alone: each would divide it again, for seams that have to be joined then.
    let once = Settings { stretch_price, symmetry: Symmetry::Off, ..settings.clone() };
    let (mut charts, mut rungs) = of_half(&half, &faces, &once)?;
    let first = Cutting::new(mesh, polygon, charts.clone());
    for chart in &charts.clone() {
        let Some(image) = copied(&first, chart, whole, &mirror.likeness, settings, &mut rungs, run)? else {
            return Ok(None);
        };
        charts.push(image);
    }
    // Joined, the halves of a ball would be an hourglass; apart they are two discs.
    let are_two_discs = charts.len() == 2 && mesh::measure::is_ball(mesh) && !cost::may_bend(settings.stretch_price);
    rungs.take(Rung::Mirrored);
    let mut cutting = Cutting::new(mesh, polygon, charts);
    if are_two_discs {
        return Ok(Some((cutting.into_charts(), rungs)));
    }
    let zip = Zip { limit: settings.stretch_limit };
    let moves = [&Join { which: Which::EVERY, alone: MOST_ALONE } as &dyn Move, &PartialJoin::MostSeen, &zip];
    let moves = moves.map(|inner| InPlane { inner, mirror, embeds: !is_large });
    let mut moves: Vec<&dyn Move> = moves.iter().map(|made| made as &dyn Move).collect();
    let face = Face { mirror, settings };
    // A map of a large one takes too long to be made so many times.
    if !is_large {
        moves.push(&face);
    }
    search(&mut cutting, &mut History::default(), &moves, settings, &mut rungs, run)?;
    Ok(Some((cutting.into_charts(), rungs)))
}

/// A move, made only where what comes of it is its own mirror image: between a chart and its image, or along the plane.
struct InPlane<'a> {
    inner: &'a dyn Move,
    mirror: &'a Mirror,
    /// Whether unions may be embedded, which takes too long for large ones.
    embeds: bool,
}

impl InPlane<'_> {
    /// The chart that has the image of another's first polygon.
    fn image(&self, cutting: &Cutting<'_>, id: ChartId) -> Option<ChartId> {
        let first = cutting.chart(id)?.patch.faces.first()?;
        let side = first.halfedges().into_iter().find(|&h| !self.mirror.likeness.image(h).is_none())?;
        cutting.owner(self.mirror.likeness.image(side).face())
    }

    /// What closes a cut of a chart that is its own image closes the image of that cut, too.
    fn in_pairs(&self, cutting: &Cutting<'_>, site: &mut Site) -> bool {
        let is_whole = site.charts.iter().all(|&id| self.image(cutting, id) == Some(id));
        if self.kind() != MoveKind::Zip || !is_whole {
            return false;
        }
        let is_seam = |h: &HalfedgeId| !h.is_none() && cutting.is_seam(*h);
        for way in &mut site.ways {
            let here = way.edit.glued().to_vec();
            let there = here.iter().map(|&h| self.mirror.likeness.image(h)).filter(is_seam);
            way.edit = Edit::new(cutting.mesh(), &here.iter().copied().chain(there).collect::<Vec<_>>(), &[]);
        }
        true
    }

    fn is_symmetric(&self, cutting: &Cutting<'_>, proposal: &Proposal) -> bool {
        proposal.edit.glued().iter().all(|&h| self.mirror.is_between(cutting.mesh(), h))
    }
}

impl Move for InPlane<'_> {
    fn kind(&self) -> MoveKind {
        self.inner.kind()
    }

    // They were divided for the sake of symmetry, not because they unroll.
    fn price(&self, usual: Price, _cutting: &Cutting<'_>, _edit: &Edit) -> Price {
        usual.bending()
    }

    // Which side of a tube stays open is for stretch to say, too.
    fn takes_cheapest(&self) -> bool {
        self.kind() == MoveKind::Join
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, price: &Price) -> Vec<Site> {
        let mut sites = self.inner.sites(cutting, history, price);
        sites.retain_mut(|site| {
            if self.in_pairs(cutting, site) {
                return true;
            }
            let is_pair = match site.charts[..] {
                [a, b] => self.image(cutting, a) == Some(b),
                _ => true,
            };
            // Where the ways are known already, one that is not symmetric must not be tried for ever.
            let had_ways = !site.ways.is_empty();
            site.ways.retain(|way| self.is_symmetric(cutting, way));
            is_pair && site.ways.is_empty() != had_ways
        });
        sites
    }

    fn ways(&self, cutting: &Cutting<'_>, site: &Site, run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        let mut ways = self.inner.ways(cutting, site, run)?;
        ways.retain(|way| self.is_symmetric(cutting, way));
        // Borders in the plane are seldom straight in both maps: what is glued all along them may need another start.
        if self.embeds && self.kind() == MoveKind::Join {
            let embedded = |way: &Proposal| Proposal { edit: way.edit.clone(), start: Start::Embedded };
            let anew: Vec<Proposal> = ways.iter().map(embedded).collect();
            ways.extend(anew);
        }
        Ok(ways)
    }
}
