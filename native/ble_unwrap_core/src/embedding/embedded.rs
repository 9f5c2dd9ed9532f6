//! The result of an embedding, among which further points can be placed.

use crate::progress::Progress;

use super::error::EmbeddingError;
use super::input::{check_affinities, check_distances, check_points};
use super::placement::Placement;
use super::source::Reference;

/// Points in few dimensions, how they were found, and what places further points among them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Embedding {
    /// Number of dimensions q.
    pub dimensions: usize,
    /// The n×q coordinates, row by row. Times √σ they are in units of distance (Isomap, with σ = 1, and the default model;
    /// the printed model has no scale). Rotation, reflection and, but for the printed model, place are arbitrary.
    pub coordinates: Vec<f64>,
    /// The n intercepts of the default model; empty for the others.
    pub intercepts: Vec<f64>,
    /// The kernel width σ, in units of squared distance; 1 for affinities and for Isomap.
    pub sigma: f64,
    /// Mean affinity over all pairs that were fitted together; `None` for Isomap.
    pub mean_affinity: Option<f64>,
    /// Log-likelihood (4) of the points that were fitted together; `None` for Isomap.
    pub log_likelihood: Option<f64>,
    /// The log-likelihood at the start and after each sweep that was kept; empty for Isomap.
    pub trace: Vec<f64>,
    /// Bregman distance (12) of the affinities from the model; `None` for Isomap.
    pub bregman: Option<f64>,
    /// Sweeps made; 0 for Isomap.
    pub sweeps: usize,
    /// Whether the likelihood settled before the sweeps ran out; true for Isomap.
    pub converged: bool,
    /// The points that were fitted together, in farthest-point order; all in their own order without landmarks.
    pub landmarks: Vec<usize>,
    pub(super) placement: Placement,
}

impl Embedding {
    /// What one row of new data must hold: p coordinates for points, else k distances or affinities to the
    /// [`landmarks`](Embedding::landmarks), in their order.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.placement.reference.columns()
    }

    /// Places `m` new points: m×q coordinates, row by row, in the frame of the embedding.
    ///
    /// `data` holds m rows of `columns` values of the kind that was embedded: points, or distances or affinities to the
    /// k fitted points. Each new point is placed by itself, as points that are no landmarks are: the maximum of its
    /// likelihood given the fitted points (for Isomap landmark scaling). A geodesic distance leads over the fitted points
    /// nearest to it, as many as the graph has neighbours. A fitted point, at distance 0 from itself, comes out
    /// where it is; by affinities, which do not tell that, nearly so.
    /// Deterministic for any number of threads. O(kq²) a point, and to find the nearest O(np) along a graph.
    ///
    /// # Errors
    /// [`EmbeddingError::WrongColumns`]; [`EmbeddingError::WrongLength`] unless there are m·columns values; the first bad
    /// value as [`embed()`](super::embed()) names it, rows being new points; cancelled.
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
