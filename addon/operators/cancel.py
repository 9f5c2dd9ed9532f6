"""The operator `uv.ble_unwrap_cancel`: stops what is being computed, as Esc does."""

import bpy

from .. import running


class UV_OT_ble_unwrap_cancel(bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_cancel"
    bl_label = "Cancel"
    bl_description = "Stop what is being computed, as Esc does. Nothing is changed"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        return running.is_there()

    def execute(self, _context):
        running.stop()
        return {"FINISHED"}


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap_cancel)


def unregister():
    bpy.utils.unregister_class(UV_OT_ble_unwrap_cancel)
