//! Sets of grid cells as rows of bits.

/// A rectangle of cells, each in or out; row-major, 64 cells a word, lowest bit leftmost.
///
/// Bits right of `width` in the last word of a row are always zero.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Mask {
    width: usize,
    height: usize,
    stride: usize,
    words: Vec<u64>,
}

/// The bits `from..=to` of a word, `from <= to < 64`.
#[inline]
fn span(from: usize, to: usize) -> u64 {
    (!0 >> (63 - to)) & (!0 << from)
}

impl Mask {
    /// The empty set.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let stride = width.div_ceil(64);
        Self { width, height, stride, words: vec![0; stride * height] }
    }

    /// Every cell.
    pub(super) fn full(width: usize, height: usize) -> Self {
        let mut mask = Self::new(width, height);
        for y in 0..height {
            mask.set_run(y, 0, width.saturating_sub(1));
        }
        mask
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// The words of row `y`.
    #[inline]
    pub(super) fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..(y + 1) * self.stride]
    }

    #[inline]
    fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.stride..(y + 1) * self.stride]
    }

    #[inline]
    pub(super) fn get(&self, x: usize, y: usize) -> bool {
        self.row(y)[x >> 6] >> (x & 63) & 1 == 1
    }

    #[cfg(test)]
    pub(super) fn set(&mut self, x: usize, y: usize) {
        debug_assert!(x < self.width && y < self.height);
        let at = y * self.stride + (x >> 6);
        self.words[at] |= 1 << (x & 63);
    }

    /// Adds the cells `from..=to` of row `y`.
    pub(super) fn set_run(&mut self, y: usize, from: usize, to: usize) {
        let to = to.min(self.width.saturating_sub(1));
        if from > to || self.width == 0 {
            return;
        }
        let (a, b) = (from >> 6, to >> 6);
        let row = self.row_mut(y);
        if a == b {
            row[a] |= span(from & 63, to & 63);
            return;
        }
        row[a] |= span(from & 63, 63);
        row[a + 1..b].fill(!0);
        row[b] |= span(0, to & 63);
    }

    /// Removes the cells `from..=to` of row `y`.
    #[inline]
    pub(super) fn clear_run(&mut self, y: usize, from: usize, to: usize) {
        let (a, b) = (from >> 6, to >> 6);
        let row = self.row_mut(y);
        if a == b {
            row[a] &= !span(from & 63, to & 63);
            return;
        }
        row[a] &= !span(from & 63, 63);
        row[a + 1..b].fill(0);
        row[b] &= !span(0, to & 63);
    }

    /// Number of cells of row `y` within `from..=to`.
    #[inline]
    pub(super) fn count_run(&self, y: usize, from: usize, to: usize) -> u32 {
        let (a, b) = (from >> 6, to >> 6);
        let row = self.row(y);
        if a == b {
            return (row[a] & span(from & 63, to & 63)).count_ones();
        }
        let ends = (row[a] & span(from & 63, 63)).count_ones() + (row[b] & span(0, to & 63)).count_ones();
        row[a + 1..b].iter().fold(ends, |n, w| n + w.count_ones())
    }

    /// Number of cells.
    pub(super) fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// A number that is the same for equal masks, and hardly ever for others.
    pub(super) fn key(&self) -> u64 {
        let fold = |key: u64, word: u64| (key ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
        self.words.iter().fold(fold(self.width as u64, self.height as u64), |key, &word| fold(key, word))
    }

    /// Whether no cell is in.
    pub(super) fn is_empty(&self) -> bool {
        self.words.iter().all(|&w| w == 0)
    }

    /// The cells (x, y) for which (x, y), (x + by, y), (x, y + by) and (x + by, y + by) all are in.
    pub(super) fn and_shifted(&self, by: usize) -> Self {
        let mut out = Self::new(self.width, self.height);
        let mut pair = vec![0; self.stride];
        for y in 0..self.height.saturating_sub(by) {
            for (p, (&a, &b)) in pair.iter_mut().zip(self.row(y).iter().zip(self.row(y + by))) {
                *p = a & b;
            }
            out.row_mut(y).copy_from_slice(&pair);
            shift_down(&mut pair, by);
            for (o, &p) in out.row_mut(y).iter_mut().zip(&pair) {
                *o &= p;
            }
        }
        out
    }

    /// Calls `f` with every cell, row by row.
    pub(super) fn for_each(&self, mut f: impl FnMut(usize, usize)) {
        for y in 0..self.height {
            for (w, &word) in self.row(y).iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    f(64 * w + rest.trailing_zeros() as usize, y);
                    rest &= rest - 1;
                }
            }
        }
    }

    /// Adds the cells of `other` moved to (x, y), clipped to `columns`.
    pub(super) fn paste(&mut self, other: &Self, x: isize, y: isize, columns: usize) {
        let (y0, y1) = (y.max(0), (y + other.height as isize).min(self.height as isize));
        let (x0, x1) = (x.max(0), (x + other.width as isize).min(columns.min(self.width) as isize));
        if y0 >= y1 || x0 >= x1 {
            return;
        }
        let (w0, w1) = (x0 as usize >> 6, (x1 as usize - 1) >> 6);
        let last = span(0, (x1 as usize - 1) & 63);
        for row in y0..y1 {
            let source = other.row((row - y) as usize);
            let target = self.row_mut(row as usize);
            for (w, t) in target.iter_mut().enumerate().take(w1 + 1).skip(w0) {
                // Bit 0 of word w is column 64w − x of the other.
                let bits = word_at(source, 64 * w as isize - x);
                *t |= if w == w1 { bits & last } else { bits };
            }
        }
    }

    /// The mask turned a quarter counter-clockwise: cell (x, y) goes to (h − 1 − y, x).
    pub(super) fn quarter_turn(&self) -> Self {
        let mut turned = Self::new(self.height, self.width);
        let mut block = [0u64; 64];
        for y0 in (0..turned.stride).map(|w| 64 * w) {
            // Columns y0..y0 + 64 of the turned mask are rows h−1−y0, h−2−y0, … of this one.
            for w in 0..self.stride {
                for (i, b) in block.iter_mut().enumerate() {
                    *b = (self.height.checked_sub(1 + y0 + i)).map_or(0, |y| self.words[y * self.stride + w]);
                }
                transpose(&mut block);
                for (i, &b) in block.iter().enumerate().take(self.width - 64 * w) {
                    turned.words[(64 * w + i) * turned.stride + (y0 >> 6)] = b;
                }
            }
        }
        turned
    }

    /// All cells whose square is nearer than the distance of `reach` to a square of the mask, with
    /// a frame of `reach.cells()` more on every side.
    pub(super) fn dilated(&self, reach: &Reach) -> Self {
        let r = reach.cells();
        let mut out = Self::new(self.width + 2 * r, self.height + 2 * r);
        let mut wide = Vec::new();
        for y in 0..self.height {
            let mut have: Option<usize> = None;
            // Rows far away reach least: widen the row step by step.
            for dy in (0..=r).rev() {
                let dx = reach.across(dy);
                match have {
                    None => {
                        wide.clear();
                        wide.resize(out.stride, 0);
                        or_shifted(&mut wide, self.row(y), r - dx);
                        spread_right(&mut wide, 2 * dx);
                    }
                    Some(before) if before < dx => {
                        // Centred on the same cells: start 'dx − before' further left.
                        shift_down(&mut wide, dx - before);
                        spread_right(&mut wide, 2 * (dx - before));
                    }
                    Some(_) => {}
                }
                have = Some(dx);
                for target in [y + r - dy, y + r + dy] {
                    for (o, &w) in out.row_mut(target).iter_mut().zip(&wide) {
                        *o |= w;
                    }
                }
            }
        }
        out
    }
}

/// 64 bits of a row from bit `from` on, zeros outside.
#[inline]
pub(super) fn word_at(row: &[u64], from: isize) -> u64 {
    let (w, shift) = (from.div_euclid(64), from.rem_euclid(64));
    let get = |w: isize| usize::try_from(w).ok().and_then(|w| row.get(w)).copied().unwrap_or(0);
    if shift == 0 { get(w) } else { get(w) >> shift | get(w + 1) << (64 - shift) }
}

/// Transposes a block of 64 by 64 bits: bit j of word i goes to bit i of word j. Warren: Hacker's
/// Delight, second edition, 2012, section 7-3.
fn transpose(block: &mut [u64; 64]) {
    let mut half = 32;
    let mut low = !0u64 >> 32;
    while half > 0 {
        let mut k = 0;
        while k < 64 {
            let swap = (block[k] >> half ^ block[k + half]) & low;
            block[k] ^= swap << half;
            block[k + half] ^= swap;
            k = (k + half + 1) & !half;
        }
        half >>= 1;
        low ^= low << half;
    }
}

/// `target |= source << by`, over words.
fn or_shifted(target: &mut [u64], source: &[u64], by: usize) {
    let (skip, shift) = (by >> 6, by & 63);
    for (w, &word) in source.iter().enumerate() {
        if let Some(t) = target.get_mut(w + skip) {
            *t |= word << shift;
        }
        if shift > 0
            && let Some(t) = target.get_mut(w + skip + 1)
        {
            *t |= word >> (64 - shift);
        }
    }
}

/// Every set bit also sets the `by` bits after it.
fn spread_right(row: &mut [u64], by: usize) {
    let mut done = 0;
    while done < by {
        let step = (by - done).min(done + 1);
        let (skip, shift) = (step >> 6, step & 63);
        for w in (skip..row.len()).rev() {
            let mut moved = row[w - skip] << shift;
            if shift > 0 && w > skip {
                moved |= row[w - skip - 1] >> (64 - shift);
            }
            row[w] |= moved;
        }
        done += step;
    }
}

/// Moves every bit `by` places towards lower indices.
fn shift_down(row: &mut [u64], by: usize) {
    let (skip, shift) = (by >> 6, by & 63);
    for w in 0..row.len() {
        let low = row.get(w + skip).copied().unwrap_or(0);
        let high = row.get(w + skip + 1).copied().unwrap_or(0);
        row[w] = if shift == 0 { low } else { low >> shift | high << (64 - shift) };
    }
}

/// Which cells lie nearer than a distance to a given one, square to square.
///
/// Two unit squares (dx, dy) cells apart are √(max(|dx|−1, 0)² + max(|dy|−1, 0)²) apart.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// Greatest |dx| too near, for |dy| = 0, 1, …; never growing.
    across: Vec<usize>,
}

impl Reach {
    /// Reach of `distance` cells, at least 0. A distance of 0 reaches the cell itself only.
    pub(super) fn new(distance: f64) -> Self {
        let near = |dx: usize, dy: usize| {
            let gap = |d: usize| d.saturating_sub(1) as f64;
            // Exactly apart by the distance is allowed; 1e-9 forgives the rounding of distance / cell size.
            gap(dx).hypot(gap(dy)) < distance - 1e-9
        };
        let mut across = Vec::new();
        let bound = distance.ceil().max(0.0) as usize + 1;
        for dy in 0..=bound {
            if dy > 0 && !near(0, dy) {
                break;
            }
            across.push((0..=bound).rev().find(|&dx| near(dx, dy)).unwrap_or(0));
        }
        Self { across }
    }

    /// Greatest reach, in cells.
    pub(super) fn cells(&self) -> usize {
        (self.across.len() - 1).max(self.across[0])
    }

    /// Reach along x of a cell `dy` rows away; 0 beyond the reach, where no cell is near.
    fn across(&self, dy: usize) -> usize {
        self.across[dy.min(self.across.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn random_mask(width: usize, height: usize, cells: &[(usize, usize)]) -> Mask {
        let mut mask = Mask::new(width, height);
        for &(x, y) in cells {
            mask.set(x % width, y % height);
        }
        mask
    }

    proptest! {
        #[test]
        fn dilation_is_square_to_square_distance(
            width in 1usize..150, height in 1usize..40,
            cells in prop::collection::vec((0usize..1000, 0usize..1000), 1..12),
            distance in prop_oneof![Just(0.0), Just(1.0), Just(2.0), Just(8.0), 0.0..20.0],
        ) {
            let mask = random_mask(width, height, &cells);
            let reach = Reach::new(distance);
            let r = reach.cells();
            let out = mask.dilated(&reach);
            prop_assert_eq!((out.width(), out.height()), (width + 2 * r, height + 2 * r));
            for y in 0..out.height() {
                for x in 0..out.width() {
                    let mut near = false;
                    mask.for_each(|a, b| {
                        let gap = |p: usize, q: usize| ((p + r).abs_diff(q).saturating_sub(1)) as f64;
                        let same = (a + r, b + r) == (x, y);
                        near |= same || gap(a, x).hypot(gap(b, y)) < distance - 1e-9;
                    });
                    prop_assert_eq!(out.get(x, y), near, "cell {} {} of reach {}", x, y, r);
                }
            }
        }

        #[test]
        fn pasting_moves_and_clips(
            width in 1usize..150, columns in 1usize..200, cells in prop::collection::vec((0usize..150, 0usize..9), 1..20),
            x in -160isize..210, y in -12isize..30,
        ) {
            let source = random_mask(width, 9, &cells);
            let mut target = Mask::new(200, 20);
            target.set(7, 3);
            target.paste(&source, x, y, columns);
            for b in 0..20 {
                for a in 0..200 {
                    let (p, q) = (a as isize - x, b as isize - y);
                    let from = (0..width as isize).contains(&p) && (0..9).contains(&q) && a < columns;
                    let expected = (a, b) == (7, 3) || from && source.get(p as usize, q as usize);
                    prop_assert_eq!(target.get(a, b), expected, "cell {} {}", a, b);
                }
            }
        }

        #[test]
        fn runs_set_count_and_clear(width in 1usize..300, a in 0usize..300, b in 0usize..300) {
            let (a, b) = (a % width, b % width);
            let (a, b) = (a.min(b), a.max(b));
            let mut mask = Mask::new(width, 2);
            mask.set_run(1, a, b);
            for x in 0..width {
                prop_assert_eq!(mask.get(x, 1), (a..=b).contains(&x));
            }
            prop_assert_eq!(mask.count(), b - a + 1);
            prop_assert_eq!(mask.count_run(1, a, b) as usize, b - a + 1);
            mask.clear_run(1, a, b);
            prop_assert_eq!(mask.count(), 0);
        }
    }

    #[test]
    fn four_quarter_turns_are_none() {
        let mask = random_mask(90, 13, &[(0, 0), (89, 0), (5, 12), (64, 7), (63, 1)]);
        let once = mask.quarter_turn();
        assert!(once.get(12, 0) && once.get(12, 89) && once.get(0, 5), "(x, y) goes to (h − 1 − y, x)");
        assert_eq!(once.quarter_turn().quarter_turn().quarter_turn(), mask);
    }

    #[test]
    fn reach_of_whole_distances_is_tight() {
        // Two cells between squares are a distance of two: three columns on are free.
        assert_eq!(Reach::new(2.0).cells(), 2);
        assert_eq!(Reach::new(0.0).cells(), 0);
        assert_eq!(Reach::new(2.5).cells(), 3);
    }
}
