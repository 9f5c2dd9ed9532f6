//! Takes apart a boundary that runs over itself in a few places.
//!
//! A map carried over from a coarser mesh brings its boundary along, which there was a straight edge and here is a
//! path with turns of its own; where two stretches of it are near each other they may cross. The barrier keeps apart
//! only what is apart, so the boundary first retreats there into the chart.

use nalgebra::Point2;

use super::StretchError;
use super::foldover_free::foldover_free_near;
use super::neighbourhood::Neighbourhood;
use super::overlap::{boundary_crossings, boundary_is_simple, first_flip};
use crate::distortion::RestTriangle;
use crate::mesh::TriMesh;
use crate::progress::Progress;

/// Boundary edges that may cross others, as a share of all: beyond, the map is not nearly injective. Of 42 maps on seven
/// development models with a share between this and a tenth four were parted, after two fifths of all the time.
const MOST_CROSSING: f64 = 0.07;
/// Rounds of retreat; each reaches further into the chart than the one before.
const ROUNDS: usize = 6;
/// Rings around a crossing that give way in the first round, and more in each that follows.
const RINGS: usize = 3;
/// Times that each vertex there is moved to the middle of its neighbours, which takes a boundary vertex inwards.
const SWEEPS: usize = 4;

/// A map without flips whose boundary is simple, near one that has no flips but crossings; `None` where those are too many
/// or do not yield. O(n) a round.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
pub(crate) fn part_boundary(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let mut uv = start.to_vec();
    let mut before = usize::MAX;
    for round in 0..ROUNDS {
        progress.check()?;
        let crossing = boundary_crossings(mesh, &uv);
        if crossing.is_empty() {
            break;
        }
        // Two sheets that lie on each other cross as often wherever their borders are.
        if is_too_many(mesh, crossing.len()) || crossing.len() >= before {
            return Ok(None);
        }
        before = crossing.len();
        let mut bad = vec![false; mesh.face_count()];
        for h in crossing {
            bad[h.face().index()] = true;
        }
        Neighbourhood::new(mesh, rest, &bad, RINGS + round).relax(&mut uv, SWEEPS, true);
        if first_flip(mesh, &uv).is_some() {
            let Some(cleared) = foldover_free_near(mesh, rest, &uv, RINGS, progress)? else { return Ok(None) };
            uv = cleared;
        }
    }
    Ok(boundary_is_simple(mesh, &uv).then_some(uv))
}

/// Whether the boundary of a map crosses itself in more places than [`part_boundary`] tries to part. O(n log n).
#[must_use]
pub(crate) fn boundary_is_tangled(mesh: &TriMesh, uv: &[Point2<f64>]) -> bool {
    is_too_many(mesh, boundary_crossings(mesh, uv).len())
}

fn is_too_many(mesh: &TriMesh, crossing: usize) -> bool {
    crossing as f64 > MOST_CROSSING * mesh.halfedges().filter(|&h| mesh.is_boundary(h)).count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::grid;
    use nalgebra::Point3;

    /// A square with a slit from the middle of one side to its centre.
    fn slit() -> (TriMesh, Vec<Point2<f64>>) {
        let n = 30;
        let whole = grid(n, n, |x, y| Point3::new(x, y, 0.0));
        let middle = whole.position(whole.vertices().last().expect("a vertex")).x / 2.0;
        let faces: Vec<_> = whole.faces().collect();
        let on_line = |v| (whole.position(v).y - middle).abs() < 1e-9 && whole.position(v).x <= middle + 1e-9;
        let (mesh, _) = whole.submesh(&faces, |h| on_line(whole.from(h)) && on_line(whole.to(h)));
        let uv = mesh.positions().iter().map(|p| p.xy()).collect();
        (mesh, uv)
    }

    #[test]
    fn the_sides_of_a_slit_part() {
        let (mesh, mut uv) = slit();
        let rest = RestTriangle::of_mesh(&mesh);
        assert!(!boundary_is_simple(&mesh, &uv), "they coincide");
        // Open, but for a place where they cross.
        for h in mesh.halfedges().filter(|&h| mesh.is_boundary(h)) {
            let p = mesh.position(mesh.from(h));
            if p.y > 0.5 && p.y < 29.0 {
                let inside = mesh.position(mesh.from(h.prev())).y - p.y;
                let wave = if p.x > 5.5 && p.x < 9.5 { -0.2 * p.x.sin().abs() } else { 0.05 };
                uv[mesh.from(h).index()].y += wave * inside.signum();
            }
        }
        let parted = part_boundary(&mesh, &rest, &uv, &Progress::new()).expect("solver").expect("parted");
        assert!(boundary_is_simple(&mesh, &parted));
        assert_eq!(first_flip(&mesh, &parted), None);
        let far = mesh.vertices().filter(|v| mesh.position(*v).y < 3.0);
        assert!(far.into_iter().all(|v| parted[v.index()] == uv[v.index()]), "what is far away stays");
    }

    #[test]
    fn a_chart_wound_over_itself_is_left() {
        let strip = grid(80, 2, |x, y| Point3::new(x, y, 0.0));
        let rest = RestTriangle::of_mesh(&strip);
        let wound: Vec<_> = strip
            .positions()
            .iter()
            .map(|p| Point2::new((p.x / 5.0).cos(), -(p.x / 5.0).sin()) * (8.0 + p.y))
            .collect();
        assert!(boundary_is_tangled(&strip, &wound));
        assert_eq!(part_boundary(&strip, &rest, &wound, &Progress::new()).expect("solver"), None);
    }
}
