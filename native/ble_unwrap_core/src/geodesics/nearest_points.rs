//! The nearest of some points to others.

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};

/// For each of the `queries` the `k` nearest of `points`: index and distance, by distance and then by index, one list
/// after another of min(k, n) entries each.
///
/// Both hold `dimension` ≥ 1 coordinates a point, row after row, all finite.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub fn nearest_points(
    points: &[f64],
    queries: &[f64],
    dimension: usize,
    k: usize,
    progress: &Progress,
) -> Result<Vec<(usize, f64)>, Cancelled> {
    let lists: Vec<Vec<(usize, f64)>> = queries
        .par_chunks_exact(dimension)
        .map(|q| {
            progress.check()?;
            let square = |p: &[f64]| p.iter().zip(q).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let mut found: Vec<(usize, f64)> = points.chunks_exact(dimension).map(square).enumerate().collect();
            let order = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
            if k > 0 && k < found.len() {
                found.select_nth_unstable_by(k - 1, order);
            }
            found.truncate(k);
            found.sort_unstable_by(order);
            found.iter_mut().for_each(|f| f.1 = f.1.sqrt());
            Ok(found)
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
