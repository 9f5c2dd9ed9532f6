"""Showing parts of meshes by selecting them in edit mode."""

import bmesh
import bpy
import numpy as np

from ..mesh_arrays import read_face_flags


def leave_edit_mode(context):
    """Puts Blender into object mode, in which meshes can be read."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def select_elements(context, found, kind):
    """Enters edit mode with some elements selected and nothing else; from object mode.

    `found` are objects, each with the numbers of its elements; `kind` is EDGE or FACE.
    """
    for obj in context.view_layer.objects:
        obj.select_set(obj in found)
    context.view_layer.objects.active = next(iter(found))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_mode(type=kind)
    bpy.ops.mesh.select_all(action="DESELECT")
    for obj, numbers in found.items():
        edit_mesh = bmesh.from_edit_mesh(obj.data)
        elements = edit_mesh.edges if kind == "EDGE" else edit_mesh.faces
        elements.ensure_lookup_table()
        for number in numbers:
            elements[number].select_set(True)
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)


def visible_faces(mesh, faces):
    """Those of the faces, by number, that are there and that edit mode would show."""
    hidden = read_face_flags(mesh, "hide")
    faces = np.array(faces, np.int64)
    faces = faces[faces < len(hidden)]
    return faces[~hidden[faces]]
