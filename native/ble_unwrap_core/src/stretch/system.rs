//! The sum of an energy over the triangles of a chart: value, gradient, and Newton's linear system.

use std::borrow::Cow;

use nalgebra::{Matrix2, Point2, Vector2};

use super::energy::{HatGradients, IsotropicEnergy, face_derivatives};
use super::other_halves::OtherHalves;
use crate::distortion::{RestTriangle, squared_stretch_of};
use crate::linalg::{RoughCholesky, SparseError, SparsePattern};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// Relative weight added to each diagonal entry of the Hessian, which is singular for translations
/// and rotations. Far below any mode that matters, far above rounding (1e-16 times the row count).
const RIDGE: f64 = 1e-9;
/// Each time a pivot fails the ridge grows by this factor ...
const RIDGE_GROWTH: f64 = 100.0;
/// ... at most so often, up to a thousandfold diagonal: plain gradient descent.
const RIDGE_ATTEMPTS: usize = 7;

/// Factor on the diagonal of a pinned vertex: stiff against its neighbours, yet too little to enlarge the ridge, which
/// is measured by the mean, to anything that counts.
const PIN_STIFFNESS: f64 = 1e4;

/// A chart's triangles with what an energy needs of each: hat gradients, and area weights, which sum to one. Behind the faces
/// of the mesh come the halves that some of its quads have by their other diagonal, if any are asked for.
pub(super) struct ChartFaces<'a> {
    triangles: Cow<'a, [[VertexId; 3]]>,
    hats: Vec<HatGradients>,
    weights: Vec<f64>,
}

/// A chart's triangles with everything that does not change between Newton steps: the place of every block in the sparse
/// matrix, the analysed factor.
pub(super) struct ChartSystem<'a> {
    pub(super) faces: ChartFaces<'a>,
    /// For each half-edge, where the block of its two ends begins.
    across: Vec<[u32; 3]>,
    /// What was assembled on the diagonal before the ridge.
    base_diagonal: Vec<f64>,
    solver: RoughCholesky,
    hessian: Vec<f64>,
    gradient: Vec<f64>,
}

/// Sums over a chart with areas as weights, ΣA₃ = 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct StretchSums {
    /// Σ A₃ e, e the squared stretch of a face.
    pub(super) stretch: f64,
    /// Σ A₂.
    pub(super) area: f64,
}

impl StretchSums {
    /// L2 stretch at the chart's own best scale.
    pub(super) fn l2(self) -> f64 {
        (self.stretch * self.area).sqrt()
    }
}

impl<'a> ChartFaces<'a> {
    fn new(mesh: &'a TriMesh, rest: &[RestTriangle], halves: &OtherHalves) -> Self {
        let all = || rest.iter().chain(halves.rest());
        let mut weights: Vec<f64> = all().map(RestTriangle::area).collect();
        weights[rest.len()..].iter_mut().for_each(|w| *w *= halves.weight());
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= total);
        let triangles = if halves.is_empty() {
            Cow::Borrowed(mesh.triangles())
        } else {
            Cow::Owned([mesh.triangles(), halves.triangles()].concat())
        };
        Self { triangles, hats: all().map(HatGradients::new).collect(), weights }
    }

    #[inline]
    fn jacobian(&self, face: usize, uv: &[Point2<f64>]) -> Matrix2<f64> {
        let [p, q, r] = self.triangles[face].map(|v| uv[v.index()]);
        self.hats[face].jacobian(q - p, r - p)
    }

    /// Sum of the energy, with areas as weights.
    pub(super) fn value<E: IsotropicEnergy>(&self, energy: &E, uv: &[Point2<f64>]) -> f64 {
        let mut sum = 0.0;
        for face in 0..self.triangles.len() {
            let j = self.jacobian(face, uv);
            sum += self.weights[face] * energy.value(j.norm_squared(), j.determinant());
        }
        sum
    }

    /// The sums that make up the L2 stretch; faces of no area make them infinite.
    pub(super) fn stretch_sums(&self, uv: &[Point2<f64>]) -> StretchSums {
        let mut sums = StretchSums { stretch: 0.0, area: 0.0 };
        for face in 0..self.triangles.len() {
            let j = self.jacobian(face, uv);
            let d = j.determinant();
            sums.stretch += self.weights[face] * squared_stretch_of(j.norm_squared(), d);
            sums.area += self.weights[face] * d;
        }
        sums
    }

    /// Least determinant of a Jacobian.
    pub(super) fn least_determinant(&self, uv: &[Point2<f64>]) -> f64 {
        (0..self.triangles.len()).map(|f| self.jacobian(f, uv).determinant()).fold(f64::INFINITY, f64::min)
    }

    /// The greatest step along `direction` at which no triangle has collapsed yet; infinite if none
    /// ever does. `uv` must have positive triangles.
    pub(super) fn first_flip(&self, uv: &[Point2<f64>], direction: &[f64]) -> f64 {
        let mut least = f64::INFINITY;
        for t in self.triangles.iter() {
            let [p, q, r] = t.map(|v| uv[v.index()]);
            let along = |v: VertexId| Vector2::new(direction[2 * v.index()], direction[2 * v.index() + 1]);
            let [dp, dq, dr] = t.map(along);
            let (e, f, de, df) = (q - p, r - p, dq - dp, dr - dp);
            let (c, b, a) = (e.perp(&f), e.perp(&df) + de.perp(&f), de.perp(&df));
            // Smallest positive root of a t² + b t + c, c > 0, in the form that does not cancel.
            let discriminant = b * b - 4.0 * a * c;
            if discriminant >= 0.0 {
                let denominator = discriminant.sqrt() - b;
                if denominator > 0.0 {
                    least = least.min(2.0 * c / denominator);
                }
            }
        }
        least
    }
}

impl<'a> ChartSystem<'a> {
    /// Analyses the Hessian's pattern. O(n log n), a third of a factorisation. The energy is summed over the other halves of
    /// quads as well.
    pub(super) fn new(mesh: &'a TriMesh, rest: &[RestTriangle], halves: &OtherHalves) -> Result<Self, SparseError> {
        let faces = ChartFaces::new(mesh, rest, halves);
        let pair = |ends: [VertexId; 2]| ends.map(|v| v.index() as u32).into();
        let edges = mesh.edges().map(|h| [mesh.from(h), mesh.to(h)]).chain(halves.diagonals()).map(pair);
        let solver = RoughCholesky::analyse(SparsePattern::from_pairs(mesh.vertex_count(), edges))?;
        let pattern = solver.pattern();
        let place = |v: VertexId, w: VertexId| {
            let (v, w) = (v.index(), w.index());
            pattern.position(2 * v.min(w), 2 * v.max(w)).map_or(u32::MAX, |p| p as u32)
        };
        let across = faces.triangles.iter().map(|&[a, b, c]| [place(a, b), place(b, c), place(c, a)]).collect();
        Ok(Self {
            faces,
            across,
            base_diagonal: vec![0.0; pattern.size()],
            hessian: vec![0.0; pattern.entry_count()],
            gradient: vec![0.0; pattern.size()],
            solver,
        })
    }

    /// Where the diagonal block of a vertex begins, and how far its second column lies behind its first.
    #[inline]
    fn block(&self, vertex: usize) -> (usize, usize) {
        let pattern = self.solver.pattern();
        (pattern.diagonal(2 * vertex), pattern.column(2 * vertex).len())
    }

    /// Gradient and projected Hessian of the energy at `uv`. O(faces).
    pub(super) fn assemble<E: IsotropicEnergy>(&mut self, energy: &E, uv: &[Point2<f64>]) {
        self.hessian.fill(0.0);
        self.gradient.fill(0.0);
        for face in 0..self.faces.triangles.len() {
            let d = face_derivatives(energy, &self.faces.hats[face], &self.faces.jacobian(face, uv));
            let (t, w) = (self.faces.triangles[face], self.faces.weights[face]);
            for k in 0..3 {
                self.add_gradient(t[k].index() as u32, d.gradient[k] * w);
                self.add_diagonal(t[k].index() as u32, &(d.diagonal[k] * w));
                self.add_across(face, k, &(d.across[k] * w));
            }
        }
    }

    /// Adds to the gradient at a vertex.
    #[inline]
    pub(super) fn add_gradient(&mut self, vertex: u32, g: Vector2<f64>) {
        self.gradient[2 * vertex as usize] += g.x;
        self.gradient[2 * vertex as usize + 1] += g.y;
    }

    /// Adds a symmetric block to the diagonal of the Hessian.
    #[inline]
    pub(super) fn add_diagonal(&mut self, vertex: u32, m: &Matrix2<f64>) {
        let (at, stride) = self.block(vertex as usize);
        self.hessian[at] += m.m11;
        self.hessian[at + stride] += m.m12;
        self.hessian[at + stride + 1] += m.m22;
    }

    /// Adds the block whose rows belong to the start and whose columns belong to the end of a half-edge.
    #[inline]
    fn add_across(&mut self, face: usize, slot: usize, m: &Matrix2<f64>) {
        let triangle = self.faces.triangles[face];
        let (from, to) = (triangle[slot], triangle[(slot + 1) % 3]);
        let (at, stride) = (self.across[face][slot] as usize, self.block(from.max(to).index()).1);
        let (m12, m21) = if from < to { (m.m12, m.m21) } else { (m.m21, m.m12) };
        self.hessian[at] += m.m11;
        self.hessian[at + 1] += m21;
        self.hessian[at + stride] += m12;
        self.hessian[at + stride + 1] += m.m22;
    }

    /// Adds the block of a half-edge's two ends; rows belong to its start.
    pub(super) fn add_edge_block(&mut self, h: HalfedgeId, m: &Matrix2<f64>) {
        self.add_across(h.face().index(), h.slot(), m);
    }

    /// The assembled gradient, x and y of each vertex in turn.
    #[cfg(test)]
    pub(super) fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// Newton's direction for what was assembled, into `direction`; returns the slope along it,
    /// negative, or `None` where no descent direction came out (at a minimum up to rounding).
    pub(super) fn solve(&mut self, direction: &mut [f64]) -> Option<f64> {
        // Where all eigenvalues round a vertex are clamped its entries vanish, so the ridge is
        // measured by the mean entry too.
        let mut mean = 0.0;
        for (i, base) in self.base_diagonal.iter_mut().enumerate() {
            *base = self.hessian[self.solver.pattern().diagonal(i)];
            mean += *base;
        }
        mean /= self.base_diagonal.len().max(1) as f64;
        let mut ridge = RIDGE;
        for _ in 0..RIDGE_ATTEMPTS {
            for (i, base) in self.base_diagonal.iter().enumerate() {
                self.hessian[self.solver.pattern().diagonal(i)] = base + ridge * (base + mean);
            }
            if self.solver.refactor(&self.hessian).is_ok() {
                for (d, g) in direction.iter_mut().zip(&self.gradient) {
                    *d = -g;
                }
                self.solver.solve_in_place(&self.hessian, direction);
                let slope: f64 = direction.iter().zip(&self.gradient).map(|(d, g)| d * g).sum();
                if slope < 0.0 && slope.is_finite() {
                    return Some(slope);
                }
                if slope == 0.0 {
                    return None;
                }
            }
            ridge *= RIDGE_GROWTH;
        }
        None
    }

    /// As [`ChartSystem::solve`], but the pinned vertices stay. Pins nothing if the slice is empty.
    pub(super) fn solve_pinned(&mut self, pinned: &[bool], direction: &mut [f64]) -> Option<f64> {
        for (v, _) in pinned.iter().enumerate().filter(|p| *p.1) {
            for k in [2 * v, 2 * v + 1] {
                self.gradient[k] = 0.0;
                self.hessian[self.solver.pattern().diagonal(k)] *= PIN_STIFFNESS;
            }
        }
        // Without gradient there the slope is the same, and the direction remains one of descent.
        let slope = self.solve(direction);
        for (v, _) in pinned.iter().enumerate().filter(|p| *p.1) {
            direction[2 * v..2 * v + 2].fill(0.0);
        }
        slope
    }
}

/// `uv + step · direction` into `out`.
pub(super) fn advance(uv: &[Point2<f64>], direction: &[f64], step: f64, out: &mut [Point2<f64>]) {
    for ((o, p), d) in out.iter_mut().zip(uv).zip(direction.chunks_exact(2)) {
        *o = Point2::new(p.x + step * d[0], p.y + step * d[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::energy::StretchEnergy;
    use crate::stretch::test_meshes::{grid, hemisphere};
    use nalgebra::Point3;

    fn nudge(uv: &[Point2<f64>], k: usize, by: f64) -> Vec<Point2<f64>> {
        let mut moved = uv.to_vec();
        moved[k / 2][k % 2] += by;
        moved
    }

    #[test]
    fn assembled_derivatives_match_finite_differences() {
        // At an isometry no eigenvalue is negative, so that the projected Hessian is the Hessian.
        let mesh = grid(4, 3, |x, y| Point3::new(x + 0.2 * y, y - 0.1 * x, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        let energy = StretchEnergy::new(0.3);
        let mut system = ChartSystem::new(&mesh, &rest, &OtherHalves::default()).expect("analysis");
        let flat: Vec<_> = mesh.positions().iter().map(|p| p.xy()).collect();
        let bent: Vec<_> = flat.iter().map(|p| Point2::new(p.x + 0.1 * p.y * p.y, 1.2 * p.y)).collect();
        let h = 1e-6;
        system.assemble(&energy, &bent);
        let gradient = system.gradient().to_vec();
        for k in 0..gradient.len() {
            let df =
                system.faces.value(&energy, &nudge(&bent, k, h)) - system.faces.value(&energy, &nudge(&bent, k, -h));
            assert!((df / (2.0 * h) - gradient[k]).abs() < 1e-7, "{k}");
        }
        for k in 0..gradient.len() {
            system.assemble(&energy, &nudge(&flat, k, h));
            let plus = system.gradient().to_vec();
            system.assemble(&energy, &nudge(&flat, k, -h));
            let minus = system.gradient().to_vec();
            system.assemble(&energy, &flat);
            for l in 0..gradient.len() {
                let entry = system.solver.pattern().position(l, k).map_or(0.0, |at| system.hessian[at]);
                let difference = (plus[l] - minus[l]) / (2.0 * h);
                assert!((entry - difference).abs() < 1e-6, "{l} {k}: {entry} {difference}");
            }
        }
    }

    #[test]
    fn the_first_flip_is_where_a_determinant_vanishes() {
        let mesh = hemisphere(6);
        let rest = RestTriangle::of_mesh(&mesh);
        let faces = ChartFaces::new(&mesh, &rest, &OtherHalves::default());
        let circle = crate::stretch::TutteBoundary::Circle;
        let uv = crate::stretch::tutte_embedding(&mesh, &rest, circle, &crate::progress::Progress::new());
        let uv = uv.expect("solver").expect("positive");
        for seed in 0..20_u32 {
            let direction: Vec<f64> =
                (0..2 * uv.len() as u32).map(|k| f64::from((k * 7919 + seed * 104_729) % 1009) / 504.0 - 1.0).collect();
            let limit = faces.first_flip(&uv, &direction);
            let least = |t: f64| {
                let mut moved = uv.clone();
                advance(&uv, &direction, t, &mut moved);
                faces.least_determinant(&moved)
            };
            assert!(limit.is_finite() && least(0.999 * limit) > 0.0 && least(1.001 * limit) < 0.0, "{limit}");
        }
    }
}
