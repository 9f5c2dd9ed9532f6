//! In which angles a chart is tried.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point2, Vector2};

use super::Rotation;
use super::outline::{Edge, Outline};

/// A chart is laid along the axes where more than this share of its border then lies along them: an octagon has half, a triangle of equal
/// sides a third, what has grown a twentieth.
const ALIGNED: f64 = 0.25;
/// An outline is symmetric if the mirror image of each point is so near to it, in units of its extent.
const MIRRORED: f64 = 0.01;
/// So many points of an outline are mirrored at most.
const MIRRORED_POINTS: usize = 200;
/// The moments of a border along its two axes differ by at least this share of their sum, or the axes are anybody's guess.
const LEAST_LONGER: f64 = 0.02;
/// What is up to so far from an axis counts as along it, in radians.
const ALONG: f64 = PI / 180.0;

/// Cosine and sine of the base angles of a chart; the other poses are quarter turns of these.
///
/// The first lays the minimum-area rectangle flat ([`Rotation::Any`]) or is the given pose. A chart that is laid along the axes or upright has
/// no other.
pub(super) fn base_turns(outline: &Outline, rotation: Rotation, angles: usize) -> Vec<[f64; 2]> {
    match rotation {
        Rotation::Aligned => {
            if let Some(turn) = aligned_turn(outline).or_else(|| symmetric_turn(outline)) {
                return vec![turn];
            }
        }
        Rotation::Any => (),
        Rotation::Quarter | Rotation::None => return vec![[1.0, 0.0]],
    }
    let first = flat_turn(outline);
    let turned = |k: usize| {
        let (s, c) = (k as f64 / angles as f64 * FRAC_PI_2).sin_cos();
        [first[0] * c - first[1] * s, first[1] * c + first[0] * s]
    };
    std::iter::once(first).chain((1..angles).map(turned)).collect()
}

/// Whether a chart keeps the angles that [`base_turns`] gives it, but for quarter turns.
pub(super) fn keeps_turn(outline: &Outline, rotation: Rotation) -> bool {
    match rotation {
        Rotation::Aligned => aligned_turn(outline).or_else(|| symmetric_turn(outline)).is_some(),
        Rotation::Any => false,
        Rotation::Quarter | Rotation::None => true,
    }
}

/// The turn that lays as much of an outline's border along the axes as can be, where that is much of it. O(n log n).
pub(super) fn aligned_turn(outline: &Outline) -> Option<[f64; 2]> {
    let side = |edge: &Edge| outline.points[edge.to as usize] - outline.points[edge.from as usize];
    // Directions up to quarter turns, and lengths.
    let mut sides: Vec<(f64, f64)> = outline
        .edges
        .iter()
        .map(side)
        .filter(|side| side.norm() > 0.0)
        .map(|side| (side.y.atan2(side.x).rem_euclid(FRAC_PI_2), side.norm()))
        .collect();
    sides.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let whole: f64 = sides.iter().map(|side| side.1).sum();
    // Those from `first` on that are within twice `ALONG` of it, around the quarter turn.
    let n = sides.len();
    let ahead = |first: usize, k: usize| (sides[k % n].0 - sides[first].0).rem_euclid(FRAC_PI_2);
    let (mut last, mut length) = (0, 0.0);
    let mut best = (0.0, 0..0);
    for first in 0..n {
        last = last.max(first);
        while last < first + n && ahead(first, last) <= 2.0 * ALONG {
            length += sides[last % n].1;
            last += 1;
        }
        if length > best.0 {
            best = (length, first..last);
        }
        length -= sides[first].1;
    }
    let (length, window) = best;
    if length <= ALIGNED * whole {
        return None;
    }
    let first = window.start;
    let mean = window.map(|k| sides[k % n].1 * ahead(first, k)).sum::<f64>() / length;
    let (sin, cos) = (sides[first].0 + mean).sin_cos();
    Some([cos, -sin])
}

/// The turn that makes the mirror axis of an outline upright, if it has one. Such an axis is one of the two along which its border spreads most
/// and least; a disc has many, and needs none. O(n).
pub(super) fn symmetric_turn(outline: &Outline) -> Option<[f64; 2]> {
    let sides = || outline.edges.iter().map(|edge| [edge.from, edge.to].map(|v| outline.points[v as usize]));
    let whole: f64 = sides().map(|[p, q]| (q - p).norm()).sum();
    let mean = sides().map(|[p, q]| (p.coords + q.coords) * (0.5 * (q - p).norm())).sum::<Vector2<f64>>() / whole;
    // Moments of second order.
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for [p, q] in sides() {
        let (along, at) = (q - p, 0.5 * (p.coords + q.coords) - mean);
        let length = along.norm();
        // Of the middle, and of the side around it.
        xx += length * (at.x * at.x + along.x * along.x / 12.0);
        xy += length * (at.x * at.y + along.x * along.y / 12.0);
        yy += length * (at.y * at.y + along.y * along.y / 12.0);
    }
    let (apart, spread) = ((xx - yy).hypot(2.0 * xy), xx + yy);
    if spread.is_nan() || apart <= LEAST_LONGER * spread {
        return None;
    }
    let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    let step = outline.points.len().div_ceil(MIRRORED_POINTS).max(1);
    let is_axis = |along: Vector2<f64>| {
        let image = |p: &Point2<f64>| {
            let at = p.coords - mean;
            Point2::from(mean + along * (2.0 * along.dot(&at)) - at)
        };
        let is_near = |p: Point2<f64>| sides().any(|side| distance(p, side) <= MIRRORED);
        outline.points.iter().step_by(step).map(image).all(is_near)
    };
    let axis = [Vector2::new(cos, sin), Vector2::new(-sin, cos)].into_iter().find(|&along| is_axis(along))?;
    Some([axis.y, axis.x])
}

/// From a point to a side.
fn distance(p: Point2<f64>, [from, to]: [Point2<f64>; 2]) -> f64 {
    let (side, at) = (to - from, p - from);
    let share = (side.dot(&at) / side.norm_squared()).clamp(0.0, 1.0);
    // A side without length.
    if share.is_nan() { at.norm() } else { (at - side * share).norm() }
}

/// The turn in which a chart alone fits a rectangle of `inner` width and height at the largest scale, exactly.
///
/// Between two angles at which a side of the convex hull is along an axis, width and height are each the distance of two
/// corners along an axis, a concave function of the angle. The larger of the two, each relative to its room, is therefore
/// least at such an angle, or where both are equal. O(h²) for the h corners of the hull.
pub(super) fn turn_alone(outline: &Outline, inner: [f64; 2]) -> [f64; 2] {
    let hull = convex_hull(&outline.points);
    let n = hull.len();
    let turned = |[c, s]: [f64; 2], p: &Point2<f64>| [c * p.x - s * p.y, s * p.x + c * p.y];
    // The corners that are least and greatest along each axis.
    let ends = |turn: [f64; 2]| {
        [0, 1].map(|k| {
            let along = |i: &usize| turned(turn, &hull[*i])[k];
            let least = (0..n).reduce(|a, b| if along(&b) < along(&a) { b } else { a });
            let greatest = (0..n).reduce(|a, b| if along(&b) > along(&a) { b } else { a });
            least.zip(greatest).map_or(Vector2::zeros(), |(a, b)| hull[b] - hull[a])
        })
    };
    let scale = |turn: [f64; 2]| {
        let [across, up] = ends(turn).map(Point2::from);
        (inner[0] / turned(turn, &across)[0]).min(inner[1] / turned(turn, &up)[1])
    };
    let side = |k: usize| hull[(k + 1) % n] - hull[k];
    let quarters = |angle: f64| [angle.rem_euclid(PI), (angle + FRAC_PI_2).rem_euclid(PI)];
    let mut angles: Vec<f64> = (0..n).flat_map(|k| quarters(-side(k).y.atan2(side(k).x))).collect();
    angles.sort_unstable_by(f64::total_cmp);
    angles.dedup();
    let flat = flat_turn(outline);
    let mut best = (scale(flat), flat);
    let mut try_turn = |turn: [f64; 2]| {
        let scale = scale(turn);
        if scale > best.0 * (1.0 + 1e-9) {
            best = (scale, turn);
        }
    };
    for (k, &angle) in angles.iter().enumerate() {
        let (s, c) = angle.sin_cos();
        try_turn([c, s]);
        let next = angles.get(k + 1).copied().unwrap_or(angles[0] + PI);
        let (s, c) = (0.5 * (angle + next)).sin_cos();
        let [across, up] = ends([c, s]);
        // Where (cos across.x - sin across.y) / inner.0 is (sin up.x + cos up.y) / inner.1.
        let equal = [inner[1] * across.y + inner[0] * up.x, inner[1] * across.x - inner[0] * up.y];
        let length = equal[0].hypot(equal[1]);
        if length > 0.0 {
            try_turn(equal.map(|x| x / length));
        }
    }
    best.1
}

/// Turn that lays the rectangle of least area around the outline along the axes, its longer side
/// along x. Freeman and Shapira: Determining the minimum-area encasing rectangle for an arbitrary
/// closed curve, CACM 18(7), 1975 (one side lies on an edge of the hull); rotating calipers after
/// Toussaint, 1983. O(n log n).
fn flat_turn(outline: &Outline) -> [f64; 2] {
    let hull = convex_hull(&outline.points);
    let n = hull.len();
    if n < 2 {
        return [1.0, 0.0];
    }
    let edge = |k: usize| hull[(k + 1) % n] - hull[k];
    let (mut right, mut top, mut left) = (0, 0, 0);
    let mut best = (f64::INFINITY, [1.0, 0.0]);
    for k in 0..n {
        let length = edge(k).norm();
        if length <= 0.0 {
            continue;
        }
        let along = edge(k) / length;
        let up = Vector2::new(-along.y, along.x);
        // Each caliper only advances: at most n steps altogether, bounded here by 2n for rounding.
        let advance = |at: &mut usize, dir: Vector2<f64>| {
            for _ in 0..2 * n {
                if edge(*at % n).dot(&dir) <= 0.0 {
                    break;
                }
                *at += 1;
            }
        };
        right = right.max(k);
        advance(&mut right, along);
        top = top.max(right);
        advance(&mut top, up);
        left = left.max(top);
        advance(&mut left, -along);
        let width = (hull[right % n] - hull[left % n]).dot(&along);
        let height = (hull[top % n] - hull[k]).dot(&up);
        if width * height < best.0 {
            // Turn `along` onto x, or onto −y where the rectangle is taller than wide.
            let turn = if width >= height { [along.x, -along.y] } else { [along.y, along.x] };
            best = (width * height, turn);
        }
    }
    best.1
}

/// Convex hull, counter-clockwise, without collinear points (Andrew's monotone chain).
pub(super) fn convex_hull(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull: Vec<Point2<f64>> = Vec::new();
    let chain = |hull: &mut Vec<Point2<f64>>, keep: usize, p: Point2<f64>| {
        while hull.len() > keep {
            let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
            if (b - a).perp(&(p - a)) > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(p);
    };
    for &p in &sorted {
        chain(&mut hull, 1, p);
    }
    let lower = hull.len();
    for &p in sorted.iter().rev().skip(1) {
        chain(&mut hull, lower, p);
    }
    hull.pop();
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackItem;
    use proptest::prelude::*;

    fn outline(points: &[Point2<f64>]) -> Outline {
        let triangles: Vec<[u32; 3]> = (1..points.len() as u32 - 1).map(|k| [0, k, k + 1]).collect();
        Outline::new(&PackItem { points, triangles: &triangles }, 0).expect("valid")
    }

    fn size(points: &[Point2<f64>], [c, s]: [f64; 2]) -> [f64; 2] {
        let mut r = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
        for p in points {
            let q = [c * p.x - s * p.y, s * p.x + c * p.y];
            r = [r[0].min(q[0]), r[1].min(q[1]), r[2].max(q[0]), r[3].max(q[1])];
        }
        [r[2] - r[0], r[3] - r[1]]
    }

    #[test]
    fn a_turned_rectangle_is_laid_flat() {
        for angle in [0.0, 0.3, 1.2, 2.0, 3.0, 4.0, 5.5] {
            let turn = nalgebra::Rotation2::new(angle);
            let points: Vec<_> = [[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [0.0, 2.0]]
                .iter()
                .map(|&[x, y]| turn * Point2::new(x, y))
                .collect();
            let [w, h] = size(&points, flat_turn(&outline(&points)));
            assert!((w - 5.0).abs() < 1e-9 && (h - 2.0).abs() < 1e-9, "{w} by {h} at {angle}");
        }
    }

    #[test]
    fn alone_a_strip_takes_the_diagonal_and_a_square_the_square() {
        let strip = outline(&[[0.0, 0.0], [9.0, 0.0], [9.0, 0.01], [0.0, 0.01]].map(|[x, y]| Point2::new(x, y)));
        let [c, s] = turn_alone(&strip, [300.0, 100.0]);
        let [w, h] = size(&strip.points, [c, s]);
        assert!((300.0 / w).min(100.0 / h) > 0.99 * 300.0_f64.hypot(100.0), "{w} by {h}");
        let square = outline(&[[0.0, 0.0], [3.0, 4.0], [-1.0, 7.0], [-4.0, 3.0]].map(|[x, y]| Point2::new(x, y)));
        let [w, h] = size(&square.points, turn_alone(&square, [100.0, 100.0]));
        assert!((w * square.unit() - 5.0).abs() < 1e-9 && (h * square.unit() - 5.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn no_turn_gives_a_smaller_rectangle(coords in prop::collection::vec((-1.0f64..1.0, -1.0f64..1.0), 3..20)) {
            let points: Vec<_> = coords.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            let o = outline(&points);
            let [w, h] = size(&o.points, flat_turn(&o));
            prop_assert!(w >= h - 1e-12);
            for k in 0..500 {
                let (s, c) = (k as f64 * FRAC_PI_2 / 500.0).sin_cos();
                let [a, b] = size(&o.points, [c, s]);
                prop_assert!(w * h <= a * b + 1e-12);
            }
        }
    }

    #[test]
    fn charts_with_straight_borders_are_laid_along_the_axes_and_round_ones_at_any_angle() {
        // An L, turned by any angle.
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        for angle in [0.0_f64, 0.3, 0.8, 1.2, FRAC_PI_2 - 1e-9, 4.0] {
            let (s, c) = angle.sin_cos();
            let points = corners.map(|[x, y]| Point2::new(c * x - s * y, s * x + c * y));
            let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
            let o = Outline::new(&PackItem { points: &points, triangles: &triangles }, 0).expect("valid");
            let turns = base_turns(&o, Rotation::Aligned, 5);
            assert_eq!(turns.len(), 1, "no other angle");
            let [c, s] = turns[0];
            for edge in &o.edges {
                let side = o.points[edge.to as usize] - o.points[edge.from as usize];
                let turned = [c * side.x - s * side.y, s * side.x + c * side.y];
                assert!(turned[0].abs().min(turned[1].abs()) < 1e-9, "{turned:?} at {angle}");
            }
        }
        for sides in [5, 20, 40] {
            let corner = |k: usize| {
                let (s, c) = (2.0 * PI * k as f64 / f64::from(sides)).sin_cos();
                Point2::new(c, s)
            };
            let round: Vec<_> = (0..sides as usize).map(corner).collect();
            assert_eq!(aligned_turn(&outline(&round)), None, "{sides} sides");
            assert_eq!(base_turns(&outline(&round), Rotation::Aligned, 5).len(), 5);
        }
    }

    #[test]
    fn a_symmetric_chart_is_laid_upright_or_level_and_others_are_not() {
        // A drop, mirrored in its long axis; and the same with a dent on one side.
        let drop = |angle: f64, dent: f64| -> Vec<Point2<f64>> {
            let (s, c) = angle.sin_cos();
            let at = |k: u32| {
                let (sin, cos) = (2.0 * PI * f64::from(k) / 48.0).sin_cos();
                let shorter = 1.0 - dent * (-((sin - 0.8) / 0.2).powi(2)).exp();
                let (x, y) = ((2.0 + cos) * cos, shorter * sin);
                Point2::new(c * x - s * y, s * x + c * y)
            };
            (0..48).map(at).collect()
        };
        for angle in [0.0_f64, 0.4, 1.1, 2.5] {
            let [c, s] = symmetric_turn(&outline(&drop(angle, 0.0))).expect("symmetric");
            let axis = [c * angle.cos() - s * angle.sin(), s * angle.cos() + c * angle.sin()];
            assert!(axis[0].abs() < 1e-6, "upright: {axis:?} at {angle}");
            assert_eq!(symmetric_turn(&outline(&drop(angle, 0.3))), None);
        }
        assert_eq!(symmetric_turn(&Outline::new(&PackItem { points: &[], triangles: &[] }, 0).expect("empty")), None);
    }

    #[test]
    fn turns_are_rotations_and_as_many_as_asked() {
        let points = [Point2::new(0.0, 0.0), Point2::new(3.0, 1.0), Point2::new(1.0, 2.0)];
        let o = outline(&points);
        let turns = base_turns(&o, Rotation::Any, 3);
        assert_eq!(turns.len(), 3);
        assert!(turns.iter().all(|[c, s]| (c * c + s * s - 1.0).abs() < 1e-14));
        assert_eq!(base_turns(&o, Rotation::Any, 1).len(), 1);
        assert_eq!(base_turns(&o, Rotation::Quarter, 3), vec![[1.0, 0.0]]);
        let empty = Outline::new(&PackItem { points: &[], triangles: &[] }, 0).expect("empty");
        for rotation in [Rotation::Any, Rotation::Aligned] {
            assert_eq!(base_turns(&empty, rotation, 1), vec![[1.0, 0.0]]);
        }
    }
}
