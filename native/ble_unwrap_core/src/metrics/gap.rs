//! Least distance between boundary segments of different owners.

use crate::progress::{Cancelled, Progress};

use super::box_tree::{Bounds, BoxTree, Visitor, in_batches};
use super::uv_topology::NONE;

/// Gaps are searched up to this many texels, or twice the margin if that is more: beyond, nothing
/// bleeds from one chart into another.
pub(crate) const GAP_SEARCH_TEXELS: f64 = 8.0;

/// A boundary segment in texels and the chart or island it belongs to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnedSegment {
    pub(crate) ends: [[f64; 2]; 2],
    pub(crate) owner: u32,
}

/// The least distance between two segments of different owners, and whether the search was complete.
///
/// `limit` if no two are nearer than that. Distances are those of double-precision arithmetic; a
/// proper crossing counts as 0. O(n log n) where segments spread as in an atlas; a bounded number of
/// segment pairs is looked at in any case, and if that was not enough the result is an upper bound.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn least_gap(segments: &[OwnedSegment], limit: f64, progress: &Progress) -> Result<(f64, bool), Cancelled> {
    let tree = BoxTree::new(segments.iter().map(|s| Bounds::of(&s.ends)).collect());
    let owners = node_owners(&tree, segments);
    if owners.get(1).is_none_or(|&o| o != NONE) {
        return Ok((limit, true));
    }
    // (least gap so far, pairs looked at, whether some chunk gave up)
    let mut state = (limit, 0u64, false);
    let total_budget = 64 * segments.len() as u64 + 100_000_000;
    in_batches(
        tree.len(),
        progress,
        &mut state,
        |range, &(best, ..)| {
            let mut n = Nearest { tree: &tree, segments, owners: &owners, me: 0, best, seen: 0 };
            for position in range {
                n.me = position;
                tree.walk(position + 1, &mut n);
            }
            (n.best, n.seen)
        },
        |state, (best, seen)| {
            state.0 = state.0.min(best);
            state.1 += seen;
            state.2 |= seen >= CHUNK_BUDGET || state.1 > total_budget;
            state.0 > 0.0 && state.1 <= total_budget
        },
    )?;
    Ok((state.0, state.0 == 0.0 || !state.2))
}

/// Segment pairs one chunk looks at before it gives up.
const CHUNK_BUDGET: u64 = 8_000_000;

/// The owner that all items below a node share, or [`NONE`] where they differ.
fn node_owners(tree: &BoxTree, segments: &[OwnedSegment]) -> Vec<u32> {
    let end = tree.node_end();
    let mut owners = vec![NONE; end];
    for node in (1..end).rev() {
        let mut range = tree.range(node);
        owners[node] = if 2 * node < end {
            // An empty child has nothing to say; its sibling speaks for both.
            match (tree.range(2 * node).is_empty(), owners[2 * node], owners[2 * node + 1]) {
                (true, _, b) => b,
                (false, a, _) if tree.range(2 * node + 1).is_empty() => a,
                (false, a, b) if a == b => a,
                _ => NONE,
            }
        } else if let Some(first) = range.next() {
            let owner = segments[tree.source(first)].owner;
            if range.all(|p| segments[tree.source(p)].owner == owner) { owner } else { NONE }
        } else {
            NONE
        };
    }
    owners
}

struct Nearest<'a> {
    tree: &'a BoxTree,
    segments: &'a [OwnedSegment],
    owners: &'a [u32],
    me: usize,
    best: f64,
    seen: u64,
}

impl Visitor for Nearest<'_> {
    fn enter(&mut self, node: usize, bounds: &Bounds) -> bool {
        let mine = self.segments[self.tree.source(self.me)].owner;
        self.seen < CHUNK_BUDGET
            && self.owners[node] != mine
            && self.tree.bounds(self.me).squared_distance(bounds) < self.best * self.best
    }

    fn item(&mut self, position: usize) -> bool {
        self.seen += 1;
        let (s, t) = (&self.segments[self.tree.source(self.me)], &self.segments[self.tree.source(position)]);
        if s.owner != t.owner
            && self.tree.bounds(self.me).squared_distance(self.tree.bounds(position)) < self.best * self.best
        {
            self.best = self.best.min(segment_distance(&s.ends, &t.ends));
        }
        self.best > 0.0
    }
}

/// Distance of two segments; 0 where they cross properly.
pub(crate) fn segment_distance(s: &[[f64; 2]; 2], t: &[[f64; 2]; 2]) -> f64 {
    let side = |a: &[f64; 2], b: &[f64; 2], p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    if side(&s[0], &s[1], &t[0]) * side(&s[0], &s[1], &t[1]) < 0.0
        && side(&t[0], &t[1], &s[0]) * side(&t[0], &t[1], &s[1]) < 0.0
    {
        return 0.0;
    }
    let near = |p: &[f64; 2], s: &[[f64; 2]; 2]| {
        let d = [s[1][0] - s[0][0], s[1][1] - s[0][1]];
        let q = d[0] * d[0] + d[1] * d[1];
        let t = if q > 0.0 { ((p[0] - s[0][0]) * d[0] + (p[1] - s[0][1]) * d[1]) / q } else { 0.0 };
        let t = t.clamp(0.0, 1.0);
        (p[0] - s[0][0] - t * d[0]).hypot(p[1] - s[0][1] - t * d[1])
    };
    near(&s[0], t).min(near(&s[1], t)).min(near(&t[0], s)).min(near(&t[1], s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random_segments(n: usize, owners: u32, spread: f64, seed: u64) -> Vec<OwnedSegment> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        (0..n)
            .map(|i| {
                let (x, y) = (spread * next(), spread * next());
                let ends = [[x, y], [x + next(), y + next()]];
                OwnedSegment { ends, owner: i as u32 % owners }
            })
            .collect()
    }

    #[test]
    fn gap_agrees_with_brute_force() {
        for (n, owners, spread, seed) in
            [(2, 2, 3.0, 1), (40, 3, 60.0, 2), (40, 2, 500.0, 3), (300, 7, 900.0, 4), (9, 1, 5.0, 5)]
        {
            let s = random_segments(n, owners, spread, seed);
            let mut expect: f64 = 8.0;
            for i in 0..n {
                for j in i + 1..n {
                    if s[i].owner != s[j].owner {
                        expect = expect.min(segment_distance(&s[i].ends, &s[j].ends));
                    }
                }
            }
            let (gap, complete) = least_gap(&s, 8.0, &Progress::new()).expect("not cancelled");
            assert!(complete);
            assert!((gap - expect).abs() <= 1e-12, "{n} segments: {gap} {expect}");
        }
    }

    #[test]
    fn distances_known_by_heart() {
        let s = [[0.0, 0.0], [2.0, 0.0]];
        assert_eq!(segment_distance(&s, &[[1.0, -1.0], [1.0, 1.0]]), 0.0);
        assert_eq!(segment_distance(&s, &[[1.0, 3.0], [1.0, 1.0]]), 1.0);
        assert_eq!(segment_distance(&s, &[[5.0, 4.0], [9.0, 4.0]]), 5.0);
        assert_eq!(segment_distance(&[[1.0, 1.0]; 2], &[[1.0, 3.0]; 2]), 2.0);
    }

    #[test]
    fn nothing_to_compare_gives_the_limit() {
        assert_eq!(least_gap(&[], 8.0, &Progress::new()), Ok((8.0, true)));
        let p = Progress::new();
        p.cancel();
        assert_eq!(least_gap(&random_segments(20, 2, 4.0, 1), 8.0, &p), Err(Cancelled::OnRequest));
    }
}
