//! Which sides of polygons become one edge.

use nalgebra::{Point3, Vector3};
use rayon::slice::ParallelSliceMut;

use super::defects::Defect;
use super::input::Polygons;
use super::measure::area_vector;
use crate::progress::{Cancelled, Progress};

/// Two sides of different polygons that are one edge. A side goes by the corner it leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Link {
    /// The two sides, lower corner first.
    pub(super) sides: [u32; 2],
    /// Both run the same way: one of the polygons is wound the wrong way round.
    pub(super) same_direction: bool,
}

/// What gluing found.
#[derive(Clone, Debug, Default)]
pub(super) struct Glued {
    /// The edges with two polygons.
    pub(super) links: Vec<Link>,
    /// Sides at whose ends one vertex may become several: unglued ones that share both ends with
    /// another side, seams, and all sides of edges with more than two.
    pub(super) severed: Vec<u32>,
    /// Edges with more than two polygons.
    pub(super) non_manifold: Defect<[u32; 2]>,
}

/// Most sides at one edge of which all pairs are compared; beyond, opposed sides are paired in order.
const MOST_COMPARED: usize = 64;

/// Cosine between the normals of two faces that lie on one another: closer to −1 than any fold a
/// modeller means, farther than rounding takes exact copies.
const FOLDED: f64 = -1.0 + 1e-9;

/// Everything gluing looks at.
pub(super) struct Sides<'a> {
    /// The polygons.
    pub(super) polygons: &'a Polygons<'a>,
    /// Which of them take part.
    pub(super) mapped: &'a [bool],
    /// Coordinates of the vertices.
    pub(super) points: &'a [Point3<f64>],
    /// The vertex that stands for each vertex once welded.
    pub(super) representative: &'a [u32],
    /// The triangles, by corner.
    pub(super) triangles: &'a [[u32; 3]],
    /// The half-edge (three a triangle, in the order of `triangles`) that is the side of each corner.
    pub(super) side_halfedge: &'a [u32],
    /// Vertex pairs to cut.
    pub(super) seams: &'a [[i32; 2]],
}

impl Sides<'_> {
    /// Pairs up the sides.
    ///
    /// Two sides at an edge are glued, whatever their directions. Of more than two, opposed pairs
    /// are glued from the flattest dihedral angle on (at equal angles a convex edge first); none of
    /// one direction, because where more than two faces meet only the winding tells which belong
    /// together. Sides that share their vertices in the
    /// input come before sides that only weld together: welding adds edges and never takes one
    /// away. Never glued: two sides of one polygon, seams, a side from a vertex to itself, and
    /// faces that lie on one another unless they share vertices and oppose. O(n log n).
    pub(super) fn glue(&self, progress: &Progress) -> Result<Glued, Cancelled> {
        // Sides that welding has shrunk to a point still have two vertices to be recognised by.
        let (mut keyed, mut shrunk) = (Vec::with_capacity(self.polygons.corner_count()), Vec::new());
        for corner in (0..self.polygons.corner_count()).filter(|&c| self.mapped[self.polygons.polygon(c)]) {
            let [a, b] = self.polygons.side(corner);
            let (p, q) = (self.representative[a], self.representative[b]);
            if p != q {
                keyed.push((key(p, q), corner as u32));
            } else if a != b {
                shrunk.push((key(a as u32, b as u32), corner as u32));
            }
        }
        progress.check()?;
        keyed.par_sort_unstable();
        shrunk.par_sort_unstable();
        progress.check()?;
        let seam_keys = |name: &dyn Fn(i32) -> u32| {
            let mut keys: Vec<u64> = self.seams.iter().map(|s| key(name(s[0]), name(s[1]))).collect();
            keys.sort_unstable();
            keys
        };
        let welded_seams = seam_keys(&|v| self.representative[v as usize]);
        let mut glued = Glued { links: Vec::with_capacity(keyed.len() / 2), ..Glued::default() };
        for (i, group) in keyed.chunk_by(|a, b| a.0 == b.0).enumerate() {
            if i.is_multiple_of(1 << 16) {
                progress.check()?;
            }
            self.glue_group(group, &welded_seams, true, &mut glued);
        }
        let seams = seam_keys(&|v| v as u32);
        for group in shrunk.chunk_by(|a, b| a.0 == b.0) {
            self.glue_group(group, &seams, false, &mut glued);
        }
        Ok(glued)
    }

    /// Glues the sides between two points; `welded` says by which of the two names their ends go.
    fn glue_group(&self, group: &[(u64, u32)], seams: &[u64], welded: bool, glued: &mut Glued) {
        if let [_] = group {
            return;
        }
        if !seams.is_empty() && seams.binary_search(&group[0].0).is_ok() {
            glued.severed.extend(group.iter().map(|s| s.1));
            return;
        }
        if let [(_, a), (_, b)] = *group {
            self.glue_pair([a, b], welded, glued);
            return;
        }
        let mut sides: Vec<(u64, u32)> = group.iter().map(|&(_, s)| (self.input_key(s), s)).collect();
        sides.sort_unstable();
        let mut left = Vec::new();
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            match *same {
                [(_, a)] => left.push(a),
                [(_, a), (_, b)] => self.glue_pair([a, b], welded, glued),
                _ => self.glue_crowd(&same.iter().map(|s| s.1).collect::<Vec<_>>(), welded, glued),
            }
        }
        match *left {
            [] => {}
            [a] => glued.severed.push(a),
            [a, b] => self.glue_pair([a, b], welded, glued),
            _ => {
                left.sort_unstable();
                self.glue_crowd(&left, welded, glued);
            }
        }
    }

    fn glue_pair(&self, [a, b]: [u32; 2], welded: bool, glued: &mut Glued) {
        let same_direction = self.start(a, welded) == self.start(b, welded);
        if self.may_meet([a, b], same_direction) {
            glued.links.push(Link { sides: [a.min(b), a.max(b)], same_direction });
        } else {
            glued.severed.extend([a, b]);
        }
    }

    /// Pairs up more than two sides, in ascending order, at one edge.
    fn glue_crowd(&self, sides: &[u32], welded: bool, glued: &mut Glued) {
        let pairs = self.crowd_pairs(sides, welded);
        let before = glued.links.len();
        let mut taken = vec![false; sides.len()];
        for [a, b] in pairs {
            if let (Ok(i), Ok(j)) = (sides.binary_search(&a), sides.binary_search(&b))
                && !taken[i]
                && !taken[j]
            {
                (taken[i], taken[j]) = (true, true);
                glued.links.push(Link { sides: [a.min(b), a.max(b)], same_direction: false });
            }
        }
        // Layers that merely lie on one another are not an edge of several faces.
        let edge = self.input_key(sides[0]);
        if glued.links.len() > before || sides.iter().all(|&s| self.input_key(s) == edge) {
            glued.non_manifold.found([(edge >> 32) as u32, edge as u32]);
        }
        glued.severed.extend(sides);
    }

    /// Opposed pairs to glue at an edge with more than two sides, best first. A side may occur in several.
    fn crowd_pairs(&self, sides: &[u32], welded: bool) -> Vec<[u32; 2]> {
        let start = self.start(sides[0], welded);
        let (along, against): (Vec<u32>, Vec<u32>) = sides.iter().partition(|&&s| self.start(s, welded) == start);
        if sides.len() > MOST_COMPARED {
            let pairs = along.iter().zip(&against).map(|(&a, &b)| [a, b]);
            return pairs.filter(|&pair| self.may_meet(pair, false)).collect();
        }
        self.by_flatness(along.iter().flat_map(|&a| against.iter().map(move |&b| [a, b])))
    }

    /// The opposed pairs that may be glued, flattest first, at equal angles convex ones, then by corner.
    fn by_flatness(&self, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
        // Angles that differ by rounding count as equal.
        const STEPS: f64 = 1e6;
        let mut ranked: Vec<(i64, bool, [u32; 2])> = pairs
            .filter(|&pair| self.may_meet(pair, false))
            .map(|[a, b]| {
                let (na, nb) = (self.normal(a), self.normal(b));
                let [from, to] = self.polygons.side(a as usize);
                let reflex = na.cross(&nb).dot(&(self.points[to] - self.points[from])) < 0.0;
                let bend = -self.cosine([a, b], false) * STEPS;
                (bend.round() as i64, reflex, [a, b])
            })
            .collect();
        ranked.sort_unstable();
        ranked.into_iter().map(|r| r.2).collect()
    }

    /// Whether two sides at one edge may be glued at all.
    fn may_meet(&self, [a, b]: [u32; 2], same_direction: bool) -> bool {
        if self.polygons.polygon(a as usize) == self.polygons.polygon(b as usize) {
            return false;
        }
        let shared = self.input_key(a) == self.input_key(b);
        (shared && !same_direction) || self.cosine([a, b], same_direction) > FOLDED
    }

    /// Cosine of the angle between the normals at two sides, the windings made to agree; 0 where a
    /// face has no area.
    fn cosine(&self, [a, b]: [u32; 2], same_direction: bool) -> f64 {
        let cosine = self.normal(a).dot(&self.normal(b));
        if same_direction { -cosine } else { cosine }
    }

    /// Unit normal of the triangle at a side, or zero.
    fn normal(&self, side: u32) -> Vector3<f64> {
        let triangle = self.triangles[self.side_halfedge[side as usize] as usize / 3];
        let corners = triangle.map(|c| self.points[self.polygons.vertex(c as usize)]);
        area_vector(corners).try_normalize(0.0).unwrap_or_else(Vector3::zeros)
    }

    /// The point or vertex a side begins at.
    fn start(&self, side: u32, welded: bool) -> u32 {
        let vertex = self.polygons.vertex(side as usize);
        if welded { self.representative[vertex] } else { vertex as u32 }
    }

    /// The vertices of the input at the ends of a side, in either direction.
    fn input_key(&self, side: u32) -> u64 {
        let [a, b] = self.polygons.side(side as usize);
        key(a as u32, b as u32)
    }
}

/// Two vertices in ascending order as one number.
fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}
