"""The command line of the batch: its options, and the settings they give, as the panel would hold them."""

import argparse

from .. import asset_io, properties, settings_table

# No selection and no old place exist for a file.
EXCLUDED_SETTINGS = ("use_selection",)


def add_setting_arguments(parser):
    """One option per declared setting, named and documented as it is in the panel."""
    group = parser.add_argument_group("settings (as in the panel)")
    for name, deferred in properties.annotations().items():
        if name in EXCLUDED_SETTINGS:
            continue
        keywords = deferred.keywords
        option = "--" + name.replace("_", "-")
        text = keywords["description"].replace("%", "%%")
        default = keywords["default"]
        shown = _shown(default)
        for preset in ("PAPER", "LIGHTMAP"):
            if name in properties.PRESET_VALUES[preset]:
                shown += f"; {_shown(properties.PRESET_VALUES[preset][name])} with --preset {preset.lower()}"
        extra = {"dest": "setting_" + name, "default": None, "help": f"{text} (default: {shown})"}
        if isinstance(default, bool):
            group.add_argument(option, action=argparse.BooleanOptionalAction, **extra)
        elif "items" in keywords:
            choices = [item[0].lower() for item in keywords["items"]]
            group.add_argument(option, choices=choices, type=str.lower, **extra)
        elif name == "texture_size":
            group.add_argument(option, type=int, nargs="+", metavar="PIXELS", **extra)
        else:
            group.add_argument(option, type=_ranged(type(default), keywords), metavar=name.upper(), **extra)


def _shown(value):
    """A setting's value as it is given on the command line."""
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value).lower()


def _ranged(kind, keywords):
    def parse(text):
        value = kind(text)
        if kind is str:
            return value
        low, high = keywords.get("min", -float("inf")), keywords.get("max", float("inf"))
        if not low <= value <= high or value == float("inf"):
            between = f"between {low} and {high}" if high < float("inf") else f"a finite number from {low} on"
            raise argparse.ArgumentTypeError(f"{text} is not {between}")
        return value

    parse.__name__ = kind.__name__
    return parse


def settings_of(arguments, parser):
    """The settings given on the command line, as the panel would hold them."""
    result = {"preset": "DEFAULT", "use_selection": False}
    for name, deferred in properties.annotations().items():
        value = getattr(arguments, "setting_" + name, None)
        if value is None:
            continue
        if "items" in deferred.keywords:
            value = value.upper()
        if name == "texture_size":
            low, high = deferred.keywords["min"], deferred.keywords["max"]
            if len(value) > 2 or not all(low <= pixels <= high for pixels in value):
                parser.error(f"--texture-size: one or two numbers of pixels between {low} and {high}")
            value = (value[0], value[-1])
        result[name] = value
    for name in settings_table.ZERO_STANDS_FOR_NONE & set(result):
        row = settings_table.SETTINGS[name]
        if 0 < result[name] < row["least"]:
            parser.error(f"--{name.replace('_', '-')}: 0 for {row['none']}, or at least {row['least']}")
    threads = settings_table.ARGUMENTS["threads"]
    if not threads["least"] <= getattr(arguments, "threads", threads["default"]) <= threads["most"]:
        parser.error(f"--threads: between {threads['least']} and {threads['most']}")
    return result


def make_parser():
    parser = argparse.ArgumentParser(
        prog="ble_unwrap",
        description="Unwrap files of meshes, or of points without faces: "
        + ", ".join("." + name for name in asset_io.INPUT_FORMATS)
        + ".",
        epilog="Results lie flat in the directory OUT; where inputs of several folders have the same name, in the same "
        "folders as these. An existing file is replaced if it has its input's own name or the report lists it as its "
        "result; else only with --overwrite. Meshes get a UV map, points an attribute of two floats; of the files "
        ".blend and .ply keep the latter. Exit codes: 0 all fine, 1 some assets failed, 2 usage, 3 environment, 4 a "
        "certificate does not hold, 5 stopped by a signal.",
    )
    parser.add_argument("inputs", nargs="+", metavar="IN", help="files to unwrap")
    parser.add_argument("-o", "--output", required=True, metavar="OUT", help="directory, or a file for a single input")
    parser.add_argument("--format", choices=asset_io.OUTPUT_FORMATS, help="output format (default: the input's)")
    parser.add_argument("--report", metavar="FILE", help="write a JSON report, valid at any moment of the run")
    parser.add_argument(
        "--resume",
        action="store_true",
        help="skip what the report lists as done where settings, versions, files read and files written are the same",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that are not known as results")
    parser.add_argument(
        "--atlas",
        choices=("asset", "object"),
        default="asset",
        help="one atlas for all meshes of an asset, or one each; points always have one each (default: asset)",
    )
    parser.add_argument("--compare", action="store_true", help="also measure Smart UV Project at the same margin")
    threads = settings_table.ARGUMENTS["threads"]
    text = f"{settings_table.tooltip(threads)} (default: {threads['default']})"
    parser.add_argument("--threads", type=int, default=threads["default"], help=text)
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    add_setting_arguments(parser)
    return parser
