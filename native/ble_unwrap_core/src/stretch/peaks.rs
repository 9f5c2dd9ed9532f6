//! Lowers the L-infinity stretch: the few triangles that are stretched far more than the rest of a chart.
//!
//! The L2 stretch is a mean, to which a few small triangles matter little, while on a texture each of them is a blurred spot. Here
//! they alone count, each with its neighbourhood, and what that may cost the mean is up to the caller.

use nalgebra::Point2;

use super::measure::{plane_area, surface_area};
use super::neighbourhood::Neighbourhood;
use super::newton::{relax_peak, rescale};
use super::other_halves::OtherHalves;
use super::overlap::{boundary_is_simple, first_flip};
use super::{StretchError, linf_stretch};
use crate::distortion::{RestTriangle, singular_values, squared_stretch};
use crate::mesh::{Quad, TriMesh};
use crate::progress::Progress;

/// An L-infinity stretch up to this is left alone: one texel is drawn over two thirds as many again.
const NOTICED: f64 = 1.5;
/// A triangle belongs to a peak if its L-infinity stretch is above this share of the greatest.
const PEAK: f64 = 0.7;
/// So many rings round the peaks move.
const RINGS: usize = 4;
/// Peaks that are more than this share of all triangles are how the surface is: they are left alone.
const MOST_PEAKS: f64 = 0.05;
/// Rounds, each of which begins with the peaks that the one before has left.
const ROUNDS: usize = 8;
/// A round that lowers the stretch by less than this share is the last.
const LEAST_GAIN: f64 = 0.02;
/// What the other halves of quads count: they are not to turn over, and no more.
const HALVES_WEIGHT: f64 = 0.01;

/// Moves the vertices near the triangles that are stretched most, in the sense of L-infinity, until these are stretched less.
///
/// `start` must be without flips and have a simple boundary; so has the result, by exact tests, its L-infinity stretch is lower, and
/// none of `quads` is bent that was not. `is_allowed` tells of a map whether it may be had: whether its L2 stretch has not
/// risen too far. `None` where there is no peak, or it cannot be lowered. O(n), and Newton steps on what lies around the peaks.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
pub(crate) fn lower_peaks(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    quads: &[Quad],
    start: &[Point2<f64>],
    is_allowed: &dyn Fn(&[Point2<f64>]) -> bool,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let mut uv = start.to_vec();
    let mut greatest = linf_stretch(mesh, rest, &uv);
    if greatest <= NOTICED || !greatest.is_finite() {
        return Ok(None);
    }
    let scale = (surface_area(rest) / plane_area(mesh, &uv)).sqrt();
    rescale(mesh, &mut uv, scale, true);
    let halves = OtherHalves::new(mesh, quads).without_bent(&uv).weighing(HALVES_WEIGHT);
    let mut is_lower = false;
    for _ in 0..ROUNDS {
        let Some(lower) = lowered(mesh, rest, &halves, &uv, progress)?.filter(|uv| is_allowed(uv)) else { break };
        let now = linf_stretch(mesh, rest, &lower);
        let has_paid = now <= (1.0 - LEAST_GAIN) * greatest;
        if now < greatest {
            (uv, greatest, is_lower) = (lower, now, true);
        }
        if !has_paid || greatest <= NOTICED {
            break;
        }
    }
    Ok(is_lower.then_some(uv))
}

/// One round: the map with what lies around its peaks relaxed. `None` where there are too many, or that makes no sound map.
fn lowered(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    halves: &OtherHalves,
    uv: &[Point2<f64>],
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let jacobian = |f: usize| rest[f].jacobian(mesh.triangles()[f].map(|v| uv[v.index()]));
    let least: Vec<f64> = (0..rest.len()).map(|f| singular_values(&jacobian(f))[1]).collect();
    let narrowest = least.iter().copied().fold(f64::INFINITY, f64::min);
    let is_peak: Vec<bool> = least.iter().map(|&s| narrowest >= PEAK * s).collect();
    let peaks = || is_peak.iter().enumerate().filter(|p| *p.1).map(|p| p.0);
    if peaks().count() as f64 > (MOST_PEAKS * rest.len() as f64).max(1.0) {
        return Ok(None);
    }
    let peak = peaks().map(|f| squared_stretch(&jacobian(f))).fold(1.0, f64::max);
    let near = Neighbourhood::new(mesh, rest, &is_peak, RINGS);
    let within = halves.part(mesh, &near);
    let border = near.pinned_and_border();
    // Where a border that moves would run over another it stays.
    for pinned in [&near.pinned, &border] {
        let relaxed = relax_peak(&near.mesh, &near.rest, &within, pinned, near.read(uv), peak, progress)?;
        let mut moved = uv.to_vec();
        near.write(&relaxed, &mut moved);
        if first_flip(mesh, &moved).is_none() && halves.bent(&moved).is_empty() && boundary_is_simple(mesh, &moved) {
            return Ok(Some(moved));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::l2_stretch;
    use crate::stretch::test_meshes::grid;
    use nalgebra::{Point3, Vector2};

    /// A flat sheet, and a map of it that is pinched at one vertex.
    fn pinched() -> (TriMesh, Vec<RestTriangle>, Vec<Point2<f64>>) {
        let mesh = grid(16, 16, |x, y| Point3::new(x, y, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        let mut uv: Vec<Point2<f64>> = mesh.positions().iter().map(|p| p.xy()).collect();
        let middle = uv.iter().position(|p| *p == Point2::new(8.0, 8.0)).expect("a vertex in the middle");
        uv[middle] += Vector2::new(0.7, 0.2);
        (mesh, rest, uv)
    }

    #[test]
    fn a_pinched_vertex_is_relaxed_and_nothing_else_moves() {
        let (mesh, rest, uv) = pinched();
        let before = linf_stretch(&mesh, &rest, &uv);
        assert!(before > 3.0, "{before}");
        let lower = lower_peaks(&mesh, &rest, &[], &uv, &|_| true, &Progress::new()).expect("solver").expect("lower");
        let after = linf_stretch(&mesh, &rest, &lower);
        assert!(after < 1.5, "{before} {after}");
        assert!(l2_stretch(&mesh, &rest, &lower) <= l2_stretch(&mesh, &rest, &uv));
        assert_eq!(first_flip(&mesh, &lower), None);
        let far = |p: &Point2<f64>| (p - Point2::new(8.0, 8.0)).norm() > 7.5;
        assert!(uv.iter().zip(&lower).filter(|(p, _)| far(p)).all(|(p, q)| (p - q).norm() < 1e-9));
    }

    #[test]
    fn what_is_not_allowed_or_even_is_left() {
        let (mesh, rest, uv) = pinched();
        let lower = |uv: &[Point2<f64>], allowed: bool| {
            lower_peaks(&mesh, &rest, &[], uv, &|_| allowed, &Progress::new()).expect("solver")
        };
        assert_eq!(lower(&uv, false), None);
        let wide: Vec<Point2<f64>> = mesh.positions().iter().map(|p| Point2::new(2.0 * p.x, 0.7 * p.y)).collect();
        assert_eq!(lower(&wide, true), None, "it is stretched alike everywhere");
    }

    #[test]
    fn quads_stay_convex() {
        let (mesh, rest, uv) = pinched();
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let quads: Vec<Quad> = Quad::all(&mesh, &polygon).collect();
        assert!(!quads.is_empty());
        let bent = |uv: &[Point2<f64>]| OtherHalves::new(&mesh, &quads).bent(uv).len();
        let before = bent(&uv);
        let lower =
            lower_peaks(&mesh, &rest, &quads, &uv, &|_| true, &Progress::new()).expect("solver").expect("lower");
        assert!(bent(&lower) <= before);
    }
}
