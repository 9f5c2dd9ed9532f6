//! Parts between hard edges: the walls, caps and flats of which a manufactured thing is made.

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId, measure};

use super::Segmentation;

/// Normals of two faces on a hard edge are at least so many degrees apart: the sides of a hexagonal nut are 60°, those of
/// an octagonal tube 45°, which is meant to be round.
const HARD: f64 = 50.0;
/// A part unrolls if the angle defects at its inner vertices add up to at most so many radians. The largest one does not count: it may
/// be the apex of a cone. A spherical cap of so much curvature, which ends 23° from its pole, has an L2 stretch of 1.0001 in the plane,
/// and one that ends at 40° has 1.0008.
const MOST_CURVED: f64 = 0.5;
/// The parts must have at least so many polygons in the mean. With fewer they are the facets of a crystal or of crumpled paper, and
/// distances tell better which of them belong together: without this bound a Menger sponge has 30 charts instead of 17.
const LEAST_POLYGONS: usize = 4;

/// Divides a patch along its hard edges where these enclose parts that unroll without stretch and make up at least a share of
/// its area; what else there is stays together as far as it is connected. `None` where the patch is not such a thing, and where
/// guides run inside it: they say where it is to be cut. O(n log n).
pub(crate) fn between_hard_edges(mesh: &TriMesh, polygon: &[u32], least_share: f64) -> Option<Segmentation> {
    if mesh.has_guides() {
        return None;
    }
    let normals = measure::face_normals(mesh);
    let least = HARD.to_radians().cos();
    let is_hard = |h: HalfedgeId| {
        let (f, g) = (h.face(), mesh.twin(h).face());
        polygon[f.index()] != polygon[g.index()] && normals[f.index()].dot(&normals[g.index()]) <= least
    };
    let (smooth, parts) = connected(mesh, |h| !is_hard(h));
    let mut polygons = polygon.to_vec();
    polygons.sort_unstable();
    polygons.dedup();
    if parts < 2 || parts * LEAST_POLYGONS > polygons.len() {
        return None;
    }
    let unrolls = unrolling(mesh, &smooth, parts);
    let areas = measure::face_areas(mesh);
    let flat: f64 = areas.iter().zip(&smooth).filter(|(_, p)| unrolls[**p as usize]).map(|(a, _)| a).sum();
    if flat < least_share * areas.iter().sum::<f64>() {
        return None;
    }
    let part = |f: FaceId| smooth[f.index()] as usize;
    let (label, parts) = connected(mesh, |h| {
        let (p, q) = (part(h.face()), part(mesh.twin(h).face()));
        p == q || !unrolls[p] && !unrolls[q]
    });
    (parts > 1).then_some(Segmentation { label, parts })
}

/// A number for each face, the same for two faces that are joined by edges over which one may go, and how many there are.
fn connected(mesh: &TriMesh, is_open: impl Fn(HalfedgeId) -> bool) -> (Vec<u32>, usize) {
    const NONE: u32 = u32::MAX;
    let mut label = vec![NONE; mesh.face_count()];
    let mut parts = 0;
    let mut open = Vec::new();
    for first in mesh.faces() {
        if label[first.index()] != NONE {
            continue;
        }
        label[first.index()] = parts;
        open.push(first);
        while let Some(f) = open.pop() {
            for h in f.halfedges().into_iter().filter(|&h| !mesh.is_boundary(h) && is_open(h)) {
                let beyond = mesh.twin(h).face();
                if label[beyond.index()] == NONE {
                    label[beyond.index()] = parts;
                    open.push(beyond);
                }
            }
        }
        parts += 1;
    }
    (label, parts as usize)
}

/// Whether each part is flat, a cylinder, a cone or the like.
fn unrolling(mesh: &TriMesh, part: &[u32], parts: usize) -> Vec<bool> {
    let defects = measure::angle_defects(mesh);
    let (mut sum, mut largest) = (vec![0.0; parts], vec![0.0f64; parts]);
    let own = |v: VertexId| {
        let mut around = mesh.outgoing(v).map(|h| part[h.face().index()]);
        let first = around.next()?;
        (!mesh.is_boundary_vertex(v) && around.all(|p| p == first)).then_some(first as usize)
    };
    for v in mesh.vertices() {
        if let Some(p) = own(v) {
            let curved = defects[v.index()].abs();
            sum[p] += curved;
            largest[p] = largest[p].max(curved);
        }
    }
    sum.iter().zip(&largest).map(|(s, l)| s - l <= MOST_CURVED).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use nalgebra::{Point3, Rotation3, Vector3};
    use std::f64::consts::TAU;

    /// A body of revolution around z: quads between rings of a profile of (radius, height), caps of one polygon at both ends. Its
    /// polygons are named in the second list.
    fn turned(sides: usize, profile: &[[f64; 2]]) -> (TriMesh, Vec<u32>) {
        let ring = |[r, z]: [f64; 2]| {
            (0..sides).map(move |k| {
                let (s, c) = (TAU * k as f64 / sides as f64).sin_cos();
                Point3::new(r * c, r * s, z)
            })
        };
        let positions: Vec<Point3<f64>> = profile.iter().flat_map(|&p| ring(p)).collect();
        let at = |row: usize, k: usize| (row * sides + k % sides) as u32;
        let (mut triangles, mut polygon) = (Vec::new(), Vec::new());
        let mut count = 0;
        for row in 0..profile.len() - 1 {
            for k in 0..sides {
                let [a, b, c, d] = [at(row, k), at(row, k + 1), at(row + 1, k + 1), at(row + 1, k)];
                triangles.extend([[a, b, c], [a, c, d]]);
                polygon.extend([count, count]);
                count += 1;
            }
        }
        for (row, turn) in [(0, true), (profile.len() - 1, false)] {
            for k in 1..sides - 1 {
                let [a, b, c] = [at(row, 0), at(row, k), at(row, k + 1)];
                triangles.push(if turn { [a, c, b] } else { [a, b, c] });
                polygon.push(count);
            }
            count += 1;
        }
        (test_surfaces::mesh(&positions, &triangles), polygon)
    }

    fn moved(mesh: &TriMesh) -> TriMesh {
        let turn = Rotation3::new(Vector3::new(0.3, -1.1, 0.7));
        let positions: Vec<Point3<f64>> = mesh.positions().iter().map(|p| turn * p * 1e-3).collect();
        let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        test_surfaces::mesh(&positions, &triangles)
    }

    fn parts(mesh: &TriMesh, polygon: &[u32]) -> Option<usize> {
        let found = between_hard_edges(mesh, polygon, 0.9)?;
        let graph_parts =
            connected(mesh, |h| found.label[h.face().index()] == found.label[mesh.twin(h).face().index()]);
        assert_eq!(graph_parts.1, found.parts, "each part is connected");
        for (f, p) in mesh.faces().zip(polygon) {
            let other = mesh.faces().zip(polygon).find(|(_, q)| *q == p).map(|(g, _)| g);
            assert_eq!(Some(found.label[f.index()]), other.map(|g| found.label[g.index()]), "polygons stay whole");
        }
        Some(found.parts)
    }

    #[test]
    fn a_pin_is_a_wall_and_two_caps_as_quads_and_as_triangles() {
        let (mesh, quads) = turned(24, &[[1.0, 0.0], [1.0, 20.0]]);
        let triangles: Vec<u32> = (0..mesh.face_count() as u32).collect();
        for polygon in [&quads, &triangles] {
            assert_eq!(parts(&mesh, polygon), Some(3));
            assert_eq!(parts(&moved(&mesh), polygon), Some(3));
        }
    }

    #[test]
    fn a_cone_and_its_base_are_two_and_a_box_is_six() {
        let (cone, polygon) = turned(32, &[[1.0, 0.0], [0.5, 1.0], [0.01, 2.0]]);
        assert_eq!(parts(&cone, &polygon), Some(3), "base, wall and the small flat top");
        let cube = test_surfaces::cubes([3, 3, 3], |_| true);
        let polygon: Vec<u32> = (0..cube.face_count() as u32).map(|f| f / 2).collect();
        assert_eq!(parts(&cube, &polygon), Some(6));
    }

    #[test]
    fn what_is_round_or_made_of_facets_is_left_alone() {
        let cube = test_surfaces::cubes([1, 1, 1], |_| true);
        let polygon: Vec<u32> = (0..cube.face_count() as u32).map(|f| f / 2).collect();
        assert_eq!(parts(&cube, &polygon), None);
        let ball = test_surfaces::sphere(3);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        assert_eq!(parts(&ball, &polygon), None);
        // A dome on a short wall: the dome, more than a tenth of all, does not unroll.
        let dome: Vec<[f64; 2]> = (0..8).map(|k| (0.18 * f64::from(k)).sin_cos()).map(|(s, c)| [c, 0.4 + s]).collect();
        let (mesh, polygon) = turned(32, &[&[[1.0, 0.0]], &dome[..]].concat());
        assert_eq!(parts(&mesh, &polygon), None);
    }
}
