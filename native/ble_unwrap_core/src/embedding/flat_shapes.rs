//! Plane figures with exact distances, for the tests of this stage.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::distortion::signed_double_area;
use crate::geodesics::LandmarkDistances;
use crate::mesh::{TriMesh, VertexId};

/// A triangulated figure in the plane.
pub(super) struct FlatShape {
    pub(super) points: Vec<Point2<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// A grid of m×n vertices; the diagonals alternate.
pub(super) fn rectangle(m: usize, n: usize, width: f64, height: f64) -> FlatShape {
    let place = |k: usize, count: usize, size: f64| size * k as f64 / (count - 1) as f64;
    let points = (0..m * n).map(|v| Point2::new(place(v % m, m, width), place(v / m, n, height))).collect();
    let mut triangles = Vec::new();
    for j in 0..n - 1 {
        for i in 0..m - 1 {
            let a = (j * m + i) as u32;
            let (b, c, d) = (a + 1, a + m as u32 + 1, a + m as u32);
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    FlatShape { points, triangles }
}

/// An L of two arms, 2s cells long and s wide, whose distances are taken straight across the notch.
pub(super) fn ell(s: usize) -> FlatShape {
    let square = rectangle(2 * s + 1, 2 * s + 1, 2.0, 2.0);
    let inside = |t: &[u32; 3]| {
        let centre = t.iter().map(|v| square.points[*v as usize].coords).sum::<Vector2<f64>>() / 3.0;
        centre.x < 1.0 || centre.y < 1.0
    };
    let mut new = vec![u32::MAX; square.points.len()];
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for t in square.triangles.iter().filter(|t| inside(t)) {
        triangles.push(t.map(|v| {
            if new[v as usize] == u32::MAX {
                new[v as usize] = points.len() as u32;
                points.push(square.points[v as usize]);
            }
            new[v as usize]
        }));
    }
    FlatShape { points, triangles }
}

/// Rings of 6r vertices around a centre: 3r(r+1)+1 in all, unit radius.
pub(super) fn disc(rings: usize) -> FlatShape {
    let mut points = vec![Point2::origin()];
    let mut triangles = Vec::new();
    let (mut inner, mut inner_start) = (1, 0);
    for r in 1..=rings {
        let (count, start) = (6 * r, points.len());
        for i in 0..count {
            let angle = std::f64::consts::TAU * i as f64 / count as f64;
            points.push(Point2::new(angle.cos(), angle.sin()) * (r as f64 / rings as f64));
        }
        // Sew the two rings: each step forward on the one that lags.
        let (mut i, mut o) = (0, 0);
        while o < count || (inner > 1 && i < inner) {
            let (a, b) = ((inner_start + i % inner) as u32, (start + o % count) as u32);
            if inner == 1 || o * inner <= i * count {
                triangles.push([a, b, (start + (o + 1) % count) as u32]);
                o += 1;
            } else {
                triangles.push([a, b, (inner_start + (i + 1) % inner) as u32]);
                i += 1;
            }
        }
        (inner, inner_start) = (count, start);
    }
    FlatShape { points, triangles }
}

impl FlatShape {
    /// The figure as a mesh; its vertices are numbered by first use, not as the points are.
    pub(super) fn mesh(&self) -> TriMesh {
        let positions: Vec<_> = self.points.iter().map(|p| [p.x, p.y, 0.0].into()).collect();
        TriMesh::from_triangles(&positions, &self.triangles).0
    }

    pub(super) fn squared_distances(&self) -> Vec<f64> {
        self.points.iter().flat_map(|p| self.points.iter().map(move |q| (p - q).norm_squared())).collect()
    }

    /// Exact distances from `count` landmarks spread over the figure: farthest-point order from vertex 0.
    pub(super) fn distances(&self, count: usize) -> LandmarkDistances {
        let mut nearest = vec![f64::INFINITY; self.points.len()];
        let mut landmarks = vec![0];
        while landmarks.len() < count {
            let last = self.points[landmarks[landmarks.len() - 1]];
            nearest.iter_mut().zip(&self.points).for_each(|(d, p)| *d = d.min((p - last).norm()));
            let far = (0..nearest.len()).max_by(|a, b| nearest[*a].total_cmp(&nearest[*b]).then(b.cmp(a)));
            landmarks.push(far.expect("a figure has points"));
        }
        let row = |l: &usize| {
            let from = self.points[*l];
            self.points.iter().map(move |p| (p - from).norm() as f32)
        };
        let rows = landmarks.iter().flat_map(row).collect();
        LandmarkDistances::new(landmarks.iter().map(|l| VertexId::new(*l)).collect(), self.points.len(), rows)
    }
}

/// Root mean square distance of n×2 `found` from `points` after the best rigid motion or mirroring
/// (Procrustes; no scaling), over the root mean square radius of the points.
pub(super) fn misfit(points: &[Point2<f64>], found: &[f64]) -> f64 {
    assert_eq!(found.len(), 2 * points.len());
    let n = points.len() as f64;
    let found: Vec<Vector2<f64>> = found.chunks_exact(2).map(Vector2::from_column_slice).collect();
    let a_mean = points.iter().map(|p| p.coords).sum::<Vector2<f64>>() / n;
    let b_mean = found.iter().sum::<Vector2<f64>>() / n;
    let cross: Matrix2<f64> =
        points.iter().zip(&found).map(|(p, b)| (p.coords - a_mean) * (b - b_mean).transpose()).sum();
    let svd = cross.svd(true, true);
    let turn = svd.u.expect("asked for") * svd.v_t.expect("asked for");
    let error: f64 =
        points.iter().zip(&found).map(|(p, b)| (p.coords - a_mean - turn * (b - b_mean)).norm_squared()).sum();
    let size: f64 = points.iter().map(|p| (p.coords - a_mean).norm_squared()).sum();
    (error / size).sqrt()
}

/// Number of triangles whose orientation is not that of the majority.
pub(super) fn flips(shape: &FlatShape, uv: &[Point2<f64>]) -> usize {
    let negative = shape.triangles.iter().filter(|t| signed_double_area(t.map(|v| uv[v as usize])) <= 0.0).count();
    negative.min(shape.triangles.len() - negative)
}
