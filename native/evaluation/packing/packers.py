"""Packers to compare: each takes islands and returns where their points go, in any unit and anywhere in the plane.

What is packed is then moved and scaled so that it fills the square (`layout_check.scaled_to_square`), which changes the
distances between islands with it. So a packer is asked for a distance that it is expected to have afterwards, and again
for a slightly different one where that was not so.
"""

import functools
import time
from dataclasses import dataclass

import layout_check
import numpy as np
from layout_check import MARGIN, SIZE

ATTEMPTS = 4  # of a packer whose height has to be found
BLENDER_ATTEMPTS = 2  # to hit the distance: one takes up to a minute


@dataclass
class Packed:
    """The best valid result of a packer: share of the square covered, and what it took."""

    cover: float
    gap: float
    cpu: float
    wall: float


def judged(islands, placed):
    """(cover, gap) of positions once they fill the square; shapes that were changed count with the areas they have."""
    placed, _ = layout_check.scaled_to_square(placed)
    scale, _ = layout_check.rigid_scale(islands, placed)
    return layout_check.cover(islands, scale), layout_check.least_gap(islands, placed)


def run(packer, islands):
    """The best of the layouts a packer yields that keeps the margin; the time is that of all of them, for each its own.

    None where none does.
    """
    best = None
    layouts = packer(islands)
    gap = None
    while True:
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            placed = layouts.send(gap)
        except StopIteration:
            return best
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        share, gap = judged(islands, placed)
        if gap >= MARGIN - layout_check.TOLERANCE and (best is None or share > best.cover):
            best = Packed(share, gap, cpu, wall)


def _arrays(islands):
    points = np.concatenate([island.points for island in islands])
    first = np.cumsum([0, *(len(island.points) for island in islands)])
    triangles = np.concatenate([island.triangles + at for island, at in zip(islands, first, strict=False)])
    chart = np.repeat(np.arange(len(islands)), [len(island.triangles) for island in islands])
    return points, triangles, chart, first


def ours(quality, rotation, threads=1):
    import ble_unwrap_native

    def packer(islands):
        points, triangles, chart, first = _arrays(islands)
        # In a frame of about the square's size: single precision then does not matter.
        low = points.min(axis=0)
        points = ((points - low) / np.ptp(points, axis=0).max()).astype(np.float32)
        packed = ble_unwrap_native.pack(
            points, triangles.astype(np.int32), chart.astype(np.int32),
            quality=quality, rotation=rotation, margin=MARGIN, texture_size=SIZE, threads=threads,
        )  # fmt: skip
        yield np.split(np.asarray(packed.uv, np.float64), first[1:-1])

    return packer


def of_xatlas(brute_force):
    """Xatlas's own packer. It aims at a size and misses it; a distance is whole texels of what it ends with."""
    import xatlas

    def packer(islands):
        points, triangles, chart, first = _arrays(islands)
        points = points / np.ptp(points, axis=0).max()
        for resolution in (SIZE, int(0.97 * SIZE), int(0.94 * SIZE), int(0.88 * SIZE)):
            atlas = xatlas.Atlas()
            # A material an island, so that islands stay apart.
            atlas.add_uv_mesh(points.astype(np.float32), triangles.astype(np.uint32), chart.astype(np.uint32)[:, None])
            options = xatlas.PackOptions()
            options.resolution, options.padding, options.bruteForce = resolution, int(MARGIN), brute_force
            options.create_image = False
            atlas.generate(xatlas.ChartOptions(), options)
            if atlas.atlas_count != 1:
                continue
            source, _, uv = atlas.get_mesh(0)
            placed = np.full((len(points), 2), np.nan)
            placed[source] = uv * [atlas.width, atlas.height]
            if np.isnan(placed).any():
                placed[np.isnan(placed)] = 0
            yield np.split(placed, first[1:-1])

    return packer


def sparrow(seconds):
    """Sparrow through spyrrow, any angle. It packs strips: the height is searched at which the strip is a square."""
    import spyrrow

    def packer(islands):
        area = sum(island.area for island in islands)
        each = max(1, round(seconds / ATTEMPTS))
        side = np.sqrt(area / 0.65)
        for _ in range(ATTEMPTS):
            gap = MARGIN * side / SIZE
            rings = [island.points[island.loops[0]] for island in islands]
            items = [spyrrow.Item(str(k), [tuple(p) for p in ring], 1, None) for k, ring in enumerate(rings)]
            height = side - gap
            instance = spyrrow.StripPackingInstance("set", height, items)
            config = spyrrow.StripPackingConfig(
                early_termination=True, total_computation_time=each, num_workers=1, seed=1,
                min_items_separation=gap * 1.001,
            )  # fmt: skip
            try:
                found = instance.solve(config)
            except BaseException as error:  # an island does not fit the strip, of which spyrrow makes a Rust panic
                if type(error).__name__ != "PanicException":
                    raise
                side *= 1.2
                continue
            placed = [None] * len(islands)
            for item in found.placed_items:
                number, angle = int(item.id), np.radians(item.rotation)
                turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
                placed[number] = islands[number].points @ turn.T + item.translation
            yield placed
            side = np.sqrt(height * found.width) + gap

    return packer


def blender(method):
    """Blender's `pack_islands`, any angle, at the margin that leaves the distance asked for in the end."""
    import bpy

    def packer(islands):
        points, triangles, _, first = _arrays(islands)
        points = points / np.ptp(points, axis=0).max()
        margin = MARGIN / SIZE
        for _ in range(BLENDER_ATTEMPTS):
            mesh = bpy.data.meshes.new("islands")
            mesh.from_pydata(np.column_stack([points, np.zeros(len(points))]), [], triangles.tolist())
            layer = mesh.uv_layers.new(name="UVMap")
            layer.data.foreach_set("uv", points[triangles.reshape(-1)].astype(np.float32).reshape(-1))
            thing = bpy.data.objects.new("islands", mesh)
            bpy.context.collection.objects.link(thing)
            bpy.context.view_layer.objects.active = thing
            thing.select_set(True)
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.select_all(action="SELECT")
            bpy.ops.uv.pack_islands(
                rotate=True,
                rotate_method="ANY",
                scale=True,
                margin_method="FRACTION",
                margin=margin,
                shape_method=method,
            )
            bpy.ops.object.mode_set(mode="OBJECT")
            uv = np.empty(2 * len(mesh.loops), np.float32)
            mesh.uv_layers[0].data.foreach_get("uv", uv)
            placed = np.empty_like(points)
            placed[triangles.reshape(-1)] = uv.reshape(-1, 2)
            bpy.data.objects.remove(thing)
            bpy.data.meshes.remove(mesh)
            gap = yield np.split(placed, first[1:-1])
            if not np.isfinite(gap) or MARGIN <= gap < 1.03 * MARGIN:
                return
            margin *= 1.005 * MARGIN / max(gap, 0.25 * MARGIN)

    return packer


def available(names, seconds):
    """{name: packer} of those that are asked for and can be imported; says which cannot."""
    own = [(quality, rotation) for quality in ("fast", "normal", "high") for rotation in ("any", "quarter")]
    makers = {
        **{f"ours {quality} {rotation}": functools.partial(ours, quality, rotation) for quality, rotation in own},
        "xatlas": lambda: of_xatlas(False),
        "xatlas brute": lambda: of_xatlas(True),
        "sparrow": lambda: sparrow(seconds),
        **{f"blender {m}": lambda m=m: blender(m.upper()) for m in ("aabb", "convex", "concave")},
    }
    found = {}
    for name, make in makers.items():
        if names and not any(name.startswith(asked) for asked in names):
            continue
        try:
            found[name] = make()
        except ImportError as error:
            print(f"{name}: left out, {error}", flush=True)
    return found
