//! Quads that are convex on the surface are convex in UV, so that a result holds by either diagonal.

use std::f64::consts::{PI, TAU};

use ble_unwrap_core::standalone::{Measures, certify, measure_layout};
use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh, grid, voxels, wrapped_grid};
use rayon::ThreadPoolBuilder;

/// By the other diagonal a result may be stretched so many times as much.
const MOST_BETWEEN_DIAGONALS: f64 = 1.05;

fn input_of<'a>(mesh: &'a PolyMesh, flat: &'a FlatPolygons) -> MeshInput<'a> {
    MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    }
}

fn unwrapped(mesh: &PolyMesh) -> Atlas {
    let flat = mesh.flat();
    unwrap(&input_of(mesh, &flat), &Settings::default(), &Progress::new()).expect("unwraps")
}

/// Each vertex halfway to the mean of its neighbours, so many times.
fn smoothed(mut mesh: PolyMesh, rounds: usize) -> PolyMesh {
    for _ in 0..rounds {
        let mut sums = vec![([0.0; 3], 0.0); mesh.positions.len()];
        for face in &mesh.faces {
            for (k, &v) in face.iter().enumerate() {
                let next = mesh.positions[face[(k + 1) % face.len()] as usize];
                let (sum, count) = &mut sums[v as usize];
                *count += 1.0;
                (0..3).for_each(|k| sum[k] += next[k]);
            }
        }
        for (p, (sum, count)) in mesh.positions.iter_mut().zip(sums) {
            (0..3).for_each(|k| p[k] = 0.5 * p[k] + 0.5 * sum[k] / count);
        }
    }
    mesh
}

/// Two balls of cubes that have grown together.
fn voxel_blob(size: usize) -> PolyMesh {
    voxels([size; 3], |cell| {
        let near = |centre: [f64; 3], radius: f64| {
            let square: f64 = (0..3).map(|k| (cell[k] as f64 + 0.5 - centre[k] * size as f64).powi(2)).sum();
            square < (radius * size as f64).powi(2)
        };
        near([0.35, 0.4, 0.4], 0.3) || near([0.62, 0.6, 0.55], 0.27)
    })
}

/// A square tower, each storey turned against the one below, so that its quads are warped.
fn twisted_tower(storeys: usize, turn: f64) -> PolyMesh {
    let corner = |u: f64| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]][(4.0 * u) as usize % 4];
    wrapped_grid(12, storeys, [true, false], |u, v| {
        let along = 4.0 * u - (4.0 * u).floor();
        let (a, b) = (corner(u), corner(u + 0.25));
        let [x, y] = [0, 1].map(|k| a[k] + along * (b[k] - a[k]));
        let (sin, cos) = (turn * storeys as f64 * v).sin_cos();
        [cos * x - sin * y, sin * x + cos * y, 0.5 * storeys as f64 * v]
    })
}

/// Hills so steep for their quads that these crowd where a map flattens them.
fn steep_hills(n: usize, waves: f64) -> PolyMesh {
    grid(n, n, |u, v| [u, v, 0.4 * (waves * u + 1.0).sin() * (0.8 * waves * v).cos()])
}

/// A ball of few quads with dents that are hardly wider than one.
fn dented_ball() -> PolyMesh {
    wrapped_grid(12, 6, [true, false], |u, v| {
        let radius = 1.0 + 0.35 * (7.0 * TAU * u).sin() * (PI * v).sin() * (6.0 * PI * v).cos();
        let (angle, turn) = (PI * (0.03 + 0.94 * v), TAU * u);
        [radius * angle.sin() * turn.cos(), radius * angle.sin() * turn.sin(), radius * angle.cos()]
    })
}

/// All quads of these are convex.
fn shapes() -> [(&'static str, PolyMesh); 5] {
    [
        ("voxel blob", voxel_blob(10)),
        ("voxel blob with smooth corners", smoothed(voxel_blob(14), 2)),
        ("twisted tower", twisted_tower(10, 0.35)),
        ("steep hills", steep_hills(24, 12.0)),
        ("dented ball", dented_ball()),
    ]
}

/// All faces as triangles, by corner: quads by the diagonal from their corner number `first`.
fn triangulated(mesh: &PolyMesh, first: usize) -> Vec<[i32; 3]> {
    let mut out = Vec::new();
    let mut begin = 0;
    for face in &mesh.faces {
        let corner = |k: usize| (begin + (first + k) % face.len()) as i32;
        out.extend((2..face.len()).map(|k| [corner(0), corner(k - 1), corner(k)]));
        begin += face.len();
    }
    out
}

/// Measured with these triangles, and proven to be free of flips and overlap with them.
fn measured(mesh: &PolyMesh, atlas: &Atlas, triangles: &[[i32; 3]], name: &str) -> Measures {
    let flat = mesh.flat();
    let input = MeshInput { corner_triangles: Some(triangles), ..input_of(mesh, &flat) };
    let (settings, progress) = (Settings::default(), Progress::new());
    let certificate = certify(&input, &atlas.uv, &atlas.chart, &[], &settings, &progress).expect("valid arrays");
    assert!(certificate.is_valid(), "{name}: {certificate:?}");
    let layout = measure_layout(&input, &atlas.uv, None, &[], &settings, &progress).expect("measures");
    assert_eq!((layout.bent_quads, layout.unmapped_faces), (0, 0), "{name}");
    layout.measures
}

#[test]
fn results_hold_by_either_diagonal() {
    let mut mended = 0;
    for (name, mesh) in shapes() {
        let atlas = unwrapped(&mesh);
        assert_eq!(atlas.report.bent_quads, 0, "{name}");
        assert_eq!(atlas.report.charts_over_limit, [], "{name}");
        let [one, other] = [0, 1].map(|first| measured(&mesh, &atlas, &triangulated(&mesh, first), name));
        assert_eq!((one.flips, other.flips, one.overlaps, other.overlaps), (0, 0, 0, 0), "{name}");
        // One triangle that is all but turned over can double it.
        let [better, worse] = [one.l2.min(other.l2), one.l2.max(other.l2)];
        assert!(worse <= MOST_BETWEEN_DIAGONALS * better, "{name}: {better} by one diagonal, {worse} by the other");
        mended += atlas.report.rungs.iter().filter(|rung| rung.0 == "unbend").map(|rung| rung.1).sum::<usize>();
    }
    assert!(mended > 0, "no quad had to be mended: no test");
}

#[test]
fn quads_that_are_not_convex_are_nobodys_fault() {
    // A tenth of these is not; half a dozen of the others would be bent.
    let mesh = steep_hills(12, 17.0);
    let atlas = unwrapped(&mesh);
    assert_eq!((atlas.report.bent_quads, atlas.report.flips), (0, 0));
    assert!(!atlas.report.warnings.iter().any(|text| text.contains("quad")), "{:?}", atlas.report.warnings);
}

#[test]
fn threads_change_nothing() {
    for (name, mesh) in shapes() {
        let with = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let bits: Vec<u32> = pool.install(|| unwrapped(&mesh)).uv.iter().flatten().map(|x| x.to_bits()).collect();
            bits
        };
        let first = with(1);
        assert!(with(2) == first && with(8) == first, "{name}");
    }
}
