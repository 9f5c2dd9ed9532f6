//! Landmarks of a graph.

use super::dijkstra::add_source;
use super::weighted_graph::WeightedGraph;
use crate::collections::MinHeap;
use crate::progress::{Cancelled, Progress};

/// At most `count` nodes of a graph, all different, each as far along edges from all before it as any node, beginning
/// with `first`.
///
/// A component without a chosen node is farther than anything else. Ties go to the lower index. Fewer are returned if
/// the rest coincides with those chosen; none if `first` is not a node. Each choice searches only the nodes that come
/// nearer by it: O(n log n log k) together, and O(kn) to look for the farthest.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn farthest_nodes(
    graph: &WeightedGraph,
    count: usize,
    first: usize,
    progress: &Progress,
) -> Result<Vec<usize>, Cancelled> {
    let n = graph.node_count();
    let mut cover = vec![f64::INFINITY; n];
    let mut heap = MinHeap::new(n);
    let mut chosen = Vec::new();
    let mut next = (first < n).then_some(first);
    while let Some(node) = next.filter(|_| chosen.len() < count) {
        progress.check()?;
        chosen.push(node);
        add_source(graph, node, &mut cover, &mut heap, progress)?;
        let farther = |best: Option<(usize, f64)>, (v, &d): (usize, &f64)| match best {
            Some((_, most)) if d <= most => best,
            _ => Some((v, d)),
        };
        next = cover.iter().enumerate().fold(None, farther).filter(|(_, d)| *d > 0.0).map(|(v, _)| v);
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_halved_and_halved_again() {
        let path = WeightedGraph::from_edges(17, (1..17).map(|v| (v - 1, v, 1.0)));
        let chosen = farthest_nodes(&path, 5, 0, &Progress::new()).expect("not cancelled");
        assert_eq!(chosen, [0, 16, 8, 4, 12]);
        assert_eq!(farthest_nodes(&path, 0, 0, &Progress::new()), Ok(vec![]));
        assert_eq!(farthest_nodes(&path, 3, 17, &Progress::new()), Ok(vec![]));
    }

    #[test]
    fn components_come_first_and_coincident_nodes_not_at_all() {
        let graph = WeightedGraph::from_edges(5, [(0, 1, 5.0), (2, 3, 1.0), (3, 4, 0.0)]);
        let chosen = farthest_nodes(&graph, 9, 1, &Progress::new()).expect("not cancelled");
        assert_eq!(chosen, [1, 2, 0, 3]);
        let progress = Progress::new();
        progress.cancel();
        assert_eq!(farthest_nodes(&graph, 9, 1, &progress), Err(Cancelled::OnRequest));
    }
}
