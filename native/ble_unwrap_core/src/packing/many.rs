//! Thousands of charts: the few large ones by their cells, the others in rows around them.

use super::PackError;
use super::mask::Mask;
use super::outline::Outline;
use super::placement::{Dense, Place};
use super::refine::CLOSE;
use super::search::{Best, Search};
use super::shelves::{Shelves, Taken};
use crate::progress::Cancelled;

/// From so many charts on rows are tried whatever the quality.
pub(super) const ROWS_TRIED: usize = 600;
/// From so many charts on nothing but rows is tried.
pub(super) const ROWS_ONLY: usize = 8000;
/// From so many charts on the large ones are placed by their cells. With fewer, the search over all charts does the same as well.
const AROUND_LARGE: usize = 1500;
/// A chart is large if it has at least this share of the area of all: the corners of its box then matter.
const LARGE: f64 = 1.0 / 2000.0;
/// Most large charts: a placement of so many takes some ten milliseconds.
const MOST_LARGE: usize = 512;
/// Most attempts.
const ATTEMPTS: u32 = 60;
/// Until an attempt fits, each is less dense by this factor; if the first fits, each is denser by the inverse until one does not.
const STEP: f64 = 0.85;

/// The densest placement found in rows, by bisection of the density from `guess` on, up to `ceiling` texels to a unit of the chart plane. `fine`
/// is the search on the fine grid; `areas` are those of all charts, in any unit. Fewer charts than [`AROUND_LARGE`] are placed in rows alone.
/// `None` where there is no room.
///
/// # Errors
/// [`PackError::Cancelled`].
pub(super) fn in_rows(
    fine: &Search<'_>,
    areas: &[f64],
    margin: f64,
    [guess, ceiling]: [f64; 2],
) -> Result<Option<Dense>, PackError> {
    let solid: Vec<usize> = (0..fine.outlines.len()).filter(|&i| !fine.outlines[i].edges.is_empty()).collect();
    let total: f64 = areas.iter().sum();
    let mut large: Vec<usize> = solid.iter().copied().filter(|&i| areas[i] >= LARGE * total).collect();
    large.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    large.truncate(MOST_LARGE);
    large.sort_unstable();
    let rows = Rows::new(fine, &solid, &[], margin)?;
    let density = densest(guess, ceiling, |density| rows.fits(density))?;
    let mut best = density.map(|density| (density, rows));
    if !large.is_empty() && solid.len() >= AROUND_LARGE {
        let around = Rows::new(fine, &solid, &large, margin)?;
        // Only what is denser than rows alone is of use.
        let guess = best.as_ref().map_or(guess, |b| b.0 / STEP).min(ceiling);
        let density = densest(guess, ceiling, |density| around.fits(density))?;
        if let Some(density) = density.filter(|&d| best.as_ref().is_none_or(|b| d > b.0)) {
            best = Some((density, around));
        }
    }
    match best {
        Some((density, rows)) => rows.at(density),
        None => Ok(None),
    }
}

/// The greatest density found at which `fits` says yes: from `guess` downwards until one does, upwards until one does not, and between.
fn densest(
    guess: f64,
    ceiling: f64,
    mut fits: impl FnMut(f64) -> Result<bool, PackError>,
) -> Result<Option<f64>, PackError> {
    let (mut fitted, mut too_dense) = (None, f64::INFINITY);
    let mut density = guess.min(ceiling);
    for _ in 0..ATTEMPTS {
        if fits(density)? {
            fitted = Some(density);
            if density >= ceiling {
                break;
            }
        } else {
            too_dense = density;
        }
        density = match fitted {
            None => STEP * density,
            Some(fitted) if too_dense.is_infinite() => (fitted / STEP).min(ceiling),
            Some(fitted) if too_dense < CLOSE * fitted => break,
            Some(fitted) => (fitted * too_dense).sqrt(),
        };
    }
    Ok(fitted)
}

/// The large charts of [`Rows`] at one density.
struct Large {
    /// Where they are; `None` where there are none.
    best: Option<Best>,
    /// What the rows keep away from, and the width of its frame.
    taken: Option<(Mask, usize)>,
}

impl Large {
    fn taken(&self) -> Option<Taken<'_>> {
        self.taken.as_ref().map(|(mask, frame)| Taken { mask, frame: *frame })
    }
}

/// Large charts by their cells and the others in rows.
struct Rows<'a> {
    shelves: Shelves<'a>,
    fine: &'a Search<'a>,
    /// The large charts, their outlines and base angles.
    large: Vec<usize>,
    outlines: Vec<Outline>,
    turns: Vec<Vec<[f64; 2]>>,
}

impl<'a> Rows<'a> {
    fn new(fine: &'a Search<'a>, solid: &[usize], large: &[usize], margin: f64) -> Result<Self, Cancelled> {
        let others: Vec<usize> = solid.iter().copied().filter(|i| large.binary_search(i).is_err()).collect();
        let Search { outlines, turns, quarters, grid, progress, .. } = *fine;
        let shelves = Shelves::new(outlines, &others, turns, quarters, grid, margin, progress)?;
        let (outlines, turns) = large.iter().map(|&i| (outlines[i].clone(), turns[i].clone())).unzip();
        Ok(Self { shelves, fine, large: large.to_vec(), outlines, turns })
    }

    /// The large charts at a density, and what is taken then; `None` where they do not fit.
    fn placed(&self, density: f64) -> Result<Option<Large>, PackError> {
        let obstacles = self.fine.obstacles.as_ref();
        let taken = obstacles.map(|o| (o.mask.clone(), o.frame));
        if self.large.is_empty() {
            return Ok(Some(Large { best: None, taken }));
        }
        let search = Search {
            outlines: &self.outlines,
            turns: &self.turns,
            reach: self.fine.reach.clone(),
            obstacles: obstacles.cloned(),
            ..*self.fine
        };
        let Some(best) = search.once(density)? else { return Ok(None) };
        let (columns, rows) = (search.grid.columns, search.grid.rows);
        let (mut mask, frame) = taken.unwrap_or_else(|| (Mask::new(columns, rows), 0));
        let r = search.reach.cells() as isize;
        for (shape, at) in best.shapes.iter().zip(&best.layout.placed) {
            let Some(at) = at else { continue };
            let grown = shape.footprints[at.footprint].mask.dilated(&search.reach);
            let [x, y] = [at.x, at.y].map(|v| v as isize + frame as isize - r);
            mask.paste(&grown, x, y, mask.width());
        }
        Ok(Some(Large { best: Some(best), taken: Some((mask, frame)) }))
    }

    fn fits(&self, density: f64) -> Result<bool, PackError> {
        let Some(large) = self.placed(density)? else { return Ok(false) };
        Ok(self.shelves.fits(density, large.taken())?)
    }

    fn at(&self, density: f64) -> Result<Option<Dense>, PackError> {
        let Some(large) = self.placed(density)? else { return Ok(None) };
        let Some(others) = self.shelves.at(density, large.taken())? else { return Ok(None) };
        let mut places: Vec<Option<Place>> = vec![None; self.fine.outlines.len()];
        if let Some(best) = large.best {
            for (&i, place) in self.large.iter().zip(best.places(self.fine.grid)) {
                places[i] = place;
            }
        }
        for (i, place) in others {
            places[i] = Some(place);
        }
        Ok(Some(Dense { places, density }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bisection_ends_just_below_what_is_too_dense() {
        for threshold in [1e-3, 0.7, 1.0, 9.0] {
            let found = densest(1.0, 100.0, |d| Ok(d <= threshold)).expect("not cancelled").expect("fits");
            assert!(found <= threshold && found > 0.999 * threshold, "{found} of {threshold}");
        }
        assert_eq!(densest(1.0, 2.0, |_| Ok(true)), Ok(Some(2.0)));
        assert_eq!(densest(1.0, 2.0, |_| Ok(false)), Ok(None));
    }
}
