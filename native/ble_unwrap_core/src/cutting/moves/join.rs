//! Neighbouring charts joined to larger ones where the union still flattens under the limit.
//!
//! Splitting top-down is greedy: two neighbours from different branches may well be one chart. Iso-charts
//! merges by an estimate; here the real flattening is the judge: first of the two charts as they are, laid side by side, and
//! where they do not fit so, of their union embedded anew.

use crate::cache::Run;
use crate::charts::Chart;
use crate::flattening::Rungs;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::super::border;
use super::super::cost::Price;
use super::super::divide::{Charting, Refused};
use super::super::edit::Edit;
use super::super::history::{History, MoveKind, Place};
use super::super::search::search;
use super::super::state::{ChartId, Cutting};
use super::{Move, Proposal, Site, Start};

/// Failed unions a chart may take part in before it is left alone.
const MOST_FAILURES: usize = 4;
/// Failed embeddings of unions that do not fit as they lie, likewise. In the geometric mean over the meshes of `make quality`
/// none gives 2.72 charts, one or two 2.56, four 2.55, in 0.43, 0.46 and 0.49 CPU seconds.
const MOST_EMBEDDED: usize = 2;
/// Where the faces of a union are bounded, an embedded one has so many times fewer: it costs as many times more as one that begins
/// with the charts as they lie.
const EMBEDDED_SHARE: usize = 5;

/// Which neighbours are tried.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Which {
    /// All; unions are embedded anew only up to so many faces, if there is a bound.
    All {
        /// Most faces of a union that is embedded.
        most_embedded: Option<usize>,
    },
    /// Only those of which one came out of a split, and which have so few faces together.
    AfterSplits {
        /// Most faces of a union.
        most_faces: usize,
    },
}

impl Which {
    /// Every pair, whatever its size.
    pub(crate) const EVERY: Self = Self::All { most_embedded: None };

    /// Every pair, on a mesh on which large unions are too costly to embed.
    pub(crate) fn every_on_fine(most_faces: usize) -> Self {
        Self::All { most_embedded: Some(most_faces / EMBEDDED_SHARE) }
    }

    fn includes(self, cutting: &Cutting<'_>, history: &History, charts: [ChartId; 2], is_embedded: bool) -> bool {
        let faces: usize = charts.iter().map(|&id| cutting.face_count(id)).sum();
        match self {
            Self::All { most_embedded } => !is_embedded || most_embedded.is_none_or(|most| faces <= most),
            Self::AfterSplits { most_faces } => {
                let most = if is_embedded { most_faces / EMBEDDED_SHARE } else { most_faces };
                charts.iter().any(|&id| history.is_from_split(id)) && faces <= most
            }
        }
    }
}

/// Joins neighbouring charts, longest shared border over √(smaller area) first (guides count little), as long as the union
/// is under the limit. Each chart takes part in at most [`MOST_FAILURES`] failed trials, and [`MOST_EMBEDDED`] from an embedding,
/// so the number of trials is linear in the number of charts. Two halves of a split in two are not tried: their union has
/// already been refused. The charts come sorted by lowest face.
pub(crate) fn join(
    mesh: &TriMesh,
    polygon: &[u32],
    charting: Charting,
    which: Which,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let Charting { charts, family, refused, .. } = charting;
    let mut cutting = Cutting::new(mesh, polygon, charts);
    let mut history = History::default();
    let mut halves: Vec<(u32, ChartId)> = cutting.ids().zip(&family).filter_map(|(id, f)| Some(((*f)?, id))).collect();
    halves.iter().for_each(|half| history.note_split(half.1));
    halves.sort_unstable();
    for pair in halves.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, a), (_, b)] = *pair {
            history.exclude(MoveKind::Join, Place::between(a, b));
        }
    }
    let moves: [&dyn Move; 2] = [&Join { which, alone: 1 }, &JoinAnew { which, refused: &refused }];
    search(&mut cutting, &mut history, &moves, settings, rungs, run)?;
    Ok(cutting.into_charts())
}

/// Two charts as they lie, glued along their border.
pub(crate) struct Join {
    pub(crate) which: Which,
    /// Where their border has several runs, so many of them are tried alone, those that cost most first.
    pub(crate) alone: usize,
}

impl Move for Join {
    fn kind(&self) -> MoveKind {
        MoveKind::Join
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, _price: &Price) -> Vec<Site> {
        let is_open = |id: ChartId| history.failures(MoveKind::Join, id) < MOST_FAILURES;
        sites(cutting, |charts| {
            charts.iter().all(|&id| is_open(id))
                && history.refusals(MoveKind::Join, Place::between(charts[0], charts[1])) == 0
                && self.which.includes(cutting, history, charts, false)
        })
    }

    /// Glued all along their border; where that has several runs, also along single ones that cost most, and open along the others.
    fn ways(&self, cutting: &Cutting<'_>, site: &Site, _run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        let [a, b] = site.charts[..] else { return Ok(Vec::new()) };
        let mesh = cutting.mesh();
        let mut runs: Vec<Vec<HalfedgeId>> =
            border::runs(cutting, a, |other| other == b).into_iter().map(|run| run.edges).collect();
        let cost = |run: &[HalfedgeId]| run.iter().map(|&h| cutting.seam_length(h)).sum::<f64>();
        runs.sort_by(|s, t| cost(t).total_cmp(&cost(s)).then(s[0].cmp(&t[0])));
        let mut ways = vec![runs.concat()];
        if runs.len() > 1 {
            ways.extend(runs.into_iter().take(self.alone));
        }
        ways.retain(|way| !way.is_empty());
        let proposal = |glue: Vec<HalfedgeId>| Proposal {
            edit: Edit::new(mesh, &glue, &[]),
            start: Start::Glued(Some((b, border::alignment(cutting, &glue)))),
        };
        Ok(ways.into_iter().map(proposal).collect())
    }
}

/// The union of two charts flattened anew, whatever they look like now: where they did not fit as they lay.
struct JoinAnew<'a> {
    which: Which,
    refused: &'a Refused,
}

impl Move for JoinAnew<'_> {
    fn kind(&self) -> MoveKind {
        MoveKind::JoinAnew
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, _price: &Price) -> Vec<Site> {
        let is_open = |id: ChartId| history.failures(MoveKind::JoinAnew, id) < MOST_EMBEDDED;
        sites(cutting, |charts| {
            charts.iter().all(|&id| is_open(id))
                && history.had_bad_start(MoveKind::Join, Place::between(charts[0], charts[1]))
                && history.refusals(MoveKind::JoinAnew, Place::between(charts[0], charts[1])) == 0
                && self.which.includes(cutting, history, charts, true)
        })
    }

    fn ways(&self, cutting: &Cutting<'_>, site: &Site, _run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        let charts = site.charts.iter().filter_map(|&id| cutting.chart(id));
        let mut faces: Vec<FaceId> = charts.flat_map(|c| c.patch.faces.iter().copied()).collect();
        faces.sort_unstable();
        // What was split into more than two may have come together again.
        if self.refused.contains(&faces) {
            return Ok(Vec::new());
        }
        let mesh = cutting.mesh();
        // Cuts inside the two charts are glued, too: it is for the embedding to say where the union is cut.
        let is_inside = |h: &HalfedgeId| cutting.is_seam(*h) && faces.binary_search(&mesh.twin(*h).face()).is_ok();
        let sides = faces.iter().flat_map(|f| f.halfedges()).filter(|&h| !mesh.is_boundary(h));
        let glue: Vec<HalfedgeId> = sides.filter(is_inside).collect();
        Ok(vec![Proposal { edit: Edit::new(mesh, &glue, &[]), start: Start::Anew }])
    }
}

/// The pairs of neighbours that are wanted, longest shared border over √(smaller area) first.
fn sites(cutting: &Cutting<'_>, is_wanted: impl Fn([ChartId; 2]) -> bool) -> Vec<Site> {
    let area = |id: ChartId| cutting.chart(id).map_or(0.0, |chart| chart.patch.area());
    let mut scored: Vec<(f64, [ChartId; 2])> = cutting
        .neighbours(None)
        .into_iter()
        .filter(|&(charts, _)| is_wanted(charts))
        .map(|([a, b], length)| (length / area(a).min(area(b)).max(f64::MIN_POSITIVE).sqrt(), [a, b]))
        .collect();
    scored.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    let site = |[a, b]: [ChartId; 2]| Site { place: Place::between(a, b), charts: vec![a, b], ways: Vec::new() };
    scored.into_iter().map(|(_, charts)| site(charts)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Patch;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::settings::Moves;
    use nalgebra::{Point2, Point3, Rotation2, Vector2};

    use super::super::super::attempt;
    use super::super::super::search::tried;
    use super::super::super::trial::Verdict;

    /// Waves of the border, so that two that lie on each other cross, and their height.
    const WAVES: (f64, f64) = (5.0, 0.1);

    /// The cap of a ball above 30° in two halves, each drawn as a disc but for a sector: as they lie, the union would go
    /// round its pole twice.
    fn halves_that_do_not_fit() -> (TriMesh, Vec<u32>, Vec<Chart>) {
        let ball = test_surfaces::sphere(3);
        let all: Vec<u32> = (0..ball.face_count() as u32).collect();
        let above = |f: &FaceId| ball.triangle_positions(*f).iter().all(|p| p.z > 0.5);
        let cap = Patch::of_surface(&ball, &all, ball.faces().filter(above).collect());
        let polygon: Vec<u32> = (0..cap.mesh.face_count() as u32).collect();
        let half = |side: f64| {
            let mine =
                |f: &FaceId| (cap.mesh.triangle_positions(*f).iter().map(|p| p.x).sum::<f64>() > 0.0) == (side > 0.0);
            let patch = Patch::of_surface(&cap.mesh, &polygon, cap.mesh.faces().filter(mine).collect());
            let draw = |p: &Point3<f64>| {
                let angle = 1.9 * (side * p.y).atan2(side * p.x);
                let radius = p.xy().coords.norm() * (1.0 + side * WAVES.1 * (WAVES.0 * angle).cos());
                Point2::new(radius * angle.cos(), radius * angle.sin())
            };
            let uv = patch.mesh.positions().iter().map(draw).collect();
            Chart { patch, uv, l2: 1.01 }
        };
        let halves = vec![half(1.0), half(-1.0)];
        (TriMesh::clone(&cap.mesh), polygon, halves)
    }

    fn merged(family: [Option<u32>; 2], which: Which, settings: &Settings) -> (Vec<Chart>, Rungs) {
        let (mesh, polygon, charts) = halves_that_do_not_fit();
        let charting =
            Charting { charts, family: family.to_vec(), rungs: Rungs::default(), refused: Refused::default() };
        let progress = Progress::new();
        let mut rungs = Rungs::default();
        let run = Run::new(&progress, None);
        let charts = join(&mesh, &polygon, charting, which, settings, &mut rungs, &run).expect("not cancelled");
        (charts, rungs)
    }

    #[test]
    fn charts_that_do_not_fit_as_they_lie_become_one_from_an_embedding() {
        let (mesh, polygon, charts) = halves_that_do_not_fit();
        let settings = Settings::default();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        for chart in &charts {
            assert!(chart.patch.mesh.topology().is_disk());
            assert_eq!(crate::stretch::first_flip(&chart.patch.mesh, &chart.uv), None);
        }
        let cutting = Cutting::new(&mesh, &polygon, charts.clone());
        let join = Join { which: Which::EVERY, alone: 1 };
        let site = join.sites(&cutting, &History::default(), &Price::new(&mesh, &settings)).pop().expect("neighbours");
        let lying = tried(&cutting, &join, &site, None, &settings, &run).expect("not cancelled").0;
        assert!(matches!(lying, Verdict::BadStart));
        let (charts, rungs) = merged([None, None], Which::EVERY, &settings);
        assert_eq!(charts.len(), 1);
        assert!(charts[0].l2 > 1.0 && charts[0].l2 <= settings.stretch_limit, "{}", charts[0].l2);
        assert_eq!(charts[0].patch.faces.len(), mesh.face_count());
        assert!(crate::stretch::boundary_is_simple(&charts[0].patch.mesh, &charts[0].uv));
        assert!(rungs.taken().contains(&("merge", 1)));
    }

    #[test]
    fn a_union_over_the_limit_stays_two_whatever_its_start() {
        let tight = Settings { stretch_limit: 1.0005, moves: Moves::Join, ..Settings::default() };
        assert_eq!(merged([None, None], Which::EVERY, &tight).0.len(), 2);
    }

    #[test]
    fn a_union_that_was_refused_before_is_not_embedded() {
        let (mesh, polygon, charts) = halves_that_do_not_fit();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let all: Vec<FaceId> = mesh.faces().collect();
        let whole = Patch::of_surface(&mesh, &polygon, all);
        let refused = Refused::of(std::iter::once(Refused::key(&whole.faces)));
        let settings = Settings::default();
        let charting = Charting { charts, family: vec![None, None], rungs: Rungs::default(), refused };
        let mut rungs = Rungs::default();
        let charts = join(&mesh, &polygon, charting, Which::EVERY, &settings, &mut rungs, &run).expect("not cancelled");
        assert_eq!(charts.len(), 2);
    }

    #[test]
    fn a_union_embedded_with_darts_lengthens_the_seam_only_for_what_it_saves() {
        // The border of a small cap is shorter than any cut that opens the ball.
        let ball = test_surfaces::sphere(3);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let settings = Settings::default();
        let high = |f: &FaceId| ball.triangle_positions(*f).iter().all(|p| p.z > 0.9);
        let side = |wanted: bool| {
            let patch = Patch::of_surface(&ball, &polygon, ball.faces().filter(|f| high(f) == wanted).collect());
            // Where it lies does not matter.
            Chart { uv: vec![Point2::origin(); patch.mesh.vertex_count()], patch, l2: 1.0 }
        };
        let sides = [side(true), side(false)];
        let seam = |c: &Chart| c.patch.mesh.boundary_length();
        let mut rungs = Rungs::default();
        let whole = Patch::of_surface(&ball, &polygon, ball.faces().collect());
        let one = attempt::as_one(&whole, &settings, &mut rungs, &run).expect("not cancelled").expect("with darts");
        assert!(seam(&one) > sides.iter().map(seam).sum());
        let cutting = Cutting::new(&ball, &polygon, sides.to_vec());
        let (which, none) = (Which::EVERY, Refused::default());
        for stretch_price in [0.0, 20.0] {
            let settings = Settings { stretch_price, ..Settings::default() };
            let price = Price::new(&ball, &settings);
            let site = Join { which, alone: 1 }.sites(&cutting, &History::default(), &price).pop().expect("neighbours");
            let anew = JoinAnew { which, refused: &none };
            let joined = tried(&cutting, &anew, &site, Some(&price), &settings, &run).expect("not cancelled").0;
            // The chart that it saves is worth the seam, but not what the union is stretched, where that has a price.
            assert_eq!(matches!(joined, Verdict::Charts(_)), stretch_price == 0.0);
        }
    }

    /// The faces of a sheet with their middle in x between two bounds, drawn in the plane turned by some angle.
    fn part(mesh: &TriMesh, from: f64, to: f64, angle: f64) -> Chart {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let middle = |f: &FaceId| mesh.triangle_positions(*f).iter().map(|p| p.x).sum::<f64>() / 3.0;
        let patch =
            Patch::of_surface(mesh, &polygon, mesh.faces().filter(|f| (from..to).contains(&middle(f))).collect());
        let turn = Rotation2::new(angle);
        let uv = patch.mesh.positions().iter().map(|p| turn * p.xy() + Vector2::new(3.0 * angle, 5.0)).collect();
        Chart { patch, uv, l2: 1.0 }
    }

    fn parts_joined(mesh: &TriMesh, charts: Vec<Chart>) -> Vec<Chart> {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let family = vec![None; charts.len()];
        let charting = Charting { charts, family, rungs: Rungs::default(), refused: Refused::default() };
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let (settings, run) = (Settings::default(), Run::new(&progress, None));
        join(mesh, &polygon, charting, Which::EVERY, &settings, &mut rungs, &run).expect("not cancelled")
    }

    #[test]
    fn halves_of_a_sheet_meet_whatever_their_pose() {
        let mesh = test_surfaces::grid(12, 12, [1.0, 1.0], 0.0);
        let whole = parts_joined(&mesh, vec![part(&mesh, -1.0, 0.5, 0.0), part(&mesh, 0.5, 2.0, 2.3)]);
        assert_eq!(whole.len(), 1);
        assert!(whole[0].l2 < 1.0 + 1e-9 && whole[0].patch.faces.len() == mesh.face_count());
    }

    #[test]
    fn charts_that_do_not_touch_are_not_joined() {
        let mesh = test_surfaces::grid(12, 12, [1.0, 1.0], 0.0);
        let apart = vec![part(&mesh, -1.0, 0.25, 0.0), part(&mesh, 0.75, 2.0, 1.0)];
        assert_eq!(parts_joined(&mesh, apart).len(), 2);
    }

    #[test]
    fn on_a_fine_mesh_only_small_unions_are_embedded() {
        let settings = Settings::default();
        let faces = halves_that_do_not_fit().0.face_count();
        let count = |family, most_faces| merged(family, Which::AfterSplits { most_faces }, &settings).0.len();
        let of_two_splits = [Some(0), Some(1)];
        assert_eq!(count(of_two_splits, EMBEDDED_SHARE * faces), 1);
        assert_eq!(count(of_two_splits, EMBEDDED_SHARE * (faces - 1)), 2, "it may be sewn, and that fails");
        assert_eq!(count([None, None], EMBEDDED_SHARE * faces), 2, "no split has made them");
        assert_eq!(count([Some(0), Some(0)], EMBEDDED_SHARE * faces), 2, "two halves of a split in two");
    }
}
