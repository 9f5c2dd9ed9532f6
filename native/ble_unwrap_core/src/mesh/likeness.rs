//! Meshes that look alike: the same polygons, up to a rigid motion or a mirror image.

use nalgebra::{Point3, Vector3};

use super::index::{HalfedgeId, VertexId};
use super::tri_mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Lengths are alike within this share of a mesh's extent: a thousandth is what an artist sees as the same.
const TOLERANCE: f64 = 1e-3;
/// Sides of polygons visited in search of a likeness are at most so many times as many as there are, so that the time stays linear.
const MOST_VISITS: usize = 24;
/// So many are visited however small the mesh is.
const FREE_VISITS: usize = 1 << 14;

/// What each side of the polygons of one mesh is in another.
#[derive(Clone, Debug)]
pub(crate) struct Likeness {
    /// The image of each side; none for diagonals.
    image: Vec<HalfedgeId>,
    /// The side of which each side of the other mesh is the image.
    source: Vec<HalfedgeId>,
    /// Whether the other is a mirror image: then sides run the other way there.
    pub(crate) is_mirrored: bool,
}

impl Likeness {
    /// A mirror image of a mesh in itself, each image of an image being the side itself.
    pub(super) fn of_itself(image: Vec<HalfedgeId>) -> Self {
        Self { source: image.clone(), image, is_mirrored: true }
    }

    /// The image of a side of a polygon; that of a diagonal is none.
    pub(crate) fn image(&self, h: HalfedgeId) -> HalfedgeId {
        self.image[h.index()]
    }

    /// The side of which this one of the other mesh is the image.
    pub(crate) fn source(&self, h: HalfedgeId) -> HalfedgeId {
        self.source[h.index()]
    }
}

/// What is compared of a connected mesh.
pub(crate) struct Shape<'a> {
    pub(super) mesh: &'a TriMesh,
    polygon: &'a [u32],
    /// Distance of each vertex from the middle.
    radius: Vec<f64>,
    /// Lengths nearer to each other than this are alike.
    pub(super) tolerance: f64,
    /// A side that leaves the vertex farthest from the middle.
    start: HalfedgeId,
    /// Whether only what counts the same for seams looks alike.
    tells_seams: bool,
}

impl<'a> Shape<'a> {
    /// `polygon` names the polygon of each face, and all faces of one are beside each other. `None` for a mesh without sides.
    pub(crate) fn new(mesh: &'a TriMesh, polygon: &'a [u32]) -> Option<Self> {
        let points = mesh.positions();
        let middle = Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64);
        let radius: Vec<f64> = points.iter().map(|p| (p - middle).norm()).collect();
        let farthest = mesh.vertices().max_by(|v, w| radius[v.index()].total_cmp(&radius[w.index()]).then(w.cmp(v)))?;
        let tolerance = TOLERANCE * 2.0 * radius[farthest.index()];
        let mut shape = Self { mesh, polygon, radius, tolerance, start: HalfedgeId::NONE, tells_seams: false };
        shape.start = mesh.outgoing(farthest).find(|&h| !shape.is_diagonal(h))?;
        Some(shape)
    }

    /// The same, alike only where seams count for the same.
    pub(crate) fn telling_seams(self) -> Self {
        Self { tells_seams: true, ..self }
    }

    pub(super) fn is_diagonal(&self, h: HalfedgeId) -> bool {
        let t = self.mesh.twin(h);
        !t.is_none() && self.polygon[t.face().index()] == self.polygon[h.face().index()]
    }

    /// The side of the same polygon that begins where this one ends. Around a polygon glued to itself there may be none, hence the bound.
    fn after(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let turn = |&h: &HalfedgeId| self.is_diagonal(h).then(|| self.mesh.twin(h).next());
        std::iter::successors(Some(h.next()), turn).take(self.mesh.face_count()).find(|&h| !self.is_diagonal(h))
    }

    /// The side of the same polygon that ends where this one begins.
    fn before(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let turn = |&h: &HalfedgeId| self.is_diagonal(h).then(|| self.mesh.twin(h).prev());
        std::iter::successors(Some(h.prev()), turn).take(self.mesh.face_count()).find(|&h| !self.is_diagonal(h))
    }

    /// Looks for images of the sides of this mesh in another, which may be this one itself, that `accept` makes something of.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` says so.
    pub(super) fn find<T>(
        &self,
        other: &Self,
        is_mirrored: bool,
        progress: &Progress,
        accept: impl Fn(&[HalfedgeId]) -> Option<T>,
    ) -> Result<Option<T>, Cancelled> {
        let comparison = Comparison { here: self, there: other, is_mirrored };
        let mut visits = MOST_VISITS * self.mesh.halfedge_count() + FREE_VISITS;
        let mut image = vec![HalfedgeId::NONE; self.mesh.halfedge_count()];
        for target in other.mesh.halfedges() {
            if other.is_diagonal(target) || !comparison.looks_alike(self.start, target) {
                continue;
            }
            progress.check()?;
            let mut known = Vec::new();
            if comparison.spread(target, &mut image, &mut known, &mut visits).is_some()
                && known.len() == self.side_count()
                && let Some(found) = accept(&image)
            {
                return Ok(Some(found));
            }
            known.iter().for_each(|h| image[h.index()] = HalfedgeId::NONE);
            if visits == 0 {
                break;
            }
        }
        Ok(None)
    }

    fn side_count(&self) -> usize {
        self.mesh.halfedges().filter(|&h| !self.is_diagonal(h)).count()
    }

    /// The likeness of this mesh to another, if they are the same up to a rigid motion or, if that is asked for, a mirror image; one in
    /// which each vertex of this mesh may be where it is in the other. It need not be found where a mesh looks alike from very many
    /// sides. O(n log n).
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` says so.
    pub(crate) fn likeness(
        &self,
        other: &Self,
        is_mirrored: bool,
        may_be: impl Fn(VertexId, VertexId) -> bool,
        progress: &Progress,
    ) -> Result<Option<Likeness>, Cancelled> {
        if self.mesh.halfedge_count() != other.mesh.halfedge_count() || self.side_count() != other.side_count() {
            return Ok(None);
        }
        self.find(other, is_mirrored, progress, |image| {
            let mut source = vec![HalfedgeId::NONE; other.mesh.halfedge_count()];
            for h in self.mesh.halfedges().filter(|h| !image[h.index()].is_none()) {
                let there = image[h.index()];
                let vertex = if is_mirrored { other.mesh.to(there) } else { other.mesh.from(there) };
                let source = &mut source[there.index()];
                if !source.is_none() || !may_be(self.mesh.from(h), vertex) {
                    return None;
                }
                *source = h;
            }
            Some(Likeness { image: image.to_vec(), source, is_mirrored })
        })
    }
}

/// Two meshes, compared polygon by polygon from a pair of sides on.
struct Comparison<'a> {
    here: &'a Shape<'a>,
    there: &'a Shape<'a>,
    is_mirrored: bool,
}

impl Comparison<'_> {
    /// Whether one side may be the image of another: as long, and its ends as far from the middle and as good for seams, where that is told.
    fn looks_alike(&self, here: HalfedgeId, there: HalfedgeId) -> bool {
        let (a, b) = (self.here, self.there);
        let alike = |x: f64, y: f64| (x - y).abs() <= a.tolerance;
        let ends = [a.mesh.from(here), a.mesh.to(here)];
        let mut other_ends = [b.mesh.from(there), b.mesh.to(there)];
        if self.is_mirrored {
            other_ends.reverse();
        }
        let are_alike = |(v, w): (VertexId, VertexId)| {
            alike(a.radius[v.index()], b.radius[w.index()])
                && (!a.tells_seams || a.mesh.seam_weight(v) == b.mesh.seam_weight(w))
        };
        ends.into_iter().zip(other_ends).all(are_alike)
            && alike(a.mesh.edge_length(here), b.mesh.edge_length(there))
            && a.mesh.is_guide(here) == b.mesh.is_guide(there)
            && a.mesh.is_boundary(here) == b.mesh.is_boundary(there)
    }

    /// Notes the images of sides from neighbour to neighbour, that of the first being `target`, and which ones were noted; `None` as soon
    /// as one does not look alike, or the visits are used up.
    fn spread(
        &self,
        target: HalfedgeId,
        image: &mut [HalfedgeId],
        known: &mut Vec<HalfedgeId>,
        visits: &mut usize,
    ) -> Option<()> {
        let (a, b) = (self.here, self.there);
        let mut open = vec![(a.start, target)];
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
                if *visits == 0 || !self.looks_alike(here, there) {
                    return None;
                }
                *visits -= 1;
                image[here.index()] = there;
                known.push(here);
                if !a.mesh.is_boundary(here) {
                    open.push((a.mesh.twin(here), b.mesh.twin(there)));
                }
                here = a.after(here)?;
                there = if self.is_mirrored { b.before(there)? } else { b.after(there)? };
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
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::mesh::{FaceId, test_surfaces};

    /// A sheet of quads without any symmetry, after a map of its positions and with its faces in another order.
    fn sheet(place: impl Fn(Point3<f64>) -> Point3<f64>, is_mirrored: bool) -> (TriMesh, Vec<u32>) {
        let flat = test_surfaces::grid(6, 5, [6.0, 5.0], 0.0);
        let height = |p: &Point3<f64>| 0.05 * p.x * p.x + 0.02 * p.y.powi(3) + 0.1 * (p.x * p.y).sin();
        let positions: Vec<_> = flat.positions().iter().map(|p| place(Point3::new(p.x, p.y, height(p)))).collect();
        // Quads stay whole: two triangles at a time, the last quad first.
        let turned = |t: &[VertexId; 3]| {
            let [a, b, c] = t.map(|v| v.index() as u32);
            if is_mirrored { [a, c, b] } else { [a, b, c] }
        };
        let quads: Vec<_> = flat.triangles().chunks(2).rev().collect();
        let triangles: Vec<_> = quads.into_iter().flatten().map(turned).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        (mesh, polygon)
    }

    fn likeness(a: &(TriMesh, Vec<u32>), b: &(TriMesh, Vec<u32>), is_mirrored: bool) -> Option<Likeness> {
        let [a, b] = [a, b].map(|(mesh, polygon)| Shape::new(mesh, polygon).expect("it has sides"));
        a.likeness(&b, is_mirrored, |_, _| true, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn a_moved_copy_is_alike_and_a_mirrored_one_only_if_mirror_images_are_asked_for() {
        let turn = Rotation3::from_euler_angles(0.4, -1.0, 2.0);
        let original = sheet(|p| p, false);
        let moved = sheet(|p| turn * p + Vector3::new(50.0, 3.0, -8.0), false);
        let mirrored = sheet(|p| turn * Point3::new(-p.x, p.y, p.z), true);
        assert!(likeness(&original, &moved, true).is_none() && likeness(&original, &mirrored, false).is_none());
        for (copy, is_mirrored) in [(&moved, false), (&mirrored, true)] {
            let found = likeness(&original, copy, is_mirrored).expect("they are alike");
            for h in original.0.halfedges() {
                let image = found.image(h);
                if image.is_none() {
                    continue;
                }
                assert_eq!(found.source(image), h);
                assert!((original.0.edge_length(h) - copy.0.edge_length(image)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn what_is_painted_differently_is_not_alike_where_that_is_told() {
        let original = sheet(|p| p, false);
        let painted = |mesh: &TriMesh| {
            let weights = mesh.positions().iter().map(|p| if p.x > 2.0 { 10.0 } else { 1.0 }).collect();
            mesh.clone().with_seam_weights(weights)
        };
        let copy = (painted(&original.0), original.1.clone());
        let telling = |a: &(TriMesh, Vec<u32>), b: &(TriMesh, Vec<u32>)| {
            let [a, b] = [a, b].map(|(mesh, polygon)| Shape::new(mesh, polygon).expect("it has sides").telling_seams());
            a.likeness(&b, false, |_, _| true, &Progress::new()).expect("not cancelled")
        };
        assert!(likeness(&original, &copy, false).is_some());
        assert!(telling(&original, &copy).is_none() && telling(&copy, &copy).is_some());
    }

    #[test]
    fn what_differs_anywhere_is_not_alike() {
        let original = sheet(|p| p, false);
        let dented = sheet(|p| if (p.x, p.y) == (2.0, 3.0) { p + Vector3::z() * 0.3 } else { p }, false);
        let larger = sheet(|p| p * 1.01, false);
        for other in [dented, larger] {
            assert!(likeness(&original, &other, false).is_none());
        }
        let faces: Vec<FaceId> = original.0.faces().skip(2).collect();
        let part = (original.0.submesh(&faces, |_| false).0, original.1[2..].to_vec());
        assert!(likeness(&original, &part, false).is_none());
        let marks = original.0.halfedges().map(|h| h.index() == 0 && original.0.is_boundary(h)).collect();
        let guided = (original.0.clone().with_guides(marks), original.1.clone());
        assert!(likeness(&original, &guided, false).is_none() == guided.0.has_guides());
    }

    #[test]
    fn of_several_likenesses_one_is_found_that_may_be() {
        let ball = test_surfaces::sphere(1);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        let shape = Shape::new(&ball, &polygon).expect("it has sides");
        let at = |v: VertexId| ball.position(v);
        // One of the planes between two vertices in which the ball is mirrored.
        let between = |w: VertexId| (at(w) - at(VertexId::new(0))).normalize();
        let is_image = |normal: Vector3<f64>, v: VertexId, w: VertexId| {
            (at(v) - normal * (2.0 * normal.dot(&at(v).coords)) - at(w)).norm() < 1e-6
        };
        let is_mirror = |n: &Vector3<f64>| ball.vertices().all(|v| ball.vertices().any(|w| is_image(*n, v, w)));
        let normal = ball.vertices().skip(1).map(between).find(is_mirror).expect("a ball has many");
        let is_image = |v: VertexId, w: VertexId| is_image(normal, v, w);
        let found = shape.likeness(&shape, true, is_image, &Progress::new()).expect("not cancelled");
        let found = found.expect("one likeness of many is this mirror image");
        assert!(ball.halfedges().all(|h| is_image(ball.from(h), ball.to(found.image(h)))));
        let never = shape.likeness(&shape, true, |_, _| false, &Progress::new()).expect("not cancelled");
        assert!(never.is_none());
    }

    #[test]
    fn round_bodies_are_alike_from_many_sides_and_found_soon() {
        let ball = test_surfaces::sphere(4);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        let ball = (ball, polygon);
        assert!(likeness(&ball, &ball, false).is_some() && likeness(&ball, &ball, true).is_some());
    }
}
