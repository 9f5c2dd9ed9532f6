//! One connected surface to charts, by way of a coarse mesh where it is large.

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::Rungs;
use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::segmentation;
use crate::settings::Settings;

use super::charted::Charted;
use super::cost::{self, Price};
use super::divide::{self, Charting};
use super::level::OnCoarse;
use super::moves::hand_over::hand_over;
use super::moves::join::Which;
use super::moves::split;
use super::symmetric;
use super::whole::Whole;

/// Components of more vertices are charted on a coarse mesh.
const COARSE_ABOVE: usize = 3_000;
/// On the fine mesh only charts that a split there has made are joined again, and only up to so many faces: the
/// others have been tried on the coarse mesh.
const FINE_UNION: usize = 20_000;
/// Share of the work on a component that the coarse mesh takes.
const COARSE_WORK: f64 = 0.4;

/// The charts of one component of the surface, by lowest face. `whole` is the component as a patch of itself; its faces are
/// named as in `faces`.
pub(crate) fn charts(
    whole: &Patch,
    faces: &[FaceId],
    settings: &Settings,
    charted: &Charted<'_>,
    run: &Run<'_>,
) -> Result<(Vec<Chart>, Rungs), Cancelled> {
    let fine = Whole { patch: whole };
    let size = faces.len() as f64;
    let mut rungs = Rungs::default();
    let is_large = is_large(whole, settings);
    let all_unroll = whole.mesh.is_all_parts() && segmentation::between_parts(&whole.mesh).is_some();
    if !all_unroll && let Some(mirrored) = symmetric::mirrored(whole, is_large, settings, run)? {
        let of_half = |half: &Patch, faces: &[FaceId], once: &Settings| charts(half, faces, once, charted, run);
        if let Some((mut charts, rungs)) = symmetric::charts(whole, &mirrored, is_large, settings, &of_half, run)? {
            charted.add(0.5 * size, 1.0);
            rename(&mut charts, faces);
            return Ok((charts, rungs));
        }
    }
    // What unrolls needs no trials that a coarse mesh would make cheap, and has its edges on the fine one.
    let is_divided = is_large && (all_unroll || !cost::may_bend(settings.stretch_price));
    let mut charts = if let Some(parts) = is_divided.then(|| split::hard_parts(whole)).flatten() {
        let charting = by_parts(parts, whole, settings, charted, run)?;
        rungs.add(&charting.rungs);
        // A large union is as costly to embed whether or not its parts unroll.
        let charts = fine.join(charting, Which::every_on_fine(FINE_UNION), settings, &mut rungs, run)?;
        joined_and_closed(fine, charts, settings, &mut rungs, run)?
    } else if is_large {
        let coarse = OnCoarse::new(fine, settings, run)?;
        let parts = coarse.parts(&mut rungs, run)?;
        charted.add(size, COARSE_WORK);
        let done = |faces| charted.add(faces, 1.0 - COARSE_WORK);
        let charting = coarse.polish(parts, &done, &mut rungs, run)?;
        fine.join(charting, Which::AfterSplits { most_faces: FINE_UNION }, settings, &mut rungs, run)?
    } else {
        // A small one is left to the search as it is: it may also unroll in fewer parts.
        let done = |faces| charted.add(faces, 1.0);
        let charts = fine.charts(vec![whole.clone()], Which::EVERY, settings, &mut rungs, &done, run)?;
        joined_and_closed(fine, charts, settings, &mut rungs, run)?
    };
    charts = hand_over(&whole.mesh, &whole.polygon, charts, settings, &mut rungs, run)?;
    rename(&mut charts, faces);
    Ok((charts, rungs))
}

/// Whether a component is charted on a coarse mesh, unless it comes apart into parts that unroll.
fn is_large(whole: &Patch, settings: &Settings) -> bool {
    whole.mesh.vertex_count() > COARSE_ABOVE && settings.coarse
}

/// The charts of the parts of a component: what does not unroll and is large, as a plane with wide bevels may be, is charted as a component is.
fn by_parts(
    parts: Vec<Patch>,
    whole: &Patch,
    settings: &Settings,
    charted: &Charted<'_>,
    run: &Run<'_>,
) -> Result<Charting, Cancelled> {
    let (large, others): (Vec<Patch>, Vec<Patch>) =
        parts.into_iter().partition(|part| is_large(part, settings) && !segmentation::is_developable(&part.mesh));
    let price = Price::new(&whole.mesh, settings);
    let mut charting = divide::divide(others, &price, settings, &|faces| charted.add(faces, 1.0), run)?;
    for part in large {
        let alone = Patch::whole(part.mesh, part.polygon);
        let (more, rungs) = charts(&alone, &part.faces, settings, charted, run)?;
        charting.rungs.add(&rungs);
        charting.family.extend(more.iter().map(|_| None));
        charting.charts.extend(more);
    }
    Ok(charting)
}

/// Charts joined along parts of their borders, and their cuts closed from their ends on.
fn joined_and_closed(
    fine: Whole<'_>,
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let charts = fine.join_partly(charts, settings, rungs, run)?;
    fine.close(charts, settings, rungs, run)
}

/// Names the faces of charts of a component as they are named on the surface.
fn rename(charts: &mut [Chart], faces: &[FaceId]) {
    for f in charts.iter_mut().flat_map(|c| &mut c.patch.faces) {
        *f = faces[f.index()];
    }
}
