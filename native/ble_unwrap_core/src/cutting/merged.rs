//! A patch whose faces are taken together to larger polygons, and in the order of these.

use std::sync::Arc;

use nalgebra::Point2;

use crate::charts::{Chart, Patch};
use crate::mesh::{FaceId, VertexId};

/// A patch, as one of larger polygons.
pub(super) struct Merged {
    /// A patch of itself, the faces of a polygon one after the other.
    pub(super) whole: Patch,
    /// The face of the patch that each face is.
    order: Vec<FaceId>,
}

impl Merged {
    /// `label` names the polygon of each face, and those of one hang together. O(n log n).
    pub(super) fn new(patch: &Patch, label: &[u32]) -> Self {
        let mut order: Vec<FaceId> = patch.mesh.faces().collect();
        order.sort_by_key(|f| (label[f.index()], *f));
        let (mesh, _) = patch.mesh.submesh(&order, |_| false);
        let polygon = order.iter().map(|f| label[f.index()]).collect();
        Self { whole: Patch::whole(Arc::new(mesh), polygon), order }
    }

    /// The face of the patch that a face of the whole is; its corners come in the same order.
    pub(super) fn face(&self, f: FaceId) -> FaceId {
        self.order[f.index()]
    }

    /// A chart of the whole as a chart of the patch that it was made of. O(n log n).
    pub(super) fn chart_of(&self, patch: &Patch, chart: &Chart) -> Chart {
        // The patch's face, and the chart's.
        let mut faces: Vec<(FaceId, FaceId)> = chart
            .patch
            .faces
            .iter()
            .enumerate()
            .map(|(local, f)| (self.order[f.index()], FaceId::new(local)))
            .collect();
        faces.sort_unstable();
        let local = |f: FaceId| faces.binary_search_by_key(&f, |pair| pair.0).ok().map(|at| faces[at].1);
        let mesh = &chart.patch.mesh;
        let names = faces.iter().map(|pair| pair.0).collect();
        let made = Patch::cut_out(&patch.mesh, &patch.polygon, names, |h| {
            local(h.face()).is_none_or(|f| mesh.is_boundary(f.halfedge(h.slot())))
        });
        let mut uv = vec![Point2::origin(); made.mesh.vertex_count()];
        for ((_, f), corners) in faces.iter().zip(made.mesh.triangles()) {
            let from: [VertexId; 3] = mesh.triangle(*f);
            corners.iter().zip(from).for_each(|(v, from)| uv[v.index()] = chart.uv[from.index()]);
        }
        Chart { patch: made, uv, l2: chart.l2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;

    #[test]
    fn a_chart_comes_back_as_it_lies_on_the_faces_that_it_was_made_of() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let patch = Patch::whole(Arc::new(mesh.clone()), (0..mesh.face_count() as u32).collect());
        // Pairs of faces that are not beside each other in the order of the faces.
        let label: Vec<u32> = mesh.faces().map(|f| (f.index() as u32 / 2).wrapping_mul(7) % 24).collect();
        let merged = Merged::new(&patch, &label);
        assert!(merged.whole.polygon.is_sorted());
        let left: Vec<FaceId> = merged
            .whole
            .mesh
            .faces()
            .filter(|f| merged.whole.mesh.triangle_positions(*f).iter().all(|p| p.x <= 3.0))
            .collect();
        let part = Patch::of_surface(&merged.whole.mesh, &merged.whole.polygon, left);
        let uv = part.mesh.positions().iter().map(|p| Point2::new(2.0 * p.x, p.y)).collect();
        let back = merged.chart_of(&patch, &Chart { patch: part, uv, l2: 1.25 });
        assert!(back.patch.faces.is_sorted() && back.patch.faces.len() == 24 && back.l2 == 1.25);
        for (f, corners) in back.patch.faces.iter().zip(back.patch.mesh.triangles()) {
            for (v, p) in corners.iter().zip(mesh.triangle_positions(*f)) {
                assert_eq!(back.uv[v.index()], Point2::new(2.0 * p.x, p.y));
            }
        }
        assert!(back.patch.mesh.topology().is_disk());
    }
}
