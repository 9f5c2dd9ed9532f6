//! One chart to the plane: landmarks, distances along the graph, the paper's embedding, relaxation, judgement.

use nalgebra::{Point2, Vector3};

use crate::embedding::{self, EmbeddingError};
use crate::geodesics::{DijkstraScratch, LandmarkDistances, WeightedGraph, dijkstra};
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};
use crate::segmentation::SpectralAnalysis;
use crate::settings::Settings;

use super::local_map::{Offset, Offsets, Stretch, measure};
use super::overlap::overlapping_pairs;
use super::relax::relax;
use super::sample::{Sample, principal_axes};

/// Charts of fewer nodes are projected, whatever comes of it: they are no surface that could be cut further.
pub(super) const LEAST_NODES: usize = 8;
/// A chart whose nodes leave their plane by no more than this share of its extent is projected, exactly.
const FLAT: f64 = 1e-9;
/// Charts less planar than this are split before any embedding, as for meshes.
const LEAST_PLANARITY: f64 = 0.6;
/// An embedding folded over more of its area is near no flat map.
const MOST_FOLDED: f64 = 0.25;
/// One hundredth of the area must not be stretched by more than this.
const MOST_P99_STRETCH: f64 = 4.0;

/// What became of a chart.
pub(super) enum Outcome {
    /// It is flat enough, or cannot be cut further.
    Flat(Flat),
    /// It must be split; the distances say where.
    Split(LandmarkDistances, SpectralAnalysis),
    /// It must be split, and the distances do not say where.
    Halve,
}

/// A chart in the plane, upright, at the area of its surface.
#[derive(Clone, Debug)]
pub(super) struct Flat {
    /// A position a node.
    pub(super) uv: Vec<Point2<f64>>,
    /// How it was found: `plane`, `embedding` or `projection`.
    pub(super) rung: &'static str,
    /// Landmarks and sweeps of its embedding.
    pub(super) landmarks: usize,
    pub(super) sweeps: usize,
}

/// Flattens a connected sample under the stretch limit, or tells that it has to be split.
pub(super) fn flatten(
    sample: &Sample,
    limit: f64,
    seed: u64,
    settings: &Settings,
    progress: &Progress,
) -> Result<Outcome, Cancelled> {
    progress.check()?;
    let [along, across, normal] = principal_axes(|| sample.position.iter().copied().zip(sample.area.iter().copied()));
    if is_flat(sample, &along, &normal) {
        return Ok(Outcome::Flat(project(sample, [along, across], "plane")));
    }
    if sample.len() < LEAST_NODES {
        return Ok(Outcome::Flat(project(sample, [along, across], "projection")));
    }
    let distances = landmark_distances(&sample.graph, settings.geodesics.landmark_count(sample.len()), progress)?;
    let analysis = SpectralAnalysis::new(&distances)?;
    if analysis.planarity < LEAST_PLANARITY {
        return Ok(Outcome::Split(distances, analysis));
    }
    let embedded = match embedding::embed_chart(&distances, &settings.embedding, seed, progress) {
        Ok(embedded) => embedded,
        Err(EmbeddingError::Cancelled(cancelled)) => return Err(cancelled),
        Err(_) => return Ok(Outcome::Halve),
    };
    let offsets = Offsets::new(sample, Offset::Unbent);
    let mut uv = embedded.uv;
    let start = measure(&offsets, &sample.area, &uv);
    if start.folded_share > MOST_FOLDED || !uv.iter().all(|p| p.coords.iter().all(|x| x.is_finite())) {
        return Ok(Outcome::Split(distances, analysis));
    }
    standard_pose(&start, &mut uv);
    relax(&offsets, &sample.area, &mut uv, progress)?;
    let stretch = measure(&offsets, &sample.area, &uv);
    standard_pose(&stretch, &mut uv);
    let good = stretch.l2 <= limit && stretch.p99 <= MOST_P99_STRETCH && stretch.folded.is_empty();
    if good && !overlaps(sample, &uv) {
        let (landmarks, sweeps) = (embedded.landmarks, embedded.sweeps);
        return Ok(Outcome::Flat(Flat { uv, rung: "embedding", landmarks, sweeps }));
    }
    Ok(Outcome::Split(distances, analysis))
}

/// Whether a sample lies in a plane, as far as rounding tells.
pub(super) fn is_plane(sample: &Sample) -> bool {
    let [along, _, normal] = principal_axes(|| sample.position.iter().copied().zip(sample.area.iter().copied()));
    is_flat(sample, &along, &normal)
}

/// Whether the nodes lie in a plane with this normal, as far as rounding tells.
fn is_flat(sample: &Sample, along: &Vector3<f64>, normal: &Vector3<f64>) -> bool {
    let extent = |axis: &Vector3<f64>| {
        let at = |f: fn(f64, f64) -> f64, start| sample.position.iter().map(|p| axis.dot(&p.coords)).fold(start, f);
        at(f64::max, f64::NEG_INFINITY) - at(f64::min, f64::INFINITY)
    };
    extent(normal) <= FLAT * extent(along)
}

/// The nodes on a plane, side by side; scaled to the area of the surface where that is known.
fn project(sample: &Sample, axes: [Vector3<f64>; 2], rung: &'static str) -> Flat {
    let origin = sample.position[0];
    let mut uv: Vec<Point2<f64>> =
        sample.position.iter().map(|p| Point2::new(axes[0].dot(&(p - origin)), axes[1].dot(&(p - origin)))).collect();
    if rung != "plane" {
        standard_pose(&measure(&Offsets::new(sample, Offset::Unbent), &sample.area, &uv), &mut uv);
    }
    Flat { uv, rung, landmarks: 0, sweeps: 0 }
}

/// Mirrors a chart that lies on its back, and brings it to the area of its surface.
fn standard_pose(stretch: &Stretch, uv: &mut [Point2<f64>]) {
    let scale = stretch.scale();
    let side = if stretch.mirrored { -scale } else { scale };
    for p in uv {
        *p = Point2::new(side * p.x, scale * p.y);
    }
}

fn overlaps(sample: &Sample, uv: &[Point2<f64>]) -> bool {
    let spacing: Vec<f64> = sample.area.iter().map(|a| a.sqrt()).collect();
    !overlapping_pairs(uv, &sample.position, &spacing, 1.0, |_| 0).is_empty()
}

/// Landmarks by farthest-point sampling along the graph, and the distances from them to all nodes. The first is the
/// node farthest from the lowest one. Serial: charts run in parallel. O(k n log n).
pub(super) fn landmark_distances(
    graph: &WeightedGraph,
    count: usize,
    progress: &Progress,
) -> Result<LandmarkDistances, Cancelled> {
    let n = graph.node_count();
    let mut scratch = DijkstraScratch::default();
    let farthest = |distance: &[f64]| {
        let mut best = (0.0, None);
        for (v, &d) in distance.iter().enumerate() {
            if d > best.0 && d.is_finite() {
                best = (d, Some(v));
            }
        }
        best.1
    };
    let mut next = farthest(dijkstra(graph, &[(0, 0.0)], &mut scratch, progress)?);
    let mut cover = vec![f64::INFINITY; n];
    let (mut landmarks, mut rows) = (Vec::with_capacity(count), Vec::with_capacity(count * n));
    while let Some(v) = next.filter(|_| landmarks.len() < count) {
        landmarks.push(VertexId::new(v));
        let row = dijkstra(graph, &[(v, 0.0)], &mut scratch, progress)?;
        rows.extend(row.iter().map(|&d| d as f32));
        cover.iter_mut().zip(row).for_each(|(c, &d)| *c = c.min(d));
        next = farthest(&cover);
    }
    Ok(LandmarkDistances::new(landmarks, n, rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::local_map::tests::sheet;
    use nalgebra::Point3;

    fn run(sample: &Sample) -> Outcome {
        flatten(sample, 1.1, 0, &Settings::default(), &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn a_tilted_plane_is_kept_exactly() {
        let (sample, plane) = sheet(15, |x, y| Point3::new(0.6 * x, 0.8 * x, y));
        let Outcome::Flat(flat) = run(&sample) else { panic!("a plane is flat") };
        assert_eq!(flat.rung, "plane");
        for (a, b) in [(0, 224), (7, 100), (30, 31)] {
            let (there, here) = ((flat.uv[a] - flat.uv[b]).norm(), (plane[a] - plane[b]).norm());
            assert!((there - here).abs() < 1e-12);
        }
    }

    #[test]
    fn half_a_cylinder_unrolls_and_a_sphere_does_not() {
        let (sample, plane) = sheet(40, |x, y| Point3::new((1.5 * x).sin() / 1.5, (1.5 * x).cos() / 1.5, y));
        let Outcome::Flat(flat) = run(&sample) else { panic!("developable") };
        let l2 = measure(&Offsets::new(&sample, Offset::Unbent), &sample.area, &flat.uv).l2;
        assert!(l2 < 1.000_1 && flat.landmarks == 48, "{l2}");
        let (there, here) = ((flat.uv[0] - flat.uv[1599]).norm(), (plane[0] - plane[1599]).norm());
        assert!((there / here - 1.0).abs() < 1e-3, "{there} {here}");
        let (sphere, _) = sheet(30, |x, y| {
            let (angle, z) = (std::f64::consts::PI * x * 29.0 / 30.0, y);
            let r = (1.0f64 - z * z).max(0.0).sqrt();
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        });
        assert!(matches!(run(&sphere), Outcome::Split(..)));
    }

    #[test]
    fn landmarks_cover_the_graph() {
        let (sample, _) = sheet(20, |x, y| Point3::new(x, y, 0.0));
        let distances = landmark_distances(&sample.graph, 30, &Progress::new()).expect("not cancelled");
        assert_eq!(distances.len(), 30);
        let cover = |v: usize| (0..30).map(|l| distances.get(l, VertexId::new(v))).fold(f64::INFINITY, f64::min);
        assert!((0..400).all(|v| cover(v) < 0.5));
        let line = WeightedGraph::from_edges(3, [(0, 1, 1.0), (1, 2, 0.0)]);
        let two = landmark_distances(&line, 3, &Progress::new()).expect("not cancelled");
        assert_eq!(two.len(), 2, "coincident nodes need one landmark");
    }
}
