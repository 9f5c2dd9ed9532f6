//! Surfaces that branch, touch or lie on themselves.

use std::f64::consts::PI;

use crate::closed::voxels;
use crate::open::grid;
use crate::poly_mesh::PolyMesh;

fn plane(u: f64, v: f64) -> [f64; 3] {
    [u, v, 0.0]
}

/// Two triangles that share a vertex.
#[must_use]
pub fn bow_tie() -> PolyMesh {
    PolyMesh {
        positions: vec![[0.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]],
        faces: vec![vec![0, 1, 2], vec![0, 3, 4]],
    }
}

/// Quads that share one edge, as the pages of an open book, all wound the same way.
#[must_use]
pub fn book(pages: usize) -> PolyMesh {
    let mut mesh = PolyMesh { positions: vec![[0.0; 3], [0.0, 0.0, 1.0]], faces: Vec::new() };
    for i in 0..pages {
        let (s, c) = (PI * i as f64 / (pages - 1) as f64).sin_cos();
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[c, s, 0.0], [c, s, 1.0]]);
        mesh.faces.push(vec![0, first, first + 1, 1]);
    }
    mesh
}

/// A flat sheet of 2n × n quads with a wall of n quads standing on its middle line.
#[must_use]
pub fn fin(n: usize) -> PolyMesh {
    let mut mesh = grid(2 * n, n, |u, v| [2.0 * u, v, 0.0]);
    let foot = |j: usize| (j * (2 * n + 1) + n) as u32;
    let first = mesh.positions.len() as u32;
    mesh.positions.extend((0..=n).map(|j| [1.0, j as f64 / n as f64, 0.5]));
    mesh.faces.extend((0..n).map(|j| vec![foot(j), foot(j + 1), first + j as u32 + 1, first + j as u32]));
    mesh
}

/// Two cubes that share one edge.
#[must_use]
pub fn touching_cubes() -> PolyMesh {
    voxels([2, 2, 1], |[x, y, _]| x == y)
}

/// The black squares of an n × n board, joined at their corners only.
#[must_use]
pub fn checkerboard(n: usize) -> PolyMesh {
    grid(n, n, plane).retained(|f| (f % n + f / n).is_multiple_of(2))
}

/// A sheet of n × n quads with one quad in seven listed twice.
#[must_use]
pub fn duplicated_faces(n: usize) -> PolyMesh {
    let mut mesh = grid(n, n, plane);
    let again: Vec<Vec<u32>> = mesh.faces.iter().skip(n + 1).step_by(7).cloned().collect();
    mesh.faces.extend(again);
    mesh
}

/// A sheet of n × n quads and the same again from below, on the same vertices.
#[must_use]
pub fn double_sided(n: usize) -> PolyMesh {
    let mut mesh = grid(n, n, plane);
    let below: Vec<Vec<u32>> = mesh.faces.iter().map(|f| f.iter().rev().copied().collect()).collect();
    mesh.faces.extend(below);
    mesh
}
