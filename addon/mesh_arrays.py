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


def read_positions(mesh):
    attribute = mesh.attributes.get("position")
    if attribute is not None and len(attribute.data) == len(mesh.vertices):
        return read_array(attribute.data, "vector", np.float32, 3)
    return read_array(mesh.vertices, "co", np.float32, 3)


def read_corner_vertices(mesh):
    attribute = mesh.attributes.get(".corner_vert")  # ten times as fast as asking the loops
    if attribute is not None and len(attribute.data) == len(mesh.loops):
        return read_array(attribute.data, "value", np.int32)
    return read_array(mesh.loops, "vertex_index", np.int32)


def read_face_offsets(mesh):
    starts = read_array(mesh.polygons, "loop_start", np.int32)
    return np.append(starts, np.int32(len(mesh.loops)))


def renumber(indices, chosen):
    """Indices into the elements that remain when only the chosen ones are kept."""
    return (np.cumsum(chosen, dtype=np.int32) - 1)[indices].reshape(indices.shape)


def crowded_edges(mesh):
    """Edges that more than two faces share, (e,) bool."""
    corner_edges = read_array(mesh.loops, "edge_index", np.int32)
    return np.bincount(corner_edges, minlength=len(mesh.edges)) > 2


def opposed_edges(mesh):
    """Edges of two faces whose normals point to opposite sides: both run along the edge the same way, (e,) bool."""
    corner_edges = read_array(mesh.loops, "edge_index", np.int32)
    first = read_array(mesh.edges, "vertices", np.int32, 2)[:, 0]
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
