//! One connected surface to charts, by way of a coarse mesh where it is large.
//!
//! Where to cut hardly depends on detail: a component of many vertices is collapsed, cut into charts and
//! merged on the coarse mesh, where every trial costs milliseconds. Labels and positions in the plane are prolonged,
//! the borders redrawn on the fine mesh, and each part is polished there. A part that detail brings over the limit
//! goes back to the coarse mesh to be split.

use std::cmp::Reverse;
use std::sync::Arc;

use crate::charts::{Chart, Patch};
use crate::mesh::{self, Coarse, FaceId, Groups, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::rounds::{self, Outcome};
use crate::segmentation::{self, Segmentation};
use crate::settings::Settings;

use super::carry::carried_over;
use super::charting::{self, Charting};
use super::darts::{self, Sewn};
use super::flatten::{self, Polished, Positions};
use super::memo::{self, Fingerprint, Kind, Run};
use super::merge::{self, Which};
use super::prolong::{Prolonged, prolong};
use super::recut::recut;
use super::relief;
use super::tally::Tally;
use crate::flattening::{Rung, Rungs};

/// Components of more vertices are charted on a coarse mesh.
const COARSE_ABOVE: usize = 3_000;
/// Vertices of the coarse mesh: this share of the fine ones,
const COARSE_SHARE: f64 = 0.05;
/// and never fewer or more than these. Below, features of the size of a chart's width vanish; above, the trials
/// cost more than the fine flattening.
const COARSE_VERTICES: (usize, usize) = (1_500, 20_000);
/// On the coarse mesh the stretch above 1 must stay under this share of what the limit allows: detail
/// that the collapse removed adds some.
const COARSE_ALLOWANCE: f64 = 0.6;
/// A flattening there only has to tell whether the limit is kept, and where to begin: it may end so many times sooner.
const COARSE_TOLERANCE: f64 = 10.0;
/// Sides by which a border may move on the fine mesh: about two edges of the coarse one at the usual
/// ratio of one vertex in twenty.
const BAND_RINGS: usize = 10;
/// On the fine mesh only charts that a split there has made are joined again, and only up to so many faces: the
/// others have been tried on the coarse mesh.
const FINE_UNION: usize = 20_000;
/// A part that is over the limit is split on the coarse mesh only while it has more faces there than this, and
const LEAST_COARSE_FACES: usize = 60;
/// more than this on the fine mesh: below, charting it there costs no more.
const LEAST_FINE_FACES: usize = 1_500;
/// Share of the area that unrolls of a component that is charted as it is, however large. A little is left to rounding.
const ALL: f64 = 1.0 - 1e-6;
/// Share of the work on a component that the coarse mesh takes.
const COARSE_WORK: f64 = 0.4;

/// The charts of one component of the surface, by lowest face. `whole` is the component as a patch of itself; its faces are
/// named as in `faces`.
pub(super) fn charts(
    whole: &Patch,
    faces: &[FaceId],
    settings: &Settings,
    tally: &Tally<'_>,
    progress: &Run<'_>,
) -> Result<(Vec<Chart>, Rungs), Cancelled> {
    let fine = Whole { patch: whole };
    let size = faces.len() as f64;
    let mut rungs = Rungs::default();
    let is_large = whole.mesh.vertex_count() > COARSE_ABOVE && settings.coarse;
    // What unrolls needs no trials that a coarse mesh would make cheap, and has its edges on the fine one.
    let unrolling = is_large.then(|| charting::hard_parts(whole, ALL, settings)).flatten();
    let mut charts = if is_large && unrolling.is_none() {
        let coarse = OnCoarse::new(fine, settings, progress)?;
        let parts = coarse.parts(&mut rungs, progress)?;
        tally.add(size, COARSE_WORK);
        let done = |faces| tally.add(faces, 1.0 - COARSE_WORK);
        let charting = coarse.polish(parts, &done, &mut rungs, progress)?;
        fine.merge(charting, Which::AfterSplits { most_faces: FINE_UNION }, settings, &mut rungs, progress)?
    } else {
        let patches = unrolling.unwrap_or_else(|| vec![whole.clone()]);
        // A large union is as costly to embed whether or not its parts unroll.
        let which = if is_large { Which::AllSewn { most_faces: FINE_UNION } } else { Which::All };
        let charts = fine.charts(patches, which, settings, &mut rungs, &|faces| tally.add(faces, 1.0), progress)?;
        fine.sew(charts, settings, &mut rungs, progress)?.into_iter().map(|sewn| sewn.chart).collect()
    };
    charts = recut(&whole.mesh, &whole.polygon, charts, settings, &mut rungs, progress)?;
    for f in charts.iter_mut().flat_map(|c| &mut c.patch.faces) {
        *f = faces[f.index()];
    }
    Ok((charts, rungs))
}

/// A connected mesh as a patch of itself.
#[derive(Clone, Copy)]
struct Whole<'a> {
    patch: &'a Patch,
}

impl Whole<'_> {
    /// The patch made of some faces, cut along some edges of which both sides are given, sorted.
    fn part(&self, faces: &[FaceId], cuts: &[HalfedgeId]) -> Patch {
        if cuts.is_empty() && faces.len() == self.patch.faces.len() {
            return self.patch.clone();
        }
        let is_cut = |h| cuts.binary_search(&h).is_ok();
        Patch::cut_out(&self.patch.mesh, &self.patch.polygon, faces.to_vec(), is_cut)
    }

    /// Charts patches that make up this mesh and joins charts that need not be apart.
    fn charts(
        &self,
        patches: Vec<Patch>,
        which: Which,
        settings: &Settings,
        rungs: &mut Rungs,
        done: &(dyn Fn(f64) + Sync),
        progress: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        let charting = charting::chart(patches, settings, done, progress)?;
        rungs.add(&charting.rungs);
        self.merge(charting, which, settings, rungs, progress)
    }

    /// Sews charts of this mesh together.
    fn sew(
        &self,
        charts: Vec<Chart>,
        settings: &Settings,
        rungs: &mut Rungs,
        progress: &Run<'_>,
    ) -> Result<Vec<Sewn>, Cancelled> {
        let (sewn, steps) = darts::sew(&self.patch.mesh, &self.patch.polygon, charts, settings, progress)?;
        rungs.add(&steps);
        Ok(sewn)
    }

    fn merge(
        &self,
        charting: Charting,
        which: Which,
        settings: &Settings,
        rungs: &mut Rungs,
        progress: &Run<'_>,
    ) -> Result<Vec<Chart>, Cancelled> {
        if !settings.merge {
            return Ok(charting.charts);
        }
        let (mesh, polygon) = (&self.patch.mesh, &self.patch.polygon);
        let (charts, steps) = merge::merge(mesh, polygon, charting, which, settings, progress)?;
        rungs.add(&steps);
        Ok(charts)
    }
}

/// A part of the fine mesh and the chart of the coarse mesh that it lies on. It becomes a mesh of its own only while it is
/// worked on.
#[derive(Clone)]
struct Part {
    /// Ascending.
    faces: Vec<FaceId>,
    /// Both sides of the edges inside it along which it is cut, sorted.
    cuts: Vec<HalfedgeId>,
    guide: Chart,
    /// The number of the guide among all, where it is not sewn.
    number: usize,
    /// What it was sewn of, to go back to.
    pieces: Vec<Part>,
}

impl Part {
    /// Whether an edge of the coarse mesh lies between two of the pieces that the guide is sewn of.
    fn is_border(&self, coarse: &TriMesh, h: HalfedgeId) -> bool {
        let piece = |h: HalfedgeId| self.pieces.iter().position(|p| p.guide.patch.faces.contains(&h.face()));
        !self.pieces.is_empty() && piece(h) != piece(coarse.twin(h))
    }
}

/// What a part is made into.
enum Made {
    Chart(Chart),
    /// To be charted on the fine mesh alone.
    Fine(Patch),
}

/// A fine mesh with its coarse one.
struct OnCoarse<'a> {
    fine: Whole<'a>,
    /// The coarse mesh as a patch of itself.
    whole: Patch,
    coarse: Arc<Coarse>,
    settings: &'a Settings,
    /// For the coarse mesh.
    strict: Settings,
}

impl<'a> OnCoarse<'a> {
    fn new(fine: Whole<'a>, settings: &'a Settings, progress: &Run<'_>) -> Result<Self, Cancelled> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
        let wanted = (COARSE_SHARE * fine.patch.mesh.vertex_count() as f64) as usize;
        let target = wanted.clamp(COARSE_VERTICES.0, COARSE_VERTICES.1);
        let input = |f: &mut Fingerprint| {
            f.mesh(&fine.patch.mesh);
            f.indices([target]);
        };
        let bytes = |c: &Coarse| 4 * (c.face.len() + c.vertex.len()) + memo::bytes_of(&c.mesh);
        let coarse =
            progress.recall(Kind::Coarse, input, bytes, || mesh::coarsen(&fine.patch.mesh, target, progress))?;
        let polygon = (0..coarse.mesh.face_count()).map(|f| FaceId::new(f).index() as u32).collect();
        let whole = Patch::whole(Arc::new(coarse.mesh.clone()), polygon);
        let mut strict = settings.clone();
        strict.stretch_limit = 1.0 + COARSE_ALLOWANCE * (settings.stretch_limit - 1.0);
        strict.stretch.tolerance *= COARSE_TOLERANCE;
        Ok(Self { fine, whole, coarse, settings, strict })
    }

    /// Parts that flatten under the limit on the coarse mesh.
    fn parts(&self, rungs: &mut Rungs, progress: &Run<'_>) -> Result<Vec<Part>, Cancelled> {
        let whole = Whole { patch: &self.whole };
        let charts = whole.charts(vec![self.whole.clone()], Which::All, &self.strict, rungs, &|_| (), progress)?;
        let parts = self.prolong_labels(self.fine.patch, &charts, progress)?;
        let sewn = whole.sew(charts, &self.strict, rungs, progress)?;
        Ok(self.join(parts, sewn))
    }

    /// Puts parts together whose guides have been sewn, cut where these are not.
    fn join(&self, parts: Vec<Part>, sewn: Vec<Sewn>) -> Vec<Part> {
        let mut rest: Vec<Option<Part>> = parts.into_iter().map(Some).collect();
        let mut joined = Vec::new();
        for sewn in sewn.into_iter().filter(|s| s.pieces.len() > 1) {
            let mine = |p: &Option<Part>| p.as_ref().is_some_and(|p| sewn.pieces.contains(&p.number));
            // A guide that has come to lie under two parts says of neither where to sew it.
            if rest.iter().filter(|p| mine(p)).count() != sewn.pieces.len() {
                continue;
            }
            let pieces: Vec<Part> = rest.iter_mut().filter(|p| mine(p)).filter_map(Option::take).collect();
            let borders: Vec<(&[FaceId], &Chart)> = pieces.iter().map(|p| (&*p.faces, &p.guide)).collect();
            match carried_over(&self.coarse.mesh, &self.fine.patch.mesh, &borders, &sewn) {
                Some(cuts) => {
                    let mut faces: Vec<FaceId> = pieces.iter().flat_map(|p| p.faces.iter().copied()).collect();
                    faces.sort_unstable();
                    joined.push(Part { faces, cuts, guide: sewn.chart, number: usize::MAX, pieces });
                }
                None => joined.extend(pieces),
            }
        }
        joined.extend(rest.into_iter().flatten());
        joined
    }

    /// Divides a patch of the fine mesh as the coarse charts it lies on are divided.
    fn prolong_labels(&self, patch: &Patch, charts: &[Chart], progress: &Run<'_>) -> Result<Vec<Part>, Cancelled> {
        const NONE: u32 = u32::MAX;
        let mut chart_of = vec![NONE; self.coarse.mesh.face_count()];
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
        let parts = progress.recall(
            Kind::Borders,
            input,
            |s: &Segmentation| 4 * s.label.len(),
            || segmentation::straighten(&patch.mesh, &patch.polygon, &label, BAND_RINGS, crease_weight, progress),
        )?;
        let guide_of = |faces: &[FaceId]| {
            let mut votes = vec![0usize; charts.len()];
            faces.iter().map(under).filter(|n| *n != NONE).for_each(|n| votes[n as usize] += 1);
            let best = votes.iter().enumerate().max_by_key(|&(i, n)| (*n, Reverse(i)));
            best.map_or(0, |b| b.0)
        };
        let part = |faces: &[FaceId]| {
            let number = guide_of(faces);
            let (faces, guide) = (faces.to_vec(), charts[number].clone());
            Part { faces, cuts: Vec::new(), guide, number, pieces: Vec::new() }
        };
        let groups = Groups::by_label(&parts.label, parts.parts, |i| patch.faces[i]);
        Ok(groups.iter().map(part).collect())
    }

    /// Flattens the parts from where the coarse charts are. Those over the limit are split on the coarse mesh, those
    /// too small for that are charted on the fine one. Each split strictly reduces the coarse faces of a part.
    fn polish(
        &self,
        parts: Vec<Part>,
        done: &(dyn Fn(f64) + Sync),
        rungs: &mut Rungs,
        progress: &Run<'_>,
    ) -> Result<Charting, Cancelled> {
        let rounds = rounds::until_made(
            parts,
            |p| (Reverse(p.faces.len()), p.faces[0]),
            || (),
            |part, ()| {
                let mut rungs = Rungs::default();
                let outcome = self.step(part, &mut rungs, progress)?;
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
        let charting = charting::chart(rest, self.settings, done, progress)?;
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
        if self.settings.wants_darts() { relief::without_doubled_edges(patch, start) } else { (patch, start) }
    }

    fn step(&self, part: &Part, rungs: &mut Rungs, progress: &Run<'_>) -> Result<Outcome<Made, Part>, Cancelled> {
        progress.check()?;
        let done = |h: HalfedgeId| part.is_border(&self.coarse.mesh, h);
        let on_fine = || self.fine.part(&part.faces, &part.cuts);
        if let Some(Prolonged { patch, start }) = prolong(&self.coarse, &part.guide, on_fine(), done)
            && let (patch, start) = self.opened(patch, start)
            && let Polished::Flat(flat) =
                flatten::polish(&patch, &start, Rung::Prolonged, self.settings, rungs, progress)?
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
        let patches = charting::split(&patch, &self.strict, rungs, progress)?;
        let charting = charting::chart(patches, &self.strict, &|_| (), progress)?;
        rungs.add(&charting.rungs);
        let patch = on_fine();
        let parts = self.prolong_labels(&patch, &charting.charts, progress)?;
        // Straightening may have given one label all.
        Ok(if parts.len() < 2 { Outcome::Made(Made::Fine(patch)) } else { Outcome::Divided(parts) })
    }
}

/// Gives faces without a label that of a neighbour, a ring at a time; 0 if nobody has any.
fn spread_labels(mesh: &TriMesh, label: &mut [u32]) {
    let mut front: Vec<FaceId> = mesh.faces().filter(|f| label[f.index()] != u32::MAX).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for f in front {
            for h in f.halfedges() {
                let t = mesh.twin(h);
                if !t.is_none() && label[t.face().index()] == u32::MAX {
                    label[t.face().index()] = label[f.index()];
                    next.push(t.face());
                }
            }
        }
        front = next;
    }
    label.iter_mut().filter(|l| **l == u32::MAX).for_each(|l| *l = 0);
}
