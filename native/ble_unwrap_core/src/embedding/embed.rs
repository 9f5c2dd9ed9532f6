//! The method in general: points, distances or affinities in, points of any dimension out.
//!
//! 1. [`EmbedInput`] is checked; points with geodesic distances get their graph ([`PointMetric`](super::PointMetric)).
//! 2. All points, or landmarks in farthest-point order, get affinities (5, 13) with a kernel of width σ.
//! 3. Classical scaling, random numbers or given coordinates are the start; [`fit`] does the rest. Of many points the
//!    scaling is that of landmarks, which the default model fits first.
//! 4. Every other point is placed by logistic regression on the landmarks ([`LandmarkModel`]).
//!
//! [`Model::Isomap`] takes the same distances and stops at classical scaling.

use crate::linalg::leading_mds;
use crate::progress::Progress;

use super::affinity::{Affinity, Kernel, KernelWidth, squared_distances};
use super::bernoulli_logistic::fit;
use super::chart::{mds_start, random_start};
use super::embedded::Embedding;
use super::error::EmbeddingError;
use super::input::EmbedInput;
use super::landmark_regression::{Evidence, LandmarkModel};
use super::placement::{Placement, Placer};
use super::settings::{EmbeddingSettings, Initial, Model};
use super::source::{Reference, Source, farthest_rows};
use super::truncated::{Threshold, Truncated, along_graph, between_points};

/// The arguments of [`embed()`] besides the settings that the embedding of charts has, too.
#[derive(Clone, Debug, PartialEq)]
pub struct EmbedOptions<'a> {
    /// Number of dimensions q of the result: at least 1, and below the number of points.
    pub dimensions: usize,
    /// How the kernel width σ is chosen; with `None`, by [`EmbeddingSettings::kernel_width`].
    pub width: Option<KernelWidth>,
    /// Affinities below this count as 0 (paper, section 3); 0 keeps all.
    pub truncation: f64,
    /// Number of landmarks k, above q. The landmarks are fitted among themselves, and the other points are placed among
    /// them. `None` fits all points together.
    pub landmarks: Option<usize>,
    /// The n×q coordinates to start from, row by row, in the unit of [`Embedding::coordinates`]. They replace
    /// [`EmbeddingSettings::initial`].
    pub start: Option<&'a [f64]>,
    /// Seed of the random start.
    pub seed: u64,
}

impl Default for EmbedOptions<'_> {
    fn default() -> Self {
        Self { dimensions: 2, width: None, truncation: 0.0, landmarks: None, start: None, seed: 0 }
    }
}

/// Landmarks that a truncated fit takes its start, and where need be σ, from.
const START_LANDMARKS: usize = 100;
/// Above so many points the default model starts from landmarks: below, classical scaling of all costs nothing.
const STARTED_BY_LANDMARKS: usize = 400;
/// Relative residual of the eigenpairs that make a start: the fit goes on from there.
const START_TOLERANCE: f64 = 1e-6;
/// Relative residual of the eigenpairs that are the result.
const ISOMAP_TOLERANCE: f64 = 1e-10;

/// Embeds points in q dimensions by the paper's method (sections 3 and 4), by its extension with intercepts, or, for
/// comparison, by Isomap.
///
/// Guaranteed: the result is the same, bit for bit, for any number of threads. From a start by classical scaling, the
/// default model reproduces Euclidean distances of points in at most q dimensions, to the precision of the numbers. With
/// serial updates, the likelihood never falls.
///
/// Not guaranteed: the global maximum of the likelihood, or that every dimension is used. (A dimension in which classical
/// scaling gives only 0 stays 0; the printed model folds sheets over.) With landmarks, the other points do not influence
/// each other. If affinities are truncated as well, what landmarks say about far points is lost.
///
/// Without landmarks, the fit takes O(n²) memory and O(n²q²) time for each sweep: some 6 ms for n = 1,000 and q = 2 on one
/// core. Distances between points add O(n²p). Distances along a graph add n searches, which truncation shortens where σ is
/// absolute or relative. With k landmarks, it takes O(n(p + kq²)) time, and along a graph also k searches and 4kn bytes.
///
/// [`KernelWidth::Relative`] refers to the mean squared distance over all pairs of points. Where there are landmarks, and
/// distances are given or are measured along a graph, it refers to the mean over the pairs of a landmark and a point. This
/// is so, too, along a graph with truncation.
///
/// # Errors
/// [`EmbeddingError::InvalidSetting`]; [`EmbeddingError::TooFewPoints`] and [`EmbeddingError::TooFewPlaces`] unless there
/// are more points and, with landmarks, more distinct places than dimensions; [`EmbeddingError::OutOfScale`] for values
/// that are not between 1e-30 and 1e30 in size; [`EmbeddingError::StartNotFinite`] and [`EmbeddingError::StartAtSaddle`];
/// [`EmbeddingError::WrongLength`]; [`EmbeddingError::NotFinite`], [`EmbeddingError::DistanceOutOfRange`] and
/// [`EmbeddingError::AffinityOutOfRange`], which name the first bad value; [`EmbeddingError::Disconnected`];
/// [`EmbeddingError::TooManyPoints`] if there are too many to be fitted together; [`EmbeddingError::NoExtent`];
/// [`EmbeddingError::Cancelled`].
pub fn embed(
    input: EmbedInput<'_>,
    options: &EmbedOptions<'_>,
    settings: &EmbeddingSettings,
    progress: &Progress,
) -> Result<Embedding, EmbeddingError> {
    let kernel = settings.kernel();
    options.validate(settings, kernel)?;
    input.check(options.dimensions)?;
    check_start(options, input.len())?;
    progress.check()?;
    let task = Task { options, settings, kernel, width: options.width.unwrap_or(settings.width()), progress };
    let source = Source::new(input, progress)?;
    match options.landmarks {
        Some(count) if count < source.len() => task.by_landmarks(&source, count),
        _ => task.all_at_once(&source),
    }
}

impl EmbedOptions<'_> {
    fn validate(&self, settings: &EmbeddingSettings, kernel: Kernel) -> Result<(), EmbeddingError> {
        settings.validate()?;
        if let Some(width) = self.width {
            width.validate(kernel)?;
        }
        kernel.check_truncation(self.truncation)?;
        match self.landmarks {
            Some(count) if count <= self.dimensions => Err(EmbeddingError::InvalidSetting {
                name: "landmarks",
                value: count as f64,
                expected: "above the number of dimensions",
            }),
            _ => Ok(()),
        }
    }
}

fn check_start(options: &EmbedOptions<'_>, n: usize) -> Result<(), EmbeddingError> {
    let Some(start) = options.start else { return Ok(()) };
    let q = options.dimensions;
    if n.checked_mul(q) != Some(start.len()) {
        return Err(EmbeddingError::WrongLength { expected: n.saturating_mul(q), found: start.len() });
    }
    match start.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(EmbeddingError::StartNotFinite { point: i / q, component: i % q }),
        None if start.iter().all(|v| *v == 0.0) => Err(EmbeddingError::StartAtSaddle),
        None => Ok(()),
    }
}

/// One checked call.
struct Task<'a> {
    options: &'a EmbedOptions<'a>,
    settings: &'a EmbeddingSettings,
    kernel: Kernel,
    width: KernelWidth,
    progress: &'a Progress,
}

/// The points that are fitted together.
struct Fitted {
    points: Vec<usize>,
    affinity: Affinity,
    reference: Reference,
    /// Coordinates in units of √σ and intercepts.
    start: (Vec<f64>, Vec<f64>),
}

impl Task<'_> {
    fn all_at_once(&self, source: &Source<'_>) -> Result<Embedding, EmbeddingError> {
        let n = source.len();
        let points: Vec<usize> = (0..n).collect();
        let isomap = self.settings.model == Model::Isomap;
        if !isomap
            && n > START_LANDMARKS
            && self.options.truncation > 0.0
            && let Some(fitted) = self.truncated(source)?
        {
            return self.fit(source, fitted);
        }
        let mut matrix = source.matrix(self.progress)?;
        if isomap {
            self.to_distances(source, &mut matrix);
            return self.isomap(source, points, &matrix, None);
        }
        let affinity = self.affinity(source, &matrix, n)?;
        let start =
            self.start(&points, &affinity, Some(matrix).filter(|_| source.evidence() != Evidence::Affinities))?;
        let reference = source.reference(&points, self.progress)?;
        self.fit(source, Fitted { points, affinity, reference, start })
    }

    fn by_landmarks(&self, source: &Source<'_>, count: usize) -> Result<Embedding, EmbeddingError> {
        let points = source.farthest_order(count, self.progress)?;
        match points.len() {
            0 | 1 => return Err(EmbeddingError::NoExtent),
            places if places <= self.options.dimensions => {
                return Err(EmbeddingError::TooFewPlaces { places, dimensions: self.options.dimensions });
            }
            _ => {}
        }
        let reference = source.reference(&points, self.progress)?;
        let mut among = source.among(&points, &reference)?;
        if self.settings.model == Model::Isomap {
            self.to_distances(source, &mut among);
            return self.isomap(source, points, &among, Some(reference));
        }
        let affinity = if source.evidence() == Evidence::Affinities {
            Affinity::from_matrix(&among, points.len())?.truncated(self.options.truncation)
        } else {
            let width = source.landmark_width(&points, &reference, &among, self.kernel, self.width, self.progress)?;
            self.affinity_of_distances(&among, points.len(), KernelWidth::Absolute(width))?
        };
        let start =
            self.start(&points, &affinity, Some(among).filter(|_| source.evidence() != Evidence::Affinities))?;
        self.fit(source, Fitted { points, affinity, reference, start })
    }

    /// All points at once, measured only within the radius of the truncated kernel; `None` where that cannot be known
    /// beforehand or the distances are there anyway.
    fn truncated(&self, source: &Source<'_>) -> Result<Option<Fitted>, EmbeddingError> {
        if let (Source::Distances { .. } | Source::Affinities { .. }, _) | (_, KernelWidth::MeanAffinity(_)) =
            (source, self.width)
        {
            return Ok(None);
        }
        let landmarks = source.farthest_order(START_LANDMARKS, self.progress)?;
        let seen = source.reference(&landmarks, self.progress)?;
        let among = source.among(&landmarks, &seen)?;
        let sigma = source.landmark_width(&landmarks, &seen, &among, self.kernel, self.width, self.progress)?;
        let threshold = Threshold { kernel: self.kernel, sigma, least: self.options.truncation };
        let (Truncated { affinity, distances }, _) = match source {
            Source::Graph { graph, .. } => along_graph(graph, threshold, self.progress)?,
            Source::Points { n, p, data } => between_points(data, *n, *p, threshold, self.progress)?,
            Source::Distances { .. } | Source::Affinities { .. } => return Ok(None),
        };
        let n = source.len();
        let points: Vec<usize> = (0..n).collect();
        let start = if self.options.start.is_none() && self.settings.initial == Initial::Mds {
            // Classical scaling of the landmarks, and everything else by its distances to them.
            let q = self.options.dimensions;
            let mds = leading_mds(&among, landmarks.len(), q, START_TOLERANCE, self.progress)
                .map_err(EmbeddingError::of_eigenvalues)?;
            let placer = Placer::Scaling { mds, kernel: self.kernel };
            let observe = |i: usize, row: &mut [f64]| source.observe(&seen, i, row);
            let placed = placer.place(n, q, Evidence::SquaredDistances, observe, self.progress)?;
            let unit = sigma.sqrt();
            with_intercepts(placed.0.iter().map(|x| x / unit).collect(), q)
        } else {
            self.start(&points, &affinity, None)?
        };
        let reference = match source.reference(&[], self.progress)? {
            Reference::Graph { p, points, neighbours, .. } => {
                Reference::Graph { p, points, neighbours, to_landmarks: distances, k: n }
            }
            _ => source.reference(&points, self.progress)?,
        };
        Ok(Some(Fitted { points, affinity, reference, start }))
    }

    fn affinity(&self, source: &Source<'_>, matrix: &[f64], n: usize) -> Result<Affinity, EmbeddingError> {
        match source.evidence() {
            Evidence::Affinities => Ok(Affinity::from_matrix(matrix, n)?.truncated(self.options.truncation)),
            Evidence::SquaredDistances => self.affinity_of_distances(matrix, n, self.width),
        }
    }

    fn affinity_of_distances(&self, squared: &[f64], n: usize, width: KernelWidth) -> Result<Affinity, EmbeddingError> {
        let affinity = Affinity::from_squared_distances(squared, n, self.kernel, width, self.progress)?;
        Ok(if self.options.truncation > 0.0 { affinity.truncated(self.options.truncation) } else { affinity })
    }

    /// The start of the points that are fitted together; squared distances are made of the affinities if need be.
    fn start(
        &self,
        points: &[usize],
        affinity: &Affinity,
        squared: Option<Vec<f64>>,
    ) -> Result<(Vec<f64>, Vec<f64>), EmbeddingError> {
        let q = self.options.dimensions;
        if let Some(start) = self.options.start {
            let chosen = points.iter().flat_map(|i| start[i * q..(i + 1) * q].iter().copied()).collect();
            return Ok(with_intercepts(chosen, q));
        }
        match self.settings.initial {
            Initial::Random => Ok((random_start(points.len(), q, self.options.seed), Vec::new())),
            Initial::Mds => {
                let squared = squared.unwrap_or_else(|| squared_distances(affinity, self.kernel));
                if self.settings.model == Model::Default && points.len() > STARTED_BY_LANDMARKS {
                    return self.landmark_start(&squared, points.len(), affinity.sigma());
                }
                let mds = leading_mds(&squared, points.len(), q, START_TOLERANCE, self.progress)
                    .map_err(EmbeddingError::of_eigenvalues)?;
                Ok(mds_start(&mds, affinity.sigma().sqrt(), q))
            }
        }
    }

    /// The landmarks fitted from their classical scaling, and every other point placed among them: nearer to the end
    /// than classical scaling of all, for less than a sweep.
    fn landmark_start(&self, squared: &[f64], n: usize, sigma: f64) -> Result<(Vec<f64>, Vec<f64>), EmbeddingError> {
        let q = self.options.dimensions;
        let landmarks = farthest_rows(squared, n, START_LANDMARKS.max(4 * (q + 1)), self.progress)?;
        let k = landmarks.len();
        let among: Vec<f64> =
            landmarks.iter().flat_map(|i| landmarks.iter().map(move |j| squared[i * n + j])).collect();
        let width = KernelWidth::Absolute(sigma);
        let affinity = Affinity::from_squared_distances(&among, k, self.kernel, width, self.progress)?;
        let mds = leading_mds(&among, k, q, START_TOLERANCE, self.progress).map_err(EmbeddingError::of_eigenvalues)?;
        let (coordinates, intercepts) = mds_start(&mds, sigma.sqrt(), q);
        let options = self.settings.fit_options();
        let fit = fit(&affinity, q, &coordinates, &intercepts, &options, self.progress)?;
        let model = LandmarkModel::new(q, &fit.coordinates, &fit.intercepts, self.kernel, sigma).anchored();
        let observe = |i: usize, row: &mut [f64]| {
            row.iter_mut().zip(&landmarks).for_each(|(square, l)| *square = squared[i * n + l]);
        };
        let placer = Placer::Regression(model);
        Ok(placer.place(n, q, Evidence::SquaredDistances, observe, self.progress)?)
    }

    fn fit(&self, source: &Source<'_>, fitted: Fitted) -> Result<Embedding, EmbeddingError> {
        let q = self.options.dimensions;
        let Fitted { points, affinity, reference, start: (coordinates, intercepts) } = fitted;
        let options = self.settings.fit_options();
        let mean_affinity = affinity.mean();
        let fit = fit(&affinity, q, &coordinates, &intercepts, &options, self.progress)?;
        drop(affinity);
        let model = LandmarkModel::new(q, &fit.coordinates, &fit.intercepts, self.kernel, fit.sigma)
            .truncated(self.options.truncation)
            .anchored();
        let placement =
            Placement { placer: Placer::Regression(model), reference, evidence: source.evidence(), dimensions: q };
        let (coordinates, intercepts) =
            placement.place_rest(source, &points, fit.coordinates, fit.intercepts, self.progress)?;
        Ok(Embedding {
            dimensions: q,
            coordinates,
            intercepts,
            sigma: fit.sigma,
            mean_affinity: Some(mean_affinity),
            log_likelihood: Some(fit.log_likelihood),
            trace: fit.trace,
            bregman: Some(fit.bregman),
            sweeps: fit.sweeps,
            converged: fit.converged,
            landmarks: points,
            placement,
        })
    }

    /// Turns affinities into the squared distances that the kernel with σ = 1 would have made them of.
    fn to_distances(&self, source: &Source<'_>, matrix: &mut [f64]) {
        if source.evidence() == Evidence::Affinities {
            let k = matrix.len().isqrt();
            matrix.iter_mut().for_each(|p| *p = 2.0 * self.kernel.scaled_square(*p));
            (0..k).for_each(|i| matrix[i * k + i] = 0.0);
        }
    }

    /// Classical scaling of the points whose squared distances are given, all others by theirs to these.
    fn isomap(
        &self,
        source: &Source<'_>,
        points: Vec<usize>,
        squared: &[f64],
        reference: Option<Reference>,
    ) -> Result<Embedding, EmbeddingError> {
        let (q, k) = (self.options.dimensions, points.len());
        let mds =
            leading_mds(squared, k, q, ISOMAP_TOLERANCE, self.progress).map_err(EmbeddingError::of_eigenvalues)?;
        if mds.dimensions == 0 {
            return Err(EmbeddingError::NoExtent);
        }
        let (fitted, _) = mds_start(&mds, 1.0, q);
        let reference = reference.map_or_else(|| source.reference(&points, self.progress), Ok)?;
        let placement = Placement {
            placer: Placer::Scaling { mds, kernel: self.kernel },
            reference,
            evidence: source.evidence(),
            dimensions: q,
        };
        let (coordinates, _) = placement.place_rest(source, &points, fitted, Vec::new(), self.progress)?;
        Ok(Embedding {
            dimensions: q,
            coordinates,
            intercepts: Vec::new(),
            sigma: 1.0,
            mean_affinity: None,
            log_likelihood: None,
            trace: Vec::new(),
            bregman: None,
            sweeps: 0,
            converged: true,
            landmarks: points,
            placement,
        })
    }
}

/// Coordinates with the intercepts −|x|²/2 that make log-odds a function of distance.
fn with_intercepts(coordinates: Vec<f64>, q: usize) -> (Vec<f64>, Vec<f64>) {
    let intercepts = coordinates.chunks_exact(q).map(|x| -0.5 * x.iter().map(|c| c * c).sum::<f64>()).collect();
    (coordinates, intercepts)
}
