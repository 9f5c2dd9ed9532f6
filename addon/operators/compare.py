"""The operators `uv.ble_unwrap_compare`, which unwraps in two ways, and those that choose between them."""

import bpy
from bpy.props import EnumProperty

from .. import (
    comparison_image,
    last_check,
    last_comparison,
    last_result,
    preferences,
    properties,
    smart_comparison,
    targets,
)
from .with_progress import USER_ERRORS, WithProgress, redraw

SIDES = (
    (smart_comparison.BLE, "BLE Unwrap", "The map by BLE Unwrap"),
    (smart_comparison.SMART, "Smart UV Project", "The map by Smart UV Project"),
)
KEEP_SETTINGS = ("uv_map", "uv_map_name", "move_pinned", "mark_seams")


class UV_OT_ble_unwrap_compare(WithProgress, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_compare"
    bl_label = "Compare with Smart UV Project"
    bl_description = (
        "See on your own meshes which unwrap serves you better: BLE Unwrap with the settings above, and Smart UV "
        "Project with the same margin at that of four angles which keeps to the stretch limit with the shortest seams. "
        "Each gets a new UV map of all faces; stacks, tiles, texel density and Keep Place, which Smart UV Project does "
        "not have, are left out. A table and a picture show both until you keep one or discard both; until then your "
        "own maps stay as they are"
    )
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context):
        if context.mode not in {"OBJECT", "EDIT_MESH"}:
            cls.poll_message_set("Works in Object Mode and in Edit Mode of a mesh")
            return False
        if last_comparison.is_there():
            cls.poll_message_set("Keep one of the maps compared, or discard both, first")
            return False
        objects = context.selected_objects if context.mode == "OBJECT" else context.objects_in_mode_unique_data
        if not any(obj.type == "MESH" for obj in objects):
            cls.poll_message_set("Select a mesh")
            return False
        return True

    def invoke(self, context, _event):
        return self.compute(context, in_background=not bpy.app.background)

    def _prepare(self, context):
        return smart_comparison.SmartComparison(
            targets.target_objects(context),
            properties.values(context.scene.ble_unwrap),
            threads=preferences.preference(context, "threads"),
        )

    def _finish(self, context, work, result):
        compared = work.finish(context, result)
        last_comparison.show(context, compared)
        texts = "; ".join(f"{label} {ours} against {theirs}" for label, ours, theirs in compared.rows)
        self.report({"INFO"}, f"BLE Unwrap against Smart UV Project: {texts}")
        redraw(context)
        return {"FINISHED"}


class _OnComparison:
    """What there has to be a comparison for."""

    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context):
        if context.mode not in {"OBJECT", "EDIT_MESH"}:
            cls.poll_message_set("Works in Object Mode and in Edit Mode of a mesh")
            return False
        if not last_comparison.is_there():
            cls.poll_message_set("There is no comparison to choose from")
            return False
        return True


class _Choice(_OnComparison):
    """What ends a comparison."""

    def execute(self, context):
        try:
            notes = self._choose(context, last_comparison.entries())
        except USER_ERRORS as error:
            self.report({"ERROR"}, f"{self.bl_label}: {error}")
            return {"CANCELLED"}
        comparison_image.take_away(context)
        for text in notes or ():
            self.report({"WARNING"}, text)
        last_result.compare()
        last_check.undone()
        redraw(context)
        return {"FINISHED"}


class UV_OT_ble_unwrap_keep(_Choice, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_keep"
    bl_label = "Keep This One"
    bl_description = (
        "End the comparison with this one's UVs, and make their map the active one. They go where UV Map says: with "
        "Active they replace the map that was active before, with By Name the map of that name, made where there is "
        "none. Both maps of the comparison and its picture go. Mark Seams holds for BLE Unwrap"
    )

    side: EnumProperty(name="Which", items=SIDES, default=smart_comparison.BLE)

    def _choose(self, context, entries):
        settings = properties.values(context.scene.ble_unwrap)
        settings = {name: settings[name] for name in KEEP_SETTINGS}
        notes = smart_comparison.keep(entries, self.side, settings)
        self.report({"INFO"}, f"The UVs by {smart_comparison.NAMES[self.side]} are kept")
        return notes


class UV_OT_ble_unwrap_look(_OnComparison, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_look"
    bl_label = "Look at This One"
    bl_description = (
        "Make this map the active one for now, so that UV Editor, Check and Show are about it. Discard Both makes the "
        "former one active again"
    )

    side: EnumProperty(name="Which", items=SIDES, default=smart_comparison.BLE)

    def execute(self, context):
        for obj, maps, _ in last_comparison.entries():
            obj.data.uv_layers.active = obj.data.uv_layers[maps[self.side]]
        redraw(context)
        return {"FINISHED"}


class UV_OT_ble_unwrap_discard(_Choice, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_discard"
    bl_label = "Discard Both"
    bl_description = (
        "End the comparison with neither: both maps and the picture go, and the map that was active before is so again"
    )

    def _choose(self, _context, entries):
        smart_comparison.discard(entries)


CLASSES = (UV_OT_ble_unwrap_compare, UV_OT_ble_unwrap_keep, UV_OT_ble_unwrap_look, UV_OT_ble_unwrap_discard)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
