//! Shortest paths along the edges of a graph (E. W. Dijkstra, 1959).

use rayon::prelude::*;

use super::weighted_graph::WeightedGraph;
use crate::collections::MinHeap;
use crate::progress::{Cancelled, Progress};

/// Nodes settled between two looks at the cancel flag.
const CHECK_EVERY: usize = 4096;

/// The arrays one search works in; make one a thread and use it for many sources.
#[derive(Clone, Debug, Default)]
pub(crate) struct DijkstraScratch {
    /// Infinite but for the nodes in `reached`.
    distance: Vec<f64>,
    reached: Vec<u32>,
    heap: MinHeap,
}

impl DijkstraScratch {
    /// The nodes that the last search reached, by distance; of equally far ones first that of lower index,
    /// unless edges without length lead to it. None after a search that was cancelled.
    #[must_use]
    pub(crate) fn reached(&self) -> &[u32] {
        &self.reached
    }

    /// Forgets the last search, at the cost of what it reached.
    fn reset(&mut self, n: usize) {
        if self.distance.len() == n {
            for &v in &self.reached {
                self.distance[v as usize] = f64::INFINITY;
            }
        } else {
            self.distance.clear();
            self.distance.resize(n, f64::INFINITY);
        }
        self.reached.clear();
        self.heap.reset(n);
    }
}

/// Distances along edges to every node from the nearest source, each beginning at its offset (≥ 0);
/// infinite where no source leads. Sources that are not nodes are left out. O((n + m) log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn dijkstra<'s>(
    graph: &WeightedGraph,
    sources: &[(usize, f64)],
    scratch: &'s mut DijkstraScratch,
    progress: &Progress,
) -> Result<&'s [f64], Cancelled> {
    dijkstra_within(graph, sources, f64::INFINITY, scratch, progress)
}

/// The distances of [`dijkstra()`] where they are at most `radius`; infinite elsewhere.
///
/// [`DijkstraScratch::reached`] lists the nodes within the radius, nearest first. Nothing lies within a radius
/// that is negative or no number. A search that uses its scratch again costs O(b log b) for b nodes and
/// edges within the radius, however large the graph.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn dijkstra_within<'s>(
    graph: &WeightedGraph,
    sources: &[(usize, f64)],
    radius: f64,
    scratch: &'s mut DijkstraScratch,
    progress: &Progress,
) -> Result<&'s [f64], Cancelled> {
    let n = graph.node_count();
    scratch.reset(n);
    let DijkstraScratch { distance, reached, heap } = scratch;
    for &(v, offset) in sources.iter().filter(|s| s.0 < n) {
        offer(distance, heap, v, offset.max(0.0), radius);
    }
    let done = settle(graph, distance, heap, radius, |v| reached.push(v as u32), progress);
    if done.is_err() {
        // Nodes that were met and not settled are in no list.
        *scratch = DijkstraScratch::default();
    }
    done?;
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
    offer(distance, heap, source, 0.0, f64::INFINITY);
    settle(graph, distance, heap, f64::INFINITY, |_| (), progress)
}

/// Takes nodes out of the queue, nearest first, until none within `radius` is left; tells each to `settled`.
fn settle(
    graph: &WeightedGraph,
    distance: &mut [f64],
    heap: &mut MinHeap,
    radius: f64,
    mut settled: impl FnMut(usize),
    progress: &Progress,
) -> Result<(), Cancelled> {
    let mut count = 0usize;
    while let Some((u, here)) = heap.pop() {
        settled(u);
        count += 1;
        if count.is_multiple_of(CHECK_EVERY) {
            progress.check()?;
        }
        for (v, length) in graph.neighbours(u) {
            offer(distance, heap, v, here + length, radius);
        }
    }
    Ok(())
}

#[inline]
fn offer(distance: &mut [f64], heap: &mut MinHeap, v: usize, d: f64, radius: f64) {
    if d < distance[v] && d <= radius {
        distance[v] = d;
        heap.push_or_lower(v, d);
    }
}

/// Distances along the edges of a graph from each of `sources` to every node, as rows of length n one
/// after another: the geodesic distances of a point cloud whose graph [`knn_graph`](super::knn_graph())
/// made (paper, section 5.1). Infinite between components; sources run in parallel, with the same
/// result for any number of threads. The row of a source that is no node is infinite.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn graph_distances(
    graph: &WeightedGraph,
    sources: &[usize],
    progress: &Progress,
) -> Result<Vec<f64>, Cancelled> {
    graph_distances_within(graph, sources, f64::INFINITY, progress)
}

/// The rows of [`graph_distances`] where they are at most `radius`; infinite elsewhere. Each source costs
/// what lies within its radius, and a row.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn graph_distances_within(
    graph: &WeightedGraph,
    sources: &[usize],
    radius: f64,
    progress: &Progress,
) -> Result<Vec<f64>, Cancelled> {
    let n = graph.node_count();
    let mut rows = vec![f64::INFINITY; n * sources.len()];
    if n > 0 {
        rows.par_chunks_mut(n).zip(sources).try_for_each_init(
            DijkstraScratch::default,
            |scratch, (row, &source)| {
                progress.check()?;
                row.copy_from_slice(dijkstra_within(graph, &[(source, 0.0)], radius, scratch, progress)?);
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

            // A bound leaves out what is farther and nothing else, whatever the scratch held before.
            let mut scratch = DijkstraScratch::default();
            for radius in [3.0, 12.0, 0.0, 5.0] {
                for (source, all) in [(0, &first), (cut, &second)] {
                    let near = dijkstra_within(&graph, &[(source, 0.0)], radius, &mut scratch, &progress)
                        .expect("not cancelled").to_vec();
                    let expected: Vec<_> =
                        all.iter().map(|&d| if d <= radius { d } else { f64::INFINITY }).collect();
                    prop_assert_eq!(&near, &expected);
                    let mut reached = scratch.reached().to_vec();
                    prop_assert!(reached.is_sorted_by_key(|&v| near[v as usize]));
                    reached.sort_unstable();
                    let expected: Vec<u32> = (0..20).filter(|&v| near[v as usize] <= radius).collect();
                    prop_assert_eq!(reached, expected);
                }
            }

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
        assert_eq!(graph_distances(&graph, &[0], &cancelled), Err(Cancelled::OnRequest));
    }

    #[test]
    fn a_bounded_search_after_a_cancelled_one_begins_afresh() {
        let n = 3 * CHECK_EVERY;
        let path = WeightedGraph::from_edges(n, (1..n).map(|v| (v - 1, v, 1.0)));
        let mut scratch = DijkstraScratch::default();
        let cancelled = Progress::new();
        cancelled.cancel();
        assert!(dijkstra(&path, &[(0, 0.0)], &mut scratch, &cancelled).is_err());
        assert!(scratch.reached().is_empty());
        let d = dijkstra_within(&path, &[(5, 0.0)], 2.0, &mut scratch, &Progress::new()).expect("not cancelled");
        assert_eq!(d.iter().filter(|d| d.is_finite()).count(), 5);
        assert_eq!(scratch.reached(), [5, 4, 6, 3, 7]);
        for radius in [-1.0, f64::NAN] {
            let rows = graph_distances_within(&path, &[5], radius, &Progress::new()).expect("not cancelled");
            assert!(rows.iter().all(|d| d.is_infinite()));
        }
    }
}
