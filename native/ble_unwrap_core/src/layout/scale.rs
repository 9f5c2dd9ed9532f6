//! The size that each chart is drawn at.

use crate::charts::Chart;
use crate::distortion;
use crate::settings::{ChartScale, Settings};

/// A chart of less area than this times the square of its longest edge is drawn with that.
const LEAST_AREA: f64 = 1e-12;
/// A chart without any extent is drawn with this area. Packing makes it a texel.
const NO_AREA: f64 = 1e-30;
/// The least height, as a share of the whole surface's size, that the triangles of a polygon on a
/// circle are to have: a dozen steps of single precision.
const LEAST_HEIGHT: f64 = 1e-6;
/// Such a polygon is not enlarged beyond this share of the whole surface's size.
const MOST_EXTENT: f64 = 0.02;
/// Texel densities of charts differ by no more than this from uniform, either way.
const MOST_SCALE: f64 = 2.0;

/// Brings each chart to the area of its surface, and to the density that its stretch asks for.
pub(super) fn scale(charts: &mut [Chart], settings: &Settings) {
    for chart in charts {
        let mesh = &chart.patch.mesh;
        let corners = |f| mesh.triangle(f).map(|v| chart.uv[v.index()]);
        let flat: f64 = mesh.faces().map(|f| 0.5 * distortion::signed_double_area(corners(f))).sum();
        let longest = mesh.halfedges().map(|h| mesh.edge_length(h)).fold(0.0, f64::max);
        let area = chart.patch.area().max(LEAST_AREA * longest * longest).max(NO_AREA);
        if !(flat > 0.0 && flat.is_finite()) {
            continue;
        }
        let mut factor = (area / flat).sqrt();
        if chart.patch.is_one_polygon() && mesh.face_count() > 1 {
            factor *= enlargement(chart, factor);
        }
        if settings.chart_scale == ChartScale::Stretch {
            factor *= chart.l2.sqrt().clamp(1.0 / MOST_SCALE, MOST_SCALE);
        }
        for p in &mut chart.uv {
            *p *= factor;
        }
    }
}

/// By how much a polygon of many corners must grow for its triangles to survive single precision.
fn enlargement(chart: &Chart, factor: f64) -> f64 {
    let mesh = &chart.patch.mesh;
    let (mut height, mut extent) = (f64::INFINITY, 0.0f64);
    for f in mesh.faces() {
        let [a, b, c] = mesh.triangle(f).map(|v| chart.uv[v.index()]);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        height = height.min(distortion::signed_double_area([a, b, c]) / longest);
        extent = extent.max(longest);
    }
    let wanted = (LEAST_HEIGHT / (factor * height)).min(MOST_EXTENT / (factor * extent));
    if wanted.is_finite() { wanted.max(1.0) } else { 1.0 }
}
