//! The stages of an unwrap by themselves, and the whole, on meshes that grow fourfold.

use ble_unwrap_core::internals::{Body, Distances, Layout, Sheet};
use ble_unwrap_core::settings::PackSettings;
use ble_unwrap_core::standalone::{RepackRules, repack};
use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, Throughput};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::LazyCell;
use std::hint::black_box;
use std::time::Duration;

use crate::surfaces;

/// Cells along an edge of a sculpt of about 1,000, 4,000, 16,000 and 64,000 triangles.
const SCULPTS: [usize; 4] = [9, 18, 37, 73];
/// Vertices along a side of a face-like sheet, likewise.
const FACES: [usize; 4] = [23, 46, 90, 180];
/// Quads across the tube of a ring, likewise.
const RINGS: [usize; 4] = [16, 32, 63, 126];
/// Charts of a packing.
const CHARTS: [usize; 4] = [4, 16, 64, 256];
/// Charts of a packing in rows.
const CROWD: usize = 50_000;
/// Vertices of the coarse mesh, as a share of the fine one's.
const COARSE_SHARE: usize = 20;

/// All on one thread, so that a figure is work and not the machine's idle cores.
pub(crate) fn benches(criterion: &mut Criterion) {
    let one = ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    conditioning(criterion, &one);
    coarsening(criterion, &one);
    distances(criterion, &one);
    segmentation(criterion, &one);
    cutting(criterion, &one);
    embedding(criterion, &one);
    flips(criterion, &one);
    minimisation(criterion, &one);
    packing(criterion, &one);
    verification(criterion, &one);
    whole(criterion, &one);
}

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    group
}

/// Times `run` on what `make` gives. Set-up and the check of the first result happen only where the name was asked for.
fn case<T: Sync, R: Send>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    one: &ThreadPool,
    name: BenchmarkId,
    elements: usize,
    make: impl FnOnce() -> T,
    run: impl Fn(&T) -> R + Sync,
    is_right: impl Fn(&T, &R) -> bool,
) {
    let made = LazyCell::new(|| {
        let made = make();
        let found = one.install(|| run(&made));
        assert!(is_right(&made, &found), "the result is not what this stage is for");
        made
    });
    group.throughput(Throughput::Elements(elements as u64));
    group.bench_function(name, |bencher| {
        let made = &*made;
        bencher.iter(|| one.install(|| run(black_box(made))));
    });
}

/// Arrays as Blender has them, of quads.
struct Polygons {
    mesh: PolyMesh,
    flat: FlatPolygons,
}

impl Polygons {
    fn of(mesh: PolyMesh) -> Self {
        Self { flat: mesh.flat(), mesh }
    }

    fn triangles(&self) -> usize {
        self.flat.corner_vertices.len() - 2 * self.mesh.faces.len()
    }

    fn input(&self) -> MeshInput<'_> {
        MeshInput {
            positions: &self.mesh.positions,
            corner_vertices: &self.flat.corner_vertices,
            face_offsets: &self.flat.face_offsets,
            corner_triangles: None,
            ..MeshInput::default()
        }
    }

    fn body(&self) -> Body {
        Body::condition(&self.input())
    }
}

/// A sculpt as the stages see it.
fn sculpt(cells: usize) -> Body {
    Polygons::of(surfaces::sculpt(cells)).body()
}

fn conditioning(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "condition");
    for cells in SCULPTS {
        case(
            &mut group,
            one,
            BenchmarkId::new("sculpt", 12 * cells * cells),
            12 * cells * cells,
            || Polygons::of(surfaces::sculpt(cells)),
            Polygons::body,
            |given, body| body.triangle_count() == given.triangles(),
        );
    }
    group.finish();
}

/// To a twentieth of the vertices.
fn coarsening(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "coarsen");
    for cells in SCULPTS {
        case(
            &mut group,
            one,
            BenchmarkId::new("sculpt", 12 * cells * cells),
            12 * cells * cells,
            || sculpt(cells),
            |body| body.coarsen(body.vertex_count() / COARSE_SHARE),
            |body, vertices| *vertices <= body.vertex_count() / COARSE_SHARE + 1,
        );
    }
    group.finish();
}

/// Choice of the landmarks, and a march from each.
fn distances(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "geodesics");
    for cells in SCULPTS {
        case(
            &mut group,
            one,
            BenchmarkId::new("sculpt", 12 * cells * cells),
            12 * cells * cells,
            || sculpt(cells),
            Body::landmark_distances,
            |body, found| found.reach(body.vertex_count()),
        );
    }
    group.finish();
}

/// Spectral analysis of known distances, and the first split by it.
fn segmentation(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "segmentation");
    for cells in SCULPTS {
        let make = || {
            let body = sculpt(cells);
            let distances = body.landmark_distances().analysed();
            (body, distances)
        };
        case(
            &mut group,
            one,
            BenchmarkId::new("analysis", 12 * cells * cells),
            12 * cells * cells,
            make,
            |(_, distances)| distances.analyse(),
            |_, &(dimension, planarity)| dimension >= 2 && planarity < 0.9,
        );
        case(
            &mut group,
            one,
            BenchmarkId::new("split", 12 * cells * cells),
            12 * cells * cells,
            make,
            |(body, distances)| body.segment(distances),
            |_, &parts| parts >= 2,
        );
    }
    group.finish();
}

fn cutting(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "cut_to_disk");
    for across in RINGS {
        case(
            &mut group,
            one,
            BenchmarkId::new("ring", 4 * across * across),
            4 * across * across,
            || Polygons::of(surfaces::ring(across)).body(),
            Body::cut_to_disk,
            |body, cuts| body.is_disk_without(cuts),
        );
    }
    group.finish();
}

/// A face-like sheet with a map of it, as the embedding leaves it.
fn embedded(side: usize) -> Sheet {
    Sheet::embedded(Polygons::of(surfaces::face(side)).body())
}

fn folded(side: usize, share: f64) -> Sheet {
    let sheet = embedded(side);
    let fold = surfaces::fold(&sheet.map(), share);
    let sheet = sheet.moved(fold);
    assert!(sheet.has_flips(), "a fold turns triangles over");
    sheet
}

/// Triangles of a sheet.
fn size(side: usize) -> usize {
    2 * (side - 1) * (side - 1)
}

/// A chart by the distances of its landmarks, which are known.
fn embedding(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "embed_chart");
    for side in FACES {
        case(
            &mut group,
            one,
            BenchmarkId::new("face", size(side)),
            size(side),
            || Polygons::of(surfaces::face(side)).body().landmark_distances(),
            Distances::embed,
            |_, found| *found == Some(side * side),
        );
    }
    group.finish();
}

/// A narrow fold is cleared in its neighbourhood, a wide one on the whole chart.
fn flips(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "make_injective");
    for (name, share) in [("narrow_fold", 0.08), ("wide_fold", 0.3)] {
        for side in FACES {
            case(
                &mut group,
                one,
                BenchmarkId::new(name, size(side)),
                size(side),
                || folded(side, share),
                Sheet::make_injective,
                |sheet, uv| !sheet.clone().with_map(uv).has_flips(),
            );
        }
    }
    group.finish();
}

/// From the embedding to the minimum.
fn minimisation(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "minimise_stretch");
    for side in FACES {
        case(
            &mut group,
            one,
            BenchmarkId::new("face", size(side)),
            size(side),
            || {
                let sheet = embedded(side);
                let uv = sheet.make_injective();
                sheet.with_map(&uv)
            },
            Sheet::minimise_stretch,
            |sheet, found| found.is_some_and(|(l2, iterations)| iterations > 1 && l2 < sheet.l2_stretch()),
        );
    }
    group.finish();
}

/// Charts as plain arrays.
#[derive(Default)]
struct Blobs {
    points: Vec<[f64; 2]>,
    triangles: Vec<[i32; 3]>,
    chart: Vec<i32>,
}

fn blobs(count: usize) -> Blobs {
    let mut out = Blobs::default();
    for k in 0..count {
        let (points, triangles) = surfaces::blob(k);
        let first = out.points.len() as i32;
        out.points.extend(points);
        out.chart.extend(vec![k as i32; triangles.len()]);
        out.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
    }
    out
}

/// Charts of one triangle each, of many shapes and sizes.
fn single_triangles(count: usize) -> Blobs {
    let side = |k: usize, prime: usize| 0.1 + (k * prime % 97) as f64 / 97.0;
    let points = (0..count).flat_map(|k| [[0.0, 0.0], [side(k, 31), 0.0], [side(k, 57), side(k, 73)]]).collect();
    let triangles = (0..count as i32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    Blobs { points, triangles, chart: (0..count as i32).collect() }
}

fn packing(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "pack");
    let of_blobs = CHARTS.map(|charts| ("blobs", charts, blobs as fn(usize) -> Blobs));
    for (name, charts, make) in
        of_blobs.into_iter().chain([("triangles", CROWD, single_triangles as fn(usize) -> Blobs)])
    {
        case(
            &mut group,
            one,
            BenchmarkId::new(name, charts),
            charts,
            || make(charts),
            |blobs| {
                let rules = RepackRules::default();
                repack(
                    &blobs.points,
                    &blobs.triangles,
                    &blobs.chart,
                    &rules,
                    &PackSettings::default(),
                    &Progress::new(),
                )
                .expect("charts that fit")
            },
            |_, packed| packed.charts == charts && packed.specks == 0 && packed.efficiency > 0.25,
        );
    }
    group.finish();
}

fn verification(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "verify");
    for cells in SCULPTS {
        case(
            &mut group,
            one,
            BenchmarkId::new("sculpt", 12 * cells * cells),
            12 * cells * cells,
            || {
                let mesh = Polygons::of(surfaces::sculpt(cells).triangulated());
                let atlas = unwrapped(&mesh);
                let triangles = mesh.mesh.triangles();
                let corners = (0..triangles.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
                let layout = Layout::new(&mesh.mesh.positions, triangles, corners, atlas.uv, atlas.chart);
                (layout, atlas.report.charts)
            },
            |(layout, _)| layout.verify(),
            |(_, charts), certificate| certificate.is_valid() && certificate.charts == *charts,
        );
    }
    group.finish();
}

fn unwrapped(mesh: &Polygons) -> Atlas {
    unwrap(&mesh.input(), &Settings::default(), &Progress::new()).expect("a valid mesh")
}

fn whole(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "unwrap");
    for cells in SCULPTS {
        case(
            &mut group,
            one,
            BenchmarkId::new("sculpt", 12 * cells * cells),
            12 * cells * cells,
            || Polygons::of(surfaces::sculpt(cells)),
            unwrapped,
            |_, atlas| atlas.report.flips == 0 && atlas.report.overlaps == 0 && atlas.report.charts > 1,
        );
    }
    group.finish();
}
