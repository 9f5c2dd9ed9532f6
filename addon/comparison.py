"""Smart UV Project on the same objects, and Blender's own overlap check: the other side of a comparison."""

import math
import time

import bpy

from . import measurement, mesh_bridge, properties, surface_report, textures
from .certificate import STRETCH_SLACK
from .faces import uv_selected_faces
from .task import unwrap_objects

BLE_MAP = "BLE Unwrap"
SMART_MAP = "Smart UV Project"

# Angle limits in degrees among which Smart UV Project may pick its best; 66 is its own default.
DEFAULT_ANGLE = 66
ANGLES = (30, 45, 66, 80)

# Settings under which ours does what Smart UV Project does: it fills one texture with all faces, and lays nothing on
# anything.
ALIKE = {
    "use_selection": False,
    "use_original_bounds": False,
    "stack": "OFF",
    "tiles": 1,
    "texel_density": 0.0,
}


def smart_uv(objects, *, margin, texture_size, angle=DEFAULT_ANGLE, map_name=SMART_MAP):
    """Unwraps with Smart UV Project into a UV map of that name at a margin in pixels; returns the seconds it took.

    Every property is passed, since their defaults differ between versions of Blender.
    """
    objects = mesh_bridge.unique_meshes(objects)
    activate_map(objects, map_name)
    with _everything_selected(objects):
        started = time.perf_counter()
        bpy.ops.uv.smart_project(
            angle_limit=math.radians(angle),
            margin_method="FRACTION",
            rotate_method="AXIS_ALIGNED",
            island_margin=margin / 2 / min(texture_size),  # Blender keeps it around every chart, so twice between two
            area_weight=0.0,
            correct_aspect=True,
            scale_to_bounds=False,
        )
        return time.perf_counter() - started


def measure_active(objects, *, margin, texture_size):
    """Measures the active UV maps of objects with our own yardstick."""
    selection = mesh_bridge.gather(mesh_bridge.unique_meshes(objects))
    held = mesh_bridge.read_uvs(selection)
    if held is None:
        raise mesh_bridge.MeshError("An object has no UV map to measure")
    return measurement.measure(selection, held, texture_size=texture_size, margin=margin)


def best_smart_uv(objects, *, margin, texture_size, angles=ANGLES, map_name=SMART_MAP, rank=None):
    """Smart UV Project at its best angle: fewest overlaps and flips, then least stretch, or least by `rank`.

    Returns {angle: measurement with "seconds_total"} and the best angle; its UVs are left in the map.
    """
    results = {}
    for angle in angles:
        seconds = smart_uv(objects, margin=margin, texture_size=texture_size, angle=angle, map_name=map_name)
        results[angle] = measure_active(objects, margin=margin, texture_size=texture_size)
        results[angle]["seconds_total"] = seconds
    best = min(results, key=lambda angle: (rank or _rank)(results[angle]))
    if best != angles[-1]:
        smart_uv(objects, margin=margin, texture_size=texture_size, angle=best, map_name=map_name)
    return results, best


def compare(objects, settings, *, angles=ANGLES, threads=0, progress=None):
    """BLE Unwrap and Smart UV Project on the same objects, at the same margin, by the same yardstick.

    Returns {"ble_unwrap": …, "smart_uv_default": …, "smart_uv_best": …}, each the measurement with "seconds_total" and
    Blender's own count of overlapping faces; both layouts stay in UV maps named `BLE_MAP` and `SMART_MAP`.
    """
    settings = {
        **properties.default_values(settings.get("preset", "DEFAULT")),
        **settings,
        **ALIKE,
        "uv_map": "ACTIVE",
    }
    objects = mesh_bridge.unique_meshes(objects)
    if settings["correct_aspect"]:
        # By the images of the maps that are there: the new ones, which both layouts come into, have none.
        maps = [layer.name if (layer := obj.data.uv_layers.active) else None for obj in objects]
        settings["texture_size"], _ = textures.proportioned_size(objects, maps, settings["texture_size"])
    target = {"texture_size": settings["texture_size"]}
    activate_map(objects, BLE_MAP)
    outcome = unwrap_objects(objects, settings, threads=threads, progress=progress)
    rows = {"ble_unwrap": {**outcome.certificate.measured, "seconds_total": outcome.seconds}}
    rows["ble_unwrap"]["violations"] = outcome.certificate.violations
    rows["ble_unwrap"]["seconds"] = outcome.report.get("seconds")
    rows["ble_unwrap"]["blender_overlapping_faces"] = overlapping_faces(objects)
    target["margin"] = outcome.report["margin_texels"]  # mip levels may have raised it
    by_angle, best = best_smart_uv(objects, angles=angles, map_name=SMART_MAP, **target)
    for measured in by_angle.values():
        measured["violations"] = surface_report.certify(
            measured, margin=target["margin"], stretch_limit=settings["stretch_limit"]
        ).violations
    by_angle[best]["blender_overlapping_faces"] = overlapping_faces(objects)
    rows["smart_uv_best"] = {**by_angle[best], "angle": best}
    if DEFAULT_ANGLE in by_angle:
        rows["smart_uv_default"] = {**by_angle[DEFAULT_ANGLE], "angle": DEFAULT_ANGLE}
    return rows


def activate_map(objects, name):
    """Makes the UV map of this name the active one of every object, adding it where it is missing."""
    for obj in objects:
        layer = obj.data.uv_layers.get(name) or obj.data.uv_layers.new(name=name)
        if layer is None:
            raise mesh_bridge.MeshError(f"{obj.name}: Blender could not add a UV map")
        obj.data.uv_layers.active = layer


def _rank(measured):
    return _faults(measured), _finite(measured.get("l2"))


def short_seams(stretch_limit):
    """A rank after what ours aims at: fewest overlaps and flips, no island beyond the limit, then shortest seams."""

    def rank(measured):
        worst = _finite(measured.get("l2_worst_chart"))
        beyond = worst if worst > stretch_limit + STRETCH_SLACK else 0.0
        return _faults(measured), beyond, _finite(measured.get("seam_length_absolute"))

    return rank


def _faults(measured):
    return int(measured.get("overlaps") or 0) + int(measured.get("flips") or 0)


def _finite(value):
    return value if value is not None and math.isfinite(value) else math.inf


def overlapping_faces(objects):
    """Number of faces that Blender's own `uv.select_overlap` finds in the active UV maps."""
    tools = bpy.context.scene.tool_settings
    objects = mesh_bridge.unique_meshes(objects)
    before = tools.use_uv_select_sync
    with _everything_selected(objects):
        tools.use_uv_select_sync = False
        try:
            bpy.ops.uv.select_all(action="DESELECT")
            bpy.ops.uv.select_overlap(extend=False)
            for obj in objects:
                obj.update_from_editmode()
            return sum(int(uv_selected_faces(obj.data).sum()) for obj in objects)
        finally:
            tools.use_uv_select_sync = before


class _everything_selected:
    """Edit mode of the given objects with all faces selected, and back to object mode."""

    def __init__(self, objects):
        self.objects = [obj for obj in objects if obj.data.polygons]

    def __enter__(self):
        if not self.objects:
            raise mesh_bridge.MeshError("There are no faces to unwrap")
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        for obj in bpy.context.view_layer.objects:
            obj.select_set(False)
        for obj in self.objects:
            obj.hide_set(False)
            obj.select_set(True)
        bpy.context.view_layer.objects.active = self.objects[0]
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.reveal(select=False)
        bpy.ops.mesh.select_all(action="SELECT")

    def __exit__(self, *_error):
        bpy.ops.object.mode_set(mode="OBJECT")
