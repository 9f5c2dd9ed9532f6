//! Sparse and dense linear algebra over faer: no mesh types, no stage.

mod sparse;

pub use sparse::{SparseCholesky, SparseError, SparsePattern};
//! Dense linear algebra on plain arrays: symmetric eigenpairs and classical scaling.
//!
//! Knows nothing of meshes or stages. Matrices are flat slices, row by row.

mod classical_mds;
mod symmetric;
mod vector_state;

pub use classical_mds::{Mds, classical_mds};
pub use symmetric::{EigenError, Eigenpairs, leading_eigenpairs};
pub use vector_state::restore_vector_state;
