//! Guides of the fine mesh on the coarse one.

use std::collections::HashSet;

use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// The coarse mesh with the guides of the fine one. `vertex` is the coarse vertex of each fine one.
///
/// The ends of an edge collapse into one vertex or into neighbours, so chains stay chains. O(n) where there are guides.
pub(super) fn carried_over(fine: &TriMesh, coarse: TriMesh, vertex: &[VertexId]) -> TriMesh {
    if !fine.has_guides() {
        return coarse;
    }
    let on_coarse = |h: HalfedgeId| {
        let (a, b) = (vertex[fine.from(h).index()], vertex[fine.to(h).index()]);
        (a.min(b), a.max(b))
    };
    let edges: HashSet<(VertexId, VertexId)> =
        fine.edges().filter(|&h| fine.is_guide(h)).map(on_coarse).filter(|(a, b)| a != b).collect();
    let ends = |h: HalfedgeId| {
        let (a, b) = (coarse.from(h), coarse.to(h));
        (a.min(b), a.max(b))
    };
    let marks = coarse.halfedges().map(|h| edges.contains(&ends(h))).collect();
    coarse.with_guides(marks)
}

#[cfg(test)]
mod tests {
    use super::super::coarsen;
    use crate::mesh::{HalfedgeId, test_surfaces};
    use crate::progress::Progress;

    #[test]
    fn a_line_across_a_plane_stays_a_line() {
        let grid = test_surfaces::grid(40, 40, [1.0, 1.0], 0.0);
        let middle =
            |h: HalfedgeId| [grid.from(h), grid.to(h)].iter().all(|v| (grid.position(*v).x - 0.5).abs() < 1e-9);
        let marks = grid.halfedges().map(middle).collect();
        let grid = grid.clone().with_guides(marks);
        let coarse = coarsen(&grid, 120, &Progress::new()).expect("not cancelled").mesh;
        assert!(coarse.vertex_count() <= 160, "{}", coarse.vertex_count());
        let guides: Vec<HalfedgeId> = coarse.edges().filter(|&h| coarse.is_guide(h)).collect();
        let length: f64 = guides.iter().map(|&h| coarse.edge_length(h)).sum();
        assert!((length - 1.0).abs() < 1e-9, "the whole line and no more: {length}");
        assert!(guides.iter().all(|&h| (coarse.position(coarse.from(h)).x - 0.5).abs() < 1e-9), "on the line");
        let plain = grid.clone().with_guides(Vec::new());
        assert!(!coarsen(&plain, 120, &Progress::new()).expect("not cancelled").mesh.has_guides());
    }
}
