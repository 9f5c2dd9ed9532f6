//! The leading eigenpairs of a large symmetric operator, by products with it alone.
//!
//! Block Krylov iteration with thick restarts: a basis of V, AV, A²V, … is kept orthonormal, the operator is
//! solved in it (Rayleigh and Ritz), and once the basis is full the leading Ritz vectors start the next. A block
//! finds multiple eigenvalues, which single vectors miss; an operator of low rank ends the basis early and exactly.
//!
//! Golub, Van Loan: Matrix Computations, 4th edition, 2013, section 10.3.6 (block Lanczos). Wu, Simon: Thick-restart
//! Lanczos method for large symmetric eigenvalue problems, SIAM Journal on Matrix Analysis 22, 2000.

use super::symmetric::{EigenError, Eigenpairs, leading_eigenpairs};
use crate::progress::Progress;

/// Vectors in a block beyond those asked for: they hold the next eigenvalues off and speed the wanted ones up.
const GUARD: usize = 4;
/// Blocks are a multiple of this many vectors, for which products are written out.
pub(super) const LANES: usize = 8;
/// Blocks in a full basis. More cost memory and orthogonalisation, fewer need more restarts.
const DEPTH: usize = 5;
/// Products with a block before giving up; 4 to 20 are usual, slowly falling spectra take some dozens.
const MOST_PRODUCTS: usize = 240;
/// A new vector that keeps less than this share of the operator's scale is rounding, not a direction.
const NEGLIGIBLE: f64 = 1e-13;

/// Number of vectors in the blocks that [`leading_of_operator`] multiplies, for `count` eigenpairs.
pub(super) fn block_width(count: usize) -> usize {
    (count + GUARD).next_multiple_of(LANES)
}

/// Whether the iteration is worth while for a matrix of this size: otherwise solve it whole.
pub(super) fn pays(n: usize, count: usize) -> bool {
    /// Below this size a complete solution takes a few milliseconds.
    const SMALL: usize = 192;
    n > SMALL && n >= 4 * DEPTH * block_width(count)
}

/// The `count` leading eigenpairs of a symmetric operator on vectors of length n, largest eigenvalue first, or `None`
/// where they did not settle; the residual |Av − λv| of each is at most `tolerance` times the largest |λ|.
///
/// `product` writes A·X for an n×w block X, row by row, w = [`block_width`]. `start` is one number an index, in
/// generic position. Deterministic if `product` is. Each product is followed by O(n·w²) work.
///
/// # Errors
/// [`EigenError::Cancelled`]; [`EigenError::NotFinite`] where products are not finite.
pub(super) fn leading_of_operator(
    n: usize,
    count: usize,
    tolerance: f64,
    start: impl Fn(u64) -> f64,
    product: impl Fn(&[f64], &mut [f64]),
    progress: &Progress,
) -> Result<Option<Eigenpairs>, EigenError> {
    let width = block_width(count);
    let mut basis = Basis { n, vectors: Vec::new(), images: Vec::new() };
    let mut block: Vec<f64> = (0..n * width).map(|i| start(i as u64)).collect();
    let mut image = vec![0.0; n * width];
    let mut scale = 0.0_f64;
    for _ in 0..MOST_PRODUCTS {
        progress.check()?;
        let before = basis.len();
        // Column by column into the basis; columns without a new direction are left out.
        for column in 0..width {
            let vector = (0..n).map(|i| block[i * width + column]).collect();
            basis.push_direction(vector, NEGLIGIBLE * scale);
        }
        let fresh = basis.len() - before;
        if fresh > 0 {
            block.fill(0.0);
            for (c, vector) in basis.vectors[before..].iter().enumerate() {
                vector.iter().enumerate().for_each(|(i, v)| block[i * width + c] = *v);
            }
            product(&block, &mut image);
            for c in 0..fresh {
                let vector: Vec<f64> = (0..n).map(|i| image[i * width + c]).collect();
                scale = scale.max(norm(&vector));
                basis.images.push(vector);
            }
        }
        let ritz = basis.ritz_pairs(width)?;
        let settled = (0..count.min(ritz.values.len())).all(|j| ritz.residuals[j] <= tolerance * ritz.largest);
        // An invariant space of n or fewer directions holds what there is to find.
        if settled && ritz.values.len() >= count.min(n) || fresh == 0 {
            return Ok(settled.then(|| ritz.leading(n, count)));
        }
        // The next block is the image of the last: A times what is newest in the basis.
        block.fill(0.0);
        for (c, vector) in basis.images[before..].iter().enumerate() {
            vector.iter().enumerate().for_each(|(i, v)| block[i * width + c] = *v);
        }
        if basis.len() + width > DEPTH * width {
            // Residuals of the Ritz vectors point where the Krylov space would have grown.
            block.fill(0.0);
            for c in 0..ritz.vectors.len() {
                for i in 0..n {
                    block[i * width + c] = ritz.images[c][i] - ritz.values[c] * ritz.vectors[c][i];
                }
            }
            basis.vectors = ritz.vectors;
            basis.images = ritz.images;
        }
    }
    Ok(None)
}

/// Orthonormal vectors and their images under the operator.
struct Basis {
    n: usize,
    vectors: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
}

/// The leading solutions in the space of a basis.
struct Ritz {
    values: Vec<f64>,
    /// Largest magnitude of all values in the space, also those not kept.
    largest: f64,
    vectors: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
    residuals: Vec<f64>,
}

impl Basis {
    fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Adds the part of `vector` that is new, if its norm is above `least`.
    fn push_direction(&mut self, mut vector: Vec<f64>, least: f64) {
        let before = norm(&vector);
        if !(before > least && before.is_finite()) {
            return;
        }
        // Twice is enough (Kahan and Parlett); a third pass for vectors that nearly vanish.
        for _ in 0..3 {
            for v in &self.vectors {
                let share = dot(v, &vector);
                vector.iter_mut().zip(v).for_each(|(x, v)| *x -= share * v);
            }
        }
        let after = norm(&vector);
        if after > least && after > NEGLIGIBLE * before {
            vector.iter_mut().for_each(|x| *x /= after);
            self.vectors.push(vector);
        }
    }

    fn ritz_pairs(&self, keep: usize) -> Result<Ritz, EigenError> {
        let m = self.len();
        let mut small = vec![0.0; m * m];
        for r in 0..m {
            for c in 0..=r {
                small[r * m + c] =
                    0.5 * (dot(&self.vectors[r], &self.images[c]) + dot(&self.vectors[c], &self.images[r]));
            }
        }
        let pairs = leading_eigenpairs(&small, m, keep)?;
        let kept = keep.min(m);
        let combine = |columns: &[Vec<f64>], j: usize| {
            let mut sum = vec![0.0; self.n];
            for (r, column) in columns.iter().enumerate() {
                let factor = pairs.vectors[r * kept + j];
                sum.iter_mut().zip(column).for_each(|(s, v)| *s += factor * v);
            }
            sum
        };
        let vectors: Vec<Vec<f64>> = (0..kept).map(|j| combine(&self.vectors, j)).collect();
        let images: Vec<Vec<f64>> = (0..kept).map(|j| combine(&self.images, j)).collect();
        let residual = |j: usize| {
            let squares = images[j].iter().zip(&vectors[j]).map(|(y, x)| (y - pairs.values[j] * x).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let residuals = (0..kept).map(residual).collect();
        let largest = pairs.values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        Ok(Ritz { values: pairs.values[..kept].to_vec(), largest, vectors, images, residuals })
    }
}

impl Ritz {
    /// The first `count` pairs, signs fixed as [`leading_eigenpairs`] fixes them.
    fn leading(&self, n: usize, count: usize) -> Eigenpairs {
        let count = count.min(self.values.len());
        let mut vectors = vec![0.0; n * count];
        for (j, vector) in self.vectors[..count].iter().enumerate() {
            let largest = vector.iter().fold(0.0_f64, |most, v| if v.abs() > most.abs() { *v } else { most });
            for (i, v) in vector.iter().enumerate() {
                vectors[i * count + j] = if largest < 0.0 { -v } else { *v };
            }
        }
        Eigenpairs { values: self.values[..count].to_vec(), vectors }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (mut lanes, whole) = ([0.0; LANES], a.len() / LANES * LANES);
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    lanes.iter().sum::<f64>() + a[whole..].iter().zip(&b[whole..]).map(|(a, b)| a * b).sum::<f64>()
}

fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in generic position.
    fn generic(index: u64) -> f64 {
        ((index.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 * 2.0_f64.powi(-53)) - 0.5
    }

    fn multiply(matrix: &[f64], n: usize, width: usize) -> impl Fn(&[f64], &mut [f64]) + '_ {
        move |x, y| {
            for i in 0..n {
                for c in 0..width {
                    y[i * width + c] = (0..n).map(|j| matrix[i * n + j] * x[j * width + c]).sum();
                }
            }
        }
    }

    /// Q diag(values) Qᵀ with a Householder reflection Q.
    fn with_spectrum(values: &[f64]) -> Vec<f64> {
        let n = values.len();
        let u: Vec<f64> = (0..n as u64).map(|i| generic(i + 99)).collect();
        let square = dot(&u, &u);
        let q = |i: usize, k: usize| f64::from(u8::from(i == k)) - 2.0 * u[i] * u[k] / square;
        let entry = |i: usize, j: usize| (0..n).map(|k| q(i, k) * values[k] * q(j, k)).sum();
        (0..n * n).map(|k| entry(k / n, k % n)).collect()
    }

    #[test]
    fn agrees_with_the_complete_solution() {
        let n = 240;
        let falling: Vec<f64> = (0..n).map(|i| 100.0 / (1.0 + i as f64)).collect();
        let mut twin = falling.clone();
        twin[1] = twin[0];
        let mut negative = falling.clone();
        negative[7] = -300.0;
        let slow: Vec<f64> = (0..n).map(|i| 1.0 - 0.002 * i as f64).collect();
        for (name, values) in [("falling", falling), ("double", twin), ("large negative", negative), ("slow", slow)] {
            let matrix = with_spectrum(&values);
            let width = block_width(3);
            let product = multiply(&matrix, n, width);
            let found = leading_of_operator(n, 3, 1e-10, generic, product, &Progress::new()).expect("finite");
            let found = found.unwrap_or_else(|| panic!("{name} settles"));
            let whole = leading_eigenpairs(&matrix, n, 3).expect("finite");
            for j in 0..3 {
                assert!((found.values[j] - whole.values[j]).abs() < 1e-8 * 300.0, "{name} {j}");
                let apply: Vec<f64> =
                    (0..n).map(|i| (0..n).map(|k| matrix[i * n + k] * found.vectors[k * 3 + j]).sum()).collect();
                let residual =
                    (0..n).map(|i| (apply[i] - found.values[j] * found.vectors[i * 3 + j]).powi(2)).sum::<f64>();
                assert!(residual.sqrt() < 1e-7, "{name} {j}: {residual:e}");
            }
        }
    }

    #[test]
    fn low_rank_ends_early_and_exactly() {
        let n = 200;
        let mut values = vec![0.0; n];
        values[..2].copy_from_slice(&[5.0, 5.0]);
        let matrix = with_spectrum(&values);
        let products = std::cell::Cell::new(0);
        let inner = multiply(&matrix, n, block_width(2));
        let product = |x: &[f64], y: &mut [f64]| {
            products.set(products.get() + 1);
            inner(x, y);
        };
        let found = leading_of_operator(n, 2, 1e-12, generic, product, &Progress::new()).expect("finite");
        let found = found.expect("two directions");
        assert!(found.values.iter().all(|v| (v - 5.0).abs() < 1e-12), "{:?}", found.values);
        assert!(products.get() <= 3, "{}", products.get());
        // A zero operator has the eigenvalue 0 everywhere.
        let zero = leading_of_operator(n, 2, 1e-12, generic, |_, y| y.fill(0.0), &Progress::new()).expect("finite");
        assert_eq!(zero.expect("settled").values, [0.0, 0.0]);
    }

    #[test]
    fn not_a_number_and_cancel() {
        let nan = leading_of_operator(200, 2, 1e-9, generic, |_, y| y.fill(f64::NAN), &Progress::new());
        assert!(matches!(nan, Err(EigenError::NotFinite { .. })));
        let progress = Progress::new();
        progress.cancel();
        let stopped = leading_of_operator(200, 2, 1e-9, generic, |_, y| y.fill(0.0), &progress);
        assert!(matches!(stopped, Err(EigenError::Cancelled(_))));
    }
}
