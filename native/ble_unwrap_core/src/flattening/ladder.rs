//! One patch to one chart: the fallback ladder from a plane to Tutte.

use nalgebra::Point2;

use crate::cache::{Fingerprint, Kind, Run};
use crate::charts::Patch;
use crate::distortion::{self, RestTriangle};
use crate::embedding::{self, EmbeddingError, Model};
use crate::geodesics::LandmarkDistances;
use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::settings::Settings;
use crate::stretch::{self, BOUNDARY_REACH, Minimised, Stitcher, StretchError};

use super::flat::{Flat, Positions, judge, l2};
use super::rungs::{Rung, Rungs};
use super::steps::Steps;

/// An isometry has no more L2 stretch than this; half a degree between normals alone gives 1.0001,
/// half a per cent of strain 1.006. What is above has folded away area that lies in thin faces.
const ISOMETRIC: f64 = 1.01;
/// An embedding folded over more of its area than this is near no flat map. Of 598 trials on three
/// development models 275 were above; 7 of these ended under the limit, after most of the time spent on all. The printed
/// model folds even what is flat, so of it this tells nothing.
const MOST_FOLDED: f64 = 0.25;
/// Charts sewn together that turn over more of the surface than this do not fit: of some 1,000 such starts on a CAD part of 61,000 slivers, a scan of
/// 871,000 faces and a dozen models 26 ended under the limit, and all took nearly half of the time that was spent on joining.
const MOST_FOLDED_SEWN: f64 = 1e-3;
/// The same of charts that lie already, most of them as on a coarser mesh, whose faces may fold in small: of 70 such starts on the CAD part and the
/// scan 2 ended under the limit.
const MOST_FOLDED_LYING: f64 = 0.01;
/// A start without flips that is stretched more than this is not worth minimising: of the trials on a model
/// with many holes, where starts are worst, none that began above 3 came under an L2 of 1.1; this leaves room.
const HOPELESS_START: f64 = 4.0;

/// Charts sewn together begin nearer to their minimum or not at all.
const HOPELESS_SEWN: f64 = 2.0;

/// Where even the start of a patch of more faces lies on itself and cannot be parted it is refused: Tutte's embedding on a circle costs much there,
/// and leads to a map under the limit one time in five. A wireframe of many short tubes has 174 charts with it, 261 without.
const MOST_FOR_TUTTE: usize = 100;

/// A patch whose faces all lean less than 70° from their mean normal is flattened from its projection.
const MOST_LEANING: f64 = 70.0;

fn bytes_of_start(start: &Option<Positions>) -> usize {
    16 * start.as_ref().map_or(0, Vec::len)
}

/// A chart over the limit by so many times at most may come under it by one cut. See `LATE_DARTS` in `cutting/attempt.rs`.
const NEAR: f64 = 1.25;

/// What came of flattening a patch under a limit.
pub(crate) enum Flattened {
    Flat(Flat),
    /// A little over the limit, and where its vertices came to lie.
    Near(Positions),
    Refused,
}

/// Isometric flattening of a planar or developable patch of genus 0 with a boundary; `None` where
/// there is none without overlap.
pub(crate) fn isometric(patch: &Patch, rungs: &mut Rungs) -> Option<Flat> {
    isometric_of(patch, &RestTriangle::of_mesh(&patch.mesh), rungs)
}

fn isometric_of(patch: &Patch, rest: &[RestTriangle], rungs: &mut Rungs) -> Option<Flat> {
    let mesh = &patch.mesh;
    let sound = |uv: Vec<Point2<f64>>, rung: Rung| {
        if stretch::first_flip(mesh, &uv).is_some() || !stretch::boundary_is_simple(mesh, &uv) {
            return None;
        }
        let l2 = l2(patch, rest, &uv);
        (l2 <= ISOMETRIC).then_some((Flat { uv, l2 }, rung))
    };
    // A wall of a thousand narrow faces, of which a projection cannot tell that they lean, is as developable as one of ten.
    let (flat, rung) = embedding::plane(mesh)
        .and_then(|uv| sound(uv, Rung::Plane))
        .or_else(|| sound(embedding::unfold(mesh, &RestTriangle::needles_of_mesh(mesh))?, Rung::Unfold))?;
    rungs.take(rung);
    Some(flat)
}

/// Flattens a patch of genus 0 with a boundary by embedding and stretch minimisation. The work stops as soon as it is clear
/// that the limit is out of reach.
pub(crate) fn flatten(
    patch: &Patch,
    distances: &LandmarkDistances,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Flattened, Cancelled> {
    let trial = Trial::new(patch, settings, run);
    recover(trial.flatten(distances, Some(settings.stretch_limit), rungs), Flattened::Refused)
}

/// The same whatever the stretch.
pub(crate) fn without_limit(
    patch: &Patch,
    distances: &LandmarkDistances,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Flattened, Cancelled> {
    recover(Trial::new(patch, settings, run).flatten(distances, None, rungs), Flattened::Refused)
}

/// Flattens a patch of genus 0 with a boundary from its projection, if it leans so little from its mean plane that this
/// has no flip and no overlap; `None` if it does not. Where the limit is out of reach another start would not help. Costs
/// neither distances nor an embedding.
pub(crate) fn projected(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Option<Flattened>, Cancelled> {
    let Some(start) = embedding::project(&patch.mesh, MOST_LEANING) else { return Ok(None) };
    if stretch::first_flip(&patch.mesh, &start).is_some() || !stretch::boundary_is_simple(&patch.mesh, &start) {
        return Ok(None);
    }
    match Trial::new(patch, settings, run).free(&start, Some(settings.stretch_limit)) {
        Ok(Free::Simple(flat)) => {
            rungs.take(Rung::Projection);
            Ok(Some(Flattened::Flat(flat)))
        }
        Ok(Free::Over(near)) => Ok(Some(near.map_or(Flattened::Refused, Flattened::Near))),
        Err(StretchError::Cancelled(c)) => Err(c),
        Ok(Free::Overlaps) | Err(_) => Ok(None),
    }
}

/// Flattens a patch that has just been cut open, from where it lay before: the cut is given room. Refused where it opens
/// the wrong way.
pub(crate) fn opened(
    patch: &Patch,
    start: &[Point2<f64>],
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Flattened, Cancelled> {
    let trial = Trial::new(patch, settings, run);
    let flattened = trial.free(start, Some(settings.stretch_limit)).map(|free| match free {
        Free::Simple(flat) => Flattened::Flat(flat),
        Free::Over(Some(uv)) => Flattened::Near(uv),
        Free::Overlaps | Free::Over(None) => Flattened::Refused,
    });
    recover(flattened, Flattened::Refused)
}

/// What came of a start in the plane.
pub(crate) enum Polished {
    Flat(Flat),
    /// The limit is out of reach.
    Refused,
    /// The start has flips or overlap that cannot be cleared: from another the patch may well be under the limit.
    BadStart,
}

/// Flattens a patch of genus 0 with a boundary from a start in the plane near its minimum, whose boundary is all but
/// simple; `rung` is where the start comes from.
pub(crate) fn polish(
    patch: &Patch,
    start: &[Point2<f64>],
    rung: Rung,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Polished, Cancelled> {
    let trial = Trial::new(patch, settings, run);
    trial.isometric_or(rungs, |rungs| trial.polish_or_not(start, settings.stretch_limit, rung, rungs))
}

/// Flattens the union of charts from where their faces are drawn, side by side in the plane: what does not meet is spread
/// over the whole map.
pub(crate) fn sewn(
    patch: &Patch,
    drawn: &[[Point2<f64>; 3]],
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Polished, Cancelled> {
    let trial = Trial::new(patch, settings, run);
    trial.isometric_or(rungs, |rungs| {
        let mut stitcher = match Stitcher::new(&patch.mesh, &trial.steps.rest, drawn) {
            Ok(stitcher) => stitcher,
            Err(StretchError::Cancelled(c)) => return Err(c),
            Err(_) => return Ok(Polished::BadStart),
        };
        // Turned triangles fold less often; but where both do not, those that keep their turn end with less stretch and shorter seams.
        let start = stitcher.stitch();
        let polished = trial.polish_or_not(&start, settings.stretch_limit, Rung::Sewn, rungs)?;
        if !matches!(polished, Polished::BadStart) {
            return Ok(polished);
        }
        match stitcher.stitch_turned() {
            Ok(start) => trial.polish_or_not(&start, settings.stretch_limit, Rung::Sewn, rungs),
            Err(StretchError::Cancelled(c)) => Err(c),
            Err(_) => Ok(Polished::BadStart),
        }
    })
}

/// A patch where it lies; refused where that is not injective or over the limit.
pub(crate) fn lying(patch: &Patch, uv: Positions, settings: &Settings) -> Polished {
    if stretch::first_flip(&patch.mesh, &uv).is_some() || !stretch::boundary_is_simple(&patch.mesh, &uv) {
        return Polished::Refused;
    }
    let judged = judge(patch, &RestTriangle::of_mesh(&patch.mesh), uv, Some(settings.stretch_limit));
    judged.map_or(Polished::Refused, Polished::Flat)
}

/// A part of a chart, where it lies if that is under the limit of single charts, and else minimised by itself. Refused where
/// that is over it, too: a chart's stretch is a mean over its parts.
pub(crate) fn part_of_chart(
    patch: &Patch,
    start: Positions,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Polished, Cancelled> {
    let trial = Trial::new(patch, settings, run);
    // Under a limit over the atlas, too: the parts together are stretched no more than the chart was.
    let limit = settings.chart_limit();
    match trial.judge(start, Some(limit)) {
        Ok(flat) => Ok(Polished::Flat(flat)),
        Err(start) => trial.polish_or_not(&start, limit, Rung::Prolonged, rungs),
    }
}

/// Flattens a chart's patch anew so that its boundary keeps its distance from itself: from Tutte's
/// embedding, under the barrier. `None` where that is over the limit.
pub(crate) fn flatten_apart(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Option<Flat>, Cancelled> {
    let trial = Trial::new(patch, settings, run);
    recover(trial.flatten_apart(Some(settings.stretch_limit), rungs), None)
}

/// What became of a chart whose boundary was free.
enum Free {
    Simple(Flat),
    /// Under the limit, but its boundary runs over itself.
    Overlaps,
    /// Over the limit; its map, if by little.
    Over(Option<Positions>),
}

/// What became of a minimisation.
enum Descended {
    AtRest(Minimised),
    /// It was clear that the limit is out of reach. The map as it was before, or none if nothing was.
    GivenUp(Positions),
}

/// The steps on one patch under a limit: the work stops as soon as that is out of reach.
struct Trial<'a> {
    patch: &'a Patch,
    settings: &'a Settings,
    seed: u64,
    steps: Steps<'a>,
    run: &'a Run<'a>,
}

impl<'a> Trial<'a> {
    fn new(patch: &'a Patch, settings: &'a Settings, run: &'a Run<'a>) -> Self {
        // The same for a patch whatever else the surface holds.
        let seed = settings.seed ^ patch.faces.first().map_or(0, |f| f.index() as u64);
        Self { patch, settings, seed, steps: Steps::new(&patch.mesh, settings, seed, run.progress), run }
    }

    fn flatten(
        &self,
        distances: &LandmarkDistances,
        limit: Option<f64>,
        rungs: &mut Rungs,
    ) -> Result<Flattened, StretchError> {
        if let Some(start) = self.embed(distances)? {
            let told_by_folds = limit.is_some() && self.steps.model() != Model::Paper;
            if told_by_folds && self.folded_share(&start) > MOST_FOLDED {
                return Ok(Flattened::Refused);
            }
            let cleared = match limit {
                // Of 29 trials on a body that Tutte's embedding had to save one came under the limit.
                Some(_) => self.recall_start(Kind::Cleared, &start, || self.steps.clear_flips(&start))?,
                None => Some(self.steps.remove_flips(&start)?),
            };
            let Some((uv, rung)) = cleared else { return Ok(Flattened::Refused) };
            rungs.take(rung);
            if limit.is_some() && stretch::l2_stretch(self.steps.mesh, &self.steps.rest, &uv) > HOPELESS_START {
                return Ok(Flattened::Refused);
            }
            match self.free(&uv, limit)? {
                Free::Simple(flat) => return Ok(Flattened::Flat(flat)),
                Free::Over(near) => return Ok(near.map_or(Flattened::Refused, Flattened::Near)),
                Free::Overlaps if self.steps.boundary_is_simple(&uv) => {
                    return Ok(self.apart(&uv, limit)?.map_or(Flattened::Refused, Flattened::Flat));
                }
                Free::Overlaps => {}
            }
            if limit.is_some() {
                if let Some(flat) = self.parted(&uv, limit)? {
                    return Ok(Flattened::Flat(flat));
                }
                if self.patch.mesh.face_count() > MOST_FOR_TUTTE {
                    return Ok(Flattened::Refused);
                }
            }
        }
        Ok(self.flatten_apart(limit, rungs)?.map_or(Flattened::Refused, Flattened::Flat))
    }

    /// From a start without flips whose boundary runs over itself here and there, parted.
    fn parted(&self, start: &[Point2<f64>], limit: Option<f64>) -> Result<Option<Flat>, StretchError> {
        if stretch::boundary_is_tangled(self.steps.mesh, start) {
            return Ok(None);
        }
        let parted = self.recall_start(Kind::Parted, start, || self.steps.part_boundary(start))?;
        Ok(parted.map(|uv| self.apart(&uv, limit)).transpose()?.flatten())
    }

    /// The isometric map if there is one, which needs no start.
    fn isometric_or(
        &self,
        rungs: &mut Rungs,
        otherwise: impl FnOnce(&mut Rungs) -> Result<Polished, Cancelled>,
    ) -> Result<Polished, Cancelled> {
        match isometric_of(self.patch, &self.steps.rest, rungs) {
            Some(flat) => Ok(Polished::Flat(flat)),
            None => otherwise(rungs),
        }
    }

    /// As [`Trial::polish`]; a patch that defeats a solver has a bad start.
    fn polish_or_not(
        &self,
        start: &[Point2<f64>],
        limit: f64,
        rung: Rung,
        rungs: &mut Rungs,
    ) -> Result<Polished, Cancelled> {
        match self.polish(start, limit, rung, rungs) {
            Ok(polished) => Ok(polished),
            Err(StretchError::Cancelled(c)) => Err(c),
            Err(_) => Ok(Polished::BadStart),
        }
    }

    fn polish(
        &self,
        start: &[Point2<f64>],
        limit: f64,
        rung: Rung,
        rungs: &mut Rungs,
    ) -> Result<Polished, StretchError> {
        let most_folded = if rung == Rung::Sewn { MOST_FOLDED_SEWN } else { MOST_FOLDED_LYING };
        if self.folded_share(start) > most_folded || stretch::boundary_is_tangled(self.steps.mesh, start) {
            return Ok(Polished::BadStart);
        }
        let cleared = self.recall_start(Kind::LocallyCleared, start, || self.steps.clear_locally(start))?;
        let Some(mut uv) = cleared else { return Ok(Polished::BadStart) };
        rungs.take(if uv == start { rung } else { Rung::FoldoverFree });
        if !self.steps.boundary_is_simple(&uv) {
            let parted = self.recall_start(Kind::Parted, &uv, || self.steps.part_boundary(&uv))?;
            let Some(parted) = parted else { return Ok(Polished::BadStart) };
            uv = parted;
        }
        if stretch::l2_stretch(self.steps.mesh, &self.steps.rest, &uv) > HOPELESS_SEWN {
            return Ok(Polished::BadStart);
        }
        if !self.steps.boundary_is_tight(&uv) {
            match self.free(&uv, Some(limit))? {
                Free::Simple(flat) => return Ok(Polished::Flat(flat)),
                Free::Over(_) => return Ok(Polished::Refused),
                Free::Overlaps => {}
            }
        }
        Ok(self.apart(&uv, Some(limit))?.map_or(Polished::Refused, Polished::Flat))
    }

    /// Minimises from a start without flips, its boundary free.
    fn free(&self, start: &[Point2<f64>], limit: Option<f64>) -> Result<Free, StretchError> {
        let best = match self.minimise(start, limit, None)? {
            Descended::AtRest(best) => best,
            Descended::GivenUp(early) => return Ok(Free::Over(self.near(early, limit))),
        };
        let over = |uv| Free::Over(self.near(uv, limit));
        if self.steps.boundary_is_simple(&best.uv) {
            return Ok(self.judge(best.uv, limit).map_or_else(over, Free::Simple));
        }
        Ok(if limit.is_some_and(|limit| best.l2 > limit) { over(best.uv) } else { Free::Overlaps })
    }

    /// Minimises from a start whose boundary is simple, and keeps it so.
    fn apart(&self, start: &[Point2<f64>], limit: Option<f64>) -> Result<Option<Flat>, StretchError> {
        let Descended::AtRest(best) = self.minimise(start, limit, Some(BOUNDARY_REACH))? else { return Ok(None) };
        Ok(if self.steps.boundary_is_simple(&best.uv) { self.judge(best.uv, limit).ok() } else { None })
    }

    fn flatten_apart(&self, limit: Option<f64>, rungs: &mut Rungs) -> Result<Option<Flat>, StretchError> {
        let Some(circle) = self.steps.on_circle()? else { return Ok(None) };
        rungs.take(Rung::TutteCircle);
        self.apart(&circle, limit)
    }

    /// `None` where the distances do not span a plane; Tutte needs none.
    fn embed(&self, distances: &LandmarkDistances) -> Result<Option<Positions>, Cancelled> {
        let input = |f: &mut Fingerprint| {
            f.mesh(self.steps.mesh);
            f.distances(distances);
            f.settings(&(&self.settings.embedding, &self.settings.geodesics, self.settings.together_max, self.seed));
        };
        let embedded = self.run.recall(Kind::Embedding, input, bytes_of_start, || {
            let all = self.steps.distances_of_all()?;
            match self.steps.embed(all.as_ref().unwrap_or(distances)) {
                Ok(embedded) => Ok(Some(embedded.uv)),
                Err(EmbeddingError::Cancelled(c)) => Err(c),
                Err(_) => Ok(None),
            }
        })?;
        Ok((*embedded).clone())
    }

    /// What a step that removes flips or overlap makes of a start; refused ones and those that a solver fails on are kept,
    /// too.
    fn recall_start<T: Clone + Send + Sync + 'static>(
        &self,
        kind: Kind,
        start: &[Point2<f64>],
        step: impl FnOnce() -> Result<Option<T>, StretchError>,
    ) -> Result<Option<T>, StretchError> {
        let input = |f: &mut Fingerprint| {
            f.mesh(self.steps.mesh);
            f.points(start);
        };
        let bytes = |_: &Result<Option<T>, StretchError>| 16 * start.len();
        let known = self.run.recall(kind, input, bytes, || match step() {
            Err(StretchError::Cancelled(c)) => Err(StretchError::Cancelled(c)),
            other => Ok(other),
        })?;
        (*known).clone()
    }

    /// Share of the surface that a map turns over.
    fn folded_share(&self, uv: &[Point2<f64>]) -> f64 {
        let (mesh, rest) = (self.steps.mesh, &self.steps.rest);
        let flipped = |f: &FaceId| distortion::signed_double_area(mesh.triangle(*f).map(|v| uv[v.index()])) <= 0.0;
        let area = |f: FaceId| rest[f.index()].area();
        mesh.faces().filter(flipped).map(area).sum::<f64>() / stretch::surface_area(rest)
    }

    /// A map that is over the limit, if by so little that one cut may do.
    fn near(&self, uv: Positions, limit: Option<f64>) -> Option<Positions> {
        let is_near = |limit: f64| stretch::l2_stretch(self.steps.mesh, &self.steps.rest, &uv) <= NEAR * limit;
        (!uv.is_empty() && limit.is_some_and(is_near)).then_some(uv)
    }

    fn minimise(
        &self,
        start: &[Point2<f64>],
        abandon_above: Option<f64>,
        keep_apart: Option<f64>,
    ) -> Result<Descended, StretchError> {
        let input = |f: &mut Fingerprint| {
            f.mesh(self.steps.mesh);
            f.points(start);
            f.reals(keep_apart);
            f.settings(&(&self.settings.stretch, self.seed));
        };
        let given_up = |best: &Minimised| abandon_above.is_some_and(|limit| limit < best.abandoned_below);
        // One that was given up tells nothing about limits that it would have gone on under.
        let will_do = |best: &Minimised| !best.abandoned || given_up(best);
        let bytes = |best: &Minimised| 16 * (best.uv.len() + best.early.len());
        let minimise = || {
            let mut best = self.steps.minimise(start, abandon_above, keep_apart)?;
            if best.abandoned {
                best.uv = Vec::new();
            }
            Ok::<_, StretchError>(best)
        };
        let best = self.run.recall_if(Kind::Minimum, input, will_do, bytes, minimise)?;
        Ok(if given_up(&best) { Descended::GivenUp(best.early.clone()) } else { Descended::AtRest((*best).clone()) })
    }

    fn judge(&self, uv: Positions, limit: Option<f64>) -> Result<Flat, Positions> {
        judge(self.patch, &self.steps.rest, uv, limit)
    }
}

/// A patch that defeats a solver or has no injective map is refused like one that is too stretched.
fn recover<T>(result: Result<T, StretchError>, refused: T) -> Result<T, Cancelled> {
    match result {
        Err(StretchError::Cancelled(c)) => Err(c),
        other => Ok(other.unwrap_or(refused)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::flat::NEGLIGIBLE;
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::settings::LimitOver;
    use nalgebra::Point3;

    /// The cap of a ball down to a height, and its vertices in the plane by direction and angle from the pole, drawn out along
    /// x.
    fn cap(down_to: f64, drawn_out: f64) -> (Patch, Positions) {
        let ball = test_surfaces::sphere(3);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        let above = |f: &FaceId| ball.triangle_positions(*f).iter().all(|p| p.z > down_to);
        let patch = Patch::of_surface(&ball, &polygon, ball.faces().filter(above).collect());
        let place = |p: &Point3<f64>| {
            let radius = p.z.acos() / p.xy().coords.norm().max(f64::MIN_POSITIVE);
            Point2::new(drawn_out * radius * p.x, radius * p.y)
        };
        let start = patch.mesh.positions().iter().map(place).collect();
        (patch, start)
    }

    fn part(patch: &Patch, start: Positions, settings: &Settings) -> Option<f64> {
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let polished = part_of_chart(patch, start, settings, &mut Rungs::default(), &run).expect("not cancelled");
        let Polished::Flat(flat) = polished else { return None };
        assert_eq!(stretch::first_flip(&patch.mesh, &flat.uv), None);
        Some(flat.l2)
    }

    #[test]
    fn a_part_of_a_chart_keeps_one_limit_as_it_lies_and_minimised() {
        let (patch, start) = cap(-0.1, 3.0);
        let of_chart = Settings { stretch_limit: 1.01, ..Settings::default() };
        let of_atlas = Settings { limit_over: LimitOver::Atlas, ..of_chart.clone() };
        let lying = stretch::l2_of_positions(&patch.mesh, &start, NEGLIGIBLE);
        assert!(lying > of_atlas.chart_limit(), "{lying}: it has to be minimised");
        assert_eq!(part(&patch, start.clone(), &of_chart), None);
        let least = part(&patch, start, &of_atlas).expect("under the limit of single charts");
        assert!(least > of_atlas.stretch_limit && least <= of_atlas.chart_limit(), "{least}");
    }

    #[test]
    fn a_part_of_a_chart_that_is_under_the_limit_stays_where_it_lies() {
        let (patch, start) = cap(0.7, 1.0);
        let settings = Settings::default();
        let lying = stretch::l2_of_positions(&patch.mesh, &start, NEGLIGIBLE);
        assert_eq!(part(&patch, start, &settings), Some(lying));
    }
}
