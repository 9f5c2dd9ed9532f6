//! Exact tests that a chart's map is injective: positive triangles and simple boundary loops.

use nalgebra::Point2;

use super::grid::Grid;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::predicates::orientation;

/// The first face whose triangle is not strictly positive by an exact test, or has a coordinate that
/// is not finite; `None` if all are positive. O(n).
#[must_use]
pub(crate) fn first_flip(mesh: &TriMesh, uv: &[Point2<f64>]) -> Option<FaceId> {
    mesh.faces().find(|&f| {
        let [a, b, c] = mesh.triangle(f).map(|v| uv[v.index()]);
        let finite = [a, b, c].iter().all(|p| p.x.is_finite() && p.y.is_finite());
        !(finite && orientation(a, b, c) > 0.0)
    })
}

/// What keeps the boundary of a chart from being simple.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BoundaryDefect {
    /// Two boundary edges meet elsewhere than at a common vertex, or fold onto each other there.
    Crossing(HalfedgeId, HalfedgeId),
    /// Not exactly one loop runs counter-clockwise: a hole is turned inside out, or all loops are.
    Orientation,
    /// A coordinate of the boundary is not finite.
    NotFinite,
}

/// Whether every boundary loop is a simple polygon, no two touch, and exactly one runs
/// counter-clockwise. Exact.
///
/// Together with positive triangles ([`first_flip`]) this makes the map injective: the number of
/// triangles over a point off the boundary is the sum of the loops' winding numbers round it, which
/// is at most 1 from the one positive loop, and at most 0 from each other.
///
/// O(b) for b boundary edges of like length; long edges cost their length in grid cells.
#[must_use]
pub(crate) fn boundary_is_simple(mesh: &TriMesh, uv: &[Point2<f64>]) -> bool {
    boundary_defect(mesh, uv).is_none()
}

/// What [`boundary_is_simple`] finds first, in a fixed order, or `None`.
#[must_use]
pub(crate) fn boundary_defect(mesh: &TriMesh, uv: &[Point2<f64>]) -> Option<BoundaryDefect> {
    let mut first = None;
    let finite = visit_crossings(mesh, uv, |g, h| {
        first = Some(BoundaryDefect::Crossing(g, h));
        false
    });
    if !finite {
        return Some(BoundaryDefect::NotFinite);
    }
    first.or_else(|| {
        let loops = mesh.boundary_loops();
        let positive = loops.iter().filter(|l| is_counter_clockwise(mesh, uv, l)).count();
        (positive != 1).then_some(BoundaryDefect::Orientation)
    })
}

/// The boundary edges that meet others elsewhere than at a common vertex, ascending; all of them if a coordinate is not
/// finite.
pub(super) fn boundary_crossings(mesh: &TriMesh, uv: &[Point2<f64>]) -> Vec<HalfedgeId> {
    let mut found = Vec::new();
    let finite = visit_crossings(mesh, uv, |g, h| {
        found.extend([g, h]);
        true
    });
    if !finite {
        return mesh.halfedges().filter(|&h| mesh.is_boundary(h)).collect();
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Calls `visit` for pairs of boundary edges that meet, in a fixed order and some more than once, while it
/// answers true; false if a coordinate is not finite.
fn visit_crossings(mesh: &TriMesh, uv: &[Point2<f64>], mut visit: impl FnMut(HalfedgeId, HalfedgeId) -> bool) -> bool {
    let edges: Vec<HalfedgeId> = mesh.halfedges().filter(|&h| mesh.is_boundary(h)).collect();
    let ends = |h: HalfedgeId| [uv[mesh.from(h).index()], uv[mesh.to(h).index()]];
    let hull = |i: usize| ends(edges[i]);
    let Some(grid) = Grid::new(edges.len(), hull, |_| 0.0) else { return false };
    for cell in grid.cells() {
        for (k, &i) in cell.iter().enumerate() {
            for &j in &cell[..k] {
                let (g, h) = (edges[j as usize], edges[i as usize]);
                if edges_meet(mesh, uv, g, h) && !visit(g, h) {
                    return true;
                }
            }
        }
    }
    true
}

/// Whether two different boundary edges share a point that is not a shared vertex.
fn edges_meet(mesh: &TriMesh, uv: &[Point2<f64>], g: HalfedgeId, h: HalfedgeId) -> bool {
    let at = |v: crate::mesh::VertexId| uv[v.index()];
    let (a, b, c, d) = (mesh.from(g), mesh.to(g), mesh.from(h), mesh.to(h));
    if a == d && b == c {
        // A slit of two edges: they coincide.
        return true;
    }
    if b == c || a == d {
        let (before, shared, after) = if b == c { (a, b, d) } else { (c, d, b) };
        let (before, shared, after) = (at(before), at(shared), at(after));
        if before == shared || shared == after {
            return true;
        }
        // They overlap only if they leave the shared vertex in exactly the same direction.
        return orientation(before, shared, after) == 0.0 && same_side(before, shared, after);
    }
    segments_meet(at(a), at(b), at(c), at(d))
}

/// For points on one line, all different from `s`, whether `p` and `q` lie on the same side of it.
/// Comparisons only: exact.
fn same_side(p: Point2<f64>, s: Point2<f64>, q: Point2<f64>) -> bool {
    if p.x == s.x { (p.y < s.y) == (q.y < s.y) } else { (p.x < s.x) == (q.x < s.x) }
}

/// Whether closed segments ab and cd share a point. Exact.
fn segments_meet(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>, d: Point2<f64>) -> bool {
    let overlap = |a: f64, b: f64, c: f64, d: f64| a.min(b) <= c.max(d) && c.min(d) <= a.max(b);
    if !(overlap(a.x, b.x, c.x, d.x) && overlap(a.y, b.y, c.y, d.y)) {
        return false;
    }
    let (c1, d1) = (orientation(a, b, c), orientation(a, b, d));
    if (c1 > 0.0 && d1 > 0.0) || (c1 < 0.0 && d1 < 0.0) {
        return false;
    }
    let (a2, b2) = (orientation(c, d, a), orientation(c, d, b));
    // All zero: on one line, where overlapping boxes mean a common point.
    !((a2 > 0.0 && b2 > 0.0) || (a2 < 0.0 && b2 < 0.0))
}

/// Orientation of a simple polygon, exact: that of its lowest, leftmost corner.
fn is_counter_clockwise(mesh: &TriMesh, uv: &[Point2<f64>], edges: &[HalfedgeId]) -> bool {
    let at = |h: HalfedgeId| uv[mesh.from(h).index()];
    let n = edges.len();
    let lowest = (0..n).min_by(|&i, &j| {
        let (p, q) = (at(edges[i]), at(edges[j]));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
    });
    let Some(i) = lowest else { return false };
    orientation(at(edges[(i + n - 1) % n]), at(edges[i]), at(edges[(i + 1) % n])) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{annulus, grid, strip};
    use nalgebra::Point3;

    fn flat(mesh: &TriMesh) -> Vec<Point2<f64>> {
        mesh.positions().iter().map(|p| p.xy()).collect()
    }

    #[test]
    fn a_plane_grid_is_injective_and_its_mirror_is_not() {
        let mesh = grid(5, 4, |x, y| Point3::new(x, y, 0.0));
        let mut uv = flat(&mesh);
        assert_eq!(first_flip(&mesh, &uv), None);
        assert_eq!(boundary_defect(&mesh, &uv), None);
        uv.iter_mut().for_each(|p| p.x = -p.x);
        assert_eq!(first_flip(&mesh, &uv), Some(FaceId::new(0)));
        assert_eq!(boundary_defect(&mesh, &uv), Some(BoundaryDefect::Orientation));
        uv[0].x = f64::NAN;
        assert_eq!(boundary_defect(&mesh, &uv), Some(BoundaryDefect::NotFinite));
    }

    #[test]
    fn a_strip_wound_over_itself_crosses() {
        // A ring sector of 1.5 turns whose radius hardly grows: positive triangles, crossing boundary.
        let mesh = strip(120);
        let wind = |growth: f64| -> Vec<Point2<f64>> {
            mesh.positions()
                .iter()
                .map(|p| {
                    let (angle, radius) = (0.08 * p.x, 3.0 - p.y + growth * p.x);
                    Point2::new(radius * angle.cos(), radius * angle.sin())
                })
                .collect()
        };
        let uv = wind(0.0);
        assert_eq!(first_flip(&mesh, &uv), None);
        let Some(BoundaryDefect::Crossing(g, h)) = boundary_defect(&mesh, &uv) else {
            panic!("the overlap was not found");
        };
        assert!(edges_meet(&mesh, &uv, g, h));
        assert_eq!(boundary_defect(&mesh, &wind(0.02)), None);
    }

    #[test]
    fn a_hole_turned_inside_out_is_found() {
        let mesh = annulus(24, 3);
        let uv = flat(&mesh);
        assert_eq!(boundary_defect(&mesh, &uv), None);
        // Inversion in a circle swaps the loops, mirrored back: still injective.
        let inverted: Vec<_> = uv.iter().map(|p| Point2::new(p.x, -p.y) / p.coords.norm_squared()).collect();
        assert_eq!(first_flip(&mesh, &inverted), None);
        assert_eq!(boundary_defect(&mesh, &inverted), None);
        // The hole pushed out over the rim: simple loops, wrong orientations.
        let out: Vec<_> =
            uv.iter().map(|p| if p.coords.norm() < 1.01 { Point2::from(p.coords * 9.0) } else { *p }).collect();
        assert!(boundary_defect(&mesh, &out).is_none() && first_flip(&mesh, &out).is_some());
        let mirrored: Vec<_> =
            uv.iter().map(|p| if p.coords.norm() < 1.01 { Point2::new(-p.x, p.y) } else { *p }).collect();
        assert_eq!(boundary_defect(&mesh, &mirrored), Some(BoundaryDefect::Orientation));
    }

    #[test]
    fn touching_and_folded_edges_count_as_crossing() {
        let p = |x: f64, y: f64| Point2::new(x, y);
        assert!(segments_meet(p(0., 0.), p(2., 0.), p(1., 0.), p(1., 1.)));
        assert!(segments_meet(p(0., 0.), p(2., 0.), p(1., 0.), p(3., 0.)));
        assert!(segments_meet(p(0., 0.), p(2., 2.), p(2., 0.), p(0., 2.)));
        assert!(!segments_meet(p(0., 0.), p(1., 0.), p(2., 0.), p(3., 0.)));
        assert!(!segments_meet(p(0., 0.), p(1., 0.), p(0., 1e-300), p(1., 1e-300)));
        assert!(same_side(p(1., 0.), p(0., 0.), p(2., 0.)) && !same_side(p(1., 0.), p(0., 0.), p(-1., 0.)));
        // One triangle folded flat.
        let (mesh, _) = TriMesh::from_triangles(
            &[Point3::origin(), Point3::new(1., 0., 0.), Point3::new(0., 1., 0.)],
            &[[0, 1, 2]],
        );
        assert!(boundary_is_simple(&mesh, &[p(0., 0.), p(1., 0.), p(0.5, 1e-12)]));
        assert!(!boundary_is_simple(&mesh, &[p(0., 0.), p(1., 0.), p(0.5, 0.0)]));
    }
}
