//! The boundary chain of each chart, and its loops.

use rayon::prelude::*;

use crate::metrics::{NONE, for_each_edge};

use super::{Point, orientation};

/// Corners welded: one vertex for each chart and UV.
pub(super) struct Vertices {
    /// Vertex of each corner of each triangle.
    pub(super) of: Vec<[u32; 3]>,
    pub(super) uv: Vec<Point>,
}

impl Vertices {
    /// O(n log n).
    pub(super) fn new(corners: &[[Point; 3]], chart: &[u32]) -> Self {
        let mut keys: Vec<(u32, [u32; 2], u32)> = (0..3 * corners.len())
            .into_par_iter()
            .map(|h| (chart[h / 3], corners[h / 3][h % 3].map(f32::to_bits), h as u32))
            .collect();
        keys.par_sort_unstable();
        let mut of = vec![[NONE; 3]; corners.len()];
        let mut uv = Vec::new();
        for same in keys.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            for &(.., h) in same {
                of[h as usize / 3][h as usize % 3] = uv.len() as u32;
            }
            uv.push(same[0].1.map(f32::from_bits));
        }
        Self { of, uv }
    }
}

/// A directed edge of the boundary chain; the chart lies on its left.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundaryEdge {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) ends: [Point; 2],
    pub(super) chart: u32,
    /// The triangle it belongs to, in the numbers of the caller.
    pub(super) triangle: u32,
}

/// A loop of the chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loop {
    pub(super) chart: u32,
    /// A point on it, and the triangle there.
    pub(super) point: Point,
    pub(super) triangle: u32,
}

/// The boundary chains of all charts.
pub(super) struct Boundary {
    /// Sorted by chart.
    pub(super) edges: Vec<BoundaryEdge>,
    pub(super) loops: Vec<Loop>,
    /// Positively oriented loops of each chart.
    pub(super) positive_loops: Vec<usize>,
    /// Vertices that a chain leaves more than once: two triangles there, and the chart.
    pub(super) pinches: Vec<(u32, u32, u32)>,
}

impl Boundary {
    /// `source` gives the callers' number of each triangle. O(n log n).
    pub(super) fn new(vertices: &Vertices, chart: &[u32], source: &[u32], chart_count: usize) -> Self {
        let of = &vertices.of;
        let ends = |h: usize| (of[h / 3][h % 3], of[h / 3][(h % 3 + 1) % 3]);
        let mut edges = Vec::new();
        for_each_edge(
            vertices.uv.len(),
            3 * of.len(),
            |h| Some(ends(h)),
            |group| {
                if let [a, b] = *group
                    && ends(a as usize).0 == ends(b as usize).1
                    && a / 3 != b / 3
                {
                    return;
                }
                for &h in group {
                    let (h, (from, to)) = (h as usize, ends(h as usize));
                    edges.push(BoundaryEdge {
                        from,
                        to,
                        ends: [from, to].map(|v| vertices.uv[v as usize]),
                        chart: chart[h / 3],
                        triangle: source[h / 3],
                    });
                }
            },
        );
        edges.sort_unstable_by_key(|e| (e.chart, e.from, e.to, e.triangle));

        // Sorted by chart and start, and a vertex has one chart: equal starts are neighbours.
        let mut leaving = vec![NONE; vertices.uv.len()];
        let mut pinches = Vec::new();
        for (i, e) in edges.iter().enumerate() {
            let slot = &mut leaving[e.from as usize];
            if *slot == NONE {
                *slot = i as u32;
            } else {
                pinches.push((edges[*slot as usize].triangle, e.triangle, e.chart));
            }
        }
        let mut out = Self { edges, loops: Vec::new(), positive_loops: vec![0; chart_count], pinches };
        out.find_loops(&leaving);
        out
    }

    /// Follows each loop once. At a pinch, which is a fault already, it goes on along the first edge.
    fn find_loops(&mut self, leaving: &[u32]) {
        let edges = &self.edges;
        let mut seen = vec![false; edges.len()];
        for first in 0..edges.len() {
            if seen[first] {
                continue;
            }
            // The lexicographically least vertex of a simple loop is a strictly convex corner.
            let key = |e: &BoundaryEdge| (e.ends[1][0], e.ends[1][1]);
            let (mut i, mut least, mut turn) = (first, None, 0);
            while !seen[i] {
                seen[i] = true;
                let next = leaving[edges[i].to as usize];
                if next == NONE {
                    break;
                }
                let (e, n) = (&edges[i], &edges[next as usize]);
                if least.is_none_or(|l| key(e) < l) {
                    least = Some(key(e));
                    turn = orientation(e.ends[0], e.ends[1], n.ends[1]);
                }
                i = next as usize;
            }
            let e = &edges[first];
            self.loops.push(Loop { chart: e.chart, point: e.ends[0], triangle: e.triangle });
            self.positive_loops[e.chart as usize] += usize::from(turn > 0);
        }
    }
}
