//! Triangles drawn apart in the plane, drawn together as one map.
//!
//! Where two flat charts are laid side by side their borders do not quite meet. Here each triangle keeps its shape and its
//! turn as well as the others let it: Poisson's equation with their Jacobians for a right-hand side, which
//! spreads what does not meet over the whole map. To go on from there as rigidly as possible, each triangle turning its shape
//! on the surface, was tried: it folds more than it gains.

use nalgebra::Point2;

use super::StretchError;
use super::laplacian::Laplacian;
use crate::distortion::RestTriangle;
use crate::mesh::TriMesh;

/// Positions that draw each face as near as can be to its three corners in `drawn`, by the lengths of their sides weighted
/// with cotangents. May have flips and overlap. O(n^1.5).
///
/// # Errors
/// [`StretchError::Solver`] where the system cannot be factored.
pub(crate) fn stitch(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    drawn: &[[Point2<f64>; 3]],
) -> Result<Vec<Point2<f64>>, StretchError> {
    let n = mesh.vertex_count();
    let mut laplacian = Laplacian::new(mesh, rest, |_| false)?;
    let mut rhs = vec![0.0; 2 * n];
    for ((t, weights), drawn) in mesh.triangles().iter().zip(&laplacian.weights).zip(drawn) {
        for k in 0..3 {
            let (i, j) = (t[k].index(), t[(k + 1) % 3].index());
            let side = (drawn[(k + 1) % 3] - drawn[k]) * weights[k];
            for (at, side) in [(0, side.x), (n, side.y)] {
                rhs[at + i] -= side;
                rhs[at + j] += side;
            }
        }
    }
    laplacian.solve_in_place(&mut rhs);
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
