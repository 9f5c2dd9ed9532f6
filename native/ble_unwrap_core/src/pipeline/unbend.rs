//! Quads bent in the plane are made convex again, before charts are packed.

use rayon::prelude::*;

use crate::charts::Chart;
use crate::distortion::{self, RestTriangle};
use crate::mesh::{Quad, VertexId};
use crate::progress::Cancelled;
use crate::settings::Settings;
use crate::stretch::{self, StretchError};

use super::flatten;
use super::memo::Run;
use crate::flattening::{Rung, Rungs};

/// The charts with their quads convex wherever they are so on the surface and that can be had; all others stay as they are.
pub(super) fn unbend(
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let mended: Vec<Result<(Chart, bool), Cancelled>> =
        charts.into_par_iter().map(|chart| unbent(chart, settings, progress)).collect();
    let mut charts = Vec::with_capacity(mended.len());
    for chart in mended {
        let (chart, has_changed) = chart?;
        if has_changed {
            rungs.take(Rung::Unbend);
        }
        charts.push(chart);
    }
    Ok(charts)
}

/// A chart, and whether it was bent.
fn unbent(chart: Chart, settings: &Settings, progress: &Run<'_>) -> Result<(Chart, bool), Cancelled> {
    if std::env::var_os("QUADS_OFF").is_some() { return Ok((chart, false)); }
    let mesh = &chart.patch.mesh;
    let quads: Vec<Quad> = Quad::all(mesh, &chart.patch.polygon).filter(|q| q.is_convex(mesh)).collect();
    let rest = RestTriangle::of_mesh(mesh);
    match stretch::unbend(mesh, &rest, quads, &chart.uv, &settings.stretch, progress) {
        Ok(Some(better)) => {
            let l2 = flatten::l2(&chart.patch, &rest, &better.uv);
            if std::env::var_os("QUADS_DEBUG").is_some() {
                eprintln!("unbend {} faces: left {} l2 {} -> {l2}", mesh.face_count(), better.left, chart.l2);
            }
            Ok((Chart { uv: better.uv, l2, ..chart }, true))
        }
        Err(StretchError::Cancelled(c)) => Err(c),
        Ok(None) | Err(_) => Ok((chart, false)),
    }
}

/// The halves that the quads of a chart have by their other diagonal, of those that are convex on the surface and in the
/// plane: rounding is to keep them.
pub(super) fn convex_halves(chart: &Chart) -> Vec<[VertexId; 3]> {
    let mesh = &chart.patch.mesh;
    let is_positive = |t: &[VertexId; 3]| distortion::signed_double_area(t.map(|v| chart.uv[v.index()])) > 0.0;
    Quad::all(mesh, &chart.patch.polygon)
        .map(|quad| (quad, quad.other_halves(mesh)))
        .filter(|(quad, halves)| halves.iter().all(is_positive) && quad.is_convex(mesh))
        .flat_map(|(_, halves)| halves)
        .collect()
}

/// What the user is told of quads that are left bent.
pub(super) fn warning(count: usize) -> String {
    let (quads, are) = if count == 1 { ("quad", "is") } else { ("quads", "are") };
    format!(
        "{count} {quads} that {are} convex on the surface {are} bent in UV: by the other diagonal, which a game engine or a \
         subdivision may take, a triangle there is flipped; triangulate such faces before"
    )
}
