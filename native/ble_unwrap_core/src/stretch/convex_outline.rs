//! A strictly convex polygon after a given closed curve.

use nalgebra::{Point2, Vector2};

use crate::predicates::orientation;

/// Corners of the hull that turn by less than this (in radians) are smoothed away: the arcs that
/// replace its sides need room to bend.
const LEAST_TURN: f64 = 0.05;
/// Greatest angle between the chord of a side and the tangent of its arc at an end.
const MAX_BEND: f64 = 0.2;
/// No two neighbours come closer than this share of the mean spacing on their side: with 10⁵ points
/// round a circle three neighbours still make a triangle of area 1e-15 of its square.
const LEAST_SPACING: f64 = 0.05;

/// `count` points on a counter-clockwise circle of the given radius, spaced in proportion to `lengths`
/// (of the edge from each point to the next). Very short edges are lengthened.
pub(super) fn circle(lengths: &[f64], radius: f64) -> Vec<Point2<f64>> {
    let at = spaced(lengths);
    at.iter()
        .take(lengths.len())
        .map(|s| {
            let (sin, cos) = (std::f64::consts::TAU * s).sin_cos();
            Point2::new(radius * cos, radius * sin)
        })
        .collect()
}

/// A strictly convex counter-clockwise polygon that follows the convex hull of a counter-clockwise
/// closed curve, with a point for each of the curve's. The hull's sides become flat arcs, on which the
/// points are spaced as `lengths`. `None` where the hull's corners do not come in the order of
/// the curve, which then crosses itself, or where rounding made the polygon not strictly convex.
pub(super) fn convex_outline(curve: &[Point2<f64>], lengths: &[f64]) -> Option<Vec<Point2<f64>>> {
    let n = curve.len();
    if n < 3 || curve.iter().any(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return None;
    }
    let mut corners = hull(curve);
    // In the order of the curve, beginning with the lowest number.
    let first = (0..corners.len()).min_by_key(|&k| corners[k])?;
    corners.rotate_left(first);
    if !corners.is_sorted() {
        return None;
    }
    // Drop the flattest corner until all turn enough.
    loop {
        if corners.len() < 3 {
            return None;
        }
        let turn = |k: usize| turn_at(curve, &corners, k);
        let flattest = (0..corners.len()).min_by(|&i, &j| turn(i).total_cmp(&turn(j)))?;
        if turn(flattest) >= LEAST_TURN {
            break;
        }
        corners.remove(flattest);
    }
    let m = corners.len();
    let mut outline = vec![Point2::origin(); n];
    for k in 0..m {
        let (i, j) = (corners[k], corners[(k + 1) % m]);
        let between = (j + n - i) % n;
        let bend = (turn_at(curve, &corners, k).min(turn_at(curve, &corners, (k + 1) % m)) / 3.0).min(MAX_BEND);
        let side: Vec<f64> = (0..between).map(|s| lengths[(i + s) % n]).collect();
        let chord = curve[j] - curve[i];
        let outwards = Vector2::new(chord.y, -chord.x);
        for (s, t) in spaced(&side).iter().take(between).enumerate() {
            // The arc's angle runs from −bend to bend.
            let (angle, half) = ((2.0 * t - 1.0) * bend, 2.0 * bend.sin());
            let along = 0.5 + angle.sin() / half;
            let height = (angle.cos() - bend.cos()) / half;
            outline[(i + s) % n] = if s == 0 { curve[i] } else { curve[i] + chord * along + outwards * height };
        }
    }
    is_strictly_convex(&outline).then_some(outline)
}

/// Whether a polygon is strictly convex and counter-clockwise, wound round once. Exact but for the count of
/// turns.
pub(super) fn is_strictly_convex(polygon: &[Point2<f64>]) -> bool {
    let n = polygon.len();
    let at = |i: usize| polygon[i % n];
    let turns_left = (0..n).all(|i| orientation(at(i), at(i + 1), at(i + 2)) > 0.0);
    // Turning left everywhere, it winds once if its direction passes the x axis upwards once.
    let rises = |i: usize| at(i + 1).y > at(i).y || (at(i + 1).y == at(i).y && at(i + 1).x > at(i).x);
    n >= 3 && turns_left && (0..n).filter(|&i| !rises(i) && rises(i + 1)).count() == 1
}

/// Positions from 0 to 1 of the ends of consecutive edges, the first at 0.
fn spaced(lengths: &[f64]) -> Vec<f64> {
    let total: f64 = lengths.iter().sum();
    let least = LEAST_SPACING * total / lengths.len().max(1) as f64;
    let usable = least.is_finite() && least > 0.0;
    let mut at = Vec::with_capacity(lengths.len() + 1);
    let mut sum = 0.0;
    at.push(0.0);
    for &l in lengths {
        sum += if usable { l.max(least) } else { 1.0 };
        at.push(sum);
    }
    at.iter_mut().for_each(|s| *s /= sum);
    at
}

/// Angle by which the polygon of `corners` turns at corner `k`.
fn turn_at(curve: &[Point2<f64>], corners: &[usize], k: usize) -> f64 {
    let m = corners.len();
    let [a, b, c] = [corners[(k + m - 1) % m], corners[k], corners[(k + 1) % m]].map(|i| curve[i]);
    (b - a).perp(&(c - b)).atan2((b - a).dot(&(c - b)))
}

/// Corners of the convex hull, counter-clockwise, without points inside its sides. O(n log n), exact.
fn hull(points: &[Point2<f64>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by(|&i, &j| {
        points[i].x.total_cmp(&points[j].x).then(points[i].y.total_cmp(&points[j].y)).then(i.cmp(&j))
    });
    order.dedup_by(|i, j| points[*i] == points[*j]);
    let half = |order: &mut dyn Iterator<Item = usize>| {
        let mut chain: Vec<usize> = Vec::new();
        for i in order {
            while let [.., a, b] = chain[..]
                && orientation(points[a], points[b], points[i]) <= 0.0
            {
                chain.pop();
            }
            chain.push(i);
        }
        chain.pop();
        chain
    };
    let mut corners = half(&mut order.iter().copied());
    corners.extend(half(&mut order.iter().rev().copied()));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_strictly_convex_with_many_and_uneven_points() {
        for n in [3, 4, 57, 100_000] {
            assert!(is_strictly_convex(&circle(&vec![1.0; n], 2.0)), "{n}");
            let uneven: Vec<f64> = (0..n).map(|i| if i % 3 == 0 { 1.0 } else { 1e-9 }).collect();
            assert!(is_strictly_convex(&circle(&uneven, 0.1)), "{n}");
            assert!(is_strictly_convex(&circle(&vec![0.0; n], 1.0)), "{n}");
        }
    }

    #[test]
    fn the_outline_of_a_square_keeps_its_corners() {
        let mut curve = Vec::new();
        for i in 0..40 {
            let s = f64::from(i % 10) / 10.0;
            curve.push(match i / 10 {
                0 => Point2::new(s, 0.0),
                1 => Point2::new(1.0, s),
                2 => Point2::new(1.0 - s, 1.0),
                _ => Point2::new(0.0, 1.0 - s),
            });
        }
        // A dent does not matter.
        curve[5] = Point2::new(0.5, 0.4);
        let outline = convex_outline(&curve, &[0.1; 40]).expect("simple curve");
        for corner in [0, 10, 20, 30] {
            assert_eq!(outline[corner], curve[corner]);
        }
        for (p, q) in outline.iter().zip(&curve) {
            assert!((p - q).norm() < 0.11 || *q == curve[5]);
        }
    }

    #[test]
    fn curves_that_wind_twice_or_backwards_have_no_outline() {
        let n = 40;
        let wound = |turns: f64| -> Vec<Point2<f64>> {
            (0..n)
                .map(|i| {
                    let a = std::f64::consts::TAU * turns * f64::from(i) / f64::from(n);
                    Point2::new((1.0 + 0.01 * f64::from(i)) * a.cos(), a.sin())
                })
                .collect()
        };
        assert!(convex_outline(&wound(1.0), &[1.0; 40]).is_some());
        assert!(convex_outline(&wound(2.0), &[1.0; 40]).is_none());
        assert!(convex_outline(&wound(-1.0), &[1.0; 40]).is_none());
        assert!(convex_outline(&[Point2::origin(); 4], &[1.0; 4]).is_none());
        assert!(!is_strictly_convex(&circle(&[1.0; 5], 1.0).into_iter().rev().collect::<Vec<_>>()));
        let star: Vec<_> = (0..5).map(|i| circle(&[1.0; 5], 1.0)[(2 * i) % 5]).collect();
        assert!(!is_strictly_convex(&star));
    }
}
