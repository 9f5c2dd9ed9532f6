//! Stretch minimisation by line searches of one vertex at a time, as in the paper.
//!
//! Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3: every
//! vertex is moved along a random line to the best place on it. Here the objective is area-normalised
//! and the boundary is free.

use nalgebra::{Point2, Vector2};

use super::measure::surface_area;
use super::overlap::boundary_is_simple;
use super::{MinimiseOptions, Minimised, StretchError, StretchSettings};
use crate::distortion::{RestTriangle, squared_stretch};
use crate::mesh::{TriMesh, VertexId};
use crate::predicates::orientation;
use crate::progress::Progress;
use crate::random::word;

/// Steps of golden section: they narrow the line to 0.618²⁴ ≈ 1e-5 of itself.
const SECTION_STEPS: usize = 24;
/// Share of the way to the first collapse that a line covers.
const SAFETY: f64 = 0.95;
/// Lines that meet no collapse end so many times the length of the longest edge at the vertex away.
const OPEN_LINE: f64 = 2.0;
/// Vertices between two looks at the cancel flag.
const CHECK_EVERY: usize = 4096;

/// Sums over the chart that the objective √(E·A) is made of.
#[derive(Clone, Copy)]
struct Sums {
    energy: f64,
    area: f64,
}

/// Sweeps over all vertices until a sweep gains less than the tolerance, at most `max_iterations`.
/// `start` has been checked to be positive, and simple if that is to be kept.
pub(super) fn minimise(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    settings: &StretchSettings,
    options: &MinimiseOptions,
    progress: &Progress,
) -> Result<Minimised, StretchError> {
    let area = surface_area(rest);
    let mut uv = start.to_vec();
    let mut sums = total(mesh, rest, &uv);
    let mut result = Minimised {
        uv: Vec::new(),
        l2: 0.0,
        iterations: 0,
        abandoned: false,
        abandoned_below: f64::NEG_INFINITY,
        early: Vec::new(),
        converged: false,
    };
    for sweep in 0..settings.max_iterations {
        let before = (sums.energy * sums.area).sqrt();
        let saved = options.keep_apart.map(|_| uv.clone());
        run_sweep(mesh, rest, &mut uv, sums, (options.seed, sweep as u64), true, progress)?;
        if let Some(saved) = saved
            && !boundary_is_simple(mesh, &uv)
        {
            uv = saved;
            run_sweep(mesh, rest, &mut uv, sums, (options.seed, sweep as u64), false, progress)?;
        }
        // Summed afresh: the running sums gather rounding.
        sums = total(mesh, rest, &uv);
        let after = (sums.energy * sums.area).sqrt();
        result.iterations = sweep + 1;
        if before - after <= settings.tolerance * after {
            result.converged = true;
            break;
        }
        // Sweeps gain ever less: as for Newton, but over as many sweeps as are left.
        let left = (settings.max_iterations - sweep - 1) as f64;
        if sweep >= 1 {
            result.abandoned_below = result.abandoned_below.max((after - left * (before - after)) / area);
            if options.abandon_above.is_some_and(|limit| limit < result.abandoned_below) {
                result.abandoned = true;
                break;
            }
        }
    }
    result.l2 = (sums.energy * sums.area).sqrt() / area;
    result.uv = uv;
    Ok(result)
}

fn face_sums(rest: &RestTriangle, uv: [Point2<f64>; 3]) -> Sums {
    let j = rest.jacobian(uv);
    let d = j.determinant();
    let energy = if d > 0.0 { rest.area() * squared_stretch(&j) } else { f64::INFINITY };
    Sums { energy, area: rest.area() * d }
}

fn total(mesh: &TriMesh, rest: &[RestTriangle], uv: &[Point2<f64>]) -> Sums {
    let mut sums = Sums { energy: 0.0, area: 0.0 };
    for (t, r) in mesh.triangles().iter().zip(rest) {
        let s = face_sums(r, t.map(|v| uv[v.index()]));
        sums.energy += s.energy;
        sums.area += s.area;
    }
    sums
}

/// One line search for each vertex, the most stretched neighbourhoods first.
fn run_sweep(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    uv: &mut [Point2<f64>],
    mut sums: Sums,
    seed: (u64, u64),
    move_boundary: bool,
    progress: &Progress,
) -> Result<(), StretchError> {
    let mut order: Vec<(f64, VertexId)> = mesh
        .vertices()
        .filter(|&v| move_boundary || !mesh.is_boundary_vertex(v))
        .map(|v| {
            let (mut energy, mut area) = (0.0, 0.0);
            for h in mesh.outgoing(v) {
                let f = h.face();
                energy += face_sums(&rest[f.index()], mesh.triangle(f).map(|v| uv[v.index()])).energy;
                area += rest[f.index()].area();
            }
            (energy / area, v)
        })
        .collect();
    order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (count, &(_, v)) in order.iter().enumerate() {
        if count % CHECK_EVERY == 0 {
            progress.check()?;
        }
        let random =
            [seed.1, v.index() as u64].into_iter().fold(word(seed.0, 0), |hash, i| word(hash.wrapping_add(i), 0));
        // 53 random bits make an angle.
        let angle = std::f64::consts::TAU * (random >> 11) as f64 / (1u64 << 53) as f64;
        let (sin, cos) = angle.sin_cos();
        search_line(mesh, rest, uv, v, Vector2::new(cos, sin), &mut sums);
    }
    Ok(())
}

/// Moves `v` to the best place on a line through it; keeps `sums` up to date.
fn search_line(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    uv: &mut [Point2<f64>],
    v: VertexId,
    direction: Vector2<f64>,
    sums: &mut Sums,
) {
    // The doubled area of a face at v is linear in the step t: c + b·t.
    let here = uv[v.index()];
    let (mut low, mut high, mut reach) = (f64::NEG_INFINITY, f64::INFINITY, 0.0_f64);
    for h in mesh.outgoing(v) {
        let (a, b) = (uv[mesh.to(h).index()], uv[mesh.to(h.next()).index()]);
        let (c, slope) = ((a - here).perp(&(b - here)), direction.perp(&(a - b)));
        let zero = -c / slope;
        if slope < 0.0 {
            high = high.min(zero);
        } else if slope > 0.0 {
            low = low.max(zero);
        }
        reach = reach.max((a - here).norm()).max((b - here).norm());
    }
    let (mut low, mut high) = ((SAFETY * low).max(-OPEN_LINE * reach), (SAFETY * high).min(OPEN_LINE * reach));

    let around = |p: Point2<f64>| {
        let mut s = Sums { energy: 0.0, area: 0.0 };
        for h in mesh.outgoing(v) {
            let f = h.face();
            let own = face_sums(&rest[f.index()], mesh.triangle(f).map(|w| if w == v { p } else { uv[w.index()] }));
            s.energy += own.energy;
            s.area += own.area;
        }
        s
    };
    let start = around(here);
    let moved = |t: f64| {
        let s = around(here + direction * t);
        Sums { energy: sums.energy - start.energy + s.energy, area: sums.area - start.area + s.area }
    };
    let objective = |t: f64| {
        let s = moved(t);
        s.energy * s.area
    };
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut x, mut y) = (high - golden * (high - low), low + golden * (high - low));
    let (mut fx, mut fy) = (objective(x), objective(y));
    for _ in 0..SECTION_STEPS {
        if fx < fy {
            (high, y, fy) = (y, x, fx);
            x = high - golden * (high - low);
            fx = objective(x);
        } else {
            (low, x, fx) = (x, y, fy);
            y = low + golden * (high - low);
            fy = objective(y);
        }
    }
    let t = if fx < fy { x } else { y };
    let better = moved(t);
    let place = here + direction * t;
    let positive =
        || mesh.outgoing(v).all(|h| orientation(place, uv[mesh.to(h).index()], uv[mesh.to(h.next()).index()]) > 0.0);
    if better.energy * better.area < sums.energy * sums.area && positive() {
        *sums = better;
        uv[v.index()] = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::overlap::first_flip;
    use crate::stretch::test_meshes::hemisphere;
    use crate::stretch::{BOUNDARY_REACH, TutteBoundary, l2_stretch, minimise_stretch, tutte_embedding};

    #[test]
    fn every_sweep_lowers_the_stretch_and_flips_nothing() {
        let mesh = hemisphere(10);
        let rest = RestTriangle::of_mesh(&mesh);
        let progress = Progress::new();
        let start = tutte_embedding(&mesh, &rest, TutteBoundary::Circle, &progress).expect("solver").expect("positive");
        let mut last = l2_stretch(&mesh, &rest, &start);
        for sweeps in [1, 2, 5, 20] {
            let settings = StretchSettings { max_iterations: sweeps, tolerance: 0.0, ..StretchSettings::paper() };
            for keep in [false, true] {
                let options =
                    MinimiseOptions { keep_apart: keep.then_some(BOUNDARY_REACH), seed: 7, ..Default::default() };
                let got = minimise_stretch(&mesh, &rest, &start, &settings, &options, &progress).expect("runs");
                assert_eq!(first_flip(&mesh, &got.uv), None);
                assert!((got.l2 - l2_stretch(&mesh, &rest, &got.uv)).abs() < 1e-9);
                if keep {
                    assert!(boundary_is_simple(&mesh, &got.uv));
                } else {
                    assert!(got.l2 < last, "{sweeps}: {} {last}", got.l2);
                    last = got.l2;
                }
            }
        }
        assert!(last < 1.08, "{last}");
    }

    #[test]
    fn the_seed_decides() {
        let mesh = hemisphere(6);
        let rest = RestTriangle::of_mesh(&mesh);
        let progress = Progress::new();
        let start = tutte_embedding(&mesh, &rest, TutteBoundary::Circle, &progress).expect("solver").expect("positive");
        let run = |seed| {
            let options = MinimiseOptions { seed, ..Default::default() };
            minimise_stretch(&mesh, &rest, &start, &StretchSettings::paper(), &options, &progress).expect("runs").uv
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }
}
