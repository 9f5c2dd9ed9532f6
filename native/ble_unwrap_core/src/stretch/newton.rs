//! Projected Newton descent on the area-normalised stretch.

use nalgebra::Point2;

use super::alignment::Alignment;
use super::barrier::Barrier;
use super::energy::{IsotropicEnergy, PeakEnergy, StretchEnergy};
use super::measure::{plane_area, surface_area};
use super::neighbourhood::Neighbourhood;
use super::other_halves::OtherHalves;
use super::overlap::{boundary_is_simple, first_flip};
use super::system::{ChartSystem, advance};
use super::{MinimiseOptions, Minimised, StretchError, StretchSettings};
use crate::distortion::{RestTriangle, squared_stretch};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;

/// Armijo's constant: a step must win this share of what its slope promises.
const ARMIJO: f64 = 1e-4;
/// Halvings before a step is given up.
const MAX_HALVINGS: usize = 40;
/// Steps stop at this share of the way to the first collapse or contact.
const SAFETY: f64 = 0.8;
/// While the energy is above this (1 is an isometry), and for at most [`WARM_UP`] iterations, the
/// symmetric Dirichlet part has at least weight ½: far from the minimum its Hessian leads better,
/// which saves one step in ten from Tutte's embedding.
const WARM_UP_ABOVE: f64 = 1.5;
/// See [`WARM_UP_ABOVE`].
const WARM_UP: usize = 3;
/// The least number of iterations before a chart may be abandoned.
const ABANDON_AFTER: usize = 5;
/// A chart is abandoned if so many times its last gain would not bring it under the limit.
const ABANDON_GAINS: f64 = 4.0;
/// After so many iterations a chart is abandoned, too, if it is still [`FAR`] above the limit.
const FAR_AFTER: usize = 10;
/// So many times the limit is far above it.
const FAR: f64 = 1.5;
/// Under the barrier the last steps win little, and slowly: the tolerance is so many times what it is without.
const APART_TOLERANCE: f64 = 10.0;

/// A triangle of more than this squared stretch is among the worst, which are mended first, and last.
const WORST: f64 = 3.0;
/// The worst triangles are mended by themselves if they are at most this share of all.
const MOST_WORST: f64 = 0.05;
/// So many rings around the worst triangles move with them.
const WORST_RINGS: usize = 4;
/// The worst triangles are mended by so many steps at most.
const WORST_STEPS: usize = 12;
/// Mending the worst triangles ends when a step gains less than this share.
const WORST_TOLERANCE: f64 = 1e-2;

/// A map with pinned vertices is minimised in so many rounds at most, each at the scale that was best after the one before.
const PINNED_ROUNDS: usize = 8;
/// Such a map has its scale when that changes by less than this share.
const SAME_SCALE: f64 = 1e-2;

/// Drawing edges to the axes goes on to the next weight when a step gains less than this share.
const ALIGN_TOLERANCE: f64 = 1e-3;

/// Minimises over all vertices; `start` has been checked to be positive, and simple if that is to
/// be kept.
///
/// The chart is scaled to equal area once, at the start. Scaling it to its best scale in every step,
/// which costs nothing and looks like a gain, made Newton take half as many steps again: far from the
/// minimum a few tiny triangles ask for a huge scale, which all others then have to undo.
pub(super) fn minimise(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    settings: &StretchSettings,
    options: &MinimiseOptions,
    progress: &Progress,
) -> Result<Minimised, StretchError> {
    let mut uv = start.to_vec();
    let scale = (surface_area(rest) / plane_area(mesh, &uv)).sqrt();
    rescale(mesh, &mut uv, scale, options.keep_apart.is_some());
    let energy = StretchEnergy::new(settings.dirichlet_weight);
    let warm = StretchEnergy::new(settings.dirichlet_weight.max(0.5));
    relax_worst(mesh, rest, &mut uv, &warm, options.keep_apart.is_some(), progress)?;
    let mut descent = Descent::new(mesh, rest, &OtherHalves::default(), uv, Vec::new(), options.keep_apart)?;
    let mut result = Minimised {
        uv: Vec::new(),
        l2: 0.0,
        iterations: 0,
        abandoned: false,
        abandoned_below: f64::NEG_INFINITY,
        early: Vec::new(),
        converged: false,
    };
    let mut l2 = descent.system.faces.stretch_sums(&descent.uv).l2();
    let tolerance = if descent.barrier.is_some() { APART_TOLERANCE } else { 1.0 } * settings.tolerance;
    for iteration in 0..settings.max_iterations {
        progress.check()?;
        let warm_up = iteration < WARM_UP && descent.system.faces.value(&energy, &descent.uv) > WARM_UP_ABOVE;
        let step = descent.step(mesh, if warm_up { &warm } else { &energy });
        let Some((before, after)) = step else {
            // No way down is left that rounding does not swallow.
            result.converged = true;
            break;
        };
        result.iterations = iteration + 1;
        let l2_before = l2;
        l2 = descent.system.faces.stretch_sums(&descent.uv).l2();
        if !warm_up && before - after <= tolerance * after {
            result.converged = true;
            break;
        }
        let gain = (l2_before - l2).max(0.0);
        if iteration == ABANDON_AFTER && options.abandon_above.is_some() {
            result.early = descent.uv.clone();
        }
        if iteration >= ABANDON_AFTER {
            let far = if iteration >= FAR_AFTER { l2 / FAR } else { f64::NEG_INFINITY };
            result.abandoned_below = result.abandoned_below.max(l2 - ABANDON_GAINS * gain).max(far);
            if options.abandon_above.is_some_and(|limit| limit < result.abandoned_below) {
                result.abandoned = true;
                break;
            }
        }
    }
    // What follows has systems of its own: this one is not held beside them.
    let Descent { system: ChartSystem { faces, .. }, uv, .. } = descent;
    result.uv = uv;
    result.l2 = l2;
    if !result.abandoned {
        let mut relaxed = result.uv.clone();
        relax_worst(mesh, rest, &mut relaxed, &warm, options.keep_apart.is_some(), progress)?;
        let l2 = faces.stretch_sums(&relaxed).l2();
        // The average has converged long before a few small triangles have.
        if l2 <= result.l2 {
            result.uv = relaxed;
            result.l2 = l2;
        }
    }
    Ok(result)
}

/// Lowers the energy around the triangles that are stretched far more than the others, each neighbourhood by itself:
/// one that is nearly flipped shortens the steps of all. Nothing where there are none, or too many.
fn relax_worst(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    uv: &mut [Point2<f64>],
    energy: &StretchEnergy,
    keep_apart: bool,
    progress: &Progress,
) -> Result<(), StretchError> {
    let stretched =
        |f: FaceId| squared_stretch(&rest[f.index()].jacobian(mesh.triangle(f).map(|v| uv[v.index()]))) > WORST;
    let bad: Vec<bool> = mesh.faces().map(stretched).collect();
    let count = bad.iter().filter(|b| **b).count();
    if count == 0 || count as f64 > MOST_WORST * bad.len() as f64 {
        return Ok(());
    }
    let near = Neighbourhood::new(mesh, rest, &bad, WORST_RINGS);
    let border = near.pinned_and_border();
    // Where a border that moves would run over another it stays.
    let pins = if keep_apart { vec![&near.pinned, &border] } else { vec![&near.pinned] };
    for pinned in pins {
        let none = OtherHalves::default();
        let mut descent = Descent::new(&near.mesh, &near.rest, &none, near.read(uv), pinned.clone(), None)?;
        descent.take_steps(&near.mesh, energy, WORST_STEPS, WORST_TOLERANCE, progress)?;
        let mut relaxed = uv.to_vec();
        near.write(&descent.uv, &mut relaxed);
        if first_flip(mesh, &relaxed).is_none() && (!keep_apart || boundary_is_simple(mesh, &relaxed)) {
            uv.copy_from_slice(&relaxed);
            break;
        }
    }
    Ok(())
}

/// Lowers the energy of all triangles, the other halves of quads among them, from a map where they are all positive; none
/// collapses. Pinned vertices stay.
pub(super) fn relax_with_halves(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    halves: &OtherHalves,
    pinned: &[bool],
    start: Vec<Point2<f64>>,
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<Vec<Point2<f64>>, StretchError> {
    let energy = StretchEnergy::new(settings.dirichlet_weight);
    let mut descent = Descent::new(mesh, rest, halves, start, pinned.to_vec(), None)?;
    descent.take_steps(mesh, &energy, settings.max_iterations, settings.tolerance, progress)?;
    Ok(descent.uv)
}

/// Lowers what is near the peak of the squared stretch, from a map without flips, by a few steps; no triangle collapses, the other
/// halves of quads among them. Pinned vertices stay.
pub(super) fn relax_peak(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    halves: &OtherHalves,
    pinned: &[bool],
    start: Vec<Point2<f64>>,
    peak: f64,
    progress: &Progress,
) -> Result<Vec<Point2<f64>>, StretchError> {
    let energy = PeakEnergy::new(StretchSettings::default().dirichlet_weight, peak);
    let mut descent = Descent::new(mesh, rest, halves, start, pinned.to_vec(), None)?;
    descent.take_steps(mesh, &energy, WORST_STEPS, WORST_TOLERANCE, progress)?;
    Ok(descent.uv)
}

/// Lowers the energy of all triangles, the other halves of quads among them, while edges are drawn to the axes: by each of some weights
/// in turn, as long as `may_go_on` says of the map. From a map where all are positive; none collapses.
pub(super) fn relax_aligned(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    halves: &OtherHalves,
    start: Vec<Point2<f64>>,
    alignment: &Alignment,
    weights: &[f64],
    may_go_on: &dyn Fn(&[Point2<f64>]) -> bool,
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let energy = StretchEnergy::new(settings.dirichlet_weight);
    let mut descent = Descent::new(mesh, rest, halves, start, Vec::new(), None)?;
    for &weight in weights {
        descent.alignment = alignment.weighing(weight);
        descent.take_steps(mesh, &energy, settings.max_iterations, ALIGN_TOLERANCE, progress)?;
        if !may_go_on(&descent.uv) {
            return Ok(None);
        }
    }
    Ok(Some(descent.uv))
}

/// Lowers the energy of a map without flips while the pinned vertices stay. The energy is that of the map times `scale` first, and
/// then at whatever scale is best for it. With `keep_apart`, whose start must have a simple boundary, that stays so. The map, at
/// the scale of the start, and how many steps were made: no more than the settings allow.
#[expect(clippy::too_many_arguments, reason = "each is needed, and there is one caller")]
pub(super) fn relax_pinned(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    pinned: &[bool],
    start: &[Point2<f64>],
    scale: f64,
    keep_apart: Option<f64>,
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<(Vec<Point2<f64>>, usize), StretchError> {
    let energy = StretchEnergy::new(settings.dirichlet_weight);
    let warm = StretchEnergy::new(settings.dirichlet_weight.max(0.5));
    let tolerance = if keep_apart.is_some() { APART_TOLERANCE } else { 1.0 } * settings.tolerance;
    let none = OtherHalves::default();
    let mut descent = Descent::new(mesh, rest, &none, start.to_vec(), pinned.to_vec(), keep_apart)?;
    let (mut factor, mut scale, mut steps) = (scale, 1.0, 0);
    for round in 0..PINNED_ROUNDS {
        let Some(scaled) = scaled(mesh, &descent.uv, factor, keep_apart.is_some()) else { break };
        descent.uv = scaled;
        scale *= factor;
        while steps < settings.max_iterations {
            progress.check()?;
            let warm_up = round == 0 && steps < WARM_UP && descent.value(&energy, &descent.uv) > WARM_UP_ABOVE;
            let Some((before, after)) = descent.step(mesh, if warm_up { &warm } else { &energy }) else { break };
            steps += 1;
            if !warm_up && before - after <= tolerance * after {
                break;
            }
        }
        // The sums of the energy's first part, which is least over all scales at this one.
        let sums = descent.system.faces.stretch_sums(&descent.uv);
        factor = (sums.stretch / sums.area).powf(0.25);
        if steps >= settings.max_iterations || !factor.is_finite() || (factor - 1.0).abs() < SAME_SCALE {
            break;
        }
    }
    let mut uv: Vec<Point2<f64>> = descent.uv.iter().map(|p| p / scale).collect();
    put_back(start, pinned, &mut uv);
    // Rounding alone can turn a triangle over here, or make the boundary touch itself.
    let is_sound = first_flip(mesh, &uv).is_none() && (keep_apart.is_none() || boundary_is_simple(mesh, &uv));
    Ok(if is_sound { (uv, steps) } else { (start.to_vec(), 0) })
}

/// Everything one Newton step works on.
struct Descent<'a> {
    system: ChartSystem<'a>,
    barrier: Option<Barrier>,
    /// Edges that are to lie along the axes; none if empty.
    alignment: Alignment,
    /// Vertices that stay; none if empty.
    pinned: Vec<bool>,
    uv: Vec<Point2<f64>>,
    trial: Vec<Point2<f64>>,
    direction: Vec<f64>,
}

impl<'a> Descent<'a> {
    /// From a map at the scale it is to be minimised at.
    fn new(
        mesh: &'a TriMesh,
        rest: &[RestTriangle],
        halves: &OtherHalves,
        uv: Vec<Point2<f64>>,
        pinned: Vec<bool>,
        keep_apart: Option<f64>,
    ) -> Result<Self, StretchError> {
        let barrier = keep_apart.map(|reach| Barrier::new(mesh, rest, reach));
        let (trial, direction) = (uv.clone(), vec![0.0; 2 * uv.len()]);
        Ok(Self {
            system: ChartSystem::new(mesh, rest, halves)?,
            barrier,
            alignment: Alignment::default(),
            pinned,
            direction,
            uv,
            trial,
        })
    }

    fn value<E: IsotropicEnergy>(&self, energy: &E, uv: &[Point2<f64>]) -> f64 {
        let own = self.system.faces.value(energy, uv) + self.alignment.value(uv);
        match &self.barrier {
            Some(barrier) if own.is_finite() => own + barrier.value(uv),
            _ => own,
        }
    }

    /// So many Newton steps at most, until one gains less than a share of the energy.
    fn take_steps<E: IsotropicEnergy>(
        &mut self,
        mesh: &TriMesh,
        energy: &E,
        most: usize,
        tolerance: f64,
        progress: &Progress,
    ) -> Result<(), StretchError> {
        for _ in 0..most {
            progress.check()?;
            let Some((before, after)) = self.step(mesh, energy) else { break };
            if before - after <= tolerance * after {
                break;
            }
        }
        Ok(())
    }

    /// One Newton step; the energy before and after, or `None` if there is no step downhill.
    fn step<E: IsotropicEnergy>(&mut self, mesh: &TriMesh, energy: &E) -> Option<(f64, f64)> {
        let before = self.value(energy, &self.uv);
        self.system.assemble(energy, &self.uv);
        if let Some(barrier) = &self.barrier {
            barrier.assemble(&self.uv, &mut self.system);
        }
        self.alignment.assemble(&self.uv, &mut self.system);
        let slope = self.system.solve_pinned(&self.pinned, &mut self.direction)?;
        let mut step = (SAFETY * self.system.faces.first_flip(&self.uv, &self.direction)).min(1.0);
        if let Some(barrier) = &self.barrier {
            step = step.min(SAFETY * barrier.first_contact(&self.uv, &self.direction, step / SAFETY));
        }
        for _ in 0..MAX_HALVINGS {
            advance(&self.uv, &self.direction, step, &mut self.trial);
            let after = self.value(energy, &self.trial);
            if after < before
                && after <= before + ARMIJO * step * slope
                && first_flip(mesh, &self.trial).is_none()
                && (self.barrier.is_none() || boundary_is_simple(mesh, &self.trial))
            {
                std::mem::swap(&mut self.uv, &mut self.trial);
                return Some((before, after));
            }
            step *= 0.5;
        }
        None
    }
}

/// Scales all of `uv`, unless rounding would flip a triangle or, where that matters, make the boundary
/// touch itself.
pub(super) fn rescale(mesh: &TriMesh, uv: &mut Vec<Point2<f64>>, scale: f64, keep_boundary_simple: bool) {
    if let Some(scaled) = scaled(mesh, uv, scale, keep_boundary_simple) {
        *uv = scaled;
    }
}

/// The map scaled; `None` where it cannot be, as [`rescale`] says.
fn scaled(mesh: &TriMesh, uv: &[Point2<f64>], scale: f64, keep_boundary_simple: bool) -> Option<Vec<Point2<f64>>> {
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let scaled: Vec<Point2<f64>> = uv.iter().map(|p| p * scale).collect();
    let is_sound = first_flip(mesh, &scaled).is_none() && (!keep_boundary_simple || boundary_is_simple(mesh, &scaled));
    is_sound.then_some(scaled)
}

/// Gives the pinned vertices their coordinates of the start, to the bit.
pub(super) fn put_back(start: &[Point2<f64>], pinned: &[bool], uv: &mut [Point2<f64>]) {
    for (v, _) in pinned.iter().enumerate().filter(|p| *p.1) {
        uv[v] = start[v];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{annulus, grid, hemisphere};
    use crate::stretch::{BOUNDARY_REACH, TutteBoundary, l2_stretch, minimise_stretch, tutte_embedding};
    use nalgebra::Point3;

    fn tutte(mesh: &TriMesh, rest: &[RestTriangle]) -> Vec<Point2<f64>> {
        let uv = tutte_embedding(mesh, rest, TutteBoundary::Circle, &Progress::new());
        uv.expect("solver").expect("positive")
    }

    fn run(mesh: &TriMesh, start: &[Point2<f64>], tolerance: f64, options: MinimiseOptions) -> Minimised {
        let rest = RestTriangle::of_mesh(mesh);
        let settings = StretchSettings { tolerance, max_iterations: 100, ..Default::default() };
        let got = minimise_stretch(mesh, &rest, start, &settings, &options, &Progress::new()).expect("runs");
        assert_eq!(first_flip(mesh, &got.uv), None);
        assert!((got.l2 - l2_stretch(mesh, &rest, &got.uv)).abs() < 1e-9);
        got
    }

    #[test]
    fn a_perturbed_flat_sheet_comes_back() {
        let mesh = grid(15, 10, |x, y| Point3::new(x, y, 0.0));
        let shake = |k: usize| ((k * 7919 % 1009) as f64 / 1009.0 - 0.5) * 0.6;
        let start: Vec<_> = (0..mesh.vertex_count())
            .map(|i| mesh.positions()[i].xy() + nalgebra::Vector2::new(shake(2 * i), shake(2 * i + 1)))
            .collect();
        for keep_apart in [None, Some(BOUNDARY_REACH)] {
            let got = run(&mesh, &start, 1e-8, MinimiseOptions { keep_apart, ..Default::default() });
            assert!(got.converged && got.l2 < 1.0 + 1e-6, "{got:?}");
        }
        // From a circle, and with a hole.
        let rest = RestTriangle::of_mesh(&mesh);
        assert!(run(&mesh, &tutte(&mesh, &rest), 1e-8, MinimiseOptions::default()).l2 < 1.0 + 1e-6);
        let ring = annulus(40, 4);
        let rest = RestTriangle::of_mesh(&ring);
        assert!(run(&ring, &tutte(&ring, &rest), 1e-8, MinimiseOptions::default()).l2 < 1.0 + 1e-6);
    }

    #[test]
    fn different_starts_reach_the_same_stretch_at_any_scale() {
        let mesh = hemisphere(14);
        let rest = RestTriangle::of_mesh(&mesh);
        let circle = tutte(&mesh, &rest);
        let first = run(&mesh, &circle, 1e-6, MinimiseOptions::default()).l2;
        assert!(first > 1.0 && first < 1.06, "{first}");
        let bend = |f: &dyn Fn(&Point2<f64>) -> Point2<f64>| -> Vec<_> { circle.iter().map(f).collect() };
        let starts = [
            bend(&|p| Point2::new(3.0 * p.x + p.y, 0.4 * p.y)),
            bend(&|p| Point2::new(p.x + 0.2 * (3.0 * p.y).sin(), p.y)),
            bend(&|p| p * 1e4),
            bend(&|p| p * 1e-4),
        ];
        for start in &starts {
            let other = run(&mesh, start, 1e-6, MinimiseOptions::default()).l2;
            assert!((other - first).abs() < 1e-3, "{other} {first}");
        }
    }

    #[test]
    fn the_energy_falls_in_every_step() {
        let mesh = hemisphere(10);
        let rest = RestTriangle::of_mesh(&mesh);
        let start = tutte(&mesh, &rest);
        for (keep, w) in [(None, 0.0), (None, 0.5), (Some(BOUNDARY_REACH), 0.05)] {
            let none = OtherHalves::default();
            let mut descent = Descent::new(&mesh, &rest, &none, start.clone(), Vec::new(), keep).expect("analysis");
            let energy = StretchEnergy::new(w);
            let mut last = descent.value(&energy, &descent.uv);
            let mut steps = 0;
            while let Some((before, after)) = descent.step(&mesh, &energy) {
                assert!(before == last && after < before, "{before} {last} {after}");
                last = after;
                steps += 1;
                if steps == 60 {
                    break;
                }
            }
            assert!(steps > 3 && last < 1.1, "{steps} {last}");
        }
    }

    #[test]
    fn with_pins_the_energy_falls_in_every_step_along_a_direction_that_leaves_them() {
        let mesh = hemisphere(10);
        let rest = RestTriangle::of_mesh(&mesh);
        let start = tutte(&mesh, &rest);
        let pinned: Vec<bool> = mesh.positions().iter().map(|p| p.x > 0.9 || p.z > 0.95).collect();
        let held = || pinned.iter().enumerate().filter(|p| *p.1).map(|(v, _)| v);
        assert!(held().count() > 5);
        let (energy, none) = (StretchEnergy::new(0.05), OtherHalves::default());
        for keep in [None, Some(BOUNDARY_REACH)] {
            let mut descent = Descent::new(&mesh, &rest, &none, start.clone(), pinned.clone(), keep).expect("analysis");
            // The slope that is promised is the derivative along the direction.
            descent.system.assemble(&energy, &start);
            let slope = descent.system.solve_pinned(&pinned, &mut descent.direction).expect("a way down");
            let along = |t: f64| {
                let mut moved = start.clone();
                advance(&start, &descent.direction, t, &mut moved);
                descent.system.faces.value(&energy, &moved)
            };
            let difference = (along(1e-6) - along(-1e-6)) / 2e-6;
            assert!(slope < 0.0 && (difference / slope - 1.0).abs() < 1e-5, "{difference} {slope}");
            let mut last = descent.value(&energy, &descent.uv);
            let mut steps = 0;
            while let Some((before, after)) = descent.step(&mesh, &energy) {
                assert!(before == last && after < before, "{before} {last} {after}");
                assert_eq!(first_flip(&mesh, &descent.uv), None);
                assert!(held().all(|v| descent.direction[2 * v..2 * v + 2] == [0.0, 0.0] && descent.uv[v] == start[v]));
                last = after;
                steps += 1;
                if steps == 40 {
                    break;
                }
            }
            assert!(steps > 3, "{steps}");
        }
    }

    #[test]
    fn hopeless_charts_are_abandoned_early() {
        let cup = |x: f64, y: f64| 25.0 * (-((x - 10.0).powi(2) + (y - 10.0).powi(2)) / 15.0).exp();
        let mesh = grid(20, 20, |x, y| Point3::new(x, y, cup(x, y)));
        let start = tutte(&mesh, &RestTriangle::of_mesh(&mesh));
        let free = run(&mesh, &start, 1e-9, MinimiseOptions::default());
        let with =
            |limit: f64| run(&mesh, &start, 1e-9, MinimiseOptions { abandon_above: Some(limit), ..Default::default() });
        let hopeless = with(1.01);
        assert!(hopeless.abandoned && !hopeless.converged && hopeless.iterations < free.iterations, "{hopeless:?}");
        let fine = with(free.l2 * 1.001);
        assert!(!fine.abandoned && fine.l2 == free.l2);
    }

    /// A ramp of a good turn and a half whose isometric image in the plane runs over itself.
    fn ramp() -> TriMesh {
        grid(96, 4, |x, y| {
            let (angle, radius) = (0.1 * x, 4.0 - 0.5 * y);
            Point3::new(radius * angle.cos(), radius * angle.sin(), 0.12 * x)
        })
    }

    #[test]
    fn the_barrier_keeps_a_ramp_from_running_over_itself() {
        let mesh = ramp();
        let start = tutte(&mesh, &RestTriangle::of_mesh(&mesh));
        assert!(boundary_is_simple(&mesh, &start));
        let free = run(&mesh, &start, 1e-4, MinimiseOptions::default());
        assert!(!boundary_is_simple(&mesh, &free.uv), "the free ramp does not overlap: no test");
        let kept = run(&mesh, &start, 1e-4, MinimiseOptions { keep_apart: Some(BOUNDARY_REACH), ..Default::default() });
        assert!(boundary_is_simple(&mesh, &kept.uv));
        assert!(kept.l2 < 1.5 && kept.l2 > free.l2, "{} {}", kept.l2, free.l2);
    }

    #[test]
    fn bad_starts_are_refused() {
        let mesh = ramp();
        let rest = RestTriangle::of_mesh(&mesh);
        let go = |start: &[Point2<f64>], apart: bool, progress: &Progress| {
            let keep_apart = apart.then_some(BOUNDARY_REACH);
            let options = MinimiseOptions { keep_apart, ..Default::default() };
            minimise_stretch(&mesh, &rest, start, &StretchSettings::default(), &options, progress)
        };
        let over: Vec<_> = mesh.positions().iter().map(|p| Point2::new(p.x, p.y)).collect();
        let flipped: Vec<_> = over.iter().map(|p| Point2::new(-p.x, p.y)).collect();
        let good = if first_flip(&mesh, &over).is_none() { (over, flipped) } else { (flipped, over) };
        assert!(matches!(go(&good.1, false, &Progress::new()), Err(StretchError::FlippedStart { .. })));
        assert_eq!(go(&good.0, true, &Progress::new()), Err(StretchError::OverlappingStart));
        assert!(go(&good.0, false, &Progress::new()).is_ok());
        let progress = Progress::new();
        progress.cancel();
        assert!(matches!(go(&good.0, false, &progress), Err(StretchError::Cancelled(_))));
    }
}
