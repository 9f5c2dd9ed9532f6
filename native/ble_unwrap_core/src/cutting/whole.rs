//! A connected mesh, fine or coarse, cut into charts by itself.

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::Rungs;
use crate::mesh::{FaceId, HalfedgeId};
use crate::progress::Cancelled;
use crate::settings::{Moves, Settings};

use super::cost::Price;
use super::divide::{self, Charting};
use super::history::History;
use super::moves::Move;
use super::moves::join::{self, Which};
use super::moves::partial_join::PartialJoin;
use super::moves::zip::Zip;
use super::search::search;
use super::state::Cutting;

/// A connected mesh as a patch of itself.
#[derive(Clone, Copy)]
pub(super) struct Whole<'a> {
    pub(super) patch: &'a Patch,
}

impl Whole<'_> {
    /// The patch made of some faces, cut along some edges of which both sides are given, sorted.
    pub(super) fn part(&self, faces: &[FaceId], cuts: &[HalfedgeId]) -> Patch {
        if cuts.is_empty() && faces.len() == self.patch.faces.len() {
            return self.patch.clone();
        }
        let is_cut = |h| cuts.binary_search(&h).is_ok();
        Patch::cut_out(&self.patch.mesh, &self.patch.polygon, faces.to_vec(), is_cut)
    }

    /// Charts patches that make up this mesh, and joins charts that need not be apart. `done` is told the
    /// faces of each chart that is made.
    pub(super) fn charts(
        &self,
        patches: Vec<Patch>,
        which: Which,
        settings: &Settings,
        rungs: &mut Rungs,
        done: &(dyn Fn(f64) + Sync),
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        let price = Price::new(&self.patch.mesh, settings);
        let charting = divide::divide(patches, &price, settings, done, run)?;
        rungs.add(&charting.rungs);
        self.join(charting, which, settings, rungs, run)
    }

    /// Joins charts of this mesh along their borders, where that is wanted.
    pub(super) fn join(
        &self,
        charting: Charting,
        which: Which,
        settings: &Settings,
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        if settings.moves < Moves::Join {
            return Ok(charting.charts);
        }
        join::join(&self.patch.mesh, &self.patch.polygon, charting, which, settings, rungs, run)
    }

    /// Joins charts of this mesh along parts of their borders, if all moves are wanted.
    pub(super) fn join_partly(
        &self,
        charts: Vec<Chart>,
        settings: &Settings,
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        self.search(charts, &[&PartialJoin::Longest], settings, rungs, run)
    }

    /// Closes cuts of charts of this mesh from their ends on, if all moves are wanted.
    pub(super) fn close(
        &self,
        charts: Vec<Chart>,
        settings: &Settings,
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        self.search(charts, &[&Zip { limit: settings.stretch_limit }], settings, rungs, run)
    }

    /// Makes moves on charts of this mesh, if all moves are wanted.
    fn search(
        &self,
        charts: Vec<Chart>,
        moves: &[&dyn Move],
        settings: &Settings,
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        if settings.moves < Moves::All {
            return Ok(charts);
        }
        let mut cutting = Cutting::new(&self.patch.mesh, &self.patch.polygon, charts);
        search(&mut cutting, &mut History::default(), moves, settings, rungs, run)?;
        Ok(cutting.into_charts())
    }
}
