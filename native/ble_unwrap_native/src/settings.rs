//! Settings by keyword. One table names every setting, its place in the core and its range; parsing,
//! defaults and error messages all come from it.

use ble_unwrap_core::packing::PackSettings;
use ble_unwrap_core::segmentation::SegmentationSettings;
use ble_unwrap_core::{NEVER_SEWN, Settings};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyString};

use crate::errors::InvalidArgumentError;
use crate::words::{Words, words};

/// What the keywords of one call amount to.
#[derive(Clone, Debug)]
pub(crate) struct Call {
    pub(crate) settings: Settings,
    /// Threads to work with; 0 for as many as the machine has.
    pub(crate) threads: usize,
}

impl Call {
    fn of(preset: Preset) -> Self {
        let settings = match preset {
            Preset::Default => Settings::default(),
            Preset::Paper => Settings::paper(),
            Preset::IsoCharts => Settings::iso_charts(),
        };
        Self { settings, threads: 0 }
    }
}

/// Where the settings that are not given come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Preset {
    /// What an artist wants.
    Default,
    /// The paper as printed.
    Paper,
    /// The same with Isomap, which the paper compares itself with.
    IsoCharts,
}

words!(Preset { "default" => Default, "paper" => Paper, "iso_charts" => IsoCharts });

/// The functions that take settings. A setting that a function has no use for is an error there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Function {
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
    fn name(self) -> &'static str {
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

/// One row of the table.
struct Setting {
    name: &'static str,
    field: Field,
    /// Functions that take it besides `unwrap`, which takes all.
    also: &'static [Function],
}

/// Where a setting lies in a [`Call`], and what it may be.
enum Field {
    Flag(fn(&mut Call) -> &mut bool),
    Real(fn(&mut Call) -> &mut f64, Interval),
    /// `None` stands for a value that is found; the text says which.
    OptionalReal(fn(&mut Call) -> &mut Option<f64>, Interval, &'static str),
    Whole(fn(&mut Call) -> &mut usize, [usize; 2]),
    /// `None` stands for no limit, `usize::MAX`.
    Limit(fn(&mut Call) -> &mut usize, [usize; 2]),
    Seed(fn(&mut Call) -> &mut u64),
    /// Width and height, or one number for both.
    Size(fn(&mut Call) -> [&mut u32; 2], [u32; 2]),
    Word(fn(&mut Call) -> &mut dyn Words),
}

/// Real numbers from `above` to `most`, `above` itself excluded if `open`.
#[derive(Clone, Copy)]
struct Interval {
    least: f64,
    open: bool,
    most: f64,
    most_open: bool,
}

impl Interval {
    const fn closed(least: f64, most: f64) -> Self {
        Self { least, open: false, most, most_open: false }
    }

    const fn above(least: f64, most: f64) -> Self {
        Self { least, open: true, most, most_open: false }
    }

    const fn between(least: f64, most: f64) -> Self {
        Self { least, open: true, most, most_open: true }
    }

    const fn at_least(least: f64) -> Self {
        Self { least, open: false, most: f64::INFINITY, most_open: true }
    }

    fn contains(self, x: f64) -> bool {
        (x > self.least || !self.open && x == self.least) && (x < self.most || !self.most_open && x == self.most)
    }

    fn text(self) -> String {
        let low = if self.open { "above" } else { "at least" };
        if self.most.is_infinite() {
            return format!("a number {low} {}", self.least);
        }
        let high = if self.most_open { "below" } else { "at most" };
        format!("a number {low} {} and {high} {}", self.least, self.most)
    }
}

/// Most threads one call may ask for: several times the largest machines, far below what exhausts one.
const MOST_THREADS: usize = 1024;
/// Most vertices embedded together: the core handles the distances of no more.
const MOST_TOGETHER: usize = 20_000;
/// Largest texture side the packer takes.
const MOST_TEXELS: u32 = PackSettings::LARGEST_SIZE;

const UNWRAP: &[Function] = &[];
const CLOUD: &[Function] = &[Function::UnwrapPoints];
const SURFACE: &[Function] = &[Function::Analyse, Function::Flatten, Function::Measure];
const FLATTEN: &[Function] = &[Function::Flatten];
const LANDMARKS: &[Function] = &[Function::Flatten, Function::UnwrapPoints];
const EMBED: &[Function] = &[Function::Embed, Function::Flatten, Function::UnwrapPoints];
const MODEL: &[Function] = &[Function::Embed, Function::Place, Function::Flatten, Function::UnwrapPoints];
const GEODESICS: &[Function] = &[Function::GeodesicDistances, Function::Flatten];
const PACK: &[Function] = &[Function::Pack, Function::UnwrapPoints];
const TEXTURE: &[Function] = &[Function::Measure, Function::Pack, Function::UnwrapPoints];
const ALL: &[Function] = &[
    Function::Analyse,
    Function::Embed,
    Function::Transform,
    Function::Place,
    Function::Flatten,
    Function::GeodesicDistances,
    Function::GraphDistances,
    Function::Measure,
    Function::Pack,
    Function::UnwrapPoints,
];

#[rustfmt::skip] // a table: one row a setting
const TABLE: &[Setting] = &[
    row("stretch_limit", Field::Real(|c| &mut c.settings.stretch_limit, Interval::above(1.0, 1e3)), CLOUD),
    row("limit_over", Field::Word(|c| &mut c.settings.limit_over), UNWRAP),
    row("weld", Field::Flag(|c| &mut c.settings.weld), SURFACE),
    row("weld_distance", Field::OptionalReal(|c| &mut c.settings.weld_distance, Interval::at_least(0.0), "what single precision cannot tell apart"), SURFACE),
    row("coarse", Field::Flag(|c| &mut c.settings.coarse), CLOUD),
    row("merge", Field::Flag(|c| &mut c.settings.merge), UNWRAP),
    row("least_sewn", Field::Real(|c| &mut c.settings.least_sewn, Interval::closed(0.0, NEVER_SEWN)), UNWRAP),
    row("holes", Field::Word(|c| &mut c.settings.holes), UNWRAP),
    row("chart_scale", Field::Word(|c| &mut c.settings.chart_scale), UNWRAP),
    row("crease_weight", Field::Real(|c| &mut c.settings.segmentation.crease_weight, Interval::closed(0.0, SegmentationSettings::MOST_CREASE_WEIGHT)), UNWRAP),
    row("seed", Field::Seed(|c| &mut c.settings.seed), EMBED),
    row("geodesics", Field::Word(|c| &mut c.settings.geodesics.metric), GEODESICS),
    row("landmark_fraction", Field::Real(|c| &mut c.settings.geodesics.landmark_fraction, Interval::above(0.0, 1.0)), LANDMARKS),
    row("landmark_min", Field::Whole(|c| &mut c.settings.geodesics.landmark_min, [3, 100_000]), LANDMARKS),
    row("landmark_max", Field::Limit(|c| &mut c.settings.geodesics.landmark_max, [3, 100_000]), LANDMARKS),
    row("together_max", Field::Whole(|c| &mut c.settings.together_max, [0, MOST_TOGETHER]), FLATTEN),
    row("model", Field::Word(|c| &mut c.settings.embedding.model), MODEL),
    row("kernel_width", Field::OptionalReal(|c| &mut c.settings.embedding.kernel_width, Interval::above(0.0, 1e3), "the model's own"), EMBED),
    row("relaxation", Field::Real(|c| &mut c.settings.embedding.relaxation, Interval::between(0.0, 2.0)), EMBED),
    row("max_sweeps", Field::Whole(|c| &mut c.settings.embedding.max_sweeps, [1, 100_000]), EMBED),
    row("tolerance", Field::Real(|c| &mut c.settings.embedding.tolerance, Interval::between(0.0, 1.0)), EMBED),
    row("update", Field::Word(|c| &mut c.settings.embedding.update), EMBED),
    row("initial", Field::Word(|c| &mut c.settings.embedding.initial), EMBED),
    row("stretch_solver", Field::Word(|c| &mut c.settings.stretch.solver), FLATTEN),
    row("stretch_iterations", Field::Whole(|c| &mut c.settings.stretch.max_iterations, [1, 100_000]), FLATTEN),
    row("margin", Field::Real(|c| &mut c.settings.packing.margin_texels, Interval::closed(0.0, 1024.0)), TEXTURE),
    row("texture_size", Field::Size(|c| [&mut c.settings.packing.width, &mut c.settings.packing.height], [1, MOST_TEXELS]), TEXTURE),
    row("rotation", Field::Word(|c| &mut c.settings.packing.rotation), PACK),
    row("threads", Field::Whole(|c| &mut c.threads, [0, MOST_THREADS]), ALL),
];

const fn row(name: &'static str, field: Field, also: &'static [Function]) -> Setting {
    Setting { name, field, also }
}

/// The settings of a call of `function`, from its keywords: those of the preset with the given ones in
/// their place.
pub(crate) fn from_keywords(keywords: Option<&Bound<'_, PyDict>>, function: Function) -> PyResult<Call> {
    let Some(keywords) = keywords else { return Ok(Call::of(Preset::Default)) };
    let mut preset = Preset::Default;
    if let Some(given) = keywords.get_item("preset")? {
        set_word("preset", &mut preset, &given)?;
    }
    let mut call = Call::of(preset);
    for (name, value) in keywords {
        let name: String = name.extract()?;
        if name == "preset" {
            continue;
        }
        let taken = |s: &&Setting| s.name == name && (function == Function::Unwrap || s.also.contains(&function));
        let Some(setting) = TABLE.iter().find(taken) else { return Err(unknown(keywords.py(), &name, function)?) };
        setting.set(&mut call, &value)?;
    }
    Ok(call)
}

/// Every setting of `unwrap` with the value it has in a preset.
///
/// ``unwrap(..., **default_settings("paper"))`` is the same as ``unwrap(..., preset="paper")``.
///
/// Parameters
/// ----------
/// preset : {"default", "paper", "iso_charts"}
///     ``"default"`` is for use; ``"paper"`` is the published method as printed; ``"iso_charts"`` the same with Isomap, which
///     the paper compares itself with.
///
/// Returns
/// -------
/// dict
///     A new dictionary, the preset's name included.
///
/// Raises
/// ------
/// InvalidArgumentError
///     If there is no such preset.
#[pyfunction]
#[pyo3(signature = (preset=None), text_signature = "(preset='default')")]
pub(crate) fn default_settings<'py>(
    py: Python<'py>,
    preset: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut chosen = Preset::Default;
    if let Some(given) = preset {
        set_word("preset", &mut chosen, given)?;
    }
    let settings = PyDict::new(py);
    settings.set_item("preset", chosen.word())?;
    let mut call = Call::of(chosen);
    for setting in TABLE {
        settings.set_item(setting.name, setting.get(py, &mut call)?)?;
    }
    Ok(settings)
}

impl Setting {
    fn set(&self, call: &mut Call, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let name = self.name;
        match &self.field {
            Field::Flag(field) => {
                *field(call) = flag(name, value)?;
            }
            Field::Real(field, interval) => *field(call) = real(name, value, *interval, "")?,
            Field::OptionalReal(field, interval, found) => {
                *field(call) = if value.is_none() {
                    None
                } else {
                    Some(real(name, value, *interval, &format!(", or None for {found}"))?)
                };
            }
            Field::Whole(field, range) => *field(call) = whole(name, value, *range, "")?,
            Field::Limit(field, range) => {
                *field(call) =
                    if value.is_none() { usize::MAX } else { whole(name, value, *range, ", or None for no limit")? };
            }
            Field::Seed(field) => *field(call) = whole(name, value, [0, u64::MAX], "")?,
            Field::Size(field, range) => {
                let sides = pair(value).unwrap_or_else(|| [value.clone(), value.clone()]);
                let [width, height] = field(call);
                let texels = " texels, or a pair of them";
                *width = whole(name, &sides[0], *range, texels)?;
                *height = whole(name, &sides[1], *range, texels)?;
            }
            Field::Word(field) => set_word(name, field(call), value)?,
        }
        Ok(())
    }

    fn get<'py>(&self, py: Python<'py>, call: &mut Call) -> PyResult<Bound<'py, PyAny>> {
        Ok(match &self.field {
            Field::Flag(field) => PyBool::new(py, *field(call)).to_owned().into_any(),
            Field::Real(field, _) => field(call).into_pyobject(py)?.into_any(),
            Field::OptionalReal(field, ..) => field(call).into_pyobject(py)?.into_any(),
            Field::Whole(field, _) => field(call).into_pyobject(py)?.into_any(),
            Field::Limit(field, _) => Some(*field(call)).filter(|&n| n != usize::MAX).into_pyobject(py)?.into_any(),
            Field::Seed(field) => field(call).into_pyobject(py)?.into_any(),
            Field::Size(field, _) => {
                let [width, height] = field(call);
                (*width, *height).into_pyobject(py)?.into_any()
            }
            Field::Word(field) => PyString::new(py, field(call).word()).into_any(),
        })
    }
}

/// A yes or no.
pub(crate) fn flag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    value.extract().map_err(|_| refusal(name, "True or False", value))
}

/// A number. A boolean is an int to Python, and one of NumPy a number, but nobody who writes one means it.
fn as_number<'py, T: FromPyObjectOwned<'py>>(value: &Bound<'py, PyAny>) -> Option<T> {
    let is_boolean = value.is_instance_of::<PyBool>()
        || value.get_type().name().is_ok_and(|name| ["bool", "bool_"].iter().any(|known| name == *known));
    if is_boolean { None } else { value.extract().ok() }
}

/// The two elements of a sequence of two, such as a tuple, a list or an array.
fn pair<'py>(value: &Bound<'py, PyAny>) -> Option<[Bound<'py, PyAny>; 2]> {
    if value.is_instance_of::<PyString>() || value.is_instance_of::<PyBytes>() || value.len().ok()? != 2 {
        return None;
    }
    Some([value.get_item(0).ok()?, value.get_item(1).ok()?])
}

fn real(name: &str, value: &Bound<'_, PyAny>, interval: Interval, or: &str) -> PyResult<f64> {
    let found = as_number(value).filter(|&x: &f64| interval.contains(x));
    found.ok_or_else(|| refusal(name, &format!("{}{or}", interval.text()), value))
}

/// A number; its range is the core's to check.
pub(crate) fn number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    as_number(value).ok_or_else(|| refusal(name, "a number", value))
}

/// A finite number above 0; `or` ends its description.
pub(crate) fn positive(name: &str, value: &Bound<'_, PyAny>, or: &str) -> PyResult<f64> {
    let found = as_number(value).filter(|x: &f64| x.is_finite() && *x > 0.0);
    found.ok_or_else(|| refusal(name, &format!("a number above 0{or}"), value))
}

/// A whole number within a range; `unit` ends the description of the range.
pub(crate) fn whole<T>(name: &str, value: &Bound<'_, PyAny>, [least, most]: [T; 2], unit: &str) -> PyResult<T>
where
    T: Copy + PartialOrd + std::fmt::Display + TryFrom<u64>,
{
    let found = as_number::<u64>(value).and_then(|n| T::try_from(n).ok()).filter(|n| (least..=most).contains(n));
    found.ok_or_else(|| refusal(name, &format!("a whole number from {least} to {most}{unit}"), value))
}

/// Sets a choice by its word.
pub(crate) fn set_word(name: &str, target: &mut dyn Words, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let known = value.extract::<String>().is_ok_and(|word| target.set(&word));
    if known { Ok(()) } else { Err(refusal(name, &crate::words::listed(&target.words()), value)) }
}

/// The error for a value that is not what it has to be.
pub(crate) fn refusal(name: &str, expected: &str, value: &Bound<'_, PyAny>) -> PyErr {
    let found = value.repr().map_or_else(|_| "an object that cannot be shown".into(), |text| text.to_string());
    InvalidArgumentError::new_err(format!("{name}: expected {expected}; found {found}"))
}

/// The error for a keyword that is no setting, with those it may have meant.
fn unknown(py: Python<'_>, name: &str, function: Function) -> PyResult<PyErr> {
    let known = TABLE.iter().filter(|s| function == Function::Unwrap || s.also.contains(&function));
    let known: Vec<&str> = std::iter::once("preset").chain(known.map(|s| s.name)).collect();
    let near: Vec<String> = py.import("difflib")?.call_method1("get_close_matches", (name, &known))?.extract()?;
    let near: Vec<&str> = near.iter().map(String::as_str).collect();
    let hint = if near.is_empty() {
        format!("the settings are {}", known.join(", "))
    } else {
        format!("did you mean {}?", crate::words::listed(&near))
    };
    Ok(InvalidArgumentError::new_err(format!("{}() has no setting '{name}'; {hint}", function.name())))
}
