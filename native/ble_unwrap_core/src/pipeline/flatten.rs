//! One patch to one chart: the fallback ladder from a plane to Tutte.

use nalgebra::Point2;

use crate::charts::{Chart, Patch};
use crate::distortion::{self, RestTriangle};
use crate::embedding::{self, unfold};
use crate::geodesics::LandmarkDistances;
use crate::mesh::measure;
use crate::progress::{Cancelled, Progress};
use crate::settings::Settings;
use crate::stretch::{self, Injective, MinimiseOptions};

use super::rungs::{Rung, Rungs};

/// A chart is refused if one face in a hundred, by area, is stretched by more than this: such a
/// chart blurs visibly somewhere although its L2 is fine (L2 averages).
const MOST_P99_STRETCH: f64 = 4.0;

/// A patch flattened without flips and without overlap.
pub(super) struct Flat {
    pub(super) uv: Vec<Point2<f64>>,
    pub(super) l2: f64,
    /// Under the limit.
    pub(super) good: bool,
}

/// Isometric flattening of a planar or developable patch; `None` where there is none without
/// overlap.
pub(super) fn isometric(patch: &Patch, rungs: &mut Rungs) -> Option<Flat> {
    let mesh = &patch.mesh;
    let rest = RestTriangle::of_mesh(mesh);
    let (uv, rung) = match unfold::plane(mesh) {
        Some(uv) => (uv, Rung::Plane),
        None => (unfold::unfold(mesh, &rest)?, Rung::Unfold),
    };
    if !stretch::all_positive(mesh, &uv) || !stretch::boundary_is_simple(mesh, &uv) {
        return None;
    }
    rungs.take(rung);
    let l2 = stretch::l2_stretch(mesh, &uv);
    Some(Flat { uv, l2, good: true })
}

/// Flattens a patch of genus 0 with a boundary by embedding and stretch minimisation.
///
/// With `must` the result is the best found even above the limit; without it the work stops as soon as
/// the limit is out of reach, and `None` says so.
pub(super) fn flatten(
    patch: &Patch,
    distances: &LandmarkDistances,
    must: bool,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Progress,
) -> Result<Option<Flat>, Cancelled> {
    let mesh = &patch.mesh;
    let rest = RestTriangle::of_mesh(mesh);
    let seed = settings.seed ^ patch.faces.first().map_or(0, |f| f.index() as u64);
    let start = match embedding::embed_chart(distances, &settings.embedding, seed, progress) {
        Ok(e) => {
            let mut uv = e.uv;
            embedding::fix_gauge(mesh, &rest, &mut uv);
            Some(uv)
        }
        Err(embedding::EmbeddingError::Cancelled(c)) => return Err(c),
        // Too few or coincident points: Tutte needs no distances.
        Err(_) => None,
    };
    let options = |keep_boundary_simple| MinimiseOptions {
        abandon_above: (!must).then_some(settings.stretch_limit),
        keep_boundary_simple,
        seed,
    };
    if let Some(start) = &start {
        let (uv, how) = stretch::make_injective(mesh, &rest, start, progress).map_err(cancelled)?;
        rungs.take(match how {
            Injective::AlreadyWas => Rung::Embedding,
            Injective::FoldoverFree => Rung::FoldoverFree,
            Injective::TutteShape => Rung::TutteShape,
            Injective::TutteCircle => Rung::TutteCircle,
        });
        let best = stretch::minimise_stretch(mesh, &rest, &uv, &settings.stretch, &options(false), progress)
            .map_err(cancelled)?;
        if best.abandoned {
            return Ok(None);
        }
        if stretch::boundary_is_simple(mesh, &best.uv) {
            return Ok(judge(patch, best.uv, must, settings));
        }
        if !must && best.l2 > settings.stretch_limit {
            return Ok(None);
        }
    }
    // The free boundary ran over itself: start without overlap and keep it so.
    rungs.take(Rung::TutteCircle);
    let circle = stretch::tutte_circle(mesh, &rest, progress).map_err(cancelled)?;
    let best = stretch::minimise_stretch(mesh, &rest, &circle, &settings.stretch, &options(true), progress)
        .map_err(cancelled)?;
    if best.abandoned {
        return Ok(None);
    }
    if stretch::boundary_is_simple(mesh, &best.uv) {
        return Ok(judge(patch, best.uv, must, settings));
    }
    Ok(if must { judge(patch, circle, must, settings) } else { None })
}

fn judge(patch: &Patch, uv: Vec<Point2<f64>>, must: bool, settings: &Settings) -> Option<Flat> {
    let l2 = stretch::l2_stretch(&patch.mesh, &uv);
    let good = l2 <= settings.stretch_limit && p99_stretch(patch, &uv) <= MOST_P99_STRETCH;
    (must || good).then_some(Flat { uv, l2, good })
}

/// The L2 stretch that 99 % of a chart's area stays under, at the chart's own best scale.
fn p99_stretch(patch: &Patch, uv: &[Point2<f64>]) -> f64 {
    let mesh = &patch.mesh;
    let rest = RestTriangle::of_mesh(mesh);
    let mut faces: Vec<(f64, f64)> = mesh
        .faces()
        .map(|f| {
            let corners = mesh.triangle(f).map(|v| uv[v.index()]);
            let squared = distortion::squared_stretch(&rest[f.index()].jacobian(corners));
            (squared, measure::triangle_area(mesh.triangle_positions(f)))
        })
        .collect();
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = faces.iter().map(|f| f.1).sum();
    let mut below = 0.0;
    for &(squared, area) in &faces {
        below += area;
        if below >= 0.99 * total {
            return squared.sqrt() * scale_to_best(patch, uv);
        }
    }
    1.0
}

/// √(A₂/A₃): stretch is measured with the chart at the area of its surface.
fn scale_to_best(patch: &Patch, uv: &[Point2<f64>]) -> f64 {
    let mesh = &patch.mesh;
    let a2: f64 = mesh
        .faces()
        .map(|f| 0.5 * distortion::signed_double_area(mesh.triangle(f).map(|v| uv[v.index()])).abs())
        .sum();
    let a3 = patch.area();
    if a3 > 0.0 { (a2 / a3).sqrt() } else { 1.0 }
}

impl Flat {
    pub(super) fn into_chart(self, patch: Patch) -> Chart {
        Chart { patch, uv: self.uv, l2: self.l2 }
    }
}

fn cancelled(error: stretch::StretchError) -> Cancelled {
    match error {
        stretch::StretchError::Cancelled(c) => c,
    }
}
