//! Components that are like others, which get copies of their charts: hundreds of bolts take the time of one, and are unwrapped alike.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{FaceId, Groups, Likeness, Shape};
use crate::progress::{Cancelled, Progress};
use crate::settings::{LimitOver, Moves, Settings};

use super::copied::copied;
use super::state::Cutting;

/// Charting components of fewer faces takes no longer than comparing them.
const LEAST_FACES: usize = 8;
/// A component is compared with so many others at most that look the same by their numbers.
const MOST_COMPARED: usize = 8;

/// A component that is like another one.
pub(super) struct Twin {
    /// The other, which is like none before it.
    pub(super) original: usize,
    /// Of the original to this one.
    likeness: Likeness,
}

/// For each component the one before it that it is like, if any. `whole` gives a component as a patch of itself. O(n log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(super) fn twins(
    components: &Groups<FaceId>,
    whole: &(impl Fn(usize) -> Patch + Sync),
    settings: &Settings,
    progress: &Progress,
) -> Result<Vec<Option<Twin>>, Cancelled> {
    let mut twins: Vec<Option<Twin>> = (0..components.len()).map(|_| None).collect();
    // Under a limit over the atlas charts of different components share it, and the paper knows of no copies.
    if settings.moves < Moves::All || settings.limit_over == LimitOver::Atlas {
        return Ok(twins);
    }
    let mut by_size: HashMap<usize, Vec<usize>> = HashMap::new();
    for component in (0..components.len()).filter(|&c| components.group(c).len() >= LEAST_FACES) {
        by_size.entry(components.group(component).len()).or_default().push(component);
    }
    let groups: Vec<Vec<usize>> = by_size.into_values().filter(|group| group.len() > 1).collect();
    let found: Vec<Result<Vec<(usize, Twin)>, Cancelled>> =
        groups.par_iter().map(|group| twins_among(group, whole, progress)).collect();
    for group in found {
        for (component, twin) in group? {
            twins[component] = Some(twin);
        }
    }
    Ok(twins)
}

/// Twins among components of the same number of faces, ascending.
fn twins_among(
    group: &[usize],
    whole: &impl Fn(usize) -> Patch,
    progress: &Progress,
) -> Result<Vec<(usize, Twin)>, Cancelled> {
    let mut originals: Vec<(usize, Patch)> = Vec::new();
    let mut twins = Vec::new();
    for &component in group {
        let patch = whole(component);
        let Some(shape) = Shape::new(&patch.mesh, &patch.polygon) else { continue };
        let mut found = None;
        for (original, other) in &originals {
            let Some(other) = Shape::new(&other.mesh, &other.polygon) else { continue };
            for is_mirrored in [true, false] {
                found = found.or(other.likeness(&shape, is_mirrored, progress)?.map(|likeness| (*original, likeness)));
            }
            if found.is_some() {
                break;
            }
        }
        match found {
            Some((original, likeness)) => twins.push((component, Twin { original, likeness })),
            None if originals.len() < MOST_COMPARED => originals.push((component, patch)),
            None => (),
        }
    }
    Ok(twins)
}

impl Twin {
    /// Copies of the original's charts. Each component comes as a patch of itself with the names of its faces on the surface, ascending, by
    /// which those of the charts go. `None` where a chart does not lie on this component as well.
    pub(super) fn charts(
        &self,
        original: (&Patch, &[FaceId]),
        charts: &[Chart],
        own: (&Patch, &[FaceId]),
        settings: &Settings,
        run: &Run<'_>,
    ) -> Result<Option<(Vec<Chart>, Rungs)>, Cancelled> {
        let mut charts = charts.to_vec();
        for f in charts.iter_mut().flat_map(|chart| &mut chart.patch.faces) {
            let Ok(local) = original.1.binary_search(f) else { return Ok(None) };
            *f = FaceId::new(local);
        }
        let cutting = Cutting::new(&original.0.mesh, &original.0.polygon, charts);
        let mut rungs = Rungs::default();
        let mut copies = Vec::new();
        for chart in cutting.ids().filter_map(|id| cutting.chart(id)) {
            let copy = copied(&cutting, chart, own.0, &self.likeness, settings, &mut rungs, run)?;
            let Some(copy) = copy else { return Ok(None) };
            copies.push(copy);
        }
        for f in copies.iter_mut().flat_map(|chart| &mut chart.patch.faces) {
            *f = own.1[f.index()];
        }
        copies.sort_by_key(|chart| chart.patch.faces[0]);
        rungs.take(Rung::Copied);
        Ok(Some((copies, rungs)))
    }
}
