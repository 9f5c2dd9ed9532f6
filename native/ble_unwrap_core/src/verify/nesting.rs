//! Boundary loops inside other charts.

use crate::metrics::{Bounds, BoxTree, Visitor, in_batches};
use crate::progress::{Cancelled, Progress};

use super::boundary::{Boundary, BoundaryEdge};
use super::{Defect, Point, orientation};

/// Charts with more boundary edges than this get a tree of their own.
const LINEAR: usize = 32;
/// Edges and charts that a chunk of loops looks at before it gives up.
const CHUNK_BUDGET: u64 = 4_000_000;

/// Loops inside the filled area of other charts.
pub(super) struct Nested {
    pub(super) nested: Defect<(u32, u32)>,
    /// Charts involved.
    pub(super) charts: Vec<u32>,
    pub(super) complete: bool,
}

/// One chart's boundary, ready for point queries.
struct Outline<'a> {
    edges: &'a [BoundaryEdge],
    bounds: Bounds,
    tree: Option<BoxTree>,
    lowest: u32,
}

/// Tests a point of each loop against every other chart whose box holds it. Meaningful where
/// boundaries do not touch; else a contact has been found already.
pub(super) fn nested(boundary: &Boundary, progress: &Progress) -> Result<Nested, Cancelled> {
    let mut outlines = Vec::new();
    for edges in boundary.edges.chunk_by(|a, b| a.chart == b.chart) {
        let boxes: Vec<Bounds> = edges.iter().map(|e| Bounds::of(&e.ends.map(|p| p.map(f64::from)))).collect();
        outlines.push(Outline {
            edges,
            bounds: boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(b)),
            tree: (edges.len() > LINEAR).then(|| BoxTree::new(boxes)),
            lowest: edges.iter().map(|e| e.triangle).min().unwrap_or(0),
        });
    }
    progress.check()?;
    let tree = BoxTree::new(outlines.iter().map(|o| o.bounds).collect());
    let mut out = Nested { nested: Defect::default(), charts: Vec::new(), complete: true };
    // Work done so far. Ten nanoseconds each: seconds at worst.
    let mut state = 0u64;
    let total_budget = 64 * boundary.edges.len() as u64 + 100_000_000;
    in_batches(
        boundary.loops.len(),
        progress,
        &mut state,
        |range, _| {
            let mut found = (Defect::default(), Vec::new());
            let mut work = 0;
            for l in &boundary.loops[range] {
                let point = l.point.map(f64::from);
                let mut c =
                    Candidates { tree: &tree, query: Bounds { lo: point, hi: point }, found: Vec::new(), work: 0 };
                if work < CHUNK_BUDGET {
                    tree.walk(0, &mut c);
                }
                work += c.work;
                for outline in c.found.iter().map(|&i| &outlines[i]) {
                    if outline.edges[0].chart != l.chart
                        && work < CHUNK_BUDGET
                        && winding_number(outline, l.point, &mut work) != 0
                    {
                        found.0.add((l.triangle, outline.lowest));
                        found.1.extend([l.chart, outline.edges[0].chart]);
                    }
                }
            }
            found.1.sort_unstable();
            found.1.dedup();
            (found, work)
        },
        |total, ((defect, charts), work)| {
            *total += work;
            out.nested.merge(defect);
            out.charts.extend(charts);
            out.complete &= work < CHUNK_BUDGET && *total <= total_budget;
            *total <= total_budget
        },
    )?;
    Ok(out)
}

/// Collects the items whose box holds a point.
struct Candidates<'a> {
    tree: &'a BoxTree,
    query: Bounds,
    found: Vec<usize>,
    work: u64,
}

impl Visitor for Candidates<'_> {
    fn enter(&mut self, _: usize, bounds: &Bounds) -> bool {
        bounds.meets(&self.query)
    }

    fn item(&mut self, position: usize) -> bool {
        self.work += 1;
        if self.tree.bounds(position).meets(&self.query) {
            self.found.push(self.tree.source(position));
        }
        self.work < CHUNK_BUDGET
    }
}

/// Winding number of an outline around a point not on it, by the crossings of the ray to the right.
/// Exact.
fn winding_number(outline: &Outline, p: Point, work: &mut u64) -> i32 {
    let Some(tree) = &outline.tree else {
        *work += outline.edges.len() as u64;
        return outline.edges.iter().map(|e| crossing(e, p)).sum();
    };
    let start = p.map(f64::from);
    let ray = Bounds { lo: start, hi: [f64::INFINITY, start[1]] };
    let mut c = Candidates { tree, query: ray, found: Vec::new(), work: 0 };
    tree.walk(0, &mut c);
    *work += c.work;
    c.found.iter().map(|&i| crossing(&outline.edges[i], p)).sum()
}

/// +1 where an edge crosses the ray from `p` to the right upwards, −1 downwards. An edge holds its
/// lower end and not its upper one, so a vertex on the ray counts once or not at all, as it should.
fn crossing(e: &BoundaryEdge, p: Point) -> i32 {
    let [a, b] = e.ends;
    if a[1] <= p[1] && p[1] < b[1] {
        i32::from(orientation(a, b, p) > 0)
    } else if b[1] <= p[1] && p[1] < a[1] {
        -i32::from(orientation(a, b, p) < 0)
    } else {
        0
    }
}
