//! Coarse to fine: a component of many vertices is cut into charts on a coarse mesh, where every trial costs milliseconds, since
//! where to cut hardly depends on detail. Labels and positions in the plane are prolonged, the borders redrawn on the fine mesh,
//! and each part is polished there. A part that detail brings over the limit goes back to the coarse mesh to be split.

mod carry;
mod prolong;

use std::cmp::Reverse;
use std::sync::Arc;

use crate::cache::{self, Fingerprint, Kind, Run};
use crate::charts::{Chart, Patch};
use crate::flattening::{self, Polished, Positions, Rung, Rungs};
use crate::mesh::{self, Coarse, FaceId, Groups, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::rounds::{self, Outcome};
use crate::segmentation::{self, Segmentation};
use crate::settings::{Moves, Settings};

use super::cost::Price;
use super::divide::{self, Charting};
use super::moves::dart;
use super::moves::join::Which;
use super::whole::Whole;
use carry::carried_over;
use prolong::{Prolonged, prolong};

/// The coarse mesh has this share of the fine one's vertices.
const COARSE_SHARE: f64 = 0.05;
/// The coarse mesh has at least and at most so many vertices. With fewer, features of the size of a chart's width vanish; with
/// more, the trials cost more than the fine flattening.
const COARSE_VERTICES: (usize, usize) = (1_500, 20_000);
/// On the coarse mesh the stretch above 1 must stay under this share of what the limit allows: detail
/// that the collapse removed adds some.
const COARSE_ALLOWANCE: f64 = 0.6;
/// The same where cuts are closed: a chart that does not hold on the fine mesh goes back to what it was, so more may be tried.
const COARSE_ALLOWANCE_TO_CLOSE: f64 = 0.9;
/// A flattening there only has to tell whether the limit is kept, and where to begin: it may end so many times sooner.
const COARSE_TOLERANCE: f64 = 10.0;
/// Sides by which a border may move on the fine mesh: about two edges of the coarse one at the usual
/// ratio of one vertex in twenty.
const BAND_RINGS: usize = 10;
/// A part that is over the limit is split on the coarse mesh only while it has more faces there than this.
const LEAST_COARSE_FACES: usize = 60;
/// It is split on the coarse mesh only while it has more faces than this on the fine one: below, charting it there costs no more.
const LEAST_FINE_FACES: usize = 1_500;
/// Stands for no label in an array of them.
const NO_LABEL: u32 = u32::MAX;

/// A part of the fine mesh and the chart of the coarse mesh that it lies on. It becomes a mesh of its own only while it is
/// worked on.
#[derive(Clone)]
pub(super) struct Part {
    /// Ascending.
    faces: Vec<FaceId>,
    /// Both sides of the edges inside it along which it is cut, sorted.
    cuts: Vec<HalfedgeId>,
    guide: Chart,
    /// The number of the guide among all, where it has not been joined.
    number: Option<usize>,
    /// What it was joined of, or what it was before its cuts were closed further: to go back to.
    pieces: Vec<Part>,
}

impl Part {
    /// Whether an edge of the coarse mesh lies between two of the charts that the guide was joined of.
    fn is_border(&self, coarse: &TriMesh, h: HalfedgeId) -> bool {
        match &self.pieces[..] {
            [] => false,
            [before] => before.is_border(coarse, h),
            pieces => {
                let piece =
                    |h: HalfedgeId| pieces.iter().position(|p| p.guide.patch.faces.binary_search(&h.face()).is_ok());
                piece(h) != piece(coarse.twin(h))
            }
        }
    }
}

/// What a part is made into.
enum Made {
    Chart(Chart),
    /// To be charted on the fine mesh alone.
    Fine(Patch),
}

/// A fine mesh with its coarse one.
pub(super) struct OnCoarse<'a> {
    fine: Whole<'a>,
    /// The coarse mesh as a patch of itself.
    whole: Patch,
    coarse: Arc<Coarse>,
    settings: &'a Settings,
    /// For the coarse mesh, where a part over the limit would have to be split.
    strict: Settings,
    /// For the coarse mesh, where a part over the limit goes back to what it was.
    less_strict: Settings,
}

impl<'a> OnCoarse<'a> {
    pub(super) fn new(fine: Whole<'a>, settings: &'a Settings, run: &Run<'_>) -> Result<Self, Cancelled> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
        let wanted = (COARSE_SHARE * fine.patch.mesh.vertex_count() as f64) as usize;
        let target = wanted.clamp(COARSE_VERTICES.0, COARSE_VERTICES.1);
        let input = |f: &mut Fingerprint| {
            f.mesh(&fine.patch.mesh);
            f.indices([target]);
        };
        let bytes = |c: &Coarse| 4 * (c.face.len() + c.vertex.len()) + cache::bytes_of(&c.mesh);
        let coarse =
            run.recall(Kind::Coarse, input, bytes, || mesh::coarsen(&fine.patch.mesh, target, run.progress))?;
        let polygon = (0..coarse.mesh.face_count()).map(|f| FaceId::new(f).index() as u32).collect();
        let whole = Patch::whole(Arc::new(coarse.mesh.clone()), polygon);
        let [strict, less_strict] = [COARSE_ALLOWANCE, COARSE_ALLOWANCE_TO_CLOSE].map(|allowance| {
            let mut of_coarse = settings.clone();
            of_coarse.stretch_limit = 1.0 + allowance * (settings.stretch_limit - 1.0);
            of_coarse.stretch.tolerance *= COARSE_TOLERANCE;
            of_coarse
        });
        Ok(Self { fine, whole, coarse, settings, strict, less_strict })
    }

    /// Parts that flatten under the limit on the coarse mesh.
    pub(super) fn parts(&self, rungs: &mut Rungs, run: &Run<'_>) -> Result<Vec<Part>, Cancelled> {
        let whole = Whole { patch: &self.whole };
        let charts = whole.charts(vec![self.whole.clone()], Which::EVERY, &self.strict, rungs, &|_| (), run)?;
        let parts = self.prolong_labels(self.fine.patch, &charts, run)?;
        let mut number = vec![None; self.coarse.mesh.face_count()];
        for (i, chart) in charts.iter().enumerate() {
            chart.patch.faces.iter().for_each(|f| number[f.index()] = Some(i));
        }
        let joined = whole.join_partly(charts, &self.strict, rungs, run)?;
        let parts = self.join(parts, &joined, &number);
        // From too far there is a way back.
        let closed = whole.close(joined, &self.less_strict, rungs, run)?;
        Ok(self.close(parts, closed))
    }

    /// Puts parts together whose guides have been joined, cut where these are open. `number` says which guide each face of the
    /// coarse mesh was in.
    fn join(&self, parts: Vec<Part>, charts: &[Chart], number: &[Option<usize>]) -> Vec<Part> {
        let mut rest: Vec<Option<Part>> = parts.into_iter().map(Some).collect();
        let mut joined = Vec::new();
        for chart in charts {
            let mut guides: Vec<usize> = chart.patch.faces.iter().filter_map(|f| number[f.index()]).collect();
            guides.sort_unstable();
            guides.dedup();
            let is_mine =
                |p: &Option<Part>| p.as_ref().and_then(|p| p.number).is_some_and(|n| guides.binary_search(&n).is_ok());
            // A guide that has come to lie under two parts says of neither where to glue it.
            if guides.len() < 2 || rest.iter().filter(|p| is_mine(p)).count() != guides.len() {
                continue;
            }
            let pieces: Vec<Part> = rest.iter_mut().filter(|p| is_mine(p)).filter_map(Option::take).collect();
            match self.cuts_of(&pieces, chart) {
                Some(cuts) => {
                    let mut faces: Vec<FaceId> = pieces.iter().flat_map(|p| p.faces.iter().copied()).collect();
                    faces.sort_unstable();
                    joined.push(Part { faces, cuts, guide: chart.clone(), number: None, pieces });
                }
                None => joined.extend(pieces),
            }
        }
        joined.extend(rest.into_iter().flatten());
        joined
    }

    /// Where the union of pieces is cut whose guides have become a chart; `None` where they do not hang together.
    fn cuts_of(&self, pieces: &[Part], chart: &Chart) -> Option<Vec<HalfedgeId>> {
        let borders: Vec<(&[FaceId], &Chart)> = pieces.iter().map(|p| (&*p.faces, &p.guide)).collect();
        carried_over(&self.coarse.mesh, &self.fine.patch.mesh, &borders, chart)
    }

    /// Gives parts whose guides have had cuts closed these as they are now.
    fn close(&self, parts: Vec<Part>, charts: Vec<Chart>) -> Vec<Part> {
        let border = |chart: &Chart| chart.patch.mesh.boundary_length();
        let close = |part: Part| {
            let same = |chart: &&Chart| chart.patch.faces == part.guide.patch.faces;
            let Some(guide) = charts.iter().find(same).filter(|chart| border(chart) < border(&part.guide)) else {
                return part;
            };
            let cuts = if part.pieces.is_empty() { Some(Vec::new()) } else { self.cuts_of(&part.pieces, guide) };
            match cuts {
                Some(cuts) => {
                    Part { faces: part.faces.clone(), cuts, guide: guide.clone(), number: None, pieces: vec![part] }
                }
                None => part,
            }
        };
        parts.into_iter().map(close).collect()
    }

    /// Divides a patch of the fine mesh as the coarse charts it lies on are divided.
    fn prolong_labels(&self, patch: &Patch, charts: &[Chart], run: &Run<'_>) -> Result<Vec<Part>, Cancelled> {
        let mut chart_of = vec![NO_LABEL; self.coarse.mesh.face_count()];
        for (number, chart) in charts.iter().enumerate() {
            for f in &chart.patch.faces {
                chart_of[f.index()] = FaceId::new(number).index() as u32;
            }
        }
        let under = |f: &FaceId| chart_of[self.coarse.face[f.index()].index()];
        let mut label: Vec<u32> = patch.faces.iter().map(under).collect();
        spread_labels(&patch.mesh, &mut label);
        let crease_weight = self.settings.segmentation.crease_weight;
        let input = |f: &mut Fingerprint| {
            f.mesh(&patch.mesh);
            f.numbers(&patch.polygon);
            f.numbers(&label);
            f.reals([crease_weight]);
        };
        let parts = run.recall(
            Kind::Borders,
            input,
            |s: &Segmentation| 4 * s.label.len(),
            || segmentation::straighten(&patch.mesh, &patch.polygon, &label, BAND_RINGS, crease_weight, run.progress),
        )?;
        let guide_of = |faces: &[FaceId]| {
            let mut votes = vec![0usize; charts.len()];
            faces.iter().map(under).filter(|n| *n != NO_LABEL).for_each(|n| votes[n as usize] += 1);
            let best = votes.iter().enumerate().max_by_key(|&(i, n)| (*n, Reverse(i)));
            best.map_or(0, |b| b.0)
        };
        let part = |faces: &[FaceId]| {
            let number = guide_of(faces);
            let (faces, guide) = (faces.to_vec(), charts[number].clone());
            Part { faces, cuts: Vec::new(), guide, number: Some(number), pieces: Vec::new() }
        };
        let groups = Groups::by_label(&parts.label, parts.parts, |i| patch.faces[i]);
        Ok(groups.iter().map(part).collect())
    }

    /// Flattens the parts from where the coarse charts are. Those over the limit are split on the coarse mesh, those
    /// too small for that are charted on the fine one. Each split strictly reduces the coarse faces of a part.
    pub(super) fn polish(
        &self,
        parts: Vec<Part>,
        done: &(dyn Fn(f64) + Sync),
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Charting, Cancelled> {
        let rounds = rounds::until_made(
            parts,
            |p| (Reverse(p.faces.len()), p.faces[0]),
            || (),
            |part, ()| {
                let mut rungs = Rungs::default();
                let outcome = self.step(part, &mut rungs, run)?;
                if matches!(outcome, Outcome::Made(Made::Chart(_))) {
                    done(part.faces.len() as f64);
                }
                Ok((outcome, rungs))
            },
        )?;
        rounds.notes.iter().for_each(|steps| rungs.add(steps));
        let (mut accepted, mut rest) = (Vec::new(), Vec::new());
        for (made, family) in rounds.made {
            match made {
                Made::Chart(chart) => accepted.push((chart, family)),
                Made::Fine(patch) => rest.push(patch),
            }
        }
        let split_count = rounds.divisions;
        let charting =
            divide::divide(rest, &Price::new(&self.fine.patch.mesh, self.settings), self.settings, done, run)?;
        // What is charted anew has not been tried with its neighbours on the coarse mesh either.
        let alone = split_count + charting.family.iter().flatten().max().map_or(0, |most| most + 1);
        let family = (alone..).zip(charting.family).map(|(own, f)| Some(f.map_or(own, |f| f + split_count)));
        accepted.extend(charting.charts.into_iter().zip(family));
        accepted.sort_by_key(|(c, _)| c.patch.faces[0]);
        let (charts, family) = accepted.into_iter().unzip();
        Ok(Charting { charts, family, rungs: charting.rungs, refused: charting.refused })
    }

    /// A patch and its start, cut open where two edges join the same vertices, as far as the coarse chart was not.
    fn opened(&self, patch: Patch, start: Positions) -> (Patch, Positions) {
        if self.settings.moves == Moves::All { dart::without_doubled_edges(patch, start) } else { (patch, start) }
    }

    fn step(&self, part: &Part, rungs: &mut Rungs, run: &Run<'_>) -> Result<Outcome<Made, Part>, Cancelled> {
        run.progress.check()?;
        let done = |h: HalfedgeId| part.is_border(&self.coarse.mesh, h);
        let on_fine = || self.fine.part(&part.faces, &part.cuts);
        if let Some(Prolonged { patch, start }) = prolong(&self.coarse, &part.guide, on_fine(), done)
            && let (patch, start) = self.opened(patch, start)
            && let Polished::Flat(flat) =
                flattening::polish(&patch, &start, Rung::Prolonged, self.settings, rungs, run)?
        {
            return Ok(Outcome::Made(Made::Chart(flat.into_chart(patch))));
        }
        if !part.pieces.is_empty() {
            return Ok(Outcome::Divided(part.pieces.clone()));
        }
        let mut faces = part.guide.patch.faces.clone();
        if faces.len() <= LEAST_COARSE_FACES || part.faces.len() <= LEAST_FINE_FACES {
            return Ok(Outcome::Made(Made::Fine(on_fine())));
        }
        faces.sort_unstable();
        let patch = Patch::of_surface(&self.whole.mesh, &self.whole.polygon, faces);
        let patches = divide::split_once(&patch, &self.strict, rungs, run)?;
        let charting =
            divide::divide(patches, &Price::new(&self.whole.mesh, &self.strict), &self.strict, &|_| (), run)?;
        rungs.add(&charting.rungs);
        let patch = on_fine();
        let parts = self.prolong_labels(&patch, &charting.charts, run)?;
        // Straightening may have given one label all.
        Ok(if parts.len() < 2 { Outcome::Made(Made::Fine(patch)) } else { Outcome::Divided(parts) })
    }
}

/// Gives faces without a label that of a neighbour, a ring at a time; 0 if nobody has any.
fn spread_labels(mesh: &TriMesh, label: &mut [u32]) {
    let mut front: Vec<FaceId> = mesh.faces().filter(|f| label[f.index()] != NO_LABEL).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for f in front {
            for h in f.halfedges() {
                let t = mesh.twin(h);
                if !t.is_none() && label[t.face().index()] == NO_LABEL {
                    label[t.face().index()] = label[f.index()];
                    next.push(t.face());
                }
            }
        }
        front = next;
    }
    label.iter_mut().filter(|l| **l == NO_LABEL).for_each(|l| *l = 0);
}
