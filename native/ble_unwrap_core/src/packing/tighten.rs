//! From placements by cells to the densest arrangement found near them, and near variations of it.
//!
//! What cells cost, about a cell between any two charts and angles that are none but a few, is won back by `compact`; and
//! since it gets stuck where charts hold each other, it is started from several sketches and, after that, from variations
//! of the best arrangements: charts are shrunk until none overlaps another, and grow again. That is a random search over
//! local optima (Wales, Doye: Global optimization by basin-hopping, The Journal of Physical Chemistry A 101(28), 1997), in
//! which the best ones are kept.

use nalgebra::Vector2;
use rayon::prelude::*;

use super::body::Body;
use super::compact::{Arrangement, Compaction, Frame, Grown, Pace};
use super::grid::Grid;
use super::outline::Outline;
use super::placement::Dense;
use super::pose::keeps_turn;
use super::rearrange::varied;
use super::shape::SAFETY_TEXELS;
use super::sketch::{Sketch, Spot};
use super::{PackSettings, Pose, Quality, Rotation};
use crate::progress::{Cancelled, Progress};

/// Most charts that are tightened. A step takes about the square of their number, 0.02 s for 300.
pub(super) const MOST: usize = 400;
/// Outlines are as coarse as the texture's shorter side over this, or a part of the distance between charts, until the last
/// steps: no chart then passes another.
const COARSE: f64 = 1024.0;
const OF_GAP: f64 = 0.25;
/// Longest step by coarse outlines, where there is one chart; with more charts it goes with the root of their number, as
/// the width of charts does. In units of [`COARSE`], like the shortest one and those by exact outlines.
const LONGEST: f64 = 40.0;
const SHORTEST: f64 = 0.25;
const EXACT_STEPS: [f64; 2] = [1.0, 0.02];
/// What distances may fall short by in an arrangement by coarse outlines, in units of [`COARSE`].
const ROUGH: f64 = 0.1;
/// What the charts of a start are shrunk by until none overlaps another, and how often at most.
const SHRUNK: f64 = 0.93;
const SHRINKS: usize = 14;
/// Variations made at once; fixed, so that results do not depend on the number of threads.
const ROUND: usize = 4;
/// So many of the best arrangements are varied in turn, and so many laid out by exact outlines.
const VARIED: usize = 3;
const EXACT: usize = 2;
/// Densities closer than this are those of the same arrangement.
const SAME: f64 = 1e-6;

/// How much is tried.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trying {
    /// Sketches to start from, besides the placement.
    pub(super) sketches: usize,
    /// Variations are made until so many inequalities have been dealt with, those of the starts included, or so many
    /// variations been made.
    work: usize,
    variations: usize,
    /// Steps from each start by coarse outlines, half as many by exact ones.
    steps: usize,
}

impl Trying {
    pub(super) fn new(charts: usize, quality: Quality) -> Self {
        let of_all = |all: usize, most: usize| (all / charts.max(1)).min(most);
        let (sketches, work, variations, steps) = match quality {
            Quality::Fast => (of_all(24, 4), 0, 0, 2400),
            Quality::Normal => (of_all(40, 8), 40_000, 60, 2400),
            Quality::High => (of_all(400, 40), 500_000, 600, 9600),
        };
        Self { sketches, work, variations, steps: of_all(steps, 60).max(8) }
    }
}

/// Charts of which a placement is tightened.
pub(super) struct Tightening<'a> {
    pub(super) outlines: &'a [Outline],
    pub(super) grid: Grid,
    /// Texels to a unit of the chart plane at most.
    pub(super) ceiling: f64,
    pub(super) settings: &'a PackSettings,
    pub(super) progress: &'a Progress,
}

impl Tightening<'_> {
    /// The densest arrangement found from a placement and sketches on; the placement itself where none is denser, or where a chart is
    /// smaller than a texel, which has a scale of its own.
    ///
    /// Guaranteed as by cells: charts are more than the margin apart, and more than the border from that of the texture.
    /// Cost: bounded by `trying`; nothing in it depends on the clock or on the number of threads.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn densest(&self, placed: Dense, sketches: &[Sketch], trying: Trying) -> Result<Dense, Cancelled> {
        let which: Vec<usize> = (0..self.outlines.len()).filter(|&i| placed.places[i].is_some()).collect();
        let is_speck = placed.places.iter().flatten().any(|p| p.is_speck);
        if is_speck || !(2..=MOST).contains(&which.len()) || placed.density >= self.ceiling {
            return Ok(placed);
        }
        let border = self.grid.border;
        let sides = self.grid.inner().map(|side| side + 2.0 * border);
        // Half of what is more than the margin is for what steps leave.
        let more = 2.0 * SAFETY_TEXELS;
        let gap = self.settings.margin_texels + more;
        let frame = Frame { sides, border: border + more, gap, ceiling: self.ceiling };
        let turns: Vec<bool> = which.iter().map(|&i| !keeps_turn(&self.outlines[i], self.settings.rotation)).collect();
        let bodies = |tolerance: f64| -> Result<Vec<Body>, Cancelled> {
            let body = |&i: &usize| {
                self.progress.check()?;
                Ok(Body::new(&self.outlines[i], tolerance / placed.density))
            };
            which.par_iter().map(body).collect()
        };
        let unit = sides[0].min(sides[1]) / COARSE;
        let (coarse, exact) = (bodies(unit.min(OF_GAP * gap))?, bodies(0.0)?);
        let compaction = |bodies| Compaction { bodies, turns: &turns, frame: &frame, progress: self.progress };
        let longest = unit * LONGEST / (which.len() as f64).sqrt();
        let pace = Pace { longest, shortest: unit * SHORTEST, steps: trying.steps, tolerance: unit * ROUGH };
        let grown = |start: Arrangement| match parted(&compaction(&coarse), start) {
            Some(start) => compaction(&coarse).grown(&start, pace),
            None => Ok(Grown { densest: None, work: 0 }),
        };
        let spot = |pose: Pose| {
            let (turn, centre) = self.grid.texture_to_frame(pose);
            Spot { turn, centre }
        };
        let spots = which.iter().filter_map(|&i| placed.places[i]).map(|place| spot(place.pose)).collect();
        let mut starts = vec![Arrangement { density: placed.density, spots }];
        for sketch in sketches {
            let spots: Vec<Spot> = which.iter().filter_map(|&i| sketch.spots[i]).collect();
            if spots.len() == which.len() {
                starts.push(Arrangement { density: sketch.density, spots });
            }
        }
        let (mut best, mut work) = (Vec::new(), 0);
        let mut all = |found: Vec<Grown>, best: &mut Vec<Arrangement>| {
            for Grown { densest, work: more } in found {
                densest.into_iter().for_each(|found| keep(best, found));
                work += more;
            }
            work < trying.work
        };
        let found = starts.into_par_iter().map(grown).collect::<Result<_, Cancelled>>()?;
        let mut goes_on = all(found, &mut best);
        let quarters = self.settings.rotation != Rotation::None;
        for first in (0..trying.variations).step_by(ROUND) {
            if !goes_on || best.is_empty() {
                break;
            }
            let of = |number: usize| grown(varied(&best[number % best.len()], number as u64, &turns, quarters, &frame));
            let found = (first..first + ROUND).into_par_iter().map(of).collect::<Result<_, Cancelled>>()?;
            goes_on = all(found, &mut best);
        }
        let [longest, shortest] = EXACT_STEPS.map(|step| unit * step);
        let pace = Pace { longest, shortest, steps: trying.steps / 2, tolerance: more - SAFETY_TEXELS };
        best.truncate(EXACT);
        let of = |start: &Arrangement| {
            let Grown { densest, .. } = compaction(&exact).grown(start, pace)?;
            Ok(densest.filter(|found| compaction(&exact).is_apart(found)))
        };
        let found: Vec<_> = best.par_iter().map(of).collect::<Result<_, Cancelled>>()?;
        let denser = |a: Arrangement, b: Arrangement| if b.density > a.density { b } else { a };
        let found = found.into_iter().flatten().reduce(denser).filter(|found| found.density > placed.density);
        Ok(found.map_or_else(|| placed.clone(), |found| self.dense(&placed, &which, &found)))
    }

    /// An arrangement of the charts `which` as a placement.
    fn dense(&self, placed: &Dense, which: &[usize], at: &Arrangement) -> Dense {
        let mut places = placed.places.clone();
        for (&i, spot) in which.iter().zip(&at.spots) {
            if let Some(place) = &mut places[i] {
                let [cos, sin] = spot.turn;
                let offset = Vector2::from(spot.centre) - Vector2::repeat(self.grid.border);
                let pose = Pose { cos, sin, centre: self.outlines[i].centre, scale: at.density, offset };
                place.pose = self.grid.frame_to_texture(pose);
                place.touched *= (at.density / placed.density).powi(2);
            }
        }
        Dense { places, density: at.density }
    }
}

/// A start with all charts shrunk about their middles until none overlaps another; `None` where they would be far too small then.
fn parted(compaction: &Compaction<'_>, mut start: Arrangement) -> Option<Arrangement> {
    for _ in 0..SHRINKS {
        if compaction.is_apart(&start) {
            return Some(start);
        }
        start.density *= SHRUNK;
    }
    None
}

/// Keeps an arrangement, if it is another one and among the densest, densest first.
fn keep(best: &mut Vec<Arrangement>, found: Arrangement) {
    if best.iter().any(|b| (b.density / found.density - 1.0).abs() < SAME) {
        return;
    }
    best.insert(best.partition_point(|b| b.density >= found.density), found);
    best.truncate(VARIED);
}
