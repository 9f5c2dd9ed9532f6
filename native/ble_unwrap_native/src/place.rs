//! `place`: further points among landmarks that are plain arrays.

use ble_unwrap_core::embedding::{self, Evidence, FittedLandmarks, Model};
use ble_unwrap_core::settings::{Choice, Function};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Argument};
use crate::errors::{Failure, InvalidArgumentError};
use crate::job::Job;
use crate::owned_array::Array;
use crate::settings;

/// Place points among fitted landmarks by their distances or affinities to them.
///
/// What ``Embedding.transform`` does, from plain arrays: an embedding cannot be pickled, arrays can. Of an embedding by
/// points ``chosen = report["landmarks"]`` they are ``coordinates[chosen]``, ``intercepts[chosen]`` and ``report["sigma"]``.
///
/// Parameters
/// ----------
/// data : (m, k) float32 or float64
///     Distances or affinities of m points to k landmarks.
/// coordinates : (k, q) float32 or float64
///     The landmarks, in the unit of ``Embedding.coordinates``.
/// intercepts : (k,) float32 or float64, optional
///     Their intercepts; for the default model, and only there.
/// kind : {"distances", "affinities"}
///     What ``data`` is.
/// sigma : float
///     The kernel width, a squared distance; 1 for affinities. Isomap does not use it.
/// truncation : float
///     Affinities below this count as 0.
/// mean_squared : (k,) float32 or float64, optional
///     For Isomap, and only there: the mean squared distance of all k landmarks, itself included, to each.
/// job : Job, optional
///     A new ``Job``, by which another thread watches or cancels this call.
/// model : {"default", "paper", "isomap"}
///     The model of the fit.
/// threads : int
///     Threads to work with; 0 for as many as the machine has. The result does not depend on it.
///
/// Returns
/// -------
/// Array, (m, q) float64
///     In the frame and unit of ``coordinates``; always finite.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If an array has the wrong type or shape or a value out of range, or a setting is unknown or out of range.
/// Cancelled
///     If the job was cancelled.
///
/// Notes
/// -----
/// Each point by itself: the maximum of its likelihood given the landmarks, which is concave; for Isomap landmark scaling.
/// A point at distance 0 from a landmark is put where the first such is. Of a point far from all landmarks the likelihood
/// says only that; there weighted least squares on the log-odds, exact for points of q dimensions, decide. O(kq²) a point.
///
/// Source: Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, section 4; de Silva, Tenenbaum: Sparse
/// multidimensional scaling using landmark points, 2004, section 2.
#[pyfunction]
#[pyo3(
    signature = (data, coordinates, intercepts=None, *, kind=None, sigma=None, truncation=None, mean_squared=None,
                 job=None, **settings),
    text_signature = "(data, coordinates, intercepts=None, *, kind='distances', sigma=1.0, truncation=0.0, \
                      mean_squared=None, job=None, **settings)"
)]
#[expect(clippy::too_many_arguments, reason = "they are Python's keywords")]
pub(crate) fn place(
    py: Python<'_>,
    data: &Bound<'_, PyAny>,
    coordinates: &Bound<'_, PyAny>,
    intercepts: Option<&Bound<'_, PyAny>>,
    kind: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
    truncation: Option<&Bound<'_, PyAny>>,
    mean_squared: Option<&Bound<'_, PyAny>>,
    job: Option<Bound<'_, Job>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let call = settings::from_keywords(settings, Function::Place)?;
    let model = call.settings.embedding.model;
    let kinds = [("distances", Evidence::SquaredDistances), ("affinities", Evidence::Affinities)];
    let evidence = kind.map_or(Ok(Evidence::SquaredDistances), |given| settings::one_of("kind", &kinds, given))?;
    let sigma = sigma.map_or(Ok(1.0), |given| settings::positive("sigma", given, ""))?;
    let truncation = truncation.map_or(Ok(0.0), |given| settings::number("truncation", given))?;
    let (data, m, columns) = arrays::real_matrix(data, Argument { name: "data", shape: "(m, k)" })?;
    let (coordinates, k, q) = arrays::real_matrix(coordinates, Argument { name: "coordinates", shape: "(k, q)" })?;
    if k == 0 || q == 0 {
        let text = format!("coordinates: expected at least one landmark of one dimension, found shape ({k}, {q})");
        return Err(InvalidArgumentError::new_err(text));
    }
    if columns != k {
        let text = format!("data: expected {k} columns, one for each landmark, found shape ({m}, {columns})");
        return Err(InvalidArgumentError::new_err(text));
    }
    let intercepts = one_a_landmark("intercepts", intercepts, k, (model, Model::Default))?;
    let mean_squared = one_a_landmark("mean_squared", mean_squared, k, (model, Model::Isomap))?;
    let job = Job::given_or_new(py, job)?;
    job.get().start(
        call.threads,
        move |progress| {
            let landmarks = FittedLandmarks {
                model,
                dimensions: q,
                coordinates: &coordinates,
                intercepts: &intercepts,
                mean_squared: &mean_squared,
                sigma,
                truncation,
            };
            embedding::place(&data, m, evidence, &landmarks, progress).map_err(Failure::from)
        },
        move |py, placed| Ok(Py::new(py, Array::from_f64_matrix(placed, [m, q]))?.into_any()),
    )?;
    job.get().finish(py)
}

/// The k values of an array that one model needs and the others refuse, unless it is empty.
fn one_a_landmark(
    name: &'static str,
    given: Option<&Bound<'_, PyAny>>,
    k: usize,
    (model, needs): (Model, Model),
) -> PyResult<Vec<f64>> {
    let values = given.map_or(Ok(Vec::new()), |given| arrays::reals(given, Argument { name, shape: "(k,)" }))?;
    let expected = if model == needs { k } else { 0 };
    if values.len() == expected {
        return Ok(values);
    }
    let (found, model) = (values.len(), model.word());
    Err(InvalidArgumentError::new_err(format!("{name}: expected {expected} values for model='{model}', found {found}")))
}
