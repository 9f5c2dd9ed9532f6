//! What can be embedded, and whether it is fit for it.

use super::error::EmbeddingError;

/// How the distances between points are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointMetric {
    /// In a straight line (equation 5 of the paper).
    Euclidean,
    /// Along the graph of nearest neighbours, by Dijkstra's algorithm (equation 13). The paper takes 12 neighbours.
    Geodesic {
        /// Least number of nearest neighbours that each point is joined to.
        neighbours: usize,
    },
}

/// What is to be embedded.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EmbedInput<'a> {
    /// n points of p coordinates, row by row.
    Points {
        /// Number of points.
        n: usize,
        /// Number of coordinates.
        p: usize,
        /// The n×p coordinates.
        data: &'a [f64],
        /// How the distances between the points are measured.
        metric: PointMetric,
    },
    /// An n×n matrix of distances (equation 13), row by row. An asymmetric matrix is replaced by its mean with its
    /// transpose. The diagonal is ignored. Distances need not satisfy the triangle inequality.
    Distances {
        /// Number of points.
        n: usize,
        /// The n×n distances.
        data: &'a [f64],
    },
    /// An n×n matrix of affinities in [0, 1], row by row. An asymmetric matrix is replaced by its mean with its transpose,
    /// on which alone the likelihood (equation 4) depends. The diagonal is ignored, and so is the kernel width.
    Affinities {
        /// Number of points.
        n: usize,
        /// The n×n affinities.
        data: &'a [f64],
    },
}

impl<'a> EmbedInput<'a> {
    /// Number of points n.
    #[must_use]
    pub fn len(&self) -> usize {
        let (Self::Points { n, .. } | Self::Distances { n, .. } | Self::Affinities { n, .. }) = self;
        *n
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn data(&self) -> &'a [f64] {
        let (Self::Points { data, .. } | Self::Distances { data, .. } | Self::Affinities { data, .. }) = self;
        data
    }

    /// Whether n points of this kind can be embedded in so many dimensions; names the first value that cannot.
    pub(super) fn check(&self, dimensions: usize) -> Result<(), EmbeddingError> {
        if dimensions == 0 {
            return Err(EmbeddingError::InvalidSetting { name: "dimensions", value: 0.0, expected: "at least 1" });
        }
        let n = self.len();
        let expected = match self {
            Self::Points { p, .. } => n.checked_mul(*p),
            Self::Distances { .. } | Self::Affinities { .. } => n.checked_mul(n),
        };
        if expected != Some(self.data().len()) {
            let expected = expected.unwrap_or(usize::MAX);
            return Err(EmbeddingError::WrongLength { expected, found: self.data().len() });
        }
        if n <= dimensions {
            return Err(EmbeddingError::TooFewPoints { points: n, dimensions });
        }
        match *self {
            Self::Points { p: 0, .. } => Err(EmbeddingError::NoExtent),
            Self::Points { p, metric: PointMetric::Geodesic { neighbours: 0 }, .. } if p > 0 => {
                Err(EmbeddingError::InvalidSetting { name: "neighbours", value: 0.0, expected: "at least 1" })
            }
            Self::Points { n, p, data, .. } => {
                check_points(data, n, p)?;
                check_scale("coordinate", data.iter().fold(0.0, |most, v| v.abs().max(most)))
            }
            Self::Distances { n, data } => {
                check_distances(data, n, n)?;
                let off = data.iter().enumerate().filter(|(k, _)| k / n != k % n);
                check_scale("distance", off.fold(0.0, |most, (_, v)| v.max(most)))
            }
            Self::Affinities { n, data } => check_affinities(data, n, n),
        }
    }
}

/// Squares and their sums keep their digits, in single precision, too. All zero is another matter.
fn check_scale(what: &'static str, largest: f64) -> Result<(), EmbeddingError> {
    const SCALES: std::ops::RangeInclusive<f64> = 1e-30..=1e30;
    if largest == 0.0 || SCALES.contains(&largest) { Ok(()) } else { Err(EmbeddingError::OutOfScale { what, largest }) }
}

/// All coordinates are finite, and so small that the sum of the squared distances of `n` points is.
pub(super) fn check_points(data: &[f64], n: usize, p: usize) -> Result<(), EmbeddingError> {
    let largest = (0.1 * f64::MAX / p.max(1) as f64).sqrt() / n.max(1) as f64;
    match data.iter().position(|v| v.is_nan() || v.abs() >= largest) {
        Some(i) => Err(EmbeddingError::NotFinite { point: i / p, component: i % p }),
        None => Ok(()),
    }
}

/// All distances off the diagonal are finite, not negative, and so small that the sum of their squares is finite.
pub(super) fn check_distances(data: &[f64], columns: usize, n: usize) -> Result<(), EmbeddingError> {
    let largest = f64::MAX.sqrt() / n.max(1) as f64;
    let bad = |v: f64| !(v >= 0.0 && v < largest);
    match first_bad(data, columns, n, bad) {
        Some((row, column, value)) => Err(EmbeddingError::DistanceOutOfRange { row, column, value }),
        None => Ok(()),
    }
}

/// All affinities off the diagonal lie in [0, 1].
pub(super) fn check_affinities(data: &[f64], columns: usize, n: usize) -> Result<(), EmbeddingError> {
    match first_bad(data, columns, n, |v| !(0.0..=1.0).contains(&v)) {
        Some((row, column, value)) => Err(EmbeddingError::AffinityOutOfRange { row, column, value }),
        None => Ok(()),
    }
}

/// The first bad entry of a matrix; off the diagonal only if it is square with `n` rows.
fn first_bad(data: &[f64], columns: usize, n: usize, bad: impl Fn(f64) -> bool) -> Option<(usize, usize, f64)> {
    let square = columns == n && data.len() == n * n;
    for (row, values) in data.chunks_exact(columns.max(1)).enumerate() {
        for (column, &value) in values.iter().enumerate() {
            if bad(value) && !(square && row == column) {
                return Some((row, column, value));
            }
        }
    }
    None
}
