//! Stretch of a whole chart at its own best scale.
//!
//! Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3.

use nalgebra::Point2;

use crate::distortion::{RestTriangle, singular_values, squared_stretch};
use crate::mesh::TriMesh;

/// Total area on the surface, of the rest triangles.
#[must_use]
pub(crate) fn surface_area(rest: &[RestTriangle]) -> f64 {
    rest.iter().map(RestTriangle::area).sum()
}

/// Total signed area in the plane.
#[must_use]
pub(crate) fn plane_area(mesh: &TriMesh, uv: &[Point2<f64>]) -> f64 {
    mesh.triangles()
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| uv[v.index()]);
            0.5 * (b - a).perp(&(c - a))
        })
        .sum()
}

/// L2 stretch of a chart at its own best scale: √(ΣE·ΣA₂)/ΣA₃ with E = A₃·½(1/σ₁² + 1/σ₂²). At least 1
/// for a chart without flips, 1 for isometries and their scalings only; infinite where a face has
/// no area, NaN where flips outweigh. O(n).
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
#[must_use]
pub(crate) fn l2_stretch(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
    assert_eq!(
        (rest.len(), uv.len()),
        (mesh.face_count(), mesh.vertex_count()),
        "a rest triangle a face, a point a vertex"
    );
    let energy: f64 = mesh
        .triangles()
        .iter()
        .zip(rest)
        .map(|(t, r)| r.area() * squared_stretch(&r.jacobian(t.map(|v| uv[v.index()]))))
        .sum();
    (energy * plane_area(mesh, uv)).sqrt() / surface_area(rest)
}

/// L2 stretch as [`l2_stretch`], but of the positions of the vertices themselves: no triangle is made thicker.
///
/// Faces of a height up to `negligible` over their longest edge are left out: their lengths are
/// rounding. NaN if no face is left; infinite where a face that counts has no area in the plane. O(n).
///
/// # Panics
/// If there is not one point a vertex.
#[must_use]
pub(crate) fn l2_of_positions(mesh: &TriMesh, uv: &[Point2<f64>], negligible: f64) -> f64 {
    let sums = Sums::of_positions(mesh, uv, negligible);
    (sums.energy * sums.plane).sqrt() / sums.surface
}

/// L2 stretch as [`l2_of_positions`], but of a map that may have flips: singular values do not tell a face from
/// its mirror image, so each face counts as if it were the right way up, with a positive area in the plane.
///
/// At least 1, and the same as [`l2_of_positions`] without flips. Infinite where a face that counts has no area in the
/// plane; large where folds leave thin ones. O(n).
///
/// # Panics
/// If there is not one point a vertex.
#[must_use]
pub(crate) fn l2_unsigned(mesh: &TriMesh, uv: &[Point2<f64>], negligible: f64) -> f64 {
    let sums = Sums::of_positions(mesh, uv, negligible);
    let l2 = (sums.energy * sums.plane_unsigned).sqrt() / sums.surface;
    // A face whose first edge has no length divides nothing by nothing.
    if l2.is_nan() && sums.surface > 0.0 { f64::INFINITY } else { l2 }
}

/// What L2 stretch is made of.
#[derive(Default)]
struct Sums {
    energy: f64,
    surface: f64,
    plane: f64,
    plane_unsigned: f64,
}

impl Sums {
    fn of_positions(mesh: &TriMesh, uv: &[Point2<f64>], negligible: f64) -> Self {
        assert_eq!(uv.len(), mesh.vertex_count(), "a point a vertex");
        let mut sums = Self::default();
        for f in mesh.faces() {
            let [p, q, r] = mesh.triangle_positions(f);
            let (e1, e2) = (q - p, r - p);
            let double_area = e1.cross(&e2).norm();
            let longest = e1.norm().max(e2.norm()).max((r - q).norm());
            if double_area <= negligible * longest || double_area.is_nan() {
                continue;
            }
            let [a, b, c] = mesh.triangle(f).map(|v| uv[v.index()]);
            let (d1, d2) = (b - a, c - a);
            let determinant = d1.perp(&d2);
            // The map from the plane to the surface, both with their first edge as axis: triangular, so
            // that a needle's height is not lost among its lengths.
            let (x, u) = (e1.norm(), d1.norm());
            let shear = (e1.dot(&e2) / x - x / u * (d1.dot(&d2) / u)) / (determinant / u);
            let squared_norm = (x / u).powi(2) + shear.powi(2) + (double_area / x / (determinant / u)).powi(2);
            sums.energy += 0.25 * double_area * squared_norm;
            sums.surface += 0.5 * double_area;
            sums.plane += 0.5 * determinant;
            sums.plane_unsigned += 0.5 * determinant.abs();
        }
        sums
    }
}

/// L-infinity stretch of a chart scaled to equal area: the greatest 1/σ₂ of its faces times √(ΣA₂/ΣA₃). At
/// least 1 for a chart without flips; infinite where a face has no area. O(n).
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
#[must_use]
pub(crate) fn linf_stretch(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
    assert_eq!(
        (rest.len(), uv.len()),
        (mesh.face_count(), mesh.vertex_count()),
        "a rest triangle a face, a point a vertex"
    );
    let least = mesh
        .triangles()
        .iter()
        .zip(rest)
        .map(|(t, r)| singular_values(&r.jacobian(t.map(|v| uv[v.index()])))[1])
        .fold(f64::INFINITY, f64::min);
    (plane_area(mesh, uv) / surface_area(rest)).sqrt() / least
}

/// Scales `uv` so that the chart covers the area of its surface; leaves it alone where its signed area
/// is not positive. Rounding may flip a triangle of almost no area: check afterwards. O(n).
pub(crate) fn rescale_to_equal_area(mesh: &TriMesh, rest: &[RestTriangle], uv: &mut [Point2<f64>]) {
    let scale = (surface_area(rest) / plane_area(mesh, uv)).sqrt();
    if scale.is_finite() && scale > 0.0 {
        for p in uv {
            *p *= scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::grid;
    use nalgebra::Point3;

    #[test]
    fn needles_count_as_they_are() {
        // Too thin for a rest triangle; laid down twice as wide.
        let mesh = grid(1, 1, |x, y| Point3::new(x, 1e-5 * y, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        let uv: Vec<_> = mesh.positions().iter().map(|p| Point2::new(p.x, 2.0 * p.y)).collect();
        assert!(l2_stretch(&mesh, &rest, &uv) > 5.0);
        assert!((l2_of_positions(&mesh, &uv, 1e-8) - 1.25_f64.sqrt()).abs() < 1e-9);
        assert!(l2_of_positions(&mesh, &uv, 1e-4).is_nan());
    }

    #[test]
    fn measures_of_a_known_map_do_not_depend_on_scale() {
        let mesh = grid(4, 3, |x, y| Point3::new(x, y, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        for scale in [1.0, 0.01, 300.0] {
            let mut uv: Vec<_> =
                mesh.positions().iter().map(|p| Point2::new(2.0 * scale * p.x, 0.5 * scale * p.y)).collect();
            // σ = 2, ½: e = ½(¼ + 4), equal area.
            assert!((l2_stretch(&mesh, &rest, &uv) - 2.125_f64.sqrt()).abs() < 1e-12);
            assert!((linf_stretch(&mesh, &rest, &uv) - 2.0).abs() < 1e-12);
            rescale_to_equal_area(&mesh, &rest, &mut uv);
            assert!((plane_area(&mesh, &uv) - 12.0).abs() < 1e-12);
        }
        let uv: Vec<_> = mesh.positions().iter().map(|p| Point2::new(2.0 * p.x + 0.3 * p.y, 0.5 * p.y)).collect();
        assert!((l2_of_positions(&mesh, &uv, 1e-8) - l2_stretch(&mesh, &rest, &uv)).abs() < 1e-12);
        assert_eq!(l2_unsigned(&mesh, &uv, 1e-8), l2_of_positions(&mesh, &uv, 1e-8));
        let uv = vec![Point2::origin(); mesh.vertex_count()];
        assert!(!l2_stretch(&mesh, &rest, &uv).is_finite());
        assert_eq!(l2_unsigned(&mesh, &uv, 1e-8), f64::INFINITY);
    }

    #[test]
    fn folds_count_as_their_mirror_image_and_collapses_as_infinite() {
        let mesh = grid(4, 1, |x, y| Point3::new(x, y, 0.0));
        let folded: Vec<_> = mesh.positions().iter().map(|p| Point2::new((p.x - 2.0).abs(), p.y)).collect();
        assert!((l2_unsigned(&mesh, &folded, 1e-8) - 1.0).abs() < 1e-12, "two isometric halves, one over the other");
        assert!(!l2_of_positions(&mesh, &folded, 1e-8).is_normal(), "their signed areas cancel");
        let flat: Vec<_> = mesh.positions().iter().map(|p| Point2::new(p.x.min(3.0), p.y)).collect();
        assert_eq!(l2_unsigned(&mesh, &flat, 1e-8), f64::INFINITY);
    }
}
