//! Choosing one of the equally good embeddings: side, axes, scale.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::distortion::{RestTriangle, signed_double_area};
use crate::mesh::TriMesh;

/// Brings a chart into the standard pose: most of its surface unflipped, its longest axis along u, its centroid
/// at the origin, its area that of the surface.
///
/// Distances say nothing of side, direction and (for the printed model) scale; this decides:
/// mirrored if faces of more than half of the surface are flipped; rotated so that the area-weighted
/// scatter of the vertices is diagonal, larger first (the axes alignment by SVD of the paper,
/// section 6); scaled so that the unsigned UV area is the rest area. `uv` holds a position a vertex, `rest` a
/// triangle a face. A chart without area keeps its scale; nothing happens if a position is not finite. Flips of
/// single faces stay. O(n), deterministic.
///
/// # Panics
/// If `uv` or `rest` have the wrong length.
pub(crate) fn fix_gauge(mesh: &TriMesh, rest: &[RestTriangle], uv: &mut [Point2<f64>]) {
    assert_eq!(rest.len(), mesh.face_count(), "one rest triangle a face");
    assert_eq!(uv.len(), mesh.vertex_count(), "one position a vertex");
    let mut weight = vec![0.0; uv.len()];
    let (mut surface, mut upright, mut area_uv) = (0.0, 0.0, 0.0);
    for (f, rest) in mesh.faces().zip(rest) {
        let corners = mesh.triangle(f);
        let double = signed_double_area(corners.map(|v| uv[v.index()]));
        surface += rest.area();
        upright += if double > 0.0 { rest.area() } else { 0.0 };
        area_uv += 0.5 * double.abs();
        corners.iter().for_each(|v| weight[v.index()] += rest.area() / 3.0);
    }
    let centroid = uv.iter().zip(&weight).map(|(p, w)| p.coords * *w).sum::<Vector2<f64>>() / surface;
    let scatter: Matrix2<f64> =
        uv.iter().zip(&weight).map(|(p, w)| (p.coords - centroid) * (p.coords - centroid).transpose() * *w).sum();
    // The longest axis makes the angle ½ atan2(2xy, xx − yy), in (−90°, 90°], with u.
    let angle = 0.5 * (2.0 * scatter.m12).atan2(scatter.m11 - scatter.m22);
    let scale = if area_uv > 0.0 { (surface / area_uv).sqrt() } else { 1.0 };
    if !(angle.is_finite() && scale.is_finite() && centroid.iter().all(|c| c.is_finite())) {
        return;
    }
    let (sin, cos) = angle.sin_cos();
    let side = if 2.0 * upright < surface { -1.0 } else { 1.0 };
    for p in uv {
        let d = (p.coords - centroid) * scale;
        *p = Point2::new(cos * d.x + sin * d.y, side * (cos * d.y - sin * d.x));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedding::flat_shapes::rectangle;
    use nalgebra::Rotation2;

    #[test]
    fn side_axes_scale_and_place_are_standard() {
        let shape = rectangle(5, 13, 2.0, 6.0);
        let mesh = shape.mesh();
        let rest = RestTriangle::of_mesh(&mesh);
        for (mirror, angle, scale) in [(1.0, 0.0, 1.0), (-1.0, 0.7, 30.0), (1.0, 3.0, 1e-3), (-1.0, -2.0, 1.0)] {
            let turn = Rotation2::new(angle);
            let mut uv: Vec<_> = mesh
                .positions()
                .iter()
                .map(|p| turn * Point2::new(mirror * p.x, p.y) * scale + Vector2::new(9.0, 4.0))
                .collect();
            fix_gauge(&mesh, &rest, &mut uv);
            for f in mesh.faces() {
                let double = signed_double_area(mesh.triangle(f).map(|v| uv[v.index()]));
                assert!((0.5 * double / rest[f.index()].area() - 1.0).abs() < 1e-9);
            }
            let reach = |pick: fn(&Point2<f64>) -> f64| uv.iter().map(pick).fold(0.0, f64::max);
            assert!((reach(|p| p.x) - 3.0).abs() < 1e-8 && (reach(|p| p.y) - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn charts_without_area_or_with_bad_positions_do_no_harm() {
        let shape = rectangle(2, 2, 1.0, 1.0);
        let mesh = shape.mesh();
        let rest = RestTriangle::of_mesh(&mesh);
        let mut point = vec![Point2::new(3.0, 3.0); 4];
        fix_gauge(&mesh, &rest, &mut point);
        assert!(point.iter().all(|p| p.coords.norm() < 1e-12));
        let mut bad = vec![Point2::new(f64::NAN, 0.0); 4];
        fix_gauge(&mesh, &rest, &mut bad);
        assert!(bad[0].x.is_nan());
    }
}
