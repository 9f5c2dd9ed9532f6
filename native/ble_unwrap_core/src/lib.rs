//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
#![forbid(unsafe_code)]

pub mod distortion;
pub mod geodesics;
pub mod mesh;
pub mod metrics;
pub mod packing;
mod progress;
pub mod standalone;

pub use progress::{Cancelled, Progress, Stage};
