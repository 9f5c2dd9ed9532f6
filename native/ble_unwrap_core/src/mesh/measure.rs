//! Lengths, areas and angles of triangles: free functions on points.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::{FaceId, TriMesh};

/// Angle defect, in radians, up to which the surface counts as flat at an inner vertex: half a degree.
pub(crate) const FLAT_DEFECT: f64 = 0.008_726_6;

/// The vertices of a ball are equally far from its middle up to this share of that.
const ROUND: f64 = 0.03;
/// The middle of a face of a ball lies at least at this share of the radius: one of a sphere of 16 by 8 faces at 0.96, one of an icosahedron at 0.79.
const LEAST_ROUND: f64 = 0.85;

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

/// Whether a mesh is closed and all but round: all its vertices are equally far from the middle of its surface, and so, nearly, are its faces. O(n).
#[must_use]
pub(crate) fn is_ball(mesh: &TriMesh) -> bool {
    let middles =
        || mesh.faces().map(|f| mesh.triangle_positions(f)).map(|[a, b, c]| (a.coords + b.coords + c.coords) / 3.0);
    let areas = face_areas(mesh);
    let total: f64 = areas.iter().sum();
    let middle = middles().zip(&areas).map(|(p, area)| p * *area).sum::<Vector3<f64>>() / total;
    let count = mesh.vertex_count() as f64;
    let radius = mesh.positions().iter().map(|p| (p.coords - middle).norm()).sum::<f64>() / count;
    let is_at = |p: Vector3<f64>, least: f64| {
        let share = (p - middle).norm() / radius;
        share >= least && share <= 1.0 + ROUND
    };
    total > 0.0
        && mesh.halfedges().all(|h| !mesh.is_boundary(h))
        && mesh.positions().iter().all(|p| is_at(p.coords, 1.0 - ROUND))
        && middles().all(|p| is_at(p, LEAST_ROUND))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;

    #[test]
    fn a_ball_is_one_wherever_it_is_and_whatever_else_has_corners_on_a_sphere_is_none() {
        let ball = test_surfaces::sphere(3);
        let moved = |mesh: &TriMesh, to: &dyn Fn(&Point3<f64>) -> Point3<f64>| {
            let positions: Vec<Point3<f64>> = mesh.positions().iter().map(to).collect();
            let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
            test_surfaces::mesh(&positions, &triangles)
        };
        assert!(is_ball(&ball) && is_ball(&moved(&ball, &|p| p * 7.0 + Vector3::new(100.0, -3.0, 2.0))));
        assert!(!is_ball(&moved(&ball, &|p| Point3::new(p.x, p.y, 1.2 * p.z))), "an egg");
        assert!(!is_ball(&test_surfaces::sphere(0)) && !is_ball(&test_surfaces::cubes([1, 1, 1], |_| true)));
        let most: Vec<FaceId> = ball.faces().skip(1).collect();
        assert!(!is_ball(&ball.submesh(&most, |_| false).0), "it has a hole");
        assert!(!is_ball(&TriMesh::default()));
    }
}
