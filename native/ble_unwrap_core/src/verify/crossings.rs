//! Contacts of boundary edges, exact.

use crate::metrics::{Bounds, BoxTree, Visitor, in_batches};
use crate::progress::{Cancelled, Progress};

use super::boundary::BoundaryEdge;
use super::{Defect, Point, orientation};

/// Boxes that meet a chunk of edges looks at before it gives up.
const CHUNK_BUDGET: u64 = 4_000_000;
/// Contacts a chunk counts before it gives up.
const CHUNK_CONTACTS: usize = 20_000;
/// Contacts after which counting stops.
const CONTACT_LIMIT: usize = 300_000;

/// Pairs of edges that have a point in common.
#[derive(Default)]
pub(super) struct Contacts {
    pub(super) inside: Defect<(u32, u32)>,
    pub(super) between: Defect<(u32, u32)>,
    /// Charts involved, ascending.
    pub(super) charts: Vec<u32>,
    pub(super) complete: bool,
}

/// Finds all contacts of edges, those of edges that follow each other aside.
pub(super) fn contacts(edges: &[BoundaryEdge], progress: &Progress) -> Result<Contacts, Cancelled> {
    let tree = BoxTree::new(edges.iter().map(|e| Bounds::of(&e.ends.map(|p| p.map(f64::from)))).collect());
    let ordered: Vec<BoundaryEdge> = (0..tree.len()).map(|p| edges[tree.source(p)]).collect();
    let mut state = (Contacts { complete: true, ..Contacts::default() }, 0u64);
    let total_budget = 64 * edges.len() as u64 + 100_000_000;
    in_batches(
        tree.len(),
        progress,
        &mut state,
        |range, _| {
            let mut s = Search { tree: &tree, ordered: &ordered, me: 0, seen: 0, found: Contacts::default() };
            for position in range {
                s.me = position;
                if s.may_go_on() {
                    tree.walk(position + 1, &mut s);
                }
            }
            s.found.complete = s.may_go_on();
            s.found.charts.sort_unstable();
            s.found.charts.dedup();
            (s.found, s.seen)
        },
        |(total, seen), (found, chunk_seen)| {
            *seen += chunk_seen;
            total.inside.merge(found.inside);
            total.between.merge(found.between);
            total.charts.extend(found.charts);
            let go_on = *seen <= total_budget && total.inside.count + total.between.count < CONTACT_LIMIT;
            total.complete &= found.complete && go_on;
            go_on
        },
    )?;
    let mut found = state.0;
    found.charts.sort_unstable();
    found.charts.dedup();
    Ok(found)
}

struct Search<'a> {
    tree: &'a BoxTree,
    ordered: &'a [BoundaryEdge],
    me: usize,
    seen: u64,
    found: Contacts,
}

impl Search<'_> {
    fn may_go_on(&self) -> bool {
        self.seen < CHUNK_BUDGET && self.found.inside.count + self.found.between.count < CHUNK_CONTACTS
    }
}

impl Visitor for Search<'_> {
    fn enter(&mut self, _: usize, bounds: &Bounds) -> bool {
        self.tree.bounds(self.me).meets(bounds)
    }

    fn item(&mut self, position: usize) -> bool {
        self.seen += 1;
        if self.tree.bounds(self.me).meets(self.tree.bounds(position)) {
            let (a, b) = (&self.ordered[self.me], &self.ordered[position]);
            if touch(a, b) {
                let pair = (a.triangle.min(b.triangle), a.triangle.max(b.triangle));
                if a.chart == b.chart {
                    self.found.inside.add(pair)
                } else {
                    self.found.between.add(pair)
                }
                self.found.charts.extend([a.chart, b.chart]);
            }
        }
        self.may_go_on()
    }
}

/// Whether two edges whose boxes meet have a point in common, other than a vertex of their chart that
/// both end in.
fn touch(a: &BoundaryEdge, b: &BoundaryEdge) -> bool {
    let shared = [a.from, a.to].map(|v| v == b.from || v == b.to);
    if a.chart == b.chart && (shared[0] || shared[1]) {
        if shared[0] && shared[1] {
            return true;
        }
        // Two segments with one end in common share more only if they leave it in one direction.
        let (p, q) = if shared[0] { (a.ends[0], a.ends[1]) } else { (a.ends[1], a.ends[0]) };
        let r = if b.ends[0] == p { b.ends[1] } else { b.ends[0] };
        return orientation(p, q, r) == 0 && same_side(p, q, r);
    }
    let ([a0, a1], [b0, b1]) = (a.ends, b.ends);
    // For collinear segments all four vanish, and the boxes have decided.
    orientation(a0, a1, b0) * orientation(a0, a1, b1) <= 0 && orientation(b0, b1, a0) * orientation(b0, b1, a1) <= 0
}

/// Whether `q` and `r`, collinear with `p`, lie on the same side of it. Exact: only comparisons.
fn same_side(p: Point, q: Point, r: Point) -> bool {
    let side = |k: usize| match (q[k] > p[k], q[k] < p[k]) {
        (true, _) => r[k] > p[k],
        (_, true) => r[k] < p[k],
        _ => false,
    };
    side(0) || side(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: u32, to: u32, ends: [Point; 2], chart: u32) -> BoundaryEdge {
        BoundaryEdge { from, to, ends, chart, triangle: from }
    }

    #[test]
    fn contacts_of_two_edges() {
        let a = edge(0, 1, [[0.0, 0.0], [1.0, 1.0]], 0);
        let other = |ends, chart| edge(2, 3, ends, chart);
        let meets = |b: &BoundaryEdge| {
            let e = [a, *b];
            let c = contacts(&e, &Progress::new()).expect("not cancelled");
            c.inside.count + c.between.count
        };
        assert_eq!(meets(&other([[0.0, 1.0], [1.0, 0.0]], 0)), 1, "crossing");
        assert_eq!(meets(&other([[0.5, 0.5], [1.0, 0.0]], 0)), 1, "a T");
        assert_eq!(meets(&other([[1.0, 1.0], [2.0, 0.0]], 0)), 1, "ends that are not one vertex");
        assert_eq!(meets(&other([[1.0, 1.0], [2.0, 2.0]], 1)), 1, "collinear, end to end");
        assert_eq!(meets(&other([[0.25, 0.25], [0.5, 0.5]], 1)), 1, "collinear, inside");
        assert_eq!(meets(&other([[1.5, 1.5], [2.0, 2.0]], 1)), 0, "collinear, apart");
        assert_eq!(meets(&other([[0.0, 0.5], [0.5, 1.0]], 1)), 0, "parallel");
        assert_eq!(meets(&edge(1, 3, [[1.0, 1.0], [2.0, 0.0]], 0)), 0, "following");
        assert_eq!(meets(&edge(1, 3, [[1.0, 1.0], [2.0, 2.0]], 0)), 0, "following straight on");
        assert_eq!(meets(&edge(1, 3, [[1.0, 1.0], [0.5, 0.5]], 0)), 1, "folding back");
        assert_eq!(meets(&edge(1, 0, [[1.0, 1.0], [0.0, 0.0]], 0)), 1, "there and back");
    }

    #[test]
    fn one_bit_decides() {
        // A point on the segment, and its two float32 neighbours.
        let a = edge(0, 1, [[0.1, 0.1], [0.9, 0.9]], 0);
        let x = 0.623_456_8f32;
        for (y, expect) in [(x, 1), (x.next_up(), 0), (x.next_down(), 1)] {
            let b = edge(2, 3, [[x, y], [0.2, 0.9]], 1);
            let c = contacts(&[a, b], &Progress::new()).expect("not cancelled");
            assert_eq!(c.between.count, expect, "{y}");
        }
    }

    #[test]
    fn a_thousand_edges_through_a_point_end() {
        let n = 3000u32;
        let edges: Vec<_> = (0..n)
            .map(|i| {
                let t = i as f32 / n as f32;
                edge(2 * i, 2 * i + 1, [[t, 0.0], [1.0 - t, 1.0]], i)
            })
            .collect();
        let c = contacts(&edges, &Progress::new()).expect("not cancelled");
        assert!(c.between.count >= CHUNK_CONTACTS && !c.complete);
        assert!(c.between.count <= CONTACT_LIMIT + 16 * CHUNK_CONTACTS);
    }
}
