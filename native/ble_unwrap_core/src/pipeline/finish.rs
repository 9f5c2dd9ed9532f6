//! Charts to atlas: scale, pack, round, check, and mend what the checks find.

use std::collections::BTreeSet;

use nalgebra::Point2;

use crate::atlas::Atlas;
use crate::charts::{Chart, Patch};
use crate::clock::Clock;
use crate::distortion;
use crate::error::UnwrapError;
use crate::mesh::{self, FaceId, MeshInput, Surface, measure};
use crate::metrics::{self, LayoutArrays, Measures, Texture};
use crate::packing::{self, PackItem, PackSettings, Packed};
use crate::progress::{Cancelled, Stage};
use crate::report::{Report, counted};
use crate::rounding::{self, Rounding, RoundingError};
use crate::segmentation;
use crate::settings::{ChartScale, LimitOver, Settings};
use crate::verify::{self, Certificate};

use super::memo::Run;
use super::{charting, flatten, polygon, touch_up};
use crate::flattening::{Rung, Rungs};

/// Rounds of packing, checking and mending. Needles that rounding breaks are gone after one; the rest
/// is for charts whose parts break again.
const MOST_ROUNDS: usize = 12;
/// From this round on a faulty chart comes apart into single polygons, which always do.
const LAST_RESORT: usize = 9;
/// Charts that came out too near are packed at least so many texels further apart.
const LEAST_WIDENING: f64 = 1.0 / 16.0;
/// A chart of less area than this times the square of its longest edge is drawn with that.
const LEAST_AREA: f64 = 1e-12;
/// And one without any extent with this. Packing makes it a texel.
const NO_AREA: f64 = 1e-30;
/// The least height, as a share of the whole surface's size, that the triangles of a polygon on a
/// circle are to have: a dozen steps of single precision.
const LEAST_HEIGHT: f64 = 1e-6;
/// And the extent up to which such a polygon may be enlarged for it.
const MOST_EXTENT: f64 = 0.02;
/// Texel densities of charts differ by no more than this from uniform, either way.
const MOST_SCALE: f64 = 2.0;

/// Packs the charts and proves the result.
pub(super) fn finish(
    input: &MeshInput<'_>,
    surface: &Surface,
    mut charts: Vec<Chart>,
    mut rungs: Rungs,
    settings: &Settings,
    mut clock: Clock,
    progress: &Run<'_>,
) -> Result<Atlas, UnwrapError> {
    let arrays = LayoutArrays::new(input, surface);
    let texture = Texture::of(&settings.packing);
    let mut packing = settings.packing.clone();
    let mut round = 0;
    loop {
        charts = touch_up::touch_up(charts, settings, &mut rungs, progress)?;
        clock.lap("touch up");
        progress.enter(Stage::Pack);
        scale(&mut charts, settings);
        let layout = Layout::new(input, surface, &charts, &packing, progress)?;
        clock.lap("pack");
        progress.enter(Stage::Verify);
        let mesh = arrays.uv_mesh(&layout.uv, &layout.face_chart, texture)?;
        let certificate = verify::verify(&mesh, progress)?;
        round += 1;
        match next_step(&certificate, !layout.broken.is_empty(), round) {
            NextStep::End => {
                drop(charts);
                let measures = metrics::measure(&mesh, progress)?;
                clock.lap("verify");
                let mut report = report_of(input, surface, &layout, &measures, settings);
                report.rungs = rungs.taken();
                report.seconds = clock.into_laps();
                let atlas = Atlas::proven(layout.uv, layout.polygon_chart, report, certificate)?;
                progress.enter(Stage::Done);
                return Ok(atlas);
            }
            NextStep::Widen(shortfall) => packing.margin_texels += shortfall,
            NextStep::Mend => {
                let faulty: BTreeSet<usize> =
                    certificate.faulty_charts.iter().filter_map(|&c| usize::try_from(c).ok()).collect();
                let faults = Faults { round, faulty: &faulty, broken: &layout.broken };
                charts = mend(surface, charts, &faults, &mut rungs, settings, progress)?;
            }
        }
        clock.lap("mend");
    }
}

/// What follows from the checks of a layout.
#[derive(Debug, PartialEq)]
enum NextStep {
    /// It is proven, or there is nothing left to try.
    End,
    /// Charts that break a rule are made anew.
    Mend,
    /// Charts are packed so many texels further apart: rounding has moved some towards each other.
    Widen(f64),
}

/// `has_broken` tells whether rounding turned faces over; rounds count from 1.
fn next_step(certificate: &Certificate, has_broken: bool, round: usize) -> NextStep {
    let has_faults = has_broken || !certificate.faulty_charts.is_empty();
    if round >= MOST_ROUNDS || certificate.is_valid() && !has_broken {
        NextStep::End
    } else if has_faults {
        NextStep::Mend
    } else if certificate.is_injective() && certificate.gap_texels < certificate.margin_texels {
        NextStep::Widen(LEAST_WIDENING.max(certificate.margin_texels - certificate.gap_texels))
    } else {
        NextStep::End
    }
}

/// The figures of a layout, and what the user should know of it.
fn report_of(
    input: &MeshInput<'_>,
    surface: &Surface,
    layout: &Layout,
    measures: &Measures,
    settings: &Settings,
) -> Report {
    let mut report = Report::new(measures, settings.chart_limit());
    report.faces = input.face_offsets.len().saturating_sub(1);
    report.unmapped_faces = surface.unmapped.len();
    report.warnings = warnings(surface, layout);
    if measures.faces > measures.unmapped_faces && measures.l2.is_nan() {
        report.warnings.push(
            "the stretch could not be measured: every triangle is thinner than single precision tells from none".into(),
        );
    }
    report.bent_quads = metrics::bent_quads(input, &layout.uv, |face| layout.polygon_chart[face] >= 0).len();
    if report.bent_quads > 0 {
        report.warnings.push(touch_up::warning(report.bent_quads));
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
    report
}

/// Brings each chart to the area of its surface, and to the density that its stretch asks for.
fn scale(charts: &mut [Chart], settings: &Settings) {
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

/// Charts packed and rounded.
struct Layout {
    uv: Vec<[f32; 2]>,
    face_chart: Vec<i32>,
    polygon_chart: Vec<i32>,
    /// Faces (of the surface) that rounding turned over, with their chart.
    broken: Vec<(usize, FaceId)>,
    specks: usize,
}

impl Layout {
    fn new(
        input: &MeshInput<'_>,
        surface: &Surface,
        charts: &[Chart],
        packing: &PackSettings,
        progress: &Run<'_>,
    ) -> Result<Self, UnwrapError> {
        let packed = pack(charts, packing, progress)?;
        let size = packed.size.map(f64::from);
        let rounding = Rounding { texel: size.map(|s| 1.0 / s), diagonal: surface.diagonal };
        let mut layout = Self {
            uv: vec![[0.0; 2]; input.corner_vertices.len()],
            face_chart: vec![-1; surface.mesh.face_count()],
            polygon_chart: vec![-1; input.face_offsets.len().saturating_sub(1)],
            broken: Vec::new(),
            specks: packed.specks,
        };
        for (number, (chart, pose)) in charts.iter().zip(&packed.poses).enumerate() {
            progress.check()?;
            let place = |p: &Point2<f64>| {
                let texel = pose.texel(*p);
                Point2::new(texel.x / size[0], texel.y / size[1])
            };
            let exact: Vec<Point2<f64>> = chart.uv.iter().map(place).collect();
            let halves = touch_up::convex_halves(chart);
            let uv = match rounding::round_to_f32(&chart.patch.mesh, &halves, &exact, &rounding, progress) {
                Ok(rounded) => rounded.uv,
                Err(RoundingError::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(RoundingError::Unmendable(unmendable)) => {
                    let faces = unmendable.faces.iter().map(|f| (number, chart.patch.faces[f.index()]));
                    layout.broken.extend(faces);
                    unmendable.uv
                }
            };
            let label = i32::try_from(number).unwrap_or(i32::MAX);
            for (local, &face) in chart.patch.mesh.faces().zip(&chart.patch.faces) {
                layout.face_chart[face.index()] = label;
                layout.polygon_chart[surface.input_polygon(face)] = label;
                for (vertex, h) in chart.patch.mesh.triangle(local).iter().zip(face.halfedges()) {
                    layout.uv[surface.corner[h.index()] as usize] = uv[vertex.index()];
                }
            }
        }
        for &[corner, with] in &surface.followers {
            layout.uv[corner as usize] = layout.uv[with as usize];
        }
        for &[polygon, with] in &surface.absorbed {
            layout.polygon_chart[polygon as usize] = layout.polygon_chart[with as usize];
        }
        Ok(layout)
    }
}

fn pack(charts: &[Chart], packing: &PackSettings, progress: &Run<'_>) -> Result<Packed, UnwrapError> {
    let index = |v: mesh::VertexId| u32::try_from(v.index()).unwrap_or(u32::MAX);
    let triangles: Vec<Vec<[u32; 3]>> =
        charts.iter().map(|c| c.patch.mesh.triangles().iter().map(|t| t.map(index)).collect()).collect();
    let items: Vec<PackItem<'_>> =
        charts.iter().zip(&triangles).map(|(c, t)| PackItem { points: &c.uv, triangles: t }).collect();
    Ok(packing::pack(&items, packing, progress)?)
}

/// What the checks of one round found.
struct Faults<'a> {
    /// The number of the round, from 1.
    round: usize,
    /// Charts that break a rule.
    faulty: &'a BTreeSet<usize>,
    /// Faces that rounding turned over, with their chart.
    broken: &'a [(usize, FaceId)],
}

/// Polygons with broken faces become charts of their own, thickened if they are already. A chart that
/// overlaps itself after rounding is flattened anew with its boundary held apart, or halved. What is
/// left of a chart is flattened anew.
fn mend(
    surface: &Surface,
    charts: Vec<Chart>,
    faults: &Faults<'_>,
    rungs: &mut Rungs,
    settings: &Settings,
    progress: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let mut separate: Vec<(usize, u32)> =
        faults.broken.iter().map(|&(chart, face)| (chart, surface.polygon[face.index()])).collect();
    separate.sort_unstable();
    separate.dedup();
    let mut kept = Vec::new();
    let mut again = Vec::new();
    for (number, chart) in charts.into_iter().enumerate() {
        let first = separate.partition_point(|s| s.0 < number);
        let mut broken: Vec<u32> = separate[first..].iter().take_while(|s| s.0 == number).map(|s| s.1).collect();
        if broken.is_empty() && !faults.faulty.contains(&number) {
            kept.push(chart);
            continue;
        }
        if chart.patch.is_one_polygon() {
            rungs.take(Rung::Thicken);
            kept.push(polygon::thicken(&chart.patch, faults.round > 2).into_chart(chart.patch));
            continue;
        }
        if broken.is_empty()
            && faults.round == 1
            && let Some(flat) = flatten::flatten_apart(&chart.patch, settings, rungs, progress)?
        {
            kept.push(flat.into_chart(chart.patch));
            continue;
        }
        let patch = Patch::of_surface(&surface.mesh, &surface.polygon, sorted(&chart.patch.faces));
        if faults.round >= LAST_RESORT {
            broken.clone_from(&patch.polygon);
            broken.sort_unstable();
            broken.dedup();
        }
        if broken.is_empty() {
            rungs.take(Rung::Bisect);
            let halves = segmentation::bisect(&patch.mesh, &patch.polygon);
            again.extend(patch.split(&halves.label, halves.parts));
        } else {
            rungs.take(Rung::Separate);
            let own = |p: &u32| broken.binary_search(p).map_or(0, |i| u32::try_from(i + 1).unwrap_or(u32::MAX));
            let label: Vec<u32> = patch.polygon.iter().map(own).collect();
            for part in patch.split(&label, broken.len() + 1).iter().filter(|p| !p.faces.is_empty()) {
                let (component, count) = part.mesh.components();
                again.extend(part.split(&component, count));
            }
        }
    }
    let redone = charting::chart(again, settings, &|_| (), progress)?;
    rungs.add(&redone.rungs);
    kept.extend(redone.charts);
    kept.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok(kept)
}

fn sorted(faces: &[FaceId]) -> Vec<FaceId> {
    let mut faces = faces.to_vec();
    faces.sort_unstable();
    faces
}

fn warnings(surface: &Surface, layout: &Layout) -> Vec<String> {
    let mut list = surface.defects.warnings();
    if layout.specks > 0 {
        let specks = counted(layout.specks, ["chart smaller than a texel was", "charts smaller than a texel were"]);
        list.push(format!("{specks} enlarged to one"));
    }
    let area = measure::total_area(&surface.mesh);
    if surface.mesh.face_count() > 0 && area <= 0.0 {
        list.push("no face has an area".into());
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Defect;

    fn checked(change: impl FnOnce(&mut Certificate)) -> Certificate {
        let mut certificate =
            Certificate { complete: true, gap_texels: 4.0, margin_texels: 4.0, ..Certificate::default() };
        change(&mut certificate);
        certificate
    }

    #[test]
    fn a_proven_layout_is_the_end_and_any_fault_is_mended_first() {
        let proven = checked(|_| ());
        assert_eq!(next_step(&proven, false, 1), NextStep::End);
        assert_eq!(next_step(&proven, true, 1), NextStep::Mend);
        let flipped = checked(|c| {
            c.flipped = Defect { count: 1, first: Some(3) };
            c.faulty_charts = vec![0];
            c.gap_texels = 0.0;
        });
        assert_eq!(next_step(&flipped, false, 1), NextStep::Mend);
        assert_eq!(next_step(&flipped, true, MOST_ROUNDS - 1), NextStep::Mend);
        assert_eq!(next_step(&flipped, true, MOST_ROUNDS), NextStep::End, "with an error that carries the certificate");
    }

    #[test]
    fn charts_too_near_are_packed_further_apart() {
        let near = checked(|c| c.gap_texels = 3.75);
        assert_eq!(next_step(&near, false, 1), NextStep::Widen(0.25));
        let all_but = checked(|c| c.gap_texels = 3.9999);
        assert_eq!(next_step(&all_but, false, 1), NextStep::Widen(LEAST_WIDENING));
        assert_eq!(next_step(&near, false, MOST_ROUNDS), NextStep::End);
    }

    #[test]
    fn what_cannot_be_checked_is_not_tried_for_ever() {
        let endless = checked(|c| c.complete = false);
        assert_eq!(next_step(&endless, false, 1), NextStep::End);
        let unmeasured = checked(|c| c.gap_texels = f64::NAN);
        assert_eq!(next_step(&unmeasured, false, 1), NextStep::End);
    }
}
