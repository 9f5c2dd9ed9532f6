//! Edges to cut so that a surface can be laid in the plane.
//!
//! Handles are opened along a tree-cotree decomposition (D. Eppstein, Dynamic generators of
//! topologically embedded graphs, SODA 2003): a spanning tree of the vertices by shortest paths from a
//! base, a spanning tree of the faces over the edges left, and 2g edges in neither, each of which closes
//! one loop through the base. Taking for the second tree the edges whose loops are longest leaves the
//! shortest loops to be cut (J. Erickson, K. Whittlesey, Greedy optimal homotopy and homology
//! generators, SODA 2005): the least sum of loops through that base.
//!
//! A boundary loop counts as one single vertex here, for to cross a hole costs nothing: so cuts may end
//! on boundaries, and the decomposition is that of a closed surface.

use crate::collections::{DisjointSets, MinHeap};
use crate::mesh::{FaceId, Groups, HalfedgeId, TriMesh, VertexId};

/// Greatest number of bases tried for the shortest cut.
const MAX_BASES: usize = 8;
/// Least number of bases tried, even on large meshes.
const MIN_BASES: usize = 2;
/// Between these bounds as many bases are tried as make so many faces to be looked at in all.
const FACES_FOR_ALL_BASES: usize = 100_000;

/// Larger weights count as this: sums over a whole mesh must stay finite.
const GREATEST_WEIGHT: f64 = 1e200;
/// Smaller weights, relative to their mean, count as this: among paths that cost nothing the one of
/// fewest edges is best.
const LEAST_WEIGHT: f64 = 1e-9;

/// Edges to cut so that every component of a mesh has genus 0 and a boundary; empty if it has already.
///
/// Each edge is given once, by its lower half-edge, in ascending order. `mesh.submesh(faces, is_cut)`
/// with these edges is still connected where `mesh` is; the slit that opens a sphere has at least two
/// edges, so that it can be laid out. Existing holes stay holes, except those the cut runs
/// through. The cut is short by `weight` (not negative, the same for both half-edges of an edge; what is
/// no number counts as 0) among loops through one of a few bases, not the shortest of all.
///
/// Edges for which `forbidden` holds are not cut. This is always possible if the faces across them form
/// no cycle, as with the diagonals of polygons; otherwise as few as the method can are cut all the same.
/// O(n log n) times at most eight.
pub(crate) fn cut_open(
    mesh: &TriMesh,
    weight: impl Fn(HalfedgeId) -> f64,
    forbidden: impl Fn(HalfedgeId) -> bool,
) -> Vec<HalfedgeId> {
    by_component(mesh, &weight, &forbidden, |edges| edges.open())
}

/// Edges to cut so that every component of a mesh becomes a topological disk: those of [`cut_open`]
/// and, by a spanning tree of shortest paths, more to join all boundary loops into one.
///
/// Order, `weight` and `forbidden` as for [`cut_open`]. O(n log n).
pub(crate) fn cut_to_disk(
    mesh: &TriMesh,
    weight: impl Fn(HalfedgeId) -> f64,
    forbidden: impl Fn(HalfedgeId) -> bool,
) -> Vec<HalfedgeId> {
    by_component(mesh, &weight, &forbidden, |edges| {
        let mut cuts = edges.open();
        cuts.extend(edges.join_boundaries(&cuts));
        cuts
    })
}

/// The shortest path by `weight` along edges from a vertex to the nearest vertex of a boundary, or to `root` where that is
/// nearer, over edges that are not forbidden, as half-edges in order: a dart. None if
/// neither can be reached; empty if `from` is one. All vertices before the last are inside, so a
/// chart cut along it remains one. `weight` as for [`cut_open`]. Time grows with the part nearer to `from` than the boundary, plus one
/// pass over two arrays.
///
/// # Panics
/// If `from` is no vertex of the mesh.
pub(crate) fn shortest_path_to_boundary(
    mesh: &TriMesh,
    from: VertexId,
    root: Option<VertexId>,
    weight: impl Fn(HalfedgeId) -> f64,
    forbidden: impl Fn(HalfedgeId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let mut distance = vec![f64::INFINITY; mesh.vertex_count()];
    let mut parent = vec![HalfedgeId::NONE; mesh.vertex_count()];
    let mut heap = MinHeap::new(mesh.vertex_count());
    distance[from.index()] = 0.0;
    heap.push_or_lower(from.index(), 0.0);
    while let Some((v, here)) = heap.pop() {
        let v = VertexId::new(v);
        if mesh.is_boundary_vertex(v) || Some(v) == root {
            let mut path = Vec::new();
            let mut at = v;
            while at != from {
                let h = parent[at.index()];
                path.push(h);
                at = mesh.from(h);
            }
            path.reverse();
            return Some(path);
        }
        // `v` is inside, so all its edges leave it by a half-edge.
        for h in mesh.outgoing(v) {
            let (to, d) = (mesh.to(h).index(), here + weight(h));
            if d < distance[to] && !forbidden(h) && !forbidden(mesh.twin(h)) {
                distance[to] = d;
                parent[to] = h;
                heap.push_or_lower(to, d);
            }
        }
    }
    None
}

/// Runs `cut` on every component and gathers the edges in terms of the whole mesh.
fn by_component(
    mesh: &TriMesh,
    weight: &impl Fn(HalfedgeId) -> f64,
    forbidden: &impl Fn(HalfedgeId) -> bool,
    cut: impl Fn(&Contracted) -> Vec<HalfedgeId>,
) -> Vec<HalfedgeId> {
    let (label, count) = mesh.components();
    let mut cuts = if count == 1 {
        cut(&Contracted::new(mesh, weight, forbidden))
    } else {
        let faces = Groups::by_label(&label, count, FaceId::new);
        let mut all = Vec::new();
        for part in faces.iter() {
            let whole = |h: HalfedgeId| part[h.face().index()].halfedge(h.slot());
            let (component, _) = mesh.submesh(part, |_| false);
            let contracted = Contracted::new(&component, &|h| weight(whole(h)), &|h| forbidden(whole(h)));
            all.extend(cut(&contracted).into_iter().map(whole));
        }
        all
    };
    cuts.sort_unstable();
    cuts
}

/// The graph of the inner edges of a connected mesh, with every boundary loop contracted to one node.
struct Contracted<'m> {
    mesh: &'m TriMesh,
    /// The node of each vertex: boundary loops first, in their order, then inner vertices.
    node: Vec<u32>,
    members: Groups<VertexId>,
    loops: usize,
    /// By half-edge, the same for twins. Forbidden edges cost more than all others together.
    cost: Vec<f64>,
    forbidden: Vec<bool>,
}

/// Shortest paths from a base: by node, the distance and the half-edge by which it is reached.
struct Tree {
    distance: Vec<f64>,
    parent: Vec<HalfedgeId>,
}

impl<'m> Contracted<'m> {
    fn new(mesh: &'m TriMesh, weight: &impl Fn(HalfedgeId) -> f64, is_forbidden: &impl Fn(HalfedgeId) -> bool) -> Self {
        let mut node = vec![u32::MAX; mesh.vertex_count()];
        let loops = mesh.boundary_loops();
        for (l, boundary) in loops.iter().enumerate() {
            for &h in boundary {
                node[mesh.from(h).index()] = l as u32;
            }
        }
        let mut count = loops.len();
        for n in &mut node {
            if *n == u32::MAX {
                *n = count as u32;
                count += 1;
            }
        }
        let mut cost = vec![0.0; mesh.halfedge_count()];
        let mut forbidden = vec![false; mesh.halfedge_count()];
        let mut total = 0.0;
        for h in mesh.edges().filter(|&h| !mesh.is_boundary(h)) {
            let (t, w) = (mesh.twin(h), weight(h));
            let w = if w.is_finite() { w.clamp(0.0, GREATEST_WEIGHT) } else { 0.0 };
            (cost[h.index()], cost[t.index()]) = (w, w);
            let no = is_forbidden(h) || is_forbidden(t);
            (forbidden[h.index()], forbidden[t.index()]) = (no, no);
            total += w;
        }
        let least = if total > 0.0 { LEAST_WEIGHT * total / mesh.halfedge_count() as f64 } else { 1.0 };
        for (cost, &no) in cost.iter_mut().zip(&forbidden) {
            *cost = cost.max(least) + if no { 2.0 * (total + least * mesh.halfedge_count() as f64) } else { 0.0 };
        }
        let members = Groups::by_label(&node, count, VertexId::new);
        Self { mesh, node, members, loops: loops.len(), cost, forbidden }
    }

    fn ends(&self, h: HalfedgeId) -> [usize; 2] {
        [self.mesh.from(h), self.mesh.to(h)].map(|v| self.node[v.index()] as usize)
    }

    fn inner_edges(&self) -> impl Iterator<Item = HalfedgeId> + '_ {
        self.mesh.edges().filter(|&h| !self.mesh.is_boundary(h))
    }

    fn lower(&self, h: HalfedgeId) -> HalfedgeId {
        h.min(self.mesh.twin(h))
    }

    fn shortest_paths(&self, base: usize) -> Tree {
        let n = self.members.len();
        let mut tree = Tree { distance: vec![f64::INFINITY; n], parent: vec![HalfedgeId::NONE; n] };
        let mut heap = MinHeap::new(n);
        tree.distance[base] = 0.0;
        heap.push_or_lower(base, 0.0);
        while let Some((u, here)) = heap.pop() {
            for &v in self.members.group(u) {
                for h in self.mesh.outgoing(v).filter(|&h| !self.mesh.is_boundary(h)) {
                    let (to, d) = (self.ends(h)[1], here + self.cost[h.index()]);
                    if d < tree.distance[to] {
                        tree.distance[to] = d;
                        tree.parent[to] = h;
                        heap.push_or_lower(to, d);
                    }
                }
            }
        }
        tree
    }

    /// The edges from a node up to the base.
    fn path_to_base<'t>(&'t self, tree: &'t Tree, from: usize) -> impl Iterator<Item = HalfedgeId> + 't {
        let mut at = from;
        std::iter::from_fn(move || {
            let h = tree.parent[at];
            if h.is_none() {
                return None;
            }
            at = self.ends(h)[0];
            Some(h)
        })
    }

    /// See [`cut_open`].
    fn open(&self) -> Vec<HalfedgeId> {
        // Euler's formula for the closed surface that the contraction makes.
        let euler = self.members.len() as i64 - self.inner_edges().count() as i64 + self.mesh.face_count() as i64;
        match (euler, self.loops) {
            (2, 0) => self.slit(),
            (2, _) => Vec::new(),
            _ => self.shortest_system_of_loops(),
        }
    }

    /// Opens a sphere along the shortest path between two vertices far apart.
    fn slit(&self) -> Vec<HalfedgeId> {
        let first = farthest(&self.shortest_paths(0).distance);
        let tree = self.shortest_paths(first);
        let last = farthest(&tree.distance);
        let mut path: Vec<_> = self.path_to_base(&tree, last).collect();
        if path.len() == 1 {
            // A slit of one edge could not be opened: both of its sides would have the same two ends.
            let more = self.inner_edges().filter(|&h| {
                let is_end = self.ends(h).map(|u| u == first || u == last);
                is_end[0] != is_end[1]
            });
            path.extend(more.min_by(|a, b| self.cost[a.index()].total_cmp(&self.cost[b.index()])));
        }
        path.into_iter().map(|h| self.lower(h)).collect()
    }

    /// Opens all handles, from the best of a few bases: boundary loops, or vertices far apart.
    fn shortest_system_of_loops(&self) -> Vec<HalfedgeId> {
        let bases = (FACES_FOR_ALL_BASES / self.mesh.face_count().max(1)).clamp(MIN_BASES, MAX_BASES);
        let mut cover = vec![f64::INFINITY; self.members.len()];
        let mut base = 0;
        let mut best: Option<(f64, Vec<HalfedgeId>)> = None;
        for _ in 0..bases {
            let tree = self.shortest_paths(base);
            let cuts = self.system_of_loops(&tree);
            let total: f64 = cuts.iter().map(|h| self.cost[h.index()]).sum();
            if best.as_ref().is_none_or(|(least, _)| total < *least) {
                best = Some((total, cuts));
            }
            for (c, d) in cover.iter_mut().zip(&tree.distance) {
                *c = c.min(*d);
            }
            base = farthest(if self.loops > 0 { &cover[..self.loops] } else { &cover });
            if cover[base] == 0.0 {
                break;
            }
        }
        best.map_or_else(Vec::new, |(_, cuts)| cuts)
    }

    /// The shortest loops through the base of `tree` that open all handles.
    fn system_of_loops(&self, tree: &Tree) -> Vec<HalfedgeId> {
        let mut in_tree = vec![false; self.mesh.halfedge_count()];
        for h in tree.parent.iter().filter(|h| !h.is_none()) {
            in_tree[self.lower(*h).index()] = true;
        }
        // Edges that must not be cut come first, then those whose loops are longest.
        let mut rest: Vec<(bool, f64, HalfedgeId)> = self
            .inner_edges()
            .filter(|h| !in_tree[h.index()])
            .map(|h| {
                let [u, v] = self.ends(h);
                let around = tree.distance[u] + tree.distance[v] + self.cost[h.index()];
                (self.forbidden[h.index()], around, h)
            })
            .collect();
        rest.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
        let mut joined = DisjointSets::new(self.mesh.face_count());
        let mut cut = vec![false; self.mesh.halfedge_count()];
        for (_, _, h) in rest {
            if !joined.join(h.face().index(), self.mesh.twin(h).face().index()) {
                cut[h.index()] = true;
                for end in self.ends(h) {
                    for h in self.path_to_base(tree, end) {
                        // The rest of the way is marked already.
                        if std::mem::replace(&mut cut[self.lower(h).index()], true) {
                            break;
                        }
                    }
                }
            }
        }
        self.without_loose_ends(cut)
    }

    /// The marked edges, without those that lead nowhere, as the stem from the base to where loops part.
    fn without_loose_ends(&self, mut cut: Vec<bool>) -> Vec<HalfedgeId> {
        let edges: Vec<_> = self.inner_edges().filter(|h| cut[h.index()]).collect();
        let mut degree = vec![0u32; self.members.len()];
        for &h in &edges {
            for u in self.ends(h) {
                degree[u] += 1;
            }
        }
        for &h in &edges {
            // Follow the loose end as far as it goes; each edge is removed once.
            let mut loose = Some(h);
            while let Some(h) = loose.take() {
                let Some(&end) = self.ends(h).iter().find(|&&u| degree[u] == 1).filter(|_| cut[h.index()]) else {
                    break;
                };
                cut[h.index()] = false;
                let [u, v] = self.ends(h);
                let other = if u == end { v } else { u };
                degree[end] -= 1;
                degree[other] -= 1;
                if degree[other] == 1 {
                    let around = self.members.group(other).iter().flat_map(|&v| self.mesh.outgoing(v));
                    loose =
                        around.filter(|&h| !self.mesh.is_boundary(h)).map(|h| self.lower(h)).find(|h| cut[h.index()]);
                }
            }
        }
        edges.into_iter().filter(|h| cut[h.index()]).collect()
    }

    /// More edges that join all boundary loops, those that `cuts` make included, into one: the minimum
    /// spanning tree of the paths between nearest boundaries (K. Mehlhorn, A faster approximation
    /// algorithm for the Steiner problem in graphs, 1988). At most twice the least length.
    fn join_boundaries(&self, cuts: &[HalfedgeId]) -> Vec<HalfedgeId> {
        let n = self.members.len();
        let mut sites = DisjointSets::new(n);
        let mut is_site: Vec<bool> = (0..n).map(|u| u < self.loops).collect();
        for &h in cuts {
            let [u, v] = self.ends(h);
            (is_site[u], is_site[v]) = (true, true);
            sites.join(u, v);
        }
        // Each node's way to the nearest site.
        let mut tree = Tree { distance: vec![f64::INFINITY; n], parent: vec![HalfedgeId::NONE; n] };
        let mut nearest: Vec<u32> = (0..n as u32).collect();
        let mut heap = MinHeap::new(n);
        for u in (0..n).filter(|&u| is_site[u]) {
            tree.distance[u] = 0.0;
            nearest[u] = sites.root(u) as u32;
            heap.push_or_lower(u, 0.0);
        }
        while let Some((u, here)) = heap.pop() {
            for &v in self.members.group(u) {
                for h in self.mesh.outgoing(v).filter(|&h| !self.mesh.is_boundary(h)) {
                    let (to, d) = (self.ends(h)[1], here + self.cost[h.index()]);
                    if d < tree.distance[to] {
                        (tree.distance[to], tree.parent[to], nearest[to]) = (d, h, nearest[u]);
                        heap.push_or_lower(to, d);
                    }
                }
            }
        }
        let mut bridges: Vec<(f64, HalfedgeId)> = self
            .inner_edges()
            .filter_map(|h| {
                let [u, v] = self.ends(h);
                let across = tree.distance[u] + tree.distance[v] + self.cost[h.index()];
                (across.is_finite() && nearest[u] != nearest[v]).then_some((across, h))
            })
            .collect();
        bridges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut more = Vec::new();
        for (_, h) in bridges {
            let [u, v] = self.ends(h);
            if sites.join(nearest[u] as usize, nearest[v] as usize) {
                more.push(h);
                for end in [u, v] {
                    more.extend(self.path_to_base(&tree, end).map(|h| self.lower(h)));
                }
            }
        }
        more.sort_unstable();
        more.dedup();
        more
    }
}

/// The index of the greatest finite value, the lowest of several; 0 if there is none.
fn farthest(distance: &[f64]) -> usize {
    let mut best = 0;
    for (i, &d) in distance.iter().enumerate() {
        if d.is_finite() && (d > distance[best] || !distance[best].is_finite()) {
            best = i;
        }
    }
    best
}

#[cfg(test)]
mod tests;
