//! Surfaces without a boundary.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use crate::open::{cylinder, wrapped_grid};
use crate::poly_mesh::PolyMesh;

/// The unit sphere in triangles: an icosahedron, each face split in four `level` times. 20·4^level
/// faces.
#[must_use]
pub fn ico_sphere(level: usize) -> PolyMesh {
    // A pole, two rings of five, the other pole.
    let ring = |z: f64, shift: f64| {
        (0..5).map(move |k| {
            let (s, c) = (TAU * (f64::from(k) + shift) / 5.0).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [r * c, r * s, z]
        })
    };
    let z = 1.0 / 5.0_f64.sqrt();
    let mut positions = vec![[0.0, 0.0, 1.0]];
    positions.extend(ring(z, 0.0).chain(ring(-z, 0.5)));
    positions.push([0.0, 0.0, -1.0]);
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for k in 0..5 {
        let next = (k + 1) % 5;
        let (a, b, c, d) = (1 + k, 1 + next, 6 + k, 6 + next);
        faces.extend([[0, a, b], [a, c, b], [b, c, d], [c, 11, d]]);
    }
    for _ in 0..level {
        let mut middle: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut split = |a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (p, q) = (positions[a as usize], positions[b as usize]);
                positions.push(normalised([p[0] + q[0], p[1] + q[1], p[2] + q[2]]));
                positions.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (split(a, b), split(b, c), split(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    PolyMesh { positions, faces: faces.into_iter().map(Vec::from).collect() }
}

pub(crate) fn normalised(p: [f64; 3]) -> [f64; 3] {
    let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
    p.map(|x| x / length)
}

/// The unit sphere by longitude and latitude: quads, and triangles at the poles.
#[must_use]
pub fn uv_sphere(around: usize, along: usize) -> PolyMesh {
    let mut mesh = wrapped_grid(around, along - 2, [true, false], |u, v| {
        let t = PI * (1.0 + v * (along - 2) as f64) / along as f64;
        [t.sin() * (TAU * u).cos(), t.sin() * (TAU * u).sin(), -t.cos()]
    });
    let (south, n) = (mesh.positions.len() as u32, around as u32);
    mesh.positions.extend([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]);
    for i in 0..n {
        let next = (i + 1) % n;
        mesh.faces.push(vec![next, i, south]);
        mesh.faces.push(vec![south - n + i, south - n + next, south + 1]);
    }
    mesh
}

/// A cylinder closed by two polygons with as many corners as it has sides.
#[must_use]
pub fn capped_cylinder(height: f64, around: usize, along: usize) -> PolyMesh {
    let mut mesh = cylinder(height, around, along);
    let (n, top) = (around as u32, (around * along) as u32);
    mesh.faces.push((0..n).rev().collect());
    mesh.faces.push((top..top + n).collect());
    mesh
}

/// A torus of radii 1 and `tube`, in quads.
#[must_use]
pub fn torus(tube: f64, around: usize, across: usize) -> PolyMesh {
    wrapped_grid(around, across, [true, true], |u, v| {
        let r = 1.0 + tube * (TAU * v).cos();
        [r * (TAU * u).cos(), r * (TAU * u).sin(), tube * (TAU * v).sin()]
    })
}

/// The outer faces of unit cubes, their corners shared. `full` tells which cells of the box are
/// cubes.
#[must_use]
pub fn voxels(size: [usize; 3], full: impl Fn([usize; 3]) -> bool) -> PolyMesh {
    let is_full =
        |cell: [i64; 3]| (0..3).all(|k| (0..size[k] as i64).contains(&cell[k])) && full(cell.map(|x| x as usize));
    let mut mesh = PolyMesh::default();
    let mut number: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let cells = (0..size[0]).flat_map(|x| (0..size[1]).flat_map(move |y| (0..size[2]).map(move |z| [x, y, z])));
    for cell in cells.map(|c| c.map(|x| x as i64)).filter(|&c| is_full(c)) {
        for axis in 0..3 {
            for front in [false, true] {
                let mut neighbour = cell;
                neighbour[axis] += if front { 1 } else { -1 };
                if is_full(neighbour) {
                    continue;
                }
                let mut face: Vec<u32> = [(0, 0), (1, 0), (1, 1), (0, 1)]
                    .into_iter()
                    .map(|(du, dv)| {
                        let mut p = cell;
                        p[axis] += i64::from(front);
                        p[(axis + 1) % 3] += du;
                        p[(axis + 2) % 3] += dv;
                        *number.entry(p).or_insert_with(|| {
                            mesh.positions.push(p.map(|x| x as f64));
                            mesh.positions.len() as u32 - 1
                        })
                    })
                    .collect();
                if !front {
                    face.reverse();
                }
                mesh.faces.push(face);
            }
        }
    }
    mesh
}

/// A plate with `genus` square holes.
#[must_use]
pub fn genus_plate(genus: usize) -> PolyMesh {
    voxels([2 * genus + 1, 3, 2], |[x, y, _]| x % 2 == 0 || y != 1)
}

/// A sphere with spikes ten times its radius at the vertices of an icosahedron split twice.
#[must_use]
pub fn hedgehog() -> PolyMesh {
    let spikes = ico_sphere(2).positions.len();
    let mut mesh = ico_sphere(4);
    mesh.positions[..spikes].iter_mut().for_each(|p| *p = p.map(|x| 10.0 * x));
    mesh
}

/// Three spheres inside one another, the middle one wound inwards.
#[must_use]
pub fn nested_shells() -> PolyMesh {
    let shell = |r: f64| ico_sphere(2).moved(|p| p.map(|x| r * x));
    shell(1.0).joined(&shell(0.8).flipped(|_| true)).joined(&shell(0.6))
}
