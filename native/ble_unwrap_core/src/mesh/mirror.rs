//! A mirror plane of a mesh, across which its polygons are mirror images, too.

use std::cell::RefCell;

use nalgebra::{Point3, Vector3};

use super::index::{FaceId, HalfedgeId, VertexId};
use super::likeness::{Likeness, Shape};
use super::tri_mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Seams count for about the same on both sides of a plane if they count for so many times as much on one in the mean. How far a vertex can be seen
/// is known from a sample of directions, which differs by less.
const MOST_UNEVEN: f64 = 1.25;

/// A plane that mirrors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    point: Point3<f64>,
    normal: Vector3<f64>,
}

impl Plane {
    /// The one in which two points mirror each other; `None` where they are one.
    fn between(p: Point3<f64>, q: Point3<f64>) -> Option<Self> {
        let normal = (q - p).try_normalize(f64::MIN_POSITIVE)?;
        Some(Self { point: nalgebra::center(&p, &q), normal })
    }

    /// The mirror image of a point.
    pub(crate) fn mirrored(&self, p: Point3<f64>) -> Point3<f64> {
        p - self.normal * (2.0 * self.normal.dot(&(p - self.point)))
    }
}

/// The two halves of a mesh, each the mirror image of the other, with lines of edges between them.
#[derive(Clone, Debug)]
pub(crate) struct Mirror {
    /// Of the mesh to itself: the image of an image is the side itself.
    pub(crate) likeness: Likeness,
    /// For each face whether it is in the half of the first face.
    in_first: Vec<bool>,
}

impl Mirror {
    /// The faces of the half that has the first face of the mesh, ascending.
    pub(crate) fn first_half(&self) -> Vec<FaceId> {
        (0..self.in_first.len()).filter(|&f| self.in_first[f]).map(FaceId::new).collect()
    }

    /// Whether a face is in the half of the first face.
    pub(crate) fn is_in_first(&self, f: FaceId) -> bool {
        self.in_first[f.index()]
    }

    /// The mirror plane, where the vertices of the mesh are at these positions.
    pub(crate) fn plane(&self, mesh: &TriMesh, positions: &[Point3<f64>]) -> Option<Plane> {
        let at = |v: VertexId| positions[v.index()];
        let pair = |h: HalfedgeId| {
            let image = self.likeness.image(h);
            (!image.is_none()).then(|| (at(mesh.from(h)), at(mesh.to(image))))
        };
        farthest_apart(mesh.halfedges().filter_map(pair))
    }

    /// The mesh on which a seam at each vertex counts for the geometric mean of what it counts for there and at its mirror image: seams come in
    /// pairs, and what is wished of one side only is to hold for both.
    pub(crate) fn with_even_seam_weights(&self, mesh: &TriMesh) -> TriMesh {
        let mut image: Vec<VertexId> = mesh.vertices().collect();
        for h in mesh.halfedges().filter(|&h| !self.likeness.image(h).is_none()) {
            // A side runs the other way in the mirror.
            image[mesh.from(h).index()] = mesh.to(self.likeness.image(h));
        }
        let vertices: Vec<VertexId> = mesh.vertices().collect();
        let pairs = mesh.seam_weights_of(&vertices).into_iter().zip(mesh.seam_weights_of(&image));
        let even = pairs.map(|(here, there)| (here * there).sqrt()).collect();
        mesh.clone().with_seam_weights(even)
    }

    /// Whether an edge lies in the mirror plane, where the two halves meet.
    pub(crate) fn is_between(&self, mesh: &TriMesh, h: HalfedgeId) -> bool {
        !mesh.is_boundary(h) && self.likeness.image(h) == mesh.twin(h)
    }
}

/// Looks for a mirror plane of a connected mesh that divides it into two connected halves along edges. `polygon` names the polygon of
/// each face, and all faces of one are beside each other. Where there are several, the first that is found across which seams count for about
/// the same, or else the first; it need not be found in meshes that look alike from very many sides. O(n log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn mirror(mesh: &TriMesh, polygon: &[u32], progress: &Progress) -> Result<Option<Mirror>, Cancelled> {
    let Some(shape) = Shape::new(mesh, polygon) else { return Ok(None) };
    let uneven = RefCell::new(None);
    let even = shape.find(&shape, true, progress, |image| {
        let is_there_and_back = |h: HalfedgeId| image[h.index()].is_none() || image[image[h.index()].index()] == h;
        let is_mirror = mesh.halfedges().all(is_there_and_back) && is_reflection(&shape, image);
        let in_first = is_mirror.then(|| halves(mesh, image)).flatten()?;
        let mirror = Mirror { likeness: Likeness::of_itself(image.to_vec()), in_first };
        if unevenness(mesh, image) <= MOST_UNEVEN.ln() {
            return Some(mirror);
        }
        uneven.borrow_mut().get_or_insert(mirror);
        None
    })?;
    Ok(even.or_else(|| uneven.into_inner()))
}

/// How many times as much, in the mean and as a logarithm, a seam counts for on one side of a mirror plane as on the other.
fn unevenness(mesh: &TriMesh, image: &[HalfedgeId]) -> f64 {
    let weight = |v: VertexId| f64::from(mesh.seam_weight(v)).ln();
    let sides = || mesh.halfedges().filter(|h| !image[h.index()].is_none());
    let apart = |h: HalfedgeId| (weight(mesh.from(h)) - weight(mesh.to(image[h.index()]))).abs();
    sides().map(apart).sum::<f64>() / sides().count().max(1) as f64
}

/// For each face whether it is on the side of the first face, where edges that are their own image divide the mesh into two.
fn halves(mesh: &TriMesh, image: &[HalfedgeId]) -> Option<Vec<bool>> {
    let mut in_first = vec![false; mesh.face_count()];
    *in_first.first_mut()? = true;
    let (mut open, mut count) = (vec![FaceId::new(0)], 1);
    while let Some(f) = open.pop() {
        for h in f.halfedges().into_iter().filter(|&h| !mesh.is_boundary(h)) {
            let t = mesh.twin(h);
            if image[h.index()] != t && !in_first[t.face().index()] {
                in_first[t.face().index()] = true;
                count += 1;
                open.push(t.face());
            }
        }
    }
    let is_other_half = |h: HalfedgeId| {
        let there = image[h.index()];
        there.is_none() || in_first[h.face().index()] != in_first[there.face().index()]
    };
    // The other half is as connected as its image.
    (2 * count == in_first.len() && mesh.halfedges().all(is_other_half)).then_some(in_first)
}

/// Whether one plane takes every vertex to its image.
fn is_reflection(shape: &Shape<'_>, image: &[HalfedgeId]) -> bool {
    let mesh = shape.mesh;
    let pairs = || {
        let sides = mesh.halfedges().filter(|h| !image[h.index()].is_none());
        sides.map(|h| (mesh.position(mesh.from(h)), mesh.position(mesh.to(image[h.index()]))))
    };
    let plane = farthest_apart(pairs());
    plane.is_some_and(|plane| pairs().all(|(p, q)| (plane.mirrored(p) - q).norm() <= shape.tolerance))
}

/// The plane between those two points of some pairs that are farthest apart.
fn farthest_apart(pairs: impl Iterator<Item = (Point3<f64>, Point3<f64>)>) -> Option<Plane> {
    let apart = |pair: &(Point3<f64>, Point3<f64>)| (pair.0 - pair.1).norm_squared();
    let (p, q) = pairs.max_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    Plane::between(p, q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;

    fn found(mesh: &TriMesh, polygon: &[u32]) -> Option<Mirror> {
        mirror(mesh, polygon, &Progress::new()).expect("not cancelled")
    }

    /// A sheet of quads with a height.
    fn sheet(n: usize, height: impl Fn(f64, f64) -> f64) -> (TriMesh, Vec<u32>) {
        let flat = test_surfaces::grid(n, n, [n as f64, n as f64], 0.0);
        let positions: Vec<_> = flat.positions().iter().map(|p| Point3::new(p.x, p.y, height(p.x, p.y))).collect();
        let triangles: Vec<_> = flat.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        (mesh, polygon)
    }

    #[test]
    fn halves_meet_in_a_line_of_edges_and_mirror_each_other() {
        // Even and odd across, but for x = 4 nothing is mirrored.
        let (mesh, polygon) = sheet(8, |x, y| (x - 4.0).powi(2) * 0.1 + 0.3 * y + 0.05 * y * y);
        let mirror = found(&mesh, &polygon).expect("a plane at x = 4");
        let plane = mirror.plane(&mesh, mesh.positions()).expect("a plane");
        assert!((plane.mirrored(Point3::new(1.0, 2.0, 3.0)) - Point3::new(7.0, 2.0, 3.0)).norm() < 1e-9);
        let half = mirror.first_half();
        assert_eq!(2 * half.len(), mesh.face_count());
        let on_plane = |v: VertexId| mesh.position(v).x == 4.0;
        for h in mesh.halfedges() {
            let image = mirror.likeness.image(h);
            if image.is_none() {
                continue;
            }
            assert_eq!(mirror.likeness.image(image), h);
            let [p, q] = [mesh.from(h), mesh.to(image)].map(|v| mesh.position(v));
            assert!(
                (p.x + q.x - 8.0).abs() < 1e-9 && (p.y - q.y).abs() < 1e-9,
                "quads may be divided by either diagonal"
            );
            assert_eq!(mirror.is_between(&mesh, h), on_plane(mesh.from(h)) && on_plane(mesh.to(h)));
        }
    }

    #[test]
    fn a_seam_counts_for_as_much_as_its_mirror_image() {
        let (mesh, polygon) = sheet(8, |x, y| (x - 4.0).powi(2) * 0.1 + 0.3 * y + 0.05 * y * y);
        let weight = |p: &Point3<f64>| (1.0 + p.x + 10.0 * p.y) as f32;
        let mesh = mesh.clone().with_seam_weights(mesh.positions().iter().map(weight).collect());
        let even = found(&mesh, &polygon).expect("a plane at x = 4").with_even_seam_weights(&mesh);
        let vertices: Vec<VertexId> = mesh.vertices().collect();
        for (v, found) in vertices.iter().zip(even.seam_weights_of(&vertices)) {
            let p = mesh.position(*v);
            let there = weight(&Point3::new(8.0 - p.x, p.y, 0.0));
            assert!((found.powi(2) - weight(&p) * there).abs() < 1e-4 * weight(&p) * there, "{p}: {found}");
        }
        let (plain, _) = sheet(8, |x, y| (x - 4.0).powi(2) * 0.1 + 0.3 * y + 0.05 * y * y);
        let even = found(&plain, &polygon).expect("a plane at x = 4").with_even_seam_weights(&plain);
        assert!(even.seam_weights_of(&vertices).is_empty(), "where all count alike nothing is kept");
    }

    #[test]
    fn of_several_planes_one_is_taken_across_which_seams_count_for_the_same() {
        let mesh = test_surfaces::cubes([4, 4, 4], |_| true);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        for axis in 0..3 {
            let weights = mesh.positions().iter().map(|p| if p[axis] < 2.0 { 10.0 } else { 1.0 }).collect();
            let painted = mesh.clone().with_seam_weights(weights);
            let mirror = found(&painted, &polygon).expect("a cube has many planes");
            let plane = mirror.plane(&painted, painted.positions()).expect("a plane");
            let [low, high] = [1.0, 3.0].map(|x| {
                let mut p = Point3::new(2.0, 2.0, 2.0);
                p[axis] = x;
                plane.mirrored(p)[axis]
            });
            assert!((low - 1.0).abs() < 1e-9 && (high - 3.0).abs() < 1e-9, "along {axis}");
        }
        // Where no plane respects them, there is one nevertheless.
        let weights = mesh.positions().iter().map(|p| 1.0 + (p.x + 3.0 * p.y + 10.0 * p.z) as f32).collect();
        assert!(found(&mesh.clone().with_seam_weights(weights), &polygon).is_some());
    }

    #[test]
    fn what_is_not_quite_mirrored_has_no_plane() {
        let height = |x: f64, y: f64| (x - 4.0).powi(2) * 0.1 + 0.3 * y + 0.05 * y * y;
        let dented = |x: f64, y: f64| height(x, y) + if (x, y) == (2.0, 5.0) { 0.2 } else { 0.0 };
        let (mesh, polygon) = sheet(8, dented);
        assert!(found(&mesh, &polygon).is_none());
        // By nothing that is seen it may differ.
        let nearly = |x: f64, y: f64| height(x, y) + if (x, y) == (2.0, 5.0) { 1e-3 } else { 0.0 };
        let (mesh, polygon) = sheet(8, nearly);
        assert!(found(&mesh, &polygon).is_some());
        // The plane goes through quads, not along edges.
        let (mesh, polygon) = sheet(7, |x, y| (x - 3.5).powi(2) * 0.1 + 0.3 * y + 0.05 * y * y);
        assert!(found(&mesh, &polygon).is_none());
        // Turned by half a turn it is the same, but mirrored it is not.
        let (mesh, polygon) = sheet(8, |x, y| 0.1 * (x - 4.0) * (y - 3.9) + 0.02 * (x - 4.0).powi(3));
        assert!(found(&mesh, &polygon).is_none());
        let ring = test_surfaces::torus(24, 12, 0.4);
        let quads: Vec<u32> = (0..ring.face_count() as u32).map(|f| f / 2).collect();
        assert!(found(&ring, &quads).is_some(), "a ring has many planes along edges");
        assert!(found(&TriMesh::default(), &[]).is_none());
    }
}
