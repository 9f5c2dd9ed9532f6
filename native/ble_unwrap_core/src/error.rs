//! What can go wrong, one variant a stage.

use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::memory::OutOfMemory;
use crate::mesh::MeshError;
use crate::metrics::TooManyTriangles;
use crate::packing::PackError;
use crate::progress::Cancelled;
use crate::verify::Certificate;

/// Why [`unwrap`](crate::unwrap()) gave no atlas. The text names the offending element and the remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum UnwrapError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(MeshError),
    /// A setting is out of its range.
    #[error("{name} is {value}; it must be {allowed}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// The charts cannot be packed as asked.
    #[error(transparent)]
    Pack(PackError),
    /// The mesh has more triangles than the exact checks can number.
    #[error("{triangles} triangles are more than the 2^30 that can be checked; give the mesh in parts")]
    TooManyTriangles {
        /// Number of triangles.
        triangles: usize,
    },
    /// There is not enough memory. Either the estimate made before the work began said so, or an allocation was refused.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemory),
    /// No layout was found that keeps what [`unwrap`](crate::unwrap()) promises. The certificate says which rules the last
    /// one breaks.
    #[error(
        "the layout cannot be proven to be free of flips and overlaps and to keep the margin: {0}; raise the texture size or \
         lower the margin, and please report the mesh"
    )]
    Unproven(Box<Certificate>),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(Cancelled),
}

impl UnwrapError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Mesh(error) => error.kind(),
            Self::Setting { .. } => ErrorKind::Argument,
            Self::Pack(error) => error.kind(),
            Self::TooManyTriangles { .. } => ErrorKind::Mesh,
            Self::Unproven(_) => ErrorKind::Unproven,
            Self::OutOfMemory(_) => ErrorKind::OutOfMemory,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

impl From<Cancelled> for UnwrapError {
    fn from(cancelled: Cancelled) -> Self {
        match cancelled {
            Cancelled::OnRequest => Self::Cancelled(cancelled),
            Cancelled::OutOfMemory(error) => Self::OutOfMemory(error),
        }
    }
}

impl From<MeshError> for UnwrapError {
    fn from(error: MeshError) -> Self {
        // A stop is a stop, whichever stage it came in.
        match error {
            MeshError::Cancelled(cancelled) => cancelled.into(),
            other => Self::Mesh(other),
        }
    }
}

impl From<TooManyTriangles> for UnwrapError {
    fn from(TooManyTriangles { triangles }: TooManyTriangles) -> Self {
        Self::TooManyTriangles { triangles }
    }
}

impl From<PackError> for UnwrapError {
    fn from(error: PackError) -> Self {
        match error {
            PackError::Cancelled(cancelled) => cancelled.into(),
            other => Self::Pack(other),
        }
    }
}
