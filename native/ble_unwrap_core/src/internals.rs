//! Stages by themselves, for this project's benchmarks and tests. This is no part of the interface: anything here may change
//! at any time.
//!
//! The types hide what they hold, so that the stages stay private; each method is one call of a stage with its default
//! settings.

use nalgebra::{Point2, Point3};

use crate::charts::{self, Patch};
use crate::distortion::RestTriangle;
use crate::embedding::{self, EmbeddingSettings};
use crate::geodesics::{self, GeodesicSettings, LandmarkDistances};
use crate::mesh::{self, ConditionOptions, MeshInput, TriMesh};
use crate::metrics::{self, Measures, Texture, UvMesh};
use crate::packing::PackSettings;
use crate::progress::Progress;
use crate::segmentation::{self, SegmentationSettings, SpectralAnalysis};
use crate::stretch::{self, MinimiseOptions, StretchSettings};
use crate::verify::{self, Certificate};

/// A conditioned surface of one piece.
#[derive(Clone)]
pub struct Body(Patch);

impl Body {
    pub fn condition(input: &MeshInput<'_>) -> Self {
        let surface = mesh::condition(input, &ConditionOptions::default(), &Progress::new()).expect("a valid mesh");
        Self(Patch::whole(surface.mesh, surface.polygon))
    }

    pub fn triangle_count(&self) -> usize {
        self.0.mesh.face_count()
    }

    pub fn vertex_count(&self) -> usize {
        self.0.mesh.vertex_count()
    }

    /// How many vertices a coarse mesh has that was to have so many.
    pub fn coarsen(&self, target: usize) -> usize {
        mesh::coarsen(&self.0.mesh, target, &Progress::new()).expect("not cancelled").mesh.vertex_count()
    }

    /// Choice of the landmarks, and a march from each.
    pub fn landmark_distances(&self) -> Distances {
        let settings = GeodesicSettings::default();
        let found = geodesics::landmark_distances(&self.0.mesh, &settings, &Progress::new()).expect("not cancelled");
        let analysis = None;
        Distances { found, analysis }
    }

    pub fn segment(&self, distances: &Distances) -> usize {
        let analysis = distances.analysis.as_ref().expect("distances that were analysed");
        let Patch { mesh, polygon, .. } = &self.0;
        let (settings, progress) = (SegmentationSettings::default(), Progress::new());
        let parts = segmentation::segment(mesh, polygon, &distances.found, analysis, true, &settings, &progress);
        parts.expect("not cancelled").parts
    }

    /// The edges to cut, by half-edge.
    pub fn cut_to_disk(&self) -> Vec<usize> {
        let mesh = &self.0.mesh;
        let cuts = charts::cut_to_disk(mesh, |h| mesh.edge_length(h), |_| false);
        cuts.into_iter().map(mesh::HalfedgeId::index).collect()
    }

    /// Whether the surface is a disk once it is cut along some edges.
    pub fn is_disk_without(&self, cuts: &[usize]) -> bool {
        let mesh = &self.0.mesh;
        let faces: Vec<_> = mesh.faces().collect();
        let is_cut = |h| cuts.binary_search(&mesh.twin(h).min(h).index()).is_ok();
        mesh.submesh(&faces, is_cut).0.topology().is_disk()
    }
}

/// Distances from landmarks, and their spectral analysis.
pub struct Distances {
    found: LandmarkDistances,
    analysis: Option<SpectralAnalysis>,
}

impl Distances {
    /// Whether there is one to each of so many vertices.
    pub fn reach(&self, vertices: usize) -> bool {
        self.found.vertex_count() == vertices && self.found.row(0).iter().all(|d| d.is_finite())
    }

    /// The dimension that the analysis finds, and how planar the surface is.
    pub fn analyse(&self) -> (usize, f64) {
        let analysis = SpectralAnalysis::new(&self.found).expect("memory");
        (analysis.dimension, analysis.planarity)
    }

    pub fn analysed(self) -> Self {
        let analysis = Some(SpectralAnalysis::new(&self.found).expect("memory"));
        Self { analysis, ..self }
    }

    /// How many vertices got a place, if the fit converged.
    pub fn embed(&self) -> Option<usize> {
        let found = embedding::embed_chart(&self.found, &EmbeddingSettings::default(), 0, &Progress::new());
        let found = found.expect("a sheet has an extent");
        found.converged.then_some(found.uv.len())
    }
}

/// A surface with a map of it.
#[derive(Clone)]
pub struct Sheet {
    body: Body,
    rest: Vec<RestTriangle>,
    uv: Vec<Point2<f64>>,
}

impl Sheet {
    /// As the embedding leaves it.
    pub fn embedded(body: Body) -> Self {
        let distances = body.landmark_distances().found;
        let found = embedding::embed_chart(&distances, &EmbeddingSettings::default(), 0, &Progress::new());
        let mut uv = found.expect("a sheet has an extent").uv;
        let rest = RestTriangle::of_mesh(&body.0.mesh);
        embedding::fix_gauge(&body.0.mesh, &rest, &mut uv);
        Self { body, rest, uv }
    }

    fn mesh(&self) -> &TriMesh {
        &self.body.0.mesh
    }

    /// With every point of the map moved.
    pub fn moved(mut self, to: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        self.uv.iter_mut().for_each(|p| *p = to([p.x, p.y]).into());
        self
    }

    pub fn map(&self) -> Vec<[f64; 2]> {
        self.uv.iter().map(|p| [p.x, p.y]).collect()
    }

    pub fn has_flips(&self) -> bool {
        stretch::first_flip(self.mesh(), &self.uv).is_some()
    }

    /// A map without flips.
    pub fn make_injective(&self) -> Vec<[f64; 2]> {
        let found = stretch::make_injective(self.mesh(), &self.rest, &self.uv, &Progress::new()).expect("a disk");
        found.0.into_iter().map(|p| [p.x, p.y]).collect()
    }

    pub fn with_map(mut self, uv: &[[f64; 2]]) -> Self {
        self.uv = uv.iter().map(|&p| p.into()).collect();
        self
    }

    pub fn l2_stretch(&self) -> f64 {
        stretch::l2_stretch(self.mesh(), &self.rest, &self.uv)
    }

    /// The least stretch, and the iterations to it, if they converged.
    pub fn minimise_stretch(&self) -> Option<(f64, usize)> {
        let (settings, options) = (StretchSettings::default(), MinimiseOptions::default());
        let found = stretch::minimise_stretch(self.mesh(), &self.rest, &self.uv, &settings, &options, &Progress::new());
        let found = found.expect("a start without flips");
        found.converged.then_some((found.l2, found.iterations))
    }
}

/// Triangles as they are, of which nothing is conditioned: by vertex and by corner, with a UV a corner and a chart a triangle
/// (or none, where all have UVs), at the default texture and margin.
pub struct Layout {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    corners: Vec<[u32; 3]>,
    uv: Vec<[f32; 2]>,
    chart: Vec<i32>,
}

impl Layout {
    pub fn new(
        positions: &[[f64; 3]],
        triangles: Vec<[u32; 3]>,
        corners: Vec<[u32; 3]>,
        uv: Vec<[f32; 2]>,
        chart: Vec<i32>,
    ) -> Self {
        Self { positions: positions.iter().map(|&p| p.into()).collect(), triangles, corners, uv, chart }
    }

    fn mesh(&self) -> UvMesh<'_> {
        let Self { positions, triangles, corners, uv, chart } = self;
        UvMesh::new(positions, triangles, uv, corners, chart, Texture::of(&PackSettings::default()))
            .expect("few triangles")
    }

    pub fn verify(&self) -> Certificate {
        verify::verify(&self.mesh(), &Progress::new()).expect("not cancelled")
    }

    pub fn measure(&self) -> Measures {
        metrics::measure(&self.mesh(), &Progress::new()).expect("not cancelled")
    }
}
