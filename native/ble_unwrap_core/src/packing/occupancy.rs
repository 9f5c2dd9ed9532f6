//! The occupied cells of the texture, ready to be asked about 64 positions at once.

use super::cover::Square;
use super::mask::{Mask, word_at};

/// Occupied cells and, for each level k, the positions where a square of side 2^k would meet one.
///
/// A chart covered by squares is free at a position where every square is free at its own; 64
/// positions along x are looked up by one unaligned word a square. Columns outside the width count
/// as occupied, rows above the height as free. A summary bit a word tells whether the word has a
/// free position, so that full regions are skipped 64 words at a time: hence at most
/// [`Occupancy::WIDEST`] columns.
#[derive(Clone, Debug)]
pub(super) struct Occupancy {
    width: usize,
    height: usize,
    stride: usize,
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    words: Vec<u64>,
    /// Bit j of `open[y]`: word j of row y has a zero.
    open: Vec<u64>,
}

impl Occupancy {
    /// Most columns.
    pub(super) const WIDEST: usize = 4096;

    /// Nothing occupied; squares up to side 2^`top` can be asked about.
    pub(super) fn new(width: usize, height: usize, top: u32) -> Self {
        debug_assert!((1..=Self::WIDEST).contains(&width));
        let stride = width.div_ceil(64) + 1;
        let levels = (0..=top).map(|_| Level { words: vec![0; stride * height], open: vec![0; height] }).collect();
        let mut new = Self { width, height, stride, levels };
        for row in new.levels[0].words.chunks_exact_mut(stride) {
            for (w, word) in row.iter_mut().enumerate() {
                let used = width.saturating_sub(64 * w);
                *word = if used >= 64 { 0 } else { !0 << used };
            }
        }
        new.summarise(0, 0, height);
        for level in 1..new.levels.len() {
            new.combine(level, 0, height, 0, stride);
        }
        new
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Bit j set: positions 64j..64j+63 of row `y` may have one where `square` is free. Never clear
    /// where there is one. `y` + square must lie within the height.
    #[inline]
    pub(super) fn open_words(&self, square: Square, y: usize) -> u64 {
        let open = self.levels[square.level as usize].open[y + square.y as usize];
        let (skip, shift) = (square.x >> 6, square.x & 63);
        let here = open >> skip;
        if shift == 0 { here } else { here | here >> 1 }
    }

    /// Bit i set: `square` of a mask at (64·`word` + i, `y`) meets an occupied cell.
    #[inline]
    pub(super) fn blocked(&self, square: Square, word: usize, y: usize) -> u64 {
        let (skip, shift) = (square.x as usize >> 6, square.x & 63);
        let at = (y + square.y as usize) * self.stride + word + skip;
        let words = &self.levels[square.level as usize].words;
        if shift == 0 { words[at] } else { words[at] >> shift | words[at + 1] << (64 - shift) }
    }

    /// Occupies the cells of `mask` moved to (x, y), clipped; keeps levels up to `top` right. Higher
    /// ones are wrong afterwards and must not be asked about again.
    pub(super) fn occupy(&mut self, mask: &Mask, x: isize, y: isize, top: u32) {
        let (y0, y1) = (y.max(0), (y + mask.height() as isize).min(self.height as isize));
        let (x0, x1) = (x.max(0), (x + mask.width() as isize).min(self.width as isize));
        if y0 >= y1 || x0 >= x1 {
            return;
        }
        let (w0, w1) = (x0 as usize >> 6, (x1 as usize - 1) >> 6);
        for row in y0..y1 {
            let source = mask.row((row - y) as usize);
            let at = row as usize * self.stride;
            for w in w0..=w1 {
                // Bit 0 of word w is mask column 64w − x.
                let from = 64 * w as isize - x;
                self.levels[0].words[at + w] |= word_at(source, from);
            }
        }
        let (y0, y1) = (y0 as usize, y1 as usize);
        self.summarise(0, y0, y1);
        for level in 1..=(top as usize).min(self.levels.len() - 1) {
            let side = 1usize << level;
            let from = (x0 as usize).saturating_sub(side - 1) >> 6;
            self.combine(level, y0.saturating_sub(side - 1), y1, from, w1 + 1);
        }
    }

    /// Makes `level` from the one below in rows y0..y1 and words w0..w1.
    fn combine(&mut self, level: usize, y0: usize, y1: usize, w0: usize, w1: usize) {
        let half = 1usize << (level - 1);
        let (stride, height) = (self.stride, self.height);
        let (skip, shift) = (half >> 6, half & 63);
        let (below, above) = self.levels.split_at_mut(level);
        let (below, above) = (&below[level - 1].words, &mut above[0]);
        let both = |row: &[u64], w: usize| {
            let moved = if shift > 0 {
                row[w] >> shift | row.get(w + 1).map_or(!0, |n| n << (64 - shift))
            } else {
                row.get(w + skip).copied().unwrap_or(!0)
            };
            row[w] | moved
        };
        for y in y0..y1 {
            let low = &below[y * stride..(y + 1) * stride];
            let out = &mut above.words[y * stride..(y + 1) * stride];
            if y + half < height {
                let high = &below[(y + half) * stride..(y + half + 1) * stride];
                (w0..w1).for_each(|w| out[w] = both(low, w) | both(high, w));
            } else {
                (w0..w1).for_each(|w| out[w] = both(low, w));
            }
        }
        self.summarise(level, y0, y1);
    }

    fn summarise(&mut self, level: usize, y0: usize, y1: usize) {
        let (stride, level) = (self.stride, &mut self.levels[level]);
        for y in y0..y1 {
            let row = &level.words[y * stride..(y + 1) * stride - 1];
            level.open[y] = row.iter().enumerate().fold(0, |open, (w, &word)| open | u64::from(word != !0) << w);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_answers_as_brute_force_does(
            width in 1usize..200, height in 1usize..100,
            stamps in prop::collection::vec((1usize..70, 1usize..40, -30isize..220, -30isize..120), 0..4),
            asked in prop::collection::vec((0u32..5, 0u32..130, 0u32..60, 0usize..3, 0usize..60), 1..20),
        ) {
            let mut grid = Occupancy::new(width, height, 4);
            let mut cells = vec![false; width * height];
            for &(w, h, x, y) in &stamps {
                grid.occupy(&Mask::full(w, h), x, y, 4);
                for cy in 0..height as isize {
                    for cx in 0..width as isize {
                        if (x..x + w as isize).contains(&cx) && (y..y + h as isize).contains(&cy) {
                            cells[cy as usize * width + cx as usize] = true;
                        }
                    }
                }
            }
            for (level, x, y, word, row) in asked {
                let square = Square { x, y, level };
                if 64 * word + x as usize >= width || row + y as usize + square.side() > height {
                    continue;
                }
                let blocked = grid.blocked(square, word, row);
                for i in 0..64 {
                    let (left, low) = (64 * word + i + x as usize, row + y as usize);
                    let hit = left + square.side() > width
                        || (low..low + square.side()).any(|b| (left..left + square.side()).any(|a| cells[b * width + a]));
                    prop_assert_eq!(blocked >> i & 1 == 1, hit, "bit {}", i);
                }
                if blocked != !0 {
                    prop_assert!(grid.open_words(square, row) >> word & 1 == 1);
                }
            }
        }
    }
}
