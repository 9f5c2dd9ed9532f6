//! Sides of a chart that are straight on the surface made straight in the plane, along the axes: so charts lie edge to edge, and textures of planks
//! and tiles run along them.

use nalgebra::Point2;

use super::alignment::Alignment;
use super::measure::{plane_area, surface_area};
use super::newton::{relax_aligned, rescale};
use super::other_halves::OtherHalves;
use super::overlap::{boundary_is_simple, first_flip};
use super::sides::{pose, sides};
use super::{StretchError, StretchSettings};
use crate::distortion::RestTriangle;
use crate::mesh::{Quad, TriMesh};
use crate::progress::Progress;

/// Sides are straightened if those that are near the axes make up at least this share of the border: a chart of fewer is packed at any angle.
const LEAST_ALIGNED: f64 = 0.25;
/// An edge that is across an axis by this share of its length at most lies along it: one degree.
const ALONG: f64 = 0.017;
/// An edge that is across by no more is left to rounding.
const EXACTLY: f64 = 1e-7;
/// What the sides count for beside the stretch, one after the other. Six from 1 on, each ten times the one before, lead to the same maps in 1.4 times
/// the time.
const WEIGHTS: [f64; 2] = [1e2, 1e5];
/// What the other halves of quads count: they are not to turn over, and no more.
const HALVES_WEIGHT: f64 = 0.01;

/// Turns a map so that the sides of the chart lie near the axes, and moves its vertices with the least stretch until they lie along them. A
/// side is a run of the border between two corners that is straight on the surface, or nearly so in the plane; how many edges it has between the
/// corners does not matter, nor how faces are divided.
///
/// `start` must be without flips and have a simple boundary; so has the result, by exact tests, and none of `quads` is bent that was
/// not. `is_worth` tells of a map, and of how much more of the border lies along the axes there, by its length on the surface, whether that is to
/// be had. `None` where too little of the border is sides near the axes, where they lie along the axes already, or where they cannot be brought
/// there. O(n), and Newton steps on the whole chart where there are sides.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
pub(crate) fn straighten_sides(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    quads: &[Quad],
    start: &[Point2<f64>],
    is_worth: &dyn Fn(&[Point2<f64>], f64) -> bool,
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    assert_eq!(
        (rest.len(), start.len()),
        (mesh.face_count(), mesh.vertex_count()),
        "a rest triangle a face, a point a vertex"
    );
    let pose = pose(mesh, start, sides(mesh, start));
    let length: f64 = pose.sides.iter().flat_map(|s| &s.1).map(|&h| mesh.edge_length(h)).sum();
    if length < LEAST_ALIGNED * mesh.boundary_length() {
        return Ok(None);
    }
    let [c, s] = pose.turn;
    let mut uv: Vec<Point2<f64>> = start.iter().map(|p| Point2::new(c * p.x - s * p.y, s * p.x + c * p.y)).collect();
    let alignment = Alignment::new(mesh, &pose.sides);
    let before = alignment.aligned_length(mesh, &uv, ALONG);
    let is_sound = |uv: &[Point2<f64>]| first_flip(mesh, uv).is_none() && boundary_is_simple(mesh, uv);
    if alignment.aligned_length(mesh, &uv, EXACTLY) >= length * (1.0 - EXACTLY) || !is_sound(&uv) {
        return Ok(None);
    }
    let scale = (surface_area(rest) / plane_area(mesh, &uv)).sqrt();
    rescale(mesh, &mut uv, scale, true);
    let halves = OtherHalves::new(mesh, quads);
    let faults = |uv: &[Point2<f64>]| (halves.bent(uv).len(), halves.crowded(mesh, rest, uv).len());
    let (were_bent, were_crowded) = faults(&uv);
    let kept = halves.without_bent(&uv).weighing(HALVES_WEIGHT);
    // What is not worth it while the sides are on their way there is not worth it in the end.
    let may_go_on = |uv: &[Point2<f64>]| is_worth(uv, length - before);
    let relaxed = relax_aligned(mesh, rest, &kept, uv, &alignment, &WEIGHTS, &may_go_on, settings, progress)?;
    let Some(mut relaxed) = relaxed else { return Ok(None) };
    alignment.snap(&mut relaxed);
    let gained = alignment.aligned_length(mesh, &relaxed, ALONG) - before;
    // A corner of a quad that comes to lie on a straight side is hardly a corner any more.
    let (bent, crowded) = faults(&relaxed);
    let are_convex = bent <= were_bent && crowded <= were_crowded;
    let is_good = is_sound(&relaxed) && are_convex && is_worth(&relaxed, gained);
    Ok(is_good.then_some(relaxed))
}

/// How much of the border of a map lies along the axes at its best turn, by its length on the surface. O(n).
#[must_use]
pub(crate) fn aligned_length(mesh: &TriMesh, uv: &[Point2<f64>]) -> f64 {
    let pose = pose(mesh, uv, sides(mesh, uv));
    let [c, s] = pose.turn;
    let turned: Vec<_> = uv.iter().map(|p| Point2::new(c * p.x - s * p.y, s * p.x + c * p.y)).collect();
    Alignment::new(mesh, &pose.sides).aligned_length(mesh, &turned, ALONG)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{annulus, grid};
    use crate::stretch::{MinimiseOptions, l2_stretch, minimise_stretch};
    use nalgebra::Point3;

    /// The wall of a barrel, cut open: quads, and the map of least stretch.
    fn wall() -> (TriMesh, Vec<Quad>, Vec<Point2<f64>>) {
        let mesh = grid(24, 8, |x, y| {
            let (s, c) = (std::f64::consts::TAU * 0.999 * x / 24.0).sin_cos();
            let r = 1.0 - (y / 8.0 - 0.5).powi(2);
            Point3::new(r * c, r * s, 2.5 * y / 8.0)
        });
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let quads = Quad::all(&mesh, &polygon).collect();
        let rest = RestTriangle::of_mesh(&mesh);
        let around = |p: &Point3<f64>| p.y.atan2(p.x).rem_euclid(std::f64::consts::TAU);
        let rolled_out: Vec<_> = mesh.positions().iter().map(|p| Point2::new(around(p), p.z)).collect();
        let (settings, options) = (StretchSettings::default(), MinimiseOptions::default());
        let best = minimise_stretch(&mesh, &rest, &rolled_out, &settings, &options, &Progress::new()).expect("runs");
        (mesh, quads, best.uv)
    }

    fn straightened(
        mesh: &TriMesh,
        quads: &[Quad],
        start: &[Point2<f64>],
        is_worth: &dyn Fn(&[Point2<f64>], f64) -> bool,
    ) -> Option<Vec<Point2<f64>>> {
        let rest = RestTriangle::of_mesh(mesh);
        straighten_sides(mesh, &rest, quads, start, is_worth, &StretchSettings::default(), &Progress::new())
            .expect("runs")
    }

    #[test]
    fn the_wall_of_a_barrel_becomes_a_rectangle_at_any_angle() {
        let (mesh, quads, flat) = wall();
        let rest = RestTriangle::of_mesh(&mesh);
        let box_of = |uv: &[Point2<f64>]| {
            let low = uv.iter().fold(uv[0], |low, p| low.inf(p));
            let high = uv.iter().fold(uv[0], |high, p| high.sup(p));
            (high.x - low.x) * (high.y - low.y)
        };
        assert!(plane_area(&mesh, &flat) < 0.99 * box_of(&flat), "it is none yet");
        for angle in [0.0_f64, 0.3, 1.2, -0.6] {
            let (s, c) = angle.sin_cos();
            let turned: Vec<_> = flat.iter().map(|p| Point2::new(c * p.x - s * p.y, s * p.x + c * p.y)).collect();
            let uv = straightened(&mesh, &quads, &turned, &|_, _| true).expect("a rectangle");
            assert!((plane_area(&mesh, &uv) / box_of(&uv) - 1.0).abs() < 1e-9);
            assert_eq!(first_flip(&mesh, &uv), None);
            assert!(boundary_is_simple(&mesh, &uv));
            assert!(OtherHalves::new(&mesh, &quads).bent(&uv).is_empty());
            assert!(l2_stretch(&mesh, &rest, &uv) < l2_stretch(&mesh, &rest, &flat) + 5e-3);
            assert_eq!(straightened(&mesh, &quads, &uv, &|_, _| true), None, "it is one already");
        }
    }

    #[test]
    fn what_is_not_worth_it_is_left_alone() {
        let (mesh, quads, flat) = wall();
        let rest = RestTriangle::of_mesh(&mesh);
        let limit = l2_stretch(&mesh, &rest, &flat) + 1e-5;
        assert_eq!(straightened(&mesh, &quads, &flat, &|uv, _| l2_stretch(&mesh, &rest, uv) <= limit), None);
        let more = 1.01 * mesh.boundary_length();
        assert_eq!(straightened(&mesh, &quads, &flat, &|_, gained| gained >= more), None);
    }

    #[test]
    fn a_ring_has_no_sides() {
        let ring = annulus(40, 4);
        let uv: Vec<_> = ring.positions().iter().map(|p| p.xy()).collect();
        assert_eq!(straightened(&ring, &[], &uv, &|_, _| true), None);
    }
}
