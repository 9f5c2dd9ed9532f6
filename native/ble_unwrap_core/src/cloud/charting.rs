//! A piece to charts: flatten, or split and flatten the parts, until all lie under the limit.

use nalgebra::Point2;

use crate::progress::{Cancelled, Progress};
use crate::rounds::{self, Outcome};
use crate::segmentation::SpectralAnalysis;
use crate::settings::Settings;

use super::flatten::{Flat, Outcome as Flattened, flatten, landmark_distances};
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
    let open = parts.into_iter().map(|nodes| Open { nodes, splits: 0 }).collect();
    let rounds = rounds::until_made(
        open,
        |o: &Open| (std::cmp::Reverse(o.nodes.len()), o.nodes.first().copied()),
        Vec::new,
        |part, local: &mut Vec<u32>| {
            local.resize(sample.len(), u32::MAX);
            let (outcome, history) = step(sample, part, local, limit, settings, progress)?;
            if matches!(outcome, Outcome::Made(_)) {
                done(part.nodes.len());
            }
            Ok((outcome, history))
        },
    )?;
    let mut charting = Charting::default();
    rounds.notes.iter().for_each(|history| charting.history.add(history));
    charting.charts = rounds.made.into_iter().map(|(chart, _)| chart).collect();
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
) -> Result<(Outcome<NodeChart, Open>, History), Cancelled> {
    progress.check()?;
    let graph = subgraph(&sample.graph, &part.nodes, local);
    let own = sample.part(&part.nodes, graph);
    let seed = settings.seed ^ u64::from(part.nodes.first().copied().unwrap_or(0));
    let (parts, rung) = match flatten(&own, limit, seed, settings, progress)? {
        Flattened::Flat(flat) => {
            let history = History::of(&flat);
            let chart = NodeChart { nodes: part.nodes.clone(), uv: flat.uv };
            return Ok((Outcome::Made(chart), history));
        }
        Flattened::Split(distances, analysis) if part.splits < MOST_SPECTRAL_SPLITS => {
            match split::spectral_parts(&own.graph, &distances, &analysis)? {
                Some(parts) => (parts, "split"),
                None => (split::halves(&own.graph), "halve"),
            }
        }
        Flattened::Split(..) | Flattened::Halve => (split::halves(&own.graph), "halve"),
    };
    let global = |nodes: Vec<u32>| Open {
        nodes: nodes.into_iter().map(|v| part.nodes[v as usize]).collect(),
        splits: part.splits + 1,
    };
    let mut history = History::default();
    history.take(rung, 1);
    Ok((Outcome::Divided(parts.into_iter().map(global).collect()), history))
}
