//! `pack`.

use ble_unwrap_core::settings::Function;
use ble_unwrap_core::standalone::{RepackRules, RepackScale, repack};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::Failure;
use crate::job::Job;
use crate::owned_array::{Array, Reduced};
use crate::settings;

/// Charts in their new places.
///
/// Attributes
/// ----------
/// uv : Array, (n, 2) float32
///     A place in [0, 1]² for each point, or in the square of a further tile; (0, 0) for points of no chart.
/// report : dict
///     ``charts``, ``tiles`` (those in which charts lie), ``packing_efficiency`` (of these), ``texels_per_unit``, ``texture_size``, ``specks``
///     (charts so small that they were enlarged to be seen at all) and ``warnings`` (a list of texts).
#[pyclass(frozen, get_all, module = "ble_unwrap_native")]
pub(crate) struct PackedCharts {
    uv: Py<Array>,
    report: Py<PyDict>,
}

#[pymethods]
impl PackedCharts {
    #[new]
    #[pyo3(signature = (uv, report, /))]
    fn new(uv: Py<Array>, report: Py<PyDict>) -> Self {
        Self { uv, report }
    }

    /// For `pickle` and `copy`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, (Py<Array>, Py<PyDict>)> {
        let (py, of) = (slf.py(), slf.get());
        (slf.get_type(), (of.uv.clone_ref(py), of.report.clone_ref(py)))
    }
}

/// Move, turn and scale charts so that they fill the unit square and keep their margin.
///
/// Parameters
/// ----------
/// points : (n, 2) float32 or float64
///     Points of the charts, in any unit; of obstacles, UVs.
/// triangles : (t, 3) int32 or int64
///     Three points each.
/// chart : (t,) int32 or int64
///     The chart of each triangle. Triangles of a negative chart are left out. A point belongs to one chart.
/// groups : (t,) int32 or int64, optional
///     A number for each triangle, the same for all triangles of a chart. Charts with the same number, 0 or more, move as one rigid whole: they
///     keep their places relative to each other, overlap as they did, and keep no margin between them. Copies that lie upon each other stay a
///     stack if they are of one group. Charts with a negative number move by themselves.
/// obstacles : (t,) bool, optional
///     Triangles whose chart or group stays where it is. The points of what stays are UVs, and are returned as they are, in single precision.
///     They may lie outside the texture.
/// border_margin : float, optional
///     Least distance of charts that move to the border of the texture, in texels; half of ``margin`` if absent, and at least that with several ``tiles``.
/// scale : {"uniform", "fixed"}
///     ``"uniform"``: all charts are scaled by the same factor, the greatest found. ``"fixed"``: charts keep their size; a unit of the points is
///     the width of the texture, along both sides.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// margin : float
///     Least distance between charts, in texels; half of it is kept to the border.
/// mip_levels : int On how many mip levels, besides the texture itself, filtering mixes no two charts, 0 to 8: the
/// margin is raised to what that takes, as in ``unwrap``.
/// texture_size : int or two ints
///     Width and height of the texture in texels. Charts keep their shape in texels.
/// rotation : {"aligned", "any", "quarter", "none"}
///     How charts may be turned. They are never mirrored.
/// quality : {"fast", "normal", "high"}
///     How long a dense placement is searched for.
/// tiles : int
///     Over how many tiles charts may be spread, 1 to 100. Tile k, from 0, is the square of UV with its lower left corner at (k mod 10, k // 10), which
///     is also called UDIM 1001 + k. No chart crosses the border of a tile, and a group stays in one; obstacles are in the way where they are.
/// texel_density : float or None
///     Texels to a unit of length of ``points``, for all charts larger than a texel, in as few tiles as are found to do; where it does not fit into
///     ``tiles`` tiles, they get the greatest density that is found, and ``warnings`` says so. None for the greatest that is found.
/// snap : bool Whether charts, or groups, whose outer border is a rectangle along the axes of the texture are laid on
/// whole texels, which scales each of them by less than a texel along each axis, also at a fixed scale. shrink_margin :
/// bool Whether a margin that leaves no room for the charts is halved until it does, which ``warnings`` says.
/// ``border_margin``, if given, is kept.
/// threads : int
///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
///
/// Returns
/// -------
/// PackedCharts
///     ``uv`` (n, 2) float32 and ``report``.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type, shape or indices, a setting is unknown or out of range, or the charts do not fit
///     with their margin; with ``scale="fixed"`` the text tells the factor at which they would, and a ``texel_density`` is one scale too many.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// All charts are scaled by the same factor, specks aside, which are enlarged to about a texel unless the scale is fixed; a group is enlarged
/// as one. Charts that overlap themselves are packed as they are. Charts keep their shape in texels: if the texture is not square, multiply the
/// ``v`` of UVs that are to be moved by its height over its width first.
#[pyfunction]
#[pyo3(signature = (points, triangles, chart, *, groups=None, obstacles=None, border_margin=None, scale=None, job=None, **settings),
    text_signature = "(points, triangles, chart, *, groups=None, obstacles=None, border_margin=None, scale='uniform', job=None, **settings)")]
#[expect(clippy::too_many_arguments, reason = "they are the keywords of a Python function")]
pub(crate) fn pack(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    triangles: &Bound<'_, PyAny>,
    chart: &Bound<'_, PyAny>,
    groups: Option<&Bound<'_, PyAny>>,
    obstacles: Option<&Bound<'_, PyAny>>,
    border_margin: Option<&Bound<'_, PyAny>>,
    scale: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Pack)?;
    let points = arrays::real_rows(points, Argument { name: "points", shape: "(n, 2)" })?;
    let triangles = arrays::index_rows(triangles, Argument { name: "triangles", shape: "(t, 3)" })?;
    let chart = arrays::indices(chart, Argument { name: "chart", shape: "(t,)" })?;
    let groups = groups.map(|given| arrays::indices(given, Argument { name: "groups", shape: "(t,)" })).transpose()?;
    let obstacles =
        obstacles.map(|given| arrays::flags(given, Argument { name: "obstacles", shape: "(t,)" })).transpose()?;
    let border_texels = border_margin.map(|given| settings::number("border_margin", given)).transpose()?;
    let scales = [("uniform", RepackScale::Uniform), ("fixed", RepackScale::Fixed)];
    let scale = scale.map(|given| settings::one_of("scale", &scales, given)).transpose()?.unwrap_or_default();
    let size = (call.settings.packing.width, call.settings.packing.height);
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| {
            let (groups, obstacles) = (groups.as_deref(), obstacles.as_deref());
            let rules = RepackRules { groups, obstacles, border_texels, scale };
            repack(&points, &triangles, &chart, &rules, &call.settings.packing, progress).map_err(Failure::from)
        },
        move |py, repacked| {
            let report = PyDict::new(py);
            report.set_item("charts", repacked.charts)?;
            report.set_item("tiles", repacked.tiles)?;
            report.set_item("packing_efficiency", repacked.efficiency)?;
            report.set_item("texels_per_unit", repacked.texels_per_unit)?;
            report.set_item("texture_size", size)?;
            report.set_item("specks", repacked.specks)?;
            report.set_item("warnings", repacked.warnings)?;
            let uv = Py::new(py, Array::from_f32_rows(repacked.uv))?;
            Ok(Py::new(py, PackedCharts { uv, report: report.unbind() })?.into_any())
        },
    )?;
    job.get().finish(py)
}
