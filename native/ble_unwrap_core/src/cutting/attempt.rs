//! One patch as one chart: the attempts that are made at it, the cheapest first.

use std::borrow::Cow;

use crate::cache::Run;
use crate::charts::{self, Chart, Patch};
use crate::flattening::{self, Flattened, Positions, Rung, Rungs};
use crate::geodesics::LandmarkDistances;
use crate::mesh::Topology;
use crate::progress::Cancelled;
use crate::segmentation::{self, SpectralAnalysis};
use crate::settings::{Holes, Moves, Settings, Symmetry};

use super::cost::{self, CutPrice, Price};
use super::measured::{Measured, analyse};
use super::moves::dart::Bulging;
use super::moves::net;

/// Patches less planar than this are split before any flattening. Far below what the embedding alone would
/// need (a cap of 100° has 0.79): stretch minimisation brings patches of 0.66 under an L2 of 1.1, and on
/// five development models 0.6 gives 13 charts in all where 0.85 gives 16.
const LEAST_PLANARITY: f64 = 0.6;
/// Below this many faces a patch is not worth a cut for its handles: it is split.
const LEAST_FACES_TO_CUT: usize = 8;
/// Of a body with more triangles one net is unfolded, which it may be in many ways.
const MOST_FACES_OF_NETS: usize = 2_000;
/// Darts of a chart that is flat, but a little over the limit. One to three, and the bound on how little that is at
/// 1.25 to 2, gave 3.94 to 3.99 charts over 16 models before darts came first.
const LATE_DARTS: usize = 2;

/// A patch as one chart, cut open where its topology asks for it; `None` where that is over the limit.
pub(super) fn as_one(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Option<Chart>, Cancelled> {
    Attempt::new(&Measured::new(patch, None, settings, run), settings, run).run(rungs)
}

/// A patch as one chart from its embedding, without cuts; `None` where that is over the limit.
pub(super) fn embedded(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Option<Chart>, Cancelled> {
    let measured = Measured::new(patch, None, settings, run);
    Ok(match Attempt::new(&measured, settings, run).embedded(patch, rungs)? {
        Flattened::Flat(flat) => Some(flat.into_chart(patch.clone())),
        Flattened::Near(_) | Flattened::Refused => None,
    })
}

/// Whether a patch unrolls as it is, as a net, or cut open along a tube.
pub(super) fn unrolls(patch: &Patch, settings: &Settings, run: &Run<'_>) -> bool {
    let measured = Measured::new(patch, None, settings, run);
    Attempt::new(&measured, settings, run).without_stretch(&mut Rungs::default()).is_some()
}

/// Whether a patch has parts between hard edges and is divided there, not bent as a whole.
pub(super) fn comes_apart(patch: &Patch, settings: &Settings) -> bool {
    !cost::may_bend(settings.stretch_price) && segmentation::between_parts(&patch.mesh).is_some()
}

fn is_sphere(topology: Topology) -> bool {
    topology.loops == 0 && topology.genus() == 0
}

/// Whether a patch of some topology may be a chart as it is.
pub(super) fn may_be_chart(topology: Topology, settings: &Settings) -> bool {
    topology.is_chart() && (settings.holes == Holes::Keep || topology.loops == 1)
}

/// One patch under trial.
pub(super) struct Attempt<'a> {
    measured: &'a Measured<'a>,
    topology: Topology,
    settings: &'a Settings,
    run: &'a Run<'a>,
}

impl<'a> Attempt<'a> {
    pub(super) fn new(measured: &'a Measured<'a>, settings: &'a Settings, run: &'a Run<'a>) -> Self {
        Self { measured, topology: measured.patch.mesh.topology(), settings, run }
    }

    fn patch(&self) -> &'a Patch {
        self.measured.patch
    }

    /// A chart whatever its stretch, for a patch that cannot be split.
    pub(super) fn polygon(&self, rungs: &mut Rungs) -> Result<Chart, Cancelled> {
        let flat = match flattening::isometric(self.patch(), rungs) {
            Some(flat) => flat,
            None => {
                flattening::flatten_polygon(self.patch(), &self.measured.analysis()?.0, self.settings, rungs, self.run)?
            }
        };
        Ok(flat.into_chart(self.patch().clone()))
    }

    /// As it is if its topology allows, else, or if that does not do, cut open.
    pub(super) fn run(&self, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        let patch = self.patch();
        let may_be_chart = may_be_chart(self.topology, self.settings);
        let is_closed = is_sphere(self.topology);
        if let Some(chart) = self.without_stretch(rungs) {
            return Ok(Some(chart));
        }
        if comes_apart(patch, self.settings) {
            return Ok(None);
        }
        if may_be_chart || is_closed {
            let chart = self.flat_or_darted(is_closed, rungs)?;
            if chart.is_some() || is_closed {
                return Ok(chart);
            }
        }
        if self.topology.is_disk() || patch.faces.len() < LEAST_FACES_TO_CUT {
            return Ok(None);
        }
        if self.topology.genus() > 0 && self.settings.holes == Holes::Keep {
            let length = |h| CutPrice::new(self.settings).of(&patch.mesh, h);
            let open = patch.cut(&charts::cut_open(&patch.mesh, length, |h| patch.is_diagonal(h)));
            let is_disk = open.mesh.topology().is_disk();
            let chart = self.run_cut(open, rungs)?;
            if chart.is_some() || is_disk {
                return Ok(chart);
            }
        }
        self.run_cut(self.cut_to_disk(), rungs)
    }

    /// The patch as it is, as a net, or as the wall of a tube, if one of these unrolls.
    fn without_stretch(&self, rungs: &mut Rungs) -> Option<Chart> {
        let patch = self.patch();
        let may_be_chart = may_be_chart(self.topology, self.settings);
        if may_be_chart && let Some(flat) = flattening::isometric(patch, rungs) {
            return Some(flat.into_chart(patch.clone()));
        }
        if !may_be_chart && !is_sphere(self.topology) {
            return None;
        }
        let net = self.net(rungs);
        if net.is_some() || cost::may_bend(self.settings.stretch_price) { net } else { self.unrolled(rungs) }
    }

    /// The patch as it is, from its projection or its embedding, or with darts where it bulges.
    fn flat_or_darted(&self, is_closed: bool, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        let patch = self.patch();
        let projected = if is_closed { None } else { flattening::projected(patch, self.settings, rungs, self.run)? };
        let bulging = match projected {
            Some(Flattened::Flat(_)) => None,
            _ => self.bulging(Cow::Borrowed(patch))?,
        };
        let is_hopeless = is_closed || bulging.as_ref().is_some_and(|bulging| !bulging.is_promising());
        let flattened = match projected {
            Some(flattened) => flattened,
            None if is_hopeless => Flattened::Refused,
            None => {
                let (distances, analysis) = self.measured.analysis()?;
                self.flatten(patch, distances, analysis, rungs)?
            }
        };
        match flattened {
            Flattened::Flat(flat) => Ok(Some(flat.into_chart(patch.clone()))),
            Flattened::Near(uv) => self.with_darts(bulging, uv, rungs),
            Flattened::Refused => self.cut_by_darts(bulging, rungs),
        }
    }

    fn cut_to_disk(&self) -> Patch {
        let patch = self.patch();
        let price = |h| CutPrice::new(self.settings).of(&patch.mesh, h);
        let cuts = charts::cut_to_disk(&patch.mesh, price, |h| patch.is_diagonal(h));
        if self.topology.loops == 2 && self.topology.genus() == 0 && !cost::may_bend(self.settings.stretch_price) {
            // A straight border is worth as much here as anywhere.
            let worth: f64 =
                cuts.iter().map(|&h| price(h) + self.settings.straighten * patch.mesh.edge_length(h)).sum();
            if let Some(line) = charts::straight_cut(&patch.mesh, worth, price, |h| patch.is_diagonal(h)) {
                return patch.cut(&line);
            }
        }
        patch.cut(&cuts)
    }

    /// A thin ring as a straight strip, if its straight borders are worth the stretch.
    pub(super) fn strip(&self, price: &Price, rungs: &mut Rungs) -> Option<Chart> {
        let (mesh, settings) = (&self.patch().mesh, self.settings);
        let is_ring = self.topology.loops == 2 && self.topology.genus() == 0;
        let is_wanted =
            settings.straighten > 0.0 && settings.moves == Moves::All && !cost::may_bend(settings.stretch_price);
        if !is_ring || !is_wanted || !mesh.vertices().all(|v| mesh.is_boundary_vertex(v)) {
            return None;
        }
        let open = self.cut_to_disk();
        let (flat, along) = flattening::strip(self.patch(), &open)?;
        let l2 = flat.l2;
        // Round it would have no stretch: nothing is curved where no vertex lies inside.
        let round = Chart { l2: 1.0, ..flat.into_chart(open) };
        if l2 > settings.stretch_limit || !price.is_worth_straightening(&round, l2, along) {
            return None;
        }
        rungs.take(Rung::CutOpen);
        rungs.take(Rung::Straighten);
        Some(Chart { l2, ..round })
    }

    /// The wall of a tube or the like, which lies flat once it is cut from one hole to the other.
    fn unrolled(&self, rungs: &mut Rungs) -> Option<Chart> {
        if self.topology.loops < 2 {
            return None;
        }
        let open = self.cut_to_disk();
        let flat = flattening::isometric(&open, rungs)?;
        rungs.take(Rung::CutOpen);
        Some(flat.into_chart(open))
    }

    fn run_cut(&self, open: Patch, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        rungs.take(Rung::CutOpen);
        if let Some(flat) = flattening::isometric(&open, rungs) {
            return Ok(Some(flat.into_chart(open)));
        }
        let bulging = self.bulging(Cow::Borrowed(&open))?;
        let is_promising = bulging.as_ref().is_none_or(Bulging::is_promising);
        let flattened = if is_promising { self.embedded(&open, rungs)? } else { Flattened::Refused };
        match flattened {
            Flattened::Flat(flat) => Ok(Some(flat.into_chart(open))),
            Flattened::Near(uv) => self.with_darts(bulging, uv, rungs),
            Flattened::Refused => self.cut_by_darts(bulging, rungs),
        }
    }

    /// A patch embedded by distances of its own.
    fn embedded(&self, patch: &Patch, rungs: &mut Rungs) -> Result<Flattened, Cancelled> {
        let known = analyse(patch, self.settings, self.run)?;
        self.flatten(patch, &known.0, &known.1, rungs)
    }

    /// How a patch bulges, for darts; `None` if none are wanted, or where that cannot be told.
    fn bulging<'p>(&'p self, patch: Cow<'p, Patch>) -> Result<Option<Bulging<'p>>, Cancelled> {
        if self.settings.moves == Moves::All { Bulging::of(patch, self.settings, self.run) } else { Ok(None) }
    }

    /// A box or the like, unfolded: to its own mirror image, where that costs little more.
    fn net(&self, rungs: &mut Rungs) -> Option<Chart> {
        let cheapest = if self.settings.moves == Moves::All { net::net(self.patch())? } else { return None };
        let unfolded = |net: Patch, rungs: &mut Rungs| Some(flattening::isometric(&net, rungs)?.into_chart(net));
        let is_mirrored = |chart: &Chart| net::has_mirrored_outline(&chart.patch.mesh, &chart.uv);
        let mut chart = unfolded(cheapest, rungs)?;
        rungs.take(Rung::Dart);
        let is_wanted = self.settings.symmetry == Symmetry::Auto && self.patch().faces.len() <= MOST_FACES_OF_NETS;
        if is_wanted && !is_mirrored(&chart) {
            let mut others = net::along_edges(self.patch()).filter_map(|net| unfolded(net, &mut Rungs::default()));
            chart = others.find(is_mirrored).unwrap_or(chart);
        }
        Some(chart)
    }

    /// A patch cut by darts where it bulges, before it is flattened.
    fn cut_by_darts(&self, bulging: Option<Bulging<'_>>, rungs: &mut Rungs) -> Result<Option<Chart>, Cancelled> {
        let Some(open) = bulging.map(Bulging::with_enough_darts).transpose()?.flatten() else { return Ok(None) };
        rungs.take(Rung::CutOpen);
        let flat = match flattening::isometric(&open, rungs) {
            Some(flat) => flat,
            None => match self.embedded(&open, rungs)? {
                Flattened::Flat(flat) => flat,
                Flattened::Near(uv) => return self.with_darts(self.bulging(Cow::Owned(open))?, uv, rungs),
                Flattened::Refused => return Ok(None),
            },
        };
        rungs.take(Rung::Dart);
        Ok(Some(flat.into_chart(open)))
    }

    /// A patch that lies in the plane with a little too much stretch, with a dart, and one more if that helps but does not do.
    fn with_darts(
        &self,
        bulging: Option<Bulging<'_>>,
        mut uv: Positions,
        rungs: &mut Rungs,
    ) -> Result<Option<Chart>, Cancelled> {
        let mut bulging = bulging;
        for _ in 0..LATE_DARTS {
            let Some((open, start)) = bulging.and_then(|r| r.opened(&uv)) else { break };
            match flattening::opened(&open, &start, self.settings, self.run)? {
                Flattened::Flat(flat) => {
                    rungs.take(Rung::Dart);
                    return Ok(Some(flat.into_chart(open)));
                }
                Flattened::Near(positions) => {
                    uv = positions;
                    bulging = self.bulging(Cow::Owned(open))?;
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
        flattening::flatten(patch, distances, self.settings, rungs, self.run)
    }
}
