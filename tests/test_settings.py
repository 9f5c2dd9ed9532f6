"""Settings are declared once, in the core's table; all that is said of them elsewhere is made from it, and true.

That addon/settings.json is what the core says is tested by the core's example `settings_table`.
"""

import ast
import importlib.util
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import ble_unwrap_native as native
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
TABLE = json.loads((ROOT / "addon/settings.json").read_text(encoding="utf-8"))
ROWS = {row["name"]: row for row in TABLE["settings"]}
ARGUMENTS = {row["name"]: row for row in TABLE["arguments"]}
EMPTY_MESH = (np.zeros((0, 3)), np.zeros(0, np.int32), np.zeros(1, np.int32))


def test_what_is_made_from_the_table_is_up_to_date():
    done = subprocess.run(
        [sys.executable, ROOT / ".ci/settings_pages", "--check"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


# The table is true --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", [row["word"] for row in TABLE["presets"]])
def test_values_of_presets_are_those_of_the_module(preset):
    found = native.default_settings(preset)
    assert found.pop("preset") == preset and found.pop("threads") == ARGUMENTS["threads"]["default"]
    assert list(found) == list(ROWS)
    for name, row in ROWS.items():
        value = row["values"][preset]
        assert found[name] == (tuple(value) if row["kind"] == "size" else value), name
        assert type(found[name]) is (tuple if row["kind"] == "size" else type(value)), name


def at_the_ends(row):
    """Values that are in range, each end among them, and values just outside."""
    least, most = row.get("least"), row.get("most")
    match row["kind"]:
        case "flag":
            return [False, True], ["no", 0.5]
        case "choice":
            return [choice["word"] for choice in row["choices"]], ["unheard of", 1]
        case "whole":
            inside, outside = [least, (least + most) // 2, most], [least - 1, most + 1, least + 0.5, True]
        case "size":
            inside = [least, most, (least, most), [most, least]]
            outside = [least - 1, most + 1, (least, most + 1), (least - 1, most), (least,) * 3]
        case "real":
            most = sys.float_info.max if most is None else most
            inside = [
                math.nextafter(least, math.inf) if row["least_open"] else least,
                least + 0.5 * min(1.0, most - least),
                math.nextafter(most, -math.inf) if row["most_open"] and row["most"] is not None else most,
            ]
            outside = [math.nextafter(inside[0], -math.inf), math.nextafter(inside[2], math.inf), math.nan, "1", True]
    return ([*inside, None], outside) if "none" in row else (inside, [*outside, None])


def call(name, value):
    # What contradicts the value otherwise: too few landmarks at most, and a margin as wide as the texture.
    others = {"landmark_min": {"landmark_max": None}, "landmark_max": {"landmark_min": 3}}
    others |= {"texture_size": {"margin": 0}, "margin": {"texture_size": 4096}, "mip_levels": {"texture_size": 4096}}
    return native.unwrap(*EMPTY_MESH, **others.get(name, {}), **{name: value})


@pytest.mark.parametrize("name", list(ROWS))
def test_the_module_keeps_every_range_at_its_ends_and_just_outside(name):
    inside, outside = at_the_ends(ROWS[name])
    for value in inside:
        call(name, value)
    expected = "True or False" if ROWS[name]["kind"] == "flag" else ROWS[name]["expected"]
    for value in outside:
        with pytest.raises(native.InvalidArgumentError) as raised:
            call(name, value)
        assert str(raised.value) == f"{name}: expected {expected}; found {value!r}"


@pytest.mark.parametrize("name", list(ARGUMENTS))
def test_arguments_beside_the_settings_keep_their_ranges(name):
    row = ARGUMENTS[name]

    def with_value(value):
        return native.unwrap_points(np.zeros((0, 3)), **{name: value})

    for value in (row["least"], row["most"]):
        with_value(value)
    for value in (row["least"] - 1, row["most"] + 1):
        with pytest.raises(native.InvalidArgumentError, match=f"{name}: expected a whole number from"):
            with_value(value)


FUNCTIONS = {
    "unwrap": lambda **settings: native.unwrap(None, None, None, **settings),
    "analyse": lambda **settings: native.analyse(None, None, None, **settings),
    "unwrap_points": lambda **settings: native.unwrap_points(None, **settings),
    "embed": lambda **settings: native.embed(None, **settings),
    "flatten": lambda **settings: native.flatten(None, None, None, **settings),
    "transform": lambda **settings: native.embed(np.eye(4)).transform(None, **settings),
    "place": lambda **settings: native.place(None, None, **settings),
    "geodesic_distances": lambda **settings: native.geodesic_distances(None, None, None, None, **settings),
    "graph_distances": lambda **settings: native.graph_distances(None, **settings),
    "measure": lambda **settings: native.measure(None, None, None, None, **settings),
    "relax": lambda **settings: native.relax(None, None, None, None, **settings),
    "pack": lambda **settings: native.pack(None, None, None, **settings),
}
OWN_ARGUMENTS = {"embed": {"initial"}}  # which also takes coordinates there


@pytest.mark.parametrize("function", TABLE["functions"])
def test_functions_take_the_settings_of_their_groups(function):
    """So says the table, and by it the stub."""
    taken = {name for name, row in ROWS.items() if function in TABLE["groups"][row["group"]]}
    for name, value in native.default_settings().items():
        with pytest.raises(native.InvalidArgumentError) as raised:  # none of the arrays is one
            FUNCTIONS[function](**{name: value})
        known = name in {*taken, "preset", "threads", *OWN_ARGUMENTS.get(function, ())}
        assert ("has no setting" not in str(raised.value)) == known, (name, raised.value)


# Nothing is written twice -------------------------------------------------------------------------------------------

# How the add-on shows a setting; all else about it is the table's.
PRESENTATION = {"soft_min", "soft_max", "step", "precision", "subtype", "unit"}
MADE = ("addon/settings.json", "README.md", "__init__.pyi", "src/settings.txt")


def sources():
    """Everything that people write, as (path, text)."""
    for folder in ("addon", "blender_scripts", "native", "tests", ".ci"):
        for file in sorted((ROOT / folder).rglob("*")):
            if file.is_file() and file.suffix in {"", ".py", ".pyi", ".rs", ".md", ".toml", ".json", ".txt"}:
                yield file.relative_to(ROOT).as_posix(), file.read_text(encoding="utf-8")
    yield "README.md", (ROOT / "README.md").read_text(encoding="utf-8")


def sentences():
    choices = [choice for row in TABLE["settings"] for choice in row.get("choices", ())]
    return [row["sentence"] for row in [*TABLE["settings"], *TABLE["arguments"], *TABLE["presets"], *choices]]


def test_every_sentence_is_written_in_one_file():
    # Lines may be broken: in Rust's strings by a backslash, in Python's by quotation marks.
    texts = [(path, re.sub(r"\s+", " ", re.sub(r'\\\n|"\n\s*"', "", text))) for path, text in sources()]
    homes = [(path, text) for path, text in texts if not path.endswith(MADE)]
    for sentence in sentences():
        stem = sentence.rstrip(".")
        found = [path for path, text in homes for _ in range(text.count(stem))]
        assert len(found) == 1 and found[0].startswith("native/ble_unwrap_core/src"), (sentence, found)


def test_the_addon_says_only_how_settings_are_shown():
    tree = ast.parse((ROOT / "addon/properties.py").read_text(encoding="utf-8"))
    (settings,) = (node for node in tree.body if isinstance(node, ast.ClassDef))
    declared = set()
    for node in settings.body:
        if not isinstance(node, ast.AnnAssign):
            continue
        name, made = node.target.id, node.annotation
        if made.func.id != "declared":
            assert name not in ROWS and name not in ARGUMENTS, f"{name} is in the table"
            continue
        assert [argument.value for argument in made.args] == [name]
        # Which way figures look is the host's to know.
        own = {"default"} if name == "front" else set()
        assert {keyword.arg for keyword in made.keywords} <= PRESENTATION | own, name
        declared.add(name)
    assert declared == {*ROWS, "neighbours"}


def test_the_binding_reads_keywords_by_the_table_alone():
    source = (ROOT / "native/ble_unwrap_native/src/settings.rs").read_text(encoding="utf-8")
    words = {choice["word"] for row in TABLE["settings"] for choice in row.get("choices", ())}
    code = re.sub(r"(?m)//.*$|text_signature = .*$", "", source)
    assert not set(re.findall(r'"(\w+)"', code)) & {*ROWS, *ARGUMENTS, *words}


# The add-on's reading of it -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def settings_table():
    spec = importlib.util.spec_from_file_location("settings_table", ROOT / "addon/settings_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_properties_stay_inside_the_ranges(settings_table):
    assert settings_table.bounds(ROWS["relaxation"], 2) == {"min": 0.01, "max": 1.99}
    assert settings_table.bounds(ROWS["stretch_limit"], 3) == {"min": 1.001, "max": 1000}
    assert settings_table.bounds(ROWS["landmark_max"]) == {"min": 0, "max": 100_000}, "0 stands for no limit"
    assert settings_table.bounds(ROWS["weld_distance"], 6) == {"min": 0}, "there is no greatest distance"
    assert settings_table.bounds(ROWS["seed"]) == {"min": 0}, "Blender's own bound is nearer"


def test_values_are_as_properties_hold_them(settings_table):
    value = settings_table.value
    assert (value("landmark_max", "PAPER"), value("kernel_width", "PAPER"), value("weld_distance")) == (0, 0.0, 0.0)
    assert value("geodesics") == "FAST_MARCHING" and value("texture_size") == (2048, 2048)
    assert settings_table.differences("DEFAULT") == {}
    paper = settings_table.differences("PAPER", ("margin", "texture_size"))
    assert paper["model"] == "PAPER" and paper["stretch_solver"] == "LINE_SEARCH" and "margin" not in paper
    assert settings_table.differences("ISO_CHARTS", ("margin", "texture_size")) == paper | {"model": "ISOMAP"}


def test_tooltips_end_without_a_full_stop_and_say_what_0_stands_for(settings_table):
    row = ROWS["landmark_max"]
    assert settings_table.tooltip(row) == row["sentence"] + " 0 stands for no limit"
    assert settings_table.tooltip(ROWS["seed"]) + "." == ROWS["seed"]["sentence"]
    assert set(settings_table.ZERO_STANDS_FOR_NONE) == {
        "landmark_max",
        "kernel_width",
        "weld_distance",
        "texel_density",
        "cut_angle",
    }
    assert "limit_over" in settings_table.taken_by("unwrap") - settings_table.taken_by("unwrap_points")
