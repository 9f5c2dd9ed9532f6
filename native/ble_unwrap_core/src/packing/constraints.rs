//! What a placement keeps to besides the settings of packing.

use nalgebra::Point2;

use super::{PackError, PackSettings};

/// What a placement keeps to besides [`PackSettings`]. The default adds nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Constraints<'a> {
    /// Least distance of charts to the border of the texture, in texels; `None` for half the margin.
    pub border_texels: Option<f64>,
    /// The scale of all charts, in texels to a unit of the chart plane; `None` for the greatest that is found. With a given scale, specks
    /// are not enlarged.
    pub scale: Option<f64>,
    /// Triangles in texels from the corner of the texture, from which every chart keeps the margin. They may overlap, be turned over, have
    /// no area, and lie beyond the texture, but no further than [`Constraints::FARTHEST`] texels from its corner.
    pub obstacles: &'a [[Point2<f64>; 3]],
}

impl Constraints<'_> {
    /// Coordinates of obstacles have at most this size, in texels: where a triangle is clipped, rounding then moves its border by less than
    /// 1e-6 texels, a small part of what charts and obstacles are grown by.
    pub(crate) const FARTHEST: f64 = 1e9;

    /// Least distance of charts to the border of the texture, in texels.
    pub(super) fn border(&self, settings: &PackSettings) -> f64 {
        self.border_texels.unwrap_or(0.5 * settings.margin_texels)
    }

    pub(super) fn check(&self, settings: &PackSettings) -> Result<(), PackError> {
        let border = self.border(settings);
        if !(border >= 0.0 && border.is_finite()) {
            return Err(PackError::Border { border });
        }
        let PackSettings { width, height, margin_texels: margin, .. } = *settings;
        // A margin as long as the texture leaves room for one chart at most, whatever the border.
        if margin >= f64::from(width).hypot(f64::from(height)) {
            return Err(PackError::MarginTooLarge { margin, width, height });
        }
        if f64::from(width.min(height)) - 2.0 * border >= 1.0 {
            return Ok(());
        }
        Err(match self.border_texels {
            Some(border) => PackError::BorderTooLarge { border, width, height },
            None => PackError::MarginTooLarge { margin, width, height },
        })
    }
}
