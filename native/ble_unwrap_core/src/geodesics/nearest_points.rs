//! The nearest of some points to others.

use rayon::prelude::*;

use super::kd_tree::KdTree;
use crate::progress::{Cancelled, Progress};

/// For each of the `queries` the `k` nearest of `points`: index and distance, by distance and then by index, one list
/// after another of min(k, n) entries each.
///
/// Both hold `dimension` ≥ 1 coordinates a point, row after row, all finite. Points that coincide count each. O(log n) a
/// query in few dimensions after O(n log n) for the tree; the same for any number of threads.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn nearest_points(
    points: &[f64],
    queries: &[f64],
    dimension: usize,
    k: usize,
    progress: &Progress,
) -> Result<Vec<(usize, f64)>, Cancelled> {
    let n = points.len() / dimension;
    let m = queries.len() / dimension;
    // The tree looks for its own points only; queries come after them.
    let both = [&points[..n * dimension], queries].concat();
    let tree = KdTree::new(&both, dimension, (0..n as u32).collect());
    let lists: Vec<Vec<(usize, f64)>> = (0..m)
        .into_par_iter()
        .map_init(Vec::new, |found, i| {
            progress.check()?;
            tree.nearest((n + i) as u32, k, found);
            Ok(found.iter().map(|&(square, j)| (j as usize, square.sqrt())).collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(lists.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_first_ties_by_index() {
        let points = [0.0, 1.0, 2.0, 1.0, -3.0];
        let found = nearest_points(&points, &[1.0, 9.0], 1, 3, &Progress::new()).expect("not cancelled");
        assert_eq!(found, [(1, 0.0), (3, 0.0), (0, 1.0), (2, 7.0), (1, 8.0), (3, 8.0)]);
        let all = nearest_points(&points, &[5.0], 1, 9, &Progress::new()).expect("not cancelled");
        assert_eq!(all.len(), 5);
        assert_eq!(nearest_points(&points, &[5.0], 1, 0, &Progress::new()), Ok(vec![]));
    }
}
