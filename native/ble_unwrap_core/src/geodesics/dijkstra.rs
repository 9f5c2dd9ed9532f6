//! Shortest paths along the edges of a graph (E. W. Dijkstra, 1959).

use rayon::prelude::*;

use super::min_heap::MinHeap;
use super::weighted_graph::WeightedGraph;
use crate::progress::{Cancelled, Progress};

/// Nodes settled between two looks at the cancel flag.
const CHECK_EVERY: usize = 4096;

/// The arrays one search works in; make one a thread and use it for many sources.
#[derive(Clone, Debug, Default)]
pub struct DijkstraScratch {
    distance: Vec<f64>,
    heap: MinHeap,
}

/// Distances along edges to every node from the nearest source, each beginning at its offset (≥ 0);
/// infinite where no source leads. Sources that are not nodes are left out. O((n + m) log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub fn dijkstra<'s>(
    graph: &WeightedGraph,
    sources: &[(usize, f64)],
    scratch: &'s mut DijkstraScratch,
    progress: &Progress,
) -> Result<&'s [f64], Cancelled> {
    let n = graph.node_count();
    scratch.distance.clear();
    scratch.distance.resize(n, f64::INFINITY);
    scratch.heap.reset(n);
    for &(v, offset) in sources.iter().filter(|s| s.0 < n) {
        offer(&mut scratch.distance, &mut scratch.heap, v, offset.max(0.0));
    }
    settle(graph, &mut scratch.distance, &mut scratch.heap, progress)?;
    Ok(&scratch.distance)
}

/// Lowers `distance` to what one more source at node `source` gives, looking only at nodes that come
/// nearer: the cost is that of the new source's own cell, not of the graph. `heap` must be empty and
/// fit the graph.
pub(super) fn add_source(
    graph: &WeightedGraph,
    source: usize,
    distance: &mut [f64],
    heap: &mut MinHeap,
    progress: &Progress,
) -> Result<(), Cancelled> {
    offer(distance, heap, source, 0.0);
    settle(graph, distance, heap, progress)
}

fn settle(
    graph: &WeightedGraph,
    distance: &mut [f64],
    heap: &mut MinHeap,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let mut settled = 0usize;
    while let Some((u, here)) = heap.pop() {
        settled += 1;
        if settled.is_multiple_of(CHECK_EVERY) {
            progress.check()?;
        }
        for (v, length) in graph.neighbours(u) {
            offer(distance, heap, v, here + length);
        }
    }
    Ok(())
}

#[inline]
fn offer(distance: &mut [f64], heap: &mut MinHeap, v: usize, d: f64) {
    if d < distance[v] {
        distance[v] = d;
        heap.push_or_lower(v, d);
    }
}

/// Distances along the edges of a graph from each of `sources` to every node, as rows of length n one
/// after another: the geodesic distances of a point cloud whose graph [`knn_graph`](super::knn_graph())
/// made (paper, equation 12). Infinite between components; sources run in parallel, with the same
/// result for any number of threads. The row of a source that is no node is infinite.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub fn graph_distances(graph: &WeightedGraph, sources: &[usize], progress: &Progress) -> Result<Vec<f64>, Cancelled> {
    let n = graph.node_count();
    let mut rows = vec![f64::INFINITY; n * sources.len()];
    if n > 0 {
        rows.par_chunks_mut(n).zip(sources).try_for_each_init(
            DijkstraScratch::default,
            |scratch, (row, &source)| {
                progress.check()?;
                row.copy_from_slice(dijkstra(graph, &[(source, 0.0)], scratch, progress)?);
                Ok(())
            },
        )?;
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Bellman and Ford's rounds: slow and obviously right.
    fn reference(n: usize, edges: &[(usize, usize, f64)], source: usize) -> Vec<f64> {
        let mut d = vec![f64::INFINITY; n];
        d[source] = 0.0;
        for _ in 0..n {
            for &(u, v, l) in edges {
                d[v] = d[v].min(d[u] + l);
                d[u] = d[u].min(d[v] + l);
            }
        }
        d
    }

    proptest! {
        #[test]
        fn agrees_with_relaxing_every_edge_n_times(
            edges in prop::collection::vec((0..20usize, 0..20usize, 0..8u32), 0..50),
            cut in 0..20usize,
        ) {
            let edges: Vec<_> = edges.into_iter().map(|(u, v, l)| (u, v, f64::from(l))).collect();
            let graph = WeightedGraph::from_edges(20, edges.clone());
            let progress = Progress::new();
            let rows = graph_distances(&graph, &[0, cut], &progress).expect("not cancelled");
            let (first, second) = (reference(20, &edges, 0), reference(20, &edges, cut));
            prop_assert_eq!(&rows[..20], &first[..]);
            prop_assert_eq!(&rows[20..], &second[..]);

            // One more source changes the cover to the lesser of both.
            let (mut cover, mut heap) = (first.clone(), MinHeap::new(20));
            add_source(&graph, cut, &mut cover, &mut heap, &progress).expect("not cancelled");
            let least: Vec<_> = first.iter().zip(&second).map(|(a, b)| a.min(*b)).collect();
            prop_assert_eq!(cover, least);
        }
    }

    #[test]
    fn offsets_and_absent_sources() {
        let graph = WeightedGraph::from_edges(3, [(0, 1, 1.0)]);
        let mut scratch = DijkstraScratch::default();
        let d =
            dijkstra(&graph, &[(0, 2.0), (1, 0.5), (7, 0.0)], &mut scratch, &Progress::new()).expect("not cancelled");
        assert_eq!(d, [1.5, 0.5, f64::INFINITY]);
        assert_eq!(graph_distances(&graph, &[9], &Progress::new()).expect("not cancelled"), [f64::INFINITY; 3]);
        let cancelled = Progress::new();
        cancelled.cancel();
        assert_eq!(graph_distances(&graph, &[0], &cancelled), Err(Cancelled));
    }
}
