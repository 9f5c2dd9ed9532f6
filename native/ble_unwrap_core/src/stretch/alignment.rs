//! How far the sides of a chart are from lying along the axes, as a term of the energy.

use nalgebra::{Matrix2, Point2, Vector2};

use super::sides::{Axis, Side};
use super::system::ChartSystem;
use crate::collections::DisjointSets;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// How far edges are from the axes they are to lie along: the sum of (what is across)² / length, over their length in all.
#[derive(Clone, Debug, Default)]
pub(super) struct Alignment {
    edges: Vec<Aligned>,
    /// Factor on the sum.
    weight: f64,
}

#[derive(Clone, Copy, Debug)]
struct Aligned {
    halfedge: HalfedgeId,
    ends: [VertexId; 2],
    axis: Axis,
    /// 1 / (length · length of all).
    share: f64,
}

impl Alignment {
    pub(super) fn new(mesh: &TriMesh, sides: &[(Axis, Side)]) -> Self {
        let total: f64 = sides.iter().flat_map(|s| &s.1).map(|&h| mesh.edge_length(h)).sum();
        let edge = |axis: Axis, h: HalfedgeId| Aligned {
            halfedge: h,
            ends: [mesh.from(h), mesh.to(h)],
            axis,
            share: 1.0 / (mesh.edge_length(h) * total),
        };
        let edges = sides.iter().flat_map(|(axis, side)| side.iter().map(|&h| edge(*axis, h)));
        Self { edges: edges.filter(|e| e.share.is_finite()).collect(), weight: 1.0 }
    }

    /// The same with another factor.
    pub(super) fn weighing(&self, weight: f64) -> Self {
        Self { weight, ..self.clone() }
    }

    fn along(e: &Aligned, uv: &[Point2<f64>]) -> Vector2<f64> {
        uv[e.ends[1].index()] - uv[e.ends[0].index()]
    }

    pub(super) fn value(&self, uv: &[Point2<f64>]) -> f64 {
        let of = |e: &Aligned| e.share * e.axis.across(Self::along(e, uv)).powi(2);
        self.weight * self.edges.iter().map(of).sum::<f64>()
    }

    /// Adds gradient and Hessian, which is exact, at `uv`.
    pub(super) fn assemble(&self, uv: &[Point2<f64>], system: &mut ChartSystem<'_>) {
        for e in &self.edges {
            let normal = match e.axis {
                Axis::X => Vector2::y(),
                Axis::Y => Vector2::x(),
            };
            let twice = 2.0 * self.weight * e.share;
            let slope = normal * (twice * e.axis.across(Self::along(e, uv)));
            let curve: Matrix2<f64> = normal * normal.transpose() * twice;
            let [from, to] = e.ends.map(|v| v.index() as u32);
            system.add_gradient(to, slope);
            system.add_gradient(from, -slope);
            system.add_diagonal(from, &curve);
            system.add_diagonal(to, &curve);
            system.add_edge_block(e.halfedge, &-curve);
        }
    }

    /// The length on the surface of those edges that lie along their axes up to a share of their length.
    pub(super) fn aligned_length(&self, mesh: &TriMesh, uv: &[Point2<f64>], up_to: f64) -> f64 {
        let lies = |e: &&Aligned| {
            let along = Self::along(e, uv);
            e.axis.across(along).abs() <= up_to * along.norm()
        };
        self.edges.iter().filter(lies).map(|e| mesh.edge_length(e.halfedge)).sum()
    }

    /// Puts all of a side on one line, sides that meet at an end on the same.
    pub(super) fn snap(&self, uv: &mut [Point2<f64>]) {
        for (axis, coordinate) in [(Axis::X, 1), (Axis::Y, 0)] {
            let mut lines = DisjointSets::new(uv.len());
            let edges = || self.edges.iter().filter(|e| e.axis == axis);
            edges().for_each(|e| {
                lines.join(e.ends[0].index(), e.ends[1].index());
            });
            let mut sums = vec![(0.0, 0.0); uv.len()];
            for e in edges() {
                let length = Self::along(e, uv).norm();
                let (sum, weight) = &mut sums[lines.root(e.ends[0].index())];
                *sum += length * e.ends.map(|v| uv[v.index()][coordinate]).iter().sum::<f64>();
                *weight += 2.0 * length;
            }
            for v in edges().flat_map(|e| e.ends) {
                let (sum, weight) = sums[lines.root(v.index())];
                if weight > 0.0 {
                    uv[v.index()][coordinate] = sum / weight;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distortion::RestTriangle;
    use crate::stretch::energy::StretchEnergy;
    use crate::stretch::other_halves::OtherHalves;
    use crate::stretch::sides::sides;
    use crate::stretch::test_meshes::grid;
    use nalgebra::Point3;

    fn sheet() -> (TriMesh, Alignment, Vec<Point2<f64>>) {
        let mesh = grid(6, 4, |x, y| Point3::new(x, y, 0.0));
        let flat: Vec<Point2<f64>> = mesh.positions().iter().map(|p| p.xy()).collect();
        let axes = [Axis::X, Axis::Y, Axis::X, Axis::Y];
        let alignment = Alignment::new(&mesh, &axes.into_iter().zip(sides(&mesh, &flat)).collect::<Vec<_>>());
        let uv = mesh.positions().iter().map(|p| Point2::new(p.x + 0.1 * p.y * p.y, p.y + 0.1 * p.x.sin()));
        let uv = uv.collect();
        (mesh, alignment, uv)
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let (mesh, alignment, uv) = sheet();
        let alignment = alignment.weighing(3.0);
        let rest = RestTriangle::of_mesh(&mesh);
        let energy = StretchEnergy::new(0.3);
        let mut system = ChartSystem::new(&mesh, &rest, &OtherHalves::default()).expect("analysis");
        system.assemble(&energy, &uv);
        let without = system.gradient().to_vec();
        alignment.assemble(&uv, &mut system);
        let gradient: Vec<f64> = system.gradient().iter().zip(&without).map(|(a, b)| a - b).collect();
        let h = 1e-6;
        for (k, g) in gradient.iter().enumerate() {
            let nudged = |by: f64| {
                let mut uv = uv.clone();
                uv[k / 2][k % 2] += by;
                alignment.value(&uv)
            };
            assert!(((nudged(h) - nudged(-h)) / (2.0 * h) - g).abs() < 1e-7, "{k}");
        }
        assert!(gradient.iter().any(|g| g.abs() > 1e-3));
    }

    #[test]
    fn sides_are_snapped_to_lines_and_the_corners_to_both() {
        let (mesh, alignment, mut uv) = sheet();
        let length = mesh.boundary_length();
        assert!(alignment.aligned_length(&mesh, &uv, 1e-9) < 0.5 * length);
        let inner: Vec<Point2<f64>> =
            mesh.vertices().filter(|v| !mesh.is_boundary_vertex(*v)).map(|v| uv[v.index()]).collect();
        alignment.snap(&mut uv);
        assert!((alignment.aligned_length(&mesh, &uv, 1e-12) - length).abs() < 1e-12);
        let after: Vec<Point2<f64>> =
            mesh.vertices().filter(|v| !mesh.is_boundary_vertex(*v)).map(|v| uv[v.index()]).collect();
        assert_eq!(inner, after);
        assert!(alignment.value(&uv) < 1e-20);
    }
}
