//! A piece to charts: flatten, or split and flatten the parts, until all lie under the limit.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};
use crate::segmentation::SpectralAnalysis;
use crate::settings::Settings;

use super::flatten::{Flat, Outcome, flatten, landmark_distances};
use super::neighbourhood::subgraph;
use super::sample::Sample;
use super::split;

/// Spectral splits that deep have not helped; halving always ends.
const MOST_SPECTRAL_SPLITS: u32 = 24;

/// A chart of a sample.
#[derive(Clone, Debug)]
pub(super) struct NodeChart {
    /// Its nodes, ascending.
    pub(super) nodes: Vec<u32>,
    /// A position a node, at the area of the surface.
    pub(super) uv: Vec<Point2<f64>>,
}

/// The charts of a sample and how they came about.
#[derive(Clone, Debug, Default)]
pub(super) struct Charting {
    pub(super) charts: Vec<NodeChart>,
    pub(super) history: History,
}

/// Counts for the report.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct History {
    pub(super) landmarks: usize,
    pub(super) sweeps: usize,
    /// By name, in no order of their own.
    pub(super) rungs: Vec<(&'static str, usize)>,
}

impl History {
    pub(super) fn take(&mut self, rung: &'static str, times: usize) {
        match self.rungs.iter_mut().find(|(name, _)| *name == rung) {
            Some((_, count)) => *count += times,
            None => self.rungs.push((rung, times)),
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.landmarks += other.landmarks;
        self.sweeps += other.sweeps;
        other.rungs.iter().for_each(|&(rung, times)| self.take(rung, times));
    }

    fn of(flat: &Flat) -> Self {
        Self { landmarks: flat.landmarks, sweeps: flat.sweeps, rungs: vec![(flat.rung, 1)] }
    }
}

struct Open {
    nodes: Vec<u32>,
    splits: u32,
}

enum Step {
    Accept(NodeChart, History),
    Split(Vec<Vec<u32>>, &'static str),
}

/// Charts of the given connected parts of a sample, sorted by lowest node, each under the limit or too small to be cut.
///
/// Rounds over all open parts, in parallel; a part is split in two or more of fewer nodes, so there are at most as many
/// rounds as nodes, and after [`MOST_SPECTRAL_SPLITS`] each halves.
pub(super) fn chart(
    sample: &Sample,
    parts: Vec<Vec<u32>>,
    limit: f64,
    settings: &Settings,
    done: &(dyn Fn(usize) + Sync),
    progress: &Progress,
) -> Result<Charting, Cancelled> {
    let mut open: Vec<Open> = parts.into_iter().map(|nodes| Open { nodes, splits: 0 }).collect();
    let mut charting = Charting::default();
    while !open.is_empty() {
        // The largest first, so that no long part starts last.
        open.sort_by_key(|o| (std::cmp::Reverse(o.nodes.len()), o.nodes.first().copied()));
        let steps: Vec<Result<Step, Cancelled>> = open
            .par_iter()
            .with_max_len(1)
            .map_init(Vec::new, |local: &mut Vec<u32>, part| {
                local.resize(sample.len(), u32::MAX);
                let outcome = step(sample, part, local, limit, settings, progress)?;
                if matches!(outcome, Step::Accept(..)) {
                    done(part.nodes.len());
                }
                Ok(outcome)
            })
            .collect();
        let mut next = Vec::new();
        for (part, step) in open.iter().zip(steps) {
            match step? {
                Step::Accept(chart, history) => {
                    charting.charts.push(chart);
                    charting.history.add(&history);
                }
                Step::Split(parts, rung) => {
                    charting.history.take(rung, 1);
                    next.extend(parts.into_iter().map(|nodes| Open { nodes, splits: part.splits + 1 }));
                }
            }
        }
        open = next;
    }
    charting.charts.sort_by_key(|c| c.nodes.first().copied());
    Ok(charting)
}

/// Splits a chart that the caller does not accept in two or more parts. A chart of one node stays whole.
pub(super) fn split(
    sample: &Sample,
    nodes: &[u32],
    settings: &Settings,
    progress: &Progress,
) -> Result<Vec<Vec<u32>>, Cancelled> {
    let graph = subgraph(&sample.graph, nodes, &mut vec![u32::MAX; sample.len()]);
    let count = settings.geodesics.landmark_count(nodes.len());
    let distances = landmark_distances(&graph, count, progress)?;
    let parts = split::spectral_parts(&graph, &distances, &SpectralAnalysis::new(&distances)?)?;
    let parts = parts.unwrap_or_else(|| split::halves(&graph));
    Ok(parts.into_iter().map(|part| part.into_iter().map(|v| nodes[v as usize]).collect()).collect())
}

fn step(
    sample: &Sample,
    part: &Open,
    local: &mut [u32],
    limit: f64,
    settings: &Settings,
    progress: &Progress,
) -> Result<Step, Cancelled> {
    progress.check()?;
    let graph = subgraph(&sample.graph, &part.nodes, local);
    let own = sample.part(&part.nodes, graph);
    let seed = settings.seed ^ u64::from(part.nodes.first().copied().unwrap_or(0));
    let (parts, rung) = match flatten(&own, limit, seed, settings, progress)? {
        Outcome::Flat(flat) => {
            let history = History::of(&flat);
            let chart = NodeChart { nodes: part.nodes.clone(), uv: flat.uv };
            return Ok(Step::Accept(chart, history));
        }
        Outcome::Split(distances, analysis) if part.splits < MOST_SPECTRAL_SPLITS => {
            match split::spectral_parts(&own.graph, &distances, &analysis)? {
                Some(parts) => (parts, "split"),
                None => (split::halves(&own.graph), "halve"),
            }
        }
        Outcome::Split(..) | Outcome::Halve => (split::halves(&own.graph), "halve"),
    };
    let global = |nodes: Vec<u32>| nodes.into_iter().map(|v| part.nodes[v as usize]).collect();
    Ok(Step::Split(parts.into_iter().map(global).collect(), rung))
}
