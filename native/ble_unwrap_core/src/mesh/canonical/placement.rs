//! A frame that a component spans itself, and coordinates in it that forget how they were come by.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use super::polygons::Polygons;
use crate::mesh::index::{HalfedgeId, VertexId};
use crate::mesh::tri_mesh::TriMesh;

/// Coordinates are rounded to multiples of this, in units of the component's size rounded up to a power of two: far finer
/// than single precision, far coarser than the rounding of a double. Where coordinates are exact to 1e-15 of the size, one
/// in fifty thousand may be rounded either way, which is harmless: with a grid of 2⁻⁴⁰, where one in a thousand is, twenty
/// motions of twenty-one shapes still gave the same charts. A coarser grid would break ties between distances, which are
/// kept in single precision: with 2⁻²⁷, 54 shapes had 2 % more charts than with this one.
const GRID: f64 = 1.0 / (1u64 << 34) as f64;
/// At a vertex with a smaller feature beside it they are rounded to this share of that feature, rounded down to a power of two.
const FEATURE_SHARE: f64 = 1.0 / (1u64 << 10) as f64;
/// No grid is finer than this, in the same unit as the usual one: below, all digits of a double are kept anyway.
const FINEST: f64 = 1.0 / (1u64 << 44) as f64;
/// A corner lower than this share of its longer side is a straight one, not a feature: rounding makes it so.
const STRAIGHT: f64 = 1.0 / (1u64 << 34) as f64;
/// What spans the frame is the first in order that is so far away or so large, as a share of the farthest or largest. No
/// simple fraction, since symmetric shapes have distances in such ratios.
const MOST: f64 = 0.813_7;
/// A component whose largest polygon has no more area than this share of its extent squared is a line, whose frame may
/// turn around it.
const LEAST_AREA: f64 = 1e-12;
/// Directions that differ by no more than this angle count as parallel: far above rounding.
const PARALLEL: f64 = 1e-6;
/// Sizes are multiplied by this before they are rounded to a power of two, which many sizes are exactly.
const ODD: f64 = 1.234_5;

/// The smallest feature at each vertex: the least height of a corner of a polygon, or the length of a side where that is
/// straight.
pub(super) fn features(mesh: &TriMesh, polygons: &Polygons<'_>) -> Vec<f64> {
    let corners = |h: HalfedgeId| {
        let next = polygons.next(h);
        [mesh.from(h), mesh.from(next), mesh.to(next)]
    };
    let feature = |h: usize| {
        let h = HalfedgeId::new(h);
        if !polygons.is_side(h) {
            return f64::INFINITY;
        }
        let [a, b, c] = corners(h).map(|v| mesh.position(v));
        let (first, second) = (b - a, c - b);
        let length = first.norm();
        let longest = length.max(second.norm()).max((c - a).norm());
        // No more than any of the three sides.
        let height = first.cross(&second).norm() / longest;
        if height > STRAIGHT * longest {
            height
        } else if length > 0.0 {
            length
        } else {
            f64::INFINITY
        }
    };
    let of_side: Vec<f64> = (0..mesh.halfedge_count()).into_par_iter().map(feature).collect();
    let mut features = vec![f64::INFINITY; mesh.vertex_count()];
    for h in mesh.halfedges().filter(|&h| polygons.is_side(h)) {
        for v in corners(h) {
            features[v.index()] = features[v.index()].min(of_side[h.index()]);
        }
    }
    features
}

/// Writes where the vertices of a component are in its own frame, rounded. `order` holds the sides by which its polygons
/// are reached.
pub(super) fn place(
    mesh: &TriMesh,
    polygons: &Polygons<'_>,
    order: &[HalfedgeId],
    vertices: &[VertexId],
    features: &[f64],
    size: f64,
    placed: &mut [Point3<f64>],
) {
    let (origin, axes) = frame(mesh, polygons, order);
    let unit = power_of_two_below(2.0 * ODD * size);
    for v in vertices {
        let feature = power_of_two_below(ODD * FEATURE_SHARE * features[v.index()]);
        let grid = feature.clamp(FINEST * unit, GRID * unit);
        placed[v.index()] = Point3::from((axes * (mesh.position(*v) - origin)).map(|x| (x / grid).round() * grid));
    }
}

/// The origin and the axes, as rows, of the frame of a component.
///
/// The axes are along a side of one of the largest polygons and across that polygon. So what is flat and straight there,
/// and what is parallel or at right angles to it, is so exactly in rounded coordinates, too, and equal lengths are equal.
fn frame(mesh: &TriMesh, polygons: &Polygons<'_>, order: &[HalfedgeId]) -> (Point3<f64>, Matrix3<f64>) {
    let sides = || order.iter().flat_map(|&entry| polygons.around(entry));
    let from = |h: HalfedgeId| mesh.position(mesh.from(h));
    let along = |h: HalfedgeId| mesh.position(mesh.to(h)) - from(h);
    let Some(start) = order.first().map(|&h| from(h)) else { return (Point3::origin(), Matrix3::identity()) };
    let Some(far) = first_of_most(sides(), |h| (from(h) - start).norm()).map(from) else {
        return (start, Matrix3::identity());
    };
    let origin = nalgebra::center(&start, &far);
    let area_vector = |h: HalfedgeId| polygons.area_vector(polygons.of(h));
    let area = |h: HalfedgeId| area_vector(h).norm();
    let polygon = first_of_most(order.iter().copied(), area);
    let Some(polygon) = polygon.filter(|&h| area(h) > LEAST_AREA * (far - start).norm_squared()) else {
        let x = (far - start).normalize();
        let y = x.cross(&Vector3::ith(x.iamin(), 1.0)).normalize();
        return (origin, Matrix3::from_rows(&[x.transpose(), y.transpose(), x.cross(&y).transpose()]));
    };
    // All that is parallel adds up, so that the rounding of a single small polygon does not tilt the whole.
    let z = sum_of_parallel(area_vector(polygon), order.iter().map(|&h| area_vector(h))).normalize();
    let side = first_of_most(polygons.around(polygon), |h| along(h).norm()).map_or_else(|| far - start, along);
    let x = sum_of_parallel(side, sides().map(along));
    let x = (x - z * z.dot(&x)).normalize();
    (origin, Matrix3::from_rows(&[x.transpose(), z.cross(&x).transpose(), z.transpose()]))
}

/// The first that has nearly as much as the one that has most, if any has more than nothing.
fn first_of_most(
    items: impl Iterator<Item = HalfedgeId> + Clone,
    measure: impl Fn(HalfedgeId) -> f64,
) -> Option<HalfedgeId> {
    let most = items.clone().map(&measure).fold(0.0, f64::max);
    items.clone().find(|&h| most > 0.0 && measure(h) >= MOST * most)
}

/// The sum of those vectors that are parallel to a direction, either way, all turned to run as it does.
fn sum_of_parallel(direction: Vector3<f64>, vectors: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let unit = direction.normalize();
    let parallel = vectors.filter(|v| v.cross(&unit).norm() <= PARALLEL * v.norm());
    parallel.fold(Vector3::zeros(), |sum, v| sum + v * v.dot(&unit).signum())
}

/// The greatest power of two that is no more than a positive number; zero, infinite and other numbers stay.
fn power_of_two_below(x: f64) -> f64 {
    // The sign and the exponent alone.
    if x.is_normal() { f64::from_bits(x.to_bits() & 0xfff0_0000_0000_0000) } else { x }
}
