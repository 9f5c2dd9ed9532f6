//! The whole of packing: a first guess, sketches on a coarse grid, the best of them on the fine one.

use rayon::prelude::*;

use super::alone::alone;
use super::grid::Grid;
use super::mask::Reach;
use super::outline::Outline;
use super::placement::{Dense, Place};
use super::pose::base_turns;
use super::refine::Refinement;
use super::search::{Best, Search};
use super::shape::SAFETY_TEXELS;
use super::sketch::{growth, most_promising};
use super::{PackError, PackSettings, Quality, Rotation};
use crate::progress::{Cancelled, Progress};

/// So many of the largest charts are tried in more angles than one: about so many in all, at least and at
/// most so many a chart. Quarter turns of each come for free.
const LARGE: usize = 24;
const ANGLES: usize = 24;
const LEAST_ANGLES: usize = 3;
const MOST_ANGLES: usize = 8;
/// Share of the texture charts cover in the first guess, with half a margin around each.
const FIRST_FILL: f64 = 0.8;
/// A search climbs from where it begins, and may end on a hill: each is made from so many densities, relative to the first
/// guess. Of thirteen atlases the second one improved eight, by up to a fifth, and harmed one; packing of the meshes of
/// `make quality` rises from 0.558 to 0.560 with it, in the same time.
const BEGINNINGS: [f64; 2] = [1.0, 0.9];
/// Vertices of outlines are moved together on a lattice of so many cells of the coarse grid.
const COARSENED: f64 = 0.3;
/// Attempts of the search on the fine grid, where no sketch could be refined.
const LAST_RESORT: usize = 10;

/// One search on a coarse grid, and what is made of it.
#[derive(Clone, Copy, Debug)]
struct Effort {
    /// Cells of the coarse grid across the square each chart would have if all were equal, and
    /// least and most across the texture.
    across: f64,
    least: f64,
    most: f64,
    /// Attempts on the coarse grid, from each beginning.
    attempts: usize,
    /// Sketches refined.
    sketches: usize,
}

impl Effort {
    /// The searches for so many charts, one after the other.
    fn new(charts: usize, quality: Quality) -> Vec<Self> {
        let grid = Self { across: 28.0, least: 128.0, most: 384.0, attempts: 0, sketches: 0 };
        // A few charts have few orders and many poses, and an attempt costs next to nothing.
        let attempts = |all: usize, least, most| (all / charts.max(1)).clamp(least, most);
        match quality {
            Quality::Fast => vec![Self { attempts: attempts(600, 30, 60), sketches: 3, ..grid }],
            Quality::High => {
                let (attempts, sketches) = (attempts(20_000, 80, 400), 16);
                let finer = Self { across: 50.0, least: 384.0, most: 2048.0, attempts, sketches };
                vec![Self { attempts, sketches, ..grid }, finer]
            }
        }
    }
}

/// What it took: attempts on the coarse grid and placements on the fine one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Trials {
    pub(super) attempts: usize,
    pub(super) placements: u32,
}

/// Places outlines at the greatest density found, and tells how many trials that took.
///
/// # Errors
/// [`PackError::MarginTooLarge`], [`PackError::TooManyCharts`], [`PackError::Cancelled`].
pub(super) fn densest(
    outlines: &[Outline],
    settings: &PackSettings,
    progress: &Progress,
) -> Result<(Dense, Trials), PackError> {
    let n = outlines.len();
    let grid = Grid::new(settings, n)?;
    let mut solid = (0..n).filter(|&i| !outlines[i].edges.is_empty());
    if let (Some(which), None) = (solid.next(), solid.next())
        && outlines[which].extent > 0.0
    {
        return Ok((alone(outlines, which, grid, settings), Trials::default()));
    }
    let largest = outlines.iter().map(|o| o.extent).fold(0.0, f64::max);
    let area = |i: usize| outlines[i].area * (outlines[i].extent / largest).powi(2);
    let turns = turns(outlines, &(0..n).map(area).collect::<Vec<_>>(), grid, settings, progress)?;
    let fine = Search {
        outlines,
        turns: &turns,
        quarters: settings.rotation != Rotation::None,
        grid,
        growth: SAFETY_TEXELS / grid.cell,
        reach: Reach::new(settings.margin_texels / grid.cell),
        budget: LAST_RESORT,
        progress,
    };
    let too_many = PackError::TooManyCharts {
        charts: n,
        margin: settings.margin_texels,
        width: settings.width,
        height: settings.height,
    };
    let mut trials = Trials::default();
    if largest <= 0.0 {
        return fine.once(1.0)?.map(|best| (dense(&best, grid), trials)).ok_or(too_many);
    }
    // No chart is larger than the texture.
    let ceiling = f64::from(settings.width).hypot(f64::from(settings.height)) / largest;
    let guess = (first_guess((0..n).map(area), settings, grid) / largest).min(ceiling);
    let mut sketches = Vec::new();
    for effort in Effort::new(n, settings.quality) {
        let coarse = Grid::coarse(settings, (effort.across * (n as f64).sqrt()).clamp(effort.least, effort.most));
        let lattice = |o: &Outline| (COARSENED * coarse.cell / (guess * o.extent)).clamp(1e-6, 0.1);
        let simple = |o: &Outline| {
            progress.check()?;
            Ok(o.coarsened(lattice(o)))
        };
        let simple: Vec<Outline> = outlines.par_iter().map(simple).collect::<Result<_, Cancelled>>()?;
        let search = Search {
            outlines: &simple,
            grid: coarse,
            growth: growth(settings.margin_texels, coarse),
            reach: Reach::new(0.0),
            budget: effort.attempts,
            ..fine
        };
        let mut found = Vec::new();
        for share in BEGINNINGS {
            let search = search.run(share * guess, ceiling)?;
            trials.attempts += search.attempts;
            found.extend(search.sketches);
        }
        sketches.extend(most_promising(found, effort.sketches));
    }
    let mut refinement = Refinement::new(outlines, grid, ceiling, settings, progress);
    let refined = refinement.best_of(&sketches)?;
    trials.placements = refinement.placements;
    if let Some(dense) = refined {
        return Ok((dense, trials));
    }
    // More charts than the coarse grid holds, or a texture of a few texels.
    let found = fine.run(guess, ceiling)?;
    trials.attempts += found.attempts;
    let best = match found.best {
        Some(best) => Some(best),
        // Every chart a speck or a point: whether they fit at all.
        None => fine.once(0.5 / largest)?,
    };
    best.map(|best| (dense(&best, grid), trials)).ok_or(too_many)
}

/// Base angles to try, by chart; `areas` tell which are large.
fn turns(
    outlines: &[Outline],
    areas: &[f64],
    grid: Grid,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Vec<Vec<[f64; 2]>>, Cancelled> {
    let n = outlines.len();
    let mut by_area: Vec<usize> = (0..n).collect();
    by_area.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let mut angles = vec![1; n];
    for &i in by_area.iter().take(LARGE) {
        angles[i] = ANGLES.div_ceil(n).clamp(LEAST_ANGLES, MOST_ANGLES);
    }
    let turns = |i: usize| {
        progress.check()?;
        Ok(match settings.rotation {
            // The given pose, in the frame of the grid.
            Rotation::None if grid.sideways => vec![[0.0, 1.0]],
            rotation => base_turns(&outlines[i], rotation, angles[i]),
        })
    };
    (0..n).into_par_iter().map(turns).collect()
}

fn dense(best: &Best, grid: Grid) -> Dense {
    let places = best.shapes.iter().zip(&best.layout.placed).map(|(shape, at)| {
        at.map(|at| Place {
            pose: grid.to_texture(shape.footprints[at.footprint].pose(at.x, at.y)),
            touched: shape.cells as f64 * grid.cell * grid.cell,
            is_speck: shape.is_speck,
        })
    });
    Dense { places: places.collect(), density: best.density }
}

/// Density at which squares of the charts' areas, with margin and raster waste added, cover
/// [`FIRST_FILL`] of the texture.
fn first_guess(areas: impl Iterator<Item = f64>, settings: &PackSettings, grid: Grid) -> f64 {
    let gap = settings.margin_texels + grid.cell + 2.0 * SAFETY_TEXELS;
    let (mut a, mut b, mut c) = (0.0, 0.0, -FIRST_FILL * f64::from(settings.width) * f64::from(settings.height));
    for area in areas {
        a += area;
        b += gap * area.sqrt();
        c += gap * gap;
    }
    // a s² + 2 b s + c = 0. Without room for the gaps alone, or without area, start small.
    let root = (b * b - a * c).max(0.0).sqrt() - b;
    if root > 0.0 && a > 0.0 { root / a } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackItem;
    use nalgebra::Point2;

    #[test]
    fn every_pass_over_the_charts_can_be_stopped() {
        let points = [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(0.0, 1.0)];
        let item = PackItem { points: &points, triangles: &[[0, 1, 2]] };
        let outlines: Vec<Outline> = (0..9).map(|i| Outline::new(&item, i).expect("finite")).collect();
        let settings = PackSettings::default();
        let grid = Grid::new(&settings, outlines.len()).expect("room");
        let stopped = Progress::new();
        stopped.cancel();
        let pass = |progress: &Progress| turns(&outlines, &[0.5; 9], grid, &settings, progress);
        assert!(pass(&Progress::new()).is_ok());
        assert_eq!(pass(&stopped), Err(Cancelled::OnRequest));
        let turns = pass(&Progress::new()).expect("not cancelled");
        let search = |progress| Search {
            outlines: &outlines,
            turns: &turns,
            quarters: true,
            grid,
            growth: 0.0,
            reach: Reach::new(0.0),
            budget: 1,
            progress,
        };
        assert!(search(&stopped).shapes(1.0).is_err());
        let going = Progress::new();
        assert_eq!(search(&going).shapes(1.0).map(|shapes| shapes.len()), Ok(9));
    }
}
