//! A single chart: no search, the largest scale at which it fits.

use nalgebra::Vector2;

use super::grid::Grid;
use super::outline::Outline;
use super::placement::{Dense, Place};
use super::pose::{aligned_turn, symmetric_turn, turn_alone};
use super::raster::rasterise;
use super::shape::{SAFETY_TEXELS, Scale};
use super::{PackSettings, Pose, Rotation};

/// Cells along the longer side of the raster that tells how much of the texture the chart touches.
const RASTER: f64 = 512.0;
/// A symmetric chart is laid upright or level if it can be at least so many times as large as at the best angle.
const UPRIGHT: f64 = 0.9;

/// The chart `which` of `outlines`, the only one with triangles and with an extent, as large as the
/// texture allows, but with at most `most` texels to a unit of its plane, in the middle of the texture.
pub(super) fn alone(outlines: &[Outline], which: usize, grid: Grid, most: f64, settings: &PackSettings) -> Dense {
    let outline = &outlines[which];
    let inner = grid.inner();
    let room = inner.map(|size| size - 2.0 * SAFETY_TEXELS);
    let given = if grid.sideways { [0.0, 1.0] } else { [1.0, 0.0] };
    let upright_or_lying = |[c, s]: [f64; 2]| {
        let [upright, lying] = [[c, s], [-s, c]].map(|turn| (fit(outline, turn, room).scale, turn));
        if lying.0 > upright.0 { lying.1 } else { upright.1 }
    };
    let settled = || {
        let upright = || {
            let any = turn_alone(outline, room);
            let is_worth = |turn| fit(outline, turn, room).scale >= UPRIGHT * fit(outline, any, room).scale;
            symmetric_turn(outline).map(upright_or_lying).filter(|&turn| is_worth(turn)).unwrap_or(any)
        };
        aligned_turn(outline).map_or_else(upright, upright_or_lying)
    };
    let turn = match settings.rotation {
        Rotation::Aligned => settled(),
        Rotation::Any => turn_alone(outline, room),
        Rotation::None => given,
        Rotation::Quarter => upright_or_lying([1.0, 0.0]),
    };
    let Fit { middle, scale } = fit(outline, turn, room);
    let wanted = Scale::new(outline, most, 1.0);
    let scale = scale.min(wanted.cells);
    let is_speck = wanted.is_speck && scale >= wanted.cells;
    // The middle of the chart's box to the middle of the grid.
    let offset = |k: usize| 0.5 * inner[k] - scale * middle[k];
    let pose = Pose {
        cos: turn[0],
        sin: turn[1],
        centre: outline.centre,
        scale: scale / outline.unit(),
        offset: Vector2::new(offset(0), offset(1)),
    };
    let cell = inner[0].max(inner[1]) / RASTER;
    let raster = rasterise(outline, turn, scale / cell, SAFETY_TEXELS / cell).mask;
    let place = Place { pose: grid.frame_to_texture(pose), touched: raster.count() as f64 * cell * cell, is_speck };
    let places = (0..outlines.len()).map(|i| (i == which).then_some(place)).collect();
    Dense { places, density: if is_speck { most } else { pose.scale } }
}

/// The box of a turned outline.
struct Fit {
    /// Its middle, in outline units.
    middle: [f64; 2],
    /// The scale at which it fits the room there is.
    scale: f64,
}

fn fit(outline: &Outline, [c, s]: [f64; 2], room: [f64; 2]) -> Fit {
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    for p in &outline.points {
        let at = [c * p.x - s * p.y, s * p.x + c * p.y];
        for k in 0..2 {
            (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
        }
    }
    let scale = (room[0] / (high[0] - low[0])).min(room[1] / (high[1] - low[1]));
    Fit { middle: [0, 1].map(|k| 0.5 * (low[k] + high[k])), scale }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackItem;
    use nalgebra::Point2;

    #[test]
    fn touches_the_border_and_no_more() {
        // A right triangle, far from the origin, in textures of either shape.
        let points = [[5.0, 7.0], [9.0, 7.0], [5.0, 8.0]].map(|[x, y]| Point2::new(x, y));
        let outline = Outline::new(&PackItem { points: &points, triangles: &[[0, 1, 2]] }, 0).expect("valid");
        for (width, height) in [(300, 300), (400, 90), (90, 400)] {
            for rotation in [Rotation::Aligned, Rotation::Any, Rotation::Quarter, Rotation::None] {
                let settings = PackSettings { width, height, margin_texels: 3.0, rotation, ..PackSettings::default() };
                let grid = Grid::new(&settings, 1.5, 1);
                let dense = alone(std::slice::from_ref(&outline), 0, grid, f64::INFINITY, &settings);
                let pose = dense.places[0].expect("placed").pose;
                let at = points.map(|p| pose.texel(p));
                let least = at.iter().flat_map(|p| [p.x, p.y, f64::from(width) - p.x, f64::from(height) - p.y]);
                let least = least.fold(f64::MAX, f64::min);
                assert!((1.5..1.6).contains(&least), "{least} texels from the border with {rotation:?}");
                if rotation == Rotation::None {
                    assert_eq!([pose.cos, pose.sin], [1.0, 0.0]);
                    assert!(
                        (pose.scale - (f64::from(width) - 3.0).min(4.0 * (f64::from(height) - 3.0)) / 4.0).abs() < 0.02
                    );
                }
            }
        }
    }

    #[test]
    fn a_given_scale_is_kept_in_the_middle() {
        let points = [[0.0, 0.0], [4.0, 0.0], [0.0, 1.0]].map(|[x, y]| Point2::new(x, y));
        let outline = Outline::new(&PackItem { points: &points, triangles: &[[0, 1, 2]] }, 0).expect("valid");
        let settings = PackSettings { width: 300, height: 300, margin_texels: 3.0, ..PackSettings::default() };
        let dense = alone(std::slice::from_ref(&outline), 0, Grid::new(&settings, 1.5, 1), 10.0, &settings);
        assert!((dense.density - 10.0).abs() < 1e-12);
        let pose = dense.places[0].expect("placed").pose;
        assert!((pose.offset - Vector2::repeat(150.0)).norm() < 1e-9);
    }
}
