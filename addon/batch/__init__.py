"""Unwraps files without a window: one code path for `blender --command`, `blender -b -P` and Python with bpy.

`main(argv) -> exit code` never raises for what a user can cause. Codes: 0 all assets are fine; 1 some failed (the
others are written, the report says why); 2 wrong usage; 3 Blender or the native library is missing; 4 all were
written, but one is not as promised; 5 a signal stopped it (what was done is written and in the report).
"""

# ruff: noqa: T201  (the command line talks through print)

import platform
import sys
import time
import traceback

import bpy

from .. import asset_io, comparison, engine, mesh_bridge, properties, targets
from ..cloud_task import CloudTask
from ..run import run_objects
from . import resume
from .arguments import make_parser, settings_of
from .plan import PlanError, is_among, plan_outputs
from .report import ReportFile, earlier_assets
from .stop_signals import Stopped, StopRequest

OK, SOME_FAILED, USAGE, ENVIRONMENT, VIOLATED, INTERRUPTED = range(6)
REPORT_SCHEMA = 2

USER_ERRORS = (asset_io.AssetError, mesh_bridge.MeshError, engine.EngineError)


def main(argv):
    """Runs the command line; returns the exit code."""
    parser = make_parser()
    try:
        arguments = parser.parse_args(argv)
        settings = settings_of(arguments, parser)
        earlier = earlier_assets(arguments.report) if arguments.report else {}
        plan, notes = planned_outputs(arguments, earlier, parser)
    except SystemExit as stop:
        return int(stop.code or 0)
    try:
        engine.native()
    except engine.EngineMissing as error:
        print(f"ble_unwrap: {error}", file=sys.stderr)
        return ENVIRONMENT
    report = Report(arguments, settings, len(plan), earlier)
    with StopRequest() as stop:
        if not report.start():
            return SOME_FAILED
        show_notes(notes, arguments)
        assets, stopped = process_all(plan, settings, arguments, earlier, report, stop)
        written = report.finish("interrupted" if stopped else "complete", stopped_by=stopped)
    if stopped:
        again = "; run it again with --resume for the rest" if arguments.report else ""
        print(f"ble_unwrap: stopped by {stopped}, {len(assets)} of {len(plan)} files were done{again}", file=sys.stderr)
        return INTERRUPTED
    return exit_code(assets) if written else SOME_FAILED


def planned_outputs(arguments, earlier, parser):
    """What is read and written, and notes; ends with wrong usage where a file would be lost."""
    try:
        plan, notes = plan_outputs(
            arguments.inputs,
            arguments.output,
            kind=arguments.format,
            overwrite=arguments.overwrite,
            written_before=set(earlier),
        )
    except PlanError as error:
        parser.error(str(error))
    if arguments.report and is_among(arguments.report, plan):
        parser.error(f"--report {arguments.report} is an input or an output: give another name")
    return plan, notes


def options_of(arguments):
    """The options besides the settings that change results."""
    return {"atlas": arguments.atlas, "compare": arguments.compare}


def show_notes(notes, arguments, indent=""):
    if not arguments.quiet:
        for note in notes:
            print(f"{indent}note: {note}", flush=True)


def process_all(plan, settings, arguments, earlier, report, stop):
    """Unwraps one file after the other and reports each: their entries, and the name of the signal that stopped it."""
    evidence = resume.Evidence(settings, options_of(arguments))
    assets = []
    try:
        for number, planned in enumerate(plan, 1):
            stop.check()
            before = earlier.get((str(planned.source), str(planned.target)))
            if arguments.resume and before and not planned.problem and evidence.is_done(planned, before):
                asset, text = before, "done already, skipped"
            else:
                asset = process(planned, settings, arguments, evidence, stop)
                text = asset["error"] or f"{asset['summary']} -> {planned.target}"
            assets.append(asset)
            report.add(asset)
            stream = sys.stdout if asset["status"] == "ok" else sys.stderr
            if asset["status"] != "ok" or not arguments.quiet:
                print(f"[{number}/{len(plan)}] {planned.source}: {text}", file=stream, flush=True)
            show_notes(asset.get("warnings", ()), arguments, indent="    ")
    except Stopped as signal:
        return assets, str(signal)
    return assets, None


def process(planned, settings, arguments, evidence, stop):
    """Unwraps one file; what goes wrong is in the result. Raises `Stopped` alone, with the output as it was."""
    source, target = planned.source, planned.target
    asset = {"in": str(source), "out": None, "status": "failed", "error": None, "summary": "", "objects": []}
    started = time.perf_counter()
    asset["sha256"] = digest = evidence.digest(source)
    try:
        if planned.problem:
            raise asset_io.AssetError(planned.problem)
        settings = {**asset_io.default_settings(source), **settings}
        asset_io.load(source)
        external = resume.external_files()
        contents = asset_io.prepare(target)
        objects, notes = unwrapped_objects(targets.unique_data(contents.objects), target)
        run, outcomes = run_objects(
            objects,
            settings,
            threads=arguments.threads,
            one_atlas=arguments.atlas == "asset",
            progress=lambda _fraction, _stage: stop.check(),
        )
        asset["objects"] = [describe(task, outcome) for task, outcome in zip(run.tasks, outcomes, strict=True)]
        warnings = [text for outcome in outcomes for text in outcome.certificate.warnings]
        asset["warnings"] = planned.notes + contents.notes + notes + warnings
        asset["summary"] = "; ".join(outcome.summary for outcome in outcomes)
        if arguments.compare:
            add_baseline(asset, run, settings)
        stop.check()
        saved = asset_io.save(target, source=source, cloud=written_cloud(run, outcomes), contents=contents)
        asset["out"] = str(target)
        asset["warnings"] = [text for text in asset["warnings"] if text not in saved.bare] + saved.notes
        broken = [text for outcome in outcomes for text in outcome.certificate.violations] + saved.bare
        asset["status"] = "violated" if broken else "ok"
        asset["error"] = "; ".join(broken) or None
        asset["resume"] = evidence.note(planned, digest, external)
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
            raise mesh_bridge.MeshError(
                "holds several point clouds, and a .ply file can store only one: use --format blend"
            )
        able = " or ".join(asset_io.POINT_FORMATS)
        raise mesh_bridge.MeshError(f"holds points, and .{kind} files cannot store UVs of points: use --format {able}")
    return surfaces, [f"{obj.name}: left out, because .{kind} files cannot store UVs of points" for obj in clouds]


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
        # As wide as mip levels made it.
        margin = entry["measured"].get("margin_texels", full["margin"])
        results, best = comparison.best_smart_uv(group, margin=margin, texture_size=full["texture_size"])
        entry["baseline_smart_uv"] = {"best_angle": best, "by_angle": results}
        for obj, name in zip(group, active, strict=True):
            obj.data.uv_layers.remove(obj.data.uv_layers[comparison.SMART_MAP])
            obj.data.uv_layers.active = obj.data.uv_layers[name]


def exit_code(assets):
    statuses = {asset["status"] for asset in assets}
    if "failed" in statuses:
        return SOME_FAILED
    return VIOLATED if "violated" in statuses else OK


class Report:
    """The report of a run, where one is asked for; that it cannot be written is said and ends nothing."""

    def __init__(self, arguments, settings, planned, earlier):
        head = {
            "schema": REPORT_SCHEMA,
            "tool": {"name": "ble_unwrap", "native": engine.version()},
            "blender": bpy.app.version_string,
            "python": platform.python_version(),
            "params": settings,
            "options": options_of(arguments),
            "planned": planned,
        }
        self._file = ReportFile(arguments.report, head, earlier) if arguments.report else None

    def start(self):
        """Whether a report can be written: asked before any work."""
        return self._try(lambda file: file.start())

    def add(self, asset):
        return self._try(lambda file: file.add(asset))

    def finish(self, state, **more):
        """Writes it for good; whether that went well."""
        return self._try(lambda file: file.finish(state, **more, peak_rss_mb=peak_memory_mb()))

    def _try(self, write):
        try:
            if self._file:
                write(self._file)
            return True
        except OSError as error:
            print(f"ble_unwrap: cannot write the report {self._file.path}: {error.strerror}", file=sys.stderr)
            return False


def peak_memory_mb():
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1024 * 1024 if sys.platform == "darwin" else 1024), 1)
