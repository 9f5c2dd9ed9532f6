//! The steps that take one patch into the plane, each by itself.

use nalgebra::Point2;

use crate::distortion::RestTriangle;
use crate::embedding::{self, ChartEmbedding, EmbeddingError, Model};
use crate::geodesics::{self, LandmarkDistances};
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};
use crate::settings::Settings;
use crate::stretch::{self, Injective, MinimiseOptions, Minimised, StretchError, TutteBoundary};

use super::rungs::Rung;

/// A map without flips, and how it was got.
pub(crate) type Cleared = (Vec<Point2<f64>>, Rung);

/// A patch of genus 0 with a boundary, and what every step needs.
pub(crate) struct Steps<'a> {
    pub(crate) mesh: &'a TriMesh,
    pub(crate) rest: Vec<RestTriangle>,
    settings: &'a Settings,
    seed: u64,
    progress: &'a Progress,
}

impl<'a> Steps<'a> {
    pub(crate) fn new(mesh: &'a TriMesh, settings: &'a Settings, seed: u64, progress: &'a Progress) -> Self {
        Self { mesh, rest: RestTriangle::of_mesh(mesh), settings, seed, progress }
    }

    pub(crate) fn model(&self) -> Model {
        self.settings.embedding.model
    }

    /// Distances between all vertices, if the settings have so small a patch embedded as a whole: the
    /// paper's way (section 5.1, m vertices of a patch).
    pub(crate) fn distances_of_all(&self) -> Result<Option<LandmarkDistances>, Cancelled> {
        if self.mesh.vertex_count() > self.settings.together_max {
            return Ok(None);
        }
        self.distances_between_all().map(Some)
    }

    /// Distances between all vertices: n×n of them.
    pub(crate) fn distances_between_all(&self) -> Result<LandmarkDistances, Cancelled> {
        let all: Vec<_> = self.mesh.vertices().collect();
        geodesics::geodesic_distances(self.mesh, &all, self.settings.geodesics.metric, self.progress)
    }

    /// Landmarks by likelihood, the rest by regression, in the standard pose.
    pub(crate) fn embed(&self, distances: &LandmarkDistances) -> Result<ChartEmbedding, EmbeddingError> {
        let mut chart = embedding::embed_chart(distances, &self.settings.embedding, self.seed, self.progress)?;
        embedding::fix_gauge(self.mesh, &self.rest, &mut chart.uv);
        Ok(chart)
    }

    /// The same map without flips, and how it was got.
    pub(crate) fn remove_flips(&self, start: &[Point2<f64>]) -> Result<Cleared, StretchError> {
        let (uv, how) = stretch::make_injective(self.mesh, &self.rest, start, self.progress)?;
        Ok((uv, rung_of(how)))
    }

    /// The same, but `None` where the flips resist.
    pub(crate) fn clear_flips(&self, start: &[Point2<f64>]) -> Result<Option<Cleared>, StretchError> {
        let cleared = stretch::clear_flips(self.mesh, &self.rest, start, self.progress)?;
        Ok(cleared.map(|(uv, how)| (uv, rung_of(how))))
    }

    /// Tutte's embedding in a circle: where the free boundary ran over itself, a start whose boundary is
    /// simple. `None` where there is none.
    pub(crate) fn on_circle(&self) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        stretch::tutte_embedding(self.mesh, &self.rest, TutteBoundary::Circle, self.progress)
    }

    /// The least stretch from a start without flips. Given up, and marked so, where it will stay above a limit.
    pub(crate) fn minimise(
        &self,
        start: &[Point2<f64>],
        abandon_above: Option<f64>,
        keep_apart: Option<f64>,
    ) -> Result<Minimised, StretchError> {
        let options = MinimiseOptions { abandon_above, keep_apart, seed: self.seed };
        stretch::minimise_stretch(self.mesh, &self.rest, start, &self.settings.stretch, &options, self.progress)
    }

    /// The same map without flips, where they are few.
    pub(crate) fn clear_locally(&self, start: &[Point2<f64>]) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        stretch::clear_locally(self.mesh, &self.rest, start, self.progress)
    }

    /// The same map with a boundary that is simple, where it crosses itself only here and there.
    pub(crate) fn part_boundary(&self, uv: &[Point2<f64>]) -> Result<Option<Vec<Point2<f64>>>, StretchError> {
        stretch::part_boundary(self.mesh, &self.rest, uv, self.progress)
    }

    /// Whether the boundary comes so near to itself that minimisation may take it across.
    pub(crate) fn boundary_is_tight(&self, uv: &[Point2<f64>]) -> bool {
        stretch::boundary_is_tight(self.mesh, &self.rest, uv)
    }

    pub(crate) fn boundary_is_simple(&self, uv: &[Point2<f64>]) -> bool {
        stretch::boundary_is_simple(self.mesh, uv)
    }
}

fn rung_of(how: Injective) -> Rung {
    match how {
        Injective::AlreadyWas => Rung::Embedding,
        Injective::FoldoverFree => Rung::FoldoverFree,
        Injective::TutteShape => Rung::TutteShape,
        Injective::TutteCircle => Rung::TutteCircle,
    }
}
