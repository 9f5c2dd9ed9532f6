//! Meshes and points that the stages are timed on. Nothing random: the same for every run.

use ble_unwrap_core::Progress;
use ble_unwrap_core::geodesics::{Metric, geodesic_distances};
use ble_unwrap_core::mesh::TriMesh;

/// A face-like surface of `side`² vertices: an oval bulge with nose, brows and eye sockets. About the relief of a
/// scanned face, over one unit of width.
pub(crate) fn face(side: usize) -> TriMesh {
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
            [x, y, relief(x, y)].into()
        })
        .collect();
    let mut triangles = Vec::new();
    for j in 0..side - 1 {
        for i in 0..side - 1 {
            let a = (j * side + i) as u32;
            let (b, c, d) = (a + 1, a + side as u32 + 1, a + side as u32);
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::from_triangles(&positions, &triangles).0
}

/// Geodesic distances of all pairs of vertices, row by row.
pub(crate) fn distances(mesh: &TriMesh) -> Vec<f64> {
    let all: Vec<_> = mesh.vertices().collect();
    let rows = geodesic_distances(mesh, &all, Metric::FastMarching, &Progress::new()).expect("not cancelled");
    rows.into_rows().into_iter().map(f64::from).collect()
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
