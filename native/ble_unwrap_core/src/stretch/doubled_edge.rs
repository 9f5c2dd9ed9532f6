//! Two edges that join the same two vertices: with straight edges, what lies between them has no room.
//!
//! Artists' quads have them where two of them meet in a vertex of no other face, and are halved across it. No map is
//! injective unless something between the two edges comes to lie on the boundary.

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Pairs of edges that are looked at; more are as good as none.
const MOST_PAIRS: usize = 8;

/// One side each of two edges that join the same vertices, or twice that of an edge that joins a vertex to itself: the first
/// pairs, by their vertices. O(n log n).
fn doubled_edges(mesh: &TriMesh) -> Vec<[HalfedgeId; 2]> {
    let ends = |h: HalfedgeId| (mesh.from(h).min(mesh.to(h)), mesh.from(h).max(mesh.to(h)));
    let mut edges: Vec<_> = mesh.edges().map(|h| (ends(h), h)).collect();
    edges.sort_unstable();
    let doubled = edges.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| [w[0].1, w[1].1]);
    let loops = edges.iter().filter(|e| e.0.0 == e.0.1).map(|e| [e.1, e.1]);
    doubled.chain(loops).take(MOST_PAIRS).collect()
}

/// The first pair of [`doubled_edges`].
pub(super) fn doubled_edge(mesh: &TriMesh) -> Option<[HalfedgeId; 2]> {
    doubled_edges(mesh).first().copied()
}

/// A vertex enclosed by two edges that join the same two: on a surface cut from it to the boundary these no longer do.
/// `None` where nothing is enclosed, as in a slit of one edge, whose sides are such a pair. O(n log n).
#[must_use]
pub(crate) fn enclosed_vertex(mesh: &TriMesh) -> Option<VertexId> {
    doubled_edges(mesh).into_iter().find_map(|edges| {
        let sides = edges.into_iter().flat_map(|h| [h, mesh.twin(h)]).filter(|h| !h.is_none());
        let between = sides.filter_map(|h| enclosed_side(mesh, h.face(), edges)).min_by_key(Vec::len)?;
        let ends = [mesh.from(edges[0]), mesh.to(edges[0])];
        let is_inside = |v: &VertexId| !ends.contains(v) && !mesh.is_boundary_vertex(*v);
        between.iter().flat_map(|&f| mesh.triangle(f)).filter(is_inside).min()
    })
}

/// The faces that hang together with one, edges aside; `None` if they reach any other boundary.
fn enclosed_side(mesh: &TriMesh, first: FaceId, edges: [HalfedgeId; 2]) -> Option<Vec<FaceId>> {
    let mut is_found = vec![false; mesh.face_count()];
    is_found[first.index()] = true;
    let mut found = vec![first];
    let mut next = 0;
    while let Some(&f) = found.get(next) {
        next += 1;
        for h in f.halfedges() {
            let t = mesh.twin(h);
            if edges.contains(&h) || edges.contains(&t) {
                continue;
            }
            if t.is_none() {
                return None;
            }
            if !std::mem::replace(&mut is_found[t.face().index()], true) {
                found.push(t.face());
            }
        }
    }
    Some(found)
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

    #[test]
    fn a_slit_of_one_edge_encloses_nothing() {
        let whole = test_surfaces::grid(4, 4, [1.0, 1.0], 0.0);
        let inner = |h: &HalfedgeId| [whole.from(*h), whole.to(*h)].iter().all(|&v| !whole.is_boundary_vertex(v));
        let h = whole.edges().find(inner).expect("an inner edge");
        // Both its ends are doubled, too, as in a surface that is severed there and nowhere else.
        let twin =
            whole.halfedges().map(|g| if [h, whole.twin(h)].contains(&g) { HalfedgeId::NONE } else { whole.twin(g) });
        let corners: Vec<u32> = whole.triangles().iter().flatten().map(|v| v.index() as u32).collect();
        let slit = TriMesh::from_glued(&corners, twin.collect(), |source| whole.positions()[source as usize]).0;
        assert!(doubled_edge(&slit).is_some());
        assert_eq!(enclosed_vertex(&slit), None);
    }
}
