"""The part of the demonstration that runs in Blender: unwrap, compare, draw, save. Started by demo.py.

Writes OUT/report.json and, for every mesh, NAME.blend (both layouts as UV maps), NAME_layout.png (both layouts
coloured by stretch) and NAME_render.png (the model under a numbered grid, BLE Unwrap left, Smart UV Project right).
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader
import compare
import demo_meshes
import pictures
import render
import tables

RENDER_SIZE = (640, 480)
RENDER_SAMPLES = 12


def show_progress(fraction, stage):
    """How far an unwrap is, rewritten in place; only for people."""
    if sys.stdout.isatty():
        print(f"\r    {100 * fraction:3.0f}%  {stage:<24}", end="", flush=True)


def render_both(objects, out, name):
    """Renders both UV maps side by side."""
    import bpy
    import numpy as np

    comparison = addon_loader.load("comparison")
    halves = []
    for number, map_name in enumerate((comparison.BLE_MAP, comparison.SMART_MAP)):
        part = out / f".{name}_{number}.png"
        render.render_objects(objects, part, map_name, size=RENDER_SIZE, samples=RENDER_SAMPLES)
        image = bpy.data.images.load(str(part))
        image.colorspace_settings.name = "Non-Color"  # the values as they are in the file
        pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(image.size[1], image.size[0], image.channels)[::-1, :, :3]
        halves.append(pictures.with_captions((pixels * 255 + 0.5).astype(np.uint8), [map_name]))
        bpy.data.images.remove(image)
        part.unlink()
    pictures.write_png(out / f"{name}_render.png", pictures.side_by_side(halves))


def main(argv):
    import bpy

    batch, asset_io, engine = (addon_loader.load(name) for name in ("batch", "asset_io", "engine"))
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
    }
    if options.mesh:
        path = Path(options.mesh)
        makers = {path.stem: lambda: None}
    models, failed = {}, []
    for number, (name, make) in enumerate(makers.items(), 1):
        started = time.perf_counter()
        try:
            if options.mesh:
                objects = asset_io.load(options.mesh)
            else:
                asset_io.new_scene()
                objects = [make()]
            objects = [obj for obj in objects if obj.data.polygons]
            faces = sum(len(obj.data.polygons) for obj in objects)
            if not faces:
                raise asset_io.AssetError("holds no faces")
            head = f"[{number}/{len(makers)}] {name}"
            print(f"{head}: {faces:,} faces; unwrapping by BLE Unwrap and Smart UV Project", flush=True)
            rows = compare.compare_objects(objects, name, out, {}, progress=show_progress)
            if sys.stdout.isatty():
                print("\r" + 40 * " ", end="\r")
            models[name] = rows
            print(f"{head}: {engine.summary(rows['ble_unwrap'], rows['ble_unwrap']['seconds_total'])}", flush=True)
            asset_io.save(out / f"{name}.blend")
            if options.render:
                print(f"{head}: rendering", flush=True)
                render_both(objects, out, name)
            print(f"{head}: done in {time.perf_counter() - started:.1f} s", flush=True)
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
        "failed": failed,
    }
    batch.write_json(out / "report.json", report)
    for name in models:
        kinds = ("blend", "layout.png", "render.png") if options.render else ("blend", "layout.png")
        print("  " + "  ".join(f"{out / name}{'.' if kind == 'blend' else '_'}{kind}" for kind in kinds))
    print(f"  {out / 'report.json'}")
    if failed:
        return batch.SOME_FAILED
    broken = {name: rows["ble_unwrap"]["violations"] for name, rows in models.items()}
    for name, violations in broken.items():
        for text in violations:
            print(f"{name}: certificate does not hold: {text}", file=sys.stderr)
    return batch.VIOLATED if any(broken.values()) else batch.OK


if __name__ == "__main__":
    addon_loader.run(main)
