//! How much of a texture some charts would cover, found out at a fraction of what it costs to pack them.

use super::alone::alone;
use super::density::{FEW_ANGLES, first_guess, turns};
use super::grid::Grid;
use super::mask::Reach;
use super::outline::Outline;
use super::search::Search;
use super::sketch::growth;
use super::{PackError, PackItem, PackSettings, Rotation};
use crate::progress::Progress;

/// Cells across the texture.
const ACROSS: f64 = 128.0;
/// Attempts on that grid; packing makes up to twice 60.
const ATTEMPTS: usize = 24;
/// Vertices of outlines are moved together on a lattice of so many cells.
const COARSENED: f64 = 0.5;

/// The share of the texture that items cover in the best of a few sketches of one tile; 0 where none was found. Within some two points of what [`pack`](super::pack) comes to
/// for up to a dozen charts, more of them and smaller ones cover less here. The result does not depend on the number of threads. O(t log t) for t triangles.
///
/// # Errors
/// As of [`pack`](super::pack).
pub(crate) fn rough_cover(
    items: &[PackItem<'_>],
    settings: &PackSettings,
    progress: &Progress,
) -> Result<f64, PackError> {
    settings.check()?;
    let mut outlines = Vec::with_capacity(items.len());
    for (number, item) in items.iter().enumerate() {
        progress.check()?;
        outlines.push(Outline::new(item, number)?);
    }
    outlines.retain(|outline| !outline.edges.is_empty() && outline.extent > 0.0);
    let border = 0.5 * settings.margin_texels;
    let texels = f64::from(settings.width) * f64::from(settings.height);
    let area: f64 = outlines.iter().map(|o| o.area * o.extent * o.extent).sum();
    let share = |density: f64| area * density * density / texels;
    match outlines.len() {
        0 => return Ok(0.0),
        1 => {
            let grid = Grid::new(settings, border, 1);
            return Ok(share(alone(&outlines, 0, grid, f64::INFINITY, settings).density));
        }
        _ => {}
    }
    let grid = Grid::coarse(settings, border, ACROSS);
    let largest = outlines.iter().map(|o| o.extent).fold(0.0, f64::max);
    let areas: Vec<f64> = outlines.iter().map(|o| o.area * (o.extent / largest).powi(2)).collect();
    let guess = first_guess(areas.iter().copied(), 1.0, settings, grid) / largest;
    let ceiling = f64::from(settings.width).hypot(f64::from(settings.height)) / largest;
    let simple: Vec<Outline> =
        outlines.iter().map(|o| o.coarsened((COARSENED * grid.cell / (guess * o.extent)).clamp(1e-6, 0.1))).collect();
    let search = Search {
        outlines: &simple,
        turns: &turns(&outlines, &areas, FEW_ANGLES, grid, settings, progress)?,
        quarters: settings.rotation != Rotation::None,
        grid,
        growth: growth(settings.margin_texels, grid),
        reach: Reach::new(0.0),
        obstacles: None,
        budget: ATTEMPTS,
        enough: f64::INFINITY,
        is_whole: false,
        progress,
    };
    let sketches = search.run(guess.min(ceiling), ceiling)?.sketches;
    Ok(share(sketches.iter().map(|sketch| sketch.density).fold(0.0, f64::max)))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use crate::packing::pack;

    /// A flat triangulated shape of `count` squares of a grid, those for which `is_there` holds.
    fn squares(size: u32, is_there: impl Fn(u32, u32) -> bool) -> (Vec<Point2<f64>>, Vec<[u32; 3]>) {
        let points =
            (0..=size).flat_map(|y| (0..=size).map(move |x| Point2::new(f64::from(x), f64::from(y)))).collect();
        let at = |x: u32, y: u32| y * (size + 1) + x;
        let cells = (0..size).flat_map(|y| (0..size).map(move |x| (x, y))).filter(|&(x, y)| is_there(x, y));
        let triangles = cells
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        (points, triangles)
    }

    #[test]
    fn it_comes_near_what_packing_comes_to() {
        let settings = PackSettings { width: 512, height: 512, margin_texels: 1.0, ..PackSettings::default() };
        let whole = squares(8, |_, _| true);
        let corner = squares(8, |x, y| x < 3 || y < 3);
        let cross = squares(9, |x, y| (3..6).contains(&x) || (3..6).contains(&y));
        for shapes in [vec![&whole], vec![&corner], vec![&cross], vec![&corner, &corner], vec![&whole, &cross, &corner]]
        {
            let items: Vec<PackItem<'_>> =
                shapes.iter().map(|(points, triangles)| PackItem { points, triangles }).collect();
            let packed = pack(&items, &settings, &Progress::new()).expect("packs").efficiency;
            let rough = rough_cover(&items, &settings, &Progress::new()).expect("packs");
            assert!((rough - packed).abs() < 0.06, "{} shapes: {rough} {packed}", shapes.len());
        }
        assert_eq!(rough_cover(&[], &settings, &Progress::new()).expect("nothing to do"), 0.0);
    }

    #[test]
    fn it_can_be_stopped() {
        let stopped = Progress::new();
        stopped.cancel();
        let (points, triangles) = squares(3, |_, _| true);
        let item = PackItem { points: &points, triangles: &triangles };
        assert!(matches!(rough_cover(&[item; 3], &PackSettings::default(), &stopped), Err(PackError::Cancelled(_))));
    }
}
