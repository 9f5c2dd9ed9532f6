//! A mirror plane of a mesh, across which its polygons are mirror images, too.

use nalgebra::{Point3, Vector3};

use super::index::{FaceId, HalfedgeId, VertexId};
use super::tri_mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Mirrored vertices lie where they should within this share of the diagonal of the box: a thousandth is what an artist sees as the same.
const TOLERANCE: f64 = 1e-3;
/// Sides of polygons visited in search of a plane are at most so many times as many as there are, so that the time stays linear.
const MOST_VISITS: usize = 24;
/// So many are visited however small the mesh is.
const FREE_VISITS: usize = 1 << 14;

/// The two halves of a mesh, each the mirror image of the other, with a line of edges between them.
#[derive(Clone, Debug)]
pub(crate) struct Mirror {
    /// The mirror image of each side of a polygon, which runs the other way; none for diagonals. The image of the image is the side itself.
    image: Vec<HalfedgeId>,
    /// For each face whether it is in the half of the first face.
    in_first: Vec<bool>,
}

impl Mirror {
    /// The mirror image of a side of a polygon; the image of a diagonal is none.
    pub(crate) fn image(&self, h: HalfedgeId) -> HalfedgeId {
        self.image[h.index()]
    }

    /// The faces of the half that has the first face of the mesh, ascending.
    pub(crate) fn first_half(&self) -> Vec<FaceId> {
        (0..self.in_first.len()).filter(|&f| self.in_first[f]).map(FaceId::new).collect()
    }

    /// Whether an edge lies in the mirror plane, which two halves share.
    pub(crate) fn is_between(&self, mesh: &TriMesh, h: HalfedgeId) -> bool {
        !mesh.is_boundary(h) && self.image(h) == mesh.twin(h)
    }
}

/// Looks for a mirror plane of a connected mesh that divides it into two connected halves along edges. `polygon` names the polygon of
/// each face, and all faces of one are beside each other. Where there are several, the first that is found; it need not be found
/// in meshes that look alike from very many sides. O(n log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn mirror(mesh: &TriMesh, polygon: &[u32], progress: &Progress) -> Result<Option<Mirror>, Cancelled> {
    let Some(shape) = Shape::new(mesh, polygon) else { return Ok(None) };
    let mut visits = MOST_VISITS * mesh.halfedge_count() + FREE_VISITS;
    let mut image = vec![HalfedgeId::NONE; mesh.halfedge_count()];
    for target in shape.candidates() {
        progress.check()?;
        if shape.find_image(target, &mut image, &mut visits) {
            if let Some(in_first) = shape.halves(&image)
                && shape.is_reflection(&image)
            {
                return Ok(Some(Mirror { image, in_first }));
            }
            image.fill(HalfedgeId::NONE);
        }
        if visits == 0 {
            break;
        }
    }
    Ok(None)
}

/// What is compared of a mesh.
struct Shape<'a> {
    mesh: &'a TriMesh,
    polygon: &'a [u32],
    /// Distance of each vertex from the middle.
    radius: Vec<f64>,
    /// Lengths nearer to each other than this are equal.
    tolerance: f64,
    /// A side that leaves the vertex farthest from the middle.
    start: HalfedgeId,
}

impl<'a> Shape<'a> {
    fn new(mesh: &'a TriMesh, polygon: &'a [u32]) -> Option<Self> {
        let points = mesh.positions();
        let middle = Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64);
        let radius: Vec<f64> = points.iter().map(|p| (p - middle).norm()).collect();
        let farthest = mesh.vertices().max_by(|v, w| radius[v.index()].total_cmp(&radius[w.index()]).then(w.cmp(v)))?;
        let mut shape = Self {
            mesh,
            polygon,
            tolerance: 2.0 * TOLERANCE * radius[farthest.index()],
            radius,
            start: HalfedgeId::NONE,
        };
        shape.start = mesh.outgoing(farthest).find(|&h| !shape.is_diagonal(h))?;
        Some(shape)
    }

    fn is_diagonal(&self, h: HalfedgeId) -> bool {
        let t = self.mesh.twin(h);
        !t.is_none() && self.polygon[t.face().index()] == self.polygon[h.face().index()]
    }

    /// The side of the same polygon that begins where this one ends. A polygon glued to itself goes round for ever, hence the bound.
    fn after(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let turn = |&h: &HalfedgeId| self.is_diagonal(h).then(|| self.mesh.twin(h).next());
        std::iter::successors(Some(h.next()), turn).take(self.mesh.face_count()).find(|&h| !self.is_diagonal(h))
    }

    /// The side of the same polygon that ends where this one begins.
    fn before(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let turn = |&h: &HalfedgeId| self.is_diagonal(h).then(|| self.mesh.twin(h).prev());
        std::iter::successors(Some(h.prev()), turn).take(self.mesh.face_count()).find(|&h| !self.is_diagonal(h))
    }

    fn equal(&self, a: f64, b: f64) -> bool {
        (a - b).abs() <= self.tolerance
    }

    /// Whether a side may be the mirror image of another: it runs from where that goes to, as far from the middle.
    fn looks_mirrored(&self, a: HalfedgeId, b: HalfedgeId) -> bool {
        let radius = |v: VertexId| self.radius[v.index()];
        self.equal(radius(self.mesh.from(a)), radius(self.mesh.to(b)))
            && self.equal(radius(self.mesh.to(a)), radius(self.mesh.from(b)))
            && self.equal(self.mesh.edge_length(a), self.mesh.edge_length(b))
            && self.mesh.is_guide(a) == self.mesh.is_guide(b)
            && self.mesh.is_boundary(a) == self.mesh.is_boundary(b)
    }

    /// The sides that may be the mirror image of the first one, in order.
    fn candidates(&self) -> impl Iterator<Item = HalfedgeId> + '_ {
        self.mesh.halfedges().filter(|&h| !self.is_diagonal(h) && self.looks_mirrored(self.start, h))
    }

    /// The image of every side if that of the first is `target`: polygon by polygon, from neighbour to neighbour. False as soon as
    /// something does not look so, or the visits are used up; then there are no images.
    fn find_image(&self, target: HalfedgeId, image: &mut [HalfedgeId], visits: &mut usize) -> bool {
        let mut known = Vec::new();
        let is_whole = self.spread(target, image, &mut known, visits).is_some() && {
            let has_image = |h: HalfedgeId| self.is_diagonal(h) || !image[h.index()].is_none();
            let is_there_and_back = |h: &HalfedgeId| image[image[h.index()].index()] == *h;
            self.mesh.halfedges().all(has_image) && known.iter().all(is_there_and_back)
        };
        if !is_whole {
            known.iter().for_each(|h| image[h.index()] = HalfedgeId::NONE);
        }
        is_whole
    }

    /// Notes the images of sides as far as they look mirrored, and which ones were noted; `None` where one does not.
    fn spread(
        &self,
        target: HalfedgeId,
        image: &mut [HalfedgeId],
        known: &mut Vec<HalfedgeId>,
        visits: &mut usize,
    ) -> Option<()> {
        let mut open = vec![(self.start, target)];
        while let Some((first, first_image)) = open.pop() {
            // All sides of a polygon have images, or none has.
            if !image[first.index()].is_none() {
                if image[first.index()] != first_image {
                    return None;
                }
                continue;
            }
            let (mut here, mut there) = (first, first_image);
            loop {
                *visits = visits.checked_sub(1)?;
                if !self.looks_mirrored(here, there) {
                    return None;
                }
                image[here.index()] = there;
                known.push(here);
                if !self.mesh.is_boundary(here) {
                    open.push((self.mesh.twin(here), self.mesh.twin(there)));
                }
                (here, there) = (self.after(here)?, self.before(there)?);
                if here == first {
                    break;
                }
            }
            if there != first_image {
                return None;
            }
        }
        Some(())
    }

    /// For each face whether it is on the side of the first face, where edges that are their own image divide the mesh into two.
    fn halves(&self, image: &[HalfedgeId]) -> Option<Vec<bool>> {
        let mut in_first = vec![false; self.mesh.face_count()];
        *in_first.first_mut()? = true;
        let (mut open, mut count) = (vec![FaceId::new(0)], 1);
        while let Some(f) = open.pop() {
            for h in f.halfedges().into_iter().filter(|&h| !self.mesh.is_boundary(h)) {
                let t = self.mesh.twin(h);
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
        (2 * count == in_first.len() && self.mesh.halfedges().all(is_other_half)).then_some(in_first)
    }

    /// Whether one plane takes every vertex to its image.
    fn is_reflection(&self, image: &[HalfedgeId]) -> bool {
        let pairs = || {
            let sides = self.mesh.halfedges().filter(|h| !image[h.index()].is_none());
            sides.map(|h| [self.mesh.from(h), self.mesh.to(image[h.index()])].map(|v| self.mesh.position(v)))
        };
        let farthest = pairs().max_by(|[p, q], [r, s]| (p - q).norm_squared().total_cmp(&(r - s).norm_squared()));
        let Some([p, q]) = farthest else { return false };
        let Some(normal) = (q - p).try_normalize(f64::MIN_POSITIVE) else { return false };
        let middle = nalgebra::center(&p, &q);
        let mirrored = |p: Point3<f64>| p - normal * (2.0 * normal.dot(&(p - middle)));
        pairs().all(|[p, q]| (mirrored(p) - q).norm() <= self.tolerance)
    }
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
        let half = mirror.first_half();
        assert_eq!(2 * half.len(), mesh.face_count());
        let on_plane = |v: VertexId| mesh.position(v).x == 4.0;
        for h in mesh.halfedges() {
            let image = mirror.image(h);
            if image.is_none() {
                continue;
            }
            assert_eq!(mirror.image(image), h);
            let [p, q] = [mesh.from(h), mesh.to(image)].map(|v| mesh.position(v));
            assert!(
                (p.x + q.x - 8.0).abs() < 1e-9 && (p.y - q.y).abs() < 1e-9,
                "quads may be divided by either diagonal"
            );
            assert_eq!(mirror.is_between(&mesh, h), on_plane(mesh.from(h)) && on_plane(mesh.to(h)));
        }
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
        let triangles = |mesh: &TriMesh| (0..mesh.face_count() as u32).collect::<Vec<_>>();
        let ball = test_surfaces::sphere(2);
        assert!(found(&ball, &triangles(&ball)).is_some(), "an icosahedron's sphere has planes along edges");
        assert!(found(&TriMesh::default(), &[]).is_none());
    }
}
