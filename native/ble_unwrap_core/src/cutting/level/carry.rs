//! What has been joined on a coarse mesh, joined on the fine one.

use nalgebra::Point3;

use crate::charts::Chart;
use crate::collections::DisjointSets;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Where the union of parts of a fine mesh is cut whose guides, charts of a coarse one, have become one chart: along the borders
/// between the parts, but where the nearest edge of the coarse border is no seam any more. Both sides of each edge, sorted;
/// `None` where the parts, each of which must be connected, do not hang together. O(n log n) and a look at each coarse edge of
/// a border for each fine one.
pub(super) fn carried_over(
    coarse: &TriMesh,
    fine: &TriMesh,
    pieces: &[(&[FaceId], &Chart)],
    joined: &Chart,
) -> Option<Vec<HalfedgeId>> {
    let guide = owners(coarse.face_count(), pieces.iter().map(|p| &*p.1.patch.faces));
    let part = owners(fine.face_count(), pieces.iter().map(|p| p.0));
    let (coarse_borders, fine_borders) = (borders(coarse, &guide), borders(fine, &part));
    let is_glued = |h: HalfedgeId| {
        let local = joined.patch.faces.binary_search(&h.face()).map(|at| FaceId::new(at).halfedge(h.slot()));
        local.is_ok_and(|local| !joined.patch.mesh.is_boundary(local))
    };
    let mut glued: Vec<HalfedgeId> = Vec::new();
    let mut together = DisjointSets::new(pieces.len());
    for border in fine_borders.chunk_by(|x, y| x.0 == y.0) {
        let from = coarse_borders.partition_point(|b| b.0 < border[0].0);
        let to = coarse_borders.partition_point(|b| b.0 <= border[0].0);
        let lies_on_glued = |h: HalfedgeId| {
            let to_edge = |&(_, g): &(_, HalfedgeId)| (middle(coarse, g) - middle(fine, h)).norm_squared();
            let nearest = coarse_borders[from..to].iter().min_by(|x, y| to_edge(x).total_cmp(&to_edge(y)));
            nearest.is_some_and(|b| is_glued(b.1))
        };
        let candidates: Vec<HalfedgeId> = border.iter().map(|b| b.1).filter(|&h| lies_on_glued(h)).collect();
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

/// The number of the group that each of `count` faces is in, if any.
fn owners<'a>(count: usize, groups: impl Iterator<Item = &'a [FaceId]>) -> Vec<Option<usize>> {
    let mut owner = vec![None; count];
    for (i, faces) in groups.enumerate() {
        for f in faces {
            owner[f.index()] = Some(i);
        }
    }
    owner
}

fn middle(mesh: &TriMesh, h: HalfedgeId) -> Point3<f64> {
    nalgebra::center(&mesh.position(mesh.from(h)), &mesh.position(mesh.to(h)))
}

/// The edges between different owners, each once, sorted by their pair.
fn borders(mesh: &TriMesh, owner: &[Option<usize>]) -> Vec<([usize; 2], HalfedgeId)> {
    let between = |h: HalfedgeId| {
        let t = mesh.twin(h);
        if t.is_none() {
            return None;
        }
        let [a, b] = [owner[h.face().index()]?, owner[t.face().index()]?];
        (a < b).then_some(([a, b], h))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Patch;
    use crate::mesh::test_surfaces;
    use nalgebra::Point2;

    /// A chart that lies anywhere.
    fn chart(patch: Patch) -> Chart {
        Chart { uv: vec![Point2::origin(); patch.mesh.vertex_count()], patch, l2: 1.0 }
    }

    #[test]
    fn a_joint_is_carried_over_to_the_mesh_it_came_from() {
        let mesh = test_surfaces::sphere(3);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let is_upper = |f: FaceId| mesh.triangle_positions(f).iter().map(|p| p.z).sum::<f64>() > 0.0;
        let half = |wanted: bool| {
            chart(Patch::of_surface(&mesh, &polygon, mesh.faces().filter(|&f| is_upper(f) == wanted).collect()))
        };
        let halves = [half(true), half(false)];
        // Glued along the half of the equator with positive x.
        let is_equator = |h: HalfedgeId| is_upper(h.face()) != is_upper(mesh.twin(h).face());
        let is_cut = |h: HalfedgeId| is_equator(h) && middle(&mesh, h).x < 0.0;
        let whole = chart(Patch::cut_out(&mesh, &polygon, mesh.faces().collect(), is_cut));
        assert!(whole.patch.mesh.topology().is_disk());
        let pieces: Vec<(&[FaceId], &Chart)> = halves.iter().map(|c| (&*c.patch.faces, c)).collect();
        let cuts = carried_over(&mesh, &mesh, &pieces, &whole).expect("it hangs together");
        let wanted: Vec<HalfedgeId> = mesh.halfedges().filter(|&h| is_cut(h)).collect();
        assert_eq!(cuts, wanted);
        let apart = chart(Patch::cut_out(&mesh, &polygon, mesh.faces().collect(), is_equator));
        assert_eq!(carried_over(&mesh, &mesh, &pieces, &apart), None, "nothing is glued");
    }
}
