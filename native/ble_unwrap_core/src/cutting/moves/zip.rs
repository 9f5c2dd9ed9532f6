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

// Measured over 13 closed meshes of 250 to 10,000 faces at limits of 1.01, 1.015 and 1.02 without a stretch price: the cost is of charts
// and seam, in geometric means.

/// Ends that were not worth closing, before a chart is left alone. With 4 instead of 2 the cost is 0.6 % higher, and so is the time, by 7 %.
const MOST_FAILURES: usize = 2;
/// What is closed costs at least as much as so many roots of the surface's area: shorter ends are not worth a minimisation. Half of
/// it takes another 0.1 % off the cost.
const LEAST_CLOSED: f64 = 0.02;
/// A gap of width g between the sides of a cut, closed, costs an excess of squared stretch of about g²/4, times area. An end is
/// tried as far as the limit and the price may allow that much. With 2 and 8 instead of 4 the cost is 1.5 % and 1.7 % higher.
const HOPE: f64 = 4.0;
/// The sides of a cut lie at most so many times as far apart as what is closed is long: from further apart there is no good start. With
/// 1 instead of 2 the cost is 2.3 % higher.
const MOST_OPEN: f64 = 2.0;
/// If closing so much of a cut as there is hope for does not do, this share of it is tried.
const SHARE: f64 = 0.5;
/// Lengths that are tried at one end. With 2 and 5 instead of 3 seams are 0.3 % longer and 0.8 % shorter, in 0.87 and 1.08 of the time.
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
        let lengths: Vec<f64> = running_sums(end.iter().map(|&h| cutting.seam_length(h)));
        let is_hopeful = |count: usize| {
            let (seam, gap) = (lengths[count], gap(end[count - 1]));
            gap <= HOPE * room.min(price.excess_worth(seam)) && gap <= (MOST_OPEN * seam).powi(2)
        };
        let hoped = (1..=end.len()).rev().find(|&count| is_hopeful(count)).unwrap_or(0);
        let mut counts = vec![hoped];
        for _ in 1..TRIES {
            let last = counts[counts.len() - 1];
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
            counts.push((SHARE * last as f64) as usize);
        }
        counts.retain(|&count| price.of_seam(lengths[count]) >= LEAST_CLOSED);
        counts.dedup();
        let glue = |&count: &usize| Proposal { edit: Edit::new(mesh, &end[..count], &[]), start: Start::Glued(None) };
        let ways: Vec<Proposal> = counts.iter().map(glue).collect();
        (!ways.is_empty()).then(|| (lengths[hoped], Site { place, charts: vec![id], ways }))
    }
}

/// The sums of the first none, one, two … of some lengths.
fn running_sums(lengths: impl Iterator<Item = f64>) -> Vec<f64> {
    let sums = lengths.scan(0.0, |sum, length| {
        *sum += length;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// The cuts that end inside the chart, along a run whose two sides are the chart's own: for each the edges from its end on, on the
/// side that comes after it, up to the first guide.
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
        // Guides say where to cut.
        let goes_on = |&(before, after): &(HalfedgeId, HalfedgeId)| mesh.twin(before) == after && !mesh.is_guide(after);
        pairs.take_while(goes_on).map(|pair| pair.1).collect()
    };
    (0..steps).filter(is_end).map(from).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::super::search::search;
    use super::*;
    use crate::cache::Run;
    use crate::charts::{Chart, Patch};
    use crate::flattening::{self, Flattened, Rungs};
    use crate::mesh::{TriMesh, test_surfaces};
    use crate::progress::Progress;
    use crate::settings::Settings;
    use crate::stretch;
    use nalgebra::Point3;

    /// A sheet of 12 by 12, bent by a bump of some height in its middle, cut from there to the side at y = 6, and flattened.
    fn slit(bump: f64) -> (TriMesh, Vec<u32>, Chart) {
        let sheet = test_surfaces::grid(12, 12, [12.0, 12.0], 0.0);
        let lifted = |p: &Point3<f64>| {
            let away = (p.x - 6.0).powi(2) + (p.y - 6.0).powi(2);
            Point3::new(p.x, p.y, bump * (-away / 8.0).exp())
        };
        let positions: Vec<_> = sheet.positions().iter().map(lifted).collect();
        let triangles: Vec<_> = sheet.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let on_cut = |v| sheet.position(v).y == 6.0 && sheet.position(v).x <= 6.0;
        let cut: Vec<HalfedgeId> = mesh.edges().filter(|&h| on_cut(mesh.from(h)) && on_cut(mesh.to(h))).collect();
        let patch = Patch::whole(Arc::new(mesh.clone()), polygon.clone()).cut(&cut);
        let start: Vec<_> = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let (settings, run) = (Settings::default(), Run::new(&progress, None));
        let flat = flattening::isometric(&patch, &mut rungs).unwrap_or_else(|| {
            match flattening::opened(&patch, &start, &settings, &run).expect("not cancelled") {
                Flattened::Flat(flat) => flat,
                Flattened::Near(_) | Flattened::Refused => panic!("it is flat enough"),
            }
        });
        (mesh, polygon, flat.into_chart(patch))
    }

    /// The chart after the search, and how often it was closed.
    fn closed(bump: f64, stretch_price: f64, limit: f64) -> (Chart, Chart, usize) {
        let (mesh, polygon, before) = slit(bump);
        let settings = Settings { stretch_price, stretch_limit: limit, ..Settings::default() };
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let run = Run::new(&progress, None);
        let mut cutting = Cutting::new(&mesh, &polygon, vec![before.clone()]);
        search(&mut cutting, &mut History::default(), &[&Zip { limit }], &settings, &mut rungs, &run)
            .expect("not cancelled");
        cutting.check_invariants().expect("sound");
        let after = cutting.into_charts().pop().expect("a chart");
        assert_eq!(stretch::first_flip(&after.patch.mesh, &after.uv), None);
        assert!(stretch::boundary_is_simple(&after.patch.mesh, &after.uv) && after.l2 <= limit);
        let times = rungs.taken().iter().find(|(name, _)| *name == "zip").map_or(0, |r| r.1);
        (before, after, times)
    }

    fn around(chart: &Chart) -> f64 {
        chart.patch.mesh.boundary_length()
    }

    #[test]
    fn a_cut_in_a_flat_sheet_is_closed_but_for_its_mouth() {
        let (before, after, times) = closed(0.0, 20.0, 1.1);
        assert_eq!((around(&before), around(&after)), (60.0, 48.0));
        assert!(times >= 1 && (after.l2 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_cut_that_the_limit_needs_stays() {
        let needed = slit(3.0).2.l2 + 1e-6;
        let (before, after, times) = closed(3.0, 0.0, needed);
        assert!(times == 0 && around(&after) == around(&before), "{times}");
    }

    #[test]
    fn a_cut_along_a_guide_stays() {
        let (mesh, polygon, chart) = slit(0.0);
        let on_cut = |v| mesh.position(v).y == 6.0;
        let is_guide = |h: HalfedgeId| on_cut(mesh.from(h)) && on_cut(mesh.to(h));
        let guided = mesh.clone().with_guides(mesh.halfedges().map(is_guide).collect());
        let cutting = Cutting::new(&guided, &polygon, vec![chart]);
        let settings = Settings::default();
        let sites = Zip { limit: 1.1 }.sites(&cutting, &History::default(), &Price::new(&guided, &settings));
        assert!(sites.is_empty());
    }

    #[test]
    fn the_price_decides_what_the_limit_allows() {
        let (before, free, _) = closed(3.0, 0.0, 1.1);
        let (_, dear, _) = closed(3.0, 1e3, 1.1);
        assert!(around(&free) < around(&before) && free.l2 > before.l2);
        assert!(around(&dear) > around(&free) && dear.l2 < free.l2);
    }

    #[test]
    fn the_ends_of_cuts_are_found_with_the_edges_from_there_on() {
        let (mesh, polygon, chart) = slit(0.0);
        let cutting = Cutting::new(&mesh, &polygon, vec![chart]);
        let id = cutting.ids().next().expect("a chart");
        let runs = border::runs(&cutting, id, |other| other == id);
        let ends: Vec<Vec<HalfedgeId>> = runs.iter().flat_map(|run| ends_of(&cutting, run)).collect();
        assert_eq!((ends.len(), ends[0].len()), (1, 6));
        let tip = mesh.position(mesh.from(ends[0][0]));
        assert_eq!((tip.x, tip.y), (6.0, 6.0));
        assert!(ends[0].windows(2).all(|pair| mesh.to(pair[0]) == mesh.from(pair[1])), "from the end on");
    }
}
