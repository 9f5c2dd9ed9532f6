//! A static tree of boxes in the plane, and the parallel batches in which it is searched.
//!
//! A balanced k-d order of the box centres with the boxes summed upwards. Unlike a uniform grid it
//! does not mind where the boxes lie: one far outlier, or a thousand specks in a corner, cost nothing.

use std::ops::Range;

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};

/// An axis-parallel box, closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) lo: [f64; 2],
    pub(crate) hi: [f64; 2],
}

impl Bounds {
    /// Holds nothing.
    pub(crate) const EMPTY: Self = Self { lo: [f64::INFINITY; 2], hi: [f64::NEG_INFINITY; 2] };

    /// The least box around points.
    pub(crate) fn of(points: &[[f64; 2]]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.union(&Self { lo: *p, hi: *p }))
    }

    pub(crate) fn union(&self, o: &Self) -> Self {
        Self {
            lo: [self.lo[0].min(o.lo[0]), self.lo[1].min(o.lo[1])],
            hi: [self.hi[0].max(o.hi[0]), self.hi[1].max(o.hi[1])],
        }
    }

    /// Whether the boxes share a point.
    #[inline]
    pub(crate) fn meets(&self, o: &Self) -> bool {
        self.lo[0] <= o.hi[0] && o.lo[0] <= self.hi[0] && self.lo[1] <= o.hi[1] && o.lo[1] <= self.hi[1]
    }

    /// Whether the boxes share area.
    #[inline]
    pub(crate) fn overlaps(&self, o: &Self) -> bool {
        self.lo[0] < o.hi[0] && o.lo[0] < self.hi[0] && self.lo[1] < o.hi[1] && o.lo[1] < self.hi[1]
    }

    /// Squared distance between two boxes.
    #[inline]
    pub(crate) fn squared_distance(&self, o: &Self) -> f64 {
        let gap = |k: usize| (self.lo[k] - o.hi[k]).max(o.lo[k] - self.hi[k]).max(0.0);
        let (x, y) = (gap(0), gap(1));
        x * x + y * y
    }
}

/// What a search does at the nodes and items of a [`BoxTree`].
pub(crate) trait Visitor {
    /// Whether anything below node `node` with box `bounds` may matter.
    fn enter(&mut self, node: usize, bounds: &Bounds) -> bool;
    /// Looks at the item at a position of the tree's order; false ends the search.
    fn item(&mut self, position: usize) -> bool;
}

/// Boxes in k-d order. Positions of that order stand for the items; [`BoxTree::source`] names them.
pub(crate) struct BoxTree {
    order: Vec<u32>,
    boxes: Vec<Bounds>,
    /// Heap order: node 1 is the root, the children of `i` are `2i` and `2i + 1`.
    nodes: Vec<Bounds>,
    depth: u32,
}

/// Items in a leaf at most: a leaf's boxes then fill a few cache lines, and nodes take an eighth of
/// the memory of the items.
const LEAF: usize = 8;
/// Fewer items than this are sorted on one thread.
const SERIAL: usize = 8192;

impl BoxTree {
    /// O(n log n). The order depends on the boxes alone; ties go by index.
    pub(crate) fn new(boxes: Vec<Bounds>) -> Self {
        let n = boxes.len();
        let mut depth = 0;
        while n.div_ceil(1 << depth) > LEAF {
            depth += 1;
        }
        let mut keys: Vec<(f64, f64, u32)> =
            boxes.par_iter().enumerate().map(|(i, b)| (b.lo[0] + b.hi[0], b.lo[1] + b.hi[1], i as u32)).collect();
        arrange(&mut keys, n, 0, 0, depth);
        let order: Vec<u32> = keys.par_iter().map(|k| k.2).collect();
        drop(keys);
        let ordered: Vec<Bounds> = order.par_iter().map(|&i| boxes[i as usize]).collect();
        drop(boxes);
        let leaves = 1usize << depth;
        let mut nodes = vec![Bounds::EMPTY; 2 * leaves];
        nodes[leaves..].par_iter_mut().enumerate().for_each(|(i, node)| {
            *node = ordered[(n * i) >> depth..(n * (i + 1)) >> depth].iter().fold(Bounds::EMPTY, |a, b| a.union(b));
        });
        for i in (1..leaves).rev() {
            nodes[i] = nodes[2 * i].union(&nodes[2 * i + 1]);
        }
        Self { order, boxes: ordered, nodes, depth }
    }

    /// Number of items.
    pub(crate) fn len(&self) -> usize {
        self.order.len()
    }

    /// Number of nodes plus one: node indices are below it.
    pub(crate) fn node_end(&self) -> usize {
        self.nodes.len()
    }

    /// The item at a position.
    #[inline]
    pub(crate) fn source(&self, position: usize) -> usize {
        self.order[position] as usize
    }

    /// The box of the item at a position.
    #[inline]
    pub(crate) fn bounds(&self, position: usize) -> &Bounds {
        &self.boxes[position]
    }

    /// The positions below a node.
    #[inline]
    pub(crate) fn range(&self, node: usize) -> Range<usize> {
        let level = node.ilog2();
        let i = node - (1 << level);
        let n = self.order.len();
        (n * i) >> level..(n * (i + 1)) >> level
    }

    /// Visits what the visitor wants of the items at position `first` and later.
    pub(crate) fn walk(&self, first: usize, visitor: &mut impl Visitor) {
        // One right sibling waits on each level.
        let mut stack = [0usize; 40];
        stack[0] = 1;
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let node = stack[top];
            let range = self.range(node);
            if range.end <= first || range.is_empty() || !visitor.enter(node, &self.nodes[node]) {
                continue;
            }
            if node >> self.depth == 1 {
                for position in range.start.max(first)..range.end {
                    if !visitor.item(position) {
                        return;
                    }
                }
            } else {
                stack[top] = 2 * node + 1;
                stack[top + 1] = 2 * node;
                top += 2;
            }
        }
    }
}

/// Puts `keys`, the items of one node, into k-d order: split across the longer side of the centres.
fn arrange(keys: &mut [(f64, f64, u32)], n: usize, i: usize, level: u32, depth: u32) {
    if level == depth {
        return;
    }
    let mut b = Bounds::EMPTY;
    for k in keys.iter() {
        b = b.union(&Bounds { lo: [k.0, k.1], hi: [k.0, k.1] });
    }
    let middle = ((n * (2 * i + 1)) >> (level + 1)) - ((n * i) >> level);
    if middle < keys.len() {
        if b.hi[0] - b.lo[0] >= b.hi[1] - b.lo[1] {
            keys.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        } else {
            keys.select_nth_unstable_by(middle, |a, b| a.1.total_cmp(&b.1).then(a.2.cmp(&b.2)));
        }
    }
    let parallel = keys.len() > SERIAL;
    let (left, right) = keys.split_at_mut(middle);
    if parallel {
        rayon::join(|| arrange(left, n, 2 * i, level + 1, depth), || arrange(right, n, 2 * i + 1, level + 1, depth));
    } else {
        arrange(left, n, 2 * i, level + 1, depth);
        arrange(right, n, 2 * i + 1, level + 1, depth);
    }
}

/// Items a task handles in [`in_batches`].
const CHUNK: usize = 512;
/// Tasks between two looks at the outcome.
const BATCH: usize = 16;

/// Works on `0..n` in parallel, chunk by chunk, and folds the outcomes in order; between batches
/// `fold` has changed `state` for the next one, and may end it all by returning false.
///
/// The outcome does not depend on the number of threads: chunks and batches are fixed.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn in_batches<S: Sync, R: Send>(
    n: usize,
    progress: &Progress,
    state: &mut S,
    work: impl Fn(Range<usize>, &S) -> R + Sync,
    mut fold: impl FnMut(&mut S, R) -> bool,
) -> Result<(), Cancelled> {
    let chunks = n.div_ceil(CHUNK);
    for start in (0..chunks).step_by(BATCH) {
        progress.check()?;
        let seen: &S = state;
        let results: Vec<R> = (start..(start + BATCH).min(chunks))
            .into_par_iter()
            .map(|c| {
                progress.check()?;
                Ok(work(c * CHUNK..((c + 1) * CHUNK).min(n), seen))
            })
            .collect::<Result<_, Cancelled>>()?;
        let mut go_on = true;
        for r in results {
            go_on &= fold(state, r);
        }
        if !go_on {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Collect<'a> {
        tree: &'a BoxTree,
        query: Bounds,
        found: Vec<usize>,
    }

    impl Visitor for Collect<'_> {
        fn enter(&mut self, _: usize, bounds: &Bounds) -> bool {
            bounds.meets(&self.query)
        }
        fn item(&mut self, position: usize) -> bool {
            if self.tree.bounds(position).meets(&self.query) {
                self.found.push(self.tree.source(position));
            }
            true
        }
    }

    /// A few boxes of very different size and one far away.
    fn boxes(n: usize) -> Vec<Bounds> {
        let mut state = 7u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        (0..n)
            .map(|i| {
                let (x, y, w) = (next(), next(), next().powi(6) + 1e-3);
                let shift = if i == 3 { 1e9 } else { 0.0 };
                Bounds { lo: [x + shift, y], hi: [x + shift + w, y + 0.5 * w] }
            })
            .collect()
    }

    #[test]
    fn search_finds_what_brute_force_finds() {
        for n in [0, 1, 7, 8, 9, 100, 1013] {
            let items = boxes(n);
            let tree = BoxTree::new(items.clone());
            for query in boxes(60) {
                let mut c = Collect { tree: &tree, query, found: vec![] };
                tree.walk(0, &mut c);
                c.found.sort_unstable();
                let expect: Vec<usize> = (0..n).filter(|&i| items[i].meets(&query)).collect();
                assert_eq!(c.found, expect);
            }
        }
    }

    #[test]
    fn every_pair_is_met_once() {
        let items = boxes(500);
        let tree = BoxTree::new(items.clone());
        let mut pairs = Vec::new();
        for position in 0..tree.len() {
            let i = tree.source(position);
            let mut c = Collect { tree: &tree, query: items[i], found: vec![] };
            tree.walk(position + 1, &mut c);
            pairs.extend(c.found.into_iter().map(|j| (i.min(j), i.max(j))));
        }
        pairs.sort_unstable();
        let brute: Vec<(usize, usize)> = (0..items.len())
            .flat_map(|i| (i + 1..items.len()).map(move |j| (i, j)))
            .filter(|&(i, j)| items[i].meets(&items[j]))
            .collect();
        assert_eq!(pairs, brute);
    }
}
