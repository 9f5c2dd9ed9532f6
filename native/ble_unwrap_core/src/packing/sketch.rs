//! A placement on a coarse grid: where charts go, to about a cell.

use super::Pose;
use super::grid::Grid;
use super::place::Layout;
use super::shape::Shape;

/// By how many cells less than the whole margin's half charts are grown on the coarse grid. Every cell
/// a chart touches would be up to a cell too much at each of its sides, none would be too little: with
/// more than this the fine placement has to be less dense than the sketch, with less the sketch is
/// loose (measured from 2 to 300 charts: 0 to 0.1 is best).
const SHRUNK: f64 = 0.05;
/// Sketches that use the height of the grid to these shares are worth refining.
const WORTHY: std::ops::RangeInclusive<f64> = 0.9..=1.05;
/// Centres nearer than so many cells are the same.
const SAME: f64 = 2.0;

/// Where a chart is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// Cosine and sine of its angle.
    pub(super) turn: [f64; 2],
    /// Texels from the corner of the texture (in the grid's frame) to its centre.
    pub(super) centre: [f64; 2],
}

/// Where all charts are to go.
#[derive(Clone, Debug)]
pub(super) struct Sketch {
    /// By chart; `None` for charts without triangles.
    pub(super) spots: Vec<Option<Spot>>,
    /// The density at which it should fill the texture, in texels to a unit of the chart plane.
    pub(super) density: f64,
    /// Texels a cell of the grid it was made on.
    pub(super) cell: f64,
}

/// Cells by which charts are grown on a coarse grid, in the maximum norm.
pub(super) fn growth(margin_texels: f64, grid: Grid) -> f64 {
    0.5 * margin_texels / grid.cell - SHRUNK
}

impl Sketch {
    /// The sketch an attempt at `density` made, if it placed all charts and used about the height of the grid.
    pub(super) fn of(layout: &Layout, shapes: &[Shape], grid: Grid, density: f64) -> Option<Self> {
        let used = layout.rows as f64 / grid.rows as f64;
        if layout.missing > 0 || !WORTHY.contains(&used) {
            return None;
        }
        let mut sketch = Self::drawn(layout, shapes, grid, density / used.sqrt());
        // What overshoots moves down with what it shrinks by.
        sketch.spots.iter_mut().flatten().for_each(|spot| spot.centre[1] /= used.max(1.0));
        Some(sketch)
    }

    /// The sketch an attempt at `density` made, where it placed all charts below the top of the grid. Between obstacles how much of the
    /// height it used says nothing, and where the density is all that is needed, it does not matter.
    pub(super) fn at_its_density(layout: &Layout, shapes: &[Shape], grid: Grid, density: f64) -> Self {
        Self::drawn(layout, shapes, grid, density)
    }

    fn drawn(layout: &Layout, shapes: &[Shape], grid: Grid, density: f64) -> Self {
        let spot = |pose: Pose| {
            let centre = [0, 1].map(|k| pose.offset[k] * grid.cell + grid.border);
            Spot { turn: [pose.cos, pose.sin], centre }
        };
        let spots = shapes
            .iter()
            .zip(&layout.placed)
            .map(|(shape, at)| at.map(|at| spot(shape.footprints[at.footprint].pose(at.x, at.y))))
            .collect();
        Self { spots, density, cell: grid.cell }
    }

    /// Whether all charts are turned the same and within two cells of where `other` has them.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let near =
            |a: Spot, b: Spot| a.turn == b.turn && (0..2).all(|k| (a.centre[k] - b.centre[k]).abs() < SAME * self.cell);
        self.spots.iter().zip(&other.spots).all(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => near(*a, *b),
            (a, b) => a.is_none() == b.is_none(),
        })
    }
}

/// The sketches that promise most, densest first (ties: earlier first), no two alike.
pub(super) fn most_promising(mut sketches: Vec<Sketch>, count: usize) -> Vec<Sketch> {
    sketches.sort_by(|a, b| b.density.total_cmp(&a.density));
    let mut kept: Vec<Sketch> = Vec::new();
    for sketch in sketches {
        if kept.len() >= count {
            break;
        }
        if !kept.iter().any(|k| k.is_like(&sketch)) {
            kept.push(sketch);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sketch(density: f64, x: f64) -> Sketch {
        let spot = Spot { turn: [1.0, 0.0], centre: [x, 0.0] };
        Sketch { spots: vec![Some(spot), None], density, cell: 1.0 }
    }

    #[test]
    fn the_densest_of_each_kind_are_kept() {
        let all = vec![sketch(1.0, 0.0), sketch(3.0, 10.0), sketch(2.0, 0.5), sketch(2.5, 11.0), sketch(0.5, 20.0)];
        let kept: Vec<f64> = most_promising(all.clone(), 2).iter().map(|s| s.density).collect();
        assert_eq!(kept, vec![3.0, 2.0]);
        let kept: Vec<f64> = most_promising(all, 9).iter().map(|s| s.density).collect();
        assert_eq!(kept, vec![3.0, 2.0, 0.5]);
    }

    #[test]
    fn another_turn_is_another_sketch() {
        let (a, mut b) = (sketch(1.0, 0.0), sketch(1.0, 0.0));
        assert!(a.is_like(&b));
        b.spots[0] = Some(Spot { turn: [0.0, 1.0], centre: [0.0, 0.0] });
        assert!(!a.is_like(&b));
        b.spots[0] = None;
        assert!(!a.is_like(&b));
    }
}
