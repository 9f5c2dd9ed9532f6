//! A chart opened by a dart from where it bulges, where that saves more stretch than it costs seam.

use std::borrow::Cow;

use crate::cache::Run;
use crate::mesh::HalfedgeId;
use crate::progress::Cancelled;

use super::super::cost::Price;
use super::super::edit::Edit;
use super::super::history::{History, MoveKind, Place};
use super::super::state::{ChartId, Cutting};
use super::dart::Bulging;
use super::{Move, Proposal, Site, Start};

/// Charts whose stretch costs less than this are left alone: the seam would have to be as short, in roots of the surface's area.
const LEAST_GAIN: f64 = 0.1;

/// A dart into a chart.
pub(crate) struct Slit {
    pub(crate) price: Price,
}

impl Move for Slit {
    fn kind(&self) -> MoveKind {
        MoveKind::Slit
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, price: &Price) -> Vec<Site> {
        let site = |id: ChartId| {
            let chart = cutting.chart(id)?;
            let first = chart.patch.faces.first()?.halfedge(0);
            let gain = price.of_stretch(chart);
            let is_open = gain > LEAST_GAIN && history.failures(MoveKind::Slit, id) == 0;
            is_open.then(|| (gain, Site { place: Place::At(first), charts: vec![id], ways: Vec::new() }))
        };
        let mut sites: Vec<(f64, Site)> = cutting.ids().filter_map(site).collect();
        sites.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.place.cmp(&b.1.place)));
        sites.into_iter().map(|site| site.1).collect()
    }

    fn ways(&self, cutting: &Cutting<'_>, site: &Site, run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        let Some(chart) = site.charts.first().and_then(|&id| cutting.chart(id)) else { return Ok(Vec::new()) };
        let Some(bulging) = Bulging::of(Cow::Borrowed(&chart.patch), 1.0, run)? else { return Ok(Vec::new()) };
        let surface = |h: &HalfedgeId| chart.patch.faces[h.face().index()].halfedge(h.slot());
        let dart: Vec<HalfedgeId> = bulging.dart().iter().flatten().map(surface).collect();
        let length: f64 = dart.iter().map(|&h| cutting.seam_length(h)).sum();
        // More than all of its stretch no dart can save.
        if dart.is_empty() || self.price.of_seam(length) >= self.price.of_stretch(chart) {
            return Ok(Vec::new());
        }
        Ok(vec![Proposal { edit: Edit::new(cutting.mesh(), &[], &dart), start: Start::Opened }])
    }
}
