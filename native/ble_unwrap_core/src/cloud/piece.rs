//! One connected piece of the cloud to charts of points.

use nalgebra::Point2;

use crate::geodesics::WeightedGraph;
use crate::progress::{Cancelled, Progress};
use crate::settings::Settings;

use super::cells::Cells;
use super::charting::{self, Charting, History, NodeChart};
use super::flatten;
use super::local_map::{Offset, Offsets, Stretch, measure_nodes};
use super::orientation::orient;
use super::overlap::overlapping_pairs;
use super::prolong::FlatCells;
use super::sample::Sample;

/// Pieces of more points are charted on cells.
const CELLS_ABOVE: usize = 6_000;
/// Points a cell, about, and the number of cells that this is kept within.
const POINTS_A_CELL: usize = 12;
const CELLS: (usize, usize) = (2_000, 5_000);
/// On cells the stretch above 1 must stay under this share of what the limit allows.
const CELL_ALLOWANCE: f64 = 0.9;
/// Share of a chart's area that may be turned over at single points, where neighbourhoods are ragged.
const MOST_FOLDED: f64 = 1e-3;
/// Rounds of splitting charts that are good on cells and not on points.
const MOST_ROUNDS: usize = 6;

/// A piece with a place for each of its points.
pub(super) struct PieceCharts {
    /// Its points in the cloud, ascending.
    pub(super) points: Vec<u32>,
    /// The points of each chart, as numbers within the piece.
    pub(super) members: Vec<Vec<u32>>,
    /// Place of each point in its chart's plane, upright and at the area of the surface.
    pub(super) uv: Vec<Point2<f64>>,
    /// What the stretch is measured by.
    pub(super) offsets: Offsets,
    /// Area of each point.
    pub(super) area: Vec<f64>,
    /// Pairs of points that lie upon each other.
    pub(super) overlaps: usize,
    /// Nodes that were charted: points or cells.
    pub(super) nodes: usize,
    pub(super) history: History,
}

/// Charts a piece: `sample_of` are its points' positions, areas and graph.
pub(super) fn charts(
    points: Vec<u32>,
    sample: Sample,
    settings: &Settings,
    done: &(dyn Fn(usize) + Sync),
    progress: &Progress,
) -> Result<PieceCharts, Cancelled> {
    // A plane keeps its shape to rounding, which cells would not.
    if sample.len() <= CELLS_ABOVE || !settings.coarse || flatten::is_plane(&sample) {
        return by_points(points, sample, settings, done, progress);
    }
    by_cells(points, sample, settings, done, progress)
}

fn by_points(
    points: Vec<u32>,
    sample: Sample,
    settings: &Settings,
    done: &(dyn Fn(usize) + Sync),
    progress: &Progress,
) -> Result<PieceCharts, Cancelled> {
    let all = vec![(0..sample.len() as u32).collect()];
    let Charting { charts, history } = charting::chart(&sample, all, settings.stretch_limit, settings, done, progress)?;
    let (chart, uv) = spread(&charts, sample.len());
    let normal = normals_of_charts(&sample, &chart);
    let offsets = Offsets::within(&sample, &normal, Offset::Unbent, |i, j| chart[i] == chart[j]);
    let overlaps = pairs(&sample, &uv, &chart).len();
    let members = charts.into_iter().map(|c| c.nodes).collect();
    let nodes = sample.len();
    Ok(PieceCharts { points, members, uv, offsets, area: sample.area, overlaps, nodes, history })
}

fn by_cells(
    points: Vec<u32>,
    sample: Sample,
    settings: &Settings,
    done: &(dyn Fn(usize) + Sync),
    progress: &Progress,
) -> Result<PieceCharts, Cancelled> {
    let wanted = (sample.len() / POINTS_A_CELL).clamp(CELLS.0, CELLS.1);
    let cells = Cells::new(&sample.position, &sample.area, &sample.graph, wanted, progress)?;
    let count = cells.sample.len();
    let weight = sample.len() as f64 / count as f64;
    let done = |nodes: usize| done((nodes as f64 * weight) as usize);
    let limit = 1.0 + CELL_ALLOWANCE * (settings.stretch_limit - 1.0);
    let all = vec![(0..count as u32).collect()];
    let mut charting = charting::chart(&cells.sample, all, limit, settings, &done, progress)?;
    // At most `MOST_ROUNDS` times.
    let mut round = 0;
    loop {
        let fine = Fine::new(&cells, &sample, &charting.charts, progress)?;
        let bad = fine.bad_charts(&sample, settings.stretch_limit, &charting.charts);
        if bad.is_empty() || round == MOST_ROUNDS {
            let Fine { members, uv, offsets, overlaps, .. } = fine;
            let overlaps = overlaps.len();
            let history = charting.history;
            return Ok(PieceCharts {
                points,
                members,
                uv,
                offsets,
                area: sample.area,
                overlaps,
                nodes: count,
                history,
            });
        }
        let mut parts = Vec::new();
        let mut kept = Vec::new();
        for (number, chart) in charting.charts.into_iter().enumerate() {
            if bad.binary_search(&number).is_ok() {
                parts.extend(charting::split(&cells.sample, &chart.nodes, settings, progress)?);
                charting.history.take("split", 1);
            } else {
                kept.push(chart);
            }
        }
        let again = charting::chart(&cells.sample, parts, limit, settings, &|_| (), progress)?;
        charting.history.add(&again.history);
        kept.extend(again.charts);
        kept.sort_by_key(|c| c.nodes.first().copied());
        charting.charts = kept;
        round += 1;
    }
}

/// The points of a piece placed by its cells.
struct Fine {
    chart: Vec<u32>,
    members: Vec<Vec<u32>>,
    uv: Vec<Point2<f64>>,
    offsets: Offsets,
    overlaps: Vec<(u32, u32)>,
}

impl Fine {
    fn new(cells: &Cells, sample: &Sample, charts: &[NodeChart], progress: &Progress) -> Result<Self, Cancelled> {
        let (chart, uv) = spread(charts, cells.sample.len());
        let normal = normals_of_charts(&cells.sample, &chart);
        let flat = FlatCells { cells, chart, uv, normal };
        let placed = flat.prolong(&sample.position, progress)?;
        let chart: Vec<u32> = cells.of_point.iter().map(|&c| flat.chart[c as usize]).collect();
        let mut members = vec![Vec::new(); charts.len()];
        for (i, &c) in chart.iter().enumerate() {
            members[c as usize].push(i as u32);
        }
        let (mut uv, normal): (Vec<_>, Vec<_>) = placed.into_iter().unzip();
        progress.check()?;
        let offsets = Offsets::within(sample, &normal, Offset::Projected, |i, j| chart[i] == chart[j]);
        for points in &members {
            let stretch = measure_nodes(&offsets, &sample.area, &uv, points);
            pose(&stretch, points, &mut uv);
        }
        progress.check()?;
        let overlaps = pairs(sample, &uv, &chart);
        Ok(Self { chart, members, uv, offsets, overlaps })
    }

    /// Charts that break a rule on the points and can be split on the cells, ascending.
    fn bad_charts(&self, sample: &Sample, limit: f64, charts: &[NodeChart]) -> Vec<usize> {
        let mut overlapping = vec![false; charts.len()];
        for &(i, _) in &self.overlaps {
            overlapping[self.chart[i as usize] as usize] = true;
        }
        let bad = |number: &usize| {
            let stretch = measure_nodes(&self.offsets, &sample.area, &self.uv, &self.members[*number]);
            let broken = overlapping[*number] || stretch.l2 > limit || stretch.folded_share > MOST_FOLDED;
            broken && charts[*number].nodes.len() >= flatten::LEAST_NODES
        };
        (0..charts.len()).filter(bad).collect()
    }
}

/// Chart and place of each node.
fn spread(charts: &[NodeChart], nodes: usize) -> (Vec<u32>, Vec<Point2<f64>>) {
    let (mut chart, mut uv) = (vec![0; nodes], vec![Point2::origin(); nodes]);
    for (number, c) in charts.iter().enumerate() {
        for (&v, p) in c.nodes.iter().zip(&c.uv) {
            chart[v as usize] = number as u32;
            uv[v as usize] = *p;
        }
    }
    (chart, uv)
}

/// Normals with one side within each chart.
fn normals_of_charts(sample: &Sample, chart: &[u32]) -> Vec<nalgebra::Vector3<f64>> {
    let edges = (0..sample.len()).flat_map(|i| {
        sample.graph.neighbours(i).filter(move |&(j, _)| i < j && chart[i] == chart[j]).map(move |(j, l)| (i, j, l))
    });
    let inside = WeightedGraph::from_edges(sample.len(), edges.collect::<Vec<_>>());
    let mut normal = sample.normal.clone();
    orient(&inside, &mut normal);
    normal
}

fn pose(stretch: &Stretch, points: &[u32], uv: &mut [Point2<f64>]) {
    let scale = stretch.scale();
    let side = if stretch.mirrored { -scale } else { scale };
    for &i in points {
        let p = uv[i as usize];
        uv[i as usize] = Point2::new(side * p.x, scale * p.y);
    }
}

fn pairs(sample: &Sample, uv: &[Point2<f64>], chart: &[u32]) -> Vec<(u32, u32)> {
    let spacing: Vec<f64> = sample.area.iter().map(|a| a.sqrt()).collect();
    overlapping_pairs(uv, &sample.position, &spacing, 1.0, |i| chart[i])
}
