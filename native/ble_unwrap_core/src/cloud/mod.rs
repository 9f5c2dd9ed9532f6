//! Point clouds: an atlas without a mesh, one UV a point.
//!
//! The paper maps "dense point clouds" (sections 5 and 5.1) as it maps meshes, with geodesic distances by Dijkstra's
//! algorithm on the graph of nearest neighbours. A cloud has no triangles, so what meshes take from them, stretch,
//! flips, overlap, borders, is defined here by neighbourhoods.
//!
//! # Terms
//! A **piece** is a connected component of the neighbourhood graph. A **chart** is a connected part of a piece that is
//! flattened as a whole. A **cell** is a patch of some tens of points, the node that large pieces are charted by. The
//! **spacing** at a point is the root of the area it stands for. A **splat** is a square around a point, one spacing to
//! each side, that keeps the margin. A **speck** is a chart of less than a texel, as stray points are.
//!
//! # Stages
//! 1. `clean`: finite, distinct points in a standard box.
//! 2. `neighbourhood`: k nearest neighbours without bridges over empty space; areas; pieces.
//! 3. `cells`, for pieces of more than some thousand points: a coarser sample.
//! 4. `charting`, by way of `flatten` and `split`: landmarks, distances, spectral planarity, Bernoulli logistic
//!    embedding, `relax`; judged by `local_map` and `overlap`; what is over the limit is split and goes again.
//! 5. `prolong`: from cells to points.
//! 6. `footprint`, `layout`: packing.
//!
//! # References
//! Hoppe et al., Surface reconstruction from unorganized points, SIGGRAPH 1992 (tangent planes and their sides);
//! those of the mesh stages; what single steps take from elsewhere is named where they are.

mod atlas;
mod cells;
mod charting;
mod clean;
mod error;
mod flatten;
mod footprint;
mod layout;
mod local_map;
mod neighbourhood;
mod orientation;
mod overlap;
mod piece;
mod prolong;
mod relax;
mod sample;
mod split;

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Point2;
use rayon::prelude::*;

use crate::clock::Clock;
use crate::memory;
use crate::progress::{Cancelled, Progress, Stage};
use crate::report::counted;
use crate::settings::{NEIGHBOURS, Settings};

pub use atlas::{CloudReport, PointAtlas, PointDefect};
pub use error::CloudError;

use charting::History;
use clean::{CleanCloud, NO_POINT};
use layout::{Layout, PlaneChart};
use local_map::measure_nodes;
use neighbourhood::{Neighbourhood, subgraph};
use piece::PieceCharts;
use sample::Sample;

/// Indices are 32 bits, one value of which stands for "none".
const MOST_POINTS: usize = (1 << 31) - 1;
/// What a point takes at the peak, in bytes: 1,300 were measured with the usual number of neighbours.
const OF_POINT: u64 = 2048;
/// Charts under this share of the surface do not count as the worst.
const NEGLIGIBLE: f64 = 1e-4;
/// Share of the charting stage that the neighbourhood graph takes.
const GRAPH_WORK: f64 = 0.2;

/// Maps a point cloud to the plane: one UV for each point, in charts under a stretch limit, packed into the unit square.
/// `neighbours` is the number of nearest neighbours that each point is joined to.
///
/// Guaranteed for every result: each point with finite coordinates lies in exactly one chart and has a UV in [0, 1]²;
/// coincident points share both; points of different charts are at least the margin apart, in texels. In charts larger than
/// a texel, this holds also for the squares around the points that reach one spacing of the points to each side. Each chart
/// of eight nodes or more (points, or groups of points in large pieces) has an L2 stretch within `settings.stretch_limit`,
/// as far as the neighbourhoods tell, or is listed in the report. A connected piece whose points lie in a plane keeps its
/// shape to rounding. The result is the same, bit for bit, for any number of threads.
///
/// Not guaranteed: a measured stretch that is right to better than some thousandths. Where the points themselves are
/// charted, it comes out up to 0.005 too low, since a mean over a neighbourhood smooths away small errors of the positions.
/// (For a hemisphere of 2,500 points it is 1.017 with 12 neighbours and 1.022 when measured with 30, while the least
/// possible is 1.021.) Also not guaranteed: freedom from folds and overlaps narrower than the spacing of points (those that
/// are found are counted); the fewest charts; the connectivity that a person would see. Two sheets are joined if they are
/// nearer to each other than the points of a sheet are, and a surface that is sampled with gaps is separated into pieces.
/// More `neighbours` bridge wider gaps.
///
/// The settings of mesh connectivity and of stretch minimisation have no meaning here. `settings.coarse` says whether large
/// pieces are charted by small groups of points rather than by single points.
///
/// O(n log n); some 3 s for 100,000 points and 25 s for a million on two cores.
///
/// # Errors
/// [`CloudError`]: a setting is out of range, no point is finite, the charts cannot keep the margin at the size of the
/// texture, or the call was cancelled.
pub fn unwrap_points(
    positions: &[[f64; 3]],
    neighbours: usize,
    settings: &Settings,
    progress: &Progress,
) -> Result<PointAtlas, CloudError> {
    progress.check()?;
    settings.validate().map_err(CloudError::Setting)?;
    let [least, most] = NEIGHBOURS.range;
    if !(least..=most).contains(&neighbours) {
        return Err(CloudError::Neighbours { value: neighbours });
    }
    if positions.len() > MOST_POINTS {
        return Err(CloudError::TooLarge { points: positions.len() });
    }
    memory::require((positions.len() as u64).saturating_mul(OF_POINT)).map_err(Cancelled::OutOfMemory)?;
    let mut clock = Clock::new();
    progress.enter(Stage::Condition);
    let cloud = clean::clean(positions, progress)?;
    if cloud.points.is_empty() && !positions.is_empty() {
        return Err(CloudError::NoFinitePoint { points: positions.len() });
    }
    clock.lap("clean");
    progress.enter(Stage::Charts);
    let neighbourhood = Neighbourhood::new(&cloud.points, neighbours, progress)?;
    progress.advance(Stage::Charts, GRAPH_WORK);
    clock.lap("neighbours");
    let pieces = charts_of_pieces(&cloud, neighbourhood, settings, progress)?;
    clock.lap("charts");
    progress.enter(Stage::Pack);
    let planes: Vec<PlaneChart> = pieces.par_iter().flat_map_iter(plane_charts).collect();
    let layout = layout::lay_out(&planes, &settings.packing, progress)?;
    clock.lap("pack");
    progress.enter(Stage::Verify);
    let mut atlas = assemble(&cloud, &pieces, &layout, settings);
    clock.lap("measure");
    atlas.report.seconds = clock.into_laps();
    progress.enter(Stage::Done);
    Ok(atlas)
}

fn charts_of_pieces(
    cloud: &CleanCloud,
    neighbourhood: Neighbourhood,
    settings: &Settings,
    progress: &Progress,
) -> Result<Vec<PieceCharts>, Cancelled> {
    let Neighbourhood { graph, area, pieces } = neighbourhood;
    let total = cloud.points.len().max(1) as f64;
    let charted = AtomicUsize::new(0);
    let done = |points: usize| {
        let share = (charted.fetch_add(points, Ordering::Relaxed) + points) as f64 / total;
        progress.advance(Stage::Charts, GRAPH_WORK + (1.0 - GRAPH_WORK) * share.min(1.0));
    };
    if pieces.len() == 1 {
        let points = (0..cloud.points.len() as u32).collect();
        let sample = Sample::new(cloud.points.clone(), area, graph);
        return Ok(vec![piece::charts(points, sample, settings, &done, progress)?]);
    }
    let one = |local: &mut Vec<u32>, points: Vec<u32>| {
        local.resize(cloud.points.len(), u32::MAX);
        let part = subgraph(&graph, &points, local);
        let position = points.iter().map(|&i| cloud.points[i as usize]).collect();
        let own = points.iter().map(|&i| area[i as usize]).collect();
        piece::charts(points, Sample::new(position, own, part), settings, &done, progress)
    };
    let work = pieces.into_par_iter().with_max_len(64).map_init(Vec::new, one);
    work.collect::<Vec<Result<PieceCharts, Cancelled>>>().into_iter().collect()
}

/// The charts of a piece as the packer wants them.
fn plane_charts(piece: &PieceCharts) -> impl Iterator<Item = PlaneChart> + '_ {
    piece.members.iter().map(|members| {
        let alone = members.len() == 1;
        let area = |&i: &u32| if alone { 0.0 } else { piece.area[i as usize] };
        PlaneChart {
            uv: members.iter().map(|&i| piece.uv[i as usize]).collect(),
            half: members.iter().map(|i| area(i).sqrt()).collect(),
            area: members.iter().map(area).sum(),
        }
    })
}

/// Gathers UVs and charts by input point, and measures what was rounded.
fn assemble(cloud: &CleanCloud, pieces: &[PieceCharts], layout: &Layout, settings: &Settings) -> PointAtlas {
    let n = cloud.points.len();
    let (mut uv, mut chart) = (vec![[0.0f32; 2]; n], vec![0i32; n]);
    let mut number = 0;
    for piece in pieces {
        for members in &piece.members {
            for (&i, place) in members.iter().zip(&layout.uv[number]) {
                let point = piece.points[i as usize] as usize;
                uv[point] = *place;
                chart[point] = number as i32;
            }
            number += 1;
        }
    }
    let report = report(cloud, pieces, layout, &uv, settings);
    let of = |&i: &u32| (i != NO_POINT).then_some(i as usize);
    PointAtlas {
        uv: cloud.of_input.iter().map(|i| of(i).map_or([0.0; 2], |i| uv[i])).collect(),
        chart: cloud.of_input.iter().map(|i| of(i).map_or(-1, |i| chart[i])).collect(),
        report,
    }
}

fn report(
    cloud: &CleanCloud,
    pieces: &[PieceCharts],
    layout: &Layout,
    uv: &[[f32; 2]],
    settings: &Settings,
) -> CloudReport {
    let size = [settings.packing.width, settings.packing.height].map(f64::from);
    let mut report = CloudReport {
        points: cloud.of_input.len(),
        unmapped_points: cloud.unmapped,
        duplicate_points: cloud.duplicates,
        pieces: pieces.len(),
        charts: layout.uv.len(),
        specks: layout.specks,
        packing_efficiency: layout.efficiency,
        l2: 1.0,
        l2_chart_scale: 1.0,
        l2_worst_chart: 1.0,
        ..CloudReport::default()
    };
    let surface: f64 = pieces.iter().flat_map(|p| &p.area).sum();
    let mut history = History::default();
    let (mut sums, mut roots, mut number) = ([0.0; 3], 0.0, 0);
    for piece in pieces {
        history.add(&piece.history);
        report.nodes += piece.nodes;
        report.overlaps += piece.overlaps;
        let texel = |&i: &u32| {
            let [u, v] = uv[i as usize].map(f64::from);
            Point2::new(u * size[0], v * size[1])
        };
        let places: Vec<Point2<f64>> = piece.points.iter().map(texel).collect();
        for members in &piece.members {
            let stretch = measure_nodes(&piece.offsets, &piece.area, &places, members);
            let [energy, plane, area] = stretch.sums;
            if area > 0.0 {
                // A speck has a scale of its own.
                sums = [sums[0] + energy, sums[1] + plane, sums[2] + area];
                roots += (energy * plane).sqrt();
                report.folded_points += stretch.folded.len();
                if stretch.l2 > report.l2_worst_chart && area > NEGLIGIBLE * surface {
                    report.l2_worst_chart = stretch.l2;
                    report.worst_chart = Some(number);
                }
                if stretch.l2 > settings.stretch_limit {
                    report.charts_over_limit.push((number, stretch.l2));
                }
            }
            number += 1;
        }
    }
    if sums[2] > 0.0 {
        report.l2 = (sums[0] / sums[2] * sums[1] / sums[2]).sqrt();
        report.l2_chart_scale = roots / sums[2];
    }
    report.landmarks = history.landmarks;
    report.sweeps = history.sweeps;
    report.rungs = history.rungs;
    report.rungs.sort_unstable();
    report.warnings = warnings(&report, pieces);
    report
}

fn warnings(report: &CloudReport, pieces: &[PieceCharts]) -> Vec<String> {
    let mut list = Vec::new();
    if report.unmapped_points > 0 {
        let points = counted(report.unmapped_points, ["point has", "points have"]);
        list.push(format!("{points} no finite position and got no UV"));
    }
    if report.duplicate_points > 0 {
        let points = counted(
            report.duplicate_points,
            ["point coincides with another and shares its", "points coincide with others and share their"],
        );
        list.push(format!("{points} UV"));
    }
    let stray = pieces.iter().filter(|p| p.points.len() < 4).count();
    if stray > 0 {
        list.push(format!(
            "{} of fewer than 4 points, far from all others, got charts of their own; if they belong to the surface, \
             raise the number of neighbours",
            counted(stray, ["piece", "pieces"])
        ));
    }
    if let Some(&(chart, l2)) = report.charts_over_limit.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        list.push(format!(
            "{} the stretch limit, the worst is chart {chart} with {l2:.3}",
            counted(report.charts_over_limit.len(), ["chart exceeds", "charts exceed"])
        ));
    }
    if report.folded_points + report.overlaps > 0 {
        list.push(format!(
            "{} folded over and {} upon each other: the cloud is noisy or no surface there",
            counted(report.folded_points, ["point is", "points are"]),
            counted(report.overlaps, ["pair lies", "pairs lie"])
        ));
    }
    list
}
