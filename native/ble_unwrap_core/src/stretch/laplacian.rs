//! The Laplacian of a mesh, factored once.

use crate::distortion::RestTriangle;
use crate::linalg::{SparseCholesky, SparseError, SparsePattern};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// Weights are kept within these bounds: positive, so that solutions peak only where there is a source and few
/// triangles flip, and well conditioned.
pub(super) const WEIGHTS: (f64, f64) = (0.05, 20.0);
/// Relative weight on the diagonal, against what is left open where nothing is held: the shift of the whole, or its turn.
pub(super) const RIDGE: f64 = 1e-10;

/// Minus the Laplacian with the cotangents of the rest triangles for weights, halves left out: twice what is usual.
pub(super) struct Laplacian {
    solver: SparseCholesky,
    /// By face and its sides.
    pub(super) weights: Vec<[f64; 3]>,
}

impl Laplacian {
    /// Held vertices keep their right-hand side and do not act on the others, as if it were zero. O(n^1.5).
    ///
    /// # Errors
    /// [`SparseError`] where the system cannot be factored.
    pub(super) fn new(
        mesh: &TriMesh,
        rest: &[RestTriangle],
        is_held: impl Fn(VertexId) -> bool,
    ) -> Result<Self, SparseError> {
        let is_free: Vec<bool> = mesh.vertices().map(|v| !is_held(v)).collect();
        let weights: Vec<[f64; 3]> =
            rest.iter().map(|r| r.cotangents().map(|w| w.clamp(WEIGHTS.0, WEIGHTS.1))).collect();
        let ends = |h: HalfedgeId| [mesh.from(h).index(), mesh.to(h).index()];
        let between_free = mesh.edges().map(ends).filter(|e| e.iter().all(|&v| is_free[v]));
        let pairs = between_free.map(|[i, j]| (i as u32, j as u32));
        let mut solver = SparseCholesky::analyse(SparsePattern::from_pairs(mesh.vertex_count(), pairs))?;
        let mut values = vec![0.0; solver.pattern().entry_count()];
        for v in mesh.vertices().filter(|v| !is_free[v.index()]) {
            values[solver.pattern().diagonal(v.index())] = 1.0;
        }
        let weight = |h: HalfedgeId| weights[h.face().index()][h.slot()];
        for h in mesh.edges() {
            let w = weight(h) + if mesh.is_boundary(h) { 0.0 } else { weight(mesh.twin(h)) };
            let [i, j] = ends(h);
            if i == j {
                continue;
            }
            for v in [i, j].into_iter().filter(|&v| is_free[v]) {
                values[solver.pattern().diagonal(v)] += w * (1.0 + RIDGE);
            }
            if is_free[i]
                && is_free[j]
                && let Some(at) = solver.pattern().position(i, j)
            {
                values[at] -= w;
            }
        }
        solver.refactor(&values)?;
        Ok(Self { solver, weights })
    }

    /// One or two right-hand sides, one after the other, become the solutions.
    pub(super) fn solve_in_place(&mut self, columns: &mut [f64]) {
        self.solver.solve_in_place(columns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::grid;
    use nalgebra::Point3;

    #[test]
    fn what_one_vertex_does_to_another_is_mutual_and_ends_where_it_is_held() {
        let mesh = grid(7, 5, |x, y| Point3::new(x + 0.3 * y, y, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        let inside: Vec<usize> =
            mesh.vertices().filter(|v| !mesh.is_boundary_vertex(*v)).map(VertexId::index).collect();
        let mut laplacian = Laplacian::new(&mesh, &rest, |v| mesh.is_boundary_vertex(v)).expect("factored");
        let mut answer = |at: usize| {
            let mut column = vec![0.0; mesh.vertex_count()];
            column[at] = 1.0;
            laplacian.solve_in_place(&mut column);
            column
        };
        let (a, b) = (inside[2], inside[11]);
        let (from_a, from_b) = (answer(a), answer(b));
        assert!((from_a[b] - from_b[a]).abs() < 1e-12 && from_a[b] > 0.0 && from_a[a] > from_a[b]);
        assert!(mesh.vertices().filter(|v| mesh.is_boundary_vertex(*v)).all(|v| from_a[v.index()] == 0.0));
    }
}
