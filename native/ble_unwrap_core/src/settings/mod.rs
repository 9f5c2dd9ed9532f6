//! Every parameter of the unwrapper, with three presets: the default for practical work, the paper's method, and
//! iso-charts, the method that the paper compares itself with.
//!
//! A setting is declared in two places. Its default, and the values that presets have instead, are where its structure is.
//! Everything else, such as its range and the sentences that describe it to users, is in the [`TABLE`].

mod interval;
mod table;

pub use interval::Interval;
pub use table::{Argument, Function, Group, Kind, NEIGHBOURS, Place, Setting, TABLE, THREADS, Value, listed};

pub use crate::choice::{Choice, Named};
pub use crate::geodesics::{GeodesicSettings, Metric};
pub use crate::packing::{PackSettings, Quality, Rotation};
pub use crate::segmentation::{CutCost, SegmentationSettings};
pub use crate::stretch::{Solver, StretchSettings};

use crate::choice::choices;
use crate::embedding::{EmbeddingSettings, Model};
use crate::error::UnwrapError;
use crate::mesh::ConditionOptions;

/// Patches of more vertices are embedded by landmarks in the presets of the paper, too. All distances of m vertices
/// take some 20 m² bytes and 0.4 µs a pair (marching, sweeps): 80 MB and 1.5 s at 2,000, twice the paper's own face of
/// "around 1,000 vertices"; every patch that is tried costs that again.
const PAPER_TOGETHER_MAX: usize = 2_000;

/// Most vertices of a patch whose distances to each other can be handled: 8 GB and minutes.
pub(crate) const MOST_TOGETHER: usize = 20_000;

/// The default of [`Settings::stretch_price`].
const DEFAULT_STRETCH_PRICE: f64 = 20.0;

/// The angle between two faces, in degrees, from which on a lightmap is cut between them: the sides of a hexagonal nut
/// are 60° apart and shaded one by one; those of an octagonal tube are 45° apart and shaded as if they were round.
const LIGHT_JUMPS: f64 = 50.0;

/// What happens to the holes of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Holes {
    /// A chart may have holes, that is, several boundary loops.
    Keep,
    /// Every chart is cut open to a topological disk, as in the paper.
    Cut,
}

choices!(Holes {
    Keep: "keep", "Keep", "A chart may have holes, and other charts may be packed into them.";
    Cut: "cut", "Cut", "Every chart is cut open to a disk.";
});

/// The moves that the search for charts may make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Moves {
    /// Patches are split until every part keeps the limit; nothing is joined.
    Split,
    /// Neighbouring charts are joined again where their union keeps the limit, too, as in iso-charts and the paper.
    Join,
    /// Charts may also be cut open by darts and into nets, be split at hard edges, be joined along a part of their border,
    /// hand polygons over a border that squeezes them, have cuts closed again from their ends, and be cut across where they are
    /// too long for the texture; and their highest stretch is lowered in the end.
    All,
}

choices!(Moves {
    Split: "split", "Split", "Patches are split until they keep the stretch limit.";
    Join: "join", "Split and Join", "Neighbouring charts are joined again where they keep the limit together.";
    All: "all", "All", "Charts may be cut open, unfolded and joined along a part of their border, too.";
});

/// Which side of a mesh is looked at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each is a direction along an axis of the mesh, or none")]
pub enum Front {
    None,
    X,
    NegativeX,
    Y,
    NegativeY,
    Z,
    NegativeZ,
}

choices!(Front {
    None: "none", "None", "No side more than another.";
    X: "x", "X", "Seams are drawn away from what faces along X.";
    NegativeX: "-x", "-X", "Seams are drawn away from what faces against X.";
    Y: "y", "Y", "Seams are drawn away from what faces along Y.";
    NegativeY: "-y", "-Y", "Seams are drawn away from what faces against Y, as the faces of figures do in Blender.";
    Z: "z", "Z", "Seams are drawn away from what faces along Z.";
    NegativeZ: "-z", "-Z", "Seams are drawn away from what faces against Z.";
});

impl Front {
    /// The direction, if there is one.
    pub(crate) fn direction(self) -> Option<[f64; 3]> {
        match self {
            Self::None => None,
            Self::X => Some([1.0, 0.0, 0.0]),
            Self::NegativeX => Some([-1.0, 0.0, 0.0]),
            Self::Y => Some([0.0, 1.0, 0.0]),
            Self::NegativeY => Some([0.0, -1.0, 0.0]),
            Self::Z => Some([0.0, 0.0, 1.0]),
            Self::NegativeZ => Some([0.0, 0.0, -1.0]),
        }
    }

    /// What is up where this is the front: Z, and Y for what faces along Z; none without a front.
    pub(crate) fn up(self) -> Option<[f64; 3]> {
        match self {
            Self::None => None,
            Self::Z | Self::NegativeZ => Some([0.0, 1.0, 0.0]),
            Self::X | Self::NegativeX | Self::Y | Self::NegativeY => Some([0.0, 0.0, 1.0]),
        }
    }
}

/// Whether charts of mirrored surfaces are mirrored, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Symmetry {
    /// Where a connected piece has a mirror plane along edges, its seams are mirrored, too.
    Auto,
    /// Seams are found without regard to it.
    Off,
}

choices!(Symmetry {
    Auto: "auto", "Auto", "Where a piece has a mirror plane along edges, so have its seams.";
    Off: "off", "Off", "Seams are found without regard to mirror planes.";
});

/// Which charts lie on each other in the texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stack {
    /// None do: each has its own place.
    Off,
    /// The charts of equal parts lie on each other: of connected pieces that are the same but for where they are and
    /// how they are turned.
    Equal,
    /// So do those of mirrored parts, and each chart of one half of a mirrored piece lies on its mirror image in the
    /// other half, where these are two charts.
    Mirrored,
}

choices!(Stack {
    Off: "off", "Off", "Every chart has a place of its own.";
    Equal: "equal", "Equal Parts", "Charts of equal parts lie exactly on each other and share their pixels.";
    Mirrored: "mirrored", "Equal and Mirrored", "Charts of mirrored parts and mirrored halves do so, too; there, the texture is mirrored on the surface.";
});

/// What kind of thing a mesh is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Style {
    /// Each connected piece is judged by itself. If most of it unrolls between hard edges, all such parts keep their shape; if most of it is
    /// planes, and walls that stand on them, with bevels between, these do, and bevels go with the planes; else large planes between hard edges do.
    Auto,
    /// The mesh has grown, and hard edges are not treated specially.
    Organic,
    /// The mesh is manufactured, and all that unrolls between hard edges keeps its shape.
    Hard,
}

choices!(Style {
    Auto: "auto", "Auto", "Parts between hard edges that can lie flat without stretch do so if most of a connected piece is made of them, and so do planes and walls between bevels; else only large planes do.";
    Organic: "organic", "Organic", "Hard edges are not treated specially.";
    Hard: "hard", "Hard Surface", "All parts between hard edges lie flat without stretch, but for thin rings that become strips, whatever the piece is made of; edges count as hard from 40° instead of 50°, and with either from less on a finely divided surface.";
});

/// How charts are scaled relative to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChartScale {
    /// The same area of texture for the same area of surface, in all charts.
    Uniform,
    /// More texture for stretched charts: texels per unit of length are multiplied by the square root of the chart's L2
    /// stretch, which is √(E/A) for the integral E of the squared stretch over the area A of the chart, but by no less than
    /// ½ and no more than 2.
    Stretch,
}

choices!(ChartScale {
    Uniform: "uniform", "Uniform", "The same texel density everywhere.";
    Stretch: "stretch", "By Stretch", "More pixels where a chart is stretched, between half and double.";
});

/// What the stretch limit bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LimitOver {
    /// The L2 stretch of every chart.
    Chart,
    /// The L2 stretch of the whole atlas, as in UVAtlas: the square root of the mean of the charts' squared L2 stretch,
    /// weighted by area. Single charts may have more, up to [`Settings::chart_limit`].
    Atlas,
}

choices!(LimitOver {
    Chart: "chart", "Each Chart", "No chart is stretched beyond the limit.";
    Atlas: "atlas", "Whole Atlas", "All charts together keep the limit, while some exceed it, up to fourfold above 1: fewer charts.";
});

/// The preset that gives the values of all settings that are not named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Preset {
    /// [`Settings::default`].
    Default,
    /// [`Settings::paper`].
    Paper,
    /// [`Settings::iso_charts`].
    IsoCharts,
    /// [`Settings::lightmap`].
    Lightmap,
}

choices!(Preset {
    Default: "default", "Default", "Extended model, fast solvers: least stretch and fewest charts.";
    Paper: "paper", "Paper", "The published method as printed: slower, more charts.";
    IsoCharts: "iso_charts", "Iso-charts", "The same with Isomap, the method the paper compares itself with.";
    Lightmap: "lightmap", "Lightmap", "For baked light: hard edges are cut, mip levels do not bleed, and rectangles lie on whole texels.";
});

/// A limit over the atlas lets single charts stretch so many times more above 1.
const SINGLE_CHARTS: f64 = 4.0;

/// All settings of [`unwrap`](crate::unwrap()), grouped by stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Upper bound of the L2 stretch; must be above 1, which is no stretch.
    pub stretch_limit: f64,
    /// Whether `stretch_limit` bounds the L2 stretch of every chart or that of all charts together.
    pub limit_over: LimitOver,
    /// Whether vertices at the same position are welded, that is, count as one. Off by default: an edge between two
    /// vertices of the input is then a seam only if the result makes it one. Turn it on for data that repeats vertices
    /// along its own seams, as many file formats do.
    pub weld: bool,
    /// The distance up to which vertices are welded, in the unit of the input; 0 welds only those with exactly the same
    /// coordinates. `None` stands for a distance that single precision cannot resolve: 2⁻²¹ of the diagonal of the bounding
    /// box, or, if all coordinates are numbers of single precision, of the greatest coordinate where that is larger, but at
    /// most a hundredth of the mean length of an edge. Has no effect unless `weld` is on.
    ///
    /// All vertices of a welded group lie within this distance of one of them, so a long chain of close vertices does not
    /// become a single vertex. Two vertices of one polygon are never welded unless they coincide: welding takes no side
    /// from a polygon, however large the distance.
    pub weld_distance: Option<f64>,
    /// The angle between the normals of two faces, in degrees, from which on the edge between them is cut, above 0 and
    /// at most 180; `None` cuts none for its angle. Angles that differ by rounding, up to a millionth of the cosine,
    /// count as the same. Faces without area have no normal, and are not cut off for it.
    pub cut_angle: Option<f64>,
    /// Whether large components are first cut on a coarse copy of the mesh. When it is off, as in the paper's presets,
    /// trial embeddings also use the full number of landmarks.
    pub coarse: bool,
    /// Which moves the search for charts may make.
    pub moves: Moves,
    /// What stretch costs beside seams: how long a seam, in square roots of the surface's area, an excess of 1 of the squared
    /// L2 stretch over the whole surface is worth. Charts are cut further where that saves more stretch than it costs seam,
    /// and joined only where it does not. With 0, stretch under the limit costs nothing, and seams are as short as the limit
    /// allows.
    pub stretch_price: f64,
    /// How much dearer a seam is where it can be seen: what it costs goes with this power of its visibility, which is the share of the
    /// outside, weighted with the cosine, that rays from there reach. In the mean over a component it costs what its length does.
    /// With 0 all places are alike.
    pub hide_seams: f64,
    /// Which side of the mesh is looked at most: what faces it counts as seen from three times as far as what faces away from it, and
    /// what faces sideways from twice as far. Has no effect where `hide_seams` is 0.
    pub front: Front,
    /// Whether charts of mirrored surfaces are mirrored, too. A mirror plane is one that takes every vertex of a connected piece to
    /// another, to a thousandth of its size, and every polygon to another. UVs are not mirrored: each half has its own place.
    pub symmetry: Symmetry,
    /// Which charts lie on each other. Parts are alike if they have the same polygons, to a thousandth of their size,
    /// and the same seams, guides and weights of seams. What is stacked shares its UVs to the bit, and the place that
    /// it does not need gives all charts more texels. The UVs of a chart that lies on its mirror image are mirrored as
    /// a whole; nothing else is ever mirrored. Has an effect only with all `moves` and with a limit over each chart.
    pub stack: Stack,
    /// What kind of thing the mesh is. Planes, walls of cylinders and the like, which lie flat without stretch, are cut out at the hard edges around
    /// them and come out as they are; they are joined to others only if the result lies flat, too. Has an effect only with all `moves`; a limit
    /// over the atlas, and the mirror plane of a symmetric piece, may join them otherwise.
    pub style: Style,
    /// How much seam a straight side is worth that lies along an axis of the texture: where the border of a chart runs straight on the surface
    /// between two corners, it is made straight in the chart, and laid along an axis, if that costs less in stretch than so many times its
    /// length costs as seam. On the same condition thin rings, such as the rim of a hoop, are opened and become strips. Has an effect only with all
    /// `moves`, and none where `stretch_price` is 0.
    pub straighten: f64,
    /// How much longer seams may get for a texture that is covered better: by so many times the share of the texture that is covered besides, as a share
    /// of all seam. Where one or two charts leave much of it empty, they are cut where they are narrow, little is seen and the parts then lie closer
    /// together. Has an effect only with all `moves`, on one tile, without a given density and without stacks, and none where
    /// `stretch_price` is 0. Of the texture, only its proportions matter.
    pub cover_price: f64,
    /// What happens to the holes of charts.
    pub holes: Holes,
    /// How charts are scaled relative to each other.
    pub chart_scale: ChartScale,
    /// Patches with at most so many vertices are embedded with all their vertices together, as in the paper, which takes
    /// time and memory proportional to the square of that number. Larger patches are embedded by their landmarks. With 0,
    /// all patches are embedded by landmarks.
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
    /// The settings for practical work: the extended model, projected Newton steps, and holes kept.
    fn default() -> Self {
        Self {
            stretch_limit: 1.1,
            limit_over: LimitOver::Chart,
            weld: false,
            weld_distance: None,
            cut_angle: None,
            coarse: true,
            moves: Moves::All,
            stretch_price: DEFAULT_STRETCH_PRICE,
            hide_seams: 2.0,
            front: Front::None,
            symmetry: Symmetry::Auto,
            stack: Stack::Off,
            style: Style::Auto,
            straighten: 0.25,
            cover_price: 2.5,
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
    /// The paper's method as printed. Its landmarks, one vertex in a hundred, are used for cutting (section 5.1); its model
    /// is fitted from a random start to all vertices of a patch together; stretch is minimised by Sander's line searches;
    /// charts are disks; the margin is two texels at a texture size of 1024.
    ///
    /// A patch of more than 2,000 vertices is embedded by its landmarks, and its other vertices are placed by regression,
    /// since all pairs of vertices would take too much time and memory.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            holes: Holes::Cut,
            coarse: false,
            moves: Moves::Join,
            stretch_price: 0.0,
            hide_seams: 0.0,
            symmetry: Symmetry::Off,
            style: Style::Organic,
            straighten: 0.0,
            cover_price: 0.0,
            segmentation: SegmentationSettings::paper(),
            together_max: PAPER_TOGETHER_MAX,
            geodesics: GeodesicSettings::paper(),
            embedding: EmbeddingSettings::paper(),
            stretch: StretchSettings::paper(),
            packing: PackSettings::paper(),
            ..Self::default()
        }
    }

    /// The method that the paper compares itself with: iso-charts (Zhou, Snyder, Guo, Shum 2004). The stages and the
    /// settings are those of [`Settings::paper`], with Isomap in place of Bernoulli logistic embedding.
    #[must_use]
    pub fn iso_charts() -> Self {
        let paper = Self::paper();
        Self { embedding: EmbeddingSettings { model: Model::Isomap, ..paper.embedding.clone() }, ..paper }
    }

    /// For textures of baked light. Edges of 50° and more are cut, since light jumps there and filtering would smear
    /// the jump across the edge; a texture of 1024 texels keeps charts apart also on two mip levels, down to 256
    /// texels; and rectangles lie on whole texels. The rest is as by default: no two charts share a place, and there is
    /// one tile.
    #[must_use]
    pub fn lightmap() -> Self {
        Self { cut_angle: Some(LIGHT_JUMPS), packing: PackSettings::lightmap(), ..Self::default() }
    }
}

impl Settings {
    /// What a mesh is conditioned with.
    #[must_use]
    pub(crate) fn conditioning(&self) -> ConditionOptions {
        ConditionOptions { weld: self.weld, weld_distance: self.weld_distance, cut_angle: self.cut_angle }
    }

    /// The L2 stretch that a single chart may have. This is `stretch_limit` itself, or, where the limit is over the atlas,
    /// the value that is four times as far above 1.
    #[must_use]
    pub fn chart_limit(&self) -> f64 {
        match self.limit_over {
            LimitOver::Chart => self.stretch_limit,
            LimitOver::Atlas => 1.0 + SINGLE_CHARTS * (self.stretch_limit - 1.0),
        }
    }

    /// The settings of a preset.
    #[must_use]
    pub fn of(preset: Preset) -> Self {
        match preset {
            Preset::Default => Self::default(),
            Preset::Paper => Self::paper(),
            Preset::IsoCharts => Self::iso_charts(),
            Preset::Lightmap => Self::lightmap(),
        }
    }

    /// Checks the range of every setting in the [`TABLE`] and of those that only Rust has, and that no two settings
    /// contradict each other.
    ///
    /// # Errors
    /// [`UnwrapError::Setting`] with the first setting that is out of range.
    pub fn validate(&self) -> Result<(), UnwrapError> {
        let refused = |name, value: String, allowed| Err(UnwrapError::Setting { name, value, allowed });
        let mut taken = Self::default();
        for setting in TABLE {
            let value = setting.value(self);
            if !setting.set(&mut taken, value) {
                return refused(setting.name, value.to_string(), setting.expected());
            }
        }
        let GeodesicSettings { landmark_min, landmark_max, .. } = self.geodesics;
        if landmark_max < landmark_min {
            return refused(
                "landmark_max",
                landmark_max.to_string(),
                format!("at least landmark_min, which is {landmark_min}"),
            );
        }
        let s = &self.segmentation;
        for (name, parts) in [("first_parts", s.first_parts), ("later_parts", s.later_parts)] {
            if parts < 2 {
                return refused(name, parts.to_string(), "at least 2".into());
            }
        }
        let share = Interval::closed(0.0, 1.0);
        for (name, value) in [("band", s.band), ("crease_share", s.crease_share)] {
            if !share.contains(value) {
                return refused(name, value.to_string(), format!("a number {share}"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_iso_charts_differs_from_the_paper_in_its_model_only() {
        for settings in [Settings::default(), Settings::paper(), Settings::iso_charts(), Settings::lightmap()] {
            assert!(settings.validate().is_ok());
        }
        let mut settings = Settings::iso_charts();
        assert_eq!(settings.embedding.model, Model::Isomap);
        settings.embedding.model = Model::Paper;
        assert_eq!(settings, Settings::paper());
    }

    /// The name and the range in the error that some settings give.
    fn refused(settings: &Settings) -> (&'static str, String) {
        match settings.validate() {
            Err(UnwrapError::Setting { name, allowed, .. }) => (name, allowed),
            other => panic!("{other:?}"),
        }
    }

    /// A value at each end of a setting's range, or next to it where the end is left out, and values just outside.
    fn at_the_ends(setting: &Setting) -> (Vec<Value<'static>>, Vec<Value<'static>>) {
        let real = |range: Interval| {
            let inside = [
                if range.least_open { range.least.next_up() } else { range.least },
                if range.most_open { range.most.next_down() } else { range.most },
            ];
            let outside = [inside[0].next_down(), inside[1].next_up(), f64::NAN];
            (inside.map(Value::Real).to_vec(), outside.map(Value::Real).to_vec())
        };
        let whole = |[least, most]: [u64; 2]| {
            let outside = [least.checked_sub(1), most.checked_add(1)];
            (vec![Value::Whole(least), Value::Whole(most)], outside.into_iter().flatten().map(Value::Whole).collect())
        };
        match setting.kind {
            Kind::Flag(_) => (vec![Value::Flag(false), Value::Flag(true)], vec![]),
            Kind::Real(_, range) => real(range),
            Kind::OptionalReal(_, range, _) => {
                let (inside, outside) = real(range);
                ([inside, vec![Value::None]].concat(), outside)
            }
            Kind::Whole(_, range) => whole(range.map(|n| n as u64)),
            Kind::Limit(_, range) => {
                let (inside, outside) = whole(range.map(|n| n as u64));
                ([inside, vec![Value::None]].concat(), outside)
            }
            Kind::Seed(_) => whole([0, u64::MAX]),
            Kind::Size(_, [least, most]) => {
                let [least, most] = [u64::from(least), u64::from(most)];
                let outside = [[least - 1, most], [most, most + 1]].map(Value::Size);
                (vec![Value::Size([least, most]), Value::Size([most, least])], outside.to_vec())
            }
            Kind::Choice(place) => {
                let words = place(&mut Settings::default()).all().iter().map(|value| Value::Word(value.word));
                (words.collect(), vec![Value::Word("unheard of")])
            }
        }
    }

    /// Puts a value where a setting lies, whether it is in range or not.
    fn force(setting: &Setting, settings: &mut Settings, value: Value<'_>) {
        match (setting.kind, value) {
            (Kind::Real(place, _), Value::Real(x)) => *place(settings) = x,
            (Kind::OptionalReal(place, ..), Value::Real(x)) => *place(settings) = Some(x),
            (Kind::Whole(place, _) | Kind::Limit(place, _), Value::Whole(n)) => *place(settings) = n as usize,
            (Kind::Size(places, _), Value::Size(sides)) => {
                places(settings).into_iter().zip(sides).for_each(|(place, side)| *place = side as u32);
            }
            (Kind::Choice(_), Value::Word(_)) => {} // no such value can be written
            (kind, value) => panic!("{kind:?} {value:?}"),
        }
    }

    #[test]
    fn every_range_is_kept_at_its_ends_and_just_outside() {
        for setting in TABLE {
            let (inside, outside) = at_the_ends(setting);
            for value in inside {
                let mut settings = Settings::default();
                assert!(setting.set(&mut settings, value), "{} {value}", setting.name);
                assert_eq!(setting.value(&settings), value, "{}", setting.name);
                // Bounds of landmarks that contradict each other are refused for that.
                settings.geodesics.landmark_max = settings.geodesics.landmark_max.max(settings.geodesics.landmark_min);
                assert!(settings.validate().is_ok(), "{} {value}", setting.name);
                assert_eq!(settings.embedding.validate(), Ok(()), "the stage itself takes {} {value}", setting.name);
            }
            for value in outside {
                let mut settings = Settings::default();
                assert!(!setting.set(&mut settings, value), "{} {value}", setting.name);
                assert_eq!(settings, Settings::default(), "{} {value}: nothing is changed", setting.name);
                force(setting, &mut settings, value);
                if settings != Settings::default() {
                    assert_eq!(refused(&settings), (setting.name, setting.expected()), "{value}");
                }
            }
            assert!(!setting.set(&mut Settings::default(), Value::Word("unheard of")), "{}", setting.name);
        }
    }

    #[test]
    fn settings_that_contradict_each_other_and_those_of_rust_alone_are_checked() {
        let mut settings = Settings::default();
        settings.geodesics.landmark_max = settings.geodesics.landmark_min - 1;
        assert_eq!(refused(&settings), ("landmark_max", "at least landmark_min, which is 48".into()));
        let wrong: [fn(&mut SegmentationSettings); 4] =
            [|s| s.first_parts = 1, |s| s.later_parts = 0, |s| s.band = 1.5, |s| s.crease_share = f64::NAN];
        for (change, name) in wrong.into_iter().zip(["first_parts", "later_parts", "band", "crease_share"]) {
            let mut settings = Settings::default();
            change(&mut settings.segmentation);
            assert_eq!(refused(&settings).0, name);
        }
    }

    #[test]
    fn everything_in_the_table_is_told_in_sentences_and_once() {
        let mut names: Vec<&str> = TABLE.iter().map(|setting| setting.name).collect();
        names.extend([NEIGHBOURS.name, THREADS.name]);
        let mut sentences: Vec<&str> = TABLE.iter().map(|setting| setting.sentence).collect();
        sentences.extend([NEIGHBOURS.sentence, THREADS.sentence]);
        for setting in TABLE {
            if let Kind::Choice(place) = setting.kind {
                sentences.extend(place(&mut Settings::default()).all().iter().map(|value| value.sentence));
            }
        }
        for list in [names, sentences] {
            let count = list.len();
            let distinct: std::collections::BTreeSet<&str> = list.into_iter().collect();
            assert_eq!(distinct.len(), count);
            assert!(distinct.iter().all(|text| !text.contains("  ")), "{distinct:?}");
        }
        for sentence in TABLE.iter().map(|setting| setting.sentence) {
            assert!(sentence.ends_with('.') && sentence.starts_with(char::is_uppercase), "{sentence}");
        }
        assert_eq!(listed(&["a"]), "'a'");
        assert_eq!(listed(&["a", "b", "c"]), "'a', 'b' or 'c'");
    }

    #[test]
    fn a_function_takes_its_groups_and_unwrap_takes_all() {
        for group in Group::ALL {
            assert!(group.concerns(Function::Unwrap));
            assert!(!group.concerns(Function::GraphDistances) && !group.concerns(Function::Transform));
            assert!(TABLE.iter().any(|setting| setting.group == group), "{group:?} is not empty");
        }
        assert!(Group::Weld.concerns(Function::Measure) && !Group::Weld.concerns(Function::UnwrapPoints));
    }
}
