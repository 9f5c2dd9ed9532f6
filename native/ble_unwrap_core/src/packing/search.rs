//! A search over densities and orders on one grid: a bracket, then a climb.
//!
//! Attempts fill the grid upwards and may overshoot its top, so that each tells *how much* too dense
//! or too loose it was: area goes with the square of the density, so the next guess is the density
//! divided by the root of the height used. Near the optimum the height is a noisy function of the
//! order of placement, and the search climbs on that: variations of the best order so far, at a
//! density slightly above the best that fitted.

use rayon::prelude::*;

use super::PackError;
use super::grid::Grid;
use super::mask::Reach;
use super::obstacles::Obstacles;
use super::order::Strategy;
use super::outline::Outline;
use super::place::{Layout, Site, place};
use super::placement::{Dense, Place};
use super::shape::Shape;
use super::sketch::Sketch;
use crate::progress::{Cancelled, Progress, Stage};

/// Attempts in a round while the density is bracketed, when strategies are compared, and in each round
/// of variations. They run in parallel; fixed, so that results do not depend on the number of threads.
const BRACKETING: usize = 2;
const COMPARED: usize = 8;
const VARIED: usize = 4;
/// From so many charts on, search rows are shared by similar footprints.
const MANY: usize = 600;
/// Attempts made to find a first fit; from the ninth on each is at least a tenth less dense.
const SHRINKS: u32 = 80;
/// Greatest and least step of density above the best fit.
const STEP: f64 = 0.003;
const LEAST_STEP: f64 = 0.0004;
/// An attempt that uses the height to this share is a start for variations.
const NEAR: f64 = 0.015;
/// Between obstacles, the next density is the geometric mean of the best that fitted and the least dense that did not, as long as these differ by
/// more than twice this share.
const HALVED: f64 = 0.02;
/// Rounds without a better fit before the step is halved.
const PATIENCE: usize = 3;

/// The densest placement that fitted the grid.
pub(super) struct Best {
    pub(super) shapes: Vec<Shape>,
    pub(super) layout: Layout,
    /// Texels to a unit of the chart plane.
    pub(super) density: f64,
}

impl Best {
    /// Where it has each chart in the texture.
    pub(super) fn places(&self, grid: Grid) -> impl Iterator<Item = Option<Place>> {
        self.shapes.iter().zip(&self.layout.placed).map(move |(shape, at)| {
            at.map(|at| Place {
                pose: grid.to_texture(shape.footprints[at.footprint].pose(at.x, at.y)),
                touched: shape.cells as f64 * grid.cell * grid.cell,
                is_speck: shape.is_speck,
            })
        })
    }

    /// All of it.
    pub(super) fn dense(&self, grid: Grid) -> Dense {
        Dense { places: self.places(grid).collect(), density: self.density }
    }
}

/// What a search found.
pub(super) struct Found {
    pub(super) best: Option<Best>,
    /// All attempts about as high as the grid, in the order they were made.
    pub(super) sketches: Vec<Sketch>,
    /// Attempts made, those before the first fit included.
    pub(super) attempts: usize,
}

/// What a search needs to know, fixed throughout.
pub(super) struct Search<'a> {
    pub(super) outlines: &'a [Outline],
    /// Base angles of each chart.
    pub(super) turns: &'a [Vec<[f64; 2]>],
    /// Whether their quarter turns are tried too.
    pub(super) quarters: bool,
    pub(super) grid: Grid,
    /// Cells by which charts are grown, in the maximum norm.
    pub(super) growth: f64,
    /// Which cells around a chart others keep away from.
    pub(super) reach: Reach,
    /// What is in the way on the grid.
    pub(super) obstacles: Option<Obstacles>,
    /// Attempts from the first fit on.
    pub(super) budget: usize,
    /// Density from which on a placement that fits ends the search.
    pub(super) enough: f64,
    /// Whether the search is all of packing, or else that of one tile among several, which is no measure of the progress made.
    pub(super) is_whole: bool,
    pub(super) progress: &'a Progress,
}

/// One attempt's outcome: height used over height there is, and the layout.
struct Attempt {
    used: f64,
    layout: Layout,
    strategy: Strategy,
}

impl Search<'_> {
    pub(super) fn shapes(&self, density: f64) -> Result<Vec<Shape>, Cancelled> {
        let shape = |i: usize| {
            self.progress.check()?;
            let Self { outlines, turns, grid, growth, .. } = self;
            Ok(Shape::new(&outlines[i], &turns[i], self.quarters, density, grid.cell, *growth))
        };
        (0..self.outlines.len()).into_par_iter().map(shape).collect()
    }

    /// Tries all strategies, in their order.
    fn attempts(&self, shapes: &[Shape], strategies: Vec<Strategy>) -> Result<Vec<Attempt>, PackError> {
        let Grid { columns, rows, .. } = self.grid;
        let cap = rows + rows / 2;
        let cells: usize = shapes.iter().map(|s| s.cells).sum();
        let alike = shapes.len() >= MANY;
        let obstacles = self.obstacles.as_ref();
        let site = Site { size: [columns, cap], reach: &self.reach, obstacles, alike };
        let attempt = |strategy: Strategy| {
            let layout = place(shapes, &strategy, site, self.progress)?;
            let used = if layout.missing == 0 {
                obstacles.map_or(layout.rows as f64 / rows as f64, |o| o.share(layout.rows))
            } else {
                1.5 * cells as f64 / (cells - layout.missing).max(cells / 100 + 1) as f64
            };
            Ok(Attempt { used, layout, strategy })
        };
        strategies.into_par_iter().map(attempt).collect()
    }

    /// One attempt at one density.
    ///
    /// # Errors
    /// [`PackError::Cancelled`].
    pub(super) fn once(&self, density: f64) -> Result<Option<Best>, PackError> {
        let shapes = self.shapes(density)?;
        let attempt = least(self.attempts(&shapes, Strategy::portfolio(&shapes, 1))?);
        let fits = attempt.filter(|a| a.used <= 1.0);
        Ok(fits.map(|a| Best { shapes, layout: a.layout, density }))
    }

    /// Searches from the density `guess` on, for at most `ceiling` texels to a unit of the chart plane.
    ///
    /// # Errors
    /// [`PackError::Cancelled`].
    pub(super) fn run(&self, guess: f64, ceiling: f64) -> Result<Found, PackError> {
        let n = self.outlines.len();
        let mut density = guess.min(ceiling);
        let (mut made, mut all_made) = (0, 0);
        let mut best: Option<Best> = None;
        let mut sketches: Vec<Sketch> = Vec::new();
        let mut lead: Option<(f64, Strategy)> = None;
        let mut too_dense = f64::INFINITY;
        let mut near = false;
        let (mut step, mut idle, mut shrinks) = (STEP, 0, 0);
        let mut shapes = self.shapes(density)?;
        while made < self.budget && shrinks < SHRINKS {
            if self.is_whole {
                self.progress.advance(Stage::Pack, made as f64 / self.budget as f64);
            }
            let strategies = match &lead {
                None if !near => Strategy::portfolio(&shapes, BRACKETING),
                None => Strategy::portfolio(&shapes, if n < MANY { COMPARED } else { VARIED }),
                Some((used, lead)) => {
                    let keep = used.is_infinite().then(|| lead.clone());
                    let varied = (0..VARIED - usize::from(keep.is_some())).map(|k| lead.varied((made + k) as u64));
                    varied.chain(keep).collect()
                }
            };
            let count = strategies.len();
            all_made += count;
            let attempts = self.attempts(&shapes, strategies)?;
            let sketch = |a: &Attempt| {
                if self.obstacles.is_none() && density < self.enough {
                    Sketch::of(&a.layout, &shapes, self.grid, density)
                } else {
                    (a.used <= 1.0).then(|| Sketch::at_its_density(&a.layout, &shapes, self.grid, density))
                }
            };
            sketches.extend(attempts.iter().filter_map(sketch));
            let Some(Attempt { used, layout, strategy }) = least(attempts) else { break };
            let loosened = 1.0 / used.sqrt();
            let before = density;
            if used <= 1.0 {
                // Every density tried lies above the best that fitted: this one is better.
                best = Some(Best { shapes, layout, density });
                if density >= self.enough {
                    break;
                }
                near = used > 1.0 - 2.0 * NEAR;
                if count > BRACKETING {
                    lead = Some((f64::INFINITY, strategy));
                }
                (step, idle) = ((2.0 * step).min(STEP), 0);
                density = (density * loosened * (1.0 + step)).min(ceiling);
                // While bracketing, do not go back to what was too dense.
                if lead.is_none() && before < too_dense && density >= too_dense {
                    density = (before * too_dense).sqrt();
                }
            } else if let Some(fitted) = &best {
                near = true;
                if used < 1.0 + NEAR && count > BRACKETING && lead.as_ref().is_none_or(|l| used <= l.0) {
                    lead = Some((used, strategy));
                }
                idle += 1;
                if idle < PATIENCE && lead.is_some() {
                    made += count;
                    continue;
                }
                (step, idle) = ((0.5 * step).max(LEAST_STEP), 0);
                too_dense = density;
                let between = (fitted.density * density).sqrt();
                let nearer = if self.obstacles.is_some() && between > fitted.density * (1.0 + HALVED) {
                    // How much of the room is used tells little.
                    between
                } else {
                    between.min(fitted.density * (1.0 + 4.0 * step))
                };
                density = nearer.max(fitted.density * (1.0 + LEAST_STEP));
                lead = lead.map(|l| (f64::INFINITY, l.1));
            } else {
                // Not a part of the search yet.
                too_dense = density;
                shrinks += 1;
                density *= (0.998 * loosened).clamp(0.5, 0.995 - 0.01 * f64::from(shrinks.min(9)));
                shapes = self.shapes(density)?;
                continue;
            }
            made += count;
            if density == before {
                break;
            }
            shapes = self.shapes(density)?;
        }
        Ok(Found { best, sketches, attempts: all_made })
    }
}

/// The attempt that uses least height, the first of several.
fn least(attempts: Vec<Attempt>) -> Option<Attempt> {
    attempts.into_iter().reduce(|a, b| if b.used < a.used { b } else { a })
}
