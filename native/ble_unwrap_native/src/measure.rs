//! `measure`.

use ble_unwrap_core::settings::Function;
use ble_unwrap_core::standalone::measure_layout;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::Failure;
use crate::job::Job;
use crate::report;
use crate::settings;
use crate::unwrap::{MeshArrays, Wishes};

/// Measure the quality of a UV map, whoever made it.
///
/// Parameters
/// ----------
/// positions, corner_vertices, face_offsets, corner_triangles
///     The mesh, as for ``unwrap``.
/// uv : (c, 2) float32 or float64
///     A UV for each corner; rounded to float32.
/// chart : (f,) int32 or int64, optional
///     Negative for faces without UVs. Charts themselves are found from the UVs; with ``stacks``, faces of one chart
///     belong together.
/// stacks : (k,) int32 or int64, optional
///     For each chart of ``chart``, which is needed then, a number that charts share which lie on each other on
///     purpose; negative for those that lie alone. ``Atlas.stack`` is one. What is meant so is no overlap, needs no
///     margin, and covers the place of one chart.
/// by_face : bool
///     Whether to say, too, which faces the numbers are from: ``face_chart`` (f,) int32, -1 without UVs; ``flipped_faces``, ``overlapping_faces``
///     and ``collapsed_faces`` (of which a triangle is degenerate in UV), int32 numbers of faces, ascending.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// weld, weld_distance : bool, float or None
///     As for ``unwrap``: which vertices count as one. Without ``weld`` an edge between two vertices of the mesh is no seam.
/// texture_size : int or two ints
///     Width and height of the texture in texels.
/// tiles : int
///     Number of tiles, each of that size, that charts may lie in; ``packing_efficiency`` is over those in which some do.
/// margin : float
///     Distance of charts, in texels, at least up to half of which gaps are searched for.
/// mip_levels : int
///     Mip levels that raise the margin, as in ``unwrap``.
/// threads : int
///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
///
/// Returns
/// -------
/// dict
///     ``charts`` (joined over UV edges), ``islands`` (joined over UV vertices), ``faces``, ``unmapped_faces``,
///     ``triangles``, ``degenerate_triangles``, ``uv_degenerate_triangles``;
///     L2 stretch: ``l2`` at the layout's best scale, ``l2_chart_scale`` with each chart at its own, ``l2_worst_chart``,
///     ``chart_l2`` (a list); ``l_infinity``, ``angle_distortion``, ``area_distortion`` (all 1 at best);
///     ``flips`` (triangles), ``bent_quads`` (convex on the surface and not in UV), ``overlaps`` and ``overlaps_between`` islands (pairs of triangles; lower bounds unless
///     ``overlaps_complete``); ``seam_length`` over the root of the area and ``seam_length_absolute``;
///     ``packing_efficiency``, ``tiles`` (in which there are charts; 0 if one reaches beyond its tile), ``gap_texels`` between islands (at most 8 or twice ``margin``; an upper bound unless
///     ``gap_complete``), ``uv_box`` (its lower left and upper right corner). Where nothing could be measured, NaN.
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
/// Guaranteed: any UVs will do, finite or not. Not guaranteed: exactness; overlaps below 1e-9 of the layout go unseen.
/// O(n log n); about two seconds for a million triangles on two cores.
///
/// Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001.
#[pyfunction]
#[pyo3(signature = (positions, corner_vertices, face_offsets, uv, *, chart=None, stacks=None, corner_triangles=None, by_face=false, job=None, **settings))]
pub(crate) fn measure(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    corner_vertices: &Bound<'_, PyAny>,
    face_offsets: &Bound<'_, PyAny>,
    uv: &Bound<'_, PyAny>,
    chart: Option<&Bound<'_, PyAny>>,
    stacks: Option<&Bound<'_, PyAny>>,
    corner_triangles: Option<&Bound<'_, PyAny>>,
    by_face: bool,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Measure)?;
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, Wishes::default())?;
    let uv = arrays::single_rows(uv, Argument { name: "uv", shape: "(c, 2)" })?;
    let chart = chart.map(|given| arrays::indices(given, Argument { name: "chart", shape: "(f,)" })).transpose()?;
    let stacks = stacks.map(|given| arrays::indices(given, Argument { name: "stacks", shape: "(k,)" })).transpose()?;
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| {
            let (chart, stack) = (chart.as_deref(), stacks.as_deref().unwrap_or_default());
            measure_layout(&mesh.input(), &uv, chart, stack, &call.settings, progress).map_err(Failure::from)
        },
        move |py, layout| Ok(report::measures_to_dict(py, layout, by_face)?.into_any().unbind()),
    )?;
    job.get().finish(py)
}
