//! Triangles drawn apart in the plane, drawn together as one map.
//!
//! Where two flat charts are laid side by side, or a cut is closed, the borders do not quite meet. What does not meet is spread
//! over the whole map by Poisson's equation, with the Jacobians of the triangles for a right-hand side. A border that opens
//! wide may fold so: there the angles between the two drawings of each edge are spread first, by another
//! equation of the kind, which gives every triangle a turn. To go on from there as rigidly as possible, each triangle turning its
//! shape on the surface, was tried: it folds more than it gains.

use nalgebra::{Point2, Rotation2};

use super::StretchError;
use super::laplacian::{Laplacian, RIDGE, WEIGHTS};
use crate::distortion::RestTriangle;
use crate::linalg::{SparseCholesky, SparseError, SparsePattern};
use crate::mesh::{HalfedgeId, TriMesh};

/// A mesh whose triangles are drawn, each by itself, at three corners in the plane.
pub(crate) struct Stitcher<'a> {
    mesh: &'a TriMesh,
    rest: &'a [RestTriangle],
    drawn: &'a [[Point2<f64>; 3]],
    laplacian: Laplacian,
}

impl<'a> Stitcher<'a> {
    /// O(n^1.5).
    ///
    /// # Errors
    /// [`StretchError::Solver`] where the system cannot be factored.
    pub(crate) fn new(
        mesh: &'a TriMesh,
        rest: &'a [RestTriangle],
        drawn: &'a [[Point2<f64>; 3]],
    ) -> Result<Self, StretchError> {
        Ok(Self { mesh, rest, drawn, laplacian: Laplacian::new(mesh, rest, |_| false)? })
    }

    /// Positions that draw each face as near as can be to its three corners, by the lengths of their sides weighted with cotangents.
    /// May have flips and overlap. O(n log n).
    pub(crate) fn stitch(&mut self) -> Vec<Point2<f64>> {
        self.stitched(self.drawn)
    }

    /// The same, each face turned first so that the two drawings of an edge point the same way as nearly as can be. O(n^1.5).
    ///
    /// # Errors
    /// [`StretchError::Solver`] where the system of the turns cannot be factored.
    pub(crate) fn stitch_turned(&mut self) -> Result<Vec<Point2<f64>>, StretchError> {
        let turn = |(corners, turn): (&[Point2<f64>; 3], f64)| corners.map(|p| Rotation2::new(turn) * p);
        let turned: Vec<_> = self.drawn.iter().zip(turns(self.mesh, self.rest, self.drawn)?).map(turn).collect();
        Ok(self.stitched(&turned))
    }

    fn stitched(&mut self, drawn: &[[Point2<f64>; 3]]) -> Vec<Point2<f64>> {
        let n = self.mesh.vertex_count();
        let mut rhs = vec![0.0; 2 * n];
        for ((t, weights), drawn) in self.mesh.triangles().iter().zip(&self.laplacian.weights).zip(drawn) {
            for k in 0..3 {
                let (i, j) = (t[k].index(), t[(k + 1) % 3].index());
                let side = (drawn[(k + 1) % 3] - drawn[k]) * weights[k];
                for (at, side) in [(0, side.x), (n, side.y)] {
                    rhs[at + i] -= side;
                    rhs[at + j] += side;
                }
            }
        }
        self.laplacian.solve_in_place(&mut rhs);
        (0..n).map(|i| Point2::new(rhs[i], rhs[n + i])).collect()
    }
}

/// By how much each face is turned, in radians: what the two drawings of each edge differ by, spread over all faces by least squares,
/// with the length of the edge over the distance between its faces for a weight.
fn turns(mesh: &TriMesh, rest: &[RestTriangle], drawn: &[[Point2<f64>; 3]]) -> Result<Vec<f64>, SparseError> {
    let inner = || mesh.edges().filter(|&h| !mesh.is_boundary(h)).map(|h| (h, mesh.twin(h)));
    let faces = |(h, t): (HalfedgeId, HalfedgeId)| [h.face().index(), t.face().index()];
    let pairs = inner().map(faces).filter(|[f, g]| f != g).map(|[f, g]| (f as u32, g as u32));
    let mut solver = SparseCholesky::analyse(SparsePattern::from_pairs(mesh.face_count(), pairs))?;
    let mut values = vec![0.0; solver.pattern().entry_count()];
    let mut turns = vec![0.0; mesh.face_count()];
    let side = |f: usize, slot: usize| drawn[f][(slot + 1) % 3] - drawn[f][slot];
    for (h, t) in inner() {
        let [f, g] = faces((h, t));
        let Some(at) = solver.pattern().position(f, g).filter(|_| f != g) else { continue };
        let (here, there) = (side(f, h.slot()), -side(g, t.slot()));
        let angle = here.perp(&there).atan2(here.dot(&there));
        let weight = mesh.edge_length(h).powi(2) / (rest[f].area() + rest[g].area());
        let weight = if weight.is_nan() { WEIGHTS.0 } else { weight.clamp(WEIGHTS.0, WEIGHTS.1) };
        values[at] -= weight;
        for face in [f, g] {
            values[solver.pattern().diagonal(face)] += weight;
        }
        turns[f] += weight * angle;
        turns[g] -= weight * angle;
    }
    for face in 0..mesh.face_count() {
        let at = solver.pattern().diagonal(face);
        values[at] = values[at] * (1.0 + RIDGE) + RIDGE;
    }
    solver.refactor(&values)?;
    solver.solve_in_place(&mut turns);
    Ok(turns)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::stretch::test_meshes::{grid, hemisphere};
    use crate::stretch::{first_flip, l2_of_positions};
    use nalgebra::{Point3, Vector2};

    #[test]
    fn a_map_drawn_whole_stays_up_to_a_shift() {
        let mesh = hemisphere(8);
        let uv: Vec<Point2<f64>> = mesh.positions().iter().map(|p| p.xy() * 1.3).collect();
        let drawn: Vec<_> = mesh.triangles().iter().map(|t| t.map(|v| uv[v.index()])).collect();
        let rest = RestTriangle::of_mesh(&mesh);
        let got = Stitcher::new(&mesh, &rest, &drawn).expect("factored").stitch();
        let shift = got[0] - uv[0];
        assert!(got.iter().zip(&uv).all(|(p, q)| (p - q - shift).norm() < 1e-6));
    }

    #[test]
    fn halves_laid_at_an_angle_share_it() {
        let mesh = grid(20, 4, |x, y| Point3::new(x, y, 0.0));
        let turn = Rotation2::new(0.1);
        let right = |p: Point2<f64>| turn * p + Vector2::new(0.3, -0.2);
        let drawn: Vec<_> = mesh
            .faces()
            .map(|f| {
                let p = mesh.triangle_positions(f).map(|p| p.xy());
                if p.iter().map(|p| p.x).sum::<f64>() < 30.0 { p } else { p.map(right) }
            })
            .collect();
        let rest = RestTriangle::of_mesh(&mesh);
        let got = Stitcher::new(&mesh, &rest, &drawn).expect("factored").stitch();
        for h in mesh.halfedges() {
            let (i, j) = (mesh.from(h).index(), mesh.to(h).index());
            let length = (got[i] - got[j]).norm() / mesh.edge_length(h);
            assert!((length - 1.0).abs() < 0.1, "the gap of half an edge and more is spread: {length}");
        }
    }

    /// A cone whose apex lacks an angle, cut open along a line from the apex and rolled out, is closed again.
    #[test]
    fn a_cut_that_opens_wide_is_closed_without_a_fold() {
        let (rings, around) = (8_usize, 24_usize);
        for opening in [0.5, 1.5, 2.5] {
            let developed = TAU - opening;
            let place = |ring: usize, k: usize| {
                let (r, angle) = (ring as f64, TAU * k as f64 / around as f64);
                let radius = r * developed / TAU;
                Point3::new(radius * angle.cos(), radius * angle.sin(), -(r * r - radius * radius).sqrt())
            };
            let mut positions = vec![Point3::origin()];
            positions.extend((1..=rings).flat_map(|ring| (0..around).map(move |k| place(ring, k))));
            let at = |ring: usize, k: usize| if ring == 0 { 0 } else { (1 + (ring - 1) * around + k % around) as u32 };
            let flat = |ring: usize, k: usize| {
                let angle = developed * k as f64 / around as f64;
                Point2::new(ring as f64 * angle.cos(), ring as f64 * angle.sin())
            };
            let (mut triangles, mut drawn) = (Vec::new(), Vec::new());
            let mut add = |corners: [(usize, usize); 3]| {
                triangles.push(corners.map(|(ring, k)| at(ring, k)));
                drawn.push(corners.map(|(ring, k)| flat(ring, k)));
            };
            for k in 0..around {
                add([(0, k), (1, k), (1, k + 1)]);
                for ring in 1..rings {
                    add([(ring, k), (ring + 1, k), (ring + 1, k + 1)]);
                    add([(ring, k), (ring + 1, k + 1), (ring, k + 1)]);
                }
            }
            let mesh = TriMesh::from_triangles(&positions, &triangles).0;
            let rest = RestTriangle::of_mesh(&mesh);
            let uv = Stitcher::new(&mesh, &rest, &drawn).and_then(|mut s| s.stitch_turned()).expect("factored");
            assert_eq!(first_flip(&mesh, &uv), None, "a cut that opens by {opening}");
            assert!(l2_of_positions(&mesh, &uv, 1e-12) < 1.0 + 0.1 * opening * opening, "{opening}");
        }
    }
}
