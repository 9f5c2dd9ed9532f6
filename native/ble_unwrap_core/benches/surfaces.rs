//! Meshes and points that the stages are timed on. Nothing random: the same for every run.

use ble_unwrap_core::settings::Metric;
use ble_unwrap_core::standalone::surface_distances;
use ble_unwrap_core::{MeshInput, Progress};
use ble_unwrap_fixtures::{PolyMesh, torus, voxels};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Directions of the horns (and, of negative height, the dents) of [`sculpt`], with width and height of each.
const HORNS: [([f64; 3], f64, f64); 7] = [
    ([0.36, 0.48, 0.80], 0.030, 1.3),
    ([-0.48, 0.36, 0.80], 0.050, 1.0),
    ([0.80, -0.60, 0.00], 0.040, 0.8),
    ([-0.60, -0.64, -0.48], 0.060, 0.6),
    ([0.00, 0.60, -0.80], 0.035, 1.1),
    ([0.00, -0.80, 0.60], 0.060, -0.35),
    ([-0.96, 0.28, 0.00], 0.050, -0.30),
];
/// Frequencies and height of the ripples on it.
const RIPPLES: [([f64; 3], f64); 3] = [([3.1, -2.3, 1.7], 0.06), ([-5.3, 4.1, 6.7], 0.03), ([11.3, 9.7, -12.1], 0.012)];

/// A closed body of genus 0 in `6·cells²` quads, with horns, dents and ripples: of the kind a sculptor makes. The same
/// shape in every resolution.
pub(crate) fn sculpt(cells: usize) -> PolyMesh {
    voxels([cells; 3], |_| true).moved(|p| {
        // Equal angles give even cells.
        let cube = p.map(|x| (FRAC_PI_4 * (2.0 * x / cells as f64 - 1.0)).tan());
        let length = dot(cube, cube).sqrt();
        let d = cube.map(|x| x / length);
        let horns: f64 = HORNS.iter().map(|&(axis, width, height)| height * ((dot(d, axis) - 1.0) / width).exp()).sum();
        let ripples: f64 = RIPPLES.iter().map(|&(wave, height)| height * (dot(d, wave) + wave[0]).sin()).sum();
        let radius = 1.0 + horns + ripples;
        [radius * d[0], 0.85 * radius * d[1], 1.15 * radius * d[2]]
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A torus of `4·across²` triangles: to lay it out, two loops have to be cut.
pub(crate) fn ring(across: usize) -> PolyMesh {
    torus(0.4, 2 * across, across)
}

/// Moves the points of a map in the plane so that there is one smooth fold in its middle, as wide as this share of the map:
/// some triangles are turned over there, as an embedding leaves them that looks at distances alone.
pub(crate) fn fold(uv: &[[f64; 2]], share: f64) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
    let mean = |k: usize| uv.iter().map(|p| p[k]).sum::<f64>() / uv.len() as f64;
    let centre = [mean(0), mean(1)];
    let square = move |p: &[f64; 2]| (p[0] - centre[0]).powi(2) + (p[1] - centre[1]).powi(2);
    let width = share * uv.iter().map(square).fold(0.0, f64::max).sqrt();
    move |p| [p[0] + 1.6 * width * (-square(&p) / (width * width)).exp(), p[1]]
}

/// Chart number `k` of many: a wavy star-shaped outline, filled by rings of triangles. Sizes differ as those of real
/// charts do, a few large ones and many small.
pub(crate) fn blob(k: usize) -> (Vec<[f64; 2]>, Vec<[i32; 3]>) {
    const AROUND: usize = 96;
    const RINGS: usize = 6;
    let fraction = |step: f64| (k as f64 * step).fract();
    let (waves, depth, turn) =
        (2 + k % 5, 0.15 + 0.3 * fraction(0.618_033_988_749_894_9), TAU * fraction(0.754_877_666));
    let size = 0.2 + fraction(0.569_840_290_998).powi(3);
    let aspect = 1.0 + 1.5 * fraction(0.324_717_957_244);
    let mut points = vec![[0.0; 2]];
    for ring in 1..=RINGS {
        for step in 0..AROUND {
            let angle = TAU * step as f64 / AROUND as f64;
            let edge = size * (1.0 + depth * (waves as f64 * angle + turn).sin());
            let r = edge * ring as f64 / RINGS as f64;
            points.push([aspect * r * angle.cos(), r * angle.sin()]);
        }
    }
    let at = |ring: usize, step: usize| (1 + (ring - 1) * AROUND + step % AROUND) as i32;
    let mut triangles: Vec<[i32; 3]> = (0..AROUND).map(|step| [0, at(1, step), at(1, step + 1)]).collect();
    for ring in 1..RINGS {
        for step in 0..AROUND {
            let (a, b) = (at(ring, step), at(ring, step + 1));
            let (c, d) = (at(ring + 1, step + 1), at(ring + 1, step));
            triangles.extend([[a, d, c], [a, c, b]]);
        }
    }
    (points, triangles)
}

/// A face-like surface of `side`² vertices: an oval bulge with nose, brows and eye sockets. About the relief of a
/// scanned face, over one unit of width.
pub(crate) fn face(side: usize) -> PolyMesh {
    let bump = |x: f64, y: f64, at: [f64; 2], size: [f64; 2], height: f64| {
        height * (-((x - at[0]) / size[0]).powi(2) - ((y - at[1]) / size[1]).powi(2)).exp()
    };
    let relief = |x: f64, y: f64| {
        0.35 * (1.0 - 3.0 * x * x - 1.5 * y * y).max(0.0).sqrt()
            + bump(x, y, [0.0, 0.0], [0.07, 0.16], 0.16)
            + bump(x, y, [0.0, 0.17], [0.25, 0.05], 0.04)
            - bump(x, y, [0.15, 0.11], [0.07, 0.05], 0.05)
            - bump(x, y, [-0.15, 0.11], [0.07, 0.05], 0.05)
            + bump(x, y, [0.0, -0.25], [0.12, 0.04], 0.04)
    };
    let at = |k: usize| k as f64 / (side - 1) as f64 - 0.5;
    let positions: Vec<_> = (0..side * side)
        .map(|v| {
            let (x, y) = (at(v % side), 1.3 * at(v / side));
            [x, y, relief(x, y)]
        })
        .collect();
    let mut faces = Vec::new();
    for j in 0..side - 1 {
        for i in 0..side - 1 {
            let a = (j * side + i) as u32;
            let (b, c, d) = (a + 1, a + side as u32 + 1, a + side as u32);
            faces.extend(if (i + j) % 2 == 0 {
                [vec![a, b, c], vec![a, c, d]]
            } else {
                [vec![a, b, d], vec![b, c, d]]
            });
        }
    }
    PolyMesh { positions, faces }
}

/// Geodesic distances of all pairs of vertices, row by row.
pub(crate) fn distances(mesh: &PolyMesh) -> Vec<f64> {
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    };
    let all: Vec<i32> = (0..mesh.positions.len() as i32).collect();
    let rows = surface_distances(&input, &all, Metric::FastMarching, &Progress::new()).expect("a valid mesh");
    rows.into_iter().map(f64::from).collect()
}

/// A sheet rolled up in space, n×3, evenly strewn.
pub(crate) fn roll(n: usize) -> Vec<f64> {
    (0..n)
        .flat_map(|i| {
            let (u, v) = ((i as f64 * 0.618_033_988_749_894_9).fract(), (i as f64 + 0.5) / n as f64);
            let angle = (20.0 + 70.0 * u).sqrt();
            [angle * angle.cos(), 8.0 * v, angle * angle.sin()]
        })
        .collect()
}
