//! Sparse and dense linear algebra over faer: no mesh types, no stage.

mod sparse;

pub use sparse::{SparseCholesky, SparseError, SparsePattern};
