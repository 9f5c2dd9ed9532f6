//! A mask as a union of squares whose sides are powers of two.

use super::mask::Mask;

/// A square of cells with corner (x, y) and side 2^`level`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Square {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) level: u32,
}

impl Square {
    pub(super) fn side(self) -> usize {
        1 << self.level
    }

    /// Where the square goes when its mask of height `height` makes a quarter turn.
    pub(super) fn quarter_turn(self, height: usize) -> Self {
        Self { x: (height - self.side()) as u32 - self.y, y: self.x, level: self.level }
    }
}

/// Squares inside the mask whose union is the mask; larger ones first.
///
/// Greedy: at each level, from the largest that fits down to sides of four, squares on a lattice of
/// half their side are taken where at least half of their cells are new; what is left, mostly the
/// staircase of the boundary, goes into squares of two and single cells. O(cells · log side / 64)
/// for the table of fitting squares and O(cells / 4) counts.
pub(super) fn cover(mask: &Mask) -> Vec<Square> {
    let fitting = fitting_squares(mask);
    let mut squares = Vec::new();
    let mut left = mask.clone();
    let mut take = |left: &mut Mask, x: usize, y: usize, level: usize| {
        squares.push(Square { x: x as u32, y: y as u32, level: level as u32 });
        let side = 1 << level;
        (y..y + side).for_each(|r| left.clear_run(r, x, x + side - 1));
    };
    for level in (2..fitting.len()).rev() {
        let side = 1usize << level;
        let step = if level + 2 > fitting.len() {
            side / 4
        } else if level + 3 > fitting.len() {
            side / 2
        } else {
            side
        };
        for y in (0..=mask.height() - side).step_by(step) {
            for x in (0..=mask.width() - side).step_by(step) {
                if !fitting[level].get(x, y) {
                    continue;
                }
                let new: u32 = (y..y + side).map(|r| left.count_run(r, x, x + side - 1)).sum();
                if 2 * new as usize >= side * side {
                    take(&mut left, x, y, level);
                }
            }
        }
    }
    for level in (0..fitting.len().min(2)).rev() {
        let reach = (1usize << level) - 1;
        let mut seeds = Vec::new();
        left.for_each(|x, y| seeds.push((x, y)));
        for (x, y) in seeds {
            if !left.get(x, y) {
                continue;
            }
            // The later corners first: earlier seeds are covered already.
            let corners = [
                (x, y),
                (x.wrapping_sub(reach), y),
                (x, y.wrapping_sub(reach)),
                (x.wrapping_sub(reach), y.wrapping_sub(reach)),
            ];
            let fits = |&(a, b): &(usize, usize)| a < mask.width() && b < mask.height() && fitting[level].get(a, b);
            if let Some((a, b)) = corners.into_iter().find(fits) {
                take(&mut left, a, b, level);
            }
        }
    }
    squares
}

/// For each level, where a square of side 2^level has its lower left corner if it lies in the mask.
fn fitting_squares(mask: &Mask) -> Vec<Mask> {
    let mut fitting = vec![mask.clone()];
    for level in 0..mask.width().min(mask.height()).ilog2() {
        let next = fitting[level as usize].and_shifted(1 << level);
        if next.is_empty() {
            break;
        }
        fitting.push(next);
    }
    fitting
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn union(squares: &[Square], width: usize, height: usize) -> Mask {
        let mut out = Mask::new(width, height);
        for q in squares {
            for y in 0..q.side() {
                out.set_run(q.y as usize + y, q.x as usize, q.x as usize + q.side() - 1);
            }
        }
        out
    }

    proptest! {
        #[test]
        fn the_union_is_the_mask_in_every_quarter(
            width in 1usize..140, height in 1usize..90,
            discs in prop::collection::vec((0.0f64..140.0, 0.0f64..90.0, 1.0f64..40.0), 1..5),
        ) {
            let mut mask = Mask::new(width, height);
            for y in 0..height {
                for x in 0..width {
                    if discs.iter().any(|&(a, b, r)| (x as f64 - a).hypot(y as f64 - b) < r) {
                        mask.set(x, y);
                    }
                }
            }
            let mut squares = cover(&mask);
            prop_assert!(squares.windows(2).all(|p| p[0].level >= p[1].level));
            for _ in 0..4 {
                prop_assert_eq!(&union(&squares, mask.width(), mask.height()), &mask);
                squares = squares.iter().map(|q| q.quarter_turn(mask.height())).collect();
                mask = mask.quarter_turn();
            }
        }
    }

    #[test]
    fn a_full_square_needs_few() {
        assert_eq!(cover(&Mask::full(64, 64)).len(), 1);
        assert!(cover(&Mask::full(100, 100)).len() < 300);
    }
}
