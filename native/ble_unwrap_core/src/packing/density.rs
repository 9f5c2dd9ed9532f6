//! The whole of packing: a first guess, sketches on a coarse grid, the best of them on the fine one.

use rayon::prelude::*;

use super::alone::alone;
use super::grid::Grid;
use super::many::{self, ROWS_ONLY, ROWS_TRIED};
use super::mask::Reach;
use super::obstacles::Obstacles;
use super::outline::Outline;
use super::placement::{Dense, Place};
use super::pose::base_turns;
use super::refine::Refinement;
use super::search::Search;
use super::shape::SAFETY_TEXELS;
use super::sketch::{Sketch, Spot, growth, most_promising};
use super::tighten::{Tightening, Trying};
use super::{Constraints, PackError, PackSettings, Quality, Rotation};
use crate::progress::{Cancelled, Progress};

/// So many of the largest charts are tried in more angles than one. Quarter turns of each come for free.
const LARGE: usize = 24;
/// About so many angles are tried in all, and at least and at most so many a chart. Charts that may be turned by any angle cover 5 % more of the
/// texture with these than with [`FEW_ANGLES`] on 16 sets of 10 to 306 charts, and 3 % more on 13 sets of up to 9; with twice as many again, another
/// 0.4 % and 0.1 %.
const ANGLES: [usize; 3] = [48, 6, 12];
/// The same for [`Quality::Fast`].
pub(super) const FEW_ANGLES: [usize; 3] = [24, 3, 8];
/// Share of the texture charts cover in the first guess, with half a margin around each.
const FIRST_FILL: f64 = 0.8;
/// A search climbs from where it begins, and may end on a hill: each is made from so many densities, relative to the first
/// guess. Of thirteen atlases the second one improved eight, by up to a fifth, and harmed one; packing of the meshes of
/// `make quality` rises from 0.558 to 0.560 with it, in the same time.
const BEGINNINGS: &[f64] = &[1.0, 0.9];
/// That of a second search, with more angles. One beginning brings it nearly all that two bring.
const OTHER_BEGINNINGS: &[f64] = &[0.95];
/// Vertices of outlines are moved together on a lattice of so many cells of the coarse grid.
const COARSENED: f64 = 0.3;
/// A scale that differs from the given one by less than this share has it: only rounding sets them apart.
pub(super) const SAME_SCALE: f64 = 1e-9;
/// A sketch so many times denser than needed is expected to have room for all charts on the fine grid at the density needed.
const SURE: f64 = 1.03;
/// Charts placed at this share of the density that is needed may get all of it once they are tightened.
const NEARLY: f64 = 0.94;
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
    /// Angles, as [`ANGLES`] has them.
    angles: [usize; 3],
    /// Where searches begin, relative to the first guess.
    beginnings: &'static [f64],
}

impl Effort {
    /// The searches for so many charts, one after the other.
    fn new(charts: usize, quality: Quality) -> Vec<Self> {
        let grid = Self {
            across: 28.0,
            least: 128.0,
            most: 384.0,
            attempts: 0,
            sketches: 0,
            angles: ANGLES,
            beginnings: BEGINNINGS,
        };
        // A few charts have few orders and many poses, and an attempt costs next to nothing.
        let attempts = |all: usize, least, most| (all / charts.max(1)).clamp(least, most);
        let fast = Self { attempts: attempts(600, 30, 60), sketches: 3, angles: FEW_ANGLES, ..grid };
        match quality {
            Quality::Fast => vec![fast],
            // What is found first is never lost, so that more effort brings no less.
            Quality::Normal => vec![fast, Self { angles: ANGLES, beginnings: OTHER_BEGINNINGS, ..fast }],
            Quality::High => vec![Self { attempts: attempts(8000, 30, 400), sketches: 4, ..grid }],
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
/// [`PackError::TooManyCharts`], [`PackError::NoRoomBetweenObstacles`], [`PackError::TooLarge`], [`PackError::Cancelled`].
pub(super) fn densest(
    outlines: &[Outline],
    constraints: &Constraints<'_>,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<(Dense, Trials), PackError> {
    let (dense, trials) = densest_up_to(outlines, constraints, settings, progress)?;
    match constraints.scale {
        Some(scale) if dense.density < scale * (1.0 - SAME_SCALE) && dense.places.iter().any(Option::is_some) => {
            Err(PackError::TooLarge { shrunk: dense.density / scale })
        }
        _ => Ok((dense, trials)),
    }
}

/// The same, where a given scale is a bound. Where there are several tiles or a texel density, the search ends once that bound is reached.
///
/// # Errors
/// As [`densest`], but [`PackError::TooLarge`].
pub(super) fn densest_up_to(
    outlines: &[Outline],
    constraints: &Constraints<'_>,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<(Dense, Trials), PackError> {
    let n = outlines.len();
    let border = constraints.border(settings);
    let most = constraints.scale.unwrap_or(f64::INFINITY);
    let grid = Grid::new(settings, border, n);
    let mut solid = (0..n).filter(|&i| !outlines[i].edges.is_empty());
    let (first, second) = (solid.next(), solid.next());
    if let (Some(which), None, true) = (first, second, constraints.obstacles.is_empty())
        && outlines[which].extent > 0.0
    {
        return Ok((alone(outlines, which, grid, most, settings), Trials::default()));
    }
    let growth_of = |grid: Grid| SAFETY_TEXELS / grid.cell;
    let reach = Reach::new(settings.margin_texels / grid.cell);
    let obstacles = Obstacles::new(constraints.obstacles, grid, growth_of(grid), &reach, progress)?;
    let PackSettings { width, height, margin_texels: margin, .. } = *settings;
    let no_room = match obstacles {
        None => PackError::TooManyCharts { charts: n, margin, width, height },
        Some(_) => PackError::NoRoomBetweenObstacles { charts: n, margin, width, height },
    };
    if first.is_some() && obstacles.as_ref().is_some_and(|o| o.free() == 0) {
        return Err(no_room);
    }
    let largest = outlines.iter().map(|o| o.extent).fold(0.0, f64::max);
    let areas: Vec<f64> = outlines.iter().map(|o| o.area * (o.extent / largest).powi(2)).collect();
    let turns_of = |angles: [usize; 3]| turns(outlines, &areas, angles, grid, settings, progress);
    let turns = turns_of(FEW_ANGLES)?;
    let fine = Search {
        outlines,
        turns: &turns,
        quarters: settings.rotation != Rotation::None,
        grid,
        growth: growth_of(grid),
        reach: reach.clone(),
        obstacles: obstacles.clone(),
        budget: LAST_RESORT,
        enough: f64::INFINITY,
        is_whole: settings.tiles == 1,
        progress,
    };
    let mut trials = Trials::default();
    if largest <= 0.0 {
        let scale = constraints.scale.unwrap_or(1.0);
        return fine.once(scale)?.map(|best| (best.dense(grid), trials)).ok_or(no_room);
    }
    // No chart is larger than the texture.
    let largest_scale = f64::from(width).hypot(f64::from(height)) / largest;
    let ceiling = largest_scale.min(most);
    let room = [width, height].map(|side| 1.0 - (2.0 * border - margin) / f64::from(side));
    let free = obstacles.as_ref().map_or(1.0, |o| o.free() as f64 / (grid.columns * grid.rows) as f64);
    let guess =
        (first_guess(areas.iter().copied(), room[0] * room[1] * free, settings, grid) / largest).min(largest_scale);
    let in_rows = match settings.quality {
        Quality::Fast if n < ROWS_TRIED => None,
        _ => many::in_rows(&fine, &areas, margin, [guess, ceiling])?,
    };
    // The search ends early where the result cannot become better; not for one tile with a given scale, where what is found last is taken.
    let stops_early = settings.tiles > 1 || settings.texel_density.is_some();
    let rows_suffice = stops_early && in_rows.as_ref().is_some_and(|rows| rows.density >= ceiling);
    if n >= ROWS_ONLY || rows_suffice {
        return in_rows.map(|dense| (dense, trials)).ok_or(no_room);
    }
    let obstacles = obstacles.as_ref();
    let mut refined = None;
    let trying = Trying::new(n, settings.quality);
    // All sketches, those that are not refined as well: where to start from when charts are tightened.
    let mut drawn: Vec<Sketch> = Vec::new();
    // Where what was thought enough turns out to be too little, all is searched.
    for enough in [if stops_early { SURE * most } else { f64::INFINITY }, f64::INFINITY] {
        let mut sketches: Vec<Sketch> = Vec::new();
        for effort in Effort::new(n, settings.quality) {
            let more = if effort.angles == FEW_ANGLES { None } else { Some(turns_of(effort.angles)?) };
            let across = (effort.across * (n as f64).sqrt()).clamp(effort.least, effort.most);
            let coarse = Grid::coarse(settings, border, across);
            let lattice = |o: &Outline| (COARSENED * coarse.cell / (guess * o.extent)).clamp(1e-6, 0.1);
            let simple = |o: &Outline| {
                progress.check()?;
                Ok(o.coarsened(lattice(o)))
            };
            let simple: Vec<Outline> = outlines.par_iter().map(simple).collect::<Result<_, Cancelled>>()?;
            let (growth, reach) = (growth(margin, coarse), Reach::new(0.0));
            let search = Search {
                outlines: &simple,
                turns: more.as_ref().unwrap_or(&turns),
                grid: coarse,
                growth,
                obstacles: Obstacles::new(constraints.obstacles, coarse, growth, &reach, progress)?,
                reach,
                budget: effort.attempts,
                enough,
                ..fine
            };
            let mut found = Vec::new();
            for share in effort.beginnings {
                // Sketches do not regard a given scale: what is drawn denser has room at the scale.
                let search = search.run((share * guess).min(enough), largest_scale)?;
                trials.attempts += search.attempts;
                found.extend(search.sketches);
                if search.best.is_some_and(|best| best.density >= enough) {
                    break;
                }
            }
            drawn.extend(found.iter().cloned());
            sketches.extend(most_promising(found, effort.sketches));
            if sketches.iter().any(|sketch| sketch.density >= enough) {
                break;
            }
        }
        let mut refinement =
            Refinement { outlines, grid, reach: &reach, obstacles, ceiling, stops_early, placements: 0, progress };
        refined = refinement.best_of(&sketches)?;
        trials.placements += refinement.placements;
        let ended_early = sketches.iter().any(|sketch| sketch.density >= enough);
        if !ended_early || refined.as_ref().is_some_and(|dense| dense.density >= ceiling) {
            break;
        }
    }
    let denser = |a: Dense, b: Dense| if b.density > a.density { b } else { a };
    if let Some(dense) = refined.into_iter().chain(in_rows).reduce(denser) {
        // Of several tiles all are brought to one density afterwards, near where charts are, which only a placement by cells is sure to allow.
        // So there only what then has the density that is needed is taken. And charts would grow into obstacles.
        let is_near = !stops_early || (NEARLY * ceiling..ceiling).contains(&dense.density);
        if obstacles.is_none() && is_near {
            let tightening = Tightening { outlines, grid, ceiling, settings, progress };
            let sketches = most_promising(drawn, trying.sketches);
            let tightened = tightening.densest(dense.clone(), &sketches, trying)?;
            let is_taken = !stops_early || tightened.density >= ceiling;
            return Ok((if is_taken { tightened } else { dense }, trials));
        }
        return Ok((dense, trials));
    }
    // More charts than the coarse grid holds, or a texture of a few texels.
    let found = fine.run(guess, ceiling)?;
    trials.attempts += found.attempts;
    let best = match found.best {
        Some(best) => Some(best),
        // Every chart a speck or a point: whether they fit at all.
        None => fine.once((0.5 / largest).min(most))?,
    };
    best.map(|best| (best.dense(grid), trials)).ok_or(no_room)
}

/// A placement of outlines at a lower density, the given scale, with every chart near where it was; `None` where that does not fit so. It costs
/// no search, and is expected to fit, since smaller charts need less room.
///
/// # Errors
/// [`PackError::Cancelled`].
pub(super) fn thinned(
    outlines: &[Outline],
    places: &[Option<Place>],
    constraints: &Constraints<'_>,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Option<Dense>, PackError> {
    let Some(ceiling) = constraints.scale else { return Ok(None) };
    let grid = Grid::new(settings, constraints.border(settings), outlines.len());
    let reach = Reach::new(settings.margin_texels / grid.cell);
    let obstacles = Obstacles::new(constraints.obstacles, grid, SAFETY_TEXELS / grid.cell, &reach, progress)?;
    let spot = |place: &Place| {
        let (turn, centre) = grid.texture_to_frame(place.pose);
        Spot { turn, centre }
    };
    let spots = places.iter().map(|place| place.as_ref().map(spot)).collect();
    let sketch = Sketch { spots, density: ceiling, cell: grid.cell };
    let obstacles = obstacles.as_ref();
    let reach = &reach;
    let mut refinement =
        Refinement { outlines, grid, reach, obstacles, ceiling, stops_early: true, placements: 0, progress };
    Ok(refinement.best_of(&[sketch])?.filter(|dense| dense.density >= ceiling))
}

/// Base angles to try, by chart; `areas` tell which are large.
pub(super) fn turns(
    outlines: &[Outline],
    areas: &[f64],
    [all, least, most]: [usize; 3],
    grid: Grid,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Vec<Vec<[f64; 2]>>, Cancelled> {
    let n = outlines.len();
    let mut by_area: Vec<usize> = (0..n).collect();
    by_area.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let mut angles = vec![1; n];
    for &i in by_area.iter().take(LARGE) {
        angles[i] = all.div_ceil(n).clamp(least, most);
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

/// Density at which squares of the charts' areas, with margin and raster waste added, cover
/// [`FIRST_FILL`] of the share `room` of the texture.
pub(super) fn first_guess(areas: impl Iterator<Item = f64>, room: f64, settings: &PackSettings, grid: Grid) -> f64 {
    let gap = settings.margin_texels + grid.cell + 2.0 * SAFETY_TEXELS;
    let (mut a, mut b, mut c) = (0.0, 0.0, -FIRST_FILL * f64::from(settings.width) * f64::from(settings.height) * room);
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
        let grid = Grid::new(&settings, 2.0, outlines.len());
        let stopped = Progress::new();
        stopped.cancel();
        let pass = |progress: &Progress| turns(&outlines, &[0.5; 9], ANGLES, grid, &settings, progress);
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
            obstacles: None,
            budget: 1,
            enough: f64::INFINITY,
            is_whole: true,
            progress,
        };
        assert!(search(&stopped).shapes(1.0).is_err());
        let going = Progress::new();
        assert_eq!(search(&going).shapes(1.0).map(|shapes| shapes.len()), Ok(9));
    }
}
