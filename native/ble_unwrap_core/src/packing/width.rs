//! How wide a chart is.

use nalgebra::Point2;

use super::pose::convex_hull;

/// The least distance of two parallel lines with all points between them. Along one side of the convex hull runs one of
/// them (Houle, Toussaint: Computing the width of a set, IEEE Transactions on Pattern Analysis and Machine Intelligence
/// 10(5), 1988). O(n log n).
pub(crate) fn least_width(points: &[Point2<f64>]) -> f64 {
    let hull = convex_hull(points);
    let n = hull.len();
    if n < 3 {
        return 0.0;
    }
    let mut least = f64::INFINITY;
    let mut far = 1;
    for k in 0..n {
        let (from, side) = (hull[k], hull[(k + 1) % n] - hull[k]);
        let height = |at: usize| side.perp(&(hull[at % n] - from));
        // The farthest corner only ever advances; the bound is for rounding.
        for _ in 0..n {
            if height(far + 1) <= height(far) {
                break;
            }
            far += 1;
        }
        least = least.min(height(far) / side.norm());
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_rectangle_is_as_wide_as_its_shorter_side_however_it_lies() {
        for angle in [0.0, 0.3, 1.2, 2.0, 4.0] {
            let turn = nalgebra::Rotation2::new(angle);
            let points = [[0.0, 0.0], [9.0, 0.0], [9.0, 0.5], [0.0, 0.5], [4.0, 0.2]].map(|p| turn * Point2::from(p));
            assert!((least_width(&points) - 0.5).abs() < 1e-12);
        }
        let triangle = [[0.0, 0.0], [2.0, 0.0], [1.0, 3.0f64.sqrt()]].map(Point2::from);
        assert!((least_width(&triangle) - 3.0f64.sqrt()).abs() < 1e-12);
        assert_eq!(least_width(&[]), 0.0);
        assert_eq!(least_width(&[[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]].map(Point2::from)), 0.0);
    }

    proptest! {
        #[test]
        fn no_direction_has_less(coords in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 3..20)) {
            let points: Vec<_> = coords.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            let width = least_width(&points);
            let across = |angle: f64| {
                let (s, c) = angle.sin_cos();
                let along = || points.iter().map(|p| c * p.x + s * p.y);
                along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
            };
            let steps: Vec<f64> = (0..2000).map(|k| across(f64::from(k) * std::f64::consts::PI / 2000.0)).collect();
            let least = steps.iter().copied().fold(f64::MAX, f64::min);
            prop_assert!(width <= least + 1e-12 && width >= least - 0.01, "{width} for {least}");
        }
    }
}
