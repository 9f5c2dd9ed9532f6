//! Pairs of UV triangles that share area.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};

use super::box_tree::{Bounds, BoxTree, Visitor, in_batches};
use super::uv_topology::NONE;

/// Counting stops after this many overlapping pairs: such a layout is broken or stacked on purpose,
/// and the exact number says no more.
pub(crate) const PAIR_LIMIT: u64 = 2_000_000;
/// Pairs of boxes a chunk of triangles looks at before it gives up.
const CHUNK_BUDGET: u64 = 4_000_000;
/// Overlapping pairs a chunk counts before it gives up: some 250 on every triangle.
const CHUNK_PAIRS: u64 = 125_000;

/// What was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Overlaps {
    /// Pairs whose common area exceeds the threshold.
    pub(crate) pairs: u64,
    /// Of these, pairs in different groups.
    pub(crate) between: u64,
    /// Sum of the common areas.
    pub(crate) area: f64,
    /// False if a limit ended the count: the figures are then lower bounds.
    pub(crate) complete: bool,
}

/// What triangles belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Belonging {
    /// What a pair between different ones is counted for in [`Overlaps::between`].
    pub(crate) group: u32,
    /// Triangles of different groups that share a stack may overlap, and are not counted; [`NONE`] shares with none.
    pub(crate) stack: u32,
}

impl Belonging {
    fn may_overlap(&self, other: &Self) -> bool {
        self.stack == other.stack && self.stack != NONE && self.group != other.group
    }
}

/// Counts pairs of triangles (either orientation) with more than `threshold` of common area, NaN has none, and says for
/// each triangle whether it is in such a pair.
///
/// Not exact: areas come from double-precision clipping. O(n log n + pairs), and a bounded number of
/// pairs in any case (see [`Overlaps::complete`]).
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn overlaps(
    triangles: &[[[f64; 2]; 3]],
    of: &[Belonging],
    threshold: f64,
    progress: &Progress,
) -> Result<(Overlaps, Vec<bool>), Cancelled> {
    let twice = |f: u32| {
        let [a, b, c] = triangles[f as usize];
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    // A triangle smaller than the threshold cannot share more than it.
    let is_large = |f: &u32| 0.5 * twice(*f).abs() > threshold;
    let large: Vec<u32> = (0..triangles.len() as u32).into_par_iter().filter(is_large).collect();
    let tree = BoxTree::new(large.par_iter().map(|&f| Bounds::of(&triangles[f as usize])).collect());
    let counter_clockwise = |position: usize| {
        let f = large[tree.source(position)];
        let [a, b, c] = triangles[f as usize];
        (if twice(f) < 0.0 { [c, b, a] } else { [a, b, c] }, of[f as usize])
    };
    let ordered: Vec<([[f64; 2]; 3], Belonging)> = (0..tree.len()).map(counter_clockwise).collect();
    // Set in any order: which are set in the end is the same on any number of threads.
    let involved: Vec<AtomicBool> = (0..ordered.len()).map(|_| AtomicBool::new(false)).collect();
    let mut state = (Overlaps { complete: true, ..Overlaps::default() }, 0u64);
    let total_budget = 100 * ordered.len() as u64 + 50_000_000;
    in_batches(
        tree.len(),
        progress,
        &mut state,
        |range, _| {
            let mut c = Counter {
                tree: &tree,
                ordered: &ordered,
                involved: &involved,
                threshold,
                me: 0,
                seen: 0,
                found: Overlaps::default(),
            };
            for position in range {
                c.me = position;
                if c.may_go_on() {
                    tree.walk(position + 1, &mut c);
                }
            }
            c.found.complete = c.may_go_on();
            (c.found, c.seen)
        },
        |(total, seen), (found, chunk_seen)| {
            total.pairs += found.pairs;
            total.between += found.between;
            total.area += found.area;
            *seen += chunk_seen;
            let go_on = *seen <= total_budget && total.pairs < PAIR_LIMIT;
            total.complete &= go_on && found.complete;
            go_on
        },
    )?;
    let mut overlapping = vec![false; triangles.len()];
    for (position, involved) in involved.into_iter().enumerate() {
        overlapping[large[tree.source(position)] as usize] = involved.into_inner();
    }
    Ok((state.0, overlapping))
}

struct Counter<'a> {
    tree: &'a BoxTree,
    ordered: &'a [([[f64; 2]; 3], Belonging)],
    /// By position in the tree, whether a pair was found that the triangle is in.
    involved: &'a [AtomicBool],
    threshold: f64,
    me: usize,
    seen: u64,
    found: Overlaps,
}

impl Counter<'_> {
    fn may_go_on(&self) -> bool {
        self.seen < CHUNK_BUDGET && self.found.pairs < CHUNK_PAIRS
    }
}

impl Visitor for Counter<'_> {
    fn enter(&mut self, _: usize, bounds: &Bounds) -> bool {
        self.tree.bounds(self.me).overlaps(bounds)
    }

    fn item(&mut self, position: usize) -> bool {
        self.seen += 1;
        if self.tree.bounds(self.me).overlaps(self.tree.bounds(position)) {
            let ((a, ga), (b, gb)) = (&self.ordered[self.me], &self.ordered[position]);
            if ga.may_overlap(gb) {
                return self.may_go_on();
            }
            let area = common_area(a, b);
            if area > self.threshold {
                self.found.pairs += 1;
                self.found.area += area;
                self.found.between += u64::from(ga.group != gb.group);
                for position in [self.me, position] {
                    self.involved[position].store(true, Ordering::Relaxed);
                }
            }
        }
        self.may_go_on()
    }
}

/// Area shared by two counter-clockwise triangles: separating edges first, then Sutherland–Hodgman
/// clipping (Reentrant polygon clipping, CACM 1974).
fn common_area(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]) -> f64 {
    let side = |p: &[f64; 2], q: &[f64; 2], r: &[f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    for (p, q) in [(a, b), (b, a)] {
        for i in 0..3 {
            if q.iter().all(|r| side(&p[i], &p[(i + 1) % 3], r) <= 0.0) {
                return 0.0;
            }
        }
    }
    // Each clip adds at most one corner: 3 + 3.
    let mut polygon = [[0.0; 2]; 8];
    polygon[..3].copy_from_slice(a);
    let mut n = 3;
    for i in 0..3 {
        let (p, q) = (&b[i], &b[(i + 1) % 3]);
        let mut clipped = [[0.0; 2]; 8];
        let mut k = 0;
        for j in 0..n {
            let (from, to) = (polygon[j], polygon[(j + 1) % n]);
            let (df, dt) = (side(p, q, &from), side(p, q, &to));
            if df >= 0.0 && k < 8 {
                clipped[k] = from;
                k += 1;
            }
            if ((df > 0.0 && dt < 0.0) || (df < 0.0 && dt > 0.0)) && k < 8 {
                let t = df / (df - dt);
                clipped[k] = [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
                k += 1;
            }
        }
        if k < 3 {
            return 0.0;
        }
        polygon = clipped;
        n = k;
    }
    let mut twice = 0.0;
    for j in 1..n - 1 {
        twice += side(&polygon[0], &polygon[j], &polygon[j + 1]);
    }
    0.5 * twice.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALONE: Belonging = Belonging { group: 0, stack: NONE };

    fn random_triangles(n: usize, size: f64, seed: u64) -> Vec<[[f64; 2]; 3]> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        (0..n)
            .map(|_| {
                let (x, y) = (next(), next());
                [0, 1, 2].map(|_| [x + size * (next() - 0.5), y + size * (next() - 0.5)])
            })
            .collect()
    }

    /// Common area by counting grid points in both.
    fn area_by_sampling(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]) -> f64 {
        let inside = |t: &[[f64; 2]; 3], p: [f64; 2]| {
            let s: Vec<f64> = (0..3)
                .map(|i| {
                    let (u, v) = (t[i], t[(i + 1) % 3]);
                    (v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])
                })
                .collect();
            s.iter().all(|&x| x >= 0.0) || s.iter().all(|&x| x <= 0.0)
        };
        let box_a = Bounds::of(a);
        let n = 400;
        let cell = [(box_a.hi[0] - box_a.lo[0]) / n as f64, (box_a.hi[1] - box_a.lo[1]) / n as f64];
        let mut hits = 0;
        for i in 0..n {
            for j in 0..n {
                let p = [box_a.lo[0] + (i as f64 + 0.5) * cell[0], box_a.lo[1] + (j as f64 + 0.5) * cell[1]];
                hits += usize::from(inside(a, p) && inside(b, p));
            }
        }
        hits as f64 * cell[0] * cell[1]
    }

    fn ccw(t: &[[f64; 2]; 3]) -> [[f64; 2]; 3] {
        let [a, b, c] = *t;
        if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0.0 { [c, b, a] } else { [a, b, c] }
    }

    #[test]
    fn common_area_agrees_with_sampling() {
        let t = random_triangles(40, 1.5, 11);
        for pair in t.chunks_exact(2) {
            let (a, b) = (ccw(&pair[0]), ccw(&pair[1]));
            assert!((common_area(&a, &b) - area_by_sampling(&a, &b)).abs() < 4e-3);
            assert!((common_area(&a, &b) - common_area(&b, &a)).abs() < 1e-14);
        }
    }

    #[test]
    fn count_agrees_with_brute_force() {
        for (n, size) in [(30, 0.5), (400, 0.08), (900, 0.02)] {
            let t = random_triangles(n, size, n as u64);
            let group: Vec<u32> = (0..n as u32).map(|i| i % 3).collect();
            let of: Vec<Belonging> = group.iter().map(|&group| Belonging { group, stack: NONE }).collect();
            let (got, involved) = overlaps(&t, &of, 1e-9, &Progress::new()).expect("not cancelled");
            let (mut pairs, mut between, mut area) = (0, 0, 0.0);
            let mut expected = vec![false; n];
            for i in 0..n {
                for j in 0..i {
                    let a = common_area(&ccw(&t[i]), &ccw(&t[j]));
                    if a > 1e-9 {
                        pairs += 1;
                        area += a;
                        between += u64::from(group[i] != group[j]);
                        (expected[i], expected[j]) = (true, true);
                    }
                }
            }
            assert!(pairs > 0, "a test of nothing");
            assert_eq!((got.pairs, got.between, got.complete), (pairs, between, true));
            assert!((got.area - area).abs() < 1e-12);
            assert_eq!(involved, expected);
        }
    }

    #[test]
    fn neighbours_do_not_overlap() {
        // A jittered grid with shared corners.
        let k = 40;
        let point = |i: usize, j: usize| {
            let wobble = ((i * 7919 + j * 104_729) % 97) as f64 / 400.0;
            [i as f64 + wobble, j as f64 - wobble]
        };
        let t: Vec<_> = (0..k * k)
            .flat_map(|c| {
                let (i, j) = (c % k, c / k);
                [
                    [point(i, j), point(i + 1, j), point(i, j + 1)],
                    [point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)],
                ]
            })
            .collect();
        let (got, involved) = overlaps(&t, &vec![ALONE; t.len()], 1e-9, &Progress::new()).expect("not cancelled");
        assert_eq!((got.pairs, got.complete, involved.contains(&true)), (0, true, false));
    }

    #[test]
    fn a_pile_of_equal_triangles_ends_and_says_so() {
        let t = vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; 60_000];
        let (got, _) = overlaps(&t, &vec![ALONE; t.len()], 1e-9, &Progress::new()).expect("not cancelled");
        assert!(!got.complete && got.pairs >= PAIR_LIMIT, "{got:?}");
    }

    #[test]
    fn what_shares_a_stack_may_overlap_but_nothing_else_and_no_group_itself() {
        let t = vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; 4];
        let count = |of: [[u32; 2]; 4]| {
            let of = of.map(|[group, stack]| Belonging { group, stack });
            overlaps(&t, &of, 1e-9, &Progress::new()).expect("not cancelled").0.pairs
        };
        assert_eq!(count([[0, 7], [1, 7], [2, 7], [3, 7]]), 0);
        assert_eq!(count([[0, 7], [1, 7], [2, 7], [3, NONE]]), 3);
        assert_eq!(count([[0, 7], [1, 7], [2, 8], [3, 8]]), 4);
        assert_eq!(count([[0, 7], [0, 7], [1, 7], [2, 7]]), 1, "a chart that overlaps itself");
        assert_eq!(count([[0, NONE], [1, NONE], [2, NONE], [3, NONE]]), 6);
    }
}
