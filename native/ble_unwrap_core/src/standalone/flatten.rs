//! One patch flattened as a single chart, step by step: distances, embedding, flips removed, stretch minimised.

use nalgebra::Point2;
use rayon::prelude::*;
use thiserror::Error;

use crate::clock::Clock;
use crate::embedding::{EmbeddingError, Model};
use crate::error::UnwrapError;
use crate::error_kind::ErrorKind;
use crate::flattening::{Rung, Steps};
use crate::geodesics::{self, LandmarkDistances};
use crate::mesh::{self, MeshError, MeshInput, Surface, VertexId};
use crate::predicates::orientation;
use crate::progress::{Cancelled, Progress, Stage};
use crate::settings::{MOST_TOGETHER, Settings};
use crate::stretch::{self, BOUNDARY_REACH, StretchError};

/// Height, where the surface has area 1, up to which a face's lengths are rounding; such a face does not count.
const NEGLIGIBLE: f64 = 1e-8;

/// Why a patch cannot be flattened as a single chart. Numbers of elements count from 0, as the arrays do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FlattenError {
    /// The input arrays do not make a mesh.
    #[error(transparent)]
    Mesh(MeshError),
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] UnwrapError),
    /// The mesh has no faces.
    #[error("the mesh has no faces")]
    NoFaces,
    /// All faces are degenerate: lines or points.
    #[error("the surface has no area to speak of: no map of it to the plane means anything; remove it")]
    NoArea,
    /// A vertex of a face has a coordinate that is not finite.
    #[error("face {face} has a vertex with non-finite coordinates; correct the coordinates or remove the face")]
    NotFinite {
        /// The first such face.
        face: usize,
    },
    /// The surface consists of several pieces that no edge joins.
    #[error(
        "the surface comes in {pieces} pieces, one with face {first} and another with face {second}; flatten them one at a time, or use unwrap"
    )]
    Pieces {
        /// Number of pieces.
        pieces: usize,
        /// A face of one.
        first: usize,
        /// A face of another.
        second: usize,
    },
    /// The surface has no boundary.
    #[error("the surface is closed; remove faces to give it a boundary, or use unwrap, which cuts it into charts")]
    Closed,
    /// The surface has handles, so that it cannot be mapped to the plane without a cut.
    #[error("the surface has {genus} handles; cut them open, or use unwrap, which cuts it into charts")]
    Handles {
        /// Number of handles.
        genus: usize,
    },
    /// A vertex would need several places in the plane.
    #[error(
        "vertex {vertex} holds together parts of the surface that share no edge there, or lies where more than two faces meet at an edge or the surface is one-sided; split it, or use unwrap, which cuts there"
    )]
    Pinched {
        /// The first such vertex.
        vertex: usize,
    },
    /// Two edges join the same vertices.
    #[error("two edges join vertices {a} and {b}: no map with straight edges can part them; cut there, or use unwrap")]
    DoubledEdge {
        /// The vertex at one end of both edges.
        a: usize,
        /// The vertex at the other end.
        b: usize,
    },
    /// There would be more landmarks than can be handled, since the distances between all pairs of them are needed.
    #[error(
        "{landmarks} landmarks are more than the {MOST_TOGETHER} whose distances can be handled; lower landmark_fraction or landmark_max"
    )]
    TooManyLandmarks {
        /// The number of landmarks that the settings ask for.
        landmarks: usize,
    },
    /// The embedding failed.
    #[error(transparent)]
    Embedding(EmbeddingError),
    /// No map without flips was found, because rounding made every method fail.
    #[error("no map without flipped triangles was found")]
    NotInjective,
    /// A numerical method failed where it never should, which is a defect of this library. The text says what happened.
    #[error("{0}")]
    Internal(String),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl FlattenError {
    /// What kind of error this is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Mesh(error) => error.kind(),
            Self::Setting(error) => error.kind(),
            Self::NoFaces
            | Self::NoArea
            | Self::NotFinite { .. }
            | Self::Pieces { .. }
            | Self::Closed
            | Self::Handles { .. }
            | Self::Pinched { .. }
            | Self::DoubledEdge { .. }
            | Self::NotInjective => ErrorKind::Mesh,
            Self::TooManyLandmarks { .. } => ErrorKind::Argument,
            // The data are distances of the mesh: what is wrong with them is wrong with it.
            Self::Embedding(
                EmbeddingError::TooFewLandmarks { .. }
                | EmbeddingError::Unreachable { .. }
                | EmbeddingError::NoExtent
                | EmbeddingError::Collinear { .. },
            ) => ErrorKind::Mesh,
            Self::Embedding(error) => error.kind(),
            Self::Internal(_) => ErrorKind::Internal,
            Self::Cancelled(error) => error.kind(),
        }
    }
}

impl From<MeshError> for FlattenError {
    fn from(error: MeshError) -> Self {
        match error {
            MeshError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Mesh(other),
        }
    }
}

impl From<EmbeddingError> for FlattenError {
    fn from(error: EmbeddingError) -> Self {
        match error {
            EmbeddingError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Embedding(other),
        }
    }
}

/// How good a map from the surface to the plane is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapQuality {
    /// Number of triangles that are turned over or have no area. This number is exact.
    pub flips: usize,
    /// L2 stretch at the map's best scale, with each flipped triangle counted as its mirror image; infinite where a
    /// triangle of the map has no area.
    pub l2: f64,
    /// L-infinity stretch: the largest stretch of any triangle in any direction, where map and surface have the same area.
    /// Flipped triangles, and those without area, count as in `l2`.
    pub l_infinity: f64,
    /// Pearson's correlation between geodesic distances on the surface and distances in the plane, over all pairs of a
    /// landmark and another vertex. NaN where all distances are equal.
    pub distance_correlation: f64,
}

/// How a patch was flattened.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FlattenReport {
    /// The model of the embedding.
    pub model: Model,
    /// Number of vertices of the surface.
    pub vertices: usize,
    /// Number of triangles of the surface.
    pub triangles: usize,
    /// Number of landmarks; this is the number of vertices if all were embedded together.
    pub landmarks: usize,
    /// The kernel width σ, in units of squared distance.
    pub sigma: f64,
    /// Number of sweeps of the fit; 0 for Isomap.
    pub sweeps: usize,
    /// Whether the fit reached its tolerance.
    pub converged: bool,
    /// Log-likelihood (equation 4 of the paper) at the end; `None` for Isomap.
    pub log_likelihood: Option<f64>,
    /// The log-likelihood at the start and after each sweep.
    pub trace: Vec<f64>,
    /// The quality of the map as the embedding gave it.
    pub before: MapQuality,
    /// The quality of the map that is returned.
    pub after: MapQuality,
    /// The method that removed the flips: `embedding` if the embedding had none, else `foldover_free`, `tutte_shape` or
    /// `tutte_circle`.
    pub rung: &'static str,
    /// Number of iterations of the stretch minimisation; 0 if it was not asked for.
    pub stretch_iterations: usize,
    /// Whether the boundary of the result is simple. If it is, the map does not overlap itself, since it has no flips.
    pub boundary_is_simple: bool,
    /// Name and duration in seconds of each step, in order.
    pub seconds: Vec<(&'static str, f64)>,
}

/// A patch in the plane, before and after its stretch was minimised.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Flattening {
    /// A position for each vertex of the input as the embedding gave it, in the unit of the input and in a standard pose.
    /// Triangles may be flipped. NaN for vertices without faces.
    pub embedded: Vec<[f64; 2]>,
    /// A position for each vertex after flips were removed and, if asked for, stretch was minimised.
    pub uv: Vec<[f64; 2]>,
    /// What was done, and how good the result is.
    pub report: FlattenReport,
}

/// Flattens one connected patch of genus 0 with a boundary (holes allowed) as a single chart, whatever its stretch, and
/// shows the steps of the paper (section 5, figure 2): geodesic distances, embedding, removal of flips, minimisation of
/// stretch.
///
/// The embedding uses the landmarks that `settings.geodesics` asks for. It uses all vertices together where
/// `landmark_fraction` is 1 (whatever `landmark_min` and `landmark_max` are), or where the patch has at most
/// `settings.together_max` vertices. If `minimise` is false, the function stops once there are no flips.
///
/// Guaranteed: no triangle of `uv` is flipped. If stretch was minimised, the boundary is simple, too, unless the report
/// says otherwise: where the boundary came to overlap itself, the minimisation is repeated from a map to a circle, as in
/// [`unwrap`](crate::unwrap()). The result is the same for any number of threads. Not guaranteed: a bound on the stretch.
///
/// The cost is that of the steps, for n vertices: O(k n log n) for the distances from k landmarks, O(k³ + sweeps·k² + kn)
/// for the embedding, and a few dozen sparse linear systems of 2n unknowns for the stretch.
///
/// # Errors
/// [`FlattenError`] says what is wrong with the patch and what to do.
pub fn flatten(
    input: &MeshInput<'_>,
    minimise: bool,
    settings: &Settings,
    progress: &Progress,
) -> Result<Flattening, FlattenError> {
    progress.check()?;
    settings.validate()?;
    let mut clock = Clock::new();
    progress.enter(Stage::Condition);
    let surface = mesh::condition(input, &settings.conditioning(), progress)?;
    let vertex = one_patch(input, &surface)?;
    clock.lap("condition");

    progress.enter(Stage::Charts);
    let steps = Steps::new(&surface.mesh, settings, settings.seed, progress);
    let distances = distances(&steps, settings, progress)?;
    clock.lap("distances");
    progress.advance(Stage::Charts, 0.3);
    let chart = steps.embed(&distances)?;
    clock.lap("embedding");
    progress.advance(Stage::Charts, 0.6);
    let named = |error| stretch_error(error, &surface);
    let (mut uv, mut rung) = steps.remove_flips(&chart.uv).map_err(named)?;
    clock.lap("flips");
    progress.advance(Stage::Charts, 0.7);
    let mut stretch_iterations = 0;
    if minimise {
        let mut best = steps.minimise(&uv, None, None).map_err(named)?;
        stretch_iterations = best.iterations;
        if !steps.boundary_is_simple(&best.uv)
            && let Some(circle) = steps.on_circle().map_err(named)?
        {
            best = steps.minimise(&circle, None, Some(BOUNDARY_REACH)).map_err(named)?;
            stretch_iterations += best.iterations;
            rung = Rung::TutteCircle;
        }
        uv = best.uv;
    }
    clock.lap("stretch");

    progress.enter(Stage::Verify);
    let quality = |uv: &[Point2<f64>]| quality(&steps, &distances, uv);
    let report = FlattenReport {
        model: settings.embedding.model,
        vertices: surface.mesh.vertex_count(),
        triangles: surface.mesh.face_count(),
        landmarks: chart.landmarks,
        sigma: chart.sigma * surface.scale * surface.scale,
        sweeps: chart.sweeps,
        converged: chart.converged,
        log_likelihood: chart.log_likelihood,
        trace: chart.trace,
        before: quality(&chart.uv),
        after: quality(&uv),
        rung: rung.name(),
        stretch_iterations,
        boundary_is_simple: steps.boundary_is_simple(&uv),
        seconds: clock.into_laps(),
    };
    let to_input = |uv: &[Point2<f64>]| -> Vec<[f64; 2]> {
        let place =
            |v: &Option<VertexId>| v.map_or([f64::NAN; 2], |v| uv[v.index()].coords.map(|x| x * surface.scale).into());
        vertex.iter().map(place).collect()
    };
    Ok(Flattening { embedded: to_input(&chart.uv), uv: to_input(&uv), report })
}

/// The vertex of the surface that each vertex of the input is, if the surface is one patch that can be flattened.
fn one_patch(input: &MeshInput<'_>, surface: &Surface) -> Result<Vec<Option<VertexId>>, FlattenError> {
    let mesh = &surface.mesh;
    if let Some(&face) = surface.unmapped.first() {
        return Err(FlattenError::NotFinite { face: face as usize });
    }
    if mesh.face_count() == 0 {
        return Err(FlattenError::NoFaces);
    }
    // Conditioning scales to area 1 where there is more area than rounding makes of a line.
    if mesh::measure::total_area(mesh) < 0.5 {
        return Err(FlattenError::NoArea);
    }
    let (label, pieces) = mesh.components();
    if let Some(other) = label.iter().position(|l| *l != label[0]) {
        let [first, second] = [0, other].map(|f| surface.polygon[f] as usize);
        return Err(FlattenError::Pieces { pieces, first, second });
    }
    let topology = mesh.topology();
    if topology.genus() > 0 {
        return Err(FlattenError::Handles { genus: topology.genus() });
    }
    if topology.loops == 0 {
        return Err(FlattenError::Closed);
    }
    let mut vertex = vec![None; input.positions.len()];
    for (corner, v) in surface.places() {
        let of = input.corner_vertices[corner as usize] as usize;
        if vertex[of].replace(v).is_some_and(|other| other != v) {
            return Err(FlattenError::Pinched { vertex: of });
        }
    }
    Ok(vertex)
}

/// From all vertices or from landmarks, as the settings want it.
fn distances(steps: &Steps<'_>, settings: &Settings, progress: &Progress) -> Result<LandmarkDistances, FlattenError> {
    let (mesh, asked) = (steps.mesh, &settings.geodesics);
    let n = mesh.vertex_count();
    let all = asked.landmark_fraction >= 1.0 || n <= settings.together_max;
    let landmarks = if all { n } else { asked.landmark_count(n) };
    if landmarks > MOST_TOGETHER {
        return Err(FlattenError::TooManyLandmarks { landmarks });
    }
    if all {
        return Ok(steps.distances_between_all()?);
    }
    Ok(geodesics::landmark_distances(mesh, asked, progress)?)
}

/// An error of the stretch stage with the numbers of the input.
fn stretch_error(error: StretchError, surface: &Surface) -> FlattenError {
    let of = |v: VertexId| surface.vertex[v.index()] as usize;
    match error {
        StretchError::Cancelled(cancelled) => FlattenError::Cancelled(cancelled),
        StretchError::DoubledEdge { a, b } => FlattenError::DoubledEdge { a: of(a), b: of(b) },
        StretchError::NotInjective => FlattenError::NotInjective,
        other => FlattenError::Internal(other.to_string()),
    }
}

fn quality(steps: &Steps<'_>, distances: &LandmarkDistances, uv: &[Point2<f64>]) -> MapQuality {
    let mesh = steps.mesh;
    let corners = |f| mesh.triangle(f).map(|v| uv[v.index()]);
    let turned = |[a, b, c]: [Point2<f64>; 3]| {
        let sign = orientation(a, b, c);
        sign.is_nan() || sign <= 0.0
    };
    let rest_l_infinity = {
        let least = mesh
            .faces()
            .map(|f| crate::distortion::singular_values(&steps.rest[f.index()].jacobian(corners(f)))[1])
            .fold(f64::INFINITY, f64::min);
        let plane: f64 = mesh.faces().map(|f| 0.5 * crate::distortion::signed_double_area(corners(f)).abs()).sum();
        (plane / stretch::surface_area(&steps.rest)).sqrt() / least
    };
    MapQuality {
        flips: mesh.faces().filter(|&f| turned(corners(f))).count(),
        l2: stretch::l2_unsigned(mesh, uv, NEGLIGIBLE),
        l_infinity: rest_l_infinity,
        distance_correlation: distance_correlation(distances, uv),
    }
}

/// Pearson's correlation over all pairs of a landmark and another vertex. Sums by rows, in order.
fn distance_correlation(distances: &LandmarkDistances, uv: &[Point2<f64>]) -> f64 {
    let pairs = |l: usize| {
        let landmark = distances.landmarks()[l];
        let row = distances.row(l).iter().enumerate().filter(move |(v, _)| *v != landmark.index());
        row.map(move |(v, &d)| [f64::from(d), (uv[v] - uv[landmark.index()]).norm()])
    };
    let total = |term: &(dyn Fn([f64; 2]) -> [f64; 3] + Sync)| -> [f64; 3] {
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        let rows: Vec<[f64; 3]> =
            (0..distances.len()).into_par_iter().map(|l| pairs(l).map(term).fold([0.0; 3], add)).collect();
        rows.into_iter().fold([0.0; 3], add)
    };
    let [sum_d, sum_e, count] = total(&|[d, e]| [d, e, 1.0]);
    let (mean_d, mean_e) = (sum_d / count, sum_e / count);
    let [dd, de, ee] = total(&|[d, e]| {
        let (d, e) = (d - mean_d, e - mean_e);
        [d * d, d * e, e * e]
    });
    de / (dd * ee).sqrt()
}

#[cfg(test)]
#[path = "flatten/tests.rs"]
mod tests;
