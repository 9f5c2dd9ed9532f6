//! Charts spread over several tiles of a texture, or packed at a density that is given.
//!
//! Charts go one after the other, large ones first, to the tile with the most room left: the rule of longest processing time (Graham:
//! Bounds on multiprocessing timing anomalies, SIAM Journal on Applied Mathematics 17(2), 1969), which leaves tiles about equally full.
//! Each tile is packed by itself, as densely as it can be. The density of all is that of the tile in which charts are packed
//! the least densely; a few charts are moved from that one to the one in which they are packed the most densely, as long as this helps. Then every
//! tile is packed at the density that is common to all. For a given density the number of tiles is found by bisection, from what the area of
//! the charts takes at least.

use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::density::{self, SAME_SCALE};
use super::many::ROWS_ONLY;
use super::obstacles;
use super::outline::Outline;
use super::placement::{Dense, Place};
use super::raster::rasterise;
use super::shape::SAFETY_TEXELS;
use super::shortfall::Shortfall;
use super::tile::Tile;
use super::{Constraints, PackError, PackSettings, Quality};
use crate::progress::{Cancelled, Progress, Stage};

/// Share of the room in tiles that charts with half a margin around them are expected to take. It only weighs margins against areas when charts are
/// shared out.
const EXPECTED_FILL: f64 = 0.75;
/// Moves of a chart from one tile to another that are tried for a number of tiles, by quality. A move costs two packings of a tile.
const MOVES: [usize; 3] = [6, 12, 24];
/// Moves in a row that did not help, after which no more are tried.
const PATIENCE: usize = 2;
/// From so many charts in a tile on, what a move gains is less than what the two packings of hundreds of charts are worth.
const MANY: usize = 100;
/// Where the least dense tile is packed at this share of the density wanted or less, a few moves do not help.
const HOPELESS: f64 = 0.93;
/// Densities of two tiles that differ by less than this share are about what packing the same charts anew may change.
const BALANCED: f64 = 0.004;
/// Numbers of tiles that are tried at most to find the least that suffices: bisection of 100 takes seven, and the first guess may be wrong twice.
const NUMBERS: usize = 10;
/// Rounds in which tiles are packed at a common density, each of which is lower than the one before by this share more. Nearly always the
/// first one suffices: each tile has been packed more densely before.
const ROUNDS: u32 = 12;
const LOWER: f64 = 0.01;
/// Rounds in which tiles that cannot hold what was given to them get no charts any more.
const CLOSINGS: usize = 4;
/// So many of the largest charts are looked at for one that is too large for any tile.
const LARGEST: usize = 64;
/// By how much more than single precision moves a point charts are kept apart: rasters, too, are exact only to a 10,000th of a texel.
const ROUNDED: f64 = 1.0625;
/// Share of the area of charts that certainly is taken: where they lie upon themselves, it is known only to a few per cent.
const CERTAIN: f64 = 0.9;
/// So many of the largest charts are rastered to find whether they lie upon themselves, on so many cells along their longer side.
const RASTERED: usize = 256;
const ACROSS: f64 = 64.0;
/// Charts between two looks at whether to stop: a few milliseconds of work.
const BETWEEN_CHECKS: usize = 4096;

/// Charts in tiles.
pub(super) struct Spread {
    /// Where each chart lies in its tile.
    pub(super) dense: Dense,
    /// The tile of each chart.
    pub(super) tiles: Vec<Tile>,
    /// What does not fit, of a density that was asked for.
    pub(super) shortfall: Option<Shortfall>,
}

impl Spread {
    /// All charts in the first tile.
    pub(super) fn on_one_tile(dense: Dense) -> Self {
        let tiles = vec![Tile::near([0.0; 2], 1); dense.places.len()];
        Self { dense, tiles, shortfall: None }
    }
}

/// Spreads outlines over the tiles of the settings, at the density that is given or the greatest that is found.
///
/// # Errors
/// [`PackError::TooManyCharts`], [`PackError::NoRoomBetweenObstacles`], [`PackError::Cancelled`], and [`PackError::TooLarge`] where a scale
/// among the constraints does not fit.
pub(super) fn spread(
    outlines: &[Outline],
    constraints: &Constraints<'_>,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Spread, PackError> {
    let wanted = constraints.scale.or(settings.texel_density);
    let packer = Packer::new(outlines, constraints, settings, progress)?;
    let found = match wanted {
        Some(wanted) => packer.fewest(wanted)?,
        None => packer.shared(packer.most, None)?,
    };
    let reached = found.density();
    if wanted.is_some_and(|wanted| reached >= wanted * (1.0 - SAME_SCALE)) {
        return Ok(packer.placed(found, wanted.unwrap_or(reached), None));
    }
    // Where there are obstacles, another tile may have more room for it.
    let is_chart_too_large = constraints.obstacles.is_empty() && found.is_one_chart_the_bound();
    let tiles = found.loads.len();
    if let Some(wanted) = constraints.scale {
        return Err(PackError::TooLarge { shrunk: reached / wanted });
    }
    let mut found = packer.at_common_density(found)?;
    if is_chart_too_large {
        // More tiles do not help; fewer may do.
        let fewer = packer.fewest(found.density())?;
        if fewer.density() >= found.density() && fewer.loads.len() < tiles {
            found = fewer;
        }
    }
    let reached = found.density();
    let shortfall = match wanted.filter(|&wanted| reached < wanted * (1.0 - SAME_SCALE)) {
        Some(wanted) => {
            let by_area = (tiles as f64 * (wanted / reached).powi(2)).ceil() as usize;
            let is_vain = is_chart_too_large || packer.has_chart_too_large(wanted)?;
            let needed = (!is_vain).then_some(by_area.max(settings.tiles + 1));
            Some(Shortfall { wanted, reached, tiles: settings.tiles, needed })
        }
        None => None,
    };
    Ok(packer.placed(found, reached, shortfall))
}

/// The charts of one tile, packed.
#[derive(Clone)]
struct Load {
    tile: Tile,
    /// Numbers of charts, ascending.
    charts: Vec<usize>,
    /// Where they are; nowhere, where they cannot be packed at all.
    places: Vec<Option<Place>>,
    /// At which density, in texels to a unit of the chart plane: 0 where they cannot be packed, infinite where any will do, because there are
    /// none or all are points.
    density: f64,
}

/// Tiles that hold all charts between them.
struct Shared {
    loads: Vec<Load>,
}

impl Shared {
    /// The density of the tile that is packed the least densely.
    fn density(&self) -> f64 {
        self.loads.iter().map(|load| load.density).fold(f64::INFINITY, f64::min)
    }

    /// The tile that is packed the least densely, the first of several.
    fn tightest(&self) -> Option<usize> {
        (0..self.loads.len()).reduce(|a, b| if self.loads[b].density < self.loads[a].density { b } else { a })
    }

    /// Whether a chart that has a tile to itself keeps the density down, so that more tiles do not help.
    fn is_one_chart_the_bound(&self) -> bool {
        let tightest = self.tightest().map(|tile| &self.loads[tile]);
        tightest.is_some_and(|load| load.charts.len() == 1 && load.density.is_finite())
    }
}

/// What packs charts into tiles.
struct Packer<'a> {
    outlines: &'a [Outline],
    constraints: &'a Constraints<'a>,
    settings: &'a PackSettings,
    /// The same, with what distances need in addition because of rounding in tiles far from the origin.
    inner: PackSettings,
    border: f64,
    /// How many tiles charts are spread over at most.
    most: usize,
    /// Charts that take room.
    solid: Vec<usize>,
    /// Area of each chart in its plane, what lies upon itself counted once.
    area: Vec<f64>,
    /// Area of each tile that no obstacle covers, in texels.
    room: Vec<f64>,
    /// Packings of a tile that are done, by which progress is told, since how many there will be is not known.
    done: AtomicUsize,
    progress: &'a Progress,
}

impl<'a> Packer<'a> {
    fn new(
        outlines: &'a [Outline],
        constraints: &'a Constraints<'a>,
        settings: &'a PackSettings,
        progress: &'a Progress,
    ) -> Result<Self, PackError> {
        let size = [settings.width, settings.height].map(f64::from);
        let further = beyond_safety(settings);
        // Beyond the border there may be another tile, to whose charts the whole margin is kept.
        let border = constraints.border(settings).max(0.5 * settings.margin_texels) + further;
        // Along both axes for both charts.
        let inner =
            PackSettings { margin_texels: settings.margin_texels + further * 8.0f64.sqrt(), ..settings.clone() };
        if further > 0.0 {
            Constraints { border_texels: Some(border), ..*constraints }.check(&inner)?;
        }
        let mut room = Vec::with_capacity(settings.tiles);
        for tile in Tile::first(settings.tiles) {
            let obstacles = obstacles::in_tile(constraints.obstacles, tile, settings);
            room.push(size[0] * size[1] - obstacles::covered(&obstacles, size, progress)?);
        }
        let solid: Vec<usize> = (0..outlines.len()).filter(|&i| !outlines[i].edges.is_empty()).collect();
        let area = areas(outlines, &solid, progress)?;
        // More tiles than charts are of use only where obstacles may fill some.
        let all = settings.tiles;
        let most = if constraints.obstacles.is_empty() { solid.len().clamp(1, all) } else { all };
        let done = AtomicUsize::new(0);
        Ok(Self { outlines, constraints, settings, inner, border, most, solid, area, room, done, progress })
    }

    /// Charts at a density in as few tiles as found; where they do not fit into all that there are, as densely as found.
    fn fewest(&self, density: f64) -> Result<Shared, PackError> {
        let most = self.most;
        let area = CERTAIN * self.area.iter().sum::<f64>() * density * density;
        let (mut least, mut room) = (1, self.room.first().copied().unwrap_or(0.0));
        while least < most && room < area {
            room += self.room.get(least).copied().unwrap_or(0.0);
            least += 1;
        }
        // All numbers below `least` are known to be too few; `best` is the least that is known to do.
        let mut best: Option<Shared> = None;
        let mut number = least;
        for _ in 0..NUMBERS {
            let found = self.shared(number, Some(density))?;
            let reached = found.density();
            if reached >= density * (1.0 - SAME_SCALE) {
                best = Some(found);
                if number == least {
                    break;
                }
                number = (least + number) / 2;
            } else {
                least = number + 1;
                let enough = best.as_ref().map_or(most, |best| best.loads.len());
                if number == most {
                    return Ok(found);
                }
                if least >= enough && best.is_some() {
                    break;
                }
                let guess = (number as f64 * (density / reached).powi(2)).ceil();
                number = (guess as usize).clamp(least, most);
                if best.is_some() {
                    number = number.min((least + enough) / 2);
                }
            }
        }
        match best {
            Some(best) => Ok(best),
            None => self.shared(most, Some(density)),
        }
    }

    /// Charts in the first tiles, packed as densely as found, up to `ceiling`.
    fn shared(&self, tiles: usize, ceiling: Option<f64>) -> Result<Shared, PackError> {
        let mut room = self.room[..tiles].to_vec();
        let weights = self.weights(room.iter().sum(), ceiling);
        for _ in 0..CLOSINGS {
            let shares = self.shares(&room, &weights)?;
            let mut found = Shared { loads: Vec::with_capacity(tiles) };
            let packed: Vec<Result<Load, PackError>> = Tile::first(tiles)
                .zip(shares)
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|(tile, charts)| self.packed(tile, charts, ceiling))
                .collect();
            let mut is_closed = false;
            for result in packed {
                let load = result?;
                if load.density <= 0.0 {
                    room[load.tile.number()] = 0.0;
                    is_closed = true;
                }
                found.loads.push(load);
            }
            if !is_closed {
                self.balance(&mut found, &weights, ceiling, tiles == self.most)?;
                return Ok(found);
            }
            if room.iter().all(|&room| room <= 0.0) {
                break;
            }
        }
        if tiles < self.most {
            // With more tiles it may do.
            let loads =
                Tile::first(tiles).map(|tile| Load { tile, charts: Vec::new(), places: Vec::new(), density: 0.0 });
            return Ok(Shared { loads: loads.collect() });
        }
        Err(self.no_room())
    }

    /// Texels that each chart takes, with its share of the margins, at a density that is given or expected to fill the room there is; 0 for charts
    /// that take none. A chart of area a and extent e counts as a rectangle of e by a / e.
    fn weights(&self, room: f64, density: Option<f64>) -> Vec<f64> {
        let gap = self.inner.margin_texels + 2.0 * SAFETY_TEXELS;
        let sides = |i: usize| {
            let extent = self.outlines[i].extent;
            [extent, if extent > 0.0 { self.area[i] / extent } else { 0.0 }]
        };
        let (mut a, mut b) = (0.0, 0.0);
        for &i in &self.solid {
            a += self.area[i];
            b += gap * sides(i).iter().sum::<f64>();
        }
        let density = density.unwrap_or_else(|| {
            // a s² + b s + c = 0.
            let c = gap * gap * self.solid.len() as f64 - EXPECTED_FILL * room;
            let root = (b * b - 4.0 * a * c).max(0.0).sqrt() - b;
            if root > 0.0 && a > 0.0 { 0.5 * root / a } else { 0.0 }
        });
        let mut weights = vec![0.0; self.outlines.len()];
        for &i in &self.solid {
            let [long, short] = sides(i).map(|side| side * density + gap);
            // A speck is a texel.
            weights[i] = (long * short).max(1.0);
        }
        weights
    }

    /// Which charts go into which tile: each to the tile with the most room left, the first of several.
    fn shares(&self, room: &[f64], weights: &[f64]) -> Result<Vec<Vec<usize>>, Cancelled> {
        let mut order = self.solid.clone();
        order.par_sort_unstable_by(|&a, &b| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)));
        let mut left = room.to_vec();
        let mut shares = vec![Vec::new(); room.len()];
        for (number, &chart) in order.iter().enumerate() {
            if number.is_multiple_of(BETWEEN_CHECKS) {
                self.progress.check()?;
            }
            let roomiest = |a: usize, b: usize| {
                // What has no room at all is the last resort, however little the others have left.
                let is_better = (room[b] > 0.0, left[b]) > (room[a] > 0.0, left[a]);
                if is_better { b } else { a }
            };
            let Some(tile) = (0..room.len()).reduce(roomiest) else { break };
            left[tile] -= weights[chart];
            shares[tile].push(chart);
        }
        for share in &mut shares {
            share.sort_unstable();
        }
        Ok(shares)
    }

    /// Charts in a tile, as densely as found, up to `ceiling`.
    fn packed(&self, tile: Tile, charts: Vec<usize>, ceiling: Option<f64>) -> Result<Load, PackError> {
        self.progress.check()?;
        if charts.is_empty() {
            return Ok(Load { tile, charts, places: Vec::new(), density: f64::INFINITY });
        }
        let outlines = self.outlines_of(&charts)?;
        let obstacles = obstacles::in_tile(self.constraints.obstacles, tile, self.settings);
        let constraints = Constraints { border_texels: Some(self.border), scale: ceiling, obstacles: &obstacles };
        let found = density::densest_up_to(&outlines, &constraints, &self.inner, self.progress);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if self.settings.tiles > 1 {
            // Every tile is packed twice, and a few are again.
            self.progress.advance(Stage::Pack, done as f64 / (done + 2 * self.most) as f64);
        }
        match found {
            Ok((dense, _)) => {
                let is_of_points = outlines.iter().all(|outline| outline.extent <= 0.0);
                let density = if is_of_points { f64::INFINITY } else { dense.density };
                Ok(Load { tile, charts, places: dense.places, density })
            }
            Err(PackError::TooManyCharts { .. } | PackError::NoRoomBetweenObstacles { .. }) => {
                Ok(Load { tile, charts, places: Vec::new(), density: 0.0 })
            }
            Err(error) => Err(error),
        }
    }

    fn outlines_of(&self, charts: &[usize]) -> Result<Vec<Outline>, Cancelled> {
        let outline = |&i: &usize| {
            self.progress.check()?;
            Ok(self.outlines[i].clone())
        };
        charts.par_iter().map(outline).collect()
    }

    /// The charts of a tile at a lower density: where they are, if that is possible, else packed anew.
    fn thinned(&self, load: &Load, density: f64) -> Result<Load, PackError> {
        // One chart is fitted without a search, and boxes in rows are as fast.
        if (2..ROWS_ONLY).contains(&load.charts.len()) {
            let obstacles = obstacles::in_tile(self.constraints.obstacles, load.tile, self.settings);
            let constraints =
                Constraints { border_texels: Some(self.border), scale: Some(density), obstacles: &obstacles };
            let outlines = self.outlines_of(&load.charts)?;
            let thinned = density::thinned(&outlines, &load.places, &constraints, &self.inner, self.progress)?;
            if let Some(Dense { places, density }) = thinned {
                return Ok(Load { tile: load.tile, charts: load.charts.clone(), places, density });
            }
        }
        self.packed(load.tile, load.charts.clone(), Some(density))
    }

    /// Moves charts from the tile that is packed the least densely to the one that is so the most, where that makes the former denser than both were.
    fn balance(
        &self,
        found: &mut Shared,
        weights: &[f64],
        ceiling: Option<f64>,
        is_last: bool,
    ) -> Result<(), PackError> {
        let moves = match self.settings.quality {
            Quality::Fast => MOVES[0],
            Quality::Normal => MOVES[1],
            Quality::High => MOVES[2],
        };
        let mut tried: HashSet<(usize, Tile)> = HashSet::new();
        let mut idle = 0;
        for _ in 0..moves {
            let Some(tight) = found.tightest() else { break };
            let density = found.loads[tight].density;
            let is_reached = ceiling.is_some_and(|ceiling| density >= ceiling * (1.0 - SAME_SCALE));
            let is_hopeless = !is_last && ceiling.is_some_and(|ceiling| density < HOPELESS * ceiling);
            let is_movable = (2..MANY).contains(&found.loads[tight].charts.len());
            if idle >= PATIENCE || !is_movable || is_reached || is_hopeless {
                break;
            }
            let weight = |load: &Load| load.charts.iter().map(|&i| weights[i]).sum::<f64>();
            let tight_weight = weight(&found.loads[tight]);
            // A tile at the ceiling, or with nothing but points, may have room for more: as much as if it could be filled like the tight one.
            let could = |load: &Load| {
                let is_bound = ceiling.is_some_and(|ceiling| load.density >= ceiling * (1.0 - SAME_SCALE));
                if !is_bound && load.density.is_finite() {
                    return load.density;
                }
                let [room, tight_room] = [load, &found.loads[tight]].map(|load| self.room[load.tile.number()].max(1.0));
                let by_fill = density * (tight_weight / tight_room * room / weight(load).max(1.0)).sqrt();
                by_fill.max(ceiling.unwrap_or(0.0))
            };
            let looser = |a: usize, b: usize| if could(&found.loads[b]) > could(&found.loads[a]) { b } else { a };
            let Some(loose) = (0..found.loads.len()).filter(|&k| k != tight).reduce(looser) else { break };
            let loose_density = could(&found.loads[loose]);
            if loose_density <= density * (1.0 + BALANCED) {
                break;
            }
            // What makes both equally dense if both stay as full: weights over squared densities are the same then.
            let loose_weight = weight(&found.loads[loose]);
            let (a, b) = (tight_weight * density * density, loose_weight * loose_density * loose_density);
            let ideal = (b * tight_weight - a * loose_weight) / (a + b);
            let to = found.loads[loose].tile;
            let off = |i: usize| (weights[i] - ideal).abs();
            let candidates = found.loads[tight].charts.iter().copied();
            let candidates = candidates.filter(|&i| weights[i] < 2.0 * ideal && !tried.contains(&(i, to)));
            let Some(chart) = candidates.reduce(|a, b| if off(b) < off(a) { b } else { a }) else { break };
            tried.insert((chart, to));
            let from: Vec<usize> = found.loads[tight].charts.iter().copied().filter(|&i| i != chart).collect();
            let mut into = found.loads[loose].charts.clone();
            into.insert(into.partition_point(|&i| i < chart), chart);
            let from_tile = found.loads[tight].tile;
            let (from, into) = rayon::join(|| self.packed(from_tile, from, ceiling), || self.packed(to, into, ceiling));
            let (from, into) = (from?, into?);
            if from.density.min(into.density) > density {
                (found.loads[tight], found.loads[loose]) = (from, into);
                idle = 0;
            } else {
                idle += 1;
            }
        }
        Ok(())
    }

    /// All tiles at the density of the one that is packed the least densely, or a little less.
    fn at_common_density(&self, found: Shared) -> Result<Shared, PackError> {
        let mut common = found.density();
        for round in 0..ROUNDS {
            if common.is_infinite() {
                return Ok(found);
            }
            let is_at_common =
                |load: &Load| load.density.is_infinite() || (load.density / common - 1.0).abs() <= SAME_SCALE;
            let packed: Vec<Result<Load, PackError>> = found
                .loads
                .par_iter()
                .map(|load| {
                    if is_at_common(load) {
                        return Ok(load.clone());
                    }
                    self.thinned(load, common)
                })
                .collect();
            let loads: Vec<Load> = packed.into_iter().collect::<Result<_, PackError>>()?;
            if loads.iter().all(is_at_common) {
                return Ok(Shared { loads });
            }
            let lower = common * (1.0 - LOWER * f64::from(round));
            let least = Shared { loads }.density();
            common = if least > 0.5 * common { least.min(lower) } else { 0.5 * lower };
        }
        Err(self.no_room())
    }

    /// Why charts cannot be placed at all.
    fn no_room(&self) -> PackError {
        let PackSettings { width, height, margin_texels: margin, .. } = *self.settings;
        let charts = self.outlines.len();
        if self.constraints.obstacles.is_empty() {
            PackError::TooManyCharts { charts, margin, width, height }
        } else {
            PackError::NoRoomBetweenObstacles { charts, margin, width, height }
        }
    }

    /// Whether one of the largest charts has not that density even if it has a tile to itself.
    fn has_chart_too_large(&self, density: f64) -> Result<bool, PackError> {
        let shorter = f64::from(self.settings.width.min(self.settings.height)) - 2.0 * self.border;
        let mut large: Vec<usize> =
            self.solid.iter().copied().filter(|&i| self.outlines[i].extent * density > shorter).collect();
        large.sort_by(|&a, &b| self.outlines[b].extent.total_cmp(&self.outlines[a].extent).then(a.cmp(&b)));
        for &chart in large.iter().take(LARGEST) {
            let constraints = Constraints { border_texels: Some(self.border), scale: Some(density), obstacles: &[] };
            let outlines = [self.outlines[chart].clone()];
            let (dense, _) = density::densest_up_to(&outlines, &constraints, &self.inner, self.progress)?;
            if dense.density < density * (1.0 - SAME_SCALE) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The charts by number.
    fn placed(&self, found: Shared, density: f64, shortfall: Option<Shortfall>) -> Spread {
        let mut places = vec![None; self.outlines.len()];
        let mut tiles = vec![Tile::near([0.0; 2], 1); self.outlines.len()];
        for load in found.loads {
            for (&chart, place) in load.charts.iter().zip(load.places) {
                places[chart] = place;
                tiles[chart] = load.tile;
            }
        }
        // With points only, any density will do.
        let density = if density.is_finite() { density } else { 1.0 };
        Spread { dense: Dense { places, density }, tiles, shortfall }
    }
}

/// Area of each outline, what lies upon itself counted once: exactly where nothing does, else as the cells of a raster that are touched, of so
/// many charts as [`RASTERED`] says, and the box for others.
fn areas(outlines: &[Outline], solid: &[usize], progress: &Progress) -> Result<Vec<f64>, Cancelled> {
    let boxed = |i: &usize| {
        progress.check()?;
        let outline = &outlines[*i];
        let size = [0, 1].map(|k| {
            let side = |p: &nalgebra::Point2<f64>| p[k];
            let low = outline.points.iter().map(side).fold(f64::INFINITY, f64::min);
            outline.points.iter().map(side).fold(f64::NEG_INFINITY, f64::max) - low
        });
        Ok(outline.area.min(size[0] * size[1]).max(0.0) * outline.extent.powi(2))
    };
    let of_solid: Vec<f64> = solid.par_iter().map(boxed).collect::<Result<_, Cancelled>>()?;
    let mut area = vec![0.0; outlines.len()];
    for (&i, found) in solid.iter().zip(of_solid) {
        area[i] = found;
    }
    let mut largest = solid.to_vec();
    largest.par_sort_unstable_by(|&a, &b| area[b].total_cmp(&area[a]).then(a.cmp(&b)));
    largest.truncate(RASTERED);
    let touched = |&i: &usize| {
        progress.check()?;
        let cells = rasterise(&outlines[i], [1.0, 0.0], ACROSS, 0.0).mask.count() as f64;
        Ok((i, cells * (outlines[i].extent / ACROSS).powi(2)))
    };
    let touched: Vec<(usize, f64)> = largest.par_iter().map(touched).collect::<Result<_, Cancelled>>()?;
    for (i, touched) in touched {
        area[i] = area[i].min(touched);
    }
    Ok(area)
}

/// By how many texels single precision moves a point further, in the tile that is the furthest from the origin, than what charts are grown by makes
/// up for. It moves a coordinate between 2^(k − 1) and 2^k by at most 2^(k − 25).
fn beyond_safety(settings: &PackSettings) -> f64 {
    let [columns, rows] = Tile::columns_and_rows(settings.tiles);
    let step = (columns.max(rows).next_power_of_two() as f64) * 0.5f64.powi(25);
    (ROUNDED * step * f64::from(settings.width.max(settings.height)) - SAFETY_TEXELS).max(0.0)
}
