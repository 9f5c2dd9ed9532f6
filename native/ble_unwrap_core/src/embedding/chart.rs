//! One chart: from the distances of its landmarks to a position in the plane a vertex.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::geodesics::LandmarkDistances;
use crate::linalg::{Mds, leading_mds};
use crate::mesh::VertexId;
use crate::progress::Progress;
use crate::random::normal;

use super::affinity::{Affinity, KernelWidth, kernel_width};
use super::bernoulli_logistic::fit;
use super::error::EmbeddingError;
use super::isomap;
use super::landmark_regression::LandmarkModel;
use super::settings::{EmbeddingSettings, Initial, Model};

/// Least extent along the second principal axis over the first: distances are kept to 6e-8, and the second
/// eigenvalue, its square, drowns in their rounding below about 1e-8.
const LEAST_ASPECT: f64 = 1e-4;
/// Residual of the two eigenpairs over the larger eigenvalue: below the rounding of the distances.
const SCALING_TOLERANCE: f64 = 1e-9;
/// Deviation of each coordinate of a random start, in units of √σ. At 1e-4 the first steps
/// explode, since the bound is nearly singular; at ½ no start tried did.
const RANDOM_DEVIATION: f64 = 0.5;

/// A chart in the plane, before its gauge is fixed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChartEmbedding {
    /// A position a vertex, in units of the surface; side, direction and place are arbitrary, and so is the
    /// scale of the printed model.
    pub uv: Vec<Point2<f64>>,
    /// Number of landmarks.
    pub landmarks: usize,
    /// The kernel width σ, in units of squared distance.
    pub sigma: f64,
    /// Sweeps of the fit; 0 for Isomap.
    pub sweeps: usize,
    /// Whether the fit reached its tolerance; true for Isomap.
    pub converged: bool,
    /// Log-likelihood (4) of the landmarks; `None` for Isomap.
    pub log_likelihood: Option<f64>,
    /// That at the start and after each sweep; empty for Isomap.
    pub trace: Vec<f64>,
}

/// Embeds a chart in the plane by the geodesic distances of its landmarks.
///
/// σ comes from the whole k×n block of distances (for a mean affinity, from the k×k block). Where distances are
/// exactly those of a plane figure, the default model returns that figure, from a classical scaling
/// start to the precision of the distances. If all vertices are landmarks, all are embedded together. The same
/// bytes for any number of threads. Not guaranteed: freedom from flips. O(k³ + sweeps·k² + kn) time,
/// O(k² + n) memory.
///
/// # Errors
/// [`EmbeddingError::InvalidSetting`]; [`EmbeddingError::TooFewLandmarks`] below three;
/// [`EmbeddingError::Unreachable`] names the first infinite distance; [`EmbeddingError::NoExtent`];
/// [`EmbeddingError::Collinear`] where classical scaling finds the landmarks thinner than 1 : 10,000
/// (a random start does not look); cancelled.
pub(crate) fn embed_chart(
    distances: &LandmarkDistances,
    settings: &EmbeddingSettings,
    seed: u64,
    progress: &Progress,
) -> Result<ChartEmbedding, EmbeddingError> {
    settings.validate()?;
    let k = distances.len();
    if k < 3 {
        return Err(EmbeddingError::TooFewLandmarks { found: k });
    }
    let mean_squared = mean_squared_distance(distances)?;
    let mut squared = distances.between_landmarks();
    squared.iter_mut().for_each(|d| *d *= *d);

    let mds = match (settings.model, settings.initial) {
        (Model::Isomap, _) | (_, Initial::Mds) => Some(planar_mds(&squared, k, progress)?),
        (_, Initial::Random) => None,
    };
    progress.check()?;
    if let (Model::Isomap, Some(mds)) = (settings.model, &mds) {
        let uv = isomap::place_all(mds, distances, progress)?;
        let uv = with_landmarks(uv, distances, |l| Point2::new(mds.point(l)[0], mds.point(l)[1]));
        let sigma = mean_squared;
        let (log_likelihood, trace) = (None, Vec::new());
        return Ok(ChartEmbedding { uv, landmarks: k, sigma, sweeps: 0, converged: true, log_likelihood, trace });
    }

    let kernel = settings.kernel();
    let sigma = match settings.width() {
        KernelWidth::Relative(c) => c * mean_squared,
        width => kernel_width(&squared, k, kernel, width, progress)?,
    };
    let width = KernelWidth::Absolute(sigma);
    let affinity = Affinity::from_squared_distances(&squared, k, kernel, width, progress)?;
    let (coordinates, intercepts) = match &mds {
        Some(mds) => mds_start(mds, sigma.sqrt(), 2),
        None => (random_start(k, 2, seed), Vec::new()),
    };
    let fit = fit(&affinity, 2, &coordinates, &intercepts, &settings.fit_options(), progress)?;

    let unit = sigma.sqrt();
    let placed = if every_vertex_is_a_landmark(distances) {
        vec![Point2::origin(); distances.vertex_count()]
    } else {
        let model = LandmarkModel::new(2, &fit.coordinates, &fit.intercepts, kernel, sigma);
        let parameters = model.place_all(distances, progress)?;
        parameters.chunks_exact(3).map(|theta| Point2::new(unit * theta[0], unit * theta[1])).collect()
    };
    let at = |l: usize| Point2::new(unit * fit.coordinates[2 * l], unit * fit.coordinates[2 * l + 1]);
    Ok(ChartEmbedding {
        uv: with_landmarks(placed, distances, at),
        landmarks: k,
        sigma,
        sweeps: fit.sweeps,
        converged: fit.converged,
        log_likelihood: Some(fit.log_likelihood),
        trace: fit.trace,
    })
}

/// Mean squared distance over the k×n block without the zeros of landmarks to themselves.
fn mean_squared_distance(distances: &LandmarkDistances) -> Result<f64, EmbeddingError> {
    let k = distances.len();
    let sums: Vec<f64> =
        (0..k).into_par_iter().map(|l| distances.row(l).iter().map(|&d| f64::from(d).powi(2)).sum()).collect();
    for (l, sum) in sums.iter().enumerate() {
        // Squares of single precision cannot overflow in double: only an infinite or undefined distance can.
        if let Some(v) = distances.row(l).iter().position(|d| !d.is_finite()).filter(|_| !sum.is_finite()) {
            let value = distances.get(l, VertexId::new(v));
            let (landmark, vertex) = (distances.landmarks()[l].index(), v);
            return Err(EmbeddingError::Unreachable { landmark, vertex, value });
        }
    }
    let pairs = k * distances.vertex_count() - k.min(k * distances.vertex_count());
    let mean = sums.iter().sum::<f64>() / pairs.max(1) as f64;
    if mean > 0.0 { Ok(mean) } else { Err(EmbeddingError::NoExtent) }
}

/// Classical scaling of the landmarks, which must span a plane.
fn planar_mds(squared: &[f64], k: usize, progress: &Progress) -> Result<Mds, EmbeddingError> {
    let mds = leading_mds(squared, k, 2, SCALING_TOLERANCE, progress).map_err(EmbeddingError::of_eigenvalues)?;
    let [first, second] = [mds.eigenvalues[0], mds.eigenvalues[1].max(0.0)];
    if first.is_nan() || first <= 0.0 {
        return Err(EmbeddingError::NoExtent);
    }
    let ratio = (second / first).sqrt();
    if ratio < LEAST_ASPECT || mds.dimensions < 2 { Err(EmbeddingError::Collinear { ratio }) } else { Ok(mds) }
}

/// Coordinates in units of √σ, zero in dimensions the scaling does not have, and intercepts −|x|²/2.
pub(super) fn mds_start(mds: &Mds, unit: f64, dimensions: usize) -> (Vec<f64>, Vec<f64>) {
    let mut coordinates = vec![0.0; mds.len() * dimensions];
    for (i, x) in coordinates.chunks_exact_mut(dimensions).enumerate() {
        x.iter_mut().zip(mds.point(i)).for_each(|(x, c)| *x = c / unit);
    }
    let norm = |x: &[f64]| x.iter().map(|c| c * c).sum::<f64>();
    let intercepts = coordinates.chunks_exact(dimensions).map(|x| -0.5 * norm(x)).collect();
    (coordinates, intercepts)
}

/// Normal coordinates from the seed; component c of point i is number iq + c.
pub(super) fn random_start(n: usize, dimensions: usize, seed: u64) -> Vec<f64> {
    (0..n * dimensions).map(|index| RANDOM_DEVIATION * normal(seed, index as u64)).collect()
}

fn every_vertex_is_a_landmark(distances: &LandmarkDistances) -> bool {
    let mut seen = vec![false; distances.vertex_count()];
    distances.landmarks().iter().for_each(|v| seen[v.index()] = true);
    seen.into_iter().all(|s| s)
}

/// Puts the landmarks where they were embedded.
fn with_landmarks(
    mut uv: Vec<Point2<f64>>,
    distances: &LandmarkDistances,
    at: impl Fn(usize) -> Point2<f64>,
) -> Vec<Point2<f64>> {
    for (l, v) in distances.landmarks().iter().enumerate() {
        uv[v.index()] = at(l);
    }
    uv
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedding::flat_shapes::{FlatShape, disc, ell, flips, misfit, rectangle};

    fn run(shape: &FlatShape, landmarks: usize, settings: &EmbeddingSettings) -> ChartEmbedding {
        embed_chart(&shape.distances(landmarks), settings, 11, &Progress::new()).expect("a plane figure")
    }

    fn flat(uv: &[Point2<f64>]) -> Vec<f64> {
        uv.iter().flat_map(|p| [p.x, p.y]).collect()
    }

    #[test]
    fn default_model_and_isomap_are_exact_on_flat_shapes() {
        for shape in [disc(9), rectangle(30, 10, 3.0, 1.0), ell(8)] {
            let n = shape.points.len();
            for landmarks in [n, 40, 4, 3] {
                for model in [Model::Default, Model::Isomap] {
                    let settings = EmbeddingSettings { model, ..EmbeddingSettings::default() };
                    let chart = run(&shape, landmarks, &settings);
                    let error = misfit(&shape.points, &flat(&chart.uv));
                    // Three or four landmarks of a long shape magnify the rounding of the distances.
                    let bound = if landmarks < 40 { 1e-4 } else { 1e-6 };
                    assert!(error < bound, "{model:?}, {landmarks} of {n} landmarks: {error:e}");
                    assert!(landmarks < 40 || flips(&shape, &chart.uv) == 0);
                }
            }
        }
    }

    #[test]
    fn printed_model_flips_as_documented() {
        // Exact distances, 1,000 vertices. A disc of evenly spaced rings is the one flat shape found that
        // the printed model can flatten, and only at the preset's kernel width.
        let share = |shape: &FlatShape, kernel_width| {
            let settings = EmbeddingSettings { kernel_width, ..EmbeddingSettings::paper() };
            let chart = run(shape, shape.points.len(), &settings);
            flips(shape, &chart.uv) as f64 / shape.triangles.len() as f64
        };
        let (square, round, long) = (rectangle(32, 32, 1.0, 1.0), disc(18), rectangle(55, 19, 3.0, 1.0));
        let found = [share(&square, None), share(&long, None), share(&round, None), share(&round, Some(0.3))];
        for (share, range) in found.iter().zip([0.04..0.12, 0.45..0.51, 0.0..0.02, 0.4..0.51]) {
            assert!(range.contains(share), "{found:?}");
        }
    }

    #[test]
    fn landmarks_lose_little_on_a_spherical_cap() {
        // Great-circle distances on a cap of 60 degrees, no plane figure's: all vertices against 60.
        let shape = disc(9);
        let n = shape.points.len();
        let unit = |p: &Point2<f64>| {
            let (angle, azimuth) = (p.coords.norm() * 60.0_f64.to_radians(), p.y.atan2(p.x));
            nalgebra::Vector3::new(angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin(), angle.cos())
        };
        let sphere: Vec<_> = shape.points.iter().map(unit).collect();
        let cap = |k: usize| {
            let landmarks = shape.distances(k).landmarks().to_vec();
            let from = |l: &VertexId| sphere.iter().map(|p| p.angle(&sphere[l.index()]) as f32).collect::<Vec<_>>();
            let rows = landmarks.iter().flat_map(from).collect();
            let distances = LandmarkDistances::new(landmarks, n, rows);
            embed_chart(&distances, &EmbeddingSettings::default(), 0, &Progress::new()).expect("spans a plane").uv
        };
        let (all, some) = (cap(n), cap(60));
        assert_eq!((flips(&shape, &all), flips(&shape, &some)), (0, 0));
        let apart = misfit(&all, &flat(&some));
        assert!(apart < 0.02, "{apart}");
    }

    #[test]
    fn scale_does_not_matter_and_threads_do_not_either() {
        let shape = ell(6);
        let (n, k) = (shape.points.len(), 30);
        let base = shape.distances(k);
        let run = |scale: f32, threads: usize| {
            let rows = (0..k).flat_map(|l| base.row(l).iter().map(|d| d * scale)).collect();
            let distances = LandmarkDistances::new(base.landmarks().to_vec(), n, rows);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
            pool.install(|| embed_chart(&distances, &EmbeddingSettings::default(), 0, &Progress::new()))
                .expect("a plane figure")
        };
        assert_eq!(run(1.0, 1), run(1.0, 4));
        let (one, large) = (run(1.0, 1), run(2.0_f32.powi(40), 1));
        for (a, b) in one.uv.iter().zip(&large.uv) {
            assert!((a * 2.0_f64.powi(40) - b).norm() < 1e-6 * 2.0_f64.powi(40));
        }
    }

    #[test]
    fn the_seed_decides_a_random_start() {
        let shape = disc(4);
        let settings = EmbeddingSettings { initial: Initial::Random, ..EmbeddingSettings::default() };
        let distances = shape.distances(shape.points.len());
        let run = |seed| embed_chart(&distances, &settings, seed, &Progress::new()).expect("a plane figure");
        assert_eq!(run(1), run(1));
        assert_ne!(run(1).uv, run(2).uv);
        assert!(misfit(&shape.points, &flat(&run(1).uv)) < 0.05);
    }

    #[test]
    fn degenerate_charts_have_clear_errors() {
        let settings = EmbeddingSettings::default();
        let run = |n: usize, k: usize, d: &dyn Fn(usize, usize) -> f32| {
            let rows = (0..k).flat_map(|l| (0..n).map(move |v| (l, v))).map(|(l, v)| d(l, v)).collect();
            let distances = LandmarkDistances::new((0..k).map(VertexId::new).collect(), n, rows);
            embed_chart(&distances, &settings, 0, &Progress::new())
        };
        let line = |l: usize, v: usize| (l as f32 - v as f32).abs();
        assert_eq!(run(5, 2, &line), Err(EmbeddingError::TooFewLandmarks { found: 2 }));
        assert_eq!(run(0, 0, &line), Err(EmbeddingError::TooFewLandmarks { found: 0 }));
        assert!(matches!(run(9, 6, &line), Err(EmbeddingError::Collinear { .. })));
        assert_eq!(run(9, 6, &|_, _| 0.0), Err(EmbeddingError::NoExtent));
        assert_eq!(run(3, 3, &|_, _| 0.0), Err(EmbeddingError::NoExtent));
        let torn = |l: usize, v: usize| if v == 7 { f32::INFINITY } else { line(l, v) };
        let (landmark, vertex) = (0, 7);
        let value = f64::INFINITY;
        assert_eq!(run(9, 6, &torn), Err(EmbeddingError::Unreachable { landmark, vertex, value }));
        let nan = |_: usize, v: usize| if v == 7 { f32::NAN } else { 1.0 };
        assert!(matches!(run(9, 6, &nan), Err(EmbeddingError::Unreachable { .. })));
    }

    #[test]
    fn cancel_is_heard() {
        let progress = Progress::new();
        progress.cancel();
        let result = embed_chart(&disc(3).distances(10), &EmbeddingSettings::default(), 0, &progress);
        assert!(matches!(result, Err(EmbeddingError::Cancelled(_))));
    }
}
