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

/// A map whose quads are less bent.
#[derive(Clone, Debug, PartialEq)]
pub struct Unbent {
    /// A point a vertex.
    pub uv: Vec<Point2<f64>>,
    /// Convex quads that are bent still.
    pub left: usize,
}

/// Moves the vertices near quads that are convex on the surface and bent in the plane, until they are convex there, too.
///
/// `start` must be without flips and have a simple boundary; so has the result, by exact tests, and it has fewer bent quads.
/// `None` where no quad is bent, or none can be mended. O(n) where none is; else what lies around them is minimised anew.
///
/// # Errors
/// [`StretchError::Solver`], [`StretchError::Cancelled`].
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
pub fn unbend(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    quads: Vec<Quad>,
    start: &[Point2<f64>],
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
    let before = halves.bent(&uv).len();
    let mut left = before;
    for rings in RINGS {
        if left == 0 {
            break;
        }
        if let Some(better) = mend(mesh, rest, &halves, &uv, rings, settings, progress)? {
            left = halves.bent(&better).len();
            uv = better;
        }
    }
    Ok((left < before).then_some(Unbent { uv, left }))
}

/// Mends the neighbourhoods of all bent quads at once; `None` where fewer are not left.
fn mend(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    halves: &OtherHalves,
    uv: &[Point2<f64>],
    rings: usize,
    settings: &StretchSettings,
    progress: &Progress,
) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
    let bent = halves.bent(uv);
    let mut bad = vec![false; mesh.face_count()];
    for quad in bent.iter().map(|&k| halves.quads()[k]) {
        for h in [quad.diagonal, mesh.twin(quad.diagonal)] {
            bad[h.face().index()] = true;
        }
    }
    let near = Neighbourhood::new(mesh, rest, &bad, rings);
    let within = halves.part(mesh, &near);
    let border: Vec<bool> =
        near.mesh.vertices().map(|v| near.pinned[v.index()] || near.mesh.is_boundary_vertex(v)).collect();
    // Where a border that moves would run over another it stays.
    for pinned in [&near.pinned, &border] {
        let cleared = clear_with_halves(&near.mesh, &near.rest, &within, pinned, near.read(uv), progress)?;
        if first_flip(&near.mesh, &cleared).is_some() {
            continue;
        }
        let kept = within.without_bent(&cleared);
        let relaxed = relax_with_halves(&near.mesh, &near.rest, &kept, pinned, cleared, settings, progress)?;
        let mut moved = uv.to_vec();
        near.write(&relaxed, &mut moved);
        if first_flip(mesh, &moved).is_none()
            && halves.bent(&moved).len() < bent.len()
            && boundary_is_simple(mesh, &moved)
        {
            return Ok(Some(moved));
        }
    }
    Ok(None)
}
