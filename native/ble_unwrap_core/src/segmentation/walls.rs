//! The planes and walls of which a thing with rounded or bevelled edges is made.

use std::collections::{HashMap, VecDeque};

use nalgebra::Vector3;

use crate::mesh::{FaceId, HalfedgeId, TriMesh};

/// Parts have at least so many triangles on average. With fewer they are the facets of a crystal or of crumpled paper, and distances tell better
/// which of them belong together.
pub(super) const LEAST_FACES: usize = 6;
/// A plane or a wall is large from this share of the area on: the caps of a barrel, the base of a bust.
pub(super) const LEAST_PLANE: f64 = 0.05;
/// Normals of a plane are at most so many degrees from their mean, or from that of its largest face; two directions that are no further apart
/// are the same.
pub(super) const MOST_LEANING: f64 = 3.0;
/// A thing is made of planes and walls if large ones have at least this share of its area: a box of which each side is rounded over by
/// a seventh at both ends has 0.69, and a bottle 0.74 without its neck.
const LEAST_SHARE: f64 = 2.0 / 3.0;
/// Around planes of at least this share of the area walls are looked for, and such planes are kept where there is a wall around them: the end of a
/// plank.
const LEAST_END: f64 = 0.01;
/// What lies around a plane goes with it up to so many times its area. The rounded rim of the box above has 1.7 times the area of its side,
/// and lies in the plane with an L2 stretch of 1.003.
const MOST_RIM: f64 = 2.0;
/// Two triangles whose normals are at most so many degrees apart may be two halves of one quad.
const HALVES: f64 = 0.5;

/// A plane, or a wall: all that stands upright on a plane and hangs together, as the sides of a cylinder, of a prism or of a box with
/// rounded corners do. Both unroll.
struct Side {
    faces: Vec<FaceId>,
    area: f64,
    is_plane: bool,
    /// The normal of a plane, or that of the planes that a wall stands on.
    axis: Vector3<f64>,
}

/// The planes and walls of a thing that is mostly made of them, numbered from 1 on for each face: the sides of a bevelled box, the wall and
/// the base of a bottle. Bevels and rims around a plane go with it, and the other faces are 0. None of these leads over a hard edge. `None`
/// for a thing that is made otherwise, and for one without a plane. O(n log n), and O(n) for each plane of more than a hundredth of the area.
pub(super) fn planes_and_walls(
    mesh: &TriMesh,
    polygon: &[u32],
    normals: &[Vector3<f64>],
    areas: &[f64],
    is_hard: &dyn Fn(HalfedgeId) -> bool,
) -> Option<Vec<u32>> {
    let thing = Thing::new(mesh, polygon, normals, areas, is_hard);
    let total: f64 = areas.iter().sum();
    let is_large = |side: &Side| side.area >= LEAST_PLANE * total;
    let mut planes = thing.planes();
    planes.retain(|plane| plane.area >= LEAST_END * total);
    let is_along = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(b).abs() >= MOST_LEANING.to_radians().cos();
    let mut axes: Vec<Vector3<f64>> = Vec::new();
    for plane in &planes {
        if !axes.iter().any(|known| is_along(known, &plane.axis)) {
            axes.push(plane.axis);
        }
    }
    // What is mostly one plane is that plane: the end of a box with a bevel that happens to stand upright on another bevel.
    let mut plane_from = vec![0.0; mesh.face_count()];
    planes.iter().for_each(|plane| plane_from[plane.faces[0].index()] = plane.area);
    let is_one_plane = |wall: &Side| wall.faces.iter().any(|f| 2.0 * plane_from[f.index()] > wall.area);
    let walls = axes.iter().flat_map(|axis| thing.walls(axis)).filter(|wall| is_large(wall) && !is_one_plane(wall));
    let mut found: Vec<Side> = walls.collect();
    found.append(&mut planes);
    found.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.faces[0].cmp(&b.faces[0])));
    let mut part = vec![0; mesh.face_count()];
    let mut taken: Vec<Side> = Vec::new();
    for side in found {
        let is_end = |of: &Side| !of.is_plane && is_along(&of.axis, &side.axis);
        let is_kept = is_large(&side) || taken.iter().any(is_end);
        if is_kept && side.faces.iter().all(|f| part[f.index()] == 0) {
            taken.push(side);
            let number = taken.len() as u32;
            taken[taken.len() - 1].faces.iter().for_each(|f| part[f.index()] = number);
        }
    }
    let covered: f64 = taken.iter().filter(|side| is_large(side)).map(|side| side.area).sum();
    if taken.len() < 2 || taken.len() * LEAST_FACES > mesh.face_count() || covered < LEAST_SHARE * total {
        return None;
    }
    thing.give_rims(&taken, &mut part);
    Some(part)
}

/// A mesh with the normals of its polygons.
struct Thing<'a> {
    mesh: &'a TriMesh,
    polygon: &'a [u32],
    normals: Vec<Vector3<f64>>,
    areas: &'a [f64],
    is_hard: &'a dyn Fn(HalfedgeId) -> bool,
}

impl<'a> Thing<'a> {
    fn new(
        mesh: &'a TriMesh,
        polygon: &'a [u32],
        normals: &[Vector3<f64>],
        areas: &'a [f64],
        is_hard: &'a dyn Fn(HalfedgeId) -> bool,
    ) -> Self {
        let mut sums: HashMap<u32, Vector3<f64>> = HashMap::new();
        for ((n, a), p) in normals.iter().zip(areas).zip(polygon) {
            *sums.entry(*p).or_insert_with(Vector3::zeros) += n * *a;
        }
        let normal = |p: &u32| sums.get(p).and_then(|sum| sum.try_normalize(0.0)).unwrap_or_else(Vector3::zeros);
        Self { mesh, polygon, normals: polygon.iter().map(normal).collect(), areas, is_hard }
    }

    fn normal(&self, f: FaceId) -> Vector3<f64> {
        self.normals[f.index()]
    }

    /// The faces beyond the sides of a face that are no hard edges.
    fn neighbours(&self, f: FaceId) -> impl Iterator<Item = FaceId> + '_ {
        let is_soft = |h: &HalfedgeId| !self.mesh.is_boundary(*h) && !(self.is_hard)(*h);
        f.halfedges().into_iter().filter(is_soft).map(|h| self.mesh.twin(h).face())
    }

    /// Connected faces whose normals lean by at most [`MOST_LEANING`] from that of the first one, which is the largest.
    fn planes(&self) -> Vec<Side> {
        let least = MOST_LEANING.to_radians().cos();
        let mut order: Vec<FaceId> = self.mesh.faces().collect();
        order.sort_by(|f, g| self.areas[g.index()].total_cmp(&self.areas[f.index()]).then(f.cmp(g)));
        self.grown(&order, None, |first, n| n.dot(&first) >= least)
    }

    /// Connected faces that stand upright on a plane across an axis.
    fn walls(&self, axis: &Vector3<f64>) -> Vec<Side> {
        let most = MOST_LEANING.to_radians().sin();
        // Faces without area have no normal.
        let is_upright = |n: Vector3<f64>| n.norm_squared() > 0.5 && n.dot(axis).abs() <= most;
        let order: Vec<FaceId> = self.mesh.faces().filter(|&f| is_upright(self.normal(f))).collect();
        self.grown(&order, Some(*axis), |_, n| is_upright(n))
    }

    /// Grows a side from each face that is in none yet, over polygons whose normals belong to that of the first one: walls around an axis, or
    /// planes.
    fn grown(
        &self,
        order: &[FaceId],
        wall: Option<Vector3<f64>>,
        belongs: impl Fn(Vector3<f64>, Vector3<f64>) -> bool,
    ) -> Vec<Side> {
        let mut is_in = vec![false; self.mesh.face_count()];
        let mut sides = Vec::new();
        for &first in order {
            if is_in[first.index()] {
                continue;
            }
            is_in[first.index()] = true;
            let mut faces = vec![first];
            let mut next = 0;
            while let Some(&f) = faces.get(next) {
                next += 1;
                for g in self.neighbours(f) {
                    if !is_in[g.index()] && belongs(self.normal(first), self.normal(g)) {
                        is_in[g.index()] = true;
                        faces.push(g);
                    }
                }
            }
            let area = faces.iter().map(|f| self.areas[f.index()]).sum();
            let axis = wall.unwrap_or_else(|| self.normal(first));
            sides.push(Side { faces, area, is_plane: wall.is_none(), axis });
        }
        sides
    }

    /// Gives what lies around a plane and is no more than [`MOST_RIM`] times as large to it, and of several planes to the nearest by steps from
    /// polygon to polygon.
    fn give_rims(&self, taken: &[Side], part: &mut [u32]) {
        let mut nearest = vec![0; part.len()];
        let mut open: VecDeque<FaceId> = VecDeque::new();
        for (side, number) in taken.iter().zip(1..).filter(|(side, _)| side.is_plane) {
            side.faces.iter().for_each(|f| nearest[f.index()] = number);
            open.extend(&side.faces);
        }
        let mut rim = vec![0.0; taken.len() + 1];
        while let Some(f) = open.pop_front() {
            let number = nearest[f.index()];
            // A step takes a whole polygon, and the other half of what may be half a quad.
            let mut step: Vec<(FaceId, bool)> = self.neighbours(f).map(|g| (g, true)).collect();
            while let Some((g, is_first)) = step.pop() {
                if part[g.index()] == 0 && nearest[g.index()] == 0 {
                    nearest[g.index()] = number;
                    rim[number as usize] += self.areas[g.index()];
                    open.push_back(g);
                    step.extend(self.neighbours(g).filter_map(|h| {
                        let is_same = self.polygon[g.index()] == self.polygon[h.index()];
                        let is_other_half =
                            is_first && self.normal(g).dot(&self.normal(h)) >= HALVES.to_radians().cos();
                        (is_same || is_other_half).then_some((h, is_same && is_first))
                    }));
                }
            }
        }
        let is_given: Vec<bool> = taken.iter().zip(&rim[1..]).map(|(side, rim)| *rim <= MOST_RIM * side.area).collect();
        for (own, nearest) in part.iter_mut().zip(nearest) {
            if *own == 0 && nearest != 0 && is_given[nearest as usize - 1] {
                *own = nearest;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::hard_edges::{tests::*, unrolling_parts};
    use super::*;
    use crate::mesh::test_surfaces::{self, turned, turned_wall};
    use nalgebra::Point3;

    /// A box from −1 to 1 with sides of `wide` and edges rounded over in two strips.
    fn bevelled(wide: [f64; 3]) -> (TriMesh, Vec<u32>) {
        let cube = test_surfaces::cubes([3, 3, 3], |_| true);
        let place = |p: &Point3<f64>| {
            let (mut core, mut out) = (Vector3::zeros(), Vector3::zeros());
            for axis in 0..3 {
                let from_middle = p[axis] - 1.5;
                core[axis] = from_middle.signum() * 0.5 * wide[axis];
                out[axis] = if from_middle.abs() > 1.0 { from_middle.signum() } else { 0.0 };
            }
            Point3::from(core + out.normalize() * 0.15)
        };
        let positions: Vec<Point3<f64>> = cube.positions().iter().map(place).collect();
        let triangles: Vec<[u32; 3]> = cube.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        (test_surfaces::mesh(&positions, &triangles), (0..cube.face_count() as u32).map(|f| f / 2).collect())
    }

    /// The profile of a bottle, with a base and an opening of one polygon each.
    const BOTTLE: [[f64; 2]; 9] =
        [[1.0, 0.0], [1.0, 1.5], [1.0, 3.0], [0.9, 3.2], [0.7, 3.5], [0.5, 3.7], [0.4, 3.9], [0.35, 4.1], [0.35, 4.6]];

    #[test]
    fn a_bevelled_box_is_a_wall_and_two_ends_with_their_bevels() {
        for wide in [[2.0, 2.0, 2.0], [6.0, 1.5, 0.6], [1.0, 3.0, 2.0]] {
            let (mesh, quads) = bevelled(wide);
            let triangles: Vec<u32> = (0..mesh.face_count() as u32).collect();
            for (mesh, polygon) in [(&mesh, &quads), (&mesh, &triangles), (&moved(&mesh), &triangles)] {
                let (count, unrolls) = parts(mesh, polygon, false);
                assert!(count == 3 && !unrolls.contains(&false), "{wide:?}: {count}");
            }
        }
    }

    #[test]
    fn a_bottle_is_a_wall_two_ends_and_what_is_between() {
        let (mesh, quads) = turned(24, &BOTTLE);
        let triangles: Vec<u32> = (0..mesh.face_count() as u32).collect();
        for polygon in [&quads, &triangles] {
            let part = unrolling_parts(&mesh, polygon, false);
            let of = |low: f64, high: f64| {
                let middle = |f: &FaceId| mesh.triangle_positions(*f).iter().map(|p| p.z).sum::<f64>() / 3.0;
                let mut found: Vec<u32> =
                    mesh.faces().filter(|f| (low..=high).contains(&middle(f))).map(|f| part[f.index()]).collect();
                found.sort_unstable();
                found.dedup();
                found
            };
            let (base, wall, shoulder, top) = (of(-0.1, 0.0), of(0.1, 2.9), of(3.01, 4.09), of(4.6, 4.7));
            assert_eq!([base.len(), wall.len(), top.len()], [1, 1, 1]);
            assert!(shoulder == [0] && base != wall && top != wall && ![base, wall, top].contains(&vec![0]));
        }
    }

    #[test]
    fn a_rim_of_triangles_has_no_teeth() {
        // A washer with bevelled edges: its wall inside is narrow, and goes to a ring, both halves of each quad to the same.
        let ring =
            [[0.5, 0.1], [0.53, 0.13], [0.97, 0.13], [1.0, 0.1], [1.0, 0.03], [0.97, 0.0], [0.53, 0.0], [0.5, 0.03]];
        let mesh = turned_wall(32, &ring, true);
        let triangles: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let part = unrolling_parts(&mesh, &triangles, false);
        assert!(part.iter().any(|p| *p != 0));
        assert!(part.chunks(2).all(|quad| quad[0] == quad[1]));
    }

    #[test]
    fn what_has_no_planes_or_only_facets_has_none() {
        let no_edge_is_hard = |_: HalfedgeId| false;
        let of = |mesh: &TriMesh| {
            let (normals, areas) = (crate::mesh::measure::face_normals(mesh), crate::mesh::measure::face_areas(mesh));
            let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
            planes_and_walls(mesh, &polygon, &normals, &areas, &no_edge_is_hard)
        };
        assert!(of(&test_surfaces::sphere(4)).is_none());
        assert!(of(&test_surfaces::sphere(1)).is_none(), "80 facets");
        assert!(of(&test_surfaces::grid(12, 12, [1.0, 1.0], 0.0)).is_none(), "one plane is a whole");
        assert!(of(&bevelled([2.0, 2.0, 2.0]).0).is_some());
    }
}
