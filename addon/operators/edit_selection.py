"""Showing parts of meshes by selecting them in edit mode."""

import bmesh
import bpy
import numpy as np

from ..mesh_arrays import read_edge_flags, read_face_flags
from ..wording import counted


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


def show_elements(operator, context, find, kind, nothing):
    """What an operator does that shows where edges or faces are, from leaving edit mode to what it returns.

    `find` is called in object mode and returns objects, each with the numbers of its elements; what is hidden is left
    out. `kind` is EDGE or FACE; `nothing` is said where nothing remains.
    """
    leave_edit_mode(context)
    found = {
        obj: shown
        for obj, numbers in find().items()
        if obj.visible_get() and (shown := visible_elements(obj.data, numbers, kind)).size
    }
    if not found:
        operator.report({"WARNING"}, nothing)
        return {"CANCELLED"}
    select_elements(context, found, kind)
    operator.report({"INFO"}, f"{counted(sum(map(len, found.values())), kind.lower())} selected")
    return {"FINISHED"}


def visible_elements(mesh, numbers, kind):
    """Those of the edges or faces, by number, that are there and that edit mode would show."""
    hidden = read_edge_flags(mesh, "hide") if kind == "EDGE" else read_face_flags(mesh, "hide")
    numbers = np.array(numbers, np.int64)
    numbers = numbers[numbers < len(hidden)]
    return numbers[~hidden[numbers]]
