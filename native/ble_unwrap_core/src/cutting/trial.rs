//! What becomes of an edit: the patches that it makes, flattened.

use nalgebra::Point2;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{self, Polished, Positions, Rungs};
use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::settings::Settings;

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
    let mut charts = Vec::new();
    for patch in proposal.edit.patches(cutting) {
        // An embedding cuts what has no chart's topology; where faces lie already, nothing does.
        if !matches!(proposal.start, Start::Anew) && !attempt::may_be_chart(patch.mesh.topology(), settings) {
            return Ok(Verdict::Refused);
        }
        match flattened(cutting, patch, &proposal.start, settings, rungs, run)? {
            Verdict::Charts(made) => charts.extend(made),
            refused => return Ok(refused),
        }
    }
    Ok(Verdict::Charts(charts))
}

/// A patch as one chart.
fn flattened(
    cutting: &Cutting<'_>,
    patch: Patch,
    start: &Start,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Verdict, Cancelled> {
    let polished = match start {
        Start::Anew => {
            let chart = attempt::as_one(&patch, settings, rungs, run)?;
            return Ok(chart.map_or(Verdict::Refused, |chart| Verdict::Charts(vec![chart])));
        }
        Start::Embedded => {
            let chart = attempt::embedded(&patch, settings, rungs, run)?;
            return Ok(chart.map_or(Verdict::Refused, |chart| Verdict::Charts(vec![chart])));
        }
        Start::Glued(moved) => flattening::sewn(&patch, &drawn(cutting, &patch, *moved), settings, rungs, run)?,
        Start::Lying => flattening::part_of_chart(&patch, positions(cutting, &patch, &[]), settings, rungs, run)?,
        Start::Redrawn(anew) => flattening::lying(&patch, positions(cutting, &patch, anew), settings),
    };
    Ok(match polished {
        Polished::Flat(flat) => Verdict::Charts(vec![flat.into_chart(patch)]),
        Polished::Refused => Verdict::Refused,
        Polished::BadStart => Verdict::BadStart,
    })
}

/// Where the corners of a patch's faces lie, those of one chart after a motion.
fn drawn(cutting: &Cutting<'_>, patch: &Patch, moved: Option<(ChartId, Motion)>) -> Vec<Corners> {
    let draw = |f: &FaceId| {
        let corners = cutting.corners(*f);
        match moved {
            Some((id, by)) if cutting.owner(*f) == Some(id) => corners.map(|p| by.apply(p)),
            _ => corners,
        }
    };
    patch.faces.iter().map(draw).collect()
}

/// Where the vertices of a patch lie, of which some faces, in ascending order, are drawn anew.
pub(super) fn positions(cutting: &Cutting<'_>, patch: &Patch, anew: &[(FaceId, Corners)]) -> Positions {
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
