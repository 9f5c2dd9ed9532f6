//! Classical multidimensional scaling: points whose Euclidean distances come nearest to a matrix.
//!
//! Cox and Cox: Multidimensional Scaling, 2nd edition, Chapman & Hall/CRC, 2000, section 2.2.
//! de Silva and Tenenbaum: Sparse multidimensional scaling using landmark points, Stanford
//! technical report, 2004, section 2: placing further points by distances to the first.

use super::symmetric::{EigenError, leading_eigenpairs};

/// A coordinate is kept only where its eigenvalue exceeds this share of the largest: below it
/// the double-centred matrix is rounding noise, and placement divides by the eigenvalue's root.
const LEAST_EIGENVALUE: f64 = 1e-12;

/// Classical scaling of k points: coordinates along the principal axes and the full spectrum.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mds {
    /// All k eigenvalues of B = −½JD²J, largest first; negative ones tell how far from
    /// Euclidean the distances are. Units of squared distance.
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
    /// Number of points k.
    #[must_use]
    pub fn len(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.eigenvalues.is_empty()
    }

    /// The m coordinates of point `i`.
    #[must_use]
    pub fn point(&self, i: usize) -> &[f64] {
        &self.coordinates[i * self.dimensions..(i + 1) * self.dimensions]
    }

    /// Share of the first `count` eigenvalues in the sum of the positive ones, from 0 to 1; 1 where
    /// none is positive. With `count` 2 it tells how well the points fit in a plane.
    #[must_use]
    pub fn energy_share(&self, count: usize) -> f64 {
        let positive = |values: &[f64]| values.iter().filter(|v| **v > 0.0).sum::<f64>();
        let total = positive(&self.eigenvalues);
        if total > 0.0 { positive(&self.eigenvalues[..count.min(self.len())]) / total } else { 1.0 }
    }

    /// Places a further point by its k squared distances to the points, into the first
    /// `place.len()` coordinates (zero beyond m). Exact where the distances are Euclidean in m
    /// dimensions. O(km).
    ///
    /// # Panics
    /// If `squared` does not hold k values.
    pub fn place(&self, squared: &[f64], place: &mut [f64]) {
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
            *sum /= value;
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
pub fn classical_mds(squared: &[f64], k: usize, keep: usize) -> Result<Mds, EigenError> {
    assert_eq!(squared.len(), k * k, "a square matrix, row by row");
    if k == 0 {
        return Ok(Mds::default());
    }
    let mean: Vec<f64> = squared.chunks_exact(k).map(|row| row.iter().sum::<f64>() / k as f64).collect();
    let grand = mean.iter().sum::<f64>() / k as f64;
    let mut b = vec![0.0; k * k];
    for i in 0..k {
        for j in 0..k {
            b[i * k + j] = -0.5 * (squared[i * k + j] - mean[i] - mean[j] + grand);
        }
    }
    let pairs = leading_eigenpairs(&b, k, keep)?;
    let kept = keep.min(k);
    let least = LEAST_EIGENVALUE * pairs.values[0];
    let dimensions = pairs.values[..kept].iter().take_while(|v| **v > 0.0 && **v > least).count();
    let mut coordinates = Vec::with_capacity(k * dimensions);
    for i in 0..k {
        coordinates.extend((0..dimensions).map(|j| pairs.vectors[i * kept + j] * pairs.values[j].sqrt()));
    }
    Ok(Mds { eigenvalues: pairs.values, dimensions, coordinates, mean_squared: mean })
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
    fn a_line_has_one_dimension_and_a_point_none() {
        let line: Vec<[f64; 2]> = (0..6).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(classical_mds(&squared(&line), 6, 2).expect("finite").dimensions, 1);
        assert_eq!(classical_mds(&[0.0; 9], 3, 2).expect("finite").dimensions, 0);
        assert!(classical_mds(&[], 0, 2).expect("nothing").is_empty());
    }

    #[test]
    fn refuses_infinite_distances() {
        assert!(classical_mds(&[0.0, f64::INFINITY, f64::INFINITY, 0.0], 2, 2).is_err());
    }
}
