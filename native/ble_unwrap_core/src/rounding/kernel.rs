//! The point of a box where linear functions are least unsatisfied: a linear program in the plane.

use nalgebra::Vector2;

/// Wants `constant + gradient·x ≥ t·want` for a `t` as large as can be; `want` > 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Constraint {
    pub(super) gradient: Vector2<f64>,
    pub(super) constant: f64,
    pub(super) want: f64,
}

/// Halvings of the interval of t: from any start that float32 areas allow (1e8) to 1e-4.
const HALVINGS: u32 = 40;

/// A point well inside the region of the box `[lo, hi]`, which holds 0, where all constraints have
/// nearly the largest common `t ≤ 1`. None if there are no constraints or they are not finite.
///
/// Bisection on `t` with the box clipped by the half-planes: O(constraints²) a step at worst.
pub(super) fn best_point(constraints: &[Constraint], lo: [f64; 2], hi: [f64; 2]) -> Option<Vector2<f64>> {
    // At the origin this much is granted.
    let mut low = constraints.iter().map(|c| c.constant / c.want).fold(f64::INFINITY, f64::min).min(1.0);
    if constraints.is_empty() || !low.is_finite() {
        return None;
    }
    let mut polygon = Vec::new();
    if low < 1.0 && !clip(constraints, 1.0, lo, hi, &mut polygon) {
        let mut high = 1.0;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if clip(constraints, middle, lo, hi, &mut polygon) {
                low = middle;
            } else {
                high = middle;
            }
        }
        // A little less, so that the region has an inside that survives rounding.
        low -= 0.1 * low.abs();
    } else {
        low = 1.0;
    }
    clip(constraints, low, lo, hi, &mut polygon).then(|| polygon.iter().sum::<Vector2<f64>>() / polygon.len() as f64)
}

/// Clips the box by all constraints at `t`; false if nothing is left.
fn clip(constraints: &[Constraint], t: f64, lo: [f64; 2], hi: [f64; 2], polygon: &mut Vec<Vector2<f64>>) -> bool {
    polygon.clear();
    polygon.extend([[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]].map(Vector2::from));
    for c in constraints {
        let value = |x: &Vector2<f64>| c.constant + c.gradient.dot(x) - t * c.want;
        let n = polygon.len();
        let mut inside = 0;
        for i in 0..n {
            let (a, b) = (polygon[i], polygon[(i + 1) % n]);
            let (va, vb) = (value(&a), value(&b));
            if va >= 0.0 {
                polygon.push(a);
                inside += 1;
            }
            if (va > 0.0 && vb < 0.0) || (va < 0.0 && vb > 0.0) {
                polygon.push(a + (b - a) * (va / (va - vb)));
            }
        }
        if inside == 0 && polygon.len() == n {
            return false;
        }
        polygon.drain(..n);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constraint(x: f64, y: f64, constant: f64, want: f64) -> Constraint {
        Constraint { gradient: Vector2::new(x, y), constant, want }
    }

    #[test]
    fn satisfiable_constraints_are_satisfied() {
        // x ≥ 1, y ≥ 1, x + y ≤ 3 within [−5, 5]².
        let c = [constraint(1.0, 0.0, 0.0, 1.0), constraint(0.0, 1.0, 0.0, 1.0), constraint(-1.0, -1.0, 4.0, 1.0)];
        let x = best_point(&c, [-5.0; 2], [5.0; 2]).expect("has a solution");
        assert!(x.x > 1.0 && x.y > 1.0 && x.x + x.y < 3.0);
    }

    #[test]
    fn the_least_violation_is_found() {
        // x ≥ t, −x − 2 ≥ t: best at x = −1, t = −1; the box ends at −½.
        let c = [constraint(1.0, 0.0, 0.0, 1.0), constraint(-1.0, 0.0, -2.0, 1.0)];
        let x = best_point(&c, [-5.0; 2], [5.0; 2]).expect("has a solution");
        assert!((x.x + 1.0).abs() < 0.11);
        let x = best_point(&c, [-0.5; 2], [0.5; 2]).expect("has a solution");
        assert!(x.x < -0.3);
        assert_eq!(best_point(&[], [-1.0; 2], [1.0; 2]), None);
        assert_eq!(best_point(&[constraint(f64::NAN, 0.0, f64::NAN, 1.0)], [-1.0; 2], [1.0; 2]), None);
    }
}
