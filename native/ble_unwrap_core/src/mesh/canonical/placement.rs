//! A frame that a component spans itself, and coordinates in it that forget how they were come by.

use nalgebra::{Matrix3, Point3, Vector3};

use super::cells::Cells;
use crate::mesh::index::{FaceId, HalfedgeId, VertexId};
use crate::mesh::tri_mesh::TriMesh;

/// Coordinates are rounded to multiples of this, in units of the component's size rounded up to a power of two: an eighth
/// of what single precision rounds coordinates of that size to. With coordinates exact to 1e-15 of the size, one in ten
/// million may be rounded either way.
const GRID: f64 = 1.0 / (1u64 << 27) as f64;
/// or of this share of the smallest feature at the vertex, rounded down to a power of two,
const FEATURE_SHARE: f64 = 1.0 / (1u64 << 10) as f64;
/// but of no less than this, in the same unit as the grid: below, all digits of a double are kept anyway.
const FINEST: f64 = 1.0 / (1u64 << 44) as f64;
/// A corner lower than this share of its longer side is a straight one, not a feature: rounding makes it so.
const STRAIGHT: f64 = 1.0 / (1u64 << 34) as f64;
/// A vertex spans the frame if it is so far away, as a share of the greatest distance. No simple fraction, since symmetric
/// shapes have distances in such ratios.
const FAR: f64 = 0.813_7;
/// A component no wider than this share of its length is a line, whose frame may turn around it.
const LEAST_WIDTH: f64 = 1e-12;
/// Sizes are multiplied by this before they are rounded to a power of two, which many sizes are exactly.
const ODD: f64 = 1.234_5;

/// The smallest feature at each vertex: the shortest side and the least height of a corner of a polygon.
pub(super) fn features(mesh: &TriMesh, cells: &Cells<'_>) -> Vec<f64> {
    let mut features = vec![f64::INFINITY; mesh.vertex_count()];
    let mut note = |corners: &[VertexId], feature: f64| {
        corners.iter().for_each(|v| features[v.index()] = features[v.index()].min(feature));
    };
    for f in mesh.faces().map(FaceId::index) {
        for h in FaceId::new(f).halfedges().into_iter().filter(|&h| cells.is_side(h)) {
            let next = cells.next(h);
            let corners = [mesh.from(h), mesh.from(next), mesh.to(next)];
            let [a, b, c] = corners.map(|v| mesh.position(v));
            let (first, second) = (b - a, c - b);
            let length = first.norm();
            if length > 0.0 {
                note(&corners[..2], length);
            }
            let longest = length.max(second.norm()).max((c - a).norm());
            let height = first.cross(&second).norm() / longest;
            if height > STRAIGHT * longest {
                note(&corners, height);
            }
        }
    }
    features
}

/// Writes where the vertices of a component are in its own frame, rounded. `order` holds the sides by which its polygons
/// are reached.
pub(super) fn place(
    mesh: &TriMesh,
    cells: &Cells<'_>,
    order: &[HalfedgeId],
    vertices: &[VertexId],
    features: &[f64],
    size: f64,
    placed: &mut [Point3<f64>],
) {
    let in_order = order.iter().flat_map(|&entry| cells.around(entry)).map(|h| mesh.position(mesh.from(h)));
    let (origin, axes) = frame(in_order, vertices.iter().map(|&v| mesh.position(v)));
    let unit = power_of_two_below(2.0 * ODD * size);
    for v in vertices {
        let feature = power_of_two_below(ODD * FEATURE_SHARE * features[v.index()]);
        let grid = feature.clamp(FINEST * unit, GRID * unit);
        placed[v.index()] = Point3::from((axes * (mesh.position(*v) - origin)).map(|x| (x / grid).round() * grid));
    }
}

/// The origin and the axes, as rows, of a frame spanned by early points of an order; `all` holds the same points in any.
fn frame(
    mut in_order: impl Iterator<Item = Point3<f64>> + Clone,
    all: impl Iterator<Item = Point3<f64>> + Clone,
) -> (Point3<f64>, Matrix3<f64>) {
    let Some(first) = in_order.next() else { return (Point3::origin(), Matrix3::identity()) };
    // The first point that is far away by a measure, if there is any distance.
    let far = |measure: &dyn Fn(Point3<f64>) -> f64, least: f64| {
        let farthest = all.clone().map(measure).fold(0.0, f64::max);
        in_order.clone().find(|&p| farthest > least && measure(p) >= FAR * farthest)
    };
    let Some(second) = far(&|p| (p - first).norm(), 0.0) else { return (first, Matrix3::identity()) };
    let length = (second - first).norm();
    let x = (second - first) / length;
    let across = |p: Point3<f64>| (p - first) - x * x.dot(&(p - first));
    let y = match far(&|p| across(p).norm(), LEAST_WIDTH * length) {
        Some(third) => across(third).normalize(),
        None => x.cross(&Vector3::ith(x.iamin(), 1.0)).normalize(),
    };
    (nalgebra::center(&first, &second), Matrix3::from_rows(&[x.transpose(), y.transpose(), x.cross(&y).transpose()]))
}

/// The greatest power of two that is no more than a positive number; zero, infinite and other numbers stay.
fn power_of_two_below(x: f64) -> f64 {
    // The sign and the exponent alone.
    if x.is_normal() { f64::from_bits(x.to_bits() & 0xfff0_0000_0000_0000) } else { x }
}
