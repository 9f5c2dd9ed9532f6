//! Polygons of a mesh of triangles that is mirrored but for how its quads were divided.
//!
//! Files of triangles mostly come from quads, each divided by one of its diagonals, and on the other side of a mirror plane not
//! always by the diagonal that mirrors it. The plane is found by the vertices alone; where the image of an edge is no edge, but the
//! other diagonal of its two triangles is one, both triangles are one quad again.

use std::collections::HashMap;

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

use super::index::{HalfedgeId, VertexId};
use super::likeness::Shape;
use super::tri_mesh::TriMesh;
use crate::collections::DisjointSets;
use crate::progress::{Cancelled, Progress};

/// The two diagonals of a quad pass each other within so many tolerances: three hundredths of the extent. Else the surface is another, as
/// where a ridge on one side is a valley on the other.
const FLAT: f64 = 30.0;
/// Where a cell has more vertices, detail is finer than the tolerance can tell apart, and no plane is looked for.
const MOST_IN_CELL: usize = 64;
/// Iterations for three principal axes, far more than they take.
const MOST_ITERATIONS: usize = 100;
/// Sides of the cells that vertices are sorted into, in tolerances: a ball of one tolerance meets two cells along each axis at most.
const CELL: f64 = 4.0;

/// Larger polygons of a connected mesh, each of which has a mirror image across one plane: a label for each face, where two that meet at an
/// edge have the same if its image is the other diagonal of theirs. `polygon` names the polygon of each face. `None` where no plane through the
/// mean of the vertices, across a principal axis of theirs or an axis of the coordinates, mirrors all, or where one mirrors all polygons as they
/// are; nor where vertices are too near to each other, as the two sides of a cut are. O(n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn mirrored_polygons(
    mesh: &TriMesh,
    polygon: &[u32],
    progress: &Progress,
) -> Result<Option<Vec<u32>>, Cancelled> {
    let Some(shape) = Shape::new(mesh, polygon) else { return Ok(None) };
    let Some(cells) = Cells::new(mesh.positions(), shape.tolerance) else { return Ok(None) };
    let middle = Point3::from(mean(mesh));
    for normal in normals(mesh) {
        progress.check()?;
        if let Some(image) = images(mesh, &cells, middle, normal) {
            return Ok(merged(mesh, polygon, &image, shape.tolerance));
        }
    }
    Ok(None)
}

fn mean(mesh: &TriMesh) -> Vector3<f64> {
    mesh.positions().iter().map(|p| p.coords).sum::<Vector3<f64>>() / mesh.vertex_count().max(1) as f64
}

/// Across what a mirror plane may lie: the coordinates' axes, as most models are made, and the principal axes of the vertices, of which one is
/// the normal of the plane unless two are as long.
fn normals(mesh: &TriMesh) -> Vec<Vector3<f64>> {
    let middle = mean(mesh);
    let scatter: Matrix3<f64> =
        mesh.positions().iter().map(|p| (p.coords - middle) * (p.coords - middle).transpose()).sum();
    let axes = SymmetricEigen::try_new(scatter, f64::EPSILON, MOST_ITERATIONS).map(|eigen| eigen.eigenvectors);
    let of_mesh = axes.into_iter().flat_map(|axes| (0..3).map(move |k| axes.column(k).into_owned()));
    [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().chain(of_mesh).collect()
}

/// The mirror image of each vertex; `None` where one has none.
fn images(mesh: &TriMesh, cells: &Cells<'_>, middle: Point3<f64>, normal: Vector3<f64>) -> Option<Vec<VertexId>> {
    let mirrored = |p: Point3<f64>| p - normal * (2.0 * normal.dot(&(p - middle)));
    let image: Vec<VertexId> = mesh.positions().iter().map(|p| cells.nearest(mirrored(*p))).collect::<Option<_>>()?;
    image.iter().enumerate().all(|(v, w)| image[w.index()].index() == v).then_some(image)
}

/// The labels by which every polygon has an image; `None` where one has none, or nothing is merged.
fn merged(mesh: &TriMesh, polygon: &[u32], image: &[VertexId], tolerance: f64) -> Option<Vec<u32>> {
    let mut sets = DisjointSets::new(mesh.face_count());
    let mut is_merged = false;
    let image = |v: VertexId| image[v.index()];
    let key = |v: VertexId, w: VertexId| (v.min(w), v.max(w));
    let edges: HashMap<(VertexId, VertexId), HalfedgeId> =
        mesh.edges().map(|h| (key(mesh.from(h), mesh.to(h)), h)).collect();
    let edge = |v: VertexId, w: VertexId| edges.get(&key(v, w)).copied();
    for h in mesh.edges() {
        let t = mesh.twin(h);
        let is_edge = edge(image(mesh.from(h)), image(mesh.to(h))).is_some();
        if t.is_none() {
            // A boundary is no diagonal.
            if !is_edge {
                return None;
            }
            continue;
        }
        let [f, g] = [h.face().index(), t.face().index()];
        if polygon[f] == polygon[g] {
            sets.join(f, g);
        } else if !is_edge {
            let beyond = |h: HalfedgeId| image(mesh.from(h.prev()));
            let other = edge(beyond(h), beyond(t)).filter(|&other| !mesh.is_boundary(other))?;
            let [along, across] = [[mesh.from(h), mesh.to(h)], [mesh.from(h.prev()), mesh.from(t.prev())]];
            if apart(mesh, along, across) > FLAT * tolerance {
                return None;
            }
            let corners = [other, mesh.twin(other)].map(|side| mesh.from(side.prev()));
            let ends = [image(mesh.from(h)), image(mesh.to(h))];
            if corners != ends && corners != [ends[1], ends[0]] {
                return None;
            }
            sets.join(f, g);
            is_merged = true;
        }
    }
    is_merged.then(|| sets.labels().0)
}

/// How far the lines through two diagonals of four corners are from each other; how far their middles are, where both run along one line.
fn apart(mesh: &TriMesh, along: [VertexId; 2], across: [VertexId; 2]) -> f64 {
    let [[a, b], [c, d]] = [along, across].map(|ends| ends.map(|v| mesh.position(v)));
    let between = nalgebra::center(&c, &d) - nalgebra::center(&a, &b);
    (b - a).cross(&(d - c)).try_normalize(f64::MIN_POSITIVE).map_or(between.norm(), |normal| between.dot(&normal).abs())
}

/// Points by the cell of a grid that they lie in.
struct Cells<'a> {
    points: &'a [Point3<f64>],
    tolerance: f64,
    members: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Cells<'a> {
    /// `None` where a cell has too many.
    fn new(points: &'a [Point3<f64>], tolerance: f64) -> Option<Self> {
        let mut cells = Self { points, tolerance, members: HashMap::with_capacity(points.len()) };
        for (i, p) in points.iter().enumerate() {
            let cell = cells.cell(p.coords);
            cells.members.entry(cell).or_default().push(VertexId::new(i).index() as u32);
        }
        cells.members.values().all(|members| members.len() <= MOST_IN_CELL).then_some(cells)
    }

    fn cell(&self, p: Vector3<f64>) -> [i64; 3] {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "an extent is a thousand tolerances, far from the bounds of the type"
        )]
        [0, 1, 2].map(|k| (p[k] / (CELL * self.tolerance)).floor() as i64)
    }

    /// The vertex nearest to a point, of those within the tolerance.
    fn nearest(&self, p: Point3<f64>) -> Option<VertexId> {
        let reach = Vector3::repeat(self.tolerance);
        let (low, high) = (self.cell(p.coords - reach), self.cell(p.coords + reach));
        let mut best: Option<(f64, u32)> = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    for &i in self.members.get(&[x, y, z]).into_iter().flatten() {
                        let apart = (self.points[i as usize] - p).norm();
                        if apart <= self.tolerance && best.is_none_or(|(least, _)| apart < least) {
                            best = Some((apart, i));
                        }
                    }
                }
            }
        }
        best.map(|(_, i)| VertexId::new(i as usize))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::mesh::test_surfaces;

    /// A sheet of 8 by 8 quads in triangles, mirrored at x = 4 as a surface; all quads are divided alike, or mirrored as `flips` says of a quad.
    fn sheet(place: impl Fn(Point3<f64>) -> Point3<f64>, flips: impl Fn(usize, usize) -> bool) -> TriMesh {
        let n = 8_u32;
        let at = |x: u32, y: u32| y * (n + 1) + x;
        let points = (0..=n).flat_map(|y| (0..=n).map(move |x| (f64::from(x), f64::from(y))));
        let height = |x: f64, y: f64| (x - 4.0).powi(2) * 0.1 + 0.3 * y + 0.05 * y * y;
        let positions: Vec<_> = points.map(|(x, y)| place(Point3::new(x, y, height(x, y)))).collect();
        let mut triangles = Vec::new();
        for y in 0..n {
            for x in 0..n {
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                let halves =
                    if flips(x as usize, y as usize) { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] };
                triangles.extend(halves);
            }
        }
        test_surfaces::mesh(&positions, &triangles)
    }

    fn found(mesh: &TriMesh) -> Option<Vec<u32>> {
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        mirrored_polygons(mesh, &polygon, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn quads_that_are_all_divided_alike_are_quads_again_however_they_lie() {
        let turn = Rotation3::from_euler_angles(0.4, -1.0, 2.0);
        for turn in [Rotation3::identity(), turn] {
            let label = found(&sheet(|p| turn * p + Vector3::new(20.0, 1.0, 3.0), |_, _| false)).expect("a plane");
            assert_eq!(label, (0..128).map(|f| f / 2).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn only_what_has_no_image_is_merged() {
        // Mirrored, but for one quad.
        let mesh = sheet(|p| p, |x, y| (x >= 4) != ((x, y) == (1, 2)));
        let label = found(&mesh).expect("a plane");
        let merged = |f: usize| label.iter().filter(|l| **l == label[f]).count() == 2;
        let quads: Vec<usize> = (0..64).filter(|&q| merged(2 * q)).collect();
        assert_eq!(quads, [2 * 8 + 1, 2 * 8 + 6]);
        assert!(found(&sheet(|p| p, |x, _| x >= 4)).is_none(), "nothing to merge");
    }

    #[test]
    fn a_ridge_is_no_diagonal_of_a_valley() {
        // One quad is folded along its diagonal, its image along the other one, as sharply.
        let folded = |height: f64| {
            move |p: Point3<f64>| match (p.x, p.y) {
                (2.0, 3.0) | (6.0, 3.0) => p + Vector3::z() * height,
                _ => p,
            }
        };
        assert!(found(&sheet(folded(0.1), |_, _| false)).is_some());
        assert!(found(&sheet(folded(3.0), |_, _| false)).is_none());
    }

    #[test]
    fn detail_finer_than_the_tolerance_is_not_looked_at() {
        let near =
            |count: usize| -> Vec<Point3<f64>> { (0..count).map(|i| Point3::new(1e-6 * i as f64, 0.0, 0.0)).collect() };
        assert!(Cells::new(&near(MOST_IN_CELL), 1.0).is_some() && Cells::new(&near(MOST_IN_CELL + 1), 1.0).is_none());
        let points = near(10);
        let cells = Cells::new(&points, 1e-7).expect("apart");
        let place = |x: f64| cells.nearest(Point3::new(x, 0.0, 0.0));
        assert_eq!(place(3.02e-6), Some(VertexId::new(3)));
        assert_eq!(place(3.5e-6), None);
    }

    #[test]
    fn what_is_not_mirrored_stays() {
        let dented = |p: Point3<f64>| if (p.x, p.y) == (2.0, 5.0) { p + Vector3::z() * 0.3 } else { p };
        assert!(found(&sheet(dented, |_, _| false)).is_none());
        assert!(found(&sheet(|p| Point3::new(p.x + 0.3 * p.y, p.y, p.z), |_, _| false)).is_none());
        assert!(found(&TriMesh::default()).is_none());
    }
}
