//! Whether a neighbourhood graph is in one piece, and how to mend it if it is not.

use std::fmt;

use super::kd_tree::KdTree;
use super::knn_graph::{Places, search_each};
use super::weighted_graph::WeightedGraph;
use crate::collections::DisjointSets;
use crate::progress::{Cancelled, Progress};

/// Where the search for a number of neighbours that connects begins; doubled until one does.
const FIRST_TRY: usize = 8;

/// Pieces that the text names, the largest one apart.
const NAMED: usize = 5;

/// A connected piece of a neighbourhood graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Piece {
    /// Number of points in the piece.
    pub size: usize,
    /// The point of the piece with the lowest number.
    pub point: usize,
}

/// How the points of a cloud are connected by the edges to their nearest neighbours. Displayed as text, it names the pieces
/// and says what would connect them.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Connectivity {
    /// Number of neighbours that each point is joined to.
    pub neighbours: usize,
    /// The connected pieces of the neighbourhood graph, the largest first; equally large pieces are in the order of their
    /// `point`. A small piece is a cluster of outliers. It has more points than `neighbours`, since a point of a smaller
    /// one would have neighbours elsewhere.
    pub pieces: Vec<Piece>,
    /// Points with a coordinate that is not finite. They are in no piece.
    pub nowhere: Vec<usize>,
    /// The least number of neighbours that connects all points, if some number up to `tried` does; equal to `neighbours` if
    /// that number does.
    pub enough: Option<usize>,
    /// The largest number of neighbours that was tried.
    pub tried: usize,
}

impl Connectivity {
    /// Whether all points with finite coordinates are in one piece.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.pieces.len() <= 1
    }
}

impl fmt::Display for Connectivity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let points = |count: usize| if count == 1 { "point" } else { "points" };
        let total: usize = self.pieces.iter().map(|p| p.size).sum();
        let by = self.neighbours;
        match &self.pieces[..] {
            [] | [_] => write!(f, "the edges to {by} neighbours connect {total} {}", points(total))?,
            [largest, rest @ ..] => {
                write!(f, "the edges to {by} neighbours leave {total} points in {} pieces: ", self.pieces.len())?;
                write!(f, "{} {} about point {}", largest.size, points(largest.size), largest.point)?;
                for piece in &rest[..rest.len().min(NAMED)] {
                    write!(f, ", {} about {}", piece.size, piece.point)?;
                }
                if rest.len() > NAMED {
                    write!(f, " and {} smaller pieces", rest.len() - NAMED)?;
                }
                match self.enough {
                    Some(k) => write!(f, "; {k} neighbours would connect them")?,
                    None => write!(f, "; no number of neighbours up to {} connects them", self.tried)?,
                }
            }
        }
        if let [first, ..] = self.nowhere[..] {
            let count = self.nowhere.len();
            write!(f, "; {count} {} without finite coordinates left out, the first is point {first}", points(count))?;
        }
        Ok(())
    }
}

/// How the points of `graph`, which [`knn_graph()`](super::knn_graph()) made of `points` with so many `neighbours`, hang
/// together. If they do not, looks for more neighbours that connect them, up to `most`.
///
/// O(n) if the graph is connected, else O(n k log n) for k up to `most` in few dimensions. The same for any number of
/// threads.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn connectivity(
    graph: &WeightedGraph,
    points: &[f64],
    dimension: usize,
    neighbours: usize,
    most: usize,
    progress: &Progress,
) -> Result<Connectivity, Cancelled> {
    let nowhere: Vec<usize> = match dimension {
        0 => Vec::new(),
        _ => (0..graph.node_count())
            .filter(|&i| !points.chunks_exact(dimension).nth(i).is_some_and(|p| p.iter().all(|x| x.is_finite())))
            .collect(),
    };
    let (label, count) = graph.components();
    let mut pieces = vec![Piece { size: 0, point: usize::MAX }; count];
    for (i, &l) in label.iter().enumerate() {
        let piece = &mut pieces[l as usize];
        piece.size += 1;
        piece.point = piece.point.min(i);
    }
    pieces.retain(|p| nowhere.binary_search(&p.point).is_err());
    pieces.sort_unstable_by_key(|p| (std::cmp::Reverse(p.size), p.point));
    let connected = pieces.len() <= 1;
    let enough = if connected { Some(neighbours) } else { least_neighbours(points, dimension, most, progress)? };
    Ok(Connectivity { neighbours, pieces, nowhere, enough, tried: if connected { neighbours } else { most } })
}

/// The least number of neighbours, from 1 to `most`, whose [`knn_graph()`](super::knn_graph()) is connected, points with
/// a coordinate that is not finite apart; none if not even `most` connect it.
///
/// More neighbours never cut a graph. O(n k log n) in few dimensions, where k is at most twice the result.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn least_neighbours(
    points: &[f64],
    dimension: usize,
    most: usize,
    progress: &Progress,
) -> Result<Option<usize>, Cancelled> {
    let places = Places::of(points, dimension);
    let most = most.min(places.first.len().max(2) - 1);
    let tree = KdTree::new(points, dimension, places.first.clone());
    let mut tried = FIRST_TRY.min(most);
    // Doubles each time: at most 64 rounds.
    while tried > 0 {
        let ranked = search_each(tree.order(), progress, |i, found, neighbours: &mut Vec<[u32; 2]>| {
            tree.nearest(i, tried, found);
            neighbours.extend(found.iter().map(|&(_, j)| [i, j]));
        })?;
        if let Some(enough) = rank_that_connects(&ranked, tried, &places) {
            return Ok(Some(enough));
        }
        if tried == most {
            break;
        }
        tried = tried.saturating_mul(2).min(most);
    }
    Ok(None)
}

/// The least rank up to which the neighbours, so many of each place in order of distance, connect all places.
fn rank_that_connects(ranked: &[Vec<[u32; 2]>], count: usize, places: &Places) -> Option<usize> {
    let mut sets = DisjointSets::new(places.count);
    let mut pieces = places.first.len();
    for rank in 1..=count {
        for edges in ranked {
            for &[i, j] in edges.iter().skip(rank - 1).step_by(count) {
                pieces -= usize::from(sets.join(i as usize, j as usize));
            }
        }
        if pieces <= 1 {
            return Some(rank);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesics::knn_graph;
    use proptest::prelude::*;

    fn judge(points: &[f64], dimension: usize, neighbours: usize, most: usize) -> Connectivity {
        let progress = Progress::new();
        let graph = knn_graph(points, dimension, neighbours, &progress).expect("not cancelled");
        connectivity(&graph, points, dimension, neighbours, most, &progress).expect("not cancelled")
    }

    /// A row of points one apart from `start` on.
    fn row(start: f64, count: usize) -> impl Iterator<Item = f64> {
        (0..count).map(move |i| start + i as f64)
    }

    proptest! {
        #[test]
        fn the_number_that_connects_is_the_least(
            coordinates in prop::collection::vec(prop_oneof![-9i32..-4, 30..36, 80..83], 2..160),
            dimension in 1..3usize,
        ) {
            let points: Vec<f64> = coordinates.iter().map(|&x| f64::from(x)).collect();
            let n = points.len() / dimension;
            let pieces = |k: usize| judge(&points, dimension, k, 0).pieces.len();
            let found = least_neighbours(&points, dimension, n, &Progress::new()).expect("not cancelled");
            let expected = (1..=n).find(|&k| pieces(k) <= 1);
            prop_assert_eq!(found, expected, "all neighbours connect");
            if let Some(enough) = expected && enough > 1 {
                let below = least_neighbours(&points, dimension, enough - 1, &Progress::new());
                prop_assert_eq!(below, Ok(None));
            }
        }
    }

    #[test]
    fn pieces_are_named_with_what_connects_them() {
        // 30 points, 8 outliers, and 5 that nearly coincide; one is nowhere.
        let mut points: Vec<f64> = row(0.0, 30).chain(row(1000.0, 8)).collect();
        points.extend([f64::NAN, 5000.0, 5000.1, 5000.2, 5000.3, 5000.4]);
        let found = judge(&points, 1, 3, 20);
        let pieces = [(30, 0), (8, 30), (5, 39)].map(|(size, point)| Piece { size, point });
        assert_eq!(found.pieces, pieces);
        assert_eq!((found.nowhere.as_slice(), found.enough, found.is_connected()), (&[38][..], Some(8), false));
        assert_eq!(
            found.to_string(),
            "the edges to 3 neighbours leave 43 points in 3 pieces: 30 points about point 0, 8 about 30, 5 about 39; \
             8 neighbours would connect them; 1 point without finite coordinates left out, the first is point 38"
        );
        let none = judge(&points, 1, 3, 7);
        assert_eq!((none.enough, none.tried), (None, 7));
        assert!(none.to_string().contains("no number of neighbours up to 7 connects them"), "{none}");
        let all = judge(&points, 1, 8, 20);
        assert!(all.is_connected() && all.enough == Some(8) && all.pieces[0].size == 43, "{all:?}");
    }

    #[test]
    fn many_pieces_are_not_all_named() {
        let points: Vec<f64> = (0..40).flat_map(|cluster| row(f64::from(cluster) * 1e4, 4)).collect();
        let text = judge(&points, 1, 3, 2).to_string();
        assert!(text.contains("160 points in 40 pieces") && text.contains("and 34 smaller pieces"), "{text}");
    }

    #[test]
    fn a_single_outlier_is_connected_and_so_is_nothing() {
        let points: Vec<f64> = row(0.0, 9).chain([1e6]).collect();
        assert!(judge(&points, 1, 2, 9).is_connected());
        for points in [vec![], vec![1.0], vec![1.0; 20], vec![f64::NAN, 2.0]] {
            let found = judge(&points, 1, 2, 9);
            assert!(found.is_connected(), "{found:?}");
            assert!(!found.to_string().is_empty());
        }
        assert!(judge(&[1.0, 2.0], 0, 2, 9).is_connected());
    }
}
