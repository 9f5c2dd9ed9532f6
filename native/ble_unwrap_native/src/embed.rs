//! `embed`: the paper's method for points of any kind.

use std::sync::Arc;

use ble_unwrap_core::embedding::{self, EmbedInput, EmbedOptions, KernelWidth, PointMetric};
use ble_unwrap_core::settings::Function;
use ble_unwrap_core::standalone::CloudDistanceSettings;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::arrays::{self, Argument};
use crate::errors::{Failure, InvalidArgumentError};
use crate::job::Job;
use crate::owned_array::Array;
use crate::settings::{self, Call};

/// Points in few dimensions, and how they were found.
///
/// Attributes
/// ----------
/// coordinates : Array, (n, dimensions) float64
///     Times the root of ``report["sigma"]`` they are in the unit of distance (default model and Isomap; the printed model has
///     no scale). Rotation, reflection and, but for the printed model, place are arbitrary.
/// intercepts : Array, (n,) float64
///     The intercepts of the default model; empty for the others.
/// report : dict
///     ``sigma``, the kernel width, a squared distance (1 for affinities and Isomap); ``mean_affinity`` of the points fitted
///     together; ``log_likelihood`` at the end, ``trace``, its values at the start and after each sweep that was kept;
///     ``bregman``, the Bregman distance from data to model; ``sweeps``; ``converged``; ``landmarks``, an Array (k,) int32 of
///     the points that were fitted together, all if there are no landmarks. Of Isomap, which fits no likelihood,
///     ``mean_affinity``, ``log_likelihood`` and ``bregman`` are None and ``trace`` is empty.
#[pyclass(frozen, module = "ble_unwrap_native")]
pub(crate) struct Embedding {
    #[pyo3(get)]
    coordinates: Py<Array>,
    #[pyo3(get)]
    intercepts: Py<Array>,
    #[pyo3(get)]
    report: Py<PyDict>,
    /// What places further points; its coordinates and trace are moved out.
    fitted: Arc<embedding::Embedding>,
}

#[pymethods]
impl Embedding {
    /// Place new points among the fitted ones.
    ///
    /// Parameters
    /// ----------
    /// data : (m, p) or (m, k) float32 or float64
    ///     New points, if points were embedded; else their distances or affinities to the k points of
    ///     ``report["landmarks"]``, in that order.
    /// job : Job, optional
    ///     A new ``Job``, by which another thread watches or cancels this call.
    /// threads : int
    ///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
    ///
    /// Returns
    /// -------
    /// Array, (m, dimensions) float64
    ///     In the frame and unit of ``coordinates``.
    ///
    /// Raises
    /// ------
    /// InvalidArgumentError
    ///     If the data have the wrong type or shape or a value out of range.
    /// Cancelled
    ///     If the job was cancelled.
    ///
    /// Notes
    /// -----
    /// Each point by itself: the maximum of its likelihood given the fitted points, which stay; for Isomap landmark
    /// scaling. Geodesic distances lead over the ``neighbours`` nearest fitted points. Fitted points come out where
    /// they are; by affinities, which do not tell that two points are one, nearly so. O(k) a point.
    #[pyo3(signature = (data, *, job=None, **settings))]
    fn transform(
        &self,
        py: Python<'_>,
        data: &Bound<'_, PyAny>,
        job: Option<Bound<'_, Job>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        let call = settings::from_keywords(settings, Function::Transform)?;
        let (data, m, columns) = arrays::real_matrix(data, Argument { name: "data", shape: "(m, p)" })?;
        let fitted = Arc::clone(&self.fitted);
        let shape = [m, fitted.dimensions];
        let job = Job::given_or_new(py, job)?;
        job.get().start(
            call.threads,
            move |progress| fitted.transform(&data, m, columns, progress).map_err(Failure::from),
            move |py, placed| Ok(Py::new(py, Array::from_f64_matrix(placed, shape))?.into_any()),
        )?;
        job.get().finish(py)
    }
}

/// What the data of a call to `embed` are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DataKind {
    /// Points of any dimension.
    Points,
    /// Distances of all pairs.
    Distances,
    /// Affinities of all pairs.
    Affinities,
}

impl DataKind {
    const ALL: [(&str, Self); 3] =
        [("points", Self::Points), ("distances", Self::Distances), ("affinities", Self::Affinities)];

    fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, kind)| *kind == self).map_or("", |(word, _)| *word)
    }
}

/// How far apart points are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PointDistance {
    /// In a straight line.
    Euclidean,
    /// Along the graph of nearest neighbours.
    Geodesic,
}

impl PointDistance {
    const ALL: [(&str, Self); 2] = [("euclidean", Self::Euclidean), ("geodesic", Self::Geodesic)];
}

/// Points can span no more dimensions than there are of them, and their n² distances must fit in memory.
const MOST_DIMENSIONS: usize = 100_000;
/// More neighbours make a graph larger than the matrix it is to stand for.
const MOST_NEIGHBOURS: usize = 100_000;

/// Embed points, distances or affinities in few dimensions by Bernoulli logistic embedding.
///
/// Parameters
/// ----------
/// data : (n, p) or (n, n) float32 or float64
///     Points of p coordinates, or a matrix of distances or of affinities between 0 and 1. Of an asymmetric matrix the
///     mean with its transpose counts, which is all that the likelihood sees; diagonals do not count.
/// kind : {"points", "distances", "affinities"}
///     What ``data`` is.
/// dimensions : int
///     Number of dimensions of the result, at least 1 and below n.
/// metric : {"euclidean", "geodesic"}
///     For points: straight distances, or shortest paths along the graph of nearest neighbours.
/// neighbours : int
///     For geodesic distances: each point is joined to so many nearest ones. The graph must be in one piece.
/// landmarks : int, optional
///     Fit so many points, in farthest-point order, among themselves, and place every other point by logistic regression
///     on them: time linear in n. 100 are enough for sheets. Without it all points are fitted together.
/// initial : {"mds", "random"} or (n, dimensions) float32 or float64, optional
///     Start: classical scaling, random by ``seed``, or coordinates in the unit of the result. By default as the preset has
///     it: classical scaling, for the paper random.
/// mean_affinity : float, optional
///     Choose the kernel width such that the mean affinity has this value. At most one of ``kernel_width`` (relative to the
///     mean squared distance), ``mean_affinity`` and ``sigma`` may be given.
/// sigma : float, optional
///     The kernel width itself, a squared distance.
/// truncation : float
///     Affinities below this count as 0; distances that would give them are then not measured where ``sigma`` or
///     ``kernel_width`` tells their radius beforehand.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// seed, model, kernel_width, relaxation, max_sweeps, tolerance, update, preset, threads
///     Settings, as for ``unwrap``. ``model="isomap"`` is classical (with landmarks, landmark) scaling of the same distances.
///
/// Returns
/// -------
/// Embedding
///     ``coordinates`` (n, dimensions) float64, ``intercepts`` (n,) or (0,) float64, ``report``, and ``transform`` for new
///     points.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If the data have the wrong type or shape or a value out of range, or a setting is unknown or out of range.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// Guaranteed: the same result for any number of threads; with serial updates the likelihood never falls. Not
/// guaranteed: the global maximum. Distances of a Euclidean point set of at most ``dimensions`` dimensions are
/// reproduced exactly by the default model from classical scaling. Without landmarks O(n²) memory and O(n²) time a sweep,
/// 6 ms for n = 1,000 on one core; with k landmarks O(kn) time and, but for geodesic distances, O(n) memory.
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, sections 3 and 4.
#[pyfunction]
#[pyo3(
    signature = (data, *, kind=None, dimensions=None, metric=None, neighbours=None, landmarks=None, initial=None,
                 mean_affinity=None, sigma=None, truncation=None, job=None, **settings),
    text_signature = "(data, *, kind='points', dimensions=2, metric='euclidean', neighbours=12, landmarks=None, \
                      initial=None, mean_affinity=None, sigma=None, truncation=0.0, job=None, **settings)"
)]
pub(crate) fn embed(
    py: Python<'_>,
    data: &Bound<'_, PyAny>,
    kind: Option<&Bound<'_, PyAny>>,
    dimensions: Option<&Bound<'_, PyAny>>,
    metric: Option<&Bound<'_, PyAny>>,
    neighbours: Option<&Bound<'_, PyAny>>,
    landmarks: Option<&Bound<'_, PyAny>>,
    initial: Option<&Bound<'_, PyAny>>,
    mean_affinity: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
    truncation: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut call = settings::from_keywords(settings, Function::Embed)?;
    let chosen = kind.map_or(Ok(DataKind::Points), |given| settings::one_of("kind", &DataKind::ALL, given))?;
    let whole = |name, given: Option<&Bound<'_, PyAny>>, usual, most| {
        given.map_or(Ok(usual), |given| settings::whole(name, given, [1, most], ""))
    };
    let dimensions = whole("dimensions", dimensions, 2, MOST_DIMENSIONS)?;
    let neighbours = whole("neighbours", neighbours, CloudDistanceSettings::default().neighbours, MOST_NEIGHBOURS)?;
    let landmarks = match landmarks {
        Some(given) => Some(settings::whole("landmarks", given, [1, i32::MAX as usize], ", or None for all points")?),
        None => None,
    };
    let metric = point_metric(metric, chosen, neighbours)?;
    let width = kernel_width(settings, mean_affinity, sigma)?;
    let truncation = truncation.map_or(Ok(0.0), |given| settings::number("truncation", given))?;
    let start = start(&mut call, initial)?;

    let shape = if chosen == DataKind::Points { "(n, p)" } else { "(n, n)" };
    let (data, n, p) = arrays::real_matrix(data, Argument { name: "data", shape })?;
    if chosen != DataKind::Points && n != p {
        let word = chosen.word();
        return Err(InvalidArgumentError::new_err(format!(
            "data: expected a square matrix of {word}, found shape ({n}, {p})"
        )));
    }
    if let Some((_, rows, columns)) = start.as_ref().filter(|(_, rows, columns)| (*rows, *columns) != (n, dimensions)) {
        return Err(InvalidArgumentError::new_err(format!(
            "initial: expected shape ({n}, {dimensions}), a row for each point, found ({rows}, {columns})"
        )));
    }
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| {
            let input = match chosen {
                DataKind::Points => EmbedInput::Points { n, p, data: &data, metric },
                DataKind::Distances => EmbedInput::Distances { n, data: &data },
                DataKind::Affinities => EmbedInput::Affinities { n, data: &data },
            };
            let start = start.as_ref().map(|(start, ..)| start.as_slice());
            let seed = call.settings.seed;
            let options = EmbedOptions { dimensions, width, truncation, landmarks, start, seed };
            embedding::embed(input, &options, &call.settings.embedding, progress).map_err(Failure::from)
        },
        move |py, fitted| Ok(Py::new(py, deliver(py, n, fitted)?)?.into_any()),
    )?;
    job.get().finish(py)
}

/// Makes the Python object.
fn deliver(py: Python<'_>, n: usize, mut fitted: embedding::Embedding) -> PyResult<Embedding> {
    let report = PyDict::new(py);
    report.set_item("sigma", fitted.sigma)?;
    report.set_item("mean_affinity", fitted.mean_affinity)?;
    report.set_item("log_likelihood", fitted.log_likelihood)?;
    report.set_item("trace", std::mem::take(&mut fitted.trace))?;
    report.set_item("bregman", fitted.bregman)?;
    report.set_item("sweeps", fitted.sweeps)?;
    report.set_item("converged", fitted.converged)?;
    let landmarks = fitted.landmarks.iter().map(|&i| i as i32).collect();
    report.set_item("landmarks", Py::new(py, Array::from_i32(landmarks))?)?;
    let coordinates = Array::from_f64_matrix(std::mem::take(&mut fitted.coordinates), [n, fitted.dimensions]);
    let intercepts = Array::from_f64(std::mem::take(&mut fitted.intercepts));
    Ok(Embedding {
        coordinates: Py::new(py, coordinates)?,
        intercepts: Py::new(py, intercepts)?,
        report: report.unbind(),
        fitted: Arc::new(fitted),
    })
}

/// How distances of points are measured; an error for data that are no points.
fn point_metric(given: Option<&Bound<'_, PyAny>>, kind: DataKind, neighbours: usize) -> PyResult<PointMetric> {
    let usual = PointDistance::Euclidean;
    match given.map_or(Ok(usual), |given| settings::one_of("metric", &PointDistance::ALL, given))? {
        PointDistance::Euclidean => Ok(PointMetric::Euclidean),
        PointDistance::Geodesic if kind == DataKind::Points => Ok(PointMetric::Geodesic { neighbours }),
        PointDistance::Geodesic => Err(InvalidArgumentError::new_err(format!(
            "metric: 'geodesic' is for kind='points'; the data are {}",
            kind.word()
        ))),
    }
}

/// The kernel width by whichever of its three names is given; `None` if the settings say it.
fn kernel_width(
    settings: Option<&Bound<'_, PyDict>>,
    mean_affinity: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<KernelWidth>> {
    let relative = match settings {
        Some(settings) => settings.get_item("kernel_width")?.is_some_and(|given| !given.is_none()),
        None => false,
    };
    let given = [("kernel_width", relative), ("mean_affinity", mean_affinity.is_some()), ("sigma", sigma.is_some())];
    let given: Vec<&str> = given.into_iter().filter_map(|(name, given)| given.then_some(name)).collect();
    if given.len() > 1 {
        return Err(InvalidArgumentError::new_err(format!(
            "expected at most one of kernel_width, mean_affinity and sigma, found {}",
            given.join(" and ")
        )));
    }
    Ok(match (mean_affinity, sigma) {
        (Some(mean), _) => Some(KernelWidth::MeanAffinity(settings::number("mean_affinity", mean)?)),
        (_, Some(sigma)) => Some(KernelWidth::Absolute(settings::number("sigma", sigma)?)),
        (None, None) => None,
    })
}

/// Start coordinates with their shape, or the word for a start, which goes to the settings.
fn start(call: &mut Call, initial: Option<&Bound<'_, PyAny>>) -> PyResult<Option<(Vec<f64>, usize, usize)>> {
    match initial {
        Some(word) if word.is_instance_of::<PyString>() => {
            settings::set_word("initial", &mut call.settings.embedding.initial, word)?;
            Ok(None)
        }
        Some(array) => {
            let shape = "(n, dimensions), or 'mds' or 'random'";
            arrays::real_matrix(array, Argument { name: "initial", shape }).map(Some)
        }
        None => Ok(None),
    }
}
