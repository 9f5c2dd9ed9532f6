//! What can go wrong with a point cloud.

use thiserror::Error;

use crate::error::UnwrapError;
use crate::error_kind::ErrorKind;
use crate::packing::PackError;
use crate::progress::Cancelled;
use crate::settings::NEIGHBOURS;

/// Why there is no atlas of a point cloud. The text names the offending element and the remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CloudError {
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(UnwrapError),
    /// The number of neighbours is out of its range.
    #[error("neighbours is {value}; it must be from {} to {}", NEIGHBOURS.range[0], NEIGHBOURS.range[1])]
    Neighbours {
        /// What was given.
        value: usize,
    },
    /// There are points, but none with finite coordinates.
    #[error("none of the {points} points has three finite coordinates; repair or replace the positions")]
    NoFinitePoint {
        /// Number of points.
        points: usize,
    },
    /// There are more points than 32-bit indices can number.
    #[error("{points} points are more than {}; map them in parts", super::MOST_POINTS)]
    TooLarge {
        /// Number of points.
        points: usize,
    },
    /// The charts cannot be packed as asked.
    #[error(transparent)]
    Pack(PackError),
    /// The charts of less than a texel alone, each with its margin, need more texels than there are.
    #[error(
        "{specks} stray points with a margin of {margin} texels do not fit a texture of {width} by {height}: choose \
         a smaller margin or a larger texture, or more neighbours so that they join"
    )]
    TooManySpecks {
        /// Number of charts of less than a texel.
        specks: usize,
        /// Margin asked for, in texels.
        margin: f64,
        /// Width of the texture in texels.
        width: u32,
        /// Height of the texture in texels.
        height: u32,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl CloudError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Setting(error) => error.kind(),
            Self::Pack(error) => error.kind(),
            Self::Neighbours { .. }
            | Self::NoFinitePoint { .. }
            | Self::TooLarge { .. }
            | Self::TooManySpecks { .. } => ErrorKind::Argument,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

impl From<PackError> for CloudError {
    fn from(error: PackError) -> Self {
        match error {
            PackError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Pack(other),
        }
    }
}
