//! `unwrap` and `submit_unwrap`: arrays in, atlas out.

use ble_unwrap_core::MeshInput;
use ble_unwrap_core::settings::Function;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::Failure;
use crate::job::Job;
use crate::owned_array::{Array, Reduced};
use crate::report;
use crate::settings;

/// UVs of a mesh, and what is known about them.
///
/// Attributes
/// ----------
/// uv : Array, (c, 2) float32
///     A UV in [0, 1]² for each corner, or in the square of a further tile; (0, 0) at corners of faces without a chart.
/// chart : Array, (f,) int32
///     The chart of each face, from 0; -1 for faces that have a vertex with non-finite coordinates.
/// stack : Array, (k,) int32
///     The stack of each of the k charts, from 0; -1 for charts that lie alone, as all do with ``stack="off"``. Charts of
///     one stack cover exactly the same place, with the same UVs to the bit. Where some are mirror images of others, those
///     that are fewer are mirrored as wholes.
/// report : dict
///     Measures of the result, taken from ``uv`` as it stands; see ``unwrap``.
/// certificate : dict
///     The outcome of the exact checks of ``uv``. ``valid`` is true, as ``unwrap`` raises ``UnprovenError`` otherwise:
///     nothing is ``flipped``, ``out_of_range``, crosses (``crossings_inside``, ``crossings_between``) or is
///     ``nested``, each chart has one outer boundary (``bad_loops``), and ``gap_texels`` is at least ``margin_texels``.
///     The ``stacked`` charts are left out of that but for one of each stack, and the others cover exactly the same
///     place (none is ``apart``), all of their triangles turned one way.
#[pyclass(frozen, get_all, module = "ble_unwrap_native")]
pub(crate) struct Atlas {
    uv: Py<Array>,
    chart: Py<Array>,
    stack: Py<Array>,
    report: Py<PyDict>,
    certificate: Py<PyDict>,
}

/// What an [`Atlas`] is made of.
type Parts = (Py<Array>, Py<Array>, Py<Array>, Py<PyDict>, Py<PyDict>);

#[pymethods]
impl Atlas {
    #[new]
    #[pyo3(signature = (uv, chart, stack, report, certificate, /))]
    fn new(uv: Py<Array>, chart: Py<Array>, stack: Py<Array>, report: Py<PyDict>, certificate: Py<PyDict>) -> Self {
        Self { uv, chart, stack, report, certificate }
    }

    /// For `pickle` and `copy`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, Parts> {
        let (py, of) = (slf.py(), slf.get());
        let [uv, chart, stack] = [&of.uv, &of.chart, &of.stack].map(|array| array.clone_ref(py));
        (slf.get_type(), (uv, chart, stack, of.report.clone_ref(py), of.certificate.clone_ref(py)))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let report = self.report.bind(py);
        let of = |key| report.get_item(key).map(|value| value.map_or_else(String::new, |value| value.to_string()));
        Ok(format!("Atlas(faces={}, charts={}, l2={})", of("faces")?, of("charts")?, of("l2")?))
    }
}

/// A mesh copied out of Python's arrays.
pub(crate) struct MeshArrays {
    positions: Vec<[f64; 3]>,
    corner_vertices: Vec<i32>,
    face_offsets: Vec<i32>,
    corner_triangles: Option<Vec<[i32; 3]>>,
    seams: Vec<[i32; 2]>,
    guides: Vec<[i32; 2]>,
    seam_weights: Option<Vec<f32>>,
}

/// What says where seams should be, as an unwrap takes it.
#[derive(Clone, Copy, Default)]
pub(crate) struct Wishes<'a, 'py> {
    pub(crate) seams: Option<&'a Bound<'py, PyAny>>,
    pub(crate) guides: Option<&'a Bound<'py, PyAny>>,
    pub(crate) seam_weights: Option<&'a Bound<'py, PyAny>>,
}

impl MeshArrays {
    /// Checks and copies the arrays that describe a mesh to every function of the module.
    pub(crate) fn new(
        positions: &Bound<'_, PyAny>,
        corner_vertices: &Bound<'_, PyAny>,
        face_offsets: &Bound<'_, PyAny>,
        corner_triangles: Option<&Bound<'_, PyAny>>,
        wishes: Wishes<'_, '_>,
    ) -> PyResult<Self> {
        let triangles = Argument { name: "corner_triangles", shape: "(t, 3)" };
        let weights = Argument { name: "seam_weights", shape: "(n,)" };
        let pairs = |given: Option<&Bound<'_, PyAny>>, argument| {
            given.map(|given| arrays::index_rows(given, argument)).transpose().map(Option::unwrap_or_default)
        };
        Ok(Self {
            positions: arrays::real_rows(positions, Argument { name: "positions", shape: "(n, 3)" })?,
            corner_vertices: arrays::indices(corner_vertices, Argument { name: "corner_vertices", shape: "(c,)" })?,
            face_offsets: arrays::indices(face_offsets, Argument { name: "face_offsets", shape: "(f + 1,)" })?,
            corner_triangles: corner_triangles.map(|given| arrays::index_rows(given, triangles)).transpose()?,
            seams: pairs(wishes.seams, Argument { name: "seams", shape: "(s, 2)" })?,
            guides: pairs(wishes.guides, Argument { name: "guides", shape: "(g, 2)" })?,
            seam_weights: wishes.seam_weights.map(|given| arrays::singles(given, weights)).transpose()?,
        })
    }

    /// The view of the arrays that the core takes.
    pub(crate) fn input(&self) -> MeshInput<'_> {
        MeshInput {
            positions: &self.positions,
            corner_vertices: &self.corner_vertices,
            face_offsets: &self.face_offsets,
            corner_triangles: self.corner_triangles.as_deref(),
            seams: &self.seams,
            guides: &self.guides,
            seam_weights: self.seam_weights.as_deref(),
        }
    }

    /// Number of vertices.
    pub(crate) fn vertex_count(&self) -> usize {
        self.positions.len()
    }
}

/// An atlas of the core as one of Python.
pub(crate) fn to_python(py: Python<'_>, atlas: ble_unwrap_core::Atlas) -> PyResult<Py<PyAny>> {
    let uv = Py::new(py, Array::from_f32_rows(atlas.uv))?;
    let chart = Py::new(py, Array::from_i32(atlas.chart))?;
    let stack = Py::new(py, Array::from_i32(atlas.stack))?;
    let report = report::to_dict(py, &atlas.report)?.unbind();
    let certificate = report::certificate_to_dict(py, &atlas.certificate)?.unbind();
    Ok(Py::new(py, Atlas { uv, chart, stack, report, certificate })?.into_any())
}

/// Cut a surface into charts, flatten them under a stretch limit and pack them into one atlas.
///
/// Every face with finite vertices gets UVs, whatever the mesh: closed, non-manifold, self-intersecting, one-sided,
/// with holes, handles, n-gons or faces without area.
///
/// Parameters
/// ----------
/// positions : (n, 3) float32 or float64
///     Vertices, in any unit.
/// corner_vertices : (c,) int32 or int64
///     The vertex of each corner, face by face.
/// face_offsets : (f + 1,) int32 or int64
///     The first corner of each face, and ``c`` at the end.
/// corner_triangles : (t, 3) int32 or int64, optional
///     Triangles by corner, which together triangulate the faces. Made if absent or if they do not cover a face.
/// seams : (s, 2) int32 or int64, optional
///     Edges to be cut, by their two vertices. Pairs that are no edge do nothing.
/// guides : (g, 2) int32 or int64, optional
///     Edges that borders of charts follow where a border is needed, such as sharp edges and borders of materials.
/// seam_weights : (n,) float32 or float64, optional
///     What a seam at each vertex counts for, as a multiple of its length, 0.001 to 1000: more than 1 where seams are to keep away, less where
///     they are welcome. Vertices that are welded count for their geometric mean, and so do a vertex and its mirror image where seams are mirrored.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
#[doc = include_str!("settings.txt")]
///
/// Returns
/// -------
/// Atlas
///     ``uv`` (c, 2) float32, ``chart`` (f,) int32, ``stack`` (k,) int32 for k charts, ``certificate``, the outcome of
///     the exact checks, and ``report``, a dict with ``charts``, ``stacked`` (charts that share their place with
///     others) and ``stacks`` (such places), ``faces``, ``unmapped_faces``, ``l2``, ``l2_chart_scale``,
///     ``l2_worst_chart``, ``l_infinity``, ``angle_distortion``, ``area_distortion``, ``flips``, ``bent_quads``,
///     ``overlaps``, ``seam_length``, ``packing_efficiency``, ``tiles``, ``texels_per_unit``, ``gap_texels``,
///     ``margin_texels`` (what was to be kept), ``chart_limit``, ``atlas_limit``, ``charts_over_limit``,
///     ``snapped_charts`` (how many), ``narrow_charts`` (numbers of those narrower than two texels), ``rungs``,
///     ``seconds``, ``warnings`` and more.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape, or a setting is unknown or out of range. The text names it.
/// Cancelled
///     If the job was cancelled. A job cancelled before the call does not look at the mesh, but arrays and settings
///     are checked first.
/// InvalidMeshError
///     If indices or offsets do not make a mesh. The text names the first wrong element.
/// OutOfMemoryError
///     If there is not enough memory. The result never depends on how much there is.
/// UnprovenError
///     If the layout cannot be proven to hold what is guaranteed below; its ``certificate`` says what it breaks.
/// InternalError
///     If the library is at fault.
///
/// Notes
/// -----
/// Guaranteed, and checked on the float32 values returned: no triangle is flipped, no chart overlaps itself
/// or another, unless ``stack`` asks for it, charts keep the margin, each chart is under ``chart_limit`` or counted in
/// ``charts_over_limit`` (a single face may not flatten under it); ``l2`` is under ``atlas_limit`` or a warning says
/// so. The result is the same, bit for bit, for any number of threads. Not guaranteed: the fewest charts or the
/// shortest seams.
///
/// With several ``tiles``, charts are spread over them at one density, and each lies within one: tile k, from 0, is the square of UV with its lower left
/// corner at (k mod 10, k // 10). A ``texel_density`` is that of all charts larger than a texel, times a factor of each where ``chart_scale`` is
/// "stretch"; where it does not fit, a warning says what did.
///
/// With ``mip_levels``, no texel of these levels and of the texture is read for two charts by bilinear filtering: for n
/// levels the margin is 2√2 · 2**n texels at least, or a little more where the size of the texture is no multiple of
/// 2**n. With ``snap``, sides of rectangles are whole numbers of texels, to single precision; a rectangle that the
/// limit would not allow it for, or of less than a texel, keeps its shape.
///
/// ``limit_over="atlas"`` bounds the root of the area-weighted mean of the charts' squared L2 stretch, as in UVAtlas.
///
/// Single precision cannot tell apart what is nearer than 2**-21 of the diagonal of the bounding box or, if all coordinates
/// are numbers of single precision, of the greatest of them where that is larger; a ``weld_distance`` of ``None`` is that,
/// but at most a hundredth of the mean length of a side, and 0 welds exactly the same coordinates only. All that is welded
/// lies within the distance around one vertex, so chains are broken up.
///
/// The arrays are copied before work begins; other Python threads run meanwhile. Ctrl-C raises ``KeyboardInterrupt``.
/// Time is near-linear in the number of faces.
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, with the extensions that
/// native/ARCHITECTURE.md describes.
#[pyfunction]
#[pyo3(signature = (positions, corner_vertices, face_offsets, *, corner_triangles=None, seams=None, guides=None, seam_weights=None, job=None, **settings))]
pub(crate) fn unwrap(
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
    let job = submit_unwrap(
        py,
        positions,
        corner_vertices,
        face_offsets,
        corner_triangles,
        seams,
        guides,
        seam_weights,
        job,
        settings,
    )?;
    job.get().finish(py)
}

/// Start ``unwrap`` on a thread of its own and return the job at once.
///
/// Takes what ``unwrap`` takes. Poll ``progress()`` and ``is_finished()``, stop it with ``cancel()``, collect the
/// ``Atlas`` with ``result()``.
///
/// Returns
/// -------
/// Job
///     The running job: ``job`` if it was given, else a new one.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape, or a setting is unknown or out of range. All other errors, including
///     ``InvalidMeshError``, are raised by ``Job.result``.
#[pyfunction]
#[pyo3(signature = (positions, corner_vertices, face_offsets, *, corner_triangles=None, seams=None, guides=None, seam_weights=None, job=None, **settings))]
pub(crate) fn submit_unwrap<'py>(
    py: Python<'py>,
    positions: &Bound<'py, PyAny>,
    corner_vertices: &Bound<'py, PyAny>,
    face_offsets: &Bound<'py, PyAny>,
    corner_triangles: Option<&Bound<'py, PyAny>>,
    seams: Option<&Bound<'py, PyAny>>,
    guides: Option<&Bound<'py, PyAny>>,
    seam_weights: Option<&Bound<'py, PyAny>>,
    job: Option<Bound<'py, Job>>,
    settings: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, Job>> {
    let call = settings::from_keywords(settings, Function::Unwrap)?;
    let wishes = Wishes { seams, guides, seam_weights };
    let mesh = MeshArrays::new(positions, corner_vertices, face_offsets, corner_triangles, wishes)?;
    let job = Job::given_or_new(py, job)?;
    let work =
        move |progress: &_| ble_unwrap_core::unwrap(&mesh.input(), &call.settings, progress).map_err(Failure::from);
    job.get().start(call.threads, work, to_python)?;
    Ok(job)
}
