//! What a good position is.

use super::occupancy::Occupancy;
use super::shape::Footprint;

/// What a position costs; all grow with x and with y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// Least top, then least x.
    Top,
    /// Lowest centre of gravity, then least x.
    Centre,
    /// Least mean of the two.
    Middle,
}

impl Goal {
    #[inline]
    pub(super) fn cost(self, f: &Footprint, x: usize, y: usize) -> f64 {
        let top = f.mask.height() as f64;
        let above = match self {
            Self::Top => top,
            Self::Centre => f.centre_y,
            Self::Middle => 0.5 * (top + f.centre_y),
        };
        // A row outweighs all columns.
        (y as f64 + above) * (2 * Occupancy::WIDEST) as f64 + x as f64
    }
}
