//! Shapes as they are scanned and sculpted.

use crate::noise::smooth_noise;
use crate::open::grid;
use crate::poly_mesh::PolyMesh;
use crate::surface_net::surface_net;

/// n × n quads of hills: five octaves of noise.
#[must_use]
pub fn terrain(n: usize, seed: u64) -> PolyMesh {
    grid(n, n, |u, v| {
        let octave = |k: i32| {
            let f = 3.0 * 2.0_f64.powi(k);
            0.15 * smooth_noise(seed.wrapping_add(k as u64), f * u, f * v) / 2.0_f64.powi(k)
        };
        [u, v, (0..5).map(octave).sum()]
    })
}

/// A face without a neck: a relief of about 1,000 vertices over an oval, with brows, eye sockets, a
/// nose that overhangs its base, lips and a chin; a disc of quads.
#[must_use]
pub fn face_like() -> PolyMesh {
    grid(31, 31, |u, v| {
        let (s, t) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        // A square to a disc without a corner in the middle (elliptical grid mapping).
        let (x, y) = (s * (1.0 - 0.5 * t * t).sqrt(), t * (1.0 - 0.5 * s * s).sqrt());
        let bump = |cx: f64, cy: f64, wx: f64, wy: f64| (-((x - cx) / wx).powi(2) - ((y - cy) / wy).powi(2)).exp();
        let pair = |cx: f64, cy: f64, wx: f64, wy: f64| bump(cx, cy, wx, wy) + bump(-cx, cy, wx, wy);
        let dome = 0.75 * (1.0 - 0.8 * (x * x + y * y)).sqrt();
        let nose = 0.34 * bump(0.0, -0.1, 0.13, 0.16) + 0.16 * bump(0.0, 0.15, 0.09, 0.25);
        let relief = 0.10 * pair(0.3, 0.38, 0.28, 0.1) - 0.16 * pair(0.33, 0.2, 0.17, 0.11)
            + 0.05 * pair(0.35, -0.1, 0.2, 0.2)
            + 0.09 * bump(0.0, -0.42, 0.25, 0.05)
            - 0.06 * bump(0.0, -0.48, 0.27, 0.03)
            + 0.08 * bump(0.0, -0.54, 0.22, 0.05)
            + 0.1 * bump(0.0, -0.78, 0.25, 0.14);
        [0.8 * x, y - 0.35 * nose, dome + nose + relief]
    })
}

/// A limb: a capsule whose radius goes from one end to the other.
struct Limb {
    from: [f64; 3],
    to: [f64; 3],
    radius: [f64; 2],
}

/// Body, neck, head, snout, ears, legs and tail of a quadruped that faces +y.
const LIMBS: [Limb; 17] = [
    Limb { from: [0.0, -0.55, 0.0], to: [0.0, 0.45, 0.05], radius: [0.36, 0.42] },
    Limb { from: [0.0, 0.5, 0.2], to: [0.0, 0.85, 0.65], radius: [0.24, 0.19] },
    Limb { from: [0.0, 0.9, 0.75], to: [0.0, 1.0, 0.78], radius: [0.27, 0.25] },
    Limb { from: [0.0, 1.1, 0.72], to: [0.0, 1.35, 0.64], radius: [0.16, 0.12] },
    Limb { from: [0.16, 0.85, 0.95], to: [0.3, 0.75, 1.25], radius: [0.11, 0.07] },
    Limb { from: [-0.16, 0.85, 0.95], to: [-0.3, 0.75, 1.25], radius: [0.11, 0.07] },
    Limb { from: [0.25, 0.42, -0.1], to: [0.33, 0.5, -0.6], radius: [0.17, 0.12] },
    Limb { from: [0.33, 0.5, -0.6], to: [0.34, 0.4, -1.1], radius: [0.12, 0.1] },
    Limb { from: [-0.25, 0.42, -0.1], to: [-0.33, 0.5, -0.6], radius: [0.17, 0.12] },
    Limb { from: [-0.33, 0.5, -0.6], to: [-0.34, 0.6, -1.1], radius: [0.12, 0.1] },
    Limb { from: [0.22, -0.55, -0.1], to: [0.3, -0.5, -0.6], radius: [0.19, 0.13] },
    Limb { from: [0.3, -0.5, -0.6], to: [0.32, -0.7, -1.1], radius: [0.13, 0.1] },
    Limb { from: [-0.22, -0.55, -0.1], to: [-0.3, -0.5, -0.6], radius: [0.19, 0.13] },
    Limb { from: [-0.3, -0.5, -0.6], to: [-0.32, -0.6, -1.1], radius: [0.13, 0.1] },
    Limb { from: [0.0, -0.85, 0.1], to: [0.05, -1.15, 0.3], radius: [0.12, 0.1] },
    Limb { from: [0.05, -1.15, 0.3], to: [0.0, -1.3, 0.65], radius: [0.1, 0.09] },
    Limb { from: [0.0, 1.42, 0.64], to: [0.0, 1.45, 0.63], radius: [0.09, 0.09] },
];

/// Signed distance to the creature, roughly: smooth union of its limbs, then wrinkles. Changes by at
/// most [`CREATURE_SLOPE`] times the way gone.
fn creature(p: [f64; 3]) -> f64 {
    const BLEND: f64 = 0.1;
    let mut d = f64::INFINITY;
    for limb in &LIMBS {
        let along = [0, 1, 2].map(|k| limb.to[k] - limb.from[k]);
        let out = [0, 1, 2].map(|k| p[k] - limb.from[k]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let t = (dot(out, along) / dot(along, along)).clamp(0.0, 1.0);
        let away = [0, 1, 2].map(|k| out[k] - t * along[k]);
        let e = dot(away, away).sqrt() - (limb.radius[0] + t * (limb.radius[1] - limb.radius[0]));
        // Polynomial smooth minimum (Quilez).
        let h = (BLEND - (d - e).abs()).max(0.0) / BLEND;
        d = d.min(e) - 0.25 * BLEND * h * h;
    }
    let wrinkle = |f: f64, a: f64| a * (f * p[0]).sin() * (f * p[1] + 1.0).sin() * (f * p[2] + 2.0).sin();
    d + wrinkle(9.0, 0.015) + wrinkle(23.0, 0.005)
}

/// Bound on the slope of [`creature`]: 1 for capsules, a little for their taper and the wrinkles.
const CREATURE_SLOPE: f64 = 1.6;

/// A four-legged creature with ears and a tail, a closed smooth surface of genus 0 in nearly square
/// quads, as a sculpt comes out of a voxel remesher. Within a twentieth of `target_faces`, which
/// should be 2,000 or more; finer ones cost in proportion.
#[must_use]
pub fn sculpt_like(target_faces: usize) -> PolyMesh {
    const EXTENT: f64 = 1.7;
    const TRIAL: f64 = 0.07;
    const ATTEMPTS: usize = 16;
    const SHIFT: f64 = 0.137;
    let trial = surface_net(EXTENT, TRIAL, CREATURE_SLOPE, creature).faces.len();
    let cell = TRIAL * (trial as f64 / target_faces as f64).sqrt();
    let mut mesh = PolyMesh::default();
    // Once in a while two sheets of the net meet in one cell; a shifted grid parts them.
    for attempt in 0..ATTEMPTS {
        mesh = surface_net(EXTENT + SHIFT * attempt as f64 * cell, cell, CREATURE_SLOPE, creature);
        if is_manifold(&mesh) {
            break;
        }
    }
    mesh
}

/// Whether every edge has two faces.
fn is_manifold(mesh: &PolyMesh) -> bool {
    let sides = mesh.faces.iter().flat_map(|f| (0..f.len()).map(|k| (f[k], f[(k + 1) % f.len()])));
    let mut edges: Vec<(u32, u32)> = sides.map(|(a, b)| (a.min(b), a.max(b))).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).all(|edge| edge.len() == 2)
}
