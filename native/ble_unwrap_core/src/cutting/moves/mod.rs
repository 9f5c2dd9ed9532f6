//! What may be changed about a cutting. A move looks at the cutting and proposes edits; it flattens nothing itself.
//!
//! Moves on a patch that has no map to the plane yet say where to cut it: [`split`], [`dart`], [`net`]. Moves on charts make
//! fewer or better ones of them: [`join`], [`partial_join`], [`zip`], [`face`], [`hand_over`], [`across`], [`fold`].

pub(super) mod across;
pub(super) mod dart;
pub(super) mod face;
pub(super) mod fold;
pub(super) mod hand_over;
pub(super) mod join;
mod lobe;
pub(super) mod net;
pub(super) mod partial_join;
pub(super) mod split;
pub(super) mod zip;

use crate::cache::Run;
use crate::mesh::FaceId;
use crate::progress::Cancelled;

use super::cost::Price;
use super::edit::Edit;
use super::history::{History, MoveKind, Place};
use super::rigid_motion::Motion;
use super::state::{ChartId, Corners, Cutting};

/// An edit, and where the trial of it begins.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    pub(super) edit: Edit,
    pub(super) start: Start,
}

/// Where what an edit makes lies before it is flattened.
#[derive(Clone, Debug)]
pub(super) enum Start {
    /// Where its faces lie now, but for those of one chart, which may be moved rigidly. What does not meet is spread over the
    /// map.
    Glued(Option<(ChartId, Motion)>),
    /// Where its faces lie now, but for these, in ascending order. Nothing else may move.
    Redrawn(Vec<(FaceId, Corners)>),
    /// Where its faces lie now, and they may stay there if they are under the limit.
    Lying,
    /// Wherever an embedding puts it, without further cuts.
    Embedded,
    /// Wherever an embedding puts it: each patch is made one chart from nothing, and cut as that asks for.
    Anew,
}

/// A place at which a move could do something.
#[derive(Debug)]
pub(super) struct Site {
    pub(super) place: Place,
    /// The charts that would be changed.
    pub(super) charts: Vec<ChartId>,
    /// What could be done there, if that is known already.
    pub(super) ways: Vec<Proposal>,
}

/// A change of charts.
pub(super) trait Move: Sync {
    fn kind(&self) -> MoveKind;

    /// The prices that an edit which the move proposes is judged by.
    fn price(&self, usual: Price, _cutting: &Cutting<'_>, _edit: &Edit) -> Price {
        usual
    }

    /// Where it may be made, best first. A site that has been refused often enough is none, so that the search ends.
    fn sites(&self, cutting: &Cutting<'_>, history: &History, price: &Price) -> Vec<Site>;

    /// Whether the cheapest of what comes of all that is to be tried at a site is made, not the first that is worth it.
    fn takes_cheapest(&self) -> bool {
        false
    }

    /// What is to be tried at a site, in this order: until a trial comes to something, or all of it where the cheapest is taken.
    ///
    /// # Errors
    /// The caller cancelled, or there is not enough memory.
    fn ways(&self, _cutting: &Cutting<'_>, site: &Site, _run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        Ok(site.ways.clone())
    }
}
