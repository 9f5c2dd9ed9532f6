//! A patch with the distances on it, measured once and only if somebody asks for them.

use std::cell::OnceCell;
use std::sync::Arc;

use crate::cache::{Fingerprint, Kind, Run};
use crate::charts::Patch;
use crate::geodesics::LandmarkDistances;
use crate::mesh::VertexId;
use crate::progress::Cancelled;
use crate::segmentation::SpectralAnalysis;
use crate::settings::Settings;

/// Of landmarks a trial takes one in so many of the bounds set: it only has to begin near the minimum, and on five
/// development models 24 to 32 gave as many charts as 48 to 64, with a third less time for distances.
const TRIAL_SHARE: usize = 2;
/// A part takes over the distances of the patch it was split from if at least so many of the landmarks lie in it.
const LEAST_INHERITED: usize = 16;

/// Distances from landmarks, and what they say of the patch.
pub(super) type Analysis = (LandmarkDistances, SpectralAnalysis);

/// A patch and, once they are asked for, its distances.
pub(super) struct Measured<'a> {
    pub(super) patch: &'a Patch,
    /// Distances taken over from the patch that this one was split from.
    inherited: Option<&'a LandmarkDistances>,
    settings: &'a Settings,
    run: &'a Run<'a>,
    known: OnceCell<Arc<Analysis>>,
}

impl<'a> Measured<'a> {
    pub(super) fn new(
        patch: &'a Patch,
        inherited: Option<&'a LandmarkDistances>,
        settings: &'a Settings,
        run: &'a Run<'a>,
    ) -> Self {
        Self { patch, inherited, settings, run, known: OnceCell::new() }
    }

    /// The distances and their spectral analysis.
    pub(super) fn analysis(&self) -> Result<&Analysis, Cancelled> {
        if let Some(known) = self.known.get() {
            return Ok(known);
        }
        let fresh = match self.inherited {
            Some(distances) => Arc::new((distances.clone(), SpectralAnalysis::new(distances)?)),
            None => analyse(self.patch, self.settings, self.run)?,
        };
        Ok(self.known.get_or_init(|| fresh))
    }

    /// The distances that a part of this patch takes over, if any were measured and it has enough of them.
    pub(super) fn inherited_by(&self, part: &Patch) -> Option<LandmarkDistances> {
        let (distances, _) = &**self.known.get()?;
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
}

/// Distances on a patch from landmarks on it, and their spectral analysis.
pub(super) fn analyse(patch: &Patch, settings: &Settings, run: &Run<'_>) -> Result<Arc<Analysis>, Cancelled> {
    let mut geodesics = settings.geodesics.clone();
    if settings.coarse {
        geodesics.landmark_min = geodesics.landmark_min.div_ceil(TRIAL_SHARE);
        geodesics.landmark_max = geodesics.landmark_max.div_ceil(TRIAL_SHARE);
    }
    let input = |f: &mut Fingerprint| {
        f.mesh(&patch.mesh);
        f.settings(&geodesics);
    };
    let bytes = |known: &Analysis| 4 * known.0.len() * known.0.vertex_count();
    run.recall(Kind::Analysis, input, bytes, || {
        let distances = crate::geodesics::landmark_distances(&patch.mesh, &geodesics, run.progress)?;
        let analysis = SpectralAnalysis::new(&distances)?;
        Ok((distances, analysis))
    })
}
