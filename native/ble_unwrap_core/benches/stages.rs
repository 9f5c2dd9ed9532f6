//! The stages of an unwrap by themselves, and the whole, on meshes that grow fourfold.

use ble_unwrap_core::charts::{Patch, cut_to_disk};
use ble_unwrap_core::distortion::RestTriangle;
use ble_unwrap_core::embedding::{EmbeddingSettings, embed_chart, fix_gauge};
use ble_unwrap_core::geodesics::{GeodesicSettings, LandmarkDistances, landmark_distances};
use ble_unwrap_core::mesh::{ConditionOptions, Surface, TriMesh, coarsen, condition};
use ble_unwrap_core::metrics::{Texture, UvMesh};
use ble_unwrap_core::packing::{PackItem, PackSettings, pack};
use ble_unwrap_core::segmentation::{SegmentationSettings, SpectralAnalysis, segment};
use ble_unwrap_core::stretch::{self, MinimiseOptions, StretchSettings, first_flip, make_injective, minimise_stretch};
use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap, verify};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, Throughput};
use nalgebra::{Point2, Point3};
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

    fn surface(&self) -> Surface {
        condition(&self.input(), &ConditionOptions::default(), &Progress::new()).expect("a valid mesh")
    }

    /// The surface as the one piece it is.
    fn patch(&self) -> Patch {
        let surface = self.surface();
        Patch::whole(surface.mesh, surface.polygon)
    }
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
            Polygons::surface,
            |given, surface| surface.mesh.face_count() == given.triangles(),
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
            || surfaces::tri_mesh(&surfaces::sculpt(cells)),
            |mesh| coarsen(mesh, mesh.vertex_count() / COARSE_SHARE, &Progress::new()).expect("not cancelled"),
            |mesh, coarse| coarse.mesh.vertex_count() <= mesh.vertex_count() / COARSE_SHARE + 1,
        );
    }
    group.finish();
}

fn measured(mesh: &TriMesh) -> LandmarkDistances {
    landmark_distances(mesh, &GeodesicSettings::default(), &Progress::new()).expect("not cancelled")
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
            || surfaces::tri_mesh(&surfaces::sculpt(cells)),
            measured,
            |mesh, found| found.vertex_count() == mesh.vertex_count() && found.row(0).iter().all(|d| d.is_finite()),
        );
    }
    group.finish();
}

/// Spectral analysis of known distances, and the first split by it.
fn segmentation(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "segmentation");
    for cells in SCULPTS {
        let make = || {
            let patch = Polygons::of(surfaces::sculpt(cells)).patch();
            let distances = measured(&patch.mesh);
            let analysis = SpectralAnalysis::new(&distances).expect("memory");
            (patch, distances, analysis)
        };
        case(
            &mut group,
            one,
            BenchmarkId::new("analysis", 12 * cells * cells),
            12 * cells * cells,
            make,
            |(_, distances, _)| SpectralAnalysis::new(distances).expect("memory"),
            |_, analysis| analysis.dimension >= 2 && analysis.planarity < 0.9,
        );
        case(
            &mut group,
            one,
            BenchmarkId::new("split", 12 * cells * cells),
            12 * cells * cells,
            make,
            |(patch, distances, analysis)| {
                let settings = SegmentationSettings::default();
                let progress = Progress::new();
                segment(&patch.mesh, &patch.polygon, distances, analysis, true, &settings, &progress)
                    .expect("not cancelled")
            },
            |_, parts| parts.parts >= 2,
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
            || surfaces::ring(across),
            |mesh| cut_to_disk(mesh, |h| mesh.edge_length(h), |_| false),
            |mesh, cuts| {
                let faces: Vec<_> = mesh.faces().collect();
                let is_cut = |h| cuts.binary_search(&mesh.twin(h).min(h)).is_ok();
                mesh.submesh(&faces, is_cut).0.topology().is_disk()
            },
        );
    }
    group.finish();
}

/// A face-like sheet with a map of it.
struct Sheet {
    mesh: TriMesh,
    rest: Vec<RestTriangle>,
    uv: Vec<Point2<f64>>,
}

impl Sheet {
    /// As the embedding leaves it.
    fn embedded(side: usize) -> Self {
        let mesh = surfaces::face(side);
        let rest = RestTriangle::of_mesh(&mesh);
        let found = embed_chart(&measured(&mesh), &EmbeddingSettings::default(), 0, &Progress::new());
        let mut uv = found.expect("a sheet has an extent").uv;
        fix_gauge(&mesh, &rest, &mut uv);
        Self { mesh, rest, uv }
    }

    fn folded(side: usize, share: f64) -> Self {
        let sheet = Self::embedded(side);
        let uv = surfaces::folded(&sheet.uv, share);
        assert!(first_flip(&sheet.mesh, &uv).is_some(), "a fold turns triangles over");
        Self { uv, ..sheet }
    }

    fn without_flips(&self) -> Vec<Point2<f64>> {
        make_injective(&self.mesh, &self.rest, &self.uv, &Progress::new()).expect("a disk").0
    }

    fn size(side: usize) -> usize {
        2 * (side - 1) * (side - 1)
    }
}

/// A chart by the distances of its landmarks, which are known.
fn embedding(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "embed_chart");
    for side in FACES {
        case(
            &mut group,
            one,
            BenchmarkId::new("face", Sheet::size(side)),
            Sheet::size(side),
            || measured(&surfaces::face(side)),
            |distances| {
                embed_chart(distances, &EmbeddingSettings::default(), 0, &Progress::new())
                    .expect("a sheet has an extent")
            },
            |_, found| found.converged && found.uv.len() == side * side,
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
                BenchmarkId::new(name, Sheet::size(side)),
                Sheet::size(side),
                || Sheet::folded(side, share),
                Sheet::without_flips,
                |sheet, uv| first_flip(&sheet.mesh, uv).is_none(),
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
            BenchmarkId::new("face", Sheet::size(side)),
            Sheet::size(side),
            || {
                let sheet = Sheet::embedded(side);
                let uv = sheet.without_flips();
                Sheet { uv, ..sheet }
            },
            |sheet| {
                let (settings, options) = (StretchSettings::default(), MinimiseOptions::default());
                minimise_stretch(&sheet.mesh, &sheet.rest, &sheet.uv, &settings, &options, &Progress::new())
                    .expect("a start without flips")
            },
            |sheet, found| {
                let start = stretch::l2_stretch(&sheet.mesh, &sheet.rest, &sheet.uv);
                found.converged && found.iterations > 1 && found.l2 < start
            },
        );
    }
    group.finish();
}

fn packing(criterion: &mut Criterion, one: &ThreadPool) {
    let mut group = group(criterion, "pack");
    for charts in CHARTS {
        case(
            &mut group,
            one,
            BenchmarkId::new("blobs", charts),
            charts,
            || (0..charts).map(surfaces::blob).collect::<Vec<_>>(),
            |blobs| {
                let items: Vec<_> = blobs.iter().map(|(points, triangles)| PackItem { points, triangles }).collect();
                pack(&items, &PackSettings::default(), &Progress::new()).expect("charts that fit")
            },
            |_, packed| packed.poses.len() == charts && packed.specks == 0 && packed.efficiency > 0.25,
        );
    }
    group.finish();
}

/// A mesh of triangles with its atlas, for the proof that nothing overlaps.
struct Mapped {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    corners: Vec<[u32; 3]>,
    atlas: Atlas,
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
                let triangles = mesh.mesh.triangles();
                Mapped {
                    positions: mesh.mesh.positions.iter().map(|&p| p.into()).collect(),
                    corners: (0..triangles.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
                    triangles,
                    atlas: unwrapped(&mesh),
                }
            },
            |mapped| {
                let Mapped { positions, triangles, corners, atlas } = mapped;
                let texture =
                    Texture::square(Settings::default().packing.width, Settings::default().packing.margin_texels);
                let mesh = UvMesh::new(positions, triangles, &atlas.uv, corners, &atlas.chart, texture);
                verify(&mesh.expect("one UV a corner"), &[], &Progress::new()).expect("not cancelled")
            },
            |mapped, certificate| certificate.is_valid() && certificate.charts == mapped.atlas.report.charts,
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
