//! The greatest density at which all charts fit: a first guess, a bracket, then a search over orders.
//!
//! Attempts fill the grid upwards and may overshoot its top, so that each tells *how much* too dense
//! or too loose it was: area goes with the square of the density, so the next guess is the density
//! divided by the root of the height used. Near the optimum the height is a noisy function of the
//! order of placement, and the search climbs on that: variations of the best order so far, at a
//! density slightly above the best that fitted.

use rayon::prelude::*;

use super::mask::Reach;
use super::occupancy::Occupancy;
use super::order::Strategy;
use super::outline::Outline;
use super::place::{Layout, place};
use super::pose::base_turns;
use super::shape::{SAFETY_TEXELS, Shape};
use super::{PackError, PackSettings, Quality, Rotation};
use crate::{Progress, Stage};

/// So many of the largest charts are tried in more angles.
const LARGE: usize = 24;
/// Attempts in a round while the density is bracketed, when strategies are compared, and in each round
/// of variations. They run in parallel; fixed, so that results do not depend on the number of threads.
const BRACKETING: usize = 2;
const COMPARED: usize = 8;
const VARIED: usize = 4;
/// From so many charts on, search rows are shared by similar footprints.
const MANY: usize = 600;
/// Attempts made before giving up shrinking; each without a fit takes at least a tenth of the density.
const SHRINKS: u32 = 80;
/// Share of the texture charts cover in the first guess, with half a margin around each.
const FIRST_FILL: f64 = 0.8;
/// Greatest and least step of density above the best fit.
const STEP: f64 = 0.003;
const LEAST_STEP: f64 = 0.0004;
/// An attempt that uses the height to this share is a start for variations.
const NEAR: f64 = 0.015;
/// Rounds without a better fit before the step is halved.
const PATIENCE: usize = 3;

/// The grid laid over the texture, half a margin from its border.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Texels a cell.
    pub(super) cell: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// The best placement found.
pub(super) struct Best {
    pub(super) shapes: Vec<Shape>,
    pub(super) layout: Layout,
    /// Texels to a unit of the chart plane.
    pub(super) density: f64,
}

impl Grid {
    /// Cells fine enough for `charts` charts; where there is a margin, a whole number of cells make it.
    fn new(settings: &PackSettings, charts: usize) -> Result<Self, PackError> {
        let (width, height) = (f64::from(settings.width), f64::from(settings.height));
        let margin = settings.margin_texels;
        let inner = width.min(height) - margin;
        // A texel must be left for the chart.
        if !(inner >= 1.0) {
            return Err(PackError::MarginTooLarge { margin, width: settings.width, height: settings.height });
        }
        // About 100 cells across a chart: the raster then wastes 1 %; below 1024 rows time hardly falls.
        let (least, most) = match settings.quality {
            Quality::Fast => (1024.0, 2048.0),
            Quality::High => (2048.0, 4096.0),
        };
        let across = (std::env::var("KK").map_or(100.0, |v| v.parse::<f64>().unwrap()) * (charts as f64).sqrt())
            .clamp(least, most);
        let larger = width.max(height);
        // Quarter texels at the finest.
        let mut cell = (larger / across).max(0.25);
        if margin > 0.0 {
            cell = if margin >= cell { margin / (margin / cell - 1e-9).ceil() } else { margin };
        }
        cell = cell.max(larger / Occupancy::WIDEST as f64).min(inner);
        let cells = |size: f64| (((size - margin) / cell + 1e-9).floor() as usize).max(1);
        Ok(Self { cell, columns: cells(width), rows: cells(height) })
    }
}

/// What a search needs to know, fixed throughout.
struct Search<'a> {
    outlines: &'a [Outline],
    turns: Vec<Vec<[f64; 2]>>,
    quarters: bool,
    grid: Grid,
    reach: Reach,
    progress: &'a Progress,
}

/// One attempt's outcome: height used over height there is, and the layout.
struct Attempt {
    used: f64,
    layout: Layout,
    strategy: Strategy,
}

impl Search<'_> {
    fn shapes(&self, density: f64) -> Vec<Shape> {
        let shape = |i: usize| Shape::new(&self.outlines[i], &self.turns[i], self.quarters, density, self.grid.cell);
        (0..self.outlines.len()).into_par_iter().map(shape).collect()
    }

    /// Tries all strategies; the one that uses least height, ties by index.
    fn best_of(&self, shapes: &[Shape], strategies: Vec<Strategy>) -> Result<Option<Attempt>, PackError> {
        let Grid { columns, rows, .. } = self.grid;
        let cap = rows + rows / 2;
        let cells: usize = shapes.iter().map(|s| s.cells).sum();
        let alike = shapes.len() >= MANY;
        let attempt = |strategy: Strategy| {
            let order = strategy.order();
            let layout = place(shapes, &order, [columns, cap], &self.reach, strategy.goal, alike, self.progress)?;
            let used = if layout.missing == 0 {
                layout.rows as f64 / rows as f64
            } else {
                1.5 * cells as f64 / (cells - layout.missing).max(cells / 100 + 1) as f64
            };
            Ok(Attempt { used, layout, strategy })
        };
        let all: Vec<Attempt> = strategies.into_par_iter().map(attempt).collect::<Result<_, PackError>>()?;
        Ok(all.into_iter().reduce(|a, b| if b.used < a.used { b } else { a }))
    }
}

/// Places outlines at the greatest density found.
///
/// # Errors
/// [`PackError::MarginTooLarge`], [`PackError::TooManyCharts`], [`PackError::Cancelled`].
pub(super) fn densest(
    outlines: &[Outline],
    settings: &PackSettings,
    progress: &Progress,
) -> Result<(Best, Grid), PackError> {
    let n = outlines.len();
    let grid = Grid::new(settings, n)?;
    let largest = outlines.iter().map(|o| o.extent).fold(0.0, f64::max);
    let area = |i: usize| outlines[i].area * (outlines[i].extent / largest).powi(2);
    let mut by_area: Vec<usize> = (0..n).collect();
    by_area.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    let mut large = vec![false; n];
    by_area.iter().take(LARGE).for_each(|&i| large[i] = true);
    let turns = |i: usize| base_turns(&outlines[i], settings.rotation, large[i], n == 1);
    let search = Search {
        outlines,
        turns: (0..n).into_par_iter().map(turns).collect(),
        quarters: settings.rotation != Rotation::None,
        grid,
        reach: Reach::new(settings.margin_texels / grid.cell),
        progress,
    };
    if !(largest > 0.0) {
        return search.without_extent(settings);
    }
    // From here on densities are texels to the largest extent: no overflow at any scale of input.
    let ceiling = f64::from(settings.width).hypot(f64::from(settings.height));
    let mut density = first_guess((0..n).map(area), settings, grid).min(ceiling);
    let budget = attempts(n, grid, settings.quality);
    let mut made = 0;
    let mut best: Option<(f64, Best)> = None;
    let mut lead: Option<(f64, Strategy)> = None;
    let mut too_dense = f64::INFINITY;
    let mut near = false;
    let (mut step, mut idle, mut shrinks) = (STEP, 0, 0);
    let mut shapes = search.shapes(density / largest);
    while made < budget && shrinks < SHRINKS {
        progress.advance(Stage::Pack, made as f64 / budget as f64);
        let strategies = match &lead {
            None => Strategy::portfolio(
                &shapes,
                if n == 1 {
                    1
                } else if near {
                    COMPARED
                } else {
                    BRACKETING
                },
            ),
            Some((used, lead)) => {
                let keep = used.is_infinite().then(|| lead.clone());
                let varied = (0..VARIED - usize::from(keep.is_some())).map(|k| lead.varied((made + k) as u64));
                varied.chain(keep).collect()
            }
        };
        let count = strategies.len();
        let Some(Attempt { used, layout, strategy }) = search.best_of(&shapes, strategies)? else { break };
        let before = density;
        if std::env::var("PACKDBG").is_ok() {
            eprintln!(
                "made {made}+{count} d {density:.3} used {used:.4} step {step} lead {:?} cell {} budget {budget}",
                lead.as_ref().map(|l| l.0),
                grid.cell
            );
        }
        if used <= 1.0 {
            // Every density tried lies above the best that fitted: this one is better.
            best = Some((density, Best { shapes, layout, density: density / largest }));
            near = used > 1.0 - 2.0 * NEAR;
            if used > 1.0 - NEAR && count > BRACKETING {
                lead = Some((f64::INFINITY, strategy));
            }
            (step, idle) = ((2.0 * step).min(STEP), 0);
            density = (density / used.sqrt() * (1.0 + step)).min(ceiling);
            // While bracketing, do not go back to what was too dense.
            if lead.is_none() && before < too_dense && density >= too_dense {
                density = (before * too_dense).sqrt();
            }
        } else if let Some((fitted, _)) = &best {
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
            let nearer = (fitted * density).sqrt().min(fitted * (1.0 + 4.0 * step));
            density = nearer.max(fitted * (1.0 + LEAST_STEP));
            lead = lead.map(|l| (f64::INFINITY, l.1));
        } else {
            // Not a part of the search yet.
            if shapes.iter().all(|s| s.is_speck || s.footprints.is_empty()) {
                break;
            }
            too_dense = density;
            shrinks += 1;
            density *= (0.998 / used.sqrt()).clamp(0.5, 0.995 - 0.01 * f64::from(shrinks.min(9)));
            shapes = search.shapes(density / largest);
            continue;
        }
        made += count;
        if density == before {
            break;
        }
        shapes = search.shapes(density / largest);
    }
    let too_many = PackError::TooManyCharts {
        charts: n,
        margin: settings.margin_texels,
        width: settings.width,
        height: settings.height,
    };
    Ok((best.ok_or(too_many)?.1, grid))
}

/// How many attempts the search may make.
fn attempts(charts: usize, grid: Grid, quality: Quality) -> usize {
    if charts == 1 {
        return 24;
    }
    // Measured: an attempt costs about so much, in 10 µs on one core.
    let cost = charts as f64 * grid.rows.max(grid.columns) as f64 / 1.5e5;
    let (work, least, most) = match quality {
        Quality::Fast => (std::env::var("WW").map_or(80.0, |v| v.parse::<f64>().unwrap()), 16.0, 64.0),
        Quality::High => (800.0, 64.0, 800.0),
    };
    (work / cost).clamp(least, most) as usize
}

impl Search<'_> {
    /// Points only: each gets a cell, the density means nothing.
    fn without_extent(&self, settings: &PackSettings) -> Result<(Best, Grid), PackError> {
        let shapes = self.shapes(1.0);
        let attempt = self.best_of(&shapes, Strategy::portfolio(&shapes, 1))?;
        let n = shapes.len();
        match attempt {
            Some(a) if a.used <= 1.0 => Ok((Best { shapes, layout: a.layout, density: 1.0 }, self.grid)),
            _ => Err(PackError::TooManyCharts {
                charts: n,
                margin: settings.margin_texels,
                width: settings.width,
                height: settings.height,
            }),
        }
    }
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
mod scratch {
    use super::*;
    use crate::packing::PackItem;
    use nalgebra::Point2;
    fn load(path: &str) -> Vec<(Vec<Point2<f64>>, Vec<[u32; 3]>)> {
        let text = std::fs::read_to_string(path).unwrap();
        let mut it = text.split_ascii_whitespace();
        let n: usize = it.next().unwrap().parse().unwrap();
        (0..n)
            .map(|_| {
                let nv: usize = it.next().unwrap().parse().unwrap();
                let nt: usize = it.next().unwrap().parse().unwrap();
                let p = (0..nv)
                    .map(|_| Point2::new(it.next().unwrap().parse().unwrap(), it.next().unwrap().parse().unwrap()))
                    .collect();
                let t = (0..nt).map(|_| [0; 3].map(|_: u32| it.next().unwrap().parse().unwrap())).collect();
                (p, t)
            })
            .collect()
    }
    #[test]
    fn scratch_run() {
        let path = std::env::var("PACKIN").unwrap();
        let charts = load(&path);
        let items: Vec<PackItem> = charts.iter().map(|(p, t)| PackItem { points: p, triangles: t }).collect();
        let mut s = PackSettings::default();
        let get = |k: &str, d: f64| std::env::var(k).ok().map_or(d, |v| v.parse().unwrap());
        s.width = get("SIZE", 1024.0) as u32;
        s.height = s.width;
        s.margin_texels = get("MARGIN", 2.0);
        if std::env::var("HIGH").is_ok() {
            s.quality = Quality::High;
        }
        let t = std::time::Instant::now();
        let r = crate::packing::pack(&items, &s, &Progress::new()).unwrap();
        eprintln!(
            "{path} charts {} eff {:.4} specks {} time {:.3}",
            items.len(),
            r.efficiency,
            r.specks,
            t.elapsed().as_secs_f64()
        );
        if let Ok(out) = std::env::var("PACKOUT") {
            let mut o = String::new();
            for (k, (p, t)) in charts.iter().enumerate() {
                for tri in t {
                    o += &format!("{k}");
                    for &v in tri {
                        let q = r.poses[k].texel(p[v as usize]);
                        o += &format!(" {} {}", q.x / f64::from(s.width), q.y / f64::from(s.height));
                    }
                    o += "\n";
                }
            }
            std::fs::write(out, o).unwrap();
        }
    }
}
