//! Stretch of a whole chart at its own best scale.
//!
//! Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3.

use nalgebra::Point2;

use crate::distortion::{RestTriangle, singular_values, squared_stretch};
use crate::mesh::TriMesh;

/// Total area on the surface, of the rest triangles.
#[must_use]
pub fn surface_area(rest: &[RestTriangle]) -> f64 {
    rest.iter().map(RestTriangle::area).sum()
}

/// Total signed area in the plane.
#[must_use]
pub fn plane_area(mesh: &TriMesh, uv: &[Point2<f64>]) -> f64 {
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
pub fn l2_stretch(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
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

/// L-infinity stretch of a chart scaled to equal area: the greatest 1/σ₂ of its faces times √(ΣA₂/ΣA₃). At
/// least 1 for a chart without flips; infinite where a face has no area. O(n).
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
#[must_use]
pub fn linf_stretch(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
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
pub fn rescale_to_equal_area(mesh: &TriMesh, rest: &[RestTriangle], uv: &mut [Point2<f64>]) {
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
        let uv = vec![Point2::origin(); mesh.vertex_count()];
        assert!(!l2_stretch(&mesh, &rest, &uv).is_finite());
    }
}
