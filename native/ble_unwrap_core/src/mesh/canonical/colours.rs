//! What the sides of polygons look like, whatever the pose, the size and the numbers of their mesh.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use super::polygons::Polygons;
use crate::mesh::index::{HalfedgeId, VertexId};
use crate::mesh::tri_mesh::TriMesh;
use crate::random;

/// Quantities are told apart in steps of this, in units of the component's size: nine digits above what rounding makes of
/// them, so that one in a billion comes to lie on either side of a step by chance. No simple fraction, since symmetric
/// shapes have quantities that are.
const STEP: f64 = 0.948_683_298e-6;
/// A component of less area than this share of the square of its extent weighs by its vertices: its area may be rounding.
const LEAST_AREA: f64 = 1e-10;

/// So many vertices or polygons are coloured by one thread at a time, which takes some 50 µs.
const TOGETHER: usize = 1024;

/// A colour for each vertex and side, of one component after the other.
pub(super) struct Colours<'a> {
    mesh: &'a TriMesh,
    polygons: &'a Polygons<'a>,
    /// Whether colours tell the division into triangles, too.
    divided: bool,
    /// The area of the polygons at each vertex, shared among their corners.
    weight: Vec<f64>,
    /// Distance of each vertex from the middle of its component, in units of its size.
    pub(super) radius: Vec<f64>,
    vertex: Vec<u64>,
    side: Vec<u64>,
}

impl<'a> Colours<'a> {
    /// With `own_triangles` the division into triangles does not matter.
    pub(super) fn new(mesh: &'a TriMesh, polygons: &'a Polygons<'a>, own_triangles: bool) -> Self {
        let mut weight = vec![0.0; mesh.vertex_count()];
        for polygon in 0..polygons.len() {
            let share = polygons.area_vector(polygon).norm() / (polygons.faces(polygon).len() + 2) as f64;
            polygons.sides(polygon).for_each(|h| weight[mesh.from(h).index()] += share);
        }
        Self {
            mesh,
            polygons,
            divided: !own_triangles,
            weight,
            radius: vec![0.0; mesh.vertex_count()],
            vertex: vec![0; mesh.vertex_count()],
            side: vec![0; mesh.halfedge_count()],
        }
    }

    /// The colour of a side.
    pub(super) fn of(&self, side: HalfedgeId) -> u64 {
        self.side[side.index()]
    }

    /// Colours a component, and returns its size: the distance of its surface from its middle, in the quadratic mean.
    pub(super) fn colour(&mut self, polygons: &[u32], vertices: &[VertexId]) -> f64 {
        let form = Form::new(vertices.iter().map(|v| (self.mesh.position(*v), self.weight[v.index()])));
        let colour = |v: &VertexId| {
            let [radius, quantities @ ..] = form.quantities(self.mesh.position(*v));
            // Where nothing is painted the colour is that of the shape.
            let weight = self.mesh.seam_weight(*v);
            let painted = if weight == 1.0 { None } else { Some(u64::from(weight.to_bits())) };
            let words = quantities.into_iter().map(step).chain(painted);
            (radius, words.fold(step(radius), joined))
        };
        let coloured: Vec<(f64, u64)> = vertices.par_iter().with_min_len(TOGETHER).map(colour).collect();
        for (v, at_vertex) in vertices.iter().zip(coloured) {
            (self.radius[v.index()], self.vertex[v.index()]) = at_vertex;
        }
        let colour = |h: HalfedgeId, sides: usize| {
            let [from, to] = [self.mesh.from(h), self.mesh.to(h)];
            let length = self.mesh.edge_length(h) / form.size;
            let marks = u64::from(self.mesh.is_boundary(h)) + 2 * u64::from(self.mesh.is_guide(h)) + 4 * sides as u64;
            let division = if self.divided { self.polygons.triangles_at(h) } else { 0 };
            let words = [self.vertex[to.index()], step(length), marks, division];
            (h, words.into_iter().fold(self.vertex[from.index()], joined))
        };
        let of_polygon = |&polygon: &u32| {
            let sides = self.polygons.faces(polygon as usize).len() + 2;
            self.polygons.sides(polygon as usize).map(move |h| colour(h, sides))
        };
        let coloured: Vec<(HalfedgeId, u64)> =
            polygons.par_iter().with_min_len(TOGETHER).flat_map_iter(of_polygon).collect();
        for (h, colour) in coloured {
            self.side[h.index()] = colour;
        }
        form.size
    }
}

/// A hash of what was hashed before and one more word.
pub(super) fn joined(hash: u64, word: u64) -> u64 {
    random::mix(hash.wrapping_mul(random::GOLDEN) ^ word)
}

/// The step that a quantity is nearest to.
pub(super) fn step(quantity: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and the bits are hashed")]
    let step = (quantity / STEP).round() as i64 as u64;
    step
}

/// How a component is spread around its middle, up to the third moments: two shapes that agree in these at all vertices
/// and in all lengths beside them, and are not the same, are made, not met.
struct Form {
    middle: Point3<f64>,
    size: f64,
    second: Matrix3<f64>,
    /// The mean of d·d d.
    skew: Vector3<f64>,
    /// The mean of d d d, by the first index.
    third: [Matrix3<f64>; 3],
}

impl Form {
    fn new(points: impl Iterator<Item = (Point3<f64>, f64)> + Clone) -> Self {
        let mean = |weigh: &dyn Fn(f64) -> f64| {
            let (mut sum, mut total) = (Vector3::zeros(), 0.0);
            for (p, w) in points.clone() {
                sum += p.coords * weigh(w);
                total += weigh(w);
            }
            (Point3::from(sum / f64::max(total, f64::MIN_POSITIVE)), total)
        };
        let (by_number, count) = mean(&|_| 1.0);
        let extent = points.clone().map(|(p, _)| (p - by_number).norm_squared()).fold(0.0, f64::max);
        let (by_area, area) = mean(&|w| w);
        let has_area = area > LEAST_AREA * extent;
        let (middle, total) = if has_area { (by_area, area) } else { (by_number, count) };
        let weigh = |w: f64| if has_area { w / total } else { 1.0 / total };
        let spread: f64 = points.clone().map(|(p, w)| weigh(w) * (p - middle).norm_squared()).sum();
        let size = if spread > 0.0 { spread.sqrt() } else { 1.0 };
        let mut form =
            Self { middle, size, second: Matrix3::zeros(), skew: Vector3::zeros(), third: [Matrix3::zeros(); 3] };
        for (p, w) in points {
            let d = (p - middle) / size;
            let square = d * d.transpose() * weigh(w);
            form.second += square;
            form.skew += d * (weigh(w) * d.norm_squared());
            for k in 0..3 {
                form.third[k] += square * d[k];
            }
        }
        form
    }

    /// Quantities of a point that no motion or scaling of the whole changes; the first is its distance from the middle.
    fn quantities(&self, p: Point3<f64>) -> [f64; 4] {
        let d = (p - self.middle) / self.size;
        let third: f64 = (0..3).map(|k| d[k] * d.dot(&(self.third[k] * d))).sum();
        [d.norm(), d.dot(&(self.second * d)), d.dot(&self.skew), third]
    }
}
