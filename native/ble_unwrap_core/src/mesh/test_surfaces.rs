//! Small surfaces of known shape and topology for unit tests.

use std::collections::HashMap;

use nalgebra::Point3;

use super::{HalfedgeId, TriMesh};

/// A mesh from clean triangles; vertices are numbered by first use.
pub(crate) fn mesh(positions: &[Point3<f64>], triangles: &[[u32; 3]]) -> TriMesh {
    TriMesh::from_triangles(positions, triangles).0
}

/// A flat rectangle of `nx`×`ny` cells, `shear` tilting the columns (large values make obtuse
/// triangles). Bounds: x in [0, `size`\[0\]] plus the shear, y in [0, `size`\[1\]].
pub(crate) fn grid(nx: usize, ny: usize, size: [f64; 2], shear: f64) -> TriMesh {
    let point = |i: usize, j: usize| {
        let (x, y) = (size[0] * i as f64 / nx as f64, size[1] * j as f64 / ny as f64);
        Point3::new(x + shear * y, y, 0.0)
    };
    patch(nx, ny, false, false, point)
}

/// An open cylinder of radius 1 around z with `m` columns and `n` rows.
pub(crate) fn cylinder(m: usize, n: usize, height: f64) -> TriMesh {
    patch(m, n, true, false, |i, j| {
        let a = std::f64::consts::TAU * i as f64 / m as f64;
        Point3::new(a.cos(), a.sin(), height * j as f64 / n as f64)
    })
}

/// A point of a ring of some sides around z, of a radius and a height.
fn on_ring(side: usize, sides: usize, [r, z]: [f64; 2]) -> Point3<f64> {
    let (s, c) = (std::f64::consts::TAU * side as f64 / sides as f64).sin_cos();
    Point3::new(r * c, r * s, z)
}

/// Quads between rings around z of a profile of (radius, height), which `is_closed` joins at its ends; the two triangles of quad k are
/// faces 2k and 2k + 1.
pub(crate) fn turned_wall(sides: usize, profile: &[[f64; 2]], is_closed: bool) -> TriMesh {
    let rows = profile.len() - usize::from(!is_closed);
    patch(sides, rows, true, is_closed, |i, j| on_ring(i, sides, profile[j]))
}

/// The same of an open profile, with a cap of one polygon at each end. The polygon of each face comes with it.
pub(crate) fn turned(sides: usize, profile: &[[f64; 2]]) -> (TriMesh, Vec<u32>) {
    let (positions, mut triangles) = quads(sides, profile.len() - 1, true, false, |i, j| on_ring(i, sides, profile[j]));
    let walls = triangles.len() as u32;
    let mut polygon: Vec<u32> = (0..walls).map(|f| f / 2).collect();
    for (cap, (row, turn)) in (walls / 2..).zip([(0, true), (profile.len() - 1, false)]) {
        for k in 1..sides - 1 {
            let [a, b, c] = [0, k, k + 1].map(|k| (row * sides + k) as u32);
            triangles.push(if turn { [a, c, b] } else { [a, b, c] });
            polygon.push(cap);
        }
    }
    (mesh(&positions, &triangles), polygon)
}

/// A torus of radii 1 and `minor`.
pub(crate) fn torus(m: usize, n: usize, minor: f64) -> TriMesh {
    patch(m, n, true, true, |i, j| {
        let a = std::f64::consts::TAU * i as f64 / m as f64;
        let b = std::f64::consts::TAU * j as f64 / n as f64;
        let r = 1.0 + minor * b.cos();
        Point3::new(r * a.cos(), r * a.sin(), minor * b.sin())
    })
}

/// Quadrilaterals over a grid, each cut along one diagonal, closed in either direction.
fn patch(m: usize, n: usize, close_i: bool, close_j: bool, point: impl Fn(usize, usize) -> Point3<f64>) -> TriMesh {
    let (positions, triangles) = quads(m, n, close_i, close_j, point);
    mesh(&positions, &triangles)
}

/// The same as points and triangles.
fn quads(
    m: usize,
    n: usize,
    close_i: bool,
    close_j: bool,
    point: impl Fn(usize, usize) -> Point3<f64>,
) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let columns = if close_i { m } else { m + 1 };
    let rows = if close_j { n } else { n + 1 };
    let at = |i: usize, j: usize| ((j % rows) * columns + i % columns) as u32;
    let positions: Vec<_> =
        (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| point(i, j)).collect();
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..m {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions, triangles)
}

/// The unit sphere: an icosahedron, each face split into four `levels` times.
pub(crate) fn sphere(levels: usize) -> TriMesh {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut positions: Vec<Point3<f64>> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        positions.extend([Point3::new(0.0, a, b), Point3::new(a, b, 0.0), Point3::new(b, 0.0, a)]);
    }
    for p in &mut positions {
        p.coords.normalize_mut();
    }
    // The faces of the icosahedron are its triples of mutually nearest vertices.
    let near = |i: usize, j: usize| (positions[i] - positions[j]).norm() < 1.1;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let [a, b, c] = [i, j, k].map(|v| positions[v].coords);
                    let outward = a.dot(&b.cross(&c)) > 0.0;
                    triangles.push(if outward { [i, j, k] } else { [i, k, j] }.map(|v| v as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middle = HashMap::new();
        let mut split = Vec::new();
        for t in &triangles {
            let m = [0, 1, 2].map(|k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let sum = positions[a as usize].coords + positions[b as usize].coords;
                    positions.push(sum.normalize().into());
                    positions.len() as u32 - 1
                })
            });
            split.extend([[t[0], m[0], m[2]], [m[0], t[1], m[1]], [m[2], m[1], t[2]], m]);
        }
        triangles = split;
    }
    mesh(&positions, &triangles)
}

/// The boundary of a solid of unit cubes in a box of `size` cubes, two triangles a square; triangles
/// 2i and 2i + 1 make up square i. Cubes must not meet at an edge or a corner only.
pub(crate) fn cubes(size: [usize; 3], filled: impl Fn([usize; 3]) -> bool) -> TriMesh {
    let is_filled =
        |c: [isize; 3]| c.iter().zip(size).all(|(&x, s)| x >= 0 && (x as usize) < s) && filled(c.map(|x| x as usize));
    let mut vertex = HashMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for z in 0..size[2] as isize {
        for y in 0..size[1] as isize {
            for x in 0..size[0] as isize {
                if !is_filled([x, y, z]) {
                    continue;
                }
                for axis in 0..3 {
                    for side in [0, 1] {
                        let mut across = [x, y, z];
                        across[axis] += 2 * side - 1;
                        if is_filled(across) {
                            continue;
                        }
                        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                        let mut square = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
                            let mut p = [x, y, z];
                            p[axis] += side;
                            p[u] += du;
                            p[v] += dv;
                            *vertex.entry(p).or_insert_with(|| {
                                positions.push(Point3::new(p[0] as f64, p[1] as f64, p[2] as f64));
                                positions.len() as u32 - 1
                            })
                        });
                        if side == 0 {
                            square.reverse();
                        }
                        let [a, b, c, d] = square;
                        triangles.extend([[a, b, c], [a, c, d]]);
                    }
                }
            }
        }
    }
    mesh(&positions, &triangles)
}

/// A plate of unit cubes with `holes` square holes: genus `holes`.
pub(crate) fn plate(holes: usize) -> TriMesh {
    cubes([2 * holes + 1, 3, 1], |[x, y, _]| !(x % 2 == 1 && y == 1))
}

/// A sheet of 2 by 2 quads, of which two share two sides: their common corner, the only vertex above it, has no other face.
pub(crate) fn sheet_with_a_flap() -> TriMesh {
    let mut points: Vec<Point3<f64>> = (0..9).map(|i| Point3::new(f64::from(i % 3), f64::from(i / 3), 0.0)).collect();
    points.push(Point3::new(1.3, 1.0, 0.2));
    let corners: Vec<u32> =
        [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [4, 5, 9], [4, 9, 5], [3, 4, 7], [3, 7, 6], [4, 5, 8], [4, 8, 7]]
            .concat();
    let side = |h: usize| (corners[h], corners[h - h % 3 + (h + 1) % 3]);
    let is_flap = |h: usize| [4, 5].contains(&(h / 3));
    let twin = |h: usize| {
        // Of the four faces at one edge those of the flap are each glued to one of the others.
        let is_twin = |&t: &usize| {
            side(t) == (side(h).1, side(h).0) && (side(h) != (4, 5) && side(h) != (5, 4) || is_flap(t) != is_flap(h))
        };
        (0..corners.len()).find(is_twin).map_or(HalfedgeId::NONE, HalfedgeId::new)
    };
    TriMesh::from_glued(&corners, (0..corners.len()).map(twin).collect(), |source| points[source as usize]).0
}
