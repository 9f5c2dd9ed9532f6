//! Polygons without their sides of no length.
//!
//! A side whose ends are at one place, or nearer than anything reads, is a point of the surface. Left in, it is a slit in
//! the surface where its two vertices have different neighbours, and its polygon has a triangle that no map can hold.
//! So its ends become one vertex and its polygon does without the corner, which later gets the UV of the corner that
//! stands for it. A polygon that has fewer than three corners left is a segment or a point: its corners follow those of
//! a neighbour that has them.

use std::collections::HashMap;

use nalgebra::Point3;

use super::input::Polygons;
use crate::collections::DisjointSets;

/// Longest side of no length, as a share of the diagonal of the bounding box: a triangle of such a height counts as
/// degenerate in the measures, since single precision resolves no less.
const NO_LENGTH: f64 = 1e-7;

/// And as a share of the longest side of each of its polygons, so that a small part beside a large one keeps its shape.
/// Flatter triangles carry no texture worth protecting.
const NO_SHARE: f64 = 1e-3;

/// Polygons with fewer corners, and what became of the others.
#[derive(Clone, Debug, Default)]
pub(super) struct Collapsed {
    /// The vertex of each corner that is left.
    pub(super) corner_vertices: Vec<i32>,
    /// As in the input, of the corners and polygons that are left.
    pub(super) face_offsets: Vec<i32>,
    /// The corner of the input that each corner is; ascending.
    pub(super) corner: Vec<u32>,
    /// The polygon of the input that each polygon is; ascending.
    pub(super) polygon: Vec<u32>,
    /// Each corner of the input that is left out, with the corner it goes with, which is not.
    pub(super) followers: Vec<[u32; 2]>,
    /// Each polygon of the input that is left out, with the neighbour its corners go with.
    pub(super) absorbed: Vec<[u32; 2]>,
    /// The sides of no length, by the vertices at their ends, lower first; each once.
    pub(super) edges: Vec<[u32; 2]>,
}

/// Joins the ends of all sides of no length: vertices that become one get the lowest `representative` of theirs.
///
/// `points` are in a frame whose bounding box has the given diagonal. Shortest sides first, and only as long as all that
/// is joined fits into a box of the length allowed: a round of many short sides keeps its shape. O(n), and
/// O(m log m) for m such sides.
pub(super) fn join_ends(
    polygons: &Polygons<'_>,
    mapped: &[bool],
    points: &[Point3<f64>],
    diagonal: f64,
    representative: &mut [u32],
) {
    let most = NO_LENGTH * diagonal;
    let length = |[a, b]: [usize; 2]| (points[b] - points[a]).norm();
    // The ends of short sides, their length, and whether they are short to their polygon, too.
    let mut short: Vec<([u32; 2], u64, bool)> = Vec::new();
    for p in (0..polygons.len()).filter(|&p| mapped[p]) {
        let mut longest = None;
        for corner in polygons.corners(p) {
            let side = polygons.side(corner);
            let [a, b] = side.map(|v| representative[v]);
            let own = length(side);
            if a == b || own > most {
                continue;
            }
            let longest = *longest
                .get_or_insert_with(|| polygons.corners(p).map(|c| length(polygons.side(c))).fold(0.0, f64::max));
            // The bits of numbers that are not negative are in their order.
            short.push(([a.min(b), a.max(b)], own.to_bits(), own <= NO_SHARE * longest));
        }
    }
    if short.is_empty() {
        return;
    }
    short.sort_unstable();
    let mut sides: Vec<(u64, [u32; 2])> = short
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|same| same.iter().all(|s| s.2))
        .map(|same| (same[0].1, same[0].0))
        .collect();
    sides.sort_unstable();
    let mut sets = DisjointSets::new(representative.len());
    let mut boxes: HashMap<usize, [Point3<f64>; 2]> = HashMap::new();
    for (_, ends) in sides {
        let roots = ends.map(|v| sets.root(v as usize));
        let [a, b] = roots.map(|r| boxes.get(&r).copied().unwrap_or([points[r]; 2]));
        let both = [a[0].inf(&b[0]), a[1].sup(&b[1])];
        if (both[1] - both[0]).norm() <= most {
            sets.join(roots[0], roots[1]);
            boxes.insert(roots[0].min(roots[1]), both);
        }
    }
    for r in representative.iter_mut() {
        *r = sets.root(*r as usize) as u32;
    }
}

impl Collapsed {
    /// The polygons less every corner whose point is that of the corner before it, and less the polygons that have fewer
    /// than three corners left and a neighbour with the same points; `None` where all is as it was. Polygons without such
    /// a neighbour stay as they are. O(n), and O(m log m) for m polygons left out.
    pub(super) fn new(polygons: &Polygons<'_>, mapped: &[bool], representative: &[u32]) -> Option<Self> {
        let point = |corner: usize| representative[polygons.vertex(corner)];
        let is_shrunk = |corner: usize| point(corner) == point(polygons.next(corner));
        let shrunk = |p: usize| mapped[p] && polygons.corners(p).any(is_shrunk);
        let first = (0..polygons.len()).find(|&p| shrunk(p))?;

        let mut out = Self::default();
        let mut flat = Vec::new();
        out.face_offsets.push(0);
        for p in 0..polygons.len() {
            let corners = polygons.corners(p);
            if p < first || !shrunk(p) {
                out.keep(polygons, p, corners);
                continue;
            }
            let ends = corners.clone().filter(|&c| is_shrunk(c)).map(|c| polygons.side(c).map(|v| v as u32));
            out.edges.extend(ends.map(|[a, b]| [a.min(b), a.max(b)]));
            // The first corner of each run at one point stays.
            let last = corners.end - 1;
            let before = |c: usize| if c == corners.start { last } else { c - 1 };
            let firsts: Vec<usize> = corners.clone().filter(|&c| !is_shrunk(before(c))).collect();
            if firsts.len() < 3 {
                flat.push(Flat::new(p, firsts.iter().map(|&c| point(c)), point(last)));
                continue;
            }
            for c in corners.clone().filter(|&c| is_shrunk(before(c))) {
                // The last run's first corner where the run goes over the end.
                let at = firsts.partition_point(|&f| f <= c).checked_sub(1).unwrap_or(firsts.len() - 1);
                out.followers.push([c as u32, firsts[at] as u32]);
            }
            out.keep(polygons, p, firsts.into_iter());
        }
        if !flat.is_empty() {
            out = out.with_flat(polygons, mapped, flat, &point);
        }
        out.edges.sort_unstable();
        out.edges.dedup();
        Some(out)
    }

    /// Appends a polygon with some of its corners.
    fn keep(&mut self, polygons: &Polygons<'_>, polygon: usize, corners: impl Iterator<Item = usize>) {
        for c in corners {
            self.corner.push(c as u32);
            self.corner_vertices.push(polygons.vertex(c) as i32);
        }
        self.polygon.push(polygon as u32);
        self.face_offsets.push(self.corner.len() as i32);
    }

    /// Finds a neighbour for each flat polygon among those that are left; those without one come back whole.
    fn with_flat(
        self,
        polygons: &Polygons<'_>,
        mapped: &[bool],
        mut flat: Vec<Flat>,
        point: &impl Fn(usize) -> u32,
    ) -> Self {
        flat.sort_unstable_by_key(|f| (f.ends, f.polygon));
        // The lowest corner from which a side leads along the same segment, and the corner it leads to.
        let mut host: Vec<Option<[usize; 2]>> = vec![None; flat.len()];
        for (pair, _) in self.face_offsets.windows(2).zip(&self.polygon).filter(|(_, p)| mapped[**p as usize]) {
            let corners = &self.corner[pair[0] as usize..pair[1] as usize];
            for (i, &c) in corners.iter().enumerate() {
                let side = [c, corners[(i + 1) % corners.len()]].map(|c| c as usize);
                let [a, b] = side.map(point);
                for ends in [[a.min(b), a.max(b)], [a, a]] {
                    let at = flat.partition_point(|f| f.ends < ends);
                    if flat.get(at).is_some_and(|f| f.ends == ends) {
                        host[at].get_or_insert(side);
                    }
                }
            }
        }
        let mut out = Self { followers: self.followers, edges: self.edges, face_offsets: vec![0], ..Self::default() };
        let mut whole: Vec<usize> = Vec::new();
        let mut at = 0;
        for same in flat.chunk_by(|a, b| a.ends == b.ends) {
            for f in same {
                let Some(side) = host[at] else {
                    whole.push(f.polygon);
                    continue;
                };
                out.absorbed.push([f.polygon as u32, polygons.polygon(side[0]) as u32]);
                for c in polygons.corners(f.polygon) {
                    let with = if point(c) == point(side[0]) { side[0] } else { side[1] };
                    out.followers.push([c as u32, with as u32]);
                }
            }
            at += same.len();
        }
        whole.sort_unstable();
        let mut whole = whole.into_iter().peekable();
        for (i, &p) in self.polygon.iter().enumerate() {
            while let Some(q) = whole.next_if(|&q| q < p as usize) {
                out.keep(polygons, q, polygons.corners(q));
            }
            let corners = self.face_offsets[i] as usize..self.face_offsets[i + 1] as usize;
            out.keep(polygons, p as usize, self.corner[corners].iter().map(|&c| c as usize));
        }
        for q in whole {
            out.keep(polygons, q, polygons.corners(q));
        }
        out.absorbed.sort_unstable();
        out
    }

    /// Given triangles of the input's polygons as triangles of what is left of them: those that lost a corner are left
    /// out. Of a triangulated polygon of n corners that loses one, n − 3 are left, which triangulate it.
    pub(super) fn triangles(&self, given: &[[i32; 3]], corner_count: usize) -> Vec<[i32; 3]> {
        let mut now = vec![-1; corner_count];
        for (i, &c) in self.corner.iter().enumerate() {
            now[c as usize] = i as i32;
        }
        for &[c, with] in &self.followers {
            now[c as usize] = now[with as usize];
        }
        given.iter().map(|t| t.map(|c| now[c as usize])).filter(|[a, b, c]| a != b && b != c && c != a).collect()
    }
}

/// A polygon all of whose corners lie at one point or two.
struct Flat {
    polygon: usize,
    /// The points, lower first; twice the same if it is one.
    ends: [u32; 2],
}

impl Flat {
    /// `firsts` are the points of its runs, `only` the point of all corners where no run begins.
    fn new(polygon: usize, mut firsts: impl Iterator<Item = u32>, only: u32) -> Self {
        let a = firsts.next().unwrap_or(only);
        let b = firsts.next().unwrap_or(a);
        Self { polygon, ends: [a.min(b), a.max(b)] }
    }
}
