//! From any start to a map without flips.

use nalgebra::Point2;

use super::StretchError;
use super::foldover_free::{collapsed, foldover_free, foldover_free_near, is_collapsed};
use super::measure::{plane_area, rescale_to_equal_area};
use super::neighbourhood::Neighbourhood;
use super::overlap::first_flip;
use super::tutte::{TutteBoundary, tutte_attempt};
use crate::distortion::RestTriangle;
use crate::mesh::TriMesh;
use crate::progress::Progress;

/// Up to this share of flipped triangles, they are cleared in their neighbourhoods. Otherwise all vertices move, which clears hardly
/// a map that resists in its neighbourhoods.
const FEW_FLIPS: f64 = 0.1;
/// So many flipped triangles are cleared in their neighbourhoods whatever their share is.
const ALWAYS_FEW: usize = 8;
/// Rings in a neighbourhood of flips; the second only where the first was too narrow.
const NEIGHBOURHOODS: [usize; 2] = [3, 8];
/// Each neighbourhood is smoothed first, by so many sweeps: a fold that hangs together is spread over it.
const SWEEPS: usize = 30;

/// How a map came to have no flips; each rung of the ladder is tried only if those before it failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Injective {
    /// The start had none (or was all mirrored).
    AlreadyWas,
    /// A regularised energy cleared them.
    FoldoverFree,
    /// Tutte's embedding in the convexified outline of the start.
    TutteShape,
    /// Tutte's embedding in a circle.
    TutteCircle,
}

/// A point a vertex, without flips, and how they were got.
pub(crate) type InjectiveMap = (Vec<Point2<f64>>, Injective);

/// A map near `start` (a point a vertex, in about surface units) with all triangles strictly positive by an exact test, and how
/// it was got.
///
/// Not guaranteed: that the boundary does not overlap itself, except after Tutte; see
/// [`boundary_is_simple`](super::boundary_is_simple). Always ends; at worst some hundred sparse factorisations.
///
/// # Errors
/// [`StretchError::DoubledEdge`] where no such map exists, [`StretchError::NotInjective`] where rounding
/// defeated every rung (a tentacle a billion times deeper than its mouth), the others as named.
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
pub(crate) fn make_injective(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    progress: &Progress,
) -> Result<InjectiveMap, StretchError> {
    assert_eq!(
        (rest.len(), start.len()),
        (mesh.face_count(), mesh.vertex_count()),
        "a rest triangle a face, a point a vertex"
    );
    if let Some(found) = clear_flips(mesh, rest, start, progress)? {
        return Ok(found);
    }
    let rungs = [(TutteBoundary::Shape(start), Injective::TutteShape), (TutteBoundary::Circle, Injective::TutteCircle)];
    for (boundary, rung) in rungs {
        let Some(mut uv) = tutte_attempt(mesh, rest, boundary, progress)? else { continue };
        if first_flip(mesh, &uv).is_none() {
            return Ok((uv, rung));
        }
        // Rounding flipped a few of the smallest triangles: a case for the regularised energy.
        rescale_to_equal_area(mesh, rest, &mut uv);
        if uv.iter().all(|p| p.x.is_finite() && p.y.is_finite())
            && let Some(uv) = foldover_free(mesh, rest, &uv, progress)?
        {
            return Ok((uv, rung));
        }
    }
    Err(StretchError::NotInjective)
}

/// The first rungs of [`make_injective`]: the start if it has no flips, or with its flips cleared; `None` if they resist, as
/// they do where the start is far from any flat map.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
pub(crate) fn clear_flips(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    progress: &Progress,
) -> Result<Option<InjectiveMap>, StretchError> {
    progress.check()?;
    if first_flip(mesh, start).is_none() {
        let better = clear_locally(mesh, rest, start, progress)?;
        return Ok(Some((better.unwrap_or_else(|| start.to_vec()), Injective::AlreadyWas)));
    }
    if !start.iter().all(|p| p.x.is_finite() && p.y.is_finite()) {
        return Ok(None);
    }
    let mut start = start.to_vec();
    if plane_area(mesh, &start) < 0.0 {
        start.iter_mut().for_each(|p| p.x = -p.x);
        if first_flip(mesh, &start).is_none() {
            return Ok(Some((start, Injective::AlreadyWas)));
        }
    }
    let cleared = if are_few(collapsed(mesh, rest, &start), mesh) {
        clear_locally(mesh, rest, &start, progress)?
    } else {
        foldover_free(mesh, rest, &start, progress)?
    };
    Ok(cleared.map(|uv| (uv, Injective::FoldoverFree)))
}

/// The map with its flipped or collapsed triangles cleared, each in its neighbourhood, and as it is if it has none; `None`
/// if they are more than a few, or resist. Costs little where they are few.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
pub(crate) fn clear_locally(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let count = collapsed(mesh, rest, start);
    if count == 0 {
        return Ok(first_flip(mesh, start).is_none().then(|| start.to_vec()));
    }
    if !are_few(count, mesh) {
        return Ok(None);
    }
    let bad: Vec<bool> = mesh.faces().map(|f| is_collapsed(mesh, rest, start, f)).collect();
    for rings in NEIGHBOURHOODS {
        let mut smooth = start.to_vec();
        Neighbourhood::new(mesh, rest, &bad, rings).relax(&mut smooth, SWEEPS, false);
        if let Some(uv) = foldover_free_near(mesh, rest, &smooth, rings, progress)? {
            return Ok(Some(uv));
        }
    }
    Ok(None)
}

fn are_few(count: usize, mesh: &TriMesh) -> bool {
    count <= ALWAYS_FEW || count as f64 <= FEW_FLIPS * mesh.face_count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::test_meshes::{annulus, grid, hemisphere};
    use nalgebra::Point3;

    #[test]
    fn takes_the_first_rung_that_holds() {
        let mesh = grid(6, 6, |x, y| Point3::new(x, y, 0.0));
        let rest = RestTriangle::of_mesh(&mesh);
        let go = |uv: &[Point2<f64>]| make_injective(&mesh, &rest, uv, &Progress::new()).expect("injective");
        let flat: Vec<_> = mesh.positions().iter().map(|p| p.xy()).collect();
        assert_eq!(go(&flat), (flat.clone(), Injective::AlreadyWas));
        let mirrored: Vec<_> = flat.iter().map(|p| Point2::new(-p.x, p.y)).collect();
        assert_eq!(go(&mirrored).1, Injective::AlreadyWas);
        let folded: Vec<_> = flat.iter().map(|p| Point2::new((p.x - 2.0).abs(), p.y)).collect();
        assert_eq!(go(&folded).1, Injective::FoldoverFree);
        let nothing = vec![Point2::new(f64::NAN, 0.0); flat.len()];
        assert_eq!(go(&nothing).1, Injective::TutteCircle);
    }

    #[test]
    fn any_start_ends_without_flips() {
        for mesh in [hemisphere(8), annulus(17, 3), grid(30, 1, |x, y| Point3::new(x, y, 0.0))] {
            let rest = RestTriangle::of_mesh(&mesh);
            let n = mesh.vertex_count();
            let starts = [
                vec![Point2::origin(); n],
                (0..n).map(|i| Point2::new(i as f64, 0.0)).collect(),
                (0..n).map(|i| Point2::new((i * 7919 % 101) as f64 * 1e6, (i * 104_729 % 97) as f64 * 1e-6)).collect(),
                vec![Point2::new(f64::INFINITY, 1.0); n],
            ];
            for start in &starts {
                let (uv, _) = make_injective(&mesh, &rest, start, &Progress::new()).expect("injective");
                assert_eq!(first_flip(&mesh, &uv), None);
            }
        }
    }

    #[test]
    fn stops_when_cancelled() {
        let mesh = hemisphere(4);
        let progress = Progress::new();
        progress.cancel();
        let start = vec![Point2::origin(); mesh.vertex_count()];
        let result = make_injective(&mesh, &RestTriangle::of_mesh(&mesh), &start, &progress);
        assert!(matches!(result, Err(StretchError::Cancelled(_))));
    }
}
