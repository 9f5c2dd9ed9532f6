//! A cut closed again from its end on.
//!
//! Where a chart is cut open the cut ends inside it, and often further in than it need: what the limit allows is not all used, or
//! the stretch that is saved is not worth the seam. Then the last edges of the cut are glued again.

use crate::mesh::HalfedgeId;

use super::super::border::{self, BorderRun};
use super::super::cost::Price;
use super::super::edit::Edit;
use super::super::history::{History, MoveKind, Place};
use super::super::state::{ChartId, Cutting};
use super::{Move, Proposal, Site, Start};

/// Ends that were not worth closing, before a chart is left alone.
const MOST_FAILURES: usize = 2;
/// What is closed costs at least as much as so many roots of the surface's area: shorter ends are not worth a minimisation.
const LEAST_CLOSED: f64 = 0.02;
/// A gap of width g between the sides of a cut, closed, costs an excess of squared stretch of about g²/4, times area. An end is
/// tried as far as the limit and the price may allow that much.
const HOPE: f64 = 4.0;
/// The sides of a cut lie at most so many times as far apart as what is closed is long: from further apart there is no good start.
const MOST_OPEN: f64 = 2.0;
/// If closing so much of a cut as there is hope for does not do, this share of it is tried.
const SHARE: f64 = 0.5;
/// Lengths that are tried at one end. A longer piece that does not do is mostly told by its start, which costs little; 4 instead of 3
/// shorten the seams of 19 models by 1 %.
const TRIES: usize = 3;

/// The end of a cut in a chart, glued.
pub(crate) struct Zip {
    /// The stretch that a chart may have.
    pub(crate) limit: f64,
}

impl Move for Zip {
    fn kind(&self) -> MoveKind {
        MoveKind::Zip
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, price: &Price) -> Vec<Site> {
        let mut ends: Vec<(f64, Site)> = Vec::new();
        for id in cutting.ids().filter(|&id| history.failures(MoveKind::Zip, id) < MOST_FAILURES) {
            for run in border::runs(cutting, id, |other| other == id) {
                for end in ends_of(cutting, &run) {
                    ends.extend(self.site(cutting, history, price, id, &end));
                }
            }
        }
        ends.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.place.cmp(&b.1.place)));
        ends.into_iter().map(|end| end.1).collect()
    }
}

impl Zip {
    /// The edges from the end of a cut on, as far as there is hope, and less of them. The length of seam it saves comes with it.
    fn site(
        &self,
        cutting: &Cutting<'_>,
        history: &History,
        price: &Price,
        id: ChartId,
        end: &[HalfedgeId],
    ) -> Option<(f64, Site)> {
        let (mesh, chart) = (cutting.mesh(), cutting.chart(id)?);
        let first = *end.first()?;
        let place = Place::At(first.min(mesh.twin(first)));
        if history.refusals(MoveKind::Zip, place) > 0 {
            return None;
        }
        let room = chart.patch.area() * (self.limit * self.limit - chart.l2 * chart.l2);
        // Both sides of an edge end where the next one begins.
        let gap = |h: HalfedgeId| (cutting.end(h) - cutting.start(mesh.twin(h))).norm_squared();
        let length = |count: usize| end[..count].iter().map(|&h| cutting.seam_length(h)).sum::<f64>();
        let is_hopeful = |count: usize| {
            let (seam, gap) = (length(count), gap(end[count - 1]));
            gap <= HOPE * room.min(price.excess_worth(seam)) && gap <= (MOST_OPEN * seam).powi(2)
        };
        let hoped = (1..=end.len()).rev().find(|&count| is_hopeful(count)).unwrap_or(0);
        let mut counts = vec![hoped];
        for _ in 1..TRIES {
            let last = counts[counts.len() - 1];
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
            counts.push((SHARE * last as f64) as usize);
        }
        counts.retain(|&count| price.of_seam(length(count)) >= LEAST_CLOSED);
        counts.dedup();
        let glue = |&count: &usize| Proposal { edit: Edit::new(mesh, &end[..count], &[]), start: Start::Glued(None) };
        let ways: Vec<Proposal> = counts.iter().map(glue).collect();
        (!ways.is_empty()).then(|| (length(hoped), Site { place, charts: vec![id], ways }))
    }
}

/// The cuts that end inside the chart, along a run whose two sides are the chart's own: for each the edges from its end on, on the
/// side that comes after it.
fn ends_of(cutting: &Cutting<'_>, run: &BorderRun) -> Vec<Vec<HalfedgeId>> {
    let (mesh, edges) = (cutting.mesh(), &run.edges);
    let n = edges.len();
    let at = |k: usize| edges[k % n];
    let steps = if run.is_loop { n } else { n.saturating_sub(1) };
    let is_end = |k: &usize| mesh.twin(at(*k)) == at(*k + 1);
    // From an end on, the run goes out on one side and came in on the other.
    let from = |k: usize| {
        let room = if run.is_loop { n / 2 } else { (k + 1).min(n - 1 - k) };
        let pairs = (0..room).map(|j| (at(n + k - j), at(k + 1 + j)));
        pairs.take_while(|&(before, after)| mesh.twin(before) == after).map(|pair| pair.1).collect()
    };
    (0..steps).filter(is_end).map(from).collect()
}
