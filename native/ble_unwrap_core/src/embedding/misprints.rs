//! The paper's misprints in sections 3 and 4: what is printed, what holds, and the evidence, one test each.
//!
//! Everything is written out here from (2), (4) and (8), independent of the fitted code, on small random problems.

use nalgebra::{DMatrix, DVector};

use super::affinity::{Affinity, Kernel, KernelWidth};
use super::bernoulli_logistic::{Fit, FitOptions, LogitModel, Update, fit};
use super::blocks::{Blocks, General};
use super::logistic::Quarter;
use crate::progress::Progress;
use crate::random::normal;

/// Affinities of all ordered pairs, not symmetric, and q-dimensional points of the printed model.
#[derive(Clone)]
struct Problem {
    n: usize,
    q: usize,
    p: Vec<f64>,
    x: Vec<f64>,
}

impl Problem {
    fn random(n: usize, q: usize, seed: u64) -> Self {
        let p = (0..n * n).map(|k| 1.0 / (1.0 + normal(seed, k as u64).exp())).collect();
        let x = (0..n * q).map(|k| normal(!seed, k as u64)).collect();
        Self { n, q, p, x }
    }

    fn symmetric(n: usize, q: usize, seed: u64) -> Self {
        let mut problem = Self::random(n, q, seed);
        problem.p = (0..n * n).map(|k| 0.5 * (problem.p[k] + problem.p[k % n * n + k / n])).collect();
        problem
    }

    fn point(&self, i: usize) -> DVector<f64> {
        DVector::from_column_slice(&self.x[i * self.q..(i + 1) * self.q])
    }

    fn move_to(&mut self, i: usize, x: &DVector<f64>) {
        self.x[i * self.q..(i + 1) * self.q].copy_from_slice(x.as_slice());
    }

    /// (2).
    fn q(&self, i: usize, j: usize) -> f64 {
        1.0 / (1.0 + (-self.point(i).dot(&self.point(j))).exp())
    }

    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let n = self.n;
        (0..n * n).map(move |k| (k / n, k % n)).filter(|(i, j)| i != j)
    }

    /// (4), over ordered pairs.
    fn f(&self) -> f64 {
        self.pairs()
            .map(|(i, j)| {
                let (p, t) = (self.p[i * self.n + j], self.point(i).dot(&self.point(j)));
                // log q = −log(1 + e⁻ᵗ), log(1 − q) = −t − log(1 + e⁻ᵗ).
                -(1.0 - p) * t - (-t.abs()).exp().ln_1p() - (-t).max(0.0)
            })
            .sum()
    }

    fn others(&self, i: usize) -> impl Iterator<Item = usize> + use<> {
        (0..self.n).filter(move |j| *j != i)
    }

    /// The gradient of (8).
    fn gradient(&self, i: usize) -> DVector<f64> {
        let term = |j: usize| {
            let (p, q) = (self.p[i * self.n + j] + self.p[j * self.n + i], self.q(i, j) + self.q(j, i));
            self.point(j) * (p - q)
        };
        self.others(i).map(term).sum()
    }

    /// The Hessian of (8).
    fn hessian(&self, i: usize) -> DMatrix<f64> {
        let term = |j: usize| {
            let q = self.q(i, j);
            self.point(j) * self.point(j).transpose() * (2.0 * q * (q - 1.0))
        };
        self.others(i).map(term).sum()
    }

    /// B_i of section 4.2.
    fn bound(&self, i: usize) -> DMatrix<f64> {
        self.others(i).map(|j| self.point(j) * self.point(j).transpose() * -0.5).sum()
    }

    /// −B⁻¹∇F.
    fn full_step(&self, i: usize) -> DVector<f64> {
        -self.bound(i).try_inverse().expect("random points span the space") * self.gradient(i)
    }

    fn fit(&self, omega: f64, max_sweeps: usize) -> Fit {
        let affinity = Affinity::from_matrix(&self.p, self.n).expect("in range");
        let options = FitOptions {
            model: LogitModel::Printed,
            update: Update::Serial,
            relaxation: omega,
            max_sweeps,
            tolerance: 0.0,
        };
        fit(&affinity, self.q, &self.x, &[], &options, &Progress::new()).expect("valid")
    }
}

/// Printed: (10) x ← (1−ω)x − ωB⁻¹∇F. Holds: x ← x − ωB⁻¹∇F, as over-relaxation of (9) and the range 0 < ω < 2 ask for.
/// Evidence: at a maximum of the block ∇F = 0, so that the printed rule moves the point to (1−ω)x and lowers F; its
/// fixed point is no maximum. The intended rule stays.
#[test]
fn equation_10_must_not_shrink_x() {
    for seed in 0..20 {
        let mut problem = Problem::symmetric(10, 2, seed);
        for _ in 0..2000 {
            let x = problem.point(0) + problem.full_step(0);
            problem.move_to(0, &x);
        }
        let (best, f, omega) = (problem.point(0), problem.f(), 1.7);
        let step = problem.full_step(0) * omega;
        assert!(step.norm() < 1e-6 * best.norm(), "a maximum is a fixed point of the intended rule");
        problem.move_to(0, &(&best * (1.0 - omega) + step));
        assert!((problem.point(0) - &best).norm() > 1.6 * best.norm() && problem.f() < f - 1e-3, "{seed}");
    }
}

/// Printed: Fig. 1 takes the argmin of F in each step (and its last line goes on with "k.l"). Holds: the argmax, since
/// F (4) is a log-likelihood; go to t.1. Evidence: with affinities strictly between 0 and 1 F falls without bound
/// along every ray of a block, so there is no argmin; the maximum is there and our sweeps climb to it.
#[test]
fn figure_1_maximises() {
    for seed in 0..20 {
        let problem = Problem::symmetric(8, 2, seed);
        let along = |length: f64, angle: f64| {
            let mut there = problem.clone();
            there.move_to(3, &DVector::from_vec(vec![length * angle.cos(), length * angle.sin()]));
            there.f()
        };
        for k in 0..8 {
            let angle = f64::from(k);
            assert!(along(1e6, angle) < -1e4 && along(1e8, angle) < 50.0 * along(1e6, angle));
        }
        let fit = problem.fit(1.0, 20);
        assert!(fit.log_likelihood > fit.trace[0] + 0.1);
    }
}

/// Printed: after (6), F − Q = ½(θ−φ)′K(θ−φ) ≥ 0 with K = B − ∇²F. Holds: K = ∇²F − B. Evidence: ∇²F − B has no negative
/// eigenvalue and F − Q is not negative; with the printed sign it would be its negative, below 0.
#[test]
fn the_k_after_equation_6_is_hessian_less_bound() {
    for seed in 0..50 {
        let problem = Problem::random(9, 3, seed);
        let k = problem.hessian(2) - problem.bound(2);
        let eigenvalues = k.symmetric_eigenvalues();
        assert!(eigenvalues.min() > -1e-12 && eigenvalues.max() > 1e-3, "{eigenvalues}");
        let (phi, gradient, bound, f) = (problem.point(2), problem.gradient(2), problem.bound(2), problem.f());
        for trial in 0..20 {
            let move_by = DVector::from_fn(3, |c, _| 2.0 * normal(seed + 100, 3 * trial + c as u64));
            let mut there = problem.clone();
            there.move_to(2, &(&phi + &move_by));
            let surrogate = f + move_by.dot(&gradient) + 0.5 * move_by.dot(&(&bound * &move_by));
            assert!(there.f() - surrogate > 1e-9, "{seed}: {} {surrogate}", there.f());
        }
    }
}

/// Printed: below (8), z_j = x^(τ) if j < i, without the index j. Holds: z_j = x_j^(τ), each other point at its latest
/// place. Evidence: (8) with z_j = x_j agrees with finite differences of (4); with one and the same x for all j it
/// does not.
#[test]
fn the_z_of_equation_8_is_the_other_point() {
    for seed in 0..20 {
        let (problem, i, h) = (Problem::random(7, 2, seed), 4, 1e-5);
        let difference = DVector::from_fn(2, |c, _| {
            let at = |step: f64| {
                let mut there = problem.clone();
                there.x[2 * i + c] += step;
                there.f()
            };
            (at(h) - at(-h)) / (2.0 * h)
        });
        assert!((problem.gradient(i) - &difference).norm() < 1e-7 * (1.0 + difference.norm()));
        let same: f64 = problem
            .others(i)
            .map(|j| problem.p[i * 7 + j] + problem.p[j * 7 + i] - problem.q(i, j) - problem.q(j, i))
            .sum();
        for j in problem.others(i) {
            assert!((problem.point(j) * same - &difference).norm() > 1e-3, "{seed} {j}");
        }
    }
}

/// Printed: step 3 computes all q_ij, ∇F_i and B_i, step 4 then updates all x_i, serially or in parallel. Holds: serial
/// updates (τ = t+1) must compute q_ij, ∇F_i and B_i of a block when its turn comes. Evidence: sweeps that take them
/// from before the sweep lower F in many problems; true serial sweeps in none.
#[test]
fn step_3_belongs_inside_the_sweep() {
    let omega = 1.5;
    let (mut stale_falls, mut serial_falls) = (0, 0);
    for seed in 0..100 {
        let start = Problem::symmetric(12, 2, seed);
        let (mut stale, mut serial) = (start.clone(), start);
        for _ in 0..10 {
            let before = (stale.f(), serial.f());
            let steps: Vec<_> = (0..12).map(|i| stale.full_step(i)).collect();
            for (i, step) in steps.iter().enumerate() {
                let moved = stale.point(i) + step * omega;
                stale.move_to(i, &moved);
                let moved = serial.point(i) + serial.full_step(i) * omega;
                serial.move_to(i, &moved);
            }
            stale_falls += usize::from(stale.f() < before.0 - 1e-9);
            serial_falls += usize::from(serial.f() < before.1 - 1e-9);
        }
    }
    assert_eq!(serial_falls, 0);
    assert!(stale_falls > 100, "{stale_falls} of 1000 sweeps");
}

/// Printed: step 5 outputs X^(iter). Holds: X^(iter+1), which step 4 has just computed. Evidence: by Theorem 4.1 it is
/// never worse, and here strictly better; the fit returns it.
#[test]
fn step_5_outputs_the_last_iterate() {
    for seed in 0..20 {
        let problem = Problem::symmetric(10, 2, seed);
        let fit = problem.fit(1.0, 5);
        let returned = Problem { x: fit.coordinates.clone(), ..problem };
        let [.., printed, last] = fit.trace[..] else { panic!("five sweeps") };
        assert!((returned.f() - last).abs() < 1e-9 && last > printed);
    }
}

/// Printed: section 4.4, "F defined in (4) is a strictly convex function". Holds: F is concave in each block with the
/// others fixed, and jointly neither convex nor concave; X = 0 is a saddle, where no step leaves. (What is strictly
/// convex is p ↦ Σ p log p + (1−p) log(1−p), which induces (12).) Evidence: F(X) = F(−X) lies above F(0) for one X and
/// below for another, though ∇F(0) = 0; the Hessian of a block has no positive eigenvalue.
#[test]
fn section_4_4_f_is_concave_in_blocks_only() {
    let mut problem = Problem::symmetric(8, 2, 3);
    for i in 0..8 {
        assert!(problem.hessian(i).symmetric_eigenvalues().max() < 1e-12);
    }
    let mut seen = [false; 2];
    problem.x.fill(0.0);
    let saddle = problem.f();
    for trial in 0..50 {
        let mut there = problem.clone();
        there.x = (0..16).map(|k| 0.1 * normal(trial, k)).collect();
        let f = there.f();
        there.x.iter_mut().for_each(|x| *x = -*x);
        assert!((there.f() - f).abs() < 1e-12);
        seen[usize::from(f > saddle)] = true;
    }
    assert_eq!(seen, [true, true], "0 is the middle of X and −X, above some pairs and below others");
    assert!((0..8).all(|i| problem.gradient(i).norm() == 0.0));
    assert!(problem.fit(1.0, 5).coordinates.iter().all(|x| *x == 0.0));
}

/// Printed: section 4.4 leaves open how (12) and F are related. Holds: B(p|q) = Σ [p log p + (1−p) log(1−p)] − F, a
/// constant less F, so the greatest likelihood is the least distance. Evidence: their sum does not depend on X.
#[test]
fn equation_12_is_a_constant_less_equation_4() {
    let problem = Problem::random(9, 3, 1);
    let sum = |x: Vec<f64>| {
        let there = Problem { x, ..problem.clone() };
        let bregman: f64 = there
            .pairs()
            .map(|(i, j)| {
                let (p, q) = (there.p[i * 9 + j], there.q(i, j));
                p * (p / q).ln() + (1.0 - p) * ((1.0 - p) / (1.0 - q)).ln()
            })
            .sum();
        assert!(bregman > 0.0);
        bregman + there.f()
    };
    let entropy: f64 =
        problem.pairs().map(|(i, j)| problem.p[i * 9 + j]).map(|p| p * p.ln() + (1.0 - p) * (1.0 - p).ln()).sum();
    for trial in 0..20 {
        let x = (0..27).map(|k| normal(trial, k)).collect();
        assert!((sum(x) - entropy).abs() < 1e-10);
    }
}

/// Printed: sections 2 and 4.1 call the algorithm "second-order convergent Newton-like". Holds: convergence is linear,
/// for B is not the Hessian. Evidence: the distance of F from its limit falls by the same factor every sweep; of second
/// order the factor would itself fall to 0.
#[test]
fn convergence_is_linear() {
    let problem = Problem::symmetric(14, 2, 5);
    let long = problem.fit(1.0, 6000);
    let gap = |t: usize| long.log_likelihood - long.trace[t];
    let t = (0..6000).find(|t| gap(*t) < 1e-5 * long.log_likelihood.abs()).expect("converges");
    let factors: Vec<f64> = (t..t + 4).map(|t| gap(t + 1) / gap(t)).collect();
    assert!(factors.iter().all(|f| (0.3..1.0).contains(f) && (f / factors[0] - 1.0).abs() < 0.05), "{factors:?}");
    // Theorem 4.1 (ii), which does hold: the gradient tends to 0.
    let steepest = |problem: &Problem| (0..problem.n).map(|i| problem.gradient(i).norm()).fold(0.0, f64::max);
    let end = Problem { x: long.coordinates, ..problem.clone() };
    assert!(steepest(&end) < 1e-3 * steepest(&problem), "{} {}", steepest(&end), steepest(&problem));
}

/// Printed: (5) and (13) divide the squared distance by 2σ and call σ a width. Holds: σ is a squared length, the
/// variance. Evidence: distances times s and σ times s² give the same affinities; σ times s does not.
#[test]
fn sigma_is_a_squared_length() {
    let squared = [0.0, 1.0, 4.0, 1.0, 0.0, 2.0, 4.0, 2.0, 0.0];
    let affinities = |scale: f64, sigma: f64| {
        let scaled = squared.map(|d| d * scale * scale);
        let width = KernelWidth::Absolute(sigma);
        let a = Affinity::from_squared_distances(&scaled, 3, Kernel::Gaussian, width, &Progress::new()).expect("valid");
        [a.row(0)[1], a.row(0)[2], a.row(1)[2]]
    };
    assert_eq!(affinities(1.0, 1.5), affinities(4.0, 24.0));
    assert_ne!(affinities(1.0, 1.5), affinities(4.0, 6.0));
    assert!((affinities(1.0, 1.5)[1] - (-4.0_f64 / 3.0).exp()).abs() < 1e-15);
}

/// Printed: section 3 lets the symmetric case count pairs i < j only, while (8) and B_i = −½Σzz′ count both orders.
/// Holds: either both count pairs once (−¼Σzz′) or both twice; the full step is 4(Σzz′)⁻¹Σ(p−q)z. Evidence: the
/// gradient of pairs i < j with the printed B makes half of that step, and the sweeps take longer; ours is whole.
#[test]
fn the_gradient_of_unordered_pairs_with_the_full_bound_halves_the_step() {
    let problem = Problem::symmetric(9, 3, 4);
    let (i, full) = (5, problem.full_step(5));
    let scatter: DMatrix<f64> = problem.others(i).map(|j| problem.point(j) * problem.point(j).transpose()).sum();
    let once: DVector<f64> =
        problem.others(i).map(|j| problem.point(j) * (problem.p[i * 9 + j] - problem.q(i, j))).sum();
    let whole = 4.0 * scatter.try_inverse().expect("nine points span space") * &once;
    assert!((&whole - &full).norm() < 1e-12 * full.norm());
    let mixed = -problem.bound(i).try_inverse().expect("as above") * once;
    assert!((2.0 * mixed - &full).norm() < 1e-12 * full.norm());

    let blocks = General::new(&problem.x, &[], 3);
    let affinity = Affinity::from_matrix(&problem.p, 9).expect("in range");
    let mut step = [0.0; 3];
    blocks.step::<Quarter>(&affinity, i, &mut blocks.scratch(), &mut step);
    assert!((DVector::from_column_slice(&step) - &full).norm() < 1e-6 * full.norm(), "up to the ridge");
}

/// Printed: "p_ij is not necessarily symmetric", as if that were a richer model. Holds: since q_ij = q_ji, p enters (4)
/// and (8) only as (p_ij + p_ji)/2. Evidence: F and its gradient are the same, for any X, with p and with its symmetric
/// part, and so is the fit.
#[test]
fn asymmetric_affinities_count_as_their_mean() {
    for seed in 0..20 {
        let problem = Problem::random(8, 2, seed);
        let mean = Problem { p: Problem::symmetric(8, 2, seed).p, ..problem.clone() };
        assert!((problem.f() - mean.f()).abs() < 1e-10);
        assert!((0..8).all(|i| (problem.gradient(i) - mean.gradient(i)).norm() < 1e-12));
        let fit = problem.fit(1.0, 4);
        assert_eq!(fit, mean.fit(1.0, 4));
        let there = Problem { x: fit.coordinates, ..problem };
        assert!((there.f() - fit.log_likelihood).abs() < 1e-9, "the likelihood (4) over ordered pairs as given");
    }
}
