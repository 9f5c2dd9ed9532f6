//! The shortest edges that make one piece of a point cloud.

use rayon::prelude::*;

use super::kd_tree::{KdTree, Pair};
use super::knn_graph::Places;
use super::weighted_graph::WeightedGraph;
use crate::collections::DisjointSets;
use crate::progress::{Cancelled, Progress};

/// Points searched between two looks at the cancel flag, and at least so many a task.
const CHUNK: usize = 256;

/// Rounds at most; each at least halves the number of pieces, which fits 32 bits.
const MAX_ROUNDS: usize = 33;

/// The edges (u, v, length) of least total length that connect the pieces of a `graph` on `points`: one fewer than
/// there are pieces, between the nearest points of any two that they join, shortest first. Of equally
/// short ones those of lower index are taken.
///
/// Points with a coordinate that is not finite stay alone. What leads across a bridge passes through its
/// two ends: distances between the pieces are those of a world in which there is no other way, not those on a
/// surface that was sampled too thinly. Put the edges in with [`WeightedGraph::with_edges`].
///
/// O(n log n) a round and up to log₂ of the number of pieces rounds (O. Borůvka, 1926), in few dimensions; the largest piece is not
/// searched. The same for any number of threads.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn shortest_bridges(
    graph: &WeightedGraph,
    points: &[f64],
    dimension: usize,
    progress: &Progress,
) -> Result<Vec<(usize, usize, f64)>, Cancelled> {
    let places = Places::of(points, dimension);
    let (mut label, count) = graph.components();
    // Points beyond the nodes of the graph are pieces, too.
    let beyond = places.count.saturating_sub(label.len());
    label.extend((count..count + beyond).map(|l| l as u32));
    let mut sets = DisjointSets::new(count + beyond);
    let mut bridges = Vec::new();
    for &[first, again] in &places.again {
        if sets.join(label[first as usize] as usize, label[again as usize] as usize) {
            bridges.push((first as usize, again as usize, 0.0));
        }
    }
    let tree = KdTree::new(points, dimension, places.first.clone());
    for _ in 0..MAX_ROUNDS {
        for l in &mut label {
            *l = sets.root(*l as usize) as u32;
        }
        let mut joined = nearest_pairs(&tree, &places.first, &label, progress)?;
        if joined.is_empty() {
            break;
        }
        joined.sort_unstable_by(|a, b| a.square.total_cmp(&b.square).then((a.low, a.high).cmp(&(b.low, b.high))));
        for Pair { square, low, high } in joined {
            let [u, v] = [low as usize, high as usize];
            if sets.join(label[u] as usize, label[v] as usize) {
                bridges.push((u, v, square.sqrt()));
            }
        }
    }
    bridges.sort_unstable_by(|a, b| a.2.total_cmp(&b.2).then((a.0, a.1).cmp(&(b.0, b.1))));
    Ok(bridges)
}

/// For each label but the commonest the shortest pair of a point that has it with one that has not.
fn nearest_pairs(
    tree: &KdTree<'_>,
    chosen: &[u32],
    label: &[u32],
    progress: &Progress,
) -> Result<Vec<Pair>, Cancelled> {
    let mut order = chosen.to_vec();
    order.sort_unstable_by_key(|&i| (label[i as usize], i));
    let same = |a: &u32, b: &u32| label[*a as usize] == label[*b as usize];
    // `max_by_key` takes the last of several, so that the index decides.
    let largest =
        order.chunk_by(same).enumerate().max_by_key(|&(i, piece)| (piece.len(), i)).map(|(_, piece)| piece[0]);
    let Some(largest) = largest else { return Ok(Vec::new()) };
    order.retain(|&i| !same(&i, &largest));
    let common = tree.common_labels(label);
    // Each chunk has the best pair of each label in it; a label may run over several.
    let chunks: Vec<Vec<(u32, Pair)>> = order
        .par_chunks(CHUNK)
        .map(|chunk| {
            progress.check()?;
            let best = |piece: &[u32]| {
                piece.iter().fold(Pair::NONE, |best, &i| tree.nearest_elsewhere(i, label, &common, best))
            };
            Ok(chunk.chunk_by(same).map(|piece| (label[piece[0] as usize], best(piece))).collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut pairs: Vec<(u32, Pair)> = Vec::new();
    for (l, pair) in chunks.into_iter().flatten() {
        match pairs.last_mut() {
            Some((last, best)) if *last == l => {
                if pair < *best {
                    *best = pair;
                }
            }
            _ => pairs.push((l, pair)),
        }
    }
    Ok(pairs.into_iter().map(|(_, pair)| pair).filter(|pair| *pair != Pair::NONE).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesics::kd_tree::square_between;
    use crate::geodesics::{graph_distances, knn_graph};
    use proptest::prelude::*;

    fn graph_of(points: &[f64], dimension: usize, k: usize) -> WeightedGraph {
        knn_graph(points, dimension, k, &Progress::new()).expect("not cancelled")
    }

    fn bridges_of(graph: &WeightedGraph, points: &[f64], dimension: usize) -> Vec<(usize, usize, f64)> {
        shortest_bridges(graph, points, dimension, &Progress::new()).expect("not cancelled")
    }

    /// J. B. Kruskal's way, with all pairs.
    fn by_all_pairs(graph: &WeightedGraph, points: &[f64], dimension: usize) -> Vec<(usize, usize, f64)> {
        let p: Vec<&[f64]> = points.chunks_exact(dimension).collect();
        let (label, count) = graph.components();
        let mut pairs = Vec::new();
        for i in 0..p.len() {
            for j in i + 1..p.len() {
                pairs.push((square_between(p[i], p[j]), i, j));
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut sets = DisjointSets::new(count);
        pairs.retain(|&(_, i, j)| sets.join(label[i] as usize, label[j] as usize));
        pairs.into_iter().map(|(square, i, j)| (i, j, square.sqrt())).collect()
    }

    proptest! {
        #[test]
        fn agrees_with_trying_all_pairs(
            // Integers make many ties, halves of a wide range few.
            coordinates in prop::collection::vec(prop_oneof![0..6i32, 40..44, -3000..3000], 2..200),
            dimension in 1..4usize,
            k in 0..4usize,
        ) {
            let points: Vec<f64> = coordinates.iter().map(|&x| f64::from(x)).collect();
            let points = &points[..points.len() / dimension * dimension];
            let graph = graph_of(points, dimension, k);
            let found = bridges_of(&graph, points, dimension);
            let expected = by_all_pairs(&graph, points, dimension);
            prop_assert_eq!(found.iter().map(|b| b.2).collect::<Vec<_>>(), expected.iter().map(|b| b.2).collect::<Vec<_>>());
            if k > 0 {
                prop_assert_eq!(&found, &expected, "without coincident points in pieces of their own");
            }
            let whole = graph.with_edges(&found);
            prop_assert!(whole.components().1 <= 1);
            prop_assert_eq!(whole.edge_count(), graph.edge_count() + found.len());
        }
    }

    #[test]
    fn two_sheets_and_an_outlier_cluster_are_joined_where_they_are_nearest() {
        let mut points = Vec::new();
        for i in 0..60 {
            for j in 0..20 {
                let (x, y) = (f64::from(i), f64::from(j));
                points.extend([x, y, 0.0]);
                points.extend([x, y, 7.0 + 0.1 * (x - 40.0).abs() + 0.1 * (y - 5.0).abs()]);
            }
        }
        points.extend((0..5).flat_map(|i| [200.0 + f64::from(i) * 0.1, 5.0, 0.0]));
        points.extend([f64::INFINITY, 0.0, 0.0]);
        let graph = graph_of(&points, 3, 4);
        let bridges = bridges_of(&graph, &points, 3);
        let at = |i: usize, j: usize| 2 * (20 * i + j);
        assert_eq!(bridges, [(at(40, 5), at(40, 5) + 1, 7.0), (at(59, 5), 2400, 141.0)]);
        let d = graph_distances(&graph.with_edges(&bridges), &[at(40, 5)], &Progress::new()).expect("not cancelled");
        assert_eq!((d[at(40, 5) + 1], d[2400]), (7.0, 19.0 + 141.0));
        assert!(d[2405].is_infinite(), "a point that is nowhere has no bridge");
    }

    #[test]
    fn thousands_of_coincident_pieces_cost_no_quadratic_time() {
        let points = vec![0.5; 60_000];
        // Not even all of them are nodes of the graph.
        let lonely = WeightedGraph::from_edges(10_000, []);
        let bridges = bridges_of(&lonely, &points, 2);
        assert_eq!(bridges.len(), 29_999);
        assert!(bridges.iter().all(|b| b.0 == 0 && b.2 == 0.0));
    }

    #[test]
    fn nothing_to_join() {
        for (points, dimension) in [(vec![], 3), (vec![1.0], 1), (vec![1.0, 2.0], 0), (vec![f64::NAN, 1.0], 1)] {
            assert!(bridges_of(&graph_of(&points, dimension, 3), &points, dimension).is_empty());
        }
        let cancelled = Progress::new();
        cancelled.cancel();
        let lonely = WeightedGraph::from_edges(2, []);
        assert_eq!(shortest_bridges(&lonely, &[0.0, 1.0], 1, &cancelled), Err(Cancelled::OnRequest));
    }
}
