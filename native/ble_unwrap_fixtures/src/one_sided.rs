//! Surfaces with one side.

use std::f64::consts::TAU;

use crate::closed::ico_sphere;
use crate::open::grid;
use crate::poly_mesh::PolyMesh;

/// Joins the vertices of a mesh as `class` says, which maps each to the one that stands for it.
fn identified(mesh: &PolyMesh, class: impl Fn(u32) -> u32) -> PolyMesh {
    let faces = mesh.faces.iter().map(|f| f.iter().map(|&v| class(v)).collect()).collect();
    PolyMesh { positions: mesh.positions.clone(), faces }.retained(|_| true)
}

/// A Möbius strip with one half turn.
#[must_use]
pub fn moebius(around: usize, across: usize) -> PolyMesh {
    let mesh = grid(around, across, |u, v| {
        let (t, w) = (TAU * u, 0.6 * (v - 0.5));
        let r = 1.0 + w * (0.5 * t).cos();
        [r * t.cos(), r * t.sin(), w * (0.5 * t).sin()]
    });
    // The last column is the first upside down.
    let columns = around as u32 + 1;
    identified(&mesh, |v| {
        let (i, j) = (v % columns, v / columns);
        if i == around as u32 { (across as u32 - j) * columns } else { v }
    })
}

/// A Klein bottle: a figure of eight swept around an axis with half a turn.
#[must_use]
pub fn klein_bottle(around: usize, across: usize) -> PolyMesh {
    let mesh = grid(around, across, |u, v| {
        let (t, w) = (TAU * u, TAU * (v + 0.013));
        let (s, c) = (0.5 * t).sin_cos();
        let r = 2.0 + c * w.sin() - s * (2.0 * w).sin();
        [r * t.cos(), r * t.sin(), s * w.sin() + c * (2.0 * w).sin()]
    });
    let (n, m, columns) = (around as u32, across as u32, around as u32 + 1);
    identified(&mesh, |v| {
        let (i, j) = (v % columns, v / columns % m);
        if i == n { ((m - j) % m) * columns } else { j * columns + i }
    })
}

/// The projective plane: a sphere of 20·4^level triangles with opposite points made one. 6 vertices
/// and 10 triangles at level 0.
#[must_use]
pub fn projective_plane(level: usize) -> PolyMesh {
    let sphere = ico_sphere(level);
    let p = &sphere.positions;
    let opposite = |v: usize| {
        let gap = |w: usize| (0..3).map(|k| (p[v][k] + p[w][k]).powi(2)).sum::<f64>();
        (0..p.len()).min_by(|&a, &b| gap(a).total_cmp(&gap(b))).unwrap_or(v)
    };
    let class: Vec<u32> = (0..p.len()).map(|v| v.min(opposite(v)) as u32).collect();
    let mut mesh = identified(&sphere, |v| class[v as usize]);
    // Each face now occurs twice, once from either side of the sphere.
    let mut seen = std::collections::BTreeSet::new();
    mesh.faces.retain(|f| {
        let mut key = f.clone();
        key.sort_unstable();
        seen.insert(key)
    });
    // Even in all coordinates together, so the same for opposite points.
    mesh.moved(|[x, y, z]| [y * z + 0.3 * x * x, z * x + 0.5 * y * y, x * y + 0.7 * z * z])
}
