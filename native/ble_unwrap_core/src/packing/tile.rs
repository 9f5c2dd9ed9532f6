//! The tiles of a texture, and where they lie in UV.

/// A tile: a square of UV of side 1 that has a texture of its own. Tile k, counted from 0, is the one that image formats
/// and renderers call UDIM 1001 + k.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Tile(usize);

impl Tile {
    /// Most tiles of a layout: ten rows. UDIM numbers have four digits and would allow for more, but single precision tells less and less
    /// apart the further a tile is from the origin.
    pub(crate) const MOST: usize = 100;
    /// Tiles in a row, as UDIM numbers have it.
    const IN_ROW: usize = 10;

    /// The first `count` tiles.
    pub(crate) fn first(count: usize) -> impl DoubleEndedIterator<Item = Self> + ExactSizeIterator {
        (0..count).map(Self)
    }

    /// Its number, from 0.
    pub(crate) fn number(self) -> usize {
        self.0
    }

    /// The UV of its lower left corner; whole numbers.
    pub(crate) fn corner(self) -> [f64; 2] {
        [self.0 % Self::IN_ROW, self.0 / Self::IN_ROW].map(|n| n as f64)
    }

    /// Columns and rows that the first `count` tiles take, at least one of each.
    pub(crate) fn columns_and_rows(count: usize) -> [usize; 2] {
        [count.clamp(1, Self::IN_ROW), count.div_ceil(Self::IN_ROW).max(1)]
    }

    /// Of the first `count` tiles, one that holds a UV, if any does; otherwise one near it. What is not a number counts as 0.
    pub(crate) fn near(uv: [f64; 2], count: usize) -> Self {
        let most = Self::columns_and_rows(count);
        // Casting saturates, and makes NaN 0.
        let [column, row] = [0, 1].map(|k| (uv[k].floor().max(0.0) as usize).min(most[k] - 1));
        Self((row * Self::IN_ROW + column).min(count.max(1) - 1))
    }

    /// Whether a UV lies in it or on its border, or outside by at most `slack`.
    pub(crate) fn holds(self, uv: [f64; 2], slack: f64) -> bool {
        let corner = self.corner();
        (0..2).all(|k| uv[k] >= corner[k] - slack && uv[k] <= corner[k] + 1.0 + slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_numbered_as_udim_has_them() {
        let corners: Vec<[f64; 2]> = Tile::first(Tile::MOST).map(Tile::corner).collect();
        assert_eq!(
            [corners[0], corners[9], corners[10], corners[99]],
            [[0.0, 0.0], [9.0, 0.0], [0.0, 1.0], [9.0, 9.0]]
        );
        for (count, expected) in [(0, [1, 1]), (1, [1, 1]), (4, [4, 1]), (10, [10, 1]), (11, [10, 2]), (100, [10, 10])]
        {
            assert_eq!(Tile::columns_and_rows(count), expected);
        }
    }

    #[test]
    fn every_uv_has_a_tile_near_it_and_is_held_by_that_alone_which_it_lies_in() {
        for tile in Tile::first(13) {
            let middle = tile.corner().map(|x| x + 0.5);
            assert_eq!(Tile::near(middle, 13), tile);
            assert!(tile.holds(middle, 0.0) && tile.holds(tile.corner(), 0.0));
            assert!(Tile::first(13).all(|other| other == tile || !other.holds(middle, 0.0)));
        }
        for (uv, count, number) in [
            ([-3.0, f64::NAN], 1, 0),
            ([1.0, 1.0], 1, 0),
            ([f64::INFINITY, f64::NEG_INFINITY], 4, 3),
            ([5.5, 1.5], 13, 12),
            ([1e300, 1e300], 100, 99),
            ([0.5, 0.5], 0, 0),
        ] {
            assert_eq!(Tile::near(uv, count).number(), number, "{uv:?} of {count}");
        }
        assert!(!Tile::near([1.5, 0.5], 1).holds([1.5, 0.5], 0.0));
        assert!(Tile::near([0.5, 0.5], 1).holds([1.000_001, -0.000_001], 1e-5));
    }
}
