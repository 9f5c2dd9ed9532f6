//! Charts that break a rule after rounding, made anew.

use std::collections::BTreeSet;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::cutting::{self, Price};
use crate::flattening::{self, Rung, Rungs};
use crate::mesh::{FaceId, Surface};
use crate::progress::Cancelled;
use crate::segmentation;
use crate::settings::Settings;

/// From this round on a faulty chart comes apart into single polygons, which always do.
const LAST_RESORT: usize = 9;

/// What the checks of one round found.
pub(super) struct Faults<'a> {
    /// The number of the round, from 1.
    pub(super) round: usize,
    /// Charts that break a rule.
    pub(super) faulty: &'a BTreeSet<usize>,
    /// Faces that rounding turned over, with their chart.
    pub(super) broken: &'a [(usize, FaceId)],
}

/// Polygons with broken faces become charts of their own, thickened if they are already. A chart that
/// overlaps itself after rounding is flattened anew with its boundary held apart, or halved. What is
/// left of a chart is flattened anew.
pub(super) fn mend(
    surface: &Surface,
    charts: Vec<Chart>,
    faults: &Faults<'_>,
    rungs: &mut Rungs,
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let mut separate: Vec<(usize, u32)> =
        faults.broken.iter().map(|&(chart, face)| (chart, surface.polygon[face.index()])).collect();
    separate.sort_unstable();
    separate.dedup();
    let mut kept = Vec::new();
    let mut again = Vec::new();
    for (number, chart) in charts.into_iter().enumerate() {
        let first = separate.partition_point(|s| s.0 < number);
        let mut broken: Vec<u32> = separate[first..].iter().take_while(|s| s.0 == number).map(|s| s.1).collect();
        if broken.is_empty() && !faults.faulty.contains(&number) {
            kept.push(chart);
            continue;
        }
        if chart.patch.is_one_polygon() {
            rungs.take(Rung::Thicken);
            kept.push(flattening::thicken(&chart.patch, faults.round > 2).into_chart(chart.patch));
            continue;
        }
        if broken.is_empty()
            && faults.round == 1
            && let Some(flat) = flattening::flatten_apart(&chart.patch, settings, rungs, run)?
        {
            kept.push(flat.into_chart(chart.patch));
            continue;
        }
        let patch = Patch::of_surface(&surface.mesh, &surface.polygon, sorted(&chart.patch.faces));
        if faults.round >= LAST_RESORT {
            broken.clone_from(&patch.polygon);
            broken.sort_unstable();
            broken.dedup();
        }
        if broken.is_empty() {
            rungs.take(Rung::Bisect);
            let halves = segmentation::bisect(&patch.mesh, &patch.polygon);
            again.extend(patch.split(&halves.label, halves.parts));
        } else {
            rungs.take(Rung::Separate);
            let own = |p: &u32| broken.binary_search(p).map_or(0, |i| u32::try_from(i + 1).unwrap_or(u32::MAX));
            let label: Vec<u32> = patch.polygon.iter().map(own).collect();
            for part in patch.split(&label, broken.len() + 1).iter().filter(|p| !p.faces.is_empty()) {
                let (component, count) = part.mesh.components();
                again.extend(part.split(&component, count));
            }
        }
    }
    let redone = cutting::divide(again, &Price::new(&surface.mesh, settings), settings, &|_| (), run)?;
    rungs.add(&redone.rungs);
    kept.extend(redone.charts);
    kept.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok(kept)
}

fn sorted(faces: &[FaceId]) -> Vec<FaceId> {
    let mut faces = faces.to_vec();
    faces.sort_unstable();
    faces
}
