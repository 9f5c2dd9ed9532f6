//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
//!
//! [`unwrap()`] takes a polygon mesh ([`MeshInput`]) to an [`Atlas`]: a UV for every polygon corner, in few
//! charts, each with bounded stretch, without flips and overlap. The stages are public, too: they are
//! listed here in the order in which data passes through them.
//!
//! | stage | module |
//! |---|---|
//! | any polygons to an oriented manifold | [`mesh`] |
//! | distances on the surface | [`geodesics`] |
//! | where to cut | [`segmentation`], [`charts`] |
//! | Bernoulli logistic embedding, the paper's method | [`embedding`] |
//! | no flips, least stretch | [`stretch`] |
//! | charts into the unit square | [`packing`] |
//! | single precision, proof, figures | [`rounding`], [`verify()`], [`metrics`] |
//!
//! [`unwrap_points()`] does the same for point clouds ([`cloud`]).
//!
//! The paper: *Bernoulli Embedding Model and Its Application in Texture Mapping*, revised 2006. Where a
//! stage follows it, its documentation names section and equation.
#![forbid(unsafe_code)]

mod atlas;
pub mod charts;
mod choice;
mod clock;
pub mod cloud;
mod collections;
pub mod distortion;
pub mod embedding;
mod error;
pub mod flattening;
pub mod geodesics;
pub mod linalg;
pub mod memory;
pub mod mesh;
pub mod metrics;
pub mod packing;
mod pipeline;
mod progress;
mod random;
mod report;
pub mod rounding;
pub mod segmentation;
pub mod settings;
pub mod standalone;
pub mod stretch;
mod verify;

pub use atlas::Atlas;
pub use choice::{Choice, Named};
pub use cloud::{CloudError, CloudReport, PointAtlas, unwrap_points};
pub use error::UnwrapError;
pub use flattening::{Rung, Rungs};
pub use mesh::{MeshError, MeshInput};
pub use pipeline::{Analysis, unwrap};
pub use progress::{Cancelled, Progress, Stage};
pub use report::Report;
pub use settings::{ChartScale, Holes, LimitOver, NEVER_SEWN, Settings};
pub use verify::{Certificate, Defect, verify};
