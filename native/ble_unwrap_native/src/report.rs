//! Reports and measures as dictionaries. Every field is named; a test finds a new one of the core that is not.

use ble_unwrap_core::standalone::LayoutMeasures;
use ble_unwrap_core::{Certificate, Report};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::owned_array::Array;

/// The report of an unwrap.
pub(crate) fn to_dict<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let Report {
        charts,
        stacked,
        stacks,
        faces,
        unmapped_faces,
        l2,
        l2_chart_scale,
        l2_worst_chart,
        worst_chart,
        l_infinity,
        angle_distortion,
        area_distortion,
        flips,
        bent_quads,
        overlaps,
        seam_length,
        seam_length_absolute,
        packing_efficiency,
        tiles,
        texels_per_unit,
        gap_texels,
        margin_texels,
        seconds,
        rungs,
        chart_limit,
        atlas_limit,
        charts_over_limit,
        snapped_charts,
        narrow_charts,
        warnings,
        ..
    } = report;
    let dict = PyDict::new(py);
    dict.set_item("charts", charts)?;
    dict.set_item("stacked", stacked)?;
    dict.set_item("stacks", stacks)?;
    dict.set_item("faces", faces)?;
    dict.set_item("unmapped_faces", unmapped_faces)?;
    dict.set_item("l2", l2)?;
    dict.set_item("l2_chart_scale", l2_chart_scale)?;
    dict.set_item("l2_worst_chart", l2_worst_chart)?;
    dict.set_item("worst_chart", worst_chart)?;
    dict.set_item("l_infinity", l_infinity)?;
    dict.set_item("angle_distortion", angle_distortion)?;
    dict.set_item("area_distortion", area_distortion)?;
    dict.set_item("flips", flips)?;
    dict.set_item("bent_quads", bent_quads)?;
    dict.set_item("overlaps", overlaps)?;
    dict.set_item("seam_length", seam_length)?;
    dict.set_item("seam_length_absolute", seam_length_absolute)?;
    dict.set_item("packing_efficiency", packing_efficiency)?;
    dict.set_item("tiles", tiles)?;
    dict.set_item("texels_per_unit", texels_per_unit)?;
    dict.set_item("gap_texels", gap_texels)?;
    dict.set_item("margin_texels", margin_texels)?;
    dict.set_item("seconds", sums(py, seconds)?)?;
    dict.set_item("rungs", sums(py, rungs)?)?;
    dict.set_item("chart_limit", chart_limit)?;
    dict.set_item("atlas_limit", atlas_limit)?;
    dict.set_item("charts_over_limit", charts_over_limit)?;
    dict.set_item("snapped_charts", snapped_charts)?;
    dict.set_item("narrow_charts", narrow_charts)?;
    dict.set_item("warnings", warnings)?;
    Ok(dict)
}

/// The outcome of the exact checks: whether all hold, how many elements break each, and the gap and the margin.
pub(crate) fn certificate_to_dict<'py>(py: Python<'py>, certificate: &Certificate) -> PyResult<Bound<'py, PyDict>> {
    let Certificate {
        charts,
        unmapped,
        out_of_range,
        flipped,
        crossings_inside,
        crossings_between,
        nested,
        bad_loops,
        stacked,
        apart,
        faulty_charts,
        gap_texels,
        margin_texels,
        complete,
        ..
    } = certificate;
    let dict = PyDict::new(py);
    dict.set_item("valid", certificate.is_valid())?;
    dict.set_item("charts", charts)?;
    dict.set_item("unmapped_triangles", unmapped.count)?;
    dict.set_item("out_of_range", out_of_range.count)?;
    dict.set_item("flipped", flipped.count)?;
    dict.set_item("crossings_inside", crossings_inside.count)?;
    dict.set_item("crossings_between", crossings_between.count)?;
    dict.set_item("nested", nested.count)?;
    dict.set_item("bad_loops", bad_loops.count)?;
    dict.set_item("stacked", stacked)?;
    dict.set_item("apart", apart.count)?;
    dict.set_item("faulty_charts", faulty_charts)?;
    dict.set_item("gap_texels", gap_texels)?;
    dict.set_item("margin_texels", margin_texels)?;
    dict.set_item("complete", complete)?;
    Ok(dict)
}

/// The measures of a layout, with the keys of a report and some of their own.
pub(crate) fn measures_to_dict(
    py: Python<'_>,
    layout: LayoutMeasures,
    with_faces: bool,
) -> PyResult<Bound<'_, PyDict>> {
    let LayoutMeasures { faces, unmapped_faces, bent_quads, measures, by_face, .. } = layout;
    let dict = PyDict::new(py);
    dict.set_item("charts", measures.charts)?;
    dict.set_item("islands", measures.islands)?;
    dict.set_item("faces", faces)?;
    dict.set_item("unmapped_faces", unmapped_faces)?;
    dict.set_item("triangles", measures.faces)?;
    dict.set_item("degenerate_triangles", measures.degenerate_faces)?;
    dict.set_item("uv_degenerate_triangles", measures.uv_degenerate_faces)?;
    dict.set_item("l2", measures.l2)?;
    dict.set_item("l2_chart_scale", measures.l2_chart_scale)?;
    dict.set_item("l2_worst_chart", measures.l2_worst_chart)?;
    dict.set_item("l_infinity", measures.l_infinity)?;
    dict.set_item("angle_distortion", measures.angle_distortion)?;
    dict.set_item("area_distortion", measures.area_distortion)?;
    dict.set_item("flips", measures.flips)?;
    dict.set_item("bent_quads", bent_quads)?;
    dict.set_item("overlaps", measures.overlaps)?;
    dict.set_item("overlaps_between", measures.overlaps_between)?;
    dict.set_item("overlaps_complete", measures.overlaps_complete)?;
    dict.set_item("seam_length", measures.seam_length)?;
    dict.set_item("seam_length_absolute", measures.seam_length_absolute)?;
    dict.set_item("packing_efficiency", measures.packing_efficiency)?;
    dict.set_item("tiles", measures.tiles)?;
    dict.set_item("gap_texels", measures.gap_texels)?;
    dict.set_item("gap_complete", measures.gap_complete)?;
    dict.set_item("uv_box", measures.uv_box)?;
    dict.set_item("chart_l2", measures.per_chart.iter().map(|chart| chart.l2).collect::<Vec<_>>())?;
    if with_faces {
        let numbers = |faces: Vec<usize>| Array::from_i32(faces.into_iter().map(|face| face as i32).collect());
        dict.set_item("face_chart", Py::new(py, Array::from_i32(by_face.chart))?)?;
        dict.set_item("flipped_faces", Py::new(py, numbers(by_face.flipped))?)?;
        dict.set_item("overlapping_faces", Py::new(py, numbers(by_face.overlapping))?)?;
        dict.set_item("collapsed_faces", Py::new(py, numbers(by_face.collapsed))?)?;
    }
    Ok(dict)
}

/// A dictionary of named numbers, those of one name added up.
pub(crate) fn sums<'py, T>(py: Python<'py>, pairs: &[(&'static str, T)]) -> PyResult<Bound<'py, PyDict>>
where
    T: Copy + std::ops::Add<Output = T> + IntoPyObject<'py>,
{
    let dict = PyDict::new(py);
    for (at, &(name, first)) in pairs.iter().enumerate() {
        if pairs[..at].iter().all(|&(earlier, _)| earlier != name) {
            let rest = pairs[at + 1..].iter().filter(|pair| pair.0 == name);
            dict.set_item(name, rest.fold(first, |sum, pair| sum + pair.1))?;
        }
    }
    Ok(dict)
}
