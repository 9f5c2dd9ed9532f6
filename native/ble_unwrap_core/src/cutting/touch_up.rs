//! Charts touched up after the search, and again where some had to be made anew: quads bent in the plane are made convex again, triangles stretched far more than
//! the others are relaxed, grids of quads are laid out as rectangles, and sides that are straight on the surface along the axes.

use std::sync::Arc;

use nalgebra::Point2;
use rayon::prelude::*;

use crate::charts::Chart;
use crate::distortion::RestTriangle;
use crate::embedding;
use crate::flattening::{self, Rung, Rungs};
use crate::mesh::Quad;
use crate::progress::{Cancelled, Progress};
use crate::settings::{LimitOver, Moves, Settings};
use crate::stretch::{self, StretchError};

use super::cost::{self, Price};

/// The L2 stretch of a chart may rise by so much for its L-infinity stretch to fall.
const MOST_RISE: f64 = 1e-3;
/// A plane that is so many times as long as wide, and curved, is a ribbon, as a road is; any other keeps its shape.
const RIBBON: f64 = 4.0;

/// The charts with their quads convex wherever they are so on the surface and that can be had, and, but in the paper's presets,
/// with less L-infinity stretch and straight sides, where that is worth it by `price`; all others stay as they are.
pub(crate) fn touch_up(
    charts: Vec<Chart>,
    price: &Price,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Progress,
) -> Result<Vec<Chart>, Cancelled> {
    let rise = affordable_rise(&charts, settings);
    let touched: Vec<Result<(Chart, Rungs), Cancelled>> =
        charts.into_par_iter().map(|chart| touched_up(chart, rise, price, settings, progress)).collect();
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
    // The stretch of all together rises by no more than that of each does. NaN, of no area, is none.
    (settings.stretch_limit - cost::l2_together(charts)).max(0.0)
}

/// A chart under its limit stays under it; of one that is over it no more is asked.
fn touched_up(
    mut chart: Chart,
    rise: f64,
    price: &Price,
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
    if settings.moves == Moves::All && settings.straighten > 0.0 {
        let is_plane = embedding::plane(&mesh).is_some();
        let is_worth = |uv: &[Point2<f64>], gained: f64| {
            let l2 = flattening::l2(&chart.patch, &rest, uv);
            l2 <= limit.min(first + rise) && price.is_worth_straightening(&chart, l2, gained)
        };
        let gained = || mesh.boundary_length() - stretch::aligned_length(&mesh, &chart.uv);
        let laid = stretch::rectangle(&mesh, &chart.patch.polygon)
            .filter(|found| (!is_plane || found.slenderness >= RIBBON) && is_worth(&found.uv, gained()));
        if let Some(found) = laid {
            chart.l2 = flattening::l2(&chart.patch, &rest, &found.uv);
            chart.uv = found.uv;
            rungs.take(Rung::Straighten);
            return Ok((chart, rungs));
        }
        if is_plane {
            return Ok((chart, rungs));
        }
        let (uv, settings) = (&chart.uv, &settings.stretch);
        let straight = stretch::straighten_sides(&mesh, &rest, &quads, uv, &is_worth, settings, progress);
        if let Some(uv) = or_nothing(straight)? {
            chart.l2 = flattening::l2(&chart.patch, &rest, &uv);
            chart.uv = uv;
            rungs.take(Rung::Straighten);
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
