"""The operator `mesh.ble_unwrap_select_edges`: shows where the edges are that a warning is about."""

import bpy
import numpy as np
from bpy.props import EnumProperty

from .. import last_result
from ..mesh_arrays import crowded_edges, opposed_edges, read_edge_flags
from .edit_selection import leave_edit_mode, select_elements

EDGES = {"CROWDED": crowded_edges, "OPPOSED": opposed_edges}


class MESH_OT_ble_unwrap_select_edges(bpy.types.Operator):
    bl_idname = "mesh.ble_unwrap_select_edges"
    bl_label = "Select Irregular Edges"
    bl_description = "In Edit Mode, select the edges of the last result's meshes at which the surface is irregular"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(
        name="Edges",
        items=(
            (
                "CROWDED",
                "More than Two Faces",
                "Edges that more than two faces share; the surface is cut there in part",
            ),
            (
                "OPPOSED",
                "Opposed Faces",
                "Edges of two faces whose normals point to opposite sides: faces that are flipped, or a surface with "
                "one side only, such as a Möbius strip, which is cut there",
            ),
        ),
        default="CROWDED",
    )

    @classmethod
    def poll(cls, context):
        if not last_result.is_true(context):
            cls.poll_message_set("Unwrap a mesh first")
            return False
        return True

    def execute(self, context):
        leave_edit_mode(context)
        visible = [obj for obj in last_result.objects(context) if obj.type == "MESH" and obj.visible_get()]
        found = {obj: shown for obj in visible if (shown := visible_edges(obj.data, EDGES[self.kind])).size}
        if not found:
            which = {"CROWDED": "has more than two faces", "OPPOSED": "lies between opposed faces"}[self.kind]
            self.report({"WARNING"}, f"No visible edge of these meshes {which}")
            return {"CANCELLED"}
        select_elements(context, found, "EDGE")
        count = sum(map(len, found.values()))
        self.report({"INFO"}, f"{count:,} edge{'' if count == 1 else 's'} selected")
        return {"FINISHED"}


def visible_edges(mesh, is_meant):
    """Indices of the edges that are meant and that edit mode would show."""
    return np.flatnonzero(is_meant(mesh) & ~read_edge_flags(mesh, "hide"))


def register():
    bpy.utils.register_class(MESH_OT_ble_unwrap_select_edges)


def unregister():
    bpy.utils.unregister_class(MESH_OT_ble_unwrap_select_edges)
