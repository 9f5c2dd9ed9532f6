//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
#![forbid(unsafe_code)]

pub mod distortion;
pub mod geodesics;
pub mod linalg;
pub mod mesh;
pub mod metrics;
pub mod packing;
mod progress;
pub mod standalone;
pub mod stretch;
mod report;
pub mod rounding;
mod verify;

pub use progress::{Cancelled, Progress, Stage};
pub use report::Report;
pub use verify::{Certificate, Defect, verify};
