//! Tutte's embedding: the boundary on a convex polygon, every other vertex in a weighted mean of its
//! neighbours. Injective for any positive weights (in exact arithmetic).
//!
//! Tutte: How to draw a graph, 1963. Floater: One-to-one piecewise linear mappings over triangulations,
//! Math. Comp. 2003: a strictly convex boundary suffices, whatever edges join boundary vertices.

use nalgebra::Point2;

use super::StretchError;
use super::convex_outline::{circle, convex_outline};
use super::doubled_edge::doubled_edge;
use super::measure::surface_area;
use super::overlap::first_flip;
use crate::distortion::{RestTriangle, squared_stretch};
use crate::linalg::{SparseCholesky, SparsePattern};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;

/// Where the outer boundary loop, the longest, goes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TutteBoundary<'a> {
    /// On a circle with the area of the surface, spaced by length.
    Circle,
    /// On a strictly convex polygon after the outer loop of this map (a point a vertex).
    Shape(&'a [Point2<f64>]),
}

/// Cotangent weights are kept within these bounds, so that they are positive (which Tutte's theorem
/// needs) and the system well conditioned.
const WEIGHTS: (f64, f64) = (0.05, 20.0);
/// Rounds that shift weight from stretched places to others. Each costs a tenth of a Newton step
/// and the first ones win more.
const SPREADING_ROUNDS: usize = 4;
/// Most by which a round changes a weight.
const SPREADING_LIMIT: f64 = 1e3;

/// A map with positive triangles, a convex outer boundary, and no overlaps where rounding did no harm;
/// `None` where rounding flipped a triangle whatever the weights, or where the outer loop of the shape
/// to follow is too far from simple.
///
/// Holes are filled with one vertex each, joined to the whole loop, so that their loops stay simple. The
/// weights are clamped cotangents; then, while it helps, weights fall where the map is stretched, after
/// Yoshizawa, Belyaev, Seidel: A fast and simple stretch-minimizing mesh parameterization, SMI 2004 (here
/// symmetric); failing that, uniform.
///
/// # Errors
/// [`StretchError::DoubledEdge`] where two edges join the same two vertices, which no map with straight
/// edges can tell apart; [`StretchError::Solver`]; [`StretchError::Cancelled`].
pub(crate) fn tutte_embedding(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    boundary: TutteBoundary,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    Ok(tutte_attempt(mesh, rest, boundary, progress)?.filter(|uv| first_flip(mesh, uv).is_none()))
}

/// As [`tutte_embedding`], but a map that rounding has flipped is returned as well.
pub(super) fn tutte_attempt(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    boundary: TutteBoundary,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    if let Some([h, _]) = doubled_edge(mesh) {
        let (a, b) = (mesh.from(h), mesh.to(h));
        return Err(StretchError::DoubledEdge { a, b });
    }
    let Some(mut system) = TutteSystem::new(mesh, rest, boundary)? else { return Ok(None) };
    progress.check()?;
    let mut best = system.solve()?;
    if first_flip(mesh, &best).is_some() {
        progress.check()?;
        system.weights.fill(1.0);
        let uniform = system.solve()?;
        if first_flip(mesh, &uniform).is_none() {
            best = uniform;
        }
        return Ok(Some(best));
    }
    let mut stretch = total_stretch(mesh, rest, &best);
    for _ in 0..SPREADING_ROUNDS {
        progress.check()?;
        system.spread(mesh, rest, &best);
        let next = system.solve()?;
        let after = total_stretch(mesh, rest, &next);
        let better = after < stretch && first_flip(mesh, &next).is_none();
        if !better {
            break;
        }
        (best, stretch) = (next, after);
    }
    Ok(Some(best))
}

/// ΣE; the area is the same for every map with the same outline.
fn total_stretch(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> f64 {
    let face =
        |(t, r): (&[VertexId; 3], &RestTriangle)| r.area() * squared_stretch(&r.jacobian(t.map(|v| uv[v.index()])));
    mesh.triangles().iter().zip(rest).map(face).sum()
}

/// The linear system: vertices of the mesh, then one for each hole.
struct TutteSystem {
    /// Ends of each edge, spokes of the holes included, and its weight.
    edges: Vec<[u32; 2]>,
    weights: Vec<f64>,
    /// The number of each free vertex among the unknowns; of the others, u32::MAX.
    unknown: Vec<u32>,
    /// Positions of the fixed vertices; of the others, whatever.
    positions: Vec<Point2<f64>>,
    vertex_count: usize,
    solver: SparseCholesky,
    values: Vec<f64>,
}

impl TutteSystem {
    fn new(mesh: &TriMesh, rest: &[RestTriangle], boundary: TutteBoundary) -> Result<Option<Self>, StretchError> {
        let length = |h: HalfedgeId| {
            let c = rest[h.face().index()].corners();
            (c[(h.slot() + 1) % 3] - c[h.slot()]).norm()
        };
        let loops = mesh.boundary_loops();
        let perimeter = |l: usize| -> f64 { loops.group(l).iter().map(|&h| length(h)).sum() };
        // The longest, the first among equals.
        let longest = (0..loops.len()).rev().max_by(|&i, &j| perimeter(i).total_cmp(&perimeter(j)));
        let Some(outer) = longest else { return Err(StretchError::NoBoundary) };

        let rim = loops.group(outer);
        let lengths: Vec<f64> = rim.iter().map(|&h| length(h)).collect();
        let outline = match boundary {
            TutteBoundary::Circle => circle(&lengths, (surface_area(rest) / std::f64::consts::PI).sqrt()),
            TutteBoundary::Shape(uv) => {
                let curve: Vec<_> = rim.iter().map(|&h| uv[mesh.from(h).index()]).collect();
                match convex_outline(&curve, &lengths) {
                    Some(outline) => outline,
                    None => return Ok(None),
                }
            }
        };

        let vertex_count = mesh.vertex_count();
        let total = vertex_count + loops.len() - 1;
        let mut positions = vec![Point2::origin(); total];
        let mut unknown = vec![0; total];
        for (&h, p) in rim.iter().zip(outline) {
            positions[mesh.from(h).index()] = p;
            unknown[mesh.from(h).index()] = u32::MAX;
        }
        let mut unknowns = 0;
        for u in unknown.iter_mut().filter(|u| **u == 0) {
            *u = unknowns;
            unknowns += 1;
        }

        let mut edges = Vec::new();
        let mut weights = Vec::new();
        let cotangent = |h: HalfedgeId| rest[h.face().index()].cotangents()[h.slot()];
        for h in mesh.edges() {
            let twin = (!mesh.is_boundary(h)).then(|| cotangent(mesh.twin(h)));
            edges.push([mesh.from(h), mesh.to(h)].map(|v| v.index() as u32));
            weights.push((0.5 * (cotangent(h) + twin.unwrap_or(0.0))).clamp(WEIGHTS.0, WEIGHTS.1));
        }
        for (hole, l) in (0..loops.len()).filter(|&l| l != outer).enumerate() {
            for &h in loops.group(l) {
                edges.push([mesh.from(h).index() as u32, (vertex_count + hole) as u32]);
                weights.push(1.0);
            }
        }
        let free = |[a, b]: &[u32; 2]| (unknown[*a as usize], unknown[*b as usize]);
        let pairs = edges.iter().map(free).filter(|&(a, b)| a != u32::MAX && b != u32::MAX);
        let solver = SparseCholesky::analyse(SparsePattern::from_pairs(unknowns as usize, pairs))?;
        let values = vec![0.0; solver.pattern().entry_count()];
        Ok(Some(Self { edges, weights, unknown, positions, vertex_count, solver, values }))
    }

    /// Positions of the mesh's vertices for the present weights.
    fn solve(&mut self) -> Result<Vec<Point2<f64>>, StretchError> {
        let n = self.solver.pattern().size();
        self.values.fill(0.0);
        let mut rhs = vec![0.0; 2 * n];
        for (&[a, b], &w) in self.edges.iter().zip(&self.weights) {
            for (from, to) in [(a, b), (b, a)] {
                let i = self.unknown[from as usize];
                if i == u32::MAX {
                    continue;
                }
                let (i, j) = (i as usize, self.unknown[to as usize]);
                if let Some(at) = self.solver.pattern().position(i, i) {
                    self.values[at] += w;
                }
                if j == u32::MAX {
                    rhs[i] += w * self.positions[to as usize].x;
                    rhs[n + i] += w * self.positions[to as usize].y;
                } else if from < to
                    && let Some(at) = self.solver.pattern().position(i, j as usize)
                {
                    self.values[at] -= w;
                }
            }
        }
        self.solver.refactor(&self.values)?;
        self.solver.solve_in_place(&mut rhs);
        for (p, &i) in self.positions.iter_mut().zip(&self.unknown) {
            if i != u32::MAX {
                *p = Point2::new(rhs[i as usize], rhs[n + i as usize]);
            }
        }
        Ok(self.positions[..self.vertex_count].to_vec())
    }

    /// Divides each weight by the stretch at its ends (geometric mean), so that the next solution
    /// gives more room to places that have too little.
    fn spread(&mut self, mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) {
        let mut energy = vec![0.0; self.positions.len()];
        let mut area = vec![0.0; self.positions.len()];
        let (mut all_energy, mut all_area) = (0.0, 0.0);
        for (t, r) in mesh.triangles().iter().zip(rest) {
            let a = r.area();
            let e = a * squared_stretch(&r.jacobian(t.map(|v| uv[v.index()])));
            for v in t {
                energy[v.index()] += e;
                area[v.index()] += a;
            }
            (all_energy, all_area) = (all_energy + e, all_area + a);
        }
        let mean = all_energy / all_area;
        let stretch = |v: u32| {
            let squared = energy[v as usize] / (area[v as usize] * mean);
            if squared > 0.0 { squared.sqrt().clamp(1.0 / SPREADING_LIMIT, SPREADING_LIMIT) } else { 1.0 }
        };
        for (&[a, b], w) in self.edges.iter().zip(&mut self.weights) {
            *w /= (stretch(a) * stretch(b)).sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::overlap::boundary_is_simple;
    use crate::stretch::test_meshes::{annulus, grid, hemisphere};
    use nalgebra::Point3;

    fn build(positions: &[Point3<f64>], triangles: &[[u32; 3]]) -> TriMesh {
        TriMesh::from_triangles(positions, triangles).0
    }

    fn embed(mesh: &TriMesh) -> Vec<Point2<f64>> {
        let rest = RestTriangle::of_mesh(mesh);
        let uv = tutte_embedding(mesh, &rest, TutteBoundary::Circle, &Progress::new());
        let uv = uv.expect("no doubled edge").expect("positive");
        assert_eq!(first_flip(mesh, &uv), None);
        assert!(boundary_is_simple(mesh, &uv));
        let shape = tutte_embedding(mesh, &rest, TutteBoundary::Shape(&uv), &Progress::new());
        let shape = shape.expect("no doubled edge").expect("positive");
        assert_eq!(first_flip(mesh, &shape), None);
        uv
    }

    #[test]
    fn discs_and_rings() {
        embed(&hemisphere(12));
        embed(&annulus(30, 4));
        embed(&annulus(3, 1));
        embed(&grid(1, 1, |x, y| Point3::new(x, y, x * y)));
    }

    #[test]
    fn awkward_meshes() {
        // A single triangle, degenerate too.
        let corner = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        embed(&build(&corner, &[[0, 1, 2]]));
        embed(&build(&[Point3::origin(); 3], &[[0, 1, 2]]));
        // A closed fan of 500 round one vertex, and an open one.
        let mut positions = vec![Point3::new(0.0, 0.0, 1.0)];
        positions.extend((0..500).map(|i| {
            let a = std::f64::consts::TAU * f64::from(i) / 500.0;
            Point3::new(a.cos(), a.sin(), if i % 7 == 0 { 0.3 } else { 0.0 })
        }));
        let fan: Vec<[u32; 3]> = (0..500).map(|i| [0, 1 + i, 1 + (i + 1) % 500]).collect();
        embed(&build(&positions, &fan));
        embed(&build(&positions, &fan[..499]));
        // A strip: every vertex on the boundary, two ears of valence two.
        embed(&grid(200, 1, |x, y| Point3::new(x, y, (0.1 * x).sin())));
        // Needle triangles.
        embed(&grid(20, 20, |x, y| Point3::new(1e-5 * x, y, 0.0)));
    }

    #[test]
    fn a_doubled_edge_is_named() {
        // Two faces glued along two edges, like a bag: the two sides of its mouth join the same vertices.
        let none = HalfedgeId::NONE;
        let twin = vec![none, HalfedgeId::new(5), HalfedgeId::new(4), none, HalfedgeId::new(2), HalfedgeId::new(1)];
        let place = |s: u32| Point3::new(f64::from(s), f64::from(s * s), 0.0);
        let (mesh, _) = TriMesh::from_glued(&[0, 1, 2, 1, 0, 2], twin, place);
        assert!(doubled_edge(&mesh).is_some());
        let rest = RestTriangle::of_mesh(&mesh);
        let result = tutte_embedding(&mesh, &rest, TutteBoundary::Circle, &Progress::new());
        assert!(matches!(result, Err(StretchError::DoubledEdge { .. })));
    }

    #[test]
    fn spreading_lowers_the_stretch_of_a_deep_cup() {
        let mesh =
            grid(24, 24, |x, y| Point3::new(x, y, 60.0 * (-((x - 12.0).powi(2) + (y - 12.0).powi(2)) / 40.0).exp()));
        let rest = RestTriangle::of_mesh(&mesh);
        let mut system = TutteSystem::new(&mesh, &rest, TutteBoundary::Circle).expect("solver").expect("circle");
        let plain = total_stretch(&mesh, &rest, &system.solve().expect("solver"));
        let spread = total_stretch(&mesh, &rest, &embed(&mesh));
        assert!(spread < 0.7 * plain, "{spread} {plain}");
    }
}
