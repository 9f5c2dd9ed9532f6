//! Geodesic distances on a triangle mesh by fast marching.
//!
//! R. Kimmel, J. A. Sethian: Computing geodesic paths on manifolds, PNAS 95 (1998), 8431–8435. A
//! front leaves the source; the vertex of least tentative distance is accepted, and each triangle
//! with two accepted corners offers its third a distance. Across an obtuse corner the front may
//! arrive too early for that, so such a triangle is split by a virtual edge to a vertex unfolded
//! from beyond its opposite side (section 4 there).
//!
//! *The local step.* Where Kimmel and Sethian let a straight wave front pass a triangle, we place a
//! virtual point source in its plane at the right distances from the two accepted corners (M. Novotni,
//! R. Klein: Computing geodesic distances on triangular meshes, WSCG 2002). On a flat or developable
//! patch this is exact to rounding wherever the shortest path is straight, which matters here: a
//! developable chart must come out undistorted. See the tests for the errors on curved surfaces.

use nalgebra::{Point2, Point3, Vector2};

use crate::collections::MinHeap;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Cosine below which a corner counts as obtuse. Right angles, as in grids, need no unfolding;
/// rounding must not make them obtuse.
const OBTUSE_COSINE: f64 = -1e-6;

/// Triangles crossed at most when unfolding. Kimmel and Sethian bound the number by the shape of the
/// triangles. On a grid sheared threefold, 16 leave errors of 8 %, 64 none; needles beyond keep their
/// obtuse corner, and the front reaches them by taking up accepted vertices again.
const MAX_UNFOLDED: usize = 64;

/// Shortest side opposite a corner, relative to the longer of its own sides, that a front is passed
/// through: below it, circles about the ends of the side meet ill-conditioned, and the path along an
/// edge is as short to the same precision.
const SHORTEST_BASE: f64 = 1e-7;

/// How much the distances from both ends of a base may fall short of its length, relatively, by
/// rounding, when the source lies on it.
const ON_BASE: f64 = 1e-9;

/// An accepted vertex is taken up again only if its distance falls by more than this, relatively:
/// half the precision that [`LandmarkDistances`](super::LandmarkDistances) keeps.
const LEAST_GAIN: f64 = 3e-8;

/// How often at most an accepted vertex is taken up again: bounds the work by so many plain marches.
/// Few vertices need it once.
const MAX_REOPENED: u8 = 8;

/// Vertices accepted between two looks at the cancel flag: less than a millisecond.
const CHECK_EVERY: usize = 1024;

/// A way for the front to reach `target` between two other vertices, one of which owns this entry.
/// In the plane the owner lies at the origin, `other` at (`base`, 0) and `target` at (`x`, `y`), y ≥ 0.
#[derive(Clone, Copy, Debug)]
struct Wedge {
    target: u32,
    other: u32,
    base: f64,
    x: f64,
    y: f64,
}

impl Wedge {
    /// Distance at the target of a point source at distance `here` from the owner and `there` from
    /// `other`, below the axis; none if there is no such point or it does not see the target through
    /// the base. Costs two roots and a division.
    #[inline]
    fn arrival(&self, here: f64, there: f64) -> Option<f64> {
        let (l, x, y) = (self.base, self.x, self.y);
        let sx = 0.5 * ((here - there) * (here + there) / l + l);
        let square = (here - sx) * (here + sx);
        if square < 0.0 && (here + there < l * (1.0 - ON_BASE) || sx < 0.0 || sx > l) {
            // The distances contradict the base, or the source lies on its line beyond an end.
            return None;
        }
        let depth = square.max(0.0).sqrt();
        let crossing = sx * y + x * depth;
        let height = y + depth;
        (crossing >= 0.0 && crossing <= l * height).then(|| ((x - sx) * (x - sx) + height * height).sqrt())
    }
}

/// An edge of the mesh, or the unfolded edge across an obtuse corner, seen from one end.
#[derive(Clone, Copy, Debug)]
struct Spoke {
    to: u32,
    length: f64,
}

/// A vertex and its place in the plane of a corner.
type Placed = (VertexId, Point2<f64>);

/// What fast marching needs to know of a mesh, prepared once and shared by all sources.
///
/// Some 240 bytes a face. Building is O(n).
#[derive(Debug)]
pub(crate) struct FastMarching<'m> {
    mesh: &'m TriMesh,
    spokes: Rows<Spoke>,
    wedges: Rows<Wedge>,
}

/// The arrays one march works in; make one a thread and use it for many sources.
#[derive(Clone, Debug, Default)]
pub(crate) struct MarchScratch {
    distance: Vec<f64>,
    /// Twice the times a vertex was taken up again, plus one while it is accepted.
    state: Vec<u8>,
    heap: MinHeap,
}

impl<'m> FastMarching<'m> {
    /// Measures and unfolds the triangles of a mesh: one or several components, with or without
    /// boundary, of any shape. Triangles without area pass the front along their edges.
    #[must_use]
    pub(crate) fn new(mesh: &'m TriMesh) -> Self {
        let n = mesh.vertex_count();
        let mut spokes = Vec::with_capacity(mesh.halfedge_count() * 2);
        let mut wedges = Vec::with_capacity(mesh.halfedge_count() * 2);
        let (mut fan, mut rest) = (Vec::new(), Vec::new());
        for h in mesh.edges() {
            add_spoke(&mut spokes, mesh.from(h), mesh.to(h), mesh.edge_length(h));
        }
        for h in mesh.halfedges() {
            let [target, p, q] = [mesh.from(h), mesh.to(h), mesh.from(h.prev())];
            let Some(flat) = lay_corner(mesh, h) else { continue };
            let corners = [(p, flat[0]), (q, flat[1])];
            if !unfold(mesh, h, corners, &mut fan, &mut rest) {
                add_wedge(&mut wedges, target, corners);
                continue;
            }
            for pair in fan.windows(2) {
                add_wedge(&mut wedges, target, [pair[0], pair[1]]);
            }
            for &(e, at) in &fan[1..fan.len() - 1] {
                add_spoke(&mut spokes, target, e, at.coords.norm());
            }
        }
        Self { mesh, spokes: Rows::new(n, &spokes), wedges: Rows::new(n, &wedges) }
    }

    /// Distances to every vertex from the nearest source, each source beginning at its offset (≥ 0);
    /// infinite where no source leads. Sources that are not vertices of the mesh are left out.
    ///
    /// Guaranteed: no NaN; at most the length of the shortest path along edges (to 1e-6, relative);
    /// with one source of offset 0, at least the distance through space, and exact to rounding where the
    /// mesh is intrinsically flat and the straight path meets no boundary. Not guaranteed: symmetry or
    /// the triangle inequality beyond the discretisation error, which is of first order in the edge
    /// length on curved surfaces: 0.1 to 0.4 % on average and up to 3 % at single vertices of meshes of some
    /// thousand (see the table of this module). O(n log n); about 0.4 µs a vertex.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` says so.
    pub(crate) fn march<'s>(
        &self,
        sources: &[(VertexId, f64)],
        scratch: &'s mut MarchScratch,
        progress: &Progress,
    ) -> Result<&'s [f64], Cancelled> {
        let n = self.mesh.vertex_count();
        scratch.reset(n);
        for &(v, offset) in sources {
            if v.index() < n && offset < scratch.distance[v.index()] {
                scratch.distance[v.index()] = offset.max(0.0);
                scratch.heap.push_or_lower(v.index(), offset.max(0.0));
            }
        }
        let mut accepted = 0usize;
        while let Some((v, here)) = scratch.heap.pop() {
            accepted += 1;
            if accepted.is_multiple_of(CHECK_EVERY) {
                progress.check()?;
            }
            scratch.state[v] |= 1;
            for spoke in self.spokes.row(v) {
                scratch.lower(spoke.to as usize, here + spoke.length);
            }
            for wedge in self.wedges.row(v) {
                let (other, target) = (wedge.other as usize, wedge.target as usize);
                if scratch.state[other] & 1 == 0 {
                    continue;
                }
                let there = scratch.distance[other];
                // No front arrives before it has passed the nearer end of the base.
                if scratch.distance[target] <= here.min(there) {
                    continue;
                }
                if let Some(arrival) = wedge.arrival(here, there) {
                    scratch.lower(target, arrival);
                }
            }
        }
        if let [(source, 0.0)] = *sources
            && source.index() < n
        {
            let centre = self.mesh.position(source);
            for (d, p) in scratch.distance.iter_mut().zip(self.mesh.positions()) {
                // Where one is no number, `max` takes the other.
                *d = d.max((p - centre).norm());
            }
        }
        Ok(&scratch.distance)
    }
}

impl MarchScratch {
    fn reset(&mut self, n: usize) {
        self.distance.clear();
        self.distance.resize(n, f64::INFINITY);
        self.state.clear();
        self.state.resize(n, 0);
        self.heap.reset(n);
    }

    /// Offers a vertex a distance.
    #[inline]
    fn lower(&mut self, v: usize, offer: f64) {
        let present = self.distance[v];
        if offer >= present || offer.is_nan() {
            return;
        }
        if self.state[v] & 1 == 1 {
            if present - offer <= LEAST_GAIN * present || self.state[v] >= 2 * MAX_REOPENED {
                return;
            }
            self.state[v] += 1;
        }
        self.distance[v] = offer;
        self.heap.push_or_lower(v, offer);
    }
}

/// The corner that `h` leaves, laid in the plane at the origin: the other two corners of its face in
/// order, the first on the x axis, the second with y ≥ 0. None if an edge has no finite length or the
/// side opposite is too short to pass a front through.
fn lay_corner(mesh: &TriMesh, h: HalfedgeId) -> Option<[Point2<f64>; 2]> {
    let [c, p, q] = [h, h.next(), h.prev()].map(|k| mesh.position(mesh.from(k)));
    let a = (p - c).norm();
    let (dot, cross) = ((p - c).dot(&(q - c)), (p - c).cross(&(q - c)).norm());
    let flat = [Point2::new(a, 0.0), Point2::new(dot / a, cross / a)];
    let base = (q - p).norm();
    // Also false for what is no number.
    (a > 0.0 && base > SHORTEST_BASE * a.max(flat[1].coords.norm()) && base.is_finite()).then_some(flat)
}

/// Splits an obtuse corner: lays triangles beyond its opposite side in the plane, one after another,
/// up to the first that has its apex where both parts of the corner are acute. `fan` gets the vertices
/// met on the way that are seen from the corner, in order from one of its `sides` to the other, both
/// included; `right` is scratch. (Kimmel and Sethian keep the apex only; but a source among the others would be missed.)
/// False for an acute corner, or if a boundary comes first.
fn unfold(
    mesh: &TriMesh,
    corner: HalfedgeId,
    sides: [Placed; 2],
    fan: &mut Vec<Placed>,
    right: &mut Vec<Placed>,
) -> bool {
    let [p, q] = sides.map(|s| s.1.coords);
    if p.dot(&q) >= OBTUSE_COSINE * p.norm() * q.norm() {
        return false;
    }
    // What is seen from the corner narrows to between the last of `fan` and the last of `right`.
    fan.clear();
    fan.push(sides[0]);
    right.clear();
    right.push(sides[1]);
    let [mut a, mut b] = [sides[0].1, sides[1].1];
    let mut side = corner.next();
    let taken = [corner, corner.next(), corner.prev()].map(|k| mesh.from(k));
    for _ in 0..MAX_UNFOLDED {
        let across = mesh.twin(side);
        if across.is_none() {
            return false;
        }
        let e = mesh.from(across.prev());
        let from_to_e = [side, side.next(), across.prev()].map(|k| mesh.position(mesh.from(k)));
        // Around a cone the front would meet the triangle itself.
        let Some(at) = lay_across(from_to_e, a, b).filter(|_| !taken.contains(&e)) else { return false };
        let (to_p, to_q) = (at.coords.dot(&p), at.coords.dot(&q));
        let seen = fan[fan.len() - 1].1.coords.perp(&at.coords) > 0.0
            && at.coords.perp(&right[right.len() - 1].1.coords) > 0.0;
        if to_p >= 0.0 && to_q >= 0.0 {
            if seen {
                fan.push((e, at));
                fan.extend(right.iter().rev());
            }
            return seen;
        }
        if to_q < 0.0 && to_p >= 0.0 {
            (a, side) = (at, across.prev());
            if seen {
                fan.push((e, at));
            }
        } else if to_p < 0.0 && to_q >= 0.0 {
            (b, side) = (at, across.next());
            if seen {
                right.push((e, at));
            }
        } else {
            return false;
        }
    }
    false
}

/// The place of the third point in the plane when a triangle, whose first two lie at `a` and `b`, is
/// laid on the right of the line from `a` to `b`.
fn lay_across([from, to, e]: [Point3<f64>; 3], a: Point2<f64>, b: Point2<f64>) -> Option<Point2<f64>> {
    let axis = (to - from).try_normalize(0.0)?;
    let flat_axis = (b - a).try_normalize(0.0)?;
    let along = (e - from).dot(&axis);
    let height = (e - from).cross(&axis).norm();
    let at = a + flat_axis * along + Vector2::new(flat_axis.y, -flat_axis.x) * height;
    (at.x.is_finite() && at.y.is_finite()).then_some(at)
}

fn add_spoke(spokes: &mut Vec<(u32, Spoke)>, u: VertexId, v: VertexId, length: f64) {
    let [u, v] = [u, v].map(|x| x.index() as u32);
    spokes.push((u, Spoke { to: v, length }));
    spokes.push((v, Spoke { to: u, length }));
}

/// Adds the way to `target`, at the origin, between two vertices: once for each of them.
fn add_wedge(wedges: &mut Vec<(u32, Wedge)>, target: VertexId, [(p, at_p), (q, at_q)]: [Placed; 2]) {
    let [target, p, q] = [target, p, q].map(|x| x.index() as u32);
    let base = (at_q - at_p).norm();
    let longest = at_p.coords.norm().max(at_q.coords.norm());
    if base <= SHORTEST_BASE * longest || !base.is_finite() || !longest.is_finite() {
        return;
    }
    let axis = (at_q - at_p) / base;
    let x = -at_p.coords.dot(&axis);
    let y = at_p.coords.perp(&axis).abs();
    wedges.push((p, Wedge { target, other: q, base, x, y }));
    wedges.push((q, Wedge { target, other: p, base, x: base - x, y }));
}

/// Items sorted by the vertex they belong to.
#[derive(Debug)]
struct Rows<T> {
    offsets: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Rows<T> {
    fn new(n: usize, entries: &[(u32, T)]) -> Self {
        let mut offsets = vec![0u32; n + 1];
        for &(v, _) in entries {
            offsets[v as usize + 1] += 1;
        }
        for v in 0..n {
            offsets[v + 1] += offsets[v];
        }
        let mut items = entries.iter().map(|e| e.1).collect::<Vec<_>>();
        let mut next = offsets.clone();
        for &(v, item) in entries {
            items[next[v as usize] as usize] = item;
            next[v as usize] += 1;
        }
        Self { offsets, items }
    }

    #[inline]
    fn row(&self, v: usize) -> &[T] {
        &self.items[self.offsets[v] as usize..self.offsets[v + 1] as usize]
    }
}

#[cfg(test)]
mod tests;
