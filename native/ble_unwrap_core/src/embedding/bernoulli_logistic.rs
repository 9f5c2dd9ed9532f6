//! Bernoulli logistic embedding in any dimension: the paper's model, its extension, and their fit.
//!
//! # Terms
//! n points, affinities p_ij in [0, 1], coordinates x_i in q dimensions, model affinities
//! q_ij = 1/(1+exp(−t_ij)). [`LogitModel::Printed`] has t_ij = x_i·x_j (paper, equation 2);
//! [`LogitModel::WithIntercepts`] adds a_i + a_j, so that a_i = −|x_i|²/2 gives
//! t_ij = −|x_i−x_j|²/2, a function of distance alone. The fit maximises the log-likelihood
//! F = Σ_{i≠j} p_ij log q_ij + (1−p_ij) log(1−q_ij) (4) over ordered pairs.
//!
//! # Algorithm
//! Block relaxation (section 4.2): θ_i ← θ_i − ωB_i⁻¹∇F_i, the intended form of (10); (8) reads
//! z_j = x_j. F is concave in each block, not jointly; x = 0 is a saddle. Serial updates never
//! lower F for 0 < ω < 2: the bound of a block is exact at the present point and below F elsewhere.
//! Parallel updates lack that guarantee (for ω ≥ 1 they regularly overshoot), so here they watch F:
//! a step that lowers it is taken back and retried with half of ω. Convergence is linear.
//!
//! # References
//! The paper: Bernoulli embedding model and its application in texture mapping, 2006, sections 3
//! and 4. Böhning, Lindsay: Monotonicity of quadratic-approximation algorithms, Annals of the
//! Institute of Statistical Mathematics 40, 1988.

use rayon::prelude::*;

use crate::choice::choices;
use crate::progress::Cancelled;
use crate::progress::Progress;

use super::EmbeddingError;
use super::affinity::Affinity;
use super::blocks::{Blocks, General, Planar};
use super::logistic::{Curvature, Quarter, Tight};

/// What the log-odds of a pair are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LogitModel {
    /// x_i·x_j + a_i + a_j, fitted with the tight bound (q−½)/t. Invariant under rigid motions.
    WithIntercepts,
    /// x_i·x_j as printed, fitted with the paper's bound ¼. Invariant under rotations about 0.
    Printed,
}

/// The order in which points are updated in a sweep (section 4.2 of the paper).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Update {
    /// One point after another, each from the present positions of all others (τ = t+1). The likelihood never falls for any
    /// ω in (0, 2).
    Serial,
    /// All points at once, from their positions after the last sweep (τ = t). A sweep that lowers the likelihood is
    /// repeated with half of ω.
    Parallel,
}

choices!(Update {
    Serial: "serial", "Serial", "Points move one after another, and the likelihood rises at every step.";
    Parallel: "parallel", "Parallel", "All points move at once from the same state, which needs a relaxation below 1.";
});

/// Parameters of [`fit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FitOptions {
    /// The model.
    pub model: LogitModel,
    /// Serial or parallel updates.
    pub update: Update,
    /// Relaxation ω, inside (0, 2).
    pub relaxation: f64,
    /// Most sweeps.
    pub max_sweeps: usize,
    /// Stop once a sweep changes F by less than this share of it.
    pub tolerance: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            model: LogitModel::WithIntercepts,
            update: Update::Serial,
            relaxation: 1.6,
            max_sweeps: 60,
            tolerance: 1e-5,
        }
    }
}

impl FitOptions {
    /// # Errors
    /// [`EmbeddingError::InvalidSetting`] names the first parameter out of range.
    pub(super) fn validate(&self) -> Result<(), EmbeddingError> {
        if !(self.relaxation > 0.0 && self.relaxation < 2.0) {
            let expected = "above 0 and below 2";
            return Err(EmbeddingError::InvalidSetting { name: "relaxation", value: self.relaxation, expected });
        }
        if self.tolerance.is_nan() || self.tolerance < 0.0 {
            return Err(EmbeddingError::InvalidSetting {
                name: "tolerance",
                value: self.tolerance,
                expected: "not negative",
            });
        }
        Ok(())
    }
}

/// A fitted model.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fit {
    /// Number of dimensions q.
    pub dimensions: usize,
    /// The n×q coordinates, row by row, without units: times √σ they are in units of distance
    /// (for the model with intercepts and the logistic kernel).
    pub coordinates: Vec<f64>,
    /// The n intercepts; empty for the printed model.
    pub intercepts: Vec<f64>,
    /// The kernel width σ of the affinities; 1 where they were given.
    pub sigma: f64,
    /// F at the end (4).
    pub log_likelihood: f64,
    /// F at the start and after each sweep; never falls by more than rounding. Parallel steps that
    /// were taken back count as sweeps but have no entry.
    pub trace: Vec<f64>,
    /// Bregman distance of the affinities from the model at the end (12): a constant less F.
    pub bregman: f64,
    /// Sweeps made.
    pub sweeps: usize,
    /// Whether F changed by less than the tolerance before the sweeps ran out.
    pub converged: bool,
}

/// In the first sweeps no point moves further than [`LONGEST_EARLY_STEP`]: from a random or badly scaled start
/// the bound of the first points is nearly singular and their steps would fling them far out.
const EARLY_SWEEPS: usize = 3;
/// In units of the coordinates, whose spread is of order 1.
const LONGEST_EARLY_STEP: f64 = 1.0;

/// Fits a model to affinities from a start of n×q `coordinates` and n `intercepts` (none given: zeros).
///
/// Deterministic for any number of threads. With serial updates each entry of [`Fit::trace`] is at least the
/// one before, up to rounding. Not guaranteed: the global maximum; a start on a line stays on it, the start 0
/// does not move. O(n²q²) a sweep and one exponential a pair: 6 ms for n = 1,000, q = 2 on one core.
///
/// # Errors
/// [`EmbeddingError::InvalidSetting`], [`EmbeddingError::WrongLength`],
/// [`EmbeddingError::NotFinite`] for the start, cancelled.
pub(super) fn fit(
    affinity: &Affinity,
    dimensions: usize,
    coordinates: &[f64],
    intercepts: &[f64],
    options: &FitOptions,
    progress: &Progress,
) -> Result<Fit, EmbeddingError> {
    options.validate()?;
    let n = affinity.len();
    if dimensions == 0 {
        return Err(EmbeddingError::InvalidSetting { name: "dimensions", value: 0.0, expected: "at least 1" });
    }
    if n.checked_mul(dimensions) != Some(coordinates.len()) {
        let expected = n.saturating_mul(dimensions);
        return Err(EmbeddingError::WrongLength { expected, found: coordinates.len() });
    }
    let zeros;
    let intercepts = match options.model {
        LogitModel::Printed => &[][..],
        LogitModel::WithIntercepts if intercepts.is_empty() => {
            zeros = vec![0.0; n];
            &zeros
        }
        LogitModel::WithIntercepts if intercepts.len() != n => {
            return Err(EmbeddingError::WrongLength { expected: n, found: intercepts.len() });
        }
        LogitModel::WithIntercepts => intercepts,
    };
    if let Some(i) = coordinates.iter().position(|v| !v.is_finite()) {
        return Err(EmbeddingError::NotFinite { point: i / dimensions, component: i % dimensions });
    }
    if let Some(point) = intercepts.iter().position(|v| !v.is_finite()) {
        return Err(EmbeddingError::NotFinite { point, component: dimensions });
    }

    let outcome = if dimensions == 2 {
        relax(Planar::new(coordinates, intercepts), affinity, dimensions, options, progress)?
    } else {
        relax(General::new(coordinates, intercepts, dimensions), affinity, dimensions, options, progress)?
    };
    let (coordinates, intercepts) = outcome.parameters;
    let log_likelihood = outcome.trace.last().copied().unwrap_or(0.0);
    Ok(Fit {
        dimensions,
        coordinates,
        intercepts,
        sigma: affinity.sigma(),
        log_likelihood,
        bregman: affinity.saturated_log_likelihood() - log_likelihood,
        trace: outcome.trace,
        sweeps: outcome.sweeps,
        converged: outcome.converged,
    })
}

struct Outcome {
    parameters: (Vec<f64>, Vec<f64>),
    trace: Vec<f64>,
    sweeps: usize,
    converged: bool,
}

fn relax<B: Blocks>(
    blocks: B,
    p: &Affinity,
    dimensions: usize,
    options: &FitOptions,
    progress: &Progress,
) -> Result<Outcome, Cancelled> {
    match (options.model, options.update) {
        (LogitModel::WithIntercepts, Update::Serial) => serial::<B, Tight>(blocks, p, dimensions, options, progress),
        (LogitModel::WithIntercepts, Update::Parallel) => {
            parallel::<B, Tight>(blocks, p, dimensions, options, progress)
        }
        (LogitModel::Printed, Update::Serial) => serial::<B, Quarter>(blocks, p, dimensions, options, progress),
        (LogitModel::Printed, Update::Parallel) => parallel::<B, Quarter>(blocks, p, dimensions, options, progress),
    }
}

/// ω, shortened in the first sweeps so that the coordinates of the block move at most
/// [`LONGEST_EARLY_STEP`]. A shorter step is a smaller ω for that block, so nothing is lost.
fn factor(step: &[f64], dimensions: usize, omega: f64, sweep: usize) -> f64 {
    if sweep >= EARLY_SWEEPS {
        return omega;
    }
    let length = omega * step[..dimensions].iter().map(|s| s * s).sum::<f64>().sqrt();
    if length > LONGEST_EARLY_STEP { omega * LONGEST_EARLY_STEP / length } else { omega }
}

fn settled(trace: &[f64], tolerance: f64) -> bool {
    matches!(trace, [.., before, now] if (now - before).abs() <= tolerance * now.abs())
}

fn total<B: Blocks>(blocks: &B, p: &Affinity) -> f64 {
    2.0 * (0..p.len()).map(|i| blocks.row_log_likelihood(p, i)).sum::<f64>()
}

/// When block i is visited, it and all later ones are as the last sweep left them. So the pairs
/// (i, j > i) that the sweep looks at anyway add up to F before the sweep, and F costs no
/// exponential of its own; the price is that convergence shows one sweep late.
fn serial<B: Blocks, C: Curvature>(
    mut blocks: B,
    p: &Affinity,
    dimensions: usize,
    options: &FitOptions,
    progress: &Progress,
) -> Result<Outcome, Cancelled> {
    let mut step = vec![0.0; blocks.block_len()];
    let mut scratch = blocks.scratch();
    let mut trace = Vec::with_capacity(options.max_sweeps.min(1000) + 1);
    let (mut sweeps, mut converged) = (0, false);
    while sweeps < options.max_sweeps && !converged {
        let mut before = 0.0;
        for i in 0..p.len() {
            progress.check()?;
            before += blocks.step::<C>(p, i, &mut scratch, &mut step);
            blocks.add(i, factor(&step, dimensions, options.relaxation, sweeps), &step);
        }
        trace.push(2.0 * before);
        converged = settled(&trace, options.tolerance);
        sweeps += 1;
    }
    trace.push(total(&blocks, p));
    let converged = converged || settled(&trace, options.tolerance);
    Ok(Outcome { parameters: blocks.parameters(), trace, sweeps, converged })
}

fn parallel<B: Blocks, C: Curvature>(
    start: B,
    p: &Affinity,
    dimensions: usize,
    options: &FitOptions,
    progress: &Progress,
) -> Result<Outcome, Cancelled> {
    let m = start.block_len();
    // F at `blocks` and all full steps from there; F summed in index order.
    let evaluate = |blocks: &B, steps: &mut Vec<f64>| -> Result<f64, Cancelled> {
        let rows: Vec<f64> = steps
            .par_chunks_exact_mut(m)
            .enumerate()
            .map_init(
                || blocks.scratch(),
                |scratch, (i, step)| {
                    progress.check()?;
                    Ok(blocks.step::<C>(p, i, scratch, step))
                },
            )
            .collect::<Result<_, Cancelled>>()?;
        Ok(2.0 * rows.iter().sum::<f64>())
    };
    let mut steps = vec![0.0; p.len() * m];
    let mut tried = steps.clone();
    let mut blocks = start;
    let mut trace = vec![evaluate(&blocks, &mut steps)?];
    let (mut sweeps, mut converged, mut omega) = (0, false, options.relaxation);
    while sweeps < options.max_sweeps && !converged {
        let mut next = blocks.clone();
        for (i, step) in steps.chunks_exact(m).enumerate() {
            next.add(i, factor(step, dimensions, omega, sweeps), step);
        }
        sweeps += 1;
        let now = evaluate(&next, &mut tried)?;
        if now >= trace[trace.len() - 1] {
            trace.push(now);
            blocks = next;
            std::mem::swap(&mut steps, &mut tried);
            converged = settled(&trace, options.tolerance);
        } else {
            omega *= 0.5;
        }
    }
    Ok(Outcome { parameters: blocks.parameters(), trace, sweeps, converged })
}

#[cfg(test)]
mod tests {
    use super::super::affinity::{Kernel, KernelWidth};
    use super::super::flat_shapes::{misfit, rectangle};
    use super::super::logistic::logistic;
    use super::*;
    use crate::random::normal;

    fn options(model: LogitModel, update: Update, relaxation: f64) -> FitOptions {
        FitOptions { model, update, relaxation, max_sweeps: 30, tolerance: 0.0 }
    }

    fn random_problem(n: usize, q: usize, seed: u64) -> (Affinity, Vec<f64>) {
        let p: Vec<f64> = (0..n * n).map(|k| logistic(2.0 * normal(seed, k as u64))).collect();
        let start = (0..n * q).map(|k| 0.5 * normal(!seed, k as u64)).collect();
        (Affinity::from_matrix(&p, n).expect("in range"), start)
    }

    /// The affinities of random points of space with a kernel.
    fn cloud(n: usize, kernel: Kernel, seed: u64) -> Affinity {
        let x: Vec<[f64; 3]> = (0..n as u64).map(|i| [0, 1, 2].map(|c| normal(seed + c, i))).collect();
        let squared: Vec<f64> = (0..n * n).map(|k| (0..3).map(|c| (x[k / n][c] - x[k % n][c]).powi(2)).sum()).collect();
        let width = KernelWidth::Relative(0.2);
        Affinity::from_squared_distances(&squared, n, kernel, width, &Progress::new()).expect("valid")
    }

    fn never_falls(trace: &[f64]) -> bool {
        trace.windows(2).all(|w| w[1] >= w[0] - 1e-12 * w[0].abs())
    }

    #[test]
    fn serial_likelihood_never_falls() {
        for seed in 0..100 {
            let q = 1 + (seed % 3) as usize;
            let n = 4 + (seed % 13) as usize;
            let kernel = if seed % 2 == 0 { Kernel::Gaussian } else { Kernel::Logistic };
            let (random, start) = random_problem(n, q, seed);
            for affinity in [random, cloud(n, kernel, seed), cloud(n, kernel, seed).truncated(0.05)] {
                for model in [LogitModel::WithIntercepts, LogitModel::Printed] {
                    for omega in [0.5, 1.0, 1.5, 1.9] {
                        let options = options(model, Update::Serial, omega);
                        let fit = fit(&affinity, q, &start, &[], &options, &Progress::new()).expect("valid");
                        assert!(never_falls(&fit.trace), "{seed} {model:?} {omega}: {:?}", fit.trace);
                        assert_eq!(fit.trace.len(), fit.sweeps + 1);
                        assert!(fit.coordinates.iter().all(|c| c.is_finite()));
                    }
                }
            }
        }
    }

    #[test]
    fn the_trace_is_the_log_likelihood_after_each_sweep() {
        let affinity = cloud(25, Kernel::Logistic, 4);
        let (_, start) = random_problem(25, 2, 4);
        let run = |max_sweeps| {
            let options = FitOptions { max_sweeps, ..options(LogitModel::WithIntercepts, Update::Serial, 1.6) };
            fit(&affinity, 2, &start, &[], &options, &Progress::new()).expect("valid")
        };
        let long = run(6);
        for sweeps in 0..6 {
            let short = run(sweeps);
            let mut f = 0.0;
            for i in 0..25 {
                for j in (0..25).filter(|j| *j != i) {
                    let x = |k: usize| [short.coordinates[2 * k], short.coordinates[2 * k + 1], short.intercepts[k]];
                    let ([a, b, c], [d, e, g]) = (x(i), x(j));
                    let q = 1.0 / (1.0 + (-(a * d + b * e + c + g)).exp());
                    let p = affinity.row(i)[j];
                    f += p * q.ln() + (1.0 - p) * (1.0 - q).ln();
                }
            }
            assert!((f - long.trace[sweeps]).abs() < 1e-9 && (f - short.log_likelihood).abs() < 1e-9);
        }
    }

    #[test]
    fn bregman_distance_is_a_constant_less_the_log_likelihood() {
        let affinity = cloud(20, Kernel::Gaussian, 8);
        let (_, start) = random_problem(20, 2, 8);
        let mut constant = Vec::new();
        for max_sweeps in [0, 1, 5, 30] {
            let options = FitOptions { max_sweeps, ..options(LogitModel::Printed, Update::Serial, 1.7) };
            let fit = fit(&affinity, 2, &start, &[], &options, &Progress::new()).expect("valid");
            let mut direct = 0.0;
            for i in 0..20 {
                for j in (0..20).filter(|j| *j != i) {
                    let dot = (0..2).map(|c| fit.coordinates[2 * i + c] * fit.coordinates[2 * j + c]).sum::<f64>();
                    let (p, q) = (affinity.row(i)[j], 1.0 / (1.0 + (-dot).exp()));
                    direct += p * (p / q).ln() + (1.0 - p) * ((1.0 - p) / (1.0 - q)).ln();
                }
            }
            assert!((fit.bregman - direct).abs() < 1e-9, "{} {direct}", fit.bregman);
            assert!(fit.bregman >= 0.0);
            constant.push(fit.bregman + fit.log_likelihood);
        }
        assert!(constant.iter().all(|c| (c - constant[0]).abs() < 1e-9), "{constant:?}");
    }

    #[test]
    fn a_rotated_start_gives_the_rotated_fit() {
        for model in [LogitModel::WithIntercepts, LogitModel::Printed] {
            for update in [Update::Serial, Update::Parallel] {
                let affinity = cloud(30, Kernel::Logistic, 2);
                let (_, start) = random_problem(30, 2, 2);
                let (sin, cos) = 0.83_f64.sin_cos();
                let turn = |x: &[f64]| -> Vec<f64> {
                    x.chunks_exact(2).flat_map(|c| [cos * c[0] - sin * c[1], sin * c[0] + cos * c[1]]).collect()
                };
                // Few sweeps: rounding grows along the way.
                let options = FitOptions { max_sweeps: 8, ..options(model, update, 0.9) };
                let run = |start: &[f64]| fit(&affinity, 2, start, &[], &options, &Progress::new()).expect("valid");
                let (plain, turned) = (run(&start), run(&turn(&start)));
                for (a, b) in turn(&plain.coordinates).iter().zip(&turned.coordinates) {
                    assert!((a - b).abs() < 1e-6, "{model:?} {update:?}: {a} {b}");
                }
                assert!((plain.log_likelihood - turned.log_likelihood).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn parallel_takes_falling_steps_back_and_does_not_depend_on_threads() {
        for (model, kernel) in [(LogitModel::WithIntercepts, Kernel::Logistic), (LogitModel::Printed, Kernel::Gaussian)]
        {
            let affinity = cloud(60, kernel, 6);
            let (_, start) = random_problem(60, 2, 6);
            let run = |threads, max_sweeps| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
                let options = FitOptions { max_sweeps, ..options(model, Update::Parallel, 1.9) };
                pool.install(|| fit(&affinity, 2, &start, &[], &options, &Progress::new())).expect("valid")
            };
            let fit = run(1, 60);
            assert_eq!(fit, run(4, 60));
            assert!(fit.trace.is_sorted());
            assert!(fit.trace.len() <= fit.sweeps, "ω = 1.9 must overshoot, so some sweep was taken back");
            let serial = FitOptions { max_sweeps: 60, ..options(model, Update::Serial, 1.7) };
            let serial = super::fit(&affinity, 2, &start, &[], &serial, &Progress::new()).expect("valid");
            let gain = (fit.log_likelihood - fit.trace[0]) / (serial.log_likelihood - fit.trace[0]);
            assert!(gain > 0.9, "parallel updates get most of the way: {gain}");
        }
    }

    #[test]
    fn a_flat_sheet_is_found_from_a_random_start() {
        let shape = rectangle(8, 8, 1.0, 1.0);
        let squared = shape.squared_distances();
        let width = KernelWidth::Relative(0.2);
        let affinity =
            Affinity::from_squared_distances(&squared, 64, Kernel::Logistic, width, &Progress::new()).expect("valid");
        let (_, start) = random_problem(64, 2, 1);
        let options = FitOptions { max_sweeps: 2000, tolerance: 1e-15, ..FitOptions::default() };
        let fit = fit(&affinity, 2, &start, &[], &options, &Progress::new()).expect("valid");
        let found: Vec<f64> = fit.coordinates.iter().map(|c| c * affinity.sigma().sqrt()).collect();
        assert!(misfit(&shape.points, &found) < 1e-4, "{} after {}", misfit(&shape.points, &found), fit.sweeps);
        assert!(fit.bregman.abs() < 1e-6 * fit.log_likelihood.abs());
    }

    #[test]
    fn bad_starts_are_named_and_cancel_is_heard() {
        let (affinity, start) = random_problem(5, 2, 0);
        let options = FitOptions::default();
        let run = |x: &[f64], a: &[f64], q| fit(&affinity, q, x, a, &options, &Progress::new()).err();
        assert_eq!(run(&start[1..], &[], 2), Some(EmbeddingError::WrongLength { expected: 10, found: 9 }));
        assert_eq!(run(&start, &[0.0; 3], 2), Some(EmbeddingError::WrongLength { expected: 5, found: 3 }));
        assert!(matches!(run(&[], &[], 0), Some(EmbeddingError::InvalidSetting { name: "dimensions", .. })));
        let mut nan = start.clone();
        nan[7] = f64::NAN;
        assert_eq!(run(&nan, &[], 2), Some(EmbeddingError::NotFinite { point: 3, component: 1 }));
        let progress = Progress::new();
        progress.cancel();
        assert_eq!(
            fit(&affinity, 2, &start, &[], &options, &progress).err(),
            Some(EmbeddingError::Cancelled(Cancelled::OnRequest))
        );
    }
}
