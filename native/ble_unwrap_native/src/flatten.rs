//! `flatten`: one patch to one chart, step by step.

use ble_unwrap_core::settings::{Choice, Function};
use ble_unwrap_core::standalone::{self, FlattenReport, MapQuality};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};

use crate::errors::Failure;
use crate::job::Job;
use crate::owned_array::{Array, Reduced};
use crate::report;
use crate::settings;
use crate::unwrap::{MeshArrays, Wishes};

/// A patch in the plane, before and after its stretch was minimised.
///
/// Attributes
/// ----------
/// embedded : Array, (n, 2) float64
///     A position for each vertex as the embedding gave it, its longest axis along u and its centroid at 0, in the unit of
///     ``positions``. May have flips. NaN for vertices without faces.
/// uv : Array, (n, 2) float64
///     The same without flips and with the least stretch.
/// report : dict
///     What was done and how good it is; see ``flatten``.
#[pyclass(frozen, get_all, module = "ble_unwrap_native")]
pub(crate) struct Flattening {
    embedded: Py<Array>,
    uv: Py<Array>,
    report: Py<PyDict>,
}

#[pymethods]
impl Flattening {
    #[new]
    #[pyo3(signature = (embedded, uv, report, /))]
    fn new(embedded: Py<Array>, uv: Py<Array>, report: Py<PyDict>) -> Self {
        Self { embedded, uv, report }
    }

    /// For `pickle` and `copy`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, (Py<Array>, Py<Array>, Py<PyDict>)> {
        let (py, of) = (slf.py(), slf.get());
        (slf.get_type(), (of.embedded.clone_ref(py), of.uv.clone_ref(py), of.report.clone_ref(py)))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let report = self.report.bind(py);
        let of = |key| report.get_item(key).map(|value| value.map_or_else(String::new, |value| value.to_string()));
        Ok(format!(
            "Flattening(model={}, vertices={}, flips_before={}, l2_before={}, l2_after={})",
            of("model")?,
            of("vertices")?,
            of("flips_before")?,
            of("l2_before")?,
            of("l2_after")?
        ))
    }
}

/// Flatten one patch as a single chart and show the steps: distances, embedding, flips removed, stretch minimised.
///
/// Parameters
/// ----------
/// positions, corner_vertices, face_offsets, corner_triangles
///     The mesh, as for ``unwrap``: one connected surface of genus 0 with a boundary; holes are allowed.
/// minimise : bool
///     Whether the stretch is minimised, or only flips are removed.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// geodesics, landmark_fraction, landmark_min, landmark_max, together_max
///     As for ``unwrap``, but a ``landmark_fraction`` of 1 embeds all vertices together, whatever the bounds.
/// model, kernel_width, relaxation, max_sweeps, tolerance, update, initial, seed, weld, weld_distance, stretch_solver,
/// stretch_iterations
///     As for ``unwrap``.
/// preset, threads
///     As for ``unwrap``.
///
/// Returns
/// -------
/// Flattening
///     ``embedded`` (n, 2) float64, ``uv`` (n, 2) float64 and ``report``, a dict with ``model``, ``vertices``,
///     ``triangles``, ``landmarks`` (all vertices if they were embedded together), ``sigma``, ``sweeps``, ``converged``,
///     ``log_likelihood`` and its ``trace`` over the sweeps (None and empty for Isomap), ``rung`` (what took the flips away;
///     ``"embedding"`` if there were none), ``stretch_iterations``, ``boundary_is_simple``, ``seconds`` of each step, and, of
///     the map straight after the embedding and of the map returned,
///     ``flips_before``, ``flips_after``: triangles turned over or without area, by an exact test.
///     ``l2_before``, ``l2_after``: L2 stretch at the map's best scale. Singular values do not care for orientation, so a
///     flipped triangle counts as its mirror image; infinite if a triangle has no area, large where folds leave thin ones.
///     ``l_infinity_before``, ``l_infinity_after``: the largest stretch of a triangle in any direction, at equal area.
///     ``distance_correlation_before``, ``distance_correlation_after``: Pearson's correlation of the distances on the
///     surface with those in the plane, over all pairs of a landmark and another vertex.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape, or a setting is unknown or out of range.
/// InvalidMeshError
///     If the arrays do not make a mesh or the mesh is no such patch. The text says why and what to do.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// Guaranteed: no triangle of ``uv`` is flipped; the result is the same, bit for bit, for any number of threads. Where
/// ``boundary_is_simple``, ``uv`` does not overlap itself, either. Not guaranteed: a bound on the stretch, which is
/// ``unwrap``'s. Embedding all n vertices together takes n² memory and time.
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, section 5 and figure 2.
#[pyfunction]
#[pyo3(
    signature = (positions, corner_vertices, face_offsets, *, corner_triangles=None, minimise=None, job=None, **settings),
    text_signature = "(positions, corner_vertices, face_offsets, *, corner_triangles=None, minimise=True, job=None, **settings)"
)]
#[expect(clippy::too_many_arguments, reason = "Python's keywords")]
pub(crate) fn flatten(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    corner_vertices: &Bound<'_, PyAny>,
    face_offsets: &Bound<'_, PyAny>,
    corner_triangles: Option<&Bound<'_, PyAny>>,
    minimise: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Flatten)?;
    let minimise = minimise.map_or(Ok(true), |given| settings::flag("minimise", given))?;
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, Wishes::default())?;
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| standalone::flatten(&mesh.input(), minimise, &call.settings, progress).map_err(Failure::from),
        |py, flat| {
            let report = to_dict(py, &flat.report)?.unbind();
            let matrix = |rows: Vec<[f64; 2]>| {
                let shape = [rows.len(), 2];
                Py::new(py, Array::from_f64_matrix(rows.into_iter().flatten().collect(), shape))
            };
            let (embedded, uv) = (matrix(flat.embedded)?, matrix(flat.uv)?);
            Ok(Py::new(py, Flattening { embedded, uv, report })?.into_any())
        },
    )?;
    job.get().finish(py)
}

/// The report as a dictionary; every field is named, so that a new one in the core is not forgotten here.
fn to_dict<'py>(py: Python<'py>, report: &FlattenReport) -> PyResult<Bound<'py, PyDict>> {
    let FlattenReport {
        model,
        vertices,
        triangles,
        landmarks,
        sigma,
        sweeps,
        converged,
        log_likelihood,
        trace,
        before,
        after,
        rung,
        stretch_iterations,
        boundary_is_simple,
        seconds,
        ..
    } = report;
    let dict = PyDict::new(py);
    dict.set_item("model", model.word())?;
    dict.set_item("vertices", vertices)?;
    dict.set_item("triangles", triangles)?;
    dict.set_item("landmarks", landmarks)?;
    dict.set_item("sigma", sigma)?;
    dict.set_item("sweeps", sweeps)?;
    dict.set_item("converged", converged)?;
    dict.set_item("log_likelihood", log_likelihood)?;
    dict.set_item("trace", trace)?;
    for (when, quality) in [("before", before), ("after", after)] {
        let MapQuality { flips, l2, l_infinity, distance_correlation, .. } = quality;
        dict.set_item(format!("flips_{when}"), flips)?;
        dict.set_item(format!("l2_{when}"), l2)?;
        dict.set_item(format!("l_infinity_{when}"), l_infinity)?;
        dict.set_item(format!("distance_correlation_{when}"), distance_correlation)?;
    }
    dict.set_item("rung", rung)?;
    dict.set_item("stretch_iterations", stretch_iterations)?;
    dict.set_item("boundary_is_simple", PyBool::new(py, *boundary_is_simple))?;
    dict.set_item("seconds", report::sums(py, seconds)?)?;
    Ok(dict)
}
