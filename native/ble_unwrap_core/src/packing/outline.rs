//! The boundary of a set of triangles, for rasters that do not depend on their number.

use std::collections::HashMap;

use nalgebra::Point2;

use super::{PackError, PackItem};
use crate::predicates::orientation;

/// The union of an item's triangles as a 1-chain.
///
/// Every triangle is turned counter-clockwise and the sum of all boundaries taken, where an edge
/// and its opposite cancel. The winding number of the chain at a point is then the number of
/// triangles over it, whatever their overlaps: the union is where it is not zero. Triangles without
/// area leave their edges as wires of winding zero, which only have to be covered.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    /// Vertices, in units of `unit` and relative to `centre`; all within the unit circle or nearly.
    pub(super) points: Vec<Point2<f64>>,
    /// Edges between them.
    pub(super) edges: Vec<Edge>,
    /// Sum of the triangles' areas, overlaps counted as often as they occur; in units of `unit`².
    pub(super) area: f64,
    /// Centre of the bounding box, in the chart plane.
    pub(super) centre: Point2<f64>,
    /// Larger extent of the bounding box, in the chart plane; 0 for a point or no triangle.
    pub(super) extent: f64,
    /// Whether the chart is never enlarged, however small it is.
    pub(super) keeps_size: bool,
    /// The item's number of each vertex; empty where vertices were moved together.
    pub(super) source: Vec<u32>,
}

/// A directed edge, its interior to the left, `winding` times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) winding: i32,
}

impl Outline {
    /// Outline of an item. O(n log n).
    ///
    /// # Errors
    /// Corner out of range, or a coordinate that is not finite or too large to subtract.
    pub(super) fn new(item: &PackItem<'_>, index: usize) -> Result<Self, PackError> {
        let (mut low, mut high) = (Point2::new(f64::MAX, f64::MAX), Point2::new(f64::MIN, f64::MIN));
        for (t, corners) in item.triangles.iter().enumerate() {
            for &corner in corners {
                let Some(p) = item.points.get(corner as usize) else {
                    return Err(PackError::CornerOutOfRange { item: index, triangle: t, points: item.points.len() });
                };
                if !(p.x.abs() <= LARGEST && p.y.abs() <= LARGEST) {
                    return Err(PackError::NotFinite { item: index, triangle: t });
                }
                low = low.inf(p);
                high = high.sup(p);
            }
        }
        if item.triangles.is_empty() {
            let centre = Point2::origin();
            return Ok(Self {
                points: Vec::new(),
                edges: Vec::new(),
                area: 0.0,
                centre,
                extent: 0.0,
                keeps_size: false,
                source: Vec::new(),
            });
        }
        let size = high - low;
        let extent = size.x.max(size.y);
        let unit = if extent > 0.0 { extent } else { 1.0 };
        let centre = low + 0.5 * size;
        let mut area = 0.0;
        let mut half = Vec::with_capacity(3 * item.triangles.len());
        for corners in item.triangles {
            let p = corners.map(|c| item.points[c as usize]);
            let [a, b, c] = p.map(|p| Point2::from((p - centre) / unit));
            let turn = orientation(a, b, c);
            area += 0.5 * turn.abs();
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let up = if (a < b) == (turn > 0.0) { 1 } else { -1 };
                half.push((a.min(b), a.max(b), if turn == 0.0 { 0 } else { up }));
            }
        }
        half.sort_unstable();
        let mut new_index = HashMap::new();
        let (mut points, mut source) = (Vec::new(), Vec::new());
        let mut edges = Vec::new();
        let mut keep = |v: u32| {
            *new_index.entry(v).or_insert_with(|| {
                points.push(Point2::from((item.points[v as usize] - centre) / unit));
                source.push(v);
                points.len() as u32 - 1
            })
        };
        for same in half.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let winding: i32 = same.iter().map(|e| e.2).sum();
            if winding != 0 || same.iter().any(|e| e.2 == 0) {
                let (low, high) = (keep(same[0].0), keep(same[0].1));
                let (from, to) = if winding >= 0 { (low, high) } else { (high, low) };
                edges.push(Edge { from, to, winding: winding.abs() });
            }
        }
        Ok(Self { points, edges, area, centre, extent, keeps_size: false, source })
    }

    /// The outline with its vertices moved together on a lattice of `step` units, which leaves far fewer
    /// edges: for rasters of cells much larger than that. Every vertex moves by at most `step`; the
    /// chain stays closed, for its boundary moves along.
    pub(super) fn coarsened(&self, step: f64) -> Self {
        let mut new_index: HashMap<(i64, i64), u32> = HashMap::new();
        let mut points = Vec::new();
        let of = |p: &Point2<f64>| {
            let key = ((p.x / step).round() as i64, (p.y / step).round() as i64);
            *new_index.entry(key).or_insert_with(|| {
                points.push(*p);
                points.len() as u32 - 1
            })
        };
        let to: Vec<u32> = self.points.iter().map(of).collect();
        let mut moved: Vec<(u32, u32, i32)> = self
            .edges
            .iter()
            .map(|e| {
                let (from, to) = (to[e.from as usize], to[e.to as usize]);
                if from < to { (from, to, e.winding) } else { (to, from, -e.winding) }
            })
            .collect();
        moved.sort_unstable();
        let mut edges = Vec::with_capacity(moved.len());
        for same in moved.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (from, to) = (same[0].0, same[0].1);
            let winding: i32 = same.iter().map(|e| e.2).sum();
            // What has shrunk to a line or a point is still there.
            if from != to || edges.is_empty() {
                let (from, to) = if winding >= 0 { (from, to) } else { (to, from) };
                edges.push(Edge { from, to, winding: winding.abs() });
            }
        }
        Self { points, edges, source: Vec::new(), ..*self }
    }

    /// What one unit of `points` is in the chart plane.
    pub(super) fn unit(&self) -> f64 {
        if self.extent > 0.0 { self.extent } else { 1.0 }
    }
}

/// Coordinates up to this can be subtracted and squared.
pub(crate) const LARGEST: f64 = 1e150;

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> Outline {
        let points: Vec<_> = points.iter().map(|&[x, y]| Point2::new(x, y)).collect();
        Outline::new(&PackItem { points: &points, triangles }, 0).expect("valid triangles")
    }

    #[test]
    fn inner_edges_cancel_whatever_the_orientation() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        for triangles in [[[0, 1, 2], [0, 2, 3]], [[0, 1, 2], [0, 3, 2]], [[2, 1, 0], [3, 2, 0]]] {
            let o = outline(&square, &triangles);
            assert_eq!(o.edges.len(), 4);
            assert!(o.edges.iter().all(|e| e.winding == 1));
            assert!((o.area * o.unit() * o.unit() - 4.0).abs() < 1e-12);
            let twice: f64 =
                o.edges.iter().map(|e| o.points[e.from as usize].coords.perp(&o.points[e.to as usize].coords)).sum();
            assert!((twice - 2.0).abs() < 1e-12, "the chain runs counter-clockwise");
        }
    }

    #[test]
    fn overlapping_triangles_wind_twice_and_flat_ones_stay_as_wires() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0]];
        let o = outline(&points, &[[0, 1, 2], [2, 1, 0]]);
        assert!(o.edges.len() == 3 && o.edges.iter().all(|e| e.winding == 2));
        let wire = outline(&points, &[[0, 3, 1]]);
        assert!(wire.edges.len() == 3 && wire.edges.iter().all(|e| e.winding == 0));
        assert_eq!(wire.area, 0.0);
    }

    #[test]
    fn coarsening_keeps_the_chain_closed_and_the_shape() {
        // A ring of 2 × 600 edges whose inner circle is too fine for the lattice of a twentieth.
        let n = 600u32;
        let circle = |r: f64| {
            (0..n).map(move |k| {
                let t = std::f64::consts::TAU * f64::from(k) / f64::from(n);
                [r * t.cos(), r * t.sin()]
            })
        };
        let points: Vec<[f64; 2]> = circle(1.0).chain(circle(0.3)).collect();
        let triangles: Vec<[u32; 3]> = (0..n)
            .flat_map(|k| {
                let next = (k + 1) % n;
                [[k, next, n + k], [next, n + next, n + k]]
            })
            .collect();
        let fine = outline(&points, &triangles);
        let coarse = fine.coarsened(0.05);
        assert!(coarse.edges.len() * 5 < fine.edges.len(), "{} edges", coarse.edges.len());
        let mut flow = vec![0; coarse.points.len()];
        for e in &coarse.edges {
            flow[e.from as usize] -= e.winding;
            flow[e.to as usize] += e.winding;
        }
        assert!(flow.iter().all(|&f| f == 0), "as many edges arrive as leave");
        let area = |o: &Outline| -> f64 {
            let at = |v: u32| o.points[v as usize].coords;
            o.edges.iter().map(|e| 0.5 * f64::from(e.winding) * at(e.from).perp(&at(e.to))).sum()
        };
        assert!((area(&coarse) / area(&fine) - 1.0).abs() < 0.1, "{} of {}", area(&coarse), area(&fine));
        // However coarse, something is left.
        assert!(!fine.coarsened(9.0).edges.is_empty());
    }

    #[test]
    fn names_what_is_wrong() {
        let points = [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(f64::NAN, 1.0)];
        let bad = PackItem { points: &points, triangles: &[[0, 1, 0], [0, 1, 2]] };
        assert!(matches!(Outline::new(&bad, 4), Err(PackError::NotFinite { item: 4, triangle: 1 })));
        let bad = PackItem { points: &points, triangles: &[[0, 1, 3]] };
        assert!(matches!(Outline::new(&bad, 2), Err(PackError::CornerOutOfRange { item: 2, triangle: 0, points: 3 })));
    }
}
