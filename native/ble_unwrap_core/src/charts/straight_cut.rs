//! A straight cut along a tube.
//!
//! Where cuts are drawn to places that are seldom seen, the cheapest one steps sideways for every little that this saves, and what is cut
//! open there has stairs for a border. Along a line of edges that goes straight on, the wall of a tube becomes a rectangle.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use crate::mesh::{HalfedgeId, TriMesh, VertexId, measure};

/// A line goes straight on where the angles on its two sides differ from half of the whole angle around the vertex by less than 10°.
const MOST_TURN: f64 = PI / 18.0;

/// The cheapest by `weight` of the lines of edges that go straight on from one of two boundary loops to the other, and what it costs; none
/// of its edges is `forbidden`. `None` where there is none, or where there are not two loops. O(n) where few lines meet, and never more than
/// that times the edges at a loop.
pub(crate) fn straight_cut(
    mesh: &TriMesh,
    weight: impl Fn(HalfedgeId) -> f64,
    forbidden: impl Fn(HalfedgeId) -> bool,
) -> Option<(Vec<HalfedgeId>, f64)> {
    let loops = mesh.boundary_loops();
    if loops.len() != 2 {
        return None;
    }
    let (one, other) = (loops.group(0), loops.group(1));
    let (from, to) = if one.len() <= other.len() { (one, other) } else { (other, one) };
    let ends: BTreeSet<VertexId> = to.iter().map(|&h| mesh.from(h)).collect();
    let is_open = |h: HalfedgeId| !mesh.is_boundary(h) && !forbidden(h) && !forbidden(mesh.twin(h));
    let mut best: Option<(Vec<HalfedgeId>, f64)> = None;
    let starts = from.iter().flat_map(|&h| mesh.outgoing(mesh.from(h)).filter(|&h| is_open(h)));
    for first in starts {
        let most = best.as_ref().map_or(f64::INFINITY, |(_, cost)| *cost);
        if let Some(line) = line(mesh, first, &ends, most, &weight, &is_open) {
            best = Some(line);
        }
    }
    best
}

/// The line that begins with an edge, if it costs less than so much.
fn line(
    mesh: &TriMesh,
    first: HalfedgeId,
    ends: &BTreeSet<VertexId>,
    most: f64,
    weight: &impl Fn(HalfedgeId) -> f64,
    is_open: &impl Fn(HalfedgeId) -> bool,
) -> Option<(Vec<HalfedgeId>, f64)> {
    let (mut path, mut cost, mut next) = (Vec::new(), 0.0, first);
    // A line that winds has no more edges than there are vertices.
    for _ in 0..mesh.vertex_count() {
        path.push(next);
        cost += weight(next);
        let v = mesh.to(next);
        if ends.contains(&v) {
            return (cost < most).then_some((path, cost));
        }
        if cost >= most || mesh.is_boundary_vertex(v) {
            return None;
        }
        next = straight_on(mesh, mesh.twin(next), is_open)?;
    }
    None
}

/// Of the open half-edges that leave a vertex inside, the one that goes on where one that leads back came from.
fn straight_on(mesh: &TriMesh, back: HalfedgeId, is_open: &impl Fn(HalfedgeId) -> bool) -> Option<HalfedgeId> {
    let mut angle = 0.0;
    let mut passed = Vec::new();
    let turn = |h: HalfedgeId| Some(mesh.twin(h.prev())).filter(|&next| !next.is_none() && next != back);
    for h in std::iter::successors(Some(back), |&h| turn(h)).take(mesh.halfedge_count()) {
        passed.push((h, angle));
        angle += measure::corner_angle([h, h.next(), h.prev()].map(|h| mesh.position(mesh.from(h))));
    }
    let turn = |before: f64| (before - 0.5 * angle).abs();
    let open = passed.into_iter().skip(1).filter(|&(h, before)| turn(before) < MOST_TURN && is_open(h));
    open.min_by(|a, b| turn(a.1).total_cmp(&turn(b.1))).map(|(h, _)| h)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use nalgebra::Point3;

    /// The wall of a tube of quads in triangles, its axis upright.
    fn tube(around: u32, rows: u32) -> TriMesh {
        let place = |row: u32, k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            Point3::new(angle.cos(), angle.sin(), f64::from(row))
        };
        let positions: Vec<_> = (0..=rows).flat_map(|row| (0..around).map(move |k| place(row, k))).collect();
        let at = |row: u32, k: u32| row * around + k % around;
        let quad = |row: u32, k: u32| [at(row, k), at(row, k + 1), at(row + 1, k + 1), at(row + 1, k)];
        let quads = (0..rows).flat_map(|row| (0..around).map(move |k| quad(row, k)));
        let triangles: Vec<_> = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        test_surfaces::mesh(&positions, &triangles)
    }

    #[test]
    fn the_cheapest_column_is_taken_though_a_path_with_steps_is_cheaper() {
        let mesh = tube(12, 6);
        // Cheap places wind around the tube; one column is a little cheaper than the others.
        let weight = |h: HalfedgeId| {
            let middle = nalgebra::center(&mesh.position(mesh.from(h)), &mesh.position(mesh.to(h)));
            let steps = (middle.y.atan2(middle.x) - 0.7 * middle.z).cos();
            let column = if (middle.x - 1.0).abs() < 1e-9 { 0.3 } else { 0.0 };
            mesh.edge_length(h) * (1.0 - 0.4 * steps - column)
        };
        let (path, cost) = straight_cut(&mesh, weight, |_| false).expect("a column");
        assert_eq!(path.len(), 6);
        assert!(path.iter().all(|&h| (mesh.position(mesh.from(h)).x - 1.0).abs() < 1e-9));
        assert!((cost - path.iter().map(|&h| weight(h)).sum::<f64>()).abs() < 1e-12);
        // Where that column must not be cut another one is.
        let is_there = |h: HalfedgeId| mesh.position(mesh.from(h)).x > 1.0 - 1e-9;
        let (other, dearer) = straight_cut(&mesh, weight, is_there).expect("another");
        assert!(dearer >= cost && !other.iter().any(|&h| is_there(h)));
    }

    #[test]
    fn there_is_none_where_nothing_goes_straight_on_or_there_are_not_two_loops() {
        let length =
            |mesh: &TriMesh| straight_cut(mesh, |h| mesh.edge_length(h), |_| false).map(|(path, _)| path.len());
        assert_eq!(length(&test_surfaces::grid(4, 4, [4.0, 4.0], 0.0)), None);
        assert_eq!(length(&test_surfaces::sphere(2)), None);
        let mesh = tube(8, 4);
        let rows = |h: HalfedgeId| mesh.position(mesh.from(h)).z != mesh.position(mesh.to(h)).z;
        assert_eq!(straight_cut(&mesh, |h| mesh.edge_length(h), rows), None);
        assert_eq!(length(&mesh), Some(4));
    }
}
