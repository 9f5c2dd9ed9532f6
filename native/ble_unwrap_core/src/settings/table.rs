//! The table of all settings: whatever is said of a setting anywhere is said here, but for its default and the values of
//! the presets, which the `Default` implementations and presets of the stages say.
//!
//! [`Settings::validate`] runs over it; the Python module parses and describes its keywords by it; and
//! `make settings` writes it to the files that the add-on, the type stub and the manual read.

use crate::choice::Choice;
use crate::packing::PackSettings;
use crate::segmentation::SegmentationSettings;

use super::interval::Interval;
use super::{MOST_TOGETHER, NEVER_SEWN, Settings};

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The name in Python, on the command line and in files.
    pub name: &'static str,
    /// The name on the screen.
    pub label: &'static str,
    /// Which functions look at it.
    pub group: Group,
    /// What it can be, and where it lies in [`Settings`].
    pub kind: Kind,
    /// The unit; empty where there is none.
    pub unit: &'static str,
    /// What it does, in a sentence or a few.
    pub sentence: &'static str,
}

/// Where a value lies in the settings.
pub type Place<T> = fn(&mut Settings) -> &mut T;

/// What a setting can be, its range, and where its value lies.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Yes or no.
    Flag(Place<bool>),
    /// A number.
    Real(Place<f64>, Interval),
    /// A number, or `None` for what the text says.
    OptionalReal(Place<Option<f64>>, Interval, &'static str),
    /// A whole number between the two, both included.
    Whole(Place<usize>, [usize; 2]),
    /// The same, or no limit, which is `usize::MAX`.
    Limit(Place<usize>, [usize; 2]),
    /// Any whole number of 64 bits.
    Seed(Place<u64>),
    /// Width and height in texels, each between the two.
    Size(fn(&mut Settings) -> [&mut u32; 2], [u32; 2]),
    /// One of a few, each with a word.
    Choice(fn(&mut Settings) -> &mut dyn Choice),
}

/// The value of a setting, whichever it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// Of a flag.
    Flag(bool),
    /// Of a number.
    Real(f64),
    /// Of a whole number.
    Whole(u64),
    /// Width and height.
    Size([u64; 2]),
    /// Of a choice.
    Word(&'a str),
    /// Of a number that is left to the library, or of a limit that is none.
    None,
}

/// The functions that take settings, by their names in Python. [`Function::Unwrap`] takes all.
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
    Pack,
}

impl Function {
    /// All functions.
    pub const ALL: [Self; 11] = [
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
            Self::Pack => "pack",
        }
    }
}

/// Settings that the same functions look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Group {
    /// How a surface is cut into charts.
    Charts,
    /// How surfaces and clouds alike are cut.
    Limit,
    /// What counts as one vertex.
    Weld,
    /// How distances on surfaces are measured.
    Geodesics,
    /// From how many landmarks.
    Landmarks,
    /// Which model embeds.
    Model,
    /// How it is fitted.
    Fit,
    /// Where the fit starts; an argument of its own of [`Function::Embed`], which takes coordinates, too.
    Start,
    /// How one patch of a surface becomes flat.
    Flattening,
    /// The texture that the result is for.
    Texture,
    /// How charts lie in it.
    Packing,
}

impl Group {
    /// All groups.
    pub const ALL: [Self; 11] = [
        Self::Charts,
        Self::Limit,
        Self::Weld,
        Self::Geodesics,
        Self::Landmarks,
        Self::Model,
        Self::Fit,
        Self::Start,
        Self::Flattening,
        Self::Texture,
        Self::Packing,
    ];

    /// The group's name in lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Charts => "charts",
            Self::Limit => "limit",
            Self::Weld => "weld",
            Self::Geodesics => "geodesics",
            Self::Landmarks => "landmarks",
            Self::Model => "model",
            Self::Fit => "fit",
            Self::Start => "start",
            Self::Flattening => "flattening",
            Self::Texture => "texture",
            Self::Packing => "packing",
        }
    }

    /// Whether a function looks at the settings of the group; for the others they are an error.
    #[must_use]
    pub fn concerns(self, function: Function) -> bool {
        use Function::{Analyse, Embed, Flatten, GeodesicDistances, Measure, Pack, Place, Unwrap, UnwrapPoints};
        let others: &[Function] = match self {
            Self::Charts => &[],
            Self::Limit => &[UnwrapPoints],
            Self::Weld => &[Analyse, Flatten, Measure],
            Self::Geodesics => &[GeodesicDistances, Flatten],
            Self::Landmarks => &[Flatten, UnwrapPoints],
            Self::Model => &[Embed, Place, Flatten, UnwrapPoints],
            Self::Fit => &[Embed, Flatten, UnwrapPoints],
            Self::Start => &[Flatten, UnwrapPoints],
            Self::Flattening => &[Flatten],
            Self::Texture => &[Measure, Pack, UnwrapPoints],
            Self::Packing => &[Pack, UnwrapPoints],
        };
        function == Unwrap || others.contains(&function)
    }
}

impl Setting {
    /// The value in some settings.
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

    /// Takes a value; false, and nothing changed, where it is of another kind or out of range.
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

    /// What the setting may be, to complete "it must be", for instance "a number above 0 and at most 1".
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

    /// What `None` stands for, where the setting can be that.
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

/// Words in quotes as English lists them: `'a', 'b' or 'c'`.
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

/// A whole number that functions take beside the settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Argument {
    /// The name in Python and on the command line.
    pub name: &'static str,
    /// The name on the screen.
    pub label: &'static str,
    /// The value that it has where it is not given.
    pub default: usize,
    /// The least and the greatest value.
    pub range: [usize; 2],
    /// What it does.
    pub sentence: &'static str,
}

/// How many points each point of a cloud is joined to. By 12, graph distances are 3 % too long on average, which the
/// relaxation takes away; the paper names no number. Fewer than 4 do not tell a tangent plane; more than 256 do not fit in
/// memory for the clouds that would need them.
pub const NEIGHBOURS: Argument = Argument {
    name: "neighbours",
    label: "Neighbours",
    default: 12,
    range: [4, 256],
    sentence: "Each point of a cloud is joined to so many nearest points. More bridge gaps, fewer keep sheets apart.",
};

/// Threads of a call. The most is several times what the largest machines have, and far below what exhausts one.
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
    row("coarse", "Coarse First", Group::Limit, Kind::Flag(|s| &mut s.coarse), "",
        "Decides on a coarse copy where to cut large pieces of surface, which is many times faster."),
    row("merge", "Merge Charts", Group::Charts, Kind::Flag(|s| &mut s.merge), "",
        "Joins neighbouring charts again where their union stays within the stretch limit."),
    row("least_sewn", "Least Sewn", Group::Charts, Kind::Real(|s| &mut s.least_sewn, Interval::closed(0.0, NEVER_SEWN)), "width of the chart",
        "Two charts are sewn along a part of their border, the rest of which stays open as a dart, if that part is at least this \
         long beside the width of the smaller one. Less gives fewer charts, more gives compact ones, the most makes no darts."),
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
    row("stretch_iterations", "Iterations", Group::Flattening, Kind::Whole(|s| &mut s.stretch.max_iterations, [1, 100_000]), "iterations",
        "Most iterations of the stretch solver."),
    row("margin", "Margin", Group::Texture, Kind::Real(|s| &mut s.packing.margin_texels, Interval::closed(0.0, 1024.0)), "texels",
        "Least distance between two charts, in texels, the pixels of the texture; half of it is kept to the border."),
    row("texture_size", "Texture Size", Group::Texture,
        Kind::Size(|s| [&mut s.packing.width, &mut s.packing.height], [1, PackSettings::LARGEST_SIZE]), "texels",
        "Width and height, in texels, of the texture that the UVs are meant for: its proportions and, for the margin, its \
         resolution."),
    row("rotation", "Rotation", Group::Packing, Kind::Choice(|s| &mut s.packing.rotation), "",
        "How charts may be turned to pack them tighter."),
];
