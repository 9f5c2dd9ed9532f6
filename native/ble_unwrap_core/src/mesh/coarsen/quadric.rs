//! Squared distance to planes and lines as a quadratic form.

use nalgebra::{Point3, Vector3};

use crate::mesh::TriMesh;
use crate::mesh::measure::area_vector;
use crate::progress::{Cancelled, Progress};

/// Weight of the planes that stand on boundary edges and on guides, in squared edge lengths. Ten times that of a
/// face: a boundary shows, and it cannot be mended by a vertex beyond it.
const BOUNDARY_WEIGHT: f64 = 10.0;

/// Faces read between two looks at the cancel flag.
const CHECK_EVERY: usize = 4096;

/// A weighted sum of squared distances from a point to planes and lines, and the area it stands for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    /// Upper triangle of the symmetric matrix A, row by row, of pᵀA p + 2 bᵀp + c.
    matrix: [f64; 6],
    linear: [f64; 3],
    constant: f64,
    /// Area of the surface whose planes were summed; lines and constraints have none.
    pub(super) area: f64,
}

impl Quadric {
    /// `weight` times the squared distance to the plane through `point` with unit normal `n`.
    pub(super) fn plane(n: Vector3<f64>, point: Point3<f64>, weight: f64) -> Self {
        let d = -n.dot(&point.coords);
        let w = n * weight;
        Self {
            matrix: [w.x * n.x, w.x * n.y, w.x * n.z, w.y * n.y, w.y * n.z, w.z * n.z],
            linear: [w.x * d, w.y * d, w.z * d],
            constant: weight * d * d,
            area: 0.0,
        }
    }

    /// `weight` times the squared distance to the line through `point` with unit direction `u`.
    pub(super) fn line(u: Vector3<f64>, point: Point3<f64>, weight: f64) -> Self {
        let p = point.coords;
        let foot = p - u * u.dot(&p);
        Self {
            matrix: [
                weight * (1.0 - u.x * u.x),
                -weight * u.x * u.y,
                -weight * u.x * u.z,
                weight * (1.0 - u.y * u.y),
                -weight * u.y * u.z,
                weight * (1.0 - u.z * u.z),
            ],
            linear: [-weight * foot.x, -weight * foot.y, -weight * foot.z],
            constant: weight * foot.norm_squared(),
            area: 0.0,
        }
    }

    /// The same planes, standing for `area` of the surface.
    pub(super) fn with_area(self, area: f64) -> Self {
        Self { area, ..self }
    }

    /// The value at `p`; never negative, exact up to rounding of the order of 1e-16 of the weights
    /// times squared distances from the origin.
    pub(super) fn at(&self, p: &Point3<f64>) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.matrix;
        let [bx, by, bz] = self.linear;
        let x = xx * p.x + xy * p.y + xz * p.z + 2.0 * bx;
        let y = xy * p.x + yy * p.y + yz * p.z + 2.0 * by;
        let z = xz * p.x + yz * p.y + zz * p.z + 2.0 * bz;
        (x * p.x + y * p.y + z * p.z + self.constant).max(0.0)
    }
}

impl std::ops::AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        for (a, b) in self.matrix.iter_mut().zip(other.matrix) {
            *a += b;
        }
        for (a, b) in self.linear.iter_mut().zip(other.linear) {
            *a += b;
        }
        self.constant += other.constant;
        self.area += other.area;
    }
}

/// At each vertex a third of its faces' planes, weighted by area, and for boundary edges and guides half of a
/// plane along the edge perpendicular to the face.
pub(super) fn initial_quadrics(
    mesh: &TriMesh,
    points: &[Point3<f64>],
    progress: &Progress,
) -> Result<Vec<Quadric>, Cancelled> {
    let mut quadrics = vec![Quadric::default(); mesh.vertex_count()];
    for f in mesh.faces() {
        if f.index().is_multiple_of(CHECK_EVERY) {
            progress.check()?;
        }
        let p = mesh.triangle(f).map(|v| points[v.index()]);
        let double_area = area_vector(p);
        let normal = double_area.try_normalize(0.0);
        if let Some(n) = normal {
            let third = double_area.norm() / 6.0;
            let q = Quadric::plane(n, p[0], third).with_area(third);
            mesh.triangle(f).iter().for_each(|v| quadrics[v.index()] += q);
        }
        for h in f.halfedges().into_iter().filter(|&h| mesh.is_boundary(h) || mesh.is_guide(h)) {
            let side = p[(h.slot() + 1) % 3] - p[h.slot()];
            let Some(u) = side.try_normalize(0.0) else { continue };
            let weight = 0.5 * BOUNDARY_WEIGHT * side.norm_squared();
            // Beside a face without a normal, whatever leaves the edge's line counts.
            let q = match normal {
                Some(n) => Quadric::plane(u.cross(&n), p[h.slot()], weight),
                None => Quadric::line(u, p[h.slot()], weight),
            };
            quadrics[mesh.from(h).index()] += q;
            quadrics[mesh.to(h).index()] += q;
        }
    }
    Ok(quadrics)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_and_lines_give_squared_distances() {
        let n = Vector3::new(2.0, -1.0, 2.0) / 3.0;
        let (on, p) = (Point3::new(0.3, 0.7, -0.2), Point3::new(-1.1, 0.4, 2.0));
        let across = n.dot(&(p - on));
        let along = (p - on).norm_squared() - across * across;
        let mut q = Quadric::plane(n, on, 3.0).with_area(5.0);
        assert!((q.at(&p) - 3.0 * across * across).abs() < 1e-12);
        assert!((Quadric::line(n, on, 2.0).at(&p) - 2.0 * along).abs() < 1e-12);
        q += Quadric::line(n, on, 2.0);
        assert!((q.at(&p) - 3.0 * across * across - 2.0 * along).abs() < 1e-12);
        assert!(q.at(&on) < 1e-14);
        assert_eq!(q.area, 5.0);
    }
}
