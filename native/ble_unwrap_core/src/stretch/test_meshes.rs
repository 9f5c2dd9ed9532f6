//! Small meshes that several tests of this stage share.

use nalgebra::Point3;

use crate::mesh::TriMesh;

/// w×h squares cut along their diagonals; corner (i, j) lies at `place(i, j)`.
pub(super) fn grid(w: usize, h: usize, place: impl Fn(f64, f64) -> Point3<f64>) -> TriMesh {
    let positions: Vec<_> =
        (0..=h).flat_map(|j| (0..=w).map(move |i| (i as f64, j as f64))).map(|(x, y)| place(x, y)).collect();
    let at = |i: usize, j: usize| (j * (w + 1) + i) as u32;
    let mut triangles = Vec::new();
    for j in 0..h {
        for i in 0..w {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::from_triangles(&positions, &triangles).0
}

/// A straight strip of unit squares, `length` long.
pub(super) fn strip(length: usize) -> TriMesh {
    grid(length, 1, |x, y| Point3::new(x, y, 0.0))
}

/// A flat ring of radii 1 and 2.
pub(super) fn annulus(around: usize, across: usize) -> TriMesh {
    let mut positions = Vec::new();
    for j in 0..=across {
        for i in 0..around {
            let (a, r) = (std::f64::consts::TAU * i as f64 / around as f64, 1.0 + j as f64 / across as f64);
            positions.push(Point3::new(r * a.cos(), r * a.sin(), 0.0));
        }
    }
    let at = |i: usize, j: usize| (j * around + i % around) as u32;
    let mut triangles = Vec::new();
    for j in 0..across {
        for i in 0..around {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, d, c], [a, c, b]]);
        }
    }
    TriMesh::from_triangles(&positions, &triangles).0
}

/// A unit hemisphere over a grid of n×n squares mapped to the disk, pole in the middle.
pub(super) fn hemisphere(n: usize) -> TriMesh {
    grid(n, n, |x, y| {
        let (x, y) = (2.0 * x / n as f64 - 1.0, 2.0 * y / n as f64 - 1.0);
        // The square's rings become circles of latitude.
        let latitude = x.abs().max(y.abs()) * std::f64::consts::FRAC_PI_2;
        let around = x.hypot(y).max(1e-300);
        Point3::new(latitude.sin() * x / around, latitude.sin() * y / around, latitude.cos())
    })
}
