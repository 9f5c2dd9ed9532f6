//! Charts too long for the texture, cut across.
//!
//! A ring or a coil unrolls to a ribbon, a frame to a spider: one chart, hardly stretched, and a texture large enough to hold
//! it is all but empty. A few cuts across, each as short as the chart is narrow there, let the texture be filled.

use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};

use crate::charts::{Chart, Patch};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Cancelled;
use crate::segmentation;
use crate::settings::{Holes, Settings};

use super::flatten;
use super::memo::Run;
use crate::flattening::{Rung, Rungs};

/// A chart is cut if a texture that holds it, whatever its turn, can be filled to no more than this share by all charts, or
const LEAST_FILL: f64 = 0.25;
/// than this if it is a body that was cut open, with seams all round: there one more shows less than across a plank. Over 16
/// models 0.25, 0.4 and 0.5 give 3.18, 3.36 and 3.78 charts, seams of 3.20, 3.24 and 3.36 (geometric means), and fill 0.546,
/// 0.567 and 0.584 of the texture.
const LEAST_FILL_OF_BODIES: f64 = 0.4;
/// Share of its boundary along which such a body borders on itself.
const LEAST_SELF_BORDER: f64 = 0.5;
/// Its parts are cut,
/// too, until it can be filled to this.
const GOOD_FILL: f64 = 0.6;
/// The cut runs in so much of the length around the middle.
const MIDDLE: [f64; 2] = [0.4, 0.6];
/// A cut is no longer than so many times the mean width of the chart, its area over its length: a straight one across a strip is
/// as long as that, and one along the sides of a triangulation up to about 1.4 times. What is longer runs along the chart, as
/// the diagonals of triangles do that are as long as the chart itself.
const MOST_CUT: f64 = 1.5;
/// A cut is worth its seam if a texture that holds the parts needs at most this share of the length of one that holds the chart. A cut in
/// the middle of a strip comes to 0.5 to 0.6.
const LEAST_GAIN: f64 = 0.9;
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
        let least = if self_border(&chart) > LEAST_SELF_BORDER { LEAST_FILL_OF_BODIES } else { LEAST_FILL };
        if most_filled(&chart.uv) > least {
            done.push(chart);
            continue;
        }
        let mut open = vec![(chart, 0)];
        while let Some((chart, cuts)) = open.pop() {
            if most_filled(&chart.uv) > GOOD_FILL || cuts == MOST_CUTS {
                done.push(chart);
                continue;
            }
            let largest = LEAST_GAIN * hold(&chart.uv, texture);
            match halves(&chart, settings, rungs, progress)? {
                Some(parts) if parts.iter().all(|part| hold(&part.uv, texture) <= largest) => {
                    rungs.take(Rung::Split);
                    open.extend(parts.into_iter().map(|part| (part, cuts + 1)));
                }
                _ => done.push(chart),
            }
        }
    }
    done.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok(done)
}

/// Share of a chart's boundary where it has been cut open: two sides of the same edge of the surface.
fn self_border(chart: &Chart) -> f64 {
    let (mesh, names) = (&chart.patch.mesh, &chart.patch.vertices);
    let ends = |h: HalfedgeId| {
        let (v, w) = (names[mesh.from(h).index()], names[mesh.to(h).index()]);
        (v.min(w), v.max(w))
    };
    let mut border: Vec<_> = mesh.halfedges().filter(|&h| mesh.is_boundary(h)).map(|h| (ends(h), h)).collect();
    border.sort_unstable();
    let length = |edge: &[((VertexId, VertexId), HalfedgeId)]| edge.iter().map(|e| mesh.edge_length(e.1)).sum::<f64>();
    let cut: f64 = border.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() > 1).map(length).sum();
    cut / length(&border).max(f64::MIN_POSITIVE)
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

/// The direction across which points extend least: along a strip, where the one in which they extend furthest is a diagonal.
fn axis(uv: &[Point2<f64>]) -> Vector2<f64> {
    let narrower = |best: (f64, Vector2<f64>), along: Vector2<f64>| {
        let width = extent(uv, Vector2::new(-along.y, along.x));
        if width < best.0 { (width, along) } else { best }
    };
    directions().fold((f64::INFINITY, Vector2::x()), narrower).1
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

/// A chart cut across near the middle of its length; `None` where that is impossible, takes a part over the limit, or
/// where the cut would be longer than the chart is wide, as it is where no polygon ends near the middle.
fn halves(
    chart: &Chart,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Option<Vec<Chart>>, Cancelled> {
    let (patch, uv) = (&chart.patch, &chart.uv);
    let along = axis(uv);
    let ends = ends(patch, uv, along);
    let crease_weight = settings.segmentation.crease_weight;
    let parts = segmentation::between(&patch.mesh, &patch.polygon, [&ends[0], &ends[1]], crease_weight, progress)?;
    let Some(parts) = parts else { return Ok(None) };
    let mean_width = patch.area() / extent(uv, along);
    if border_length(&patch.mesh, &parts.label) > MOST_CUT * mean_width {
        return Ok(None);
    }
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

/// The faces at either end of a chart, between which it may be cut: those of polygons that lie beyond the middle, or reach into it from
/// there. Polygons that reach over the whole middle are at neither end.
fn ends(patch: &Patch, uv: &[Point2<f64>], along: Vector2<f64>) -> [Vec<FaceId>; 2] {
    let (low, high) = range(uv, along);
    let mut names = patch.polygon.clone();
    names.sort_unstable();
    names.dedup();
    let place = |f: FaceId| names.partition_point(|&name| name < patch.polygon[f.index()]);
    let mut span = vec![[f64::INFINITY, f64::NEG_INFINITY]; names.len()];
    for f in patch.mesh.faces() {
        let [first, last] = &mut span[place(f)];
        for v in patch.mesh.triangle(f) {
            let at = (uv[v.index()].coords.dot(&along) - low) / (high - low);
            (*first, *last) = (first.min(at), last.max(at));
        }
    }
    let [begin, end] = MIDDLE;
    let faces_of =
        |is_wanted: &dyn Fn([f64; 2]) -> bool| patch.mesh.faces().filter(|&f| is_wanted(span[place(f)])).collect();
    [faces_of(&|[first, last]| first < begin && last <= end), faces_of(&|[first, last]| first >= begin && last > end)]
}

/// Length of the border between parts of a mesh.
fn border_length(mesh: &TriMesh, label: &[u32]) -> f64 {
    let parts = |h: HalfedgeId| label[h.face().index()] != label[mesh.twin(h).face().index()];
    mesh.edges().filter(|&h| !mesh.is_boundary(h) && parts(h)).map(|h| mesh.edge_length(h)).sum()
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
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::stretch;
    use nalgebra::Point3;

    fn sheet(length: usize) -> Chart {
        sheet_of(length, 2)
    }

    /// As long as it has cells, and two wide.
    fn sheet_of(length: usize, across: usize) -> Chart {
        strip([length, across], [length as f64, 2.0])
    }

    /// A flat rectangle of so many cells, each two triangles that are polygons of their own.
    fn strip([along, across]: [usize; 2], size: [f64; 2]) -> Chart {
        let mesh = test_surfaces::grid(along, across, size, 0.0);
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
            let around: f64 = boundary_lengths(mesh).iter().sum();
            let straight = part.patch.area() + 4.0;
            assert!((around - straight).abs() < 1e-9, "{around} {straight}: two ends of two edges each");
        }
    }

    #[test]
    fn a_body_cut_open_is_cut_sooner_than_a_sheet_of_its_shape() {
        let sheet = sheet_of(10, 4);
        assert!(self_border(&sheet) == 0.0);
        // A tube of that length, unrolled: its ends are its own border, its sides the two sides of the cut.
        let mut tube = sheet.clone();
        let seam = |p: &Point3<f64>| p.y == 0.0 || p.y == 2.0;
        let name = |(i, p): (usize, &Point3<f64>)| VertexId::new(if seam(p) { 1000 + p.x as usize } else { i });
        tube.patch.vertices = tube.patch.mesh.positions().iter().enumerate().map(name).collect();
        assert!((self_border(&tube) - 20.0 / 24.0).abs() < 1e-9);
        assert_eq!((cut_up(vec![sheet]).len(), cut_up(vec![tube]).len()), (1, 2));
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

    /// Diagonals of triangles as long as the strip are no place for a cut; sides across it are, where there are some.
    #[test]
    fn triangles_as_long_as_the_chart_stay_together() {
        for across in [1, 2, 24] {
            assert_eq!(cut_up(vec![strip([1, across], [30.0, 2.0])]).len(), 1, "{across} across, no side between");
            for along in [2, 3, 5] {
                let parts = cut_up(vec![strip([along, across], [30.0, 2.0])]);
                assert!((2..=along).contains(&parts.len()), "{along} by {across} cells: {} parts", parts.len());
                let around: f64 = parts.iter().flat_map(|c| boundary_lengths(&c.patch.mesh)).sum();
                let straight = 64.0 + 4.0 * (parts.len() - 1) as f64;
                assert!((around - straight).abs() < 1e-9, "{along} by {across} cells: every cut is straight, {around}");
            }
        }
    }

    #[test]
    fn a_cut_that_only_takes_off_an_end_is_not_made() {
        // A side across near one end alone.
        let mut chart = strip([2, 2], [30.0, 2.0]);
        let moved = |p: &Point3<f64>| Point3::new(if p.x == 15.0 { 2.0 } else { p.x }, p.y, p.z);
        let positions: Vec<Point3<f64>> = chart.patch.mesh.positions().iter().map(moved).collect();
        let triangles: Vec<[u32; 3]> =
            chart.patch.mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        chart.uv = mesh.positions().iter().map(|p| p.xy()).collect();
        chart.patch = Patch::whole(Arc::new(mesh), chart.patch.polygon);
        assert_eq!(cut_up(vec![chart]).len(), 1);
    }

    fn boundary_lengths(mesh: &TriMesh) -> Vec<f64> {
        mesh.halfedges().filter(|&h| mesh.is_boundary(h)).map(|h| mesh.edge_length(h)).collect()
    }
}
