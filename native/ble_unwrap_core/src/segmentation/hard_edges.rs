//! Parts between hard edges: the walls, caps and flats of which a manufactured thing is made. Where its edges are bevelled, `walls` finds them.

use nalgebra::Vector3;

use crate::mesh::{HalfedgeId, TriMesh, VertexId, measure};

use super::Segmentation;
use super::walls::{self, LEAST_FACES, LEAST_PLANE, MOST_LEANING};

/// Normals of two faces on a hard edge are at least so many degrees apart: the sides of a hexagonal nut are 60°, those of
/// an octagonal tube 45°, which is meant to be round.
const HARD: f64 = 50.0;
/// The same on what is known to be manufactured: a bevel of one strip has 45°.
const HARD_OF_MANUFACTURED: f64 = 40.0;
/// A part unrolls if the angle defects at its inner vertices add up to at most so many radians. The largest one does not count: it may
/// be the apex of a cone. A spherical cap of so much curvature, which ends 23° from its pole, has an L2 stretch of 1.0001 in the plane,
/// and one that ends at 40° has 1.0008.
const MOST_CURVED: f64 = 0.5;
/// A thing is manufactured if parts that unroll have at least this share of its area; then all of them are kept. With a half in its place a
/// table with barrels and bottles on it has twice as much seam, and a fan disk 1.4 times.
const LEAST_SHARE: f64 = 0.8;

/// The parts between the hard edges of a thing that unroll without stretch: a number from 1 on for each face, and 0 for
/// faces that are in none. Empty where there are no such parts or the whole is one. Of what is not known to be manufactured, parts count
/// only if most of it is made of them; else planes and walls do, with the bevels around planes, if most of it is made of these
/// ([`walls::planes_and_walls`]), or large planes between hard edges; and none do where there are guides: these say where to cut. O(n log n).
pub(crate) fn unrolling_parts(mesh: &TriMesh, polygon: &[u32], is_manufactured: bool) -> Vec<u32> {
    if mesh.has_guides() && !is_manufactured {
        return Vec::new();
    }
    let (normals, areas) = (measure::face_normals(mesh), measure::face_areas(mesh));
    let least = if is_manufactured { HARD_OF_MANUFACTURED } else { HARD }.to_radians().cos();
    let is_edge = |h: HalfedgeId| {
        let (f, g) = (h.face().index(), mesh.twin(h).face().index());
        // A face without area has no normal, and no edge of it is hard.
        areas[f].min(areas[g]) > 0.0 && polygon[f] != polygon[g] && normals[f].dot(&normals[g]) <= least
    };
    if areas.iter().all(|area| *area <= 0.0) {
        return Vec::new();
    }
    let between_bevels =
        || if is_manufactured { None } else { walls::planes_and_walls(mesh, polygon, &normals, &areas, &is_edge) };
    let (part, parts) = connected(mesh, |h| !is_edge(h));
    if parts < 2 {
        return between_bevels().unwrap_or_default();
    }
    let mut area = vec![0.0; parts];
    areas.iter().zip(&part).for_each(|(a, p)| area[*p as usize] += a);
    let total: f64 = area.iter().sum();
    let unrolls = unrolling(mesh, &part, parts);
    let unrolled: f64 = (0..parts).filter(|&p| unrolls[p]).map(|p| area[p]).sum();
    let are_parts = parts * LEAST_FACES <= mesh.face_count() && unrolled >= LEAST_SHARE * total;
    if !are_parts && let Some(found) = between_bevels() {
        return found;
    }
    let is_taken: Vec<bool> = if is_manufactured || are_parts {
        unrolls
    } else {
        let is_plane = plane(&normals, &areas, &part, parts);
        (0..parts).map(|p| is_plane[p] && area[p] >= LEAST_PLANE * total).collect()
    };
    if !is_taken.contains(&true) {
        return Vec::new();
    }
    part.iter().map(|&p| if is_taken[p as usize] { p + 1 } else { 0 }).collect()
}

/// Divides a mesh into its unrolling parts and what else there is, as far as that is connected; `None` where it is all one.
pub(crate) fn between_parts(mesh: &TriMesh) -> Option<Segmentation> {
    let mut faces = mesh.faces();
    let first = mesh.part(faces.next()?);
    if faces.all(|f| mesh.part(f) == first) {
        return None;
    }
    let (label, parts) = connected(mesh, |h| mesh.part(h.face()) == mesh.part(mesh.twin(h).face()));
    Some(Segmentation { label, parts })
}

/// A number for each face, the same for two faces that are joined by edges over which one may go, and how many there are.
fn connected(mesh: &TriMesh, is_open: impl Fn(HalfedgeId) -> bool) -> (Vec<u32>, usize) {
    const NONE: u32 = u32::MAX;
    let mut label = vec![NONE; mesh.face_count()];
    let mut parts = 0;
    let mut open = Vec::new();
    for first in mesh.faces() {
        if label[first.index()] != NONE {
            continue;
        }
        label[first.index()] = parts;
        open.push(first);
        while let Some(f) = open.pop() {
            for h in f.halfedges().into_iter().filter(|&h| !mesh.is_boundary(h) && is_open(h)) {
                let beyond = mesh.twin(h).face();
                if label[beyond.index()] == NONE {
                    label[beyond.index()] = parts;
                    open.push(beyond);
                }
            }
        }
        parts += 1;
    }
    (label, parts as usize)
}

/// Whether a mesh as a whole is flat, a cylinder, a cone or the like.
pub(crate) fn is_developable(mesh: &TriMesh) -> bool {
    unrolling(mesh, &vec![0; mesh.face_count()], 1) == [true]
}

/// Whether each part is flat, a cylinder, a cone or the like.
fn unrolling(mesh: &TriMesh, part: &[u32], parts: usize) -> Vec<bool> {
    let defects = measure::angle_defects(mesh);
    let (mut sum, mut largest) = (vec![0.0; parts], vec![0.0f64; parts]);
    let own = |v: VertexId| {
        let mut around = mesh.outgoing(v).map(|h| part[h.face().index()]);
        let first = around.next()?;
        (!mesh.is_boundary_vertex(v) && around.all(|p| p == first)).then_some(first as usize)
    };
    for v in mesh.vertices() {
        if let Some(p) = own(v) {
            let curved = defects[v.index()].abs();
            sum[p] += curved;
            largest[p] = largest[p].max(curved);
        }
    }
    sum.iter().zip(&largest).map(|(s, l)| s - l <= MOST_CURVED).collect()
}

/// Whether each part lies in a plane.
fn plane(normals: &[Vector3<f64>], areas: &[f64], part: &[u32], parts: usize) -> Vec<bool> {
    let mut sum = vec![Vector3::zeros(); parts];
    for ((n, a), p) in normals.iter().zip(areas).zip(part) {
        sum[*p as usize] += n * *a;
    }
    let least = MOST_LEANING.to_radians().cos();
    let mut is_plane = vec![true; parts];
    for ((n, a), p) in normals.iter().zip(areas).zip(part) {
        // Faces without area have no normal.
        let leans = *a > 0.0 && n.dot(&sum[*p as usize]) < least * sum[*p as usize].norm();
        is_plane[*p as usize] &= !leans;
    }
    is_plane
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::mesh::test_surfaces::{self, turned};
    use nalgebra::{Point3, Rotation3, Vector3};

    pub(crate) fn moved(mesh: &TriMesh) -> TriMesh {
        let turn = Rotation3::new(Vector3::new(0.3, -1.1, 0.7));
        let positions: Vec<Point3<f64>> = mesh.positions().iter().map(|p| turn * p * 1e-3).collect();
        let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        test_surfaces::mesh(&positions, &triangles)
    }

    /// How many parts a mesh comes apart into, and whether a face is in one that unrolls.
    pub(crate) fn parts(mesh: &TriMesh, polygon: &[u32], is_manufactured: bool) -> (usize, Vec<bool>) {
        let part = unrolling_parts(mesh, polygon, is_manufactured);
        let unrolls = mesh.faces().map(|f| part.get(f.index()).is_some_and(|p| *p != 0)).collect();
        let mesh = mesh.clone().with_parts(part);
        let Some(found) = between_parts(&mesh) else { return (1, unrolls) };
        let label = |h: HalfedgeId| found.label[h.face().index()];
        assert_eq!(connected(&mesh, |h| label(h) == label(mesh.twin(h))).1, found.parts, "each part is connected");
        for (f, p) in mesh.faces().zip(polygon) {
            let other = mesh.faces().zip(polygon).find(|(_, q)| *q == p).map(|(g, _)| g);
            assert_eq!(Some(found.label[f.index()]), other.map(|g| found.label[g.index()]), "polygons stay whole");
        }
        (found.parts, unrolls)
    }

    #[test]
    fn a_pin_is_a_wall_and_two_caps_as_quads_and_as_triangles() {
        let (mesh, quads) = turned(24, &[[1.0, 0.0], [1.0, 20.0]]);
        let triangles: Vec<u32> = (0..mesh.face_count() as u32).collect();
        for polygon in [&quads, &triangles] {
            for mesh in [&mesh, &moved(&mesh)] {
                let (count, unrolls) = parts(mesh, polygon, false);
                assert!(count == 3 && !unrolls.contains(&false));
            }
        }
    }

    #[test]
    fn a_cone_and_its_base_are_two_and_a_box_is_six() {
        let (cone, polygon) = turned(32, &[[1.0, 0.0], [0.5, 1.0], [0.01, 2.0]]);
        assert_eq!(parts(&cone, &polygon, false).0, 3, "base, wall and the small flat top");
        let cube = test_surfaces::cubes([3, 3, 3], |_| true);
        let polygon: Vec<u32> = (0..cube.face_count() as u32).map(|f| f / 2).collect();
        assert_eq!(parts(&cube, &polygon, false).0, 6);
    }

    #[test]
    fn of_what_is_round_only_large_planes_are_parts_unless_it_is_known_to_be_manufactured() {
        let ball = test_surfaces::sphere(3);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        assert_eq!(parts(&ball, &polygon, false).0, 1);
        assert_eq!(parts(&ball, &polygon, true).0, 1);
        // A barrel: its wall does not unroll, its caps are planes.
        let barrel: Vec<[f64; 2]> = (-4..=4).map(f64::from).map(|z| [1.0 - 0.02 * z * z, 0.3 * z]).collect();
        let (mesh, polygon) = turned(24, &barrel);
        let (count, unrolls) = parts(&mesh, &polygon, false);
        assert_eq!(count, 3);
        let is_cap = |p: [Point3<f64>; 3]| p[0].z == p[1].z && p[0].z == p[2].z;
        assert!(mesh.faces().all(|f| unrolls[f.index()] == is_cap(mesh.triangle_positions(f))));
        // With a rim that is not a plane and not large either.
        let rim = [&[[0.5, -1.0], [0.55, -0.98], [0.6, -1.0], [0.6, -1.2]], &barrel[..]].concat();
        let (mesh, polygon) = turned(24, &rim);
        assert!(parts(&mesh, &polygon, true).0 > parts(&mesh, &polygon, false).0);
    }

    #[test]
    fn where_guides_say_where_to_cut_hard_edges_do_not() {
        let (mesh, polygon) = turned(24, &[[1.0, 0.0], [1.0, 20.0]]);
        let marks = mesh.halfedges().map(|h| mesh.edge_length(h) > 19.0 && mesh.edge_length(h) < 20.01).collect();
        let guided = mesh.with_guides(marks);
        assert!(guided.has_guides() && unrolling_parts(&guided, &polygon, false).is_empty());
        assert!(!unrolling_parts(&guided, &polygon, true).is_empty(), "unless it is known to be manufactured");
    }
}
