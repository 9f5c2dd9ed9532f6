//! Charts touched up before they are packed: quads bent in the plane are made convex again, and triangles stretched far more than
//! the others are relaxed.

use std::sync::Arc;

use nalgebra::Point2;
use rayon::prelude::*;

use crate::charts::Chart;
use crate::distortion::{self, RestTriangle};
use crate::flattening::{self, Rung, Rungs};
use crate::mesh::{Quad, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::settings::{LimitOver, Moves, Settings};
use crate::stretch::{self, StretchError};

/// The L2 stretch of a chart may rise by so much for its L-infinity stretch to fall.
const MOST_RISE: f64 = 1e-3;

/// The charts with their quads convex wherever they are so on the surface and that can be had, and, but in the paper's presets,
/// with less L-infinity stretch; all others stay as they are.
pub(super) fn touch_up(
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Progress,
) -> Result<Vec<Chart>, Cancelled> {
    let rise = affordable_rise(&charts, settings);
    let touched: Vec<Result<(Chart, Rungs), Cancelled>> =
        charts.into_par_iter().map(|chart| touched_up(chart, rise, settings, progress)).collect();
    let mut charts = Vec::with_capacity(touched.len());
    for chart in touched {
        let (chart, steps) = chart?;
        rungs.add(&steps);
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

/// A chart under its limit stays under it; of one that is over it no more is asked.
fn touched_up(
    mut chart: Chart,
    rise: f64,
    settings: &Settings,
    progress: &Progress,
) -> Result<(Chart, Rungs), Cancelled> {
    progress.check()?;
    let mesh = Arc::clone(&chart.patch.mesh);
    let quads: Vec<Quad> = Quad::all(&mesh, &chart.patch.polygon).filter(|q| q.is_convex(&mesh)).collect();
    let rest = RestTriangle::of_mesh(&mesh);
    let mut rungs = Rungs::default();
    let first = chart.l2;
    let limit = if first > settings.chart_limit() { f64::INFINITY } else { settings.chart_limit() };
    if !quads.is_empty() {
        let is_allowed = |uv: &[Point2<f64>]| flattening::l2(&chart.patch, &rest, uv) <= limit.min(first + rise);
        let unbent = stretch::unbend(&mesh, &rest, &quads, &chart.uv, &is_allowed, &settings.stretch, progress);
        if let Some(unbent) = or_nothing(unbent)? {
            chart.l2 = flattening::l2(&chart.patch, &rest, &unbent.uv);
            chart.uv = unbent.uv;
            rungs.take(Rung::Unbend);
        }
    }
    if settings.moves == Moves::All {
        let most = limit.min(first + rise).min(chart.l2 + MOST_RISE);
        let is_allowed = |uv: &[Point2<f64>]| flattening::l2(&chart.patch, &rest, uv) <= most;
        let lowered = stretch::lower_peaks(&mesh, &rest, &quads, &chart.uv, &is_allowed, progress);
        if let Some(uv) = or_nothing(lowered)? {
            chart.l2 = flattening::l2(&chart.patch, &rest, &uv);
            chart.uv = uv;
            rungs.take(Rung::Relax);
        }
    }
    Ok((chart, rungs))
}

/// A chart that defeats the solver stays as it is.
fn or_nothing<T>(result: Result<Option<T>, StretchError>) -> Result<Option<T>, Cancelled> {
    match result {
        Ok(found) => Ok(found),
        Err(StretchError::Cancelled(c)) => Err(c),
        Err(_) => Ok(None),
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
