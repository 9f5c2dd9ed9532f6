"""Checking the active UV maps of objects, whoever made them: read, measured, and which faces are at fault."""

from dataclasses import dataclass

import numpy as np

from . import check_report, map_state, measurement, mesh_bridge, textures, units, uv_islands
from .mesh_arrays import MeshError

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
    selection = mesh_bridge.gather(mapped, whole=True, target=None)
    maps = mesh_bridge.active_maps(selection)
    held = [map_state.read_uv(obj, name) for obj, name in zip(mapped, maps, strict=True)]
    # A large mesh is read in object mode, where that takes a fraction of the time.
    uv = mesh_bridge.read_uvs(selection) if any(values is None for values in held) else np.concatenate(held)
    size = settings["texture_size"]
    if settings["correct_aspect"]:
        size, _ = textures.proportioned_size(mapped, maps, size)
    part = np.repeat(np.arange(len(mapped)), [part.faces.stop - part.faces.start for part in selection.parts])
    island = uv_islands.islands(selection.positions, selection.corner_vertices, selection.face_offsets, uv, part)
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
    areas = _face_areas(selection, uv, size)
    measured |= _densities(island, *areas)
    limit = settings["stretch_limit"]
    faults = _faults(measured, island, stack, areas, limit)
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
            density_text=units.density_text,
        ),
        faces={kind: mesh_bridge.by_part(selection, is_meant) for kind, is_meant in faults.items()},
    )


def _face_areas(selection, uv, size):
    """The area of each face on the surface and, without sign, in pixels, two of (f,)."""
    triangles = selection.corner_triangles
    if triangles is None:
        triangles = np.arange(len(uv), dtype=np.int32).reshape(-1, 3)
    a, b, c = selection.positions.astype(np.float64)[selection.corner_vertices[triangles]].transpose(1, 0, 2)
    surface = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    a, b, c = (uv.astype(np.float64) * size)[triangles].transpose(1, 0, 2)
    (ax, ay), (bx, by) = (b - a).T, (c - a).T
    pixels = 0.5 * np.abs(ax * by - ay * bx)
    face = np.repeat(np.arange(selection.face_count), np.diff(selection.face_offsets))[triangles[:, 0]]
    return [np.bincount(face, area, selection.face_count) for area in (surface, pixels)]


def _densities(island, surface, pixels):
    """Pixels for each unit of length: over all, and of the islands that have least and most."""
    count = int(island.max(initial=-1)) + 1
    known = (island >= 0) & np.isfinite(surface) & np.isfinite(pixels)
    sums = [np.bincount(island[known], area[known], count) for area in (surface, pixels)]
    compared = (sums[0] > SPECK * sums[0].sum()) & (sums[0] > 0)
    if not compared.any():
        return {}
    each = np.sqrt(sums[1][compared] / sums[0][compared])
    return {
        "density": float(np.sqrt(sums[1].sum() / sums[0].sum())),
        "densities": (float(each.min()), float(each.max())),
    }


def _faults(measured, island, stack, areas, limit):
    """Kind of fault -> which faces have it, (f,) bool."""
    surface, _ = areas
    chart, stretch = np.asarray(measured["face_chart"]), np.asarray(measured["face_l2"])
    too_much = limit + check_report.STRETCH_SLACK
    of_charts = np.append(np.array(measured["chart_l2"], np.float64), np.nan)  # the last is for faces without UVs
    numbered = {}
    for name in ("overlapping", "flipped"):
        numbered[name] = np.zeros(len(island), bool)
        numbered[name][np.asarray(measured[f"{name}_faces"])] = True
    with np.errstate(invalid="ignore"):
        stretched = (stretch > too_much) & (of_charts[chart] > too_much)
    return {
        "OVERLAPPING": numbered["overlapping"],
        "FLIPPED": numbered["flipped"],
        "STRETCHED": stretched,
        "COLLAPSED": (chart >= 0) & np.isnan(stretch) & (surface > 0),
        "UNMAPPED": chart < 0,
        "STACKED": (island >= 0) & np.append(stack, -1)[island] >= 0 if len(stack) else np.zeros(len(island), bool),
    }
