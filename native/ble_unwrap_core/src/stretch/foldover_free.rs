//! Clears flipped triangles from a map with a free boundary.
//!
//! Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps in 50 lines of code, ACM TOG
//! 2021. The energy and the schedule of ε are theirs; they minimise with L-BFGS, this with projected Newton
//! steps, which reuse the system of the stretch energy: a camel's head of 22,704 faces projected on a
//! plane (about 10,000 flips) was cleared along each of the three axes when 60 steps were allowed.

use nalgebra::Point2;

use super::StretchError;
use super::energy::FoldoverEnergy;
use super::neighbourhood::Neighbourhood;
use super::overlap::first_flip;
use super::system::{ChartSystem, advance};
use crate::distortion::RestTriangle;
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;

/// Newton steps at most. Starts that resemble the surface take 3 to 35; vertices scattered at random are not
/// untangled in 120 either, and Tutte's embedding serves them sooner.
const MAX_ITERATIONS: usize = 40;
/// In so many steps
const ROUND: usize = 10;
/// the flips must fall to this share, or it is given up.
const LEAST_CLEARED: f64 = 0.8;
/// Armijo's constant.
const ARMIJO: f64 = 1e-4;
/// Halvings before a step is given up.
const MAX_HALVINGS: usize = 30;
/// Area ratio below which a triangle counts as collapsed.
const COLLAPSED: f64 = 0.02;
/// Least share of its way to zero that ε goes in an iteration (σ in the paper).
const LEAST_PROGRESS: f64 = 0.1;

/// Moves all vertices until every triangle is positive; `Ok(None)` if that did not succeed within
/// a fixed number of steps. `start` must be finite and in about surface units.
pub(super) fn foldover_free(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    clear(mesh, rest, start, &[], 0.0, progress)
}

/// Whether a triangle is flipped or so nearly collapsed that Newton's steps would end there.
pub(super) fn is_collapsed(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>], f: FaceId) -> bool {
    rest[f.index()].jacobian(mesh.triangle(f).map(|v| uv[v.index()])).determinant() < COLLAPSED
}

/// As [`foldover_free`], but only vertices near flipped or collapsed triangles move: all whose triangles are fewer than
/// `rings` away from one. Costs what lies there.
pub(super) fn foldover_free_near(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    rings: usize,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let bad: Vec<bool> = mesh.faces().map(|f| is_collapsed(mesh, rest, start, f)).collect();
    if !bad.contains(&true) {
        return Ok(first_flip(mesh, start).is_none().then(|| start.to_vec()));
    }
    let near = Neighbourhood::new(mesh, rest, &bad, rings);
    let Some(cleared) = clear(&near.mesh, &near.rest, &near.read(start), &near.pinned, COLLAPSED, progress)? else {
        return Ok(None);
    };
    let mut uv = start.to_vec();
    near.write(&cleared, &mut uv);
    Ok(first_flip(mesh, &uv).is_none().then_some(uv))
}

/// `pinned` says which vertices stay; none if it is empty. Done once no triangle is flipped and all determinants are at
/// least `least`.
fn clear(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    pinned: &[bool],
    least: f64,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let mut system = ChartSystem::new(mesh, rest)?;
    let mut uv = start.to_vec();
    let mut trial = uv.clone();
    let mut direction = vec![0.0; 2 * uv.len()];
    let mut energy = FoldoverEnergy { epsilon: 1.0 };
    let mut before_round = usize::MAX;
    for iteration in 0..MAX_ITERATIONS {
        if first_flip(mesh, &uv).is_none() && system.faces.least_determinant(&uv) >= least {
            return Ok(Some(uv));
        }
        if iteration % ROUND == 0 {
            let flips = mesh.faces().filter(|&f| is_collapsed(mesh, rest, &uv, f)).count();
            if flips as f64 > LEAST_CLEARED * before_round as f64 {
                return Ok(None);
            }
            before_round = flips;
        }
        progress.check()?;
        let before = system.faces.value(&energy, &uv);
        system.assemble(&energy, &uv);
        let Some(slope) = system.solve_pinned(pinned, &mut direction) else { break };
        let mut step = 1.0;
        let mut after = before;
        for _ in 0..MAX_HALVINGS {
            advance(&uv, &direction, step, &mut trial);
            let value = system.faces.value(&energy, &trial);
            if value <= before + ARMIJO * step * slope {
                std::mem::swap(&mut uv, &mut trial);
                after = value;
                break;
            }
            step *= 0.5;
        }
        // Equation 7 of the paper.
        let sigma = (1.0 - after / before).max(LEAST_PROGRESS);
        let worst = system.faces.least_determinant(&uv);
        let root = worst.hypot(energy.epsilon);
        energy.epsilon *= if worst >= 0.0 { 1.0 - sigma } else { 1.0 - sigma * root / (worst.abs() + root) };
    }
    Ok(first_flip(mesh, &uv).is_none().then_some(uv))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{annulus, grid, hemisphere};
    use nalgebra::Point3;

    fn clears(mesh: &TriMesh, start: &[Point2<f64>]) {
        let rest = RestTriangle::of_mesh(mesh);
        assert!(first_flip(mesh, start).is_some(), "nothing to clear");
        let uv = foldover_free(mesh, &rest, start, &Progress::new()).expect("solver").expect("cleared");
        assert_eq!(first_flip(mesh, &uv), None);
    }

    #[test]
    fn a_folded_sheet_and_a_mirrored_one() {
        let mesh = grid(12, 8, |x, y| Point3::new(x, y, 0.0));
        let folded: Vec<_> =
            mesh.positions().iter().map(|p| Point2::new((p.x - 5.3).abs(), p.y + 0.05 * p.x)).collect();
        clears(&mesh, &folded);
        let mirrored: Vec<_> = mesh.positions().iter().map(|p| Point2::new(-p.x, p.y)).collect();
        clears(&mesh, &mirrored);
    }

    #[test]
    fn a_projected_ball_and_a_ring() {
        // More than a hemisphere, seen from above.
        let mesh = hemisphere(14);
        let wrapped: Vec<_> = mesh
            .positions()
            .iter()
            .map(|p| {
                let a = 1.6 * p.z.clamp(-1.0, 1.0).acos();
                Point2::from(p.xy().coords.try_normalize(1e-12).unwrap_or_default() * a.sin())
            })
            .collect();
        clears(&mesh, &wrapped);
        let ring = annulus(40, 5);
        let inverted: Vec<_> = ring.positions().iter().map(|p| p.xy() / p.coords.norm_squared()).collect();
        clears(&ring, &inverted);
    }
}
