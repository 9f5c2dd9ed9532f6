//! The embedding alone: distances or points in, coordinates out.

use ble_unwrap_core::Progress;
use ble_unwrap_core::embedding::{
    EmbedInput, EmbedOptions, Embedding, EmbeddingSettings, KernelWidth, Model, PointMetric, embed,
};
use criterion::{BenchmarkId, Criterion, Throughput};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::hint::black_box;
use std::time::Duration;

use crate::surfaces;

/// Landmarks of the cases that grow with n.
const LANDMARKS: usize = 100;

/// All on one thread, as the paper's figures are, but for the last group.
pub(crate) fn benches(criterion: &mut Criterion) {
    let one = pool(1);
    all_pairs(criterion, &one);
    landmarks(criterion, &one);
    truncation(criterion, &one);
    dimensions(criterion, &one);
    threads(criterion);
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

fn run(
    pool: &ThreadPool,
    input: EmbedInput<'_>,
    options: &EmbedOptions<'_>,
    settings: &EmbeddingSettings,
) -> Embedding {
    pool.install(|| embed(input, options, settings, &Progress::new())).expect("valid input")
}

fn points(data: &[f64], metric: PointMetric) -> EmbedInput<'_> {
    EmbedInput::Points { n: data.len() / 3, p: 3, data, metric }
}

/// Root mean square error of the distances of some pairs, over their root mean square.
fn misfit(found: &Embedding, data: &[f64], n: usize) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for k in 0..4 * n {
        let (i, j) = (k % n, (k * 7919 + 13) % n);
        let square: f64 = (0..2).map(|c| (found.coordinates[2 * i + c] - found.coordinates[2 * j + c]).powi(2)).sum();
        let d = (square * found.sigma).sqrt();
        error += (d - data[i * n + j]).powi(2);
        size += data[i * n + j].powi(2);
    }
    (error / size).sqrt()
}

/// All vertices of a face-like surface at once, from the matrix of their geodesic distances: kernel width, affinities,
/// classical scaling and sweeps.
fn all_pairs(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = criterion.benchmark_group("embedding");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    // The paper's face has "around 1,000 vertices": 32² = 1,024 here. Otherwise fourfold.
    for (side, name) in [(16, "256"), (32, "1000"), (64, "4096")] {
        let distances = surfaces::distances(&surfaces::face(side));
        let n = side * side;
        let input = EmbedInput::Distances { n, data: &distances };
        let cases = [
            ("face", EmbeddingSettings::default()),
            ("face_isomap", EmbeddingSettings { model: Model::Isomap, ..EmbeddingSettings::default() }),
            (
                "face_paper_10_sweeps",
                EmbeddingSettings { max_sweeps: 10, tolerance: 0.0, ..EmbeddingSettings::paper() },
            ),
        ];
        for (case, settings) in cases {
            let found = run(one, input, &EmbedOptions::default(), &settings);
            let error = misfit(&found, &distances, n);
            // The printed model folds and has no scale; its likelihood must have grown.
            let gained = found.trace.first().zip(found.log_likelihood).is_none_or(|(start, end)| end > *start);
            assert!(gained && (case == "face_paper_10_sweeps" || error < 0.1), "{case} {n}: {error}");
            group.throughput(Throughput::Elements(n as u64));
            group.bench_function(BenchmarkId::new(case, name), |bencher| {
                bencher.iter(|| run(one, black_box(input), &EmbedOptions::default(), &settings));
            });
        }
    }
    group.finish();
}

/// Points of a rolled sheet by 100 landmarks: time grows with their number, straight and along the graph.
fn landmarks(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = criterion.benchmark_group("embedding");
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(100));
    let options = EmbedOptions { landmarks: Some(LANDMARKS), ..EmbedOptions::default() };
    let settings = EmbeddingSettings::default();
    for n in [1_000, 4_000, 16_000, 20_000, 64_000, 256_000, 1_000_000] {
        let data = surfaces::roll(n);
        let cases = [("roll", PointMetric::Euclidean), ("roll_geodesic", PointMetric::Geodesic { neighbours: 12 })];
        for (case, metric) in cases {
            if metric != PointMetric::Euclidean && n > 64_000 {
                continue;
            }
            let input = points(&data, metric);
            let found = run(one, input, &options, &settings);
            assert_eq!((found.landmarks.len(), found.coordinates.len()), (LANDMARKS, 2 * n));
            assert!(found.converged && found.coordinates.iter().all(|c| c.is_finite()));
            group.throughput(Throughput::Elements(n as u64));
            group.bench_function(BenchmarkId::new(case, n), |bencher| {
                bencher.iter(|| run(one, black_box(input), &options, &settings));
            });
        }
    }
    group.finish();
}

/// The whole matrix along a graph, with a kernel so narrow that most of it need not be measured.
fn truncation(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = criterion.benchmark_group("embedding");
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(100));
    let data = surfaces::roll(1_000);
    let input = points(&data, PointMetric::Geodesic { neighbours: 12 });
    // One sweep, so that the distances weigh.
    let settings = EmbeddingSettings { max_sweeps: 1, ..EmbeddingSettings::default() };
    for (case, truncation) in [("roll_all_distances", 0.0), ("roll_truncated", 0.01)] {
        let width = Some(KernelWidth::Absolute(2.0));
        let options = EmbedOptions { truncation, width, ..EmbedOptions::default() };
        let found = run(one, input, &options, &settings);
        assert!(found.coordinates.iter().all(|c| c.is_finite()));
        group.throughput(Throughput::Elements(1_000));
        group.bench_function(BenchmarkId::new(case, 1_000), |bencher| {
            bencher.iter(|| run(one, black_box(input), &options, &settings));
        });
    }
    group.finish();
}

/// Other output dimensions, and a degenerate case: points in four places only.
fn dimensions(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = criterion.benchmark_group("embedding");
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(100));
    let data = surfaces::roll(1_000);
    let settings = EmbeddingSettings::default();
    for dimensions in [1, 2, 3, 8] {
        let options = EmbedOptions { dimensions, ..EmbedOptions::default() };
        let input = points(&data, PointMetric::Euclidean);
        assert_eq!(run(one, input, &options, &settings).coordinates.len(), 1_000 * dimensions);
        group.bench_function(BenchmarkId::new(format!("roll_q{dimensions}"), 1_000), |bencher| {
            bencher.iter(|| run(one, black_box(input), &options, &settings));
        });
    }
    let few: Vec<f64> = (0..1_000).flat_map(|i| [f64::from(i % 2), f64::from(i / 2 % 2), 0.0]).collect();
    let input = points(&few, PointMetric::Euclidean);
    let found = run(one, input, &EmbedOptions::default(), &settings);
    assert!(found.bregman.is_some_and(|b| b.abs() < 1e-6), "four points of the plane are reproduced");
    group.bench_function(BenchmarkId::new("four_places", 1_000), |bencher| {
        bencher.iter(|| run(one, black_box(input), &EmbedOptions::default(), &settings));
    });
    group.finish();
}

/// The same by one and two threads: the same bytes.
fn threads(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("embedding");
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(100));
    let data = surfaces::roll(64_000);
    let options = EmbedOptions { landmarks: Some(LANDMARKS), ..EmbedOptions::default() };
    let input = points(&data, PointMetric::Euclidean);
    let settings = EmbeddingSettings::default();
    let mut first = None;
    for threads in [1, 2] {
        let pool = pool(threads);
        let found = run(&pool, input, &options, &settings).coordinates;
        assert_eq!(first.get_or_insert_with(|| found.clone()), &found);
        group.throughput(Throughput::Elements(64_000));
        group.bench_function(BenchmarkId::new(format!("roll_{threads}_threads"), 64_000), |bencher| {
            bencher.iter(|| run(&pool, black_box(input), &options, &settings));
        });
    }
    group.finish();
}
