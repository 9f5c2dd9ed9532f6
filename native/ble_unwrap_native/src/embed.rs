//! `embed`: the paper's method for points of any kind.

use ble_unwrap_core::embedding::{self, EmbedInput};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::{Failure, InvalidArgumentError};
use crate::job::Job;
use crate::owned_array::Array;
use crate::settings::{self, Function};
use crate::words::Words;

/// Points in few dimensions, and how they were found.
///
/// Attributes
/// ----------
/// coordinates : Array, (n, dimensions) float64
///     Without units: times the root of ``report["sigma"]`` they are in the unit of distance (default model). Rotation,
///     reflection and, for the default model, place are arbitrary.
/// intercepts : Array, (n,) float64
///     The intercepts of the default model; empty for the printed one.
/// report : dict
///     ``sigma``, the kernel width, a squared distance (1 for affinities); ``log_likelihood`` at the end, ``trace``, its
///     values at the start and after each sweep; ``bregman``, the Bregman distance from data to model; ``sweeps``;
///     ``converged``.
#[pyclass(frozen, get_all, module = "ble_unwrap_native")]
pub(crate) struct Embedding {
    coordinates: Py<Array>,
    intercepts: Py<Array>,
    report: Py<PyDict>,
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

/// Points can span no more dimensions than there are of them, and their n² distances must fit in memory.
const MOST_DIMENSIONS: usize = 100_000;

/// Embed points, distances or affinities in few dimensions by Bernoulli logistic embedding.
///
/// Parameters
/// ----------
/// data : (n, p) or (n, n) float32 or float64
///     Points of p coordinates, or a matrix of distances or of affinities between 0 and 1. Of an asymmetric matrix the
///     mean with its transpose counts; diagonals do not count.
/// kind : {"points", "distances", "affinities"}
///     What ``data`` is.
/// dimensions : int
///     Number of dimensions of the result, at least 1 and below n.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// seed, model, kernel_width, relaxation, max_sweeps, tolerance, update, initial, preset, threads
///     Settings, as for ``unwrap``; ``model="isomap"`` has no likelihood and is refused.
///
/// Returns
/// -------
/// Embedding
///     ``coordinates`` (n, dimensions) float64, ``intercepts`` (n,) or (0,) float64 and ``report``.
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
/// reproduced exactly by the default model. O(n²) memory and O(n²) time a sweep; classical scaling, the usual start, takes
/// O(n³).
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, sections 3 and 4.
#[pyfunction]
#[pyo3(
    signature = (data, *, kind=None, dimensions=None, job=None, **settings),
    text_signature = "(data, *, kind='points', dimensions=2, job=None, **settings)"
)]
pub(crate) fn embed(
    py: Python<'_>,
    data: &Bound<'_, PyAny>,
    kind: Option<&Bound<'_, PyAny>>,
    dimensions: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Embed)?;
    let mut chosen = DataKind::Points;
    if let Some(kind) = kind {
        settings::set_word("kind", &mut chosen, kind)?;
    }
    let dimensions = dimensions.map_or(Ok(2), |given| settings::whole("dimensions", given, [1, MOST_DIMENSIONS], ""))?;
    let shape = if chosen == DataKind::Points { "(n, p)" } else { "(n, n)" };
    let (data, n, p) = arrays::real_matrix(data, Argument { name: "data", shape })?;
    if chosen != DataKind::Points && n != p {
        let word = chosen.word();
        return Err(InvalidArgumentError::new_err(format!(
            "data: expected a square matrix of {word}, found shape ({n}, {p})"
        )));
    }
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| {
            let input = match chosen {
                DataKind::Points => EmbedInput::Points { n, p, data: &data },
                DataKind::Distances => EmbedInput::Distances { n, data: &data },
                DataKind::Affinities => EmbedInput::Affinities { n, data: &data },
            };
            let settings = &call.settings;
            embedding::embed(input, dimensions, &settings.embedding, settings.seed, progress).map_err(Failure::from)
        },
        move |py, fit| {
            let report = PyDict::new(py);
            report.set_item("sigma", fit.sigma)?;
            report.set_item("log_likelihood", fit.log_likelihood)?;
            report.set_item("trace", fit.trace)?;
            report.set_item("bregman", fit.bregman)?;
            report.set_item("sweeps", fit.sweeps)?;
            report.set_item("converged", fit.converged)?;
            let coordinates = Py::new(py, Array::from_f64_matrix(fit.coordinates, [n, fit.dimensions]))?;
            let intercepts = Py::new(py, Array::from_f64(fit.intercepts))?;
            Ok(Py::new(py, Embedding { coordinates, intercepts, report: report.unbind() })?.into_any())
        },
    )?;
    job.get().finish(py)
}
