//! One connected surface to charts, by way of a coarse mesh where it is large.
//!
//! Where to cut hardly depends on detail: a component of many vertices is collapsed, cut into charts and
//! merged on the coarse mesh, where every trial costs milliseconds; the labels are prolonged, their
//! borders redrawn on the fine mesh, and each part is flattened there once.

use crate::charts::{Chart, Patch};
use crate::mesh::{self, FaceId};
use crate::progress::{Cancelled, Progress};
use crate::segmentation;
use crate::settings::Settings;

use super::charting;
use super::merge::{self, Which};
use super::rungs::Rungs;
use super::tally::Tally;

/// Components of more vertices are charted on a coarse mesh.
const COARSE_ABOVE: usize = 3_000;
/// Vertices of the coarse mesh: this share of the fine ones,
const COARSE_SHARE: f64 = 0.05;
/// and never fewer or more than these. Below, features of the size of a chart's width vanish; above, the trials
/// cost more than the fine flattening.
const COARSE_VERTICES: (usize, usize) = (1_500, 4_000);
/// On the coarse mesh the stretch above 1 must stay under this share of what the limit allows: detail
/// that the collapse removed adds some.
const COARSE_ALLOWANCE: f64 = 0.6;
/// Sides by which a border may move on the fine mesh: about two edges of the coarse one at the usual
/// ratio of one vertex in twenty.
const BAND_RINGS: usize = 10;
/// On the fine mesh only charts that a split there has made are joined again, and only up to so many faces: the
/// others have been tried on the coarse mesh, and a trial costs what flattening them did. On a body with fingers
/// and ears 1,200 instead of 6,000 saves a quarter of the time and costs 5 % more charts.
const FINE_UNION: usize = 1_200;
/// Share of the work on a component that the coarse mesh takes.
const COARSE_WORK: f64 = 0.4;

/// The charts of one component of the surface, by lowest face; faces are named as in `patch.faces`.
pub(super) fn charts(
    patch: &Patch,
    settings: &Settings,
    tally: &Tally<'_>,
    progress: &Progress,
) -> Result<(Vec<Chart>, Rungs), Cancelled> {
    let fine = Whole::new(patch.mesh.clone(), patch.polygon.clone());
    let size = patch.faces.len() as f64;
    let mut rungs = Rungs::default();
    let mut charts = if patch.mesh.vertex_count() > COARSE_ABOVE && settings.coarse {
        let parts = fine.parts_by_coarse_mesh(settings, &mut rungs, progress)?;
        tally.add(size, COARSE_WORK);
        let done = |faces| tally.add(faces, 1.0 - COARSE_WORK);
        fine.charts(parts, Which::AfterSplits { most_faces: FINE_UNION }, settings, &mut rungs, &done, progress)?
    } else {
        let parts = vec![fine.patch.clone()];
        fine.charts(parts, Which::All, settings, &mut rungs, &|faces| tally.add(faces, 1.0), progress)?
    };
    for f in charts.iter_mut().flat_map(|c| &mut c.patch.faces) {
        *f = patch.faces[f.index()];
    }
    Ok((charts, rungs))
}

/// A connected mesh as a patch of itself.
struct Whole {
    patch: Patch,
}

impl Whole {
    fn new(mesh: mesh::TriMesh, polygon: Vec<u32>) -> Self {
        let faces = mesh.faces().collect();
        let vertices = mesh.vertices().collect();
        Self { patch: Patch { mesh, faces, vertices, polygon } }
    }

    /// Charts parts of this mesh and joins them again where they need not be apart.
    fn charts(
        &self,
        parts: Vec<Patch>,
        which: Which,
        settings: &Settings,
        rungs: &mut Rungs,
        done: &(dyn Fn(f64) + Sync),
        progress: &Progress,
    ) -> Result<Vec<Chart>, Cancelled> {
        let charting = charting::chart(parts, settings, done, progress)?;
        rungs.add(&charting.rungs);
        if !settings.merge {
            return Ok(charting.charts);
        }
        let (mesh, polygon) = (&self.patch.mesh, &self.patch.polygon);
        let (charts, steps) = merge::merge(mesh, polygon, charting, which, settings, progress)?;
        rungs.add(&steps);
        Ok(charts)
    }

    /// Parts that flatten under the limit on a coarse mesh, prolonged to this one.
    fn parts_by_coarse_mesh(
        &self,
        settings: &Settings,
        rungs: &mut Rungs,
        progress: &Progress,
    ) -> Result<Vec<Patch>, Cancelled> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
        let wanted = (COARSE_SHARE * self.patch.mesh.vertex_count() as f64) as usize;
        let target = wanted.clamp(COARSE_VERTICES.0, COARSE_VERTICES.1);
        let coarse = mesh::coarsen(&self.patch.mesh, target, progress)?;
        let polygon = (0..coarse.mesh.face_count()).map(|f| FaceId::new(f).index() as u32).collect();
        let whole = Whole::new(coarse.mesh, polygon);
        let mut strict = settings.clone();
        strict.stretch_limit = 1.0 + COARSE_ALLOWANCE * (settings.stretch_limit - 1.0);
        let charts = whole.charts(vec![whole.patch.clone()], Which::All, &strict, rungs, &|_| (), progress)?;
        let mut coarse_label = vec![0; whole.patch.mesh.face_count()];
        for (number, chart) in charts.iter().enumerate() {
            for f in &chart.patch.faces {
                coarse_label[f.index()] = FaceId::new(number).index() as u32;
            }
        }
        let label: Vec<u32> = coarse.face.iter().map(|f| coarse_label[f.index()]).collect();
        let (mesh, polygon) = (&self.patch.mesh, &self.patch.polygon);
        let parts = segmentation::straighten(mesh, polygon, &label, BAND_RINGS, progress)?;
        Ok(self.patch.split(&parts.label, parts.parts))
    }
}
