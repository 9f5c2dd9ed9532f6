//! `geodesic_distances`.

use ble_unwrap_core::standalone::surface_distances;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::Failure;
use crate::job::Job;
use crate::owned_array::Array;
use crate::settings::{self, Function};
use crate::unwrap::MeshArrays;

/// Distances along a surface from some vertices to all.
///
/// Parameters
/// ----------
/// positions, corner_vertices, face_offsets, corner_triangles
///     The mesh, as for ``unwrap``.
/// sources : (k,) int32 or int64
///     Vertices to measure from.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// geodesics : {"fast_marching", "dijkstra"}
///     Fast marching across triangles, or shortest paths along edges, which are some 6 % too long.
/// threads : int
///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
///
/// Returns
/// -------
/// Array, (k, n) float32
///     In the unit of ``positions``. Infinite where the surface does not lead: to other components, to vertices without
///     faces. A source is at 0 from itself.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape, a source is no vertex, or a setting is unknown or out of range.
/// InvalidMeshError
///     If indices or offsets do not make a mesh.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// Vertices at one position count as one. Exact on flat surfaces; elsewhere of first order in the edge length. Not
/// guaranteed: symmetry and the triangle inequality beyond that error. Some 0.4 µs a vertex and source.
///
/// Kimmel, Sethian: Computing geodesic paths on manifolds, PNAS 95, 1998.
#[pyfunction]
#[pyo3(signature = (positions, corner_vertices, face_offsets, sources, *, corner_triangles=None, job=None, **settings))]
pub(crate) fn geodesic_distances(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    corner_vertices: &Bound<'_, PyAny>,
    face_offsets: &Bound<'_, PyAny>,
    sources: &Bound<'_, PyAny>,
    corner_triangles: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::GeodesicDistances)?;
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, None)?;
    let sources = arrays::indices(sources, Argument { name: "sources", shape: "(k,)" })?;
    let shape = [sources.len(), mesh.vertex_count()];
    let job = Job::given_or_new(py, job)?;
    let metric = call.settings.geodesics.metric;
    job.get().start(
        call.threads,
        move |progress| surface_distances(&mesh.input(), &sources, metric, progress).map_err(Failure::from),
        move |py, rows| Ok(Py::new(py, Array::from_f32_matrix(rows, shape))?.into_any()),
    )?;
    job.get().finish(py)
}
