//! A connected sample of a surface, as the charting works on it: the points of a piece, or the cells of a large one.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use crate::geodesics::WeightedGraph;

/// Nodes on a surface, their neighbours, areas and tangent planes.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    /// Where the nodes are.
    pub(super) position: Vec<Point3<f64>>,
    /// Area of surface each stands for.
    pub(super) area: Vec<f64>,
    /// Neighbours, with edges of Euclidean length.
    pub(super) graph: WeightedGraph,
    /// Unit normals, of either side.
    pub(super) normal: Vec<Vector3<f64>>,
}

impl Sample {
    /// Nodes with the tangent planes of their neighbourhoods. O(m) for m edges.
    pub(super) fn new(position: Vec<Point3<f64>>, area: Vec<f64>, graph: WeightedGraph) -> Self {
        let normal = (0..position.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let near = || graph.neighbours(i).map(|(j, _)| j).chain([i]);
                principal_axes(|| near().map(|j| (position[j], area[j])))[2]
            })
            .collect();
        Self { position, area, graph, normal }
    }

    /// Number of nodes.
    pub(super) fn len(&self) -> usize {
        self.position.len()
    }

    /// The part of the sample on some of its nodes (ascending), with the same tangent planes.
    pub(super) fn part(&self, nodes: &[u32], graph: WeightedGraph) -> Self {
        Self {
            position: nodes.iter().map(|&v| self.position[v as usize]).collect(),
            area: nodes.iter().map(|&v| self.area[v as usize]).collect(),
            normal: nodes.iter().map(|&v| self.normal[v as usize]).collect(),
            graph,
        }
    }
}

/// The principal axes of weighted points, longest extent first, orthonormal: the last is the normal of the plane of
/// least squares. Points without extent have the axes of space.
pub(super) fn principal_axes<I>(points: impl Fn() -> I) -> [Vector3<f64>; 3]
where
    I: Iterator<Item = (Point3<f64>, f64)>,
{
    let (mut sum, mut weight) = (Vector3::zeros(), 0.0);
    for (p, w) in points() {
        sum += p.coords * w;
        weight += w;
    }
    let space = [Vector3::x(), Vector3::y(), Vector3::z()];
    if weight <= 0.0 || !weight.is_finite() {
        return space;
    }
    let mean = sum / weight;
    let mut scatter = Matrix3::zeros();
    let mut widest: f64 = 0.0;
    for (p, _) in points() {
        widest = widest.max((p.coords - mean).amax());
    }
    if widest <= 0.0 {
        return space;
    }
    for (p, w) in points() {
        let d = (p.coords - mean) / widest;
        scatter += d * d.transpose() * (w / weight);
    }
    let eigen = SymmetricEigen::new(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|&a: &usize, &b: &usize| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]).then(a.cmp(&b)));
    let first = eigen.eigenvectors.column(order[0]).into_owned();
    let second = eigen.eigenvectors.column(order[1]).into_owned();
    [first, second, first.cross(&second)]
}

/// Two unit vectors that make a right-handed frame with the unit vector `normal`.
pub(super) fn tangents(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let away = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = (away - normal * normal.dot(&away)).normalize();
    [first, normal.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_a_slab_are_its_sides() {
        let points: Vec<_> = (0..200)
            .map(|i| Point3::new(f64::from(i % 20), 0.3 * f64::from(i / 20), 0.001 * f64::from(i % 3)))
            .map(|p| (p, 1.0))
            .collect();
        let axes = principal_axes(|| points.iter().copied());
        for (axis, side) in axes.iter().zip([Vector3::x(), Vector3::y(), Vector3::z()]) {
            assert!(axis.dot(&side).abs() > 0.999_9, "{axis}");
        }
        assert!((axes[0].cross(&axes[1]) - axes[2]).norm() < 1e-12);
        // No extent, and a size that would underflow when squared.
        assert_eq!(principal_axes(|| [(Point3::origin(), 1.0)].into_iter())[2], Vector3::z());
        let small = || points.iter().map(|&(p, w)| (p * 1e-200, w));
        assert!(principal_axes(small)[0].x.abs() > 0.999_9);
    }

    #[test]
    fn tangents_are_orthonormal() {
        for n in [Vector3::x(), Vector3::y(), -Vector3::z(), Vector3::new(0.6, 0.64, 0.48)] {
            let [a, b] = tangents(&n);
            assert!((a.cross(&b) - n).norm() < 1e-12 && a.dot(&b).abs() < 1e-12);
        }
    }
}
