//! Charts sewn together along a part of their border: what is left of the border is a dart.
//!
//! Two neighbours whose union is over the limit often flatten together if a part of the border between them stays
//! cut: a tail and the body it grows from, two halves of a bulge. Their maps tell where to sew: one is laid against the other by the
//! rigid motion that fits a stretch of the border best, and where it fits, little has to give way. Every seam this
//! makes was one before, so nothing gets longer. From the two maps so joined the stretch is minimised as ever, and that
//! is the judge.

use nalgebra::{Complex, Point2};
use rayon::prelude::*;

use crate::charts::{Chart, Patch};
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::flatten::{self, Polished};
use super::memo;
use super::rigid::{Motion, longest_fit};
use crate::flattening::{Rung, Rungs};

/// Charts are sewn where their borders fit, by a rigid motion, up to this share (root of mean square over length) of the
/// length that is sewn: a straight border and an arc of 120°. If that is over the limit, once more where they fit closer.
const FITS: [f64; 2] = [0.08, 0.03];
/// Failed trials a chart may take part in before it is left alone.
const MOST_FAILURES: usize = 3;

/// Charts that have become one.
#[derive(Clone, Debug)]
pub(super) struct Sewn {
    /// What they are together.
    pub(super) chart: Chart,
    /// Which charts, by index; one if there was nothing to sew.
    pub(super) pieces: Vec<usize>,
    /// Where they are sewn: one half-edge of each edge, of the mesh whose faces the charts are made of.
    pub(super) edges: Vec<HalfedgeId>,
}

struct Piece {
    sewn: Sewn,
    area: f64,
    failures: usize,
    /// Pieces (by index) that did not go with this one, and how close a fit was tried.
    refused: Vec<(usize, usize)>,
}

impl Piece {
    fn new(sewn: Sewn) -> Self {
        Self { area: sewn.chart.patch.area(), sewn, failures: 0, refused: Vec::new() }
    }
}

/// Sews charts together, longest seam first, where they fit and stay under the limit. The charts are made of faces of
/// `mesh`. Sorted by lowest face. Each chart takes part in at most [`MOST_FAILURES`] failed trials, so the number of trials
/// is linear in the number of charts.
pub(super) fn sew(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    settings: &Settings,
    progress: &memo::Run<'_>,
) -> Result<(Vec<Sewn>, Rungs), Cancelled> {
    let mut rungs = Rungs::default();
    let is_wanted = settings.merge && settings.wants_darts();
    let whole = |(i, chart)| Some(Piece::new(Sewn { chart, pieces: vec![i], edges: Vec::new() }));
    let pool: Vec<Option<Piece>> = charts.into_iter().enumerate().map(whole).collect();
    let mut table =
        Table { mesh, polygon, owner: vec![(usize::MAX, 0); mesh.face_count()], pool, least_sewn: settings.least_sewn };
    (0..table.pool.len()).for_each(|i| table.claim(i));
    loop {
        progress.check()?;
        let seams = if is_wanted { table.independent_seams() } else { Vec::new() };
        if seams.is_empty() {
            break;
        }
        let trials: Vec<Result<(Option<Chart>, Rungs), Cancelled>> = seams
            .par_iter()
            .with_max_len(1)
            .map(|seam| {
                let mut rungs = Rungs::default();
                let (patch, drawn) = table.joined(seam);
                let chart = if patch.mesh.topology().is_chart() {
                    match flatten::sewn(&patch, &drawn, settings, &mut rungs, progress)? {
                        Polished::Flat(flat) => Some(flat.into_chart(patch)),
                        Polished::Refused | Polished::BadStart => None,
                    }
                } else {
                    None
                };
                Ok((chart, rungs))
            })
            .collect();
        for (seam, trial) in seams.into_iter().zip(trials) {
            let (chart, steps) = trial?;
            match chart {
                Some(chart) => {
                    rungs.add(&steps);
                    rungs.take(Rung::Dart);
                    table.replace(&seam, chart);
                }
                None => table.refuse(&seam),
            }
        }
    }
    let mut sewn: Vec<Sewn> = table.pool.into_iter().flatten().map(|p| p.sewn).collect();
    sewn.sort_by_key(|s| s.chart.patch.faces.iter().min().copied());
    Ok((sewn, rungs))
}

/// Where two pieces may be sewn.
struct Seam {
    pieces: [usize; 2],
    /// How close a fit was asked for.
    fit: usize,
    /// Half-edges of the mesh on the side of the first piece, in order.
    edges: Vec<HalfedgeId>,
    length: f64,
    motion: Motion,
}

struct Table<'a> {
    mesh: &'a TriMesh,
    polygon: &'a [u32],
    /// The piece of each face, and its number there.
    owner: Vec<(usize, usize)>,
    pool: Vec<Option<Piece>>,
    /// See [`Settings::least_sewn`].
    least_sewn: f64,
}

impl Table<'_> {
    fn chart(&self, i: usize) -> Option<&Chart> {
        self.pool[i].as_ref().map(|p| &p.sewn.chart)
    }

    /// Enters the faces of a piece.
    fn claim(&mut self, i: usize) {
        if let Some(piece) = &self.pool[i] {
            for (local, f) in piece.sewn.chart.patch.faces.iter().enumerate() {
                self.owner[f.index()] = (i, local);
            }
        }
    }

    /// Half-edge `h` of the mesh in the chart of its face.
    fn local(&self, h: HalfedgeId) -> HalfedgeId {
        FaceId::new(self.owner[h.face().index()].1).halfedge(h.slot())
    }

    /// Position of the start of half-edge `h` of the mesh, in the chart of its face.
    fn place(&self, h: HalfedgeId) -> Point2<f64> {
        let chart = self.chart(self.owner[h.face().index()].0);
        chart.map_or_else(Point2::origin, |c| c.uv[c.patch.mesh.from(self.local(h)).index()])
    }

    /// Seams worth a trial, of which no two share a piece, longest first.
    fn independent_seams(&self) -> Vec<Seam> {
        let mut seams: Vec<Seam> = Vec::new();
        for (i, piece) in self.pool.iter().enumerate() {
            let Some(piece) = piece else { continue };
            if piece.failures < MOST_FAILURES {
                seams.extend(self.runs(i).into_iter().filter_map(|run| self.seam(&run)));
            }
        }
        let order = |a: &Seam, b: &Seam| b.length.total_cmp(&a.length).then_with(|| a.edges[0].cmp(&b.edges[0]));
        seams.sort_by(order);
        let mut taken = vec![false; self.pool.len()];
        seams.retain(|seam| {
            let free = seam.pieces.iter().all(|&p| !taken[p]);
            if free {
                seam.pieces.iter().for_each(|&p| taken[p] = true);
            }
            free
        });
        seams
    }

    /// The stretches of border that a piece shares with another of higher number.
    fn runs(&self, i: usize) -> Vec<Run> {
        let Some(chart) = self.chart(i) else { return Vec::new() };
        let (patch, mesh) = (&chart.patch, self.mesh);
        let beyond = |h: HalfedgeId| {
            let t = mesh.twin(h);
            let other = if t.is_none() { usize::MAX } else { self.owner[t.face().index()].0 };
            if other == usize::MAX || other <= i {
                return None;
            }
            let piece = self.pool[other].as_ref()?;
            (piece.failures < MOST_FAILURES).then_some(other)
        };
        // On the other side the border runs on without a third chart or a cut between.
        let runs_on = |g: HalfedgeId, h: HalfedgeId| {
            let (Some(a), Some(b)) = (beyond(g), beyond(h)) else { return false };
            let (before, after) = (self.local(mesh.twin(h)), self.local(mesh.twin(g)));
            a == b && self.chart(a).is_some_and(|c| c.patch.mesh.next_boundary(before) == after)
        };
        let mut runs = Vec::new();
        for border in patch.mesh.boundary_loops().iter() {
            let border: Vec<HalfedgeId> =
                border.iter().map(|h| patch.faces[h.face().index()].halfedge(h.slot())).collect();
            let n = border.len();
            let breaks: Vec<usize> = (0..n).filter(|&k| !runs_on(border[(k + n - 1) % n], border[k])).collect();
            if breaks.is_empty() {
                runs.extend(beyond(border[0]).map(|other| Run {
                    pieces: [i, other],
                    edges: border.iter().chain(&border).copied().collect(),
                    most_edges: n.saturating_sub(2),
                }));
            }
            for (at, &first) in breaks.iter().enumerate() {
                let length = (breaks[(at + 1) % breaks.len()] + n - first - 1) % n + 1;
                let edges: Vec<HalfedgeId> = (first..first + length).map(|k| border[k % n]).collect();
                runs.extend(beyond(border[first]).map(|other| Run { pieces: [i, other], edges, most_edges: length }));
            }
        }
        runs
    }

    /// The longest part of a run where the two charts fit.
    fn seam(&self, run: &Run) -> Option<Seam> {
        let [a, b] = run.pieces;
        let (one, other) = (self.pool[a].as_ref()?, self.pool[b].as_ref()?);
        let fit = one.refused.iter().filter(|r| r.0 == b).map(|r| r.1 + 1).max().unwrap_or(0);
        let least = self.least_sewn * one.area.min(other.area).sqrt();
        let number = |p: Point2<f64>| Complex::new(p.x, p.y);
        let mesh = self.mesh;
        let last = *run.edges.last()?;
        let first = *run.edges.first()?;
        // On this side an edge starts where the one beyond ends.
        let here = run.edges.iter().map(|&h| self.place(h)).chain([self.place_of_end(last)]);
        let there = [self.place_of_end(mesh.twin(first))]
            .into_iter()
            .chain(run.edges.iter().map(|&h| self.place(mesh.twin(h))));
        let points: Vec<[Complex<f64>; 2]> = here.zip(there).map(|(p, q)| [number(p), number(q)]).collect();
        let lengths: Vec<f64> = run.edges.iter().map(|&h| mesh.edge_length(h)).collect();
        let window = longest_fit(&points, &lengths, run.most_edges, *FITS.get(fit)?)?;
        (window.length >= least).then(|| Seam {
            pieces: run.pieces,
            fit,
            edges: run.edges[window.first..window.last].to_vec(),
            length: window.length,
            motion: window.motion,
        })
    }

    fn place_of_end(&self, h: HalfedgeId) -> Point2<f64> {
        self.place(h.next())
    }

    /// The union of two pieces, glued along a seam, and where each face is drawn, one piece laid against the other.
    fn joined(&self, seam: &Seam) -> (Patch, Vec<[Point2<f64>; 3]>) {
        let mesh = self.mesh;
        let mut faces: Vec<FaceId> =
            seam.pieces.iter().filter_map(|&i| self.chart(i)).flat_map(|c| c.patch.faces.iter().copied()).collect();
        faces.sort_unstable();
        let mut sewn: Vec<HalfedgeId> = seam.edges.iter().flat_map(|&h| [h, mesh.twin(h)]).collect();
        sewn.sort_unstable();
        let is_cut = |h: HalfedgeId| {
            let (a, b) = (self.owner[h.face().index()].0, self.owner[mesh.twin(h).face().index()].0);
            if a == b {
                self.chart(a).is_none_or(|c| c.patch.mesh.is_boundary(self.local(h)))
            } else {
                sewn.binary_search(&h).is_err()
            }
        };
        let draw = |f: &FaceId| {
            let place = f.halfedges().map(|h| self.place(h));
            if self.owner[f.index()].0 == seam.pieces[1] { place.map(|p| seam.motion.apply(p)) } else { place }
        };
        let drawn: Vec<[Point2<f64>; 3]> = faces.iter().map(draw).collect();
        (Patch::cut_out(mesh, self.polygon, faces, is_cut), drawn)
    }

    fn replace(&mut self, seam: &Seam, chart: Chart) {
        let mut sewn = Sewn { chart, pieces: Vec::new(), edges: seam.edges.clone() };
        for i in seam.pieces {
            if let Some(piece) = self.pool[i].take() {
                sewn.pieces.extend(piece.sewn.pieces);
                sewn.edges.extend(piece.sewn.edges);
            }
        }
        self.pool.push(Some(Piece::new(sewn)));
        self.claim(self.pool.len() - 1);
    }

    fn refuse(&mut self, seam: &Seam) {
        let [a, b] = seam.pieces;
        for (one, other) in [(a, b), (b, a)] {
            if let Some(piece) = &mut self.pool[one] {
                piece.failures += 1;
                piece.refused.push((other, seam.fit));
            }
        }
    }
}

/// A stretch of border that two charts share.
struct Run {
    pieces: [usize; 2],
    /// Half-edges on the side of the first; twice around where the border is a whole loop.
    edges: Vec<HalfedgeId>,
    /// At most so many may be sewn.
    most_edges: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::pipeline::carry::carried_over;
    use crate::pipeline::charting;
    use crate::progress::Progress;
    use crate::settings::NEVER_SEWN;
    use crate::stretch;
    use nalgebra::Point3;

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
            let charting = charting::chart(vec![patch], settings, &|_| (), &memo::Run::new(&Progress::new(), None))
                .expect("not cancelled");
            assert_eq!(charting.charts.len(), 1);
            charting.charts.into_iter().next().expect("a chart")
        };
        (0..count).map(chart).collect()
    }

    fn sewn(mesh: &TriMesh, charts: Vec<Chart>, settings: &Settings) -> (Vec<Sewn>, Rungs) {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let result =
            sew(mesh, &polygon, charts, settings, &memo::Run::new(&Progress::new(), None)).expect("not cancelled");
        for s in &result.0 {
            assert!(s.chart.patch.mesh.topology().is_chart());
            assert!(s.pieces.len() == 1 || s.chart.l2 <= settings.stretch_limit);
            assert_eq!(stretch::first_flip(&s.chart.patch.mesh, &s.chart.uv), None);
            assert!(stretch::boundary_is_simple(&s.chart.patch.mesh, &s.chart.uv));
        }
        let faces: usize = result.0.iter().map(|s| s.chart.patch.faces.len()).sum();
        assert_eq!(faces, mesh.face_count());
        result
    }

    fn hemisphere(p: [Point3<f64>; 3]) -> usize {
        usize::from(p[0].z + p[1].z + p[2].z > 0.0)
    }

    #[test]
    fn two_halves_of_a_sheet_are_sewn_all_along() {
        let mesh = test_surfaces::grid(12, 12, [12.0, 12.0], 0.0);
        let settings = settings(1.1);
        let half = |p: [Point3<f64>; 3]| usize::from(p[0].x + p[1].x + p[2].x > 18.0);
        let (sewn, rungs) = sewn(&mesh, charts(&mesh, &settings, half), &settings);
        assert_eq!((sewn.len(), sewn[0].edges.len(), &sewn[0].pieces[..]), (1, 12, &[0, 1][..]));
        assert!(sewn[0].chart.l2 < 1.0 + 1e-9);
        assert!(rungs.taken().contains(&("dart", 1)));
    }

    #[test]
    fn a_ball_of_two_halves_becomes_one_chart_that_hangs_together_on_an_arc() {
        let mesh = test_surfaces::sphere(3);
        let settings = settings(1.1);
        let halves = charts(&mesh, &settings, hemisphere);
        let least = settings.least_sewn * halves[0].patch.area().sqrt();
        let (sewn, _) = sewn(&mesh, halves, &settings);
        assert_eq!(sewn.len(), 1);
        let length: f64 = sewn[0].edges.iter().map(|&h| mesh.edge_length(h)).sum();
        assert!(length >= least && length < 3.0, "{length} of a circle of 6.28");
        assert!(sewn[0].chart.patch.mesh.topology().is_disk());
    }

    #[test]
    fn what_would_be_over_the_limit_or_is_not_wanted_stays_apart() {
        let mesh = test_surfaces::sphere(3);
        let loose = settings(1.1);
        let halves = charts(&mesh, &loose, hemisphere);
        let worst = halves.iter().map(|c| c.l2).fold(1.0, f64::max);
        let tight = settings(1.0 + 0.5 * (worst - 1.0));
        assert_eq!(sewn(&mesh, halves.clone(), &tight).0.len(), 2);
        let never = Settings { least_sewn: NEVER_SEWN, ..loose.clone() };
        assert_eq!(sewn(&mesh, halves.clone(), &never).0.len(), 2);
        let long = Settings { least_sewn: 2.0, ..loose };
        assert_eq!(sewn(&mesh, halves, &long).0.len(), 2);
    }

    #[test]
    fn a_seam_is_carried_over_to_the_mesh_it_came_from() {
        let mesh = test_surfaces::sphere(3);
        let settings = settings(1.1);
        let halves = charts(&mesh, &settings, hemisphere);
        let (sewn, _) = sewn(&mesh, halves.clone(), &settings);
        let pieces: Vec<(&[FaceId], &Chart)> = halves.iter().map(|c| (&*c.patch.faces, c)).collect();
        let cuts = carried_over(&mesh, &mesh, &pieces, &sewn[0]).expect("it hangs together");
        let all: Vec<FaceId> = mesh.faces().collect();
        let open = mesh.submesh(&all, |h| cuts.binary_search(&h).is_ok()).0;
        assert_eq!(open.topology(), sewn[0].chart.patch.mesh.topology());
        assert_eq!(all, sewn[0].chart.patch.faces);
    }
}
