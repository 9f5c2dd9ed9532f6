//! Triangles of polygons: those the host gave, checked, or our own.

use nalgebra::Point3;

use super::defects::Defect;
use super::ear_clipping::clip_ears;
use super::input::{MeshError, Polygons};
use super::measure::area_vector;
use crate::collections::DisjointSets;
use crate::progress::Progress;

/// Every polygon as n − 2 triangles that form a topological disk.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangulation {
    /// The corners of each triangle, wound as its polygon; in the order of the polygons.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The polygon of each triangle.
    pub(super) polygon: Vec<u32>,
    /// Polygons whose given triangles were of no use.
    pub(super) replaced: Defect<u32>,
}

/// Triangulates the polygons for which `mapped` holds.
///
/// Given triangles are taken where they are a triangulation: n − 2 of them, wound as the polygon,
/// each side once, each diagonal twice, all in one piece. Otherwise quads are halved by
/// [`halve_quad`], larger polygons by ear clipping. `points` are the vertices, finite and of
/// moderate size for mapped polygons.
///
/// # Errors
/// A given triangle with an unknown corner or with corners of several polygons; cancellation.
pub(super) fn triangulate(
    polygons: &Polygons<'_>,
    mapped: &[bool],
    points: &[Point3<f64>],
    given: Option<&[[i32; 3]]>,
    progress: &Progress,
) -> Result<Triangulation, MeshError> {
    let given = given.map(|g| GivenTriangles::new(polygons, g)).transpose()?;
    let count = polygons.corner_count() - 2 * polygons.len();
    let mut out = Triangulation {
        triangles: Vec::with_capacity(count),
        polygon: Vec::with_capacity(count),
        replaced: Defect::default(),
    };
    let (mut local, mut outline) = (Vec::new(), Vec::new());
    for p in (0..polygons.len()).filter(|&p| mapped[p]) {
        if p.is_multiple_of(1 << 12) {
            progress.check()?;
        }
        let corners = polygons.corners(p);
        local.clear();
        if let Some(given) = &given {
            given.of_polygon(p, corners.start, &mut local);
            if !is_triangulation(&local, corners.len()) {
                out.replaced.found(p as u32);
                local.clear();
            }
        }
        if local.is_empty() {
            outline.clear();
            outline.extend(corners.clone().map(|c| points[polygons.vertex(c)]));
            match *outline {
                [_, _, _] => local.push([0, 1, 2]),
                [a, b, c, d] => local.extend(halve_quad([a, b, c, d], None, Diagonal::FromFirst)),
                _ => clip_ears(&outline, &mut local, progress)?,
            }
        }
        let first = corners.start as u32;
        out.triangles.extend(local.iter().map(|t| t.map(|c| first + c)));
        out.polygon.resize(out.triangles.len(), p as u32);
    }
    Ok(out)
}

/// Checks that each given triangle has corners of one polygon.
///
/// # Errors
/// The first that has not, or more triangles than corners.
pub(super) fn check_given(polygons: &Polygons<'_>, given: &[[i32; 3]]) -> Result<(), MeshError> {
    GivenTriangles::new(polygons, given).map(|_| ())
}

/// Given triangles sorted by polygon.
struct GivenTriangles<'a> {
    triangles: &'a [[i32; 3]],
    /// First entry of each polygon in `order`, and their number.
    offsets: Vec<usize>,
    /// Triangles by polygon; empty if they come in that order already.
    order: Vec<u32>,
}

impl<'a> GivenTriangles<'a> {
    fn new(polygons: &Polygons<'_>, triangles: &'a [[i32; 3]]) -> Result<Self, MeshError> {
        let corner_count = polygons.corner_count();
        if triangles.len() > corner_count {
            return Err(MeshError::TooLarge { element: "triangles", count: triangles.len(), limit: corner_count });
        }
        let mut offsets = vec![0usize; polygons.len() + 1];
        let mut owner = Vec::with_capacity(triangles.len());
        for (triangle, corners) in triangles.iter().enumerate() {
            let mut polygon = [0; 3];
            for (polygon, &corner) in polygon.iter_mut().zip(corners) {
                *polygon = match usize::try_from(corner) {
                    Ok(c) if c < corner_count => polygons.polygon(c),
                    _ => return Err(MeshError::TriangleCornerOutOfRange { triangle, corner, corner_count }),
                };
            }
            let first = polygon[0];
            if let Some(&second) = polygon.iter().find(|&&p| p != first) {
                return Err(MeshError::TriangleAcrossFaces { triangle, first, second });
            }
            offsets[first + 1] += 1;
            owner.push(first as u32);
        }
        for p in 0..polygons.len() {
            offsets[p + 1] += offsets[p];
        }
        let mut order = Vec::new();
        if !owner.is_sorted() {
            let mut next = offsets.clone();
            order.resize(triangles.len(), 0);
            for (triangle, &p) in owner.iter().enumerate() {
                order[next[p as usize]] = triangle as u32;
                next[p as usize] += 1;
            }
        }
        Ok(Self { triangles, offsets, order })
    }

    /// Appends the triangles of a polygon, by corner counted from its first.
    fn of_polygon(&self, polygon: usize, first_corner: usize, out: &mut Vec<[u32; 3]>) {
        for i in self.offsets[polygon]..self.offsets[polygon + 1] {
            let triangle = self.order.get(i).map_or(i, |&t| t as usize);
            out.push(self.triangles[triangle].map(|c| c as u32 - first_corner as u32));
        }
    }
}

/// Whether triangles (by corner, in range) triangulate a polygon of `n` corners as a disk: n − 2 of
/// them, the boundary the polygon's sides in order, in one piece.
///
/// With n sides used once and every other half-edge opposed there are n − 3 diagonals; n − 2
/// triangles that so few diagonals hold together form a tree, and a tree of triangles is a disk.
fn is_triangulation(triangles: &[[u32; 3]], n: usize) -> bool {
    if triangles.len() + 2 != n {
        return false;
    }
    let n = n as u32;
    let mut sides = 0;
    // Diagonals by (lower corner, higher corner, direction), with their triangle.
    let mut diagonals = Vec::with_capacity(3 * triangles.len());
    for (t, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if a == b {
                return false;
            }
            if b == (a + 1) % n {
                sides += 1;
            } else {
                diagonals.push((a.min(b), a.max(b), a > b, t));
            }
        }
    }
    diagonals.sort_unstable();
    // All half-edges being distinct, n sides are all of them.
    if sides != n || !all_sides_once(triangles, n) || diagonals.len() % 2 != 0 {
        return false;
    }
    let mut sets = DisjointSets::new(triangles.len());
    let mut pieces = triangles.len();
    for pair in diagonals.chunks_exact(2) {
        let (first, second) = (pair[0], pair[1]);
        if (first.0, first.1) != (second.0, second.1) || first.2 == second.2 {
            return false;
        }
        pieces -= usize::from(sets.join(first.3, second.3));
    }
    pieces == 1
}

fn all_sides_once(triangles: &[[u32; 3]], n: u32) -> bool {
    let mut seen = vec![false; n as usize];
    for corners in triangles {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if b == (a + 1) % n && std::mem::replace(&mut seen[a as usize], true) {
                return false;
            }
        }
    }
    true
}

/// A diagonal of a quad, by the first corner that it ends at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Diagonal {
    FromFirst,
    FromSecond,
}

/// Halves a quad by the diagonal that leaves no triangle turned over; by the needed one where both will do, if one is, and else by the shorter one.
/// The wanted diagonal wins near-ties, so that rounding does not decide for squares.
pub(super) fn halve_quad(p: [Point3<f64>; 4], needed: Option<Diagonal>, wanted: Diagonal) -> [[u32; 3]; 2] {
    const TIE: f64 = 1.0 + 1e-6;
    // A triangle of less than this share of the quad is turned over or flat, as rounding would have it.
    const FLAT: f64 = 1e-9;
    // The area vector of a quad is half the cross product of its diagonals, however it is bent.
    let normal = (p[2] - p[0]).cross(&(p[3] - p[1]));
    let upright = |t: [u32; 3]| area_vector(t.map(|i| p[i as usize])).dot(&normal);
    let halves = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
    let worst = halves.map(|h: [[u32; 3]; 2]| upright(h[0]).min(upright(h[1])));
    let least = FLAT * normal.norm_squared();
    let second = if worst[0] > least && worst[1] > least {
        let [first, second] = [p[2] - p[0], p[3] - p[1]].map(|d| d.norm_squared());
        match (needed, wanted) {
            (Some(needed), _) => needed == Diagonal::FromSecond,
            (None, Diagonal::FromFirst) => second * TIE < first,
            (None, Diagonal::FromSecond) => second <= first * TIE,
        }
    } else {
        worst[1] > worst[0]
    };
    halves[usize::from(second)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(p: [[f64; 2]; 4]) -> [[u32; 3]; 2] {
        halve_quad(p.map(|[x, y]| Point3::new(x, y, 0.0)), None, Diagonal::FromFirst)
    }

    #[test]
    fn quads_are_halved_by_the_shorter_diagonal_unless_reflex() {
        assert_eq!(quad([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(quad([[0.0, 0.0], [1.0, 0.0], [3.0, 1.0], [0.0, 1.0]]), [[0, 1, 3], [1, 2, 3]]);
        // Corner 2 is reflex and its diagonal the longer one; the same with corner 1.
        assert_eq!(quad([[0.0, 0.0], [2.0, -1.5], [0.5, 0.0], [2.0, 1.5]]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(quad([[-9.0, 0.0], [0.0, 1.0], [9.0, 0.0], [0.0, 9.0]]), [[0, 1, 3], [1, 2, 3]]);
    }

    #[test]
    fn the_needed_diagonal_is_taken_unless_it_turns_a_triangle_over() {
        let flat = |p: [[f64; 2]; 4]| {
            halve_quad(p.map(|[x, y]| Point3::new(x, y, 0.0)), Some(Diagonal::FromFirst), Diagonal::FromSecond)
        };
        assert_eq!(flat([[0.0, 0.0], [1.0, 0.0], [3.0, 1.0], [0.0, 1.0]]), [[0, 1, 2], [0, 2, 3]], "the longer one");
        assert_eq!(
            flat([[-9.0, 0.0], [0.0, 1.0], [9.0, 0.0], [0.0, 9.0]]),
            [[0, 1, 3], [1, 2, 3]],
            "corner 1 is reflex"
        );
    }

    #[test]
    fn triangulations_are_told_from_other_triangles() {
        assert!(is_triangulation(&[[0, 1, 2]], 3));
        assert!(is_triangulation(&[[2, 0, 1]], 3));
        assert!(!is_triangulation(&[[0, 2, 1]], 3), "wound backwards");
        assert!(!is_triangulation(&[[0, 0, 1]], 3));
        assert!(is_triangulation(&[[1, 2, 3], [3, 0, 1]], 4));
        assert!(!is_triangulation(&[[0, 1, 2], [0, 1, 2]], 4), "one half twice");
        assert!(!is_triangulation(&[[0, 1, 2], [1, 2, 3]], 4), "overlapping");
        assert!(!is_triangulation(&[[0, 1, 2]], 4));
        assert!(is_triangulation(&[[0, 1, 2], [2, 3, 4], [4, 0, 2]], 5));
        assert!(is_triangulation(&[[0, 1, 2], [2, 3, 4], [4, 5, 0], [0, 2, 4]], 6));
        assert!(!is_triangulation(&[[0, 1, 2], [2, 3, 4], [4, 5, 0], [0, 1, 2]], 6));
    }
}
