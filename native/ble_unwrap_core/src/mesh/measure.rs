//! Lengths, areas and angles of triangles: free functions on points.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::{FaceId, TriMesh};

/// Angle defect, in radians, up to which the surface counts as flat at an inner vertex: half a degree.
pub(crate) const FLAT_DEFECT: f64 = 0.008_726_6;

/// Twice the area times the unit normal of a triangle.
#[inline]
#[must_use]
pub(crate) fn area_vector(p: [Point3<f64>; 3]) -> Vector3<f64> {
    (p[1] - p[0]).cross(&(p[2] - p[0]))
}

/// Area of a triangle.
#[inline]
#[must_use]
pub(crate) fn triangle_area(p: [Point3<f64>; 3]) -> f64 {
    0.5 * area_vector(p).norm()
}

/// Unit normal of a triangle; zero where it has no area.
#[inline]
#[must_use]
pub(crate) fn triangle_normal(p: [Point3<f64>; 3]) -> Vector3<f64> {
    area_vector(p).try_normalize(0.0).unwrap_or_else(Vector3::zeros)
}

/// The angle at `p[0]`, in radians; accurate for needles and caps, 0 where an edge has no length.
#[inline]
#[must_use]
pub(crate) fn corner_angle(p: [Point3<f64>; 3]) -> f64 {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    a.cross(&b).norm().atan2(a.dot(&b))
}

/// Area of each face.
#[must_use]
pub(crate) fn face_areas(mesh: &TriMesh) -> Vec<f64> {
    mesh.faces().map(|f| triangle_area(mesh.triangle_positions(f))).collect()
}

/// Total area, summed in face order.
#[must_use]
pub(crate) fn total_area(mesh: &TriMesh) -> f64 {
    mesh.faces().map(|f| triangle_area(mesh.triangle_positions(f))).sum()
}

/// Unit normal of each face; zero where a face has no area.
#[must_use]
pub(crate) fn face_normals(mesh: &TriMesh) -> Vec<Vector3<f64>> {
    mesh.faces().map(|f: FaceId| triangle_normal(mesh.triangle_positions(f))).collect()
}

/// 2π less the angles around each vertex, in radians: the curvature there, where it is inside.
#[must_use]
pub(crate) fn angle_defects(mesh: &TriMesh) -> Vec<f64> {
    let mut defect = vec![TAU; mesh.vertex_count()];
    for h in mesh.halfedges() {
        let corner = [h, h.next(), h.prev()].map(|h| mesh.position(mesh.from(h)));
        defect[mesh.from(h).index()] -= corner_angle(corner);
    }
    defect
}
