//! A patch split: at its hard edges where the parts unroll, else by spectral segmentation, and at last in half.

use std::sync::Arc;

use crate::cache::{Fingerprint, Kind, Run};
use crate::charts::Patch;
use crate::flattening::{Rung, Rungs};
use crate::progress::Cancelled;
use crate::segmentation::{self, Segmentation};
use crate::settings::{Moves, Settings};

use super::super::measured::Measured;

/// Spectral splits that deep have not helped; halving by breadth-first order always ends.
const MOST_SPECTRAL_SPLITS: u32 = 24;
/// A patch that is split comes apart at its hard edges where parts that unroll have at least this share of its area.
const MOSTLY_UNROLLED: f64 = 0.9;

/// Share of the area that unrolls where all of it does. A little is left to rounding.
const ALL: f64 = 1.0 - 1e-6;

/// The parts of a patch between its hard edges, if all of them unroll: a cylinder's wall and its caps. Not in the paper's presets.
pub(crate) fn unrolling_parts(patch: &Patch, settings: &Settings) -> Option<Vec<Patch>> {
    hard_parts(patch, ALL, settings)
}

/// The parts of a patch between its hard edges, if those that unroll have at least a share of its area, and not in the paper's
/// presets.
fn hard_parts(patch: &Patch, least_share: f64, settings: &Settings) -> Option<Vec<Patch>> {
    if settings.moves != Moves::All {
        return None;
    }
    let parts = segmentation::between_hard_edges(&patch.mesh, &patch.polygon, least_share)?;
    Some(patch.split(&parts.label, parts.parts))
}

/// The parts of a patch that is known not to be one chart and that is not one polygon; `splits` tells how often the patch that
/// it comes from was split, and is 0 for a component. Each part has fewer polygons.
pub(crate) fn split(
    measured: &Measured<'_>,
    splits: u32,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Patch>, Cancelled> {
    let patch = measured.patch;
    if let Some(parts) = hard_parts(patch, MOSTLY_UNROLLED, settings) {
        rungs.take(Rung::Split);
        return Ok(parts);
    }
    let parts = if splits < MOST_SPECTRAL_SPLITS {
        rungs.take(Rung::Split);
        spectral_parts(measured, splits == 0, settings, run)?
    } else {
        rungs.take(Rung::Bisect);
        Arc::new(segmentation::bisect(&patch.mesh, &patch.polygon))
    };
    Ok(patch.split(&parts.label, parts.parts))
}

fn spectral_parts(
    measured: &Measured<'_>,
    is_component: bool,
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Arc<Segmentation>, Cancelled> {
    let (patch, cuts) = (measured.patch, &settings.segmentation);
    let (distances, analysis) = measured.analysis()?;
    let input = |f: &mut Fingerprint| {
        f.mesh(&patch.mesh);
        f.numbers(&patch.polygon);
        f.distances(distances);
        f.indices([usize::from(is_component)]);
        f.settings(cuts);
    };
    let bytes = |s: &Segmentation| 4 * s.label.len();
    let segment =
        || segmentation::segment(&patch.mesh, &patch.polygon, distances, analysis, is_component, cuts, run.progress);
    run.recall(Kind::Segments, input, bytes, segment)
}
