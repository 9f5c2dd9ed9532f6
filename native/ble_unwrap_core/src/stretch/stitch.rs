//! Triangles drawn apart in the plane, drawn together as one map.
//!
//! Where two flat charts are laid side by side their borders do not quite meet. Here each triangle keeps its shape and its
//! turn as well as the others let it: Poisson's equation with their Jacobians for a right-hand side, which
//! spreads what does not meet over the whole map. To go on from there as rigidly as possible, each triangle turning its shape
//! on the surface, was tried: it folds more than it gains.

use nalgebra::Point2;

use crate::distortion::RestTriangle;
use crate::linalg::{SparseCholesky, SparseError, SparsePattern};
use crate::mesh::{HalfedgeId, TriMesh};

/// Cotangent weights are kept within these bounds: positive, so that few triangles flip, and well conditioned.
const WEIGHTS: (f64, f64) = (0.05, 20.0);
/// Relative weight on the diagonal, against the translation that the equation leaves open.
const RIDGE: f64 = 1e-10;

/// Positions that draw each face as near as can be to its three corners in `drawn`, by the lengths of their sides weighted
/// with cotangents. May have flips and overlap. O(n^1.5).
///
/// # Errors
/// [`SparseError`] where the system cannot be factored.
pub fn stitch(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    drawn: &[[Point2<f64>; 3]],
) -> Result<Vec<Point2<f64>>, SparseError> {
    let n = mesh.vertex_count();
    let weights: Vec<[f64; 3]> = rest.iter().map(|r| r.cotangents().map(|w| w.clamp(WEIGHTS.0, WEIGHTS.1))).collect();
    let pairs = mesh.edges().map(|h| (mesh.from(h).index() as u32, mesh.to(h).index() as u32));
    let mut solver = SparseCholesky::analyse(SparsePattern::from_pairs(n, pairs))?;
    let mut values = vec![0.0; solver.pattern().entry_count()];
    let mut rhs = vec![0.0; 2 * n];
    let weight = |h: HalfedgeId| weights[h.face().index()][h.slot()];
    for h in mesh.edges() {
        let (i, j) = (mesh.from(h).index(), mesh.to(h).index());
        let w = weight(h) + if mesh.is_boundary(h) { 0.0 } else { weight(mesh.twin(h)) };
        for v in [i, j] {
            values[solver.pattern().diagonal(v)] += w * (1.0 + RIDGE);
        }
        if let Some(at) = solver.pattern().position(i, j) {
            values[at] -= w;
        }
    }
    for ((t, weights), drawn) in mesh.triangles().iter().zip(&weights).zip(drawn) {
        for k in 0..3 {
            let (i, j) = (t[k].index(), t[(k + 1) % 3].index());
            let side = (drawn[(k + 1) % 3] - drawn[k]) * weights[k];
            for (at, side) in [(0, side.x), (n, side.y)] {
                rhs[at + i] -= side;
                rhs[at + j] += side;
            }
        }
    }
    solver.refactor(&values)?;
    solver.solve_in_place(&mut rhs);
    Ok((0..n).map(|i| Point2::new(rhs[i], rhs[n + i])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{grid, hemisphere};
    use nalgebra::{Point3, Rotation2, Vector2};

    #[test]
    fn a_map_drawn_whole_stays_up_to_a_shift() {
        let mesh = hemisphere(8);
        let uv: Vec<Point2<f64>> = mesh.positions().iter().map(|p| p.xy() * 1.3).collect();
        let drawn: Vec<_> = mesh.triangles().iter().map(|t| t.map(|v| uv[v.index()])).collect();
        let got = stitch(&mesh, &RestTriangle::of_mesh(&mesh), &drawn).expect("factored");
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
        let got = stitch(&mesh, &RestTriangle::of_mesh(&mesh), &drawn).expect("factored");
        for h in mesh.halfedges() {
            let (i, j) = (mesh.from(h).index(), mesh.to(h).index());
            let length = (got[i] - got[j]).norm() / mesh.edge_length(h);
            assert!((length - 1.0).abs() < 0.1, "the gap of half an edge and more is spread: {length}");
        }
    }
}
