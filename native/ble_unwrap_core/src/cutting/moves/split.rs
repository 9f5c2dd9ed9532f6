//! A patch split: at its hard edges where the parts unroll, else by spectral segmentation, and at last in half.

use std::sync::Arc;

use crate::cache::{Fingerprint, Kind, Run};
use crate::charts::Patch;
use crate::flattening::{Rung, Rungs};
use crate::progress::Cancelled;
use crate::segmentation::{self, Segmentation};
use crate::settings::Settings;

use super::super::measured::Measured;

/// Spectral splits that deep have not helped; halving by breadth-first order always ends.
const MOST_SPECTRAL_SPLITS: u32 = 24;

/// The unrolling parts of a patch between its hard edges and what is left of it; `None` where it has nothing to come apart.
pub(crate) fn hard_parts(patch: &Patch) -> Option<Vec<Patch>> {
    let parts = segmentation::between_parts(&patch.mesh)?;
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
    if let Some(parts) = hard_parts(patch) {
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
