//! What is reported of a layout.

use crate::mesh::{MeshInput, Surface, measure};
use crate::metrics::{self, Measures};
use crate::packing::{self, Shortfall};
use crate::progress::{Cancelled, Progress};
use crate::report::{Report, counted};
use crate::settings::{LimitOver, Settings};

use super::narrow::Narrow;
use super::placed::Placed;
use super::quads;

/// The figures of a layout, and what the user should know of it.
pub(super) fn report_of(
    input: &MeshInput<'_>,
    surface: &Surface,
    layout: &Placed,
    measures: &Measures,
    settings: &Settings,
    progress: &Progress,
) -> Result<Report, Cancelled> {
    let mut report = Report::new(measures, settings.chart_limit());
    report.faces = input.face_offsets.len().saturating_sub(1);
    report.stacked = layout.stack.iter().filter(|&&stack| stack >= 0).count();
    report.stacks = layout.stack.iter().max().map_or(0, |&last| usize::try_from(last + 1).unwrap_or(0));
    report.unmapped_faces = surface.unmapped.len();
    report.texels_per_unit = layout.texels_per_unit;
    report.warnings = warnings(surface, layout);
    if measures.faces > measures.unmapped_faces && measures.l2.is_nan() {
        report.warnings.push(
            "the stretch could not be measured: every triangle is thinner than single precision tells from none".into(),
        );
    }
    report.bent_quads = metrics::bent_quads(input, &layout.uv, |face| layout.polygon_chart[face] >= 0).len();
    if report.bent_quads > 0 {
        report.warnings.push(quads::warning(report.bent_quads));
    }
    if let Some(&(chart, l2)) = report.charts_over_limit.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        report.warnings.push(format!(
            "{} the stretch limit, the worst is chart {chart} with {l2:.3}",
            counted(report.charts_over_limit.len(), ["chart exceeds", "charts exceed"])
        ));
    }
    if settings.limit_over == LimitOver::Atlas {
        report.atlas_limit = Some(settings.stretch_limit);
        if report.l2_chart_scale > settings.stretch_limit {
            let (l2, limit) = (report.l2_chart_scale, settings.stretch_limit);
            report.warnings.push(format!("the atlas has a stretch of {l2:.3}, above the limit of {limit}"));
        }
    }
    let narrow = Narrow::of(input, layout, &settings.packing, progress)?;
    report.warnings.extend(narrow.warning());
    report.narrow_charts = narrow.charts;
    report.snapped_charts = layout.snapped;
    report.margin_texels = settings.packing.margin().min(layout.margin);
    report.warnings.extend(packing::told_of_margin(settings.packing.margin(), layout.margin));
    Ok(report)
}

fn warnings(surface: &Surface, layout: &Placed) -> Vec<String> {
    let mut list = surface.defects.warnings();
    if layout.specks > 0 {
        let specks = counted(layout.specks, ["chart smaller than a texel was", "charts smaller than a texel were"]);
        list.push(format!("{specks} enlarged to one"));
    }
    list.extend(layout.shortfall.iter().map(Shortfall::to_string));
    let area = measure::total_area(&surface.mesh);
    if surface.mesh.face_count() > 0 && area <= 0.0 {
        list.push("no face has an area".into());
    }
    list
}
