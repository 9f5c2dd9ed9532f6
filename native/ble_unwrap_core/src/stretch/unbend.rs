//! Makes the quads of a chart convex in the plane that are convex on the surface.
//!
//! The stretch of a map sees each quad as the two triangles of one diagonal: nothing keeps the other two from being turned
//! over. Where one is, it becomes an element of the energy around there, and so do the other halves of all quads nearby: what
//! is turned over is cleared as a flip is, and what is not cannot become so in the minimisation that follows.

use nalgebra::Point2;

use super::foldover_free::clear_with_halves;
use super::measure::{plane_area, surface_area};
use super::neighbourhood::Neighbourhood;
use super::newton::{relax_with_halves, rescale};
use super::other_halves::OtherHalves;
use super::overlap::{boundary_is_simple, first_flip};
use super::{StretchError, StretchSettings};
use crate::distortion::RestTriangle;
use crate::mesh::{Quad, TriMesh};
use crate::progress::Progress;

/// So many rings round the bent quads move; more only where that was too narrow.
const RINGS: [usize; 3] = [2, 5, 12];
/// What the other halves count beside the faces, area by area: at first as much, and less where that takes a chart over
/// its limit.
const WEIGHTS: [f64; 3] = [1.0, 0.1, 0.01];
/// So many quads at most that are bent after all have been mended together are mended one by one.
const MOST_SINGLY: usize = 16;
/// What the other halves count there.
const SINGLE_WEIGHTS: [f64; 3] = [0.01, 1.0, 100.0];
/// Quads that are crowded but not bent are left alone where they are more than this share of all: that is then how the surface
/// is, and relaxing them would cost as much as another minimisation of the chart.
const MOST_CROWDED: f64 = 0.1;
/// So many crowded quads are relaxed whatever their share is, since that costs next to nothing.
const ALWAYS_FEW: f64 = 50.0;

/// A map whose quads are less bent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Unbent {
    /// A point a vertex.
    pub uv: Vec<Point2<f64>>,
    /// Convex quads that are bent still.
    pub left: usize,
}

/// Moves the vertices near quads that are convex on the surface and bent in the plane, until they are convex there, too. Quads
/// that are all but bent, one of their halves by the other diagonal being stretched far more than the faces there, are relaxed.
///
/// `start` must be without flips and have a simple boundary; so has the result, by exact tests, and it has no more bent quads.
/// `is_allowed` tells of a map whether it may be had: whether its stretch is under a limit. `None` where there is nothing to
/// mend, or it may not be. O(n) where there is nothing; else what lies around is minimised anew.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
pub(crate) fn unbend(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    quads: &[Quad],
    start: &[Point2<f64>],
    is_allowed: &dyn Fn(&[Point2<f64>]) -> bool,
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<Option<Unbent>, StretchError> {
    assert_eq!(
        (rest.len(), start.len()),
        (mesh.face_count(), mesh.vertex_count()),
        "a rest triangle a face, a point a vertex"
    );
    let halves = OtherHalves::new(mesh, quads);
    let mut uv = start.to_vec();
    let scale = (surface_area(rest) / plane_area(mesh, &uv)).sqrt();
    rescale(mesh, &mut uv, scale, true);
    let bent = halves.bent(&uv);
    let mut bad = halves.crowded(mesh, rest, &uv);
    if (bad.len() - bent.len()) as f64 > (MOST_CROWDED * quads.len() as f64).max(ALWAYS_FEW) {
        bad.clone_from(&bent);
    }
    if bad.is_empty() {
        return Ok(None);
    }
    let mut mending = Mending { mesh, rest, halves: halves.clone(), settings, progress };
    let mut best = None;
    for weight in WEIGHTS {
        mending.halves = halves.weighing(weight);
        let is_lightest = weight == WEIGHTS[WEIGHTS.len() - 1];
        best = mending.allowed(mending.mend(&uv, &bad)?, is_lightest, is_allowed)?;
        if best.is_some() {
            break;
        }
    }
    // What can be had of those that are left.
    let left = halves.bent(best.as_ref().unwrap_or(&uv));
    for &quad in left.iter().take(MOST_SINGLY) {
        for weight in SINGLE_WEIGHTS {
            let from = best.as_ref().unwrap_or(&uv);
            if halves.is_bent(quad, from) {
                mending.halves = halves.weighing(weight);
                best = mending.allowed(mending.mend(from, &[quad])?, true, is_allowed)?.or(best);
            }
        }
    }
    Ok(best.map(|uv| Unbent { left: halves.bent(&uv).len(), uv }))
}

/// What mending works on.
struct Mending<'a> {
    mesh: &'a TriMesh,
    rest: &'a [RestTriangle],
    halves: OtherHalves,
    settings: &'a StretchSettings,
    progress: &'a Progress,
}

impl Mending<'_> {
    /// Mends some quads; those that are crowded still once more, and those that are bent still as often as there are wider
    /// neighbourhoods. `None` where nothing gets better.
    fn mend(&self, uv: &[Point2<f64>], quads: &[usize]) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        let mut best = self.mend_near(uv, quads, RINGS[0])?;
        for (round, &rings) in RINGS.iter().enumerate().skip(1) {
            let from = best.as_deref().unwrap_or(uv);
            let crowded = self.halves.crowded(self.mesh, self.rest, from);
            let is_left =
                |quad: &usize| self.halves.is_bent(*quad, from) || round == 1 && crowded.binary_search(quad).is_ok();
            let left: Vec<usize> = quads.iter().copied().filter(is_left).collect();
            if left.is_empty() {
                break;
            }
            best = self.mend_near(from, &left, rings)?.or(best);
        }
        Ok(best)
    }

    /// How many quads are bent, and how many of these and the crowded ones there are.
    fn faults(&self, uv: &[Point2<f64>]) -> (usize, usize) {
        (self.halves.bent(uv).len(), self.halves.crowded(self.mesh, self.rest, uv).len())
    }

    /// Mends the neighbourhoods of some quads, all at once; `None` where there are no fewer faults then.
    fn mend_near(
        &self,
        uv: &[Point2<f64>],
        quads: &[usize],
        rings: usize,
    ) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        let mut bad = vec![false; self.mesh.face_count()];
        for quad in quads.iter().map(|&k| self.halves.quads()[k]) {
            for h in [quad.diagonal, self.mesh.twin(quad.diagonal)] {
                bad[h.face().index()] = true;
            }
        }
        let near = Neighbourhood::new(self.mesh, self.rest, &bad, rings);
        let within = self.halves.part(self.mesh, &near);
        let border = near.pinned_and_border();
        let faults = self.faults(uv);
        // Where a border that moves would run over another it stays.
        for pinned in [&near.pinned, &border] {
            // Cleared by what both diagonals ask for alike, whatever they count afterwards.
            let alike = within.weighing(1.0);
            let cleared = clear_with_halves(&near.mesh, &near.rest, &alike, pinned, near.read(uv), self.progress)?;
            if first_flip(&near.mesh, &cleared).is_some() {
                continue;
            }
            let kept = within.without_bent(&cleared);
            let relaxed =
                relax_with_halves(&near.mesh, &near.rest, &kept, pinned, cleared, self.settings, self.progress)?;
            let mut moved = uv.to_vec();
            near.write(&relaxed, &mut moved);
            if first_flip(self.mesh, &moved).is_none()
                && self.faults(&moved) < faults
                && boundary_is_simple(self.mesh, &moved)
            {
                return Ok(Some(moved));
            }
        }
        Ok(None)
    }

    /// A mended map if it may be had, or if it may be had once the whole has less stretch, where that is to be tried.
    fn allowed(
        &self,
        mended: Option<Vec<Point2<f64>>>,
        settles: bool,
        is_allowed: &dyn Fn(&[Point2<f64>]) -> bool,
    ) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        match mended {
            Some(uv) if is_allowed(&uv) => Ok(Some(uv)),
            Some(uv) if settles => Ok(self.settle(&uv)?.filter(|uv| is_allowed(uv))),
            _ => Ok(None),
        }
    }

    /// The whole map with less stretch, its quads as they are: by the plain stretch, since every bit counts here.
    fn settle(&self, uv: &[Point2<f64>]) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        let kept = self.halves.without_bent(uv);
        let plain = StretchSettings { dirichlet_weight: 0.0, ..self.settings.clone() };
        let settled = relax_with_halves(self.mesh, self.rest, &kept, &[], uv.to_vec(), &plain, self.progress)?;
        let is_good = first_flip(self.mesh, &settled).is_none()
            && self.halves.bent(&settled).len() <= self.halves.bent(uv).len()
            && boundary_is_simple(self.mesh, &settled);
        Ok(is_good.then_some(settled))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stretch::minimise_stretch;
    use crate::stretch::test_meshes::grid;
    use nalgebra::{Point3, Vector2};

    /// A flat sheet, its quads, and where its vertices are.
    fn sheet(n: usize) -> (TriMesh, Vec<Quad>, Vec<Point2<f64>>) {
        let mesh = grid(n, n, |x, y| Point3::new(x, y, 0.0));
        let polygon: Vec<u32> = mesh.faces().map(|f| f.index() as u32 / 2).collect();
        let quads: Vec<Quad> = Quad::all(&mesh, &polygon).collect();
        assert_eq!(quads.len(), n * n);
        let flat = mesh.positions().iter().map(|p| p.xy()).collect();
        (mesh, quads, flat)
    }

    /// The map with the vertex at (x, y) pushed by `by` along both axes.
    fn pushed(flat: &[Point2<f64>], x: f64, y: f64, by: f64) -> Vec<Point2<f64>> {
        let moved = |p: &Point2<f64>| if *p == Point2::new(x, y) { p + Vector2::new(by, by) } else { *p };
        flat.iter().map(moved).collect()
    }

    fn bent(mesh: &TriMesh, quads: &[Quad], uv: &[Point2<f64>]) -> usize {
        OtherHalves::new(mesh, quads).bent(uv).len()
    }

    #[test]
    fn a_bent_quad_becomes_convex_and_the_rest_stays() {
        let (mesh, quads, flat) = sheet(24);
        let rest = RestTriangle::of_mesh(&mesh);
        // Inside, at the border and in a corner of the sheet: over the middle of the quad, whose own diagonal it lies on.
        for (x, y) in [(4.0, 4.0), (4.0, 0.0), (0.0, 0.0)] {
            let start = pushed(&flat, x, y, 0.6);
            assert_eq!((bent(&mesh, &quads, &start), first_flip(&mesh, &start)), (1, None), "nothing to mend");
            let settings = StretchSettings::default();
            let got = unbend(&mesh, &rest, &quads, &start, &|_| true, &settings, &Progress::new()).expect("runs");
            let got = got.expect("a mended map");
            assert_eq!((got.left, bent(&mesh, &quads, &got.uv)), (0, 0));
            assert!(first_flip(&mesh, &got.uv).is_none() && boundary_is_simple(&mesh, &got.uv));
            let far = |p: &Point2<f64>| p.x > 16.0 || p.y > 16.0;
            let scale = got.uv[24].x / start[24].x;
            assert!((scale - 1.0).abs() < 1e-3);
            let stays = |(p, q): (&Point2<f64>, &Point2<f64>)| !far(p) || (p * scale - q).norm() < 1e-9;
            assert!(start.iter().zip(&got.uv).all(stays));
        }
    }

    #[test]
    fn a_map_without_bent_quads_is_left_alone() {
        let (mesh, quads, flat) = sheet(6);
        let rest = RestTriangle::of_mesh(&mesh);
        let settings = StretchSettings::default();
        for start in [flat.clone(), pushed(&flat, 2.0, 2.0, 0.2)] {
            let got = unbend(&mesh, &rest, &quads, &start, &|_| true, &settings, &Progress::new());
            assert_eq!(got, Ok(None));
        }
        assert_eq!(unbend(&mesh, &rest, &[], &flat, &|_| true, &settings, &Progress::new()), Ok(None));
    }

    #[test]
    fn a_map_that_may_not_be_had_is_not_taken() {
        let (mesh, quads, flat) = sheet(8);
        let rest = RestTriangle::of_mesh(&mesh);
        let start = pushed(&flat, 4.0, 4.0, 0.6);
        let settings = StretchSettings::default();
        let with = |is_allowed: &dyn Fn(&[Point2<f64>]) -> bool| {
            unbend(&mesh, &rest, &quads, &start, is_allowed, &settings, &Progress::new()).expect("runs")
        };
        assert_eq!(with(&|_| false), None);
        // Only the plainest stretch, of the whole sheet, comes so near to none.
        let limit = 1.0 + 1e-9;
        let got = with(&|uv| crate::stretch::l2_stretch(&mesh, &rest, uv) <= limit).expect("flat");
        assert_eq!(got.left, 0);
    }

    #[test]
    fn many_bent_quads_are_mended_at_once_and_cost_no_stretch() {
        let (mesh, quads, flat) = sheet(12);
        let rest = RestTriangle::of_mesh(&mesh);
        let start: Vec<_> = (0..3).fold(flat, |uv, k| {
            let at = f64::from(2 + 4 * k);
            (0..3).fold(uv, |uv, l| pushed(&uv, at, f64::from(2 + 4 * l), 0.7))
        });
        assert_eq!(bent(&mesh, &quads, &start), 9);
        let settings = StretchSettings::default();
        let got = unbend(&mesh, &rest, &quads, &start, &|_| true, &settings, &Progress::new()).expect("runs");
        let got = got.expect("a mended map");
        assert_eq!(got.left, 0);
        let least = minimise_stretch(&mesh, &rest, &got.uv, &settings, &Default::default(), &Progress::new());
        let l2 = crate::stretch::l2_stretch(&mesh, &rest, &got.uv);
        assert!(l2 < 1.001 * least.expect("runs").l2, "{l2}");
    }
}
