//! Every parameter of the unwrapper, with the presets of practice, of the paper and of the method it is compared with.

use crate::embedding::{EmbeddingSettings, Model};
use crate::error::UnwrapError;
use crate::geodesics::GeodesicSettings;
use crate::mesh::ConditionOptions;
use crate::packing::PackSettings;
use crate::segmentation::SegmentationSettings;
use crate::stretch::StretchSettings;

/// Patches of more vertices are embedded by landmarks in the presets of the paper, too. All distances of m vertices
/// take some 20 m² bytes and 0.4 µs a pair (marching, sweeps): 80 MB and 1.5 s at 2,000, twice the paper's own face of
/// "around 1,000 vertices"; every patch that is tried costs that again.
const PAPER_TOGETHER_MAX: usize = 2_000;

/// Most vertices of a patch whose distances to each other can be handled: 8 GB and minutes.
pub(crate) const MOST_TOGETHER: usize = 20_000;

/// The value of [`Settings::least_sewn`] that keeps charts without darts.
pub const NEVER_SEWN: f64 = 1e3;

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

/// What the stretch limit bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitOver {
    /// The L2 stretch of every chart.
    Chart,
    /// The L2 stretch of the whole atlas, as UVAtlas has it: the root of the area-weighted mean of the charts' squared L2
    /// stretch. Single charts may have more, up to [`Settings::chart_limit`].
    Atlas,
}

/// A limit over the atlas lets single charts stretch so many times more above 1.
const SINGLE_CHARTS: f64 = 4.0;

/// All settings of [`unwrap`](crate::unwrap()), grouped by stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Upper bound of the L2 stretch, above 1.
    pub stretch_limit: f64,
    /// Of what: of every chart, or of all together.
    pub limit_over: LimitOver,
    /// Whether vertices at the same position count as one. Off by default: an edge between two
    /// vertices of the input is then a seam only if the result says so. Turn it on for data that
    /// repeats vertices along seams of its own, as many file formats do.
    pub weld: bool,
    /// How near to each other such vertices are, in the unit of the input; `None` for what single precision cannot tell
    /// apart. See [`ConditionOptions::weld_distance`].
    pub weld_distance: Option<f64>,
    /// Whether large components are cut on a coarse mesh first. Off, as in the paper's presets, patches are embedded by all
    /// landmarks and ribbons stay whole, too.
    pub coarse: bool,
    /// Whether neighbouring charts are joined again where their union stays under the limit, and crushed polygons at their
    /// borders handed over.
    pub merge: bool,
    /// Charts whose union would be over the limit are sewn along a part of their border, the rest being left as a dart,
    /// where that part is at least this share of the square root of the smaller one's area: less for fewer charts and a
    /// shorter seam, more for compact charts. From [`NEVER_SEWN`] on none are, nor are patches cut by darts or to
    /// nets before they are split, nor crushed polygons handed over borders.
    pub least_sewn: f64,
    /// Holes of charts.
    pub holes: Holes,
    /// Relative scale of charts.
    pub chart_scale: ChartScale,
    /// Patches of at most so many vertices are embedded with all their vertices together, as the paper does, in
    /// time and memory of the square of their number; larger ones by their landmarks. 0: always by landmarks.
    pub together_max: usize,
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
            limit_over: LimitOver::Chart,
            weld: false,
            weld_distance: None,
            coarse: true,
            merge: true,
            least_sewn: 0.2,
            holes: Holes::Keep,
            chart_scale: ChartScale::Uniform,
            together_max: 0,
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
    /// The paper as printed: landmarks, one vertex in a hundred, for cutting (section 5.1); its model from a random
    /// start on all vertices of a patch together; Sander's line searches, disks, two texels at 1024.
    ///
    /// Above 2,000 vertices a patch is embedded by its landmarks, and the others are placed by regression: all pairs would
    /// not fit in time and memory.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            holes: Holes::Cut,
            coarse: false,
            least_sewn: NEVER_SEWN,
            segmentation: SegmentationSettings::paper(),
            together_max: PAPER_TOGETHER_MAX,
            geodesics: GeodesicSettings::paper(),
            embedding: EmbeddingSettings::paper(),
            stretch: StretchSettings::paper(),
            packing: PackSettings::paper(),
            ..Self::default()
        }
    }

    /// What the paper is compared with: iso-charts (Zhou, Snyder, Guo, Shum 2004), the same pipeline and settings as
    /// [`Settings::paper`] with Isomap in place of Bernoulli logistic embedding.
    #[must_use]
    pub fn iso_charts() -> Self {
        let paper = Self::paper();
        Self { embedding: EmbeddingSettings { model: Model::Isomap, ..paper.embedding.clone() }, ..paper }
    }
}

impl Settings {
    /// Whether charts may be cut open by darts, to nets, or have polygons handed over their borders: [`Settings::least_sewn`]
    /// is below [`NEVER_SEWN`].
    pub(crate) fn wants_darts(&self) -> bool {
        self.least_sewn < NEVER_SEWN
    }

    /// What a mesh is conditioned with.
    #[must_use]
    pub fn conditioning(&self) -> ConditionOptions {
        ConditionOptions { weld: self.weld, weld_distance: self.weld_distance }
    }

    /// The L2 stretch that a single chart may have: the limit, or where that is over the atlas 1 and four times what the
    /// limit is above 1.
    #[must_use]
    pub fn chart_limit(&self) -> f64 {
        match self.limit_over {
            LimitOver::Chart => self.stretch_limit,
            LimitOver::Atlas => 1.0 + SINGLE_CHARTS * (self.stretch_limit - 1.0),
        }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`UnwrapError::Setting`] with the first setting that is out of range.
    pub fn validate(&self) -> Result<(), UnwrapError> {
        let g = &self.geodesics;
        let s = &self.segmentation;
        let e = &self.embedding;
        let t = &self.stretch;
        let positive = "a positive number";
        let unit = "between 0 and 1";
        let checks: [(&'static str, f64, bool, &'static str); 17] = [
            (
                "stretch_limit",
                self.stretch_limit,
                self.stretch_limit > 1.0 && self.stretch_limit.is_finite(),
                "above 1",
            ),
            (
                "landmark_fraction",
                g.landmark_fraction,
                g.landmark_fraction > 0.0 && g.landmark_fraction <= 1.0,
                "above 0 and at most 1",
            ),
            ("landmark_min", g.landmark_min as f64, g.landmark_min >= 3, "at least 3"),
            ("landmark_max", g.landmark_max as f64, g.landmark_max >= g.landmark_min, "at least landmark_min"),
            ("together_max", self.together_max as f64, self.together_max <= MOST_TOGETHER, "at most 20,000"),
            ("least_sewn", self.least_sewn, (0.0..=NEVER_SEWN).contains(&self.least_sewn), "between 0 and 1000"),
            ("first_parts", s.first_parts as f64, s.first_parts >= 2, "at least 2"),
            ("later_parts", s.later_parts as f64, s.later_parts >= 2, "at least 2"),
            ("band", s.band, (0.0..=1.0).contains(&s.band), unit),
            ("crease_share", s.crease_share, (0.0..=1.0).contains(&s.crease_share), unit),
            (
                "crease_weight",
                s.crease_weight,
                (0.0..=SegmentationSettings::MOST_CREASE_WEIGHT).contains(&s.crease_weight),
                "between 0 and 2",
            ),
            (
                "kernel_width",
                e.kernel_width.unwrap_or(1.0),
                e.kernel_width.is_none_or(|c| c > 0.0 && c.is_finite()),
                positive,
            ),
            ("relaxation", e.relaxation, e.relaxation > 0.0 && e.relaxation < 2.0, "between 0 and 2, both excluded"),
            ("max_sweeps", e.max_sweeps as f64, e.max_sweeps >= 1, "at least 1"),
            ("tolerance", e.tolerance, e.tolerance > 0.0 && e.tolerance < 1.0, unit),
            ("stretch_iterations", t.max_iterations as f64, t.max_iterations >= 1, "at least 1"),
            (
                "margin",
                self.packing.margin_texels,
                self.packing.margin_texels >= 0.0 && self.packing.margin_texels.is_finite(),
                "0 or more texels",
            ),
        ];
        for (name, value, holds, allowed) in checks {
            if !holds {
                return Err(UnwrapError::Setting { name, value: value.to_string(), allowed });
            }
        }
        check_weld_distance(self.weld_distance)
    }
}

/// Checks the range of a weld distance.
pub(crate) fn check_weld_distance(distance: Option<f64>) -> Result<(), UnwrapError> {
    match distance.filter(|d| !(*d >= 0.0 && d.is_finite())) {
        None => Ok(()),
        Some(d) => {
            let (value, allowed) = (d.to_string(), "0 or more, in the unit of the positions");
            Err(UnwrapError::Setting { name: "weld_distance", value, allowed })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_iso_charts_differs_from_the_paper_in_its_model_only() {
        for settings in [Settings::default(), Settings::paper(), Settings::iso_charts()] {
            assert!(settings.validate().is_ok());
        }
        let mut settings = Settings::iso_charts();
        assert_eq!(settings.embedding.model, Model::Isomap);
        settings.embedding.model = Model::Paper;
        assert_eq!(settings, Settings::paper());
        let too_many = Settings { together_max: MOST_TOGETHER + 1, ..Settings::default() };
        assert!(matches!(too_many.validate(), Err(UnwrapError::Setting { name: "together_max", .. })));
    }
}
