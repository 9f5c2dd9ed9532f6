//! Seams of a coarse mesh carried over to the fine one.

use nalgebra::Point3;

use crate::charts::Chart;
use crate::collections::DisjointSets;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

use super::darts::Sewn;

/// Where the union of parts of a fine mesh is cut whose guides, charts of a coarse one, have been sewn: along the borders
/// between the parts but where the nearest edge of the coarse border is sewn. Both sides of each edge, sorted; `None`
/// where the parts, each of which must be connected, do not hang together. O(n log n) and a look at each coarse edge of
/// a border for each fine one.
pub(super) fn carried_over(
    coarse: &TriMesh,
    fine: &TriMesh,
    pieces: &[(&[FaceId], &Chart)],
    sewn: &Sewn,
) -> Option<Vec<HalfedgeId>> {
    let guide = owners(coarse.face_count(), pieces.iter().map(|p| &*p.1.patch.faces));
    let part = owners(fine.face_count(), pieces.iter().map(|p| p.0));
    let (coarse_borders, fine_borders) = (borders(coarse, &guide), borders(fine, &part));
    let mut edges: Vec<HalfedgeId> = sewn.edges.iter().flat_map(|&h| [h, coarse.twin(h)]).collect();
    edges.sort_unstable();
    let mut glued: Vec<HalfedgeId> = Vec::new();
    let mut together = DisjointSets::new(pieces.len());
    for border in fine_borders.chunk_by(|x, y| x.0 == y.0) {
        let from = coarse_borders.partition_point(|b| b.0 < border[0].0);
        let to = coarse_borders.partition_point(|b| b.0 <= border[0].0);
        let is_sewn = |h: HalfedgeId| {
            let to_edge = |&(_, g): &(_, HalfedgeId)| (middle(coarse, g) - middle(fine, h)).norm_squared();
            let nearest = coarse_borders[from..to].iter().min_by(|x, y| to_edge(x).total_cmp(&to_edge(y)));
            nearest.is_some_and(|b| edges.binary_search(&b.1).is_ok())
        };
        let candidates: Vec<HalfedgeId> = border.iter().map(|b| b.1).filter(|&h| is_sewn(h)).collect();
        let chain = longest_chain(fine, &candidates);
        if !chain.is_empty() {
            together.join(border[0].0[0], border[0].0[1]);
        }
        glued.extend(chain);
    }
    glued.sort_unstable();
    let apart = fine_borders.iter().map(|b| b.1).filter(|h| glued.binary_search(h).is_err());
    let mut cuts: Vec<HalfedgeId> = apart.flat_map(|h| [h, fine.twin(h)]).collect();
    cuts.sort_unstable();
    (together.labels().1 == 1).then_some(cuts)
}

/// The number of the group that each of `count` faces is in; `usize::MAX` where it is in none.
fn owners<'a>(count: usize, groups: impl Iterator<Item = &'a [FaceId]>) -> Vec<usize> {
    let mut owner = vec![usize::MAX; count];
    for (i, faces) in groups.enumerate() {
        for f in faces {
            owner[f.index()] = i;
        }
    }
    owner
}

fn middle(mesh: &TriMesh, h: HalfedgeId) -> Point3<f64> {
    nalgebra::center(&mesh.position(mesh.from(h)), &mesh.position(mesh.to(h)))
}

/// The edges between different owners, each once, sorted by their pair.
fn borders(mesh: &TriMesh, owner: &[usize]) -> Vec<([usize; 2], HalfedgeId)> {
    let between = |h: HalfedgeId| {
        let t = mesh.twin(h);
        if t.is_none() {
            return None;
        }
        let [a, b] = [h, t].map(|h| owner[h.face().index()]);
        (a < b && b != usize::MAX).then_some(([a, b], h))
    };
    let mut borders: Vec<_> = mesh.halfedges().filter_map(between).collect();
    borders.sort_unstable();
    borders
}

/// Of edges, each given by the half-edge on the same side, the connected ones that are longest together.
fn longest_chain(mesh: &TriMesh, edges: &[HalfedgeId]) -> Vec<HalfedgeId> {
    let mut ends: Vec<(VertexId, usize)> =
        edges.iter().enumerate().flat_map(|(i, &h)| [(mesh.from(h), i), (mesh.to(h), i)]).collect();
    ends.sort_unstable();
    let mut sets = DisjointSets::new(edges.len());
    for at in ends.chunk_by(|x, y| x.0 == y.0) {
        at.windows(2).for_each(|pair| {
            sets.join(pair[0].1, pair[1].1);
        });
    }
    let root: Vec<usize> = (0..edges.len()).map(|i| sets.root(i)).collect();
    let mut length = vec![0.0; edges.len()];
    for (&h, &r) in edges.iter().zip(&root) {
        length[r] += mesh.edge_length(h);
    }
    let longest = (0..edges.len()).max_by(|&a, &b| length[a].total_cmp(&length[b]).then(b.cmp(&a)));
    edges.iter().zip(&root).filter(|(_, r)| Some(**r) == longest).map(|(h, _)| *h).collect()
}
