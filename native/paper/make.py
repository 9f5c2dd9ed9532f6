"""`make paper`: the paper's figures and comparisons, measured and drawn anew.

python native/paper/make.py [MODEL.obj ...] [-o out/paper] [--no-render] [--quick] [--publish]

Writes the page (README.md), its pictures and its table as JSON to the output directory, and nothing elsewhere; with
`--publish`, which is what `make paper-page` does, the page beside this file is brought up to date afterwards. Models
given by path take the place of the generated ones in figure 3 and in the table of charts. Needs the wheel, matplotlib
and scikit-learn, and for the renders a Blender or its Python package.
"""

# ruff: noqa: E402

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPO = HERE.parent.parent
sys.path[:0] = [str(HERE), str(REPO / "blender_scripts")]

import ble_unwrap_native as ble
import commit
import compare
import figures
import launch
import machine
import measure
import numpy as np
import page
import publish
import rivals
import shapes

RUNS = 7  # of an embedding whose time is given: the best counts
PATCH_CELLS = 26  # of the checker along the longer side of a patch
MODEL_CELLS = 60  # of the checker along the side of a texture


def say(text):
    print(f"[{time.strftime('%H:%M:%S')}] {text}", flush=True)


class Renders:
    """Pictures that Blender is asked for, all in one run."""

    def __init__(self, directory, wanted):
        self.directory, self.wanted, self.jobs = directory, wanted, []
        directory.mkdir(parents=True, exist_ok=True)

    def add(self, name, mesh, uv=None, colours=None, *, cells=1.0, size=(400, 400), samples=24):
        data = {
            "positions": mesh.positions,
            "corner_vertices": mesh.corner_vertices,
            "face_offsets": mesh.face_offsets,
        }
        data |= {} if uv is None else {"uv": uv}
        data |= {} if colours is None else {"colours": colours}
        np.savez(self.directory / f"{name}.npz", **data)
        picture = self.directory / f"{name}.png"
        paths = {"mesh": str(self.directory / f"{name}.npz"), "picture": str(picture)}
        self.jobs.append({**paths, "view": list(mesh.view), "size": list(size), "samples": samples, "cells": cells})
        return picture

    def run(self):
        """Whether the pictures are there."""
        if not self.wanted:
            return False
        listed = self.directory / "jobs.json"
        listed.write_text(json.dumps(self.jobs), encoding="utf-8")
        try:
            blender = launch.find_blender()
            say(f"rendering {len(self.jobs)} pictures in {blender.name}")
            with launch.Profile(blender) as profile:
                script = launch.SCRIPTS / "paper_render.py"
                done = profile.run(script, listed, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        except launch.Unavailable as error:
            say(f"no renders: {error}")
            return False
        missing = [job["picture"] for job in self.jobs if not Path(job["picture"]).is_file()]
        if done.returncode or missing:
            print(done.stdout[-4000:], file=sys.stderr)
            raise SystemExit(f"Blender rendered {len(self.jobs) - len(missing)} of {len(self.jobs)} pictures")
        return True


def patch_figures(renders):
    """What figure 2 needs: the face and the camel's head by both models."""
    face, head = shapes.face(), shapes.camel_head()
    both = {name: compare.METHODS[name] for name in ("BLE (paper)", "BLE (default)")}
    faces, heads = compare.compare_patches([face], both, RUNS), compare.compare_patches([head], both)
    pictures = {}
    for row in heads:
        for when, uv in (("before", row.embedded), ("after", row.uv)):
            cells = PATCH_CELLS / np.ptp(uv, axis=0).max()
            name = f"head_{row.report['model']}_{when}"
            pictures[row.method, when] = renders.add(name, head, figures.corner_uv(head, uv), cells=cells)
    return face, faces, head, heads, pictures


def atlases(models, renders):
    """An unwrap of each model, with the pictures of figure 3."""
    found = []
    for mesh in models:
        atlas = ble.unwrap(*mesh.arrays, texture_size=1024)
        say(f"{mesh.name}: {atlas.report['faces']:,} faces, {compare.charts_text(atlas.report['charts'])}")
        uv, chart = np.asarray(atlas.uv), np.asarray(atlas.chart)
        name = mesh.name.replace(" ", "_")
        pictures = {
            "checker": renders.add(f"{name}_checker", mesh, uv, cells=MODEL_CELLS),
            "charts": renders.add(f"{name}_charts", mesh, uv, figures.chart_colours(chart) ** 2.2, cells=MODEL_CELLS),
        }
        found.append((mesh, atlas, pictures))
    return found


def variants(models):
    """Models by the three presets: charts and stretch of whole atlases."""
    rows = []
    for mesh in models:
        for preset in ("default", "paper", "iso_charts"):
            begin = time.perf_counter()
            report = ble.unwrap(*mesh.arrays, preset=preset, texture_size=1024, margin=2).report
            rows.append((mesh.name, preset, dict(report), time.perf_counter() - begin))
            say(f"{mesh.name}, preset {preset}: {compare.charts_text(report['charts'])} in {rows[-1][-1]:.0f} s")
    return rows


def main():
    parser = argparse.ArgumentParser(prog="make.py", description="The paper's figures and comparisons.")
    parser.add_argument(
        "models", nargs="*", metavar="MODEL.obj", help="models of your own instead of the generated ones"
    )
    parser.add_argument("-o", "--output", default=REPO / "out" / "paper", type=Path, help="(default: out/paper)")
    parser.add_argument("--render", action=argparse.BooleanOptionalAction, default=True, help="(default: yes)")
    parser.add_argument("--quick", action="store_true", help="small sizes and no presets: to try the script")
    parser.add_argument("--publish", action="store_true", help="bring the page in native/paper up to date afterwards")
    options = parser.parse_args()
    for path in options.models:
        if not Path(path).is_file():
            parser.error(f"{path}: no such file")
    code, clean = commit.described(REPO), commit.is_clean(REPO)
    if options.publish:
        given = {"models": options.models, "quick": options.quick, "rendered": options.render}
        if reason := publish.refusal(clean=clean, **given):
            parser.error(reason)
    out = options.output.resolve()
    pictures = out / "pictures"
    renders = Renders(out / "renders", options.render)
    models = [shapes.read_obj(path) for path in options.models] or shapes.complex_models()

    say("figure 2: patches before and after")
    face, faces, head, heads, textured = patch_figures(renders)
    figures.figure_2a(face, faces, pictures / "figure_2a.png")
    say("figure 3: atlases")
    made = atlases(models, renders)
    rendered = renders.run()
    if options.publish and not rendered:
        raise SystemExit("The page needs the renders, and there is no Blender to make them")
    if rendered:
        figures.figure_2b(head, heads, textured, pictures / "figure_2b.png")
        figures.figure_3(made, pictures / "figure_3.png")
    say("the table: three methods on the same patches")
    patches = compare.compare_patches(shapes.patches(), runs=RUNS)
    two = {name: compare.CHART_METHODS[name] for name in ("BLE (default)", "Isomap")}
    by_landmarks = compare.compare_patches(shapes.patches()[:-1], two)
    say("the table: three methods on the same charts")
    charts = {mesh.name: compare.compare_charts(mesh) for mesh in models}
    presets = [] if options.quick else variants(models if options.models else shapes.complex_models(0.085))
    say("whole atlases by BLE and by Isomap")
    pairs = rivals.measured(rivals.generated(options.quick), say=say)
    say("time against size")
    sizes = measure.SIZES[:3] if options.quick else measure.SIZES
    surfaces, points = measure.time_of_surfaces(sizes), measure.time_of_points(sizes)
    figures.figure_scaling(surfaces, points, measure.traces(face), pictures / "scaling.png")
    say("trustworthiness")
    trust = measure.trustworthiness_table(400 if options.quick else 1500)
    text = page.text(
        code=code,
        machine=machine.described(),
        models=[Path(path).name for path in options.models],
        rendered=rendered,
        faces=faces,
        landmarks=compare.flatten(face, "by landmarks", {}, RUNS).report,
        heads=heads,
        made=made,
        patches=patches,
        by_landmarks=by_landmarks,
        charts=charts,
        presets=presets,
        pairs=pairs,
        surfaces=surfaces,
        points=points,
        trust=trust,
    )
    (out / "README.md").write_text(text, encoding="utf-8")
    rows = [
        {"patch": row.patch, "method": row.method, "l2_of_99_before": row.trimmed_before, **row.report}
        for row in [*patches, *(row for group in charts.values() for row in group)]
    ]
    (out / "table.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if options.publish:
        publish.publish(out, HERE)
        say(f"brought native/paper up to date ({figures.total_size(HERE / 'pictures') / 1e6:.2f} MB of pictures)")
    (out / "rivals.json").write_text(json.dumps(pairs, indent=1), encoding="utf-8")
    print(
        compare.patch_table(patches), compare.chart_table(charts), rivals.table(pairs), f"written to {out}", sep="\n\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
