//! Eigenpairs of dense symmetric matrices.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{Mat, MatRef, Par};
use thiserror::Error;

use super::packing_buffers;
use super::vector_state::restore_vector_state;
use crate::memory::OutOfMemory;
use crate::progress::Cancelled;

/// Why a symmetric matrix has no eigenpairs to give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub(crate) enum EigenError {
    /// An entry is infinite or not a number.
    #[error("entry ({row}, {column}) of the matrix is not finite")]
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
    },
    /// The QR iteration gave up; does not happen for matrices of sane scale.
    #[error("the symmetric eigenvalue iteration did not converge")]
    NoConvergence,
    /// Asked to stop, or out of memory.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<OutOfMemory> for EigenError {
    fn from(error: OutOfMemory) -> Self {
        Self::Cancelled(Cancelled::OutOfMemory(error))
    }
}

/// The eigenvalues of a symmetric matrix and the eigenvectors of the largest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Eigenpairs {
    /// All n eigenvalues, largest first.
    pub values: Vec<f64>,
    /// The m leading unit eigenvectors as an n×m matrix, row by row: column `j` belongs to
    /// `values[j]`. The component of largest magnitude (the first of equals) is positive.
    pub vectors: Vec<f64>,
}

/// All eigenvalues of a symmetric n×n matrix and the eigenvectors of the `count` largest (at most n).
///
/// Only the lower triangle is read. Serial, so the bytes do not depend on the number of threads; eigenvectors
/// of equal eigenvalues are an arbitrary basis of their space. O(n³), about 4 ms for n = 100.
///
/// # Errors
/// [`EigenError::NotFinite`] names an entry; [`EigenError::NoConvergence`]; [`EigenError::Cancelled`] where there is no
/// memory.
///
/// # Panics
/// If `matrix` does not hold n² values.
pub(crate) fn leading_eigenpairs(matrix: &[f64], n: usize, count: usize) -> Result<Eigenpairs, EigenError> {
    assert_eq!(matrix.len(), n * n, "a square matrix, row by row");
    for row in 0..n {
        if let Some(column) = matrix[row * n..=row * n + row].iter().position(|v| !v.is_finite()) {
            return Err(EigenError::NotFinite { row, column });
        }
    }
    let count = count.min(n);
    if n < 2 {
        return Ok(Eigenpairs { values: matrix.to_vec(), vectors: vec![1.0; count] });
    }
    let mut vectors = Mat::<f64>::zeros(n, n);
    let mut values = faer::diag::Diag::<f64>::zeros(n);
    let scratch = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, faer::prelude::default());
    let bytes = scratch.size_bytes() as u64;
    let mut scratch = MemBuffer::try_new(scratch).map_err(|_| OutOfMemory::Refused { bytes })?;
    packing_buffers::reserve()?;
    let outcome = self_adjoint_evd(
        MatRef::from_row_major_slice(matrix, n, n),
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut scratch),
        faer::prelude::default(),
    );
    restore_vector_state();
    outcome.map_err(|_| EigenError::NoConvergence)?;

    let mut leading = vec![0.0; n * count];
    for j in 0..count {
        let column = vectors.col(n - 1 - j);
        let mut largest = 0.0_f64;
        for i in 0..n {
            if column[i].abs() > largest.abs() {
                largest = column[i];
            }
        }
        for i in 0..n {
            leading[i * count + j] = if largest < 0.0 { -column[i] } else { column[i] };
        }
    }
    let values = (0..n).rev().map(|j| values.column_vector()[j]).collect();
    Ok(Eigenpairs { values, vectors: leading })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn eigenpairs_of_a_known_matrix() {
        // The path Laplacian of three vertices: eigenvalues 3, 1, 0.
        let m = [1.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 1.0];
        let e = leading_eigenpairs(&m, 3, 2).expect("finite");
        for (value, expected) in e.values.iter().zip([3.0, 1.0, 0.0]) {
            assert!((value - expected).abs() < 1e-14, "{value}");
        }
        let first = [-1.0, 2.0, -1.0].map(|v: f64| v / 6.0_f64.sqrt());
        for i in 0..3 {
            assert!((e.vectors[2 * i] - first[i]).abs() < 1e-14, "{:?}", e.vectors);
        }
    }

    #[test]
    fn sizes_nought_and_one() {
        assert_eq!(leading_eigenpairs(&[], 0, 3), Ok(Eigenpairs::default()));
        assert_eq!(leading_eigenpairs(&[-2.0], 1, 3), Ok(Eigenpairs { values: vec![-2.0], vectors: vec![1.0] }));
    }

    #[test]
    fn names_the_entry_that_is_not_finite() {
        let m = [1.0, 0.0, f64::NAN, 1.0];
        assert_eq!(leading_eigenpairs(&m, 2, 1), Err(EigenError::NotFinite { row: 1, column: 0 }));
    }

    proptest! {
        #[test]
        fn vectors_are_orthonormal_and_solve_the_problem(
            n in 1usize..12,
            entries in proptest::collection::vec(-1.0f64..1.0, 144),
        ) {
            let at = |i: usize, j: usize| entries[12 * i.max(j) + i.min(j)];
            let m: Vec<f64> = (0..n * n).map(|k| at(k / n, k % n)).collect();
            let e = leading_eigenpairs(&m, n, n).expect("finite");
            prop_assert!(e.values.is_sorted_by(|a, b| a >= b));
            for j in 0..n {
                for i in 0..n {
                    let product: f64 = (0..n).map(|k| m[i * n + k] * e.vectors[k * n + j]).sum();
                    prop_assert!((product - e.values[j] * e.vectors[i * n + j]).abs() < 1e-12);
                    let dot: f64 = (0..n).map(|k| e.vectors[k * n + i] * e.vectors[k * n + j]).sum();
                    prop_assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-12);
                }
            }
        }
    }
}
