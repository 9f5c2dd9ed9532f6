//! The cheapest border between two places of a patch.

use crate::mesh::{FaceId, TriMesh};
use crate::progress::{Cancelled, Progress};

use super::bends::{Bends, capacity};
use super::polygon_graph::PolygonGraph;
use super::{CutGraph, Segmentation, finish_labels};

/// Divides a patch between two sets of its faces where the border is short and runs along creases: two parts or, where
/// one of them falls apart, more. `None` where a polygon has faces of both sets, or the parts come out as one.
/// `crease_weight` as in [`SegmentationSettings`](super::SegmentationSettings). O(n log n) and one cut.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn between(
    mesh: &TriMesh,
    polygon: &[u32],
    places: [&[FaceId]; 2],
    crease_weight: f64,
    progress: &Progress,
) -> Result<Option<Segmentation>, Cancelled> {
    let graph = PolygonGraph::new(mesh, polygon);
    let bends = Bends::new(mesh, &graph, crease_weight);
    let mut cut = CutGraph::new(graph.len());
    for p in 0..graph.len() {
        for (k, link) in graph.links.group(p).iter().enumerate() {
            if p < link.to as usize {
                let relative = bends.crease(p, k) * link.length / bends.mean_length;
                cut.add_edge(p, link.to as usize, capacity(relative));
            }
        }
    }
    let mut taken = vec![None; graph.len()];
    for (side, faces) in places.into_iter().enumerate() {
        for f in faces {
            let p = graph.of_face[f.index()] as usize;
            if taken[p].is_some_and(|other| other != side) {
                return Ok(None);
            }
            taken[p] = Some(side);
        }
    }
    for (p, side) in taken.iter().enumerate() {
        match side {
            Some(0) => cut.fix_to_source(p),
            Some(_) => cut.fix_to_sink(p),
            None => {}
        }
    }
    let label: Vec<u32> = cut.min_cut(progress)?.into_iter().map(u32::from).collect();
    let parts = finish_labels(&graph, label);
    Ok((parts.parts > 1).then_some(parts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;

    /// Two squares joined by a neck.
    #[test]
    fn the_border_is_where_the_patch_is_narrow() {
        let whole = test_surfaces::grid(21, 9, [21.0, 9.0], 0.0);
        let middle = |f: FaceId| nalgebra::center(&whole.triangle_positions(f)[0], &whole.triangle_positions(f)[2]);
        let neck = |f: &FaceId| {
            let p = middle(*f);
            !(9.0..12.0).contains(&p.x) || (3.0..6.0).contains(&p.y)
        };
        let kept: Vec<FaceId> = whole.faces().filter(neck).collect();
        let (mesh, _) = whole.submesh(&kept, |_| false);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let x = |f: FaceId| mesh.triangle_positions(f).iter().map(|p| p.x).sum::<f64>() / 3.0;
        let left: Vec<FaceId> = mesh.faces().filter(|&f| x(f) < 1.0).collect();
        let right: Vec<FaceId> = mesh.faces().filter(|&f| x(f) > 20.0).collect();
        let parts = between(&mesh, &polygon, [&left, &right], 0.0, &Progress::new()).expect("not cancelled");
        let parts = parts.expect("two parts");
        assert_eq!(parts.parts, 2);
        let border: f64 = mesh
            .edges()
            .filter(|&h| !mesh.is_boundary(h))
            .filter(|&h| parts.label[h.face().index()] != parts.label[mesh.twin(h).face().index()])
            .map(|h| mesh.edge_length(h))
            .sum();
        assert!((border - 3.0).abs() < 1e-9, "{border}");
        assert!(between(&mesh, &polygon, [&left, &left], 0.0, &Progress::new()).expect("not cancelled").is_none());
    }
}
