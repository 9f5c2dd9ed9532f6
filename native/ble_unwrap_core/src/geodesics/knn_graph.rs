//! The neighbourhood graph of a point cloud.

use rayon::prelude::*;

use super::kd_tree::KdTree;
use super::weighted_graph::WeightedGraph;
use crate::progress::{Cancelled, Progress};

/// Points searched between two looks at the cancel flag, and at least so many a task.
const CHUNK: usize = 256;

/// Joins every point to the points at its `k` nearest other places, by edges of their Euclidean distance;
/// the graph is symmetric, so a point may have more than `k` neighbours.
///
/// `points` holds `dimension` coordinates a point, row after row (an incomplete last row is left
/// out). Of equally near points the one of lower index is nearer. Points that coincide count as one, or
/// `k` of them would be an island: the first of them stands for all, and the others hang from it
/// by edges of length 0. Points with a coordinate that is not finite get no edge.
///
/// Whether so many neighbours connect the graph, and how to mend it if not, tells
/// [`connectivity()`](super::connectivity()). Distances along the graph are those of the paper's section 5.1 for point
/// clouds; it does not say how many neighbours, 12 serve well. O(n log n) in few dimensions; the same graph for any
/// number of threads.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn knn_graph(
    points: &[f64],
    dimension: usize,
    k: usize,
    progress: &Progress,
) -> Result<WeightedGraph, Cancelled> {
    let places = Places::of(points, dimension);
    let tree = KdTree::new(points, dimension, places.first.clone());
    let edges = search_each(tree.order(), progress, |i, found, edges: &mut Vec<(usize, usize, f64)>| {
        tree.nearest(i, k, found);
        edges.extend(found.iter().map(|&(square, j)| (i as usize, j as usize, square.sqrt())));
    })?;
    let again = if k == 0 { &[] } else { &places.again[..] };
    let again = again.iter().map(|&[first, i]| (first as usize, i as usize, 0.0));
    Ok(WeightedGraph::from_edges(places.count, edges.into_iter().flatten().chain(again)))
}

/// Where points are, each place once.
#[derive(Clone, Debug)]
pub(super) struct Places {
    /// Number of points.
    pub(super) count: usize,
    /// The first point at each place, ascending. Points that are nowhere, with a coordinate that is not
    /// finite, are not here.
    pub(super) first: Vec<u32>,
    /// The other points: the first at their place, and themselves.
    pub(super) again: Vec<[u32; 2]>,
}

impl Places {
    /// Finds the points that coincide. O(n log n).
    pub(super) fn of(points: &[f64], dimension: usize) -> Self {
        let count = points.len().checked_div(dimension).unwrap_or(0);
        let point = |i: u32| &points[i as usize * dimension..][..dimension];
        let mut order: Vec<u32> = (0..count as u32).filter(|&i| point(i).iter().all(|x| x.is_finite())).collect();
        // The two zeros are one place; there is no NaN to make coordinates incomparable.
        let compare =
            |&a: &u32, &b: &u32| point(a).partial_cmp(point(b)).unwrap_or(std::cmp::Ordering::Equal).then(a.cmp(&b));
        order.par_sort_unstable_by(compare);
        let (mut first, mut again) = (Vec::with_capacity(order.len()), Vec::new());
        for same in order.chunk_by(|&a, &b| point(a) == point(b)) {
            first.push(same[0]);
            again.extend(same[1..].iter().map(|&i| [same[0], i]));
        }
        first.sort_unstable();
        again.sort_unstable();
        Self { count, first, again }
    }
}

/// Runs `search` for each of some points, in parallel; what it adds, in their order.
pub(super) fn search_each<T: Send>(
    points: &[u32],
    progress: &Progress,
    search: impl Fn(u32, &mut Vec<(f64, u32)>, &mut Vec<T>) + Sync,
) -> Result<Vec<Vec<T>>, Cancelled> {
    let chunks = points.par_chunks(CHUNK).map(|chunk| {
        progress.check()?;
        let (mut found, mut results) = (Vec::new(), Vec::new());
        for &i in chunk {
            search(i, &mut found, &mut results);
        }
        Ok(results)
    });
    chunks.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesics::graph_distances;
    use crate::geodesics::kd_tree::square_between;
    use proptest::prelude::*;

    fn brute_force(points: &[f64], dimension: usize, k: usize) -> WeightedGraph {
        let p: Vec<&[f64]> = points.chunks_exact(dimension).collect();
        let square = |i: usize, j: usize| square_between(p[i], p[j]);
        let first: Vec<usize> = (0..p.len()).filter(|&i| (0..i).all(|j| square(i, j) > 0.0)).collect();
        let mut edges = Vec::new();
        for i in 0..p.len() {
            let mut others: Vec<_> = first.iter().filter(|&&j| j != i).map(|&j| (square(i, j), j)).collect();
            others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let k = if first.contains(&i) { k } else { k.min(1) };
            edges.extend(others.iter().take(k).map(|&(s, j)| (i, j, s.sqrt())));
        }
        WeightedGraph::from_edges(p.len(), edges)
    }

    proptest! {
        #[test]
        fn agrees_with_brute_force(
            // Few distinct coordinates: many ties and coincident points.
            coordinates in prop::collection::vec(-4i32..4, 0..400),
            dimension in 1..5usize,
            k in 0..9usize,
        ) {
            let whole = coordinates.len() / dimension * dimension;
            let points: Vec<f64> = coordinates[..whole].iter().map(|&x| f64::from(x) * 0.5).collect();
            let graph = knn_graph(&points, dimension, k, &Progress::new()).expect("not cancelled");
            prop_assert_eq!(graph, brute_force(&points, dimension, k));
        }

        #[test]
        fn agrees_with_brute_force_in_general_position(
            points in prop::collection::vec(-1.0..1.0f64, 0..600),
            dimension in 1..12usize,
            k in 1..20usize,
        ) {
            let graph = knn_graph(&points, dimension, k, &Progress::new()).expect("not cancelled");
            let whole = points.len() / dimension * dimension;
            prop_assert_eq!(graph, brute_force(&points[..whole], dimension, k));
        }
    }

    #[test]
    fn two_clusters_are_two_components() {
        let mut points = Vec::new();
        for i in 0..40 {
            points.extend([f64::from(i) * 0.1, 0.0]);
            points.extend([f64::from(i) * 0.1, 100.0]);
        }
        points.extend([f64::NAN, 0.0]);
        let graph = knn_graph(&points, 2, 3, &Progress::new()).expect("not cancelled");
        let (label, count) = graph.components();
        assert_eq!(count, 3, "two clusters and the point that is nowhere");
        assert!(label[0] != label[1] && label[2] == label[0]);
        let d = graph_distances(&graph, &[0], &Progress::new()).expect("not cancelled");
        assert!(d[1].is_infinite() && (d[78] - 3.9).abs() < 1e-12);
    }

    #[test]
    fn coincident_points_are_no_island() {
        // 50 points at one place of a row, among them both zeros, and 3 at another.
        let mut points: Vec<f64> = (0..20).map(f64::from).collect();
        points.extend((0..50).map(|i| if i % 2 == 0 { 0.0 } else { -0.0 }));
        points.extend([7.0; 3]);
        let graph = knn_graph(&points, 1, 2, &Progress::new()).expect("not cancelled");
        assert_eq!(graph.components().1, 1);
        let d = graph_distances(&graph, &[45], &Progress::new()).expect("not cancelled");
        let exact: Vec<f64> = points.iter().map(|x| x.abs()).collect();
        assert_eq!(d, exact);
    }

    #[test]
    fn no_points_and_no_dimension() {
        for (points, dimension) in [(vec![], 3), (vec![1.0, 2.0], 0), (vec![1.0], 1)] {
            let graph = knn_graph(&points, dimension, 4, &Progress::new()).expect("not cancelled");
            assert_eq!(graph.edge_count(), 0);
        }
    }
}
