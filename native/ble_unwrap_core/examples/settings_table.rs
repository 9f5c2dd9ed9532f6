//! Prints the table of all settings as JSON: `cargo run --example settings_table`.
//!
//! `make settings` keeps it as `addon/settings.json`, from which the add-on, the type stub and the manual have everything
//! that they say of a setting.
#![expect(clippy::print_stdout, reason = "a command line program")]

use std::fmt::Write;

use ble_unwrap_core::settings::{
    Argument, Choice, Function, Group, Interval, Kind, NEIGHBOURS, Named, Preset, Setting, Settings, TABLE, THREADS,
    Value,
};

fn main() {
    print!("{}", table());
}

/// The whole table, a line for each value.
fn table() -> String {
    let groups = Group::ALL.map(|group| {
        let functions = Function::ALL.into_iter().filter(|function| group.concerns(*function));
        (group.name(), list(functions.map(|function| quoted(function.name()))))
    });
    let parts = [
        ("presets", lines('[', choices(Preset::Default.all()), 1)),
        ("functions", list(Function::ALL.map(|function| quoted(function.name())))),
        ("groups", object(&groups, 1)),
        ("arguments", lines('[', [NEIGHBOURS, THREADS].map(|argument| object(&of_argument(&argument), 2)), 1)),
        ("settings", lines('[', TABLE.iter().map(|setting| object(&of_setting(setting), 2)), 1)),
    ];
    format!("{}\n", object(&parts, 0))
}

fn of_argument(argument: &Argument) -> Vec<(&'static str, String)> {
    vec![
        ("name", quoted(argument.name)),
        ("label", quoted(argument.label)),
        ("sentence", quoted(argument.sentence)),
        ("kind", quoted("whole")),
        ("least", argument.range[0].to_string()),
        ("most", argument.range[1].to_string()),
        ("default", argument.default.to_string()),
    ]
}

fn of_setting(setting: &Setting) -> Vec<(&'static str, String)> {
    let mut keys = vec![
        ("name", quoted(setting.name)),
        ("label", quoted(setting.label)),
        ("group", quoted(setting.group.name())),
        ("unit", quoted(setting.unit)),
        ("sentence", quoted(setting.sentence)),
    ];
    let mut say = |kind: &str, details: Vec<(&'static str, String)>| {
        keys.push(("kind", quoted(kind)));
        keys.extend(details);
    };
    let whole = |[least, most]: [u64; 2]| vec![("least", least.to_string()), ("most", most.to_string())];
    match setting.kind {
        Kind::Flag(_) => say("flag", vec![]),
        Kind::Real(_, interval) | Kind::OptionalReal(_, interval, _) => say("real", of_interval(interval)),
        Kind::Whole(_, range) | Kind::Limit(_, range) => say("whole", whole(range.map(|n| n as u64))),
        Kind::Seed(_) => say("whole", whole([0, u64::MAX])),
        Kind::Size(_, range) => say("size", whole(range.map(u64::from))),
        Kind::Choice(place) => {
            let mut settings = Settings::default();
            say("choice", vec![("choices", lines('[', choices(place(&mut settings).all()), 3))]);
        }
    }
    if let Some(none) = setting.none() {
        keys.push(("none", quoted(none)));
    }
    keys.push(("expected", quoted(&setting.expected())));
    let values = Preset::Default.all().iter().map(|named| {
        let mut preset = Preset::Default;
        preset.choose(named.word);
        format!("{}: {}", quoted(named.word), number(&setting.value(&Settings::of(preset))))
    });
    keys.push(("values", format!("{{{}}}", values.collect::<Vec<_>>().join(", "))));
    keys
}

fn of_interval(interval: Interval) -> Vec<(&'static str, String)> {
    let most = if interval.most.is_finite() { interval.most.to_string() } else { "null".into() };
    vec![
        ("least", interval.least.to_string()),
        ("least_open", interval.least_open.to_string()),
        ("most", most),
        ("most_open", interval.most_open.to_string()),
    ]
}

fn choices(all: &[Named]) -> impl Iterator<Item = String> {
    all.iter().map(|Named { word, label, sentence }| {
        let [word, label, sentence] = [word, label, sentence].map(|text| quoted(text));
        format!("{{\"word\": {word}, \"label\": {label}, \"sentence\": {sentence}}}")
    })
}

/// A value as JSON has it.
fn number(value: &Value<'_>) -> String {
    match value {
        Value::Flag(flag) => flag.to_string(),
        // As Rust's debug output has it a real number keeps its point, so that it stays one in Python.
        Value::Real(x) => format!("{x:?}"),
        Value::Whole(n) => n.to_string(),
        Value::Size([width, height]) => format!("[{width}, {height}]"),
        Value::Word(word) => quoted(word),
        Value::None => "null".into(),
    }
}

fn quoted(text: &str) -> String {
    let mut result = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => result.extend(['\\', c]),
            c if c.is_control() => _ = write!(result, "\\u{:04x}", u32::from(c)),
            c => result.push(c),
        }
    }
    result + "\""
}

fn list(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(", "))
}

fn object(keys: &[(&str, String)], depth: usize) -> String {
    lines('{', keys.iter().map(|(key, value)| format!("{}: {value}", quoted(key))), depth)
}

/// Items on lines of their own, between brackets or braces.
fn lines(open: char, items: impl IntoIterator<Item = String>, depth: usize) -> String {
    let indent = "  ".repeat(depth);
    let items: Vec<String> = items.into_iter().map(|item| format!("\n{indent}  {item}")).collect();
    let close = if open == '{' { '}' } else { ']' };
    format!("{open}{}\n{indent}{close}", items.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_that_is_kept_is_up_to_date() {
        let kept = include_str!("../../../addon/settings.json");
        assert!(kept == table(), "addon/settings.json is not what the core says: run `make settings`");
    }

    #[test]
    fn texts_are_quoted_as_json_has_it() {
        assert_eq!(quoted("a \"b\" \\ c\n°"), r#""a \"b\" \\ c\u000a°""#);
        assert_eq!(number(&Value::Real(4.0)), "4.0");
    }
}
