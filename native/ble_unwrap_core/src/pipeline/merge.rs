//! Charts joined to larger ones where the union still flattens under the limit.
//!
//! Splitting top-down is greedy: two neighbours from different branches may well be one chart. Iso-charts
//! merges by an estimate; here the real flattening is the judge.

use rayon::prelude::*;

use crate::charts::Chart;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::charting::Charting;
use super::memo::Run;
use super::rungs::{Rung, Rungs};
use super::sew;

/// Failed unions a chart may take part in before it is left alone.
const MOST_FAILURES: usize = 4;

/// Which neighbours are tried.
#[derive(Clone, Copy, Debug)]
pub(super) enum Which {
    /// All.
    All,
    /// Only those of which one came out of a split, and which have so few faces together.
    AfterSplits {
        /// Most faces of a union.
        most_faces: usize,
    },
}

/// A chart and its history.
struct Candidate {
    chart: Chart,
    area: f64,
    failures: usize,
    /// Came out of a split, or of joining a chart that did.
    split: bool,
    /// Charts (by index) whose union with this one is known to be over the limit.
    refused: Vec<usize>,
}

impl Candidate {
    fn new(chart: Chart, split: bool) -> Self {
        Self { area: chart.patch.area(), chart, failures: 0, split, refused: Vec::new() }
    }
}

/// Joins neighbouring charts, longest shared border over √(smaller area) first (guides count little), as long as the union
/// is under the limit. Each chart takes part in at most [`MOST_FAILURES`] failed tests, so the number of
/// tests is linear in the number of charts. Two halves of a split in two are not tried: their union has
/// already been refused.
pub(super) fn merge(
    mesh: &TriMesh,
    polygon: &[u32],
    charting: Charting,
    which: Which,
    settings: &Settings,
    progress: &Run<'_>,
) -> Result<(Vec<Chart>, Rungs), Cancelled> {
    let mut rungs = Rungs::default();
    let family = charting.family;
    let mut pool: Vec<Option<Candidate>> = charting
        .charts
        .into_iter()
        .zip(&family)
        .map(|(chart, family)| Some(Candidate::new(chart, family.is_some())))
        .collect();
    let mut halves: Vec<(u32, usize)> = family.iter().enumerate().filter_map(|(i, f)| Some(((*f)?, i))).collect();
    halves.sort_unstable();
    for pair in halves.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, a), (_, b)] = *pair {
            for (one, other) in [(a, b), (b, a)] {
                if let Some(c) = &mut pool[one] {
                    c.refused.push(other);
                }
            }
        }
    }
    let mut owner = vec![usize::MAX; mesh.face_count()];
    for (i, c) in pool.iter().enumerate() {
        for f in c.iter().flat_map(|c| &c.chart.patch.faces) {
            owner[f.index()] = i;
        }
    }
    loop {
        progress.check()?;
        let pairs = independent_pairs(&pool, &borders(mesh, &owner, &pool, which));
        if pairs.is_empty() {
            break;
        }
        let tests: Vec<Result<(Option<Chart>, Rungs), Cancelled>> = pairs
            .par_iter()
            .with_max_len(1)
            .map(|&(a, b)| {
                let mut rungs = Rungs::default();
                let (Some(one), Some(other)) = (&pool[a], &pool[b]) else { return Ok((None, rungs)) };
                let sides = [&one.chart, &other.chart];
                Ok((sew::joined(mesh, polygon, sides, settings, &mut rungs, progress)?, rungs))
            })
            .collect();
        for (&(a, b), test) in pairs.iter().zip(tests) {
            let (joined, steps) = test?;
            if let Some(chart) = joined {
                rungs.add(&steps);
                rungs.take(Rung::Merge);
                for f in &chart.patch.faces {
                    owner[f.index()] = pool.len();
                }
                let split = [a, b].iter().any(|&i| pool[i].as_ref().is_some_and(|c| c.split));
                pool[a] = None;
                pool[b] = None;
                pool.push(Some(Candidate::new(chart, split)));
            } else {
                for (one, other) in [(a, b), (b, a)] {
                    if let Some(c) = &mut pool[one] {
                        c.failures += 1;
                        c.refused.push(other);
                    }
                }
            }
        }
    }
    let mut charts: Vec<Chart> = pool.into_iter().flatten().map(|c| c.chart).collect();
    charts.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok((charts, rungs))
}

/// Shared border length of each pair of charts that may still be tested, sorted by pair.
fn borders(mesh: &TriMesh, owner: &[usize], pool: &[Option<Candidate>], which: Which) -> Vec<(usize, usize, f64)> {
    let faces = |i: usize| pool[i].as_ref().map_or(0, |c| c.chart.patch.faces.len());
    let split = |i: usize| pool[i].as_ref().is_some_and(|c| c.split);
    let wanted = |a: usize, b: usize| match which {
        Which::All => true,
        Which::AfterSplits { most_faces } => (split(a) || split(b)) && faces(a) + faces(b) <= most_faces,
    };
    let open = |i: usize| pool[i].as_ref().is_some_and(|c| c.failures < MOST_FAILURES);
    let shared = |h: HalfedgeId| {
        let t = mesh.twin(h);
        if t.is_none() || t < h {
            return None;
        }
        let (a, b) = (owner[h.face().index()], owner[t.face().index()]);
        let (a, b) = (a.min(b), a.max(b));
        let refused = || pool[a].as_ref().is_some_and(|c| c.refused.contains(&b));
        (a != b && b != usize::MAX && wanted(a, b) && open(a) && open(b) && !refused())
            .then(|| (a, b, mesh.edge_length(h) * mesh.border_cost(h)))
    };
    let mut sides: Vec<(usize, usize, f64)> = mesh.halfedges().filter_map(shared).collect();
    sides.sort_by_key(|s| (s.0, s.1));
    sides
        .chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
        .map(|group| (group[0].0, group[0].1, group.iter().map(|s| s.2).sum()))
        .collect()
}

/// Pairs in which no chart occurs twice, best first.
fn independent_pairs(pool: &[Option<Candidate>], borders: &[(usize, usize, f64)]) -> Vec<(usize, usize)> {
    let area = |i: usize| pool[i].as_ref().map_or(0.0, |c| c.area);
    let mut scored: Vec<(f64, usize, usize)> = borders
        .iter()
        .map(|&(a, b, length)| (length / area(a).min(area(b)).max(f64::MIN_POSITIVE).sqrt(), a, b))
        .collect();
    scored.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut taken = vec![false; pool.len()];
    let mut pairs = Vec::new();
    for (_, a, b) in scored {
        if !taken[a] && !taken[b] {
            taken[a] = true;
            taken[b] = true;
            pairs.push((a, b));
        }
    }
    pairs
}
