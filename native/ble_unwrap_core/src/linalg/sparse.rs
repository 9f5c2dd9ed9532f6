//! Sparse symmetric positive definite systems: analyse a pattern once, factor it many times.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef};
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side, Spec};
use thiserror::Error;

use super::packing_buffers;
use super::sparse_pattern::SparsePattern;
use super::triangular::{self, Real};
use super::vector_state::restore_vector_state;
use crate::memory::{self, OutOfMemory};

/// Why a sparse system could not be factored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub(crate) enum SparseError {
    /// A pivot was not positive, or a value was not finite: the matrix is not numerically positive
    /// definite.
    #[error("the matrix is not positive definite (row {row})")]
    NotPositiveDefinite {
        /// The row of the pivot, in the order of the caller.
        row: usize,
    },
    /// The factor has more than 2³¹ entries, whatever the memory.
    #[error("the sparse factor has too many entries")]
    TooLarge,
    /// There is no memory for the factor.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemory),
}

/// Most right-hand sides solved at once.
const MAX_COLUMNS: usize = 2;
/// Added to the diagonal of a matrix in single precision, relative to it: well above what rounding there takes from the
/// last pivots.
const ROUGH_RIDGE: f64 = 1e-6;
/// The conjugate gradients end when the residual has fallen to this share: Newton's method needs no more of a direction.
const RESIDUAL: f64 = 1e-4;
/// The conjugate gradients end after so many steps, however large the residual is.
const MOST_STEPS: usize = 24;

/// LLᵀ of a sparse symmetric positive definite matrix: owns the symbolic analysis (approximate
/// minimum degree), the factor and the scratch memory, of which factoring and solving share one piece.
///
/// Serial, hence the same bits whatever the number of threads; callers run charts in parallel. Once
/// made, refactoring and solving allocate nothing.
pub(crate) struct SparseCholesky {
    pattern: SparsePattern,
    factor: Factor<f64>,
    scratch: MemBuffer,
}

impl SparseCholesky {
    /// Orders the unknowns and finds the pattern of the factor. The factor is that of no matrix until
    /// [`SparseCholesky::refactor`] succeeds.
    ///
    /// # Errors
    /// [`SparseError::TooLarge`], [`SparseError::OutOfMemory`].
    pub(crate) fn analyse(pattern: SparsePattern) -> Result<Self, SparseError> {
        let factor = Factor::analyse(&pattern, Order::of(&pattern)?)?;
        let scratch = buffer(factor.refactor_scratch().or(factor.solve_scratch()))?;
        Ok(Self { pattern, factor, scratch })
    }

    /// The pattern that was analysed.
    #[must_use]
    pub(crate) fn pattern(&self) -> &SparsePattern {
        &self.pattern
    }

    /// Factors the matrix with these values, in the order of the pattern.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`]; the factor is then that of no matrix.
    ///
    /// # Panics
    /// If there is not one value for each entry of the pattern.
    pub(crate) fn refactor(&mut self, values: &[f64]) -> Result<(), SparseError> {
        assert_eq!(values.len(), self.pattern.entry_count(), "one value for each entry of the pattern");
        if let Some(bad) = values.iter().position(|v| !v.is_finite()) {
            return Err(SparseError::NotPositiveDefinite { row: self.pattern.row(bad) });
        }
        self.factor.refactor(&self.pattern, values, MemStack::new(&mut self.scratch))
    }

    /// Solves with the last matrix factored: one or two right-hand sides, one after the other in
    /// `columns`, become the solutions.
    ///
    /// # Panics
    /// If the length of `columns` is not once or twice the size of the matrix.
    pub(crate) fn solve_in_place(&mut self, columns: &mut [f64]) {
        self.factor.solve_in_place(columns, MemStack::new(&mut self.scratch));
    }
}

/// Solves systems of 2×2 blocks, a block for each entry of a pattern, roughly: a factor in single precision, which takes
/// half the memory, leads conjugate gradients in double precision to a small residual. Serial, like [`SparseCholesky`].
pub(crate) struct RoughCholesky {
    pattern: SparsePattern,
    factor: Factor<f32>,
    /// For factoring: the matrix in single precision, and what the factorisation needs. For solving: the vectors of the
    /// conjugate gradients, and what a solution by the factor needs. Never both at once.
    scratch: MemBuffer,
}

impl RoughCholesky {
    /// Orders the blocks and finds the pattern of the factor.
    ///
    /// # Errors
    /// [`SparseError::TooLarge`], [`SparseError::OutOfMemory`].
    pub(crate) fn analyse(blocks: SparsePattern) -> Result<Self, SparseError> {
        let (pattern, order) = (blocks.with_blocks_of_two(), Order::of(&blocks)?.with_blocks_of_two());
        drop(blocks);
        let factor = Factor::analyse(&pattern, order)?;
        let n = pattern.size();
        let to_factor = StackReq::new::<f32>(pattern.entry_count()).and(factor.refactor_scratch());
        let vectors = StackReq::new::<f64>(n).array(3).and(StackReq::new::<f32>(n));
        let scratch = buffer(to_factor.or(vectors.and(factor.solve_one_scratch())))?;
        Ok(Self { pattern, factor, scratch })
    }

    /// The pattern of all unknowns, two for each block.
    #[must_use]
    pub(crate) fn pattern(&self) -> &SparsePattern {
        &self.pattern
    }

    /// Factors a matrix with these values, in the order of the pattern.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`]; the factor is then that of no matrix.
    ///
    /// # Panics
    /// If there is not one value for each entry of the pattern.
    pub(crate) fn refactor(&mut self, values: &[f64]) -> Result<(), SparseError> {
        assert_eq!(values.len(), self.pattern.entry_count(), "one value for each entry of the pattern");
        let stack = MemStack::new(&mut self.scratch);
        let (mut rough, stack) = stack.make_with(values.len(), |at| values[at] as f32);
        for j in 0..self.pattern.size() {
            let at = self.pattern.diagonal(j);
            rough[at] = (values[at] * (1.0 + ROUGH_RIDGE)) as f32;
        }
        if let Some(bad) = rough.iter().position(|v| !v.is_finite()) {
            return Err(SparseError::NotPositiveDefinite { row: self.pattern.row(bad) });
        }
        self.factor.refactor(&self.pattern, &rough, stack)
    }

    /// Solves a system whose matrix, with these values, is near the last one factored: `x` is the right-hand side, and
    /// becomes a vector that points the same way as the solution in the sense of the matrix.
    ///
    /// # Panics
    /// If there is not one value for each entry of the pattern, or the length of `x` is not its size.
    pub(crate) fn solve_in_place(&mut self, values: &[f64], x: &mut [f64]) {
        assert_eq!((values.len(), x.len()), (self.pattern.entry_count(), self.pattern.size()), "of the pattern");
        let n = x.len();
        let stack = MemStack::new(&mut self.scratch);
        let (mut residual, stack) = stack.make_with(n, |i| x[i]);
        let (mut search, stack) = stack.make_with(n, |_| 0.0);
        let (mut image, stack) = stack.make_with(n, |_| 0.0);
        let (mut column, stack) = stack.make_with(n, |_| 0.0);
        x.fill(0.0);
        let target = RESIDUAL * RESIDUAL * dot(&residual, &residual);
        let mut before = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            // The preconditioned residual, in `image` until the search direction has it.
            for (c, r) in column.iter_mut().zip(residual.iter()) {
                *c = *r as f32;
            }
            self.factor.solve_one(&mut column, stack);
            for (i, c) in image.iter_mut().zip(column.iter()) {
                *i = f64::from(*c);
            }
            let now = dot(&image, &residual);
            if !(now > 0.0 && now.is_finite()) {
                break;
            }
            let share = now / before;
            for (s, i) in search.iter_mut().zip(image.iter()) {
                *s = i + share * *s;
            }
            before = now;
            self.pattern.multiply(values, &search, &mut image);
            let curvature = dot(&image, &search);
            if !(curvature > 0.0 && curvature.is_finite()) {
                break;
            }
            let length = now / curvature;
            for ((x, r), (s, i)) in x.iter_mut().zip(residual.iter_mut()).zip(search.iter().zip(image.iter())) {
                *x += length * s;
                *r -= length * i;
            }
            if dot(&residual, &residual) <= target {
                break;
            }
        }
    }
}

fn buffer(size: StackReq) -> Result<MemBuffer, SparseError> {
    let bytes = size.size_bytes() as u64;
    MemBuffer::try_new(size).map_err(|_| OutOfMemory::Refused { bytes }.into())
}

/// An error of faer's analysis of so many entries.
fn analysis_error(error: FaerError, entries: usize) -> SparseError {
    match error {
        // faer does not say what it asked for: an index an entry, at least.
        FaerError::OutOfMemory => OutOfMemory::Refused { bytes: 4 * entries as u64 }.into(),
        _ => SparseError::TooLarge,
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A permutation of the unknowns, and its inverse.
struct Order {
    forward: Vec<u32>,
    inverse: Vec<u32>,
}

impl Order {
    /// Approximate minimum degree.
    fn of(pattern: &SparsePattern) -> Result<Self, SparseError> {
        let n = pattern.size();
        let (mut forward, mut inverse) = (vec![0; n], vec![0; n]);
        let mut scratch = buffer(amd::order_maybe_unsorted_scratch::<u32>(n, pattern.entry_count()))?;
        let stack = MemStack::new(&mut scratch);
        amd::order_maybe_unsorted(&mut forward, &mut inverse, pattern.symbolic(), amd::Control::default(), stack)
            .map_err(|error| analysis_error(error, pattern.entry_count()))?;
        Ok(Self { forward, inverse })
    }

    /// The two unknowns of a block next to each other.
    fn with_blocks_of_two(&self) -> Self {
        let double = |p: &Vec<u32>| p.iter().flat_map(|&i| [2 * i, 2 * i + 1]).collect();
        Self { forward: double(&self.forward), inverse: double(&self.inverse) }
    }
}

/// A factor in some precision, and its symbolic analysis.
struct Factor<T> {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<T>,
}

impl<T: RealField + Real> Factor<T> {
    fn analyse(pattern: &SparsePattern, order: Order) -> Result<Self, SparseError> {
        // The 2×2 blocks of a map's Hessian make dense panels even in small charts.
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let permutation = PermRef::new_checked(&order.forward, &order.inverse, pattern.size());
        let ordering = SymmetricOrdering::Custom(permutation);
        let symbolic = factorize_symbolic_cholesky(pattern.symbolic(), Side::Upper, ordering, params)
            .map_err(|error| analysis_error(error, pattern.entry_count()))?;
        // The analysis has a copy.
        drop(order);
        // Before the first product of this thread.
        packing_buffers::reserve()?;
        let values = memory::filled(symbolic.len_val(), T::default())?;
        Ok(Self { symbolic, values })
    }

    /// What [`Factor::refactor`] needs of a stack.
    fn refactor_scratch(&self) -> StackReq {
        self.symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default())
    }

    /// What [`Factor::solve_one`] needs of a stack.
    fn solve_one_scratch(&self) -> StackReq {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let below = triangular::most_below(symbolic);
                StackReq::new::<T>(self.symbolic.nrows()).and(StackReq::new::<T>(below))
            }
            SymbolicCholeskyRaw::Simplicial(_) => self.solve_scratch(),
        }
    }

    /// Solves with one right-hand side.
    fn solve_one(&self, column: &mut [T], stack: &mut MemStack) {
        let (SymbolicCholeskyRaw::Supernodal(symbolic), Some(order)) = (self.symbolic.raw(), self.symbolic.perm())
        else {
            return self.solve_in_place(column, stack);
        };
        let order = order.arrays().0;
        let (mut x, stack) = stack.make_with(order.len(), |i| column[order[i] as usize]);
        let (mut below, _) = stack.make_with(triangular::most_below(symbolic), |_| T::default());
        triangular::solve(symbolic, &self.values, &mut x, &mut below);
        for (&i, x) in order.iter().zip(x.iter()) {
            column[i as usize] = *x;
        }
    }

    /// What [`Factor::solve_in_place`] needs of a stack.
    fn solve_scratch(&self) -> StackReq {
        self.symbolic.solve_in_place_scratch::<T>(MAX_COLUMNS, Par::Seq)
    }

    fn refactor(&mut self, pattern: &SparsePattern, values: &[T], stack: &mut MemStack) -> Result<(), SparseError> {
        let done = self.symbolic.factorize_numeric_llt(
            &mut self.values,
            SparseColMatRef::new(pattern.symbolic(), values),
            Side::Upper,
            LltRegularization::default(),
            Par::Seq,
            stack,
            Spec::default(),
        );
        restore_vector_state();
        match done {
            Ok(_) => Ok(()),
            Err(LltError::NonPositivePivot { index }) => {
                let row = self.symbolic.perm().and_then(|p| p.arrays().0.get(index).copied());
                Err(SparseError::NotPositiveDefinite { row: row.map_or(index, |r| r as usize) })
            }
        }
    }

    fn solve_in_place(&self, columns: &mut [T], stack: &mut MemStack) {
        let n = self.symbolic.nrows();
        if n == 0 {
            return;
        }
        let count = columns.len() / n;
        assert!(columns.len() == count * n && (1..=MAX_COLUMNS).contains(&count), "one or two columns of length {n}");
        let rhs = MatMut::from_column_major_slice_mut(columns, n, count);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
        restore_vector_state();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five-point Laplacian of a w×w grid plus `shift` on the diagonal.
    fn grid(w: usize, shift: f64) -> (SparsePattern, Vec<f64>) {
        let id = |x: usize, y: usize| (y * w + x) as u32;
        let mut pairs = Vec::new();
        for y in 0..w {
            for x in 0..w {
                if x + 1 < w {
                    pairs.push((id(x, y), id(x + 1, y)));
                }
                if y + 1 < w {
                    pairs.push((id(x, y + 1), id(x, y)));
                }
            }
        }
        let pattern = SparsePattern::from_pairs(w * w, pairs.iter().copied());
        let mut values = vec![0.0; pattern.entry_count()];
        for i in 0..w * w {
            values[pattern.position(i, i).expect("diagonal")] = shift;
        }
        for &(i, j) in &pairs {
            let (i, j) = (i as usize, j as usize);
            values[pattern.position(i, j).expect("entry")] -= 1.0;
            values[pattern.position(i, i).expect("diagonal")] += 1.0;
            values[pattern.position(j, j).expect("diagonal")] += 1.0;
        }
        (pattern, values)
    }

    fn product(pattern: &SparsePattern, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for j in 0..x.len() {
            for &i in pattern.column(j) {
                let i = i as usize;
                let v = values[pattern.position(i, j).expect("entry")];
                y[i] += v * x[j];
                if i != j {
                    y[j] += v * x[i];
                }
            }
        }
        y
    }

    #[test]
    fn solves_small_and_large_systems_repeatedly() {
        // 3×3 takes faer's simplicial path, 60×60 the supernodal one.
        for w in [1, 3, 60] {
            let (pattern, _) = grid(w, 0.1);
            let mut solver = SparseCholesky::analyse(pattern).expect("analysis");
            for shift in [0.1, 3.0] {
                let (pattern, values) = grid(w, shift);
                solver.refactor(&values).expect("positive definite");
                let x: Vec<f64> = (0..2 * w * w).map(|i| ((i * 37) % 11) as f64 - 5.0).collect();
                let (x0, x1) = x.split_at(w * w);
                let mut b = product(&pattern, &values, x0);
                b.extend(product(&pattern, &values, x1));
                solver.solve_in_place(&mut b);
                let worst = b.iter().zip(&x).map(|(b, x)| (b - x).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-10, "{w} {shift}: {worst}");
            }
        }
    }

    #[test]
    fn refuses_indefinite_and_non_finite_matrices_and_recovers() {
        for w in [3, 40] {
            let (pattern, good) = grid(w, 0.1);
            let mut solver = SparseCholesky::analyse(pattern.clone()).expect("analysis");
            let at = pattern.position(4, 4).expect("diagonal");
            for bad in [-5.0, 0.0, f64::NAN, f64::INFINITY] {
                let mut values = good.clone();
                values[at] = bad;
                assert!(matches!(solver.refactor(&values), Err(SparseError::NotPositiveDefinite { .. })), "{w} {bad}");
            }
            assert_eq!(solver.refactor(&good), Ok(()));
        }
    }

    /// A Laplacian of 2×2 blocks: both unknowns of a block as in [`grid`], and joined to each other.
    fn blocks(w: usize, shift: f64) -> (SparsePattern, Vec<f64>) {
        let (scalar, single) = grid(w, shift);
        let both = scalar.with_blocks_of_two();
        let mut values = vec![0.0; both.entry_count()];
        for j in 0..scalar.size() {
            for &i in scalar.column(j) {
                let (i, v) = (i as usize, single[scalar.position(i as usize, j).expect("entry")]);
                for k in 0..2 {
                    values[both.position(2 * i + k, 2 * j + k).expect("entry")] = v;
                }
            }
            values[both.position(2 * j, 2 * j + 1).expect("entry")] = 0.5 * shift;
        }
        (scalar, values)
    }

    #[test]
    fn a_rough_factor_solves_to_a_small_residual() {
        for (w, shift) in [(3, 0.1), (40, 0.1), (40, 1e-7)] {
            let (scalar, values) = blocks(w, shift);
            let mut solver = RoughCholesky::analyse(scalar.clone()).expect("analysis");
            solver.refactor(&values).expect("positive definite");
            let b: Vec<f64> = (0..2 * w * w).map(|i| ((i * 37) % 11) as f64 - 5.0).collect();
            let mut x = b.clone();
            solver.solve_in_place(&values, &mut x);
            let image = product(solver.pattern(), &values, &x);
            let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>().sqrt();
            let residual = norm(&mut image.iter().zip(&b).map(|(p, q)| p - q)) / norm(&mut b.iter().copied());
            assert!(residual <= RESIDUAL, "{w} {shift}: {residual}");
        }
    }

    #[test]
    fn a_matrix_that_changed_since_is_solved_all_the_same() {
        let (scalar, values) = blocks(30, 0.5);
        let mut solver = RoughCholesky::analyse(scalar.clone()).expect("analysis");
        solver.refactor(&values).expect("positive definite");
        let changed: Vec<f64> = values.iter().enumerate().map(|(i, v)| v * (1.0 + 1e-3 * (i % 7) as f64)).collect();
        let b: Vec<f64> = (0..2 * 900).map(|i| ((i * 53) % 13) as f64 - 6.0).collect();
        let mut x = b.clone();
        solver.solve_in_place(&changed, &mut x);
        let image = product(solver.pattern(), &changed, &x);
        let worst = image.iter().zip(&b).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
        assert!(worst < 0.05, "{worst}");
        assert!(dot(&x, &b) > 0.0);
        assert!(matches!(
            solver.refactor(&vec![f64::NAN; changed.len()]),
            Err(SparseError::NotPositiveDefinite { .. })
        ));
    }

    #[test]
    fn an_empty_system_is_solved() {
        let mut solver = SparseCholesky::analyse(SparsePattern::from_pairs(0, [])).expect("analysis");
        assert_eq!(solver.refactor(&[]), Ok(()));
        solver.solve_in_place(&mut []);
    }
}
