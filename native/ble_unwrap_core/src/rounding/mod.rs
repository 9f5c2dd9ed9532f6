//! Double-precision UVs of a chart rounded to float32 without turning a triangle over.
//!
//! Near 1 the float32 grid has a pitch of 6e-8. A needle or a very small triangle may collapse on it
//! or change its orientation. Then vertices of the triangle are moved, one by one, by a few grid
//! steps: each to where the least height in its star is greatest (a linear program in two variables,
//! `kernel`), as far as the grid lets it. Boundary vertices stay within a 64th of a texel. The halves that quads have by
//! their other diagonal are looked after in the same way, behind the faces.

mod kernel;

use nalgebra::{Point2, Vector2};
use thiserror::Error;

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::predicates::orientation;
use crate::progress::{Cancelled, Progress};

use kernel::{Constraint, best_point};

/// A triangle thinner than this (height over its longest edge, in UV) is degenerate to float32
/// readers, which take 1e-7 of the layout's extent as the bound. Three times that leaves room.
const HEIGHT: f64 = 3e-7;
/// Surface triangles thinner than this share of the bounding box diagonal are degenerate anyway, and
/// only have to keep their orientation.
const DEGENERATE: f64 = 1e-7;
/// Boundary vertices move at most this share of a texel: invisible, and a sixteenth of what a margin
/// is accurate to.
const BOUNDARY_REACH: f64 = 1.0 / 64.0;
/// Inner vertices move at most this share of a texel.
const INNER_REACH: f64 = 0.5;
/// Rounds; the reach doubles every second one, from two grid steps to 8192.
const ROUNDS: u32 = 24;
/// Rounds in which triangles that are merely thin are looked after, with a reach of twice `HEIGHT` or
/// more from the start.
const THIN_ROUNDS: u32 = 6;
/// From this round on the neighbours of a turned triangle's vertices move as well.
const NEIGHBOUR_ROUND: u32 = 8;
/// Moves tried at most, for turned and for thin triangles each, besides two a vertex. About 5 µs a try.
const TRIES: usize = 50_000;

/// What the rounding has to know besides the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rounding {
    /// Size of a texel along u and v.
    pub texel: [f64; 2],
    /// Lower left corner of the tile that the chart lies in, a square of side 1; whole numbers, at least 0.
    pub corner: [f64; 2],
    /// Bounding box diagonal of the whole input mesh, in the unit of the chart's positions.
    pub diagonal: f64,
}

impl Rounding {
    /// How much coarser the float32 grid is in this tile than from ½ to 1, at most: it doubles at each power of two.
    fn coarseness(&self) -> f64 {
        (1.0 + self.corner[0].max(self.corner[1])).log2().ceil().exp2()
    }
}

/// A rounded chart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rounded {
    /// UV of each vertex.
    pub uv: Vec<[f32; 2]>,
    /// Vertices that are not at the float32 point nearest to where they were.
    pub moved: usize,
    /// Triangles, not degenerate on the surface, that stay thinner than 3e-7 in UV.
    pub thin_faces: usize,
}

/// Triangles without a positive area in float32.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{} triangles lose their orientation in float32, first {}", .faces.len(), .faces[0])]
pub(crate) struct Unmendable {
    /// The triangles, ascending; at least one.
    pub faces: Vec<FaceId>,
    /// The best that was found.
    pub uv: Vec<[f32; 2]>,
}

/// Why there is nothing rounded.
#[derive(Clone, Debug, PartialEq, Error)]
pub(crate) enum RoundingError {
    /// The chart is too small for the float32 grid, or had turned triangles (or NaN).
    #[error(transparent)]
    Unmendable(Unmendable),
    /// The computation was broken off.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Rounds the final UVs of a chart, one for each vertex of `mesh`, to float32 in its tile. `halves` are further triangles over
/// its vertices that should stay positive, too: those that quads have by their other diagonal.
///
/// Guaranteed: every triangle of the result is strictly positive by an exact test; vertices whose
/// triangles survive plain rounding are rounded plainly; the result depends on the arguments alone.
/// Not guaranteed: that all of `halves` are positive (no face is given up for one); that moved boundary vertices leave the boundary simple (they move less than a 64th
/// of a texel; [`verify`](crate::verify::verify()) tells).
///
/// O(n) and one pass where nothing breaks; a bounded number of moves otherwise.
///
/// # Errors
/// [`RoundingError`].
///
/// # Panics
/// If `uv` does not hold one point a vertex.
pub(crate) fn round_to_f32(
    mesh: &TriMesh,
    halves: &[[VertexId; 3]],
    uv: &[Point2<f64>],
    rounding: &Rounding,
    progress: &Progress,
) -> Result<Rounded, RoundingError> {
    assert_eq!(uv.len(), mesh.vertex_count(), "one UV a vertex");
    // Adding 0 makes −0 plain.
    let plain: Vec<[f32; 2]> = uv.iter().map(|p| [p.x as f32 + 0.0, p.y as f32 + 0.0]).collect();
    let mut mender = Mender {
        mesh,
        halves: Halves { triangles: halves, turned: Vec::new(), at: Vec::new() },
        home: uv,
        uv: plain.clone(),
        rounding,
        goal: Vec::new(),
        turned: Vec::new(),
        thin: Vec::new(),
    };
    mender.goal = mesh.faces().map(|f| mender.surface_goal(f)).collect();
    mender.look(mesh.faces());
    mender.halves.look(&mender.uv);
    mender.mend(progress)?;
    let moved = mender.uv.iter().zip(&plain).filter(|(a, b)| a != b && !(a[0].is_nan() || a[1].is_nan())).count();
    if mender.turned.is_empty() {
        Ok(Rounded { uv: mender.uv, moved, thin_faces: mender.thin.len() })
    } else {
        Err(RoundingError::Unmendable(Unmendable { faces: mender.turned, uv: mender.uv }))
    }
}

/// The triangles of a chart that do not have a strictly positive area with these UVs, or, of a mirror image, a strictly
/// negative one. Exact. O(n).
///
/// # Panics
/// If `uv` does not hold one UV a vertex.
pub(crate) fn turned_faces(mesh: &TriMesh, uv: &[[f32; 2]], is_mirrored: bool) -> Vec<FaceId> {
    assert_eq!(uv.len(), mesh.vertex_count(), "one UV a vertex");
    let is_turned = |f: &FaceId| {
        let [a, b, c] = mesh.triangle(*f).map(|v| uv[v.index()]);
        !is_positive(if is_mirrored { double_area(a, c, b) } else { double_area(a, b, c) })
    };
    mesh.faces().filter(is_turned).collect()
}

/// The halves that quads have by their other diagonal.
struct Halves<'a> {
    triangles: &'a [[VertexId; 3]],
    /// Those not strictly positive, ascending.
    turned: Vec<usize>,
    /// Each with each of its vertices, by vertex; empty until one is asked for.
    at: Vec<(VertexId, u32)>,
}

impl Halves<'_> {
    /// Finds those that are turned over.
    fn look(&mut self, uv: &[[f32; 2]]) {
        let is_turned = |k: &usize| {
            let [a, b, c] = self.triangles[*k].map(|v| uv[v.index()]);
            !is_positive(double_area(a, b, c))
        };
        self.turned = (0..self.triangles.len()).filter(is_turned).collect();
    }

    /// Lists them by vertex.
    fn sort(&mut self) {
        let corners = |(k, t): (usize, &[VertexId; 3])| t.map(|v| (v, k as u32));
        self.at = self.triangles.iter().enumerate().flat_map(corners).collect();
        self.at.sort_unstable();
    }

    /// The other two vertices, in order, of each one that a vertex belongs to.
    fn opposite(&self, v: VertexId) -> impl Iterator<Item = [VertexId; 2]> + '_ {
        let first = self.at.partition_point(|entry| entry.0 < v);
        self.at[first..].iter().take_while(move |entry| entry.0 == v).map(move |&(_, k)| {
            let [a, b, c] = self.triangles[k as usize];
            if a == v {
                [b, c]
            } else if b == v {
                [c, a]
            } else {
                [a, b]
            }
        })
    }
}

struct Mender<'a> {
    mesh: &'a TriMesh,
    halves: Halves<'a>,
    home: &'a [Point2<f64>],
    uv: Vec<[f32; 2]>,
    rounding: &'a Rounding,
    /// Height each face should have.
    goal: Vec<f32>,
    /// Faces not strictly positive, ascending.
    turned: Vec<FaceId>,
    /// Positive faces below their goal, ascending.
    thin: Vec<FaceId>,
}

impl Mender<'_> {
    /// The height a face should have in UV: 0 if it has none on the surface.
    fn surface_goal(&self, f: FaceId) -> f32 {
        let p = self.mesh.triangle_positions(f);
        let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
        let longest = e1.norm().max(e2.norm()).max((p[2] - p[1]).norm());
        if e1.cross(&e2).norm() > DEGENERATE * self.rounding.diagonal * longest { self.height() as f32 } else { 0.0 }
    }

    /// [`HEIGHT`] in this tile: a layout of several tiles has a larger extent, and a coarser grid.
    fn height(&self) -> f64 {
        HEIGHT * self.rounding.coarseness()
    }

    fn at(&self, v: VertexId) -> [f32; 2] {
        self.uv[v.index()]
    }

    /// Sorts the given faces, ascending, into turned, thin and good ones.
    fn look(&mut self, faces: impl Iterator<Item = FaceId>) {
        let (mut turned, mut thin) = (Vec::new(), Vec::new());
        for f in faces {
            let [a, b, c] = self.mesh.triangle(f).map(|v| self.at(v));
            let area = double_area(a, b, c);
            if !is_positive(area) {
                turned.push(f);
            } else if area < f64::from(self.goal[f.index()]) * longest_edge(a, b, c) {
                thin.push(f);
            }
        }
        self.turned = turned;
        self.thin = thin;
    }

    fn mend(&mut self, progress: &Progress) -> Result<(), Cancelled> {
        let largest = self.uv.iter().flatten().fold(0.0f32, |a, x| a.max(x.abs()));
        // At least the pitch of the grid at the largest coordinate.
        let pitch = f64::from(largest) * f64::from(f32::EPSILON);
        let mut tries = [TRIES + 2 * self.mesh.vertex_count(); 3];
        for round in 0..ROUNDS {
            let thin_too = round < THIN_ROUNDS && !self.thin.is_empty() && tries[1] > 0;
            let halves_too = !self.halves.turned.is_empty() && tries[2] > 0;
            if self.turned.is_empty() && !thin_too && !halves_too {
                break;
            }
            if round == 0 {
                self.halves.sort();
            }
            let reach = pitch * f64::from(2u32 << (round / 2));
            let mut touched: Vec<FaceId> = self.turned.iter().chain(&self.thin).copied().collect();
            let corners = |faces: &[FaceId]| faces.iter().map(|&f| self.mesh.triangle(f)).collect();
            let turned_halves = self.halves.turned.iter().map(|&k| self.halves.triangles[k]).collect();
            let lists: [Vec<[VertexId; 3]>; 3] =
                [corners(&self.turned), if thin_too { corners(&self.thin) } else { Vec::new() }, turned_halves];
            let reaches = [reach, reach.max(2.0 * self.height()), reach];
            for ((list, reach), tries) in lists.iter().zip(reaches).zip(&mut tries) {
                for v in self.vertices_of(list, round >= NEIGHBOUR_ROUND) {
                    if *tries == 0 {
                        break;
                    }
                    *tries -= 1;
                    progress.check()?;
                    if self.improve(v, reach) {
                        touched.extend(self.mesh.outgoing(v).map(|h| h.face()));
                    }
                }
            }
            touched.sort_unstable();
            touched.dedup();
            self.look(touched.into_iter());
            self.halves.look(&self.uv);
        }
        Ok(())
    }

    /// Vertices of triangles, each once, in the order of these; inner ones of a triangle first. With their
    /// neighbours behind them if asked.
    fn vertices_of(&self, triangles: &[[VertexId; 3]], neighbours: bool) -> Vec<VertexId> {
        let mut order = Vec::with_capacity(3 * triangles.len());
        for &(mut corners) in triangles {
            corners.sort_unstable_by_key(|&v| (self.mesh.is_boundary_vertex(v), v));
            order.extend(corners);
        }
        let mut seen = std::collections::HashSet::new();
        order.retain(|&v| seen.insert(v));
        if neighbours {
            // Each of them once, or a vertex of many faces would name its neighbours for each of these.
            for i in 0..order.len() {
                order.extend(self.mesh.neighbours(order[i]).filter(|&v| seen.insert(v)));
            }
        }
        order
    }

    /// Moves a vertex to the best point within `reach` of where it belongs, if that is better than
    /// where it is.
    fn improve(&mut self, v: VertexId, reach: f64) -> bool {
        let home = self.home[v.index()];
        let share = if self.mesh.is_boundary_vertex(v) { BOUNDARY_REACH } else { INNER_REACH };
        let reach = self.rounding.texel.map(|t| reach.min(share * t));
        if !(home.x.is_finite() && home.y.is_finite()) {
            return false;
        }
        // What may be moved to, relative to home: within reach and the tile.
        let corner = self.rounding.corner;
        let lo = [0, 1].map(|k| (-reach[k]).max(corner[k] - home[k]).min(0.0));
        let hi = [0, 1].map(|k| reach[k].min(corner[k] + 1.0 - home[k]).max(0.0));
        let local = |p: [f32; 2]| Vector2::new(f64::from(p[0]) - home.x, f64::from(p[1]) - home.y);
        let faces = self.mesh.outgoing(v).map(|h| {
            let goal = f64::from(self.goal[h.face().index()]);
            ([self.mesh.to(h), self.mesh.from(h.prev())], goal, false)
        });
        let star: Vec<Opposite> = faces
            .chain(self.halves.opposite(v).map(|ends| (ends, 0.0, true)))
            .map(|(ends, goal, is_half)| {
                let [p, q] = ends.map(|w| self.at(w));
                let (a, b) = (local(p), local(q));
                let d = b - a;
                let gradient = Vector2::new(-d.y, d.x);
                let constant = a.perp(&b);
                let most =
                    constant + [0, 1].map(|k| (gradient[k] * lo[k]).max(gradient[k] * hi[k])).iter().sum::<f64>();
                // No more than half of what this vertex alone can reach, or a face that others must
                // mend would hide the rest.
                let goal = goal.max(0.25 * f64::from(f32::EPSILON) * self.rounding.coarseness());
                let want = (goal * a.norm().max(b.norm()).max(d.norm())).min(0.5 * most);
                Opposite { p, q, is_half, constraint: Constraint { gradient, constant, want } }
            })
            .collect();
        let constraints: Vec<Constraint> = star.iter().map(|o| o.constraint).filter(|c| c.want > 0.0).collect();
        let Some(best) = best_point(&constraints, lo, hi) else { return false };
        let target = [(home.x + best.x) as f32 + 0.0, (home.y + best.y) as f32 + 0.0];
        let current = self.score(&star, self.at(v), home);
        let (mut winner, mut winning) = (self.at(v), current);
        for dx in [0, -1, 1] {
            for dy in [0, -1, 1] {
                let p = [step(target[0], dx, corner[0]), step(target[1], dy, corner[1])];
                let inside = (0..2).all(|k| (f64::from(p[k]) - home[k]).abs() <= share * self.rounding.texel[k]);
                let score = self.score(&star, p, home);
                if inside && score.beats(&winning) {
                    (winner, winning) = (p, score);
                }
            }
        }
        let better = (winning.turned, winning.bent) < (current.turned, current.bent)
            || winning.least > current.least + 1e-3 * current.least.abs();
        if better {
            self.uv[v.index()] = winner;
        }
        better
    }

    fn score(&self, star: &[Opposite], x: [f32; 2], home: Point2<f64>) -> Score {
        let mut score = Score { turned: 0, bent: 0, least: 1.0, distance: 0.0 };
        for o in star {
            let area = double_area(x, o.p, o.q);
            *(if o.is_half { &mut score.bent } else { &mut score.turned }) += usize::from(!is_positive(area));
            if o.constraint.want > 0.0 {
                score.least = score.least.min(area / o.constraint.want);
            }
        }
        score.distance = (f64::from(x[0]) - home.x).hypot(f64::from(x[1]) - home.y);
        score
    }
}

/// The edge of a face, or of a quad's other half, opposite to the vertex that moves.
struct Opposite {
    p: [f32; 2],
    q: [f32; 2],
    is_half: bool,
    constraint: Constraint,
}

/// How good a place for a vertex is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Score {
    /// Faces of its star that are not strictly positive.
    turned: usize,
    /// Other halves of quads that are not.
    bent: usize,
    /// The least share of what each face wants; at most 1.
    least: f64,
    /// Distance from where the vertex belongs.
    distance: f64,
}

impl Score {
    fn beats(&self, other: &Self) -> bool {
        if (self.turned, self.bent) != (other.turned, other.bent) {
            return (self.turned, self.bent) < (other.turned, other.bent);
        }
        self.least > other.least || (self.least == other.least && self.distance < other.distance)
    }
}

/// A float32 neighbour of a coordinate that stays within 1 from `least` on.
fn step(x: f32, by: i32, least: f64) -> f32 {
    match by {
        -1 => x.next_down(),
        1 => x.next_up(),
        _ => x,
    }
    .clamp(least as f32, (least + 1.0) as f32)
}

/// Twice the signed area; its sign is exact.
fn double_area(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> f64 {
    orientation(a.map(f64::from), b.map(f64::from), c.map(f64::from))
}

/// Whether an area makes a triangle; NaN does not.
fn is_positive(area: f64) -> bool {
    area > 0.0
}

fn longest_edge(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> f64 {
    let length = |p: [f32; 2], q: [f32; 2]| {
        let d = [0, 1].map(|k| f64::from(q[k]) - f64::from(p[k]));
        d[0] * d[0] + d[1] * d[1]
    };
    length(a, b).max(length(b, c)).max(length(c, a)).sqrt()
}

#[cfg(test)]
mod tests;
