//! Surface to charts: flatten a patch, accept the chart or split the patch, until all are charts.

use std::borrow::Cow;
use std::cell::{LazyCell, OnceCell};
use std::collections::HashSet;
use std::sync::Arc;

use crate::charts::{self, Chart, Patch};
use crate::geodesics::LandmarkDistances;
use crate::mesh::{FaceId, Topology, VertexId};
use crate::progress::Cancelled;
use crate::rounds::{self, Outcome};
use crate::segmentation::{self, Segmentation, SpectralAnalysis};
use crate::settings::{Holes, Settings};

use super::flatten::{self, Flattened, Positions};
use super::memo::{Fingerprint, Kind, Run};
use super::polygon;
use super::relief::{self, Relief};
use crate::flattening::{Rung, Rungs};

/// Patches less planar than this are split before any flattening. Far below what the embedding alone would
/// need (a cap of 100° has 0.79): stretch minimisation brings patches of 0.66 under an L2 of 1.1, and on
/// five development models 0.6 gives 13 charts in all where 0.85 gives 16.
const LEAST_PLANARITY: f64 = 0.6;
/// Spectral splits that deep have not helped; halving by breadth-first order always ends.
const MOST_SPECTRAL_SPLITS: u32 = 24;
/// A patch that is split comes apart at its hard edges where parts that unroll have at least this share of its area.
const MOSTLY_UNROLLED: f64 = 0.9;
/// Below this many faces a patch is not worth a cut for its handles: it is split.
const LEAST_FACES_TO_CUT: usize = 8;

/// Of landmarks a trial takes one in so many of the bounds set: it only has to begin near the minimum, and on five
/// development models 24 to 32 gave as many charts as 48 to 64, with a third less time for distances.
const TRIAL_SHARE: usize = 2;

/// Darts of a chart that is flat, but a little over the limit. One to three, and [`flatten`]'s bound on how little that is at
/// 1.25 to 2, gave 3.94 to 3.99 charts over 16 models before darts came first.
const LATE_DARTS: usize = 2;

/// A part takes over the distances of the patch it was split from if so many of the landmarks lie in it.
const LEAST_INHERITED: usize = 16;

/// The charts of a surface and how they came about.
pub(super) struct Charting {
    pub(super) charts: Vec<Chart>,
    /// For each chart, the split that it came out of, if any; the same for both halves of a split in two, and else for no
    /// other.
    pub(super) family: Vec<Option<u32>>,
    pub(super) rungs: Rungs,
    /// The faces, ascending, of patches that are known not to be one chart.
    pub(super) refused: Refused,
}

/// Sets of faces that are known not to be one chart, by their fingerprints.
#[derive(Default)]
pub(super) struct Refused(HashSet<Fingerprint>);

impl Refused {
    pub(super) fn of(keys: impl Iterator<Item = Fingerprint>) -> Self {
        Self(keys.collect())
    }

    pub(super) fn contains(&self, faces: &[FaceId]) -> bool {
        self.0.contains(&Self::key(faces))
    }

    /// For faces in ascending order, as patches have them that were never sewn.
    pub(super) fn key(faces: &[FaceId]) -> Fingerprint {
        let mut key = Fingerprint::new();
        key.indices(faces.iter().map(|f| f.index()));
        key
    }
}

struct Piece {
    patch: Patch,
    splits: u32,
    /// Distances taken over from the patch it was split from.
    inherited: Option<LandmarkDistances>,
}

/// Cuts and flattens patches until every chart is under the limit. Rounds over all open pieces, in
/// parallel; a piece is split into two or more of fewer polygons, so there are at most as many rounds
/// as polygons, and in practice some ten. `done` is told the faces of each chart as it is accepted.
/// Charts come sorted by lowest face.
pub(super) fn chart(
    patches: Vec<Patch>,
    settings: &Settings,
    done: &(dyn Fn(f64) + Sync),
    progress: &Run<'_>,
) -> Result<Charting, Cancelled> {
    let pieces = patches.into_iter().map(|patch| Piece { patch, splits: 0, inherited: None }).collect();
    let rounds = rounds::until_made(
        pieces,
        |p| (std::cmp::Reverse(p.patch.faces.len()), p.patch.faces[0]),
        || (),
        |piece, ()| {
            let mut rungs = Rungs::default();
            let outcome = step(piece, settings, &mut rungs, progress)?;
            let refused = match &outcome {
                Outcome::Made(_) => {
                    done(piece.patch.faces.len() as f64);
                    None
                }
                Outcome::Divided(_) => Some(Refused::key(&piece.patch.faces)),
            };
            Ok((outcome, (rungs, refused)))
        },
    )?;
    let mut rungs = Rungs::default();
    rounds.notes.iter().for_each(|(steps, _)| rungs.add(steps));
    let refused = Refused::of(rounds.notes.into_iter().filter_map(|(_, key)| key));
    let mut made = rounds.made;
    made.sort_by_key(|(c, _)| c.patch.faces[0]);
    let (charts, family) = made.into_iter().unzip();
    Ok(Charting { charts, family, rungs, refused })
}

fn step(
    piece: &Piece,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Outcome<Chart, Piece>, Cancelled> {
    progress.check()?;
    let (patch, splits) = (&piece.patch, piece.splits);
    let attempt = Attempt::new(patch, piece.inherited.as_ref(), settings, progress);
    if patch.is_one_polygon() {
        return Ok(Outcome::Made(attempt.polygon(rungs)?));
    }
    if let Some(chart) = attempt.run(rungs)? {
        return Ok(Outcome::Made(chart));
    }
    let part = |patch| {
        let inherited = attempt.heritage(&patch);
        Piece { patch, splits: splits + 1, inherited }
    };
    Ok(Outcome::Divided(attempt.split(splits, rungs)?.into_iter().map(part).collect()))
}

/// The parts of a patch between its hard edges, if those that unroll have at least a share of its area, and not in the paper's
/// presets.
pub(super) fn hard_parts(patch: &Patch, least_share: f64, settings: &Settings) -> Option<Vec<Patch>> {
    if !settings.wants_darts() {
        return None;
    }
    let parts = segmentation::between_hard_edges(&patch.mesh, &patch.polygon, least_share)?;
    Some(patch.split(&parts.label, parts.parts))
}

/// The parts of a patch that is known not to be one chart, and that is not one polygon.
pub(super) fn split(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Vec<Patch>, Cancelled> {
    Attempt::new(patch, None, settings, progress).split(1, rungs)
}

/// A patch as one chart, cut open where its topology asks for it; `None` where that is over the limit.
pub(super) fn as_one(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Option<Chart>, Cancelled> {
    Attempt::new(patch, None, settings, progress).run(rungs)
}

/// One patch under trial: its topology, and its distances once somebody asks.
struct Attempt<'a> {
    patch: &'a Patch,
    topology: Topology,
    inherited: Option<&'a LandmarkDistances>,
    settings: &'a Settings,
    progress: &'a Run<'a>,
    measured: OnceCell<Arc<(LandmarkDistances, SpectralAnalysis)>>,
}

impl<'a> Attempt<'a> {
    fn new(
        patch: &'a Patch,
        inherited: Option<&'a LandmarkDistances>,
        settings: &'a Settings,
        progress: &'a Run<'a>,
    ) -> Self {
        Self { patch, topology: patch.mesh.topology(), inherited, settings, progress, measured: OnceCell::new() }
    }

    fn analysis(&self) -> Result<&(LandmarkDistances, SpectralAnalysis), Cancelled> {
        if let Some(known) = self.measured.get() {
            return Ok(known);
        }
        let fresh = match self.inherited {
            Some(distances) => Arc::new((distances.clone(), SpectralAnalysis::new(distances)?)),
            None => analyse(self.patch, self.settings, self.progress)?,
        };
        Ok(self.measured.get_or_init(|| fresh))
    }

    /// Parts by spectral segmentation, or halves after that has been tried so often; `splits` is 0 for a component.
    fn split(&self, splits: u32, rungs: &mut Rungs) -> Result<Vec<Patch>, Cancelled> {
        let (patch, progress) = (self.patch, self.progress);
        if let Some(parts) = hard_parts(patch, MOSTLY_UNROLLED, self.settings) {
            rungs.take(Rung::Split);
            return Ok(parts);
        }
        let parts = if splits < MOST_SPECTRAL_SPLITS {
            rungs.take(Rung::Split);
            let (distances, analysis) = self.analysis()?;
            let cuts = &self.settings.segmentation;
            let first = splits == 0;
            let input = |f: &mut Fingerprint| {
                f.mesh(&patch.mesh);
                f.numbers(&patch.polygon);
                f.distances(distances);
                f.indices([usize::from(first)]);
                f.settings(cuts);
            };
            progress.recall(
                Kind::Segments,
                input,
                |s: &Segmentation| 4 * s.label.len(),
                || segmentation::segment(&patch.mesh, &patch.polygon, distances, analysis, first, cuts, progress),
            )?
        } else {
            rungs.take(Rung::Bisect);
            Arc::new(segmentation::bisect(&patch.mesh, &patch.polygon))
        };
        Ok(patch.split(&parts.label, parts.parts))
    }

    /// The distances that a part of this patch takes over, if it has enough of them.
    fn heritage(&self, part: &Patch) -> Option<LandmarkDistances> {
        let (distances, _) = &**self.measured.get()?;
        if !self.settings.coarse || distances.len() < LEAST_INHERITED {
            return None;
        }
        let mut own: Vec<(VertexId, VertexId)> =
            self.patch.vertices.iter().enumerate().map(|(i, v)| (*v, VertexId::new(i))).collect();
        own.sort_unstable();
        let find = |v: &VertexId| own.binary_search_by_key(v, |e| e.0).ok().map(|at| own[at].1);
        let vertices: Option<Vec<VertexId>> = part.vertices.iter().map(find).collect();
        let taken = distances.restricted(&vertices?);
        (taken.len() >= LEAST_INHERITED).then_some(taken)
    }

    /// A chart whatever its stretch, for a patch that cannot be split.
    fn polygon(&self, rungs: &mut Rungs) -> Result<Chart, Cancelled> {
        let flat = match flatten::isometric(self.patch, rungs) {
            Some(flat) => flat,
            None => polygon::flatten(self.patch, &self.analysis()?.0, self.settings, rungs, self.progress)?,
        };
        Ok(flat.into_chart(self.patch.clone()))
    }

    /// As it is if its topology allows, else, or if that does not do, cut open.
    fn run(&self, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        let patch = self.patch;
        let relief = LazyCell::new(|| self.relief(Cow::Borrowed(patch)));
        if self.topology.is_chart() && (self.settings.holes == Holes::Keep || self.topology.loops == 1) {
            if let Some(flat) = flatten::isometric(patch, rungs) {
                return Ok(Some(flat.into_chart(patch.clone())));
            }
            if let Some(chart) = self.net(rungs) {
                return Ok(Some(chart));
            }
            let flattened = match flatten::projected(patch, self.settings, rungs, self.progress)? {
                Some(verdict) => verdict,
                None if relief.as_ref().map_err(|c| *c)?.as_ref().is_some_and(|r| !r.is_promising()) => {
                    Flattened::Refused
                }
                None => {
                    let (distances, analysis) = self.analysis()?;
                    self.flatten(patch, distances, analysis, rungs)?
                }
            };
            let chart = match flattened {
                Flattened::Flat(flat) => return Ok(Some(flat.into_chart(patch.clone()))),
                Flattened::Near(uv) => self.with_darts((*relief).clone()?, uv, rungs)?,
                Flattened::Refused => self.relieved((*relief).clone()?, rungs)?,
            };
            if chart.is_some() {
                return Ok(chart);
            }
        }
        // A few faces are not worth a cut.
        let blob = self.topology.loops == 0 && self.topology.genus() == 0;
        if blob {
            return match self.net(rungs) {
                Some(chart) => Ok(Some(chart)),
                None => self.relieved((*relief).clone()?, rungs),
            };
        }
        if self.topology.is_disk() || patch.faces.len() < LEAST_FACES_TO_CUT {
            return Ok(None);
        }
        let length = |h| patch.mesh.edge_length(h) * patch.mesh.border_cost(h);
        let diagonal = |h| patch.is_diagonal(h);
        if self.topology.genus() > 0 && self.settings.holes == Holes::Keep {
            let open = patch.cut(&charts::cut_open(&patch.mesh, length, diagonal));
            let is_disk = open.mesh.topology().is_disk();
            let chart = self.run_cut(open, rungs)?;
            if chart.is_some() || is_disk {
                return Ok(chart);
            }
        }
        self.run_cut(patch.cut(&charts::cut_to_disk(&patch.mesh, length, diagonal)), rungs)
    }

    fn run_cut(&self, open: Patch, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        rungs.take(Rung::CutOpen);
        if let Some(flat) = flatten::isometric(&open, rungs) {
            return Ok(Some(flat.into_chart(open)));
        }
        let relief = self.relief(Cow::Borrowed(&open))?;
        let is_promising = relief.as_ref().is_none_or(Relief::is_promising);
        let flattened = if is_promising { self.embedded(&open, rungs)? } else { Flattened::Refused };
        match flattened {
            Flattened::Flat(flat) => Ok(Some(flat.into_chart(open))),
            Flattened::Near(uv) => self.with_darts(relief, uv, rungs),
            Flattened::Refused => self.relieved(relief, rungs),
        }
    }

    /// A patch other than the whole, embedded by distances of its own.
    fn embedded(&self, patch: &Patch, rungs: &mut Rungs) -> Result<Flattened, Cancelled> {
        let known = analyse(patch, self.settings, self.progress)?;
        self.flatten(patch, &known.0, &known.1, rungs)
    }

    /// What darts may do for a patch; `None` if none are wanted.
    fn relief<'p>(&'p self, patch: Cow<'p, Patch>) -> Result<Option<Relief<'p>>, Cancelled> {
        if self.settings.wants_darts() {
            Relief::of(patch, self.settings.stretch_limit, self.progress)
        } else {
            Ok(None)
        }
    }

    /// A box or the like, unfolded.
    fn net(&self, rungs: &mut Rungs) -> Option<Chart> {
        let net = if self.settings.wants_darts() { relief::net(self.patch)? } else { return None };
        let flat = flatten::isometric(&net, rungs)?;
        rungs.take(Rung::Dart);
        Some(flat.into_chart(net))
    }

    /// A patch cut by darts where it bulges, before it is flattened.
    fn relieved(&self, relief: Option<Relief<'_>>, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        let Some(open) = relief.map(Relief::relieved).transpose()?.flatten() else { return Ok(None) };
        rungs.take(Rung::CutOpen);
        let flat = match flatten::isometric(&open, rungs) {
            Some(flat) => flat,
            None => match self.embedded(&open, rungs)? {
                Flattened::Flat(flat) => flat,
                Flattened::Near(uv) => return self.with_darts(self.relief(Cow::Owned(open))?, uv, rungs),
                Flattened::Refused => return Ok(None),
            },
        };
        rungs.take(Rung::Dart);
        Ok(Some(flat.into_chart(open)))
    }

    /// A patch that lies in the plane with a little too much stretch, with a dart, and one more if that helps but does not do.
    fn with_darts(
        &self,
        relief: Option<Relief<'_>>,
        mut uv: Positions,
        rungs: &mut Rungs,
    ) -> Result<Option<Chart>, Cancelled> {
        let mut relief = relief;
        for _ in 0..LATE_DARTS {
            let Some((open, start)) = relief.and_then(|r| r.opened(&uv)) else { break };
            match flatten::opened(&open, &start, self.settings, self.progress)? {
                Flattened::Flat(flat) => {
                    rungs.take(Rung::Dart);
                    return Ok(Some(flat.into_chart(open)));
                }
                Flattened::Near(positions) => {
                    uv = positions;
                    relief = self.relief(Cow::Owned(open))?;
                }
                Flattened::Refused => break,
            }
        }
        Ok(None)
    }

    fn flatten(
        &self,
        patch: &Patch,
        distances: &LandmarkDistances,
        analysis: &SpectralAnalysis,
        rungs: &mut Rungs,
    ) -> Result<Flattened, Cancelled> {
        if analysis.planarity < LEAST_PLANARITY {
            return Ok(Flattened::Refused);
        }
        flatten::flatten(patch, distances, self.settings, rungs, self.progress)
    }
}

fn analyse(
    patch: &Patch,
    settings: &Settings,
    progress: &Run<'_>,
) -> Result<Arc<(LandmarkDistances, SpectralAnalysis)>, Cancelled> {
    let mut geodesics = settings.geodesics.clone();
    if settings.coarse {
        geodesics.landmark_min = geodesics.landmark_min.div_ceil(TRIAL_SHARE);
        geodesics.landmark_max = geodesics.landmark_max.div_ceil(TRIAL_SHARE);
    }
    let input = |f: &mut Fingerprint| {
        f.mesh(&patch.mesh);
        f.settings(&geodesics);
    };
    let bytes = |known: &(LandmarkDistances, SpectralAnalysis)| 4 * known.0.len() * known.0.vertex_count();
    progress.recall(Kind::Analysis, input, bytes, || {
        let distances = crate::geodesics::landmark_distances(&patch.mesh, &geodesics, progress)?;
        let analysis = SpectralAnalysis::new(&distances)?;
        Ok((distances, analysis))
    })
}
