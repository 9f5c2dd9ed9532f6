//! Sparse symmetric positive definite systems: analyse a pattern once, factor it many times.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use thiserror::Error;

use super::vector_state::restore_vector_state;

/// Why a sparse system could not be factored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SparseError {
    /// A pivot was not positive, or a value was not finite: the matrix is not numerically positive
    /// definite.
    #[error("the matrix is not positive definite (row {row})")]
    NotPositiveDefinite {
        /// The row of the pivot, in the order of the caller.
        row: usize,
    },
    /// The factor does not fit in memory, or has more than 2³¹ entries.
    #[error("the sparse factor is too large")]
    TooLarge,
}

/// The upper triangle of a symmetric matrix, column by column: which entries may differ from zero.
///
/// Every diagonal entry is present; rows ascend within a column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SparsePattern {
    column_start: Vec<u32>,
    row: Vec<u32>,
}

impl SparsePattern {
    /// The pattern with a full diagonal and an entry for each pair, in either order and as often as
    /// one likes. O(m log m) for m pairs.
    ///
    /// # Panics
    /// If a pair names a row that is not there.
    #[must_use]
    pub fn from_pairs(size: usize, pairs: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let mut entries: Vec<(u32, u32)> = pairs.into_iter().map(|(i, j)| (i.max(j), i.min(j))).collect();
        entries.extend((0..size as u32).map(|i| (i, i)));
        entries.sort_unstable();
        entries.dedup();
        let mut column_start = vec![0; size + 1];
        for &(column, _) in &entries {
            column_start[column as usize + 1] += 1;
        }
        for j in 0..size {
            column_start[j + 1] += column_start[j];
        }
        Self { column_start, row: entries.into_iter().map(|(_, row)| row).collect() }
    }

    /// Every entry replaced by a 2×2 block: unknown `i` becomes unknowns `2i` and `2i + 1`. O(m).
    #[must_use]
    pub fn with_blocks_of_two(&self) -> Self {
        let mut column_start = Vec::with_capacity(2 * self.size() + 1);
        let mut row = Vec::with_capacity(4 * self.row.len());
        column_start.push(0);
        for j in 0..self.size() {
            let above = &self.column(j)[..self.column(j).len() - 1];
            for last in [2 * j as u32, 2 * j as u32 + 1] {
                row.extend(above.iter().flat_map(|&i| [2 * i, 2 * i + 1]));
                row.extend(2 * j as u32..=last);
                column_start.push(row.len() as u32);
            }
        }
        Self { column_start, row }
    }

    /// Number of rows and columns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.column_start.len() - 1
    }

    /// Number of stored entries: the length of the array of values that goes with the pattern.
    #[must_use]
    pub fn entry_count(&self) -> usize {
        self.row.len()
    }

    /// The rows of column `j`, the diagonal last.
    #[must_use]
    pub fn column(&self, j: usize) -> &[u32] {
        &self.row[self.column_start[j] as usize..self.column_start[j + 1] as usize]
    }

    /// Where the value of entry (i, j), equally (j, i), is kept, if it is in the pattern. O(log).
    #[must_use]
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let (row, column) = (i.min(j) as u32, i.max(j));
        let found = self.column(column).binary_search(&row).ok()?;
        Some(self.column_start[column] as usize + found)
    }
}

/// LLᵀ of a sparse symmetric positive definite matrix: owns the symbolic analysis (approximate
/// minimum degree), the factor and the scratch memory.
///
/// Serial, hence the same bits whatever the number of threads; callers run charts in parallel. Once
/// made, refactoring and solving allocate nothing. On the Hessian of a chart of 100,000 faces
/// (2×2 blocks) the analysis takes about 70 ms, a factorisation 190 ms, a solve 20 ms.
pub struct SparseCholesky {
    pattern: SparsePattern,
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    factor_scratch: MemBuffer,
    solve_scratch: MemBuffer,
}

/// Most right-hand sides solved at once.
const MAX_COLUMNS: usize = 2;

impl SparseCholesky {
    /// Orders the unknowns and finds the pattern of the factor. The factor is that of no matrix until
    /// [`SparseCholesky::refactor`] succeeds.
    ///
    /// # Errors
    /// [`SparseError::TooLarge`].
    pub fn analyse(pattern: SparsePattern) -> Result<Self, SparseError> {
        let n = pattern.size();
        let a = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.row);
        // The 2×2 blocks of a map's Hessian make dense panels even in small charts.
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(a, Side::Upper, SymmetricOrdering::Amd, params)
            .map_err(|_: FaerError| SparseError::TooLarge)?;
        let buffer = |req| MemBuffer::try_new(req).map_err(|_| SparseError::TooLarge);
        let factor_scratch = buffer(symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()))?;
        let solve_scratch = buffer(symbolic.solve_in_place_scratch::<f64>(MAX_COLUMNS, Par::Seq))?;
        let mut factor = Vec::new();
        factor.try_reserve_exact(symbolic.len_val()).map_err(|_| SparseError::TooLarge)?;
        factor.resize(symbolic.len_val(), 0.0);
        Ok(Self { pattern, symbolic, factor, factor_scratch, solve_scratch })
    }

    /// The pattern that was analysed.
    #[must_use]
    pub fn pattern(&self) -> &SparsePattern {
        &self.pattern
    }

    /// Factors the matrix with these values, in the order of the pattern.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`]; the factor is then that of no matrix.
    ///
    /// # Panics
    /// If there is not one value for each entry of the pattern.
    pub fn refactor(&mut self, values: &[f64]) -> Result<(), SparseError> {
        assert_eq!(values.len(), self.pattern.entry_count(), "one value for each entry of the pattern");
        if let Some(bad) = values.iter().position(|v| !v.is_finite()) {
            return Err(SparseError::NotPositiveDefinite { row: self.pattern.row[bad] as usize });
        }
        let n = self.pattern.size();
        let a = SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, &self.pattern.column_start, None, &self.pattern.row),
            values,
        );
        let done = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            a,
            Side::Upper,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.factor_scratch),
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

    /// Solves with the last matrix factored: one or two right-hand sides, one after the other in
    /// `columns`, become the solutions.
    ///
    /// # Panics
    /// If the length of `columns` is not once or twice the size of the matrix.
    pub fn solve_in_place(&mut self, columns: &mut [f64]) {
        let n = self.pattern.size();
        if n == 0 {
            return;
        }
        let count = columns.len() / n;
        assert!(columns.len() == count * n && (1..=MAX_COLUMNS).contains(&count), "one or two columns of length {n}");
        let rhs = MatMut::from_column_major_slice_mut(columns, n, count);
        let stack = MemStack::new(&mut self.solve_scratch);
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
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

    #[test]
    fn blocks_of_two_hold_every_pair_of_unknowns() {
        let (pattern, _) = grid(4, 1.0);
        let blocks = pattern.with_blocks_of_two();
        assert_eq!(blocks.size(), 32);
        for i in 0..32 {
            for j in 0..32 {
                assert_eq!(blocks.position(i, j).is_some(), pattern.position(i / 2, j / 2).is_some());
            }
        }
    }

    #[test]
    fn an_empty_system_is_solved() {
        let mut solver = SparseCholesky::analyse(SparsePattern::from_pairs(0, [])).expect("analysis");
        assert_eq!(solver.refactor(&[]), Ok(()));
        solver.solve_in_place(&mut []);
    }
}
