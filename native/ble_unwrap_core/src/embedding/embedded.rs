//! The result of an embedding, among which further points can be placed.

use crate::progress::Progress;

use super::error::EmbeddingError;
use super::input::{check_affinities, check_distances, check_points};
use super::placement::Placement;
use super::source::Reference;

/// Points in few dimensions, how they were found, and what is needed to place further points among them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Embedding {
    /// Number of dimensions q.
    pub dimensions: usize,
    /// The n×q coordinates, row by row. Multiplied by √σ they are in the unit of the distances; for Isomap σ is 1, and the
    /// printed model has no scale. Rotation and reflection are arbitrary, and except for the printed model so is
    /// translation.
    pub coordinates: Vec<f64>,
    /// The n intercepts of the default model; empty for the others.
    pub intercepts: Vec<f64>,
    /// The kernel width σ, in units of squared distance; 1 for affinities and for Isomap.
    pub sigma: f64,
    /// Mean affinity over all pairs that were fitted together; `None` for Isomap.
    pub mean_affinity: Option<f64>,
    /// Log-likelihood (equation 4) of the points that were fitted together; `None` for Isomap.
    pub log_likelihood: Option<f64>,
    /// The log-likelihood at the start and after each sweep that was kept; empty for Isomap.
    pub trace: Vec<f64>,
    /// Bregman distance (equation 12) between the affinities and the model; `None` for Isomap.
    pub bregman: Option<f64>,
    /// Number of sweeps; 0 for Isomap.
    pub sweeps: usize,
    /// Whether the likelihood converged before the greatest number of sweeps was reached; true for Isomap.
    pub converged: bool,
    /// The points that were fitted together: the landmarks in farthest-point order or, without landmarks, all points in the
    /// order of the input.
    pub landmarks: Vec<usize>,
    pub(super) placement: Placement,
}

impl Embedding {
    /// Number of values in a row of new data: p coordinates for points, else k distances or affinities to the
    /// [`landmarks`](Embedding::landmarks), in their order.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.placement.reference.columns()
    }

    /// Places `m` new points: m×q coordinates, row by row, in the coordinate system of the embedding.
    ///
    /// `data` holds m rows of [`columns`](Embedding::columns) values of the kind that was embedded: coordinates of points,
    /// or distances or affinities to the k fitted points. Each new point is placed by itself, like the points that are not
    /// landmarks: where its likelihood given the fitted points is greatest or, for Isomap, by landmark scaling. With
    /// geodesic distances, paths from a new point lead over the nearest of the embedded points, as many as the graph has
    /// neighbours. A fitted point, whose distance to itself is 0, is placed where it is already; by affinities, which do
    /// not say whether two points coincide, it is placed only near there.
    ///
    /// The result is the same for any number of threads. O(kq²) for each point; along a graph, also O(np) to find its
    /// neighbours.
    ///
    /// # Errors
    /// [`EmbeddingError::WrongColumns`]; [`EmbeddingError::WrongLength`] unless there are m·columns values; the first bad
    /// value, by the errors of [`embed()`](super::embed()), where rows are numbers of new points;
    /// [`EmbeddingError::Cancelled`].
    pub fn transform(
        &self,
        data: &[f64],
        m: usize,
        columns: usize,
        progress: &Progress,
    ) -> Result<Vec<f64>, EmbeddingError> {
        let reference = &self.placement.reference;
        let expected = reference.columns();
        if columns != expected {
            let what = match reference {
                Reference::Points { .. } | Reference::Graph { .. } => "coordinates a point",
                Reference::Distances { .. } => "distances a point, to the points that were fitted",
                Reference::Affinities { .. } => "affinities a point, to the points that were fitted",
            };
            return Err(EmbeddingError::WrongColumns { expected, what, found: columns });
        }
        if m.checked_mul(columns) != Some(data.len()) {
            return Err(EmbeddingError::WrongLength { expected: m.saturating_mul(columns), found: data.len() });
        }
        // New rows are no square matrix: nothing is exempt as a diagonal.
        match reference {
            Reference::Points { .. } | Reference::Graph { .. } => check_points(data, m, columns)?,
            Reference::Distances { .. } => check_distances(data, columns, 0)?,
            Reference::Affinities { .. } => check_affinities(data, columns, 0)?,
        }
        let contacts = reference.contacts(data, progress)?;
        let observe = |i: usize, row: &mut [f64]| reference.observe_new(data, &contacts, i, row);
        Ok(self.placement.placer.place(m, self.dimensions, self.placement.evidence, observe, progress)?.0)
    }
}
