//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
#![forbid(unsafe_code)]

pub mod distortion;
pub mod embedding;
pub mod geodesics;
pub mod linalg;
pub mod mesh;
mod progress;
pub mod stretch;

pub use progress::{Cancelled, Progress, Stage};
