//! What becomes of an edit: the patches that it makes, flattened.

use nalgebra::Point2;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::distortion::RestTriangle;
use crate::flattening::{self, NEGLIGIBLE, Polished, Positions, Rungs};
use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::settings::{Holes, Settings};
use crate::stretch;

use super::attempt;
use super::moves::{Proposal, Start};
use super::rigid_motion::Motion;
use super::state::{ChartId, Corners, Cutting};

/// What came of a trial.
pub(super) enum Verdict {
    /// The charts that take the place of those that the edit changes, all of them injective and under the limit.
    Charts(Vec<Chart>),
    /// Over the limit, or not of a chart's topology.
    Refused,
    /// From where it began there are flips or overlap that cannot be cleared; from elsewhere it may well be a chart.
    BadStart,
}

/// Flattens what an edit makes. O(n log n) in the faces of the charts that it changes, and for most starts a minimisation.
pub(super) fn trial(
    cutting: &Cutting<'_>,
    proposal: &Proposal,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Verdict, Cancelled> {
    run.progress.check()?;
    match &proposal.start {
        Start::Glued(moved) => glued(cutting, proposal, *moved, settings, rungs, run),
        Start::Redrawn(anew) => Ok(redrawn(cutting, proposal, anew, settings)),
        Start::Lying => parts(cutting, proposal, settings, rungs, run),
        Start::Anew => made_anew(cutting, proposal, settings, rungs, run),
    }
}

/// Whether a patch can be a chart.
fn may_be_chart(patch: &Patch, settings: &Settings) -> bool {
    let topology = patch.mesh.topology();
    topology.is_chart() && (settings.holes == Holes::Keep || topology.loops == 1)
}

/// What is glued becomes one chart: what does not meet is spread over its whole map, and the stretch minimised.
fn glued(
    cutting: &Cutting<'_>,
    proposal: &Proposal,
    moved: Option<(ChartId, Motion)>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Verdict, Cancelled> {
    let patches = proposal.edit.patches(cutting);
    let Ok([patch]) = <[Patch; 1]>::try_from(patches) else { return Ok(Verdict::Refused) };
    if !may_be_chart(&patch, settings) {
        return Ok(Verdict::Refused);
    }
    let draw = |f: &FaceId| {
        let corners = cutting.corners(*f);
        match moved {
            Some((id, by)) if cutting.owner(*f) == Some(id) => corners.map(|p| by.apply(p)),
            _ => corners,
        }
    };
    let drawn: Vec<Corners> = patch.faces.iter().map(draw).collect();
    Ok(match flattening::sewn(&patch, &drawn, settings, rungs, run)? {
        Polished::Flat(flat) => Verdict::Charts(vec![flat.into_chart(patch)]),
        Polished::Refused => Verdict::Refused,
        Polished::BadStart => Verdict::BadStart,
    })
}

/// Charts become one that is flattened from nothing, if that makes no seam longer.
fn made_anew(
    cutting: &Cutting<'_>,
    proposal: &Proposal,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Verdict, Cancelled> {
    let before: Vec<&Chart> = proposal.edit.charts(cutting).into_iter().filter_map(|id| cutting.chart(id)).collect();
    let mut faces: Vec<FaceId> = before.iter().flat_map(|chart| chart.patch.faces.iter().copied()).collect();
    faces.sort_unstable();
    let chart = attempt::as_one(&cutting.patch(faces, |_| false), settings, rungs, run)?;
    // Darts may have made more seam than the border was.
    let seams = |chart: &Chart| chart.patch.mesh.boundary_length();
    let shorter = chart.filter(|chart| seams(chart) <= before.iter().map(|chart| seams(chart)).sum());
    Ok(shorter.map_or(Verdict::Refused, |chart| Verdict::Charts(vec![chart])))
}

/// Parts of charts, where they lie if that is under the limit of single charts, and else minimised.
fn parts(
    cutting: &Cutting<'_>,
    proposal: &Proposal,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Verdict, Cancelled> {
    let mut charts = Vec::new();
    for patch in proposal.edit.patches(cutting) {
        if !may_be_chart(&patch, settings) {
            return Ok(Verdict::Refused);
        }
        let start = positions(cutting, &patch, &[]);
        match flattening::part_of_chart(&patch, start, settings, rungs, run)? {
            Some(flat) => charts.push(flat.into_chart(patch)),
            None => return Ok(Verdict::Refused),
        }
    }
    Ok(Verdict::Charts(charts))
}

/// Charts whose faces lie where they lay, but for those drawn anew. Refused where that is not injective or over the limit.
fn redrawn(cutting: &Cutting<'_>, proposal: &Proposal, anew: &[(FaceId, Corners)], settings: &Settings) -> Verdict {
    let lying = |patch: Patch| {
        if !may_be_chart(&patch, settings) {
            return None;
        }
        let (mesh, uv) = (&patch.mesh, positions(cutting, &patch, anew));
        if stretch::first_flip(mesh, &uv).is_some() || !stretch::boundary_is_simple(mesh, &uv) {
            return None;
        }
        let l2 = stretch::l2_of_positions(mesh, &uv, NEGLIGIBLE);
        let is_good = l2 <= settings.stretch_limit && flattening::is_sharp(mesh, &RestTriangle::of_mesh(mesh), &uv);
        is_good.then_some(Chart { patch, uv, l2 })
    };
    let charts: Option<Vec<Chart>> = proposal.edit.patches(cutting).into_iter().map(lying).collect();
    charts.map_or(Verdict::Refused, Verdict::Charts)
}

/// Where the vertices of a patch lie, of which some faces, in ascending order, are drawn anew.
fn positions(cutting: &Cutting<'_>, patch: &Patch, anew: &[(FaceId, Corners)]) -> Positions {
    let mut uv = vec![Point2::origin(); patch.mesh.vertex_count()];
    let redrawn = |f: &FaceId| anew.binary_search_by_key(f, |d| d.0).ok().map(|at| anew[at].1);
    let mut put = |is_anew: bool| {
        for (f, vertices) in patch.faces.iter().zip(patch.mesh.triangles()) {
            let corners = redrawn(f);
            if corners.is_some() == is_anew {
                let corners = corners.unwrap_or_else(|| cutting.corners(*f));
                vertices.iter().zip(corners).for_each(|(v, p)| uv[v.index()] = p);
            }
        }
    };
    // What has been there stays, so it comes last.
    put(true);
    put(false);
    uv
}
