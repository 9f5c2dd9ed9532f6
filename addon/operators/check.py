"""The operator `uv.ble_unwrap_check`: measures the active UV maps, whoever made them, for the panel."""

import bpy

from .. import last_check, map_check, preferences, properties, targets
from .map_poll import has_map
from .with_progress import USER_ERRORS, redraw


class UV_OT_ble_unwrap_check(bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_check"
    bl_label = "Check UV Map"
    bl_description = (
        "Measure the active UV map, whoever made it: stretch, overlaps, flipped faces, the distance of islands, how "
        "much of the texture is used, and at how many pixels for each unit of length. All faces count, whether "
        "selected, hidden or not. Nothing is changed"
    )

    @classmethod
    def poll(cls, context):
        return has_map(cls, context)

    def execute(self, context):
        settings = properties.plain_values(context.scene.ble_unwrap, last_check.SETTINGS)
        threads = preferences.preference(context, "threads")
        try:
            check = map_check.check(targets.target_objects(context), settings, threads=threads)
        except USER_ERRORS as error:
            self.report({"ERROR"}, f"{self.bl_label}: {error}")
            return {"CANCELLED"}
        last_check.show(context, check)
        self.report({"INFO"}, f"{check.title}: {'; '.join(line.text for line in check.lines)}")
        redraw(context)
        return {"FINISHED"}


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap_check)


def unregister():
    bpy.utils.unregister_class(UV_OT_ble_unwrap_check)
