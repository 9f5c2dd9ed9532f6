//! The triangles that quads have by their other diagonal, as further elements of an energy.

use nalgebra::Point2;

use super::foldover_free::is_triangle_collapsed;
use super::neighbourhood::Neighbourhood;
use super::overlap::orientation;
use crate::distortion::RestTriangle;
use crate::mesh::{Quad, TriMesh, VertexId};

/// Some quads of a chart, and the two triangles that each has by its other diagonal: where these are positive, and those by
/// the first diagonal, the quad is convex in the plane.
#[derive(Default)]
pub(super) struct OtherHalves {
    quads: Vec<Quad>,
    triangles: Vec<[VertexId; 3]>,
    rest: Vec<RestTriangle>,
}

impl OtherHalves {
    pub(super) fn new(mesh: &TriMesh, quads: Vec<Quad>) -> Self {
        let total: f64 = mesh.halfedges().map(|h| mesh.edge_length(h)).sum();
        let unit = total / mesh.halfedge_count().max(1) as f64;
        let triangles: Vec<[VertexId; 3]> = quads.iter().flat_map(|q| q.other_halves(mesh)).collect();
        let laid = |t: &[VertexId; 3]| RestTriangle::new(t.map(|v| mesh.position(v)), unit);
        let rest = triangles.iter().map(laid).collect();
        Self { quads, triangles, rest }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.quads.is_empty()
    }

    pub(super) fn quads(&self) -> &[Quad] {
        &self.quads
    }

    pub(super) fn triangles(&self) -> &[[VertexId; 3]] {
        &self.triangles
    }

    /// A rest triangle for each of them.
    pub(super) fn rest(&self) -> &[RestTriangle] {
        &self.rest
    }

    /// The ends of the other diagonals.
    pub(super) fn diagonals(&self) -> impl Iterator<Item = [VertexId; 2]> + '_ {
        self.triangles.iter().step_by(2).map(|&[_, b, d]| [b, d])
    }

    /// Whether a quad has a half that is turned over, by an exact test.
    pub(super) fn is_bent(&self, quad: usize, uv: &[Point2<f64>]) -> bool {
        self.triangles[2 * quad..2 * quad + 2].iter().any(|t| {
            let [a, b, c] = t.map(|v| uv[v.index()]);
            !(orientation(a, b, c) > 0.0)
        })
    }

    /// The quads that are bent, by an exact test.
    pub(super) fn bent(&self, uv: &[Point2<f64>]) -> Vec<usize> {
        (0..self.quads.len()).filter(|&quad| self.is_bent(quad, uv)).collect()
    }

    /// Whether a quad has a half that is turned over or as good as collapsed.
    pub(super) fn is_nearly_bent(&self, quad: usize, uv: &[Point2<f64>]) -> bool {
        (2 * quad..2 * quad + 2).any(|k| is_triangle_collapsed(&self.rest[k], self.triangles[k], uv))
    }

    /// Without the quads that are bent.
    pub(super) fn without_bent(&self, uv: &[Point2<f64>]) -> Self {
        let mut out = Self::default();
        for (k, &quad) in self.quads.iter().enumerate().filter(|q| !self.is_bent(q.0, uv)) {
            out.quads.push(quad);
            out.triangles.extend(&self.triangles[2 * k..2 * k + 2]);
            out.rest.extend(&self.rest[2 * k..2 * k + 2]);
        }
        out
    }

    /// Those of the quads that lie in a part of the mesh, there.
    pub(super) fn part(&self, mesh: &TriMesh, part: &Neighbourhood) -> Self {
        let mut out = Self::default();
        for (k, quad) in self.quads.iter().enumerate() {
            let (h, t) = (quad.diagonal, mesh.twin(quad.diagonal));
            let (Some(f), Some(_)) = (part.place(h.face()), part.place(t.face())) else { continue };
            let quad = Quad { diagonal: f.halfedges()[h.slot()] };
            out.triangles.extend(quad.other_halves(&part.mesh));
            out.rest.extend(&self.rest[2 * k..2 * k + 2]);
            out.quads.push(quad);
        }
        out
    }
}
