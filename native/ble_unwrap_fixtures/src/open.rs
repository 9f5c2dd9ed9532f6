//! Surfaces with a boundary.

use std::f64::consts::TAU;

use crate::noise::random;
use crate::poly_mesh::PolyMesh;

/// nx × ny quads over the unit square, placed by `f`.
#[must_use]
pub fn grid(nx: usize, ny: usize, f: impl Fn(f64, f64) -> [f64; 3]) -> PolyMesh {
    wrapped_grid(nx, ny, [false, false], f)
}

/// nx × ny quads over the unit square, placed by `f`; `wrap` joins the last column and row to the
/// first.
#[must_use]
pub fn wrapped_grid(nx: usize, ny: usize, wrap: [bool; 2], f: impl Fn(f64, f64) -> [f64; 3]) -> PolyMesh {
    let (columns, rows) = (nx + usize::from(!wrap[0]), ny + usize::from(!wrap[1]));
    let at = |i: usize, j: usize| ((j % rows) * columns + i % columns) as u32;
    let (u, v) = (|i: usize| i as f64 / nx as f64, |j: usize| j as f64 / ny as f64);
    PolyMesh {
        positions: (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| f(u(i), v(j))).collect(),
        faces: (0..ny)
            .flat_map(|j| (0..nx).map(move |i| (i, j)))
            .map(|(i, j)| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            .collect(),
    }
}

/// A flat rectangle `width` × 1 of `n`-high square quads.
#[must_use]
pub fn rectangle(width: usize, n: usize) -> PolyMesh {
    grid(width * n, n, |u, v| [u * width as f64, v, 0.0])
}

/// Three quarters of a flat square of 2n × 2n quads.
#[must_use]
pub fn l_shape(n: usize) -> PolyMesh {
    grid(2 * n, 2 * n, |u, v| [2.0 * u, 2.0 * v, 0.0]).retained(|f| f % (2 * n) < n || f / (2 * n) < n)
}

/// A disc of triangles in `rings` rings of 6, 12, 18… vertices; `f` places a point given its radius
/// in [0, 1] and angle.
fn rings_of_triangles(rings: usize, f: impl Fn(f64, f64) -> [f64; 3]) -> PolyMesh {
    let mut mesh = PolyMesh { positions: vec![f(0.0, 0.0)], faces: Vec::new() };
    let first = |ring: usize| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    let at = |ring: usize, k: usize| (first(ring) + if ring == 0 { 0 } else { k % (6 * ring) }) as u32;
    for ring in 1..=rings {
        for k in 0..6 * ring {
            mesh.positions.push(f(ring as f64 / rings as f64, TAU * k as f64 / (6 * ring) as f64));
        }
        for sector in 0..6 {
            for k in 0..ring {
                let (outer, inner) = (sector * ring + k, sector * (ring - 1) + k);
                mesh.faces.push(vec![at(ring, outer), at(ring, outer + 1), at(ring - 1, inner)]);
                if k + 1 < ring {
                    mesh.faces.push(vec![at(ring, outer + 1), at(ring - 1, inner + 1), at(ring - 1, inner)]);
                }
            }
        }
    }
    mesh
}

/// The flat unit disc in 6·rings² triangles.
#[must_use]
pub fn disc(rings: usize) -> PolyMesh {
    rings_of_triangles(rings, |r, t| [r * t.cos(), r * t.sin(), 0.0])
}

/// The part of the unit sphere within `angle` radians of the pole: π/2 gives a hemisphere.
#[must_use]
pub fn spherical_cap(angle: f64, rings: usize) -> PolyMesh {
    rings_of_triangles(rings, |r, t| {
        let (s, c) = (r * angle).sin_cos();
        [s * t.cos(), s * t.sin(), c]
    })
}

/// A flat ring between the radii `inner` and 1.
#[must_use]
pub fn annulus(inner: f64, around: usize, across: usize) -> PolyMesh {
    wrapped_grid(around, across, [true, false], |u, v| {
        let r = 1.0 + v * (inner - 1.0);
        [r * (TAU * u).cos(), r * (TAU * u).sin(), 0.0]
    })
}

/// An open cylinder of radius 1.
#[must_use]
pub fn cylinder(height: f64, around: usize, along: usize) -> PolyMesh {
    wrapped_grid(around, along, [true, false], |u, v| [(TAU * u).cos(), (TAU * u).sin(), height * v])
}

/// A cone of base radius 1 with an apex, without its base.
#[must_use]
pub fn cone(height: f64, around: usize, along: usize) -> PolyMesh {
    let mut mesh = wrapped_grid(around, along - 1, [true, false], |u, v| {
        let t = v * (along - 1) as f64 / along as f64;
        [(1.0 - t) * (TAU * u).cos(), (1.0 - t) * (TAU * u).sin(), height * t]
    });
    let apex = mesh.positions.len() as u32;
    mesh.positions.push([0.0, 0.0, height]);
    let last = apex - around as u32;
    mesh.faces.extend((0..around as u32).map(|i| vec![last + i, last + (i + 1) % around as u32, apex]));
    mesh
}

/// A ramp of `quads` that winds `turns` times around an axis and rises `rise` a quad: seen from above,
/// it covers itself.
#[must_use]
pub fn spiral_ramp(quads: usize, turns: f64, rise: f64) -> PolyMesh {
    grid(quads, 1, |u, v| {
        let (r, t) = (1.5 - 0.5 * v, TAU * turns * u);
        [r * t.cos(), r * t.sin(), rise * quads as f64 * u]
    })
}

/// A tube along a helix of `turns` turns, open at both ends.
#[must_use]
pub fn helix_tube(turns: f64, along: usize, around: usize) -> PolyMesh {
    const PITCH: f64 = 0.5;
    const RADIUS: f64 = 0.12;
    wrapped_grid(around, along, [true, false], |u, v| {
        let t = TAU * turns * v;
        let out = [t.cos(), t.sin(), 0.0];
        let slope = (PITCH / TAU).hypot(1.0);
        // Across the tube: outwards, and along the binormal of the helix.
        let up = [PITCH / TAU * t.sin() / slope, -PITCH / TAU * t.cos() / slope, 1.0 / slope];
        let (s, c) = (-TAU * u).sin_cos();
        let axis = [out[0], out[1], PITCH * turns * v];
        [0, 1, 2].map(|k| axis[k] + RADIUS * (c * out[k] + s * up[k]))
    })
}

/// A strip folded flat onto itself `folds` times: its layers coincide.
#[must_use]
pub fn zigzag(folds: usize, n: usize) -> PolyMesh {
    grid((folds + 1) * n, n, |u, v| {
        // Folded by whole cells, so that layers coincide exactly.
        let cell = (u * ((folds + 1) * n) as f64).round() as usize;
        let (layer, step) = (cell / n, cell % n);
        let x = if layer % 2 == 0 { step } else { n - step };
        [x as f64 / n as f64, v, 0.0]
    })
}

/// Every face with vertices of its own.
#[must_use]
pub fn soup(mesh: &PolyMesh) -> PolyMesh {
    let mut first = 0;
    let own = |f: &Vec<u32>| {
        let face = (first..first + f.len() as u32).collect();
        first += f.len() as u32;
        face
    };
    PolyMesh {
        faces: mesh.faces.iter().map(own).collect(),
        positions: mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]).collect(),
    }
}

/// `count` separate triangles and quads, turned and scattered.
#[must_use]
pub fn many_components(count: usize) -> PolyMesh {
    let mut mesh = PolyMesh::default();
    for k in 0..count {
        let draw = |i: u64| random(17, 16 * k as u64 + i);
        let (s, c) = (TAU * draw(0)).sin_cos();
        let centre = [draw(1), draw(2), draw(3)].map(|x| 100.0 * x);
        let side = 0.2 + draw(4);
        let first = mesh.positions.len() as u32;
        let corners = if k % 2 == 0 { 3 } else { 4 };
        for (x, y) in [(0.0, 0.0), (side, 0.0), (side, 1.0), (0.0, 1.0)].into_iter().take(corners) {
            mesh.positions.push([centre[0] + c * x - s * y, centre[1] + s * x + c * y, centre[2] + 0.3 * x]);
        }
        mesh.faces.push((first..first + corners as u32).collect());
    }
    mesh
}

/// A fan of `count` triangles that are `thinness` as wide as long.
#[must_use]
pub fn needles(count: usize, thinness: f64) -> PolyMesh {
    let mut mesh = PolyMesh { positions: vec![[0.0; 3]], faces: Vec::new() };
    for i in 0..=count {
        let t = thinness * i as f64;
        mesh.positions.push([t.cos(), t.sin(), 0.0]);
    }
    mesh.faces = (1..=count as u32).map(|i| vec![0, i, i + 1]).collect();
    mesh
}

/// A strip of triangles with one angle just short of π.
#[must_use]
pub fn caps(count: usize, height: f64) -> PolyMesh {
    let mut mesh = PolyMesh::default();
    for i in 0..=count {
        mesh.positions.extend([[i as f64, 0.0, 0.0], [i as f64 + 0.5, height, 0.0]]);
    }
    for i in (0..2 * count as u32).step_by(2) {
        mesh.faces.extend([vec![i, i + 2, i + 1], vec![i + 1, i + 2, i + 3]]);
    }
    mesh
}
