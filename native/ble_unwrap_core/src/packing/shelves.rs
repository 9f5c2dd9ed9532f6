//! Thousands of charts: boxes in rows, the tallest first.
//!
//! A search over orders of placement costs a bounded number of attempts, and each goes through all charts in all poses. Beyond some thousand
//! charts that takes long, and cells that are few enough to search are as large as the charts, so that rounding up to whole cells wastes more
//! than the search gains. Boxes in rows need no cells: an attempt is one pass over the sorted boxes, and what is lost is the corners of
//! the boxes. The few large charts, whose corners are worth most, are placed by their cells first, and the rows run around them.
//!
//! **Reference.** Coffman, Garey, Johnson, Tarjan: Performance bounds for level-oriented two-dimensional packing algorithms, SIAM Journal on
//! Computing 9(4), 1980 (boxes by decreasing height, row after row).

use rayon::prelude::*;

use super::Pose;
use super::grid::Grid;
use super::mask::{Mask, word_at};
use super::outline::Outline;
use super::placement::Place;
use super::shape::{SAFETY_TEXELS, Scale};
use crate::progress::{Cancelled, Progress};

/// Boxes between two looks at whether to stop: a few milliseconds of work.
const BETWEEN_CHECKS: usize = 1 << 16;

/// A chart as a box, in one pose.
#[derive(Clone, Copy, Debug)]
struct ChartBox {
    chart: u32,
    turn: [f64; 2],
    /// Lower left corner of the turned outline, in outline units.
    low: [f64; 2],
    /// Width and height, in outline units.
    size: [f64; 2],
    /// Extent of the chart, in units of its plane, and whether it keeps its size: what its scale depends on.
    extent: f64,
    keeps_size: bool,
}

/// Charts as boxes, in the order in which they are placed.
pub(super) struct Shelves<'a> {
    outlines: &'a [Outline],
    boxes: Vec<ChartBox>,
    grid: Grid,
    /// Distance of two boxes, in texels.
    gap: f64,
    progress: &'a Progress,
}

/// Cells of the grid that boxes keep away from: what is there already, with the margin around it.
#[derive(Clone, Copy)]
pub(super) struct Taken<'a> {
    pub(super) mask: &'a Mask,
    /// Width of the mask's frame around the grid, in cells.
    pub(super) frame: usize,
}

impl<'a> Shelves<'a> {
    /// The charts `of` by their first base angle in `turns`, on a grid, `margin` texels apart. With `quarters` those that are taller than wide
    /// are laid down. O(n log n).
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(
        outlines: &'a [Outline],
        of: &[usize],
        turns: &[Vec<[f64; 2]>],
        quarters: bool,
        grid: Grid,
        margin: f64,
        progress: &'a Progress,
    ) -> Result<Self, Cancelled> {
        let boxed = |&i: &usize| {
            progress.check()?;
            let outline = &outlines[i];
            let turn = turns[i].first().copied().unwrap_or([1.0, 0.0]);
            let given = ChartBox::new(i, outline, turn);
            let laid_down = || ChartBox::new(i, outline, [-turn[1], turn[0]]);
            let lies = if quarters && given.size[1] > given.size[0] { laid_down() } else { given };
            Ok(lies)
        };
        let unsorted: Vec<ChartBox> = of.par_iter().map(boxed).collect::<Result<_, Cancelled>>()?;
        // By height, ties by number: no two are equal, so the order is one. Only heights and places are moved about.
        let height = |(at, c): (usize, &ChartBox)| (c.size[1] * outlines[c.chart as usize].unit(), at);
        let mut order: Vec<(f64, usize)> = unsorted.par_iter().enumerate().map(height).collect();
        progress.check()?;
        order.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        progress.check()?;
        let boxes = order.into_iter().map(|(_, at)| unsorted[at]).collect();
        Ok(Self { outlines, boxes, grid, gap: margin + 2.0 * SAFETY_TEXELS, progress })
    }

    /// Where each chart goes at a density, in texels to a unit of the chart plane, or `None` where there is no room for all.
    /// O(n + cells of the grid / 64).
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn at(&self, density: f64, taken: Option<Taken<'_>>) -> Result<Option<Vec<(usize, Place)>>, Cancelled> {
        let mut places = Vec::with_capacity(self.boxes.len());
        let fits = self.fill(density, taken, |c, scale, corner| places.push(self.place(c, scale, corner)))?;
        Ok(fits.then_some(places))
    }

    /// Whether there is room for all at a density.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn fits(&self, density: f64, taken: Option<Taken<'_>>) -> Result<bool, Cancelled> {
        self.fill(density, taken, |_, _, _| ())
    }

    /// Calls `put` with each box, its scale in texels to an outline unit and its lower left corner in texels from the corner of the grid,
    /// until there is no room for one; tells whether there was room for all.
    fn fill(
        &self,
        density: f64,
        taken: Option<Taken<'_>>,
        mut put: impl FnMut(&ChartBox, Scale, [f64; 2]),
    ) -> Result<bool, Cancelled> {
        let mut shelf = Shelf::new(self.grid, taken);
        // Tops and heights are those of the boxes themselves, which keep the safety to the border and the gap to each other.
        let mut height = 0.0;
        let mut next = SAFETY_TEXELS;
        for (number, c) in self.boxes.iter().enumerate() {
            if number.is_multiple_of(BETWEEN_CHECKS) {
                self.progress.check()?;
            }
            let scale = Scale::of(c.extent, c.keeps_size, density, 1.0);
            let size = c.size.map(|side| side * scale.cells);
            let on_this = if size[1] <= height { shelf.take(size[0], self.gap) } else { None };
            let corner = match on_this {
                Some(x) => [x, shelf.bottom],
                None => {
                    height = size[1];
                    match shelf.open(next, size, self.gap) {
                        Some(x) => {
                            next = shelf.bottom + height + self.gap;
                            [x, shelf.bottom]
                        }
                        None => return Ok(false),
                    }
                }
            };
            put(c, scale, corner);
        }
        Ok(true)
    }

    fn place(&self, c: &ChartBox, scale: Scale, corner: [f64; 2]) -> (usize, Place) {
        let outline = &self.outlines[c.chart as usize];
        let pose = Pose {
            cos: c.turn[0],
            sin: c.turn[1],
            centre: outline.centre,
            scale: scale.cells / outline.unit(),
            offset: [0, 1].map(|k| corner[k] - scale.cells * c.low[k]).into(),
        };
        let touched = c.size.iter().map(|side| side * scale.cells).product();
        (c.chart as usize, Place { pose: self.grid.frame_to_texture(pose), touched, is_speck: scale.is_speck })
    }
}

impl ChartBox {
    fn new(chart: usize, outline: &Outline, [c, s]: [f64; 2]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in &outline.points {
            for (k, x) in [c * p.x - s * p.y, s * p.x + c * p.y].into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(x), high[k].max(x));
            }
        }
        Self {
            chart: chart as u32,
            turn: [c, s],
            low,
            size: [0, 1].map(|k| high[k] - low[k]),
            extent: outline.extent,
            keeps_size: outline.keeps_size,
        }
    }
}

/// The row that is being filled.
struct Shelf<'a> {
    grid: Grid,
    taken: Option<Taken<'a>>,
    /// Its lower side, in texels from the lower side of the grid.
    bottom: f64,
    /// What is left of the stretch that is being filled, in texels.
    left: [f64; 2],
    /// The columns of the grid that are taken somewhere in the row, 64 a word; only where something is taken.
    columns: Vec<u64>,
    /// The first column that was not looked at yet.
    unseen: usize,
}

impl<'a> Shelf<'a> {
    fn new(grid: Grid, taken: Option<Taken<'a>>) -> Self {
        let words = if taken.is_some() { grid.columns.div_ceil(64) } else { 0 };
        // No row is open yet: there is no room on it, not even for a point.
        Self { grid, taken, bottom: 0.0, left: [0.0, -1.0], columns: vec![0; words], unseen: grid.columns }
    }

    /// Takes room for a box of the given width on this row; its left side.
    fn take(&mut self, width: f64, gap: f64) -> Option<f64> {
        loop {
            let [from, to] = self.left;
            if from + width <= to {
                self.left[0] = from + width + gap;
                return Some(from);
            }
            self.next_stretch()?;
        }
    }

    /// The next stretch of free columns.
    fn next_stretch(&mut self) -> Option<()> {
        let columns = self.grid.columns;
        let is_taken = |x: usize| self.columns[x >> 6] >> (x & 63) & 1 == 1;
        let from = (self.unseen..columns).find(|&x| !is_taken(x))?;
        let to = (from..columns).find(|&x| is_taken(x)).unwrap_or(columns);
        self.unseen = to;
        self.left = [from as f64 * self.grid.cell + SAFETY_TEXELS, to as f64 * self.grid.cell - SAFETY_TEXELS];
        Some(())
    }

    /// Begins a row, at the height `from` or above, where there is room for a box of the given size, and takes it.
    fn open(&mut self, from: f64, [width, height]: [f64; 2], gap: f64) -> Option<f64> {
        let inner = self.grid.inner();
        let Some(Taken { mask, frame }) = self.taken else {
            self.bottom = from;
            self.left = [SAFETY_TEXELS, inner[0] - SAFETY_TEXELS];
            self.unseen = self.grid.columns;
            return if from + height <= inner[1] - SAFETY_TEXELS { self.take(width, gap) } else { None };
        };
        let (cell, rows) = (self.grid.cell, self.grid.rows);
        // The lowest row of cells that the row of boxes touches.
        let mut first = ((from - SAFETY_TEXELS) / cell).floor() as usize;
        let mut bottom = from;
        loop {
            let last = ((bottom + height + SAFETY_TEXELS) / cell).floor() as usize;
            if last >= rows {
                return None;
            }
            self.columns.fill(0);
            for y in first..=last {
                for (w, word) in self.columns.iter_mut().enumerate() {
                    *word |= word_at(mask.row(y + frame), (64 * w + frame) as isize);
                }
            }
            (self.bottom, self.left, self.unseen) = (bottom, [0.0, -1.0], 0);
            if let Some(x) = self.take(width, gap) {
                return Some(x);
            }
            first += 1;
            bottom = first as f64 * cell + SAFETY_TEXELS;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::{PackItem, PackSettings};
    use nalgebra::Point2;

    fn rectangle(w: f64, h: f64) -> Outline {
        let points = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(|[x, y]| Point2::new(x, y));
        Outline::new(&PackItem { points: &points, triangles: &[[0, 1, 2], [0, 2, 3]] }, 0).expect("valid")
    }

    fn grid(margin: f64) -> Grid {
        let settings = PackSettings { width: 100, height: 100, margin_texels: margin, ..PackSettings::default() };
        Grid::coarse(&settings, 0.5 * margin, 50.0)
    }

    /// Lower left corners of boxes that are not turned, by chart.
    fn corners(outlines: &[Outline], margin: f64, taken: Option<Taken<'_>>) -> Option<Vec<[f64; 2]>> {
        let (of, turns): (Vec<usize>, Vec<_>) = (0..outlines.len()).map(|i| (i, vec![[1.0, 0.0]])).unzip();
        let progress = Progress::new();
        let shelves =
            Shelves::new(outlines, &of, &turns, false, grid(margin), margin, &progress).expect("not cancelled");
        let places = shelves.at(1.0, taken).expect("not cancelled");
        assert_eq!(places.is_some(), shelves.fits(1.0, taken).expect("not cancelled"));
        let mut found = vec![[0.0; 2]; outlines.len()];
        for (i, place) in places? {
            found[i] = place.pose.texel(Point2::origin()).coords.into();
        }
        Some(found)
    }

    #[test]
    fn rows_run_from_the_tallest_box_on() {
        let outlines = [rectangle(40.0, 10.0), rectangle(50.0, 20.0), rectangle(40.0, 30.0)];
        let found = corners(&outlines, 4.0, None).expect("room");
        let s = SAFETY_TEXELS;
        let expected = [[s, 34.0 + 3.0 * s], [44.0 + 3.0 * s, s], [s, s]];
        for (found, expected) in found.iter().zip(expected) {
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-9), "{found:?} for {expected:?}");
        }
        let level = corners(&[rectangle(9.0, 0.0), rectangle(0.0, 0.0)], 4.0, None).expect("room");
        assert_eq!(level[0], [s, s]);
        assert!(level[1][0] >= 13.0, "{level:?}");
        assert!(corners(&[rectangle(100.0, 1.0)], 4.0, None).is_none(), "too wide");
        assert!(corners(&[rectangle(1.0, 100.0)], 4.0, None).is_none(), "too tall");
    }

    #[test]
    fn rows_are_broken_by_what_is_taken() {
        // Cells of two texels: columns 10 to 19 of the rows below 5 are taken, and row 20 from end to end.
        let mut mask = Mask::new(50, 50);
        (0..5).for_each(|y| mask.set_run(y, 10, 19));
        mask.set_run(20, 0, 49);
        let taken = Some(Taken { mask: &mask, frame: 0 });
        let outlines: Vec<Outline> = (0..8).map(|_| rectangle(18.0, 30.0)).collect();
        let found = corners(&outlines, 0.0, taken).expect("room");
        for [x, y] in &found {
            assert!(x + 18.0 < 20.0 || *x > 40.0 || *y > 10.0, "{x} {y} meets the block");
            assert!(y + 30.0 < 40.0 || *y > 42.0, "{x} {y} meets the bar");
        }
        assert!(found.iter().any(|[x, y]| *x < 2.0 && *y < 2.0) && found.iter().any(|[x, y]| *x > 40.0 && *y < 2.0));
        mask.set_run(34, 0, 49);
        assert!(corners(&outlines, 0.0, Some(Taken { mask: &mask, frame: 0 })).is_none());
    }
}
