//! The margin that keeps charts apart on mip levels, too.
//!
//! On mip level n a texel is a square whose side is s = 2ⁿ texels of the texture, and holds the mean of what lies
//! there. Bilinear filtering at a point reads the four texels whose middles are around it, each less than s away from
//! it along either axis. So one texel is read for two points only if these are less than 2 s apart along both axes.
//! Charts whose distance is 2√2 s or more are at least 2 s apart along one of them, in whatever direction they lie from
//! each other: no texel is read for both, and whoever fills the texels around a chart, as bakers do, spoils none that
//! another chart needs. On the levels before, s is smaller.
//!
//! A block of 4 by 4 texels, which texture compression takes for one, is a texel of level 2. Charts share none where
//! they are as far apart as that takes on level 1.

use std::f64::consts::SQRT_2;

use super::PackSettings;

/// How far charts are to be apart, in texels of a mip level, for that level to mix none.
const APART: f64 = 2.0 * SQRT_2;

impl PackSettings {
    /// The least distance of two charts, in texels: `margin_texels`, or what the mip levels take where that is more,
    /// which is 2√2 times the side of a texel of the last level. Where the size of the texture is no multiple of that,
    /// a texel of the level is a little larger than a power of two.
    #[must_use]
    pub fn margin(&self) -> f64 {
        if self.mip_levels == 0 {
            return self.margin_texels;
        }
        let texel = |side: u32| {
            let halved = u32::try_from(self.mip_levels).ok().and_then(|levels| side.checked_shr(levels)).unwrap_or(0);
            f64::from(side) / f64::from(halved.max(1))
        };
        self.margin_texels.max(APART * texel(self.width).max(texel(self.height)))
    }

    /// The same settings with that for their margin.
    pub(crate) fn with_whole_margin(&self) -> Self {
        Self { margin_texels: self.margin(), mip_levels: 0, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn settings(size: [u32; 2], margin_texels: f64, mip_levels: usize) -> PackSettings {
        PackSettings { width: size[0], height: size[1], margin_texels, mip_levels, ..PackSettings::default() }
    }

    #[test]
    fn the_margin_is_raised_to_what_the_last_level_takes() {
        assert_eq!(settings([1024, 1024], 4.0, 0).margin(), 4.0);
        assert_eq!(settings([1024, 512], 4.0, 2).margin(), 8.0 * SQRT_2);
        assert_eq!(settings([1024, 1024], 20.0, 2).margin(), 20.0, "a wider one is kept");
        // 1000 / 8 texels are whole, 1000 / 16 are 62.
        assert_eq!(settings([1000, 1000], 0.0, 3).margin(), 16.0 * SQRT_2);
        assert_eq!(settings([1000, 1000], 0.0, 4).margin(), 2.0 * SQRT_2 * 1000.0 / 62.0);
        // No texture has so many.
        assert_eq!(settings([64, 32], 0.0, 40).margin(), 2.0 * SQRT_2 * 64.0);
        assert_eq!(settings([64, 32], 0.0, usize::MAX).margin(), 2.0 * SQRT_2 * 64.0);
        let whole = settings([1024, 1024], 4.0, 2).with_whole_margin();
        assert_eq!((whole.margin_texels, whole.margin(), whole.mip_levels), (8.0 * SQRT_2, 8.0 * SQRT_2, 0));
        assert!(settings([64, 64], f64::NAN, 0).margin().is_nan(), "which is refused later");
    }

    proptest! {
        /// The four texels of each of two points, on a level whose texels have a side of 1.
        #[test]
        fn points_so_far_apart_read_no_texel_in_common(x in 0.0f64..9.0, y in 0.0f64..9.0, angle in 0.0f64..6.3, more in 1e-9f64..3.0) {
            let distance = APART + more;
            let other = [x + distance * angle.cos(), y + distance * angle.sin()];
            let read = |at: f64| {
                let first = (at - 0.5).floor() as i64;
                [first, first + 1]
            };
            let meets = |k: usize| {
                let (a, b) = (read([x, y][k]), read(other[k]));
                a.iter().any(|texel| b.contains(texel))
            };
            prop_assert!(!(meets(0) && meets(1)));
        }
    }
}
