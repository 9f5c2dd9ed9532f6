"""Arrays of one Blender mesh, read in bulk, and edit mode left and entered again: what the bridge is built of."""

from contextlib import contextmanager

import bpy
import numpy as np


class MeshError(Exception):
    """The selection cannot be unwrapped, or not any more; the text is for the user."""


class NothingToUnwrap(MeshError):
    """There is no face, or none is selected."""


def read_array(collection, attribute, dtype, width=1):
    """One attribute of all elements as an array, (n,) or (n, width)."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(attribute, values)
    return values.reshape(-1, width) if width > 1 else values


@contextmanager
def in_bulk(mesh):
    """A mesh whose attributes can be read in bulk, for the length of a `with` block.

    In object mode it is the mesh itself. In edit mode Blender shows attributes and UV maps as empty, but a copy of the
    mesh has them as they were when it was last brought up to date (`update_from_editmode`). It shares the arrays, so
    that it costs next to nothing, and is removed at the end.
    """
    if not mesh.is_editmode:
        yield mesh
        return
    copy = mesh.copy()
    try:
        yield copy
    finally:
        bpy.data.meshes.remove(copy)


def read_positions(mesh):
    return _read(mesh, "position", "vector", np.float32, 3, mesh.vertices, "co")


def read_corner_vertices(mesh):
    return _read(mesh, ".corner_vert", "value", np.int32, 1, mesh.loops, "vertex_index")


def read_corner_edges(mesh):
    return _read(mesh, ".corner_edge", "value", np.int32, 1, mesh.loops, "edge_index")


def read_edge_vertices(mesh):
    return _read(mesh, ".edge_verts", "value", np.int32, 2, mesh.edges, "vertices")


def _read(mesh, name, value, dtype, width, elements, attribute):
    """The attribute `name` of a mesh; where Blender shows none, what its elements say.

    That is the same, and takes a hundred times as long.
    """
    stored = mesh.attributes.get(name)
    if stored is not None and len(stored.data) == len(elements):
        return read_array(stored.data, value, dtype, width)
    return read_array(elements, attribute, dtype, width)


# The attributes that flags are stored as, by the property of an element that tells the same. Blender 4.5 renamed one.
EDGE_FLAGS = {"use_seam": ("uv_seam", ".uv_seam"), "use_edge_sharp": ("sharp_edge",), "hide": (".hide_edge",)}
FACE_FLAGS = {"hide": (".hide_poly",), "select": (".select_poly",)}


def read_edge_flags(mesh, name):
    """Which edges have this of `EDGE_FLAGS` set, (e,) bool."""
    return _read_flags(mesh, EDGE_FLAGS[name], mesh.edges, name)


def read_face_flags(mesh, name):
    """Which faces have this of `FACE_FLAGS` set, (f,) bool."""
    return _read_flags(mesh, FACE_FLAGS[name], mesh.polygons, name)


def _read_flags(mesh, names, elements, flag):
    if mesh.is_editmode:
        return read_array(elements, flag, bool)
    stored = [attribute for name in names if (attribute := mesh.attributes.get(name)) is not None]
    # Where no element has the flag, Blender as a rule stores no attribute.
    return read_array(stored[0].data, "value", bool) if stored else np.zeros(len(elements), bool)


def read_face_offsets(mesh):
    starts = read_array(mesh.polygons, "loop_start", np.int32)
    return np.append(starts, np.int32(len(mesh.loops)))


def renumber(indices, chosen):
    """Indices into the elements that remain when only the chosen ones are kept."""
    return (np.cumsum(chosen, dtype=np.int32) - 1)[indices].reshape(indices.shape)


def crowded_edges(mesh):
    """Edges that more than two faces share, (e,) bool."""
    return np.bincount(read_corner_edges(mesh), minlength=len(mesh.edges)) > 2


def opposed_edges(mesh):
    """Edges of two faces whose normals point to opposite sides: both run along the edge the same way, (e,) bool."""
    corner_edges = read_corner_edges(mesh)
    first = read_edge_vertices(mesh)[:, 0]
    forward = read_corner_vertices(mesh) == first[corner_edges]
    count = np.bincount(corner_edges, minlength=len(mesh.edges))
    forwards = np.bincount(corner_edges[forward], minlength=len(mesh.edges))
    return (count == 2) & (forwards != 1)


@contextmanager
def object_mode(meshes):
    """Leaves edit mode for a while if any of the meshes is in it: UV maps are empty arrays there."""
    if not any(mesh.is_editmode for mesh in meshes):
        yield
        return
    view_layer = bpy.context.view_layer
    editing = [obj for obj in view_layer.objects if obj.type == "MESH" and obj.mode == "EDIT"]
    selected = {obj: obj.select_get() for obj in editing}
    active = view_layer.objects.active
    if not editing:
        raise MeshError("The mesh is in edit mode in another scene or view layer; leave it there first")
    if active not in editing:
        view_layer.objects.active = editing[0]
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        for obj in editing:
            obj.select_set(True)  # edit mode takes every selected object of the active one's type
        others = [obj for obj in view_layer.objects if obj.type == "MESH" and obj.select_get() and obj not in editing]
        for obj in others:
            obj.select_set(False)
        bpy.ops.object.mode_set(mode="EDIT")
        for obj in others:
            obj.select_set(True)
        for obj, state in selected.items():
            obj.select_set(state)
        view_layer.objects.active = active
