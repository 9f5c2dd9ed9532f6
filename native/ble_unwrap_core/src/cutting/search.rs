//! The search: trials of moves at many places at once, and those made by which the cost falls.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::cache::Run;
use crate::charts::Chart;
use crate::flattening::{Rung, Rungs};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::cost::{self, Price};
use super::edit::Edit;
use super::history::{History, MoveKind};
use super::moves::{Move, Site};
use super::state::{ChartId, Cutting};
use super::trial::{Verdict, trial};

/// Makes moves until none is left to be tried. In each round the first of `moves` that has any sites is tried at as many as
/// have no chart in common, best first, in parallel; so a later one waits until the earlier ones have nothing left to do.
///
/// It ends because the cost falls with every move that is made, every other trial is noted, and a move has no site that was
/// refused often enough. The result does not depend on the number of threads.
pub(super) fn search(
    cutting: &mut Cutting<'_>,
    history: &mut History,
    moves: &[&dyn Move],
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<(), Cancelled> {
    let price = Price::new(cutting.mesh(), settings);
    loop {
        run.progress.check()?;
        let found = moves.iter().find_map(|made| {
            let sites = disjoint(made.sites(cutting, history, &price));
            (!sites.is_empty()).then_some((made, sites))
        });
        let Some((made, sites)) = found else { return Ok(()) };
        let trials: Vec<Result<(Verdict, Rungs), Cancelled>> = sites
            .par_iter()
            .with_max_len(1)
            .map(|site| tried(cutting, *made, site, Some(&price), settings, run))
            .collect();
        for (site, trial) in sites.iter().zip(trials) {
            let (verdict, steps) = trial?;
            match verdict {
                Verdict::Charts(charts) => {
                    rungs.add(&steps);
                    rungs.take(rung_of(made.kind()));
                    let new = cutting.replace(&site.charts, charts);
                    history.replace(&site.charts, &new);
                }
                refused => history.refuse(made.kind(), site.place, &site.charts, matches!(refused, Verdict::BadStart)),
            }
        }
    }
}

/// How the report counts a move.
fn rung_of(kind: MoveKind) -> Rung {
    match kind {
        MoveKind::Join | MoveKind::JoinAnew => Rung::Merge,
        MoveKind::PartialJoin | MoveKind::Face => Rung::Dart,
        MoveKind::Zip => Rung::Zip,
    }
}

/// Those sites of which no two share a chart, the earlier ones first.
fn disjoint(mut sites: Vec<Site>) -> Vec<Site> {
    let mut taken: BTreeSet<ChartId> = BTreeSet::new();
    sites.retain(|site| {
        let is_free = site.charts.iter().all(|id| !taken.contains(id));
        if is_free {
            taken.extend(&site.charts);
        }
        is_free
    });
    sites
}

/// What comes of a move at a site: the first of its ways that makes charts, and where there is a price, is worth it, or the cheapest of these;
/// the moves of the search glue, so that one chart takes the place of all. One with a bad start tells that another may do.
pub(super) fn tried(
    cutting: &Cutting<'_>,
    made: &dyn Move,
    site: &Site,
    price: Option<&Price>,
    settings: &Settings,
    run: &Run<'_>,
) -> Result<(Verdict, Rungs), Cancelled> {
    let mut rungs = Rungs::default();
    let mut verdict = Verdict::Refused;
    let old: Vec<&Chart> = site.charts.iter().filter_map(|&id| cutting.chart(id)).collect();
    let mut best: Option<(f64, Vec<Chart>)> = None;
    let mut made_by: Vec<Edit> = Vec::new();
    for way in made.ways(cutting, site, run)? {
        // From another start the same edit makes the same charts, or hardly better ones.
        if made_by.contains(&way.edit) {
            continue;
        }
        let price = price.map(|price| made.price(*price, cutting, &way.edit));
        let saved = way.edit.saved_length(cutting);
        let stretch_limit = price.map_or(settings.stretch_limit, |price| price.limit_of_union(&old, saved, settings));
        if price.is_some() && cost::is_out_of_reach(&old, stretch_limit) {
            continue;
        }
        let under_price = Settings { stretch_limit, ..settings.clone() };
        match trial(cutting, &way, &under_price, &mut rungs, run)? {
            Verdict::Refused => (),
            Verdict::BadStart => verdict = Verdict::BadStart,
            Verdict::Charts(charts) => {
                if price.is_some_and(|price| !price.is_worth(&old, &charts)) {
                    continue;
                }
                let cost = price.map_or(0.0, |price| price.of_all(&charts));
                if !made.takes_cheapest() {
                    return Ok((Verdict::Charts(charts), rungs));
                }
                made_by.push(way.edit);
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, charts));
                }
            }
        }
    }
    Ok((best.map_or(verdict, |(_, charts)| Verdict::Charts(charts)), rungs))
}
