//! Quads, and when one is convex.
//!
//! A quad is drawn as two triangles, by either diagonal: a game engine or a subdivision may take the other one than its
//! author. Where its image in the plane is convex both are good; where it is bent, one of the other two is turned over.

use nalgebra::{Point3, Vector3};

use super::index::{HalfedgeId, VertexId};
use super::tri_mesh::TriMesh;

/// A corner counts as convex if its triangle has at least this share of the quad's area (of its sign, seen along the mean
/// normal). What is less is a straight corner, which coordinates in single precision cannot tell from a reflex one.
const STRAIGHT: f64 = 1e-6;

/// A polygon of two triangles in a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Quad {
    /// The diagonal that its triangles share, on its lower side.
    pub diagonal: HalfedgeId,
}

impl Quad {
    /// All quads of a mesh, in the order of their diagonals; `polygon` names the polygon of each face. O(n).
    ///
    /// # Panics
    /// If `polygon` does not name one a face.
    pub(crate) fn all<'a>(mesh: &'a TriMesh, polygon: &'a [u32]) -> impl Iterator<Item = Self> + 'a {
        assert_eq!(polygon.len(), mesh.face_count(), "one polygon a face");
        let inside = move |h: HalfedgeId| {
            let t = mesh.twin(h);
            !t.is_none() && polygon[t.face().index()] == polygon[h.face().index()]
        };
        // A triangle of a larger polygon has several diagonals, or borders on one that has.
        let is_half = move |h: HalfedgeId| !inside(h.next()) && !inside(h.prev());
        let is_quad = move |&h: &HalfedgeId| {
            let t = mesh.twin(h);
            inside(h) && h < t && h.face() != t.face() && is_half(h) && is_half(t)
        };
        mesh.halfedges().filter(is_quad).map(|diagonal| Self { diagonal })
    }

    /// The corners in order; the first and the third are the ends of the diagonal.
    #[must_use]
    pub(crate) fn corners(self, mesh: &TriMesh) -> [VertexId; 4] {
        let (h, t) = (self.diagonal, mesh.twin(self.diagonal));
        [mesh.from(h), mesh.from(t.prev()), mesh.to(h), mesh.from(h.prev())]
    }

    /// The triangles that the other diagonal makes, wound as the quad.
    #[must_use]
    pub(crate) fn other_halves(self, mesh: &TriMesh) -> [[VertexId; 3]; 2] {
        let [a, b, c, d] = self.corners(mesh);
        [[a, b, d], [b, c, d]]
    }

    /// Whether the quad is [convex](is_convex) on the surface.
    #[must_use]
    pub(crate) fn is_convex(self, mesh: &TriMesh) -> bool {
        is_convex(self.corners(mesh).map(|v| mesh.position(v)))
    }
}

/// Whether a quad is convex, seen along its mean normal: the normal of each corner's triangle within 90 degrees of that,
/// and each of these triangles at least a millionth of the quad seen so. A warped quad may well be; one with a straight or
/// a reflex corner, without an area or with a coordinate that is not finite is not. Scale does not matter.
#[must_use]
pub(crate) fn is_convex(p: [Point3<f64>; 4]) -> bool {
    // Halves, and a unit that makes the largest difference 1: no square overflows or vanishes.
    let from_first = [1, 2, 3].map(|k: usize| p[k].coords * 0.5 - p[0].coords * 0.5);
    let unit = from_first.iter().map(Vector3::amax).fold(0.0, f64::max);
    let [b, c, d] = from_first.map(|e| e / unit);
    let side = [b, c - b, d - c, -d];
    // Half the cross product of the diagonals is the area vector, however the quad is warped.
    let normal = c.cross(&(d - b));
    let least = STRAIGHT * normal.norm_squared();
    // NaN compares as false.
    (0..4).all(|k| side[k].cross(&side[(k + 1) % 4]).dot(&normal) > least)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }

    #[test]
    fn convex_quads_are_told_from_bent_and_straight_ones() {
        let with = |p: Point3<f64>| is_convex([at(0.0, 0.0, 0.0), at(2.0, 0.0, 0.0), p, at(0.0, 2.0, 0.0)]);
        assert!(with(at(2.0, 2.0, 0.0)) && with(at(1.01, 1.01, 0.0)));
        assert!(with(at(2.0, 2.0, 1.5)), "warped");
        assert!(!with(at(1.0, 1.0, 0.0)) && !with(at(1.0 + 1e-8, 1.0, 0.0)), "straight");
        assert!(!with(at(0.9, 0.9, 0.0)) && !with(at(2.0, 0.0, 0.0)) && !with(at(f64::NAN, 2.0, 0.0)));
        // A bow tie, and four corners in one place.
        assert!(!is_convex([at(0.0, 0.0, 0.0), at(1.0, 1.0, 0.0), at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0)]));
        assert!(!is_convex([at(1.0, 2.0, 3.0); 4]));
    }

    #[test]
    fn neither_scale_nor_winding_matters() {
        let square = [at(0.0, 0.0, 0.1), at(1.0, 0.0, 0.0), at(1.1, 1.0, 0.0), at(0.0, 1.0, 0.0)];
        for scale in [1e-300, 1e-3, 1.0, 1e307] {
            let scaled = square.map(|p| p * scale);
            let [a, b, c, d] = scaled;
            assert!(is_convex(scaled) && is_convex([d, c, b, a]) && is_convex([c, d, a, b]), "{scale}");
        }
    }

    #[test]
    fn quads_are_found_among_other_polygons() {
        // A quad, a triangle and a pentagon in a row.
        let p = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (3, 0), (4, 0), (3, 1)]
            .map(|(x, y)| at(f64::from(x), f64::from(y), 0.0));
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 5], [2, 5, 7], [5, 6, 7]];
        let (mesh, _) = TriMesh::from_triangles(&p, &triangles);
        let quads: Vec<Quad> = Quad::all(&mesh, &[0, 0, 1, 2, 2, 2]).collect();
        assert_eq!(quads.len(), 1);
        let places = |v: VertexId| mesh.position(v);
        assert_eq!(quads[0].corners(&mesh).map(places), [p[2], p[3], p[0], p[1]].map(|q| q));
        assert!(quads[0].is_convex(&mesh));
        let halves = quads[0].other_halves(&mesh).map(|t| t.map(places));
        assert_eq!(halves, [[p[2], p[3], p[1]], [p[3], p[0], p[1]]]);
        assert_eq!(Quad::all(&mesh, &[0, 1, 2, 3, 4, 5]).count(), 0);
    }
}
