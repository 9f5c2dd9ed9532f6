//! A connected mesh, fine or coarse, cut into charts by itself.

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::Rungs;
use crate::mesh::{FaceId, HalfedgeId};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::divide::{self, Charting};
use super::moves::join::{self, Which};
use super::moves::partial_join;

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

    /// Charts patches that make up this mesh and joins charts that need not be apart. `done` is told the faces of each chart
    /// that is made.
    pub(super) fn charts(
        &self,
        patches: Vec<Patch>,
        settings: &Settings,
        rungs: &mut Rungs,
        done: &(dyn Fn(f64) + Sync),
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        let charting = divide::divide(patches, settings, done, run)?;
        rungs.add(&charting.rungs);
        self.join(charting, Which::All, settings, rungs, run)
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
        if !settings.merge {
            return Ok(charting.charts);
        }
        join::join(&self.patch.mesh, &self.patch.polygon, charting, which, settings, rungs, run)
    }

    /// Joins charts of this mesh along parts of their borders, where that is wanted.
    pub(super) fn join_partly(
        &self,
        charts: Vec<Chart>,
        settings: &Settings,
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        partial_join::join_partly(&self.patch.mesh, &self.patch.polygon, charts, settings, rungs, run)
    }
}
