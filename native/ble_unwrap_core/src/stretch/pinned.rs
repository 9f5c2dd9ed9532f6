//! The least stretch of a map some of whose vertices have to stay where they are.

use nalgebra::{Point2, Vector2};

use super::barrier::BOUNDARY_REACH;
use super::foldover_free::clear_with_halves;
use super::newton::{put_back, relax_pinned};
use super::other_halves::OtherHalves;
use super::overlap::{boundary_is_simple, first_flip};
use super::{MinimiseOptions, Solver, StretchError, StretchSettings, minimise_stretch};
use crate::distortion::RestTriangle;
use crate::mesh::TriMesh;
use crate::progress::Progress;

/// What became of a map with pinned vertices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PinnedMap {
    /// It has no flips, its boundary is simple, and the pinned vertices are where they were.
    Relaxed {
        /// A point a vertex, at the scale of the start.
        uv: Vec<Point2<f64>>,
        /// Newton steps made.
        iterations: usize,
    },
    /// The start has flips that do not yield while the pinned vertices stay.
    Flipped,
    /// The start overlaps itself, and goes on to do so while the pinned vertices stay.
    Overlapping,
}

/// Moves the vertices that are not pinned so that the stretch of the map falls, at whatever scale is best for it. If the
/// start has flips, they are cleared first. `start` must be finite and in about surface units.
///
/// Guaranteed: a map that is returned has no flips and a simple boundary, by exact tests, and has the pinned vertices at
/// the very coordinates of the start. The method is Newton's, whatever the settings say. The cost is that of
/// [`minimise_stretch`], three times at most: the first is without pins and tells the scale that these ask for.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
///
/// # Panics
/// If there is not one rest triangle a face, and one point and one mark a vertex.
pub(crate) fn minimise_pinned(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    pinned: &[bool],
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<PinnedMap, StretchError> {
    assert_eq!(
        (rest.len(), start.len(), pinned.len()),
        (mesh.face_count(), mesh.vertex_count(), mesh.vertex_count()),
        "a rest triangle a face, a point and a mark a vertex"
    );
    let Some(sound) = cleared(mesh, rest, start, pinned, progress)? else { return Ok(PinnedMap::Flipped) };
    let free = StretchSettings { solver: Solver::Newton, ..settings.clone() };
    let free = minimise_stretch(mesh, rest, &sound, &free, &MinimiseOptions::default(), progress)?;
    // Were the map at its own scale, the pins would drag spikes out of it, or crush it, before all of it followed them.
    let scale = spread(&free.uv, pinned) / spread(start, pinned);
    let scale = if scale.is_finite() && scale > 0.0 { scale } else { 1.0 };
    let (uv, iterations) = relax_pinned(mesh, rest, pinned, &sound, scale, None, settings, progress)?;
    let iterations = free.iterations + iterations;
    if boundary_is_simple(mesh, &uv) {
        return Ok(PinnedMap::Relaxed { uv, iterations });
    }
    if !boundary_is_simple(mesh, &sound) {
        return Ok(PinnedMap::Overlapping);
    }
    let (uv, more) = relax_pinned(mesh, rest, pinned, &sound, scale, Some(BOUNDARY_REACH), settings, progress)?;
    Ok(PinnedMap::Relaxed { uv, iterations: iterations + more })
}

/// The map without flips, with the pinned vertices where they were; `None` where the flips do not yield. Where the boundary is
/// simple it stays as it is, if that is possible: what a pin has folded lies inside as a rule.
fn cleared(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    pinned: &[bool],
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    if first_flip(mesh, start).is_none() {
        return Ok(Some(start.to_vec()));
    }
    let border = || mesh.vertices().map(|v| pinned[v.index()] || mesh.is_boundary_vertex(v)).collect();
    let with_border: Option<Vec<bool>> = boundary_is_simple(mesh, start).then(border);
    for held in with_border.as_deref().into_iter().chain([pinned]) {
        let mut uv = clear_with_halves(mesh, rest, &OtherHalves::default(), held, start.to_vec(), progress)?;
        put_back(start, held, &mut uv);
        if first_flip(mesh, &uv).is_none() {
            return Ok(Some(uv));
        }
    }
    Ok(None)
}

/// How far apart the pinned points are: the root of their mean squared distance from their middle.
fn spread(uv: &[Point2<f64>], pinned: &[bool]) -> f64 {
    let points = || uv.iter().zip(pinned).filter(|p| *p.1).map(|(p, _)| p.coords);
    let count = points().count() as f64;
    let middle = points().sum::<Vector2<f64>>() / count;
    (points().map(|p| (p - middle).norm_squared()).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{grid, hemisphere};
    use crate::stretch::{TutteBoundary, l2_stretch, tutte_embedding};
    use nalgebra::{Point3, Rotation2};

    fn go(mesh: &TriMesh, start: &[Point2<f64>], pinned: &[bool]) -> PinnedMap {
        let rest = RestTriangle::of_mesh(mesh);
        let settings = StretchSettings { tolerance: 1e-8, max_iterations: 100, ..StretchSettings::default() };
        minimise_pinned(mesh, &rest, start, pinned, &settings, &Progress::new()).expect("runs")
    }

    fn relaxed(mesh: &TriMesh, start: &[Point2<f64>], pinned: &[bool]) -> Vec<Point2<f64>> {
        let PinnedMap::Relaxed { uv, iterations } = go(mesh, start, pinned) else { panic!("it can be relaxed") };
        assert!(iterations <= 300);
        assert_eq!(first_flip(mesh, &uv), None);
        assert!(boundary_is_simple(mesh, &uv));
        for v in (0..uv.len()).filter(|&v| pinned[v]) {
            assert_eq!(uv[v].coords.map(f64::to_bits), start[v].coords.map(f64::to_bits), "vertex {v} moved");
        }
        uv
    }

    fn marks(mesh: &TriMesh, is_pinned: impl Fn(Point3<f64>) -> bool) -> Vec<bool> {
        mesh.positions().iter().map(|&p| is_pinned(p)).collect()
    }

    #[test]
    fn what_is_pinned_stays_and_the_rest_relaxes_around_it() {
        let mesh = hemisphere(12);
        let rest = RestTriangle::of_mesh(&mesh);
        let start = tutte_embedding(&mesh, &rest, TutteBoundary::Circle, &Progress::new());
        let start = start.expect("solver").expect("positive");
        let before = l2_stretch(&mesh, &rest, &start);
        let few = relaxed(&mesh, &start, &marks(&mesh, |p| p.x.abs() > 0.99));
        let many = relaxed(&mesh, &start, &marks(&mesh, |p| p.z < 0.5));
        let [few, many] = [few, many].map(|uv| l2_stretch(&mesh, &rest, &uv));
        assert!(few < many && many < before, "{few} {many} {before}");
    }

    #[test]
    fn the_map_takes_the_scale_and_the_turn_that_two_pins_give_it() {
        // Two corners of a square are pulled apart, or pushed together, and turned: all follows, without any stretch.
        let mesh = grid(8, 8, |x, y| Point3::new(x - 4.0, y - 4.0, 0.0));
        let pinned = marks(&mesh, |p| p.x == p.y && p.x.abs() == 4.0);
        for (turn, scale) in [(0.3, 1.7), (0.0, 2.5), (-0.2, 0.8)] {
            let goal = |p: Point2<f64>| Rotation2::new(turn) * p * scale;
            let start: Vec<Point2<f64>> = (mesh.positions().iter().zip(&pinned))
                .map(|(p, is_pinned)| if *is_pinned { goal(p.xy()) } else { p.xy() * 0.7 })
                .collect();
            let uv = relaxed(&mesh, &start, &pinned);
            for (p, q) in mesh.positions().iter().zip(&uv) {
                assert!((goal(p.xy()) - q).norm() < 0.02, "{turn} {scale}: {p} {q}");
            }
        }
    }

    #[test]
    fn flips_around_a_pin_that_was_dragged_are_cleared() {
        let mesh = grid(10, 10, |x, y| Point3::new(x, y, 0.0));
        let corners = |p: Point3<f64>| (p.x == 0.0 || p.x == 10.0) && (p.y == 0.0 || p.y == 10.0);
        let dragged = |p: Point3<f64>| p.x == 4.0 && p.y == 5.0;
        let pinned = marks(&mesh, |p| corners(p) || dragged(p));
        let start: Vec<Point2<f64>> =
            (mesh.positions().iter()).map(|&p| if dragged(p) { Point2::new(6.3, 5.2) } else { p.xy() }).collect();
        assert!(first_flip(&mesh, &start).is_some());
        relaxed(&mesh, &start, &pinned);
    }

    #[test]
    fn pins_that_turn_a_triangle_over_or_lay_it_on_others_are_told() {
        let mesh = grid(4, 4, |x, y| Point3::new(x, y, 0.0));
        let rest: Vec<Point2<f64>> = mesh.positions().iter().map(|p| p.xy()).collect();
        let mut folded = rest.clone();
        folded.iter_mut().for_each(|p| p.x = (p.x - 2.0).abs());
        assert_eq!(go(&mesh, &folded, &vec![true; folded.len()]), PinnedMap::Flipped);
        // A strip that is wound over itself, both ends of which are pinned there.
        let strip = grid(80, 2, |x, y| Point3::new(x, y, 0.0));
        let wind = |p: &Point3<f64>| Point2::new((p.x / 5.0).cos(), -(p.x / 5.0).sin()) * (8.0 + p.y);
        let wound: Vec<Point2<f64>> = strip.positions().iter().map(wind).collect();
        assert_eq!(first_flip(&strip, &wound), None);
        let ends = marks(&strip, |p| p.x < 1.5 || p.x > 60.5);
        assert_eq!(go(&strip, &wound, &ends), PinnedMap::Overlapping);
    }

    #[test]
    fn a_boundary_that_would_run_over_itself_is_kept_apart() {
        // A ramp of more than a turn: laid out without stretch it overlaps itself.
        let mesh = grid(96, 4, |x, y| {
            let (angle, radius) = (0.1 * x, 4.0 - 0.5 * y);
            Point3::new(radius * angle.cos(), radius * angle.sin(), 0.12 * x)
        });
        let rest = RestTriangle::of_mesh(&mesh);
        let start = tutte_embedding(&mesh, &rest, TutteBoundary::Circle, &Progress::new());
        let start = start.expect("solver").expect("positive");
        let mut pinned = vec![false; start.len()];
        (pinned[0], pinned[1]) = (true, true);
        let uv = relaxed(&mesh, &start, &pinned);
        assert!(l2_stretch(&mesh, &rest, &uv) < l2_stretch(&mesh, &rest, &start));
    }

    #[test]
    fn stops_when_cancelled() {
        let mesh = hemisphere(4);
        let rest = RestTriangle::of_mesh(&mesh);
        let start: Vec<_> = mesh.positions().iter().map(|p| p.xy()).collect();
        let progress = Progress::new();
        progress.cancel();
        let pinned = vec![false; start.len()];
        let got = minimise_pinned(&mesh, &rest, &start, &pinned, &StretchSettings::default(), &progress);
        assert!(matches!(got, Err(StretchError::Cancelled(_))));
    }
}
