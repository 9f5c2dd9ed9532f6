//! How much of a surface's surroundings can be seen from places on it: seams are hidden where that is little.
//!
//! From a sample of vertices rays are sent to the outside, more of them along the normal than aslant, as Lambert's cosine
//! has it; the visibility is the share of them that leave the model. It is what is called ambient occlusion, seen from the other end.
//! For one who looks from the front most of the time some rays go to where that one is, too: the groove between two eyes hides nothing from a
//! person who stands before the face.

use std::time::Duration;

use glam::Vec3A;
use nalgebra::{Point3, Vector3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use obvhs::ray::Ray;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Rays from each vertex of the sample.
const RAYS: usize = 32;
/// Rays from each vertex of the sample to one who stands in front.
const FRONT_RAYS: usize = 8;
/// One who looks from the front walks so far to the sides, as an angle: about 25°.
const WALK: f64 = 0.44;
/// A surface has about so many vertices in the sample at most.
const SAMPLES: usize = 1500;
/// A ray begins so far above its vertex, as a share of the diagonal of the model's box: far enough to leave the faces there, near enough to
/// see any wrinkle that matters.
const ABOVE: f64 = 1e-4;
/// Triangles in one tree of boxes, which takes a thread some 30 ms to make.
const TREE: usize = 1 << 15;
/// Samples traced by one thread between two looks at whether the caller has cancelled.
const TOGETHER: usize = 64;

/// The visibility of each vertex of a mesh, from 0 to 1. The mesh says what is connected, `positions` where its vertices are beside each
/// other, and `front`, a unit vector, whereto the model turns its face, if it has one. Then places count for as much as without a front where the surface
/// faces that way, for two thirds where it faces sideways, and for one third where it faces away; and for no less than how well they are seen from the front. O(n log n); the
/// rays take about a microsecond each.
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(crate) fn of_vertices(
    mesh: &TriMesh,
    positions: &[Point3<f64>],
    front: Option<Vector3<f64>>,
    progress: &Progress,
) -> Result<Vec<f32>, Cancelled> {
    let Some(scene) = Scene::new(mesh, positions, progress)? else { return Ok(vec![1.0; mesh.vertex_count()]) };
    let sample = Sample::new(mesh, progress)?;
    let around = sample.measured(mesh, |v| scene.visibility(v), progress)?;
    let Some(front) = front else { return Ok(around) };
    let before = cone(front);
    let from_there = sample.measured(mesh, |v| scene.visibility_from(v, &before), progress)?;
    let seen = |v: VertexId| {
        let facing = normal(mesh, positions, v).map_or(0.0, |normal| normal.dot(&front));
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        let [usual, aslant] = [(2.0 + facing) / 3.0, facing.max(0.0)].map(|share| share as f32);
        (around[v.index()] * usual).max(from_there[v.index()] * aslant)
    };
    Ok(mesh.vertices().map(seen).collect())
}

/// The mean normal of the faces at a vertex, by area; `None` where they have none.
fn normal(mesh: &TriMesh, positions: &[Point3<f64>], v: VertexId) -> Option<Vector3<f64>> {
    let area = |h: HalfedgeId| {
        let [a, b, c] = mesh.triangle(h.face()).map(|v| positions[v.index()]);
        (b - a).cross(&(c - a))
    };
    mesh.outgoing(v).map(area).sum::<Vector3<f64>>().try_normalize(f64::MIN_POSITIVE)
}

/// The triangles of a model, to be met by rays.
struct Scene<'a> {
    mesh: &'a TriMesh,
    /// The vertices in the unit box.
    positions: Vec<Point3<f64>>,
    /// Of the triangles some thousands at a time.
    trees: Vec<Tree>,
    /// Directions in the hemisphere over the xy plane.
    directions: Vec<Vector3<f64>>,
}

impl<'a> Scene<'a> {
    /// `None` for a model without any extent.
    fn new(mesh: &'a TriMesh, positions: &[Point3<f64>], progress: &Progress) -> Result<Option<Self>, Cancelled> {
        let corner = |pick: fn(f64, f64) -> f64, from: f64| {
            positions.iter().fold(Vector3::repeat(from), |sum, p| sum.zip_map(&p.coords, pick))
        };
        let (low, high) = (corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY));
        let diagonal = (high - low).norm();
        if !(diagonal.is_finite() && diagonal > 0.0) {
            return Ok(None);
        }
        let middle = low + 0.5 * (high - low);
        let positions: Vec<_> = positions.iter().map(|p| Point3::from((p.coords - middle) / diagonal)).collect();
        let at = |v: VertexId| single(positions[v.index()].coords);
        let triangle = |t: &[VertexId; 3]| Triangle { v0: at(t[0]), v1: at(t[1]), v2: at(t[2]) };
        let some = |triangles: &[[VertexId; 3]]| {
            progress.check()?;
            Ok(Tree::new(triangles.iter().map(triangle).collect()))
        };
        let trees: Vec<Result<Tree, Cancelled>> = mesh.triangles().par_chunks(TREE).map(some).collect();
        let trees = trees.into_iter().collect::<Result<Vec<_>, Cancelled>>()?;
        Ok(Some(Self { mesh, positions, trees, directions: hemisphere(RAYS) }))
    }

    fn visibility(&self, v: VertexId) -> f32 {
        let Some((normal, along)) = self.frame(v) else { return 1.0 };
        let across = normal.cross(&along);
        let origin = single(self.positions[v.index()].coords + ABOVE * normal);
        let leaves = |d: &&Vector3<f64>| {
            let ray = Ray::new_inf(origin, single(along * d.x + across * d.y + normal * d.z));
            self.trees.iter().all(|tree| tree.is_missed(ray))
        };
        self.directions.iter().filter(leaves).count() as f32 / self.directions.len() as f32
    }

    /// The share of rays in some directions that leave the model.
    fn visibility_from(&self, v: VertexId, directions: &[Vector3<f64>]) -> f32 {
        let Some((normal, _)) = self.frame(v) else { return 1.0 };
        let origin = single(self.positions[v.index()].coords + ABOVE * normal);
        let leaves = |d: &&Vector3<f64>| {
            let ray = Ray::new_inf(origin, single(**d));
            normal.dot(d) > 0.0 && self.trees.iter().all(|tree| tree.is_missed(ray))
        };
        directions.iter().filter(leaves).count() as f32 / directions.len() as f32
    }

    /// The normal at a vertex and a direction at right angles to it, which turn with the model; `None` where there is no area.
    fn frame(&self, v: VertexId) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let at = |v: VertexId| self.positions[v.index()];
        let normal = normal(self.mesh, &self.positions, v)?;
        let side = at(self.mesh.to(self.mesh.an_outgoing(v))) - at(v);
        let along = (side - normal * normal.dot(&side)).try_normalize(f64::MIN_POSITIVE)?;
        Some((normal, along))
    }
}

/// Some triangles, so few that a cancel is not kept waiting while their boxes are made.
struct Tree {
    boxes: Bvh2,
    /// In the order of the boxes.
    triangles: Vec<Triangle>,
}

impl Tree {
    fn new(triangles: Vec<Triangle>) -> Self {
        let mut build_time = Duration::ZERO;
        let boxes = build_bvh2(&triangles, BvhBuildParams::very_fast_build(), &mut build_time);
        let triangles = boxes.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        Self { boxes, triangles }
    }

    fn is_missed(&self, ray: Ray) -> bool {
        self.boxes.ray_traverse_miss(ray, |ray, i| self.triangles[i].intersect(ray))
    }
}

/// In single precision.
#[expect(clippy::cast_possible_truncation, reason = "coordinates in the unit box")]
fn single(v: Vector3<f64>) -> Vec3A {
    Vec3A::new(v.x as f32, v.y as f32, v.z as f32)
}

/// Directions over the xy plane, spread evenly as seen from below: their density goes with the cosine.
fn hemisphere(count: usize) -> Vec<Vector3<f64>> {
    // Vogel's spiral.
    let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let direction = |i: usize| {
        let (square, angle) = ((i as f64 + 0.5) / count as f64, turn * i as f64);
        Vector3::new(square.sqrt() * angle.cos(), square.sqrt() * angle.sin(), (1.0 - square).sqrt())
    };
    (0..count).map(direction).collect()
}

/// Directions around one, none farther from it than [`WALK`].
fn cone(axis: Vector3<f64>) -> Vec<Vector3<f64>> {
    let beside = if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let along = axis.cross(&beside).normalize();
    let across = axis.cross(&along);
    let narrow = |d: Vector3<f64>| (axis + WALK.tan() * (along * d.x + across * d.y)).normalize();
    hemisphere(FRONT_RAYS).into_iter().map(narrow).collect()
}

/// Some vertices of a mesh, spread evenly, and which of them is near each vertex.
struct Sample {
    vertices: Vec<VertexId>,
    /// By its place among them.
    near: Vec<u32>,
    /// How many edges the vertices of the sample are apart at least.
    apart: usize,
}

impl Sample {
    fn new(mesh: &TriMesh, progress: &Progress) -> Result<Self, Cancelled> {
        let count = mesh.vertex_count();
        // A vertex of a triangle mesh has about 3r² others within r edges.
        let apart = (0..).find(|r| count <= SAMPLES * (1 + r * r)).unwrap_or(0);
        let (mut vertices, mut near) = (Vec::new(), vec![u32::MAX; count]);
        let mut reached = Vec::new();
        for v in mesh.vertices() {
            if near[v.index()] != u32::MAX {
                continue;
            }
            progress.check()?;
            let number = vertices.len() as u32;
            vertices.push(v);
            near[v.index()] = number;
            reached.clear();
            reached.push(v);
            let mut first = 0;
            for _ in 0..apart {
                let last = reached.len();
                for i in first..last {
                    for w in mesh.neighbours(reached[i]) {
                        if near[w.index()] == u32::MAX {
                            near[w.index()] = number;
                            reached.push(w);
                        }
                    }
                }
                first = last;
            }
        }
        Ok(Self { vertices, near, apart })
    }

    /// Values of all vertices, of which those of the sample are measured.
    fn measured(
        &self,
        mesh: &TriMesh,
        measure: impl Fn(VertexId) -> f32 + Sync,
        progress: &Progress,
    ) -> Result<Vec<f32>, Cancelled> {
        let some = |vertices: &[VertexId]| {
            progress.check()?;
            Ok(vertices.iter().map(|&v| measure(v)).collect())
        };
        let measured: Vec<Result<Vec<f32>, Cancelled>> = self.vertices.par_chunks(TOGETHER).map(some).collect();
        let measured = measured.into_iter().collect::<Result<Vec<_>, Cancelled>>()?;
        self.spread(mesh, &measured.concat(), progress)
    }

    /// Values of the sample on all vertices, smoothed as widely as the sample is apart.
    fn spread(&self, mesh: &TriMesh, of_sample: &[f32], progress: &Progress) -> Result<Vec<f32>, Cancelled> {
        let mut values: Vec<f32> = self.near.iter().map(|&i| of_sample[i as usize]).collect();
        for _ in 0..=self.apart {
            progress.check()?;
            let smooth = |v: VertexId| {
                let (sum, count) =
                    mesh.neighbours(v).fold((values[v.index()], 1.0), |(s, n), w| (s + values[w.index()], n + 1.0));
                sum / count
            };
            values = mesh.vertices().map(smooth).collect();
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::mesh::test_surfaces;

    fn seen(mesh: &TriMesh, positions: &[Point3<f64>]) -> Vec<f32> {
        of_vertices(mesh, positions, None, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn from_a_convex_body_and_a_sheet_everything_is_seen() {
        for mesh in [
            test_surfaces::sphere(3),
            test_surfaces::cubes([1, 2, 3], |_| true),
            test_surfaces::grid(9, 9, [2.0, 1.0], 0.3),
        ] {
            assert!(seen(&mesh, mesh.positions()).iter().all(|&v| v > 0.999));
        }
    }

    /// The inner side of a torus sees its other side.
    #[test]
    fn less_is_seen_from_a_hollow_wherever_the_model_is() {
        let torus = test_surfaces::torus(40, 20, 0.4);
        let values = seen(&torus, torus.positions());
        let distance = |v: VertexId| torus.position(v).coords.xy().norm();
        let mean = |is_of: &dyn Fn(f64) -> bool| {
            let of: Vec<f32> = torus.vertices().filter(|&v| is_of(distance(v))).map(|v| values[v.index()]).collect();
            of.iter().sum::<f32>() / of.len() as f32
        };
        let (inside, outside) = (mean(&|d| d < 0.7), mean(&|d| d > 1.3));
        assert!(inside < 0.8 && outside > 0.95, "{inside} {outside}");
        let turn = Rotation3::from_euler_angles(0.3, 1.1, -2.0);
        let elsewhere: Vec<Point3<f64>> =
            torus.positions().iter().map(|p| (turn * p) * 300.0 + Vector3::new(1e4, -7.0, 2.0)).collect();
        let there = seen(&torus, &elsewhere);
        assert!(values.iter().zip(&there).all(|(a, b)| (a - b).abs() < 0.05), "rays along an edge may miss it or not");
    }

    #[test]
    fn one_component_hides_another() {
        // Two balls as one mesh: the triangles of the second are the vertices of the first, further on.
        let ball = test_surfaces::sphere(2);
        let count = ball.vertex_count() as u32;
        let shrunk = ball.positions().iter().map(|p| p * 0.5);
        let positions: Vec<Point3<f64>> = ball.positions().iter().copied().chain(shrunk).collect();
        let numbers = |shift: u32| ball.triangles().iter().map(move |t| t.map(|v| v.index() as u32 + shift));
        let triangles: Vec<[u32; 3]> = numbers(0).chain(numbers(count)).collect();
        let both = test_surfaces::mesh(&positions, &triangles);
        let values = seen(&both, both.positions());
        let is_inner = |v: VertexId| both.position(v).coords.norm() < 0.75;
        // A ray or two slip through between triangles, along the lines on which the balls' vertices lie.
        assert!(both.vertices().all(|v| if is_inner(v) { values[v.index()] < 0.1 } else { values[v.index()] == 1.0 }));
    }

    #[test]
    fn large_meshes_are_sampled_and_values_spread_between() {
        let torus = test_surfaces::torus(160, 80, 0.4);
        let sample = Sample::new(&torus, &Progress::new()).expect("not cancelled");
        assert!(
            sample.apart > 0 && sample.vertices.len() < 2 * SAMPLES && sample.vertices.len() > SAMPLES / 3,
            "{}",
            sample.vertices.len()
        );
        let values = seen(&torus, torus.positions());
        let same_ring = |v: VertexId, w: VertexId| {
            let ring = |v: VertexId| (torus.position(v).coords.xy().norm(), torus.position(v).z);
            (ring(v).0 - ring(w).0).abs() + (ring(v).1 - ring(w).1).abs() < 1e-9
        };
        let first = VertexId::new(0);
        let around = torus.vertices().filter(|&v| same_ring(v, first)).map(|v| values[v.index()]);
        let (low, high) = around.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)));
        assert!(high - low < 0.15, "alike places look alike: {low} to {high}");
    }

    #[test]
    fn from_the_front_the_front_is_seen_most() {
        let ball = test_surfaces::sphere(2);
        let front = Some(Vector3::new(0.0, -1.0, 0.0));
        let seen = of_vertices(&ball, ball.positions(), front, &Progress::new()).expect("not cancelled");
        for (p, seen) in ball.positions().iter().zip(seen) {
            assert!((f64::from(seen) - (2.0 - p.y / p.coords.norm()) / 3.0).abs() < 0.02, "{p} {seen}");
        }
    }

    /// The bottom of a ditch that runs up the middle of a wall: from the side it is hidden, from the front it is not.
    #[test]
    fn a_groove_that_one_looks_into_is_seen() {
        let flat = test_surfaces::grid(20, 20, [2.0, 2.0], 0.0);
        let ditch: Vec<Point3<f64>> = flat
            .positions()
            .iter()
            .map(|p| Point3::new(p.x, p.y, if (p.x - 1.0).abs() < 0.05 { -0.3 } else { 0.0 }))
            .collect();
        let bottom = flat.vertices().filter(|v| ditch[v.index()].z < 0.0 && (ditch[v.index()].y - 1.0).abs() < 0.5);
        let bottom: Vec<VertexId> = bottom.collect();
        let mean = |front: Option<Vector3<f64>>| {
            let seen = of_vertices(&flat, &ditch, front, &Progress::new()).expect("not cancelled");
            bottom.iter().map(|v| seen[v.index()]).sum::<f32>() / bottom.len() as f32
        };
        let (anywhere, front, side) = (mean(None), mean(Some(Vector3::z())), mean(Some(Vector3::x())));
        assert!(anywhere < 0.65 && side < anywhere && front > 0.8, "{anywhere} {front} {side}");
    }

    #[test]
    fn what_has_no_extent_is_seen_and_a_cancel_is_heard() {
        let mesh = test_surfaces::grid(2, 2, [1.0, 1.0], 0.0);
        let nowhere = vec![Point3::origin(); mesh.vertex_count()];
        assert!(seen(&mesh, &nowhere).iter().all(|&v| v == 1.0));
        assert!(seen(&TriMesh::default(), &[]).is_empty());
        let progress = Progress::new();
        progress.cancel();
        assert!(of_vertices(&mesh, mesh.positions(), None, &progress).is_err());
    }
}
