//! Small linear programs: what a step of `compact` asks for.
//!
//! Mehrotra: On the implementation of a primal-dual interior point method, SIAM Journal on Optimization 2(4), 1992. The
//! matrix of each iteration has a row for each variable, and entries where two variables are in the same inequality. Its
//! factor has entries in the same envelope (Jennings: A compact storage scheme for the solution of symmetric linear
//! simultaneous equations, The Computer Journal 9(3), 1966), which is narrow where variables are numbered so that those
//! of an inequality are near each other. A variable that is in all of them comes last.

/// Most iterations; a dozen is usual.
const ITERATIONS: usize = 40;
/// Share of the way to the nearest bound that a step takes.
const SHORT_OF_BOUND: f64 = 0.99;
/// The solution is taken for exact where its error is such a share of the largest limit: it only guides a step, after which distances are
/// found anew.
const ACCURACY: f64 = 1e-2;
/// What is added to the diagonal of a matrix, as a share of it, so that rounding never makes it indefinite.
const RIDGE: f64 = 1e-12;

/// Inequalities on variables: sums of few of them that have a least value each.
#[derive(Clone, Debug, Default)]
pub(super) struct Inequalities {
    entries: Vec<(u32, f64)>,
    /// Where the entries of each row end, and its least value.
    rows: Vec<(u32, f64)>,
}

impl Inequalities {
    /// Adds the inequality Σ factor · variable ≥ `least`.
    pub(super) fn push(&mut self, entries: impl IntoIterator<Item = (u32, f64)>, least: f64) {
        self.entries.extend(entries);
        self.rows.push((self.entries.len() as u32, least));
    }

    /// Number of inequalities.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    fn rows(&self) -> impl Iterator<Item = (&[(u32, f64)], f64)> {
        let mut from = 0;
        self.rows.iter().map(move |&(to, least)| {
            let row = &self.entries[from..to as usize];
            from = to as usize;
            (row, least)
        })
    }
}

fn dot(row: &[(u32, f64)], x: &[f64]) -> f64 {
    row.iter().map(|&(k, factor)| factor * x[k as usize]).sum()
}

/// Slacks of inequalities and of both limits of each variable, or the multipliers of these.
#[derive(Clone)]
struct Sides {
    rows: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Sides {
    fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let zip = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect();
        Self { rows: zip(&self.rows, &other.rows), low: zip(&self.low, &other.low), high: zip(&self.high, &other.high) }
    }

    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        let map = |a: &[f64]| a.iter().map(|a| f(*a)).collect();
        Self { rows: map(&self.rows), low: map(&self.low), high: map(&self.high) }
    }

    fn iter(&self) -> impl Iterator<Item = f64> {
        self.rows.iter().chain(&self.low).chain(&self.high).copied()
    }

    fn dot(&self, other: &Self) -> f64 {
        self.iter().zip(other.iter()).map(|(a, b)| a * b).sum()
    }

    /// The greatest step along `by`, up to 1, at which all stay positive.
    fn step(&self, by: &Self) -> f64 {
        let steps = self.iter().zip(by.iter()).filter(|(_, d)| *d < 0.0).map(|(x, d)| -x / d);
        steps.fold(1.0 / SHORT_OF_BOUND, f64::min) * SHORT_OF_BOUND
    }

    fn advance(&mut self, step: f64, by: &Self) {
        let one = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += step * b);
        one(&mut self.rows, &by.rows);
        one(&mut self.low, &by.low);
        one(&mut self.high, &by.high);
    }
}

/// A symmetric matrix by the lower half of its rows, each from its first entry to the diagonal; later its factor.
struct Envelope {
    entries: Vec<f64>,
    /// Where each row would begin if it had all columns, so that entry (i, j) is at `start[i] + j`, and its first column.
    start: Vec<isize>,
    first: Vec<usize>,
}

impl Envelope {
    /// With room for products of the variables of each inequality.
    fn new(n: usize, inequalities: &Inequalities) -> Self {
        let mut first: Vec<usize> = (0..n).collect();
        for (row, _) in inequalities.rows() {
            let least = row.iter().map(|e| e.0 as usize).min().unwrap_or(0);
            row.iter().for_each(|e| first[e.0 as usize] = first[e.0 as usize].min(least));
        }
        let mut start = Vec::with_capacity(n);
        let mut end = 0;
        for i in 0..n {
            start.push(end as isize - first[i] as isize);
            end += i + 1 - first[i];
        }
        Self { entries: vec![0.0; end], start, first }
    }

    #[inline]
    fn at(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.entries[(self.start[i] + j as isize) as usize]
    }

    fn row(&self, i: usize, columns: std::ops::Range<usize>) -> &[f64] {
        let of = |j: usize| (self.start[i] + j as isize) as usize;
        &self.entries[of(columns.start)..of(columns.end)]
    }

    /// Becomes its Cholesky factor; false where it is not positive.
    fn factorise(&mut self) -> bool {
        for i in 0..self.first.len() {
            for j in self.first[i]..i {
                let from = self.first[i].max(self.first[j]);
                let sum = if from < j { product(self.row(i, from..j), self.row(j, from..j)) } else { 0.0 };
                let diagonal = *self.at(j, j);
                let entry = self.at(i, j);
                *entry = (*entry - sum) / diagonal;
            }
            let own = self.row(i, self.first[i]..i);
            let sum = product(own, own);
            let diagonal = self.at(i, i);
            let rest = *diagonal - sum;
            if rest.is_nan() || rest <= 0.0 {
                return false;
            }
            *diagonal = rest.sqrt();
        }
        true
    }

    /// Solves the system whose matrix this is the factor of.
    fn solve(&self, x: &mut [f64]) {
        for i in 0..x.len() {
            let from = self.first[i];
            let sum = product(self.row(i, from..i), &x[from..i]);
            x[i] = (x[i] - sum) / self.row(i, i..i + 1)[0];
        }
        for i in (0..x.len()).rev() {
            x[i] /= self.row(i, i..i + 1)[0];
            let from = self.first[i];
            let of = x[i];
            x[from..i].iter_mut().zip(self.row(i, from..i)).for_each(|(x, entry)| *x -= of * entry);
        }
    }
}

/// The sum of products, in an order that lets the compiler use wide registers.
fn product(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (chunks, others) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = chunks.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in chunks.zip(others) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Variables that satisfy the inequalities, none further from 0 than its limit, with the greatest value of variable
/// `greatest`; of several such solutions one in the middle of them. Limits are above 0. `None` where rounding leaves
/// nothing. Where no variables satisfy all inequalities, the result violates some.
///
/// Cost: about ten factorisations in the envelope, and as many passes over the inequalities.
pub(super) fn maximise(greatest: usize, inequalities: &Inequalities, limits: &[f64]) -> Option<Vec<f64>> {
    let n = limits.len();
    let size = limits.iter().copied().fold(0.0, f64::max);
    let values = |x: &[f64]| Sides {
        rows: inequalities.rows().map(|(row, least)| dot(row, x) - least).collect(),
        low: x.iter().zip(limits).map(|(x, l)| l + x).collect(),
        high: x.iter().zip(limits).map(|(x, l)| l - x).collect(),
    };
    // Gᵀ v, where G has the inequalities and the limits as rows.
    let transposed = |v: &Sides| {
        let mut sum: Vec<f64> = v.low.iter().zip(&v.high).map(|(low, high)| low - high).collect();
        for ((row, _), v) in inequalities.rows().zip(&v.rows) {
            row.iter().for_each(|&(k, factor)| sum[k as usize] += factor * v);
        }
        sum
    };
    let changes = |dx: &[f64]| Sides {
        rows: inequalities.rows().map(|(row, _)| dot(row, dx)).collect(),
        low: dx.to_vec(),
        high: dx.iter().map(|d| -d).collect(),
    };
    let mut matrix = Envelope::new(n, inequalities);
    let mut x = vec![0.0; n];
    let mut slack = values(&x).map(|s| s.max(0.1 * size));
    let count = (inequalities.len() + 2 * n) as f64;
    let mut multiplier = slack.map(|s| size / (s * count));
    for _ in 0..ITERATIONS {
        let short = values(&x).zip(&slack, |value, slack| value - slack);
        let mut dual = transposed(&multiplier).into_iter().map(|g| -g).collect::<Vec<f64>>();
        dual[greatest] -= 1.0;
        let gap = slack.dot(&multiplier);
        let is_feasible = short.iter().all(|r| r.abs() < ACCURACY * size);
        if is_feasible && gap < ACCURACY * size && dual.iter().all(|r| r.abs() < ACCURACY) {
            break;
        }
        let weight = multiplier.zip(&slack, |z, s| z / s);
        matrix.entries.fill(0.0);
        for ((row, _), w) in inequalities.rows().zip(&weight.rows) {
            for &(i, a) in row {
                let wa = w * a;
                for &(j, b) in row {
                    // Only this half is read.
                    if j <= i {
                        *matrix.at(i as usize, j as usize) += wa * b;
                    }
                }
            }
        }
        for k in 0..n {
            let diagonal = matrix.at(k, k);
            *diagonal = (*diagonal + weight.low[k] + weight.high[k]) * (1.0 + RIDGE);
        }
        if !matrix.factorise() {
            return None;
        }
        // The step at which slack times multiplier becomes `target` less a correction of second order.
        let direction = |rest: &Sides| {
            let of_short = rest.zip(&slack, |rest, s| rest / s).zip(&short.zip(&weight, |r, w| r * w), |a, b| a - b);
            let mut right = transposed(&of_short);
            right.iter_mut().zip(&dual).for_each(|(r, d)| *r -= d);
            matrix.solve(&mut right);
            let dx = right;
            let ds = changes(&dx).zip(&short, |c, r| c + r);
            let dz = rest.zip(&slack, |rest, s| rest / s).zip(&ds.zip(&weight, |d, w| d * w), |a, b| a - b);
            (dx, ds, dz)
        };
        let product = slack.zip(&multiplier, |s, z| s * z);
        let (_, ds, dz) = direction(&product.map(|p| -p));
        let steps = [slack.step(&ds), multiplier.step(&dz)];
        let after: f64 = slack
            .iter()
            .zip(ds.iter())
            .zip(multiplier.iter().zip(dz.iter()))
            .map(|((s, ds), (z, dz))| (s + steps[0] * ds) * (z + steps[1] * dz))
            .sum();
        let target = (after / gap).powi(3) * gap / count;
        let rest = product.zip(&ds.zip(&dz, |a, b| a * b), |p, second| target - p - second);
        let (dx, ds, dz) = direction(&rest);
        let steps = [slack.step(&ds), multiplier.step(&dz)];
        x.iter_mut().zip(dx.iter()).for_each(|(x, d)| *x += steps[0] * d);
        slack.advance(steps[0], &ds);
        multiplier.advance(steps[1], &dz);
        if !x.iter().all(|x| x.is_finite()) {
            return None;
        }
    }
    Some(x.iter().zip(limits).map(|(x, l)| x.clamp(-l, *l)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_bound_is_met_and_what_is_free_stays_in_the_middle() {
        let mut inequalities = Inequalities::default();
        // x₀ ≤ 2 + x₁ and x₁ ≤ −1: at most 1.
        inequalities.push([(0, -1.0), (1, 1.0)], -2.0);
        inequalities.push([(1, -1.0)], 1.0);
        let x = maximise(0, &inequalities, &[10.0; 3]).expect("solved");
        assert!((x[0] - 1.0).abs() < 0.1 && (x[1] + 1.0).abs() < 0.1, "{x:?}");
        assert!(x[2].abs() < 1.0, "nothing moves it: {x:?}");
        let x = maximise(0, &Inequalities::default(), &[10.0, 3.0]).expect("solved");
        assert!(x[0] > 9.8);
    }

    #[test]
    fn a_start_that_violates_is_mended_where_it_can_be() {
        let mut inequalities = Inequalities::default();
        inequalities.push([(1, 1.0)], 4.0);
        inequalities.push([(0, -1.0), (1, -1.0)], -5.0);
        let x = maximise(0, &inequalities, &[10.0; 2]).expect("solved");
        assert!((x[0] - 1.0).abs() < 0.2 && (x[1] - 4.0).abs() < 0.1, "{x:?}");
    }

    #[test]
    fn a_factor_in_the_envelope_solves_the_system() {
        let mut inequalities = Inequalities::default();
        inequalities.push([(0, 1.0), (1, 2.0), (4, -1.0)], 0.0);
        inequalities.push([(2, 3.0), (3, 1.0), (4, 1.0)], 0.0);
        inequalities.push([(1, 1.0), (2, -1.0)], 0.0);
        let mut matrix = Envelope::new(5, &inequalities);
        let mut full = [[0.0; 5]; 5];
        for (row, _) in inequalities.rows() {
            for &(i, a) in row {
                for &(j, b) in row {
                    full[i as usize][j as usize] += a * b;
                    if j <= i {
                        *matrix.at(i as usize, j as usize) += a * b;
                    }
                }
            }
        }
        for k in 0..5 {
            full[k][k] += 1.0;
            *matrix.at(k, k) += 1.0;
        }
        assert!(matrix.entries.len() < 15, "the envelope is no full half");
        let expected = [1.0, -2.0, 3.0, 0.5, 4.0];
        let mut x: Vec<f64> = full.iter().map(|row| row.iter().zip(&expected).map(|(a, b)| a * b).sum()).collect();
        assert!(matrix.factorise());
        matrix.solve(&mut x);
        assert!(x.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12), "{x:?}");
        let mut zero = Envelope::new(5, &inequalities);
        assert!(!zero.factorise());
    }

    proptest! {
        #[test]
        fn no_vertex_of_the_region_is_better(
            rows in prop::collection::vec((0.0f64..6.3, 0.1f64..3.0), 0..12),
        ) {
            let mut inequalities = Inequalities::default();
            // Half-planes around the origin, which is inside all of them.
            for &(angle, at) in &rows {
                inequalities.push([(0, -angle.cos()), (1, -angle.sin())], -at);
            }
            let x = maximise(0, &inequalities, &[4.0; 2]).expect("solved");
            let mut lines: Vec<[f64; 3]> = rows.iter().map(|&(a, at)| [a.cos(), a.sin(), at]).collect();
            lines.extend([[1.0, 0.0, 4.0], [-1.0, 0.0, 4.0], [0.0, 1.0, 4.0], [0.0, -1.0, 4.0]]);
            let excess = |p: [f64; 2]| lines.iter().map(|l| l[0] * p[0] + l[1] * p[1] - l[2]).fold(f64::MIN, f64::max);
            prop_assert!(excess([x[0], x[1]]) < 0.05);
            for (i, a) in lines.iter().enumerate() {
                for b in &lines[..i] {
                    let det = a[0] * b[1] - a[1] * b[0];
                    if det.abs() > 1e-6 {
                        let p = [(a[2] * b[1] - a[1] * b[2]) / det, (a[0] * b[2] - a[2] * b[0]) / det];
                        prop_assert!(excess(p) > 1e-9 || p[0] <= x[0] + 0.1, "{p:?} beats {x:?}");
                    }
                }
            }
        }
    }
}
