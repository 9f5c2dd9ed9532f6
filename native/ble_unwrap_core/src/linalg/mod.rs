//! Linear algebra over faer and on plain arrays: no mesh types, no stage.
//!
//! Sparse symmetric solves, symmetric eigenpairs, classical scaling. Dense matrices are flat slices, row by
//! row.

mod classical_mds;
mod krylov;
mod packing_buffers;
mod sparse;
mod sparse_pattern;
mod symmetric;
mod vector_state;

pub use classical_mds::{Mds, classical_mds, leading_mds};
pub use packing_buffers::bytes_of_packing_buffers;
pub use sparse::{RoughCholesky, SparseCholesky, SparseError};
pub use sparse_pattern::SparsePattern;
pub use symmetric::{EigenError, Eigenpairs, leading_eigenpairs};
pub use vector_state::restore_vector_state;
