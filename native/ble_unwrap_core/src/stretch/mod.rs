//! Positions of a chart's vertices in the plane: injective, and with the least stretch.
//!
//! All of this works on one chart: a [`TriMesh`] that is connected, oriented and of genus 0, with one or
//! more boundary loops (holes), a [`RestTriangle`] for each face, and a point of the plane for each vertex,
//! in about the units of the surface.
//!
//! Terms. A face's map is *flipped* where its determinant is not positive. *Stretch* of a face is ½(1/σ₁² + 1/σ₂²)
//! squared, of a chart the root of its mean over the surface, at the chart's best scale. A map is *injective*
//! if no face is flipped and the boundary loops are simple ([`boundary_is_simple`]).
//!
//! The ways in: [`make_injective`] removes flips, [`minimise_stretch`] lowers the stretch without making
//! any, [`minimise_pinned`] does so while some vertices stay, [`bulge()`] tells where to cut before all that, [`tutte_embedding`] makes an injective map from nothing, [`first_flip`] and [`boundary_is_simple`] check exactly.
//!
//! Papers: Sander et al. 2001 (stretch, line searches), Smith and Schaefer 2015 (step limits, boundary
//! barrier), Smith et al. 2019 (closed-form Hessians), Garanzha et al. 2021 (flips), Tutte 1963 and Floater
//! 2003 (convex embeddings).

mod alignment;
mod barrier;
mod bulge;
mod convex_outline;
mod doubled_edge;
mod energy;
mod foldover_free;
mod grid;
mod injective;
mod laplacian;
mod line_search;
mod measure;
mod moving_boundary;
mod neighbourhood;
mod newton;
mod other_halves;
mod overlap;
mod part_boundary;
mod peaks;
mod pinned;
mod rectangle;
mod sides;
mod stitch;
mod straighten_sides;
mod system;
#[cfg(test)]
mod test_meshes;
mod tutte;
mod unbend;

use nalgebra::Point2;
use thiserror::Error;

pub(crate) use barrier::{BOUNDARY_REACH, boundary_is_tight};
pub(crate) use bulge::{Bulge, bulge, corners};
pub(crate) use doubled_edge::enclosed_vertex;
pub(crate) use injective::{Injective, clear_flips, clear_locally, make_injective};
pub(crate) use measure::{l2_of_positions, l2_stretch, l2_unsigned, linf_stretch, plane_area, surface_area};
pub(crate) use overlap::{boundary_is_simple, first_flip};
pub(crate) use part_boundary::{boundary_is_tangled, part_boundary};
pub(crate) use peaks::lower_peaks;
pub(crate) use pinned::{PinnedMap, minimise_pinned};
pub(crate) use rectangle::rectangle;
pub(crate) use stitch::Stitcher;
pub(crate) use straighten_sides::{aligned_length, straighten_sides};
pub(crate) use tutte::{TutteBoundary, tutte_embedding};
pub(crate) use unbend::unbend;

use crate::choice::choices;
use crate::distortion::RestTriangle;
use crate::linalg::SparseError;
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// The method by which stretch is minimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Solver {
    /// Projected Newton steps, which move all vertices at once.
    Newton,
    /// One vertex at a time is moved along random lines, as in the paper.
    LineSearch,
}

choices!(Solver {
    Newton: "newton", "Newton", "Projected Newton steps, which are fast.";
    LineSearch: "line_search", "Line Search", "One vertex at a time along random directions, as in the paper.";
});

/// How stretch is minimised, and when to stop.
#[derive(Clone, Debug, PartialEq)]
pub struct StretchSettings {
    /// The method.
    pub solver: Solver,
    /// Greatest number of Newton steps or, for line searches, of sweeps over all vertices.
    pub max_iterations: usize,
    /// The minimisation stops when an iteration lowers the energy by less than this share of it.
    pub tolerance: f64,
    /// Weight of the symmetric Dirichlet energy that is added to the L2 stretch, from 0 to 1; used only by Newton's method.
    /// A higher weight treats the worst triangles better, a lower one gives less L2 stretch. For instance, the L2 stretch
    /// of half a cat, half a fan disk and a camel's head is 1.114, 1.095 and 1.322 with weight 0.15; 1.107, 1.092 and 1.301
    /// with 0.05; and 1.099, 1.079 and 1.211 with 0, which takes up to four times as many steps.
    pub dirichlet_weight: f64,
}

impl Default for StretchSettings {
    fn default() -> Self {
        Self { solver: Solver::Newton, max_iterations: 40, tolerance: 1e-4, dirichlet_weight: 0.05 }
    }
}

impl StretchSettings {
    /// The paper's method: line searches on the L2 stretch alone.
    #[must_use]
    pub fn paper() -> Self {
        Self { solver: Solver::LineSearch, max_iterations: 60, tolerance: 1e-4, dirichlet_weight: 0.0 }
    }
}

/// What one call of [`minimise_stretch`] may be asked beyond the settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MinimiseOptions {
    /// Give up as soon as the chart's L2 stretch is clearly not going to come under this.
    pub abandon_above: Option<f64>,
    /// Keep the boundary from touching itself; the start must be simple. It begins to feel itself at this share of its
    /// edges' lengths; [`BOUNDARY_REACH`] is usual.
    pub keep_apart: Option<f64>,
    /// Seed of the random lines.
    pub seed: u64,
}

/// What [`minimise_stretch`] found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Minimised {
    /// A point a vertex, scaled to the area of the surface.
    pub uv: Vec<Point2<f64>>,
    /// L2 stretch at the chart's own best scale; at least 1.
    pub l2: f64,
    /// Newton steps or sweeps made.
    pub iterations: usize,
    /// Whether it was given up because of [`MinimiseOptions::abandon_above`].
    pub abandoned: bool,
    /// Under any limit below this it would have been given up, sooner or now, and under no other so far: −∞ where it came
    /// to rest before anything could be told.
    pub abandoned_below: f64,
    /// The map as it was when it could first have been given up, which does not depend on any limit; empty where it came to
    /// rest before, or no limit was set.
    pub early: Vec<Point2<f64>>,
    /// Whether the last iteration gained less than the tolerance.
    pub converged: bool,
}

/// Why a chart has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub(crate) enum StretchError {
    /// The computation was asked to stop, or is out of memory.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Two edges join the same two vertices (or one edge joins a vertex to itself): with straight edges the
    /// surface between them has no area. The chart must be cut there.
    #[error("two edges join {a} and {b}: no map with straight edges is injective")]
    DoubledEdge {
        /// One end of both edges.
        a: VertexId,
        /// The other end.
        b: VertexId,
    },
    /// The mesh is closed.
    #[error("the chart has no boundary")]
    NoBoundary,
    /// Every way to a map without flips was defeated by rounding.
    #[error("no map without flipped triangles was found")]
    NotInjective,
    /// The start of a minimisation has a flipped triangle.
    #[error("triangle {face} of the start is flipped")]
    FlippedStart {
        /// The first such face.
        face: FaceId,
    },
    /// The boundary was to be kept simple and is not.
    #[error("the boundary of the start touches itself")]
    OverlappingStart,
    /// The linear solver failed.
    #[error(transparent)]
    Solver(SparseError),
}

impl From<SparseError> for StretchError {
    fn from(error: SparseError) -> Self {
        match error {
            // No property of the chart: it must not be taken for one.
            SparseError::OutOfMemory(error) => Self::Cancelled(Cancelled::OutOfMemory(error)),
            other => Self::Solver(other),
        }
    }
}

/// Moves the vertices of a map without flips so that its stretch falls; no triangle ever flips (exact test),
/// and the result is never worse than the start in the energy minimised.
///
/// Minimises the area-normalised L2 stretch, with Newton mixed with some symmetric Dirichlet energy. The boundary is free;
/// unless [`MinimiseOptions::keep_apart`] is set it may come to overlap itself.
/// The minimum is local, but from Tutte's embedding and from other injective starts the same one is
/// commonly found. O(n^1.5) for a Newton step (about 0.2 s for 100,000 faces), O(n) a sweep.
///
/// # Errors
/// [`StretchError::FlippedStart`], [`StretchError::OverlappingStart`], [`StretchError::Solver`],
/// [`StretchError::Cancelled`].
///
/// # Panics
/// If there is not one rest triangle a face and one point a vertex.
pub(crate) fn minimise_stretch(
    mesh: &TriMesh,
    rest: &[RestTriangle],
    start: &[Point2<f64>],
    settings: &StretchSettings,
    options: &MinimiseOptions,
    progress: &Progress,
) -> Result<Minimised, StretchError> {
    assert_eq!(
        (rest.len(), start.len()),
        (mesh.face_count(), mesh.vertex_count()),
        "a rest triangle a face, a point a vertex"
    );
    if let Some(face) = first_flip(mesh, start) {
        return Err(StretchError::FlippedStart { face });
    }
    if options.keep_apart.is_some() && !boundary_is_simple(mesh, start) {
        return Err(StretchError::OverlappingStart);
    }
    let mut result = match settings.solver {
        Solver::Newton => newton::minimise(mesh, rest, start, settings, options, progress)?,
        Solver::LineSearch => line_search::minimise(mesh, rest, start, settings, options, progress)?,
    };
    let scale = (surface_area(rest) / plane_area(mesh, &result.uv)).sqrt();
    newton::rescale(mesh, &mut result.uv, scale, options.keep_apart.is_some());
    Ok(result)
}
