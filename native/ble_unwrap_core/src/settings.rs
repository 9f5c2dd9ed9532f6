//! Every parameter of the unwrapper, with the two presets of the paper and of practice.

use crate::embedding::EmbeddingSettings;
use crate::geodesics::GeodesicSettings;
use crate::packing::PackSettings;
use crate::segmentation::SegmentationSettings;
use crate::stretch::StretchSettings;

/// What happens to the holes of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holes {
    /// A chart may have several boundary loops.
    Keep,
    /// Every chart is cut to a topological disk, as the paper has it.
    Cut,
}

/// How charts are scaled relative to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartScale {
    /// The same area of texture for the same area of surface.
    Uniform,
    /// More texture for stretched charts: √(E/A) of each chart, within [½, 2] of uniform.
    Stretch,
}

/// All settings of [`unwrap`](crate::unwrap()), grouped by stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Upper bound of the L2 stretch of every chart, above 1.
    pub stretch_limit: f64,
    /// Whether coincident vertices are joined before charting.
    pub weld: bool,
    /// Whether neighbouring charts are joined again where their union stays under the limit.
    pub merge: bool,
    /// Holes of charts.
    pub holes: Holes,
    /// Relative scale of charts.
    pub chart_scale: ChartScale,
    /// Seed of every random choice.
    pub seed: u64,
    /// Landmarks and geodesic distances.
    pub geodesics: GeodesicSettings,
    /// Spectral analysis and cutting.
    pub segmentation: SegmentationSettings,
    /// Bernoulli logistic embedding.
    pub embedding: EmbeddingSettings,
    /// Stretch minimisation.
    pub stretch: StretchSettings,
    /// Packing.
    pub packing: PackSettings,
}

impl Default for Settings {
    /// What an artist wants: the extended model, projected Newton, holes kept.
    fn default() -> Self {
        Self {
            stretch_limit: 1.1,
            weld: true,
            merge: true,
            holes: Holes::Keep,
            chart_scale: ChartScale::Uniform,
            seed: 0,
            geodesics: GeodesicSettings::default(),
            segmentation: SegmentationSettings::default(),
            embedding: EmbeddingSettings::default(),
            stretch: StretchSettings::default(),
            packing: PackSettings::default(),
        }
    }
}

impl Settings {
    /// The paper as printed: its model from a random start, all vertices of a patch embedded,
    /// Sander's line searches, disks, two texels at 1024 (paper, sections 4 to 6).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            holes: Holes::Cut,
            geodesics: GeodesicSettings::paper(),
            embedding: EmbeddingSettings::paper(),
            stretch: StretchSettings::paper(),
            packing: PackSettings::paper(),
            ..Self::default()
        }
    }
}
