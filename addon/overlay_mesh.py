"""What is drawn on an object: read from the mesh that Blender shows, which is left as it is.

The mesh is the evaluated one, with modifiers, in edit mode with what is being edited, so that what is drawn lies on
what is seen. Blender hands out a copy of it; nothing is written anywhere.
"""

from dataclasses import dataclass

import numpy as np

from . import overlay_colours, seams, uv_islands
from .mesh_arrays import (
    read_array,
    read_corner_edges,
    read_corner_vertices,
    read_edge_vertices,
    read_face_flags,
    read_face_offsets,
    read_positions,
)
from .triangle_shapes import Shapes

# UVs that are nearer to each other are one place: modifiers compute those of each face by themselves, and round. It is
# a sixteenth of a pixel at 8192. A power of two, so that UVs at pixels lie in the middle of what is rounded to one.
TOLERANCE = 2.0**-17


@dataclass
class Surface:
    """The visible faces of a mesh with a UV map."""

    positions: np.ndarray  # (n, 3) float32, in the space of the object
    corner_vertices: np.ndarray  # (c,) int32
    face_offsets: np.ndarray  # (f + 1,) int32
    corner_triangles: np.ndarray  # (t, 3) int32 corners
    uv: np.ndarray  # (c, 2) float32
    shown: np.ndarray  # (t,) bool, of faces that are not hidden
    cuts: np.ndarray  # (m, 2) int32 vertices, where the map is cut between two visible faces

    @property
    def face_count(self):
        return len(self.face_offsets) - 1


@dataclass
class Picture:
    """What is drawn on one object, ready for the graphics card."""

    positions: np.ndarray  # (c, 3) float32, by corner
    uv: np.ndarray  # (c, 2) float32
    colours: np.ndarray | None  # (c, 4) float32; None for a checker
    triangles: np.ndarray  # (t, 3) uint32 corners
    lines: np.ndarray  # (2 m, 3) float32, the ends of lines one after the other
    worst: tuple  # factors by which lines of all faces are longer and shorter at most; empty unless stretch is shown


def read(obj, map_name, depsgraph):
    """The surface of an object as Blender shows it; None where it has no faces, or modifiers leave no such map."""
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        layer = mesh.uv_layers.get(map_name) if mesh is not None else None
        if layer is None or not mesh.polygons or len(layer.uv) != len(mesh.loops):
            return None
        uv = read_array(layer.uv, "vector", np.float32, 2)
        mesh.calc_loop_triangles()
        triangles = read_array(mesh.loop_triangles, "loops", np.int32, 3)
        offsets = read_face_offsets(mesh)
        visible = np.ones(len(mesh.polygons), bool)
        if obj.mode == "EDIT":  # in other modes Blender shows all faces
            visible = ~read_face_flags(mesh, "hide")
        face_of_corner = np.repeat(np.arange(len(visible)), np.diff(offsets))
        edges = read_edge_vertices(mesh)
        cut = seams.chart_borders(mesh, uv, tolerance=TOLERANCE)
        if not visible.all():
            seen = np.zeros(len(edges), bool)
            seen[read_corner_edges(mesh)[visible[face_of_corner]]] = True
            cut &= seen
        return Surface(
            positions=read_positions(mesh),
            corner_vertices=read_corner_vertices(mesh),
            face_offsets=offsets,
            corner_triangles=triangles,
            uv=uv,
            shown=visible[face_of_corner[triangles[:, 0]]],
            cuts=edges[cut],
        )
    finally:
        evaluated.to_mesh_clear()


def picture(surface, kind, *, matrix, texture_size, first=0):
    """What is drawn on a surface. `kind` is CHECKER, STRETCH, ISLANDS or empty, where there are only lines.

    `matrix` is the object's, (4, 4): stretch is that of the shape in the scene. `first` as in `island_colours`.
    """
    colours, worst = None, ()
    if kind in {"STRETCH", "ISLANDS"}:
        _, island = uv_islands.islands(
            surface.positions,
            surface.corner_vertices,
            surface.face_offsets,
            np.round(surface.uv / np.float32(TOLERANCE)) * np.float32(TOLERANCE),
            np.zeros(surface.face_count, np.int32),
        )
        if kind == "STRETCH":
            colours, worst = _stretch(surface, island, matrix, texture_size)
        else:
            known = overlay_colours.island_colours(int(island.max(initial=-1)) + 1, first)
            colours = np.concatenate([known, overlay_colours.BROKEN[None]])[island]
        colours = np.concatenate([colours, np.ones((len(colours), 1))], axis=1).astype(np.float32)
        colours = np.repeat(colours, np.diff(surface.face_offsets), axis=0)
    return Picture(
        positions=np.ascontiguousarray(surface.positions[surface.corner_vertices]),
        uv=np.nan_to_num(surface.uv, nan=0.0, posinf=0.0, neginf=0.0),
        colours=colours,
        triangles=np.ascontiguousarray(surface.corner_triangles[surface.shown], np.uint32),
        lines=surface.positions[surface.cuts.reshape(-1)],
        worst=worst,
    )


def _stretch(surface, island, matrix, texture_size):
    """The colours of faces, (f, 3), and the factors of the worst ones."""
    in_scene = Surface(**{**vars(surface), "positions": surface.positions @ np.array(matrix, np.float64)[:3, :3].T})
    longer, shorter = overlay_colours.face_stretch(Shapes.of(in_scene, surface.uv, texture_size), island)
    known = np.isfinite(longer) & np.isfinite(shorter)
    worst = tuple(float(factor[known].max(initial=1.0)) for factor in (longer, shorter))
    return overlay_colours.stretch_colours(longer, shorter), worst
