//! Charts too long for the texture, cut across.
//!
//! A ring or a coil unrolls to a ribbon, a frame to a spider: one chart, hardly stretched, and a texture large enough to hold
//! it is all but empty. A few cuts across, each as short as the chart is narrow there, let the texture be filled.

use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};

use crate::charts::{Chart, Patch};
use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::segmentation;
use crate::settings::{Holes, Settings};

use super::flatten;
use super::memo::Run;
use super::rungs::{Rung, Rungs};

/// A chart is cut if a texture that holds it, whatever its turn, can be filled to no more than this share by all charts,
const LEAST_FILL: f64 = 0.25;
/// and so are its parts, until it can be filled to this.
const GOOD_FILL: f64 = 0.6;
/// The cut runs in so much of the length around the middle.
const MIDDLE: [f64; 2] = [0.4, 0.6];
/// Turns tried, of a half one.
const DIRECTIONS: usize = 24;
/// Cuts in two, one after the other, that a part comes out of at most.
const MOST_CUTS: usize = 6;

/// The charts, with those cut across that are too long for the texture of `settings`. All parts stay under the limit, and
/// lie where they lay in their chart but for what that takes. Sorted by lowest face. O(n log n).
pub(super) fn cut(
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let area: f64 = charts.iter().map(|c| c.patch.area()).sum();
    let texture = [settings.packing.width, settings.packing.height].map(f64::from);
    let most_filled = |uv: &[Point2<f64>]| area / (texture[0] * texture[1] * hold(uv, texture).powi(2));
    let mut done = Vec::new();
    for chart in charts {
        progress.check()?;
        if most_filled(&chart.uv) > LEAST_FILL {
            done.push(chart);
            continue;
        }
        let mut open = vec![(chart, 0)];
        while let Some((chart, cuts)) = open.pop() {
            if most_filled(&chart.uv) > GOOD_FILL || cuts == MOST_CUTS {
                done.push(chart);
                continue;
            }
            match halves(&chart, settings, rungs, progress)? {
                Some(parts) => {
                    rungs.take(Rung::Split);
                    open.extend(parts.into_iter().map(|part| (part, cuts + 1)));
                }
                None => done.push(chart),
            }
        }
    }
    done.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok(done)
}

/// By how much a texture of this width and height must be enlarged to hold points, turned as suits them best.
fn hold(uv: &[Point2<f64>], [width, height]: [f64; 2]) -> f64 {
    directions()
        .map(|along| {
            let across = Vector2::new(-along.y, along.x);
            (extent(uv, along) / width).max(extent(uv, across) / height)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The direction in which points extend furthest.
fn longest(uv: &[Point2<f64>]) -> Vector2<f64> {
    let further = |best: (f64, Vector2<f64>), along| {
        let extent = extent(uv, along);
        if extent > best.0 { (extent, along) } else { best }
    };
    directions().fold((0.0, Vector2::x()), further).1
}

fn directions() -> impl Iterator<Item = Vector2<f64>> {
    (0..DIRECTIONS).map(|k| PI * k as f64 / DIRECTIONS as f64).map(|angle| Vector2::new(angle.cos(), angle.sin()))
}

fn extent(uv: &[Point2<f64>], along: Vector2<f64>) -> f64 {
    let (low, high) = range(uv, along);
    high - low
}

fn range(uv: &[Point2<f64>], along: Vector2<f64>) -> (f64, f64) {
    uv.iter()
        .map(|p| p.coords.dot(&along))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
}

/// A chart cut across near the middle of its length; `None` where that is impossible or takes a part over the limit.
fn halves(
    chart: &Chart,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Option<Vec<Chart>>, Cancelled> {
    let (patch, uv) = (&chart.patch, &chart.uv);
    let along = longest(uv);
    let (low, high) = range(uv, along);
    let at = |f: &FaceId| {
        let sum: f64 = patch.mesh.triangle(*f).iter().map(|v| uv[v.index()].coords.dot(&along)).sum();
        (sum / 3.0 - low) / (high - low)
    };
    let ends: [Vec<FaceId>; 2] = [
        patch.mesh.faces().filter(|f| at(f) < MIDDLE[0]).collect(),
        patch.mesh.faces().filter(|f| at(f) > MIDDLE[1]).collect(),
    ];
    let crease_weight = settings.segmentation.crease_weight;
    let parts = segmentation::between(&patch.mesh, &patch.polygon, [&ends[0], &ends[1]], crease_weight, progress)?;
    let Some(parts) = parts else { return Ok(None) };
    let mut charts = Vec::new();
    for (part, start) in with_positions(patch, uv, &parts.label, parts.parts) {
        let topology = part.mesh.topology();
        if !topology.is_chart() || (settings.holes != Holes::Keep && topology.loops > 1) {
            return Ok(None);
        }
        match flatten::part_of_chart(&part, start, settings, rungs, progress)? {
            Some(flat) => charts.push(flat.into_chart(part)),
            None => return Ok(None),
        }
    }
    Ok(Some(charts))
}

/// The parts of a patch by label, each with the positions of its vertices.
fn with_positions(
    patch: &Patch,
    uv: &[Point2<f64>],
    label: &[u32],
    count: usize,
) -> impl Iterator<Item = (Patch, Vec<Point2<f64>>)> {
    let mut faces = vec![Vec::new(); count];
    for (f, label) in patch.mesh.faces().zip(label) {
        faces[*label as usize].push(f);
    }
    patch.split(label, count).into_iter().zip(faces).map(|(part, faces)| {
        let mut own = vec![Point2::origin(); part.mesh.vertex_count()];
        for (corners, f) in part.mesh.triangles().iter().zip(faces) {
            for (v, w) in corners.iter().zip(patch.mesh.triangle(f)) {
                own[v.index()] = uv[w.index()];
            }
        }
        (part, own)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::Progress;
    use crate::mesh::test_surfaces;
    use crate::stretch;

    fn sheet(length: usize) -> Chart {
        let mesh = test_surfaces::grid(length, 2, [length as f64, 2.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let patch = Patch::whole(Arc::new(mesh), polygon);
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        Chart { patch, uv, l2: 1.0 }
    }

    fn cut_up(charts: Vec<Chart>) -> Vec<Chart> {
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        cut(charts, &Settings::default(), &mut Rungs::default(), &run).expect("not cancelled")
    }

    #[test]
    fn a_ribbon_is_cut_into_a_few_straight_across() {
        let parts = cut_up(vec![sheet(80)]);
        assert!((3..=6).contains(&parts.len()), "{}", parts.len());
        let area: f64 = parts.iter().map(|c| c.patch.area()).sum();
        assert!((area - 160.0).abs() < 1e-9);
        for part in &parts {
            assert!(part.l2 < 1.0 + 1e-9 && stretch::boundary_is_simple(&part.patch.mesh, &part.uv));
            let mesh = &part.patch.mesh;
            let around: f64 = mesh.halfedges().filter(|&h| mesh.is_boundary(h)).map(|h| mesh.edge_length(h)).sum();
            let straight = part.patch.area() + 4.0;
            assert!((around - straight).abs() < 1e-9, "{around} {straight}: two ends of two edges each");
        }
    }

    #[test]
    fn what_is_short_or_small_beside_others_stays() {
        assert_eq!(cut_up(vec![sheet(10)]).len(), 1);
        let mesh = test_surfaces::grid(10, 10, [60.0, 60.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let patch = Patch::whole(Arc::new(mesh), polygon);
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        assert_eq!(cut_up(vec![sheet(80), Chart { patch, uv, l2: 1.0 }]).len(), 2);
    }
}
