"""Checking the active UV maps of objects, whoever made them: read, measured, and which faces are at fault."""

from dataclasses import dataclass

import numpy as np

from . import check_report, measurement, mesh_bridge, textures, triangle_shapes, units, uv_islands, uv_maps
from .island_choice import part_of_face
from .mesh_arrays import MeshError
from .triangle_shapes import Shapes

ALL_TILES = 100  # as many as the native module knows: maps of others may use any
# Islands with less than this share of the surface are left out where densities are compared.
SPECK = 1e-4


@dataclass
class Check:
    """What was found in the active UV maps of objects."""

    objects: list
    maps: list  # name of the map of each object
    title: str
    lines: list  # of `check_report.Line`
    faces: dict  # kind of fault -> numbers of the faces that have it, of each object


def check(objects, settings, *, threads=0):
    """Measures the active UV maps of mesh objects, all faces of them; nothing is changed.

    `settings` are `texture_size`, `correct_aspect`, `margin` and `stretch_limit`. Raises `MeshError`,
    `engine.EngineMissing`, `engine.EngineError`.
    """
    for obj in objects:
        if obj.mode == "EDIT":
            obj.update_from_editmode()
    mapped = [obj for obj in objects if obj.type == "MESH" and obj.data.polygons and obj.data.uv_layers.active]
    if not mapped:
        raise MeshError("There is no UV map to check")
    selection = mesh_bridge.gather(mapped, whole=True, marks=False, target=None)
    maps = mesh_bridge.active_maps(selection)
    # Edit mode is not left for it: a check is no step of Blender's undo.
    uv = np.concatenate([uv_maps.read_map(obj.data, name) for obj, name in zip(mapped, maps, strict=True)])
    size = settings["texture_size"]
    if settings["correct_aspect"]:
        size, _ = textures.proportioned_size(mapped, maps, size)
    _, island = uv_islands.islands(
        selection.positions, selection.corner_vertices, selection.face_offsets, uv, part_of_face(selection)
    )
    stack = uv_islands.stacks(island, selection.face_offsets, uv)
    measured = measurement.measure(
        selection,
        uv,
        texture_size=size,
        margin=settings["margin"],
        tiles=ALL_TILES,
        threads=threads,
        stacks=(island, stack) if (stack >= 0).any() else None,
        by_face=True,
    )
    measured |= {"stacked": int((stack >= 0).sum()), "stacks": int(stack.max(initial=-1)) + 1}
    shapes = Shapes.of(selection, uv, size)
    measured |= _densities(island, shapes)
    limit = settings["stretch_limit"]
    mirrored = triangle_shapes.mirrored(island, shapes)
    measured["mirrored"] = int(mirrored.sum())
    faults = _faults(measured, island, stack, shapes, limit)
    faults["MIRRORED"] = (island >= 0) & np.append(mirrored, False)[island]
    return Check(
        objects=mapped,
        maps=maps,
        title=f"{selection.title}: {maps[0]}" if len(set(maps)) == 1 else selection.title,
        lines=check_report.lines(
            measured,
            {kind: int(is_meant.sum()) for kind, is_meant in faults.items()},
            margin=settings["margin"],
            stretch_limit=limit,
            length_text=units.length_text,
            density_of=units.density,
        ),
        faces={kind: mesh_bridge.by_part(selection, is_meant) for kind, is_meant in faults.items()},
    )


def _densities(island, shapes):
    """Pixels for each unit of length: over all, and of the islands that have least and most."""
    count = int(island.max(initial=-1)) + 1
    of = island[shapes.face]
    known = (of >= 0) & np.isfinite(shapes.surface) & np.isfinite(shapes.pixels)
    sums = [np.bincount(of[known], area[known], count) for area in (shapes.surface, np.abs(shapes.pixels))]
    compared = (sums[0] > SPECK * sums[0].sum()) & (sums[0] > 0)
    if not compared.any():
        return {}
    each = np.sqrt(sums[1][compared] / sums[0][compared])
    return {
        "density": float(np.sqrt(sums[1].sum() / sums[0].sum())),
        "densities": (float(each.min()), float(each.max())),
    }


def _faults(measured, island, stack, shapes, limit):
    """Kind of fault -> which faces have it, (f,) bool."""

    def numbered(name):
        found = np.zeros(len(island), bool)
        found[np.asarray(measured[name])] = True
        return found

    return {
        "OVERLAPPING": numbered("overlapping_faces"),
        "FLIPPED": numbered("flipped_faces"),
        "COLLAPSED": numbered("collapsed_faces"),
        "STRETCHED": _stretched(measured, shapes, limit),
        "UNMAPPED": np.asarray(measured["face_chart"]) < 0,
        "STACKED": (island >= 0) & (np.append(stack, np.int32(-1))[island] >= 0),
    }


def _stretched(measured, shapes, limit):
    """Which faces are drawn out or pressed together most, in islands that are beyond the limit as a whole, (f,) bool.

    What counts is the line of a face that is longest on the surface, or shortest, against the lines of half the island:
    an island that is drawn out at one place is not at fault everywhere else. Where no line is beyond the limit, lines
    beyond its root count, of which there are some in each island whose mean is beyond it.
    """
    chart = np.asarray(measured["face_chart"])
    too_much = limit + check_report.STRETCH_SLACK
    beyond = np.array(measured["chart_l2"], np.float64)
    beyond = np.append(np.nan_to_num(beyond, nan=0.0) > too_much, False)  # the last is for faces without UVs
    asked = np.flatnonzero(beyond[chart[shapes.face]] & np.isfinite(shapes.longest) & np.isfinite(shapes.shortest))
    of = chart[shapes.face[asked]]
    usual = triangle_shapes.medians(
        np.sqrt(shapes.longest[asked] * shapes.shortest[asked]), shapes.surface[asked], of, len(beyond)
    )
    off = np.maximum(shapes.longest[asked] / usual[of], usual[of] / shapes.shortest[asked])
    worst = np.zeros(len(beyond))
    np.maximum.at(worst, of, off)
    least = np.where(worst > limit, limit, np.sqrt(limit))
    found = np.zeros(len(chart), bool)
    found[shapes.face[asked[off > least[of]]]] = True
    return found
