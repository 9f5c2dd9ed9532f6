//! Coarse to fine: a component of many vertices is cut into charts on a coarse mesh, where every trial costs milliseconds, since
//! where to cut hardly depends on detail. Labels and positions in the plane are prolonged, the borders redrawn on the fine mesh,
//! and each part is polished there. A part that detail brings over the limit goes back to the coarse mesh, to be charted there again
//! under a stricter limit, and at last to be split.

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
/// Where a part came to be over the limit on the fine mesh, the stretch above 1 must stay under this share of what the limit allows
/// on the coarse one, since there detail that the collapse removed adds some. Mostly it adds none: over 13 closed meshes under limits of
/// 1.01 to 1.02 charts and seam cost 3 % less than if all were charted so strictly, over nine models under 1.1 2 % less, and 5 % more
/// if none were.
const STRICT_ALLOWANCE: f64 = 0.6;
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
    origin: Origin,
}

/// How a part came about, which says what is done where the fine mesh refuses it.
#[derive(Clone)]
enum Origin {
    /// The guide is one of the charts that the coarse mesh was divided into, by its number; whether under the stricter limit.
    Charted { number: usize, is_strict: bool },
    /// Other parts were joined, or the cuts of a single one closed further. There is a way back to them.
    Pieces(Vec<Part>),
}

impl Part {
    /// Whether an edge of the coarse mesh lies between two of the charts that the guide was joined of.
    fn is_border(&self, coarse: &TriMesh, h: HalfedgeId) -> bool {
        match self.pieces() {
            [] => false,
            [before] => before.is_border(coarse, h),
            pieces => {
                let piece =
                    |h: HalfedgeId| pieces.iter().position(|p| p.guide.patch.faces.binary_search(&h.face()).is_ok());
                piece(h) != piece(coarse.twin(h))
            }
        }
    }

    /// What it was made of on the coarse mesh, if of other parts.
    fn pieces(&self) -> &[Part] {
        match &self.origin {
            Origin::Charted { .. } => &[],
            Origin::Pieces(pieces) => pieces,
        }
    }

    /// The number of its guide among the charts that the coarse mesh was divided into, where that is what it still is.
    fn number(&self) -> Option<usize> {
        match self.origin {
            Origin::Charted { number, .. } => Some(number),
            Origin::Pieces(_) => None,
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
    /// For the coarse mesh.
    of_coarse: Settings,
    /// For the coarse mesh, where a part came to be over the limit on the fine one.
    strict: Settings,
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
        let mut of_coarse = settings.clone();
        of_coarse.stretch.tolerance *= COARSE_TOLERANCE;
        // What is straight on the coarse mesh is minimised on the fine one, and bent again.
        of_coarse.straighten = 0.0;
        let mut strict = of_coarse.clone();
        strict.stretch_limit = 1.0 + STRICT_ALLOWANCE * (settings.stretch_limit - 1.0);
        Ok(Self { fine, whole, coarse, settings, of_coarse, strict })
    }

    /// Parts that flatten under the limit on the coarse mesh.
    pub(super) fn parts(&self, rungs: &mut Rungs, run: &Run<'_>) -> Result<Vec<Part>, Cancelled> {
        self.charted(self.fine.patch, self.whole.clone(), false, rungs, run)
    }

    /// Parts of a patch of the fine mesh, as the patch of the coarse mesh that it lies on is charted.
    fn charted(
        &self,
        fine: &Patch,
        coarse: Patch,
        is_strict: bool,
        rungs: &mut Rungs,
        run: &Run<'_>,
    ) -> Result<Vec<Part>, Cancelled> {
        let settings = if is_strict { &self.strict } else { &self.of_coarse };
        let whole = Whole { patch: &self.whole };
        let charts = whole.charts(vec![coarse], Which::EVERY, settings, rungs, &|_| (), run)?;
        let parts = self.prolong_labels(fine, &charts, is_strict, run)?;
        let mut number = vec![None; self.coarse.mesh.face_count()];
        for (i, chart) in charts.iter().enumerate() {
            chart.patch.faces.iter().for_each(|f| number[f.index()] = Some(i));
        }
        let joined = whole.join_partly(charts, settings, rungs, run)?;
        let parts = self.join(parts, &joined, &number);
        // From too far there is a way back, under the stricter limit, too.
        let closed = whole.close(joined, &self.of_coarse, rungs, run)?;
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
                |p: &Option<Part>| p.as_ref().and_then(Part::number).is_some_and(|n| guides.binary_search(&n).is_ok());
            // A guide that has come to lie under two parts says of neither where to glue it.
            if guides.len() < 2 || rest.iter().filter(|p| is_mine(p)).count() != guides.len() {
                continue;
            }
            let pieces: Vec<Part> = rest.iter_mut().filter(|p| is_mine(p)).filter_map(Option::take).collect();
            match self.cuts_of(&pieces, chart) {
                Some(cuts) => {
                    let mut faces: Vec<FaceId> = pieces.iter().flat_map(|p| p.faces.iter().copied()).collect();
                    faces.sort_unstable();
                    joined.push(Part { faces, cuts, guide: chart.clone(), origin: Origin::Pieces(pieces) });
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
            let cuts = match &part.origin {
                Origin::Charted { .. } => Some(Vec::new()),
                Origin::Pieces(pieces) => self.cuts_of(pieces, guide),
            };
            match cuts {
                Some(cuts) => {
                    let faces = part.faces.clone();
                    Part { faces, cuts, guide: guide.clone(), origin: Origin::Pieces(vec![part]) }
                }
                None => part,
            }
        };
        parts.into_iter().map(close).collect()
    }

    /// Divides a patch of the fine mesh as the coarse charts it lies on are divided.
    fn prolong_labels(
        &self,
        patch: &Patch,
        charts: &[Chart],
        is_strict: bool,
        run: &Run<'_>,
    ) -> Result<Vec<Part>, Cancelled> {
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
            Part { faces, cuts: Vec::new(), guide, origin: Origin::Charted { number, is_strict } }
        };
        let groups = Groups::by_label(&parts.label, parts.parts, |i| patch.faces[i]);
        Ok(groups.iter().map(part).collect())
    }

    /// Flattens the parts from where the coarse charts are. Those over the limit are charted on the coarse mesh again under a stricter
    /// limit, then split there, and those too small for that are charted on the fine one. A part is charted again once, and each
    /// split strictly reduces its coarse faces.
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
        if self.settings.moves == Moves::All {
            dart::without_doubled_edges(patch, start, self.settings)
        } else {
            (patch, start)
        }
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
        let is_strict = match &part.origin {
            Origin::Pieces(pieces) => return Ok(Outcome::Divided(pieces.clone())),
            Origin::Charted { is_strict, .. } => *is_strict,
        };
        let mut faces = part.guide.patch.faces.clone();
        faces.sort_unstable();
        let patch = Patch::of_surface(&self.whole.mesh, &self.whole.polygon, faces);
        if !is_strict {
            return Ok(Outcome::Divided(self.charted(&on_fine(), patch, true, rungs, run)?));
        }
        if patch.faces.len() <= LEAST_COARSE_FACES || part.faces.len() <= LEAST_FINE_FACES {
            return Ok(Outcome::Made(Made::Fine(on_fine())));
        }
        let patches = divide::split_once(&patch, &self.strict, rungs, run)?;
        let charting =
            divide::divide(patches, &Price::new(&self.whole.mesh, &self.strict), &self.strict, &|_| (), run)?;
        rungs.add(&charting.rungs);
        let patch = on_fine();
        let parts = self.prolong_labels(&patch, &charting.charts, true, run)?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;

    /// A part that the fine mesh refuses goes back to the coarse one once, where it is charted under the stricter limit, and only
    /// then is split.
    #[test]
    fn what_the_fine_mesh_refuses_is_charted_again_more_strictly_then_split() {
        let ball = test_surfaces::sphere(5);
        let polygon = (0..ball.face_count() as u32).collect();
        let whole = Patch::whole(Arc::new(ball), polygon);
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let run = Run::new(&progress, None);
        let settings = Settings { stretch_limit: 1.03, stretch_price: 0.0, ..Settings::default() };
        // No part of a ball is so flat.
        let too_tight = Settings { stretch_limit: 1.0 + 1e-6, ..settings.clone() };
        let mut level = OnCoarse::new(Whole { patch: &whole }, &settings, &run).expect("not cancelled");
        let parts = level.parts(&mut rungs, &run).expect("not cancelled");
        let strictly =
            |part: &Part, wanted: bool| matches!(part.origin, Origin::Charted { is_strict, .. } if is_strict == wanted);
        assert!(parts.iter().all(|part| part.guide.l2 <= settings.stretch_limit));
        assert!(parts.iter().all(|part| strictly(part, false) || !part.pieces().is_empty()));
        level.settings = &too_tight;
        let mut open = parts;
        let (mut charted_again, mut split) = (0, 0);
        while let Some(part) = open.pop() {
            let Outcome::Divided(next) = level.step(&part, &mut rungs, &run).expect("not cancelled") else { continue };
            let mut faces: Vec<FaceId> = next.iter().flat_map(|part| part.faces.iter().copied()).collect();
            faces.sort_unstable();
            assert_eq!(faces, part.faces, "each face is in one part again");
            // Those that are made of others have these to go back to.
            let are_strict = |next: &[Part]| next.iter().all(|new| strictly(new, true) || !new.pieces().is_empty());
            if strictly(&part, false) {
                charted_again += 1;
                assert!(are_strict(&next));
            } else if strictly(&part, true) {
                split += 1;
                let size = |part: &Part| part.guide.patch.faces.len();
                assert!(are_strict(&next) && next.iter().all(|new| size(new) < size(&part)));
            }
            if split < 3 {
                open.extend(next);
            }
        }
        assert!(charted_again >= 1 && split >= 1, "{charted_again} {split}");
    }
}
