//! Two edges that join the same two vertices: with straight edges, what lies between them has no room.
//!
//! Artists' quads have them where two of them meet in a vertex of no other face, and are halved across it. No map is
//! injective unless something between the two edges comes to lie on the boundary.

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// One side each of the first two edges that join the same vertices, or twice that of an edge that joins a vertex to itself.
/// O(n log n).
pub(super) fn doubled_edge(mesh: &TriMesh) -> Option<[HalfedgeId; 2]> {
    let ends = |h: HalfedgeId| (mesh.from(h).min(mesh.to(h)), mesh.from(h).max(mesh.to(h)));
    let mut edges: Vec<_> = mesh.edges().map(|h| (ends(h), h)).collect();
    edges.sort_unstable();
    let doubled = edges.windows(2).find(|w| w[0].0 == w[1].0).map(|w| [w[0].1, w[1].1]);
    doubled.or_else(|| edges.iter().find(|e| e.0.0 == e.0.1).map(|e| [e.1, e.1]))
}

/// A vertex between the first two edges that join the same two: on a surface cut from it to the boundary they no longer do.
/// `None` where there are none, or no vertex inside between them. O(n log n).
#[must_use]
pub fn enclosed_vertex(mesh: &TriMesh) -> Option<VertexId> {
    let edges = doubled_edge(mesh)?;
    let sides = edges.iter().flat_map(|&h| [h, mesh.twin(h)]).filter(|h| !h.is_none());
    let between = sides.map(|h| side(mesh, h.face(), edges)).min_by_key(Vec::len)?;
    let ends = [mesh.from(edges[0]), mesh.to(edges[0])];
    let is_inside = |v: &VertexId| !ends.contains(v) && !mesh.is_boundary_vertex(*v);
    between.iter().flat_map(|&f| mesh.triangle(f)).filter(is_inside).min()
}

/// The faces that hang together with one, edges aside.
fn side(mesh: &TriMesh, first: FaceId, edges: [HalfedgeId; 2]) -> Vec<FaceId> {
    let mut is_found = vec![false; mesh.face_count()];
    is_found[first.index()] = true;
    let mut found = vec![first];
    let mut next = 0;
    while let Some(&f) = found.get(next) {
        next += 1;
        for h in f.halfedges() {
            let t = mesh.twin(h);
            let is_border = t.is_none() || edges.contains(&h) || edges.contains(&t);
            if !is_border && !std::mem::replace(&mut is_found[t.face().index()], true) {
                found.push(t.face());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;

    #[test]
    fn the_vertex_in_a_flap_is_found_and_cutting_to_it_helps() {
        let mesh = test_surfaces::sheet_with_a_flap();
        let [g, h] = doubled_edge(&mesh).expect("the middle and the vertex right of it are joined twice");
        assert!(g != h && [g, h].iter().all(|&h| mesh.edge_length(h) == 1.0 && mesh.position(mesh.from(h)).y == 1.0));
        let tip = enclosed_vertex(&mesh).expect("a flap");
        assert_eq!(mesh.position(tip).z, 0.2, "the vertex above the sheet");
        let path = crate::charts::shortest_path_to_boundary(&mesh, tip, None, |h| mesh.edge_length(h), |_| false);
        let path = path.expect("a boundary");
        let all: Vec<FaceId> = mesh.faces().collect();
        let is_cut = |h| path.contains(&h) || path.contains(&mesh.twin(h));
        let open = mesh.submesh(&all, is_cut).0;
        assert_eq!((doubled_edge(&open), enclosed_vertex(&open)), (None, None));
        assert!(open.topology().is_disk());
    }

    #[test]
    fn a_plain_sheet_and_a_ball_have_none() {
        assert_eq!(enclosed_vertex(&test_surfaces::grid(4, 4, [1.0, 1.0], 0.0)), None);
        assert_eq!(enclosed_vertex(&test_surfaces::sphere(2)), None);
    }
}
