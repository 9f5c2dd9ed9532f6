//! The logistic function and the sums over one row of pairs that every fit is made of.
//!
//! Terms: `p` an affinity in [0, 1], `t` its log-odds in the model, `q = 1/(1+e⁻ᵗ)` the model's
//! affinity (paper, equation 2), `z = (x, y, 1)` the other point of the pair.
//!
//! The paper bounds q(1−q) by ¼. The tighter bound of Jaakkola and Jordan (Bayesian parameter
//! estimation via variational methods, Statistics and Computing 10, 2000, section 3),
//! w(t) = (q−½)/t, is ¼ at t = 0 and falls off, so steps are longer; the quadratic through the
//! present point with curvature −w still lies below the log-likelihood everywhere.

use std::marker::PhantomData;

/// Log-odds beyond ±700 have an affinity of 0 or 1 to 300 digits, and e⁻⁷⁰⁰ is still a normal number.
const LARGEST_LOG_ODDS: f64 = 700.0;

/// The affinities (σ(s), σ(−s)) for s ≥ 0, larger first, with 1/(1+e⁻ˢ) and one division.
///
/// Relative error below 1e-15 each, small values included, up to s = 700 where both stop changing.
/// Only additions, products and one quotient: loops over it vectorise and the bytes are the same on
/// every machine, which the system's `exp` does not promise.
#[inline(always)]
pub(super) fn logistic_pair(s: f64) -> (f64, f64) {
    // Adding 1.5·2⁵² rounds to an integer and leaves it in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const LN2_HIGH: f64 = 0.693_147_180_369_123_8; // the first 32 bits of ln 2: k·LN2_HIGH is exact
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    let x = -if s < LARGEST_LOG_ODDS { s } else { LARGEST_LOG_ODDS };
    // eˣ = 2ᵏ eʳ, |r| ≤ ½ ln 2, and eʳ = (E+O)/(E−O) by the diagonal Padé approximant of degree 6.
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x - k * LN2_HIGH) - k * LN2_LOW;
    let u = r * r;
    let even = 1.0 + u * (5.0 / 44.0 + u * (1.0 / 792.0 + u * (1.0 / 665_280.0)));
    let odd = r * (0.5 + u * (1.0 / 66.0 + u * (1.0 / 15_840.0)));
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    let (low, high) = ((even + odd) * power, even - odd);
    let inverse = 1.0 / (low + high);
    (high * inverse, low * inverse)
}

/// The model's affinity q for log-odds t.
#[cfg(test)]
pub(super) fn logistic(t: f64) -> f64 {
    let (large, small) = logistic_pair(t.abs());
    if t < 0.0 { small } else { large }
}

/// The curvature a fit gives a pair; all are even in t.
pub(super) trait Curvature: Copy + Send + Sync {
    /// From s = |t|, σ(s) and σ(−s).
    fn weight(s: f64, large: f64, small: f64) -> f64;
}

/// The paper's bound ¼ (section 4.2).
#[derive(Clone, Copy)]
pub(super) struct Quarter;

/// The tight bound (q−½)/t.
#[derive(Clone, Copy)]
pub(super) struct Tight;

/// The second derivative q(1−q) itself: Newton's method.
#[derive(Clone, Copy)]
pub(super) struct Exact;

impl Curvature for Quarter {
    #[inline(always)]
    fn weight(_: f64, _: f64, _: f64) -> f64 {
        0.25
    }
}

impl Curvature for Tight {
    #[inline(always)]
    fn weight(s: f64, large: f64, _: f64) -> f64 {
        // Below 1e-4 the difference cancels and the series ¼ − t²/48 is exact to 1e-18.
        if s > 1e-4 { (large - 0.5) / s } else { 0.25 - s * s * (1.0 / 48.0) }
    }
}

impl Curvature for Exact {
    #[inline(always)]
    fn weight(_: f64, large: f64, small: f64) -> f64 {
        large * small
    }
}

/// Points of the plane with their intercepts (all zero for the printed model), or a range of them.
#[derive(Clone, Copy)]
pub(super) struct PlanarPoints<'a> {
    pub(super) x: &'a [f64],
    pub(super) y: &'a [f64],
    pub(super) a: &'a [f64],
}

/// Sums over the pairs of one point with others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RowSums {
    /// Σ p log q + (1−p) log(1−q).
    pub(super) log_likelihood: f64,
    /// Σ (p−q) z.
    pub(super) gradient: [f64; 3],
    /// Σ w z zᵀ: entries xx, xy, yy, x, y, 1.
    pub(super) curvature: [f64; 6],
}

impl RowSums {
    pub(super) fn plus(mut self, other: &Self) -> Self {
        self.log_likelihood += other.log_likelihood;
        self.gradient.iter_mut().zip(other.gradient).for_each(|(s, v)| *s += v);
        self.curvature.iter_mut().zip(other.curvature).for_each(|(s, v)| *s += v);
        self
    }
}

/// Pairs worked on at a time: the intermediate values stay in the first-level cache, and a product
/// of 64 affinities ≥ ½ is far from underflow.
const BLOCK: usize = 64;
/// Independent partial sums, so that additions overlap and vectorise. Fixed: it decides the bytes.
const LANES: usize = 4;

/// The sums of the point `theta = (x, y, a)` against `others`, whose affinities to it are `p`.
///
/// One exponential a pair: log(1+e⁻ˢ) is summed as the logarithm of a product of 64. O(n), no allocation. Compiled for
/// the widest registers there are; the bytes are the same for all, since the lanes are fixed and nothing is fused.
pub(super) fn planar_row<C: Curvature>(p: &[f64], others: PlanarPoints<'_>, theta: [f64; 3]) -> RowSums {
    pulp::Arch::new().dispatch(Row { p, others, theta, curvature: PhantomData::<C> })
}

/// The work of [`planar_row`], compiled once for each width of registers.
struct Row<'a, C> {
    p: &'a [f64],
    others: PlanarPoints<'a>,
    theta: [f64; 3],
    curvature: PhantomData<C>,
}

impl<C: Curvature> pulp::WithSimd for Row<'_, C> {
    type Output = RowSums;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> RowSums {
        row_sums::<C>(self.p, self.others, self.theta)
    }
}

#[inline(always)]
fn row_sums<C: Curvature>(p: &[f64], others: PlanarPoints<'_>, theta: [f64; 3]) -> RowSums {
    let mut sums = RowSums::default();
    let [x0, y0, a0] = theta;
    let blocks = p.chunks(BLOCK).zip(others.x.chunks(BLOCK)).zip(others.y.chunks(BLOCK)).zip(others.a.chunks(BLOCK));
    for (((p, x), y), a) in blocks {
        let n = p.len().min(x.len()).min(y.len()).min(a.len());
        let (p, x, y, a) = (&p[..n], &x[..n], &y[..n], &a[..n]);
        let (mut residual, mut weight) = ([0.0; BLOCK], [0.0; BLOCK]);
        let (mut linear, mut larger) = ([0.0; BLOCK], [1.0; BLOCK]);
        {
            let (residual, weight) = (&mut residual[..n], &mut weight[..n]);
            let (linear, larger) = (&mut linear[..n], &mut larger[..n]);
            for j in 0..n {
                let t = x0 * x[j] + y0 * y[j] + (a0 + a[j]);
                let s = t.abs();
                let (large, small) = logistic_pair(s);
                residual[j] = p[j] - if t < 0.0 { small } else { large };
                weight[j] = C::weight(s, large, small);
                linear[j] = p[j] * t - if t < 0.0 { 0.0 } else { t };
                larger[j] = large;
            }
        }
        reduce(&residual[..n], &weight[..n], x, y, &mut sums);
        // Beyond n the arrays hold 0 and 1, so whole blocks can be reduced.
        let (mut sum, mut product) = ([0.0; LANES], [1.0; LANES]);
        for (l, m) in linear.chunks_exact(LANES).zip(larger.chunks_exact(LANES)) {
            for lane in 0..LANES {
                sum[lane] += l[lane];
                product[lane] *= m[lane];
            }
        }
        sums.log_likelihood += sum.iter().sum::<f64>() + product.iter().product::<f64>().ln();
    }
    sums
}

/// Adds Σ r z and Σ w z zᵀ.
#[inline(always)]
fn reduce(residual: &[f64], weight: &[f64], x: &[f64], y: &[f64], sums: &mut RowSums) {
    let mut acc = [[0.0; LANES]; 9];
    let mut add = |lane: usize, r: f64, w: f64, x: f64, y: f64| {
        let (wx, wy) = (w * x, w * y);
        acc[0][lane] += r * x;
        acc[1][lane] += r * y;
        acc[2][lane] += r;
        acc[3][lane] += wx * x;
        acc[4][lane] += wx * y;
        acc[5][lane] += wy * y;
        acc[6][lane] += wx;
        acc[7][lane] += wy;
        acc[8][lane] += w;
    };
    let whole = residual.len() / LANES * LANES;
    for (((r, w), x), y) in residual
        .chunks_exact(LANES)
        .zip(weight.chunks_exact(LANES))
        .zip(x.chunks_exact(LANES))
        .zip(y.chunks_exact(LANES))
    {
        for lane in 0..LANES {
            add(lane, r[lane], w[lane], x[lane], y[lane]);
        }
    }
    for j in whole..residual.len() {
        add(j - whole, residual[j], weight[j], x[j], y[j]);
    }
    for (total, lanes) in sums.gradient.iter_mut().chain(&mut sums.curvature).zip(acc) {
        *total += lanes.iter().sum::<f64>();
    }
}

/// The log-likelihood part of [`planar_row`] alone.
pub(super) fn planar_log_likelihood(p: &[f64], others: PlanarPoints<'_>, theta: [f64; 3]) -> f64 {
    let mut total = 0.0;
    let blocks = p.chunks(BLOCK).zip(others.x.chunks(BLOCK)).zip(others.y.chunks(BLOCK)).zip(others.a.chunks(BLOCK));
    for (((p, x), y), a) in blocks {
        let (mut linear, mut larger) = ([0.0; BLOCK], [1.0; BLOCK]);
        for (((((p, x), y), a), linear), larger) in p.iter().zip(x).zip(y).zip(a).zip(&mut linear).zip(&mut larger) {
            let t = theta[0] * x + theta[1] * y + (theta[2] + a);
            *linear = p * t - if t < 0.0 { 0.0 } else { t };
            *larger = logistic_pair(t.abs()).0;
        }
        total += linear.iter().sum::<f64>() + larger.iter().product::<f64>().ln();
    }
    total
}

/// p log q + (1−p) log(1−q) for one pair with log-odds t.
#[inline]
pub(super) fn pair_log_likelihood(p: f64, t: f64) -> f64 {
    p * t - t.max(0.0) + logistic_pair(t.abs()).0.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logistic_pair_agrees_with_the_system_exponential() {
        let mut worst = 0.0_f64;
        for i in 0..200_000 {
            let s = (f64::from(i) / 200_000.0).powi(3) * 705.0;
            let (large, small) = logistic_pair(s);
            let e = (-s.min(700.0)).exp();
            worst = worst.max((large * (1.0 + e) - 1.0).abs()).max((small * (1.0 + e) / e - 1.0).abs());
        }
        assert!(worst < 1e-15, "{worst:e}");
        assert_eq!(logistic_pair(0.0), (0.5, 0.5));
        assert!(logistic_pair(f64::INFINITY).1 > 0.0);
    }

    #[test]
    fn tight_bound_lies_below_the_log_likelihood_and_touches_it() {
        // log σ(t) − t/2 as a function of u, bounded at t: −½ w(t)(u² − t²) + the same at t.
        let even = |t: f64| pair_log_likelihood(0.5, t);
        for t in [0.0, 1e-6, 5e-5, 2e-4, 0.3, 1.0, 4.0, 30.0, 400.0_f64] {
            let (large, small) = logistic_pair(t);
            let w = Tight::weight(t, large, small);
            assert!(w <= 0.25 && w >= Exact::weight(t, large, small) - 1e-9, "{t}: {w}");
            for u in [-500.0, -20.0, -3.0, -0.5, 0.0, 0.1, 0.9, 2.0, 7.0, 60.0] {
                let bound = even(t) - 0.5 * w * (u * u - t * t);
                assert!(bound <= even(u) + 1e-9 * (1.0 + u.abs()), "at {t} to {u}: {bound} above {}", even(u));
            }
        }
    }

    #[test]
    fn planar_row_agrees_with_plain_sums() {
        for n in [0, 1, 2, 63, 64, 65, 200] {
            let x: Vec<f64> = (0..n).map(|i| 3.0 * (f64::from(i) * 1.3).sin()).collect();
            let y: Vec<f64> = (0..n).map(|i| 2.0 * (f64::from(i) * 2.1).cos()).collect();
            let a: Vec<f64> = (0..n).map(|i| -0.1 * f64::from(i % 7)).collect();
            let p: Vec<f64> = (0..n).map(|i| f64::from(i % 5) / 4.0).collect();
            let others = PlanarPoints { x: &x, y: &y, a: &a };
            let theta = [0.7, -1.2, 0.3];
            let fast = planar_row::<Tight>(&p, others, theta);
            let mut plain = RowSums::default();
            for j in 0..x.len() {
                let t = theta[0] * x[j] + theta[1] * y[j] + theta[2] + a[j];
                let q = 1.0 / (1.0 + (-t).exp());
                let (r, w) = (p[j] - q, (q - 0.5) / t);
                let z = [x[j], y[j], 1.0];
                plain.log_likelihood += p[j] * q.ln() + (1.0 - p[j]) * (1.0 - q).ln();
                (0..3).for_each(|c| plain.gradient[c] += r * z[c]);
                for (entry, (c, d)) in [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)].into_iter().enumerate() {
                    plain.curvature[entry] += w * z[c] * z[d];
                }
            }
            assert!((fast.log_likelihood - plain.log_likelihood).abs() < 1e-11);
            assert!((fast.log_likelihood - planar_log_likelihood(&p, others, theta)).abs() < 1e-11);
            for (f, e) in fast.gradient.iter().zip(plain.gradient).chain(fast.curvature.iter().zip(plain.curvature)) {
                assert!((f - e).abs() < 1e-11, "{n}: {f} {e}");
            }
        }
    }
}
