//! Keeps a chart's boundary from running into itself: a barrier energy and a first-contact step limit.
//!
//! Smith, Schaefer: Bijective parameterization with free boundaries, ACM TOG 2015, section 4.

use nalgebra::{Matrix2, Point2, Vector2};

use super::grid::Grid;
use super::moving_boundary::MovingBoundary;
use super::system::ChartSystem;
use crate::distortion::RestTriangle;
use crate::mesh::{HalfedgeId, TriMesh};

/// The barrier usually begins at this share of the boundary edges' lengths: small enough that the boundary of
/// an undistorted chart does not feel itself round an ordinary corner.
pub(crate) const BOUNDARY_REACH: f64 = 0.25;
/// Halvings after which a step is given up: 2⁻³⁰ of it moves nothing.
const MAX_HALVINGS: usize = 30;
/// A contact counts if it is this near the edge, relative to its length: rounding must not let a
/// vertex slip past the end of an edge.
const CONTACT_SLACK: f64 = 1e-6;
/// What boxes round edges are widened by for that to be found, relative to their two sides together, which no edge in them
/// is longer than.
const ROOM: f64 = 2.0 * CONTACT_SLACK;

/// Σ w·max(0, δ/d − 1)² over boundary vertices and boundary edges they are no end of, d their distance.
///
/// δ is the reach (a quarter) of the shortest of the three edges involved, so tiny edges beside long ones are not
/// pushed at; w = 4δ²/A, about the share of the surface that lies within reach.
pub(super) struct Barrier {
    /// The boundary edges; vertex number `i` of the boundary is the start of edge `i`.
    edges: Vec<HalfedgeId>,
    /// The numbers of the edges in the order in which the boundary runs.
    order: Vec<u32>,
    from: Vec<u32>,
    to: Vec<u32>,
    vertex_reach: Vec<f64>,
    edge_reach: Vec<f64>,
    area: f64,
}

/// Whether the boundary comes nearer to itself somewhere than [`BOUNDARY_REACH`], or touches itself. O(b log b) for b
/// boundary edges of like length.
#[must_use]
pub(crate) fn boundary_is_tight(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> bool {
    Barrier::new(mesh, rest, BOUNDARY_REACH).value(uv) > 0.0
}

/// A boundary vertex near a boundary edge.
struct Contact {
    vertex: usize,
    edge: usize,
    delta: f64,
    distance: f64,
    /// Where on the edge the nearest point is, 0 at its start and 1 at its end.
    t: f64,
    /// Unit vector from that point to the vertex.
    normal: Vector2<f64>,
}

impl Barrier {
    pub(super) fn new(mesh: &TriMesh, rest: &[RestTriangle], reach: f64) -> Self {
        let edges: Vec<HalfedgeId> = mesh.halfedges().filter(|&h| mesh.is_boundary(h)).collect();
        let length = |h: HalfedgeId| {
            let c = rest[h.face().index()].corners();
            (c[(h.slot() + 1) % 3] - c[h.slot()]).norm()
        };
        let mut vertex_reach = vec![f64::INFINITY; mesh.vertex_count()];
        for &h in &edges {
            for v in [mesh.from(h), mesh.to(h)] {
                vertex_reach[v.index()] = vertex_reach[v.index()].min(reach * length(h));
            }
        }
        let edge_reach: Vec<f64> = edges.iter().map(|&h| reach * length(h)).collect();
        let number = |h: &HalfedgeId| edges.binary_search(h).ok().map(|i| i as u32);
        Self {
            order: mesh.boundary_loops().iter().flatten().filter_map(number).collect(),
            from: edges.iter().map(|&h| mesh.from(h).index() as u32).collect(),
            to: edges.iter().map(|&h| mesh.to(h).index() as u32).collect(),
            vertex_reach: edges.iter().map(|&h| vertex_reach[mesh.from(h).index()]).collect(),
            edge_reach,
            edges,
            area: rest.iter().map(RestTriangle::area).sum(),
        }
    }

    fn is_end(&self, vertex: usize, edge: usize) -> bool {
        let v = self.from[vertex];
        v == self.from[edge] || v == self.to[edge]
    }

    /// Calls `visit` for every vertex and edge within their reach, in a fixed order; `false` if `uv` is
    /// not finite.
    fn for_contacts(&self, uv: &[Point2<f64>], mut visit: impl FnMut(&Contact)) -> bool {
        let hull = |i: usize| [uv[self.from[i] as usize], uv[self.to[i] as usize]];
        let Some(grid) = Grid::new(self.edges.len(), hull, |i| self.edge_reach[i]) else {
            return false;
        };
        let mut near = Vec::new();
        for vertex in 0..self.edges.len() {
            let p = uv[self.from[vertex] as usize];
            near.clear();
            grid.near(&[p], |edge| near.push(edge));
            near.sort_unstable();
            near.dedup();
            for edge in near.iter().map(|&e| e as usize) {
                if self.is_end(vertex, edge) {
                    continue;
                }
                let delta = self.vertex_reach[vertex].min(self.edge_reach[edge]);
                let (a, b) = (uv[self.from[edge] as usize], uv[self.to[edge] as usize]);
                let along = b - a;
                let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                let apart = p - (a + along * t);
                let distance = apart.norm();
                if distance < delta {
                    visit(&Contact { vertex, edge, delta, distance, t, normal: apart / distance });
                }
            }
        }
        true
    }

    /// Value of the barrier; infinite where a vertex lies on an edge.
    pub(super) fn value(&self, uv: &[Point2<f64>]) -> f64 {
        let mut sum = 0.0;
        let finite = self.for_contacts(uv, |c| {
            let over = c.delta / c.distance - 1.0;
            sum += 4.0 * c.delta * c.delta / self.area * over * over;
        });
        if finite { sum } else { f64::INFINITY }
    }

    /// Adds gradient and a positive semidefinite Hessian to an assembled system.
    ///
    /// The Hessian is b''·∇d∇dᵀ (the rest, b'·∇²d, is not positive). Its blocks between the vertex and
    /// the edge are not in the mesh's pattern; since (x + y)² ≤ 2x² + 2y², twice the vertex's block and
    /// twice the edge's bound it from above, and those are. So the symbolic factor stays valid, at the
    /// price of shorter steps where boundaries press on each other.
    pub(super) fn assemble(&self, uv: &[Point2<f64>], system: &mut ChartSystem) {
        self.for_contacts(uv, |c| {
            let weight = 4.0 * c.delta * c.delta / self.area;
            let (ratio, d) = (c.delta / c.distance, c.distance);
            let slope = -2.0 * weight * (ratio - 1.0) * ratio / d;
            let curve = 2.0 * weight * ratio * (3.0 * ratio - 2.0) / (d * d);
            let (p, h) = (self.from[c.vertex], self.edges[c.edge]);
            let (s, t) = (1.0 - c.t, c.t);
            system.add_gradient(p, c.normal * slope);
            system.add_gradient(self.from[c.edge], c.normal * (-slope * s));
            system.add_gradient(self.to[c.edge], c.normal * (-slope * t));
            let m: Matrix2<f64> = c.normal * c.normal.transpose() * (2.0 * curve);
            system.add_diagonal(p, &m);
            system.add_diagonal(self.from[c.edge], &(m * (s * s)));
            system.add_diagonal(self.to[c.edge], &(m * (t * t)));
            system.add_edge_block(h, &(m * (s * t)));
        });
    }

    /// The greatest step up to `most` along `direction` before which no boundary vertex touches a
    /// boundary edge, up to rounding; may be less than that if the boundary is thrown about. O(b log b) where neighbours move
    /// alike.
    pub(super) fn first_contact(&self, uv: &[Point2<f64>], direction: &[f64], most: f64) -> f64 {
        let moving = |v: u32| (uv[v as usize], Vector2::new(direction[2 * v as usize], direction[2 * v as usize + 1]));
        let ends = |edge: usize| [moving(self.from[edge]), moving(self.to[edge])];
        let Some(boundary) = MovingBoundary::new(&self.order, ends, most) else { return 0.0 };
        let mut most = most;
        for _ in 0..MAX_HALVINGS {
            let (mut least, mut visits) = (most, 0);
            for vertex in 0..self.edges.len() {
                let own = moving(self.from[vertex]);
                least = boundary.near(own, least, ROOM, &mut visits, |edge, least| {
                    if self.is_end(vertex, edge) {
                        least
                    } else {
                        self.contact_time(uv, direction, vertex, edge, least)
                    }
                });
                if visits > boundary.most_visits() {
                    break;
                }
            }
            if visits <= boundary.most_visits() {
                return least;
            }
            most *= 0.5;
        }
        0.0
    }

    /// When the moving vertex first lies on the moving edge, if before `most`; otherwise `most`.
    fn contact_time(&self, uv: &[Point2<f64>], direction: &[f64], vertex: usize, edge: usize, most: f64) -> f64 {
        let velocity = |v: u32| Vector2::new(direction[2 * v as usize], direction[2 * v as usize + 1]);
        let (p, a, b) = (self.from[vertex], self.from[edge], self.to[edge]);
        let at = |v: u32| uv[v as usize];
        let (e, f) = (at(a) - at(p), at(b) - at(p));
        let (de, df) = (velocity(a) - velocity(p), velocity(b) - velocity(p));
        let mut first = most;
        for t in quadratic_roots(de.perp(&df), e.perp(&df) + de.perp(&f), e.perp(&f)) {
            if t >= 0.0 && t < first {
                let (x, y) = (e + de * t, f + df * t);
                let along = y - x;
                let s = -x.dot(&along) / along.norm_squared();
                // An edge that has shrunk to a point (s is NaN) is a contact as well.
                if s.is_nan() || (-CONTACT_SLACK..=1.0 + CONTACT_SLACK).contains(&s) {
                    first = t;
                }
            }
        }
        first
    }
}

/// Real roots of a t² + b t + c, without cancellation; not finite where there are none.
fn quadratic_roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [f64::INFINITY; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [q / a, c / q]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::other_halves::OtherHalves;
    use crate::stretch::test_meshes::strip;

    /// A strip bent to a horseshoe whose ends nearly touch.
    fn horseshoe(gap: f64) -> (TriMesh, Vec<Point2<f64>>) {
        let mesh = strip(40);
        let uv = mesh
            .positions()
            .iter()
            .map(|p| {
                let angle = (std::f64::consts::TAU - gap) * p.x / 40.0;
                Point2::new((7.0 - p.y) * angle.cos(), (7.0 - p.y) * angle.sin())
            })
            .collect();
        (mesh, uv)
    }

    #[test]
    fn gradient_matches_finite_differences() {
        let (mesh, uv) = horseshoe(0.02);
        let rest = RestTriangle::of_mesh(&mesh);
        let barrier = Barrier::new(&mesh, &rest, BOUNDARY_REACH);
        assert!(barrier.value(&uv) > 0.0);
        assert_eq!(barrier.value(&horseshoe(0.5).1), 0.0);
        let mut system = ChartSystem::new(&mesh, &rest, &OtherHalves::default()).expect("analysis");
        barrier.assemble(&uv, &mut system);
        let g = system.gradient().to_vec();
        let h = 1e-7;
        for k in 0..g.len() {
            let shifted = |s: f64| {
                let mut moved = uv.clone();
                moved[k / 2][k % 2] += s;
                barrier.value(&moved)
            };
            let df = (shifted(h) - shifted(-h)) / (2.0 * h);
            assert!((df - g[k]).abs() < 1e-4 * (1.0 + g[k].abs()), "{k}: {df} {}", g[k]);
        }
    }

    #[test]
    fn first_contact_is_when_the_ends_meet() {
        let (mesh, uv) = horseshoe(0.3);
        let barrier = Barrier::new(&mesh, &RestTriangle::of_mesh(&mesh), BOUNDARY_REACH);
        // The end column moves straight at the fixed first column, which lies on y = 0 between x = 6
        // and 7: the first to touch is the vertex (6, 0).
        let last: Vec<usize> = mesh.vertices().map(|v| v.index()).filter(|&v| mesh.positions()[v].x > 39.5).collect();
        let mut direction = vec![0.0; 2 * uv.len()];
        for &v in &last {
            direction[2 * v + 1] = 1.0;
        }
        let [p, q] = [uv[last[0]], uv[last[1]]];
        let distance = -(p.y + (q.y - p.y) * (6.0 - p.x) / (q.x - p.x));
        let limit = barrier.first_contact(&uv, &direction, 10.0);
        assert!((limit - distance).abs() < 1e-9, "{limit} {distance}");
        assert_eq!(barrier.first_contact(&uv, &direction, 0.5 * distance), 0.5 * distance);
        direction.iter_mut().for_each(|d| *d = -*d);
        assert!(barrier.first_contact(&uv, &direction, 0.5) >= 0.5);
    }

    #[test]
    fn roots_of_quadratics() {
        let sorted = |a, b, c| {
            let mut r = quadratic_roots(a, b, c);
            r.sort_by(f64::total_cmp);
            r
        };
        assert_eq!(sorted(1.0, -3.0, 2.0), [1.0, 2.0]);
        assert_eq!(sorted(0.0, -2.0, 4.0)[0], 2.0);
        assert!(sorted(1.0, 0.0, 1.0)[0].is_infinite());
    }
}
