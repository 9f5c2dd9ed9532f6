//! What is in the way before any chart is placed.

use std::borrow::Cow;

use nalgebra::{Point2, Vector2};

use super::PackSettings;
use super::grid::Grid;
use super::mask::{Mask, Reach};
use super::tile::Tile;
use crate::progress::{Cancelled, Progress};

/// Triangles between two looks at whether to stop: a few milliseconds of work.
const BETWEEN_CHECKS: usize = 4096;
/// Cells along the longer side of the raster that tells how much of the texture obstacles touch.
const RASTER: f64 = 1024.0;

/// The cells of a grid that obstacles take, with the reach of charts around them.
#[derive(Clone, Debug)]
pub(super) struct Obstacles {
    /// The taken cells, with a frame around the grid, for obstacles at the border and beyond it keep charts away, too.
    pub(super) mask: Mask,
    /// Width of that frame, in cells.
    pub(super) frame: usize,
    /// Number of cells that are not taken in the rows below each row of the grid, and in all rows.
    free_below: Vec<usize>,
    columns: usize,
}

impl Obstacles {
    /// Obstacles on a grid: every cell that comes nearer than `reach` to a cell which a triangle, grown by `growth` cells in the maximum norm,
    /// touches. `None` where there are no triangles, which are in texels. Negative growth counts as none.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(
        triangles: &[[Point2<f64>; 3]],
        grid: Grid,
        growth: f64,
        reach: &Reach,
        progress: &Progress,
    ) -> Result<Option<Self>, Cancelled> {
        if triangles.is_empty() {
            return Ok(None);
        }
        let growth = growth.max(0.0);
        // What is further from the grid than this reaches no cell of it.
        let ring = reach.cells() + growth.ceil() as usize + 1;
        let (width, height) = (grid.columns + 2 * ring, grid.rows + 2 * ring);
        let mut touched = Mask::new(width, height);
        let in_frame = |p: Point2<f64>| grid.cells_of(p) + Vector2::repeat(ring as f64);
        for (number, triangle) in triangles.iter().enumerate() {
            if number.is_multiple_of(BETWEEN_CHECKS) {
                progress.check()?;
            }
            cover(&mut touched, triangle.map(in_frame), growth);
        }
        let mask = touched.dilated(reach);
        let frame = ring + reach.cells();
        let mut free_below = Vec::with_capacity(grid.rows + 1);
        let mut free = 0;
        for y in 0..grid.rows {
            free_below.push(free);
            free += grid.columns - mask.count_run(y + frame, frame, frame + grid.columns - 1) as usize;
        }
        free_below.push(free);
        Ok(Some(Self { mask, frame, free_below, columns: grid.columns }))
    }

    /// Number of cells of the grid that are not taken.
    pub(super) fn free(&self) -> usize {
        self.free_below.last().copied().unwrap_or(0)
    }

    /// Share of the free cells of the grid that lie in the lowest `rows` rows. Above the grid all are free, so that it may be more than 1.
    pub(super) fn share(&self, rows: usize) -> f64 {
        let top = self.free_below.len() - 1;
        let cells = self.free_below[rows.min(top)] + self.columns * rows.saturating_sub(top);
        cells as f64 / self.free().max(1) as f64
    }
}

/// The triangles that matter in a tile, in texels from its corner; `triangles` are in texels from the origin of UV. They matter if their box comes
/// within a margin of the tile, and a texel for all that they are grown by. Where there is only one tile, it gets all.
pub(super) fn in_tile<'a>(
    triangles: &'a [[Point2<f64>; 3]],
    tile: Tile,
    settings: &PackSettings,
) -> Cow<'a, [[Point2<f64>; 3]]> {
    if settings.tiles == 1 {
        return Cow::Borrowed(triangles);
    }
    let size = [f64::from(settings.width), f64::from(settings.height)];
    let corner = [0, 1].map(|k| tile.corner()[k] * size[k]);
    let near = settings.margin_texels + 1.0;
    let matters = |t: &&[Point2<f64>; 3]| {
        (0..2)
            .all(|k| t.iter().any(|p| p[k] >= corner[k] - near) && t.iter().any(|p| p[k] <= corner[k] + size[k] + near))
    };
    triangles.iter().filter(matters).map(|t| t.map(|p| p - Vector2::from(corner))).collect()
}

/// Area of a texture of the given size that triangles in texels cover: the sum of their areas within it, but no more than the area of the
/// cells they touch there.
///
/// # Errors
/// [`Cancelled`].
pub(super) fn covered(
    triangles: &[[Point2<f64>; 3]],
    [width, height]: [f64; 2],
    progress: &Progress,
) -> Result<f64, Cancelled> {
    let cell = width.max(height) / RASTER;
    let mut touched = Mask::new((width / cell).ceil() as usize, (height / cell).ceil() as usize);
    let mut area = 0.0;
    for (number, triangle) in triangles.iter().enumerate() {
        if number.is_multiple_of(BETWEEN_CHECKS) {
            progress.check()?;
        }
        let part = clipped(*triangle, [0.0; 2], [width, height]);
        let doubled: f64 =
            (1..part.len().saturating_sub(1)).map(|k| (part[k] - part[0]).perp(&(part[k + 1] - part[0]))).sum();
        area += 0.5 * doubled.abs();
        cover(&mut touched, triangle.map(|p| p / cell), 0.0);
    }
    // The cells at the far borders reach beyond the texture.
    Ok(area.min(touched.count() as f64 * cell * cell).min(width * height))
}

/// Sets the cells of a mask that a triangle touches, grown by `growth` cells in the maximum norm, as far as they lie in the mask.
fn cover(mask: &mut Mask, triangle: [Point2<f64>; 3], growth: f64) {
    let size = [mask.width(), mask.height()].map(|n| n as f64);
    let part = clipped(triangle, [-growth; 2], size.map(|n| n + growth));
    let Some(first) = part.first() else { return };
    let (low, high) = part.iter().fold((first.y, first.y), |(low, high), p| (low.min(p.y), high.max(p.y)));
    let cell = |v: f64, n: usize| (v.floor().max(0.0) as usize).min(n - 1);
    for row in cell(low - growth, mask.height())..=cell(high + growth, mask.height()) {
        // The part that lies within the row grown by `growth` is convex, so the cells it touches are consecutive.
        let (bottom, top) = (row as f64 - growth, row as f64 + 1.0 + growth);
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for (k, &p) in part.iter().enumerate() {
            let q = part[(k + 1) % part.len()];
            let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
            if q.y < bottom || p.y > top {
                continue;
            }
            let along = |y: f64| {
                if y <= p.y {
                    p.x
                } else if y >= q.y {
                    q.x
                } else {
                    (p.x + (y - p.y) * ((q.x - p.x) / (q.y - p.y))).clamp(p.x.min(q.x), p.x.max(q.x))
                }
            };
            // A level side is touched from end to end.
            let ends = if p.y == q.y { [p.x, q.x] } else { [along(bottom), along(top)] };
            left = left.min(ends[0].min(ends[1]));
            right = right.max(ends[0].max(ends[1]));
        }
        if left <= right {
            mask.set_run(row, cell(left - growth, mask.width()), cell(right + growth, mask.width()));
        }
    }
}

/// The part of a triangle within a rectangle, as the corners of a convex polygon; empty where there is none. Sutherland and Hodgman:
/// Reentrant polygon clipping, CACM 17(1), 1974.
fn clipped(triangle: [Point2<f64>; 3], low: [f64; 2], high: [f64; 2]) -> Vec<Point2<f64>> {
    let mut part: Vec<Point2<f64>> = triangle.to_vec();
    for axis in 0..2 {
        for (bound, sign) in [(low[axis], 1.0), (high[axis], -1.0)] {
            if part.iter().all(|p| sign * (p[axis] - bound) >= 0.0) {
                continue;
            }
            let before = std::mem::take(&mut part);
            for (k, &p) in before.iter().enumerate() {
                let q = before[(k + 1) % before.len()];
                let (a, b) = (sign * (p[axis] - bound), sign * (q[axis] - bound));
                if a >= 0.0 {
                    part.push(p);
                }
                if (a < 0.0) != (b < 0.0) {
                    let mut crossing = p + (q - p) * (a / (a - b));
                    crossing[axis] = bound;
                    part.push(crossing);
                }
            }
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::super::raster::tests::touches;
    use super::*;
    use crate::packing::PackSettings;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn cells_near_a_triangle_are_taken_wherever_it_lies(
            corners in prop::array::uniform3((-60.0f64..160.0, -60.0f64..120.0)),
            size in prop_oneof![Just((100, 60)), Just((60, 100)), Just((40, 40))],
            margin in prop_oneof![Just(0.0), 0.0..9.0], growth in prop_oneof![Just(0.0), 0.01..3.0],
        ) {
            let triangle = corners.map(|(x, y)| Point2::new(x, y));
            let settings = PackSettings { width: size.0, height: size.1, margin_texels: margin, ..PackSettings::default() };
            let grid = Grid::coarse(&settings, 0.5 * margin, 40.0);
            let reach = Reach::new(margin / grid.cell);
            let taken = Obstacles::new(&[triangle], grid, growth, &reach, &Progress::new()).expect("not cancelled").expect("one");
            let cells = triangle.map(|p| grid.cells_of(p));
            let near = |e: f64| {
                let mut cells_near = Vec::new();
                for y in -20..grid.rows as isize + 20 {
                    for x in -20..grid.columns as isize + 20 {
                        if touches(&cells, x as f64, y as f64, e) {
                            cells_near.push((x, y));
                        }
                    }
                }
                cells_near
            };
            let is_taken = |touched: &[(isize, isize)], x: usize, y: usize| touched.iter().any(|&(a, b)| {
                let gap = |p: isize, q: usize| (p.abs_diff(q as isize).saturating_sub(1)) as f64;
                (a, b) == (x as isize, y as isize) || gap(a, x).hypot(gap(b, y)) < margin / grid.cell - 1e-9
            });
            let (inner, outer) = (near(growth - 1e-6), near(growth + 1e-6));
            let mut free = 0;
            for y in 0..grid.rows {
                for x in 0..grid.columns {
                    let found = taken.mask.get(x + taken.frame, y + taken.frame);
                    prop_assert!(found || !is_taken(&inner, x, y), "cell {x} {y} is near and free");
                    prop_assert!(!found || is_taken(&outer, x, y), "cell {x} {y} is taken for nothing");
                    free += usize::from(!found);
                }
            }
            prop_assert_eq!(taken.free(), free);
            prop_assert!(free == 0 || (taken.share(grid.rows) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn only_what_lies_in_the_texture_is_covered() {
        let triangle = [[-10.0, -10.0], [30.0, -10.0], [-10.0, 30.0]].map(|[x, y]| Point2::new(x, y));
        let area =
            |triangles: &[[Point2<f64>; 3]]| covered(triangles, [40.0, 20.0], &Progress::new()).expect("not cancelled");
        // A right triangle with legs of 20 is left.
        assert!((area(&[triangle]) - 200.0).abs() < 1e-9);
        assert!(area(&[triangle; 3]) < 205.0, "counted once");
        assert_eq!(area(&[triangle.map(|p| p + Vector2::new(100.0, 0.0))]), 0.0);
    }

    #[test]
    fn far_corners_do_not_blur_what_is_near() {
        let far = crate::packing::Constraints::FARTHEST;
        let triangle = [[0.0, 10.25], [far, 10.25], [far, far]].map(|[x, y]| Point2::new(x, y));
        let settings = PackSettings { width: 64, height: 64, margin_texels: 0.0, ..PackSettings::default() };
        let grid = Grid::coarse(&settings, 0.0, 64.0);
        let taken = Obstacles::new(&[triangle], grid, 0.01, &Reach::new(0.0), &Progress::new())
            .expect("not cancelled")
            .expect("one");
        let row = |y: usize| (0..64).filter(|&x| taken.mask.get(x + taken.frame, y + taken.frame)).count();
        assert_eq!([row(9), row(10)], [0, 64]);
    }
}
