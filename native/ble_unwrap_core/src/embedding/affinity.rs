//! Affinities: how strongly two points belong together, from their distance.

use rayon::prelude::*;

use crate::progress::Progress;

use super::EmbeddingError;
use super::logistic::logistic_pair;
use super::square_matrix::square_matrix;

/// How affinity falls with distance d, for a kernel width σ in units of squared distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kernel {
    /// p = exp(−d²/2σ), from 1 (paper, equations 5 and 13).
    Gaussian,
    /// p = 1/(1 + exp(d²/2σ)), from ½: its log-odds are −d²/2σ, which a model with intercepts
    /// reproduces exactly where the distances are Euclidean.
    Logistic,
}

impl Kernel {
    /// Affinity of two points with d²/2σ = `u` ≥ 0.
    #[inline]
    #[must_use]
    pub(super) fn affinity(self, u: f64) -> f64 {
        match self {
            Self::Gaussian => {
                let (large, small) = logistic_pair(u);
                small / large
            }
            Self::Logistic => logistic_pair(u).1,
        }
    }

    /// log(p/(1−p)) of the affinity p of two points with d²/2σ = `u`: exact however small p is; finite for finite `u`,
    /// distances next to 0 being taken as a little more.
    pub(super) fn log_odds(self, u: f64) -> f64 {
        match self {
            Self::Gaussian => -u - (-(-u.max(1e-12)).exp_m1()).ln(),
            Self::Logistic => -u,
        }
    }

    /// The inverse of [`Kernel::affinity`]: d²/2σ, with affinities within 1e-12 of 0 or 1 taken as that near.
    /// Negative under the logistic kernel where p > ½, which classical scaling allows.
    pub(super) fn scaled_square(self, p: f64) -> f64 {
        match self {
            Self::Gaussian => -p.max(1e-12).ln(),
            Self::Logistic => -log_odds(p),
        }
    }

    /// Whether affinities below `least` may be dropped.
    pub(super) fn check_truncation(self, least: f64) -> Result<(), EmbeddingError> {
        if least >= 0.0 && least < self.at_zero() {
            return Ok(());
        }
        Err(EmbeddingError::InvalidSetting {
            name: "truncation",
            value: least,
            expected: "not negative, and below the affinity at distance 0 (1 for the Gaussian kernel, 0.5 for the logistic \
                       one)",
        })
    }

    /// Affinity of a point with itself.
    pub(super) fn at_zero(self) -> f64 {
        match self {
            Self::Gaussian => 1.0,
            Self::Logistic => 0.5,
        }
    }
}

/// How the kernel width σ is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum KernelWidth {
    /// This σ, in units of squared distance.
    Absolute(f64),
    /// σ is this many times the mean squared distance of all pairs i ≠ j.
    Relative(f64),
    /// σ is such that the mean affinity over all pairs i ≠ j has this value.
    MeanAffinity(f64),
}

impl KernelWidth {
    /// Checks the parameter for a kernel.
    ///
    /// # Errors
    /// [`EmbeddingError::InvalidSetting`] where no positive σ can follow.
    pub(super) fn validate(self, kernel: Kernel) -> Result<(), EmbeddingError> {
        match self {
            Self::Absolute(value) if !(value > 0.0 && value.is_finite()) => {
                Err(EmbeddingError::InvalidSetting { name: "sigma", value, expected: "positive and finite" })
            }
            Self::Relative(value) if !(value > 0.0 && value.is_finite()) => {
                Err(EmbeddingError::InvalidSetting { name: "kernel_width", value, expected: "positive and finite" })
            }
            Self::MeanAffinity(value) if !(value > 0.0 && value < kernel.at_zero()) => {
                Err(EmbeddingError::InvalidSetting {
                    name: "mean_affinity",
                    value,
                    expected: "above 0 and below the affinity at distance 0 (1 for the Gaussian kernel, 0.5 for the logistic one)",
                })
            }
            _ => Ok(()),
        }
    }
}

/// A symmetric n×n matrix of affinities in [0, 1]; the diagonal is never looked at.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Affinity {
    n: usize,
    values: Vec<f64>,
    sigma: f64,
}

impl Affinity {
    /// Takes any n×n matrix, row by row. An asymmetric one is replaced by (p_ij + p_ji)/2, which is
    /// all the likelihood (4) sees of it. σ is 1.
    ///
    /// # Errors
    /// [`EmbeddingError::WrongLength`]; [`EmbeddingError::AffinityOutOfRange`] names the first pair outside [0, 1].
    pub(super) fn from_matrix(matrix: &[f64], n: usize) -> Result<Self, EmbeddingError> {
        check_square(matrix, n)?;
        for row in 0..n {
            for column in 0..n {
                let value = matrix[row * n + column];
                if row != column && !(0.0..=1.0).contains(&value) {
                    return Err(EmbeddingError::AffinityOutOfRange { row, column, value });
                }
            }
        }
        let mut values = square_matrix(n)?;
        for i in 0..n {
            for j in (0..n).filter(|j| *j != i) {
                values[i * n + j] = 0.5 * (matrix[i * n + j] + matrix[j * n + i]);
            }
        }
        Ok(Self { n, values, sigma: 1.0 })
    }

    /// Takes a symmetric matrix of values in [0, 1] as it is.
    pub(super) fn symmetric(values: Vec<f64>, n: usize, sigma: f64) -> Self {
        debug_assert_eq!(values.len(), n * n);
        Self { n, values, sigma }
    }

    /// Mirrors the lower triangle.
    pub(super) fn from_lower_triangle(mut values: Vec<f64>, n: usize, sigma: f64) -> Self {
        for i in 0..n {
            for j in 0..i {
                values[j * n + i] = values[i * n + j];
            }
        }
        Self::symmetric(values, n, sigma)
    }

    /// The affinities of a symmetric n×n matrix of squared distances, row by row. O(n²).
    ///
    /// # Errors
    /// As [`KernelWidth::validate`] and [`kernel_width`]; [`EmbeddingError::WrongLength`].
    pub(super) fn from_squared_distances(
        squared: &[f64],
        n: usize,
        kernel: Kernel,
        width: KernelWidth,
        progress: &Progress,
    ) -> Result<Self, EmbeddingError> {
        check_square(squared, n)?;
        let sigma = kernel_width(squared, n, kernel, width, progress)?;
        let scale = 0.5 / sigma;
        let mut values = vec![0.0; squared.len()];
        values.par_chunks_mut(n.max(1)).zip(squared.par_chunks(n.max(1))).for_each(|(values, squared)| {
            values.iter_mut().zip(squared).for_each(|(p, d)| *p = kernel.affinity(d * scale));
        });
        Ok(Self { n, values, sigma })
    }

    /// Replaces affinities below `least` by 0 (the truncated kernel of the paper, section 3).
    #[must_use]
    pub(super) fn truncated(mut self, least: f64) -> Self {
        self.values.iter_mut().filter(|p| **p < least).for_each(|p| *p = 0.0);
        self
    }

    /// Number of points n.
    #[must_use]
    pub(super) fn len(&self) -> usize {
        self.n
    }

    /// The kernel width σ, in units of squared distance.
    #[must_use]
    pub(super) fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The affinities of point `i` to all points.
    #[must_use]
    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.n..(i + 1) * self.n]
    }

    /// Mean over all pairs i ≠ j; 0 where there are none.
    #[must_use]
    pub(super) fn mean(&self) -> f64 {
        let total: f64 = (0..self.n).map(|i| self.row(i)[..i].iter().sum::<f64>()).sum();
        total / pair_count(self.n).max(1.0)
    }

    /// Σ_{i≠j} p log p + (1−p) log(1−p): the log-likelihood (4) of a model that fits every pair
    /// exactly, so the Bregman distance (12) is this less the log-likelihood.
    #[must_use]
    pub(super) fn saturated_log_likelihood(&self) -> f64 {
        let term = |p: f64| if p > 0.0 { p * p.ln() } else { 0.0 };
        let row = |i: usize| self.row(i)[..i].iter().map(|&p| term(p) + term(1.0 - p)).sum::<f64>();
        2.0 * (0..self.n).map(row).sum::<f64>()
    }
}

/// The kernel width σ for a symmetric n×n matrix of squared distances. O(n²), for a mean affinity
/// about ten times that.
///
/// # Errors
/// As [`KernelWidth::validate`]; [`EmbeddingError::NoExtent`] where all distances are zero;
/// cancelled.
pub(super) fn kernel_width(
    squared: &[f64],
    n: usize,
    kernel: Kernel,
    width: KernelWidth,
    progress: &Progress,
) -> Result<f64, EmbeddingError> {
    width.validate(kernel)?;
    if let KernelWidth::Absolute(sigma) = width {
        return Ok(sigma);
    }
    let mean_squared = mean_over_pairs(squared, n, |d| d);
    if !(mean_squared > 0.0 && mean_squared.is_finite()) {
        return Err(EmbeddingError::NoExtent);
    }
    let target = match width {
        KernelWidth::Relative(c) => return Ok(c * mean_squared),
        KernelWidth::MeanAffinity(target) | KernelWidth::Absolute(target) => target,
    };
    // The mean affinity rises with σ. Bracket log₂ σ by steps of two octaves, then false position in
    // the Illinois form (halve the value of an end kept twice).
    let excess = |log2: f64| {
        let scale = 0.5 / (mean_squared * log2.exp2());
        mean_over_pairs(squared, n, |d| kernel.affinity(d * scale)) - target
    };
    let mut a = (-1.0, excess(-1.0));
    let step = if a.1 < 0.0 { 2.0 } else { -2.0 };
    let mut b = a;
    for _ in 0..MOST_BRACKETING_STEPS {
        progress.check()?;
        b = (a.0 + step, excess(a.0 + step));
        if (b.1 < 0.0) != (a.1 < 0.0) {
            break;
        }
        a = b;
    }
    let (mut end, mut best) = (a, b);
    for _ in 0..MOST_REFINEMENTS {
        progress.check()?;
        if best.1.abs() < MEAN_TOLERANCE * target || best.1 == end.1 {
            break;
        }
        let x = best.0 - best.1 * (best.0 - end.0) / (best.1 - end.1);
        let next = (x, excess(x));
        end = if (next.1 < 0.0) == (best.1 < 0.0) { (end.0, 0.5 * end.1) } else { best };
        best = next;
    }
    Ok(mean_squared * best.0.exp2())
}

/// Two octaves a step: σ is sought from 2⁻¹²⁸ to 2¹²⁸ times the mean square.
const MOST_BRACKETING_STEPS: usize = 64;
/// Five to eight are taken.
const MOST_REFINEMENTS: usize = 30;
/// Relative error of the mean affinity; a thousand times below what changes an embedding visibly.
const MEAN_TOLERANCE: f64 = 1e-6;

/// Mean of a term over the pairs of a symmetric matrix, summed in fixed order.
fn mean_over_pairs(squared: &[f64], n: usize, term: impl Fn(f64) -> f64) -> f64 {
    const LANES: usize = 4;
    let mut total = 0.0;
    for i in 0..n {
        let row = &squared[i * n..i * n + i];
        let chunks = row.chunks_exact(LANES);
        let rest: f64 = chunks.remainder().iter().map(|&d| term(d)).sum();
        let mut lanes = [0.0; LANES];
        for chunk in chunks {
            for lane in 0..LANES {
                lanes[lane] += term(chunk[lane]);
            }
        }
        total += lanes.iter().sum::<f64>() + rest;
    }
    total / pair_count(n).max(1.0)
}

fn pair_count(n: usize) -> f64 {
    0.5 * n as f64 * (n as f64 - 1.0)
}

fn check_square(matrix: &[f64], n: usize) -> Result<(), EmbeddingError> {
    match n.checked_mul(n) {
        Some(expected) if expected == matrix.len() => Ok(()),
        expected => Err(EmbeddingError::WrongLength { expected: expected.unwrap_or(usize::MAX), found: matrix.len() }),
    }
}

/// The log-odds of affinity `p`, with affinities within 1e-12 of 0 or 1 taken as that near.
pub(super) fn log_odds(p: f64) -> f64 {
    let p = p.clamp(1e-12, 1.0 - 1e-12);
    (p / (1.0 - p)).ln()
}

/// Squared distances, up to the factor σ, whose affinities under `kernel` are those given.
pub(super) fn squared_distances(affinity: &Affinity, kernel: Kernel) -> Vec<f64> {
    let n = affinity.len();
    let mut squared = vec![0.0; n * n];
    for i in 0..n {
        for (j, &p) in affinity.row(i).iter().enumerate().filter(|(j, _)| *j != i) {
            squared[i * n + j] = 2.0 * kernel.scaled_square(p);
        }
    }
    squared
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squared_line(n: usize) -> Vec<f64> {
        (0..n * n).map(|k| ((k / n) as f64 - (k % n) as f64).powi(2)).collect()
    }

    #[test]
    fn kernels_are_what_they_say() {
        for u in [0.0, 0.3, 2.0, 50.0] {
            assert!((Kernel::Gaussian.affinity(u) / (-u).exp() - 1.0).abs() < 1e-14);
            assert!((Kernel::Logistic.affinity(u) * (1.0 + u.exp()) - 1.0).abs() < 1e-14);
        }
        for (kernel, u) in
            [Kernel::Gaussian, Kernel::Logistic].into_iter().flat_map(|k| [0.1, 1.0, 20.0].map(|u| (k, u)))
        {
            assert!((kernel.log_odds(u) - log_odds(kernel.affinity(u))).abs() < 1e-9);
        }
        assert!(Kernel::Gaussian.log_odds(0.0).is_finite() && (Kernel::Gaussian.log_odds(1e4) + 1e4).abs() < 1e-9);
        assert_eq!(Kernel::Gaussian.affinity(0.0), Kernel::Gaussian.at_zero());
        assert_eq!(Kernel::Logistic.affinity(0.0), Kernel::Logistic.at_zero());
    }

    #[test]
    fn relative_width_is_a_multiple_of_the_mean_square() {
        let d = squared_line(5);
        // Pairs of 5 points on a line: 4·1 + 3·4 + 2·9 + 1·16 = 50 over 10.
        let sigma = kernel_width(&d, 5, Kernel::Logistic, KernelWidth::Relative(0.2), &Progress::new());
        assert_eq!(sigma, Ok(1.0));
    }

    #[test]
    fn mean_affinity_is_hit_at_any_scale() {
        for (kernel, targets) in [(Kernel::Gaussian, [0.01, 0.57, 0.99]), (Kernel::Logistic, [0.01, 0.25, 0.49])] {
            for target in targets {
                for scale in [1e-24, 1.0, 1e30] {
                    let d: Vec<f64> = squared_line(40).iter().map(|d| d * scale).collect();
                    let width = KernelWidth::MeanAffinity(target);
                    let a = Affinity::from_squared_distances(&d, 40, kernel, width, &Progress::new()).expect("valid");
                    assert!((a.mean() - target).abs() < 2e-6 * target, "{kernel:?} {target} {scale}: {}", a.mean());
                }
            }
        }
    }

    #[test]
    fn asymmetric_matrices_are_averaged_and_truncation_cuts() {
        let a = Affinity::from_matrix(&[9.0, 0.2, 0.6, -1.0], 2).expect("the diagonal does not matter");
        assert_eq!((a.row(0)[1], a.row(1)[0]), (0.4, 0.4));
        assert_eq!(a.clone().truncated(0.3), a);
        assert_eq!(a.truncated(0.5).row(0)[1], 0.0);
    }

    #[test]
    fn bad_input_is_named() {
        let p = Progress::new();
        assert_eq!(Affinity::from_matrix(&[0.0; 5], 2), Err(EmbeddingError::WrongLength { expected: 4, found: 5 }));
        assert!(matches!(
            Affinity::from_matrix(&[0.0, 0.5, f64::NAN, 0.0], 2),
            Err(EmbeddingError::AffinityOutOfRange { row: 1, column: 0, .. })
        ));
        let zero = kernel_width(&[0.0; 9], 3, Kernel::Gaussian, KernelWidth::Relative(0.2), &p);
        assert_eq!(zero, Err(EmbeddingError::NoExtent));
        for width in [KernelWidth::Absolute(0.0), KernelWidth::Relative(f64::NAN), KernelWidth::MeanAffinity(0.5)] {
            assert!(matches!(width.validate(Kernel::Logistic), Err(EmbeddingError::InvalidSetting { .. })));
        }
    }

    #[test]
    fn squared_distances_invert_the_kernel() {
        let d = squared_line(6);
        for kernel in [Kernel::Gaussian, Kernel::Logistic] {
            let width = KernelWidth::Absolute(3.0);
            let a = Affinity::from_squared_distances(&d, 6, kernel, width, &Progress::new()).expect("valid");
            for (found, expected) in squared_distances(&a, kernel).iter().zip(&d) {
                assert!((3.0 * found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
    }
}
