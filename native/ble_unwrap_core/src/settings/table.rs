//! The table of all settings: whatever is said of a setting anywhere is said here, but for its default and the values of
//! the presets, which the `Default` implementations and presets of the stages say.
//!
//! [`Settings::validate`] runs over it; the Python module parses and describes its keywords by it; and
//! `make settings` writes it to the files that the add-on, the type stub and the manual read.

use crate::choice::Choice;
use crate::packing::PackSettings;
use crate::segmentation::SegmentationSettings;

use super::interval::Interval;
use super::{MOST_TOGETHER, Settings};

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The name in Python, on the command line and in files.
    pub name: &'static str,
    /// The name on the screen.
    pub label: &'static str,
    /// Which functions take it.
    pub group: Group,
    /// What values it can have, and where its value is in [`Settings`].
    pub kind: Kind,
    /// The unit; empty where there is none.
    pub unit: &'static str,
    /// What it does, in a sentence or a few.
    pub sentence: &'static str,
}

/// Where a value lies in the settings.
pub type Place<T> = fn(&mut Settings) -> &mut T;

/// What values a setting can have, their range, and where the value is in [`Settings`].
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// True or false.
    Flag(Place<bool>),
    /// A number in the interval.
    Real(Place<f64>, Interval),
    /// A number in the interval, or `None`, which stands for what the text says.
    OptionalReal(Place<Option<f64>>, Interval, &'static str),
    /// A whole number from the first to the second, both included.
    Whole(Place<usize>, [usize; 2]),
    /// A whole number from the first to the second, both included, or no limit, which is `usize::MAX`.
    Limit(Place<usize>, [usize; 2]),
    /// Any unsigned whole number of 64 bits.
    Seed(Place<u64>),
    /// Width and height in texels, each from the first number to the second, both included.
    Size(fn(&mut Settings) -> [&mut u32; 2], [u32; 2]),
    /// One of a few values, each of which has a word.
    Choice(fn(&mut Settings) -> &mut dyn Choice),
}

/// The value of a setting of any kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// The value of a [`Kind::Flag`].
    Flag(bool),
    /// The value of a [`Kind::Real`] or [`Kind::OptionalReal`].
    Real(f64),
    /// The value of a [`Kind::Whole`], [`Kind::Limit`] or [`Kind::Seed`].
    Whole(u64),
    /// The width and height of a [`Kind::Size`].
    Size([u64; 2]),
    /// The word of a [`Kind::Choice`].
    Word(&'a str),
    /// A [`Kind::OptionalReal`] that is left to the library, or a [`Kind::Limit`] that does not limit anything.
    None,
}

/// The functions that take settings, by their names in Python. [`Function::Unwrap`] takes all settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "they are documented where they are")]
#[non_exhaustive]
pub enum Function {
    Unwrap,
    Analyse,
    UnwrapPoints,
    Embed,
    Flatten,
    Transform,
    Place,
    GeodesicDistances,
    GraphDistances,
    Measure,
    Relax,
    Pack,
}

impl Function {
    /// All functions.
    pub const ALL: [Self; 12] = [
        Self::Unwrap,
        Self::Analyse,
        Self::UnwrapPoints,
        Self::Embed,
        Self::Flatten,
        Self::Transform,
        Self::Place,
        Self::GeodesicDistances,
        Self::GraphDistances,
        Self::Measure,
        Self::Relax,
        Self::Pack,
    ];

    /// The name in Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Unwrap => "unwrap",
            Self::Analyse => "analyse",
            Self::UnwrapPoints => "unwrap_points",
            Self::Embed => "embed",
            Self::Flatten => "flatten",
            Self::Transform => "transform",
            Self::Place => "place",
            Self::GeodesicDistances => "geodesic_distances",
            Self::GraphDistances => "graph_distances",
            Self::Measure => "measure",
            Self::Relax => "relax",
            Self::Pack => "pack",
        }
    }
}

/// Settings that are taken by the same functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Group {
    /// How a surface is cut into charts.
    Charts,
    /// How surfaces, and clouds as well, are cut into charts.
    Limit,
    /// Which vertices count as one.
    Weld,
    /// Which edges of a surface are cut whatever the charts.
    Cut,
    /// How distances on surfaces are measured.
    Geodesics,
    /// How many landmarks there are.
    Landmarks,
    /// Which model embeds points.
    Model,
    /// How the model is fitted.
    Fit,
    /// Where the fit starts from. [`Function::Embed`] has an argument of its own instead, which can also be an array of
    /// coordinates.
    Start,
    /// How one patch of a surface becomes flat.
    Flattening,
    /// How long the stretch of a chart is minimised.
    Stretch,
    /// The size of the texture that the result is for.
    Size,
    /// How far apart charts are in the texture.
    Margin,
    /// The tiles that the texture has. Clouds have one.
    Tiles,
    /// How charts are placed in the texture.
    Packing,
    /// How large charts are, to the texel, and what gives way where they do not fit. Those of clouds fill the texture.
    Density,
}

impl Group {
    /// All groups.
    pub const ALL: [Self; 16] = [
        Self::Charts,
        Self::Limit,
        Self::Weld,
        Self::Cut,
        Self::Geodesics,
        Self::Landmarks,
        Self::Model,
        Self::Fit,
        Self::Start,
        Self::Flattening,
        Self::Stretch,
        Self::Size,
        Self::Margin,
        Self::Tiles,
        Self::Packing,
        Self::Density,
    ];

    /// The group's name in lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Charts => "charts",
            Self::Limit => "limit",
            Self::Weld => "weld",
            Self::Cut => "cut",
            Self::Geodesics => "geodesics",
            Self::Landmarks => "landmarks",
            Self::Model => "model",
            Self::Fit => "fit",
            Self::Start => "start",
            Self::Flattening => "flattening",
            Self::Stretch => "stretch",
            Self::Size => "size",
            Self::Margin => "margin",
            Self::Tiles => "tiles",
            Self::Packing => "packing",
            Self::Density => "density",
        }
    }

    /// Whether a function takes the settings of the group. If it does not, giving it one is an error.
    #[must_use]
    pub fn concerns(self, function: Function) -> bool {
        use Function::{Analyse, Embed, Flatten, GeodesicDistances, Measure, Pack, Place, Relax, Unwrap, UnwrapPoints};
        let others: &[Function] = match self {
            Self::Charts => &[],
            Self::Limit => &[UnwrapPoints],
            Self::Weld => &[Analyse, Flatten, Measure, Relax],
            Self::Cut => &[Analyse],
            Self::Geodesics => &[GeodesicDistances, Flatten],
            Self::Landmarks => &[Flatten, UnwrapPoints],
            Self::Model => &[Embed, Place, Flatten, UnwrapPoints],
            Self::Fit => &[Embed, Flatten, UnwrapPoints],
            Self::Start => &[Flatten, UnwrapPoints],
            Self::Flattening => &[Flatten],
            Self::Stretch => &[Flatten, Relax],
            Self::Size => &[Measure, Pack, Relax, UnwrapPoints],
            Self::Margin => &[Measure, Pack, UnwrapPoints],
            Self::Tiles => &[Measure, Pack],
            Self::Packing => &[Pack, UnwrapPoints],
            Self::Density => &[Pack],
        };
        function == Unwrap || others.contains(&function)
    }
}

impl Setting {
    /// The value that this setting has in `settings`.
    #[must_use]
    pub fn value(&self, settings: &Settings) -> Value<'static> {
        // The places are for writing, too; settings are a few hundred bytes.
        let settings = &mut settings.clone();
        match self.kind {
            Kind::Flag(place) => Value::Flag(*place(settings)),
            Kind::Real(place, _) => Value::Real(*place(settings)),
            Kind::OptionalReal(place, ..) => place(settings).map_or(Value::None, Value::Real),
            Kind::Whole(place, _) => Value::Whole(*place(settings) as u64),
            Kind::Limit(place, _) => match *place(settings) {
                usize::MAX => Value::None,
                limit => Value::Whole(limit as u64),
            },
            Kind::Seed(place) => Value::Whole(*place(settings)),
            Kind::Size(places, _) => Value::Size(places(settings).map(|side| u64::from(*side))),
            Kind::Choice(place) => Value::Word(place(settings).word()),
        }
    }

    /// Gives this setting a value in `settings`. Returns false, and changes nothing, if the value is of another kind or out
    /// of range.
    #[must_use]
    pub fn set(&self, settings: &mut Settings, value: Value<'_>) -> bool {
        match (self.kind, value) {
            (Kind::Flag(place), Value::Flag(flag)) => *place(settings) = flag,
            (Kind::Real(place, interval), Value::Real(x)) if interval.contains(x) => *place(settings) = x,
            (Kind::OptionalReal(place, interval, _), Value::Real(x)) if interval.contains(x) => {
                *place(settings) = Some(x);
            }
            (Kind::OptionalReal(place, ..), Value::None) => *place(settings) = None,
            (Kind::Whole(place, range) | Kind::Limit(place, range), Value::Whole(n)) => match within(n, range) {
                Some(n) => *place(settings) = n,
                None => return false,
            },
            (Kind::Limit(place, _), Value::None) => *place(settings) = usize::MAX,
            (Kind::Seed(place), Value::Whole(n)) => *place(settings) = n,
            (Kind::Size(places, range), Value::Size([width, height])) => {
                let (Some(width), Some(height)) = (within(width, range), within(height, range)) else { return false };
                let [w, h] = places(settings);
                (*w, *h) = (width, height);
            }
            (Kind::Choice(place), Value::Word(word)) => return place(settings).choose(word),
            _ => return false,
        }
        true
    }

    /// What values the setting can have, in words that complete "it must be": for instance, "a number above 0 and at most
    /// 1".
    #[must_use]
    pub fn expected(&self) -> String {
        let whole = |[least, most]: [u64; 2]| format!("a whole number from {least} to {most}");
        match self.kind {
            Kind::Flag(_) => "true or false".into(),
            Kind::Real(_, interval) => format!("a number {interval}"),
            Kind::OptionalReal(_, interval, none) => format!("a number {interval}, or None for {none}"),
            Kind::Whole(_, range) => whole(range.map(|n| n as u64)),
            Kind::Limit(_, range) => format!("{}, or None for {NO_LIMIT}", whole(range.map(|n| n as u64))),
            Kind::Seed(_) => whole([0, u64::MAX]),
            Kind::Size(_, range) => format!("{} texels, or a pair of them", whole(range.map(u64::from))),
            Kind::Choice(place) => {
                let mut settings = Settings::default();
                let words: Vec<&str> = place(&mut settings).all().iter().map(|value| value.word).collect();
                listed(&words)
            }
        }
    }

    /// What `None` stands for, if the setting can be `None`.
    #[must_use]
    pub fn none(&self) -> Option<&'static str> {
        match self.kind {
            Kind::OptionalReal(_, _, none) => Some(none),
            Kind::Limit(..) => Some(NO_LIMIT),
            _ => None,
        }
    }
}

/// What `None` stands for in a [`Kind::Limit`].
const NO_LIMIT: &str = "no limit";

/// A whole number of the range's own type, if it lies in the range.
fn within<T: Copy + PartialOrd + TryFrom<u64>>(n: u64, [least, most]: [T; 2]) -> Option<T> {
    T::try_from(n).ok().filter(|n| (least..=most).contains(n))
}

/// Words in quotes, listed as in an English sentence: `'a', 'b' or 'c'`.
#[must_use]
pub fn listed(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}

impl std::fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Real(x) => write!(f, "{x}"),
            Self::Whole(n) => write!(f, "{n}"),
            Self::Size([width, height]) => write!(f, "{width} by {height}"),
            Self::Word(word) => write!(f, "{word}"),
            Self::None => write!(f, "not given"),
        }
    }
}

/// A whole number that functions take besides the settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Argument {
    /// The name in Python and on the command line.
    pub name: &'static str,
    /// The name on the screen.
    pub label: &'static str,
    /// The value where none is given.
    pub default: usize,
    /// The least and the greatest value.
    pub range: [usize; 2],
    /// What it does, in a sentence.
    pub sentence: &'static str,
}

/// The number of nearest neighbours that each point of a cloud is joined to. With 12, graph distances are 3 % too long on
/// average, which the relaxation of a chart corrects; the paper names no number. Fewer than 4 do not determine a tangent
/// plane; more than 256 take too much memory for the clouds that would need them.
pub const NEIGHBOURS: Argument = Argument {
    name: "neighbours",
    label: "Neighbours",
    default: 12,
    range: [4, 256],
    sentence: "Each point of a cloud is joined to so many nearest points. More bridge gaps, fewer keep sheets apart.",
};

/// The number of threads of a call. The greatest allowed value is several times what the largest machines have, and far
/// below what would exhaust a machine.
pub const THREADS: Argument = Argument {
    name: "threads",
    label: "Threads",
    default: 0,
    range: [0, 1024],
    sentence: "Processor threads to work with; 0 takes all that the machine has. The result does not depend on it.",
};

const fn row(
    name: &'static str,
    label: &'static str,
    group: Group,
    kind: Kind,
    unit: &'static str,
    sentence: &'static str,
) -> Setting {
    Setting { name, label, group, kind, unit, sentence }
}

/// All settings, in the order in which they are listed.
#[rustfmt::skip] // a table: first what a setting is, then what it does
pub static TABLE: &[Setting] = &[
    row("stretch_limit", "Stretch Limit", Group::Limit, Kind::Real(|s| &mut s.stretch_limit, Interval::above(1.0, 1e3)), "",
        "No chart may have a larger L2 stretch than this; 1 is none. Lower values give less distortion and more seams."),
    row("limit_over", "Limit Over", Group::Charts, Kind::Choice(|s| &mut s.limit_over), "",
        "What the limit bounds."),
    row("weld", "Weld Vertices", Group::Weld, Kind::Flag(|s| &mut s.weld), "",
        "Lets charts run across vertices at the same place, which imported files often have. The mesh itself stays as it is."),
    row("weld_distance", "Weld Distance", Group::Weld,
        Kind::OptionalReal(|s| &mut s.weld_distance, Interval::at_least(0.0), "what single precision cannot tell apart"), "the mesh's unit of length",
        "How near to each other vertices are that are welded. Two vertices of one face never are, unless they coincide."),
    row("cut_angle", "Cut Angle", Group::Cut, Kind::OptionalReal(|s| &mut s.cut_angle, Interval::above(0.0, 180.0), "no edge"), "degrees",
        "Edges at which the normals of two faces are at least so many degrees apart are all cut."),
    row("coarse", "Coarse First", Group::Limit, Kind::Flag(|s| &mut s.coarse), "",
        "Decides on a coarse copy where to cut large pieces of surface, which is many times faster."),
    row("stretch_price", "Stretch Price", Group::Charts, Kind::Real(|s| &mut s.stretch_price, Interval::closed(0.0, 1e3)), "width of the surface",
        "How much more seam less stretch is worth: the length of seam for an excess of 1 of the squared stretch. \
         0 makes seams as short as the limit allows; more gives less stretch and more charts."),
    row("hide_seams", "Hide Seams", Group::Charts, Kind::Real(|s| &mut s.hide_seams, Interval::closed(0.0, 10.0)), "",
        "How strongly seams are drawn to where they are hidden: under chins, behind ears, between limbs. A seam costs as much as \
         this power of how far it can be seen; 0 makes all places alike."),
    row("front", "Front", Group::Charts, Kind::Choice(|s| &mut s.front), "",
        "Which side is looked at most. The layout is turned so that what is up on the object is up in it."),
    row("symmetry", "Symmetry", Group::Charts, Kind::Choice(|s| &mut s.symmetry), "",
        "Whether seams of mirrored surfaces are mirrored, too."),
    row("stack", "Stack", Group::Charts, Kind::Choice(|s| &mut s.stack), "",
        "Which charts lie on each other, so that like parts share their pixels and all charts get more of them. Nothing is copied, and so nothing stacked, under a limit over the atlas or with fewer moves."),
    row("style", "Style", Group::Charts, Kind::Choice(|s| &mut s.style), "",
        "Whether planes, cylinders and the like between hard edges keep their shape."),
    row("straighten", "Straighten", Group::Charts, Kind::Real(|s| &mut s.straighten, Interval::closed(0.0, 10.0)), "",
        "How much seam a straight side along an axis of the texture is worth. Sides of charts that are straight on the surface are made \
         straight, and thin rings become strips, where that costs less in stretch; 0 leaves them as they are."),
    row("cover_price", "Cut to Fill", Group::Charts, Kind::Real(|s| &mut s.cover_price, Interval::closed(0.0, 100.0)), "",
        "How much longer seams may get for a texture that is covered better: one or two charts that leave much of it empty are cut where their parts then lie closer \
         together, if that makes all seams longer by at most so many per cent for each per cent of the texture; 0 cuts none for it."),
    row("moves", "Moves", Group::Charts, Kind::Choice(|s| &mut s.moves), "",
        "What the search for charts may do."),
    row("holes", "Holes", Group::Charts, Kind::Choice(|s| &mut s.holes), "",
        "What happens to charts with holes."),
    row("chart_scale", "Chart Scale", Group::Charts, Kind::Choice(|s| &mut s.chart_scale), "",
        "How large charts are beside each other."),
    row("crease_weight", "Crease Weight", Group::Charts,
        Kind::Real(|s| &mut s.segmentation.crease_weight, Interval::closed(0.0, SegmentationSettings::MOST_CREASE_WEIGHT)), "",
        "How strongly borders are drawn to folds of the surface; 0 looks at their length alone."),
    row("seed", "Seed", Group::Fit, Kind::Seed(|s| &mut s.seed), "",
        "Start of all random choices. The same seed gives the same result on any machine."),
    row("geodesics", "Geodesics", Group::Geodesics, Kind::Choice(|s| &mut s.geodesics.metric), "",
        "How distances along the surface are measured."),
    row("landmark_fraction", "Landmarks", Group::Landmarks,
        Kind::Real(|s| &mut s.geodesics.landmark_fraction, Interval::above(0.0, 1.0)), "share of the vertices",
        "Share of a chart's vertices that serve as landmarks of its embedding."),
    row("landmark_min", "At Least", Group::Landmarks, Kind::Whole(|s| &mut s.geodesics.landmark_min, [3, 100_000]), "landmarks",
        "Fewest landmarks of a chart, where it has as many vertices."),
    row("landmark_max", "At Most", Group::Landmarks, Kind::Limit(|s| &mut s.geodesics.landmark_max, [3, 100_000]), "landmarks",
        "Most landmarks of a chart."),
    row("together_max", "Together", Group::Flattening, Kind::Whole(|s| &mut s.together_max, [0, MOST_TOGETHER]), "vertices",
        "Charts of at most so many vertices are embedded with all their vertices together, as in the paper, at a cost of the \
         square of their number; larger ones by their landmarks."),
    row("model", "Model", Group::Model, Kind::Choice(|s| &mut s.embedding.model), "",
        "How a chart is laid out in the plane before its stretch is minimised."),
    row("kernel_width", "Kernel Width", Group::Fit,
        Kind::OptionalReal(|s| &mut s.embedding.kernel_width, Interval::above(0.0, 1e3), "the model's own"), "mean squared distance",
        "Width of the affinity as a multiple of the mean squared distance; useful from 0.1 to 0.3."),
    row("relaxation", "Relaxation", Group::Fit, Kind::Real(|s| &mut s.embedding.relaxation, Interval::between(0.0, 2.0)), "",
        "Over-relaxation of the sweeps. Within this range the likelihood never falls."),
    row("max_sweeps", "Sweeps", Group::Fit, Kind::Whole(|s| &mut s.embedding.max_sweeps, [1, 100_000]), "sweeps",
        "Most sweeps of the embedding over all points."),
    row("tolerance", "Tolerance", Group::Fit, Kind::Real(|s| &mut s.embedding.tolerance, Interval::between(0.0, 1.0)), "share of the likelihood",
        "The sweeps stop when one changes the likelihood by less than this share of it."),
    row("update", "Update", Group::Fit, Kind::Choice(|s| &mut s.embedding.update), "",
        "The order in which points move in a sweep."),
    row("initial", "Start", Group::Start, Kind::Choice(|s| &mut s.embedding.initial), "",
        "Where the embedding starts from."),
    row("stretch_solver", "Stretch Solver", Group::Flattening, Kind::Choice(|s| &mut s.stretch.solver), "",
        "How the stretch of a chart is minimised."),
    row("stretch_iterations", "Iterations", Group::Stretch, Kind::Whole(|s| &mut s.stretch.max_iterations, [1, 100_000]), "iterations",
        "Most iterations of the stretch solver."),
    row("margin", "Margin", Group::Margin, Kind::Real(|s| &mut s.packing.margin_texels, Interval::closed(0.0, 1024.0)), "texels",
        "Least distance between two charts, in texels, the pixels of the texture; half of it is kept to the border."),
    row("texture_size", "Texture Size", Group::Size,
        Kind::Size(|s| [&mut s.packing.width, &mut s.packing.height], [1, PackSettings::LARGEST_SIZE]), "texels",
        "Width and height, in texels, of the texture that the UVs are meant for: its proportions and, for the margin, its \
         resolution."),
    row("mip_levels", "Mip Levels", Group::Margin, Kind::Whole(|s| &mut s.packing.mip_levels, [0, PackSettings::MOST_MIP_LEVELS]), "levels",
        "On how many mip levels of the texture, besides itself, bilinear filtering mixes no two charts: the margin is raised to 2.83 texels of the last one. \
         0 leaves it as it is."),
    row("rotation", "Rotation", Group::Packing, Kind::Choice(|s| &mut s.packing.rotation), "",
        "How charts may be turned when they are packed."),
    row("quality", "Packing Quality", Group::Packing, Kind::Choice(|s| &mut s.packing.quality), "",
        "How long a dense placement of the charts is searched for."),
    row("tiles", "Tiles", Group::Tiles, Kind::Whole(|s| &mut s.packing.tiles, [1, PackSettings::MOST_TILES]), "tiles",
        "Over how many tiles of the texture charts may be spread: UDIM 1001, 1002 and so on, ten in a row. No chart crosses the border of a tile."),
    row("texel_density", "Texel Density", Group::Density,
        Kind::OptionalReal(|s| &mut s.packing.texel_density, Interval::above(0.0, PackSettings::GREATEST_DENSITY), "the greatest that is found"),
        "texels per unit of length",
        "How many texels a unit of length gets, in all charts that are larger than a texel, in as few tiles as are found to do; where there are too \
         few, charts get the greatest density that is found, with a warning."),
    row("snap", "Snap to Texels", Group::Density, Kind::Flag(|s| &mut s.packing.snap), "",
        "Moves the sides of charts that are rectangles to the nearest edges of texels, so that none is covered in part; this scales such a chart by less than a \
         texel along each axis."),
    row("shrink_margin", "Shrink Margin", Group::Density, Kind::Flag(|s| &mut s.packing.shrink_margin), "",
        "Halves a margin that leaves no room for the charts in the texture until it does, with a warning; otherwise such a margin is an error."),
];
