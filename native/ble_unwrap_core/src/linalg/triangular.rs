//! Solving with the factor LLᵀ of a sparse matrix: forward with L, backward with its transpose.
//!
//! The factor is faer's, in panels: the columns of a *supernode* have the same rows below their triangle, which are
//! stored as one dense block, column by column. The factors of charts have panels of two to some dozen columns, for
//! which faer's own solution spends most of its time on dispatch; plain loops over the columns of a panel take a third
//! of that. Nothing here depends on the width of the processor's vectors: each sum has a fixed number of partial sums.

use std::ops::{Add, Div, Mul, Sub};

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// Partial sums of a product of two columns, so that these are added up in vector registers.
const LANES: usize = 16;

/// The arithmetic of a solution.
pub(super) trait Real:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
}

impl Real for f32 {}
impl Real for f64 {}

/// A panel of the factor: the triangle of its columns, and below it the rows that they share.
struct Panel<'a, T> {
    /// The first of its columns.
    start: usize,
    /// Columns.
    width: usize,
    /// The rows below the triangle.
    rows: &'a [u32],
    /// Column by column, each of the triangle's rows and then of those below.
    values: &'a [T],
}

impl<'a, T> Panel<'a, T> {
    fn of(symbolic: &'a SymbolicSupernodalCholesky<u32>, values: &'a [T], number: usize) -> Self {
        let at = |ends: &[u32], k: usize| ends[k] as usize;
        let start = at(symbolic.supernode_begin(), number);
        let rows = symbolic.supernode(number).pattern();
        let ends = symbolic.col_ptr_for_val();
        Self {
            start,
            width: at(symbolic.supernode_end(), number) - start,
            rows,
            values: &values[at(ends, number)..at(ends, number + 1)],
        }
    }

    /// A column from its diagonal entry down, parted where the triangle ends.
    fn column(&self, k: usize) -> (&'a [T], &'a [T]) {
        let height = self.width + self.rows.len();
        self.values[k * height + k..(k + 1) * height].split_at(self.width - k)
    }
}

/// Makes `x`, in the order of the factor, the solution of L Lᵀ y = x. `below` is room for the rows below a panel.
///
/// # Panics
/// If the lengths are not those of the factor, or `below` is shorter than the most rows below a panel.
pub(super) fn solve<T: Real>(symbolic: &SymbolicSupernodalCholesky<u32>, values: &[T], x: &mut [T], below: &mut [T]) {
    let panels = symbolic.n_supernodes();
    for number in 0..panels {
        forward(&Panel::of(symbolic, values, number), x, below);
    }
    for number in (0..panels).rev() {
        backward(&Panel::of(symbolic, values, number), x, below);
    }
}

/// The most rows below a panel.
pub(super) fn most_below(symbolic: &SymbolicSupernodalCholesky<u32>) -> usize {
    (0..symbolic.n_supernodes()).map(|number| symbolic.supernode(number).pattern().len()).max().unwrap_or(0)
}

fn forward<T: Real>(panel: &Panel<'_, T>, x: &mut [T], below: &mut [T]) {
    let own = &mut x[panel.start..panel.start + panel.width];
    let below = &mut below[..panel.rows.len()];
    below.fill(T::default());
    let mut k = 0;
    // Two columns at once: what lies below is read and written half as often.
    while k + 1 < panel.width {
        let ((first, under_first), (second, under_second)) = (panel.column(k), panel.column(k + 1));
        let a = own[k] / first[0];
        let b = (own[k + 1] - a * first[1]) / second[0];
        (own[k], own[k + 1]) = (a, b);
        for ((x, f), s) in own[k + 2..].iter_mut().zip(&first[2..]).zip(&second[1..]) {
            *x = *x - (*f * a + *s * b);
        }
        for ((x, f), s) in below.iter_mut().zip(under_first).zip(under_second) {
            *x = *x + (*f * a + *s * b);
        }
        k += 2;
    }
    if k < panel.width {
        let (last, under) = panel.column(k);
        own[k] = own[k] / last[0];
        for (x, l) in below.iter_mut().zip(under) {
            *x = *x + *l * own[k];
        }
    }
    for (&row, b) in panel.rows.iter().zip(below.iter()) {
        x[row as usize] = x[row as usize] - *b;
    }
}

fn backward<T: Real>(panel: &Panel<'_, T>, x: &mut [T], below: &mut [T]) {
    let below = &mut below[..panel.rows.len()];
    for (&row, b) in panel.rows.iter().zip(below.iter_mut()) {
        *b = x[row as usize];
    }
    let own = &mut x[panel.start..panel.start + panel.width];
    for k in (0..panel.width).rev() {
        let (column, under) = panel.column(k);
        let known = dot(&column[1..], &own[k + 1..]) + dot(under, below);
        own[k] = (own[k] - known) / column[0];
    }
}

/// The product of two columns of one length, in [`LANES`] partial sums.
fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let (mut sums, mut rest) = ([T::default(); LANES], T::default());
    let (a_parts, b_parts) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    for (x, y) in a_parts.remainder().iter().zip(b_parts.remainder()) {
        rest = rest + *x * *y;
    }
    for (x, y) in a_parts.zip(b_parts) {
        for lane in 0..LANES {
            sums[lane] = sums[lane] + x[lane] * y[lane];
        }
    }
    let mut width = LANES / 2;
    while width > 0 {
        for lane in 0..width {
            sums[lane] = sums[lane] + sums[lane + width];
        }
        width /= 2;
    }
    sums[0] + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::sparse::linalg::SupernodalThreshold;
    use faer::sparse::linalg::cholesky::{
        CholeskySymbolicParams, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
    };
    use faer::{Side, sparse::SymbolicSparseColMat};

    #[test]
    fn a_product_of_columns_of_any_length() {
        for length in [0, 1, 15, 16, 17, 40] {
            let a: Vec<f64> = (0..length).map(f64::from).collect();
            let b: Vec<f64> = (0..length).map(|i| f64::from(i % 3) - 1.0).collect();
            let expected: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            assert_eq!(dot(&a, &b), expected, "whole numbers, so without rounding");
        }
    }

    /// An arrow of 2×2 blocks and a tail: panels of one, two and more columns.
    fn arrow(n: usize) -> SymbolicCholesky {
        let mut starts = vec![0];
        let mut rows: Vec<u32> = Vec::new();
        for j in 0..n {
            let last = j + 3 > n;
            rows.extend((0..j).filter(|i| last || j % 2 == 1 && i + 1 == j).map(|i| i as u32));
            rows.push(j as u32);
            starts.push(rows.len() as u32);
        }
        let pattern = SymbolicSparseColMat::<u32>::new_checked(n, n, starts, None, rows);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        factorize_symbolic_cholesky(pattern.as_ref(), Side::Upper, SymmetricOrdering::Identity, params).expect("small")
    }

    type SymbolicCholesky = faer::sparse::linalg::cholesky::SymbolicCholesky<u32>;

    #[test]
    fn a_factor_times_its_transpose_is_undone() {
        for n in [1, 2, 7, 30, 61] {
            let symbolic = arrow(n);
            let SymbolicCholeskyRaw::Supernodal(panels) = symbolic.raw() else { panic!("panels were forced") };
            let values: Vec<f64> = (0..symbolic.len_val()).map(|i| 1.0 + (i * 7 % 5) as f64).collect();
            // L as a dense matrix, by rows, from the same panels.
            let mut l = vec![0.0; n * n];
            for number in 0..panels.n_supernodes() {
                let panel = Panel::of(panels, &values, number);
                for k in 0..panel.width {
                    let (own, under) = panel.column(k);
                    let column = panel.start + k;
                    own.iter().enumerate().for_each(|(i, v)| l[(column + i) * n + column] = *v);
                    panel.rows.iter().zip(under).for_each(|(i, v)| l[*i as usize * n + column] = *v);
                }
            }
            let expected: Vec<f64> = (0..n).map(|i| (i * 5 % 7) as f64 - 3.0).collect();
            let across: Vec<f64> = (0..n).map(|j| (0..n).map(|i| l[i * n + j] * expected[i]).sum()).collect();
            let mut x: Vec<f64> = (0..n).map(|i| (0..n).map(|j| l[i * n + j] * across[j]).sum()).collect();
            let image = x.clone();
            solve(panels, &values, &mut x, &mut vec![0.0; most_below(panels)]);
            // Such a factor may be ill-conditioned: what is small is the residual.
            let back: Vec<f64> = (0..n).map(|j| (0..n).map(|i| l[i * n + j] * x[i]).sum()).collect();
            let again: Vec<f64> = (0..n).map(|i| (0..n).map(|j| l[i * n + j] * back[j]).sum()).collect();
            let size = image.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            let worst = image.iter().zip(&again).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst <= 1e-9 * size, "{n}: {worst} of {size}");
        }
    }
}
