//! The triangles that quads have by their other diagonal, as further elements of an energy.

use nalgebra::Point2;

use super::neighbourhood::Neighbourhood;
use crate::distortion::{RestTriangle, squared_stretch};
use crate::mesh::{Quad, TriMesh, VertexId};
use crate::predicates::orientation;

/// A quad is crowded if a half of it by its other diagonal has more squared stretch than this (1 is an isometry), and
/// [`CROWDED_OVER_OWN`] holds.
const CROWDED: f64 = 4.0;
/// A crowded quad has a half that is stretched so many times as much as any triangle by its own diagonal.
const CROWDED_OVER_OWN: f64 = 2.0;

/// Some quads of a chart, and the two triangles that each has by its other diagonal: where these are positive, and those by
/// the first diagonal, the quad is convex in the plane.
#[derive(Clone, Default)]
pub(super) struct OtherHalves {
    quads: Vec<Quad>,
    triangles: Vec<[VertexId; 3]>,
    rest: Vec<RestTriangle>,
    /// See [`OtherHalves::weight`]; less 1.
    lighter: f64,
}

impl OtherHalves {
    pub(super) fn new(mesh: &TriMesh, quads: &[Quad]) -> Self {
        let total: f64 = mesh.halfedges().map(|h| mesh.edge_length(h)).sum();
        let unit = total / mesh.halfedge_count().max(1) as f64;
        let triangles: Vec<[VertexId; 3]> = quads.iter().flat_map(|q| q.other_halves(mesh)).collect();
        let laid = |t: &[VertexId; 3]| RestTriangle::new(t.map(|v| mesh.position(v)), unit);
        let rest = triangles.iter().map(laid).collect();
        Self { quads: quads.to_vec(), triangles, rest, lighter: 0.0 }
    }

    /// The same with another weight.
    pub(super) fn weighing(&self, weight: f64) -> Self {
        Self { lighter: 1.0 - weight, ..self.clone() }
    }

    /// What an area counts in an energy beside that of a face. 1 minimises for both diagonals alike, less keeps the map good
    /// by the first.
    pub(super) fn weight(&self) -> f64 {
        1.0 - self.lighter
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

    /// The quads that are bent: one of their halves is not positive, by an exact test.
    pub(super) fn bent(&self, uv: &[Point2<f64>]) -> Vec<usize> {
        (0..self.quads.len()).filter(|&quad| self.is_bent(quad, uv)).collect()
    }

    pub(super) fn is_bent(&self, quad: usize, uv: &[Point2<f64>]) -> bool {
        !self.triangles[2 * quad..2 * quad + 2].iter().all(|t| {
            let [a, b, c] = t.map(|v| uv[v.index()]);
            orientation(a, b, c) > 0.0
        })
    }

    /// The quads that are bent, or so crowded at a corner that one of their halves is stretched far more than any face there.
    /// `rest` and `mesh` are the faces.
    pub(super) fn crowded(&self, mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> Vec<usize> {
        let stretch = |r: &RestTriangle, t: [VertexId; 3]| squared_stretch(&r.jacobian(t.map(|v| uv[v.index()])));
        let is_crowded = |&quad: &usize| {
            let half = |k: usize| stretch(&self.rest[k], self.triangles[k]);
            let worst = half(2 * quad).max(half(2 * quad + 1));
            if worst <= CROWDED {
                return false;
            }
            let h = self.quads[quad].diagonal;
            let own = [h, mesh.twin(h)].map(|h| stretch(&rest[h.face().index()], mesh.triangle(h.face())));
            worst > CROWDED_OVER_OWN * own[0].max(own[1])
        };
        (0..self.quads.len()).filter(|quad| self.is_bent(*quad, uv) || is_crowded(quad)).collect()
    }

    /// Without the quads that are bent.
    pub(super) fn without_bent(&self, uv: &[Point2<f64>]) -> Self {
        let mut out = Self { lighter: self.lighter, ..Self::default() };
        for (k, &quad) in self.quads.iter().enumerate().filter(|q| !self.is_bent(q.0, uv)) {
            out.quads.push(quad);
            out.triangles.extend(&self.triangles[2 * k..2 * k + 2]);
            out.rest.extend(&self.rest[2 * k..2 * k + 2]);
        }
        out
    }

    /// Those of the quads that lie in a part of the mesh, there.
    pub(super) fn part(&self, mesh: &TriMesh, part: &Neighbourhood) -> Self {
        let mut out = Self { lighter: self.lighter, ..Self::default() };
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
