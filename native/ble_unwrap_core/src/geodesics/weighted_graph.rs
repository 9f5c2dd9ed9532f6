//! An undirected graph with edge lengths, in compressed rows.

use crate::mesh::TriMesh;

/// An undirected graph with a length for each edge: the neighbours of node v and the lengths to them
/// are two parallel slices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WeightedGraph {
    offsets: Vec<usize>,
    targets: Vec<u32>,
    lengths: Vec<f64>,
}

impl WeightedGraph {
    /// A graph of `n` nodes from edges (u, v, length), each given once and stored both ways. Of
    /// several edges between the same nodes the shortest is kept. Left out: loops, edges to nodes that
    /// are not there, lengths that are negative or no number. O(n + m log d), where d is the most edges of a node.
    #[must_use]
    pub(crate) fn from_edges(n: usize, edges: impl IntoIterator<Item = (usize, usize, f64)>) -> Self {
        let mut edges: Vec<(u32, u32, f64)> = edges
            .into_iter()
            .filter(|&(u, v, length)| u < n && v < n && u != v && length >= 0.0)
            .map(|(u, v, length)| (u as u32, v as u32, length))
            .collect();
        let mut offsets = vec![0; n + 1];
        for &(u, v, _) in &edges {
            offsets[u as usize + 1] += 1;
            offsets[v as usize + 1] += 1;
        }
        for u in 0..n {
            offsets[u + 1] += offsets[u];
        }
        let mut next = offsets.clone();
        let mut arcs = vec![(0u32, 0.0f64); offsets[n]];
        for (u, v, length) in edges.drain(..) {
            for (from, to) in [(u, v), (v, u)] {
                arcs[next[from as usize]] = (to, length);
                next[from as usize] += 1;
            }
        }
        let (mut targets, mut lengths) = (Vec::with_capacity(arcs.len()), Vec::with_capacity(arcs.len()));
        for u in 0..n {
            let row = &mut arcs[offsets[u]..offsets[u + 1]];
            row.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            offsets[u] = targets.len();
            for same in row.chunk_by(|a, b| a.0 == b.0) {
                targets.push(same[0].0);
                lengths.push(same[0].1);
            }
        }
        offsets[n] = targets.len();
        Self { offsets, targets, lengths }
    }

    /// The vertices and edges of a mesh.
    #[must_use]
    pub(crate) fn of_mesh(mesh: &TriMesh) -> Self {
        let edges = mesh.edges().map(|h| (mesh.from(h).index(), mesh.to(h).index(), mesh.edge_length(h)));
        Self::from_edges(mesh.vertex_count(), edges)
    }

    /// The graph with more edges, such as the bridges of [`shortest_bridges`](super::shortest_bridges()); which of
    /// them are taken says [`WeightedGraph::from_edges`].
    #[must_use]
    pub(crate) fn with_edges(&self, edges: &[(usize, usize, f64)]) -> Self {
        let n = self.node_count();
        let present = (0..n).flat_map(|u| self.neighbours(u).filter(move |&(v, _)| u < v).map(move |(v, l)| (u, v, l)));
        Self::from_edges(n, present.chain(edges.iter().copied()))
    }

    /// Number of nodes.
    #[must_use]
    pub(crate) fn node_count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of edges.
    #[cfg(test)]
    #[must_use]
    pub(crate) fn edge_count(&self) -> usize {
        self.targets.len() / 2
    }

    /// The neighbours of a node, ascending, with the lengths to them.
    #[inline]
    pub(crate) fn neighbours(&self, node: usize) -> impl ExactSizeIterator<Item = (usize, f64)> + '_ {
        let row = self.offsets[node]..self.offsets[node + 1];
        self.targets[row.clone()].iter().map(|&t| t as usize).zip(self.lengths[row].iter().copied())
    }

    /// A component label for each node and the number of components; labels ascend with the lowest
    /// node. Distances between components are infinite; [`connectivity()`](super::connectivity()) tells how to mend the
    /// graph of a point cloud.
    #[must_use]
    pub(crate) fn components(&self) -> (Vec<u32>, usize) {
        let mut label = vec![u32::MAX; self.node_count()];
        let mut count = 0;
        let mut stack = Vec::new();
        for seed in 0..self.node_count() {
            if label[seed] != u32::MAX {
                continue;
            }
            label[seed] = count;
            stack.push(seed);
            while let Some(u) = stack.pop() {
                for (v, _) in self.neighbours(u) {
                    if label[v] == u32::MAX {
                        label[v] = count;
                        stack.push(v);
                    }
                }
            }
            count += 1;
        }
        (label, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces::grid;

    #[test]
    fn edges_go_both_ways_and_bad_ones_are_left_out() {
        let g = WeightedGraph::from_edges(
            4,
            [(0, 1, 2.0), (1, 0, 1.0), (2, 2, 1.0), (2, 9, 1.0), (2, 3, f64::NAN), (2, 3, -1.0)],
        );
        assert_eq!(g.edge_count(), 1);
        assert_eq!(g.neighbours(1).collect::<Vec<_>>(), [(0, 1.0)]);
        assert_eq!(g.neighbours(0).collect::<Vec<_>>(), [(1, 1.0)]);
        assert_eq!(g.components(), (vec![0, 0, 1, 2], 3));
    }

    #[test]
    fn mesh_graph_has_the_edges_of_the_mesh() {
        let mesh = grid(3, 4, [1.0, 1.0], 0.0);
        let g = WeightedGraph::of_mesh(&mesh);
        assert_eq!((g.node_count(), g.edge_count()), (mesh.vertex_count(), mesh.topology().edges));
        assert_eq!(g.components().1, 1);
    }
}
