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
use super::other_halves::OtherHalves;
use super::overlap::first_flip;
use super::system::{ChartSystem, advance};
use crate::distortion::RestTriangle;
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;

/// A round has so many Newton steps; after each it is asked whether the flips fall.
const ROUND: usize = 5;
/// Greatest number of rounds. Starts that resemble the surface take 3 to 35 steps; vertices scattered at random are not
/// untangled in 120 either, and Tutte's embedding serves them sooner.
const MOST_ROUNDS: usize = 8;
/// Rounds in which the flips must fall to [`LEAST_CLEARED`], or clearing is given up.
const PATIENT: usize = 2;
/// Greatest share of the flips that may be left after [`PATIENT`] rounds.
const LEAST_CLEARED: f64 = 0.8;
/// Clearing is given up once there are more than so many times the flips that it began with, and [`RISE_FORGIVEN`] more: of 1,300
/// clearings that ended well one in ten rose so high, of 500 that failed half did, at the end of their first round.
const MOST_RISEN: f64 = 2.5;
/// Flips that may be added whatever their share, since a few flips often become some more on their way.
const RISE_FORGIVEN: f64 = 10.0;
/// Where only the neighbourhood of flips moves, and there are so many, they must fall to [`LEAST_CLEARED`] in the first round:
/// of 39 clearings that did not so, on the development models, an assembly of a hundred parts and plates pierced by
/// finely divided holes, none ended well.
const VERY_MANY: usize = 300;
/// Where there are so many flips, they must not rise by [`MOST_RISEN_OF_MANY`] in the first round.
const MANY: usize = 100;
/// Rise at which [`MANY`] flips are given up: of 51 clearings on the same meshes whose flips rose by more none ended well.
const MOST_RISEN_OF_MANY: f64 = 1.3;
/// ε to begin with, the paper's. Over 16 models 0.3, 0.1, 0.03 give more charts, by 1, 7 and 22 %, and 2 gives 9 % more.
const WIDE: f64 = 1.0;
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
    let mut patience = Patience::default();
    let mut clearing = Clearing::new(mesh, rest, &OtherHalves::default(), start.to_vec(), 0.0, WIDE)?;
    while !clearing.is_done() {
        if patience.ends(collapsed(mesh, rest, &clearing.uv)) || !clearing.round(&[], progress)? {
            break;
        }
    }
    Ok(first_flip(mesh, &clearing.uv).is_none().then_some(clearing.uv))
}

/// Whether a triangle is flipped or so nearly collapsed that Newton's steps would end there.
pub(super) fn is_collapsed(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>], f: FaceId) -> bool {
    rest[f.index()].jacobian(mesh.triangle(f).map(|v| uv[v.index()])).determinant() < COLLAPSED
}

/// Number of such triangles.
pub(super) fn collapsed(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> usize {
    mesh.faces().filter(|&f| is_collapsed(mesh, rest, uv, f)).count()
}

/// As [`foldover_free`], but only vertices near flipped or collapsed triangles move: all whose triangles are fewer than
/// `rings` away from one. Costs what lies there; after each round that is less.
pub(super) fn foldover_free_near(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    rings: usize,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let mut uv = start.to_vec();
    let mut patience = Patience::default();
    let mut epsilon = WIDE;
    loop {
        let bad: Vec<bool> = mesh.faces().map(|f| is_collapsed(mesh, rest, &uv, f)).collect();
        let count = bad.iter().filter(|b| **b).count();
        if count == 0 {
            return Ok(first_flip(mesh, &uv).is_none().then_some(uv));
        }
        if patience.ends_locally(count) {
            break;
        }
        let near = Neighbourhood::new(mesh, rest, &bad, rings);
        let none = OtherHalves::default();
        let mut clearing = Clearing::new(&near.mesh, &near.rest, &none, near.read(&uv), COLLAPSED, epsilon)?;
        let goes_on = clearing.round(&near.pinned, progress)?;
        near.write(&clearing.uv, &mut uv);
        epsilon = clearing.energy.epsilon;
        if !goes_on {
            break;
        }
    }
    // Some may be all but collapsed still.
    Ok(first_flip(mesh, &uv).is_none().then_some(uv))
}

/// Moves the vertices that are not pinned until every triangle, and every other half of a quad, is positive and not near to
/// collapse, or as far on the way there as a fixed number of steps leads.
pub(super) fn clear_with_halves(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    halves: &OtherHalves,
    pinned: &[bool],
    start: Vec<Point2<f64>>,
    progress: &Progress,
) -> Result<Vec<Point2<f64>>, StretchError> {
    let mut clearing = Clearing::new(mesh, rest, halves, start, COLLAPSED, WIDE)?;
    for _ in 0..MOST_ROUNDS {
        if clearing.is_done() || !clearing.round(pinned, progress)? {
            break;
        }
    }
    Ok(clearing.uv)
}

/// When to give up.
#[derive(Default)]
struct Patience {
    /// Collapsed triangles before each round.
    collapsed: Vec<usize>,
}

impl Patience {
    /// Whether this is the end, with so many collapsed triangles left before another round.
    fn ends(&mut self, count: usize) -> bool {
        let rounds = self.collapsed.len();
        self.collapsed.push(count);
        let stagnates = rounds >= PATIENT && count as f64 > LEAST_CLEARED * self.collapsed[rounds - PATIENT] as f64;
        let rises = rounds > 0 && count as f64 > MOST_RISEN * self.collapsed[0] as f64 + RISE_FORGIVEN;
        rounds >= MOST_ROUNDS || stagnates && rounds.is_multiple_of(PATIENT) || rises
    }

    /// The same where only the neighbourhood of these triangles moves, which clears many at once or not at all.
    fn ends_locally(&mut self, count: usize) -> bool {
        let ends = self.ends(count);
        let [first, second] = self.collapsed[..] else { return ends };
        let share = second as f64 / first as f64;
        ends || first >= VERY_MANY && share > LEAST_CLEARED || first >= MANY && share > MOST_RISEN_OF_MANY
    }
}

/// A map on its way, and what a step needs.
struct Clearing<'a> {
    mesh: &'a TriMesh,
    system: ChartSystem<'a>,
    uv: Vec<Point2<f64>>,
    trial: Vec<Point2<f64>>,
    direction: Vec<f64>,
    energy: FoldoverEnergy,
    /// Done once no triangle is flipped and all determinants are at least this.
    least: f64,
}

impl<'a> Clearing<'a> {
    fn new(
        mesh: &'a TriMesh,
        rest: &[RestTriangle],
        halves: &OtherHalves,
        uv: Vec<Point2<f64>>,
        least: f64,
        epsilon: f64,
    ) -> Result<Self, StretchError> {
        let (trial, direction) = (uv.clone(), vec![0.0; 2 * uv.len()]);
        let (system, energy) = (ChartSystem::new(mesh, rest, halves)?, FoldoverEnergy { epsilon });
        Ok(Self { mesh, system, uv, trial, direction, energy, least })
    }

    fn is_done(&self) -> bool {
        first_flip(self.mesh, &self.uv).is_none() && self.system.faces.least_determinant(&self.uv) >= self.least
    }

    /// Some steps, fewer if that does. `pinned` says which vertices stay; none if it is empty. False where no step is left.
    fn round(&mut self, pinned: &[bool], progress: &Progress) -> Result<bool, StretchError> {
        for _ in 0..ROUND {
            if self.is_done() {
                break;
            }
            progress.check()?;
            if !self.step(pinned) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// A Newton step, and ε after it. False where there is none.
    fn step(&mut self, pinned: &[bool]) -> bool {
        let before = self.system.faces.value(&self.energy, &self.uv);
        self.system.assemble(&self.energy, &self.uv);
        let Some(slope) = self.system.solve_pinned(pinned, &mut self.direction) else { return false };
        let mut step = 1.0;
        let mut after = before;
        for _ in 0..MAX_HALVINGS {
            advance(&self.uv, &self.direction, step, &mut self.trial);
            let value = self.system.faces.value(&self.energy, &self.trial);
            if value <= before + ARMIJO * step * slope {
                std::mem::swap(&mut self.uv, &mut self.trial);
                after = value;
                break;
            }
            step *= 0.5;
        }
        // Equation 7 of the paper.
        let sigma = (1.0 - after / before).max(LEAST_PROGRESS);
        let worst = self.system.faces.least_determinant(&self.uv);
        let root = worst.hypot(self.energy.epsilon);
        self.energy.epsilon *= if worst >= 0.0 { 1.0 - sigma } else { 1.0 - sigma * root / (worst.abs() + root) };
        true
    }
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
    fn patience_ends_where_flips_rise_or_stay() {
        let rounds = |counts: &[usize]| {
            let mut patience = Patience::default();
            counts.iter().position(|&count| patience.ends(count))
        };
        assert_eq!(rounds(&[20, 16, 9, 5, 2, 2, 2]), Some(6), "stays, asked every other round");
        assert_eq!(rounds(&[20, 40, 15, 30, 9, 8, 7]), None);
        assert_eq!(rounds(&[20, 61]), Some(1), "rises");
        assert_eq!(rounds(&[2, 14, 1]), None, "a few more are forgiven");
        assert_eq!(rounds(&[900, 800, 700, 500, 400, 300, 200, 150, 100]), Some(MOST_ROUNDS));
    }

    #[test]
    fn a_neighbourhood_with_many_flips_is_given_up_after_one_round() {
        let rounds = |counts: &[usize]| {
            let mut patience = Patience::default();
            counts.iter().position(|&count| patience.ends_locally(count))
        };
        assert_eq!(rounds(&[386, 372, 339]), Some(1), "of very many too few are cleared");
        assert_eq!(rounds(&[709, 30, 1, 0]), None);
        assert_eq!(rounds(&[190, 275, 10]), Some(1), "many rise");
        assert_eq!(rounds(&[190, 197, 90, 3]), None, "they stay, and then fall");
        assert_eq!(rounds(&[20, 40, 15, 30, 9, 8, 7]), None, "a few may rise");
    }

    #[test]
    fn near_a_fold_only_its_neighbourhood_moves_and_collapsed_is_not_flipped() {
        let mesh = grid(30, 8, |x, y| Point3::new(x, y, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        let flat: Vec<_> = mesh.positions().iter().map(|p| p.xy()).collect();
        let at = |x: f64, y: f64| flat.iter().position(|p| *p == Point2::new(x, y)).expect("a vertex");
        let mut folded = flat.clone();
        folded[at(6.0, 4.0)].x += 1.7;
        assert!(first_flip(&mesh, &folded).is_some());
        let near = foldover_free_near(&mesh, &rest, &folded, 3, &Progress::new()).expect("solver").expect("cleared");
        assert_eq!(first_flip(&mesh, &near), None);
        assert!(flat.iter().zip(&near).all(|(p, q)| p.x < 13.0 || p == q));
        // Held by so narrow a neighbourhood that nothing moves, a triangle without a flip is no failure.
        let mut thin = flat.clone();
        thin[at(6.0, 4.0)].x += 0.99;
        let kept = foldover_free_near(&mesh, &rest, &thin, 0, &Progress::new()).expect("solver").expect("no flip");
        assert_eq!(first_flip(&mesh, &kept), None);
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
