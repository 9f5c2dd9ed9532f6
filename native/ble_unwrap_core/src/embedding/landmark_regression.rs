//! Every point that is no landmark, by logistic regression on the landmarks.
//!
//! With the landmarks fixed the likelihood (4) falls apart: each other point is a concave logistic regression of
//! its own in (x, a), or x for the printed model, with k observations. k = 100 landmarks lose
//! nothing measurable on a chart against embedding every vertex.
//!
//! Newton's method, damped by halving, from Berkson's least squares, which also hold a point that is far from all
//! landmarks ([`LandmarkModel::anchored`]). The plane has sums written out
//! ([`PlanarLandmarks`]); every other dimension has plain ones ([`GeneralLandmarks`]), which the plane tests.

use rayon::prelude::*;

use crate::geodesics::LandmarkDistances;
use crate::mesh::VertexId;
use crate::progress::Cancelled;
use crate::progress::Progress;

use super::affinity::{Kernel, log_odds};
use super::blocks::{planar_solve, solve};
use super::logistic::{Exact, PlanarPoints, RowSums, logistic_pair, pair_log_likelihood, planar_row};

/// Most evaluations a point; three or four are usual. A point that uses them all keeps its best place.
const MOST_EVALUATIONS: usize = 24;
/// The same of an anchored point, whose least squares may be far off: where distances are of many dimensions and the
/// kernel is narrow, steps are halved often.
const MOST_EVALUATIONS_ANCHORED: usize = 100;
/// A Newton step shorter than this is the last: the next would be of its square, 1e-10 in units of √σ.
const LAST_STEP: f64 = 1e-5;
/// Weight of an anchored point's place by least squares against its likelihood. A pair of affinity ½ weighs ¼: this
/// decides only where all affinities are of this order or below, and the likelihood says no more than "far away".
const PRIOR: f64 = 1e-6;
/// Least relative weight of a pair in an anchored point's least squares: far away it is placed by more than the
/// landmark next to it.
const LEAST_RELATIVE_WEIGHT: f64 = 1e-3;
/// Points a task: a distance row is read a cache line or more at a time.
const CHUNK: usize = 64;

/// What is known of a new point and each landmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Evidence {
    /// Their distance. It is squared internally: [`place`](super::place()) takes distances that are not squared.
    SquaredDistances,
    /// Their affinity.
    Affinities,
}

/// Landmarks with their fitted parameters, ready to place further points.
#[derive(Clone, Debug)]
pub(super) struct LandmarkModel {
    landmarks: Landmarks,
    dimensions: usize,
    kernel: Kernel,
    sigma: f64,
    truncation: f64,
    anchored: bool,
}

#[derive(Clone, Debug)]
enum Landmarks {
    Planar(PlanarLandmarks),
    General(GeneralLandmarks),
}

/// Landmarks in the plane.
#[derive(Clone, Debug)]
struct PlanarLandmarks {
    x: Vec<f64>,
    y: Vec<f64>,
    a: Vec<f64>,
    intercepts: bool,
}

/// Landmarks in any dimension.
#[derive(Clone, Debug)]
struct GeneralLandmarks {
    dimensions: usize,
    coordinates: Vec<f64>,
    /// Zeros for the printed model.
    a: Vec<f64>,
    intercepts: bool,
}

/// Sums over the landmarks in any dimension: log-likelihood, gradient, lower triangle of the curvature.
#[derive(Clone, Debug, Default)]
struct GeneralSums {
    log_likelihood: f64,
    gradient: Vec<f64>,
    curvature: Vec<f64>,
}

/// The regression of one point. Parameters are (x, a), a = 0 and its step 0 for the printed model.
trait Regression {
    type Sums: Clone + Default;

    /// Log-likelihood, gradient and curvature at `theta` for affinities `p`.
    fn sums(&self, p: &[f64], theta: &[f64], sums: &mut Self::Sums);

    /// Gradient and curvature of Berkson's least squares: log-odds `target(j)` with the weights of some landmarks.
    fn linear_sums(
        &self,
        weights: impl Iterator<Item = (usize, f64)>,
        target: impl Fn(usize) -> f64,
        sums: &mut Self::Sums,
    );

    /// Adds a normal prior of precision `weight` about theta − `aside` to the sums at theta.
    fn hold(&self, weight: f64, aside: impl Fn(usize) -> f64, sums: &mut Self::Sums);

    fn log_likelihood(sums: &Self::Sums) -> f64;

    /// Newton's step; the curvature may be overwritten.
    fn solve(&self, sums: &mut Self::Sums, step: &mut [f64]);
}

impl Regression for PlanarLandmarks {
    type Sums = RowSums;

    fn sums(&self, p: &[f64], theta: &[f64], sums: &mut RowSums) {
        *sums = planar_row::<Exact>(p, self.points(), [theta[0], theta[1], theta[2]]);
    }

    fn linear_sums(
        &self,
        weights: impl Iterator<Item = (usize, f64)>,
        target: impl Fn(usize) -> f64,
        sums: &mut RowSums,
    ) {
        *sums = RowSums::default();
        for (j, w) in weights {
            let (x, y, r) = (self.x[j], self.y[j], w * (target(j) - self.a[j]));
            for (sum, v) in sums.gradient.iter_mut().zip([r * x, r * y, r]) {
                *sum += v;
            }
            for (sum, v) in sums.curvature.iter_mut().zip([w * x * x, w * x * y, w * y * y, w * x, w * y, w]) {
                *sum += v;
            }
        }
    }

    fn hold(&self, weight: f64, aside: impl Fn(usize) -> f64, sums: &mut RowSums) {
        // Entries xx, yy and 1 of the curvature.
        for (c, diagonal) in [0, 2, 5].into_iter().enumerate() {
            let aside = aside(c);
            sums.log_likelihood -= 0.5 * weight * aside * aside;
            sums.gradient[c] -= weight * aside;
            sums.curvature[diagonal] += weight;
        }
    }

    fn log_likelihood(sums: &RowSums) -> f64 {
        sums.log_likelihood
    }

    fn solve(&self, sums: &mut RowSums, step: &mut [f64]) {
        step.copy_from_slice(&planar_solve(sums, self.intercepts));
    }
}

impl PlanarLandmarks {
    fn points(&self) -> PlanarPoints<'_> {
        PlanarPoints { x: &self.x, y: &self.y, a: &self.a }
    }
}

impl GeneralLandmarks {
    fn point(&self, j: usize) -> &[f64] {
        &self.coordinates[j * self.dimensions..(j + 1) * self.dimensions]
    }

    fn add(&self, j: usize, residual: f64, weight: f64, sums: &mut GeneralSums) {
        let q = self.dimensions;
        let m = q + usize::from(self.intercepts);
        let z = |r: usize, point: &[f64]| if r < q { point[r] } else { 1.0 };
        let point = self.point(j);
        for r in 0..m {
            let zr = z(r, point);
            sums.gradient[r] += residual * zr;
            for c in 0..=r {
                sums.curvature[r * m + c] += weight * zr * z(c, point);
            }
        }
    }

    fn clear(&self, sums: &mut GeneralSums) {
        let m = self.dimensions + usize::from(self.intercepts);
        sums.log_likelihood = 0.0;
        sums.gradient.clear();
        sums.gradient.resize(m, 0.0);
        sums.curvature.clear();
        sums.curvature.resize(m * m, 0.0);
    }
}

impl Regression for GeneralLandmarks {
    type Sums = GeneralSums;

    fn sums(&self, p: &[f64], theta: &[f64], sums: &mut GeneralSums) {
        self.clear(sums);
        for (j, &p) in p.iter().enumerate() {
            let product: f64 = self.point(j).iter().zip(theta).map(|(a, b)| a * b).sum();
            let t = product + (theta[self.dimensions] + self.a[j]);
            let (large, small) = logistic_pair(t.abs());
            self.add(j, p - if t < 0.0 { small } else { large }, large * small, sums);
            sums.log_likelihood += pair_log_likelihood(p, t);
        }
    }

    fn linear_sums(
        &self,
        weights: impl Iterator<Item = (usize, f64)>,
        target: impl Fn(usize) -> f64,
        sums: &mut GeneralSums,
    ) {
        self.clear(sums);
        for (j, w) in weights {
            self.add(j, w * (target(j) - self.a[j]), w, sums);
        }
    }

    fn hold(&self, weight: f64, aside: impl Fn(usize) -> f64, sums: &mut GeneralSums) {
        let m = sums.gradient.len();
        for c in 0..m {
            let aside = aside(c);
            sums.log_likelihood -= 0.5 * weight * aside * aside;
            sums.gradient[c] -= weight * aside;
            sums.curvature[c * m + c] += weight;
        }
    }

    fn log_likelihood(sums: &GeneralSums) -> f64 {
        sums.log_likelihood
    }

    fn solve(&self, sums: &mut GeneralSums, step: &mut [f64]) {
        step.fill(0.0);
        let m = sums.gradient.len();
        solve(&mut sums.curvature, m, &sums.gradient, &mut step[..m]);
    }
}

/// Lighter observations say nothing in double precision, and their log-odds may be infinite.
const LEAST_WEIGHT: f64 = 1e-300;

/// The landmarks that say something of a point, with their weights p(1−p).
fn weights(p: &[f64]) -> impl Iterator<Item = (usize, f64)> + '_ {
    p.iter().map(|p| p * (1.0 - p)).enumerate().filter(|(_, w)| *w > LEAST_WEIGHT)
}

/// Writes p(1−p) relative to the largest, from log-odds and so however small p is, to `weights`; 0 where the
/// log-odds are infinite.
fn relative_weights(odds: &[f64], weights: &mut Vec<f64>) {
    weights.clear();
    weights.extend(odds.iter().map(|t| -t.abs() - 2.0 * (-t.abs()).exp().ln_1p()));
    let largest = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let relative = |w: f64| if w.is_finite() { (w - largest).exp().max(LEAST_RELATIVE_WEIGHT) } else { 0.0 };
    weights.iter_mut().for_each(|w| *w = relative(*w));
}

/// Working memory of one thread.
#[derive(Default)]
struct Scratch {
    observed: Vec<f64>,
    affinities: Vec<f64>,
    odds: Vec<f64>,
    weights: Vec<f64>,
    steps: Steps,
    planar: [RowSums; 2],
    general: [GeneralSums; 2],
}

/// Parameters of one climb.
#[derive(Default)]
struct Steps {
    start: Vec<f64>,
    step: Vec<f64>,
    next: Vec<f64>,
}

/// Climbs to the maximum of the likelihood, with a prior about the start if `prior` > 0, from the least squares on
/// log-odds (Berkson 1944) that `sums` holds: they are linear in the parameters and already the answer where model and
/// data agree exactly, as on a flat patch.
fn climb<R: Regression>(
    regression: &R,
    p: &[f64],
    prior: f64,
    [sums, there]: &mut [R::Sums; 2],
    Steps { start, step, next }: &mut Steps,
    theta: &mut [f64],
) {
    regression.solve(sums, theta);
    start.clear();
    start.extend_from_slice(theta);
    let evaluate = |theta: &[f64], sums: &mut R::Sums| {
        regression.sums(p, theta, sums);
        if prior > 0.0 {
            regression.hold(prior, |c| theta[c] - start[c], sums);
        }
    };
    evaluate(theta, sums);
    step.resize(theta.len(), 0.0);
    next.resize(theta.len(), 0.0);
    let mut best = R::log_likelihood(sums);
    regression.solve(sums, step);
    for _ in 0..if prior > 0.0 { MOST_EVALUATIONS_ANCHORED } else { MOST_EVALUATIONS } {
        for (next, (theta, step)) in next.iter_mut().zip(theta.iter().zip(step.iter())) {
            *next = theta + step;
        }
        if step.iter().all(|s| s.abs() < LAST_STEP) {
            theta.copy_from_slice(next);
            return;
        }
        evaluate(next, there);
        // Rounding may eat the gain of a step that is already tiny; halving it ends at LAST_STEP.
        if R::log_likelihood(there) > best {
            best = R::log_likelihood(there);
            theta.copy_from_slice(next);
            regression.solve(there, step);
        } else {
            step.iter_mut().for_each(|s| *s *= 0.5);
        }
    }
}

/// A climb without prior from least squares by the log-odds `target(j)`.
fn free<R: Regression>(
    regression: &R,
    p: &[f64],
    target: impl Fn(usize) -> f64,
    sums: &mut [R::Sums; 2],
    steps: &mut Steps,
    theta: &mut [f64],
) {
    regression.linear_sums(weights(p), target, &mut sums[0]);
    climb(regression, p, 0.0, sums, steps, theta);
}

/// A climb with prior from least squares by log-odds with relative weights.
fn held<R: Regression>(
    regression: &R,
    p: &[f64],
    odds: &[f64],
    relative: &[f64],
    sums: &mut [R::Sums; 2],
    steps: &mut Steps,
    theta: &mut [f64],
) {
    let weights = relative.iter().copied().enumerate().filter(|(_, w)| *w > 0.0);
    regression.linear_sums(weights, |j| odds[j], &mut sums[0]);
    climb(regression, p, PRIOR, sums, steps, theta);
}

impl Landmarks {
    /// Writes the parameters (x, a) of landmark `j`.
    fn parameters(&self, j: usize, theta: &mut [f64]) {
        match self {
            Self::Planar(l) => theta.copy_from_slice(&[l.x[j], l.y[j], l.a[j]]),
            Self::General(l) => {
                theta[..l.dimensions].copy_from_slice(l.point(j));
                theta[l.dimensions] = l.a[j];
            }
        }
    }
}

impl LandmarkModel {
    /// From k×q coordinates and k intercepts (none for the printed model), as a fit gives them, with the kernel
    /// and width of its affinities.
    #[must_use]
    pub(super) fn new(dimensions: usize, coordinates: &[f64], intercepts: &[f64], kernel: Kernel, sigma: f64) -> Self {
        let with = !intercepts.is_empty();
        let k = coordinates.len().checked_div(dimensions).unwrap_or(0);
        let a = if with { intercepts.to_vec() } else { vec![0.0; k] };
        let landmarks = if dimensions == 2 {
            let (x, y): (Vec<f64>, Vec<f64>) = coordinates.chunks_exact(2).map(|c| (c[0], c[1])).unzip();
            Landmarks::Planar(PlanarLandmarks { x, y, a, intercepts: with })
        } else {
            Landmarks::General(GeneralLandmarks { dimensions, coordinates: coordinates.to_vec(), a, intercepts: with })
        };
        Self { landmarks, dimensions, kernel, sigma, truncation: 0.0, anchored: false }
    }

    /// The same for points that may lie anywhere. One at distance 0 from a landmark is put where the first such is; one far
    /// from all, of which the likelihood says no more than that, near the place that least squares give it.
    ///
    /// Vertices of a chart, whose landmarks cover it, need neither.
    #[must_use]
    pub(super) fn anchored(mut self) -> Self {
        self.anchored = true;
        self
    }

    /// The same with affinities below `least` taken as 0.
    #[must_use]
    pub(super) fn truncated(mut self, least: f64) -> Self {
        self.truncation = least;
        self
    }

    /// Number of landmarks k.
    #[must_use]
    pub(super) fn len(&self) -> usize {
        match &self.landmarks {
            Landmarks::Planar(l) => l.a.len(),
            Landmarks::General(l) => l.a.len(),
        }
    }

    /// Writes the parameters (x, a) of greatest likelihood for a point of which `scratch.observed` holds the evidence; a
    /// is 0 for the printed model. Always finite.
    fn place(&self, evidence: Evidence, scratch: &mut Scratch, theta: &mut [f64]) {
        let Scratch { observed, affinities: p, odds, weights: relative, steps, planar, general } = scratch;
        p.clear();
        let scale = 0.5 / self.sigma;
        if self.anchored {
            let coincident = observed.iter().position(|d| evidence == Evidence::SquaredDistances && *d == 0.0);
            if let Some(j) = coincident {
                return self.landmarks.parameters(j, theta);
            }
            odds.clear();
            odds.extend(observed.iter().map(|&d| match evidence {
                Evidence::SquaredDistances => self.kernel.log_odds(d * scale),
                Evidence::Affinities => log_odds(d),
            }));
            relative_weights(odds, relative);
        }
        match evidence {
            Evidence::SquaredDistances => p.extend(observed.iter().map(|d| self.kernel.affinity(d * scale))),
            Evidence::Affinities => p.extend_from_slice(observed),
        }
        if self.truncation > 0.0 {
            p.iter_mut().filter(|p| **p < self.truncation).for_each(|p| *p = 0.0);
        }
        let target = |j: usize| match (evidence, self.kernel) {
            (Evidence::SquaredDistances, Kernel::Logistic) => -observed[j] * scale,
            _ => log_odds(p[j]),
        };
        match &self.landmarks {
            Landmarks::Planar(l) if self.anchored => held(l, p, odds, relative, planar, steps, theta),
            Landmarks::General(l) if self.anchored => held(l, p, odds, relative, general, steps, theta),
            Landmarks::Planar(l) => free(l, p, target, planar, steps, theta),
            Landmarks::General(l) => free(l, p, target, general, steps, theta),
        }
    }

    /// Places `count` points: `observe(i, row)` writes what is known of point i and the k landmarks. The result has q + 1
    /// numbers a point, its coordinates and its intercept (0 for the printed model).
    ///
    /// Points are independent, so the bytes are the same for any number of threads. Each is the maximum of its
    /// likelihood, to 1e-10 where that has one; finite always. Not guaranteed unless [`LandmarkModel::anchored`]: the
    /// place of points some 8√σ and more from all landmarks, of which the nearest then outweighs the rest. O(kq²) a
    /// point: about 5 µs anchored, for k = 100 in the plane (`benches/README.md`).
    ///
    /// # Errors
    /// Cancelled.
    pub(super) fn place_points(
        &self,
        count: usize,
        evidence: Evidence,
        observe: impl Fn(usize, &mut [f64]) + Sync,
        progress: &Progress,
    ) -> Result<Vec<f64>, Cancelled> {
        let stride = self.dimensions + 1;
        let mut placed = vec![0.0; count * stride];
        placed.par_chunks_mut(CHUNK * stride).enumerate().try_for_each_init(
            || Scratch { observed: vec![0.0; self.len()], ..Scratch::default() },
            |scratch, (c, chunk)| {
                progress.check()?;
                for (i, theta) in chunk.chunks_exact_mut(stride).enumerate() {
                    observe(c * CHUNK + i, &mut scratch.observed);
                    self.place(evidence, scratch, theta);
                }
                Ok(())
            },
        )?;
        Ok(placed)
    }

    /// [`LandmarkModel::place_points`] for every vertex of a mesh, by its distances to the landmarks.
    ///
    /// # Errors
    /// Cancelled.
    ///
    /// # Panics
    /// If the distances are not from as many landmarks as the model has.
    pub(super) fn place_all(&self, distances: &LandmarkDistances, progress: &Progress) -> Result<Vec<f64>, Cancelled> {
        assert_eq!(distances.len(), self.len(), "the distances are those of the model's landmarks");
        let observe = |v: usize, row: &mut [f64]| {
            for (l, d) in row.iter_mut().enumerate() {
                *d = distances.get(l, VertexId::new(v)).powi(2);
            }
        };
        self.place_points(distances.vertex_count(), Evidence::SquaredDistances, observe, progress)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;

    #[test]
    fn planar_and_general_place_alike() {
        let coordinates: Vec<f64> = (0..80).map(|i| normal(5, i)).collect();
        let a: Vec<f64> = (0..40).map(|i| normal(6, i)).collect();
        for intercepts in [true, false] {
            let (x, y) = coordinates.chunks_exact(2).map(|c| (c[0], c[1])).unzip();
            let a = if intercepts { a.clone() } else { vec![0.0; 40] };
            let planar = PlanarLandmarks { x, y, a: a.clone(), intercepts };
            let general = GeneralLandmarks { dimensions: 2, coordinates: coordinates.clone(), a, intercepts };
            for trial in 0..20 {
                let p: Vec<f64> = (0..40).map(|j| 1.0 / (1.0 + normal(50 + trial, j).exp())).collect();
                let (mut one, mut other) = ([0.0; 3], [0.0; 3]);
                let steps = &mut Steps::default();
                free(&planar, &p, |j| log_odds(p[j]), &mut Default::default(), steps, &mut one);
                free(&general, &p, |j| log_odds(p[j]), &mut Default::default(), steps, &mut other);
                assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-8), "{one:?} {other:?}");
                // Affinities so small that the prior decides.
                let p: Vec<f64> = p.iter().map(|p| 1e-6 * p).collect();
                let odds: Vec<f64> = p.iter().map(|p| log_odds(*p)).collect();
                let mut relative = Vec::new();
                relative_weights(&odds, &mut relative);
                held(&planar, &p, &odds, &relative, &mut Default::default(), steps, &mut one);
                held(&general, &p, &odds, &relative, &mut Default::default(), steps, &mut other);
                assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-6), "{one:?} {other:?}");
            }
        }
    }
}
