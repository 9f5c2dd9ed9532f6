//! The search grid and where it lies on the texture.

use nalgebra::{Point2, Vector2};

use super::occupancy::Occupancy;
use super::{PackSettings, Pose};

/// Cells across the square each chart would have if all were equal: the raster then wastes about 2 %
/// of the texture. Finer grids gain half of that for twice the time.
const CELLS_ACROSS: f64 = 70.0;
/// Least and most of them across the texture.
const LEAST_ACROSS: f64 = 1024.0;
const MOST_ACROSS: f64 = 2048.0;
/// Texels a cell at the finest.
const FINEST: f64 = 0.25;

/// Square cells over the texture, a given distance from its border; the rows run along its shorter
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
    /// Cells fine enough for `charts` charts, `border` texels from the border of the texture, where at least a texel is to be left between
    /// the borders. Where there is a margin, a whole number of cells make it unless that takes too many cells.
    pub(super) fn new(settings: &PackSettings, border: f64, charts: usize) -> Self {
        let (width, height) = (f64::from(settings.width), f64::from(settings.height));
        let (shorter, longer) = (width.min(height), width.max(height));
        let margin = settings.margin_texels;
        let across = (CELLS_ACROSS * (charts as f64).sqrt()).clamp(LEAST_ACROSS, MOST_ACROSS);
        let mut cell = (longer / across).max(FINEST);
        if margin >= cell {
            cell = margin / (margin / cell - 1e-9).ceil();
        } else {
            cell = margin.max(0.5 * cell);
        }
        cell = cell.max(shorter / Occupancy::WIDEST as f64).min(shorter - 2.0 * border);
        Self::of([shorter, longer], border, cell, width > height, height)
    }

    /// About `across` cells along the longer side of the texture. Charts are to be grown by half the margin: at a border of half the margin
    /// they then may touch the border of the texture; where it is to be wider, the grid is smaller by the rest, else larger.
    pub(super) fn coarse(settings: &PackSettings, border: f64, across: f64) -> Self {
        let (width, height) = (f64::from(settings.width), f64::from(settings.height));
        let (shorter, longer) = (width.min(height), width.max(height));
        let rest = border - 0.5 * settings.margin_texels;
        let cell = (longer / across).max((shorter - 2.0 * rest) / Occupancy::WIDEST as f64).min(shorter - 2.0 * rest);
        Self::of([shorter, longer], rest, cell, width > height, height)
    }

    /// As many cells as there is room for between the borders of a texture whose sides are `shorter` and `longer`.
    fn of([shorter, longer]: [f64; 2], border: f64, cell: f64, sideways: bool, height: f64) -> Self {
        let inner = [shorter - 2.0 * border, longer - 2.0 * border];
        let [columns, rows] = inner.map(|size| ((size / cell + 1e-9).floor() as usize).max(1));
        Self { cell, columns, rows, sideways, border, inner, height }
    }

    /// Width and height in texels between the borders, in the grid's frame.
    pub(super) fn inner(self) -> [f64; 2] {
        self.inner
    }

    /// A point in texels of the texture as one in cells of the grid.
    pub(super) fn cells_of(self, p: Point2<f64>) -> Point2<f64> {
        let p = if self.sideways { Point2::new(self.height - p.y, p.x) } else { p };
        p.map(|x| (x - self.border) / self.cell)
    }

    /// A pose in cells of the grid as a pose in texels of the texture.
    pub(super) fn to_texture(self, pose: Pose) -> Pose {
        self.frame_to_texture(Pose { scale: pose.scale * self.cell, offset: pose.offset * self.cell, ..pose })
    }

    /// The turn of a pose in texels of the texture and where its centre goes, both in the grid's frame; the latter in texels from the texture's corner.
    pub(super) fn texture_to_frame(self, pose: Pose) -> ([f64; 2], [f64; 2]) {
        if self.sideways {
            ([-pose.sin, pose.cos], [self.height - pose.offset.y, pose.offset.x])
        } else {
            ([pose.cos, pose.sin], pose.offset.into())
        }
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
        let settings = PackSettings { width, height, margin_texels, ..PackSettings::default() };
        Grid::new(&settings, 0.5 * margin_texels, charts)
    }

    #[test]
    fn poses_come_back_from_the_texture_as_they_went() {
        for (width, height) in [(640, 480), (480, 640)] {
            let g = grid(width, height, 4.0, 10);
            let offset = Vector2::new(7.0, 30.0);
            let pose = Pose { cos: 0.8, sin: 0.6, centre: Point2::origin(), scale: 3.0, offset };
            let (turn, centre) = g.texture_to_frame(g.frame_to_texture(pose));
            assert_eq!((turn, centre), ([0.8, 0.6], [7.0 + g.border, 30.0 + g.border]));
        }
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

    #[test]
    fn points_go_to_the_grid_and_back() {
        for (width, height) in [(640, 480), (480, 640)] {
            let grid = grid(width, height, 3.0, 10);
            let p = Point2::new(100.0, 7.0);
            let cells = grid.cells_of(p);
            let pose = Pose { cos: 1.0, sin: 0.0, centre: Point2::origin(), scale: 1.0, offset: cells.coords };
            let back = grid.to_texture(pose).offset;
            assert!((back - p.coords).norm() < 1e-9, "{back:?}");
        }
    }

    #[test]
    fn another_border_leaves_as_much_room_on_every_grid() {
        let settings = PackSettings { width: 1000, height: 600, margin_texels: 8.0, ..PackSettings::default() };
        for border in [0.0, 4.0, 50.0] {
            let room = [600.0 - 2.0 * border, 1000.0 - 2.0 * border];
            let fine = Grid::new(&settings, border, 9);
            assert_eq!(fine.inner(), room);
            // Charts grown by half a margin are half a margin from the border of the coarse grid.
            let coarse = Grid::coarse(&settings, border, 128.0).inner();
            assert_eq!(coarse, room.map(|side| side + 8.0));
        }
    }
}
