//! `unwrap_points` and `submit_unwrap_points`: a point cloud in, an atlas of points out.

use ble_unwrap_core::settings::{Function, NEIGHBOURS};
use ble_unwrap_core::{self as core, CloudReport};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::Failure;
use crate::job::Job;
use crate::owned_array::{Array, Reduced};
use crate::report::sums;
use crate::settings;

/// UVs of a point cloud, and what is known about them.
///
/// Attributes
/// ----------
/// uv : Array, (n, 2) float32
///     A UV in [0, 1]² for each point; (0, 0) for points whose position is not finite.
/// chart : Array, (n,) int32
///     The chart of each point, from 0; -1 for points whose position is not finite.
/// report : dict
///     Measures of the result; see ``unwrap_points``.
#[pyclass(frozen, get_all, module = "ble_unwrap_native")]
pub(crate) struct PointAtlas {
    uv: Py<Array>,
    chart: Py<Array>,
    report: Py<PyDict>,
}

#[pymethods]
impl PointAtlas {
    #[new]
    #[pyo3(signature = (uv, chart, report, /))]
    fn new(uv: Py<Array>, chart: Py<Array>, report: Py<PyDict>) -> Self {
        Self { uv, chart, report }
    }

    /// For `pickle` and `copy`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, (Py<Array>, Py<Array>, Py<PyDict>)> {
        let (py, of) = (slf.py(), slf.get());
        (slf.get_type(), (of.uv.clone_ref(py), of.chart.clone_ref(py), of.report.clone_ref(py)))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let report = self.report.bind(py);
        let of = |key| report.get_item(key).map(|value| value.map_or_else(String::new, |value| value.to_string()));
        Ok(format!("PointAtlas(points={}, charts={}, l2={})", of("points")?, of("charts")?, of("l2")?))
    }
}

/// An atlas of the core as one of Python.
fn to_python(py: Python<'_>, atlas: core::PointAtlas) -> PyResult<Py<PyAny>> {
    let uv = Py::new(py, Array::from_f32_rows(atlas.uv))?;
    let chart = Py::new(py, Array::from_i32(atlas.chart))?;
    let report = report_to_dict(py, &atlas.report)?.unbind();
    Ok(Py::new(py, PointAtlas { uv, chart, report })?.into_any())
}

/// Map a point cloud to the plane under a stretch limit: one UV a point, in charts packed into one atlas.
///
/// Parameters
/// ----------
/// positions : (n, 3) float32 or float64
///     Points on one or more surfaces, in any unit and order. Coincident points share their UV.
/// neighbours : int
///     How many nearest points count as the neighbourhood of a point, 4 to 256. More bridge gaps and average noise; fewer
///     keep sheets apart that are close to each other.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// preset : {"default", "paper"}
///     Where settings that are not given come from.
/// stretch_limit : float, above 1
///     Upper bound of the L2 stretch of every chart, as the neighbourhoods tell it. The default is 1.1.
/// coarse : bool
///     Whether large pieces are cut into charts by cells of some tens of points, which is many times faster.
/// seed, landmark_fraction, landmark_min, landmark_max, model, kernel_width, relaxation, max_sweeps, tolerance, update,
/// initial, margin, mip_levels, texture_size, rotation, threads
///     As for ``unwrap``. Landmarks are counted by points, or by cells in large pieces.
///
/// Returns
/// -------
/// PointAtlas
///     ``uv`` (n, 2) float32, ``chart`` (n,) int32 and ``report``, a dict with ``points``, ``unmapped_points``,
///     ``duplicate_points``, ``pieces``, ``charts``, ``specks``, ``l2``, ``l2_chart_scale``, ``l2_worst_chart``,
///     ``worst_chart``, ``charts_over_limit``, ``folded_points``, ``overlaps``, ``packing_efficiency``, ``nodes``,
///     ``landmarks``, ``sweeps``, ``rungs``, ``seconds`` and ``warnings``.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If the array has the wrong type or shape, no point is finite, a setting is unknown or out of range, or charts
///     and stray points cannot keep the margin at the texture size.
/// Cancelled
///     If the job was cancelled.
/// InternalError
///     If the library is at fault.
///
/// Notes
/// -----
/// Guaranteed: every point with finite coordinates has one chart and a UV in [0, 1]²; points of different charts are at
/// least the margin apart; the same result, bit for bit, for any number of threads. A flat piece keeps its shape. Not
/// guaranteed: freedom from folds and overlaps below the distance of neighbours (those found are counted in
/// ``folded_points`` and ``overlaps``), since a cloud does not say what its surface is.
///
/// Distances are measured along the graph of nearest neighbours (paper, section 5). O(n log n).
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, sections 5 and 5.1.
#[pyfunction]
#[pyo3(
    signature = (positions, *, neighbours=None, job=None, **settings),
    text_signature = "(positions, *, neighbours=12, job=None, **settings)"
)]
pub(crate) fn unwrap_points(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    neighbours: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    submit_unwrap_points(py, positions, neighbours, job, settings)?.get().finish(py)
}

/// Start ``unwrap_points`` on a thread of its own and return the job at once.
///
/// Takes what ``unwrap_points`` takes. Poll ``progress()`` and ``is_finished()``, stop it with ``cancel()``, collect the
/// ``PointAtlas`` with ``result()``.
///
/// Returns
/// -------
/// Job
///     The running job: ``job`` if it was given, else a new one.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If the array has the wrong type or shape, or a setting is unknown or out of range. All other errors are raised by
///     ``Job.result``.
#[pyfunction]
#[pyo3(
    signature = (positions, *, neighbours=None, job=None, **settings),
    text_signature = "(positions, *, neighbours=12, job=None, **settings)"
)]
pub(crate) fn submit_unwrap_points<'py>(
    py: Python<'py>,
    positions: &Bound<'py, PyAny>,
    neighbours: Option<&Bound<'py, PyAny>>,
    job: Option<Bound<'py, Job>>,
    settings: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, Job>> {
    let call = settings::from_keywords(settings, Function::UnwrapPoints)?;
    let neighbours = neighbours
        .map_or(Ok(NEIGHBOURS.default), |given| settings::whole(NEIGHBOURS.name, given, NEIGHBOURS.range, ""))?;
    let positions = arrays::real_rows(positions, Argument { name: "positions", shape: "(n, 3)" })?;
    let job = Job::given_or_new(py, job)?;
    let work = move |progress: &_| {
        core::unwrap_points(&positions, neighbours, &call.settings, progress).map_err(Failure::from)
    };
    job.get().start(call.threads, work, to_python)?;
    Ok(job)
}

/// The report as a dictionary. Every field is named; a test finds a new one of the core that is not.
fn report_to_dict<'py>(py: Python<'py>, report: &CloudReport) -> PyResult<Bound<'py, PyDict>> {
    let CloudReport {
        points,
        unmapped_points,
        duplicate_points,
        pieces,
        charts,
        specks,
        l2,
        l2_chart_scale,
        l2_worst_chart,
        worst_chart,
        charts_over_limit,
        folded_points,
        overlaps,
        packing_efficiency,
        nodes,
        landmarks,
        sweeps,
        rungs,
        seconds,
        warnings,
        ..
    } = report;
    let dict = PyDict::new(py);
    dict.set_item("points", points)?;
    dict.set_item("unmapped_points", unmapped_points)?;
    dict.set_item("duplicate_points", duplicate_points)?;
    dict.set_item("pieces", pieces)?;
    dict.set_item("charts", charts)?;
    dict.set_item("specks", specks)?;
    dict.set_item("l2", l2)?;
    dict.set_item("l2_chart_scale", l2_chart_scale)?;
    dict.set_item("l2_worst_chart", l2_worst_chart)?;
    dict.set_item("worst_chart", worst_chart)?;
    dict.set_item("charts_over_limit", charts_over_limit)?;
    dict.set_item("folded_points", folded_points)?;
    dict.set_item("overlaps", overlaps)?;
    dict.set_item("packing_efficiency", packing_efficiency)?;
    dict.set_item("nodes", nodes)?;
    dict.set_item("landmarks", landmarks)?;
    dict.set_item("sweeps", sweeps)?;
    dict.set_item("rungs", sums(py, rungs)?)?;
    dict.set_item("seconds", sums(py, seconds)?)?;
    dict.set_item("warnings", warnings)?;
    Ok(dict)
}
