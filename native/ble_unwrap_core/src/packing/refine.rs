//! From sketches to the placement: settled on the fine grid, then grown until it no longer fits.

use rayon::prelude::*;

use super::PackError;
use super::grid::Grid;
use super::mask::Reach;
use super::obstacles::Obstacles;
use super::outline::Outline;
use super::placement::{Dense, Place};
use super::settle::{Ground, Piece, settle};
use super::sketch::{Sketch, Spot};
use crate::progress::{Cancelled, Progress};

/// Half the side of the windows charts are looked for in first, in cells of the sketch.
const WINDOW: f64 = 1.0;
/// Share of the height by which a placement may overshoot and still tell by how much.
const OVERSHOOT: usize = 16;
/// Placements of a sketch until one fits, each less dense; of a further sketch there is one, slightly
/// denser than the best so far.
const SHRINKS: u32 = 14;
const BETTER: f64 = 1.002;
/// Placements of a sketch from the first fit on.
const GROWTHS: u32 = 5;
/// The same between obstacles, where a sketch does not tell how much denser it may become.
const GROWTHS_BETWEEN: u32 = 24;
/// Least and greatest step of density while nothing was too dense.
const STEPS: [f64; 2] = [1.002, 1.01];
/// Densities this close to too dense are not improved on.
pub(super) const CLOSE: f64 = 1.0005;

/// Refines sketches on the fine grid.
pub(super) struct Refinement<'a> {
    pub(super) outlines: &'a [Outline],
    pub(super) grid: Grid,
    pub(super) reach: &'a Reach,
    /// What is in the way on the grid.
    pub(super) obstacles: Option<&'a Obstacles>,
    /// Texels to a unit of the chart plane at most.
    pub(super) ceiling: f64,
    /// Whether further sketches are left alone once that is reached.
    pub(super) stops_early: bool,
    /// Placements made.
    pub(super) placements: u32,
    pub(super) progress: &'a Progress,
}

/// A placement that fits.
struct Fit {
    density: f64,
    pieces: Vec<Option<Piece>>,
    corners: Vec<Option<[usize; 2]>>,
}

impl Refinement<'_> {
    /// The densest placement found near any of the sketches.
    ///
    /// # Errors
    /// [`PackError::Cancelled`].
    pub(super) fn best_of(&mut self, sketches: &[Sketch]) -> Result<Option<Dense>, PackError> {
        let mut best: Option<Fit> = None;
        for sketch in sketches {
            let above = best.as_ref().map(|b| b.density * BETTER);
            best = self.grown(sketch, above)?.or(best);
            if self.stops_early && best.as_ref().is_some_and(|b| b.density >= self.ceiling) {
                break;
            }
        }
        Ok(best.map(|fit| self.dense(fit)))
    }

    /// The densest placement near a sketch, if it is at least `above` dense.
    fn grown(&mut self, sketch: &Sketch, above: Option<f64>) -> Result<Option<Fit>, PackError> {
        let mut spots = sketch.spots.clone();
        let window = (WINDOW * sketch.cell / self.grid.cell).ceil() as usize;
        let mut density = above.unwrap_or(sketch.density).min(self.ceiling);
        let mut too_dense = f64::INFINITY;
        let mut fit: Option<Fit> = None;
        let (mut shrinks, mut growths) = (0, 0);
        loop {
            self.placements += 1;
            let pieces = self.pieces(&spots, density)?;
            let height = self.grid.rows + self.grid.rows / OVERSHOOT;
            let mut ground = Ground::new(self.grid.columns, height, self.reach.clone());
            if let Some(obstacles) = self.obstacles {
                ground.obstruct(obstacles);
            }
            let centres: Vec<[f64; 2]> = spots.iter().map(|s| s.map_or([0.0; 2], |s| self.cells(s.centre))).collect();
            let settled = settle(&pieces, &centres, &mut ground, window, self.progress)?;
            let used = settled.as_ref().map(|s| s.rows as f64 / self.grid.rows as f64);
            match settled {
                Some(settled) if settled.rows <= self.grid.rows => {
                    // The next one starts from here.
                    for (spot, (piece, corner)) in spots.iter_mut().zip(pieces.iter().zip(&settled.corners)) {
                        if let (Some(spot), Some(piece), Some(corner)) = (spot, piece, corner) {
                            spot.centre = piece.pose(*corner).offset.into();
                            spot.centre = spot.centre.map(|c| c * self.grid.cell + self.grid.border);
                        }
                    }
                    fit = Some(Fit { density, pieces, corners: settled.corners });
                }
                _ => too_dense = density,
            }
            if let Some(Fit { density: fitted, .. }) = &fit {
                growths += 1;
                let most = if self.obstacles.is_some() { GROWTHS_BETWEEN } else { GROWTHS };
                if growths >= most || too_dense < CLOSE * fitted || density >= self.ceiling {
                    break;
                }
                density = denser(*fitted, too_dense, density, used).min(self.ceiling);
            } else {
                shrinks += 1;
                if shrinks >= SHRINKS || above.is_some() {
                    break;
                }
                density *= match used {
                    Some(used) => (1.0 / used.sqrt()).min(0.998),
                    None => 1.0 - 0.01 * f64::from(shrinks),
                };
            }
        }
        Ok(fit)
    }

    /// Texels from the texture's corner as cells of the grid.
    fn cells(&self, texels: [f64; 2]) -> [f64; 2] {
        texels.map(|t| (t - self.grid.border) / self.grid.cell)
    }

    fn pieces(&self, spots: &[Option<Spot>], density: f64) -> Result<Vec<Option<Piece>>, Cancelled> {
        let piece = |(outline, spot): (&Outline, &Option<Spot>)| {
            self.progress.check()?;
            Ok(spot.map(|spot| Piece::new(outline, spot.turn, density, self.grid.cell)))
        };
        self.outlines.par_iter().zip(spots).map(piece).collect()
    }

    fn dense(&self, fit: Fit) -> Dense {
        let place = |(piece, corner): (&Option<Piece>, &Option<[usize; 2]>)| {
            piece.as_ref().zip(*corner).map(|(piece, corner)| Place {
                pose: self.grid.to_texture(piece.pose(corner)),
                touched: piece.cells as f64 * self.grid.cell * self.grid.cell,
                is_speck: piece.is_speck,
            })
        };
        Dense { places: fit.pieces.iter().zip(&fit.corners).map(place).collect(), density: fit.density }
    }
}

/// The density to try after one that used a share of the height (if it could be placed at all), between the
/// densest that fitted and the least dense that did not.
fn denser(fitted: f64, too_dense: f64, tried: f64, used: Option<f64>) -> f64 {
    let aim = match used {
        Some(used) if used <= 1.0 => tried * (1.0 / used.sqrt()).clamp(STEPS[0], STEPS[1]),
        Some(used) => tried / used.sqrt(),
        None => fitted,
    };
    if too_dense.is_infinite() {
        return aim;
    }
    let between = |share: f64| fitted + share * (too_dense - fitted);
    aim.clamp(between(0.3), between(0.7))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_stay_between_what_fits_and_what_does_not() {
        assert_eq!(denser(1.0, f64::INFINITY, 1.0, Some(0.5)), STEPS[1]);
        assert_eq!(denser(1.0, f64::INFINITY, 1.0, Some(1.0)), STEPS[0]);
        for used in [None, Some(0.9), Some(0.999), Some(1.001), Some(1.06)] {
            for tried in [1.0, 1.01] {
                let next = denser(1.0, 1.01, tried, used);
                assert!(next > 1.002 && next < 1.008, "{next} after {tried} used {used:?}");
            }
        }
    }
}
