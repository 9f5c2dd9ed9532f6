//! Further points among those that were fitted together.

use rayon::prelude::*;

use crate::linalg::Mds;
use crate::progress::Cancelled;
use crate::progress::Progress;

use super::affinity::{Kernel, KernelWidth};
use super::error::EmbeddingError;
use super::input::{check_affinities, check_distances, check_points};
use super::landmark_regression::{Evidence, LandmarkModel};
use super::settings::Model;
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

/// The landmarks of an embedding as plain arrays. They can be kept after the [`Embedding`](super::Embedding) that they come
/// from is gone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedLandmarks<'a> {
    /// The model.
    pub model: Model,
    /// Number of dimensions q ≥ 1.
    pub dimensions: usize,
    /// The k×q coordinates, row by row, in the unit of [`Embedding::coordinates`](super::Embedding::coordinates).
    pub coordinates: &'a [f64],
    /// The k intercepts of the default model; empty for the others.
    pub intercepts: &'a [f64],
    /// For Isomap, the mean of the squared distances from all landmarks, itself included, to each of the k landmarks; empty
    /// for the other models.
    pub mean_squared: &'a [f64],
    /// The kernel width σ, in units of squared distance; 1 for affinities. Isomap does not use it.
    pub sigma: f64,
    /// Affinities below this count as 0; 0 keeps all.
    pub truncation: f64,
}

impl FittedLandmarks<'_> {
    fn placer(&self) -> Result<Placer, EmbeddingError> {
        let kernel = self.model.kernel();
        if self.dimensions == 0 {
            return Err(EmbeddingError::InvalidSetting { name: "dimensions", value: 0.0, expected: "at least 1" });
        }
        let (q, k) = (self.dimensions, self.coordinates.len() / self.dimensions);
        if k == 0 {
            return Err(EmbeddingError::TooFewPoints { points: 0, dimensions: q });
        }
        KernelWidth::Absolute(self.sigma).validate(kernel)?;
        kernel.check_truncation(self.truncation)?;
        let only_for = |model| if self.model == model { k } else { 0 };
        let lengths = [
            (self.coordinates, k * q),
            (self.intercepts, only_for(Model::Default)),
            (self.mean_squared, only_for(Model::Isomap)),
        ];
        if let Some((values, expected)) = lengths.into_iter().find(|(values, expected)| values.len() != *expected) {
            return Err(EmbeddingError::WrongLength { expected, found: values.len() });
        }
        check_points(self.coordinates, k, q)?;
        for values in [self.intercepts, self.mean_squared] {
            if let Some(point) = values.iter().position(|v| !v.is_finite()) {
                return Err(EmbeddingError::NotFinite { point, component: q });
            }
        }
        Ok(match self.model {
            Model::Isomap => {
                let mds = Mds::from_parts(self.coordinates.to_vec(), q, self.mean_squared.to_vec());
                Placer::Scaling { mds, kernel }
            }
            Model::Default | Model::Paper => {
                let model = LandmarkModel::new(q, self.coordinates, self.intercepts, kernel, self.sigma);
                Placer::Regression(model.truncated(self.truncation).anchored())
            }
        })
    }
}

/// Places `m` points by what is `known` of them: m rows, each with the point's distances (not squared) or affinities to the
/// k landmarks. The result is m×q coordinates, row by row, as from [`Embedding::transform`](super::Embedding::transform),
/// which keeps the landmarks of the fit itself.
///
/// The result is the same for any number of threads. O(kq²) for each point.
///
/// # Errors
/// [`EmbeddingError::WrongLength`] unless there are m·k values, and k intercepts or mean squared distances where the model
/// has them; [`EmbeddingError::InvalidSetting`]; [`EmbeddingError::TooFewPoints`] without landmarks;
/// [`EmbeddingError::NotFinite`], which names the landmark; [`EmbeddingError::DistanceOutOfRange`] and
/// [`EmbeddingError::AffinityOutOfRange`], which name the first bad value; [`EmbeddingError::Cancelled`].
pub fn place(
    known: &[f64],
    m: usize,
    evidence: Evidence,
    landmarks: &FittedLandmarks<'_>,
    progress: &Progress,
) -> Result<Vec<f64>, EmbeddingError> {
    let placer = landmarks.placer()?;
    let k = landmarks.coordinates.len() / landmarks.dimensions;
    if m.checked_mul(k) != Some(known.len()) {
        return Err(EmbeddingError::WrongLength { expected: m.saturating_mul(k), found: known.len() });
    }
    match evidence {
        Evidence::SquaredDistances => check_distances(known, k, 0)?,
        Evidence::Affinities => check_affinities(known, k, 0)?,
    }
    let observe = |i: usize, row: &mut [f64]| {
        for (value, &given) in row.iter_mut().zip(&known[i * k..(i + 1) * k]) {
            *value = if evidence == Evidence::SquaredDistances { given * given } else { given };
        }
    };
    Ok(placer.place(m, landmarks.dimensions, evidence, observe, progress)?.0)
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
