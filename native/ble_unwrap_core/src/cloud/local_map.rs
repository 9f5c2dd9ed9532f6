//! The map of a chart near each node: least-squares Jacobians, and the stretch they amount to.
//!
//! A sample has no triangles. What stands in for a triangle's affine map is the linear map that takes the offsets to
//! the neighbours, in the tangent plane, to their offsets in the UV plane with least squared error. With σ₁ ≥ σ₂ its
//! singular values, the squared L2 stretch is ½(1/σ₁² + 1/σ₂²) as for triangles (Sander et al. 2001, section 3), and a
//! chart's L2 is √(ΣaE/Σa · Σa|det J|/Σa), a the areas of the nodes.

use nalgebra::{Matrix2, Point2, Vector2, Vector3};
use rayon::prelude::*;

use crate::distortion;

use super::orientation::orient;
use super::sample::{Sample, tangents};

/// The offsets of a neighbourhood must spread by this share of their longest direction across it, or they lie on a line
/// and tell nothing of the map across.
const LEAST_SPREAD: f64 = 0.03;

/// Which offsets stand for a neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Offset {
    /// As long as the edge: exact where the surface is only bent, up to (distance × curvature)²/24.
    Unbent,
    /// Projected on the tangent plane: noise across it does not count.
    Projected,
}

/// For each node the offsets to its neighbours in its own tangent plane; the planes have one side.
#[derive(Clone, Debug)]
pub(super) struct Offsets {
    first: Vec<u32>,
    to: Vec<u32>,
    offset: Vec<Vector2<f64>>,
    /// Inverse of the second moments Σ x xᵀ, zero where the offsets lie on a line.
    inverse: Vec<Matrix2<f64>>,
}

impl Offsets {
    /// Offsets along the edges of a sample. O(m log n).
    pub(super) fn new(sample: &Sample, kind: Offset) -> Self {
        let mut normal = sample.normal.clone();
        orient(&sample.graph, &mut normal);
        Self::with_normals(sample, &normal, kind)
    }

    /// The same with normals that are oriented already.
    pub(super) fn with_normals(sample: &Sample, normal: &[Vector3<f64>], kind: Offset) -> Self {
        Self::within(sample, normal, kind, |_, _| true)
    }

    /// The same along the edges between nodes that belong `together`.
    pub(super) fn within(
        sample: &Sample,
        normal: &[Vector3<f64>],
        kind: Offset,
        together: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let mut first = Vec::with_capacity(sample.len() + 1);
        first.push(0);
        let (mut to, mut offset, mut inverse) = (Vec::new(), Vec::new(), Vec::with_capacity(sample.len()));
        for i in 0..sample.len() {
            let [a, b] = tangents(&normal[i]);
            let mut moment = Matrix2::zeros();
            for (j, length) in sample.graph.neighbours(i).filter(|&(j, _)| together(i, j)) {
                let d = sample.position[j] - sample.position[i];
                let mut x = Vector2::new(a.dot(&d), b.dot(&d));
                if kind == Offset::Unbent {
                    let flat = x.norm();
                    // A neighbour straight above has no direction: it is left where it is, without length.
                    x *= if flat > 1e-6 * length { length / flat } else { 0.0 };
                }
                moment += x * x.transpose();
                to.push(j as u32);
                offset.push(x);
            }
            first.push(to.len() as u32);
            inverse.push(inverse_moment(&moment));
        }
        Self { first, to, offset, inverse }
    }

    /// Number of nodes.
    pub(super) fn len(&self) -> usize {
        self.inverse.len()
    }

    /// The neighbours of a node and the offsets to them.
    pub(super) fn around(&self, node: usize) -> impl Iterator<Item = (usize, &Vector2<f64>)> + Clone {
        let row = self.first[node] as usize..self.first[node + 1] as usize;
        self.to[row.clone()].iter().map(|&j| j as usize).zip(&self.offset[row])
    }

    /// Number of edges, counted from both ends.
    pub(super) fn arc_count(&self) -> usize {
        self.to.len()
    }

    /// The Jacobian of the map at a node; `None` where the offsets lie on a line.
    pub(super) fn jacobian(&self, node: usize, uv: &[Point2<f64>]) -> Option<Matrix2<f64>> {
        let inverse = &self.inverse[node];
        if inverse.m11 == 0.0 {
            return None;
        }
        let mixed: Matrix2<f64> = self.around(node).map(|(j, x)| (uv[j] - uv[node]) * x.transpose()).sum();
        Some(mixed * inverse)
    }
}

fn inverse_moment(moment: &Matrix2<f64>) -> Matrix2<f64> {
    let [most, least] = distortion::singular_values(moment);
    if least <= LEAST_SPREAD * LEAST_SPREAD * most || !most.is_finite() {
        return Matrix2::zeros();
    }
    moment.try_inverse().unwrap_or_else(Matrix2::zeros)
}

/// How far a chart is from isometric.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    /// L2 stretch at the chart's best scale; 1 is none. 1 where nothing could be measured.
    pub(super) l2: f64,
    /// The stretch that 99 % of the area stays under, at the scale that keeps the area.
    pub(super) p99: f64,
    /// The nodes that are turned over against most of the area.
    pub(super) folded: Vec<u32>,
    /// Share of the measured area in them.
    pub(super) folded_share: f64,
    /// Whether most of the area is turned over: the chart is mirrored.
    pub(super) mirrored: bool,
    /// Σ aE, Σ a|det J| and Σ a over the nodes that could be measured.
    pub(super) sums: [f64; 3],
}

impl Stretch {
    /// The factor that brings a chart to the area of its surface, 1 where that is not known.
    pub(super) fn scale(&self) -> f64 {
        let [_, plane, surface] = self.sums;
        let factor = (surface / plane).sqrt();
        if factor.is_finite() && factor > 0.0 { factor } else { 1.0 }
    }
}

/// Measures a map. A node whose Jacobian is singular has infinite stretch. Sums are taken in the order of the nodes.
/// O(m).
pub(super) fn measure(offsets: &Offsets, area: &[f64], uv: &[Point2<f64>]) -> Stretch {
    let all: Vec<u32> = (0..offsets.len() as u32).collect();
    measure_nodes(offsets, area, uv, &all)
}

/// The same over some of the nodes.
pub(super) fn measure_nodes(offsets: &Offsets, area: &[f64], uv: &[Point2<f64>], nodes: &[u32]) -> Stretch {
    let local: Vec<Option<(f64, f64)>> = nodes
        .par_iter()
        .with_min_len(1024)
        .map(|&i| offsets.jacobian(i as usize, uv).map(|j| (distortion::squared_stretch(&j), j.determinant())))
        .collect();
    let area = || nodes.iter().map(|&i| area[i as usize]);
    let mut sums = [0.0; 3];
    let (mut upright, mut turned) = (0.0, 0.0);
    for (local, a) in local.iter().zip(area()) {
        if let &Some((energy, det)) = local {
            sums[0] += a * if energy.is_nan() { f64::INFINITY } else { energy };
            sums[1] += a * det.abs();
            sums[2] += a;
            *(if det > 0.0 { &mut upright } else { &mut turned }) += a;
        }
    }
    if sums[2] <= 0.0 {
        return Stretch { l2: 1.0, p99: 1.0, folded: Vec::new(), folded_share: 0.0, mirrored: false, sums };
    }
    let mirrored = turned > upright;
    let over = |det: f64| (det > 0.0) == mirrored;
    let folded: Vec<u32> =
        (0..local.len()).filter(|&i| local[i].is_some_and(|(_, det)| over(det))).map(|i| nodes[i]).collect();
    let density = sums[1] / sums[2];
    let mut sorted: Vec<(f64, f64)> =
        local.iter().zip(area()).filter_map(|(l, a)| l.map(|(energy, _)| (energy, a))).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let p99 = sorted.iter().find(|&&(_, a)| {
        below += a;
        below >= 0.99 * sums[2]
    });
    Stretch {
        l2: (sums[0] / sums[2] * density).sqrt(),
        p99: p99.map_or(1.0, |&(energy, _)| (energy * density).sqrt()),
        folded,
        folded_share: upright.min(turned) / sums[2],
        mirrored,
        sums,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geodesics::knn_graph;
    use crate::progress::Progress;
    use nalgebra::Point3;

    /// A jittered lattice of side² points over a square of side 2, lifted to space.
    pub(in crate::cloud) fn sheet(side: usize, lift: impl Fn(f64, f64) -> Point3<f64>) -> (Sample, Vec<Point2<f64>>) {
        let mut plane = Vec::new();
        for i in 0..side * side {
            let jitter = |k: usize| 0.4 * (((i * 37 + k * 61) % 101) as f64 / 101.0 - 0.5);
            let at = |c: usize, k: usize| 2.0 * (c as f64 + jitter(k)) / (side - 1) as f64 - 1.0;
            plane.push(Point2::new(at(i % side, 1), at(i / side, 2)));
        }
        let position: Vec<_> = plane.iter().map(|p| lift(p.x, p.y)).collect();
        let flat: Vec<f64> = position.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        let graph = knn_graph(&flat, 3, 12, &Progress::new()).expect("not cancelled");
        let area = vec![4.0 / (side * side) as f64; side * side];
        (Sample::new(position, area, graph), plane)
    }

    #[test]
    fn jacobians_of_affine_maps_are_exact() {
        let (sample, plane) = sheet(12, |x, y| Point3::new(0.6 * x, 0.8 * x, y));
        let offsets = Offsets::new(&sample, Offset::Projected);
        let map = Matrix2::new(1.7, 0.4, -0.2, 0.9);
        let uv: Vec<_> = plane.iter().map(|p| map * p + Vector2::new(3.0, -1.0)).collect();
        let expected = distortion::singular_values(&map);
        for i in 0..offsets.len() {
            let found = distortion::singular_values(&offsets.jacobian(i, &uv).expect("spread out"));
            assert!((found[0] - expected[0]).abs() < 1e-10 && (found[1] - expected[1]).abs() < 1e-10);
        }
        let stretch = measure(&offsets, &sample.area, &uv);
        let l2 = (distortion::squared_stretch(&map) * map.determinant()).sqrt();
        assert!((stretch.l2 - l2).abs() < 1e-10 && (stretch.p99 - l2).abs() < 1e-10);
        assert!(stretch.folded.is_empty());
        assert!((stretch.scale() - map.determinant().powf(-0.5)).abs() < 1e-10);
    }

    #[test]
    fn a_cylinder_unrolled_is_isometric() {
        let (sample, plane) = sheet(40, |x, y| Point3::new(x.sin(), x.cos(), y));
        let stretch = measure(&Offsets::new(&sample, Offset::Unbent), &sample.area, &plane);
        assert!((stretch.l2 - 1.0).abs() < 1e-4, "{}", stretch.l2);
        assert!(stretch.folded.is_empty());
    }

    #[test]
    fn a_fold_turns_over_the_side_with_less_area() {
        let (sample, plane) = sheet(30, |x, y| Point3::new(x, y, 0.1 * x * x));
        let offsets = Offsets::new(&sample, Offset::Unbent);
        let fold: Vec<_> = plane.iter().map(|p| Point2::new((p.x - 0.5).abs(), p.y)).collect();
        let stretch = measure(&offsets, &sample.area, &fold);
        let folded = |i: u32| stretch.folded.binary_search(&i).is_ok();
        for (i, p) in plane.iter().enumerate() {
            // Next to the crease the map is neither.
            assert!((p.x - 0.5).abs() < 0.15 || folded(i as u32) == (p.x > 0.5), "{p}");
        }
        assert!((stretch.folded_share - 0.25).abs() < 0.04, "{}", stretch.folded_share);
    }

    #[test]
    fn points_on_a_line_are_not_measured() {
        let position: Vec<_> = (0..20).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        let graph = WeightedGraphOfLine::of(&position);
        let uv: Vec<_> = position.iter().map(|p| Point2::new(p.x, 0.0)).collect();
        let sample = Sample::new(position, vec![1.0; 20], graph);
        let stretch = measure(&Offsets::new(&sample, Offset::Unbent), &sample.area, &uv);
        assert_eq!((stretch.l2, stretch.folded.len(), stretch.scale()), (1.0, 0, 1.0));
    }

    struct WeightedGraphOfLine;

    impl WeightedGraphOfLine {
        fn of(position: &[Point3<f64>]) -> crate::geodesics::WeightedGraph {
            let edges = (1..position.len()).map(|i| (i - 1, i, (position[i] - position[i - 1]).norm()));
            crate::geodesics::WeightedGraph::from_edges(position.len(), edges)
        }
    }
}
