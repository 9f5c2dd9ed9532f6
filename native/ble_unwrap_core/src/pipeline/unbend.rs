//! Quads bent in the plane are made convex again, before charts are packed.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::charts::Chart;
use crate::distortion::{self, RestTriangle};
use crate::mesh::{Quad, VertexId};
use crate::progress::Cancelled;
use crate::settings::{LimitOver, Settings};
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
    let rise = affordable_rise(&charts, settings);
    let mended: Vec<Result<(Chart, bool), Cancelled>> =
        charts.into_par_iter().map(|chart| unbent(chart, rise, settings, progress)).collect();
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

/// By how much the stretch of every chart may rise for a limit over the atlas to hold; without end where there is none.
fn affordable_rise(charts: &[Chart], settings: &Settings) -> f64 {
    if settings.limit_over == LimitOver::Chart {
        return f64::INFINITY;
    }
    let (mut stretch, mut area) = (0.0, 0.0);
    for chart in charts {
        let share = chart.patch.area();
        stretch += share * chart.l2 * chart.l2;
        area += share;
    }
    // The whole's stretch is the root of that mean, which rises by no more than all charts do. NaN, of no area, is none.
    (settings.stretch_limit - (stretch / area).sqrt()).max(0.0)
}

/// A chart, and whether it was bent. A chart under its limit stays under it; of one that is over it no more is asked.
fn unbent(chart: Chart, rise: f64, settings: &Settings, progress: &Run<'_>) -> Result<(Chart, bool), Cancelled> {
    let mesh = &chart.patch.mesh;
    let quads: Vec<Quad> = Quad::all(mesh, &chart.patch.polygon).filter(|q| q.is_convex(mesh)).collect();
    if quads.is_empty() {
        return Ok((chart, false));
    }
    let rest = RestTriangle::of_mesh(mesh);
    let l2 = |uv: &[Point2<f64>]| flatten::l2(&chart.patch, &rest, uv);
    let limit = settings.chart_limit();
    let is_allowed = |uv: &[Point2<f64>]| (chart.l2 > limit || l2(uv) <= limit) && l2(uv) <= chart.l2 + rise;
    match stretch::unbend(mesh, &rest, &quads, &chart.uv, &is_allowed, &settings.stretch, progress) {
        Ok(Some(better)) => {
            let l2 = l2(&better.uv);
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
