"""The part of the demonstration that runs in Blender: unwrap, compare, draw, save. Started by demo.py.

Writes OUT/report.json and, for every mesh, NAME.blend (both layouts as UV maps), NAME_layout.png (both layouts
coloured by stretch) and NAME_render.png (the model under a numbered grid, BLE Unwrap left, Smart UV Project right).
A point cloud, which Smart UV Project cannot map, gets NAME_render.png alone: under a checker, beside its atlas.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader
import compare
import demo_clouds
import demo_meshes
import pictures
import render
import render_points
import tables

RENDER_SIZE = (640, 480)
RENDER_SAMPLES = 12
CLOUD_SIZE = (560, 312)
CLOUD_CELLS = 16
CLOUD_SAMPLES = 32


def show_progress(fraction, stage):
    """How far an unwrap is, rewritten in place; only for people."""
    if sys.stdout.isatty():
        print(f"\r    {100 * fraction:3.0f}%  {stage:<24}", end="", flush=True)


def render_both(objects, out, name):
    """Renders both UV maps side by side."""
    comparison = addon_loader.load("comparison")
    halves = []
    for number, map_name in enumerate((comparison.BLE_MAP, comparison.SMART_MAP)):
        part = out / f".{name}_{number}.png"
        render.render_objects(objects, part, map_name, size=RENDER_SIZE, samples=RENDER_SAMPLES)
        halves.append(pictures.with_captions(taken(part), [map_name]))
    pictures.write_png(out / f"{name}_render.png", pictures.side_by_side(halves))


def taken(path):
    """The picture in a file, which is removed."""
    picture = pictures.read_png(path)
    path.unlink()
    return picture


def demonstrate_mesh(objects, name, out, options):
    """Unwraps by both methods and draws both; the comparison's rows."""
    report = addon_loader.load("surface_report")
    faces = sum(len(obj.data.polygons) for obj in objects)
    print(f"{name}: {faces:,} faces; unwrapping by BLE Unwrap and Smart UV Project", flush=True)
    settings = addon_loader.load("asset_io").default_settings(options.mesh) if options.mesh else {}
    rows = compare.compare_objects(objects, name, out, settings, progress=show_progress)
    end_progress()
    print(f"{name}: {report.summary(rows['ble_unwrap'], rows['ble_unwrap']['seconds_total'])}", flush=True)
    print(f"{name}: unwrapping by xatlas, which may take minutes", flush=True)
    rows, reason = compare.with_xatlas(rows, objects, settings)
    if reason:
        print(f"{name}: {reason}", flush=True)
    if options.render:
        print(f"{name}: rendering", flush=True)
        render_both(objects, out, name)
    return rows


def demonstrate_cloud(cloud, name, out, options):
    """Maps a cloud and draws it under a checker, beside its atlas; the report's entry."""
    print(f"{name}: {len(render_points.world_points(cloud)):,} points; mapping by BLE Unwrap", flush=True)
    _, (outcome,) = addon_loader.load("run").run_objects([cloud], {}, progress=show_progress)
    end_progress()
    print(f"{name}: {outcome.summary}", flush=True)
    if options.render:
        print(f"{name}: rendering", flush=True)
        (map_name,) = outcome.maps
        part = out / f".{name}.png"
        render.render_objects([cloud], part, map_name, size=CLOUD_SIZE, samples=CLOUD_SAMPLES, cells=CLOUD_CELLS)
        uv = render_points.map_of(cloud, map_name)
        atlas = pictures.point_layout(uv, render_points.checker_colours(uv, CLOUD_CELLS), CLOUD_SIZE[1])
        found = outcome.certificate.measured
        captions = [f"{found['points']:,} points, no faces"], [f"{found['charts']} charts, stretch {found['l2']:.3f}"]
        halves = [pictures.with_captions(half, text) for half, text in zip((taken(part), atlas), captions, strict=True)]
        pictures.write_png(out / f"{name}_render.png", pictures.side_by_side(halves))
    return {
        **outcome.certificate.measured,
        "seconds_total": outcome.seconds,
        "violations": outcome.certificate.violations,
    }


def end_progress():
    if sys.stdout.isatty():
        print("\r" + 40 * " ", end="\r")


def main(argv):
    import bpy

    batch, asset_io, engine, targets = (addon_loader.load(name) for name in ("batch", "asset_io", "engine", "targets"))
    parser = argparse.ArgumentParser(prog="demo_inside.py")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--mesh")
    parser.add_argument("--render", action=argparse.BooleanOptionalAction, default=True)
    options = parser.parse_args(argv)
    out = Path(options.output)
    out.mkdir(parents=True, exist_ok=True)
    print(f"Blender {bpy.app.version_string}, BLE Unwrap {engine.version()} as {addon_loader.package()}", flush=True)
    makers = {
        "suzanne": demo_meshes.suzanne,
        "spiral_ramp": demo_meshes.spiral_ramp,
        "sculpt": demo_meshes.sculpt,
        "cloud": demo_clouds.add_scan,
    }
    if options.mesh:
        path = Path(options.mesh)
        makers = {path.stem: lambda: None}
    models, clouds, failed = {}, {}, []
    for number, (name, make) in enumerate(makers.items(), 1):
        started = time.perf_counter()
        try:
            if options.mesh:
                objects = asset_io.load(options.mesh)
            else:
                asset_io.new_scene()
                objects = [make()]
            surfaces = [obj for obj in objects if targets.is_surface(obj)]
            points = [obj for obj in objects if targets.is_cloud(obj)]
            if not surfaces and not points:
                raise asset_io.AssetError("holds no faces and no points")
            print(f"[{number}/{len(makers)}] ", end="")
            if surfaces:
                models[name] = demonstrate_mesh(surfaces, name, out, options)
            else:
                clouds[name] = demonstrate_cloud(points[0], name, out, options)
            asset_io.save(out / f"{name}.blend")
            print(f"{name}: done in {time.perf_counter() - started:.1f} s", flush=True)
        except (*batch.USER_ERRORS, RuntimeError, OSError) as error:
            failed.append({"model": name, "error": str(error)})
            print(f"{name}: {error}", file=sys.stderr, flush=True)
    if models:
        print("", *tables.table(models), "", sep="\n")
    ramp = models.get("spiral_ramp")
    if ramp:
        print(
            "Faces of the spiral ramp that Blender's own Select Overlap finds: "
            f"{ramp['ble_unwrap']['blender_overlapping_faces']} by BLE Unwrap, "
            f"{ramp['smart_uv_best']['blender_overlapping_faces']} by Smart UV Project\n"
        )
    report = {
        "blender": bpy.app.version_string,
        "native": engine.version(),
        "models": models,
        "clouds": clouds,
        "failed": failed,
    }
    addon_loader.load("batch.report").write_json(out / "report.json", report)
    for name in [*models, *clouds]:
        files = [f"{name}.blend"] + [f"{name}_layout.png"] * (name in models) + [f"{name}_render.png"] * options.render
        print("  " + "  ".join(str(out / file) for file in files))
    print(f"  {out / 'report.json'}")
    if failed:
        return batch.SOME_FAILED
    broken = {name: rows["ble_unwrap"]["violations"] for name, rows in models.items()}
    broken |= {name: found["violations"] for name, found in clouds.items()}
    for name, violations in broken.items():
        for text in violations:
            print(f"{name}: not as promised: {text}", file=sys.stderr)
    return batch.VIOLATED if any(broken.values()) else batch.OK


if __name__ == "__main__":
    addon_loader.run(main)
