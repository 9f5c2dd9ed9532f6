//! A uniform grid over short segments, for finding those near each other.

use nalgebra::{Point2, Vector2};

/// Cells are widened by this share of their size when items are put in, so that an item whose
/// rounded extent ends just short of a cell it touches is still found there.
const PADDING: f64 = 1e-6;
/// Most cells along one side.
const MAX_SIDE: f64 = 4096.0;

/// The convex hull of a few points: a point, or a segment to put in a grid.
type Hull<'a> = &'a [Point2<f64>];

/// For each cell, the items that reach into it. Items are put only in the cells they touch, row by
/// row, so that a long diagonal segment costs its length and not its bounding box.
pub(super) struct Grid {
    origin: Point2<f64>,
    cell: Vector2<f64>,
    columns: usize,
    rows: usize,
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    /// Puts `hull(i)`, i < `count`, widened by `reach(i)`, into about `count` cells. `None` if a
    /// coordinate is not finite. Each item has a reach of its own: that of one long
    /// edge, given to all the short ones, would fill the grid with each of them.
    pub(super) fn new(
        count: usize,
        hull: impl Fn(usize) -> [Point2<f64>; 2],
        reach: impl Fn(usize) -> f64,
    ) -> Option<Self> {
        let (mut low, mut high) =
            (Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(-f64::INFINITY, -f64::INFINITY));
        for i in 0..count {
            for p in hull(i) {
                if !(p.x.is_finite() && p.y.is_finite()) {
                    return None;
                }
                let reach = Vector2::repeat(reach(i));
                low = low.inf(&(p - reach));
                high = high.sup(&(p + reach));
            }
        }
        if count == 0 {
            (low, high) = (Point2::origin(), Point2::origin());
        }
        let size = high - low;
        let longest = size.x.max(size.y);
        // Square cells, about as many as items; a degenerate extent still has one row.
        let side = (size.x * size.y / count.max(1) as f64).sqrt().max(longest / count.max(1) as f64);
        let side = side.max(longest / MAX_SIDE);
        let side = if side > 0.0 && side.is_finite() { side } else { 1.0 };
        let cells = |extent: f64| (extent / side).floor().clamp(0.0, MAX_SIDE) as usize + 1;
        let mut grid = Self {
            origin: low,
            cell: Vector2::repeat(side),
            columns: cells(size.x),
            rows: cells(size.y),
            start: Vec::new(),
            items: Vec::new(),
        };
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for i in 0..count {
            grid.for_cells(&hull(i), reach(i), |cell| entries.push((cell as u32, i as u32)));
        }
        entries.sort_unstable();
        grid.start = vec![0; grid.columns * grid.rows + 1];
        for &(cell, _) in &entries {
            grid.start[cell as usize + 1] += 1;
        }
        for c in 0..grid.columns * grid.rows {
            grid.start[c + 1] += grid.start[c];
        }
        grid.items = entries.into_iter().map(|(_, item)| item).collect();
        Some(grid)
    }

    /// The items of each cell that holds more than one, ascending.
    pub(super) fn cells(&self) -> impl Iterator<Item = &[u32]> {
        self.start.windows(2).map(|w| &self.items[w[0] as usize..w[1] as usize]).filter(|c| c.len() > 1)
    }

    /// The items in the cells that a hull touches; an item may come several times.
    pub(super) fn near(&self, hull: Hull, mut found: impl FnMut(u32)) {
        self.for_cells(hull, 0.0, |cell| {
            for &item in &self.items[self.start[cell] as usize..self.start[cell + 1] as usize] {
                found(item);
            }
        });
    }

    fn for_cells(&self, hull: Hull, reach: f64, mut visit: impl FnMut(usize)) {
        let place = |p: &Point2<f64>| Point2::from((p - self.origin).component_div(&self.cell));
        let pad = Vector2::repeat(reach).component_div(&self.cell).add_scalar(PADDING);
        let clamp = |x: f64, count: usize| x.floor().clamp(0.0, (count - 1) as f64) as usize;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in hull {
            let y = place(p).y;
            (low, high) = (low.min(y), high.max(y));
        }
        for row in clamp(low - pad.y, self.rows)..=clamp(high + pad.y, self.rows) {
            // The hull's extent in x within this row: that of its points and of all joining
            // segments, cut to the row.
            let (bottom, top) = (row as f64 - pad.y, row as f64 + 1.0 + pad.y);
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (i, p) in hull.iter().enumerate() {
                for q in &hull[i..] {
                    let (mut p, mut q) = (place(p), place(q));
                    if p.y > q.y {
                        std::mem::swap(&mut p, &mut q);
                    }
                    if q.y < bottom || p.y > top {
                        continue;
                    }
                    let at = |y: f64| {
                        if q.y > p.y { p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y)) } else { p.x }
                    };
                    let x0 = if p.y < bottom { at(bottom) } else { p.x };
                    let x1 = if q.y > top { at(top) } else { q.x };
                    left = left.min(x0.min(x1));
                    right = right.max(x0.max(x1));
                }
            }
            if left > right {
                continue;
            }
            for column in clamp(left - pad.x, self.columns)..=clamp(right + pad.x, self.columns) {
                visit(row * self.columns + column);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn distance(a: [Point2<f64>; 2], p: Point2<f64>) -> f64 {
        let e = a[1] - a[0];
        let t = if e.norm_squared() > 0.0 { ((p - a[0]).dot(&e) / e.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
        (a[0] + e * t - p).norm()
    }

    proptest! {
        #[test]
        fn finds_every_segment_within_reach(
            ends in prop::collection::vec(prop::array::uniform4(-3.0..3.0_f64), 1..40),
            at in prop::array::uniform2(-3.5..3.5_f64),
            reach in 0.0..0.5_f64,
        ) {
            let segment = |i: usize| {
                let [x, y, z, w] = ends[i];
                [Point2::new(x, y), Point2::new(z, w)]
            };
            let hull = segment;
            // Every other one with less.
            let reach = |i: usize| if i.is_multiple_of(2) { reach } else { 0.5 * reach };
            let grid = Grid::new(ends.len(), hull, reach).expect("finite");
            let p = Point2::new(at[0], at[1]);
            let mut found = vec![false; ends.len()];
            grid.near(&[p], |i| found[i as usize] = true);
            for i in 0..ends.len() {
                prop_assert!(found[i] || distance(segment(i), p) > reach(i));
            }
        }
    }

    #[test]
    fn a_long_diagonal_costs_its_length() {
        let at = |t: f64| Point2::new(t, t);
        let hull = |i: usize| {
            let t = i as f64 / 10_000.0;
            if i == 0 { [at(0.0), at(1.0)] } else { [Point2::new(t, 1.0 - t); 2] }
        };
        let grid = Grid::new(10_000, hull, |_| 0.0).expect("finite");
        assert!(grid.items.len() < 10_000 * 2 + 500, "{}", grid.items.len());
    }

    #[test]
    fn one_long_reach_costs_in_proportion_to_the_items() {
        // A sector of a disc: a thousand short edges of the rim, and its two sides.
        let entries = |n: usize| {
            let at = |i: usize| {
                let angle = (i as f64 / n as f64).min(1.0);
                Point2::new(angle.cos(), angle.sin())
            };
            let hull = |i: usize| {
                if i < n { [at(i), at(i + 1)] } else { [Point2::origin(), at(i)] }
            };
            let reach = |i: usize| if i < n { 0.25 / n as f64 } else { 0.25 };
            Grid::new(n + 2, hull, reach).expect("finite").items.len()
        };
        let (few, many) = (entries(1000), entries(4000));
        assert!(many < 5 * few, "{few} entries become {many} for four times as many edges");
    }

    #[test]
    fn refuses_bad_coordinates_and_takes_none() {
        assert!(Grid::new(1, |_| [Point2::new(f64::NAN, 0.0); 2], |_| 0.0).is_none());
        assert!(Grid::new(0, |_| [Point2::origin(); 2], |_| 0.0).is_some());
        assert!(Grid::new(3, |_| [Point2::new(2.0, 2.0); 2], |_| 0.0).is_some());
    }
}
