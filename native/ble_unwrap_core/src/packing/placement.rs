//! Where all charts went.

use super::Pose;

/// Where a chart went.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Chart plane to texels.
    pub(super) pose: Pose,
    /// Area of the cells it touches, in texels.
    pub(super) touched: f64,
    /// Whether it was scaled up to a texel.
    pub(super) is_speck: bool,
}

/// A placement of all charts.
#[derive(Clone, Debug)]
pub(super) struct Dense {
    /// By chart; `None` for charts without triangles.
    pub(super) places: Vec<Option<Place>>,
    /// Texels to a unit of the chart plane.
    pub(super) density: f64,
}
