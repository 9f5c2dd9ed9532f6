//! The fine placement: every chart near where a sketch has it, in the one pose it has there.
//!
//! A window of a few dozen positions is all that is searched, so no summaries of the grid pay: the
//! runs of cells of a chart's rows are asked for 64 positions at once, those that blocked the last
//! positions first.

use super::Pose;
use super::mask::{Mask, Reach};
use super::obstacles::Obstacles;
use super::outline::Outline;
use super::raster::rasterise;
use super::shape::{SAFETY_TEXELS, Scale};
use crate::progress::{Cancelled, Progress};

/// What a cell to the right costs in rows when a place is chosen.
const LEAN: f64 = 0.3;
/// What a cell to the right counts in rows when pieces are put in order.
const SWEEP: f64 = 0.25;
/// Times a window may be doubled, and in how many of them reservations are kept.
const DOUBLINGS: u32 = 5;
const POLITE: u32 = 2;

/// A row's worth of neighbouring cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    row: u32,
    from: u32,
    to: u32,
}

/// A chart in one pose, on the fine grid.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    mask: Mask,
    /// The runs of the mask's rows; spread out, so that the first few are a sample of all.
    runs: Vec<Run>,
    /// Cells covered.
    pub(super) cells: usize,
    /// Whether the chart was scaled up to a texel.
    pub(super) is_speck: bool,
    /// Chart plane to cells of the mask.
    to_cells: Pose,
}

impl Piece {
    /// The chart at `density` texels to a unit of its plane, turned by the angle of (cos, sin) = `turn`.
    pub(super) fn new(outline: &Outline, turn: [f64; 2], density: f64, cell: f64) -> Self {
        let Scale { cells: scale, is_speck } = Scale::new(outline, density, cell);
        let raster = rasterise(outline, turn, scale, SAFETY_TEXELS / cell);
        let to_cells = Pose {
            cos: turn[0],
            sin: turn[1],
            centre: outline.centre,
            scale: scale / outline.unit(),
            offset: raster.shift.into(),
        };
        let all = runs(&raster.mask);
        let cells = all.iter().map(|r| (r.to - r.from + 1) as usize).sum();
        let step = (all.len() as f64).sqrt().ceil().max(1.0) as usize;
        let spread = (0..step).flat_map(|k| all.iter().skip(k).step_by(step).copied()).collect();
        Self { mask: raster.mask, runs: spread, cells, is_speck, to_cells }
    }

    /// Chart plane to cells of the grid, with the mask's corner at `corner`.
    pub(super) fn pose(&self, corner: [usize; 2]) -> Pose {
        Pose {
            offset: self.to_cells.offset + nalgebra::Vector2::new(corner[0] as f64, corner[1] as f64),
            ..self.to_cells
        }
    }
}

fn runs(mask: &Mask) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::with_capacity(mask.height());
    for y in 0..mask.height() {
        let mut open: Option<u32> = None;
        for (w, &word) in mask.row(y).iter().enumerate() {
            let base = 64 * w as u32;
            let mut at = 0;
            while at < 64 {
                let rest = if open.is_some() { !word >> at } else { word >> at };
                let skip = rest.trailing_zeros();
                if rest == 0 {
                    break;
                }
                at += skip;
                match open.take() {
                    Some(from) => runs.push(Run { row: y as u32, from, to: base + at - 1 }),
                    None => open = Some(base + at),
                }
            }
        }
        if let Some(from) = open {
            runs.push(Run { row: y as u32, from, to: mask.width() as u32 - 1 });
        }
    }
    runs
}

/// Bit i set: the run of cells `from..=to`, moved right by i, meets a cell of `row`. The row must have 64
/// columns more than the run reaches.
#[inline]
fn meets(row: &[u64], from: usize, to: usize) -> u64 {
    let word = |at: usize| {
        let (w, shift) = (at >> 6, at & 63);
        let low = row[w] >> shift;
        if shift == 0 { low } else { low | row[w + 1] << (64 - shift) }
    };
    let length = to - from + 1;
    if length < 64 {
        let mut bits = u128::from(word(from)) | u128::from(word(from + 64)) << 64;
        if bits == 0 {
            return 0;
        }
        let mut done = 1;
        while done < length {
            let step = done.min(length - done);
            bits |= bits >> step;
            done += step;
        }
        return bits as u64;
    }
    // Cells that leave the run as it moves, cells that join it, and those that never change.
    let (left, right) = (word(from), word(to));
    let leaving = if left == 0 { 0 } else { !0 >> left.leading_zeros() };
    let joining = if right == 0 { 0 } else { !0 << right.trailing_zeros() };
    if leaving | joining == !0 {
        return !0;
    }
    let (first, last) = (from + 64, to);
    if first < last {
        let (a, b) = (first >> 6, (last - 1) >> 6);
        let low = !0 << (first & 63);
        let high = !0 >> (63 - ((last - 1) & 63));
        let any = if a == b {
            row[a] & low & high
        } else {
            row[a + 1..b].iter().fold(row[a] & low | row[b] & high, |any, &w| any | w)
        };
        if any != 0 {
            return !0;
        }
    }
    leaving | joining
}

/// Where a piece may go: corners `x` and `y`, both inclusive.
#[derive(Clone, Copy, Debug)]
struct Window {
    x: [usize; 2],
    y: [usize; 2],
}

/// What is taken on the fine grid.
pub(super) struct Ground {
    columns: usize,
    rows: usize,
    reach: Reach,
    /// Cells too near to placed pieces.
    taken: Mask,
    /// Cells of pieces not placed yet, where they are to go.
    reserved: Mask,
}

impl Ground {
    pub(super) fn new(columns: usize, rows: usize, reach: Reach) -> Self {
        // Words beyond the last column are read by `meets`, never set.
        let empty = Mask::new(columns + 192, rows);
        Self { columns, rows, reach, taken: empty.clone(), reserved: empty }
    }

    /// Takes the cells of obstacles on the same grid.
    pub(super) fn obstruct(&mut self, obstacles: &Obstacles) {
        let corner = -(obstacles.frame as isize);
        self.taken.paste(&obstacles.mask, corner, corner, self.columns);
    }

    fn reserve(&mut self, piece: &Piece, corner: [isize; 2]) {
        self.reserved.paste(&piece.mask, corner[0], corner[1], self.columns);
    }

    /// Ends a reservation. Cells two pieces had reserved are free then, which does no harm.
    fn release(&mut self, piece: &Piece, corner: [isize; 2]) {
        let [x, y] = corner;
        for run in &piece.runs {
            let row = y + run.row as isize;
            let (from, to) = ((x + run.from as isize).max(0), (x + run.to as isize).min(self.columns as isize - 1));
            if from <= to && (0..self.rows as isize).contains(&row) {
                self.reserved.clear_run(row as usize, from as usize, to as usize);
            }
        }
    }

    fn occupy(&mut self, piece: &Piece, corner: [usize; 2]) {
        let r = self.reach.cells() as isize;
        let grown = piece.mask.dilated(&self.reach);
        self.taken.paste(&grown, corner[0] as isize - r, corner[1] as isize - r, self.columns);
    }

    /// The free corner in the window that is least in y + [`LEAN`] · x; free of reservations too if `polite`.
    fn lowest(&self, runs: &mut [Run], window: Window, polite: bool) -> Option<[usize; 2]> {
        let mut best: Option<(f64, [usize; 2])> = None;
        let blocked = |run: Run, x: usize, y: usize| {
            let (row, from, to) = (y + run.row as usize, x + run.from as usize, x + run.to as usize);
            let taken = meets(self.taken.row(row), from, to);
            if polite { taken | meets(self.reserved.row(row), from, to) } else { taken }
        };
        for y in window.y[0]..=window.y[1] {
            let limit = best.map_or(f64::INFINITY, |b| b.0);
            let cost = |x: usize| (y - window.y[0]) as f64 + LEAN * (x - window.x[0]) as f64;
            let mut x = window.x[0];
            while x <= window.x[1] && cost(x) < limit {
                let count = (window.x[1] - x + 1).min(64);
                let mut closed = if count == 64 { 0 } else { !0 << count };
                for k in 0..runs.len() {
                    closed |= blocked(runs[k], x, y);
                    if closed == !0 {
                        // What blocks here blocks next door: ask it earlier.
                        runs.swap(k, k / 2);
                        break;
                    }
                }
                if closed != !0 {
                    let at = x + closed.trailing_ones() as usize;
                    if cost(at) < limit {
                        best = Some((cost(at), [at, y]));
                    }
                    break;
                }
                x += 64;
            }
            if best.is_some_and(|b| b.0 <= (y + 1 - window.y[0]) as f64) {
                break;
            }
        }
        best.map(|b| b.1)
    }
}

/// Where pieces went, and the rows they take.
#[derive(Clone, Debug)]
pub(super) struct Settled {
    /// Corners of masks, by piece.
    pub(super) corners: Vec<Option<[usize; 2]>>,
    pub(super) rows: usize,
}

/// Places pieces on empty ground near the places `centres` (in cells) of their centres: as low and as far
/// left in a window of `window` cells around as they go without taking the place of another. A piece that
/// finds none is looked for in windows up to [`DOUBLINGS`] times doubled, where it may take another's; `None`
/// where that fails too.
///
/// Cost: about the number of words of the masks, plus the rows of the windows.
///
/// # Errors
/// [`Cancelled`].
pub(super) fn settle(
    pieces: &[Option<Piece>],
    centres: &[[f64; 2]],
    ground: &mut Ground,
    window: usize,
    progress: &Progress,
) -> Result<Option<Settled>, Cancelled> {
    // The corner of each mask if its centre is where it should be.
    let near: Vec<[f64; 2]> = pieces
        .iter()
        .zip(centres)
        .map(|(p, c)| p.as_ref().map_or([0.0; 2], |p| [0, 1].map(|k| c[k] - p.to_cells.offset[k])))
        .collect();
    let cell = |at: [f64; 2]| at.map(|v| v.round() as isize);
    // Those further down and left first: they make room for the others.
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    let depth = |i: usize| near[i][1] + SWEEP * near[i][0];
    order.sort_by(|&a, &b| depth(a).total_cmp(&depth(b)).then(a.cmp(&b)));
    for &i in &order {
        if let Some(piece) = &pieces[i] {
            ground.reserve(piece, cell(near[i]));
        }
    }
    let mut settled = Settled { corners: vec![None; pieces.len()], rows: 0 };
    for &i in &order {
        progress.check()?;
        let Some(piece) = &pieces[i] else { continue };
        let (w, h) = (piece.mask.width(), piece.mask.height());
        if w > ground.columns || h > ground.rows {
            return Ok(None);
        }
        let most = [ground.columns - w, ground.rows - h];
        ground.release(piece, cell(near[i]));
        let mut runs = piece.runs.clone();
        let found = (0..=DOUBLINGS).find_map(|k| {
            let half = (window << k) as f64;
            let [x, y] = [0, 1].map(|k: usize| {
                [near[i][k] - half, near[i][k] + half].map(|v| (v.round().max(0.0) as usize).min(most[k]))
            });
            let polite = (k < POLITE).then(|| ground.lowest(&mut runs, Window { x, y }, true)).flatten();
            polite.or_else(|| ground.lowest(&mut runs, Window { x, y }, false))
        });
        let Some(corner) = found else { return Ok(None) };
        ground.occupy(piece, corner);
        settled.rows = settled.rows.max(corner[1] + h);
        settled.corners[i] = Some(corner);
    }
    Ok(Some(settled))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_moving_run_meets_what_brute_force_says(
            cells in prop::collection::vec(0usize..300, 0..12), from in 0usize..120, length in 1usize..180,
        ) {
            let mut mask = Mask::new(512, 1);
            for &c in &cells {
                mask.set(c, 0);
            }
            let bits = meets(mask.row(0), from, from + length - 1);
            for i in 0..64 {
                let hit = (from + i..from + i + length).any(|x| mask.get(x, 0));
                prop_assert_eq!(bits >> i & 1 == 1, hit, "moved by {}", i);
            }
        }

        #[test]
        fn runs_are_the_mask(
            width in 1usize..200, cells in prop::collection::vec((0usize..200, 0usize..5), 0..60),
            spans in prop::collection::vec((0usize..200, 0usize..200, 0usize..5), 0..4),
        ) {
            let mut mask = Mask::new(width, 5);
            for &(x, y) in &cells {
                mask.set(x % width, y);
            }
            for &(a, b, y) in &spans {
                mask.set_run(y, (a % width).min(b % width), (a % width).max(b % width));
            }
            let mut again = Mask::new(width, 5);
            let all = runs(&mask);
            for r in &all {
                again.set_run(r.row as usize, r.from as usize, r.to as usize);
            }
            prop_assert_eq!(&again, &mask);
            prop_assert!(all.windows(2).all(|p| p[0].row < p[1].row || p[0].to + 1 < p[1].from), "runs are maximal");
        }
    }

    /// A rectangle of w by h cells whose outline is exactly that.
    fn piece(w: f64, h: f64) -> Piece {
        let points = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(|[x, y]| nalgebra::Point2::new(x, y));
        let item = crate::packing::PackItem { points: &points, triangles: &[[0, 1, 2], [0, 2, 3]] };
        Piece::new(&Outline::new(&item, 0).expect("valid"), [1.0, 0.0], 1.0, 1.0)
    }

    fn settled(pieces: &[Option<Piece>], centres: &[[f64; 2]], size: [usize; 2], reach: f64) -> Option<Settled> {
        let mut ground = Ground::new(size[0], size[1], Reach::new(reach));
        settle(pieces, centres, &mut ground, 4, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn pieces_sink_to_the_corner_and_keep_apart() {
        let pieces = [Some(piece(9.5, 9.5)), None, Some(piece(9.5, 9.5))];
        let found = settled(&pieces, &[[20.0, 8.0], [0.0; 2], [7.0, 7.0]], [100, 100], 3.0).expect("room");
        assert_eq!(found.corners, vec![Some([13, 0]), None, Some([0, 0])]);
        assert_eq!(found.rows, 10);
    }

    #[test]
    fn what_has_no_room_nearby_goes_further_or_nowhere() {
        let pieces: Vec<_> = (0..4).map(|_| Some(piece(9.5, 9.5))).collect();
        let found = settled(&pieces, &[[5.0; 2]; 4], [20, 60], 0.0).expect("room");
        let mut corners: Vec<_> = found.corners.iter().flatten().copied().collect();
        corners.sort_unstable();
        corners.dedup();
        assert_eq!(corners.len(), 4);
        assert!(settled(&pieces, &[[5.0; 2]; 4], [12, 30], 0.0).is_none());
    }
}
