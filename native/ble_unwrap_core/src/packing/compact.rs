//! Charts pressed together along their outlines: moved and turned by steps that let all of them grow.
//!
//! A placement by cells has them to about a cell, in few angles. From there on every step is a linear program: the
//! variables are how far each chart moves along either axis, by how much it turns, and by how much all grow; an
//! inequality for each vertex near another chart's side says that the distance between them stays at least the margin;
//! and all grow by as much as that allows. Distances to a side are convex functions of where a chart is, so that their
//! linear part never promises too much as long as nothing turns or grows; what these bend is made up for by the next,
//! smaller step. Steps end where nothing grows any more: charts have got stuck, each held by those around it.
//!
//! **References.** Li, Milenkovic: Compaction and separation algorithms for non-convex polygons and their applications,
//! European Journal of Operational Research 84(3), 1995 (linear programs over near pairs of vertices and sides);
//! Torquato, Jiao: Robust algorithm to generate a diverse class of dense disordered and ordered sphere packings via
//! linear programming, Physical Review E 82, 061302, 2010 (growth as the objective, within a region of trust).

use nalgebra::Vector2;

use super::body::{Body, Piece};
use super::linear_program::{Inequalities, maximise};
use super::sketch::Spot;
use crate::progress::{Cancelled, Progress};

/// Distances up to so many times the longest step beyond the margin are part of a linear program.
const REACH: f64 = 4.0;
/// A step is halved where all grow by less than this share of it.
const SLOW: f64 = 0.1;
/// Steps end where all grow by less than this share of the largest chart.
const NEGLIGIBLE: f64 = 1e-5;

/// Where charts are and how large.
#[derive(Clone, Debug)]
pub(super) struct Arrangement {
    /// Texels to a unit of the chart plane.
    pub(super) density: f64,
    /// Each chart's angle, and its middle in texels from the corner of the frame.
    pub(super) spots: Vec<Spot>,
}

/// What steps keep to.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// Sides of the frame in texels, from its corner.
    pub(super) sides: [f64; 2],
    /// Least distance of charts to the border of the frame, and to each other, in texels.
    pub(super) border: f64,
    pub(super) gap: f64,
    /// Greatest density.
    pub(super) ceiling: f64,
}

/// How long steps are, in texels, and how far distances may fall short in what is taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    pub(super) longest: f64,
    pub(super) shortest: f64,
    pub(super) steps: usize,
    pub(super) tolerance: f64,
}

/// What came of a start.
pub(super) struct Grown {
    /// The densest arrangement on the way that keeps all distances but for the tolerance, if any does.
    pub(super) densest: Option<Arrangement>,
    /// Inequalities of all steps: what they cost grows with that.
    pub(super) work: usize,
}

/// Charts as bodies, in a frame.
pub(super) struct Compaction<'a> {
    pub(super) bodies: &'a [Body],
    /// Whether each may be turned.
    pub(super) turns: &'a [bool],
    pub(super) frame: &'a Frame,
    pub(super) progress: &'a Progress,
}

/// Distances of an arrangement.
struct Contacts {
    inequalities: Inequalities,
    /// By how much the least distance is short, in texels; 0 where none is.
    short: f64,
    /// Whether two charts meet.
    meet: bool,
}

/// Vertices and discs of a body where it is.
struct Posed<'a> {
    body: &'a Body,
    centre: Vector2<f64>,
    points: Vec<Vector2<f64>>,
    discs: Vec<(Vector2<f64>, f64)>,
}

impl Posed<'_> {
    /// Whether a chain of sides begins inside another chart.
    fn is_inside(&self, other: &Self) -> bool {
        self.body.starts.iter().any(|&v| other.winding(self.points[v as usize]) != 0)
    }

    /// The winding number at a point: crossings of the ray to the right, upwards ones less downwards ones.
    fn winding(&self, at: Vector2<f64>) -> i32 {
        let of_side = |side: &[u32; 2]| {
            let [p, q] = side.map(|v| self.points[v as usize]);
            let is_left = (q - p).perp(&(at - p)) > 0.0;
            match (p.y <= at.y, q.y <= at.y) {
                (true, false) if is_left => 1,
                (false, true) if !is_left => -1,
                _ => 0,
            }
        };
        self.body.pieces.iter().map(|piece| piece.winding * piece.sides.iter().map(of_side).sum::<i32>()).sum()
    }
}

impl Compaction<'_> {
    /// The number of the first variable of each chart, then that of the growth: charts near each other along the longer
    /// side of the frame have numbers near each other.
    fn variables(&self, at: &Arrangement) -> Vec<u32> {
        let along = usize::from(self.frame.sides[1] >= self.frame.sides[0]);
        let mut order: Vec<usize> = (0..self.bodies.len()).collect();
        order.sort_by(|&a, &b| at.spots[a].centre[along].total_cmp(&at.spots[b].centre[along]).then(a.cmp(&b)));
        let mut first = vec![0; order.len() + 1];
        let mut next = 0;
        for i in order {
            first[i] = next;
            next += if self.turns[i] { 3 } else { 2 };
        }
        first[self.bodies.len()] = next;
        first
    }

    fn largest(&self) -> f64 {
        self.bodies.iter().map(|b| b.radius).fold(f64::MIN_POSITIVE, f64::max)
    }

    fn posed(&self, at: &Arrangement) -> Vec<Posed<'_>> {
        let posed = |(body, spot): (&'_ Body, &Spot)| {
            let [c, s] = spot.turn.map(|x| at.density * x);
            let centre = Vector2::from(spot.centre);
            let to = |p: &Vector2<f64>| centre + Vector2::new(c * p.x - s * p.y, s * p.x + c * p.y);
            (
                centre,
                body.points.iter().map(to).collect(),
                body.pieces.iter().map(|p| (to(&p.centre), at.density * p.radius)).collect(),
            )
        };
        self.bodies
            .iter()
            .zip(&at.spots)
            .map(|(body, spot)| {
                let (centre, points, discs) = posed((body, spot));
                Posed { body, centre, points, discs }
            })
            .collect()
    }

    /// All distances up to `reach` texels more than they have to be.
    fn contacts(&self, at: &Arrangement, first: &[u32], reach: f64) -> Contacts {
        let Frame { sides, border, gap, .. } = *self.frame;
        let growth = first[self.bodies.len()];
        let largest = self.largest() * at.density;
        let mut found = Contacts { inequalities: Inequalities::default(), short: 0.0, meet: false };
        let posed = self.posed(at);
        // What the point of a chart at `arm` from its middle moves by along `n`, and what it grows by.
        let moved = |i: usize, n: Vector2<f64>, arm: Vector2<f64>| {
            let radius = self.bodies[i].radius * at.density;
            let turn = self.turns[i].then(|| (first[i] + 2, (n.y * arm.x - n.x * arm.y) / radius));
            [(first[i], n.x), (first[i] + 1, n.y)].into_iter().chain(turn)
        };
        for (i, of) in posed.iter().enumerate() {
            for &v in &of.body.hull {
                let p = of.points[v as usize];
                let arm = p - of.centre;
                for k in 0..2 {
                    for (distance, sign) in [(p[k], 1.0), (sides[k] - p[k], -1.0)] {
                        let over = distance - border;
                        found.short = found.short.max(-over);
                        if over < reach {
                            let mut n = Vector2::zeros();
                            n[k] = sign;
                            let grown = (growth, n.dot(&arm) / largest);
                            found.inequalities.push(moved(i, n, arm).chain([grown]), -over);
                        }
                    }
                }
            }
        }
        for i in 1..posed.len() {
            for j in 0..i {
                let (a, b) = (&posed[i], &posed[j]);
                let mut near = |i: usize, j: usize, p: Vector2<f64>, w: Vector2<f64>| {
                    let apart = p - w;
                    let distance = apart.norm();
                    let over = distance - gap;
                    if over >= reach {
                        return;
                    }
                    found.short = found.short.max(-over);
                    if distance <= 0.0 {
                        found.meet = true;
                        return;
                    }
                    let n = apart / distance;
                    let (arm, other) = (p - posed[i].centre, w - posed[j].centre);
                    let grown = (growth, n.dot(&(arm - other)) / largest);
                    found.inequalities.push(moved(i, n, arm).chain(moved(j, -n, other)).chain([grown]), -over);
                };
                if (a.centre - b.centre).norm() - at.density * (a.body.radius + b.body.radius) >= gap + reach {
                    continue;
                }
                let mut crossing = false;
                for (piece, disc) in a.body.pieces.iter().zip(&a.discs) {
                    for (other, other_disc) in b.body.pieces.iter().zip(&b.discs) {
                        let apart = (disc.0 - other_disc.0).norm() - disc.1 - other_disc.1;
                        if apart >= gap + reach {
                            continue;
                        }
                        nearest(a, piece, b, other, |p, w| near(i, j, p, w));
                        nearest(b, other, a, piece, |p, w| near(j, i, p, w));
                        crossing |= apart < 0.0 && cross(a, piece, b, other);
                    }
                }
                found.meet |= crossing;
            }
        }
        found
    }

    /// Whether no two charts overlap, as far as outlines are as exact as the bodies.
    pub(super) fn is_apart(&self, at: &Arrangement) -> bool {
        let posed = self.posed(at);
        let apart = |a: &Posed<'_>, b: &Posed<'_>| {
            let far = (a.centre - b.centre).norm() - at.density * (a.body.radius + b.body.radius);
            if far > 0.0 {
                return true;
            }
            let mut pieces = a.body.pieces.iter().zip(&a.discs);
            let crosses = pieces.any(|(piece, disc)| {
                let mut others = b.body.pieces.iter().zip(&b.discs);
                others.any(|(other, of_other)| {
                    (disc.0 - of_other.0).norm() <= disc.1 + of_other.1 && cross(a, piece, b, other)
                })
            });
            !crosses && !a.is_inside(b) && !b.is_inside(a)
        };
        (1..posed.len()).all(|i| (0..i).all(|j| apart(&posed[i], &posed[j])))
    }

    /// The arrangement after a step. Where that would make it denser than allowed, charts stay smaller, which only leaves more between them.
    fn moved(&self, at: &Arrangement, first: &[u32], x: &[f64]) -> Arrangement {
        let growth = x[first[self.bodies.len()] as usize] / (self.largest() * at.density);
        let spot = |(i, spot): (usize, &Spot)| {
            let by = first[i] as usize;
            let turn = if self.turns[i] {
                let (s, c) = (x[by + 2] / (self.bodies[i].radius * at.density)).sin_cos();
                let [a, b] = spot.turn;
                let [a, b] = [a * c - b * s, b * c + a * s];
                let norm = a.hypot(b);
                [a / norm, b / norm]
            } else {
                spot.turn
            };
            Spot { turn, centre: [spot.centre[0] + x[by], spot.centre[1] + x[by + 1]] }
        };
        Arrangement {
            density: (at.density * (1.0 + growth)).min(self.frame.ceiling),
            spots: at.spots.iter().enumerate().map(spot).collect(),
        }
    }

    /// Lets all charts grow from `start` on, where no two of them may meet.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn grown(&self, start: &Arrangement, pace: Pace) -> Result<Grown, Cancelled> {
        let first = self.variables(start);
        let mut radius = pace.longest;
        let mut at = start.clone();
        let mut contacts = self.contacts(&at, &first, REACH * radius);
        let mut best = (contacts.short <= pace.tolerance && !contacts.meet).then(|| at.clone());
        let mut work = contacts.inequalities.len();
        if contacts.meet {
            return Ok(Grown { densest: None, work });
        }
        let count = first[self.bodies.len()] as usize;
        for _ in 0..pace.steps {
            self.progress.check()?;
            let Some(x) = maximise(count, &contacts.inequalities, &vec![radius; count + 1]) else {
                break;
            };
            let next = self.moved(&at, &first, &x);
            let of_next = self.contacts(&next, &first, REACH * radius);
            work += of_next.inequalities.len();
            let is_worse = of_next.short > contacts.short.max(0.1 * radius);
            if of_next.meet || is_worse {
                radius *= 0.5;
            } else {
                at = next;
                contacts = of_next;
                if contacts.short <= pace.tolerance && best.as_ref().is_none_or(|b| at.density > b.density) {
                    best = Some(at.clone());
                }
                if x[count] < SLOW * radius {
                    radius *= 0.5;
                }
                let is_done = at.density >= self.frame.ceiling || x[count] < NEGLIGIBLE * self.largest() * at.density;
                if is_done && contacts.short <= pace.tolerance {
                    break;
                }
            }
            if radius < pace.shortest {
                break;
            }
        }
        Ok(Grown { densest: best, work })
    }
}

/// Calls `near` with each point of a piece and the point of each side of another that is nearest to it. A point that is
/// nearest to the end of one side and the beginning of the next comes once.
fn nearest(
    a: &Posed<'_>,
    piece: &Piece,
    b: &Posed<'_>,
    other: &Piece,
    mut near: impl FnMut(Vector2<f64>, Vector2<f64>),
) {
    for &v in &piece.points {
        let p = a.points[v as usize];
        let mut is_past_last = true;
        for &[from, to] in &other.sides {
            let (from, to) = (b.points[from as usize], b.points[to as usize]);
            let side = to - from;
            let share = (p - from).dot(&side) / side.norm_squared();
            if share > 0.0 && share < 1.0 {
                near(p, from + side * share);
            } else if share.is_nan() || (share <= 0.0 && is_past_last) {
                near(p, from);
            }
            is_past_last = share >= 1.0;
        }
    }
}

/// Whether a side of a piece crosses one of another.
fn cross(a: &Posed<'_>, piece: &Piece, b: &Posed<'_>, other: &Piece) -> bool {
    let ends = |of: &Posed<'_>, side: &[u32; 2]| side.map(|v| of.points[v as usize]);
    piece.sides.iter().any(|side| {
        let [p, q] = ends(a, side);
        other.sides.iter().any(|side| {
            let [r, s] = ends(b, side);
            let left = |from: Vector2<f64>, to: Vector2<f64>, at: Vector2<f64>| (to - from).perp(&(at - from)) > 0.0;
            left(p, q, r) != left(p, q, s) && left(r, s, p) != left(r, s, q)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackItem;
    use crate::packing::outline::Outline;
    use nalgebra::Point2;

    fn rectangle(w: f64, h: f64) -> Body {
        let points = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(Point2::from);
        let item = PackItem { points: &points, triangles: &[[0, 1, 2], [0, 2, 3]] };
        Body::new(&Outline::new(&item, 0).expect("valid"), 0.0)
    }

    /// A square ring of four units, three wide inside.
    fn ring() -> Body {
        let points: Vec<Point2<f64>> =
            [2.0, 1.5].iter().flat_map(|&r| [[-r, -r], [r, -r], [r, r], [-r, r]]).map(Point2::from).collect();
        let triangles: Vec<[u32; 3]> =
            (0..4).flat_map(|k| [[k, (k + 1) % 4, 4 + k], [(k + 1) % 4, 4 + (k + 1) % 4, 4 + k]]).collect();
        Body::new(&Outline::new(&PackItem { points: &points, triangles: &triangles }, 0).expect("valid"), 0.0)
    }

    fn spot(angle: f64, centre: [f64; 2]) -> Spot {
        Spot { turn: [angle.cos(), angle.sin()], centre }
    }

    fn frame(ceiling: f64) -> Frame {
        Frame { sides: [100.0; 2], border: 1.0, gap: 2.0, ceiling }
    }

    const PACE: Pace = Pace { longest: 5.0, shortest: 1e-4, steps: 200, tolerance: 1e-6 };

    fn grown(bodies: &[Body], turns: bool, spots: Vec<Spot>, frame: &Frame) -> Arrangement {
        let turns = vec![turns; bodies.len()];
        let compaction = Compaction { bodies, turns: &turns, frame, progress: &Progress::new() };
        let start = Arrangement { density: 1.0, spots };
        let found = compaction.grown(&start, PACE).expect("not cancelled").densest.expect("grown");
        assert!(compaction.is_apart(&found));
        found
    }

    #[test]
    fn two_rectangles_fill_the_frame_up_to_the_gap() {
        let bodies = [rectangle(2.0, 1.0), rectangle(2.0, 1.0)];
        let spots = vec![spot(0.3, [30.0, 30.0]), spot(-0.2, [60.0, 70.0])];
        // Side by side: two heights and a gap, or one width.
        let found = grown(&bodies, true, spots.clone(), &frame(f64::INFINITY));
        assert!((found.density - 48.0).abs() < 0.05, "{}", found.density);
        for Spot { turn: [c, s], .. } in &found.spots {
            assert!(c.abs().min(s.abs()) < 1e-2, "along an axis");
        }
        let found = grown(&bodies, true, spots, &frame(20.0));
        assert!((found.density - 20.0).abs() < 1e-9, "the ceiling");
    }

    #[test]
    fn what_may_not_turn_keeps_its_angle() {
        let bodies = [rectangle(2.0, 1.0), rectangle(1.0, 1.0)];
        let spots = vec![spot(0.5, [30.0, 30.0]), spot(0.0, [70.0, 70.0])];
        let found = grown(&bodies, false, spots.clone(), &frame(f64::INFINITY));
        assert!(found.density > 20.0);
        for (a, b) in found.spots.iter().zip(&spots) {
            assert_eq!(a.turn, b.turn);
        }
    }

    #[test]
    fn a_chart_in_a_hole_stays_there_and_one_on_another_is_told() {
        let bodies = [ring(), rectangle(1.0, 1.0)];
        let found = grown(&bodies, true, vec![spot(0.0, [50.0; 2]), spot(0.0, [50.1, 49.9])], &frame(f64::INFINITY));
        assert!((found.density - 24.5).abs() < 0.05, "the ring alone: {}", found.density);
        let solid = [rectangle(4.0, 4.0), rectangle(1.0, 1.0)];
        let compaction =
            Compaction { bodies: &solid, turns: &[true; 2], frame: &frame(1e9), progress: &Progress::new() };
        let at = |x: f64| Arrangement { density: 10.0, spots: vec![spot(0.0, [50.0; 2]), spot(0.0, [x, 50.0])] };
        assert!(!compaction.is_apart(&at(50.0)), "inside");
        assert!(!compaction.is_apart(&at(70.0)), "across the side");
        assert!(compaction.is_apart(&at(80.0)));
        assert!(compaction.grown(&at(70.0), PACE).expect("not cancelled").densest.is_none());
    }

    #[test]
    fn steps_can_be_stopped() {
        let progress = Progress::new();
        progress.cancel();
        let bodies = [rectangle(2.0, 1.0), rectangle(1.0, 1.0)];
        let compaction = Compaction { bodies: &bodies, turns: &[true; 2], frame: &frame(1e9), progress: &progress };
        let start = Arrangement { density: 1.0, spots: vec![spot(0.5, [30.0, 30.0]), spot(0.0, [70.0, 70.0])] };
        assert!(compaction.grown(&start, PACE).is_err());
    }
}
