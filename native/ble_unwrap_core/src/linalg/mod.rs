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
mod triangular;
mod vector_state;

pub(crate) use classical_mds::{Mds, classical_mds, leading_mds};
pub(crate) use packing_buffers::bytes_of_packing_buffers;
pub(crate) use sparse::{RoughCholesky, SparseCholesky, SparseError};
pub(crate) use sparse_pattern::SparsePattern;
pub(crate) use symmetric::EigenError;
