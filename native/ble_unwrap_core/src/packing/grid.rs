//! The search grid and where it lies on the texture.

use nalgebra::Vector2;

use super::occupancy::Occupancy;
use super::{PackError, PackSettings, Pose, Quality};

/// Cells across the square each chart would have if all were equal: the raster then wastes about 2 %
/// of the texture. Finer grids gain half of that for twice the time.
const CELLS_ACROSS: f64 = 70.0;
/// Texels a cell at the finest.
const FINEST: f64 = 0.25;

/// Square cells over the texture, half a margin from its border; the rows run along its shorter
/// side, because charts are piled up row by row and a tall pile wastes less at its top.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Texels a cell.
    pub(super) cell: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The grid's frame is the texture's turned by a quarter: for textures wider than tall.
    pub(super) sideways: bool,
    /// Texels from the frame of the texture to that of the grid.
    pub(super) border: f64,
    inner: [f64; 2],
    /// Height of the texture in texels.
    height: f64,
}

impl Grid {
    /// Cells fine enough for `charts` charts; where there is a margin, a whole number of cells make it
    /// unless that takes too many cells.
    ///
    /// # Errors
    /// [`PackError::MarginTooLarge`] where less than a texel is left between the borders.
    pub(super) fn new(settings: &PackSettings, charts: usize) -> Result<Self, PackError> {
        let (width, height) = (f64::from(settings.width), f64::from(settings.height));
        let (shorter, longer) = (width.min(height), width.max(height));
        let margin = settings.margin_texels;
        if shorter - margin < 1.0 {
            return Err(PackError::MarginTooLarge { margin, width: settings.width, height: settings.height });
        }
        let (least, most) = match settings.quality {
            Quality::Fast => (1024.0, 2048.0),
            Quality::High => (2048.0, Occupancy::WIDEST as f64),
        };
        let across = (CELLS_ACROSS * (charts as f64).sqrt()).clamp(least, most);
        let mut cell = (longer / across).max(FINEST);
        if margin >= cell {
            cell = margin / (margin / cell - 1e-9).ceil();
        } else {
            cell = margin.max(0.5 * cell);
        }
        cell = cell.max(shorter / Occupancy::WIDEST as f64).min(shorter - margin);
        let cells = |size: f64| (((size - margin) / cell + 1e-9).floor() as usize).max(1);
        let (columns, rows) = (cells(shorter), cells(longer));
        Ok(Self {
            cell,
            columns,
            rows,
            sideways: width > height,
            border: 0.5 * margin,
            inner: [shorter - margin, longer - margin],
            height,
        })
    }

    /// About `across` cells along the longer side of the whole texture, border and all.
    pub(super) fn coarse(settings: &PackSettings, across: f64) -> Self {
        let (width, height) = (f64::from(settings.width), f64::from(settings.height));
        let (shorter, longer) = (width.min(height), width.max(height));
        let cell = (longer / across).max(shorter / Occupancy::WIDEST as f64).min(shorter);
        let cells = |size: f64| ((size / cell + 1e-9).floor() as usize).max(1);
        let (columns, rows) = (cells(shorter), cells(longer));
        Self { cell, columns, rows, sideways: width > height, border: 0.0, inner: [shorter, longer], height }
    }

    /// Width and height in texels between the borders, in the grid's frame.
    pub(super) fn inner(self) -> [f64; 2] {
        self.inner
    }

    /// A pose in cells of the grid as a pose in texels of the texture.
    pub(super) fn to_texture(self, pose: Pose) -> Pose {
        self.frame_to_texture(Pose { scale: pose.scale * self.cell, offset: pose.offset * self.cell, ..pose })
    }

    /// A pose in texels from the grid's corner as a pose in texels of the texture.
    pub(super) fn frame_to_texture(self, pose: Pose) -> Pose {
        let offset = pose.offset + Vector2::repeat(self.border);
        if self.sideways {
            // A quarter clockwise, back into the texture.
            let offset = Vector2::new(offset.y, self.height - offset.x);
            Pose { cos: pose.sin, sin: -pose.cos, offset, ..pose }
        } else {
            Pose { offset, ..pose }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(width: u32, height: u32, margin_texels: f64, charts: usize) -> Grid {
        Grid::new(&PackSettings { width, height, margin_texels, ..PackSettings::default() }, charts).expect("room")
    }

    #[test]
    fn lies_within_the_border_and_is_not_too_wide() {
        for (w, h) in [(1, 1), (1, 32_768), (32_768, 1), (32_768, 32_768), (1024, 1024), (640, 480), (5, 7)] {
            for margin in [0.0, 0.001, 0.5, 2.0, 2.5, 64.0] {
                if f64::from(w.min(h)) - margin < 1.0 {
                    continue;
                }
                for charts in [1, 100, 10_000] {
                    let g = grid(w, h, margin, charts);
                    assert!((1..=Occupancy::WIDEST).contains(&g.columns), "{} columns for {w} by {h}", g.columns);
                    assert!(g.columns as f64 * g.cell <= f64::from(w.min(h)) - margin + 1e-6);
                    assert!(g.rows as f64 * g.cell <= f64::from(w.max(h)) - margin + 1e-6);
                    assert!(g.rows <= 32_768 * 4);
                }
            }
        }
    }

    #[test]
    fn a_margin_is_a_whole_number_of_cells() {
        for (size, margin) in [(1024, 2.0), (2048, 4.0), (1024, 2.5), (4096, 8.0)] {
            for charts in [10, 300, 5000] {
                let cells = margin / grid(size, size, margin, charts).cell;
                assert!((cells - cells.round()).abs() < 1e-9, "{cells} cells make {margin} of {size}");
            }
        }
    }
}
