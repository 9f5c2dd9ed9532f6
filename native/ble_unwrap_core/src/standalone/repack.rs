//! Packing charts that exist already.

use nalgebra::Point2;
use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::packing::{self, PackError, PackItem, PackSettings, Packed};
use crate::progress::{Cancelled, Progress, Stage};

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
    /// A point belongs to two charts, which move differently.
    #[error("point {point} belongs to charts {first} and {second}; give each chart points of its own")]
    SharedPoint {
        /// The point.
        point: usize,
        /// The chart of its first triangle.
        first: i32,
        /// Another chart.
        second: i32,
    },
    /// The charts do not fit, or cannot be packed for another reason. In this error, charts are counted from 0 in ascending
    /// order of their numbers.
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
            Self::ChartCount { .. } | Self::PointOutOfRange { .. } | Self::SharedPoint { .. } => ErrorKind::Argument,
            Self::Pack(error) => error.kind(),
            Self::Cancelled(error) => error.kind(),
        }
    }
}

/// Charts in their new places.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Repacked {
    /// The new position of each point, in [0, 1]²; (0, 0) for points that belong to no chart.
    pub uv: Vec<[f32; 2]>,
    /// Number of charts.
    pub charts: usize,
    /// Area that charts cover, divided by the area of the texture. A chart that overlaps itself counts with the sum of its
    /// triangles' areas, but with no more than the texels it touches.
    pub efficiency: f64,
    /// The texel density that all charts share, except for tiny ones: texels to a unit of length of the points.
    pub texels_per_unit: f64,
    /// Number of tiny charts, each of which was scaled up to about a texel by a factor of its own.
    pub specks: usize,
}

/// Moves, turns and scales charts so that they fill the unit square and keep their margin. All charts are scaled by the
/// same factor, except for those of less than a texel.
///
/// Each of the `triangles` names three of the `points`. Triangles with the same number in `chart` make up a chart,
/// connected or not. Triangles with a negative number are left out, and so are points that belong to no triangle.
///
/// Guaranteed, also after rounding to single precision: two different charts are at least the margin apart; every chart
/// lies within the texture, at least half a margin from its border; no chart is mirrored; each is at least about a texel
/// large in its longer direction (unless all its points coincide). The result is the same for any number of threads. Not
/// guaranteed: the greatest possible density.
///
/// O(t log t) for t triangles and a bounded number of attempts; on two cores 0.05 to 0.1 s for 2 to 40 charts, and 0.2 to
/// 0.3 s for 170.
///
/// # Errors
/// [`RepackError`]: lengths or indices are wrong, a point belongs to two charts, the charts do not fit with their margin,
/// or the call was cancelled.
pub fn repack(
    points: &[[f64; 2]],
    triangles: &[[i32; 3]],
    chart: &[i32],
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Repacked, RepackError> {
    progress.check()?;
    progress.enter(Stage::Pack);
    if chart.len() != triangles.len() {
        return Err(RepackError::ChartCount { found: chart.len(), triangles: triangles.len() });
    }
    let mut owner = vec![-1; points.len()];
    let mut order: Vec<usize> = (0..triangles.len()).filter(|&t| chart[t] >= 0).collect();
    for &t in &order {
        for point in triangles[t] {
            let place = usize::try_from(point).ok().filter(|&p| p < points.len());
            let place = place.ok_or(RepackError::PointOutOfRange { triangle: t, point, points: points.len() })?;
            if owner[place] >= 0 && owner[place] != chart[t] {
                return Err(RepackError::SharedPoint { point: place, first: owner[place], second: chart[t] });
            }
            owner[place] = chart[t];
        }
    }
    order.sort_by_key(|&t| chart[t]);
    let mut local = vec![u32::MAX; points.len()];
    let charts: Vec<Island> = order
        .chunk_by(|&a, &b| chart[a] == chart[b])
        .map(|part| Island::new(points, triangles, part, &mut local))
        .collect();
    let items: Vec<PackItem<'_>> =
        charts.iter().map(|c| PackItem { points: &c.points, triangles: &c.triangles }).collect();
    let packed = packing::pack(&items, settings, progress)?;
    let mut uv = vec![[0.0; 2]; points.len()];
    let size = packed.size.map(|s| f64::from(s.max(1)));
    for (island, pose) in charts.iter().zip(&packed.poses) {
        for (&from, p) in island.source.iter().zip(&island.points) {
            let texel = pose.texel(*p);
            uv[from] = [(texel.x / size[0]) as f32, (texel.y / size[1]) as f32];
        }
    }
    let Packed { efficiency, texels_per_unit, specks, .. } = packed;
    Ok(Repacked { uv, charts: charts.len(), efficiency, texels_per_unit, specks })
}

/// One chart with points of its own.
struct Island {
    source: Vec<usize>,
    points: Vec<Point2<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Island {
    /// Gathers the triangles `part`. `local` is scratch: a point belongs to one chart, so its entry is
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
        repack(&POINTS, triangles, chart, &settings, &Progress::new())
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
}
