//! A straight cut along a tube.
//!
//! Where cuts are drawn to places that are seldom seen, the cheapest one steps sideways for every little that this saves, and what is cut
//! open there has stairs for a border. Along a line of edges that goes straight on, the wall of a tube becomes a rectangle.

use std::f64::consts::PI;

use crate::mesh::{HalfedgeId, TriMesh, measure};

/// A line goes straight on where the angles on its two sides differ from half of the whole angle around the vertex by less than 10°.
const MOST_TURN: f64 = PI / 18.0;

/// Edges that are followed in search of a line, at most so many times as many as there are vertices.
const MOST_FOLLOWED: usize = 24;

/// The cheapest by `weight` of the lines of edges that go straight on from one of two boundary loops to the other, if one costs at most `most`; none
/// of its edges is `forbidden`, and it meets no vertex twice. `None` where there is none, or where there are not two loops. It need not be
/// found where very many lines wind around a tube. O(n).
pub(crate) fn straight_cut(
    mesh: &TriMesh,
    most: f64,
    weight: impl Fn(HalfedgeId) -> f64,
    forbidden: impl Fn(HalfedgeId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let loops = mesh.boundary_loops();
    if loops.len() != 2 {
        return None;
    }
    let (one, other) = (loops.group(0), loops.group(1));
    let (from, to) = if one.len() <= other.len() { (one, other) } else { (other, one) };
    let mut is_end = vec![false; mesh.vertex_count()];
    to.iter().for_each(|&h| is_end[mesh.from(h).index()] = true);
    let is_open = |h: HalfedgeId| !mesh.is_boundary(h) && !forbidden(h) && !forbidden(mesh.twin(h));
    // The last line that met each vertex.
    let mut met_by = vec![0usize; mesh.vertex_count()];
    let mut left = MOST_FOLLOWED * mesh.vertex_count();
    let mut best: Option<(Vec<HalfedgeId>, f64)> = None;
    let starts = from.iter().flat_map(|&h| mesh.outgoing(mesh.from(h)).filter(|&h| is_open(h)));
    for (line, first) in (1..).zip(starts) {
        let (mut path, mut cost, mut next) = (Vec::new(), 0.0, Some(first));
        met_by[mesh.from(first).index()] = line;
        while let Some(h) = next {
            let v = mesh.to(h);
            cost += weight(h);
            let is_dear = best.as_ref().map_or(cost > most, |(_, least)| cost >= *least);
            if left == 0 || is_dear || std::mem::replace(&mut met_by[v.index()], line) == line {
                break;
            }
            left -= 1;
            path.push(h);
            if is_end[v.index()] {
                best = Some((path, cost));
                break;
            }
            next = if mesh.is_boundary_vertex(v) { None } else { straight_on(mesh, mesh.twin(h), &is_open) };
        }
    }
    best.map(|(path, _)| path)
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
    use crate::charts::cut_to_disk;
    use crate::mesh::{VertexId, test_surfaces};
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
        // Cheap places wind around the tube, and to step aside costs little; one column is cheaper than the others.
        let weight = |h: HalfedgeId| {
            let middle = nalgebra::center(&mesh.position(mesh.from(h)), &mesh.position(mesh.to(h)));
            let steps = (middle.y.atan2(middle.x) - 0.7 * middle.z).cos();
            let column = if (middle.x - 1.0).abs() < 1e-9 { 0.4 } else { 0.0 };
            let is_step = mesh.position(mesh.from(h)).z == mesh.position(mesh.to(h)).z;
            mesh.edge_length(h) * (1.0 - 0.4 * steps - column) * if is_step { 0.05 } else { 1.0 }
        };
        let path = straight_cut(&mesh, 10.0, weight, |_| false).expect("a column");
        assert_eq!(path.len(), 6);
        assert!(path.iter().all(|&h| (mesh.position(mesh.from(h)).x - 1.0).abs() < 1e-9));
        let cost = |path: &[HalfedgeId]| path.iter().map(|&h| weight(h)).sum::<f64>();
        let shortest = cut_to_disk(&mesh, weight, |_| false);
        assert!(cost(&shortest) < cost(&path));
        assert_eq!(straight_cut(&mesh, cost(&shortest), weight, |_| false), None, "it costs too much");
        // Where that column must not be cut another one is; either side may say so.
        let is_there = |h: HalfedgeId| mesh.position(mesh.from(h)).x > 1.0 - 1e-9 && h < mesh.twin(h);
        let other = straight_cut(&mesh, 10.0, weight, is_there).expect("another");
        assert!(cost(&other) >= cost(&path) && !other.iter().any(|&h| is_there(h) || is_there(mesh.twin(h))));
    }

    /// A cone of a quarter of a turn: a square lattice of which one axis is glued to the other. Where cells would meet at the tip there is a fan, and
    /// one cell is left out.
    fn cone(n: u32, hole: [u32; 2]) -> (TriMesh, impl Fn(VertexId) -> [u32; 2]) {
        let place = |[x, y]: [u32; 2]| {
            let (x, y) = (f64::from(x), f64::from(y));
            let (sin, cos) = (4.0 * y.atan2(x)).sin_cos();
            let (radius, away) = (x.hypot(y), 0.25 * x.hypot(y));
            Point3::new(away * cos, away * sin, -(radius * radius - away * away).sqrt())
        };
        // The tip, and all places but those of the axis that is glued.
        let lattice: Vec<[u32; 2]> = (1..=n).flat_map(|x| (0..=n).map(move |y| [x, y])).chain([[0, 0]]).collect();
        let at = |[x, y]: [u32; 2]| {
            let glued = if x == 0 { [y, 0] } else { [x, y] };
            lattice.iter().position(|p| *p == glued).expect("a place") as u32
        };
        let is_kept = |p: &[u32; 2]| p[0].max(p[1]) > 1 && *p != hole;
        let cells = (0..n).flat_map(|x| (0..n).map(move |y| [x, y])).filter(is_kept);
        let corners = |[x, y]: [u32; 2]| [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]].map(at);
        let halves = cells.map(corners).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let around = [[2, 0], [2, 1], [2, 2], [1, 2], [0, 2]];
        let fan = around.windows(2).map(|side| [at([0, 0]), at(side[0]), at(side[1])]);
        let triangles: Vec<[u32; 3]> = halves.chain(fan).collect();
        let mesh = test_surfaces::mesh(&lattice.iter().map(|p| place(*p)).collect::<Vec<_>>(), &triangles);
        let positions = mesh.positions().to_vec();
        let name = move |v: VertexId| {
            let near = |p: &&[u32; 2]| (place(**p) - positions[v.index()]).norm() < 1e-9;
            *lattice.iter().find(near).expect("a place of the lattice")
        };
        (mesh, name)
    }

    /// A line that comes by the tip of a cone so slender crosses itself on its other side.
    #[test]
    fn a_line_meets_no_vertex_twice() {
        let length = |hole| {
            let (mesh, name) = cone(12, hole);
            // Only the line that comes along y = 6 is open, and where it goes on along x = 6 once it has crossed the glued axis.
            let is_on_line = |v: VertexId| {
                let [x, y] = name(v);
                y == 6 || x == 6 && y < 9
            };
            let is_closed = |h: HalfedgeId| {
                let ends = [mesh.from(h), mesh.to(h)];
                let [p, q] = ends.map(&name);
                let is_side = p[0] == q[0] || p[1] == q[1] || [p, q].contains(&[6, 0]);
                !ends.into_iter().all(is_on_line) || !is_side
            };
            straight_cut(&mesh, f64::INFINITY, |h| mesh.edge_length(h), is_closed).map(|path| path.len())
        };
        assert_eq!(length([6, 3]), Some(12 + 3), "to a hole before the crossing: along y = 6, then along x = 6");
        assert_eq!(length([6, 8]), None, "to a hole beyond it");
    }

    #[test]
    fn there_is_none_where_nothing_goes_straight_on_or_there_are_not_two_loops() {
        let length =
            |mesh: &TriMesh| straight_cut(mesh, 1e9, |h| mesh.edge_length(h), |_| false).map(|path| path.len());
        assert_eq!(length(&test_surfaces::grid(4, 4, [4.0, 4.0], 0.0)), None);
        assert_eq!(length(&test_surfaces::sphere(2)), None);
        let mesh = tube(8, 4);
        let rows = |h: HalfedgeId| mesh.position(mesh.from(h)).z != mesh.position(mesh.to(h)).z;
        assert_eq!(straight_cut(&mesh, 1e9, |h| mesh.edge_length(h), rows), None);
        assert_eq!(length(&mesh), Some(4));
    }
}
