//! The frame in which conditioning works.

use nalgebra::{Point3, Vector3};

/// The middle and half the longest side of a box; what it holds is placed in [−1, 1]³.
pub(super) struct Frame {
    centre: Vector3<f64>,
    /// Length of the frame's unit in the unit of the input.
    pub(super) half_extent: f64,
    /// The diagonal of the box, in the frame's unit.
    pub(super) diagonal: f64,
    /// The greatest coordinate of the input, in the frame's unit; infinite where that is too much.
    pub(super) largest: f64,
}

impl Frame {
    /// Around the vertices that are `used`, which must be finite.
    pub(super) fn around(positions: &[[f64; 3]], used: &[bool]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (p, _) in positions.iter().zip(used).filter(|(_, used)| **used) {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        if low[0] > high[0] {
            return Self { centre: Vector3::zeros(), half_extent: 1.0, diagonal: 0.0, largest: 0.0 };
        }
        // Halved before they are added or subtracted: neither overflows.
        let centre = Vector3::from_fn(|k, _| 0.5 * low[k] + 0.5 * high[k]);
        let half = Vector3::from_fn(|k, _| 0.5 * high[k] - 0.5 * low[k]);
        let half_extent = if half.max() > 0.0 { half.max() } else { 1.0 };
        let largest = (0..3).map(|k| low[k].abs().max(high[k].abs())).fold(0.0, f64::max);
        Self { centre, half_extent, diagonal: 2.0 * (half / half_extent).norm(), largest: largest / half_extent }
    }

    /// A point of the input in the frame.
    pub(super) fn place(&self, p: &[f64; 3]) -> Point3<f64> {
        // Divided, not multiplied by an inverse, which overflows for the tiniest extents.
        Point3::from((Vector3::from(*p) - self.centre) / self.half_extent)
    }
}
