//! The same shape, turned, moved, scaled and renumbered, comes out the same: as many charts, seams as long, as much stretch.

use std::f64::consts::{FRAC_PI_2, TAU};

use ble_unwrap_core::{MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::{
    PolyMesh, capped_cylinder, genus_plate, ico_sphere, random, sculpt_like, torus, uv_sphere, voxels, wrapped_grid,
};

/// How far the greatest and the least of several results may be apart, as a share: lengths and stretches that differ by
/// less are the same to the eye.
const SHARE: f64 = 0.02;
/// Ways in which each shape is moved and renumbered.
const MOTIONS: u64 = 6;

/// A mesh moved, scaled and renumbered in a way of its own for each number.
fn moved(mesh: &PolyMesh, number: u64) -> PolyMesh {
    let turns = [1, 2, 3].map(|k| (TAU * random(number, k)).sin_cos());
    let size = 10f64.powf(6.0 * random(number, 4) - 3.0);
    let shift = [5, 6, 7].map(|k| size * (random(number, k) - 0.5));
    mesh.renumbered(number).moved(|mut p| {
        for (axis, (s, c)) in turns.iter().enumerate() {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            (p[i], p[j]) = (c * p[i] - s * p[j], s * p[i] + c * p[j]);
        }
        [0, 1, 2].map(|k| size * p[k] + shift[k])
    })
}

/// Charts, length of the seams over the root of the area, and stretch.
fn figures(mesh: &PolyMesh) -> [f64; 3] {
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    };
    let report = unwrap(&input, &Settings::default(), &Progress::new()).expect("unwraps").report;
    [report.charts as f64, report.seam_length, report.l2]
}

/// A tube with two round ends: its radius and height by place along it, poles included.
fn capsule() -> PolyMesh {
    let end = |v: f64| (FRAC_PI_2 * v).sin_cos();
    wrapped_grid(24, 24, [true, false], |u, v| {
        let (r, z) = match v * 3.0 {
            v if v < 1.0 => (end(v).0.max(1e-3), -1.0 - end(v).1),
            v if v <= 2.0 => (1.0, 2.0 * (v - 1.5)),
            v => (end(3.0 - v).0.max(1e-3), 1.0 + end(3.0 - v).1),
        };
        [r * (TAU * u).cos(), r * (TAU * u).sin(), z]
    })
}

/// A ball with bumps.
fn bumpy() -> PolyMesh {
    uv_sphere(32, 16).moved(|p| {
        let r = 1.0 + 0.12 * (5.0 * p[0] + 1.0).sin() * (4.0 * p[1] + 2.0).sin() * (6.0 * p[2]).cos();
        p.map(|x| r * x)
    })
}

#[test]
fn results_do_not_depend_on_pose_size_and_numbers() {
    let shapes = [
        ("ball", ico_sphere(3)),
        ("globe", uv_sphere(32, 16)),
        ("box", voxels([6, 6, 6], |_| true)),
        ("capsule", capsule()),
        ("ring", torus(0.35, 32, 16)),
        ("can", capped_cylinder(2.0, 32, 8)),
        ("pin", capped_cylinder(20.0, 24, 1)),
        ("bumpy ball", bumpy()),
        ("plate with two holes", genus_plate(2)),
        ("small sculpt", sculpt_like(1_500)),
    ];
    let mut apart = Vec::new();
    for (name, quads) in shapes {
        for triangles in [false, true] {
            if triangles && quads.faces.iter().all(|f| f.len() == 3) {
                continue;
            }
            let mesh = if triangles { quads.clone().triangulated() } else { quads.clone() };
            let first = figures(&mesh);
            let (mut least, mut most) = (first, first);
            for number in 1..=MOTIONS {
                let found = figures(&moved(&mesh, number));
                least = [0, 1, 2].map(|k| least[k].min(found[k]));
                most = [0, 1, 2].map(|k| most[k].max(found[k]));
            }
            if least[0] < most[0] || (1..3).any(|k| most[k] > (1.0 + SHARE) * least[k]) {
                apart.push(format!("{name}, triangles {triangles}: {least:?} to {most:?}"));
            }
        }
    }
    assert!(apart.is_empty(), "charts, seams and stretch:\n{}", apart.join("\n"));
}
