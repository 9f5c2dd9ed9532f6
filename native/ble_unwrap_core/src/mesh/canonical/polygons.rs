//! The polygons of a triangulated surface, by their sides.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::mesh::index::{FaceId, HalfedgeId};
use crate::mesh::tri_mesh::TriMesh;

/// The polygons of a mesh, whose sides are those half-edges that are no diagonals.
pub(super) struct Polygons<'a> {
    mesh: &'a TriMesh,
    /// The polygon of each face; ascending.
    of_face: Vec<u32>,
    /// The first face of each polygon, and the number of faces.
    first: Vec<u32>,
    /// The side after each side; none for diagonals.
    next: Vec<HalfedgeId>,
    /// The area of each polygon along its mean normal.
    area: Vec<Vector3<f64>>,
}

impl<'a> Polygons<'a> {
    /// `polygon` names the polygon of each face, ascending, and `corner` its corner of each half-edge, of which a polygon
    /// has none twice.
    pub(super) fn new(mesh: &'a TriMesh, polygon: &[u32], corner: &[u32]) -> Self {
        let mut of_face = Vec::with_capacity(polygon.len());
        let mut first = Vec::new();
        for (f, p) in polygon.iter().enumerate() {
            if f == 0 || polygon[f - 1] != *p {
                first.push(f as u32);
            }
            of_face.push(first.len() as u32 - 1);
        }
        first.push(polygon.len() as u32);
        // A polygon may be glued to itself along a side, too, as one around a hole is: then other corners of it meet.
        let is_diagonal = |h: HalfedgeId| {
            let t = mesh.twin(h);
            !t.is_none()
                && of_face[t.face().index()] == of_face[h.face().index()]
                && corner[t.index()] == corner[h.next().index()]
                && corner[t.next().index()] == corner[h.index()]
        };
        let after = |h: HalfedgeId| {
            if is_diagonal(h) {
                return HalfedgeId::NONE;
            }
            let mut next = h.next();
            // Triangles of a polygon are a disk, so that the turn around a corner ends.
            while is_diagonal(next) {
                next = mesh.twin(next).next();
            }
            next
        };
        let next = (0..mesh.halfedge_count()).into_par_iter().map(|h| after(HalfedgeId::new(h))).collect();
        let mut polygons = Self { mesh, of_face, first, next, area: Vec::new() };
        polygons.area = (0..polygons.len()).into_par_iter().map(|polygon| polygons.area_of(polygon)).collect();
        polygons
    }

    /// Number of polygons.
    pub(super) fn len(&self) -> usize {
        self.first.len() - 1
    }

    /// The faces of a polygon.
    pub(super) fn faces(&self, polygon: usize) -> Range<usize> {
        self.first[polygon] as usize..self.first[polygon + 1] as usize
    }

    /// The polygon of a half-edge.
    pub(super) fn of(&self, h: HalfedgeId) -> usize {
        self.of_face[h.face().index()] as usize
    }

    /// Whether the polygon of a half-edge has four sides.
    pub(super) fn is_quad(&self, h: HalfedgeId) -> bool {
        self.faces(self.of(h)).len() == 2
    }

    /// Whether a half-edge is a side.
    pub(super) fn is_side(&self, h: HalfedgeId) -> bool {
        !self.next[h.index()].is_none()
    }

    /// The side after a side.
    pub(super) fn next(&self, h: HalfedgeId) -> HalfedgeId {
        self.next[h.index()]
    }

    /// The sides of a polygon in order, from one of them.
    pub(super) fn around(&self, first: HalfedgeId) -> impl Iterator<Item = HalfedgeId> + Clone {
        let count = self.faces(self.of(first)).len() + 2;
        std::iter::successors(Some(first), |&h| Some(self.next(h))).take(count)
    }

    /// All sides of a polygon, in order.
    pub(super) fn sides(&self, polygon: usize) -> impl Iterator<Item = HalfedgeId> + '_ {
        let halfedges = self.faces(polygon).flat_map(|f| FaceId::new(f).halfedges());
        let first = halfedges.into_iter().find(|&h| self.is_side(h));
        first.into_iter().flat_map(|first| self.around(first))
    }

    /// The area of a polygon along its mean normal, which is that of its outline, however it is divided.
    pub(super) fn area_vector(&self, polygon: usize) -> Vector3<f64> {
        self.area[polygon]
    }

    fn area_of(&self, polygon: usize) -> Vector3<f64> {
        let Some(first) = self.sides(polygon).next() else { return Vector3::zeros() };
        let origin = self.mesh.position(self.mesh.from(first));
        let (mut sum, mut before) = (Vector3::zeros(), Vector3::zeros());
        for h in self.around(first) {
            let arm = self.mesh.position(self.mesh.to(h)) - origin;
            sum += before.cross(&arm) * 0.5;
            before = arm;
        }
        sum
    }

    /// How many triangles of its polygon meet at the corner that a side leaves: with its other corners, this says how
    /// the polygon is divided.
    pub(super) fn triangles_at(&self, side: HalfedgeId) -> u64 {
        let mut count = 1;
        let mut h = side.prev();
        while !self.is_side(h) {
            count += 1;
            h = self.mesh.twin(h).prev();
        }
        count
    }
}
