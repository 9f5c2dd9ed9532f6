"""The part of the contact sheet that runs in Blender: unwrap, render from two sides, draw. Started by contact_sheet.py.

blender -b -P blender_scripts/contact_sheet_inside.py -- [MODEL ...] -o SHEET.png [--compare smart] [--size 360]

Writes SHEET.png and, beside it, SHEET.json with what was measured. Without models: the meshes of the demonstration. A
model that cannot be read or unwrapped gets a cell that says why, and the exit code 1.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader
import demo_meshes
import numpy as np
import pictures
import render

SAMPLES = 16
# Of the checker, along the side of the texture: fields of some six pixels in a picture of 360.
CELLS = 48
SIZE = 360
# From the front and from behind: a seam that only one of them shows would look hidden.
VIEWS = ((0.62, -1.0, 0.42), (-0.62, 1.0, 0.42))
COLUMNS = 3
GAP = 14
NAME_SIZE, TEXT_SIZE = 24, 16  # of the captions, in pixels


def caption(name, measured, seconds):
    """Name and figures of a cell: one line for the name, two for the figures."""
    charts = int(measured["charts"])
    faces = int(measured["faces"])
    wrong = [f"{int(measured[key])} {key}" for key in ("flips", "overlaps") if measured.get(key)]
    figures = [
        f"stretch {measured['l2']:.3f}",
        f"worst chart {measured['l2_worst_chart']:.3f}",
        f"L-infinity {measured['l_infinity']:.2f}",
        f"seams {measured['seam_length']:.2f}",
        f"{100 * measured['packing_efficiency']:.1f}% used",
    ]
    counts = [f"{faces:,} faces", f"{charts} chart{'' if charts == 1 else 's'}", f"{seconds:.2f} s", *wrong]
    return [name, ", ".join(counts), ", ".join(figures)]


def titled(panels, lines, gap=GAP):
    """Panels of equal height in a row below their caption; the first line larger. Text too long for it is cut off."""
    row = []
    for number, panel in enumerate(panels):
        if number:
            row.append(pictures.plain(panel.shape[0], gap))
        row.append(panel)
    body = np.concatenate(row, axis=1)
    head = pictures.plain(head_height(len(lines)), body.shape[1])
    y = 4
    for number, text in enumerate(lines):
        size = NAME_SIZE if number == 0 else TEXT_SIZE
        pictures.draw_text(head, pictures.shortened(text, body.shape[1], size), 0, y, size)
        y += pictures.line_height(size)
    return np.concatenate([head, body])


def head_height(lines):
    """Pixels above the panels for so many lines of caption."""
    return pictures.line_height(NAME_SIZE) + (lines - 1) * pictures.line_height(TEXT_SIZE) + 8


def sheet(cells, columns=COLUMNS, gap=GAP):
    """Cells of equal size in rows, with a legend below. Missing ones of the last row stay empty."""
    columns = max(1, min(columns, len(cells)))
    height, width, _ = cells[0].shape
    rows = -(-len(cells) // columns)
    strip = pictures.legend(columns * (width + 2 * gap))
    canvas = pictures.plain(rows * (height + 2 * gap) + strip.shape[0] + gap, strip.shape[1])
    for number, cell in enumerate(cells):
        row, column = divmod(number, columns)
        top, left = row * (height + 2 * gap) + gap, column * (width + 2 * gap) + gap
        canvas[top : top + height, left : left + width] = cell
    canvas[-strip.shape[0] - gap : -gap] = strip
    return canvas


def failed_cell(name, reason, size, panels):
    """A cell that says what went wrong."""
    empty = pictures.plain(size, size, pictures.EMPTY)
    return titled([empty] * panels, [name, "failed", reason])


def layout_of(objects, map_name, size):
    comparison, bridge = addon_loader.load("comparison"), addon_loader.load("mesh_bridge")
    comparison.activate_map(bridge.unique_meshes(objects), map_name)
    selection = bridge.gather(bridge.unique_meshes(objects))
    return pictures.layout(selection, bridge.read_uvs(selection), size)


def unwrapped(objects, settings, smart):
    """Unwraps into a UV map; rows by method, the first ours, each with its map."""
    comparison, task = addon_loader.load("comparison"), addon_loader.load("task")
    settings = {**settings, "use_selection": False, "uv_map": "ACTIVE", "use_original_bounds": False}
    if smart:
        rows = comparison.compare(objects, settings)
        found = [(comparison.BLE_MAP, rows["ble_unwrap"], rows["ble_unwrap"]["seconds_total"])]
        return [*found, (comparison.SMART_MAP, rows["smart_uv_best"], rows["smart_uv_best"]["seconds_total"])]
    comparison.activate_map(addon_loader.load("mesh_bridge").unique_meshes(objects), comparison.BLE_MAP)
    outcome = task.unwrap_objects(objects, settings)
    measured = {**outcome.certificate.measured, "violations": outcome.certificate.violations}
    return [(comparison.BLE_MAP, measured, outcome.seconds)]


def cell_of(name, objects, settings, work, options):
    """The finished cell of a model, and what was measured."""
    rows = unwrapped(objects, settings, options.compare == "smart")
    map_name, measured, seconds = rows[0]
    picture = work.with_name(f".{work.stem}_render.png")
    panels = []
    for view in VIEWS:
        size = (options.size, options.size)
        render.render_objects(
            objects, picture, map_name, size=size, samples=SAMPLES, cells=CELLS, plain=True, view=view
        )
        panels.append(pictures.read_png(picture))
        picture.unlink()
    panels += [layout_of(objects, row[0], options.size) for row in rows]
    lines = caption(name, measured, seconds)
    if len(rows) > 1:
        lines.append("Smart UV Project: " + ", ".join(caption("", *rows[1][1:])[1:]))
    return titled(panels, lines), {**measured, "seconds_total": seconds}


def sources(models):
    """(name, function that loads and returns objects, settings) of each model."""
    asset_io = addon_loader.load("asset_io")
    if models:
        return [
            (Path(model).stem, lambda model=model: asset_io.load(model), asset_io.default_settings(model))
            for model in models
        ]

    def made(make):
        asset_io.new_scene()
        return [make()]

    generated = {"suzanne": demo_meshes.suzanne, "spiral ramp": demo_meshes.spiral_ramp, "sculpt": demo_meshes.sculpt}
    return [(name, lambda make=make: made(make), {}) for name, make in generated.items()]


def main(argv):
    batch, targets = addon_loader.load("batch"), addon_loader.load("targets")
    bridge, engine = addon_loader.load("mesh_bridge"), addon_loader.load("engine")
    surface_report = addon_loader.load("surface_report")
    parser = argparse.ArgumentParser(prog="contact_sheet_inside.py")
    parser.add_argument("models", nargs="*", metavar="MODEL")
    parser.add_argument("-o", "--output", required=True, type=Path)
    parser.add_argument("--compare", choices=["smart"])
    parser.add_argument("--size", type=int, default=SIZE, help=f"pixels of one picture (default: {SIZE})")
    parser.add_argument("--columns", type=int, default=COLUMNS)
    options = parser.parse_args(argv)
    if not 64 <= options.size <= 2048 or not 1 <= options.columns <= 16:
        parser.error("--size must be within 64 and 2048, --columns within 1 and 16")
    try:
        engine.native()
        options.output.parent.mkdir(parents=True, exist_ok=True)
    except engine.EngineMissing as error:
        print(f"contact sheet: {error}", file=sys.stderr)
        return batch.ENVIRONMENT
    cells, report, failed = [], {}, {}
    todo = sources(options.models)
    for number, (name, load, settings) in enumerate(todo, 1):
        started = time.perf_counter()
        try:
            objects = [obj for obj in load() if targets.is_surface(obj)]
            if not objects:
                raise bridge.MeshError("holds no faces")
            cell, report[name] = cell_of(name, objects, settings, options.output, options)
            said = surface_report.summary(report[name], report[name]["seconds_total"])
        except (*batch.USER_ERRORS, RuntimeError, OSError) as error:
            cell = failed_cell(name, str(error), options.size, len(VIEWS) + (2 if options.compare else 1))
            failed[name] = str(error)
            said = f"failed: {error}"
        cells.append(cell)
        spent = time.perf_counter() - started
        print(f"[{number}/{len(todo)}] {name}: {said} ({spent:.1f} s with the pictures)", flush=True)
    height = max(cell.shape[0] for cell in cells)
    cells = [np.concatenate([cell, pictures.plain(height - cell.shape[0], cell.shape[1])]) for cell in cells]
    pictures.write_png(options.output, sheet(cells, options.columns))
    addon_loader.load("batch.report").write_json(
        options.output.with_suffix(".json"), {"models": report, "failed": failed}
    )
    print(f"written to {options.output}")
    if failed:
        return batch.SOME_FAILED
    broken = {name: found["violations"] for name, found in report.items() if found["violations"]}
    for name, violations in broken.items():
        print(f"{name}: not as promised: {'; '.join(violations)}", file=sys.stderr)
    return batch.VIOLATED if broken else batch.OK


if __name__ == "__main__":
    addon_loader.run(main)
