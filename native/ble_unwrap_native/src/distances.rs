//! `geodesic_distances` on meshes and `graph_distances` of clouds.

use ble_unwrap_core::settings::Function;
use ble_unwrap_core::standalone::{CloudDistanceSettings, Connect, cloud_distances, surface_distances};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::{Failure, InvalidArgumentError};
use crate::job::Job;
use crate::owned_array::Array;
use crate::settings;
use crate::unwrap::{MeshArrays, Wishes};

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
///     Fast marching across triangles, or shortest paths along edges, some 5 to 9 % too long.
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
/// Vertices at one position count as one. Exact to rounding on flat surfaces. Elsewhere of first order in the edge length:
/// 0.1 to 0.4 % on average, and up to 3 % at single vertices, of meshes of some thousand vertices against exact polyhedral
/// distances. Not guaranteed: symmetry and the triangle inequality beyond that error. Some 0.4 µs a vertex and source.
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
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, Wishes::default())?;
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

/// Most neighbours a point may have: all others of a large cloud.
const MOST_NEIGHBOURS: usize = 100_000;

/// Distances along the graph of nearest neighbours of points of any dimension.
///
/// Parameters
/// ----------
/// points : (n, p) float32 or float64
///     Points of p coordinates, p at least 1.
/// sources : (k,) int32 or int64, optional
///     Points to measure from; all of them, in order, if not given.
/// neighbours : int
///     Each point is joined to the points at so many nearest other places, at least 1.
/// connect : {"error", "bridge", "separate"}
///     What becomes of a cloud whose neighbours leave it in several pieces: an error that names them and the number of
///     neighbours that would connect them; joining them by the shortest edges; or infinite distances between them.
/// radius : float, optional
///     Distances beyond it are infinite and cost no search; no bound if not given.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// threads : int
///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
///
/// Returns
/// -------
/// Array, (k, n) float64
///     In the unit of ``points``; double, because the sums are exact to rounding and ``embed`` computes in it. With all
///     sources exactly symmetric.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape, a coordinate is not finite, a source is no point, an argument is out of
///     range, or the points are in several pieces and ``connect`` is ``"error"``.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// An estimate of distances on the surface that the points sample: along zigzags, which are 3 % too long on average for
/// random points with 12 neighbours and 0.9 % with 24, however many points, and through space where edges leave the
/// surface. Coincident points count as one place and are at distance 0. Across a bridge everything passes through its two
/// ends. The triangle inequality holds to rounding. The graph takes O(n log n) in few dimensions, a source O(n log n) or what lies
/// within the radius, and a row of 8n bytes.
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, section 5.1; Tenenbaum, de Silva,
/// Langford: A global geometric framework for nonlinear dimensionality reduction, Science 290, 2000.
#[pyfunction]
#[pyo3(
    signature = (points, sources=None, *, neighbours=None, connect=None, radius=None, job=None, **settings),
    text_signature = "(points, sources=None, *, neighbours=12, connect='error', radius=None, job=None, **settings)"
)]
#[expect(clippy::too_many_arguments, reason = "they are Python's keywords")]
pub(crate) fn graph_distances(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    sources: Option<&Bound<'_, PyAny>>,
    neighbours: Option<&Bound<'_, PyAny>>,
    connect: Option<&Bound<'_, PyAny>>,
    radius: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::GraphDistances)?;
    let mut cloud = CloudDistanceSettings::default();
    if let Some(given) = neighbours {
        cloud.neighbours = settings::whole("neighbours", given, [1, MOST_NEIGHBOURS], "")?;
    }
    if let Some(given) = connect {
        let choices = [("error", Connect::Error), ("bridge", Connect::Bridge), ("separate", Connect::Separate)];
        cloud.connect = settings::one_of("connect", &choices, given)?;
    }
    if let Some(given) = radius {
        cloud.radius = settings::positive("radius", given, ", or None for no bound")?;
    }
    let (points, n, p) = arrays::real_matrix(points, Argument { name: "points", shape: "(n, p)" })?;
    if p == 0 {
        let text = format!("points: expected at least 1 coordinate a point, found shape ({n}, 0)");
        return Err(InvalidArgumentError::new_err(text));
    }
    let sources =
        sources.map(|given| arrays::indices(given, Argument { name: "sources", shape: "(k,)" })).transpose()?;
    let shape = [sources.as_ref().map_or(n, Vec::len), n];
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| cloud_distances(&points, p, sources.as_deref(), &cloud, progress).map_err(Failure::from),
        move |py, rows| Ok(Py::new(py, Array::from_f64_matrix(rows, shape))?.into_any()),
    )?;
    job.get().finish(py)
}
