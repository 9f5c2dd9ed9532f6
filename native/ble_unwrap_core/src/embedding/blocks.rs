//! One block of the likelihood a point: its gradient, its bound and the step they give.
//!
//! Block i is θ_i = (x_i, a_i), or x_i alone in the printed model. With all others fixed the
//! log-likelihood (4) is concave in θ_i, has gradient g = 2Σ(p_ij−q_ij)z_j and lies above the
//! quadratic of curvature B = −2Σ w_ij z_j z_jᵀ (paper, equation 8 and the bound after it, for
//! symmetric p). The factor 2 cancels in the step −B⁻¹g, so sums are kept without it.

use nalgebra::{Cholesky, Matrix2, Matrix3, Vector2, Vector3};

use super::affinity::Affinity;
use super::logistic::{
    Curvature, PlanarPoints, RowSums, logistic_pair, pair_log_likelihood, planar_log_likelihood, planar_row,
};

/// Added to the diagonal of the bound, times its trace: enough to invert it where the other points lie on
/// a line, too little to be felt otherwise. It only enlarges the bound, so monotonicity stays.
const RIDGE: f64 = 1e-9;

/// The parameters of a model and its block steps. Two implementations: the plane, and any dimension.
pub(super) trait Blocks: Clone + Send + Sync {
    /// Working memory of one step.
    type Scratch: Send;

    /// Working memory for [`Blocks::step`]; made once a thread.
    fn scratch(&self) -> Self::Scratch;

    /// Number of parameters of a block.
    fn block_len(&self) -> usize;

    /// Writes the full step −B_i⁻¹g_i to `step` and returns the log-likelihood of the pairs (i, j), j > i,
    /// each counted once.
    fn step<C: Curvature>(&self, p: &Affinity, i: usize, scratch: &mut Self::Scratch, step: &mut [f64]) -> f64;

    /// θ_i ← θ_i + factor·step.
    fn add(&mut self, i: usize, factor: f64, step: &[f64]);

    /// Log-likelihood of the pairs (i, j), j < i, each counted once.
    fn row_log_likelihood(&self, p: &Affinity, i: usize) -> f64;

    /// Coordinates, row by row, and intercepts (none for the printed model).
    fn parameters(&self) -> (Vec<f64>, Vec<f64>);
}

/// Points of the plane.
#[derive(Clone)]
pub(super) struct Planar {
    x: Vec<f64>,
    y: Vec<f64>,
    a: Vec<f64>,
    intercepts: bool,
}

impl Planar {
    /// From n×2 coordinates; `intercepts` holds n values, or none for the printed model.
    pub(super) fn new(coordinates: &[f64], intercepts: &[f64]) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = coordinates.chunks_exact(2).map(|c| (c[0], c[1])).unzip();
        let with = !intercepts.is_empty();
        let a = if with { intercepts.to_vec() } else { vec![0.0; x.len()] };
        Self { x, y, a, intercepts: with }
    }

    fn range(&self, from: usize, to: usize) -> PlanarPoints<'_> {
        PlanarPoints { x: &self.x[from..to], y: &self.y[from..to], a: &self.a[from..to] }
    }

    fn theta(&self, i: usize) -> [f64; 3] {
        [self.x[i], self.y[i], self.a[i]]
    }
}

/// Solves the ridged 2×2 or 3×3 system of one block; zero where it is singular or not finite.
#[inline]
pub(super) fn planar_solve(sums: &RowSums, intercept: bool) -> [f64; 3] {
    let [xx, xy, yy, x, y, one] = sums.curvature;
    let [gx, gy, ga] = sums.gradient;
    let step = if intercept {
        let ridge = RIDGE * (xx + yy + one);
        let m = Matrix3::new(xx + ridge, xy, x, xy, yy + ridge, y, x, y, one + ridge);
        Cholesky::new(m).map(|c| c.solve(&Vector3::new(gx, gy, ga)).into())
    } else {
        let ridge = RIDGE * (xx + yy);
        let m = Matrix2::new(xx + ridge, xy, xy, yy + ridge);
        Cholesky::new(m).map(|c| c.solve(&Vector2::new(gx, gy))).map(|s| [s.x, s.y, 0.0])
    };
    step.filter(|s: &[f64; 3]| s.iter().all(|v| v.is_finite())).unwrap_or_default()
}

impl Blocks for Planar {
    type Scratch = ();

    fn scratch(&self) {}

    fn block_len(&self) -> usize {
        if self.intercepts { 3 } else { 2 }
    }

    fn step<C: Curvature>(&self, p: &Affinity, i: usize, (): &mut (), step: &mut [f64]) -> f64 {
        let (n, row, theta) = (self.x.len(), p.row(i), self.theta(i));
        let before = planar_row::<C>(&row[..i], self.range(0, i), theta);
        let after = planar_row::<C>(&row[i + 1..], self.range(i + 1, n), theta);
        let log_likelihood = after.log_likelihood;
        let solved = planar_solve(&before.plus(&after), self.intercepts);
        step.copy_from_slice(&solved[..step.len()]);
        log_likelihood
    }

    fn add(&mut self, i: usize, factor: f64, step: &[f64]) {
        self.x[i] += factor * step[0];
        self.y[i] += factor * step[1];
        if let Some(a) = step.get(2) {
            self.a[i] += factor * a;
        }
    }

    fn row_log_likelihood(&self, p: &Affinity, i: usize) -> f64 {
        planar_log_likelihood(&p.row(i)[..i], self.range(0, i), self.theta(i))
    }

    fn parameters(&self) -> (Vec<f64>, Vec<f64>) {
        let coordinates = self.x.iter().zip(&self.y).flat_map(|(x, y)| [*x, *y]).collect();
        (coordinates, if self.intercepts { self.a.clone() } else { Vec::new() })
    }
}

/// Points of any dimension q ≥ 1. Also the plain statement of what [`Planar`] does fast.
#[derive(Clone)]
pub(super) struct General {
    dimensions: usize,
    coordinates: Vec<f64>,
    intercepts: Vec<f64>,
}

impl General {
    /// From n×q coordinates; `intercepts` holds n values, or none for the printed model.
    pub(super) fn new(coordinates: &[f64], intercepts: &[f64], dimensions: usize) -> Self {
        Self { dimensions, coordinates: coordinates.to_vec(), intercepts: intercepts.to_vec() }
    }

    fn point(&self, i: usize) -> &[f64] {
        &self.coordinates[i * self.dimensions..(i + 1) * self.dimensions]
    }

    fn log_odds(&self, i: usize, j: usize) -> f64 {
        let product: f64 = self.point(i).iter().zip(self.point(j)).map(|(a, b)| a * b).sum();
        if self.intercepts.is_empty() { product } else { product + (self.intercepts[i] + self.intercepts[j]) }
    }
}

impl Blocks for General {
    /// Gradient, z, and the lower triangle of the bound, row by row.
    type Scratch = (Vec<f64>, Vec<f64>, Vec<f64>);

    fn scratch(&self) -> Self::Scratch {
        let m = self.block_len();
        (vec![0.0; m], vec![1.0; m], vec![0.0; m * m])
    }

    fn block_len(&self) -> usize {
        self.dimensions + usize::from(!self.intercepts.is_empty())
    }

    fn step<C: Curvature>(&self, p: &Affinity, i: usize, scratch: &mut Self::Scratch, step: &mut [f64]) -> f64 {
        let m = self.block_len();
        let (gradient, z, bound) = scratch;
        gradient.fill(0.0);
        bound.fill(0.0);
        let mut log_likelihood = 0.0;
        for (j, &p) in p.row(i).iter().enumerate().filter(|(j, _)| *j != i) {
            let t = self.log_odds(i, j);
            let (large, small) = logistic_pair(t.abs());
            let residual = p - if t < 0.0 { small } else { large };
            let weight = C::weight(t.abs(), large, small);
            z[..self.dimensions].copy_from_slice(self.point(j));
            for r in 0..m {
                gradient[r] += residual * z[r];
                for c in 0..=r {
                    bound[r * m + c] += weight * z[r] * z[c];
                }
            }
            if j > i {
                log_likelihood += pair_log_likelihood(p, t);
            }
        }
        solve(bound, m, gradient, step);
        log_likelihood
    }

    fn add(&mut self, i: usize, factor: f64, step: &[f64]) {
        let q = self.dimensions;
        self.coordinates[i * q..(i + 1) * q].iter_mut().zip(step).for_each(|(x, s)| *x += factor * s);
        if let Some(a) = step.get(q) {
            self.intercepts[i] += factor * a;
        }
    }

    fn row_log_likelihood(&self, p: &Affinity, i: usize) -> f64 {
        p.row(i)[..i].iter().enumerate().map(|(j, &p)| pair_log_likelihood(p, self.log_odds(i, j))).sum()
    }

    fn parameters(&self) -> (Vec<f64>, Vec<f64>) {
        (self.coordinates.clone(), self.intercepts.clone())
    }
}

/// Solves the ridged m×m system given by its lower triangle, in place by Cholesky; zero where it is singular
/// or not finite.
pub(super) fn solve(matrix: &mut [f64], m: usize, right: &[f64], solution: &mut [f64]) {
    let ridge = RIDGE * (0..m).map(|r| matrix[r * m + r]).sum::<f64>();
    solution.copy_from_slice(right);
    for r in 0..m {
        for c in 0..=r {
            let dot: f64 = (0..c).map(|k| matrix[r * m + k] * matrix[c * m + k]).sum();
            if c < r {
                matrix[r * m + c] = (matrix[r * m + c] - dot) / matrix[c * m + c];
                continue;
            }
            let pivot = matrix[r * m + r] + ridge - dot;
            if !(pivot > 0.0 && pivot.is_finite()) {
                solution.fill(0.0);
                return;
            }
            matrix[r * m + r] = pivot.sqrt();
        }
    }
    for r in 0..m {
        let dot: f64 = (0..r).map(|k| matrix[r * m + k] * solution[k]).sum();
        solution[r] = (solution[r] - dot) / matrix[r * m + r];
    }
    for r in (0..m).rev() {
        let dot: f64 = (r + 1..m).map(|k| matrix[k * m + r] * solution[k]).sum();
        solution[r] = (solution[r] - dot) / matrix[r * m + r];
    }
    if solution.iter().any(|v| !v.is_finite()) {
        solution.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::logistic::{Exact, Quarter, Tight};
    use super::*;
    use crate::random::normal;

    /// A random problem: affinities, n×q coordinates, intercepts (empty for the printed model).
    fn problem(n: usize, q: usize, with: bool, seed: u64) -> (Affinity, Vec<f64>, Vec<f64>) {
        let p: Vec<f64> = (0..n * n).map(|k| 1.0 / (1.0 + normal(seed, k as u64).exp())).collect();
        let x = (0..n * q).map(|k| normal(seed + 1, k as u64)).collect();
        let a = (0..if with { n } else { 0 }).map(|k| normal(seed + 2, k as u64)).collect();
        (Affinity::from_matrix(&p, n).expect("in range"), x, a)
    }

    fn total(blocks: &impl Blocks, p: &Affinity) -> f64 {
        2.0 * (0..p.len()).map(|i| blocks.row_log_likelihood(p, i)).sum::<f64>()
    }

    #[test]
    fn gradient_and_hessian_of_equation_8_match_finite_differences() {
        let n = 9;
        for with in [true, false] {
            for i in 0..n {
                let (p, x, a) = problem(n, 2, with, 10 + i as u64);
                let blocks = Planar::new(&x, &a);
                let m = blocks.block_len();
                let (row, theta) = (p.row(i), blocks.theta(i));
                let before = planar_row::<Exact>(&row[..i], blocks.range(0, i), theta);
                let sums = before.plus(&planar_row::<Exact>(&row[i + 1..], blocks.range(i + 1, n), theta));
                let at = |step: [f64; 3]| {
                    let mut moved = blocks.clone();
                    moved.add(i, 1.0, &step[..m]);
                    total(&moved, &p)
                };
                let unit = |c: usize, h: f64| std::array::from_fn(|k| if k == c { h } else { 0.0 });
                let h = 1e-4;
                // Order of the entries of RowSums::curvature.
                let entry = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];
                for c in 0..m {
                    let slope = (at(unit(c, h)) - at(unit(c, -h))) / (2.0 * h);
                    assert!((slope - 2.0 * sums.gradient[c]).abs() < 1e-6 * (1.0 + slope.abs()));
                    for d in 0..m {
                        let (u, v): ([f64; 3], [f64; 3]) = (unit(c, h), unit(d, h));
                        let corner = |s: f64, t: f64| at(std::array::from_fn(|k| s * u[k] + t * v[k]));
                        let second = (corner(1.0, 1.0) - corner(1.0, -1.0) - corner(-1.0, 1.0) + corner(-1.0, -1.0))
                            / (4.0 * h * h);
                        let expected = -2.0 * sums.curvature[entry[c][d]];
                        assert!((second - expected).abs() < 1e-4 * (1.0 + expected.abs()), "{second} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn planar_and_general_give_the_same_steps() {
        for with in [true, false] {
            let (p, x, a) = problem(70, 2, with, 3);
            let (planar, general) = (Planar::new(&x, &a), General::new(&x, &a, 2));
            let mut scratch = general.scratch();
            for i in 0..70 {
                let m = planar.block_len();
                let (mut s, mut t) = ([0.0; 3], [0.0; 3]);
                let f = planar.step::<Tight>(&p, i, &mut (), &mut s[..m]);
                let g = general.step::<Tight>(&p, i, &mut scratch, &mut t[..m]);
                assert!((f - g).abs() < 1e-10);
                assert!(s.iter().zip(t).all(|(a, b)| (a - b).abs() < 1e-10), "{s:?} {t:?}");
                planar.step::<Quarter>(&p, i, &mut (), &mut s[..m]);
                general.step::<Quarter>(&p, i, &mut scratch, &mut t[..m]);
                assert!(s.iter().zip(t).all(|(a, b)| (a - b).abs() < 1e-10), "{s:?} {t:?}");
                assert!((planar.row_log_likelihood(&p, i) - general.row_log_likelihood(&p, i)).abs() < 1e-10);
            }
            assert_eq!(planar.parameters(), general.parameters());
        }
    }

    #[test]
    fn the_step_is_four_times_the_inverse_scatter_times_the_residuals() {
        // For symmetric p and the bound ¼ the full step is 4(Σzzᵀ)⁻¹Σ(p−q)z.
        let (p, x, _) = problem(12, 3, false, 5);
        let blocks = General::new(&x, &[], 3);
        let (mut step, mut scratch) = ([0.0; 3], blocks.scratch());
        blocks.step::<Quarter>(&p, 4, &mut scratch, &mut step);
        let (mut scatter, mut residuals) = (Matrix3::zeros(), Vector3::zeros());
        for j in (0..12).filter(|j| *j != 4) {
            let z = Vector3::from_column_slice(blocks.point(j));
            scatter += z * z.transpose();
            residuals += z * (p.row(4)[j] - 1.0 / (1.0 + (-blocks.log_odds(4, j)).exp()));
        }
        let expected = 4.0 * scatter.try_inverse().expect("twelve random points span space") * residuals;
        assert!((Vector3::from(step) - expected).norm() < 1e-6 * expected.norm());
    }

    #[test]
    fn singular_blocks_do_not_move() {
        let p = Affinity::from_matrix(&[0.5; 9], 3).expect("in range");
        let blocks = Planar::new(&[0.0; 6], &[]);
        let mut step = [1.0; 2];
        blocks.step::<Quarter>(&p, 0, &mut (), &mut step);
        assert_eq!(step, [0.0; 2]);
        let general = General::new(&[0.0; 6], &[], 2);
        general.step::<Quarter>(&p, 0, &mut general.scratch(), &mut step);
        assert_eq!(step, [0.0; 2]);
    }
}
