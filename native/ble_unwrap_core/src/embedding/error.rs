//! What can go wrong in an embedding.

use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::linalg::EigenError;
use crate::memory;
use crate::progress::Cancelled;

/// Why there is no embedding, or why points cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum EmbeddingError {
    /// There are fewer than three landmarks, which do not span a plane.
    #[error("{found} landmarks do not span a plane; at least 3 are needed")]
    TooFewLandmarks {
        /// How many there are.
        found: usize,
    },
    /// No path leads from a landmark to a vertex: the chart is not connected, or the distance is no number.
    #[error("the distance from landmark {landmark} to vertex {vertex} is {value}: the chart is not connected")]
    Unreachable {
        /// The landmark.
        landmark: usize,
        /// The vertex.
        vertex: usize,
        /// The distance found.
        value: f64,
    },
    /// All distances are zero, or too small to be squared.
    #[error("all points lie at distance zero of each other")]
    NoExtent,
    /// The landmarks lie on a line, as far as their distances tell.
    #[error("the landmarks lie on a line: the second principal axis is {ratio:.1e} of the first")]
    Collinear {
        /// Extent along the second axis over that along the first.
        ratio: f64,
    },
    /// A parameter is out of range.
    #[error("{name} is {value}, but must be {expected}")]
    InvalidSetting {
        /// Name of the parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        expected: &'static str,
    },
    /// An array has the wrong number of values.
    #[error("expected {expected} values, found {found}")]
    WrongLength {
        /// Number needed.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// A coordinate is not finite, or its square is not.
    #[error("component {component} of point {point} is not finite or too large to square")]
    NotFinite {
        /// Number of the point.
        point: usize,
        /// Number of the coordinate of that point, from 0. For an intercept it is the number of coordinates.
        component: usize,
    },
    /// A distance is negative, not finite, or too large to be squared.
    #[error(
        "the distance from point {row} to point {column} is {value}; it must be finite and not negative{}",
        hint(*.value)
    )]
    DistanceOutOfRange {
        /// First point.
        row: usize,
        /// Second point.
        column: usize,
        /// The distance.
        value: f64,
    },
    /// An affinity lies outside [0, 1] or is not a number.
    #[error("the affinity of points {row} and {column} is {value}; it must lie between 0 and 1")]
    AffinityOutOfRange {
        /// First point.
        row: usize,
        /// Second point.
        column: usize,
        /// The affinity.
        value: f64,
    },
    /// Coordinates or distances are so large or so small that rounding destroys their squares, or nearly.
    #[error("the largest {what} is {largest:.1e}; scale the data so that it lies between 1e-30 and 1e30")]
    OutOfScale {
        /// What was measured.
        what: &'static str,
        /// Its largest size.
        largest: f64,
    },
    /// The points lie in too few distinct places. Points that coincide count as one landmark.
    #[error("the points lie in {places} distinct places only, which do not span {dimensions} dimensions")]
    TooFewPlaces {
        /// Number of places.
        places: usize,
        /// Number of dimensions asked for.
        dimensions: usize,
    },
    /// A coordinate of the start is not finite.
    #[error("component {component} of point {point} of the start is not finite")]
    StartNotFinite {
        /// Number of the point.
        point: usize,
        /// Number of the component.
        component: usize,
    },
    /// All coordinates of the start are 0, which no sweep changes.
    #[error("the start is 0 for all points, a saddle that no sweep leaves; start from classical scaling or at random")]
    StartAtSaddle,
    /// There are not more points than dimensions.
    #[error("{points} points do not span {dimensions} dimensions")]
    TooFewPoints {
        /// Number of points.
        points: usize,
        /// Number of dimensions asked for.
        dimensions: usize,
    },
    /// The graph of nearest neighbours is in several pieces, between which there is no distance.
    #[error(
        "the graph of {neighbours} nearest neighbours falls into {pieces} pieces, the largest of {largest} of the \
         {points} points; {}, or embed each piece by itself",
        raise(*.enough)
    )]
    Disconnected {
        /// Number of neighbours that points are joined to.
        neighbours: usize,
        /// Number of connected pieces.
        pieces: usize,
        /// Number of points.
        points: usize,
        /// Number of points in the largest piece.
        largest: usize,
        /// The least number of neighbours that connects the points, if one was found.
        enough: Option<usize>,
    },
    /// The matrix of all pairs does not fit in memory.
    #[error(
        "the {points} x {points} matrix of all pairs takes {} and does not fit in memory; embed by landmarks (100 or so)",
        memory::text((*points as u64).saturating_pow(2).saturating_mul(8))
    )]
    TooManyPoints {
        /// Number of points.
        points: usize,
    },
    /// A row of new points does not have as many values as the fitted points require.
    #[error("expected {expected} {what}, found {found}")]
    WrongColumns {
        /// Number needed.
        expected: usize,
        /// What the values are.
        what: &'static str,
        /// Number given.
        found: usize,
    },
    /// The eigenvalues of the double-centred distances could not be computed.
    #[error("the eigenvalues of the double-centred distances could not be computed")]
    NoEigenvalues,
    /// The caller asked to stop, or memory ran out.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl EmbeddingError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::TooFewLandmarks { .. }
            | Self::Unreachable { .. }
            | Self::NoExtent
            | Self::Collinear { .. }
            | Self::InvalidSetting { .. }
            | Self::WrongLength { .. }
            | Self::NotFinite { .. }
            | Self::DistanceOutOfRange { .. }
            | Self::AffinityOutOfRange { .. }
            | Self::TooFewPoints { .. }
            | Self::OutOfScale { .. }
            | Self::TooFewPlaces { .. }
            | Self::StartNotFinite { .. }
            | Self::StartAtSaddle
            | Self::Disconnected { .. }
            | Self::TooManyPoints { .. }
            | Self::WrongColumns { .. } => ErrorKind::Argument,
            Self::NoEigenvalues => ErrorKind::Internal,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

impl EmbeddingError {
    /// Why eigenvalues are missing.
    pub(super) fn of_eigenvalues(error: EigenError) -> Self {
        match error {
            EigenError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            EigenError::NotFinite { .. } | EigenError::NoConvergence => Self::NoEigenvalues,
        }
    }
}

/// What to do about an infinite distance.
fn hint(distance: f64) -> &'static str {
    if distance == f64::INFINITY { "; pieces with no path between them are embedded each by itself" } else { "" }
}

/// How many neighbours to ask for.
fn raise(enough: Option<usize>) -> String {
    enough.map_or_else(|| "raise neighbours".into(), |k| format!("raise neighbours to {k}"))
}
