//! Packing charts that exist already.

use std::collections::HashMap;

use nalgebra::Point2;
use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::packing::{self, Constraints, PackError, PackItem, PackSettings, Shortfall};
use crate::progress::{Cancelled, Progress, Stage};

/// Elements of an array between two looks at whether to stop: a few milliseconds of work.
const BETWEEN_CHECKS: usize = 1 << 16;

/// How large charts are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum RepackScale {
    /// All charts that move are scaled by the same factor, the greatest at which a placement was found; tiny ones are enlarged to about a
    /// texel.
    #[default]
    Uniform,
    /// Charts keep their size, but for what [`PackSettings::snap`] changes. A unit of the points is the width of the
    /// texture, along both of its sides.
    Fixed,
}

/// What [`repack`] keeps to besides its settings. The default adds nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct RepackRules<'a> {
    /// A number for each triangle, the same for all triangles of a chart. Charts with the same number, which is at least 0, move as one rigid
    /// whole: they keep their places relative to each other, overlap as they did, and keep no margin between them. Copies that lie upon each
    /// other thus stay a stack. Charts with a negative number move by themselves.
    pub groups: Option<&'a [i32]>,
    /// For each triangle, whether the chart or group that it belongs to stays where it is. The points of what stays are UVs, of which (1, 1) is
    /// the corner of the texture opposite to the origin, also if the texture is not square. They may lie outside the texture. What stays keeps
    /// no margin to other things that stay.
    pub obstacles: Option<&'a [bool]>,
    /// Least distance of the charts that move to the border of the texture, in texels; `None` for half the margin, which it is at least where there are
    /// several tiles.
    pub border_texels: Option<f64>,
    /// How large charts are made.
    pub scale: RepackScale,
}

/// Why charts could not be packed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RepackError {
    /// The number of chart numbers is not the number of triangles.
    #[error("there are {found} chart numbers, but {triangles} triangles; give one a triangle")]
    ChartCount {
        /// Number of chart numbers that were given.
        found: usize,
        /// Number of triangles.
        triangles: usize,
    },
    /// A triangle names a point that does not exist.
    #[error("triangle {triangle} names point {point}, but the points are numbered 0 to {points} (exclusive)")]
    PointOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The point it names.
        point: i32,
        /// Number of points.
        points: usize,
    },
    /// A point belongs to two charts that are not of the same group.
    #[error(
        "point {point} belongs to charts {first} and {second}; give each chart points of its own, or the two the same group"
    )]
    SharedPoint {
        /// The point.
        point: usize,
        /// The chart of its first triangle.
        first: i32,
        /// Another chart.
        second: i32,
    },
    /// A coordinate of a point that a triangle names is not finite or beyond 1e150.
    #[error(
        "point {point}, a corner of triangle {triangle}, has a coordinate that is not finite or beyond 1e150; repair or leave out its chart"
    )]
    NotFinite {
        /// The triangle.
        triangle: usize,
        /// The point it names.
        point: usize,
    },
    /// The number of group numbers is not the number of triangles.
    #[error("there are {found} group numbers, but {triangles} triangles; give one a triangle")]
    GroupCount {
        /// Number of group numbers that were given.
        found: usize,
        /// Number of triangles.
        triangles: usize,
    },
    /// Two triangles of a chart have different group numbers.
    #[error("chart {chart} is in group {first} and in group {second}; give all triangles of a chart the same group")]
    GroupsOfChart {
        /// The chart.
        chart: i32,
        /// The group of its first triangle.
        first: i32,
        /// Another group.
        second: i32,
    },
    /// The number of flags for obstacles is not the number of triangles.
    #[error("there are {found} flags for obstacles, but {triangles} triangles; give one a triangle")]
    ObstacleCount {
        /// Number of flags that were given.
        found: usize,
        /// Number of triangles.
        triangles: usize,
    },
    /// A point of an obstacle is so far from the texture that its distance to the charts could not be kept exactly.
    #[error("point {point} of an obstacle is more than {farthest} textures away from the origin; leave out its chart")]
    ObstacleFarAway {
        /// The point.
        point: usize,
        /// How far it may be, in widths or heights of the texture.
        farthest: f64,
    },
    /// Charts are to keep their size, and to have a texel density that is given as well.
    #[error("charts that keep their size cannot be given a texel density of {density}; leave out one of the two")]
    TwoScales {
        /// The texel density.
        density: f64,
    },
    /// The charts do not fit, or cannot be packed for another reason. In this error, a group of charts counts as one chart.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl RepackError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::ChartCount { .. }
            | Self::PointOutOfRange { .. }
            | Self::SharedPoint { .. }
            | Self::NotFinite { .. }
            | Self::GroupCount { .. }
            | Self::GroupsOfChart { .. }
            | Self::ObstacleCount { .. }
            | Self::ObstacleFarAway { .. }
            | Self::TwoScales { .. } => ErrorKind::Argument,
            Self::Pack(error) => error.kind(),
            Self::Cancelled(error) => error.kind(),
        }
    }
}

/// Charts in their new places.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Repacked {
    /// The new position of each point, in [0, 1]² or the squares of further [tiles](PackSettings::tiles); (0, 0) for points that belong to no chart.
    /// What stays is where it was, rounded to single precision.
    pub uv: Vec<[f32; 2]>,
    /// Number of charts, those that stay included.
    pub charts: usize,
    /// Number of tiles in which charts lie, those that stay included.
    pub tiles: usize,
    /// Area that charts cover, divided by the area of the tiles in which some lie. A chart or group that overlaps itself counts with the sum of its
    /// triangles' areas, but with no more than the texels it touches; so do all that stay together.
    pub efficiency: f64,
    /// The texel density that all charts that move share, except for tiny ones: texels to a unit of length of the points.
    pub texels_per_unit: f64,
    /// Number of tiny charts or groups, each of which was scaled up to about a texel by a factor of its own.
    pub specks: usize,
    /// What else the user should know, in sentences: that a [`PackSettings::texel_density`] or a margin does not fit.
    pub warnings: Vec<String>,
}

/// Moves, turns and scales charts so that they fill the unit square and keep their margin. All charts are scaled by the
/// same factor, except for those of less than a texel. With several [tiles](PackSettings::tiles) they are spread over these; a group stays together,
/// and what stays is in the way in every tile that it comes near. With a [density](PackSettings::texel_density) they get that, if it fits.
///
/// Each of the `triangles` names three of the `points`. Triangles with the same number in `chart` make up a chart,
/// connected or not. Triangles with a negative number are left out, and so are points that belong to no triangle. Charts
/// keep their shape in texels: if the texture is not square, UVs that are to be moved have to be multiplied by its
/// proportions first. The `rules` say which charts move together, which stay, and how large they become.
///
/// Guaranteed, also after rounding to single precision: two different charts are at least the margin apart, unless they
/// are of one group or both stay; every chart that moves lies within one tile of the texture, at least half a margin or the given distance from its
/// border; no chart is mirrored; with [`RepackScale::Uniform`] each chart or group is at least about a texel
/// large in its longer direction (unless all its points coincide). What stays has the very coordinates that it had, rounded to single
/// precision. The result is the same for any number of threads. Not guaranteed: the greatest possible density.
///
/// O(t log t) for t triangles and a bounded number of attempts; on two cores 0.05 to 0.1 s for 2 to 40 charts, and 0.2 to
/// 0.3 s for 170. From 8,000 charts on, which are placed as boxes in rows around the few large ones, O(n log n) for n charts: half a second for
/// 50,000, and six for a million.
///
/// # Errors
/// [`RepackError`]: lengths or indices are wrong, a coordinate is not finite, a point belongs to two charts, a chart to two groups, the
/// charts do not fit with their margin, or not at the size they have, two scales are given, or the call was cancelled.
pub fn repack(
    points: &[[f64; 2]],
    triangles: &[[i32; 3]],
    chart: &[i32],
    rules: &RepackRules<'_>,
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Repacked, RepackError> {
    progress.check()?;
    progress.enter(Stage::Pack);
    let input = Input::new(points, triangles, chart, rules, progress)?;
    let size = [settings.width, settings.height].map(f64::from);
    let obstacles = input.obstacles(size, progress)?;
    let islands = input.islands(progress)?;
    let items: Vec<PackItem<'_>> =
        islands.iter().map(|island| PackItem { points: &island.points, triangles: &island.triangles }).collect();
    let scale = match rules.scale {
        RepackScale::Uniform => None,
        RepackScale::Fixed => Some(size[0]),
    };
    if let (Some(_), Some(density)) = (scale, settings.texel_density) {
        return Err(RepackError::TwoScales { density });
    }
    let constraints = Constraints { border_texels: rules.border_texels, scale, obstacles: &obstacles };
    let packed = packing::pack_within(&items, &constraints, settings, progress)?;
    let mut uv = vec![[0.0; 2]; points.len()];
    for &t in &input.staying {
        for p in triangles[t].map(|p| p as usize) {
            uv[p] = points[p].map(|x| x as f32);
        }
    }
    for (number, island) in islands.iter().enumerate() {
        for (&from, at) in island.source.iter().zip(packed.uvs(number, &island.points)) {
            uv[from] = [at.x as f32, at.y as f32];
        }
    }
    Ok(Repacked {
        uv,
        charts: input.charts,
        tiles: packed.tiles_used,
        efficiency: packed.efficiency,
        texels_per_unit: packed.texels_per_unit,
        specks: packed.specks,
        warnings: (packed.shortfall.iter().map(Shortfall::to_string))
            .chain(packing::told_of_margin(settings.margin(), packed.margin))
            .collect(),
    })
}

/// The arrays of a call, checked, with what moves apart from what stays.
struct Input<'a> {
    points: &'a [[f64; 2]],
    triangles: &'a [[i32; 3]],
    /// For each triangle the rigid whole that it belongs to, by the least number of a chart in it.
    whole: Vec<i32>,
    /// Triangles that move, whole by whole.
    moving: Vec<usize>,
    /// Triangles that stay.
    staying: Vec<usize>,
    charts: usize,
}

impl<'a> Input<'a> {
    fn new(
        points: &'a [[f64; 2]],
        triangles: &'a [[i32; 3]],
        chart: &[i32],
        rules: &RepackRules<'_>,
        progress: &Progress,
    ) -> Result<Self, RepackError> {
        let count = triangles.len();
        if chart.len() != count {
            return Err(RepackError::ChartCount { found: chart.len(), triangles: count });
        }
        if let Some(groups) = rules.groups.filter(|groups| groups.len() != count) {
            return Err(RepackError::GroupCount { found: groups.len(), triangles: count });
        }
        if let Some(flags) = rules.obstacles.filter(|flags| flags.len() != count) {
            return Err(RepackError::ObstacleCount { found: flags.len(), triangles: count });
        }
        let whole = match rules.groups {
            Some(groups) => wholes(chart, groups, progress)?,
            None => chart.to_vec(),
        };
        let mut moving: Vec<usize> = (0..count).filter(|&t| chart[t] >= 0).collect();
        // The chart of the first triangle at each point.
        let mut first = vec![-1; points.len()];
        for (k, &t) in moving.iter().enumerate() {
            if k.is_multiple_of(BETWEEN_CHECKS) {
                progress.check()?;
            }
            for point in triangles[t] {
                let place = usize::try_from(point).ok().filter(|&p| p < points.len());
                let place = place.ok_or(RepackError::PointOutOfRange { triangle: t, point, points: points.len() })?;
                if !points[place].iter().all(|x| x.abs() <= packing::LARGEST) {
                    return Err(RepackError::NotFinite { triangle: t, point: place });
                }
                match first[place] {
                    -1 => first[place] = t as i32,
                    before if whole[before as usize] == whole[t] => {}
                    before => {
                        let first = chart[before as usize];
                        return Err(RepackError::SharedPoint { point: place, first, second: chart[t] });
                    }
                }
            }
        }
        moving.sort_by_key(|&t| whole[t]);
        progress.check()?;
        let mut numbers: Vec<i32> = moving.iter().map(|&t| chart[t]).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let mut staying = Vec::new();
        if let Some(flags) = rules.obstacles {
            let parts = moving.chunk_by(|&a, &b| whole[a] == whole[b]);
            let (stay, go): (Vec<&[usize]>, Vec<&[usize]>) = parts.partition(|part| part.iter().any(|&t| flags[t]));
            (staying, moving) = (stay.concat(), go.concat());
        }
        progress.check()?;
        Ok(Self { points, triangles, whole, moving, staying, charts: numbers.len() })
    }

    /// The triangles that stay, in texels. They are those of single precision that are returned.
    fn obstacles(&self, size: [f64; 2], progress: &Progress) -> Result<Vec<[Point2<f64>; 3]>, RepackError> {
        let mut obstacles = Vec::with_capacity(self.staying.len());
        let farthest = Constraints::FARTHEST / size[0].max(size[1]);
        for (k, &t) in self.staying.iter().enumerate() {
            if k.is_multiple_of(BETWEEN_CHECKS) {
                progress.check()?;
            }
            let corners = self.triangles[t].map(|p| p as usize);
            if let Some(&point) = corners.iter().find(|&&p| !self.points[p].iter().all(|x| x.abs() <= farthest)) {
                return Err(RepackError::ObstacleFarAway { point, farthest });
            }
            let texels = |p: usize| {
                let [u, v] = self.points[p].map(|x| f64::from(x as f32));
                Point2::new(u * size[0], v * size[1])
            };
            obstacles.push(corners.map(texels));
        }
        Ok(obstacles)
    }

    /// What moves, one rigid whole after the other.
    fn islands(&self, progress: &Progress) -> Result<Vec<Island>, Cancelled> {
        let mut local = vec![u32::MAX; self.points.len()];
        let mut islands = Vec::new();
        let mut gathered = 0;
        for part in self.moving.chunk_by(|&a, &b| self.whole[a] == self.whole[b]) {
            if gathered / BETWEEN_CHECKS != (gathered + part.len()) / BETWEEN_CHECKS {
                progress.check()?;
            }
            gathered += part.len();
            islands.push(Island::new(self.points, self.triangles, part, &mut local));
        }
        Ok(islands)
    }
}

/// The rigid whole of each triangle, by the least number of a chart in it: charts of a group are one, other charts are each for themselves.
fn wholes(chart: &[i32], groups: &[i32], progress: &Progress) -> Result<Vec<i32>, RepackError> {
    let mut group_of: HashMap<i32, i32> = HashMap::new();
    let mut least: HashMap<i32, i32> = HashMap::new();
    for (t, (&chart, &group)) in chart.iter().zip(groups).enumerate() {
        if t.is_multiple_of(BETWEEN_CHECKS) {
            progress.check()?;
        }
        if chart < 0 {
            continue;
        }
        let first = *group_of.entry(chart).or_insert(group);
        if first.max(-1) != group.max(-1) {
            return Err(RepackError::GroupsOfChart { chart, first, second: group });
        }
        if group >= 0 {
            least.entry(group).and_modify(|least| *least = chart.min(*least)).or_insert(chart);
        }
    }
    let whole =
        |(&chart, group): (&i32, &i32)| if chart < 0 { chart } else { least.get(group).copied().unwrap_or(chart) };
    Ok(chart.iter().zip(groups).map(whole).collect())
}

/// A rigid whole, a chart or a group of them, with points of its own.
struct Island {
    source: Vec<usize>,
    points: Vec<Point2<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Island {
    /// Gathers the triangles `part`. `local` is scratch: a point belongs to one whole, so its entry is
    /// written once.
    fn new(points: &[[f64; 2]], triangles: &[[i32; 3]], part: &[usize], local: &mut [u32]) -> Self {
        let mut source = Vec::new();
        let triangles = part
            .iter()
            .map(|&t| {
                triangles[t].map(|p| {
                    let p = p as usize;
                    if local[p] == u32::MAX {
                        local[p] = source.len() as u32;
                        source.push(p);
                    }
                    local[p]
                })
            })
            .collect();
        let points = source.iter().map(|&p| Point2::from(points[p])).collect();
        Self { source, points, triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three unit squares on one spot, of charts 5, 2 and (left out) −1.
    const POINTS: [[f64; 2]; 12] = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
    ];
    const TRIANGLES: [[i32; 3]; 6] = [[0, 1, 2], [4, 5, 6], [0, 2, 3], [4, 6, 7], [8, 9, 10], [8, 10, 11]];
    const CHART: [i32; 6] = [5, 2, 5, 2, -1, -1];

    fn packed(triangles: &[[i32; 3]], chart: &[i32]) -> Result<Repacked, RepackError> {
        let settings = PackSettings { margin_texels: 2.0, width: 256, height: 128, ..PackSettings::default() };
        repack(&POINTS, triangles, chart, &RepackRules::default(), &settings, &Progress::new())
    }

    #[test]
    fn squares_stay_squares_of_one_size_apart() {
        let r = packed(&TRIANGLES, &CHART).expect("they fit");
        assert_eq!(r.charts, 2);
        assert!(r.uv[8..].iter().all(|&p| p == [0.0, 0.0]));
        let texel = |p: usize| Point2::new(f64::from(r.uv[p][0]) * 256.0, f64::from(r.uv[p][1]) * 128.0);
        let side = (texel(1) - texel(0)).norm();
        assert!(side > 80.0, "two squares nearly fill a 2:1 texture, found {side}");
        for q in [0, 4] {
            for k in 0..4 {
                let edge = texel(q + (k + 1) % 4) - texel(q + k);
                assert!((edge.norm() - side).abs() < 1e-3, "{edge:?}");
            }
            let turn = (texel(q + 1) - texel(q)).perp(&(texel(q + 2) - texel(q)));
            assert!(turn > 0.0, "not mirrored");
        }
        let centre = |q: usize| texel(q) + (texel(q + 2) - texel(q)) * 0.5;
        assert!((centre(0) - centre(4)).norm() >= side + 2.0 - 1e-3);
    }

    #[test]
    fn wrong_arrays_are_named() {
        let error = |triangles: &[[i32; 3]], chart: &[i32]| packed(triangles, chart).err();
        assert_eq!(error(&TRIANGLES, &[0]), Some(RepackError::ChartCount { found: 1, triangles: 6 }));
        let out = RepackError::PointOutOfRange { triangle: 0, point: 12, points: 12 };
        assert_eq!(error(&[[0, 1, 12]], &[0]), Some(out));
        let shared = RepackError::SharedPoint { point: 2, first: 0, second: 1 };
        assert_eq!(error(&[[0, 1, 2], [2, 3, 4]], &[0, 1]), Some(shared));
    }

    #[test]
    fn nothing_packs_into_nothing() {
        assert_eq!(packed(&[], &[]).expect("nothing to do").charts, 0);
    }

    fn by_rules(chart: &[i32], rules: &RepackRules<'_>) -> Result<Repacked, RepackError> {
        let settings = PackSettings { margin_texels: 2.0, width: 256, height: 128, ..PackSettings::default() };
        repack(&POINTS, &TRIANGLES, chart, rules, &settings, &Progress::new())
    }

    #[test]
    fn a_group_moves_as_one() {
        // All three squares lie on one spot; the first two stay there together.
        let groups = [4, 4, 4, 4, -1, -1];
        let found = by_rules(&[5, 2, 5, 2, 0, 0], &RepackRules { groups: Some(&groups), ..RepackRules::default() });
        let found = found.expect("they fit");
        assert_eq!((found.charts, &found.uv[..4]), (3, &found.uv[4..8]));
        assert_ne!(found.uv[..4], found.uv[8..]);
        let mixed = [4, 4, 1, 4, -1, -1];
        assert_eq!(
            by_rules(&[5, 2, 5, 2, 0, 0], &RepackRules { groups: Some(&mixed), ..RepackRules::default() }).err(),
            Some(RepackError::GroupsOfChart { chart: 5, first: 4, second: 1 })
        );
        let few = RepackRules { groups: Some(&[1]), ..RepackRules::default() };
        assert_eq!(by_rules(&CHART, &few).err(), Some(RepackError::GroupCount { found: 1, triangles: 6 }));
    }

    #[test]
    fn what_is_marked_stays_with_all_that_belongs_to_it() {
        // The squares fill the texture where they are: one that stays leaves no room.
        let marked = [false, true, false, false, false, false];
        let rules = RepackRules { obstacles: Some(&marked), ..RepackRules::default() };
        assert!(matches!(
            by_rules(&CHART, &rules).err(),
            Some(RepackError::Pack(PackError::NoRoomBetweenObstacles { charts: 1, margin: 2.0, .. }))
        ));
        let together = RepackRules { groups: Some(&[0; 6]), ..rules };
        let found = by_rules(&[5, 2, 5, 2, 0, 0], &together).expect("nothing moves");
        assert_eq!(found.uv, POINTS.map(|p| p.map(|x| x as f32)));
        assert!((found.efficiency - 1.0).abs() < 1e-9 && found.charts == 3);
        let few = RepackRules { obstacles: Some(&[true]), ..RepackRules::default() };
        assert_eq!(by_rules(&CHART, &few).err(), Some(RepackError::ObstacleCount { found: 1, triangles: 6 }));
    }

    #[test]
    fn a_fixed_scale_is_in_widths_of_the_texture() {
        let rules = RepackRules { scale: RepackScale::Fixed, ..RepackRules::default() };
        // A square as wide as the texture does not fit into half its height, twice.
        let Some(RepackError::Pack(PackError::TooLarge { shrunk })) = by_rules(&CHART, &rules).err() else {
            panic!("too large")
        };
        assert!(shrunk > 0.45 && shrunk < 0.5, "{shrunk}");
    }

    #[test]
    fn a_density_is_in_units_of_the_points_and_told_where_it_does_not_fit() {
        let at = |tiles: usize, density: f64| {
            let settings = PackSettings {
                margin_texels: 2.0,
                width: 256,
                height: 128,
                tiles,
                texel_density: Some(density),
                ..PackSettings::default()
            };
            repack(&POINTS, &TRIANGLES, &CHART, &RepackRules::default(), &settings, &Progress::new()).expect("they fit")
        };
        let exact = at(4, 120.0);
        assert_eq!((exact.tiles, exact.texels_per_unit, &exact.warnings), (1, 120.0, &Vec::new()));
        let side = (exact.uv[1][0] - exact.uv[0][0]).hypot(0.5 * (exact.uv[1][1] - exact.uv[0][1])) * 256.0;
        assert!((side - 120.0).abs() < 1e-3, "{side}");
        let dense = at(4, 200.0);
        assert!(dense.texels_per_unit > 120.0 && dense.texels_per_unit < 126.0, "{}", dense.texels_per_unit);
        assert!(dense.warnings.len() == 1 && dense.warnings[0].contains("200 does not fit"), "{:?}", dense.warnings);
    }

    #[test]
    fn groups_stay_in_one_tile_and_two_scales_are_one_too_many() {
        let settings = PackSettings { margin_texels: 2.0, width: 64, height: 64, tiles: 4, ..PackSettings::default() };
        let groups = [4, 4, 4, 4, -1, -1];
        let rules = RepackRules { groups: Some(&groups), ..RepackRules::default() };
        let pack = |settings: &PackSettings, rules: &RepackRules<'_>| {
            repack(&POINTS, &TRIANGLES, &[5, 2, 5, 2, 0, 0], rules, settings, &Progress::new())
        };
        let found = pack(&settings, &rules).expect("they fit");
        assert_eq!((found.tiles, &found.uv[..4]), (2, &found.uv[4..8]));
        let fixed = RepackRules { scale: RepackScale::Fixed, ..rules };
        let both = PackSettings { texel_density: Some(3.0), ..settings };
        assert_eq!(pack(&both, &fixed).err(), Some(RepackError::TwoScales { density: 3.0 }));
    }
}
