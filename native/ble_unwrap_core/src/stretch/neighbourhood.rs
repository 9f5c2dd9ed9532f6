//! The neighbourhood of a few bad triangles as a mesh of its own, so that mending them costs what lies there.

use nalgebra::{Point2, Vector2};

use crate::distortion::RestTriangle;
use crate::mesh::{FaceId, TriMesh, VertexId};

/// Some faces of a chart; the vertices towards all others are pinned.
pub(super) struct Neighbourhood {
    pub(super) mesh: TriMesh,
    pub(super) rest: Vec<RestTriangle>,
    /// The vertices that must not move: those of a face outside.
    pub(super) pinned: Vec<bool>,
    vertices: Vec<VertexId>,
    /// The face of the chart that each face is; ascending.
    faces: Vec<FaceId>,
}

impl Neighbourhood {
    /// The bad faces and all that are up to `rings` vertices away from one. O(n · rings), and no more for what it
    /// is used for than its own size asks.
    pub(super) fn new(mesh: &TriMesh, rest: &[RestTriangle], bad: &[bool], rings: usize) -> Self {
        let mut near = bad.to_vec();
        let mut touched = vec![false; mesh.vertex_count()];
        for _ in 0..rings {
            for f in mesh.faces().filter(|f| near[f.index()]) {
                mesh.triangle(f).iter().for_each(|v| touched[v.index()] = true);
            }
            for f in mesh.faces() {
                near[f.index()] |= mesh.triangle(f).iter().any(|v| touched[v.index()]);
            }
        }
        let faces: Vec<FaceId> = mesh.faces().filter(|f| near[f.index()]).collect();
        let (part, vertices) = mesh.submesh(&faces, |_| false);
        let at_edge = |v: &VertexId| mesh.outgoing(*v).any(|h| !near[h.face().index()]);
        Self {
            mesh: part,
            rest: faces.iter().map(|f| rest[f.index()]).collect(),
            pinned: vertices.iter().map(at_edge).collect(),
            vertices,
            faces,
        }
    }

    /// The face here that a face of the chart is, if it lies here.
    pub(super) fn place(&self, f: FaceId) -> Option<FaceId> {
        self.faces.binary_search(&f).ok().map(FaceId::new)
    }

    /// The vertices that must not move where the border of the chart, too, is to stay as it is.
    pub(super) fn pinned_and_border(&self) -> Vec<bool> {
        self.mesh.vertices().map(|v| self.pinned[v.index()] || self.mesh.is_boundary_vertex(v)).collect()
    }

    /// The neighbourhood's part of a map.
    pub(super) fn read(&self, uv: &[Point2<f64>]) -> Vec<Point2<f64>> {
        self.vertices.iter().map(|v| uv[v.index()]).collect()
    }

    /// Moves each vertex that is not pinned to the middle of its neighbours, so many times; those on the boundary only
    /// if they `retreat`, which takes them inwards.
    pub(super) fn relax(&self, uv: &mut [Point2<f64>], sweeps: usize, retreat: bool) {
        let mut part = self.read(uv);
        let stays = |v: VertexId| self.pinned[v.index()] || (!retreat && self.mesh.is_boundary_vertex(v));
        let moving: Vec<VertexId> = self.mesh.vertices().filter(|&v| !stays(v)).collect();
        for _ in 0..sweeps {
            for &v in &moving {
                let (sum, count) = self
                    .mesh
                    .neighbours(v)
                    .fold((Vector2::zeros(), 0.0), |(sum, n), w| (sum + part[w.index()].coords, n + 1.0));
                part[v.index()] = Point2::from(sum / count);
            }
        }
        self.write(&part, uv);
    }

    /// Puts the neighbourhood's part of a map in its place.
    pub(super) fn write(&self, part: &[Point2<f64>], uv: &mut [Point2<f64>]) {
        for (v, p) in self.vertices.iter().zip(part) {
            uv[v.index()] = *p;
        }
    }
}
