//! One face's map from the surface to the plane: singular values, stretch, flip.
//!
//! Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3.
//! With σ₁ ≥ σ₂ the singular values of the 3D→2D map of a triangle, its squared L2 stretch is
//! ½(1/σ₁² + 1/σ₂²) and its L-infinity stretch 1/σ₂.

use nalgebra::{Matrix2, Point2, Point3};

use crate::mesh::TriMesh;

/// A triangle of the surface laid isometrically in the plane: (0,0), (`x1`,0), (`x2`,`y2`), `y2` > 0.
///
/// Triangles flatter than [`RestTriangle::MIN_HEIGHT`] are given that height, so that every rest
/// triangle has an area and a map to the UV plane has a finite Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RestTriangle {
    /// Length of the first edge.
    pub x1: f64,
    /// Abscissa of the third corner.
    pub x2: f64,
    /// Height of the third corner above the first edge.
    pub y2: f64,
}

impl RestTriangle {
    /// Least height over the longest edge, relative to it. Flatter triangles carry no texture worth
    /// protecting (a thousandth of a texel row a texel), and at this height Newton's Hessian still
    /// has a condition number near 1e6.
    pub(crate) const MIN_HEIGHT: f64 = 1e-3;
    /// What the height of a needle is told by in double precision, with eight digits left.
    const NEEDLE_HEIGHT: f64 = 1e-8;

    /// Lays a triangle in the plane. `unit` is a length typical of the mesh: a triangle whose longest
    /// edge is below `unit`·1e-6 becomes an equilateral one of that size.
    #[must_use]
    pub(crate) fn new(p: [Point3<f64>; 3], unit: f64) -> Self {
        Self::at_least_as_high(p, unit, Self::MIN_HEIGHT)
    }

    /// The same with another least height over the longest edge.
    fn at_least_as_high(p: [Point3<f64>; 3], unit: f64, least_height: f64) -> Self {
        let length = [(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()];
        let longest = length[0].max(length[1]).max(length[2]);
        let least = unit * 1e-6;
        if longest <= least || !longest.is_finite() {
            let side = if least > 0.0 { least } else { 1.0 };
            return Self { x1: side, x2: 0.5 * side, y2: 0.75_f64.sqrt() * side };
        }
        // Lay the longest edge on the axis, lift the apex if need be, then turn edge 0 onto the axis.
        let k = (0..3).find(|&k| length[k] == longest).unwrap_or(0);
        let (a, b, c) = (p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
        let axis = (b - a) / longest;
        let along = (c - a).dot(&axis).clamp(0.0, longest);
        let height = (c - a).cross(&axis).norm().max(least_height * longest);
        let laid = [Point2::new(0.0, 0.0), Point2::new(longest, 0.0), Point2::new(along, height)];
        let q = [laid[(3 - k) % 3], laid[(4 - k) % 3], laid[(5 - k) % 3]];
        let (e1, e2) = (q[1] - q[0], q[2] - q[0]);
        let x1 = e1.norm();
        Self { x1, x2: e1.dot(&e2) / x1, y2: e1.perp(&e2) / x1 }
    }

    /// Rest triangles of all faces of a mesh; the unit is its mean edge length. O(n).
    #[must_use]
    pub(crate) fn of_mesh(mesh: &TriMesh) -> Vec<Self> {
        Self::all(mesh, Self::MIN_HEIGHT)
    }

    /// Rest triangles of all faces of a mesh that may be as thin as a needle is: for a map that needs no derivative. O(n).
    #[must_use]
    pub(crate) fn needles_of_mesh(mesh: &TriMesh) -> Vec<Self> {
        Self::all(mesh, Self::NEEDLE_HEIGHT)
    }

    fn all(mesh: &TriMesh, least_height: f64) -> Vec<Self> {
        let total: f64 = mesh.halfedges().map(|h| mesh.edge_length(h)).sum();
        let unit = total / mesh.halfedge_count().max(1) as f64;
        mesh.faces().map(|f| Self::at_least_as_high(mesh.triangle_positions(f), unit, least_height)).collect()
    }

    /// Area.
    #[inline]
    #[must_use]
    pub(crate) fn area(&self) -> f64 {
        0.5 * self.x1 * self.y2
    }

    /// The corners in the plane.
    #[inline]
    #[must_use]
    pub(crate) fn corners(&self) -> [Point2<f64>; 3] {
        [Point2::new(0.0, 0.0), Point2::new(self.x1, 0.0), Point2::new(self.x2, self.y2)]
    }

    /// Cotangents of the angles opposite the three sides, in the order of the half-edges.
    #[must_use]
    pub(crate) fn cotangents(&self) -> [f64; 3] {
        let c = self.corners();
        [0, 1, 2].map(|k| {
            let apex = c[(k + 2) % 3];
            let (a, b) = (c[k] - apex, c[(k + 1) % 3] - apex);
            a.dot(&b) / a.perp(&b)
        })
    }

    /// Jacobian of the affine map that takes this triangle to `uv`.
    #[inline]
    #[must_use]
    pub(crate) fn jacobian(&self, uv: [Point2<f64>; 3]) -> Matrix2<f64> {
        let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
        let jx = d1 / self.x1;
        let jy = (d2 - jx * self.x2) / self.y2;
        Matrix2::from_columns(&[jx, jy])
    }
}

/// Singular values of a 2×2 matrix, larger first; both non-negative. Closed form, accurate for
/// nearly conformal maps.
#[inline]
#[must_use]
pub(crate) fn singular_values(j: &Matrix2<f64>) -> [f64; 2] {
    let (e, f) = (0.5 * (j.m11 + j.m22), 0.5 * (j.m11 - j.m22));
    let (g, h) = (0.5 * (j.m21 + j.m12), 0.5 * (j.m21 - j.m12));
    let (q, r) = (e.hypot(h), f.hypot(g));
    [q + r, (q - r).abs()]
}

/// Squared L2 stretch of a face whose 3D→2D map has Jacobian `j`: ½(1/σ₁² + 1/σ₂²) = |J|²/(2 det²).
/// Infinite where the map has no area; the sign of the determinant is not looked at.
#[inline]
#[must_use]
pub(crate) fn squared_stretch(j: &Matrix2<f64>) -> f64 {
    squared_stretch_of(j.norm_squared(), j.determinant())
}

/// The same of |J|² and det J.
#[inline]
#[must_use]
pub(crate) fn squared_stretch_of(norm_squared: f64, determinant: f64) -> f64 {
    0.5 * norm_squared / (determinant * determinant)
}

/// Twice the signed area of a triangle in the plane.
#[inline]
#[must_use]
pub(crate) fn signed_double_area(uv: [Point2<f64>; 3]) -> f64 {
    (uv[1] - uv[0]).perp(&(uv[2] - uv[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation2;

    #[test]
    fn cotangents_of_half_a_square() {
        let got = RestTriangle { x1: 1.0, x2: 1.0, y2: 1.0 }.cotangents();
        assert!(got.iter().zip([1.0, 1.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{got:?}");
    }

    #[test]
    fn singular_values_of_a_known_map() {
        let j = Rotation2::new(0.3).into_inner() * Matrix2::new(3.0, 0.0, 0.0, 0.5) * Rotation2::new(-1.1).into_inner();
        let s = singular_values(&j);
        assert!((s[0] - 3.0).abs() < 1e-14 && (s[1] - 0.5).abs() < 1e-14);
        assert!((squared_stretch(&j) - 0.5 * (1.0 / 9.0 + 4.0)).abs() < 1e-12);
    }

    #[test]
    fn rest_triangle_keeps_lengths_whichever_edge_is_longest() {
        let p = [Point3::new(0.1, 0.2, 0.3), Point3::new(2.0, -1.0, 0.5), Point3::new(0.7, 1.1, -2.0)];
        for k in 0..3 {
            let q = [p[k], p[(k + 1) % 3], p[(k + 2) % 3]];
            let c = RestTriangle::new(q, 1.0).corners();
            for e in 0..3 {
                let (a, b) = (e, (e + 1) % 3);
                assert!(((c[b] - c[a]).norm() - (q[b] - q[a]).norm()).abs() < 1e-14);
            }
            assert!(signed_double_area(c) > 0.0);
        }
    }

    #[test]
    fn rest_triangle_of_a_degenerate_face_has_area() {
        let line = [Point3::origin(), Point3::new(2.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0)];
        let point = [Point3::new(4.0, 4.0, 4.0); 3];
        for p in [line, point, [line[1], line[0], line[0]]] {
            for unit in [1.0, 0.0] {
                let t = RestTriangle::new(p, unit);
                assert!(t.area() > 0.0 && t.y2 > 0.0, "{t:?}");
            }
        }
    }
}
