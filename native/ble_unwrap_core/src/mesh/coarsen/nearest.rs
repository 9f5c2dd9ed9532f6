//! For each fine face the coarse face it lies on.

use nalgebra::{Point3, Vector3};
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

use super::collapse::MOST_NEIGHBOURS;
use crate::mesh::measure::area_vector;
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Faces a task searches between two looks at the cancel flag.
const CHECK_EVERY: usize = 1024;

/// For each face of `fine` the face of `coarse` nearest to its centroid among those at the vertices
/// its corners went to; at vertices of more than [`MOST_NEIGHBOURS`] only if there is no other. A coarse face turned away counts as further: on a thin sheet the two sides
/// are as near as the coarsening is inexact, and share the vertices of the rim.
pub(super) fn nearest_faces(
    fine: &TriMesh,
    coarse: &TriMesh,
    vertex: &[VertexId],
    progress: &Progress,
) -> Result<Vec<FaceId>, Cancelled> {
    let plates: Vec<Plate> = coarse.faces().map(|f| Plate::new(coarse.triangle_positions(f))).collect();
    let degree: Vec<u32> = coarse.vertices().map(|v| coarse.outgoing(v).count() as u32).collect();
    let nearest = |f: usize| {
        if f.is_multiple_of(CHECK_EVERY) {
            progress.check()?;
        }
        let f = FaceId::new(f);
        let p = fine.triangle_positions(f);
        let centroid = Point3::from((p[0].coords + p[1].coords + p[2].coords) / 3.0);
        let normal = area_vector(p).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let roots = fine.triangle(f).map(|v| vertex[v.index()]);
        let mut best = (f64::INFINITY, FaceId::NONE);
        for root in asked(roots, &degree) {
            for h in coarse.outgoing(root) {
                let g = h.face();
                let candidate = (plates[g.index()].remoteness(&centroid, &normal), g);
                if candidate < best || best.1.is_none() {
                    best = candidate;
                }
            }
        }
        Ok(best.1)
    };
    (0..fine.face_count()).into_par_iter().with_min_len(CHECK_EVERY).map(nearest).collect()
}

/// The coarse vertices, each once, whose faces are candidates for a fine face with its corners there. All faces of a hub,
/// asked for by each of its fine faces, would be quadratic, and those on its rim know the ones near: so not the hubs, but
/// where all three are hubs the smallest. The sum of that over the triangles of a surface is linear.
fn asked(roots: [VertexId; 3], degree: &[u32]) -> impl Iterator<Item = VertexId> {
    let size = roots.map(|root| degree[root.index()]);
    let most = size.into_iter().min().unwrap_or(0).max(MOST_NEIGHBOURS);
    (0..3).filter(move |&k| size[k] <= most && !roots[..k].contains(&roots[k])).map(move |k| roots[k])
}

/// A triangle prepared for distances.
struct Plate {
    corners: [Point3<f64>; 3],
    /// Unit normal; zero without area.
    normal: Vector3<f64>,
    area: f64,
}

impl Plate {
    fn new(corners: [Point3<f64>; 3]) -> Self {
        let double = area_vector(corners);
        let normal = double.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        Self { corners, normal, area: 0.5 * double.norm() }
    }

    /// The squared distance of a point, plus up to the area if its normal looks the other way.
    fn remoteness(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let away = self.normal.dot(normal).min(0.0);
        self.squared_distance(p) + self.area * away * away
    }

    /// Any triangle, degenerate ones too.
    fn squared_distance(&self, p: &Point3<f64>) -> f64 {
        let mut inside = self.area > 0.0;
        let mut least = f64::INFINITY;
        for k in 0..3 {
            let a = self.corners[k];
            let (side, offset) = (self.corners[(k + 1) % 3] - a, p - a);
            let outward = side.cross(&self.normal).dot(&offset) > 0.0;
            inside &= !outward;
            // Where the point is on the inner side of a line, another line or the plane is nearer.
            if outward || self.area <= 0.0 {
                let length = side.norm_squared();
                let t = if length > 0.0 { (side.dot(&offset) / length).clamp(0.0, 1.0) } else { 0.0 };
                least = least.min((offset - side * t).norm_squared());
            }
        }
        if inside {
            let height = self.normal.dot(&(p - self.corners[0]));
            return height * height;
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faces_asked_grow_with_the_mesh_and_not_with_its_hubs() {
        // The faces that a cone asks which is coarsened no further: its tip has as many as its rim has edges.
        let asked_of_cone = |n: usize| -> usize {
            let positions: Vec<Point3<f64>> = std::iter::once(Point3::new(0.0, 0.0, 1.0))
                .chain(
                    (0..n)
                        .map(|i| (i as f64 / n as f64 * std::f64::consts::TAU).sin_cos())
                        .map(|(s, c)| Point3::new(c, s, 0.0)),
                )
                .collect();
            let triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, i as u32 + 1, ((i + 1) % n) as u32 + 1]).collect();
            let (cone, _) = TriMesh::from_triangles(&positions, &triangles);
            let degree: Vec<u32> = cone.vertices().map(|v| cone.outgoing(v).count() as u32).collect();
            let faces = |f| asked(cone.triangle(f), &degree).map(|v| degree[v.index()] as usize).sum::<usize>();
            cone.faces().map(faces).sum()
        };
        let (few, many) = (asked_of_cone(1000), asked_of_cone(4000));
        assert!(few >= 1000 && many <= 4 * few, "{few} faces become {many} for four times as many");
    }

    #[test]
    fn distance_to_a_triangle_is_that_to_its_nearest_sample() {
        let triangles = [
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [0.3, 0.8, -0.1]],
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.1, 0.05, 0.0]],
            [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 0.5, 0.0]],
            [[0.2, 0.2, 0.2]; 3],
        ];
        for corners in triangles {
            let plate = Plate::new(corners.map(|c| Point3::from(Vector3::from(c))));
            for i in 0..64 {
                let p = Point3::new(f64::from(i % 4), f64::from(i / 4 % 4), f64::from(i / 16)) * 0.6
                    - Vector3::new(0.5, 0.4, 0.9);
                let n = 200;
                let mut sampled = f64::INFINITY;
                for a in 0..=n {
                    for b in 0..=n - a {
                        let (s, t) = (f64::from(a) / f64::from(n), f64::from(b) / f64::from(n));
                        let q = plate.corners[0]
                            + (plate.corners[1] - plate.corners[0]) * s
                            + (plate.corners[2] - plate.corners[0]) * t;
                        sampled = sampled.min((q - p).norm());
                    }
                }
                let exact = plate.squared_distance(&p).sqrt();
                assert!(exact <= sampled + 1e-12 && sampled <= exact + 0.01, "{corners:?} {p}: {exact} {sampled}");
            }
        }
    }
}
