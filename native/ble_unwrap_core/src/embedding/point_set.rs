//! The method in general: points, distances or affinities in, points of any dimension out.

use crate::Progress;
use crate::linalg::classical_mds;

use super::affinity::{Affinity, squared_distances};
use super::bernoulli_logistic::{Fit, fit};
use super::chart::{mds_start, random_start};
use super::error::EmbeddingError;
use super::settings::{EmbeddingSettings, Initial, Model};

/// What is to be embedded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmbedInput<'a> {
    /// n points of p coordinates, row by row; their distances are Euclidean (paper, equation 5).
    Points {
        /// Number of points.
        n: usize,
        /// Number of coordinates.
        p: usize,
        /// The n×p coordinates.
        data: &'a [f64],
    },
    /// An n×n matrix of distances, row by row (13). An asymmetric one is replaced by the mean with
    /// its transpose; the diagonal is ignored.
    Distances {
        /// Number of points.
        n: usize,
        /// The n×n distances.
        data: &'a [f64],
    },
    /// An n×n matrix of affinities in [0, 1], row by row. An asymmetric one is replaced by the mean with its
    /// transpose; the diagonal is ignored, and so is the kernel width of the settings.
    Affinities {
        /// Number of points.
        n: usize,
        /// The n×n affinities.
        data: &'a [f64],
    },
}

/// Embeds points in `dimensions` dimensions by the paper's method (sections 3 and 4) or its extension.
///
/// Deterministic in its arguments for any number of threads. The start is classical scaling or random, by the
/// settings; from affinities, scaling uses the distances the kernel would have made them of.
/// O(n²) memory; O(n²p) for points, O(n³) for classical scaling, then as [`fit`].
///
/// # Errors
/// [`EmbeddingError::InvalidSetting`], [`EmbeddingError::TooFewPoints`] unless n > `dimensions`,
/// [`EmbeddingError::WrongLength`], [`EmbeddingError::NotFinite`], [`EmbeddingError::DistanceOutOfRange`] and
/// [`EmbeddingError::AffinityOutOfRange`] name the first bad value, [`EmbeddingError::NoExtent`],
/// [`EmbeddingError::NoLikelihood`] for [`Model::Isomap`], cancelled.
pub fn embed(
    input: EmbedInput<'_>,
    dimensions: usize,
    settings: &EmbeddingSettings,
    seed: u64,
    progress: &Progress,
) -> Result<Fit, EmbeddingError> {
    settings.validate()?;
    if settings.model == Model::Isomap {
        return Err(EmbeddingError::NoLikelihood);
    }
    if dimensions == 0 {
        return Err(EmbeddingError::InvalidSetting { name: "dimensions", value: 0.0, expected: "at least 1" });
    }
    let (n, expected) = match input {
        EmbedInput::Points { n, p, .. } => (n, n.checked_mul(p)),
        EmbedInput::Distances { n, .. } | EmbedInput::Affinities { n, .. } => (n, n.checked_mul(n)),
    };
    let (EmbedInput::Points { data, .. } | EmbedInput::Distances { data, .. } | EmbedInput::Affinities { data, .. }) =
        input;
    if expected != Some(data.len()) {
        return Err(EmbeddingError::WrongLength { expected: expected.unwrap_or(usize::MAX), found: data.len() });
    }
    if n <= dimensions {
        return Err(EmbeddingError::TooFewPoints { points: n, dimensions });
    }
    let kernel = settings.kernel();
    let (affinity, squared) = match input {
        EmbedInput::Affinities { .. } => (Affinity::from_matrix(data, n)?, None),
        EmbedInput::Points { p, .. } => {
            let squared = squared_between(data, n, p, progress)?;
            let affinity = Affinity::from_squared_distances(&squared, n, kernel, settings.width(), progress)?;
            (affinity, Some(squared))
        }
        EmbedInput::Distances { .. } => {
            let squared = squared_matrix(data, n)?;
            let affinity = Affinity::from_squared_distances(&squared, n, kernel, settings.width(), progress)?;
            (affinity, Some(squared))
        }
    };
    progress.check()?;
    let (coordinates, intercepts) = match settings.initial {
        Initial::Random => (random_start(n, dimensions, seed), Vec::new()),
        Initial::Mds => {
            let squared = squared.unwrap_or_else(|| squared_distances(&affinity, kernel));
            mds_start(&classical_mds(&squared, n, dimensions)?, affinity.sigma().sqrt(), dimensions)
        }
    };
    fit(&affinity, dimensions, &coordinates, &intercepts, &settings.fit_options(), progress)
}

fn squared_between(data: &[f64], n: usize, p: usize, progress: &Progress) -> Result<Vec<f64>, EmbeddingError> {
    // The sum of the squared distances of all pairs stays finite.
    let largest = (0.1 * f64::MAX / p.max(1) as f64).sqrt() / n as f64;
    if let Some(i) = data.iter().position(|v| v.is_nan() || v.abs() >= largest) {
        return Err(EmbeddingError::NotFinite { point: i / p, component: i % p });
    }
    let point = |i: usize| &data[i * p..(i + 1) * p];
    let mut squared = vec![0.0; n * n];
    for i in 0..n {
        progress.check()?;
        for j in 0..i {
            let d: f64 = point(i).iter().zip(point(j)).map(|(a, b)| (a - b) * (a - b)).sum();
            squared[i * n + j] = d;
            squared[j * n + i] = d;
        }
    }
    Ok(squared)
}

fn squared_matrix(data: &[f64], n: usize) -> Result<Vec<f64>, EmbeddingError> {
    // The sum of the squares stays finite.
    let largest = f64::MAX.sqrt() / n as f64;
    let mut squared = vec![0.0; n * n];
    for row in 0..n {
        for column in (0..n).filter(|c| *c != row) {
            let value = data[row * n + column];
            if !(value >= 0.0 && value < largest) {
                return Err(EmbeddingError::DistanceOutOfRange { row, column, value });
            }
            squared[row * n + column] = (0.5 * (value + data[column * n + row])).powi(2);
        }
    }
    Ok(squared)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedding::flat_shapes::{misfit, rectangle};

    fn run(input: EmbedInput<'_>, dimensions: usize, settings: &EmbeddingSettings) -> Result<Fit, EmbeddingError> {
        embed(input, dimensions, settings, 0, &Progress::new())
    }

    fn scaled(fit: &Fit) -> Vec<f64> {
        fit.coordinates.iter().map(|c| c * fit.sigma.sqrt()).collect()
    }

    #[test]
    fn points_distances_and_affinities_of_a_plane_in_space_give_it_back() {
        let flat = rectangle(6, 9, 2.0, 3.0).points;
        let n = flat.len();
        // An isometric copy in five dimensions.
        let points: Vec<f64> = flat.iter().flat_map(|c| [0.6 * c.x, 0.8 * c.x, 7.0, 0.28 * c.y, 0.96 * c.y]).collect();
        let distances: Vec<f64> = (0..n * n).map(|k| (flat[k / n] - flat[k % n]).norm()).collect();
        let settings = EmbeddingSettings::default();
        let from_points = run(EmbedInput::Points { n, p: 5, data: &points }, 2, &settings).expect("valid");
        let from_distances = run(EmbedInput::Distances { n, data: &distances }, 2, &settings).expect("valid");
        assert!(misfit(&flat, &scaled(&from_points)) < 1e-10);
        assert!(misfit(&flat, &scaled(&from_distances)) < 1e-10);

        let sigma = from_points.sigma;
        let affinities: Vec<f64> = distances.iter().map(|d| 1.0 / (1.0 + (d * d / (2.0 * sigma)).exp())).collect();
        let fit = run(EmbedInput::Affinities { n, data: &affinities }, 2, &settings).expect("valid");
        let in_units: Vec<f64> = fit.coordinates.iter().map(|c| c * sigma.sqrt()).collect();
        assert!(misfit(&flat, &in_units) < 1e-7, "{}", misfit(&flat, &in_units));
    }

    #[test]
    fn any_dimension_and_both_models() {
        let n = 40;
        let data: Vec<f64> = random_start(n, 3, 5);
        for settings in [EmbeddingSettings::default(), EmbeddingSettings::paper()] {
            let mut last = f64::NEG_INFINITY;
            for dimensions in [1, 2, 3, 5] {
                let settings = EmbeddingSettings { tolerance: 1e-9, max_sweeps: 300, ..settings.clone() };
                let fit = run(EmbedInput::Points { n, p: 3, data: &data }, dimensions, &settings).expect("valid");
                assert_eq!(fit.coordinates.len(), n * dimensions);
                assert!(fit.log_likelihood >= last - 1e-3, "more dimensions fit better");
                last = fit.log_likelihood;
            }
        }
    }

    #[test]
    fn bad_input_is_named() {
        let settings = EmbeddingSettings::default();
        let points = |n, p, data: &[f64]| run(EmbedInput::Points { n, p, data }, 2, &settings);
        assert_eq!(points(3, 2, &[0.0; 5]), Err(EmbeddingError::WrongLength { expected: 6, found: 5 }));
        assert_eq!(points(2, 2, &[0.0; 4]), Err(EmbeddingError::TooFewPoints { points: 2, dimensions: 2 }));
        assert_eq!(points(3, 1, &[0.0; 3]), Err(EmbeddingError::NoExtent));
        assert_eq!(points(3, 0, &[]), Err(EmbeddingError::NoExtent));
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            let found = points(3, 2, &[0.0, 1.0, 2.0, bad, 0.0, 0.0]);
            assert_eq!(found, Err(EmbeddingError::NotFinite { point: 1, component: 1 }));
        }
        let mut data = [1.0; 9];
        let distances = |data: &[f64]| run(EmbedInput::Distances { n: 3, data }, 2, &settings);
        for bad in [-1.0, f64::INFINITY] {
            data[5] = bad;
            assert_eq!(distances(&data), Err(EmbeddingError::DistanceOutOfRange { row: 1, column: 2, value: bad }));
        }
        assert!(distances(&data[..4]).is_err());
        let affinities = run(EmbedInput::Affinities { n: 3, data: &[2.0; 9] }, 2, &settings);
        assert_eq!(affinities, Err(EmbeddingError::AffinityOutOfRange { row: 0, column: 1, value: 2.0 }));
        let isomap = EmbeddingSettings { model: Model::Isomap, ..settings.clone() };
        assert_eq!(run(EmbedInput::Distances { n: 3, data: &[1.0; 9] }, 2, &isomap), Err(EmbeddingError::NoLikelihood));
        let still = EmbeddingSettings { relaxation: 0.0, ..settings.clone() };
        let still = run(EmbedInput::Distances { n: 3, data: &[1.0; 9] }, 2, &still);
        assert!(matches!(still, Err(EmbeddingError::InvalidSetting { name: "relaxation", .. })));
        let none = run(EmbedInput::Distances { n: 3, data: &[1.0; 9] }, 0, &settings);
        assert!(matches!(none, Err(EmbeddingError::InvalidSetting { name: "dimensions", .. })));
    }
}
