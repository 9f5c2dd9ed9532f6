//! Rigid motions that lay one chart's border against another's.

use nalgebra::{Complex, Point2};

/// Longer stretches of border are looked at in so many places only.
const MOST_PLACES: usize = 256;

/// x ↦ turn·x + shift, a rigid motion of the plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    turn: Complex<f64>,
    shift: Complex<f64>,
}

impl Motion {
    /// The motion that takes the second of each pair of points nearest to the first, by weighted squares.
    pub(super) fn fit(pairs: &[([Point2<f64>; 2], f64)]) -> Self {
        let number = |p: Point2<f64>| Complex::new(p.x, p.y);
        let total = pairs.iter().map(|p| p.1).sum::<f64>().max(f64::MIN_POSITIVE);
        let mean = |side: usize| pairs.iter().map(|(p, w)| number(p[side]) * *w).sum::<Complex<f64>>() / total;
        let (to, from) = (mean(0), mean(1));
        let product = |(p, w): &([Point2<f64>; 2], f64)| (number(p[0]) - to) * (number(p[1]) - from).conj() * *w;
        let covariance: Complex<f64> = pairs.iter().map(product).sum();
        let turn = Complex::from_polar(1.0, covariance.arg());
        Self { turn, shift: to - turn * from }
    }

    pub(super) fn apply(&self, p: Point2<f64>) -> Point2<f64> {
        let moved = self.turn * Complex::new(p.x, p.y) + self.shift;
        Point2::new(moved.re, moved.im)
    }
}

/// A stretch of a border, from point `first` to point `last`.
pub(super) struct Window {
    pub(super) first: usize,
    pub(super) last: usize,
    pub(super) length: f64,
    pub(super) motion: Motion,
}

/// The longest stretch over which a rigid motion takes the second of each pair of points to the first, up to `fit`
/// (root of mean square over length). Looks at O(m²) stretches between m ≤ [`MOST_PLACES`] places, each in O(1) by sums
/// that have been taken before.
pub(super) fn longest_fit(
    points: &[[Complex<f64>; 2]],
    lengths: &[f64],
    most_edges: usize,
    fit: f64,
) -> Option<Window> {
    #[derive(Clone, Copy, Default)]
    struct Sums {
        a: Complex<f64>,
        b: Complex<f64>,
        squares: f64,
        product: Complex<f64>,
        length: f64,
    }
    let mut sums = vec![Sums::default()];
    for (k, [a, b]) in points.iter().enumerate() {
        let s = sums[k];
        sums.push(Sums {
            a: s.a + a,
            b: s.b + b,
            squares: s.squares + a.norm_sqr() + b.norm_sqr(),
            product: s.product + a * b.conj(),
            // Up to point k.
            length: s.length + if k > 0 { lengths[k - 1] } else { 0.0 },
        });
    }
    let n = points.len();
    let stride = n.div_ceil(MOST_PLACES).max(1);
    let mut best: Option<Window> = None;
    for first in (0..n).step_by(stride) {
        for last in (first + 1..n.min(first + most_edges + 1)).rev() {
            let length = sums[last + 1].length - sums[first + 1].length;
            if best.as_ref().is_some_and(|b| length <= b.length) {
                break;
            }
            if (last - first) % stride != 0 {
                continue;
            }
            let (from, to) = (&sums[first], &sums[last + 1]);
            let count = (last + 1 - first) as f64;
            let (a, b) = (to.a - from.a, to.b - from.b);
            let covariance = to.product - from.product - a * b.conj() / count;
            let squares = to.squares - from.squares - (a.norm_sqr() + b.norm_sqr()) / count;
            let error = ((squares - 2.0 * covariance.norm()) / count).max(0.0).sqrt();
            if error <= fit * length && covariance.norm() > 0.0 {
                let turn = covariance / covariance.norm();
                best = Some(Window { first, last, length, motion: Motion { turn, shift: (a - turn * b) / count } });
                break;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_found_again() {
        let there = Motion { turn: Complex::from_polar(1.0, 2.0), shift: Complex::new(-3.0, 0.5) };
        let points = [[0.0, 0.0], [1.0, 0.3], [2.0, -1.0], [0.1, 4.0]].map(Point2::from);
        let pairs: Vec<_> = points.iter().zip([1.0, 2.0, 0.5, 1.5]).map(|(&p, w)| ([there.apply(p), p], w)).collect();
        let found = Motion::fit(&pairs);
        assert!((found.turn - there.turn).norm() < 1e-12 && (found.shift - there.shift).norm() < 1e-12);
    }

    #[test]
    fn the_longest_fit_of_a_bent_border_is_its_straight_part() {
        let turn = Complex::from_polar(1.0, 0.7);
        let shift = Complex::new(3.0, -1.0);
        // The second bends away by a right angle after ten of sixteen edges.
        let points: Vec<[Complex<f64>; 2]> = (0..=16)
            .map(|k| {
                let k = f64::from(k);
                let bent = if k <= 10.0 { Complex::new(k, 0.0) } else { Complex::new(10.0, k - 10.0) };
                [Complex::new(k, 0.0), (bent - shift) / turn]
            })
            .collect();
        let exact = longest_fit(&points, &[1.0; 16], 16, 1e-9).expect("the straight part");
        assert_eq!((exact.first, exact.last, exact.length), (0, 10, 10.0));
        assert!((exact.motion.turn - turn).norm() < 1e-9 && (exact.motion.shift - shift).norm() < 1e-9);
        let short = longest_fit(&points, &[1.0; 16], 4, 1e-9).expect("four edges");
        assert_eq!(short.last - short.first, 4);
        let loose = longest_fit(&points, &[1.0; 16], 16, 0.05).expect("more");
        assert!(loose.length > 10.0 && loose.length < 14.0, "{}", loose.length);
    }
}
