"""The operator `mesh.ble_unwrap_select_narrow`: shows where the charts are that are too narrow for the texture."""

import bpy

from .. import last_result
from .edit_selection import show_elements


class MESH_OT_ble_unwrap_select_narrow(bpy.types.Operator):
    bl_idname = "mesh.ble_unwrap_select_narrow"
    bl_label = "Select Narrow Charts"
    bl_description = "In Edit Mode, select the faces of the last result's charts that are narrower than two texels"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not last_result.is_true(context):
            cls.poll_message_set("Unwrap a mesh first")
            return False
        return True

    def execute(self, context):
        nothing = "No visible face of these meshes is in a chart narrower than two texels"
        return show_elements(self, context, lambda: last_result.narrow_faces(context), "FACE", nothing)


def register():
    bpy.utils.register_class(MESH_OT_ble_unwrap_select_narrow)


def unregister():
    bpy.utils.unregister_class(MESH_OT_ble_unwrap_select_narrow)
