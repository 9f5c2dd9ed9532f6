//! The sides of a chart: runs of its border between corners that are straight on the surface or nearly so in the plane.

use std::f64::consts::{FRAC_PI_4, PI};

use nalgebra::{Point2, Vector2};

use crate::mesh::{HalfedgeId, TriMesh, VertexId, measure};

/// A border has a corner where it turns by more than so many radians on the surface: twelve sides make a circle, eight an octagon.
const CORNER: f64 = PI / 5.5;
/// A side of less than this share of a chart's border is one only between two corners that turn the same way by more than [`END`], as the
/// end of a strip is: the steps of a staircase are none.
const LEAST_LENGTH: f64 = 0.03;
/// In radians; see [`LEAST_LENGTH`].
const END: f64 = PI / 3.0;
/// Along a side the border turns by no more than so many radians in all, on the surface or in the plane: what turns more in both is an arc.
const MOST_TURN: f64 = FRAC_PI_4;
/// The ends of a side are apart by at least this share of its length.
const LEAST_CHORD: f64 = 0.85;
/// A side belongs to the axis that its ends lie along up to so many radians.
const MOST_OFF: f64 = PI / 9.0;

/// An axis of the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    /// The side runs from left to right: all of it has one y.
    X,
    /// The side runs up or down: all of it has one x.
    Y,
}

impl Axis {
    /// What of a vector is across the axis.
    pub(super) fn across(self, v: Vector2<f64>) -> f64 {
        match self {
            Self::X => v.y,
            Self::Y => v.x,
        }
    }
}

/// The border's half-edges between two corners of a chart, in order.
pub(super) type Side = Vec<HalfedgeId>;

/// The sides of a chart's border, loop by loop: between two corners it is straight on the surface or nearly so in the plane. Arcs and loops
/// without corners are none, nor are the steps of a staircase. O(n).
pub(super) fn sides(mesh: &TriMesh, uv: &[Point2<f64>]) -> Vec<Side> {
    // At the border the angles around a vertex make half a turn where it is straight.
    let defects = measure::angle_defects(mesh);
    let shortest = LEAST_LENGTH * mesh.boundary_length();
    let along = |h: HalfedgeId| uv[mesh.to(h).index()] - uv[mesh.from(h).index()];
    let mut sides = Vec::new();
    for around in mesh.boundary_loops().iter() {
        let n = around.len();
        let turns: Vec<f64> = around.iter().map(|&h| defects[mesh.from(h).index()] - PI).collect();
        let in_plane = |k: usize| {
            let (before, after) = (along(around[(k + n - 1) % n]), along(around[k]));
            before.perp(&after).atan2(before.dot(&after))
        };
        let corners: Vec<usize> = (0..n).filter(|&k| turns[k].abs() > CORNER).collect();
        for (at, &first) in corners.iter().enumerate() {
            let last = corners[(at + 1) % corners.len()];
            let length = (last + n - first - 1) % n + 1;
            let side: Side = (first..first + length).map(|k| around[k % n]).collect();
            let inner = || (first + 1..first + length).map(|k| k % n);
            let is_straight =
                turning(inner().map(|k| turns[k])) <= MOST_TURN || turning(inner().map(in_plane)) <= MOST_TURN;
            let is_end = turns[first] > END && turns[last] > END;
            let is_long = || side.iter().map(|&h| mesh.edge_length(h)).sum::<f64>() >= shortest;
            if is_straight && (is_end || is_long()) {
                sides.push(side);
            }
        }
    }
    sides
}

/// How far a run turns between the direction that is most to the left and the one that is most to the right.
fn turning(turns: impl Iterator<Item = f64>) -> f64 {
    let (mut turned, mut least, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
    for turn in turns {
        turned += turn;
        (least, most) = (least.min(turned), most.max(turned));
    }
    most - least
}

/// A turn of the plane, and the sides that it brings near an axis.
pub(super) struct Pose {
    /// Cosine and sine.
    pub(super) turn: [f64; 2],
    pub(super) sides: Vec<(Axis, Side)>,
}

/// The turn that brings sides as near to the axes as can be. O(n).
pub(super) fn pose(mesh: &TriMesh, uv: &[Point2<f64>], sides: Vec<Side>) -> Pose {
    let at = |v: VertexId| uv[v.index()];
    let chord = |side: &Side| match side[..] {
        [first, .., last] => at(mesh.to(last)) - at(mesh.from(first)),
        [only] => at(mesh.to(only)) - at(mesh.from(only)),
        [] => Vector2::zeros(),
    };
    let length = |side: &Side| side.iter().map(|&h| (at(mesh.to(h)) - at(mesh.from(h))).norm()).sum::<f64>();
    let straight: Vec<(Vector2<f64>, Side)> = sides
        .into_iter()
        .map(|side| (chord(&side), side))
        .filter(|(chord, side)| chord.norm() > LEAST_CHORD * length(side))
        .collect();
    // Directions up to quarter turns: four times the angle, by length.
    let (mut cos, mut sin) = (0.0, 0.0);
    for (chord, _) in &straight {
        let (s, c) = (4.0 * chord.y.atan2(chord.x)).sin_cos();
        cos += chord.norm() * c;
        sin += chord.norm() * s;
    }
    let (s, c) = (-0.25 * sin.atan2(cos)).sin_cos();
    let along = |(chord, side): (Vector2<f64>, Side)| {
        let turned = Vector2::new(c * chord.x - s * chord.y, s * chord.x + c * chord.y);
        let axis = if turned.x.abs() >= turned.y.abs() { Axis::X } else { Axis::Y };
        (axis.across(turned).abs() <= MOST_OFF.sin() * turned.norm()).then_some((axis, side))
    };
    Pose { turn: [c, s], sides: straight.into_iter().filter_map(along).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{annulus, grid};
    use nalgebra::Point3;

    fn from_above(mesh: &TriMesh) -> Vec<Point2<f64>> {
        mesh.positions().iter().map(|p| p.xy()).collect()
    }

    #[test]
    fn a_sheet_has_four_sides_however_it_is_rolled_up_and_a_ring_has_none() {
        let flat = grid(12, 8, |x, y| Point3::new(x, y, 0.0));
        let rolled = grid(12, 8, |x, y| Point3::new(4.0 * (0.25 * x).cos(), 4.0 * (0.25 * x).sin(), y));
        for mesh in [&flat, &rolled] {
            let found = sides(mesh, &from_above(mesh));
            let mut lengths: Vec<usize> = found.iter().map(Vec::len).collect();
            lengths.sort_unstable();
            assert_eq!(lengths, [8, 8, 12, 12]);
            for side in &found {
                assert!(side.windows(2).all(|pair| mesh.to(pair[0]) == mesh.from(pair[1])));
            }
        }
        let ring = annulus(40, 4);
        assert!(sides(&ring, &from_above(&ring)).is_empty());
    }

    #[test]
    fn an_arc_is_no_side_and_the_ends_of_a_thin_strip_are() {
        // A quarter of a ring: its ends are straight, its arcs turn by a quarter.
        let ring = grid(24, 4, |x, y| {
            let (s, c) = (std::f64::consts::FRAC_PI_2 * x / 24.0).sin_cos();
            Point3::new((12.0 - y) * c, (12.0 - y) * s, 0.0)
        });
        assert_eq!(sides(&ring, &from_above(&ring)).iter().map(Vec::len).collect::<Vec<_>>(), [4, 4]);
        let strip = grid(40, 1, |x, y| Point3::new(x, 0.5 * y, 0.0));
        assert_eq!(sides(&strip, &from_above(&strip)).len(), 4);
    }

    #[test]
    fn the_steps_of_a_staircase_are_no_sides() {
        // What is below a flight of steps.
        let below = grid(40, 40, |x, y| Point3::new(x, y, 0.0));
        let under: Vec<_> = below
            .faces()
            .filter(|f| {
                let middle = below.triangle_positions(*f).iter().fold(Vector2::zeros(), |m, p| m + p.coords.xy() / 3.0);
                middle.x.floor() + middle.y.floor() < 40.0
            })
            .collect();
        let (mesh, _) = below.submesh(&under, |_| false);
        let found = sides(&mesh, &from_above(&mesh));
        let mut lengths: Vec<usize> = found.iter().map(Vec::len).collect();
        lengths.sort_unstable();
        assert_eq!(lengths, [1, 1, 40, 40], "the ends of the flight, and the two sides that are straight");
    }

    #[test]
    fn a_pose_lays_sides_along_the_axes_whatever_the_map_was_turned_by() {
        let mesh = grid(12, 8, |x, y| Point3::new(2.0 * x, y, 0.0));
        for angle in [0.0_f64, 0.3, -0.7, 2.0] {
            let (s, c) = angle.sin_cos();
            let uv: Vec<Point2<f64>> =
                mesh.positions().iter().map(|p| Point2::new(c * p.x - s * p.y, s * p.x + c * p.y)).collect();
            let Pose { turn: [c, s], sides } = pose(&mesh, &uv, sides(&mesh, &uv));
            assert_eq!(sides.len(), 4);
            for (axis, side) in &sides {
                for h in side {
                    let along = uv[mesh.to(*h).index()] - uv[mesh.from(*h).index()];
                    let turned = Vector2::new(c * along.x - s * along.y, s * along.x + c * along.y);
                    assert!(axis.across(turned).abs() < 1e-12);
                }
            }
        }
    }
}
