//! What a search remembers of trials that came to nothing.

use std::collections::{BTreeMap, BTreeSet};

use crate::mesh::HalfedgeId;

use super::state::ChartId;

/// The moves on charts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum MoveKind {
    /// Two charts are glued along their whole border, or a run of it.
    Join,
    /// The same, embedded anew.
    JoinAnew,
    /// Two charts are glued along a part of a run.
    PartialJoin,
    /// A cut in a chart is closed from its end on.
    Zip,
    /// A cut along the mirror plane is closed where it can be seen, for darts in pairs.
    Face,
}

/// Where a move is made, for as long as the charts there stay what they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// Between two charts, the lower name first.
    Between(ChartId, ChartId),
    /// At an edge, of which this is the lower side.
    At(HalfedgeId),
}

impl Place {
    pub(super) fn between(a: ChartId, b: ChartId) -> Self {
        Self::Between(a.min(b), a.max(b))
    }
}

/// How often a move was refused at a place, and how it was the last time.
#[derive(Clone, Copy, Debug, Default)]
struct Refusals {
    count: usize,
    had_bad_start: bool,
}

/// The refused trials of one search. A chart that is new has none.
#[derive(Debug, Default)]
pub(super) struct History {
    refusals: BTreeMap<(MoveKind, Place), Refusals>,
    failures: BTreeMap<(MoveKind, ChartId), usize>,
    /// Charts that a split has made since all neighbours were tried with each other, and what they were joined to.
    split: BTreeSet<ChartId>,
}

impl History {
    /// Notes that a chart came out of a split.
    pub(super) fn note_split(&mut self, id: ChartId) {
        self.split.insert(id);
    }

    pub(super) fn is_from_split(&self, id: ChartId) -> bool {
        self.split.contains(&id)
    }

    /// Notes that a move is known to come to nothing, without a trial.
    pub(super) fn exclude(&mut self, by: MoveKind, place: Place) {
        self.refusals.entry((by, place)).or_default().count += 1;
    }

    /// Notes a trial that came to nothing; `had_bad_start` where another start might do.
    pub(super) fn refuse(&mut self, by: MoveKind, place: Place, charts: &[ChartId], had_bad_start: bool) {
        self.exclude(by, place);
        self.refusals.entry((by, place)).or_default().had_bad_start = had_bad_start;
        for &id in charts {
            *self.failures.entry((by, id)).or_default() += 1;
        }
    }

    /// Notes that charts have been replaced by others.
    pub(super) fn replace(&mut self, old: &[ChartId], new: &[ChartId]) {
        if old.iter().any(|&id| self.is_from_split(id)) {
            self.split.extend(new);
        }
    }

    /// How often a move was refused at a place.
    pub(super) fn refusals(&self, by: MoveKind, place: Place) -> usize {
        self.refusals.get(&(by, place)).map_or(0, |r| r.count)
    }

    /// Whether the last trial of a move at a place began badly.
    pub(super) fn had_bad_start(&self, by: MoveKind, place: Place) -> bool {
        self.refusals.get(&(by, place)).is_some_and(|r| r.had_bad_start)
    }

    /// In how many trials of a move that came to nothing a chart took part.
    pub(super) fn failures(&self, by: MoveKind, id: ChartId) -> usize {
        self.failures.get(&(by, id)).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::state::{Cutting, tests::strips};
    use super::*;
    use crate::mesh::test_surfaces;

    #[test]
    fn refusals_are_of_a_move_and_a_pair_and_failures_of_a_chart() {
        let mesh = test_surfaces::grid(6, 4, [6.0, 4.0], 0.0);
        let (polygon, charts) = strips(&mesh, 6.0, 3);
        let cutting = Cutting::new(&mesh, &polygon, charts);
        let ids: Vec<ChartId> = cutting.ids().collect();
        let mut history = History::default();
        let place = |a: usize, b: usize| Place::between(ids[a], ids[b]);
        history.refuse(MoveKind::Join, place(1, 0), &[ids[1], ids[0]], true);
        history.refuse(MoveKind::Join, place(1, 2), &[ids[1], ids[2]], false);
        history.exclude(MoveKind::Join, place(0, 2));
        assert_eq!(history.refusals(MoveKind::Join, place(0, 1)), 1);
        assert_eq!(history.refusals(MoveKind::Join, place(2, 0)), 1);
        assert_eq!(history.refusals(MoveKind::JoinAnew, place(0, 1)), 0);
        assert!(history.had_bad_start(MoveKind::Join, place(0, 1)));
        assert!(!history.had_bad_start(MoveKind::Join, place(1, 2)));
        let failures: Vec<usize> = ids.iter().map(|&id| history.failures(MoveKind::Join, id)).collect();
        assert_eq!(failures, [1, 2, 1], "what is known without a trial is no failure");
        history.note_split(ids[2]);
        history.replace(&ids[..2], &ids[..1]);
        assert!(!history.is_from_split(ids[0]));
        history.replace(&ids[1..], &ids[1..2]);
        assert!(history.is_from_split(ids[1]));
    }
}
