//! Geodesic distances between the points of a cloud.

use rayon::prelude::*;
use thiserror::Error;

use crate::error_kind::ErrorKind;
use crate::geodesics::{
    Connectivity, DijkstraScratch, WeightedGraph, connectivity, dijkstra_within, knn_graph, shortest_bridges,
};
use crate::memory;
use crate::progress::{Cancelled, Progress, Stage};

/// Numbers of neighbours looked at for one that connects a cloud: above it the edges of most clouds leave their surface,
/// and the search takes longer than the distances.
const MOST_NEIGHBOURS_TRIED: usize = 64;

/// Sources whose rows are filled together: enough for many threads, and no more memory is touched before the
/// next look at the cancel flag.
const SOURCES_AT_ONCE: usize = 256;

/// What to do with a cloud that its neighbourhood graph does not connect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Connect {
    /// Return an error, whose text says what would connect the points.
    Error,
    /// Join the pieces by the shortest edges between them. Every path between two pieces then leads over such a bridge, so
    /// a distance between pieces is correct only if the surface has no other connection between them.
    Bridge,
    /// Leave the pieces separate: distances between them are infinite.
    Separate,
}

/// How distances between the points of a cloud are measured.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudDistanceSettings {
    /// Number of nearest neighbours that each point is joined to; at least 1.
    pub neighbours: usize,
    /// What to do with a cloud in several pieces.
    pub connect: Connect,
    /// Greatest distance of interest, in the unit of the points. Larger distances are given as infinite, and no time is
    /// spent on them.
    pub radius: f64,
}

impl Default for CloudDistanceSettings {
    /// 12 neighbours, no greatest distance, and an error for a cloud in pieces. With 12 neighbours distances are 3 % too
    /// long on average, where 6 neighbours give 10 %; and edges leave the surface less often than with 24.
    fn default() -> Self {
        Self { neighbours: 12, connect: Connect::Error, radius: f64::INFINITY }
    }
}

/// Why distances could not be computed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CloudDistancesError {
    /// The number of coordinates is not a multiple of the dimension.
    #[error("{values} coordinates do not make points of {dimension} coordinates each")]
    WrongLength {
        /// Number of values.
        values: usize,
        /// Number of coordinates of each point.
        dimension: usize,
    },
    /// A coordinate is not finite.
    #[error("point {point} has a coordinate that is not finite{}", others_text(*.others))]
    NotFinite {
        /// The first such point.
        point: usize,
        /// How many more points there are like it.
        others: usize,
    },
    /// A source is not a point of the cloud.
    #[error("source {number} is point {point}, but the points are numbered 0 to {point_count} (exclusive)")]
    Source {
        /// Position in the list of sources, from 0.
        number: usize,
        /// The point it names.
        point: i32,
        /// Number of points.
        point_count: usize,
    },
    /// The settings ask for no neighbours.
    #[error("points need at least 1 neighbour, not 0")]
    NoNeighbours,
    /// There are more distances than fit in memory.
    #[error(
        "{sources} sources times {points} points are more distances than fit in memory ({}); ask for fewer sources at a time",
        memory::text((*sources as u64).saturating_mul(*points as u64).saturating_mul(8))
    )]
    TooLarge {
        /// Number of sources.
        sources: usize,
        /// Number of points.
        points: usize,
    },
    /// The neighbourhood graph is in several pieces.
    #[error("{0}; or bridge the pieces, leave the small ones out, or measure each by itself")]
    Disconnected(Box<Connectivity>),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl CloudDistancesError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::WrongLength { .. }
            | Self::NotFinite { .. }
            | Self::Source { .. }
            | Self::NoNeighbours
            | Self::TooLarge { .. }
            | Self::Disconnected(_) => ErrorKind::Argument,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

fn others_text(others: usize) -> String {
    match others {
        0 => String::new(),
        1 => ", and so has 1 other point".into(),
        _ => format!(", and so have {others} other points"),
    }
}

/// Distances from each of k `sources` (all points, if `None`) to each of n points, along the edges from points to their
/// nearest neighbours: k×n values, row by row, in the unit of the points.
///
/// `points` holds the coordinates of each point, `dimension` ≥ 1 of them, row by row. The result is an estimate of the
/// geodesic distance on the surface that the points sample. Since paths zigzag from point to point, it is some per cent too
/// long; more neighbours reduce this error, but more points do not. It is too short where edges leave the surface. On
/// random points of smooth surfaces it is 3 % too long on average with 12 neighbours, and 0.9 % with 24. Points that
/// coincide are at distance 0 from each other. A distance is infinite if it is larger than `radius`, or between pieces with
/// [`Connect::Separate`]. If all points are sources, the matrix is exactly symmetric and satisfies the triangle inequality,
/// to rounding. The result is the same for any number of threads.
///
/// Distances are in double precision, unlike those of [`surface_distances`](super::surface_distances()), because functions
/// that compute with whole matrices, such as [`embed`](crate::embedding::embed()), take double precision.
///
/// O(n log n) for the graph in few dimensions, and O(b log b) for a source that has b points and edges within the radius.
///
/// Source: the paper, section 5.1, and J. B. Tenenbaum, V. de Silva, J. C. Langford: A global geometric framework for
/// nonlinear dimensionality reduction, Science 290 (2000), 2319–2323.
///
/// # Errors
/// [`CloudDistancesError`]: a coordinate is not finite or the last point is incomplete, a source is not a point, there are
/// no neighbours, the graph is in several pieces (with [`Connect::Error`]), the result is too large, or the call was
/// cancelled.
pub fn cloud_distances(
    points: &[f64],
    dimension: usize,
    sources: Option<&[i32]>,
    settings: &CloudDistanceSettings,
    progress: &Progress,
) -> Result<Vec<f64>, CloudDistancesError> {
    progress.check()?;
    progress.enter(Stage::Condition);
    let n = checked_count(points, dimension)?;
    let all = sources.is_none();
    let sources = checked_sources(sources, n)?;
    if settings.neighbours == 0 {
        return Err(CloudDistancesError::NoNeighbours);
    }
    let too_large = || CloudDistancesError::TooLarge { sources: sources.len(), points: n };
    let count = sources.len().checked_mul(n).ok_or_else(too_large)?;
    let mut rows: Vec<f64> = memory::required(count).map_err(|_| too_large())?;
    // A power of two loses no bit, and squares of the scaled coordinates neither overflow nor vanish.
    let scale = power_of_two_within(points);
    let scaled: Vec<f64> = points.iter().map(|x| x / scale).collect();
    let graph = connected_graph(&scaled, dimension, settings, progress)?;
    if count == 0 {
        return Ok(rows);
    }
    progress.enter(Stage::Charts);
    for sources in sources.chunks(SOURCES_AT_ONCE) {
        let first = rows.len();
        rows.resize(first + sources.len() * n, f64::INFINITY);
        let tasks = rows[first..].par_chunks_mut(n).zip(sources);
        tasks.try_for_each_init(DijkstraScratch::default, |scratch, (row, &source)| {
            progress.check()?;
            let distances = dijkstra_within(&graph, &[(source, 0.0)], settings.radius / scale, scratch, progress)?;
            for (to, &distance) in row.iter_mut().zip(distances) {
                *to = distance * scale;
            }
            Ok::<(), Cancelled>(())
        })?;
        progress.advance(Stage::Charts, rows.len() as f64 / count as f64);
    }
    if all {
        make_symmetric(&mut rows, n);
    }
    Ok(rows)
}

/// The graph that the settings ask for, or why there is none.
fn connected_graph(
    points: &[f64],
    dimension: usize,
    settings: &CloudDistanceSettings,
    progress: &Progress,
) -> Result<WeightedGraph, CloudDistancesError> {
    let graph = knn_graph(points, dimension, settings.neighbours, progress)?;
    match settings.connect {
        Connect::Separate => Ok(graph),
        Connect::Bridge => {
            let bridges = shortest_bridges(&graph, points, dimension, progress)?;
            Ok(if bridges.is_empty() { graph } else { graph.with_edges(&bridges) })
        }
        Connect::Error => {
            let most = MOST_NEIGHBOURS_TRIED.max(2 * settings.neighbours);
            let found = connectivity(&graph, points, dimension, settings.neighbours, most, progress)?;
            if found.is_connected() { Ok(graph) } else { Err(CloudDistancesError::Disconnected(Box::new(found))) }
        }
    }
}

/// The number of points, all of whose coordinates are finite.
fn checked_count(points: &[f64], dimension: usize) -> Result<usize, CloudDistancesError> {
    if dimension == 0 || !points.len().is_multiple_of(dimension) {
        return Err(CloudDistancesError::WrongLength { values: points.len(), dimension });
    }
    let mut nowhere =
        points.chunks_exact(dimension).enumerate().filter(|(_, p)| !p.iter().all(|x| x.is_finite())).map(|(i, _)| i);
    match nowhere.next() {
        Some(point) => Err(CloudDistancesError::NotFinite { point, others: nowhere.count() }),
        None => Ok(points.len() / dimension),
    }
}

/// The sources as nodes; all points if none are given.
fn checked_sources(sources: Option<&[i32]>, n: usize) -> Result<Vec<usize>, CloudDistancesError> {
    let Some(sources) = sources else { return Ok((0..n).collect()) };
    let node = |(number, &point): (usize, &i32)| match usize::try_from(point) {
        Ok(node) if node < n => Ok(node),
        _ => Err(CloudDistancesError::Source { number, point, point_count: n }),
    };
    sources.iter().enumerate().map(node).collect()
}

/// The greatest power of two that no coordinate is below in size; 1 where all are zero.
fn power_of_two_within(points: &[f64]) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    let greatest = points.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if greatest == 0.0 { 1.0 } else { f64::from_bits(greatest.to_bits() & EXPONENT).max(f64::MIN_POSITIVE) }
}

/// Gives both of d(i, j) and d(j, i), which differ by the order of their sums, the lesser value.
fn make_symmetric(rows: &mut [f64], n: usize) {
    /// Square tiles of so many columns stay in the cache while they are read across.
    const TILE: usize = 64;
    for top in (0..n).step_by(TILE) {
        for left in (0..=top).step_by(TILE) {
            for i in top..(top + TILE).min(n) {
                for j in left..(left + TILE).min(i) {
                    let least = rows[i * n + j].min(rows[j * n + i]);
                    rows[i * n + j] = least;
                    rows[j * n + i] = least;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a sheet in 4 dimensions, turned so that no coordinate is simple, and a cluster far from it.
    fn sheet(columns: usize, rows: usize, far: usize) -> Vec<f64> {
        let mut points = Vec::new();
        for i in 0..columns * rows {
            let (x, y) = ((i % columns) as f64, (i / columns) as f64);
            points.extend([0.6 * x, 0.8 * x, 0.28 * y, 0.96 * y]);
        }
        points.extend((0..far).flat_map(|i| [1e3, 0.0, 0.01 * i as f64, 0.0]));
        points
    }

    fn distances(
        points: &[f64],
        sources: Option<&[i32]>,
        settings: &CloudDistanceSettings,
    ) -> Result<Vec<f64>, CloudDistancesError> {
        cloud_distances(points, 4, sources, settings, &Progress::new())
    }

    fn by(neighbours: usize, connect: Connect) -> CloudDistanceSettings {
        CloudDistanceSettings { neighbours, connect, ..CloudDistanceSettings::default() }
    }

    #[test]
    fn distances_along_a_sheet() {
        let points = sheet(30, 20, 0);
        let d = distances(&points, Some(&[0, 29]), &by(20, Connect::Error)).expect("connected");
        assert_eq!(d.len(), 1200);
        assert!((d[29] - 29.0).abs() < 1e-9 && (d[600] - 29.0).abs() < 1e-9, "straight along a row");
        assert_eq!(d[0], 0.0);
        // The steps of knights and kings, at most 2.8 % longer than straight.
        for i in 0..600 {
            let straight = ((i % 30) as f64).hypot((i / 30) as f64);
            assert!(d[i] >= straight - 1e-9 && d[i] <= 1.03 * straight + 1e-9, "{i}: {} {straight}", d[i]);
        }
    }

    #[test]
    fn all_pairs_are_symmetric_to_the_bit_and_scale_with_the_points() {
        let points: Vec<f64> = sheet(14, 11, 0).iter().enumerate().map(|(i, x)| x + 0.2 * (i as f64).sin()).collect();
        let d = distances(&points, None, &CloudDistanceSettings::default()).expect("connected");
        for i in 0..154 {
            for j in 0..154 {
                assert_eq!(d[i * 154 + j].to_bits(), d[j * 154 + i].to_bits());
            }
        }
        for factor in [2f64.powi(-900), 2f64.powi(1000)] {
            let scaled: Vec<f64> = points.iter().map(|x| x * factor).collect();
            let found = distances(&scaled, None, &CloudDistanceSettings::default()).expect("connected");
            assert!(found.iter().zip(&d).all(|(a, b)| *a == b * factor), "squares of {factor:e} leave the range");
        }
    }

    #[test]
    fn a_cloud_in_pieces_is_an_error_joined_or_left_alone() {
        let points = sheet(10, 10, 20);
        let found = distances(&points, Some(&[0]), &by(5, Connect::Error));
        let Err(CloudDistancesError::Disconnected(found)) = found else { panic!("two pieces: {found:?}") };
        assert_eq!((found.pieces.len(), found.pieces[1].size, found.enough), (2, 20, Some(20)));
        let text = CloudDistancesError::Disconnected(found).to_string();
        assert!(text.contains("20 about 100; 20 neighbours would connect them; or bridge"), "{text}");

        let apart = distances(&points, Some(&[0]), &by(5, Connect::Separate)).expect("two pieces");
        assert!(apart[..100].iter().all(|d| d.is_finite()) && apart[100..].iter().all(|d| d.is_infinite()));
        let joined = distances(&points, Some(&[0]), &by(5, Connect::Bridge)).expect("two pieces");
        assert_eq!(&joined[..100], &apart[..100]);
        assert!(joined[100..].iter().all(|d| (900.0..1100.0).contains(d)));
    }

    #[test]
    fn beyond_the_radius_is_infinity() {
        let points = sheet(20, 20, 0);
        let all = distances(&points, Some(&[7]), &CloudDistanceSettings::default()).expect("connected");
        let settings = CloudDistanceSettings { radius: 4.5, ..CloudDistanceSettings::default() };
        let near = distances(&points, Some(&[7]), &settings).expect("connected");
        assert!(all.iter().zip(&near).all(|(a, n)| if *a <= 4.5 { a == n } else { n.is_infinite() }));
        assert!(near.iter().any(|d| d.is_infinite()));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let mut points = sheet(5, 5, 0);
        let found = distances(&points[..6], None, &CloudDistanceSettings::default());
        assert_eq!(found, Err(CloudDistancesError::WrongLength { values: 6, dimension: 4 }));
        let none = cloud_distances(&points, 0, None, &CloudDistanceSettings::default(), &Progress::new());
        assert_eq!(none, Err(CloudDistancesError::WrongLength { values: 100, dimension: 0 }));
        for point in [25, -1] {
            let found = distances(&points, Some(&[3, point]), &CloudDistanceSettings::default());
            assert_eq!(found, Err(CloudDistancesError::Source { number: 1, point, point_count: 25 }));
        }
        assert_eq!(distances(&points, None, &by(0, Connect::Bridge)), Err(CloudDistancesError::NoNeighbours));
        points[13] = f64::NAN;
        points[50] = f64::INFINITY;
        let found = distances(&points, None, &CloudDistanceSettings::default());
        assert_eq!(found, Err(CloudDistancesError::NotFinite { point: 3, others: 1 }));
        let cancelled = Progress::new();
        cancelled.cancel();
        let found = cloud_distances(&points, 4, None, &CloudDistanceSettings::default(), &cancelled);
        assert_eq!(found, Err(CloudDistancesError::Cancelled(Cancelled::OnRequest)));
        assert_eq!(distances(&[], None, &CloudDistanceSettings::default()), Ok(Vec::new()));
        assert_eq!(distances(&[1.0; 4], None, &CloudDistanceSettings::default()), Ok(vec![0.0]));
    }
}
