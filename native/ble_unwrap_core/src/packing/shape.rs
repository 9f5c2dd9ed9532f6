//! A chart at one density: its footprints on the grid in every pose to try.

use nalgebra::Vector2;

use super::Pose;
use super::cover::{Square, cover};
use super::mask::Mask;
use super::outline::Outline;
use super::raster::rasterise;

/// Distance in texels by which charts are grown before they are rasterised, in the maximum norm.
/// Half of what a pair of charts has over the margin; rounding a coordinate of a texture of
/// [`PackSettings::LARGEST_SIZE`](super::PackSettings::LARGEST_SIZE) texels to f32 moves it by
/// 1/1024 texel at most.
pub(super) const SAFETY_TEXELS: f64 = 1.0 / 128.0;

/// Extent to which smaller charts are grown, in texels: with the safety on both sides one texel.
const SPECK_TEXELS: f64 = 1.0 - 4.0 * SAFETY_TEXELS;

/// Footprints of up to this many cells in either direction are filled to their box: they then are
/// all alike, and a chart like one placed before is found a place where that search ended.
const BOX_CELLS: usize = 6;

/// How large a chart is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Cells to an outline unit.
    pub(super) cells: f64,
    /// Whether the chart was scaled up to a texel.
    pub(super) is_speck: bool,
}

impl Scale {
    /// At `density` texels to a unit of the chart plane, on cells of `cell` texels.
    pub(super) fn new(outline: &Outline, density: f64, cell: f64) -> Self {
        Self::of(outline.extent, outline.keeps_size, density, cell)
    }

    /// The same for an outline of an extent in units of the chart plane.
    pub(super) fn of(extent: f64, keeps_size: bool, density: f64, cell: f64) -> Self {
        let texels = density * extent;
        let is_speck = extent > 0.0 && texels < SPECK_TEXELS && !keeps_size;
        // A chart without extent is a point at any scale.
        let drawn = match extent {
            0.0 => density,
            _ if is_speck => SPECK_TEXELS,
            _ => texels,
        };
        Self { cells: drawn / cell, is_speck }
    }
}

/// A footprint: the cells of a chart in one pose.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    pub(super) mask: Mask,
    pub(super) squares: Vec<Square>,
    /// Number of its cells.
    pub(super) cells: usize,
    /// Mean row of its cells.
    pub(super) centre_y: f64,
    /// The same for equal masks, and hardly ever for others.
    pub(super) key: u64,
    /// Chart plane to cells of the mask.
    to_cells: Pose,
}

/// A chart at one density.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    /// Poses to try, in order of preference.
    pub(super) footprints: Vec<Footprint>,
    /// Cells covered.
    pub(super) cells: usize,
    /// Whether the chart was scaled up to a texel.
    pub(super) is_speck: bool,
}

impl Shape {
    /// Footprints at `density` texels to a unit of the chart plane, on cells of `cell` texels.
    /// The charts are grown by `growth` cells before they are rasterised.
    pub(super) fn new(
        outline: &Outline,
        turns: &[[f64; 2]],
        quarters: bool,
        density: f64,
        cell: f64,
        growth: f64,
    ) -> Self {
        let Scale { cells: scale, is_speck } = Scale::new(outline, density, cell);
        let mut footprints: Vec<Footprint> = Vec::new();
        // Without triangles there is nothing to place.
        for &turn in turns.iter().filter(|_| !outline.edges.is_empty()) {
            let raster = rasterise(outline, turn, scale, growth);
            let mut mask = raster.mask;
            let tiny = mask.width().max(mask.height()) <= BOX_CELLS;
            if tiny {
                mask = Mask::full(mask.width(), mask.height());
            }
            let mut squares = cover(&mask);
            let mut to_cells = Pose {
                cos: turn[0],
                sin: turn[1],
                centre: outline.centre,
                scale: scale / outline.unit(),
                offset: Vector2::from(raster.shift),
            };
            for quarter in 0..4 {
                if quarter > 0 {
                    squares = squares.iter().map(|q| q.quarter_turn(mask.height())).collect();
                    to_cells = to_cells.quarter_turn(mask.height() as f64);
                    mask = mask.quarter_turn();
                }
                let footprint = Footprint::new(mask.clone(), squares.clone(), to_cells);
                if !footprints.iter().any(|f| f.key == footprint.key && f.mask == footprint.mask) {
                    footprints.push(footprint);
                }
                if tiny || !quarters {
                    break;
                }
            }
            if tiny {
                break;
            }
        }
        let cells = footprints.first().map_or(0, |f| f.cells);
        Self { footprints, cells, is_speck }
    }
}

impl Footprint {
    fn new(mask: Mask, squares: Vec<Square>, to_cells: Pose) -> Self {
        let (mut moment, mut cells) = (0.0, 0);
        for y in 0..mask.height() {
            let count: usize = mask.row(y).iter().map(|w| w.count_ones() as usize).sum();
            moment += (y as f64 + 0.5) * count as f64;
            cells += count;
        }
        let key = mask.key();
        Self { mask, squares, cells, key, centre_y: moment / cells.max(1) as f64, to_cells }
    }

    /// Chart plane to cells of the grid, with the mask's corner at cell (x, y).
    pub(super) fn pose(&self, x: usize, y: usize) -> Pose {
        Pose { offset: self.to_cells.offset + Vector2::new(x as f64, y as f64), ..self.to_cells }
    }
}

impl Pose {
    /// Followed by a quarter turn of a frame of the given height, whose corner stays at the origin.
    fn quarter_turn(self, height: f64) -> Self {
        let offset = Vector2::new(height - self.offset.y, self.offset.x);
        Self { cos: -self.sin, sin: self.cos, offset, ..self }
    }
}
