"""What the library says of its settings, read from settings.json, and how Blender's properties hold it.

`make settings` writes the file from the table in the core, so that nothing of it is written again here. Knows neither
Blender nor the native module: the add-on registers without the latter.

Properties hold what the library calls None as 0, its words in capitals, and the size of a texture as a tuple.
"""

import json
from pathlib import Path

_TABLE = json.loads((Path(__file__).parent / "settings.json").read_text(encoding="utf-8"))

# Name -> row of the table; the settings of the library, and what its functions take beside them.
SETTINGS = {row["name"]: row for row in _TABLE["settings"]}
ARGUMENTS = {row["name"]: row for row in _TABLE["arguments"]}
PRESETS = [row["word"].upper() for row in _TABLE["presets"]]

# Settings that may be None in the library.
ZERO_STANDS_FOR_NONE = frozenset(name for name, row in SETTINGS.items() if "none" in row)


def value(name, preset="DEFAULT"):
    """The value of a setting under a preset, as properties hold it."""
    row = SETTINGS[name]
    found = row["values"][preset.lower()]
    if found is None:
        return 0.0 if row["kind"] == "real" else 0
    if row["kind"] == "choice":
        return found.upper()
    return tuple(found) if row["kind"] == "size" else found


def differences(preset, left_out=()):
    """What a preset differs in from the defaults, some settings left out: name -> value as properties hold it."""
    return {
        name: value(name, preset) for name in SETTINGS if name not in left_out and value(name, preset) != value(name)
    }


def taken_by(function):
    """Names of the settings that a function of the library takes."""
    return frozenset(name for name, row in SETTINGS.items() if function in _TABLE["groups"][row["group"]])


def tooltip(row):
    """The sentences of a row as Blender shows them, which adds the last full stop itself."""
    text = row["sentence"]
    if "none" in row:
        text += f" 0 stands for {row['none']}."
    return text.removesuffix(".")


def items(rows):
    """The values of a choice as an `EnumProperty` has them."""
    return tuple((row["word"].upper(), row["label"], tooltip(row)) for row in rows)


def preset_items():
    """The presets as an `EnumProperty` has them."""
    return items(_TABLE["presets"])


def bounds(row, digits=None):
    """Least and greatest value that a property may hold: name of Blender's keyword -> value.

    Properties include their bounds; where the library leaves one out, they stay away from it by one in the last of
    the `digits` after the point that are shown. What is too large for a property has no bound.
    """
    least, most = row["least"], row["most"]
    if "none" in row:
        least = 0
    elif row.get("least_open"):
        least = round(least + 10**-digits, digits)
    if row.get("most_open") and most is not None:
        most = round(most - 10**-digits, digits)
    found = {"min": least, "max": most}
    return {name: bound for name, bound in found.items() if bound is not None and bound < 2**31}
