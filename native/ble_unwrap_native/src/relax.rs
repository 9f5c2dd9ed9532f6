//! `relax`.

use ble_unwrap_core::settings::Function;
use ble_unwrap_core::standalone::{RelaxRules, RelaxStart, Relaxed, RelaxedIsland, relax as relax_islands};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{self, Argument};
use crate::errors::Failure;
use crate::job::Job;
use crate::owned_array::{Array, Reduced};
use crate::settings;
use crate::unwrap::{MeshArrays, Wishes};

/// A UV map whose islands were relaxed.
///
/// Attributes
/// ----------
/// uv : Array, (c, 2) float32
///     A UV for each corner. Those of what was not moved are as they were, to the bit.
/// island : Array, (f,) int32
///     The island of each face, numbered by its lowest face; -1 for faces with a UV or a vertex that is not finite.
/// report : dict
///     ``relaxed`` (islands that were moved), ``kept`` (those that had the least stretch already), ``left`` (those that were left as they
///     were for another reason); ``l2_before`` and ``l2_after`` (L2 stretch over what was relaxed or kept, each island at its own scale, weighted by
///     area; NaN where that is nothing); ``islands``, a list of a dict for each island that was to be relaxed: ``island`` (its number), ``face`` (its lowest face), ``faces``
///     and ``pinned`` (how many faces and pinned vertices it has), ``area`` (its share of the surface), ``l2_before``, ``l2_after``, ``iterations``,
///     ``moved`` (a bool), ``left`` (a text that says why it was left as it was, or None) and ``left_at`` (a list of the vertices at which the reason
///     is found, where it is found at single ones).
#[pyclass(frozen, get_all, module = "ble_unwrap_native")]
pub(crate) struct RelaxedMap {
    uv: Py<Array>,
    island: Py<Array>,
    report: Py<PyDict>,
}

#[pymethods]
impl RelaxedMap {
    #[new]
    #[pyo3(signature = (uv, island, report, /))]
    fn new(uv: Py<Array>, island: Py<Array>, report: Py<PyDict>) -> Self {
        Self { uv, island, report }
    }

    /// For `pickle` and `copy`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, (Py<Array>, Py<Array>, Py<PyDict>)> {
        let (py, of) = (slf.py(), slf.get());
        (slf.get_type(), (of.uv.clone_ref(py), of.island.clone_ref(py), of.report.clone_ref(py)))
    }
}

/// Lower the stretch of the islands of a UV map, whoever made it, each from where and how it lies.
///
/// Parameters
/// ----------
/// positions, corner_vertices, face_offsets, corner_triangles
///     The mesh, as for ``unwrap``.
/// uv : (c, 2) float32 or float64
///     A UV for each corner; rounded to float32. Two faces are of one island if they have a vertex in common that has the same UV in both.
/// pinned : (c,) bool, optional
///     Corners that stay where they are, with all that are joined to them.
/// selected : (f,) bool, optional
///     Faces whose islands are relaxed; all, if absent.
/// start : {"as_they_are", "anew"}
///     ``"as_they_are"``: islands are relaxed from how they are. ``"anew"``: each is embedded anew, as ``unwrap`` does it, whatever its shape was;
///     its outline on the surface, and so the seams, stay the same, and it goes back to where it was.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// weld, weld_distance : bool, float or None
///     As for ``unwrap``: which vertices count as one, so that islands hang together there.
/// texture_size : int or two ints
///     Width and height of the texture, of which only the proportions matter here.
/// stretch_iterations : int
///     Most iterations of the minimisation of an island. It is by Newton's method, whatever preset is given.
/// threads : int
///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
///
/// Returns
/// -------
/// RelaxedMap
///     ``uv`` (c, 2) float32, ``island`` (f,) int32 and ``report``.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type, shape or length, or a setting is unknown or out of range.
/// InvalidMeshError
///     If indices or offsets do not make a mesh.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// Guaranteed: corners that were joined are joined afterwards, to the bit, and no others are; pinned corners stay, to the bit. An island that was
/// moved has no triangle turned over and does not overlap itself, and if neither was so before, its L2 stretch is lower. Without pins an
/// island keeps its area, its centroid and its orientation; with one pin, that place instead of its centroid; with several, these alone determine where it lies
/// and how large it is. Islands with flips or overlap are cleared of them first; where that fails, as it may because of pins, an island is left as
/// it was, which is no error but told in the report. Parts of an island that are joined at a vertex only are held there, and their overlaps
/// with each other are seen from 1e-9 of the island on.
///
/// Not guaranteed: that islands keep clear of each other, since their outlines change; nor that a quad stays convex, as long as its triangles are
/// not turned over (``bent_quads`` of ``measure``).
///
/// A few dozen sparse linear systems of 2n unknowns for an island of n vertices.
///
/// Smith, Schaefer: Bijective parameterization with free boundaries, ACM TOG 2015.
#[pyfunction]
#[pyo3(signature = (positions, corner_vertices, face_offsets, uv, *, pinned=None, selected=None, start=None, corner_triangles=None, job=None, **settings),
    text_signature = "(positions, corner_vertices, face_offsets, uv, *, pinned=None, selected=None, start='as_they_are', corner_triangles=None, job=None, **settings)")]
#[expect(clippy::too_many_arguments, reason = "they are the keywords of a Python function")]
pub(crate) fn relax(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    corner_vertices: &Bound<'_, PyAny>,
    face_offsets: &Bound<'_, PyAny>,
    uv: &Bound<'_, PyAny>,
    pinned: Option<&Bound<'_, PyAny>>,
    selected: Option<&Bound<'_, PyAny>>,
    start: Option<&Bound<'_, PyAny>>,
    corner_triangles: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Relax)?;
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, Wishes::default())?;
    let uv = arrays::single_rows(uv, Argument { name: "uv", shape: "(c, 2)" })?;
    let pinned = pinned.map(|given| arrays::flags(given, Argument { name: "pinned", shape: "(c,)" })).transpose()?;
    let selected =
        selected.map(|given| arrays::flags(given, Argument { name: "selected", shape: "(f,)" })).transpose()?;
    let starts = [("as_they_are", RelaxStart::AsTheyAre), ("anew", RelaxStart::Anew)];
    let start = start.map(|given| settings::one_of("start", &starts, given)).transpose()?.unwrap_or_default();
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| {
            let rules = RelaxRules { pinned: pinned.as_deref(), selected: selected.as_deref(), start };
            relax_islands(&mesh.input(), &uv, &rules, &call.settings, progress).map_err(Failure::from)
        },
        move |py, relaxed| {
            let report = report(py, &relaxed)?.unbind();
            let uv = Py::new(py, Array::from_f32_rows(relaxed.uv))?;
            let island = Py::new(py, Array::from_i32(relaxed.island))?;
            Ok(Py::new(py, RelaxedMap { uv, island, report })?.into_any())
        },
    )?;
    job.get().finish(py)
}

fn report<'py>(py: Python<'py>, relaxed: &Relaxed) -> PyResult<Bound<'py, PyDict>> {
    let islands = PyList::empty(py);
    for (number, island) in &relaxed.islands {
        let RelaxedIsland { face, faces, pinned, area, l2_before, l2_after, iterations, moved, left, .. } = *island;
        let row = PyDict::new(py);
        row.set_item("island", number)?;
        row.set_item("face", face)?;
        row.set_item("faces", faces)?;
        row.set_item("pinned", pinned)?;
        row.set_item("area", area)?;
        row.set_item("l2_before", l2_before)?;
        row.set_item("l2_after", l2_after)?;
        row.set_item("iterations", iterations)?;
        row.set_item("moved", moved)?;
        row.set_item("left", left.map(|reason| reason.to_string()))?;
        row.set_item("left_at", left.map(|reason| reason.vertices()).unwrap_or_default())?;
        islands.append(row)?;
    }
    let count = |moved: bool, left: bool| {
        relaxed.islands.iter().filter(|(_, island)| (island.moved, island.left.is_some()) == (moved, left)).count()
    };
    let report = PyDict::new(py);
    report.set_item("relaxed", count(true, false))?;
    report.set_item("kept", count(false, false))?;
    report.set_item("left", count(false, true))?;
    report.set_item("l2_before", relaxed.l2_before)?;
    report.set_item("l2_after", relaxed.l2_after)?;
    report.set_item("islands", islands)?;
    Ok(report)
}
