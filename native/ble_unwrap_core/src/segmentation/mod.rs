//! Cutting a patch into parts that flatten better.
//!
//! Zhou, Snyder, Guo, Shum: Iso-charts: stretch-driven mesh parameterization using spectral
//! analysis, SGP 2004, sections 3 and 4; the paper takes its segmentation from there (section 5.1).
//!
//! 1. [`SpectralAnalysis`]: classical scaling of the landmark distances tells how many dimensions
//!    the patch needs, and how well two would do.
//! 2. Representatives: landmarks at the ends of the leading dimensions, spread apart.
//! 3. Growth: every polygon goes to the nearest representative by geodesic distance.
//!    Where guides divide the patch, whole regions between guides go where most of them went, or become the parts.
//! 4. Boundaries: a minimum cut in a band around each border, drawn to creases and to short lines.
//! 5. Repair: parts become connected, fragments go to a neighbour.
//!
//! [`straighten()`] redraws borders that come from a coarser mesh; [`between()`] parts a patch between two given places.
//!
//! Polygons stay whole. The result is a label a face; each label is connected over polygon sides.

mod bends;
mod between;
mod boundary;
mod grow;
mod guides;
mod hard_edges;
mod min_cut;
mod polygon_graph;
mod repair;
mod smooth;
mod spectral;
mod straighten;
mod walls;

use crate::geodesics::LandmarkDistances;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

pub(crate) use between::between;
pub(crate) use hard_edges::{between_parts, is_developable, unrolling_parts};
pub(crate) use min_cut::CutGraph;
use polygon_graph::PolygonGraph;
pub(crate) use spectral::SpectralAnalysis;
pub(crate) use straighten::straighten;

/// Parameters of the segmentation.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentationSettings {
    /// Greatest number of parts that a component is first split into (10 in iso-charts).
    pub first_parts: usize,
    /// Greatest number of parts in every later split.
    pub later_parts: usize,
    /// Width of the band within which the minimum cut may move a border between two parts. The band holds the places where
    /// |d₁ − d₂| / (d₁ + d₂) is at most this, for the geodesic distances d₁ and d₂ to the representatives of the two parts.
    pub band: f64,
    /// Share of length and creases in the cost of a cut after the first split, from 0 to 1. The rest is the share of the
    /// embedding errors.
    pub crease_share: f64,
    /// How strongly seams are drawn to creases, from 0 to 2: 0 means not at all, 1 is as in iso-charts. Where a seam along
    /// an edge of a flat place costs 1, one along an edge that bends as much as the average edge costs ½ to the power of
    /// this weight.
    pub crease_weight: f64,
    /// How the crease term and the misfit term make up the cost.
    pub cost: CutCost,
}

/// What a cut costs where it runs. In the formulas, α stands for [`SegmentationSettings::crease_share`]; "crease" is 1
/// where the surface is flat and near 0 where it bends; "misfit" measures the embedding errors and is 1 on average.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CutCost {
    /// α·crease + (1 − α)·misfit, as in iso-charts. A crease then never costs less than the share of the misfit, which is a
    /// third of the cost in a flat place, and cuts leave creases for a slightly shorter path.
    Sum,
    /// crease·(α + (1 − α)·misfit). A crease is then cheap whatever the embedding errors are. On models with creases seams
    /// get shorter (on a car their length falls from 8.7 to 7.3); on some models without creases they get a little longer.
    Product,
}

impl SegmentationSettings {
    /// The largest [`crease_weight`](Self::crease_weight). With more, folds would cost less than the least capacity of an
    /// edge in the minimum cut.
    pub const MOST_CREASE_WEIGHT: f64 = 2.0;
}

impl Default for SegmentationSettings {
    fn default() -> Self {
        Self {
            first_parts: 2,
            later_parts: 2,
            band: 0.3,
            crease_share: 0.65,
            crease_weight: 1.0,
            cost: CutCost::Product,
        }
    }
}

impl SegmentationSettings {
    /// The cost of a cut as in iso-charts.
    #[must_use]
    pub fn paper() -> Self {
        Self { cost: CutCost::Sum, ..Self::default() }
    }
}

/// The parts of a patch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Segmentation {
    /// Part of each face; each part is connected.
    pub label: Vec<u32>,
    /// Number of parts.
    pub parts: usize,
}

/// Splits a patch by spectral analysis into at least two connected parts of whole polygons.
///
/// `polygon` names the polygon of each face. `first` says whether this is the first split of a
/// component. If the spectral split comes out as one part, the polygons are halved in breadth-first
/// order, so the result has two parts or more whenever the patch has two polygons. O(n log n) and
/// one minimum cut a border.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn segment(
    mesh: &TriMesh,
    polygon: &[u32],
    distances: &LandmarkDistances,
    analysis: &SpectralAnalysis,
    first: bool,
    settings: &SegmentationSettings,
    progress: &Progress,
) -> Result<Segmentation, Cancelled> {
    let graph = PolygonGraph::new(mesh, polygon);
    let most = if first { settings.first_parts } else { settings.later_parts };
    let area: f64 = graph.area.iter().sum();
    let representatives = grow::representatives(distances, analysis, area, most.min(2 * analysis.dimension));
    let mut label = grow::nearest(mesh, &graph, distances, &representatives);
    if guides::snap(mesh, &graph, &mut label) {
        return Ok(finish(&graph, label));
    }
    let crease_share = if first { 1.0 } else { settings.crease_share };
    let cut =
        boundary::Cut { band: settings.band, crease_share, crease_weight: settings.crease_weight, cost: settings.cost };
    boundary::improve(mesh, &graph, distances, &representatives, cut, &mut label, progress)?;
    Ok(finish(&graph, label))
}

/// Halves a patch in breadth-first order of its polygons: the split that always works, for patches
/// that spectral analysis cannot split. O(n).
#[must_use]
pub(crate) fn bisect(mesh: &TriMesh, polygon: &[u32]) -> Segmentation {
    let graph = PolygonGraph::new(mesh, polygon);
    let label = grow::halves(&graph);
    finish(&graph, label)
}

fn finish(graph: &PolygonGraph, mut label: Vec<u32>) -> Segmentation {
    if graph.split_components(&mut label.clone()) < 2 {
        label = grow::halves(graph);
    }
    finish_labels(graph, label)
}

fn finish_labels(graph: &PolygonGraph, mut label: Vec<u32>) -> Segmentation {
    repair::absorb_fragments(graph, &mut label);
    let parts = graph.split_components(&mut label);
    Segmentation { label: graph.of_face.iter().map(|&p| label[p as usize]).collect(), parts }
}
