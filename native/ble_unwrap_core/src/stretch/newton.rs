//! Projected Newton descent on the area-normalised stretch.

use nalgebra::Point2;

use super::StretchError;
use super::barrier::Barrier;
use super::energy::StretchEnergy;
use super::overlap::{boundary_is_simple, first_flip};
use super::system::{ChartSystem, advance};
use super::{MinimiseOptions, Minimised, StretchSettings};
use crate::distortion::RestTriangle;
use crate::mesh::TriMesh;
use crate::progress::Progress;

/// Armijo's constant: a step must win this share of what its slope promises.
const ARMIJO: f64 = 1e-4;
/// Halvings before a step is given up.
const MAX_HALVINGS: usize = 40;
/// Steps stop at this share of the way to the first collapse or contact.
const SAFETY: f64 = 0.8;
/// While the energy is above this (1 is an isometry), and for at most [`WARM_UP`] iterations, the
/// symmetric Dirichlet part has at least weight ½: far from the minimum its Hessian leads better.
const WARM_UP_ABOVE: f64 = 1.5;
/// See [`WARM_UP_ABOVE`].
const WARM_UP: usize = 3;
/// The least number of iterations before a chart may be abandoned.
const ABANDON_AFTER: usize = 5;
/// A chart is abandoned if so many times its last gain would not bring it under the limit.
const ABANDON_GAINS: f64 = 4.0;

/// Minimises over all vertices; `start` has been checked to be positive, and simple if that is to
/// be kept.
pub(super) fn minimise(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    settings: &StretchSettings,
    options: &MinimiseOptions,
    progress: &Progress,
) -> Result<Minimised, StretchError> {
    let mut system = ChartSystem::new(mesh, rest)?;
    let barrier = options.keep_boundary_simple.then(|| Barrier::new(mesh, rest));
    let mut uv = start.to_vec();
    let mut trial = uv.clone();
    let mut direction = vec![0.0; 2 * uv.len()];
    let mut result = Minimised { uv: Vec::new(), l2: 0.0, iterations: 0, abandoned: false, converged: false };
    let mut l2 = system.stretch_sums(&uv).l2();

    for iteration in 0..settings.max_iterations {
        progress.check()?;
        let mut energy = StretchEnergy::new(settings.dirichlet_weight);
        let scale = system.best_scale(&energy, &uv);
        let warm_up = iteration < WARM_UP && system.value(&energy, &uv) > WARM_UP_ABOVE;
        if warm_up {
            energy = StretchEnergy::new(settings.dirichlet_weight.max(0.5));
        }
        let value = |system: &ChartSystem, uv: &[Point2<f64>]| {
            let own = system.value(&energy, uv);
            if own.is_finite() { own + barrier.as_ref().map_or(0.0, |b| b.value(uv)) } else { own }
        };
        // The best scale costs nothing and saves the first steps; the reach of the barrier is
        // absolute, so there it is left to Newton after the first time.
        if barrier.is_none() || iteration == 0 {
            rescale(mesh, &mut uv, scale, &mut trial, barrier.is_some());
        }
        let before = value(&system, &uv);
        system.assemble(&energy, &uv);
        if let Some(b) = &barrier {
            b.assemble(&uv, &mut system);
        }
        let Some(slope) = system.solve(&mut direction) else {
            result.converged = true;
            break;
        };
        let mut step = (SAFETY * system.first_flip(&uv, &direction)).min(1.0);
        if let Some(b) = &barrier {
            let contact = b.first_contact(&uv, &direction, step / SAFETY);
            step = step.min(SAFETY * contact);
        }
        let mut after = f64::INFINITY;
        for _ in 0..MAX_HALVINGS {
            advance(&uv, &direction, step, &mut trial);
            after = value(&system, &trial);
            let safe = after <= before + ARMIJO * step * slope
                && first_flip(mesh, &trial).is_none()
                && (barrier.is_none() || boundary_is_simple(mesh, &trial));
            if safe {
                break;
            }
            after = f64::INFINITY;
            step *= 0.5;
        }
        result.iterations = iteration + 1;
        if !after.is_finite() {
            // No step downhill is left that rounding does not swallow.
            result.converged = !warm_up;
            if warm_up { continue } else { break }
        }
        std::mem::swap(&mut uv, &mut trial);
        let gain = l2;
        l2 = system.stretch_sums(&uv).l2();
        let gain = (gain - l2).max(0.0);
        if !warm_up && before - after <= settings.tolerance * after {
            result.converged = true;
            break;
        }
        let out_of_reach = |limit: f64| l2 - ABANDON_GAINS * gain > limit;
        if iteration >= ABANDON_AFTER && !warm_up && options.abandon_above.is_some_and(out_of_reach) {
            result.abandoned = true;
            break;
        }
    }
    result.l2 = l2;
    result.uv = uv;
    Ok(result)
}

/// Scales all of `uv`, unless rounding would flip a triangle or, where that matters, make the boundary
/// touch itself; `scratch` has the same length.
pub(super) fn rescale(
    mesh: &TriMesh,
    uv: &mut [Point2<f64>],
    scale: f64,
    scratch: &mut [Point2<f64>],
    keep_boundary_simple: bool,
) {
    if !(scale.is_finite() && scale > 0.0) {
        return;
    }
    for (s, p) in scratch.iter_mut().zip(uv.iter()) {
        *s = p * scale;
    }
    if first_flip(mesh, scratch).is_none() && (!keep_boundary_simple || boundary_is_simple(mesh, scratch)) {
        uv.copy_from_slice(scratch);
    }
}
