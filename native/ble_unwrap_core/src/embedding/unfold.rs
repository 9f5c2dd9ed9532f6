//! Charts that need no embedding: plane pieces are projected, developable pieces unfolded.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Matrix2, Point2, Vector2, Vector3};

use crate::distortion::{RestTriangle, signed_double_area, singular_values};
use crate::mesh::measure::{FLAT_DEFECT, angle_defects, area_vector};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Most that a normal may lean from the mean one: 0.5°, the angle defect that counts as flat. A face projected
/// at that slope is shortened by 4e-5.
const COPLANAR_COS: f64 = 0.999_961_9;
/// An unfolding is accepted if the singular values of every face lie this near to 1. Then its L2 stretch is below
/// 1.006. Small defects add up along the way: this, not the defect, is the decisive test.
const LARGEST_STRAIN: f64 = 5e-3;

/// The orthogonal projection of a plane mesh to its plane, one position a vertex; `None` if it is not plane.
///
/// Plane means that every face with an area worth its name (as [`RestTriangle::MIN_HEIGHT`] has it) lies
/// within half a degree of the mean normal. All such faces come out positive, with L2 stretch below 1.0001, in
/// units of the surface, with the centroid of the vertices at the origin. Not guaranteed: flatter faces may come
/// out without area or flipped, and a mesh that overlaps itself in its plane still does. O(n).
#[must_use]
pub(crate) fn plane(mesh: &TriMesh) -> Option<Vec<Point2<f64>>> {
    let normals: Vec<Vector3<f64>> = mesh.faces().map(|f| area_vector(mesh.triangle_positions(f))).collect();
    let mean = normals.iter().sum::<Vector3<f64>>().try_normalize(0.0)?;
    for (f, normal) in mesh.faces().zip(&normals) {
        let length = normal.norm();
        let longest = f.halfedges().map(|h| mesh.edge_length(h)).into_iter().fold(0.0, f64::max);
        let flat = length <= RestTriangle::MIN_HEIGHT * longest * longest;
        let leans = normal.dot(&mean) < COPLANAR_COS * length;
        if length.is_nan() || (!flat && leans) {
            return None;
        }
    }
    onto_plane(mesh, &mean)
}

/// The orthogonal projection of a mesh along its mean normal, one position a vertex; `None` if a face leans by more than
/// so many degrees from it. Not guaranteed: freedom from overlap. O(n).
#[must_use]
pub(crate) fn project(mesh: &TriMesh, most_degrees: f64) -> Option<Vec<Point2<f64>>> {
    let normals = || mesh.faces().map(|f| area_vector(mesh.triangle_positions(f)));
    let mean = normals().sum::<Vector3<f64>>().try_normalize(0.0)?;
    let least = most_degrees.to_radians().cos();
    // Also refused: what is no number.
    let upright = normals().all(|n| n.dot(&mean) >= least * n.norm());
    if upright { onto_plane(mesh, &mean) } else { None }
}

/// Positions in the plane that `normal` is perpendicular to; `None` if one is not finite.
fn onto_plane(mesh: &TriMesh, normal: &Vector3<f64>) -> Option<Vec<Point2<f64>>> {
    // Any two axes that make a right-handed frame with the normal; the one least along it first.
    let smallest = normal.iamin();
    let u = normal.cross(&Vector3::ith(smallest, 1.0)).try_normalize(0.0)?;
    let v = normal.cross(&u);
    let n = mesh.vertex_count() as f64;
    let centre = mesh.positions().iter().map(|p| p.coords).sum::<Vector3<f64>>() / n;
    let projected: Vec<Point2<f64>> =
        mesh.positions().iter().map(|p| p.coords - centre).map(|d| Point2::new(d.dot(&u), d.dot(&v))).collect();
    projected.iter().all(|p| p.x.is_finite() && p.y.is_finite()).then_some(projected)
}

/// The isometric unfolding of a developable mesh, one position a vertex; `None` if there is none.
///
/// `rest` holds the triangle of each face. Accepted only if every face comes out positive with singular values
/// within 0.5 % of 1, so the L2 stretch is below 1.006 and there is no flip. One triangle, and two that share
/// one edge, always unfold. Not guaranteed: freedom from overlap (a long helix unfolds over itself). A mesh in
/// several components, without boundary, or with an interior angle defect above half a degree is refused at
/// once. O(n log n).
///
/// # Panics
/// If `rest` does not hold a triangle a face.
#[must_use]
pub(crate) fn unfold(mesh: &TriMesh, rest: &[RestTriangle]) -> Option<Vec<Point2<f64>>> {
    assert_eq!(rest.len(), mesh.face_count(), "one rest triangle a face");
    if rest.is_empty() || (mesh.face_count() > 2 && !is_developable(mesh)) {
        return None;
    }
    let uv = lay(mesh, rest)?;
    let accurate = mesh.faces().zip(rest).all(|(f, rest)| {
        let corners = mesh.triangle(f).map(|v| uv[v.index()]);
        let j: Matrix2<f64> = rest.jacobian(corners);
        let [large, small] = singular_values(&j);
        j.determinant() > 0.0 && large <= 1.0 + LARGEST_STRAIN && small >= 1.0 - LARGEST_STRAIN
    });
    // Two triangles on one edge have nothing to disagree about but its length, where both are degenerate.
    let upright = |f: FaceId| signed_double_area(mesh.triangle(f).map(|v| uv[v.index()])) > 0.0;
    let pair = mesh.face_count() <= 2 && mesh.vertex_count() == mesh.face_count() + 2 && mesh.faces().all(upright);
    (accurate || pair).then_some(uv)
}

/// Whether there is a boundary and no interior angle defect exceeds [`FLAT_DEFECT`].
fn is_developable(mesh: &TriMesh) -> bool {
    let defect = angle_defects(mesh);
    let is_flat = |v: VertexId| defect[v.index()].abs() <= FLAT_DEFECT;
    mesh.halfedges().any(|h| mesh.is_boundary(h)) && mesh.vertices().all(|v| mesh.is_boundary_vertex(v) || is_flat(v))
}

/// A non-negative cost that sorts by value.
#[derive(Clone, Copy, PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Lays face after face against its parent, outwards from a central face; `None` if not all are reached.
///
/// Laying a face over a short edge magnifies the error of the edge's ends by its length over the edge's, so the
/// order is that of Dijkstra with this ratio for the cost of an edge: breadth-first on even meshes,
/// around needles elsewhere.
fn lay(mesh: &TriMesh, rest: &[RestTriangle]) -> Option<Vec<Point2<f64>>> {
    let mut uv: Vec<Option<Point2<f64>>> = vec![None; mesh.vertex_count()];
    let mut laid = vec![false; mesh.face_count()];
    let mut queue = BinaryHeap::new();
    let push = |queue: &mut BinaryHeap<Reverse<(Cost, HalfedgeId)>>, cost: f64, f: FaceId| {
        for h in f.halfedges() {
            let t = mesh.twin(h);
            if !t.is_none() {
                let corners = rest[t.face().index()].corners();
                let side = |k: usize| (corners[(k + 1) % 3] - corners[k]).norm();
                let longest = side(0).max(side(1)).max(side(2));
                queue.push(Reverse((Cost(cost + longest / side(t.slot())), t)));
            }
        }
    };
    let seed = central_face(mesh);
    for (v, c) in mesh.triangle(seed).into_iter().zip(rest[seed.index()].corners()) {
        uv[v.index()] = Some(c);
    }
    laid[seed.index()] = true;
    push(&mut queue, 0.0, seed);
    while let Some(Reverse((Cost(cost), h))) = queue.pop() {
        let f = h.face();
        if std::mem::replace(&mut laid[f.index()], true) {
            continue;
        }
        let apex = mesh.from(h.prev());
        if uv[apex.index()].is_none() {
            let corners = rest[f.index()].corners();
            let (a, b) = (corners[h.slot()], corners[h.next().slot()]);
            let (from, to) = (uv[mesh.from(h).index()]?, uv[mesh.to(h).index()]?);
            // Rigid: the edge's middle to the middle, its direction to the direction.
            let (axis, along) = ((b - a).try_normalize(0.0)?, (to - from).try_normalize(0.0)?);
            let d = corners[h.prev().slot()] - nalgebra::center(&a, &b);
            let (s, t) = (d.dot(&axis), axis.perp(&d));
            uv[apex.index()] = Some(nalgebra::center(&from, &to) + along * s + Vector2::new(-along.y, along.x) * t);
        }
        push(&mut queue, cost, f);
    }
    uv.into_iter().collect()
}

/// The face whose centroid is nearest to that of all vertices; the first of equals.
fn central_face(mesh: &TriMesh) -> FaceId {
    let sum = mesh.positions().iter().map(|p| p.coords).sum::<Vector3<f64>>();
    let centre = sum / mesh.vertex_count().max(1) as f64;
    let distance = |f: &FaceId| {
        let [a, b, c] = mesh.triangle_positions(*f);
        ((a.coords + b.coords + c.coords) / 3.0 - centre).norm_squared()
    };
    mesh.faces().min_by(|f, g| distance(f).total_cmp(&distance(g))).unwrap_or(FaceId::new(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Rotation3};

    /// A grid of (m+1)×(n+1) vertices through `at`, two triangles a cell.
    fn grid(m: usize, n: usize, at: impl Fn(f64, f64) -> Point3<f64>) -> TriMesh {
        let positions: Vec<_> = (0..=n)
            .flat_map(|j| (0..=m).map(move |i| (i as f64 / m as f64, j as f64 / n as f64)))
            .map(|(s, t)| at(s, t))
            .collect();
        let mut triangles = Vec::new();
        for j in 0..n as u32 {
            for i in 0..m as u32 {
                let a = j * (m as u32 + 1) + i;
                let (b, c, d) = (a + 1, a + m as u32 + 2, a + m as u32 + 1);
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        TriMesh::from_triangles(&positions, &triangles).0
    }

    fn worst_strain(mesh: &TriMesh, uv: &[Point2<f64>]) -> f64 {
        mesh.halfedges()
            .map(|h| ((uv[mesh.to(h).index()] - uv[mesh.from(h).index()]).norm() / mesh.edge_length(h) - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_tilted_plane_is_projected_upright() {
        for angles in [[0.3, 1.2, -0.4], [3.1, 0.0, 2.0], [0.0, 0.0, 0.0]] {
            let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
            let mesh = grid(5, 4, |s, t| turn * Point3::new(2.0 * s, t + 0.2 * s * s, 0.0));
            let uv = plane(&mesh).expect("plane");
            assert!(worst_strain(&mesh, &uv) < 1e-14);
            for f in mesh.faces() {
                assert!(signed_double_area(mesh.triangle(f).map(|v| uv[v.index()])) > 0.0);
            }
        }
    }

    #[test]
    fn plane_refuses_bends_and_folds_but_not_needles() {
        let bend = |angle: f64| grid(2, 2, move |s, t| Point3::new(s, t, (s - 0.5).max(0.0) * angle.tan()));
        assert!(plane(&bend(0.1)).is_none());
        assert!(plane(&bend(0.001)).is_some());
        assert!(plane(&grid(2, 1, |s, t| Point3::new((s - 0.5).abs(), t, 0.0))).is_none(), "folded over");
        let p = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0));
        let (mesh, _) = TriMesh::from_triangles(&p, &[[0, 2, 3], [0, 1, 2]]);
        assert!(plane(&mesh).is_some(), "a needle has no normal to disagree with");
        assert!(plane(&TriMesh::default()).is_none());
    }

    #[test]
    fn cylinder_patch_and_cone_sector_unfold_isometrically() {
        // Exact developables as meshes: strips of plane quads along the rulings.
        let cylinder = grid(24, 7, |s, t| Point3::new((4.0 * s).cos(), (4.0 * s).sin(), 3.0 * t));
        let cone = grid(30, 6, |s, t| {
            let r = 0.5 + t;
            Point3::new(r * (5.0 * s).cos(), r * (5.0 * s).sin(), 2.0 * r)
        });
        for mesh in [cylinder, cone] {
            let rest = RestTriangle::of_mesh(&mesh);
            let uv = unfold(&mesh, &rest).expect("developable");
            assert!(worst_strain(&mesh, &uv) < 1e-12, "{}", worst_strain(&mesh, &uv));
            for f in mesh.faces() {
                assert!(signed_double_area(mesh.triangle(f).map(|v| uv[v.index()])) > 0.0);
            }
            assert!(plane(&mesh).is_none());
        }
    }

    #[test]
    fn what_is_not_developable_is_refused() {
        let saddle = grid(10, 10, |s, t| Point3::new(s, t, s * t));
        // So fine that no defect exceeds half a degree: the closing edges must tell.
        let cap = grid(60, 60, |s, t| {
            let (x, y) = (s - 0.5, t - 0.5);
            Point3::new(x, y, (1.0 - x * x - y * y).sqrt())
        });
        assert!(is_developable(&cap) && !is_developable(&saddle));
        // A closed tube has flat vertices only and still does not open.
        let n = 12;
        let ring = |i: usize| 2.0 * std::f64::consts::PI * i as f64 / f64::from(n);
        let p: Vec<_> = (0..24).map(|i| Point3::new(ring(i % 12).cos(), ring(i % 12).sin(), (i / 12) as f64)).collect();
        let quads = (0..n as u32).map(|i| [i, (i + 1) % 12, 12 + (i + 1) % 12, 12 + i]);
        let triangles: Vec<_> = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let tube = TriMesh::from_triangles(&p, &triangles).0;
        assert!(is_developable(&tube));
        for mesh in [saddle, cap, tube] {
            assert!(unfold(&mesh, &RestTriangle::of_mesh(&mesh)).is_none());
        }
        assert!(unfold(&TriMesh::default(), &[]).is_none());
    }

    #[test]
    fn one_and_two_triangles_always_unfold() {
        let shapes: [&[[f64; 3]]; 5] = [
            &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.8, 0.0], [0.9, 0.7, 2.0]],
            &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.9, 0.7, 2.0]],
            &[[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
            &[[1.0, 1.0, 1.0]; 4],
            &[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 1e-7, 0.0], [5.0, 1.0, 0.0]],
        ];
        for shape in shapes {
            let p: Vec<_> = shape.iter().map(|c| Point3::from(*c)).collect();
            for triangles in [&[[0, 1, 2]][..], &[[0, 1, 2], [2, 1, 3]]] {
                let (mesh, _) = TriMesh::from_triangles(&p, triangles);
                let uv = unfold(&mesh, &RestTriangle::of_mesh(&mesh)).expect("always");
                for f in mesh.faces() {
                    assert!(signed_double_area(mesh.triangle(f).map(|v| uv[v.index()])) > 0.0, "{shape:?}");
                }
            }
        }
    }
}
