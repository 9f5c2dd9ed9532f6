//! `analyse` and `Analysis`: one mesh, unwrapped again and again.

use std::sync::Arc;

use ble_unwrap_core::settings::Function;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Failure;
use crate::job::Job;
use crate::settings::{self, Call};
use crate::unwrap::{MeshArrays, Wishes, to_python};

/// A mesh made ready to be unwrapped with several settings, one after another.
///
/// What does not depend on the settings that change is computed once: after a first ``unwrap`` another with nothing but
/// another ``stretch_limit`` takes less time. Results are those of the function ``unwrap`` with the same mesh and settings,
/// bit for bit (``seconds`` in the report apart), whatever was asked before. May be used from several threads at once.
/// Holds a copy of the mesh, and of what was computed up to some 1 KiB a face; free it by dropping the last reference.
///
/// Attributes
/// ----------
/// weld : bool
///     Whether vertices at the same position count as one.
/// weld_distance : float or None
///     How near to each other such vertices are.
/// cut_angle : float or None
///     The angle, in degrees, from which on edges are cut.
#[pyclass(frozen, module = "ble_unwrap_native")]
pub(crate) struct Analysis {
    shared: Arc<ble_unwrap_core::Analysis>,
}

#[pymethods]
impl Analysis {
    #[getter]
    fn weld(&self) -> bool {
        self.shared.weld()
    }

    #[getter]
    fn weld_distance(&self) -> Option<f64> {
        self.shared.weld_distance()
    }

    #[getter]
    fn cut_angle(&self) -> Option<f64> {
        self.shared.cut_angle()
    }

    /// Unwrap the mesh: the function ``unwrap`` with its settings, of which ``weld``, ``weld_distance`` and
    /// ``cut_angle`` can only be as in ``analyse``, also where a preset has them.
    ///
    /// Parameters
    /// ----------
    /// job : Job, optional
    ///     A new ``Job``, by which another thread watches or cancels this call.
    /// **settings
    ///     As in the function ``unwrap``.
    ///
    /// Returns
    /// -------
    /// Atlas
    ///     As from the function ``unwrap``.
    ///
    /// Raises
    /// ------
    /// InvalidArgumentError
    ///     If a setting is unknown, out of range or contradicts the analysis.
    /// Cancelled
    ///     If the job was cancelled; the analysis stays good.
    #[pyo3(signature = (*, job=None, **settings))]
    fn unwrap(
        &self,
        py: Python<'_>,
        job: Option<Bound<'_, Job>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        self.submit_unwrap(py, job, settings)?.get().finish(py)
    }

    /// Start ``unwrap`` on a thread of its own and return the job at once.
    ///
    /// Returns
    /// -------
    /// Job
    ///     The running job: ``job`` if it was given, else a new one.
    #[pyo3(signature = (*, job=None, **settings))]
    fn submit_unwrap<'py>(
        &self,
        py: Python<'py>,
        job: Option<Bound<'py, Job>>,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Job>> {
        let mut call: Call = settings::from_keywords(settings, Function::Unwrap)?;
        let is_given = |name| settings.map_or(Ok(false), |given| given.contains(name));
        if !is_given("weld")? {
            call.settings.weld = self.weld();
        }
        if !is_given("weld_distance")? {
            call.settings.weld_distance = self.weld_distance();
        }
        // A preset that cuts says so as much as one who gives the angle.
        if !is_given("cut_angle")? && call.settings.cut_angle.is_none() {
            call.settings.cut_angle = self.cut_angle();
        }
        let job = Job::given_or_new(py, job)?;
        let shared = Arc::clone(&self.shared);
        let work = move |progress: &_| shared.unwrap(&call.settings, progress).map_err(Failure::from);
        job.get().start(call.threads, work, to_python)?;
        Ok(job)
    }

    fn __repr__(&self) -> String {
        format!("Analysis(faces={}, weld={})", self.shared.face_count(), if self.weld() { "True" } else { "False" })
    }
}

/// Make a mesh ready to be unwrapped several times, such as under several limits.
///
/// Parameters
/// ----------
/// positions, corner_vertices, face_offsets, corner_triangles, seams, guides, seam_weights
///     The mesh, as in ``unwrap``.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// weld : bool
///     Whether vertices at the same position count as one.
/// weld_distance : float, at least 0, or None
///     How near to each other such vertices are, as in ``unwrap``.
/// cut_angle : float above 0, or None
///     The angle between the normals of two faces, in degrees, from which on the edge between them is cut.
/// preset : {"default", "paper", "iso_charts", "lightmap"}
///     Gives the values of those of these settings that are not named.
/// threads : int
///     Threads to work with; 0 for as many as the machine has.
///
/// Returns
/// -------
/// Analysis
///     Its method ``unwrap`` takes the other settings.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape, or a setting is unknown or out of range. The text names it.
/// Cancelled
///     If the job was cancelled.
/// InvalidMeshError
///     If indices or offsets do not make a mesh. The text names the first wrong element.
#[pyfunction]
#[pyo3(signature = (positions, corner_vertices, face_offsets, *, corner_triangles=None, seams=None, guides=None, seam_weights=None, job=None, **settings))]
pub(crate) fn analyse(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    corner_vertices: &Bound<'_, PyAny>,
    face_offsets: &Bound<'_, PyAny>,
    corner_triangles: Option<&Bound<'_, PyAny>>,
    seams: Option<&Bound<'_, PyAny>>,
    guides: Option<&Bound<'_, PyAny>>,
    seam_weights: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Analyse)?;
    let wishes = Wishes { seams, guides, seam_weights };
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, wishes)?;
    let job = Job::given_or_new(py, job)?;
    let work = move |progress: &_| {
        ble_unwrap_core::Analysis::new(&mesh.input(), &call.settings, progress).map_err(Failure::from)
    };
    let deliver = |py: Python<'_>, analysis| Ok(Py::new(py, Analysis { shared: Arc::new(analysis) })?.into_any());
    job.get().start(call.threads, work, deliver)?;
    job.get().finish(py)
}
