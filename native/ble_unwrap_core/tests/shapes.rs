//! Tubes, horns and balls come out as an artist would cut them: few charts, none of them a sliver.

use std::f64::consts::TAU;

use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{PolyMesh, capped_cylinder, ico_sphere, torus, wrapped_grid};

/// A chart of less than this share of the faces is a sliver on these shapes.
const SLIVER: f64 = 0.02;

fn unwrapped(mesh: &PolyMesh) -> Atlas {
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    };
    unwrap(&input, &Settings::default(), &Progress::new()).expect("unwraps")
}

/// Number of charts, after checks that none is a sliver and that all are under the limit.
fn charts(mesh: &PolyMesh, name: &str) -> usize {
    let atlas = unwrapped(mesh);
    let count = atlas.chart.iter().max().map_or(0, |c| *c as usize + 1);
    let mut faces = vec![0usize; count];
    for &c in &atlas.chart {
        faces[usize::try_from(c).expect("every face has a chart")] += 1;
    }
    let least = faces.iter().min().copied().unwrap_or(0);
    assert!(least as f64 >= SLIVER * atlas.chart.len() as f64, "{name}: a chart of {least} faces in {faces:?}");
    assert!(atlas.report.charts_over_limit.is_empty(), "{name}: over the limit");
    count
}

/// A closed surface around an axis that bends, of this radius by place along it, both ends drawn to a point.
fn horn(along: usize, bend: f64, radius: impl Fn(f64) -> f64) -> PolyMesh {
    wrapped_grid(32, along, [true, false], |u, v| {
        let (angle, turn) = (TAU * u, bend * v);
        let r = radius(v);
        let out = 4.0 + r * angle.cos();
        [out * turn.cos(), out * turn.sin(), r * angle.sin()]
    })
}

#[test]
fn few_charts_and_no_slivers() {
    let shapes: [(&str, PolyMesh, usize); 5] = [
        ("ball", ico_sphere(4), 2),
        ("ring", torus(0.3, 64, 24), 2),
        ("long horn", horn(80, 1.5, |v| 0.6 * (1.0 - v) + 0.02), 2),
        ("bent tube", horn(80, 2.0, |_| 0.5), 2),
        ("capsule", horn(60, 0.8, |v| 0.5 * (1.0 - (2.0 * v - 1.0).powi(8)).max(1e-3).sqrt()), 2),
    ];
    for (name, mesh, most) in shapes {
        let count = charts(&mesh, name);
        assert!(count <= most, "{name}: {count} charts");
    }
}

/// To hang on the wall by more than an edge, a cap would have to be bent.
#[test]
fn a_closed_tube_is_a_wall_and_two_caps_as_they_are() {
    let report = unwrapped(&capped_cylinder(6.0, 32, 40)).report;
    assert_eq!(report.charts, 3);
    assert!(report.l_infinity < 1.001, "{report:?}");
}

/// A tube around z whose side faces are as long as itself, as quads or as triangles; with caps or open.
fn prism(sides: usize, [base, top]: [f64; 2], radius: f64, caps: bool, triangles: bool) -> PolyMesh {
    let n = sides as u32;
    let ring = |z: f64| {
        (0..sides)
            .map(move |k| (TAU * k as f64 / sides as f64).sin_cos())
            .map(move |(s, c)| [radius * c, radius * s, z])
    };
    let positions = ring(base).chain(ring(top)).collect();
    let side = |k: u32| vec![k, (k + 1) % n, n + (k + 1) % n, n + k];
    let mut faces: Vec<Vec<u32>> = (0..n).map(side).collect();
    if caps {
        faces.push((0..n).rev().collect());
        faces.push((n..2 * n).collect());
    }
    let quads = PolyMesh { positions, faces };
    if triangles { quads.triangulated() } else { quads }
}

/// A mesh turned about an axis that is none of the coordinates', and made larger or smaller, in a way of its own for each number.
fn turned(mesh: PolyMesh, number: u32) -> PolyMesh {
    let ((s, c), (t, d)) = ((0.7 + f64::from(number)).sin_cos(), (1.9 * f64::from(number)).sin_cos());
    let size = 10f64.powi(2 * i32::try_from(number).unwrap_or(0) - 5);
    mesh.moved(|[x, y, z]| {
        let (x, y) = (c * x - s * y, s * x + c * y);
        let (y, z) = (d * y - t * z, t * y + d * z);
        [x, y, z].map(|p| size * p)
    })
}

/// A tube of thousands of sides is a wall and two caps like any other, none of them bent.
#[test]
fn a_tube_of_many_sides_is_as_good_as_one_of_few() {
    for sides in [12, 5_000] {
        let tube = unwrapped(&prism(sides, [0.0, 2.0], 1.0, true, false)).report;
        assert!(tube.charts <= 3 && tube.l2 < 1.001, "{sides} sides: {} charts, {}", tube.charts, tube.l2);
    }
}

/// Faces as long as the whole shape: no cut runs along their diagonals, and triangles come out as their quads do.
#[test]
fn long_faces_stay_together() {
    for triangles in [false, true] {
        let kind = if triangles { "triangles" } else { "quads" };
        let pipe = unwrapped(&prism(12, [0.0, 16.0], 1.0, false, triangles)).report;
        assert!(pipe.charts == 1 && pipe.l2 < 1.001, "pipe of {kind}: {} charts, {}", pipe.charts, pipe.l2);
        assert!(pipe.packing_efficiency >= 0.35 && pipe.seam_length <= 2.5, "pipe of {kind}: {}", pipe.seam_length);
        let beam = unwrapped(&prism(4, [0.0, 12.0], 1.0, true, triangles)).report;
        assert!(beam.charts <= 2 && beam.seam_length <= 3.0, "beam of {kind}: {}, {}", beam.charts, beam.seam_length);
        let post = prism(12, [0.0, 60.0], 1.0, true, triangles).joined(&prism(12, [60.0, 63.0], 1.5, true, triangles));
        let post = unwrapped(&post).report;
        assert!(post.charts <= 6 && post.seam_length <= 10.0, "post of {kind}: {}, {}", post.charts, post.seam_length);
        // Its wall is a strip ten times as long as wide, which lies along an axis and cannot be cut across.
        assert!(post.packing_efficiency >= 0.07, "post of {kind}: {}", post.packing_efficiency);
    }
    // However they lie, and at any size: what hangs on the last digit would come out otherwise.
    for k in 0..6 {
        for triangles in [false, true] {
            let post =
                prism(12, [0.0, 60.0], 1.0, true, triangles).joined(&prism(12, [60.0, 63.0], 1.5, true, triangles));
            let pin = unwrapped(&turned(prism(24, [0.0, 20.0], 1.0, true, triangles), k)).report;
            assert!(pin.charts <= 3 && pin.seam_length <= 4.5, "pin {k}: {}, {}", pin.charts, pin.seam_length);
            let post = unwrapped(&turned(post, k)).report;
            assert!(post.charts <= 6 && post.seam_length <= 10.0, "post {k}: {}, {}", post.charts, post.seam_length);
        }
    }
    let plank = PolyMesh {
        positions: vec![[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [8.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        faces: vec![vec![0, 1, 2], vec![0, 2, 3]],
    };
    assert_eq!(unwrapped(&plank).report.charts, 1);
}
