//! Settings by keyword: a Python value for each row of the core's table, which says all that there is to say of a setting.

use ble_unwrap_core::settings::{
    Choice, Function, Kind, Named, Preset, Setting, Settings, TABLE, THREADS, Value, listed,
};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyString};

use crate::errors::InvalidArgumentError;

/// What the keywords of one call amount to.
#[derive(Clone, Debug)]
pub(crate) struct Call {
    pub(crate) settings: Settings,
    /// Threads to work with; 0 for as many as the machine has.
    pub(crate) threads: usize,
}

/// The keyword that names the preset.
const PRESET: &str = "preset";

/// The settings of a call of `function`, from its keywords: those of the preset with the given ones in
/// their place.
pub(crate) fn from_keywords(keywords: Option<&Bound<'_, PyDict>>, function: Function) -> PyResult<Call> {
    let mut preset = Preset::Default;
    if let Some(given) = keywords.map(|keywords| keywords.get_item(PRESET)).transpose()?.flatten() {
        set_word(PRESET, &mut preset, &given)?;
    }
    let mut call = Call { settings: Settings::of(preset), threads: THREADS.default };
    for (name, value) in keywords.into_iter().flatten() {
        let name: String = name.extract()?;
        if name == PRESET {
            continue;
        }
        if name == THREADS.name {
            call.threads = whole(THREADS.name, &value, THREADS.range, "")?;
            continue;
        }
        let setting = taken_by(function).find(|setting| setting.name == name);
        let Some(setting) = setting else { return Err(unknown(value.py(), &name, function)?) };
        set(setting, &mut call.settings, &value)?;
    }
    Ok(call)
}

/// The settings that a function takes.
fn taken_by(function: Function) -> impl Iterator<Item = &'static Setting> {
    TABLE.iter().filter(move |setting| setting.group.concerns(function))
}

/// Every setting of `unwrap` with the value it has in a preset.
///
/// ``unwrap(..., **default_settings("paper"))`` is the same as ``unwrap(..., preset="paper")``.
///
/// Parameters
/// ----------
/// preset : {"default", "paper", "iso_charts", "lightmap"}
///     ``"default"`` is for use; ``"paper"`` is the published method as printed; ``"iso_charts"`` the same with Isomap, which
///     the paper compares itself with; ``"lightmap"`` is for textures of baked light.
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
        set_word(PRESET, &mut chosen, given)?;
    }
    let settings = PyDict::new(py);
    settings.set_item(PRESET, chosen.word())?;
    let values = Settings::of(chosen);
    for setting in TABLE {
        settings.set_item(setting.name, to_python(py, setting.value(&values))?)?;
    }
    settings.set_item(THREADS.name, THREADS.default)?;
    Ok(settings)
}

/// Gives a setting the value that Python has for it.
fn set(setting: &Setting, settings: &mut Settings, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let word: String;
    let found = match setting.kind {
        Kind::Flag(_) => Some(Value::Flag(flag(setting.name, value)?)),
        Kind::OptionalReal(..) | Kind::Limit(..) if value.is_none() => Some(Value::None),
        Kind::Real(..) | Kind::OptionalReal(..) => as_number(value).map(Value::Real),
        Kind::Whole(..) | Kind::Limit(..) | Kind::Seed(_) => as_number(value).map(Value::Whole),
        Kind::Size(..) => {
            let [width, height] = pair(value).unwrap_or_else(|| [value.clone(), value.clone()]);
            as_number(&width).zip(as_number(&height)).map(|(width, height)| Value::Size([width, height]))
        }
        Kind::Choice(_) => match value.extract::<String>() {
            Ok(given) => {
                word = given;
                Some(Value::Word(&word))
            }
            Err(_) => None,
        },
    };
    match found {
        Some(found) if setting.set(settings, found) => Ok(()),
        _ => Err(refusal(setting.name, &setting.expected(), value)),
    }
}

fn to_python<'py>(py: Python<'py>, value: Value<'_>) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Flag(flag) => PyBool::new(py, flag).to_owned().into_any(),
        Value::Real(x) => x.into_pyobject(py)?.into_any(),
        Value::Whole(n) => n.into_pyobject(py)?.into_any(),
        Value::Size([width, height]) => (width, height).into_pyobject(py)?.into_any(),
        Value::Word(word) => PyString::new(py, word).into_any(),
        Value::None => py.None().into_bound(py),
    })
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
pub(crate) fn set_word(name: &str, target: &mut dyn Choice, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let known = value.extract::<String>().is_ok_and(|word| target.choose(&word));
    let words = |all: &[Named]| -> Vec<&str> { all.iter().map(|value| value.word).collect() };
    if known { Ok(()) } else { Err(refusal(name, &listed(&words(target.all())), value)) }
}

/// One of a few values, by its word.
pub(crate) fn one_of<T: Copy>(name: &str, values: &[(&str, T)], given: &Bound<'_, PyAny>) -> PyResult<T> {
    let found = given.extract::<String>().ok().and_then(|given| values.iter().find(|(word, _)| *word == given));
    let words = || -> Vec<&str> { values.iter().map(|(word, _)| *word).collect() };
    found.map(|(_, value)| *value).ok_or_else(|| refusal(name, &listed(&words()), given))
}

/// The error for a value that is not what it has to be.
pub(crate) fn refusal(name: &str, expected: &str, value: &Bound<'_, PyAny>) -> PyErr {
    let found = value.repr().map_or_else(|_| "an object that cannot be shown".into(), |text| text.to_string());
    InvalidArgumentError::new_err(format!("{name}: expected {expected}; found {found}"))
}

/// The error for a keyword that is no setting, with those it may have meant.
fn unknown(py: Python<'_>, name: &str, function: Function) -> PyResult<PyErr> {
    let taken = taken_by(function).map(|setting| setting.name);
    let known: Vec<&str> = std::iter::once(PRESET).chain(taken).chain([THREADS.name]).collect();
    let near: Vec<String> = py.import("difflib")?.call_method1("get_close_matches", (name, &known))?.extract()?;
    let near: Vec<&str> = near.iter().map(String::as_str).collect();
    let hint = if near.is_empty() {
        format!("the settings are {}", known.join(", "))
    } else {
        format!("did you mean {}?", listed(&near))
    };
    Ok(InvalidArgumentError::new_err(format!("{}() has no setting '{name}'; {hint}", function.name())))
}
