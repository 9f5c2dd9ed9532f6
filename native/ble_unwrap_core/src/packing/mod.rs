//! WIP
mod cover;
mod density;
mod mask;
mod occupancy;
mod outline;
mod place;
mod pose;
mod raster;
mod shape;

use nalgebra::{Point2, Vector2};
use thiserror::Error;

use crate::{Cancelled, Progress};

/// Which rotations a chart may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// Any angle.
    Any,
    /// Quarter turns from the given pose.
    Quarter,
    /// The given pose only.
    None,
}

/// How much time to spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Fast.
    Fast,
    /// Best.
    High,
}

/// Settings.
#[derive(Clone, Debug, PartialEq)]
pub struct PackSettings {
    /// Least distance of charts.
    pub margin_texels: f64,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
    /// Rotation.
    pub rotation: Rotation,
    /// Effort.
    pub quality: Quality,
}

impl PackSettings {
    /// Largest
    pub const LARGEST_SIZE: u32 = 32_768;

    /// Paper.
    #[must_use]
    pub fn paper() -> Self {
        Self { margin_texels: 2.0, width: 1024, height: 1024, rotation: Rotation::Quarter, ..Self::default() }
    }
}

impl Default for PackSettings {
    fn default() -> Self {
        Self { margin_texels: 4.0, width: 2048, height: 2048, rotation: Rotation::Any, quality: Quality::Fast }
    }
}

/// A chart.
#[derive(Clone, Copy, Debug)]
pub struct PackItem<'a> {
    /// Points.
    pub points: &'a [Point2<f64>],
    /// Triangles.
    pub triangles: &'a [[u32; 3]],
}

/// Where a chart goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Cosine.
    pub cos: f64,
    /// Sine.
    pub sin: f64,
    /// Point turned about.
    pub centre: Point2<f64>,
    /// Texels per unit.
    pub scale: f64,
    /// Texel position of centre.
    pub offset: Vector2<f64>,
}

impl Pose {
    /// Texel.
    #[must_use]
    pub fn texel(&self, p: Point2<f64>) -> Point2<f64> {
        let d = (p - self.centre) * self.scale;
        Point2::new(self.cos * d.x - self.sin * d.y, self.sin * d.x + self.cos * d.y) + self.offset
    }
}

/// Result.
#[derive(Clone, Debug)]
pub struct Packed {
    /// Poses.
    pub poses: Vec<Pose>,
    /// Covered.
    pub efficiency: f64,
    /// Density.
    pub texels_per_unit: f64,
    /// Specks.
    pub specks: usize,
    /// Texture size.
    pub size: [u32; 2],
}

/// Error.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PackError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// x.
    #[error("triangle {triangle} of chart {item}")]
    NotFinite {
        /// item
        item: usize,
        /// tri
        triangle: usize,
    },
    /// x.
    #[error("triangle {triangle} of chart {item} names a corner beyond its {points} points")]
    CornerOutOfRange {
        /// item
        item: usize,
        /// tri
        triangle: usize,
        /// points
        points: usize,
    },
    /// x.
    #[error("full")]
    Full,
}

/// Packs.
///
/// # Errors
/// See [`PackError`].
pub fn pack(items: &[PackItem<'_>], settings: &PackSettings, progress: &Progress) -> Result<Packed, PackError> {
    density::pack(items, settings, progress)
}
