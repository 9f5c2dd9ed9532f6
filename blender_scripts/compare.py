"""BLE Unwrap against Smart UV Project, and xatlas where it is installed, on your own meshes, at the same margin.

blender -b -P blender_scripts/compare.py -- IN... -o OUTDIR [--margin 4] [--texture-size 2048] [settings]
python blender_scripts/compare.py IN... -o OUTDIR [settings]

Writes OUTDIR/compare.json, a picture of the first two layouts a model, coloured by stretch, and a .blend with their UV
maps (`--no-blend` leaves it out). The pictures need Pillow; where there is none, a sentence says how to install it, and
all else is written. xatlas knows triangles only and may cut between two of one polygon, so its layout is
measured on the triangles and is no UV map. Exit codes as for unwrap.py.
"""

import argparse
import sys
from pathlib import Path
from types import SimpleNamespace

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader
import numpy as np
import tables
import xatlas_peer

try:
    import pictures
except ImportError as error:
    pictures, no_pictures = None, str(error)
else:
    no_pictures = None


def compare_objects(objects, name, out, settings, *, threads=0, picture_size=900, progress=None):
    """Compares on objects of the current scene and draws the picture, if it can; the rows of the table."""
    rows = addon_loader.load("comparison").compare(objects, settings, threads=threads, progress=progress)
    out.mkdir(parents=True, exist_ok=True)
    if pictures:
        draw_layouts(objects, rows, out / f"{name}_layout.png", picture_size)
    return rows


def draw_layouts(objects, rows, path, size):
    """Draws the layouts by BLE Unwrap and Smart UV Project beside each other, over a legend."""
    comparison, bridge = addon_loader.load("comparison"), addon_loader.load("mesh_bridge")
    panels = []
    for key, map_name in (("ble_unwrap", comparison.BLE_MAP), ("smart_uv_best", comparison.SMART_MAP)):
        comparison.activate_map(bridge.unique_meshes(objects), map_name)
        selection = bridge.gather(bridge.unique_meshes(objects))
        picture = pictures.layout(selection, bridge.read_uvs(selection), size)
        panels.append(pictures.with_captions(picture, tables.caption(key, rows[key])))
    comparison.activate_map(bridge.unique_meshes(objects), comparison.BLE_MAP)
    picture = pictures.side_by_side(panels)
    pictures.write_png(path, pictures.stacked([picture, pictures.legend(picture.shape[1])]))


def xatlas_row(objects, settings):
    """The measurement of a layout by xatlas of the same objects. Raises `xatlas_peer.Unavailable`."""
    measurement, bridge = addon_loader.load("measurement"), addon_loader.load("mesh_bridge")
    properties = addon_loader.load("properties")
    full = {**properties.default_values(settings.get("preset", "DEFAULT")), **settings}
    selection = bridge.gather(bridge.unique_meshes(objects))
    corners = selection.corner_vertices
    if selection.corner_triangles is not None:
        corners = corners[selection.corner_triangles]
    triangles = SimpleNamespace(
        positions=selection.positions,
        corner_vertices=np.ascontiguousarray(corners.reshape(-1)),
        face_offsets=np.arange(0, corners.size + 1, 3, dtype=np.int32),
        corner_triangles=None,
    )
    peer = xatlas_peer.unwrap(
        triangles.positions,
        triangles.corner_vertices,
        margin=full["margin"],
        texture_size=full["texture_size"],
    )
    # Its texture has a size of its own, by which its UVs are divided: stretch and margin are in the texels of that.
    measured = measurement.measure(triangles, peer.uv, texture_size=peer.texture_size, margin=full["margin"])
    return {**measured, "seconds_total": peer.seconds, "texture_size": peer.texture_size}


def with_xatlas(rows, objects, settings):
    """The rows and one by xatlas after them, and None; or the same rows and why there is none."""
    try:
        return {**rows, "xatlas": xatlas_row(objects, settings)}, None
    except xatlas_peer.Unavailable as error:
        return rows, f"no row by xatlas: {error}"


def main(argv):
    batch, asset_io = addon_loader.load("batch"), addon_loader.load("asset_io")
    engine, bridge = addon_loader.load("engine"), addon_loader.load("mesh_bridge")
    targets, arguments = addon_loader.load("targets"), addon_loader.load("batch.arguments")
    parser = argparse.ArgumentParser(
        prog="compare.py",
        description="Unwrap meshes by BLE Unwrap, Smart UV Project and, where installed, xatlas, and compare.",
    )
    parser.add_argument("inputs", nargs="+", metavar="IN", help="files of meshes")
    parser.add_argument("-o", "--output", required=True, metavar="OUTDIR", help="directory for the results")
    parser.add_argument(
        "--picture-size", type=int, default=900, help="pixels along a side of one layout (default: 900)"
    )
    parser.add_argument(
        "--blend",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="also write the UV maps as a .blend (default: yes)",
    )
    parser.add_argument("--threads", type=int, default=0, help="processor threads, 0 for all (default: 0)")
    arguments.add_setting_arguments(parser)
    options = parser.parse_args(argv)
    settings = arguments.settings_of(options, parser)
    if not 64 <= options.picture_size <= 8192:
        parser.error("--picture-size must be between 64 and 8192")
    out = Path(options.output)
    try:
        engine.native()
        out.mkdir(parents=True, exist_ok=True)
    except engine.EngineMissing as error:
        print(f"compare.py: {error}", file=sys.stderr)
        return batch.ENVIRONMENT
    except OSError as error:
        print(f"compare.py: cannot write to {out}: {error.strerror}", file=sys.stderr)
        return batch.SOME_FAILED
    if no_pictures:
        print(f"no pictures: {no_pictures}", flush=True)
    models, failed, left_out = {}, {}, {}
    for number, name in enumerate(options.inputs, 1):
        print(f"[{number}/{len(options.inputs)}] {name}", flush=True)
        source = Path(name)
        key = source.stem if source.stem not in models else f"{source.stem}_{number}"
        try:
            objects = [obj for obj in asset_io.load(source) if targets.is_surface(obj)]
            if not objects:
                raise bridge.MeshError("holds no faces")
            given = {**asset_io.default_settings(source), **settings}
            models[key] = compare_objects(
                objects, key, out, given, threads=options.threads, picture_size=options.picture_size
            )
            models[key], reason = with_xatlas(models[key], objects, given)
            if reason:
                left_out[key] = reason
                print(f"{name}: {reason}", flush=True)
            if options.blend:
                asset_io.save(out / f"{key}.blend")
        except (*batch.USER_ERRORS, OSError) as error:
            failed[name] = str(error)
            print(f"{name}: {error}", file=sys.stderr, flush=True)
    if models:
        print("", *tables.table(models), "", sep="\n")
    report = {"params": settings, "models": models, "left_out": left_out, "failed": failed}
    addon_loader.load("batch.report").write_json(out / "compare.json", report)
    print(f"written to {out}/")
    if failed:
        return batch.SOME_FAILED
    return batch.VIOLATED if any(rows["ble_unwrap"]["violations"] for rows in models.values()) else batch.OK


if __name__ == "__main__":
    addon_loader.run(main)
