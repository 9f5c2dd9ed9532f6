//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
//!
//! [`unwrap()`] takes a polygon mesh ([`MeshInput`]) to an [`Atlas`]: a UV for every polygon corner, in few
//! charts, each with bounded stretch, without flips and overlap. [`unwrap_points()`] does the same for point clouds.
#![forbid(unsafe_code)]
#![warn(unnameable_types)]

mod atlas;
mod charts;
mod choice;
mod clock;
mod cloud;
mod distortion;
pub mod embedding;
mod error;
mod error_kind;
mod flattening;
mod geodesics;
#[doc(hidden)]
pub mod internals;
mod linalg;
pub mod memory;
mod mesh;
mod metrics;
mod packing;
mod pipeline;
mod progress;
mod report;
mod rounding;
mod segmentation;
pub mod settings;
pub mod standalone;
mod stretch;
mod verify;

pub use atlas::Atlas;
pub use cloud::{CloudError, CloudReport, PointAtlas, PointDefect, unwrap_points};
pub use error::UnwrapError;
pub use error_kind::ErrorKind;
pub use mesh::{MeshError, MeshInput};
pub use packing::PackError;
pub use pipeline::{Analysis, unwrap};
pub use progress::{Cancelled, Progress, Stage};
pub use report::Report;
pub use settings::Settings;
pub use verify::{Certificate, Defect};
