//! Room for a number a pair of points.

use crate::memory;

use super::error::EmbeddingError;

/// An n×n matrix of zeros, if there is room.
pub(super) fn square_matrix(n: usize) -> Result<Vec<f64>, EmbeddingError> {
    let room = n.checked_mul(n).and_then(|count| memory::required(count).ok());
    let mut matrix: Vec<f64> = room.ok_or(EmbeddingError::TooManyPoints { points: n })?;
    matrix.resize(n * n, 0.0);
    Ok(matrix)
}
