"""Unwraps files without a window: one code path for `blender --command`, `blender -b -P` and Python with bpy.

`main(argv) -> exit code` never raises for what a user can cause. Codes: 0 all assets are fine; 1 some failed (the
others are written, the report says why); 2 wrong usage; 3 Blender or the native library is missing; 4 all were
written but a certificate does not hold.
"""

# ruff: noqa: T201  (the command line talks through print)

import argparse
import hashlib
import json
import math
import os
import platform
import sys
import time
import traceback
from pathlib import Path

import bpy

from . import asset_io, comparison, engine, mesh_bridge, properties, targets
from .cloud_task import CloudTask
from .run import run_objects

OK, SOME_FAILED, USAGE, ENVIRONMENT, VIOLATED = range(5)
REPORT_SCHEMA = 1
# No selection and no old place exist for a file.
EXCLUDED_SETTINGS = ("use_selection",)

USER_ERRORS = (asset_io.AssetError, mesh_bridge.MeshError, engine.EngineError)


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
        if name in properties.PAPER_VALUES:
            shown += f"; {_shown(properties.PAPER_VALUES[name])} with --preset paper"
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
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not between {low} and {high}")
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
    if 0 < result.get("landmark_max", 0) < 3:
        parser.error("--landmark-max: 0 for no bound, or at least 3")
    if not 0 <= getattr(arguments, "threads", 0) <= 1024:
        parser.error("--threads: between 0 and 1024")
    return result


def make_parser():
    parser = argparse.ArgumentParser(
        prog="ble_unwrap",
        description="Unwrap files of meshes, or of points without faces: "
        + ", ".join("." + name for name in asset_io.INPUT_FORMATS)
        + ".",
        epilog="Meshes get a UV map, points an attribute of two floats; of the files .blend and .ply keep the latter. "
        "Exit codes: 0 all fine, 1 some assets failed, 2 usage, 3 environment, 4 a certificate does not hold.",
    )
    parser.add_argument("inputs", nargs="+", metavar="IN", help="files to unwrap")
    parser.add_argument("-o", "--output", required=True, metavar="OUT", help="directory, or a file for a single input")
    parser.add_argument("--format", choices=asset_io.OUTPUT_FORMATS, help="output format (default: the input's)")
    parser.add_argument("--report", metavar="FILE", help="write a JSON report")
    parser.add_argument("--resume", action="store_true", help="skip what the report lists as done and is unchanged")
    parser.add_argument(
        "--atlas",
        choices=("asset", "object"),
        default="asset",
        help="one atlas for all meshes of an asset, or one each; points always have one each (default: asset)",
    )
    parser.add_argument("--compare", action="store_true", help="also measure Smart UV Project at the same margin")
    parser.add_argument("--threads", type=int, default=0, help="processor threads, 0 for all (default: 0)")
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    add_setting_arguments(parser)
    return parser


def main(argv):
    """Runs the command line; returns the exit code."""
    parser = make_parser()
    try:
        arguments = parser.parse_args(argv)
        settings = settings_of(arguments, parser)
        outputs = plan_outputs(arguments, parser)
    except SystemExit as stop:
        return int(stop.code or 0)
    try:
        engine.native()
    except engine.EngineMissing as error:
        print(f"ble_unwrap: {error}", file=sys.stderr)
        return ENVIRONMENT
    earlier = previous_assets(arguments.report, settings) if arguments.resume else {}
    assets = []
    for number, (source, target) in enumerate(outputs, 1):
        label = f"[{number}/{len(outputs)}] {source}"
        digest = file_digest(source)
        done = earlier.get((str(source), str(target)))
        if done and digest and done.get("sha256") == digest and target.exists():
            asset = done
            text = "done before"
        else:
            asset = process(source, target, settings, arguments)
            asset["sha256"] = digest
            text = asset["error"] or f"{asset['summary']} -> {target}"
        assets.append(asset)
        stream = sys.stdout if asset["status"] == "ok" else sys.stderr
        if asset["status"] != "ok" or not arguments.quiet:
            print(f"{label}: {text}", file=stream, flush=True)
        for warning in asset.get("warnings", ()):
            if not arguments.quiet:
                print(f"    note: {warning}", flush=True)
    code = exit_code(assets)
    if arguments.report:
        try:
            write_json(arguments.report, make_report(assets, settings))
        except OSError as error:
            print(f"ble_unwrap: cannot write the report {arguments.report}: {error.strerror}", file=sys.stderr)
            return SOME_FAILED
    return code


def plan_outputs(arguments, parser):
    """Pairs of input and output paths; wrong usage where a file would be lost."""
    target = Path(arguments.output)
    inputs = [Path(name) for name in arguments.inputs]
    as_file = asset_io.file_format(target) in asset_io.OUTPUT_FORMATS and not target.is_dir()
    if as_file and len(inputs) > 1:
        parser.error("-o names a file, but there are several inputs: give a directory")
    if target.suffix and not as_file and not target.is_dir() and len(inputs) == 1:
        known = ", ".join(asset_io.OUTPUT_FORMATS)
        parser.error(f"cannot write '{target.suffix}' files; known are {known} (a directory may have no such name)")
    if as_file and arguments.format and arguments.format != asset_io.file_format(target):
        parser.error(f"-o {target} and --format {arguments.format} contradict each other")
    if not as_file and target.exists() and not target.is_dir():
        parser.error(f"-o {target} is a file, not a directory")
    pairs, taken = [], {}
    for source in inputs:
        kind = arguments.format or asset_io.default_output_format(source)
        out = target if as_file else target / f"{source.stem}.{kind}"
        if out.resolve() == source.resolve():
            parser.error(f"{source} would be overwritten by its own result: give another -o")
        if out.resolve() in taken:
            parser.error(f"{source} and {taken[out.resolve()]} would both be written to {out}")
        taken[out.resolve()] = source
        pairs.append((source, out))
    return pairs


def process(source, target, settings, arguments):
    """Unwraps one file; what goes wrong is in the result, not raised."""
    asset = {"in": str(source), "out": None, "status": "failed", "error": None, "summary": "", "objects": []}
    started = time.perf_counter()
    try:
        # These formats split vertices wherever normals or UVs differ.
        settings = {"weld": asset_io.file_format(source) in asset_io.SPLIT_FORMATS, **settings}
        asset_io.load(source)
        contents = asset_io.prepare(target)
        objects, notes = unwrapped_objects(targets.unique_data(contents.objects), target)
        run, outcomes = run_objects(objects, settings, threads=arguments.threads, one_atlas=arguments.atlas == "asset")
        asset["objects"] = [describe(task, outcome) for task, outcome in zip(run.tasks, outcomes, strict=True)]
        warnings = [text for outcome in outcomes for text in outcome.certificate.warnings]
        asset["warnings"] = contents.notes + notes + warnings
        asset["summary"] = "; ".join(outcome.summary for outcome in outcomes)
        if arguments.compare:
            add_baseline(asset, run, settings)
        saved = asset_io.save(target, source=source, cloud=written_cloud(run, outcomes), contents=contents)
        asset["out"] = str(target)
        asset["warnings"] = [text for text in asset["warnings"] if text not in saved.bare] + saved.notes
        broken = [text for outcome in outcomes for text in outcome.certificate.violations] + saved.bare
        asset["status"] = "violated" if broken else "ok"
        asset["error"] = "; ".join(broken) or None
    except USER_ERRORS as error:
        asset["error"] = str(error)
    except Exception as error:  # a bug of ours: the other assets go on, and this one is reported as it is
        traceback.print_exc()
        asset["error"] = f"internal error, please report it: {type(error).__name__}: {error}"
    asset["time_s"] = round(time.perf_counter() - started, 4)
    return asset


def unwrapped_objects(objects, target):
    """Objects whose maps the output can hold, and notes about those that are left out."""
    surfaces, clouds = ([obj for obj in objects if test(obj)] for test in (targets.is_surface, targets.is_cloud))
    if not surfaces and not clouds:
        raise mesh_bridge.MeshError("holds no faces and no points to unwrap")
    kind = asset_io.file_format(target)
    if not clouds or asset_io.keeps_points(kind, surfaces=bool(surfaces), clouds=len(clouds)):
        return surfaces + clouds, []
    if not surfaces:
        if kind == "ply":
            raise mesh_bridge.MeshError("holds several clouds, and a .ply file keeps one: use --format blend")
        able = " or ".join(asset_io.POINT_FORMATS)
        raise mesh_bridge.MeshError(f"holds points, whose UVs .{kind} files cannot keep: use --format {able}")
    return surfaces, [f"{obj.name}: left out, .{kind} files cannot keep UVs of its points" for obj in clouds]


def written_cloud(run, outcomes):
    """The only cloud of a run and its attribute, for `asset_io.save`; None for anything else."""
    if len(run.tasks) != 1 or not isinstance(run.tasks[0], CloudTask):
        return None
    return bpy.data.objects[run.tasks[0].title], outcomes[0].maps[0]


def describe(task, outcome):
    """The report's entry for one atlas."""
    if isinstance(task, CloudTask):
        names, size = [task.title], {"kind": "cloud", "points": task.element_count}
    else:
        names = [part.object_name for part in task.selection.parts]
        size = {"kind": "surface", "corners": len(task.selection.corner_vertices)}
    return {
        "names": names,
        "uv_maps": outcome.maps,
        **size,
        "time_s": round(outcome.seconds, 4),
        "certificate": {"holds": outcome.certificate.holds, "violations": outcome.certificate.violations},
        "measured": outcome.certificate.measured,
        "seconds": outcome.report.get("seconds"),
        "rungs": outcome.report.get("rungs"),
        "charts_over_limit": outcome.report.get("charts_over_limit"),
        "warnings": outcome.certificate.warnings,
    }


def add_baseline(asset, run, settings):
    """Measures Smart UV Project in a UV map of its own, and takes that map away again. It cannot map clouds."""
    full = {**properties.default_values(settings["preset"]), **settings}
    for entry, task in zip(asset["objects"], run.tasks, strict=True):
        if isinstance(task, CloudTask):
            continue
        group = task.objects
        active = [obj.data.uv_layers.active.name for obj in group]
        results, best = comparison.best_smart_uv(group, margin=full["margin"], texture_size=full["texture_size"])
        entry["baseline_smart_uv"] = {"best_angle": best, "by_angle": results}
        for obj, name in zip(group, active, strict=True):
            obj.data.uv_layers.remove(obj.data.uv_layers[comparison.SMART_MAP])
            obj.data.uv_layers.active = obj.data.uv_layers[name]


def exit_code(assets):
    statuses = {asset["status"] for asset in assets}
    if "failed" in statuses:
        return SOME_FAILED
    return VIOLATED if "violated" in statuses else OK


def file_digest(path):
    try:
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


def make_report(assets, settings):
    counts = {name: sum(asset["status"] == name for asset in assets) for name in ("ok", "violated", "failed")}
    return {
        "schema": REPORT_SCHEMA,
        "tool": {"name": "ble_unwrap", "native": engine.version()},
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "params": settings,
        "assets": assets,
        "summary": {"assets": len(assets), **counts},
        "peak_rss_mb": peak_memory_mb(),
    }


def peak_memory_mb():
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1024 * 1024 if sys.platform == "darwin" else 1024), 1)


def write_json(path, value):
    """Writes JSON under a temporary name, then renames: a reader never sees half a file."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    work = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        work.write_text(json.dumps(_plain(value), indent=1, allow_nan=False) + "\n", encoding="utf-8")
        work.replace(path)
    finally:
        work.unlink(missing_ok=True)


def _plain(value):
    """A value as JSON can hold it: NumPy's scalars and arrays as numbers, what is not finite as null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def previous_assets(report, settings):
    """Finished assets of an earlier report made with the same settings, by input and output."""
    try:
        earlier = json.loads(Path(report).read_text(encoding="utf-8"))
        if earlier["schema"] != REPORT_SCHEMA or earlier["params"] != json.loads(json.dumps(settings)):
            return {}
        return {(asset["in"], asset["out"]): asset for asset in earlier["assets"] if asset["status"] == "ok"}
    except (OSError, TypeError, ValueError, KeyError):
        return {}
