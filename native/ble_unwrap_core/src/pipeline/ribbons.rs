//! Charts too long for the texture, cut across.
//!
//! A ring or a coil unrolls to a ribbon: one chart, hardly stretched, and a texture as long as the ribbon is all but empty.
//! A few cuts across it, each as short as the ribbon is narrow, let the texture be filled.

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

/// A chart that by its length alone keeps the atlas from filling this share of the texture is cut,
const LEAST_FILL: f64 = 0.25;
/// and so are its parts until they let it fill this, as far as length goes.
const GOOD_FILL: f64 = 0.6;
/// The cut runs in so much of the length around the middle.
const MIDDLE: [f64; 2] = [0.4, 0.6];
/// Directions in which length is measured.
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
    let (width, height) = (f64::from(settings.packing.width), f64::from(settings.packing.height));
    let area: f64 = charts.iter().map(|c| c.patch.area()).sum();
    // A chart as long as the texture's diagonal.
    let longest = |fill: f64| (area * (width * width + height * height) / (width * height * fill)).sqrt();
    let (too_long, good) = (longest(LEAST_FILL), longest(GOOD_FILL));
    let mut done = Vec::new();
    for chart in charts {
        progress.check()?;
        if length(&chart.uv).0 <= too_long {
            done.push(chart);
            continue;
        }
        let mut open = vec![(chart, 0)];
        while let Some((chart, cuts)) = open.pop() {
            let (length, along) = length(&chart.uv);
            if length <= good || cuts == MOST_CUTS {
                done.push(chart);
                continue;
            }
            match halves(&chart, along, settings, rungs, progress)? {
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

/// The greatest extent of points, and the direction of it.
fn length(uv: &[Point2<f64>]) -> (f64, Vector2<f64>) {
    let extent = |k: usize| {
        let angle = PI * k as f64 / DIRECTIONS as f64;
        let along = Vector2::new(angle.cos(), angle.sin());
        let (low, high) = range(uv, along);
        (high - low, along)
    };
    (0..DIRECTIONS).map(extent).fold((0.0, Vector2::x()), |best, next| if next.0 > best.0 { next } else { best })
}

fn range(uv: &[Point2<f64>], along: Vector2<f64>) -> (f64, f64) {
    uv.iter()
        .map(|p| p.coords.dot(&along))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
}

/// A chart cut across near the middle of its length; `None` where that is impossible or takes a part over the limit.
fn halves(
    chart: &Chart,
    along: Vector2<f64>,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Option<Vec<Chart>>, Cancelled> {
    let (patch, uv) = (&chart.patch, &chart.uv);
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
    use super::*;
    use crate::Progress;
    use crate::mesh::test_surfaces;
    use crate::stretch;

    fn sheet(length: usize) -> Chart {
        let mesh = test_surfaces::grid(length, 2, [length as f64, 2.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let patch = Patch::components(&mesh, &polygon).remove(0);
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
        let patch = Patch::components(&mesh, &polygon).remove(0);
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        assert_eq!(cut_up(vec![sheet(80), Chart { patch, uv, l2: 1.0 }]).len(), 2);
    }
}
