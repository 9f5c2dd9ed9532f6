//! Patches and charts, with their maps to the surface.

use std::sync::Arc;

use nalgebra::Point2;

use crate::mesh::{FaceId, Groups, HalfedgeId, TriMesh, VertexId, measure};

/// A connected piece of a surface, made of whole polygons.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// The piece as a mesh of its own; shared, as a piece may be the whole surface and stay as it is for several stages.
    pub mesh: Arc<TriMesh>,
    /// The surface's face that each face of the patch is.
    pub faces: Vec<FaceId>,
    /// The surface's vertex that each vertex of the patch lies at.
    pub vertices: Vec<VertexId>,
    /// The input polygon each face belongs to.
    pub polygon: Vec<u32>,
}

/// A flattened patch: genus 0, with a boundary, and a position in the plane for each vertex.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    /// The patch; cuts that open it are part of its mesh.
    pub patch: Patch,
    /// Position of each vertex in the chart's plane, in units of the surface.
    pub uv: Vec<Point2<f64>>,
    /// L2 stretch at the chart's own best scale.
    pub l2: f64,
}

impl Patch {
    /// A connected mesh as a patch of itself. `polygon` names the polygon of each face.
    #[must_use]
    pub(crate) fn whole(mesh: Arc<TriMesh>, polygon: Vec<u32>) -> Self {
        Self { faces: mesh.faces().collect(), vertices: mesh.vertices().collect(), mesh, polygon }
    }

    /// The patch made of some faces of a surface. `faces` should be ascending, for determinism.
    #[must_use]
    pub(crate) fn of_surface(mesh: &TriMesh, polygon: &[u32], faces: Vec<FaceId>) -> Self {
        Self::cut_out(mesh, polygon, faces, |_| false)
    }

    /// The patch made of some faces of a surface, cut along every edge for which `is_cut` holds (asked once a side).
    #[must_use]
    pub(crate) fn cut_out(
        mesh: &TriMesh,
        polygon: &[u32],
        faces: Vec<FaceId>,
        is_cut: impl Fn(HalfedgeId) -> bool,
    ) -> Self {
        let (part, vertices) = mesh.submesh(&faces, is_cut);
        let polygon = faces.iter().map(|f| polygon[f.index()]).collect();
        Self { mesh: Arc::new(part), vertices, polygon, faces }
    }

    /// The parts of this patch by label, each of which must be connected.
    #[must_use]
    pub(crate) fn split(&self, labels: &[u32], count: usize) -> Vec<Self> {
        let groups = Groups::by_label(labels, count, FaceId::new);
        self.mesh
            .partition(&groups)
            .into_iter()
            .zip(groups.iter())
            .map(|((mesh, vertices), local)| Self {
                mesh: Arc::new(mesh),
                vertices: vertices.iter().map(|v| self.vertices[v.index()]).collect(),
                faces: local.iter().map(|f| self.faces[f.index()]).collect(),
                polygon: local.iter().map(|f| self.polygon[f.index()]).collect(),
            })
            .collect()
    }

    /// This patch cut open along some edges (either side of each may be given).
    #[must_use]
    pub(crate) fn cut(&self, edges: &[HalfedgeId]) -> Self {
        let mut is_cut = vec![false; self.mesh.halfedge_count()];
        for h in edges {
            is_cut[h.index()] = true;
        }
        let all: Vec<FaceId> = self.mesh.faces().collect();
        let (mesh, vertices) = self.mesh.submesh(&all, |h| is_cut[h.index()]);
        Self {
            mesh: Arc::new(mesh),
            vertices: vertices.iter().map(|v| self.vertices[v.index()]).collect(),
            faces: self.faces.clone(),
            polygon: self.polygon.clone(),
        }
    }

    /// Whether a half-edge is a diagonal inside a polygon, which is never cut.
    #[must_use]
    pub(crate) fn is_diagonal(&self, h: HalfedgeId) -> bool {
        let t = self.mesh.twin(h);
        !t.is_none() && self.polygon[h.face().index()] == self.polygon[t.face().index()]
    }

    /// Whether the patch is one polygon, which cannot be split.
    #[must_use]
    pub(crate) fn is_one_polygon(&self) -> bool {
        self.polygon.iter().all(|p| *p == self.polygon[0])
    }

    /// Surface area.
    #[must_use]
    pub(crate) fn area(&self) -> f64 {
        measure::total_area(&self.mesh)
    }
}
