//! The neighbourhood graph of a point cloud.

use rayon::prelude::*;

use super::kd_tree::KdTree;
use super::weighted_graph::WeightedGraph;
use crate::progress::{Cancelled, Progress};

/// Points searched between two looks at the cancel flag, and at least so many a task.
const CHUNK: usize = 256;

/// Joins every point to its `k` nearest others by edges of their Euclidean distance; the graph is
/// symmetric, so a point may have more than `k` neighbours.
///
/// `points` holds `dimension` coordinates a point, row after row (an incomplete last row is left
/// out). Of equally near points the one of lower index is nearer. Points with a coordinate that is not
/// finite get no edge. The paper uses 12 neighbours (section 5); whether the graph is connected tells
/// [`WeightedGraph::components`], and if it is not, distances between components are infinite.
/// O(n log n) in few dimensions; the same graph for any number of threads.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub fn knn_graph(points: &[f64], dimension: usize, k: usize, progress: &Progress) -> Result<WeightedGraph, Cancelled> {
    let n = points.len().checked_div(dimension).unwrap_or(0);
    let tree = KdTree::new(points, dimension);
    let chunks: Vec<Vec<(usize, usize, f64)>> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            progress.check()?;
            let (mut edges, mut found) = (Vec::new(), Vec::new());
            for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(n) {
                tree.nearest(i, k, &mut found);
                edges.extend(found.iter().map(|&(square, j)| (i, j as usize, square.sqrt())));
            }
            Ok(edges)
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(WeightedGraph::from_edges(n, chunks.into_iter().flatten()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesics::graph_distances;
    use proptest::prelude::*;

    fn brute_force(points: &[f64], dimension: usize, k: usize) -> WeightedGraph {
        let p: Vec<&[f64]> = points.chunks_exact(dimension).collect();
        let mut edges = Vec::new();
        for i in 0..p.len() {
            let square = |j: usize| p[i].iter().zip(p[j]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let mut others: Vec<_> = (0..p.len()).filter(|&j| j != i).map(|j| (square(j), j)).collect();
            others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
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
    fn no_points_and_no_dimension() {
        for (points, dimension) in [(vec![], 3), (vec![1.0, 2.0], 0), (vec![1.0], 1)] {
            let graph = knn_graph(&points, dimension, 4, &Progress::new()).expect("not cancelled");
            assert_eq!(graph.edge_count(), 0);
        }
    }
}
