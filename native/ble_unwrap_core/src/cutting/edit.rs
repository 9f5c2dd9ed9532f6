//! What a move changes: edges that are opened, and edges that are glued.

use crate::charts::Patch;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};

use super::state::{ChartId, Cutting};

/// A change of a [`Cutting`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Edit {
    /// Both sides of seams that will be none, ascending.
    glue: Vec<HalfedgeId>,
    /// Both sides of edges that will be seams, ascending.
    open: Vec<HalfedgeId>,
}

impl Edit {
    /// Of each edge either side may be given, in any order. Edges at the boundary of the surface stay seams.
    pub(super) fn new(mesh: &TriMesh, glue: &[HalfedgeId], open: &[HalfedgeId]) -> Self {
        let both_sides = |edges: &[HalfedgeId]| {
            let inner = edges.iter().filter(|&&h| !mesh.is_boundary(h));
            let mut sides: Vec<HalfedgeId> = inner.flat_map(|&h| [h, mesh.twin(h)]).collect();
            sides.sort_unstable();
            sides.dedup();
            sides
        };
        Self { glue: both_sides(glue), open: both_sides(open) }
    }

    /// Whether an edge is a seam once the edit is made.
    pub(super) fn is_seam_after(&self, cutting: &Cutting<'_>, h: HalfedgeId) -> bool {
        let has = |edges: &[HalfedgeId]| edges.binary_search(&h).is_ok();
        if cutting.is_seam(h) { !has(&self.glue) } else { has(&self.open) }
    }

    /// Both sides of the seams that will be none.
    pub(super) fn glued(&self) -> &[HalfedgeId] {
        &self.glue
    }

    /// Both sides of the edges that it opens, ascending.
    pub(super) fn opened(&self) -> &[HalfedgeId] {
        &self.open
    }

    /// How much less seam there is after it, of what seams count for.
    pub(super) fn saved_length(&self, cutting: &Cutting<'_>) -> f64 {
        let length = |edges: &[HalfedgeId]| edges.iter().map(|&h| cutting.seam_length(h)).sum::<f64>();
        0.5 * (length(&self.glue) - length(&self.open))
    }

    /// How long the edges are that it opens, however much seams there count for.
    pub(super) fn opened_length(&self, cutting: &Cutting<'_>) -> f64 {
        0.5 * self.open.iter().map(|&h| cutting.mesh().edge_length(h)).sum::<f64>()
    }

    /// The charts that it changes, ascending.
    pub(super) fn charts(&self, cutting: &Cutting<'_>) -> Vec<ChartId> {
        let mut found: Vec<ChartId> =
            self.glue.iter().chain(&self.open).filter_map(|h| cutting.owner(h.face())).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// What becomes of these charts: connected patches, by lowest face. O(n log n) in their faces.
    pub(super) fn patches(&self, cutting: &Cutting<'_>) -> Vec<Patch> {
        let mut faces: Vec<FaceId> = self
            .charts(cutting)
            .iter()
            .filter_map(|&id| cutting.chart(id))
            .flat_map(|chart| chart.patch.faces.iter().copied())
            .collect();
        faces.sort_unstable();
        let mut is_done = vec![false; faces.len()];
        let mut patches = Vec::new();
        for first in 0..faces.len() {
            if is_done[first] {
                continue;
            }
            is_done[first] = true;
            let mut piece = vec![faces[first]];
            let mut at = 0;
            while at < piece.len() {
                for h in piece[at].halfedges().into_iter().filter(|&h| !self.is_seam_after(cutting, h)) {
                    // All that is not cut off is of these charts.
                    if let Ok(next) = faces.binary_search(&cutting.mesh().twin(h).face())
                        && !is_done[next]
                    {
                        is_done[next] = true;
                        piece.push(faces[next]);
                    }
                }
                at += 1;
            }
            piece.sort_unstable();
            patches.push(cutting.patch(piece, |h| self.is_seam_after(cutting, h)));
        }
        patches
    }
}

#[cfg(test)]
mod tests {
    use super::super::state::tests::strips;
    use super::*;
    use crate::mesh::test_surfaces;

    #[test]
    fn charts_are_glued_where_the_edit_says_and_stay_open_elsewhere() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 3);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let ids: Vec<ChartId> = cutting.ids().collect();
        let border: Vec<HalfedgeId> =
            mesh.halfedges().filter(|&h| cutting.sides(h) == Some([ids[0], ids[1]])).collect();
        assert_eq!(border.len(), 4);
        for glued in 1..=4 {
            // The first edges of the border from one end.
            let edit = Edit::new(&mesh, &border[..glued], &[]);
            assert_eq!(edit.charts(&cutting), ids[..2]);
            let patches = edit.patches(&cutting);
            assert_eq!(patches.len(), 1);
            assert_eq!(patches[0].faces.len(), 32);
            // Two strips of 2 by 4, less what is glued of the border on both sides.
            assert_eq!(patches[0].mesh.boundary_length(), 24.0 - 2.0 * glued as f64);
        }
    }

    #[test]
    fn a_chart_opened_all_across_comes_apart_and_one_opened_in_part_does_not() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 1);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let across: Vec<HalfedgeId> =
            mesh.edges().filter(|&h| [mesh.from(h), mesh.to(h)].iter().all(|v| mesh.position(*v).x == 2.0)).collect();
        let patches = Edit::new(&mesh, &[], &across).patches(&cutting);
        assert_eq!(patches.iter().map(|p| p.faces.len()).collect::<Vec<_>>(), [16, 32]);
        let slit = Edit::new(&mesh, &[], &across[1..3]).patches(&cutting);
        assert_eq!((slit.len(), slit[0].faces.len()), (1, 48));
        let topology = slit[0].mesh.topology();
        assert_eq!((topology.loops, topology.genus()), (2, 0), "a hole without area");
    }

    #[test]
    fn what_is_opened_and_glued_moves_a_border() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 2);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let upright = |x: f64| -> Vec<HalfedgeId> {
            mesh.edges().filter(|&h| [mesh.from(h), mesh.to(h)].iter().all(|v| mesh.position(*v).x == x)).collect()
        };
        let patches = Edit::new(&mesh, &upright(3.0), &upright(2.0)).patches(&cutting);
        assert_eq!(patches.iter().map(|p| p.faces.len()).collect::<Vec<_>>(), [16, 32]);
        // The boundary of the surface cannot be glued.
        let edit = Edit::new(&mesh, &upright(0.0), &[]);
        assert!(edit.charts(&cutting).is_empty() && edit.patches(&cutting).is_empty());
    }
}
