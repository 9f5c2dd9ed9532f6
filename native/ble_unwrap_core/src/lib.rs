//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
#![forbid(unsafe_code)]

pub mod charts;
pub mod distortion;
pub mod geodesics;
pub mod mesh;
mod progress;
pub mod segmentation;

pub use progress::{Cancelled, Progress, Stage};
