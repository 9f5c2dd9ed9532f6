//! Classical multidimensional scaling: points whose Euclidean distances come nearest to a matrix.
//!
//! Cox and Cox: Multidimensional Scaling, 2nd edition, Chapman & Hall/CRC, 2000, section 2.2.
//! de Silva and Tenenbaum: Sparse multidimensional scaling using landmark points, Stanford
//! technical report, 2004, section 2: placing further points by distances to the first.

use rayon::prelude::*;

use super::krylov::{LANES, block_width, leading_of_operator, pays};
use super::symmetric::{EigenError, Eigenpairs, leading_eigenpairs};
use crate::memory;
use crate::progress::Progress;

/// A coordinate is kept only where its eigenvalue exceeds this share of the largest: below it
/// the double-centred matrix is rounding noise, and placement divides by the eigenvalue's root.
const LEAST_EIGENVALUE: f64 = 1e-12;

/// Classical scaling of k points: coordinates along the principal axes and the spectrum.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mds {
    /// The eigenvalues of B = −½JD²J, largest first: all k, of which negative ones tell how far from
    /// Euclidean the distances are; from [`leading_mds`] only those asked for. Units of squared distance.
    pub eigenvalues: Vec<f64>,
    /// Number m of coordinates kept: those asked for whose eigenvalue is clearly positive.
    pub dimensions: usize,
    /// The k×m coordinates, row by row, in units of distance; column `j` has squared norm
    /// `eigenvalues[j]` and mean zero.
    pub coordinates: Vec<f64>,
    /// Mean squared distance of all points to each of the k.
    mean_squared: Vec<f64>,
}

impl Mds {
    /// From the k×m coordinates of a scaling and the mean squared distance of all points to each, to place further ones.
    ///
    /// The columns are taken to be orthogonal and to have mean zero, as scaling makes them.
    ///
    /// # Panics
    /// If there are not k·m coordinates.
    #[must_use]
    pub(crate) fn from_parts(coordinates: Vec<f64>, dimensions: usize, mean_squared: Vec<f64>) -> Self {
        assert_eq!(coordinates.len(), dimensions * mean_squared.len(), "m coordinates a point");
        let mut eigenvalues = vec![0.0; dimensions];
        for row in coordinates.chunks_exact(dimensions.max(1)) {
            eigenvalues.iter_mut().zip(row).for_each(|(sum, x)| *sum += x * x);
        }
        Self { eigenvalues, dimensions, coordinates, mean_squared }
    }

    /// Number of points k.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.mean_squared.len()
    }

    /// The m coordinates of point `i`.
    #[must_use]
    pub(crate) fn point(&self, i: usize) -> &[f64] {
        &self.coordinates[i * self.dimensions..(i + 1) * self.dimensions]
    }

    /// Share of the first `count` eigenvalues in the sum of the positive ones held, from 0 to 1; 1 where
    /// none is positive. With all eigenvalues and `count` 2 it tells how well the points fit in a plane.
    #[must_use]
    pub(crate) fn energy_share(&self, count: usize) -> f64 {
        let positive = |values: &[f64]| values.iter().filter(|v| **v > 0.0).sum::<f64>();
        let total = positive(&self.eigenvalues);
        if total > 0.0 { positive(&self.eigenvalues[..count.min(self.eigenvalues.len())]) / total } else { 1.0 }
    }

    /// Places a further point by its k squared distances to the points, into the first
    /// `place.len()` coordinates (zero beyond m). Exact where the distances are Euclidean in m
    /// dimensions. O(km).
    ///
    /// # Panics
    /// If `squared` does not hold k values.
    pub(crate) fn place(&self, squared: &[f64], place: &mut [f64]) {
        assert_eq!(squared.len(), self.len(), "one squared distance a point");
        place.fill(0.0);
        let kept = self.dimensions.min(place.len());
        for (i, (d, mean)) in squared.iter().zip(&self.mean_squared).enumerate() {
            let difference = 0.5 * (mean - d);
            for (sum, c) in place[..kept].iter_mut().zip(self.point(i)) {
                *sum += difference * c;
            }
        }
        for (sum, value) in place[..kept].iter_mut().zip(&self.eigenvalues) {
            // A dimension without extent, which a scaling does not keep but given coordinates may have, stays empty.
            *sum = if *value == 0.0 { 0.0 } else { *sum / value };
        }
    }
}

/// Classical scaling of a symmetric k×k matrix of squared distances, keeping up to `keep` coordinates.
///
/// The matrix need not be Euclidean, nor even hold true squares: any symmetric dissimilarities will do.
/// Deterministic, serial, O(k³).
///
/// # Errors
/// [`EigenError::NotFinite`] where an entry, or a sum of entries, is not finite.
///
/// # Panics
/// If `squared` does not hold k² values.
pub(crate) fn classical_mds(squared: &[f64], k: usize, keep: usize) -> Result<Mds, EigenError> {
    assert_eq!(squared.len(), k * k, "a square matrix, row by row");
    if k == 0 {
        return Ok(Mds::default());
    }
    let mean: Vec<f64> = squared.chunks_exact(k).map(|row| row.iter().sum::<f64>() / k as f64).collect();
    let grand = mean.iter().sum::<f64>() / k as f64;
    let mut b = memory::filled(k * k, 0.0)?;
    for i in 0..k {
        for j in 0..k {
            b[i * k + j] = -0.5 * (squared[i * k + j] - mean[i] - mean[j] + grand);
        }
    }
    Ok(from_pairs(leading_eigenpairs(&b, k, keep)?, keep.min(k), mean))
}

/// Coordinates from the eigenpairs of B, `kept` vectors of which are given.
fn from_pairs(pairs: Eigenpairs, kept: usize, mean_squared: Vec<f64>) -> Mds {
    let k = mean_squared.len();
    let least = LEAST_EIGENVALUE * pairs.values[0];
    let dimensions = pairs.values[..kept].iter().take_while(|v| **v > 0.0 && **v > least).count();
    let mut coordinates = Vec::with_capacity(k * dimensions);
    for i in 0..k {
        coordinates.extend((0..dimensions).map(|j| pairs.vectors[i * kept + j] * pairs.values[j].sqrt()));
    }
    Mds { eigenvalues: pairs.values, dimensions, coordinates, mean_squared }
}

/// Classical scaling as [`classical_mds`], but for large matrices with only the eigenpairs that are kept.
///
/// Of the eigenvalues only the first `keep` are held where the iteration was worth while (above some 200 points) and
/// settled, else all. Each residual |Bv − λv| is at most `tolerance` times the largest |λ|; where the distances are
/// Euclidean in a few dimensions the result is exact all the same. The matrix is read, not copied: O(k²) a pass, some
/// 5 passes where few dimensions dominate, some dozens where the spectrum falls slowly; the same bytes for any number of
/// threads.
///
/// # Errors
/// [`EigenError::NotFinite`] where an entry, or a sum of entries, is not finite; [`EigenError::Cancelled`].
///
/// # Panics
/// If `squared` does not hold k² values.
pub(crate) fn leading_mds(
    squared: &[f64],
    k: usize,
    keep: usize,
    tolerance: f64,
    progress: &Progress,
) -> Result<Mds, EigenError> {
    assert_eq!(squared.len(), k * k, "a square matrix, row by row");
    if !pays(k, keep) {
        progress.check()?;
        return classical_mds(squared, k, keep);
    }
    let mean: Vec<f64> = squared.par_chunks_exact(k).map(|row| row.iter().sum::<f64>() / k as f64).collect();
    if let Some(row) = mean.iter().position(|m| !m.is_finite()) {
        let column = squared[row * k..(row + 1) * k].iter().position(|d| !d.is_finite()).unwrap_or(0);
        return Err(EigenError::NotFinite { row, column });
    }
    let width = block_width(keep);
    // Weyl's sequence: evenly spread, and no smooth function of the index that a matrix could be blind to.
    let start = |index: u64| (index as f64 * GOLDEN).fract() - 0.5;
    let product = |x: &[f64], y: &mut [f64]| doubly_centred_product(squared, k, width, x, y);
    match leading_of_operator(k, keep, tolerance, start, product, progress)? {
        Some(pairs) => {
            let kept = pairs.values.len();
            Ok(from_pairs(pairs, kept, mean))
        }
        None => classical_mds(squared, k, keep),
    }
}

/// The fractional part of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Rows of a product a task.
const ROWS: usize = 64;

/// y = −½JDJx for k×w blocks x and y, w a multiple of [`LANES`].
fn doubly_centred_product(d: &[f64], k: usize, width: usize, x: &[f64], y: &mut [f64]) {
    let mut centred = x.to_vec();
    centre(&mut centred, width);
    for lanes in 0..width / LANES {
        // Eight columns side by side, so that the inner loop is one row of the matrix against a contiguous block.
        let columns: Vec<[f64; LANES]> =
            centred.chunks_exact(width).map(|row| std::array::from_fn(|c| row[lanes * LANES + c])).collect();
        y.par_chunks_mut(width * ROWS).enumerate().for_each(|(chunk, rows)| {
            for (r, out) in rows.chunks_exact_mut(width).enumerate() {
                let i = chunk * ROWS + r;
                let mut sums = [0.0; LANES];
                for (d, column) in d[i * k..(i + 1) * k].iter().zip(&columns) {
                    for c in 0..LANES {
                        sums[c] += d * column[c];
                    }
                }
                out[lanes * LANES..(lanes + 1) * LANES].copy_from_slice(&sums.map(|s| -0.5 * s));
            }
        });
    }
    centre(y, width);
}

/// Subtracts the mean of each column.
fn centre(block: &mut [f64], width: usize) {
    let mut mean = vec![0.0; width];
    for row in block.chunks_exact(width) {
        mean.iter_mut().zip(row).for_each(|(m, v)| *m += v);
    }
    let n = (block.len() / width) as f64;
    mean.iter_mut().for_each(|m| *m /= n);
    for row in block.chunks_exact_mut(width) {
        row.iter_mut().zip(&mean).for_each(|(v, m)| *v -= m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squared(points: &[[f64; 2]]) -> Vec<f64> {
        let pairs = points.iter().flat_map(|p| points.iter().map(move |q| (p, q)));
        pairs.map(|(p, q)| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)).collect()
    }

    fn scatter(n: usize) -> Vec<[f64; 2]> {
        (0..n).map(|i| [3.0 * (1.7 * i as f64).sin(), (2.9 * i as f64 + 1.0).cos() + 0.1 * i as f64]).collect()
    }

    #[test]
    fn recovers_a_plane_configuration() {
        let points = scatter(20);
        let d = squared(&points);
        let mds = classical_mds(&d, 20, 10).expect("finite");
        assert_eq!(mds.dimensions, 2);
        assert!((mds.energy_share(2) - 1.0).abs() < 1e-12);
        let found: Vec<[f64; 2]> = (0..20).map(|i| [mds.point(i)[0], mds.point(i)[1]]).collect();
        for (a, b) in squared(&found).iter().zip(&d) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
    }

    #[test]
    fn places_further_points_exactly() {
        let points = scatter(30);
        let mds = classical_mds(&squared(&points[..8]), 8, 2).expect("finite");
        let all = squared(&points);
        let mut placed = vec![[0.0; 2]; 30];
        for (v, place) in placed.iter_mut().enumerate() {
            mds.place(&all[v * 30..v * 30 + 8], place);
        }
        for (a, b) in squared(&placed).iter().zip(&all) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
    }

    #[test]
    fn places_further_points_by_parts_as_by_the_whole() {
        let points = scatter(20);
        let d = squared(&points);
        let among: Vec<f64> = (0..64).map(|i| d[i / 8 * 20 + i % 8]).collect();
        let mds = classical_mds(&among, 8, 2).expect("finite");
        // One more column, which is empty.
        let coordinates = mds.coordinates.chunks_exact(2).flat_map(|c| [c[0], c[1], 0.0]).collect();
        let mean = among.chunks_exact(8).map(|row| row.iter().sum::<f64>() / 8.0).collect();
        let parts = Mds::from_parts(coordinates, 3, mean);
        let (mut one, mut other) = ([0.0; 2], [1.0; 3]);
        for v in 0..20 {
            mds.place(&d[v * 20..v * 20 + 8], &mut one);
            parts.place(&d[v * 20..v * 20 + 8], &mut other);
            assert!((one[0] - other[0]).abs() + (one[1] - other[1]).abs() < 1e-12 && other[2] == 0.0);
        }
    }

    #[test]
    fn a_line_has_one_dimension_and_a_point_none() {
        let line: Vec<[f64; 2]> = (0..6).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(classical_mds(&squared(&line), 6, 2).expect("finite").dimensions, 1);
        assert_eq!(classical_mds(&[0.0; 9], 3, 2).expect("finite").dimensions, 0);
        assert_eq!(classical_mds(&[], 0, 2).expect("nothing").len(), 0);
    }

    #[test]
    fn the_leading_scaling_is_that_of_the_complete_one() {
        // A plane, a curved sheet (distances of no plane), and points of many dimensions with a slowly falling spectrum.
        let plane = squared(&scatter(300));
        let bent: Vec<f64> = plane.iter().map(|d| (d.sqrt() * 0.4).sin().powi(2) + 0.1 * d).collect();
        let many: Vec<f64> = (0..300 * 300)
            .map(|k| {
                let coordinate = |i: usize, c: usize| ((i * 31 + c * 17) as f64 * 0.37).sin();
                (0..25).map(|c| (coordinate(k / 300, c) - coordinate(k % 300, c)).powi(2)).sum()
            })
            .collect();
        for (name, d) in [("plane", &plane), ("bent", &bent), ("many", &many)] {
            let whole = classical_mds(d, 300, 2).expect("finite");
            let few = leading_mds(d, 300, 2, 1e-10, &Progress::new()).expect("finite");
            assert_eq!((few.len(), few.dimensions, few.eigenvalues.len()), (300, 2, 2), "{name}");
            for (a, b) in few.eigenvalues.iter().zip(&whole.eigenvalues) {
                assert!((a - b).abs() < 1e-9 * whole.eigenvalues[0], "{name}: {a} {b}");
            }
            let points = |mds: &Mds| (0..300).map(|i| [mds.point(i)[0], mds.point(i)[1]]).collect::<Vec<_>>();
            let (a, b) = (squared(&points(&few)), squared(&points(&whole)));
            let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-7 * whole.eigenvalues[0], "{name}: {worst:e}");
        }
        let exact = leading_mds(&plane, 300, 2, 1e-6, &Progress::new()).expect("finite");
        let found: Vec<[f64; 2]> = (0..300).map(|i| [exact.point(i)[0], exact.point(i)[1]]).collect();
        for (a, b) in squared(&found).iter().zip(&plane) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b), "{a} {b}");
        }
    }

    #[test]
    fn a_large_line_has_one_dimension_and_a_large_heap_none() {
        let line: Vec<[f64; 2]> = (0..400).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(leading_mds(&squared(&line), 400, 2, 1e-6, &Progress::new()).expect("finite").dimensions, 1);
        assert_eq!(leading_mds(&[0.0; 160_000], 400, 2, 1e-6, &Progress::new()).expect("finite").dimensions, 0);
        let mut bad = squared(&line);
        bad[7 * 400 + 5] = f64::NAN;
        let found = leading_mds(&bad, 400, 2, 1e-6, &Progress::new());
        assert_eq!(found, Err(EigenError::NotFinite { row: 7, column: 5 }));
    }

    #[test]
    fn refuses_infinite_distances() {
        assert!(classical_mds(&[0.0, f64::INFINITY, f64::INFINITY, 0.0], 2, 2).is_err());
    }
}
