//! Parts between hard edges: the walls, caps and flats of which a manufactured thing is made. Where its edges are bevelled, `walls` finds them.

use nalgebra::Vector3;

use crate::mesh::{HalfedgeId, TriMesh, VertexId, measure};

use super::Segmentation;
use super::walls::{self, LEAST_FACES, LEAST_PLANE, MOST_LEANING};

/// Normals of two faces on a hard edge are at least so many degrees apart: the sides of a hexagonal nut are 60°, those of
/// an octagonal tube 45°, which is meant to be round. Where a thing is divided more finely, so that round surfaces bend less from face to face, less may do
/// ([`SHARPER`]).
const HARD: f64 = 50.0;
/// The same on what is known to be manufactured: a bevel of one strip has 45°.
const HARD_OF_MANUFACTURED: f64 = 40.0;
/// A hard edge is bent at least so many times as much as is usual on the thing. With 3 the half of 50° counts on tubes of 44 sides and more, and a quarter of it on
/// those of 87; with 5 a part with drilled holes of 96 sides does not come apart where these cut spheres and rounds.
const SHARPER: f64 = 3.0;
/// The usual bend is the one that edges with this share of the length that is bent do not exceed. With a half in its place a fan disk with rounded edges, which bend by 11°
/// and more, comes apart, with 1.4 times as much seam.
const USUAL: f64 = 0.75;
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
/// ([`walls::planes_and_walls`]), or parts between edges that are bent less, but far more than is usual on the thing, or large planes between hard edges; and none do
/// where there are guides: these say where to cut. O(n log n).
pub(crate) fn unrolling_parts(mesh: &TriMesh, polygon: &[u32], is_manufactured: bool) -> Vec<u32> {
    if mesh.has_guides() && !is_manufactured {
        return Vec::new();
    }
    let (normals, areas) = (measure::face_normals(mesh), measure::face_areas(mesh));
    if areas.iter().all(|area| *area <= 0.0) {
        return Vec::new();
    }
    let bends = Bends { mesh, polygon, normals: &normals, areas: &areas };
    let least = if is_manufactured { HARD_OF_MANUFACTURED } else { HARD };
    let hard = Division::new(&bends, least);
    if hard.are_parts() {
        return hard.numbered(&hard.unrolls);
    }
    let is_hard = |h: HalfedgeId| bends.is_edge(h, least);
    if !is_manufactured && let Some(found) = walls::planes_and_walls(mesh, polygon, &normals, &areas, &is_hard) {
        return found;
    }
    // The cylinders and spheres of a part that was computed from these meet at any angle.
    let usual = bends.usual();
    let halved = std::iter::successors(Some(0.5 * least), |angle| Some(0.5 * angle));
    let finer = halved.take_while(|angle| *angle >= SHARPER * usual);
    if let Some(found) = finer.map(|angle| Division::new(&bends, angle)).find(Division::are_parts) {
        return found.numbered(&found.unrolls);
    }
    if hard.parts < 2 {
        return Vec::new();
    }
    if is_manufactured {
        return hard.numbered(&hard.unrolls);
    }
    let total: f64 = areas.iter().sum();
    let is_plane = plane(&normals, &areas, &hard.part, hard.parts);
    let is_taken: Vec<bool> = (0..hard.parts).map(|p| is_plane[p] && hard.area[p] >= LEAST_PLANE * total).collect();
    hard.numbered(&is_taken)
}

/// By how much a surface bends over its edges.
struct Bends<'a> {
    mesh: &'a TriMesh,
    polygon: &'a [u32],
    normals: &'a [Vector3<f64>],
    areas: &'a [f64],
}

impl Bends<'_> {
    /// The cosine of the bend over an edge between two polygons; `None` elsewhere.
    fn cosine(&self, h: HalfedgeId) -> Option<f64> {
        let beyond = self.mesh.twin(h);
        if beyond.is_none() {
            return None;
        }
        let (f, g) = (h.face().index(), beyond.face().index());
        // A face without area has no normal, and nothing bends there.
        let is_known = self.areas[f].min(self.areas[g]) > 0.0 && self.polygon[f] != self.polygon[g];
        is_known.then(|| self.normals[f].dot(&self.normals[g]))
    }

    /// Whether the surface bends by so many degrees at least.
    fn is_edge(&self, h: HalfedgeId, degrees: f64) -> bool {
        self.cosine(h).is_some_and(|cosine| cosine <= degrees.to_radians().cos())
    }

    /// The bend, in degrees, that most of what is bent does not exceed ([`USUAL`]); infinite where nothing is bent.
    fn usual(&self) -> f64 {
        let bend = |h: HalfedgeId| {
            let bend = self.cosine(h)?.clamp(-1.0, 1.0).acos();
            (bend > measure::FLAT_DEFECT).then(|| (bend, self.mesh.edge_length(h)))
        };
        let mut bends: Vec<(f64, f64)> = self.mesh.edges().filter_map(bend).collect();
        bends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let most = USUAL * bends.iter().map(|b| b.1).sum::<f64>();
        let mut below = 0.0;
        let usual = bends.iter().find(|b| {
            below += b.1;
            below >= most
        });
        usual.map_or(f64::INFINITY, |b| b.0.to_degrees())
    }
}

/// A mesh divided at all edges over which it bends by some angle.
struct Division {
    /// Part of each face.
    part: Vec<u32>,
    parts: usize,
    /// Of each part.
    area: Vec<f64>,
    /// Whether each part unrolls.
    unrolls: Vec<bool>,
}

impl Division {
    fn new(bends: &Bends<'_>, degrees: f64) -> Self {
        let (part, parts) = connected(bends.mesh, |h| !bends.is_edge(h, degrees));
        let mut area = vec![0.0; parts];
        bends.areas.iter().zip(&part).for_each(|(a, p)| area[*p as usize] += a);
        let unrolls = unrolling(bends.mesh, &part, parts);
        Self { part, parts, area, unrolls }
    }

    /// Whether the thing is made of these parts: there are not too many, and most of it unrolls.
    fn are_parts(&self) -> bool {
        let unrolled: f64 = self.area.iter().zip(&self.unrolls).filter(|(_, unrolls)| **unrolls).map(|(a, _)| a).sum();
        let total: f64 = self.area.iter().sum();
        self.parts >= 2 && self.parts * LEAST_FACES <= self.part.len() && unrolled >= LEAST_SHARE * total
    }

    /// The parts that are taken, from 1 on; empty where none is.
    fn numbered(&self, is_taken: &[bool]) -> Vec<u32> {
        if !is_taken.contains(&true) {
            return Vec::new();
        }
        self.part.iter().map(|&p| if is_taken[p as usize] { p + 1 } else { 0 }).collect()
    }
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
    fn what_is_finely_divided_has_edges_where_it_bends_far_more_than_elsewhere() {
        // Three cones that meet at 36°, and two caps.
        let profile = [[1.0, 0.0], [0.6, 1.0], [0.9, 2.2], [0.5, 3.2]];
        let fine = turned(96, &profile);
        let triangles: Vec<u32> = (0..fine.0.face_count() as u32).collect();
        for polygon in [&fine.1, &triangles] {
            for mesh in [&fine.0, &moved(&fine.0)] {
                for is_manufactured in [false, true] {
                    let (count, unrolls) = parts(mesh, polygon, is_manufactured);
                    assert!(count == 5 && !unrolls.contains(&false), "{count}");
                }
            }
        }
        let (coarse, polygon) = turned(12, &profile);
        let (_, unrolls) = parts(&coarse, &polygon, false);
        let count = unrolls.iter().filter(|unrolls| **unrolls).count();
        assert!(
            count <= 2 * 10,
            "beside bends of 30° one of 36° is none: at most the caps are parts, not {count} faces"
        );
    }

    #[test]
    fn the_usual_bend_is_that_of_most_of_the_length_that_is_bent() {
        // 60 lines along the wall with bends of 6°, against two rings of 90°.
        let (mesh, polygon) = turned(60, &[[1.0, 0.0], [1.0, 20.0]]);
        let (normals, areas) = (measure::face_normals(&mesh), measure::face_areas(&mesh));
        let bends = Bends { mesh: &mesh, polygon: &polygon, normals: &normals, areas: &areas };
        assert!((bends.usual() - 6.0).abs() < 1e-6, "{}", bends.usual());
        let sheet = test_surfaces::grid(4, 4, [1.0, 1.0], 0.0);
        let (normals, areas) = (measure::face_normals(&sheet), measure::face_areas(&sheet));
        let triangles: Vec<u32> = (0..sheet.face_count() as u32).collect();
        let flat = Bends { mesh: &sheet, polygon: &triangles, normals: &normals, areas: &areas };
        assert_eq!(flat.usual(), f64::INFINITY, "nothing is usual where nothing bends");
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
