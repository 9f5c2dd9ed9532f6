//! Packing: where each chart goes in the texture.
//!
//! **Terms.** A *texel* is the square (0, 1)² of a texture of W by H; UV is texel position over size.
//! The *margin* is the least Euclidean distance of two charts, in texels. A *cell* is a square of the
//! search grid, a texel or a fraction or a small multiple of one. A *footprint* is the set of cells a
//! chart touches in one pose; a *pose* is a rotation, a scale and a position. The *density* is the
//! scale all charts share, in texels to a unit of the chart plane. A *speck* is a chart that would be
//! smaller than a texel.
//!
//! **Steps.**
//! 1. `outline`: the triangles of a chart become the boundary of their union, whatever their
//!    number, orientation and overlaps.
//! 2. `pose`: a few base angles, the first from the minimum-area rectangle; quarter turns are free.
//! 3. `shape`, `raster`, `mask`: at a given density, the footprint in every pose: all cells the
//!    chart, grown by a 128th of a texel, touches. Two charts whose cells are a margin apart, square
//!    to square, therefore are more than a margin apart, and rounding to f32 cannot eat the rest.
//!    Holes stay open and are used.
//! 4. `grid`, `occupancy`, `cover`: occupied cells, dilated by the margin, as bits; for each power of two
//!    also where a square of that side would collide. A footprint is a union of such squares, which
//!    answers 64 positions a lookup, and most of them by its largest square.
//! 5. `place`: charts one after the other to the free position and pose that lie lowest.
//! 6. `search`, `order`: on a coarse grid of some hundred cells, where neither margin nor raster are
//!    exact and an attempt costs little: the density by bracketing, then a climb over orders of
//!    placement and choices of poses. Every attempt about as high as the texture is a `sketch`.
//! 7. `settle`, `refine`: the few densest sketches on the fine grid, each chart in its one pose and a
//!    small window around its place, grown until they no longer fit. Here the guarantee is made.
//! 8. `tighten`: up to some hundred charts are then pressed together along their outlines (`body`), moved and turned by
//!    any amount, in steps each of which is a linear program (`compact`, `linear_program`): from the placement, from
//!    further sketches, and from variations of what was found (`rearrange`).
//! 9. `many`, `shelves`: thousands of charts as boxes in rows around the large ones among them.
//! 10. `density` is the whole of it for one texture; `alone` a single chart, where there is nothing to search.
//! 11. `spread`, for several tiles or a density that is given: which chart goes into which tile, each of which is packed by 1 to 10, but for 8.
//!     `tile` says where tiles lie, `shortfall` what the user is told of a density that does not fit.
//! 12. `rough` tells about how much will be covered, for a fraction of the cost.
//! 13. `snap`: at last rectangles are laid on whole texels, where that is asked for.
//!
//! `constraints` are what a caller may ask for in addition. `obstacles` are cells that are occupied from the start, by the same raster
//! and the same distance between cells, so that the guarantee holds for them as it does between charts. `mip_margin`
//! says how wide a margin keeps mip levels apart, and `width` how wide a chart is.
//!
//! **References.** Lévy, Petitjean, Ray, Maillot: Least squares conformal maps for automatic texture
//! atlas generation, SIGGRAPH 2002, section 4 (charts of pixels piled up, large ones first); Sander,
//! Wood, Gortler, Snyder, Hoppe: Multi-chart geometry images, SGP 2003 (rasterised charts in several
//! poses); Burke, Hellier, Kendall, Whitwell: A new bottom-left-fill heuristic algorithm for the
//! two-dimensional irregular packing problem, Operations Research 54(3), 2006 (local search over the
//! order of placement).

mod alone;
mod body;
mod compact;
#[cfg(test)]
mod constrained_tests;
mod constraints;
mod cover;
mod density;
mod goal;
mod grid;
mod linear_program;
mod many;
mod mask;
mod mip_margin;
mod obstacles;
mod occupancy;
mod order;
mod outline;
mod place;
mod placement;
mod pose;
mod raster;
mod rearrange;
mod refine;
mod rough;
mod search;
mod settle;
mod shape;
mod shelves;
mod shortfall;
mod shrink;
mod sketch;
mod snap;
mod spread;
#[cfg(test)]
mod tests;
mod tighten;
mod tile;
#[cfg(test)]
mod tiled_tests;
mod width;

use nalgebra::{Point2, Vector2};
use rayon::prelude::*;
use thiserror::Error;

use crate::choice::choices;
use crate::error_kind::ErrorKind;
use crate::memory;
use crate::progress::{Cancelled, Progress};
pub(crate) use constraints::Constraints;
pub(crate) use outline::LARGEST;
use outline::Outline;
use placement::Place;
pub(crate) use rough::rough_cover;
pub(crate) use shortfall::Shortfall;
pub(crate) use shrink::told as told_of_margin;
use snap::Snapped;
use spread::Spread;
pub(crate) use tile::Tile;
pub(crate) use width::least_width;

/// Which rotations a chart may take. Charts are never mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rotation {
    /// Along the axes where much of a chart's border is straight, upright or level where a chart is symmetric; any angle for the others.
    Aligned,
    /// Any angle.
    Any,
    /// Multiples of a quarter turn from the pose that is given.
    Quarter,
    /// Only the pose that is given.
    None,
}

choices!(Rotation {
    Aligned: "aligned", "Aligned", "Charts with straight borders lie along the axes, symmetric ones upright or level, others at any angle.";
    Any: "any", "Any", "Charts are turned by any angle, which packs tightest.";
    Quarter: "quarter", "Quarter Turns", "Charts are turned by multiples of 90° from how they were flattened, none set upright by itself.";
    None: "none", "None", "Charts stay as they were flattened, at whatever angle that is.";
});

/// How long to search for a dense placement. The search counts its work rather than looking at a clock, so the result does
/// not depend on the speed of the machine; the times are typical ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quality {
    /// Takes a twentieth to a tenth of a second for up to some dozen charts, and a fifth to a third of a second for some hundred.
    Fast,
    /// Takes two to four times as long. What `Fast` does is followed by a second search in which the larger charts are tried at twice as many
    /// angles, boxes in rows are tried as well, and up to some dozen charts are arranged in other ways and pressed together again.
    Normal,
    /// Takes ten to twenty times as long as `Fast`, one to three seconds: many more sketches and arrangements are tried, at the angles and with the
    /// rows of `Normal`. Of 8,000 charts and more only the largest are placed by their shapes, and the others as boxes in rows, whatever the quality.
    High,
}

choices!(Quality {
    Fast: "fast", "Fast", "A fraction of a second for up to some hundred charts.";
    Normal: "normal", "Normal", "Two to four times as long; more angles and arrangements are tried.";
    High: "high", "High", "Ten to twenty times as long, with many more arrangements tried.";
});

/// How charts are packed, and into which texture.
#[derive(Clone, Debug, PartialEq)]
pub struct PackSettings {
    /// Least distance between two charts in texels; half of it is kept to the border of the texture. At least 0; with 0,
    /// charts may all but touch (a 128th of a texel stays between them).
    pub margin_texels: f64,
    /// Width of the texture in texels, 1 to [`PackSettings::LARGEST_SIZE`].
    pub width: u32,
    /// Height of the texture in texels, likewise.
    pub height: u32,
    /// Which rotations charts may take.
    pub rotation: Rotation,
    /// How long to search.
    pub quality: Quality,
    /// Over how many tiles of the texture charts may be spread, 1 to [`PackSettings::MOST_TILES`], each as large as `width` by `height`. Tile k, from
    /// 0, is the square of UV whose lower left corner is (k mod 10, ⌊k / 10⌋), also known as UDIM 1001 + k. No chart crosses the border of its tile. A point
    /// cloud gets one tile whatever this is.
    pub tiles: usize,
    /// The density of all charts that are larger than a texel, in texels to a unit of length, above 0, or `None` for the greatest that is found. A given
    /// one is had in as few tiles as are found to do; where it does not fit into `tiles` tiles, charts get the greatest density that is found, with a
    /// warning. For a point cloud it has no meaning.
    pub texel_density: Option<f64>,
    /// On how many mip levels, besides the texture itself, filtering is to mix no two charts: 0 to
    /// [`PackSettings::MOST_MIP_LEVELS`]. The margin is raised to what that takes, which [`PackSettings::margin`]
    /// tells; 0 leaves it as it is.
    pub mip_levels: usize,
    /// Whether charts whose outer border is a rectangle along the axes of the texture are laid on whole texels: their
    /// sides go to the nearest edges of texels, which scales them by less than a texel along each axis, also where a
    /// scale or a density is given. All others keep their shape. The room for it is kept besides the margin. For a
    /// point cloud it has no meaning.
    pub snap: bool,
    /// Whether a margin that leaves no room for the charts in the texture is halved until it does, with a warning,
    /// where it is an error otherwise. A distance to the border that is given besides is kept. For a point cloud it has
    /// no meaning.
    pub shrink_margin: bool,
}

impl PackSettings {
    /// Largest width or height of a texture.
    pub const LARGEST_SIZE: u32 = 32_768;
    /// Most tiles: ten rows of ten.
    pub const MOST_TILES: usize = Tile::MOST;
    /// Greatest texel density that can be asked for: the largest texture upon a surface of 30 millionths of a unit. It is a bound only so that
    /// products with it are finite.
    pub const GREATEST_DENSITY: f64 = 1e9;
    /// Most mip levels that can be asked for: the margin of 724 texels that they take is about the largest that can be
    /// asked for.
    pub const MOST_MIP_LEVELS: usize = 8;

    /// The paper's: a margin of two texels at a texture size of 1024, and quarter turns.
    #[must_use]
    pub fn paper() -> Self {
        Self { margin_texels: 2.0, width: 1024, height: 1024, rotation: Rotation::Quarter, ..Self::default() }
    }

    /// For lightmaps: two mip levels of a texture of 1024 texels, and rectangles on whole texels.
    #[must_use]
    pub fn lightmap() -> Self {
        Self { width: 1024, height: 1024, mip_levels: 2, snap: true, ..Self::default() }
    }

    fn check(&self) -> Result<(), PackError> {
        let sizes = 1..=Self::LARGEST_SIZE;
        if !sizes.contains(&self.width) || !sizes.contains(&self.height) {
            return Err(PackError::TextureSize { width: self.width, height: self.height });
        }
        if !(self.margin_texels >= 0.0 && self.margin_texels.is_finite()) {
            return Err(PackError::Margin { margin: self.margin_texels });
        }
        if !(1..=Self::MOST_TILES).contains(&self.tiles) {
            return Err(PackError::Tiles { tiles: self.tiles });
        }
        if let Some(density) = self.texel_density.filter(|&d| !(d > 0.0 && d <= Self::GREATEST_DENSITY)) {
            return Err(PackError::TexelDensity { density });
        }
        Ok(())
    }
}

impl Default for PackSettings {
    /// A margin of four texels at a texture size of 2048, and charts with straight borders along the axes.
    fn default() -> Self {
        Self {
            margin_texels: 4.0,
            width: 2048,
            height: 2048,
            rotation: Rotation::Aligned,
            quality: Quality::Fast,
            tiles: 1,
            texel_density: None,
            mip_levels: 0,
            snap: false,
            shrink_margin: false,
        }
    }
}

/// A chart: triangles in a plane of its own. All items of a call share their unit of length.
///
/// Triangles may overlap, be turned over or have no area; all of them keep the margin to other
/// charts, none to those of the same chart. Points no triangle uses do not matter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackItem<'a> {
    /// Points of the chart plane.
    pub points: &'a [Point2<f64>],
    /// Triangles as indices of points. Triangles that share indices are packed faster.
    pub triangles: &'a [[u32; 3]],
}

/// A similarity without mirroring, from a chart plane to texels: turn about `centre`, scale, put
/// `centre` at `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// Cosine of the angle.
    pub cos: f64,
    /// Sine of the angle.
    pub sin: f64,
    /// The point turned about: the middle of the chart, so that nothing cancels far from the origin.
    pub centre: Point2<f64>,
    /// Texels to a unit of the chart plane.
    pub scale: f64,
    /// Where `centre` goes, in texels.
    pub offset: Vector2<f64>,
}

impl Pose {
    /// Where a point of the chart plane goes, in texels.
    #[inline]
    #[must_use]
    pub(crate) fn texel(&self, p: Point2<f64>) -> Point2<f64> {
        let d = (p - self.centre) * self.scale;
        Point2::new(self.cos * d.x - self.sin * d.y, self.sin * d.x + self.cos * d.y) + self.offset
    }
}

/// The result of [`pack`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packed {
    /// A pose an item, in their order: texels from the corner of its tile.
    pub poses: Vec<Pose>,
    /// The tile of each item.
    pub tiles: Vec<Tile>,
    /// Number of tiles in which charts or obstacles lie.
    pub tiles_used: usize,
    /// Area covered by charts over the area of the tiles used. A chart that overlaps itself counts its
    /// triangles' areas, but no more than the cells it touches.
    pub efficiency: f64,
    /// The density all charts but specks share, in texels to a unit of the chart plane.
    pub texels_per_unit: f64,
    /// Where the density that was asked for does not fit: what did.
    pub shortfall: Option<Shortfall>,
    /// Charts scaled up to about a texel, individually.
    pub specks: usize,
    /// Width and height of a tile.
    pub size: [u32; 2],
    /// The margin that is kept, in texels: less than what was asked for only with [`PackSettings::shrink_margin`].
    pub margin: f64,
    /// For each item what lays it on whole texels after its pose, if anything does; empty where nothing was to be.
    snapped: Vec<Option<Snapped>>,
    /// Quarter turns, counter-clockwise, by which each tile is turned at last: none or two where it is no square.
    pub quarter_turns: usize,
}

impl Packed {
    /// Where the points of an item go, in UV: all of them, in their order.
    #[must_use]
    pub(crate) fn uvs(&self, item: usize, points: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let mut at: Vec<Point2<f64>> = points.iter().map(|p| self.poses[item].texel(*p)).collect();
        if let Some(Some(snapped)) = self.snapped.get(item) {
            snapped.apply(&mut at);
        }
        let corner = self.tiles[item].corner();
        for p in &mut at {
            let [x, y] = [p.x / f64::from(self.size[0]), p.y / f64::from(self.size[1])];
            let [x, y] = match self.quarter_turns {
                1 => [1.0 - y, x],
                2 => [1.0 - x, 1.0 - y],
                3 => [y, 1.0 - x],
                _ => [x, y],
            };
            *p = Point2::new(x + corner[0], y + corner[1]);
        }
        at
    }

    /// Whether an item is laid on whole texels.
    #[must_use]
    pub(crate) fn is_snapped(&self, item: usize) -> bool {
        matches!(self.snapped.get(item), Some(Some(_)))
    }

    /// Gives an item its shape back: it is not laid on whole texels then. There is room for it either way.
    pub(crate) fn unsnap(&mut self, item: usize) {
        if let Some(snapped) = self.snapped.get_mut(item) {
            *snapped = None;
        }
    }
}

/// Why charts could not be packed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PackError {
    /// The texture has no texels, or is so large that single-precision coordinates cannot tell fractions of a texel apart.
    #[error(
        "a texture of {width} by {height} texels cannot be packed: choose 1 to {} each",
        PackSettings::LARGEST_SIZE
    )]
    TextureSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// The number of tiles is none that a layout can have.
    #[error("{tiles} tiles cannot be packed: choose 1 to {}", PackSettings::MOST_TILES)]
    Tiles {
        /// Number asked for.
        tiles: usize,
    },
    /// The texel density is not a positive number, or too great.
    #[error(
        "a texel density of {density} is none: choose a number above 0 and at most {}",
        PackSettings::GREATEST_DENSITY
    )]
    TexelDensity {
        /// Density asked for.
        density: f64,
    },
    /// The margin is negative or not finite.
    #[error("a margin of {margin} texels is not a distance: choose 0 or more")]
    Margin {
        /// Margin asked for.
        margin: f64,
    },
    /// The distance to the border of the texture is negative or not finite.
    #[error("a distance of {border} texels to the border is none: choose 0 or more")]
    Border {
        /// Distance asked for.
        border: f64,
    },
    /// The distance that is kept to the border takes the whole texture.
    #[error(
        "a distance of {border} texels to the border leaves no room in a texture of {width} by {height}: choose a smaller distance or a larger texture"
    )]
    BorderTooLarge {
        /// Distance asked for.
        border: f64,
        /// Width of the texture.
        width: u32,
        /// Height of the texture.
        height: u32,
    },
    /// The obstacles, with the margin around them, leave no room for the charts, even if each is only a texel large.
    #[error(
        "the obstacles leave no room for {charts} charts with a margin of {margin} texels in a texture of {width} by {height}: choose a smaller margin or a larger texture, or mark fewer obstacles"
    )]
    NoRoomBetweenObstacles {
        /// Number of charts that are to be placed.
        charts: usize,
        /// Margin asked for.
        margin: f64,
        /// Width of the texture.
        width: u32,
        /// Height of the texture.
        height: u32,
    },
    /// The charts do not fit at the scale that is asked for.
    #[error(
        "the charts do not fit at the size they have; the densest placement that was found has them {shrunk:.4} times as large: scale them by that or less, or choose a smaller margin or a larger texture"
    )]
    TooLarge {
        /// The factor by which all charts had to be scaled to be placed, below 1.
        shrunk: f64,
    },
    /// The margin that is kept to the border takes the whole texture.
    #[error(
        "a margin of {margin} texels leaves no room in a texture of {width} by {height}: choose a smaller margin or a larger texture"
    )]
    MarginTooLarge {
        /// Margin asked for.
        margin: f64,
        /// Width of the texture.
        width: u32,
        /// Height of the texture.
        height: u32,
    },
    /// The charts do not fit even if each is only a texel large.
    #[error(
        "{charts} charts with a margin of {margin} texels do not fit a texture of {width} by {height}: choose a smaller margin or a larger texture, or make fewer charts"
    )]
    TooManyCharts {
        /// Number of charts.
        charts: usize,
        /// Margin asked for.
        margin: f64,
        /// Width of the texture.
        width: u32,
        /// Height of the texture.
        height: u32,
    },
    /// A coordinate is not finite, or is beyond 1e150 in size.
    #[error(
        "triangle {triangle} of chart {item} has a coordinate that is not finite or beyond 1e150: repair or leave out the chart"
    )]
    NotFinite {
        /// The chart, numbered from 0.
        item: usize,
        /// The triangle, numbered within the chart.
        triangle: usize,
    },
    /// A triangle names a point that does not exist.
    #[error("triangle {triangle} of chart {item} names a point beyond the chart's {points}")]
    CornerOutOfRange {
        /// The chart, numbered from 0.
        item: usize,
        /// The triangle, numbered within the chart.
        triangle: usize,
        /// Number of points of the chart.
        points: usize,
    },
    /// The caller asked to stop, or memory ran out.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl PackError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::TextureSize { .. }
            | Self::Tiles { .. }
            | Self::TexelDensity { .. }
            | Self::Margin { .. }
            | Self::Border { .. }
            | Self::BorderTooLarge { .. }
            | Self::NoRoomBetweenObstacles { .. }
            | Self::TooLarge { .. }
            | Self::MarginTooLarge { .. }
            | Self::TooManyCharts { .. }
            | Self::NotFinite { .. }
            | Self::CornerOutOfRange { .. } => ErrorKind::Argument,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

/// What a triangle takes while its outline is found, and what a chart takes in its many poses, in bytes: 58 were measured for each of
/// 800,000 triangles in one chart, and 6.8 KiB for each of 119,000 charts of one triangle. In rows a chart has one pose: a million charts of one
/// triangle took 885 MB, their arrays included.
const OF_TRIANGLE: u64 = 256;
const OF_ITEM: u64 = 8 << 10;
const OF_ITEM_IN_ROWS: u64 = 1 << 10;

/// Fails where less memory is left than packing takes, by an estimate on the safe side.
fn require_memory(items: &[PackItem<'_>]) -> Result<(), Cancelled> {
    let triangles: usize = items.iter().map(|item| item.triangles.len()).sum();
    let of_item = if items.len() >= many::ROWS_ONLY { OF_ITEM_IN_ROWS } else { OF_ITEM };
    let needed =
        (triangles as u64).saturating_mul(OF_TRIANGLE).saturating_add((items.len() as u64).saturating_mul(of_item));
    memory::require(needed).map_err(Cancelled::OutOfMemory)
}

/// Poses that place all charts in the texture, or in its tiles, at the density asked for or else the greatest common density found.
///
/// Guaranteed, also after rounding UVs to f32: two different charts are at least the margin apart,
/// every chart lies within one tile at least half a margin from its border, none is mirrored, and
/// each is at least about a texel large in its larger extent (unless all its points coincide). The
/// result is a function of items and settings, whatever the number of threads. Not guaranteed: the
/// greatest possible density, nor that one more chart or a little less margin never costs density.
///
/// An item without triangles gets a pose in the middle of the texture and takes no room.
///
/// Cost: O(t log t) for t triangles, then a bounded number of attempts on the coarse grid (30 to 60 from each
/// beginning once one fits, `Fast`), of placements on the fine one (about a dozen), and of steps along outlines (10 to 90 a start). Measured on two cores: 0.05 to 0.1 s for
/// 2 to 40 charts, 0.2 to 0.3 s for 170. Attempts and rasters run in parallel. A single chart is fitted without a search.
/// Thousands of charts are placed in rows, in O(n log n): 50,000 in half a second, a million in six.
///
/// # Errors
/// [`PackError`]; [`PackError::Cancelled`] takes precedence only over errors not yet found.
pub(crate) fn pack(items: &[PackItem<'_>], settings: &PackSettings, progress: &Progress) -> Result<Packed, PackError> {
    pack_within(items, &Constraints::default(), settings, progress)
}

/// The same within further constraints: another distance to the border of the texture, a scale that is given, and obstacles.
///
/// Guaranteed in addition: every chart is at least the margin from every obstacle, and with a given scale each has exactly that,
/// specks included, but for what [`PackSettings::snap`] changes. `efficiency` counts the obstacles, too: the sum of
/// their areas within the texture, but no more than the
/// cells they touch.
///
/// # Errors
/// Also [`PackError::NoRoomBetweenObstacles`], and [`PackError::TooLarge`] where no placement was found at the given scale.
pub(crate) fn pack_within(
    items: &[PackItem<'_>],
    constraints: &Constraints<'_>,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Packed, PackError> {
    settings.check()?;
    let mut asked = settings.with_whole_margin();
    loop {
        match pack_apart(items, constraints, &asked, progress) {
            Err(error) if asked.shrink_margin && shrink::helps(&error) && asked.margin_texels > 0.0 => {
                asked.margin_texels = shrink::smaller(asked.margin_texels);
            }
            Err(error) if asked.snap => return Err(shrink::with_margin(error, asked.margin_texels)),
            found => return found,
        }
    }
}

/// The same at the margin of the settings, whatever the mip levels.
fn pack_apart(
    items: &[PackItem<'_>],
    given: &Constraints<'_>,
    asked: &PackSettings,
    progress: &Progress,
) -> Result<Packed, PackError> {
    given.check(asked)?;
    let (settings, constraints) = if asked.snap { snap::with_room(asked, given) } else { (asked.clone(), *given) };
    let (settings, constraints) = (&settings, &constraints);
    constraints.check(settings)?;
    progress.check()?;
    require_memory(items)?;
    let outline = |(i, item)| {
        progress.check()?;
        Ok(Outline { keeps_size: constraints.scale.is_some(), ..Outline::new(item, i)? })
    };
    let outlines: Vec<Outline> = items.par_iter().enumerate().map(outline).collect::<Result<_, PackError>>()?;
    let is_single = settings.tiles == 1 && settings.texel_density.is_none();
    let Spread { dense, tiles, shortfall } = if is_single {
        Spread::on_one_tile(density::densest(&outlines, constraints, settings, progress)?.0)
    } else {
        spread::spread(&outlines, constraints, settings, progress)?
    };
    let texels = f64::from(settings.width) * f64::from(settings.height);
    let middle = 0.5 * Vector2::new(f64::from(settings.width), f64::from(settings.height));
    let mut is_used = vec![false; settings.tiles];
    let mut covered = 0.0;
    for tile in Tile::first(settings.tiles) {
        let obstacles = obstacles::in_tile(constraints.obstacles, tile, settings);
        let of_tile = obstacles::covered(&obstacles, [settings.width, settings.height].map(f64::from), progress)?;
        is_used[tile.number()] = of_tile > 0.0;
        covered += of_tile;
    }
    let snapped: Vec<Option<Snapped>> = if settings.snap {
        let snapped = |((item, outline), place): ((&PackItem<'_>, &Outline), &Option<Place>)| {
            progress.check()?;
            Ok(place.as_ref().and_then(|place| Snapped::new(item, outline, &place.pose)))
        };
        items.par_iter().zip(&outlines).zip(&dense.places).map(snapped).collect::<Result<_, Cancelled>>()?
    } else {
        Vec::new()
    };
    let mut poses = Vec::with_capacity(items.len());
    for (number, ((outline, place), tile)) in outlines.iter().zip(&dense.places).zip(&tiles).enumerate() {
        // Only items without triangles are not placed.
        let nowhere = Pose { cos: 1.0, sin: 0.0, centre: outline.centre, scale: dense.density, offset: middle };
        let pose = place.map_or(nowhere, |p| p.pose);
        let area = outline.area * (outline.extent * pose.scale).powi(2);
        let factor = snapped.get(number).and_then(Option::as_ref).map_or(1.0, Snapped::area_factor);
        covered += factor * area.min(place.map_or(0.0, |p| p.touched));
        is_used[tile.number()] |= place.is_some();
        poses.push(pose);
    }
    let specks = dense.places.iter().flatten().filter(|p| p.is_speck).count();
    let size = [settings.width, settings.height];
    let tiles_used = is_used.iter().filter(|used| **used).count();
    let efficiency = covered / (texels * tiles_used.max(1) as f64);
    Ok(Packed {
        poses,
        tiles,
        tiles_used,
        efficiency,
        texels_per_unit: dense.density,
        shortfall,
        specks,
        size,
        margin: asked.margin_texels,
        snapped,
        quarter_turns: 0,
    })
}
