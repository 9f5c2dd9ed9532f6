//! What can go wrong, one variant a stage.

use thiserror::Error;

use crate::mesh::MeshError;
use crate::metrics::UvMeshError;
use crate::packing::PackError;
use crate::progress::Cancelled;

/// Why [`unwrap`](crate::unwrap()) gave no atlas. The text names the offending element and the remedy.
#[derive(Debug, Error)]
pub enum UnwrapError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A setting is out of its range.
    #[error("{name} is {value}; it must be {allowed}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The charts cannot be packed as asked.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// The result does not fit the checks, which take 2³⁰ triangles.
    #[error(transparent)]
    Check(#[from] UvMeshError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
