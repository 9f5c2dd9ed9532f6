//! Charts joined along a part of their border: what is left of the border is a dart.
//!
//! Two neighbours whose union is over the limit often flatten together if a part of the border between them stays
//! cut: a tail and the body it grows from, two halves of a bulge. Their maps tell where to glue: one is laid against the other
//! by the rigid motion that fits a stretch of the border best, and where it fits, little has to give way. Every seam this
//! leaves was one before, so nothing gets longer. From the two maps so joined the stretch is minimised as ever, and that
//! is the judge.

use std::ops::Range;

use nalgebra::{Complex, Point2};

use crate::mesh::HalfedgeId;

use super::super::border::{self, BorderRun};
use super::super::cost::{LEAST_GLUED, Price};
use super::super::edit::Edit;
use super::super::history::{History, MoveKind, Place};
use super::super::rigid_motion::{Motion, longest_fit};
use super::super::state::{ChartId, Cutting};
use super::{Move, Proposal, Site, Start};

/// Charts are glued where their borders fit, by a rigid motion, up to this share (root of mean square over length) of the
/// length that is glued: a straight border and an arc of 120°. If that is over the limit, once more where they fit closer.
const FITS: [f64; 2] = [0.08, 0.03];
/// Failed trials a chart may take part in before it is left alone.
const MOST_FAILURES: usize = 3;

/// Where a part is wanted that is seen, these shares of it are tried, too, around its middle, if all of it comes to nothing.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Two charts as they lie, glued along a part of a run of their border that no guide is on, longest part first. Each chart takes part in at most
/// [`MOST_FAILURES`] failed trials, so the number of trials is linear in the number of charts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PartialJoin {
    /// Where the border fits best.
    Longest,
    /// Where it is seen most: its edges count by their length times the square of what a border counts for there.
    MostSeen,
}

impl Move for PartialJoin {
    fn kind(&self) -> MoveKind {
        MoveKind::PartialJoin
    }

    fn price(&self, usual: Price, _cutting: &Cutting<'_>, _edit: &Edit) -> Price {
        usual.exact()
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, _price: &Price) -> Vec<Site> {
        let is_open = |id: ChartId| history.failures(MoveKind::PartialJoin, id) < MOST_FAILURES;
        let mut parts: Vec<Part> = Vec::new();
        for id in cutting.ids().filter(|&id| is_open(id)) {
            // Each pair is looked at from one side.
            let runs = border::runs(cutting, id, |other| other > id && is_open(other));
            parts.extend(runs.into_iter().filter_map(|run| self.part(cutting, history, id, &run)));
        }
        parts.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.first.cmp(&b.first)));
        parts.into_iter().map(|part| part.site).collect()
    }
}

/// A part of a border where two charts fit.
struct Part {
    length: f64,
    first: HalfedgeId,
    site: Site,
}

impl PartialJoin {
    /// The longest part of a run where the two charts fit.
    fn part(self, cutting: &Cutting<'_>, history: &History, id: ChartId, run: &BorderRun) -> Option<Part> {
        let mesh = cutting.mesh();
        // Guides say where to cut: all of one, or none.
        if run.edges.iter().any(|&h| mesh.is_guide(h)) {
            return None;
        }
        let fit = *FITS.get(history.refusals(MoveKind::PartialJoin, Place::between(id, run.beyond)))?;
        let [one, other] = [cutting.chart(id)?.patch.area(), cutting.chart(run.beyond)?.patch.area()];
        // Of a whole loop any part may be glued, wherever it begins, but for two edges at least.
        let edges = if run.is_loop { run.edges.repeat(2) } else { run.edges.clone() };
        let most_edges = if run.is_loop { run.edges.len().saturating_sub(2) } else { run.edges.len() };
        let (first, last) = (*edges.first()?, *edges.last()?);
        let number = |p: Point2<f64>| Complex::new(p.x, p.y);
        // On this side an edge starts where the one beyond ends.
        let here = edges.iter().map(|&h| cutting.start(h)).chain([cutting.end(last)]);
        let there = [cutting.end(mesh.twin(first))].into_iter();
        let there = there.chain(edges.iter().map(|&h| cutting.start(mesh.twin(h))));
        let points: Vec<[Complex<f64>; 2]> = here.zip(there).map(|(p, q)| [number(p), number(q)]).collect();
        let lengths: Vec<f64> = edges.iter().map(|&h| self.length(cutting, h)).collect();
        let window = longest_fit(&points, &lengths, most_edges, fit)?;
        if window.length < LEAST_GLUED * one.min(other).sqrt() {
            return None;
        }
        let (glue, lengths) = (&edges[window.first..window.last], &lengths[window.first..window.last]);
        let way = |glue: &[HalfedgeId], motion: Motion| Proposal {
            edit: Edit::new(mesh, glue, &[]),
            start: Start::Glued(Some((run.beyond, motion))),
        };
        let mut ways = vec![way(glue, window.motion)];
        if matches!(self, Self::MostSeen) {
            ways.extend(SHARES[1..].iter().map(|&share| {
                let glue = &glue[around_the_middle(lengths, share)];
                way(glue, border::alignment(cutting, glue))
            }));
        }
        let site = Site { place: Place::between(id, run.beyond), charts: vec![id, run.beyond], ways };
        Some(Part { length: window.length, first: glue[0], site })
    }

    /// What an edge counts for.
    fn length(self, cutting: &Cutting<'_>, h: HalfedgeId) -> f64 {
        let mesh = cutting.mesh();
        match self {
            Self::Longest => mesh.edge_length(h),
            Self::MostSeen => mesh.edge_length(h) * mesh.border_cost(h).powi(2),
        }
    }
}

/// The edges around the middle of some, by length, that have about a share of it, and one at least.
fn around_the_middle(lengths: &[f64], share: f64) -> Range<usize> {
    let side = 0.5 * (1.0 - share) * lengths.iter().sum::<f64>();
    // How many edges fit into what is left over on a side.
    let left_over = |lengths: &mut dyn Iterator<Item = &f64>| {
        let sums = lengths.scan(0.0, |sum, length| {
            *sum += length;
            Some(*sum)
        });
        sums.take_while(|sum| *sum <= side).count()
    };
    let first = left_over(&mut lengths.iter()).min(lengths.len().saturating_sub(1));
    first..(lengths.len() - left_over(&mut lengths.iter().rev())).max(first + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::Run;
    use crate::charts::{Chart, Patch};
    use crate::flattening::Rungs;
    use crate::mesh::TriMesh;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::settings::Settings;
    use crate::stretch;
    use nalgebra::Point3;

    use super::super::super::divide::divide;
    use super::super::super::search::search;

    #[test]
    fn what_is_around_the_middle_is_so_by_length_and_never_nothing() {
        let lengths = [4.0, 1.0, 1.0, 1.0, 1.0];
        assert_eq!(around_the_middle(&lengths, 1.0), 0..5);
        assert_eq!(around_the_middle(&lengths, 0.5), 0..3, "the first is longer than what is left over on its side");
        assert_eq!(around_the_middle(&[1.0; 8], 0.25), 3..5);
        for share in [0.9, 0.5, 0.125, 0.0] {
            for n in 1..6 {
                let found = around_the_middle(&lengths[..n], share);
                assert!(!found.is_empty() && found.end <= n);
            }
        }
    }

    fn settings(stretch_limit: f64) -> Settings {
        Settings { stretch_limit, ..Settings::default() }
    }

    /// Charts of a mesh whose faces are grouped by a label.
    fn charts(mesh: &TriMesh, settings: &Settings, label: impl Fn([Point3<f64>; 3]) -> usize) -> Vec<Chart> {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let count = mesh.faces().map(|f| label(mesh.triangle_positions(f))).max().map_or(0, |l| l + 1);
        let chart = |wanted: usize| {
            let faces = mesh.faces().filter(|f| label(mesh.triangle_positions(*f)) == wanted).collect();
            let patch = Patch::of_surface(mesh, &polygon, faces);
            let charting =
                divide(vec![patch], &Price::new(mesh, settings), settings, &|_| (), &Run::new(&Progress::new(), None))
                    .expect("not cancelled");
            assert_eq!(charting.charts.len(), 1);
            charting.charts.into_iter().next().expect("a chart")
        };
        (0..count).map(chart).collect()
    }

    fn joined(mesh: &TriMesh, charts: Vec<Chart>, settings: &Settings) -> (Vec<Chart>, Rungs) {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let (count, progress, mut rungs) = (charts.len(), Progress::new(), Rungs::default());
        let run = Run::new(&progress, None);
        let mut cutting = Cutting::new(mesh, &polygon, charts);
        search(&mut cutting, &mut History::default(), &[&PartialJoin::Longest], settings, &mut rungs, &run)
            .expect("not cancelled");
        cutting.check_invariants().expect("sound");
        let joined = cutting.into_charts();
        for chart in &joined {
            assert!(chart.patch.mesh.topology().is_chart());
            assert!(joined.len() == count || chart.l2 <= settings.stretch_limit);
            assert_eq!(stretch::first_flip(&chart.patch.mesh, &chart.uv), None);
            assert!(stretch::boundary_is_simple(&chart.patch.mesh, &chart.uv));
        }
        let faces: usize = joined.iter().map(|chart| chart.patch.faces.len()).sum();
        assert_eq!(faces, mesh.face_count());
        (joined, rungs)
    }

    /// Length of the seam that charts of a closed surface have, or more than its boundary has.
    fn seam(charts: &[Chart]) -> f64 {
        0.5 * charts.iter().map(|chart| chart.patch.mesh.boundary_length()).sum::<f64>()
    }

    fn hemisphere(p: [Point3<f64>; 3]) -> usize {
        usize::from(p[0].z + p[1].z + p[2].z > 0.0)
    }

    #[test]
    fn two_halves_of_a_sheet_are_glued_all_along() {
        let mesh = test_surfaces::grid(12, 12, [12.0, 12.0], 0.0);
        let settings = settings(1.1);
        let half = |p: [Point3<f64>; 3]| usize::from(p[0].x + p[1].x + p[2].x > 18.0);
        let (joined, rungs) = joined(&mesh, charts(&mesh, &settings, half), &settings);
        assert_eq!((joined.len(), joined[0].patch.mesh.boundary_length()), (1, 48.0));
        assert!(joined[0].l2 < 1.0 + 1e-9);
        assert!(rungs.taken().contains(&("dart", 1)));
    }

    #[test]
    fn a_ball_of_two_halves_becomes_one_chart_that_hangs_together_on_an_arc() {
        let mesh = test_surfaces::sphere(3);
        let settings = settings(1.1);
        let halves = charts(&mesh, &settings, hemisphere);
        let least = LEAST_GLUED * halves[0].patch.area().sqrt();
        let before = seam(&halves);
        let (joined, _) = joined(&mesh, halves, &settings);
        assert_eq!(joined.len(), 1);
        let glued = before - seam(&joined);
        assert!(glued >= least && glued < 3.0, "{glued} of a circle of 6.28");
        assert!(joined[0].patch.mesh.topology().is_disk());
    }

    #[test]
    fn what_would_be_over_the_limit_stays_apart() {
        let mesh = test_surfaces::sphere(3);
        let loose = settings(1.1);
        let halves = charts(&mesh, &loose, hemisphere);
        let worst = halves.iter().map(|c| c.l2).fold(1.0, f64::max);
        let tight = settings(1.0 + 0.5 * (worst - 1.0));
        assert_eq!(joined(&mesh, halves, &tight).0.len(), 2);
    }
}
