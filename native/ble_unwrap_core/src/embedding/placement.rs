//! Further points among those that were fitted together.

use rayon::prelude::*;

use crate::Progress;
use crate::linalg::Mds;
use crate::progress::Cancelled;

use super::affinity::Kernel;
use super::embed::Embedding;
use super::error::EmbeddingError;
use super::input::{check_affinities, check_distances, check_points};
use super::landmark_regression::{Evidence, LandmarkModel};
use super::source::{Reference, Source};

/// How a point is placed by what is known of it and the landmarks.
#[derive(Clone, Debug)]
pub(super) enum Placer {
    /// Logistic regression.
    Regression(LandmarkModel),
    /// Landmark scaling (de Silva and Tenenbaum 2004), of affinities through the kernel's inverse.
    Scaling { mds: Mds, kernel: Kernel },
}

impl Placer {
    /// Coordinates and intercepts (none but from a regression with them) of `count` points.
    pub(super) fn place(
        &self,
        count: usize,
        dimensions: usize,
        evidence: Evidence,
        observe: impl Fn(usize, &mut [f64]) + Sync,
        progress: &Progress,
    ) -> Result<(Vec<f64>, Vec<f64>), Cancelled> {
        match self {
            Self::Regression(model) => {
                let placed = model.place_points(count, evidence, observe, progress)?;
                let split = placed.chunks_exact(dimensions + 1).map(|theta| theta.split_at(dimensions));
                Ok((split.clone().flat_map(|s| s.0.to_vec()).collect(), split.map(|s| s.1[0]).collect()))
            }
            Self::Scaling { mds, kernel } => {
                let mut placed = vec![0.0; count * dimensions];
                placed.par_chunks_exact_mut(dimensions).enumerate().try_for_each_init(
                    || vec![0.0; mds.len()],
                    |row, (i, place)| {
                        progress.check()?;
                        observe(i, row);
                        if evidence == Evidence::Affinities {
                            row.iter_mut().for_each(|p| *p = 2.0 * kernel.scaled_square(*p));
                        }
                        mds.place(row, place);
                        Ok(())
                    },
                )?;
                Ok((placed, Vec::new()))
            }
        }
    }
}

/// The landmarks of an embedding, and what relates points to them.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    pub(super) placer: Placer,
    pub(super) reference: Reference,
    pub(super) evidence: Evidence,
    pub(super) dimensions: usize,
}

impl Placement {
    /// Coordinates and intercepts of all points: those of the `fitted` ones, and the rest placed.
    pub(super) fn place_rest(
        &self,
        source: &Source<'_>,
        fitted: &[usize],
        coordinates: Vec<f64>,
        intercepts: Vec<f64>,
        progress: &Progress,
    ) -> Result<(Vec<f64>, Vec<f64>), EmbeddingError> {
        let (n, q) = (source.len(), self.dimensions);
        if fitted.len() == n {
            return Ok((coordinates, intercepts));
        }
        let observe = |i: usize, row: &mut [f64]| source.observe(&self.reference, i, row);
        let (mut all, mut all_intercepts) = self.placer.place(n, q, self.evidence, observe, progress)?;
        for (l, &i) in fitted.iter().enumerate() {
            all[i * q..(i + 1) * q].copy_from_slice(&coordinates[l * q..(l + 1) * q]);
            if let Some(a) = intercepts.get(l) {
                all_intercepts[i] = *a;
            }
        }
        if intercepts.is_empty() {
            all_intercepts.clear();
        }
        Ok((all, all_intercepts))
    }
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
    /// nearest to it, as many as the graph has neighbours. A fitted point comes out where it is but for two
    /// things: the fit may have stopped short of the maximum, and here the point also has itself as a landmark.
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
