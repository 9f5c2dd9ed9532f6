//! Triangles of a polygon with five corners or more.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Vector3};

use super::measure::area_vector;
use crate::predicates::orientation;
use crate::progress::{Cancelled, Progress};

/// Most point-in-triangle tests for one polygon (half a second). What is left is then fanned out.
const MOST_TESTS: usize = 1 << 26;

/// An ear lower than this, relative to its longest side, is clipped only after all others.
const FLAT: f64 = 1e-4;

/// Appends n − 2 triangles, by corner, that triangulate a polygon of n ≥ 3 corners as a topological
/// disk, wound as the polygon.
///
/// Seen along the Newell normal, or along the axis nearest to it if the polygon is flat: dropping a
/// coordinate keeps what is straight straight, and tests are exact. The ear with the shortest
/// diagonal is clipped first, which halves a regular polygon evenly instead of fanning it. A simple
/// polygon gives triangles that do not overlap in that view, keyholes with coincident bridges
/// included; of a self-crossing or collapsed one only the topology is promised.
/// O(n log n + n·r) with r reflex corners.
pub(super) fn clip_ears(
    polygon: &[Point3<f64>],
    out: &mut Vec<[u32; 3]>,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let mut clipper = Clipper::new(polygon);
    // A corner can be forced at most once, after which the neighbours are queued again.
    while clipper.left > 3 {
        progress.check()?;
        if clipper.tests > MOST_TESTS {
            break;
        }
        let corner = clipper.next_ear().unwrap_or_else(|| clipper.least_bad());
        out.push(clipper.clip(corner));
    }
    clipper.fan(out);
    Ok(())
}

/// The part of a polygon that is not yet clipped.
struct Clipper<'a> {
    points: &'a [Point3<f64>],
    flat: Vec<[f64; 2]>,
    prev: Vec<u32>,
    next: Vec<u32>,
    clipped: Vec<bool>,
    /// Corners that are not strictly convex, perhaps with some that have been clipped or have
    /// become convex.
    reflex: Vec<u32>,
    is_reflex: Vec<bool>,
    /// Possible ears, shortest diagonal first; an entry counts while its stamp is the corner's.
    queue: BinaryHeap<Reverse<(bool, u64, u32, u32)>>,
    stamp: Vec<u32>,
    left: usize,
    tests: usize,
}

impl<'a> Clipper<'a> {
    fn new(points: &'a [Point3<f64>]) -> Self {
        let n = points.len();
        let mut clipper = Self {
            points,
            flat: project(points),
            prev: (0..n as u32).map(|i| if i == 0 { n as u32 - 1 } else { i - 1 }).collect(),
            next: (1..=n as u32).map(|i| if i == n as u32 { 0 } else { i }).collect(),
            clipped: vec![false; n],
            reflex: Vec::new(),
            is_reflex: vec![false; n],
            queue: BinaryHeap::with_capacity(n),
            stamp: vec![0; n],
            left: n,
            tests: 0,
        };
        for corner in 0..n {
            if clipper.turn(corner) <= 0.0 {
                clipper.is_reflex[corner] = true;
                clipper.reflex.push(corner as u32);
            }
        }
        for corner in 0..n {
            clipper.enqueue(corner);
        }
        clipper
    }

    /// The corner with its neighbours.
    fn ear(&self, corner: usize) -> [usize; 3] {
        [self.prev[corner] as usize, corner, self.next[corner] as usize]
    }

    /// Positive where the outline turns left.
    fn turn(&self, corner: usize) -> f64 {
        let [a, b, c] = self.ear(corner).map(|i| self.flat[i]);
        orientation(a, b, c)
    }

    /// The rank of an ear: flat ones last, then the shortest diagonal.
    fn rank(&self, corner: usize) -> (bool, u64) {
        let p = self.ear(corner).map(|i| self.points[i]);
        let longest = (0..3).map(|k| (p[(k + 1) % 3] - p[k]).norm_squared()).fold(0.0, f64::max);
        let flat = area_vector(p).norm() < FLAT * longest;
        // Non-negative numbers are ordered as their bits.
        (flat, (p[2] - p[0]).norm_squared().to_bits())
    }

    fn enqueue(&mut self, corner: usize) {
        self.stamp[corner] += 1;
        if !self.is_reflex[corner] {
            let (flat, diagonal) = self.rank(corner);
            self.queue.push(Reverse((flat, diagonal, corner as u32, self.stamp[corner])));
        }
    }

    fn next_ear(&mut self) -> Option<usize> {
        while let Some(Reverse((_, _, corner, stamp))) = self.queue.pop() {
            let corner = corner as usize;
            if !self.clipped[corner] && self.stamp[corner] == stamp && self.is_empty(corner) {
                return Some(corner);
            }
        }
        None
    }

    /// Whether no reflex corner lies in or on the triangle of a convex corner. Points that coincide
    /// with the triangle's corners do not count: they are the ends of bridges.
    fn is_empty(&mut self, corner: usize) -> bool {
        let ear = self.ear(corner);
        let [a, b, c] = ear.map(|i| self.flat[i]);
        let (clipped, is_reflex) = (&self.clipped, &self.is_reflex);
        self.reflex.retain(|&r| !clipped[r as usize] && is_reflex[r as usize]);
        self.tests += self.reflex.len();
        !self.reflex.iter().any(|&r| {
            let p = self.flat[r as usize];
            let corner_of_ear = ear.contains(&(r as usize)) || [a, b, c].contains(&p);
            !corner_of_ear && orientation(a, b, p) >= 0.0 && orientation(b, c, p) >= 0.0 && orientation(c, a, p) >= 0.0
        })
    }

    /// Where the outline crosses itself: a convex corner if there is one, then a straight one, the
    /// shortest diagonal first.
    fn least_bad(&mut self) -> usize {
        self.tests += self.left;
        let better = |corner: usize| {
            let turn = self.turn(corner);
            let side = if turn > 0.0 {
                0
            } else if turn == 0.0 {
                1
            } else {
                2
            };
            (side, self.rank(corner), corner)
        };
        (0..self.points.len()).filter(|&i| !self.clipped[i]).map(better).min().map_or(0, |best| best.2)
    }

    /// Takes a corner out and returns its triangle.
    fn clip(&mut self, corner: usize) -> [u32; 3] {
        let [a, b, c] = self.ear(corner);
        self.next[a] = c as u32;
        self.prev[c] = a as u32;
        self.clipped[b] = true;
        self.left -= 1;
        for corner in [a, c] {
            let reflex = self.turn(corner) <= 0.0;
            if reflex && !self.is_reflex[corner] {
                self.reflex.push(corner as u32);
            }
            self.is_reflex[corner] = reflex;
            self.enqueue(corner);
        }
        [a, b, c].map(|i| i as u32)
    }

    /// Appends the rest as a fan.
    fn fan(&self, out: &mut Vec<[u32; 3]>) {
        let Some(first) = self.clipped.iter().position(|&gone| !gone) else { return };
        let mut b = self.next[first];
        for _ in 2..self.left {
            let c = self.next[b as usize];
            out.push([first as u32, b, c]);
            b = c;
        }
    }
}

/// Greatest distance from the plane, relative to the extent, of polygons that count as flat.
const WARP: f64 = 1e-6;

/// The outline seen from the side on which it runs counter-clockwise.
fn project(points: &[Point3<f64>]) -> Vec<[f64; 2]> {
    let origin = points[0];
    let normal: Vector3<f64> =
        points.windows(2).map(|w| (w[0] - origin).cross(&(w[1] - origin))).fold(Vector3::zeros(), |sum, n| sum + n);
    let furthest =
        |direction: Vector3<f64>| points.iter().map(|p| (p - origin).dot(&direction).abs()).fold(0.0, f64::max);
    let unit = |k: usize| Vector3::ith(k, 1.0);
    let extent = (0..3).map(|k| furthest(unit(k))).fold(0.0, f64::max);
    let Some(direction) = normal.try_normalize(0.0) else {
        // No area: along the axis of least extent.
        let axis = (0..3).min_by(|&a, &b| furthest(unit(a)).total_cmp(&furthest(unit(b)))).unwrap_or(2);
        return drop_axis(points, axis, false);
    };
    let axis = direction.iamax();
    if furthest(direction) <= WARP * extent {
        return drop_axis(points, axis, direction[axis] < 0.0);
    }
    let u = unit((axis + 1) % 3).cross(&direction).normalize();
    let v = direction.cross(&u);
    points.iter().map(|p| p - origin).map(|p| [p.dot(&u), p.dot(&v)]).collect()
}

/// The outline along a coordinate axis, from its positive side or from behind.
fn drop_axis(points: &[Point3<f64>], axis: usize, behind: bool) -> Vec<[f64; 2]> {
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if behind {
        (u, v) = (v, u);
    }
    points.iter().map(|p| [p[u], p[v]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn triangles(points: &[Point3<f64>]) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        clip_ears(points, &mut out, &Progress::new()).expect("not cancelled");
        out
    }

    fn double_areas(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<f64> {
        triangles.iter().map(|t| area_vector(t.map(|i| points[i as usize])).z).collect()
    }

    /// All triangles upright and together as large as the outline: no overlap, nothing missing.
    fn assert_covers(points: &[Point3<f64>], double_area: f64) {
        let t = triangles(points);
        assert_eq!(t.len() + 2, points.len());
        let areas = double_areas(points, &t);
        assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - double_area).abs() < 1e-9 * double_area);
    }

    fn flat(outline: impl IntoIterator<Item = (f64, f64)>) -> Vec<Point3<f64>> {
        outline.into_iter().map(|(x, y)| Point3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn a_circle_of_500_corners() {
        let n = 500;
        let p = flat((0..n).map(|i| (TAU * f64::from(i) / f64::from(n)).sin_cos()).map(|(s, c)| (c, s)));
        assert_covers(&p, f64::from(n) * (TAU / f64::from(n)).sin());
        // Evenly halved: no corner carries a fan.
        let mut valence = vec![0; p.len()];
        triangles(&p).iter().flatten().for_each(|&c| valence[c as usize] += 1);
        assert!(valence.iter().all(|&v| v < 24), "{:?}", valence.iter().max());
    }

    #[test]
    fn a_comb() {
        let mut outline = vec![(40.0, -1.0), (40.0, 0.0)];
        for i in (0..40).rev().map(f64::from) {
            outline.extend([(i + 0.6, 0.0), (i + 0.6, 5.0), (i, 5.0), (i, 0.0)]);
        }
        outline.push((0.0, -1.0));
        assert_covers(&flat(outline), 2.0 * (40.0 + 40.0 * 3.0));
    }

    #[test]
    fn a_keyhole() {
        let p = flat([
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 3.0),
            (0.0, 3.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
        ]);
        assert_covers(&p, 16.0);
    }

    #[test]
    fn straight_sides_leave_no_flat_triangle() {
        let side = |k: i32| f64::from(k) / 8.0;
        let p = flat(
            (0..8)
                .map(|k| (side(k), 0.0))
                .chain((0..8).map(|k| (1.0, side(k))))
                .chain((0..8).map(|k| (1.0 - side(k), 1.0)))
                .chain((0..8).map(|k| (0.0, 1.0 - side(k)))),
        );
        assert_covers(&p, 2.0);
    }

    #[test]
    fn tilted_polygons_keep_their_winding() {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let p: Vec<Point3<f64>> = (0..7)
                    .map(|i| {
                        let (s, c) = (sign * TAU * f64::from(i) / 7.0).sin_cos();
                        let mut p = [0.1 * c, 0.0, 0.0];
                        p[(axis + 1) % 3] = c;
                        p[(axis + 2) % 3] = s;
                        Point3::from(p)
                    })
                    .collect();
                let sum = triangles(&p).iter().map(|t| area_vector(t.map(|i| p[i as usize]))).sum::<Vector3<f64>>();
                assert!(sum[axis] * sign > 0.0);
            }
        }
    }

    #[test]
    fn a_tilted_wave_is_seen_along_its_normal() {
        let (s, c) = 0.7_f64.sin_cos();
        let wave = |i: i32| {
            let t = TAU * f64::from(i) / 64.0;
            let (x, z) = (t.cos(), 0.8 * (5.0 * t).sin());
            Point3::new(c * x - s * z, t.sin(), s * x + c * z)
        };
        let p: Vec<_> = (0..64).map(wave).collect();
        let normal = Vector3::new(-s, 0.0, c);
        let t = triangles(&p);
        assert!(t.iter().all(|t| area_vector(t.map(|i| p[i as usize])).dot(&normal) > 0.0));
    }

    proptest! {
        #[test]
        fn any_outline_gives_a_disk(points in prop::collection::vec((-3i32..4, -3i32..4, 0i32..2), 3..40)) {
            let p: Vec<_> = points.iter().map(|&(x, y, z)| Point3::new(f64::from(x), f64::from(y), f64::from(z))).collect();
            let t = triangles(&p);
            prop_assert_eq!(t.len() + 2, p.len());
            let mut outline: Vec<u32> = (0..p.len() as u32).collect();
            // Undo: every triangle must be an ear of what is left when it was clipped.
            for (i, &[a, b, c]) in t.iter().enumerate() {
                if i + 1 == t.len() {
                    prop_assert_eq!(outline.len(), 3);
                    prop_assert!([a, b, c].iter().all(|v| outline.contains(v)));
                    break;
                }
                let at = outline.iter().position(|&v| v == b).expect("still there");
                let n = outline.len();
                prop_assert_eq!([outline[(at + n - 1) % n], outline[(at + 1) % n]], [a, c]);
                outline.remove(at);
            }
        }

        #[test]
        fn star_shaped_outlines_are_covered(radii in prop::collection::vec(0.2f64..1.0, 5..60)) {
            let n = radii.len() as f64;
            let p = flat(radii.iter().enumerate().map(|(i, r)| {
                let (s, c) = (TAU * i as f64 / n).sin_cos();
                (r * c, r * s)
            }));
            let area: f64 = (0..p.len()).map(|i| p[i].coords.xy().perp(&p[(i + 1) % p.len()].coords.xy())).sum();
            assert_covers(&p, area);
        }
    }
}
