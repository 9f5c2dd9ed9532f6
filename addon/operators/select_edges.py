"""The operator `mesh.ble_unwrap_select_edges`: shows where the edges are that a warning is about."""

import bpy
import numpy as np
from bpy.props import EnumProperty

from .. import last_result
from ..mesh_arrays import crowded_edges, opposed_edges
from .edit_selection import show_elements

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
        which = {"CROWDED": "has more than two faces", "OPPOSED": "lies between opposed faces"}[self.kind]

        def find():
            meshes = [obj for obj in last_result.objects(context) if obj.type == "MESH"]
            return {obj: np.flatnonzero(EDGES[self.kind](obj.data)) for obj in meshes}

        return show_elements(self, context, find, "EDGE", f"No visible edge of these meshes {which}")


def register():
    bpy.utils.register_class(MESH_OT_ble_unwrap_select_edges)


def unregister():
    bpy.utils.unregister_class(MESH_OT_ble_unwrap_select_edges)
