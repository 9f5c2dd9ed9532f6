//! One part of an island, connected over edges: its stretch lowered, and the result laid where it was.

use nalgebra::{Point2, Rotation2, Vector2};
use thiserror::Error;

use crate::distortion::RestTriangle;
use crate::embedding::EmbeddingError;
use crate::flattening::Steps;
use crate::geodesics;
use crate::mesh::{self, TriMesh};
use crate::progress::{Cancelled, Progress};
use crate::rounding::{Rounding, RoundingError, round_to_f32};
use crate::settings::{Settings, Solver, StretchSettings};
use crate::stretch::{self, BOUNDARY_REACH, MinimiseOptions, PinnedMap, StretchError, TutteBoundary};

/// Triangles flatter than [`RestTriangle::MIN_HEIGHT`] are relaxed as if they had that height. A part that has less than
/// this share of the area it then gets is nothing but such triangles.
const LEAST_AREA: f64 = 0.05;

/// Why an island was left as it was. The text completes the sentence "It was left as it was, because …".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LeftAsItWas {
    /// None of its vertices is free to move.
    #[error("all of it is pinned")]
    AllPinned,
    /// It has triangles that are turned over or have no area, and they remain so while the pinned vertices stay.
    #[error("its pinned vertices turn faces over")]
    PinsTurnFacesOver,
    /// It overlaps itself, and goes on to do so while the pinned vertices stay.
    #[error("it overlaps itself, which its pinned vertices do not let it end")]
    PinsOverlap,
    /// It has no border: no surface that is closed lies in the plane.
    #[error("it has no border; give it seams and unwrap it")]
    Closed,
    /// It has handles: no such surface lies in the plane, either.
    #[error("it has handles, so that it cannot lie flat; give it seams and unwrap it")]
    Handles,
    /// Its parts are joined at a vertex only, at which it touches itself.
    #[error("it touches itself at a single vertex")]
    Pinched {
        /// The first such vertex.
        vertex: usize,
    },
    /// None of its vertices is pinned, but its parts, which are joined at vertices only, are held there, and cannot be relaxed so.
    #[error("its parts, which are joined at single vertices only, hold each other as they are")]
    PartsHold,
    /// Its parts, which are joined at vertices only, would overlap each other.
    #[error("its parts, which are joined at single vertices only, would overlap each other")]
    PartsOverlap,
    /// Two edges join the same vertices.
    #[error("two of its edges join the same two vertices, and no map with straight edges parts them")]
    DoubledEdge {
        /// The vertex at one end of both edges.
        a: usize,
        /// The vertex at the other end.
        b: usize,
    },
    /// An edge has no length on the surface, but one in the map.
    #[error("an edge of it has no length on the surface, but one in the map; merge its vertices")]
    EdgeOfNoLength {
        /// A vertex at one end.
        vertex: usize,
    },
    /// It has no area on the surface.
    #[error("its faces have no area")]
    NoSurface,
    /// It has no area in the map, so there is no size that it could keep.
    #[error("it has no area in the map; unwrap it")]
    NoAreaInMap,
    /// No map without flips was found, because rounding made every method fail.
    #[error("no map of it without faces that are turned over was found")]
    Unsolved,
    /// Rounded to single precision, the result has triangles that are turned over, or overlaps itself.
    #[error("it is too small for the precision of UVs")]
    TooSmall,
}

impl LeftAsItWas {
    /// The reason why an island is left that was held, if it was held by its own parts and not by pins.
    pub(super) fn without_pins(self) -> Self {
        match self {
            Self::AllPinned | Self::PinsTurnFacesOver | Self::PinsOverlap => Self::PartsHold,
            other => other,
        }
    }

    /// The vertices of the input at which the reason is found, where it is found at single ones.
    #[must_use]
    pub fn vertices(&self) -> Vec<usize> {
        match *self {
            Self::Pinched { vertex } | Self::EdgeOfNoLength { vertex } => vec![vertex],
            Self::DoubledEdge { a, b } => vec![a, b],
            _ => Vec::new(),
        }
    }
}

/// Why a part has no result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stop {
    Left(LeftAsItWas),
    Cancelled(Cancelled),
}

impl From<Cancelled> for Stop {
    fn from(error: Cancelled) -> Self {
        Self::Cancelled(error)
    }
}

impl From<LeftAsItWas> for Stop {
    fn from(reason: LeftAsItWas) -> Self {
        Self::Left(reason)
    }
}

/// What all parts have in common.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    /// Factors that give UVs the proportions of the texture.
    pub(super) aspect: [f64; 2],
    /// Size of a texel in UVs.
    pub(super) texel: [f64; 2],
    /// The diagonal of the whole surface, in the unit of the parts' positions.
    pub(super) diagonal: f64,
    pub(super) settings: &'a Settings,
    /// Whether parts are embedded anew, whatever their shape was.
    pub(super) is_anew: bool,
    pub(super) progress: &'a Progress,
}

/// A part of an island and where it lies.
pub(super) struct Part<'a> {
    pub(super) mesh: &'a TriMesh,
    /// The UV of each vertex; finite.
    pub(super) uv: &'a [[f32; 2]],
    /// The vertices that must not move.
    pub(super) held: &'a [bool],
    /// The number in the input of each vertex.
    pub(super) vertex: &'a [u32],
}

/// A relaxed part: without flips and without overlap, by exact tests of the very numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RelaxedPart {
    /// The UV of each vertex.
    pub(super) uv: Vec<[f32; 2]>,
    /// Newton steps made.
    pub(super) iterations: usize,
    /// Whether the part had neither flips nor overlap before.
    pub(super) was_sound: bool,
}

impl Part<'_> {
    /// Lowers the stretch from where the part lies. What is held stays to the bit. With at most one vertex held, the rest keeps
    /// its area, its orientation and, without any, its centroid.
    pub(super) fn relaxed(&self, frame: &Frame<'_>) -> Result<RelaxedPart, Stop> {
        let held = self.held.iter().filter(|held| **held).count();
        if held == self.held.len() {
            return Err(LeftAsItWas::AllPinned.into());
        }
        let topology = self.mesh.topology();
        if topology.loops == 0 {
            return Err(LeftAsItWas::Closed.into());
        }
        if topology.genus() > 0 {
            return Err(LeftAsItWas::Handles.into());
        }
        let rest = RestTriangle::of_mesh(self.mesh);
        let surface = stretch::surface_area(&rest);
        let is_degenerate = mesh::measure::total_area(self.mesh) < LEAST_AREA * surface;
        if is_degenerate {
            return Err(LeftAsItWas::NoSurface.into());
        }
        // A mirrored part is relaxed as its mirror image.
        let (turned, side) = self.positive();
        let [ax, ay] = frame.aspect;
        let before: Vec<Point2<f64>> = turned.iter().map(|p| Point2::new(ax * p.x, ay * p.y)).collect();
        let area = unsigned_area(self.mesh, &before);
        let scale = (surface / area).sqrt();
        if !(area > 0.0 && scale.is_finite()) {
            return Err(LeftAsItWas::NoAreaInMap.into());
        }
        let start: Vec<Point2<f64>> = before.iter().map(|p| p * scale).collect();
        let was_sound = is_sound(self.mesh, &turned);

        let embedded = if frame.is_anew { self.embedded(frame)? } else { None };
        let (found, iterations) = if held < 2 {
            let (found, iterations) = self.free(&rest, embedded.as_deref().unwrap_or(&start), frame)?;
            (self.laid_back(&rest, &before, &found), iterations)
        } else {
            let mut start = start;
            if let Some(embedded) = embedded {
                let (found, _) = self.free(&rest, &embedded, frame)?;
                self.lay_on_held(&found, &mut start);
            }
            match stretch::minimise_pinned(self.mesh, &rest, &start, self.held, &frame.settings.stretch, frame.progress)
            {
                Ok(PinnedMap::Relaxed { uv, iterations }) => (uv.iter().map(|p| p / scale).collect(), iterations),
                Ok(PinnedMap::Flipped) => return Err(LeftAsItWas::PinsTurnFacesOver.into()),
                Ok(PinnedMap::Overlapping) => return Err(LeftAsItWas::PinsOverlap.into()),
                Err(error) => return Err(self.stop(error)),
            }
        };
        let in_uv = |(v, p): (usize, &Point2<f64>)| {
            if self.held[v] { turned[v] } else { Point2::new(p.x / ax, p.y / ay) }
        };
        let found: Vec<Point2<f64>> = found.iter().enumerate().map(in_uv).collect();
        let rounded = self.rounded(&found, frame)?;
        let to_side = |(v, uv): (usize, [f32; 2])| {
            if self.held[v] { self.uv[v] } else { [side as f32 * uv[0] + 0.0, uv[1]] }
        };
        let uv = rounded.into_iter().enumerate().map(to_side).collect();
        Ok(RelaxedPart { uv, iterations, was_sound })
    }

    /// Whether the part lies without flips and without overlap, by exact tests.
    pub(super) fn is_sound(&self) -> bool {
        is_sound(self.mesh, &self.positive().0)
    }

    /// Where the part lies, or if more of it is turned over than not, its mirror image; and the factor of its abscissae.
    fn positive(&self) -> (Vec<Point2<f64>>, f64) {
        let uv: Vec<Point2<f64>> = self.uv.iter().map(|&uv| Point2::from(uv.map(f64::from))).collect();
        let side = if stretch::plane_area(self.mesh, &uv) < 0.0 { -1.0 } else { 1.0 };
        (uv.iter().map(|p| Point2::new(side * p.x, p.y)).collect(), side)
    }

    /// The part embedded by its distances alone, in units of the surface; `None` if these do not span a plane.
    fn embedded(&self, frame: &Frame<'_>) -> Result<Option<Vec<Point2<f64>>>, Cancelled> {
        let (settings, progress) = (frame.settings, frame.progress);
        let steps = Steps::new(self.mesh, settings, settings.seed, progress);
        let distances = match steps.distances_of_all()? {
            Some(distances) => distances,
            None => geodesics::landmark_distances(self.mesh, &settings.geodesics, progress)?,
        };
        match steps.embed(&distances) {
            Ok(chart) => Ok(Some(chart.uv)),
            Err(EmbeddingError::Cancelled(cancelled)) => Err(cancelled),
            Err(_) => Ok(None),
        }
    }

    /// Moves the vertices of `start` that are not held to where a map has them, once that is moved, turned and scaled so that
    /// it is as near as possible to what is held. Nothing where that is all at one point.
    fn lay_on_held(&self, map: &[Point2<f64>], start: &mut [Point2<f64>]) {
        let pairs = || start.iter().zip(map).zip(self.held).filter(|pair| *pair.1).map(|(pair, _)| pair);
        let count = pairs().count() as f64;
        let to = pairs().map(|(p, _)| p.coords).sum::<Vector2<f64>>() / count;
        let from = pairs().map(|(_, q)| q.coords).sum::<Vector2<f64>>() / count;
        let (mut cos, mut sin, mut square) = (0.0, 0.0, 0.0);
        for (p, q) in pairs() {
            let (p, q) = (p.coords - to, q.coords - from);
            cos += q.dot(&p);
            sin += q.perp(&p);
            square += q.norm_squared();
        }
        let scale = f64::hypot(cos, sin) / square;
        if !(scale.is_finite() && scale > 0.0) {
            return;
        }
        let turn = Rotation2::new(f64::atan2(sin, cos)).into_inner() * scale;
        for ((p, q), held) in start.iter_mut().zip(map).zip(self.held) {
            if !held {
                *p = Point2::from(turn * (q.coords - from) + to);
            }
        }
    }

    /// The least stretch from a start in units of the surface, whose vertices may all move: without flips and without overlap.
    fn free(
        &self,
        rest: &[RestTriangle],
        start: &[Point2<f64>],
        frame: &Frame<'_>,
    ) -> Result<(Vec<Point2<f64>>, usize), Stop> {
        let (mesh, progress) = (self.mesh, frame.progress);
        let stop = |error| self.stop(error);
        let settings = StretchSettings { solver: Solver::Newton, ..frame.settings.stretch.clone() };
        let minimise = |start: &[Point2<f64>], keep_apart: Option<f64>| {
            let options = MinimiseOptions { keep_apart, ..MinimiseOptions::default() };
            stretch::minimise_stretch(mesh, rest, start, &settings, &options, progress).map_err(stop)
        };
        let (cleared, _) = stretch::make_injective(mesh, rest, start, progress).map_err(stop)?;
        let found = minimise(&cleared, None)?;
        if stretch::boundary_is_simple(mesh, &found.uv) {
            return Ok((found.uv, found.iterations));
        }
        let apart = if is_sound(mesh, &cleared) {
            cleared
        } else if is_sound(mesh, start) {
            start.to_vec()
        } else if let Some(parted) = stretch::part_boundary(mesh, rest, &found.uv, progress).map_err(stop)? {
            parted
        } else {
            stretch::tutte_embedding(mesh, rest, TutteBoundary::Circle, progress)
                .map_err(stop)?
                .ok_or(LeftAsItWas::Unsolved)?
        };
        let kept = minimise(&apart, Some(BOUNDARY_REACH))?;
        Ok((kept.uv, found.iterations + kept.iterations))
    }

    /// The map moved, turned and scaled to where the part was: its area is the same, the turn is the one by which its vertices
    /// come nearest to where they were, and its centroid, or else the vertex that is held, is where it was.
    fn laid_back(&self, rest: &[RestTriangle], before: &[Point2<f64>], found: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let mut weight = vec![0.0; found.len()];
        for (triangle, rest) in self.mesh.triangles().iter().zip(rest) {
            triangle.iter().for_each(|v| weight[v.index()] += rest.area());
        }
        let total: f64 = weight.iter().sum();
        let middle = |points: &[Point2<f64>]| -> Vector2<f64> {
            points.iter().zip(&weight).map(|(p, w)| p.coords * *w).sum::<Vector2<f64>>() / total
        };
        let (old, new) = (middle(before), middle(found));
        let (mut cos, mut sin) = (0.0, 0.0);
        for ((p, q), w) in before.iter().zip(found).zip(&weight) {
            let (p, q) = (p.coords - old, q.coords - new);
            cos += w * q.dot(&p);
            sin += w * q.perp(&p);
        }
        let scale = (unsigned_area(self.mesh, before) / unsigned_area(self.mesh, found)).sqrt();
        let turn = Rotation2::new(f64::atan2(sin, cos)).into_inner() * scale;
        let (from, to) = match self.held.iter().position(|held| *held) {
            Some(v) => (found[v].coords, before[v].coords),
            None => (centroid(self.mesh, found), centroid(self.mesh, before)),
        };
        found.iter().map(|p| Point2::from(turn * (p.coords - from) + to)).collect()
    }

    /// The map in single precision, checked again: what is held has the numbers that it had.
    fn rounded(&self, found: &[Point2<f64>], frame: &Frame<'_>) -> Result<Vec<[f32; 2]>, Stop> {
        let middle = centroid(self.mesh, found);
        let corner = [middle.x, middle.y].map(|x| if x.is_finite() { x.floor().max(0.0) } else { 0.0 });
        let rounding = Rounding { texel: frame.texel, corner, diagonal: frame.diagonal };
        let mut uv = match round_to_f32(self.mesh, &[], found, &rounding, frame.progress) {
            Ok(rounded) => rounded.uv,
            Err(RoundingError::Unmendable(_)) => return Err(LeftAsItWas::TooSmall.into()),
            Err(RoundingError::Cancelled(cancelled)) => return Err(cancelled.into()),
        };
        for v in (0..uv.len()).filter(|&v| self.held[v]) {
            uv[v] = [found[v].x as f32, found[v].y as f32];
        }
        let exact: Vec<Point2<f64>> = uv.iter().map(|&uv| Point2::from(uv.map(f64::from))).collect();
        if is_sound(self.mesh, &exact) { Ok(uv) } else { Err(LeftAsItWas::TooSmall.into()) }
    }

    /// What an error of the minimisation means for the part.
    fn stop(&self, error: StretchError) -> Stop {
        match error {
            StretchError::Cancelled(cancelled) => cancelled.into(),
            StretchError::DoubledEdge { a, b } => {
                let [a, b] = [a, b].map(|v| self.vertex[v.index()] as usize);
                LeftAsItWas::DoubledEdge { a, b }.into()
            }
            _ => LeftAsItWas::Unsolved.into(),
        }
    }
}

/// Whether a map has no flips and does not overlap itself, by exact tests.
fn is_sound(mesh: &TriMesh, uv: &[Point2<f64>]) -> bool {
    stretch::first_flip(mesh, uv).is_none() && stretch::boundary_is_simple(mesh, uv)
}

/// Area in the plane, each triangle counted as positive.
fn unsigned_area(mesh: &TriMesh, uv: &[Point2<f64>]) -> f64 {
    triangles(mesh, uv).map(|(area, _)| area).sum()
}

/// The centroid of the triangles, by their areas, each counted as positive.
fn centroid(mesh: &TriMesh, uv: &[Point2<f64>]) -> Vector2<f64> {
    let (mut sum, mut total) = (Vector2::zeros(), 0.0);
    for (area, middle) in triangles(mesh, uv) {
        sum += middle * area;
        total += area;
    }
    sum / total
}

/// The area and the middle of each triangle.
fn triangles<'a>(mesh: &'a TriMesh, uv: &'a [Point2<f64>]) -> impl Iterator<Item = (f64, Vector2<f64>)> + 'a {
    mesh.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|v| uv[v.index()]);
        (0.5 * (b - a).perp(&(c - a)).abs(), (a.coords + b.coords + c.coords) / 3.0)
    })
}
