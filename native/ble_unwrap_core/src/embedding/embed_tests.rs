//! Tests of [`embed()`] and [`Embedding::transform`].

use nalgebra::Point2;
use proptest::prelude::*;

use super::affinity::{Kernel, KernelWidth};
use super::embed::{EmbedOptions, embed};
use super::embedded::Embedding;
use super::error::EmbeddingError;
use super::flat_shapes::{disc, ell, misfit, rectangle};
use super::input::{EmbedInput, PointMetric};
use super::settings::{EmbeddingSettings, Initial, Model};
use crate::linalg::classical_mds;
use crate::progress::Progress;
use crate::random::normal;

const GEODESIC: PointMetric = PointMetric::Geodesic { neighbours: 8 };

fn run(
    input: EmbedInput<'_>,
    options: &EmbedOptions<'_>,
    settings: &EmbeddingSettings,
) -> Result<Embedding, EmbeddingError> {
    embed(input, options, settings, &Progress::new())
}

fn with(dimensions: usize) -> EmbedOptions<'static> {
    EmbedOptions { dimensions, ..EmbedOptions::default() }
}

fn euclidean(data: &[f64], p: usize) -> EmbedInput<'_> {
    EmbedInput::Points { n: data.len() / p, p, data, metric: PointMetric::Euclidean }
}

fn flat(points: &[Point2<f64>]) -> Vec<f64> {
    points.iter().flat_map(|c| [c.x, c.y]).collect()
}

fn distances(points: &[Point2<f64>]) -> Vec<f64> {
    points.iter().flat_map(|a| points.iter().map(move |b| (a - b).norm())).collect()
}

fn affinities(points: &[Point2<f64>], sigma: f64) -> Vec<f64> {
    distances(points).iter().map(|d| Kernel::Logistic.affinity(d * d / (2.0 * sigma))).collect()
}

/// In units of distance.
fn scaled(embedding: &Embedding) -> Vec<f64> {
    embedding.coordinates.iter().map(|c| c * embedding.sigma.sqrt()).collect()
}

#[test]
fn flat_shapes_come_back_from_points_distances_and_affinities() {
    let settings = EmbeddingSettings::default();
    for shape in [disc(6), rectangle(24, 8, 3.0, 1.0), ell(6)] {
        let n = shape.points.len();
        // An isometric copy in five dimensions.
        let lifted: Vec<f64> =
            shape.points.iter().flat_map(|c| [0.6 * c.x, 0.8 * c.x, 7.0, 0.28 * c.y, 0.96 * c.y]).collect();
        let (straight, sigma) = (distances(&shape.points), 0.2);
        let likely = affinities(&shape.points, sigma);
        for landmarks in [None, Some(40)] {
            let options = EmbedOptions { landmarks, ..with(2) };
            let found = run(euclidean(&lifted, 5), &options, &settings).expect("valid");
            assert!(misfit(&shape.points, &scaled(&found)) < 1e-6);
            let found = run(EmbedInput::Distances { n, data: &straight }, &options, &settings).expect("valid");
            assert!(misfit(&shape.points, &scaled(&found)) < 1e-6);
            let found = run(EmbedInput::Affinities { n, data: &likely }, &options, &settings).expect("valid");
            let in_units: Vec<f64> = found.coordinates.iter().map(|c| c * sigma.sqrt()).collect();
            assert!(misfit(&shape.points, &in_units) < 1e-6, "{}", misfit(&shape.points, &in_units));
            assert_eq!(found.landmarks.len(), landmarks.unwrap_or(n));
        }
    }
}

#[test]
fn an_l_bends_under_geodesic_distances() {
    // Paths around the notch are longer than straight lines: no plane figure has these distances. With a 12-neighbour
    // graph the L comes back bent open by some 5 % of its size, Isomap by more.
    let shape = ell(10);
    let data = flat(&shape.points);
    let input = EmbedInput::Points {
        n: shape.points.len(),
        p: 2,
        data: &data,
        metric: PointMetric::Geodesic { neighbours: 12 },
    };
    let error = |model| {
        let settings = EmbeddingSettings { model, ..EmbeddingSettings::default() };
        misfit(&shape.points, &scaled(&run(input, &with(2), &settings).expect("connected")))
    };
    let (ours, isomap) = (error(Model::Default), error(Model::Isomap));
    assert!((0.02..0.15).contains(&ours) && isomap > ours, "{ours} {isomap}");
}

#[test]
fn compact_shapes_come_back_from_random_starts() {
    for (shape, seeds) in [(disc(4), 0..4), (rectangle(8, 8, 1.0, 1.0), 4..8)] {
        let data = flat(&shape.points);
        for seed in seeds {
            let settings = EmbeddingSettings {
                initial: Initial::Random,
                max_sweeps: 4000,
                tolerance: 1e-14,
                ..EmbeddingSettings::default()
            };
            let found = run(euclidean(&data, 2), &EmbedOptions { seed, ..with(2) }, &settings).expect("valid");
            let error = misfit(&shape.points, &scaled(&found));
            assert!(error < 1e-3, "{seed}: {error:e} after {} sweeps", found.sweeps);
            assert!(found.trace.windows(2).all(|w| w[1] >= w[0] - 1e-9));
        }
    }
}

#[test]
fn any_dimension_both_models_with_and_without_landmarks() {
    let (n, p) = (60, 4);
    let data: Vec<f64> = (0..n * p).map(|k| normal(5, k as u64)).collect();
    for settings in [EmbeddingSettings::default(), EmbeddingSettings::paper()] {
        let mut last = f64::NEG_INFINITY;
        for dimensions in [1, 2, 3, 5] {
            let settings = EmbeddingSettings { tolerance: 1e-9, max_sweeps: 300, ..settings.clone() };
            let all = run(euclidean(&data, p), &with(dimensions), &settings).expect("valid");
            assert_eq!(all.coordinates.len(), n * dimensions);
            let f = all.log_likelihood.expect("fitted");
            assert!(f >= last - 1e-3 * f.abs(), "more dimensions fit better: {last} {f}");
            assert!((all.bregman.expect("fitted") >= 0.0) && all.trace.last() == Some(&f));
            last = f;
            let some = run(euclidean(&data, p), &EmbedOptions { landmarks: Some(20), ..with(dimensions) }, &settings);
            let some = some.expect("valid");
            assert_eq!((some.coordinates.len(), some.landmarks.len()), (n * dimensions, 20));
            assert!(some.coordinates.iter().all(|c| c.is_finite()));
            assert_eq!(some.intercepts.len(), all.intercepts.len());
        }
    }
}

#[test]
fn points_of_as_many_dimensions_come_back_exactly_by_landmarks() {
    for q in [1, 2, 3, 4] {
        let n = 200;
        let data: Vec<f64> = (0..n * q).map(|k| normal(9, k as u64)).collect();
        let options = EmbedOptions { landmarks: Some(30), ..with(q) };
        let found = scaled(&run(euclidean(&data, q), &options, &EmbeddingSettings::default()).expect("valid"));
        let square =
            |x: &[f64], i: usize, j: usize| (0..q).map(|c| (x[i * q + c] - x[j * q + c]).powi(2)).sum::<f64>().sqrt();
        for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let (a, b) = (square(&data, i, j), square(&found, i, j));
            assert!((a - b).abs() < 1e-6, "q = {q}: {i} {j} {a} {b}");
        }
    }
}

#[test]
fn a_start_by_landmarks_is_exact_where_scaling_is_and_better_elsewhere() {
    let shape = rectangle(36, 18, 2.0, 1.0);
    let data = flat(&shape.points);
    let found = run(euclidean(&data, 2), &with(2), &EmbeddingSettings::default()).expect("valid");
    assert!(misfit(&shape.points, &scaled(&found)) < 1e-6 && found.sweeps <= 2);

    let (space, _) = roll(600);
    let input = EmbedInput::Points { n: 600, p: 3, data: &space, metric: GEODESIC };
    let found = run(input, &with(2), &EmbeddingSettings::default()).expect("connected");
    let isomap = EmbeddingSettings { model: Model::Isomap, ..EmbeddingSettings::default() };
    let scaling = run(input, &with(2), &isomap).expect("connected");
    let start: Vec<f64> = scaling.coordinates.iter().map(|c| c / found.sigma.sqrt()).collect();
    let options = EmbedOptions { start: Some(&start), ..with(2) };
    let other = run(input, &options, &EmbeddingSettings::default()).expect("connected");
    assert!(found.trace[0] > other.trace[0] && found.sweeps <= other.sweeps, "{:?} {:?}", found.trace, other.trace);
    let (f, g) = (found.log_likelihood.expect("fitted"), other.log_likelihood.expect("fitted"));
    assert!((f / g - 1.0).abs() < 1e-4, "the same maximum: {f} {g}");
}

#[test]
fn landmarks_lie_far_apart() {
    let data: Vec<f64> = (0..=16).map(f64::from).collect();
    let options = EmbedOptions { landmarks: Some(5), ..with(1) };
    let found = run(euclidean(&data, 1), &options, &EmbeddingSettings::default()).expect("valid");
    assert_eq!(found.landmarks, [0, 16, 8, 4, 12]);
    let geodesic = EmbedInput::Points { n: 17, p: 1, data: &data, metric: PointMetric::Geodesic { neighbours: 2 } };
    let found = run(geodesic, &options, &EmbeddingSettings::default()).expect("valid");
    assert_eq!(found.landmarks, [16, 0, 8, 4, 12]);
    let straight: Vec<f64> = (0..289).map(|k| (f64::from(k / 17) - f64::from(k % 17)).abs()).collect();
    let found = run(EmbedInput::Distances { n: 17, data: &straight }, &options, &EmbeddingSettings::default());
    assert_eq!(found.expect("valid").landmarks, [16, 0, 8, 4, 12]);
    // Points in few places: as many landmarks as places.
    let few: Vec<f64> = (0..30).flat_map(|i| [f64::from(i % 2), f64::from(i / 2 % 3)]).collect();
    let options = EmbedOptions { landmarks: Some(20), ..with(2) };
    let found = run(euclidean(&few, 2), &options, &EmbeddingSettings::default()).expect("valid");
    assert_eq!(found.landmarks.len(), 6);
    let one_place = run(euclidean(&[1.0; 60], 2), &options, &EmbeddingSettings::default());
    assert_eq!(one_place.err(), Some(EmbeddingError::NoExtent));
}

/// A sheet rolled up in space, and the sheet.
fn roll(n: usize) -> (Vec<f64>, Vec<Point2<f64>>) {
    let mut space = Vec::new();
    let mut sheet = Vec::new();
    for i in 0..n {
        // An even spiral: arc length s along a curve of radius growing with the angle.
        let (u, v) = ((i as f64 * 0.618_033_988_75).fract(), (i as f64 + 0.5) / n as f64);
        let angle = (20.25 + 70.0 * u).sqrt();
        space.extend([angle * angle.cos(), 8.0 * v, angle * angle.sin()]);
        let arc = |a: f64| 0.5 * (a * (1.0 + a * a).sqrt() + a.asinh());
        sheet.push(Point2::new(arc(angle) - arc(4.5), 8.0 * v));
    }
    (space, sheet)
}

#[test]
fn geodesic_distances_unroll_a_sheet() {
    let (space, sheet) = roll(800);
    let input = EmbedInput::Points { n: 800, p: 3, data: &space, metric: PointMetric::Geodesic { neighbours: 12 } };
    for landmarks in [None, Some(80)] {
        let options = EmbedOptions { landmarks, ..with(2) };
        let found = run(input, &options, &EmbeddingSettings::default()).expect("connected");
        let error = misfit(&sheet, &scaled(&found));
        assert!(error < 0.05, "{landmarks:?}: {error}");
        let straight = run(euclidean(&space, 3), &options, &EmbeddingSettings::default()).expect("valid");
        assert!(misfit(&sheet, &scaled(&straight)) > 0.5, "straight distances see no sheet");
    }
}

#[test]
fn transform_places_new_points_of_every_kind() {
    let shape = rectangle(9, 12, 2.0, 3.0);
    let n = shape.points.len();
    let data = flat(&shape.points);
    let new: Vec<Point2<f64>> = (0..25).map(|i| Point2::new(0.4 * f64::from(i % 5), 0.7 * f64::from(i / 5))).collect();
    let both: Vec<Point2<f64>> = shape.points.iter().chain(&new).copied().collect();
    let sigma = 0.3;
    for model in [Model::Default, Model::Isomap] {
        for landmarks in [None, Some(25)] {
            let settings = EmbeddingSettings { model, ..EmbeddingSettings::default() };
            let options = EmbedOptions { landmarks, ..with(2) };
            let check = |embedding: &Embedding, rows: &[f64], unit: f64, what: &str| {
                let columns = embedding.columns();
                assert_eq!(rows.len(), 25 * columns);
                let placed = embedding.transform(rows, 25, columns, &Progress::new()).expect("valid");
                let all: Vec<f64> = embedding.coordinates.iter().chain(&placed).map(|c| c * unit).collect();
                let error = misfit(&both, &all);
                assert!(error < 1e-6, "{model:?} {landmarks:?} {what}: {error:e}");
            };
            let found = run(euclidean(&data, 2), &options, &settings).expect("valid");
            check(&found, &flat(&new), found.sigma.sqrt(), "points");

            let to_landmarks = |points: &[usize]| -> Vec<f64> {
                new.iter()
                    .flat_map(|a| points.iter().map(move |l| (a, *l)))
                    .map(|(a, l)| (a - shape.points[l]).norm())
                    .collect()
            };
            let straight = distances(&shape.points);
            let found = run(EmbedInput::Distances { n, data: &straight }, &options, &settings).expect("valid");
            check(&found, &to_landmarks(&found.landmarks), found.sigma.sqrt(), "distances");

            let likely = affinities(&shape.points, sigma);
            let found = run(EmbedInput::Affinities { n, data: &likely }, &options, &settings).expect("valid");
            let rows: Vec<f64> = to_landmarks(&found.landmarks)
                .iter()
                .map(|d| Kernel::Logistic.affinity(d * d / (2.0 * sigma)))
                .collect();
            check(&found, &rows, sigma.sqrt(), "affinities");
        }
    }
}

#[test]
fn transform_leaves_fitted_points_nearly_where_they_are() {
    let (space, _) = roll(500);
    for metric in [PointMetric::Euclidean, GEODESIC] {
        for landmarks in [None, Some(60)] {
            for settings in [EmbeddingSettings::default(), EmbeddingSettings::paper()] {
                let settings = EmbeddingSettings { max_sweeps: 400, tolerance: 1e-9, ..settings };
                let input = EmbedInput::Points { n: 500, p: 3, data: &space, metric };
                let found = run(input, &EmbedOptions { landmarks, ..with(2) }, &settings).expect("connected");
                let again = found.transform(&space, 500, 3, &Progress::new()).expect("valid");
                let size: f64 = found.coordinates.iter().map(|c| c * c).sum();
                let error: f64 = found.coordinates.iter().zip(&again).map(|(a, b)| (a - b).powi(2)).sum();
                let error = (error / size).sqrt();
                assert!(error < 0.02, "{metric:?} {landmarks:?} {:?}: {error}", settings.model);
            }
        }
    }
}

#[test]
fn isomap_is_classical_and_landmark_scaling_of_the_same_distances() {
    let (space, sheet) = roll(300);
    let isomap = EmbeddingSettings { model: Model::Isomap, ..EmbeddingSettings::default() };
    let n = 300;
    let straight: Vec<f64> = (0..n * n)
        .map(|k| (0..3).map(|c| (space[k / n * 3 + c] - space[k % n * 3 + c]).powi(2)).sum::<f64>().sqrt())
        .collect();
    let squared: Vec<f64> = straight.iter().map(|d| d * d).collect();
    let whole = classical_mds(&squared, n, 2).expect("finite");
    let found = run(EmbedInput::Distances { n, data: &straight }, &with(2), &isomap).expect("valid");
    assert!(found.coordinates.iter().zip(&whole.coordinates).all(|(a, b)| (a - b).abs() < 1e-6));
    assert_eq!((found.log_likelihood, found.bregman, found.mean_affinity), (None, None, None));
    assert!(found.trace.is_empty() && found.intercepts.is_empty() && found.sweeps == 0 && found.sigma == 1.0);

    let geodesic = EmbedInput::Points { n, p: 3, data: &space, metric: GEODESIC };
    for landmarks in [None, Some(50)] {
        let found = run(geodesic, &EmbedOptions { landmarks, ..with(2) }, &isomap).expect("connected");
        let error = misfit(&sheet, &found.coordinates);
        assert!(error < 0.1, "{landmarks:?}: {error}");
    }
}

#[test]
fn a_given_start_is_taken() {
    let shape = disc(5);
    let (data, n) = (flat(&shape.points), shape.points.len());
    let settings = EmbeddingSettings { tolerance: 1e-7, max_sweeps: 300, ..EmbeddingSettings::default() };
    let first = run(euclidean(&data, 2), &with(2), &settings).expect("valid");
    let options = EmbedOptions { start: Some(&first.coordinates), ..with(2) };
    let again = run(euclidean(&data, 2), &options, &settings).expect("valid");
    assert!(again.sweeps <= 2, "{}", again.sweeps);
    assert!(again.coordinates.iter().zip(&first.coordinates).all(|(a, b)| (a - b).abs() < 1e-6));
    // A turned start gives the turned result, by landmarks, too.
    let turned: Vec<f64> = first.coordinates.chunks_exact(2).flat_map(|c| [-c[1], c[0]]).collect();
    for landmarks in [None, Some(30)] {
        let options = EmbedOptions { start: Some(&turned), landmarks, ..with(2) };
        let found = run(euclidean(&data, 2), &options, &settings).expect("valid");
        assert!(found.coordinates.iter().zip(&turned).all(|(a, b)| (a - b).abs() < 1e-4), "{landmarks:?}");
    }
    let short = EmbedOptions { start: Some(&turned[1..]), ..with(2) };
    let expected = EmbeddingError::WrongLength { expected: 2 * n, found: 2 * n - 1 };
    assert_eq!(run(euclidean(&data, 2), &short, &settings).err(), Some(expected));
    let mut bad = turned.clone();
    bad[5] = f64::NAN;
    let bad = EmbedOptions { start: Some(&bad), ..with(2) };
    let expected = EmbeddingError::StartNotFinite { point: 2, component: 1 };
    assert_eq!(run(euclidean(&data, 2), &bad, &settings).err(), Some(expected));
}

#[test]
fn truncation_gives_what_it_would_of_all_distances() {
    let (space, _) = roll(400);
    let n = 400;
    for (settings, least) in [(EmbeddingSettings::default(), 0.01), (EmbeddingSettings::paper(), 0.02)] {
        let settings = EmbeddingSettings { max_sweeps: 200, tolerance: 1e-8, initial: Initial::Mds, ..settings };
        for metric in [PointMetric::Euclidean, GEODESIC] {
            let input = EmbedInput::Points { n, p: 3, data: &space, metric };
            let options = EmbedOptions { truncation: least, width: Some(KernelWidth::Absolute(20.0)), ..with(2) };
            let found = run(input, &options, &settings).expect("connected");
            // The same from a matrix of all distances, which is truncated afterwards.
            let matrix = super::source::Source::new(input, &Progress::new()).expect("connected");
            let straight: Vec<f64> = matrix.matrix(&Progress::new()).expect("fits").iter().map(|d| d.sqrt()).collect();
            let other = run(EmbedInput::Distances { n, data: &straight }, &options, &settings).expect("valid");
            assert!((found.mean_affinity.expect("fitted") - other.mean_affinity.expect("fitted")).abs() < 1e-12);
            let (f, g) = (found.log_likelihood.expect("fitted"), other.log_likelihood.expect("fitted"));
            assert!((f / g - 1.0).abs() < 1e-3, "{metric:?} {:?}: {f} {g}", settings.model);
            // New points, too.
            let placed = found.transform(&space[..30], 10, 3, &Progress::new()).expect("valid");
            let size = found.coordinates.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            assert!(placed.iter().zip(&found.coordinates).all(|(a, b)| (a - b).abs() < 0.1 * size));
            // A relative width comes from the landmarks.
            let relative = EmbedOptions { truncation: least, ..with(2) };
            assert!(run(input, &relative, &EmbeddingSettings { kernel_width: Some(0.1), ..settings.clone() }).is_ok());
        }
    }
}

#[test]
fn widths_are_what_they_say() {
    let shape = disc(6);
    let data = flat(&shape.points);
    let settings = EmbeddingSettings::default();
    for landmarks in [None, Some(40)] {
        let fitted = |width| {
            let options = EmbedOptions { width, landmarks, ..with(2) };
            run(euclidean(&data, 2), &options, &settings).expect("valid")
        };
        assert_eq!(fitted(Some(KernelWidth::Absolute(0.37))).sigma, 0.37);
        let mean = fitted(Some(KernelWidth::MeanAffinity(0.2))).mean_affinity.expect("fitted");
        assert!((mean - 0.2).abs() < 1e-5);
        // All pairs, also by landmarks.
        let n = shape.points.len() as f64;
        let mean: f64 = distances(&shape.points).iter().map(|d| d * d).sum::<f64>() / (n * (n - 1.0));
        assert!((fitted(None).sigma / (0.2 * mean) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn threads_and_asymmetry_do_not_matter() {
    let (space, _) = roll(300);
    for (metric, landmarks) in [(PointMetric::Euclidean, None), (GEODESIC, None), (GEODESIC, Some(40))] {
        let input = EmbedInput::Points { n: 300, p: 3, data: &space, metric };
        let once = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
            let options = EmbedOptions { landmarks, ..with(2) };
            pool.install(|| run(input, &options, &EmbeddingSettings::default())).expect("connected").coordinates
        };
        assert_eq!(once(1), once(3), "{metric:?} {landmarks:?}");
    }
    let points: Vec<Point2<f64>> = (0..30).map(|i| Point2::new(normal(1, i), normal(2, i))).collect();
    let (d, p) = (distances(&points), affinities(&points, 0.3));
    let skew = |values: &[f64], by: f64| -> Vec<f64> {
        (0..900).map(|k| values[k] * if k / 30 < k % 30 { 1.0 + by } else { 1.0 - by }).collect()
    };
    let settings = EmbeddingSettings::default();
    for landmarks in [None, Some(12)] {
        let options = EmbedOptions { landmarks, ..with(2) };
        let of = |input: EmbedInput<'_>| run(input, &options, &settings).expect("valid").coordinates;
        let close = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6);
        let straight = of(EmbedInput::Distances { n: 30, data: &d });
        assert!(close(of(EmbedInput::Distances { n: 30, data: &skew(&d, 0.25) }), straight));
        let likely = of(EmbedInput::Affinities { n: 30, data: &p });
        assert!(close(of(EmbedInput::Affinities { n: 30, data: &skew(&p, 0.25) }), likely));
    }
}

#[test]
fn bad_input_is_named() {
    let settings = EmbeddingSettings::default();
    let points = |n, p, data: &[f64]| {
        run(EmbedInput::Points { n, p, data, metric: PointMetric::Euclidean }, &with(2), &settings).err()
    };
    assert_eq!(points(3, 2, &[0.0; 5]), Some(EmbeddingError::WrongLength { expected: 6, found: 5 }));
    assert_eq!(points(usize::MAX, 2, &[]), Some(EmbeddingError::WrongLength { expected: usize::MAX, found: 0 }));
    assert_eq!(points(2, 2, &[0.0; 4]), Some(EmbeddingError::TooFewPoints { points: 2, dimensions: 2 }));
    assert_eq!(points(3, 1, &[0.0; 3]), Some(EmbeddingError::NoExtent));
    assert_eq!(points(3, 0, &[]), Some(EmbeddingError::NoExtent));
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let found = points(3, 2, &[0.0, 1.0, 2.0, bad, 0.0, 0.0]);
        assert_eq!(found, Some(EmbeddingError::NotFinite { point: 1, component: 1 }));
    }
    let mut data = [1.0; 9];
    let straight = |data: &[f64]| run(EmbedInput::Distances { n: 3, data }, &with(2), &settings).err();
    for bad in [-1.0, f64::INFINITY] {
        data[5] = bad;
        let found = straight(&data).expect("an error");
        assert_eq!(found, EmbeddingError::DistanceOutOfRange { row: 1, column: 2, value: bad });
        assert_eq!(found.to_string().contains("pieces"), bad > 0.0, "{found}");
    }
    data[5] = 1.0;
    data[4] = f64::NAN;
    assert_eq!(straight(&data), None, "the diagonal does not matter");
    assert!(straight(&data[..4]).is_some());
    let likely = run(EmbedInput::Affinities { n: 3, data: &[2.0; 9] }, &with(2), &settings).err();
    assert_eq!(likely, Some(EmbeddingError::AffinityOutOfRange { row: 0, column: 1, value: 2.0 }));

    let square = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let named = |options: &EmbedOptions<'_>, settings: &EmbeddingSettings| match run(
        euclidean(&square, 2),
        options,
        settings,
    ) {
        Err(EmbeddingError::InvalidSetting { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    let wide = |width| EmbedOptions { width: Some(width), ..with(2) };
    assert_eq!(named(&wide(KernelWidth::Absolute(0.0)), &settings), "sigma");
    assert_eq!(named(&wide(KernelWidth::Absolute(-1.0)), &settings), "sigma");
    assert_eq!(named(&wide(KernelWidth::Relative(f64::NAN)), &settings), "kernel_width");
    assert_eq!(named(&wide(KernelWidth::MeanAffinity(0.5)), &settings), "mean_affinity");
    assert_eq!(named(&with(0), &settings), "dimensions");
    for truncation in [-0.1, f64::NAN, 0.5] {
        assert_eq!(named(&EmbedOptions { truncation, ..with(2) }, &settings), "truncation");
    }
    for relaxation in [0.0, 2.0, -1.0, f64::NAN] {
        assert_eq!(named(&with(2), &EmbeddingSettings { relaxation, ..settings.clone() }), "relaxation");
    }
    assert_eq!(named(&EmbedOptions { landmarks: Some(2), ..with(2) }, &settings), "landmarks");
    let started =
        |start: &[f64]| run(euclidean(&square, 2), &EmbedOptions { start: Some(start), ..with(2) }, &settings).err();
    let nan = [1.0, 1.0, 1.0, f64::NAN, 1.0, 1.0, 1.0, 1.0];
    assert_eq!(started(&nan), Some(EmbeddingError::StartNotFinite { point: 1, component: 1 }));
    assert_eq!(started(&[0.0; 8]), Some(EmbeddingError::StartAtSaddle));
    for scale in [1e-157, 1e40] {
        let scaled: Vec<f64> = square.iter().map(|v| scale * v).collect();
        let found = run(euclidean(&scaled, 2), &with(2), &settings).err();
        assert_eq!(found, Some(EmbeddingError::OutOfScale { what: "coordinate", largest: scale }));
    }
    let two_places: Vec<f64> = (0..40).flat_map(|i| [f64::from(i % 2), 0.0]).collect();
    let found = run(euclidean(&two_places, 2), &EmbedOptions { landmarks: Some(5), ..with(2) }, &settings).err();
    assert_eq!(found, Some(EmbeddingError::TooFewPlaces { places: 2, dimensions: 2 }));
}

#[test]
fn narrow_kernels_and_far_points_are_placed_among_landmarks() {
    // Landmarks further apart than the kernel sees: only the anchor says where the other points are.
    let points: Vec<Point2<f64>> =
        (0..800).map(|i| Point2::new((f64::from(i) * 0.618).fract(), (f64::from(i) * 0.383).fract())).collect();
    let data = flat(&points);
    for width in [0.2, 0.01, 1e-3, 1e-4] {
        let options = EmbedOptions { landmarks: Some(20), width: Some(KernelWidth::Relative(width)), ..with(2) };
        let found = run(euclidean(&data, 2), &options, &EmbeddingSettings::default()).expect("valid");
        assert!(misfit(&points, &scaled(&found)) < 1e-3, "{width}: {}", misfit(&points, &scaled(&found)));
        let far = found.transform(&[20.0, 0.5], 1, 2, &Progress::new()).expect("valid");
        let apart = (0..2).map(|c| (far[c] - found.coordinates[c]).powi(2)).sum::<f64>().sqrt() * found.sigma.sqrt();
        let expected = (Point2::new(20.0, 0.5) - points[0]).norm();
        assert!((apart / expected - 1.0).abs() < 0.01, "{width}: {apart} {expected}");
    }
}

#[test]
fn separate_pieces_are_counted() {
    let data: Vec<f64> = (0..30).flat_map(|i| [f64::from(i % 10), 100.0 * f64::from(i / 10)]).collect();
    let input =
        |neighbours| EmbedInput::Points { n: 30, p: 2, data: &data, metric: PointMetric::Geodesic { neighbours } };
    let found = run(input(3), &with(2), &EmbeddingSettings::default()).expect_err("three rows");
    assert_eq!(
        found,
        EmbeddingError::Disconnected { neighbours: 3, pieces: 3, points: 30, largest: 10, enough: Some(10) }
    );
    assert!(found.to_string().contains("3 pieces") && found.to_string().contains("raise neighbours to 10"), "{found}");
    assert!(run(input(12), &with(2), &EmbeddingSettings::default()).is_ok());
    let none = run(input(0), &with(2), &EmbeddingSettings::default());
    assert!(matches!(none, Err(EmbeddingError::InvalidSetting { name: "neighbours", .. })));
}

#[test]
fn transform_names_what_is_wrong() {
    let shape = disc(3);
    let (data, n) = (flat(&shape.points), shape.points.len());
    let settings = EmbeddingSettings::default();
    let found = run(euclidean(&data, 2), &with(2), &settings).expect("valid");
    let wrong = found.transform(&[0.0; 6], 2, 3, &Progress::new()).expect_err("two columns");
    assert_eq!(wrong, EmbeddingError::WrongColumns { expected: 2, what: "coordinates a point", found: 3 });
    assert_eq!(wrong.to_string(), "expected 2 coordinates a point, found 3");
    let short = found.transform(&[0.0; 5], 3, 2, &Progress::new());
    assert_eq!(short, Err(EmbeddingError::WrongLength { expected: 6, found: 5 }));
    let nan = found.transform(&[0.0, 0.0, f64::NAN, 0.0], 2, 2, &Progress::new());
    assert_eq!(nan, Err(EmbeddingError::NotFinite { point: 1, component: 0 }));
    assert_eq!(found.transform(&[], 0, 2, &Progress::new()), Ok(vec![]));

    let straight = distances(&shape.points);
    let found = run(EmbedInput::Distances { n, data: &straight }, &with(2), &settings).expect("valid");
    // As many rows as columns: still no diagonal to ignore.
    let mut rows = straight.clone();
    rows[n + 1] = -1.0;
    let negative = found.transform(&rows, n, n, &Progress::new());
    assert_eq!(negative, Err(EmbeddingError::DistanceOutOfRange { row: 1, column: 1, value: -1.0 }));
    let progress = Progress::new();
    progress.cancel();
    assert!(matches!(found.transform(&straight, n, n, &progress), Err(EmbeddingError::Cancelled(_))));
}

#[test]
fn cancel_is_heard_everywhere() {
    let progress = Progress::new();
    progress.cancel();
    let (space, _) = roll(300);
    for metric in [PointMetric::Euclidean, GEODESIC] {
        for landmarks in [None, Some(20)] {
            let input = EmbedInput::Points { n: 300, p: 3, data: &space, metric };
            let options = EmbedOptions { landmarks, ..with(2) };
            let found = embed(input, &options, &EmbeddingSettings::default(), &progress);
            assert!(matches!(found, Err(EmbeddingError::Cancelled(_))));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever the points, coincident or on a line, there is an answer of finite numbers or an error; never a panic.
    #[test]
    fn any_points_give_finite_numbers_or_an_error(
        coordinates in prop::collection::vec(-3i32..4, 0..90),
        p in 1..4usize,
        q in 1..4usize,
        landmarks in prop::option::of(0..12usize),
        model in prop::sample::select(vec![Model::Default, Model::Paper, Model::Isomap]),
        initial in prop::sample::select(vec![Initial::Mds, Initial::Random]),
        geodesic in any::<bool>(),
        truncation in prop::sample::select(vec![0.0, 0.05]),
    ) {
        let n = coordinates.len() / p;
        let data: Vec<f64> = coordinates[..n * p].iter().map(|c| f64::from(*c)).collect();
        let metric = if geodesic { PointMetric::Geodesic { neighbours: 6 } } else { PointMetric::Euclidean };
        let settings = EmbeddingSettings { model, initial, max_sweeps: 15, ..EmbeddingSettings::default() };
        let options = EmbedOptions { landmarks, truncation, ..with(q) };
        let input = EmbedInput::Points { n, p, data: &data, metric };
        if let Ok(found) = run(input, &options, &settings) {
            prop_assert_eq!(found.coordinates.len(), n * q);
            prop_assert!(found.coordinates.iter().chain(&found.intercepts).all(|c| c.is_finite()));
            prop_assert!(found.trace.windows(2).all(|w| w[1] >= w[0] - 1e-9 * w[0].abs()));
            let placed = found.transform(&data, n, p, &Progress::new()).expect("valid points");
            prop_assert!(placed.iter().all(|c| c.is_finite()));
        }
    }
}

#[test]
fn large_matrices_are_refused_with_advice() {
    // More pairs than there is address space for.
    let n = 1 << 28;
    let source = super::square_matrix::square_matrix(n);
    let error = source.expect_err("no memory");
    assert_eq!(error, EmbeddingError::TooManyPoints { points: n });
    assert!(error.to_string().contains("landmarks"));
}
