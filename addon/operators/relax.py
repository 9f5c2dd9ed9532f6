"""The operator `uv.ble_unwrap_relax`: lowers the stretch of islands that are there, each where it lies."""

import bpy
from bpy.props import BoolProperty

from .. import faces, last_result, preferences, properties, targets
from ..relax_task import RelaxTask
from .map_poll import has_map
from .with_progress import WithProgress, redraw

SETTINGS = ("texture_size", "correct_aspect")


class UV_OT_ble_unwrap_relax(WithProgress, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_relax"
    bl_label = "Relax Islands (BLE)"
    bl_description = (
        "Lower the stretch of the selected islands, whoever made them, starting from how they are. Pinned UVs and "
        "seams stay, and an island without pins keeps its place, its orientation and its size. No face is turned "
        "over, and no island comes to overlap itself"
    )
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = properties.operator_annotations(SETTINGS) | {
        # Kept with a run, so that the redo panel repeats it: whether the UV Editor's selection counts.
        "by_uv": BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
    }

    @classmethod
    def poll(cls, context):
        return has_map(cls, context)

    def invoke(self, context, _event):
        properties.copy_unset(self.properties, context.scene.ble_unwrap, SETTINGS)
        return self.compute(context, in_background=not bpy.app.background)

    def execute(self, context):
        return self.compute(context, in_background=False)

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        for name in SETTINGS:
            column.prop(self, name)

    def _prepare(self, context):
        if not self.properties.is_property_set("by_uv"):
            self.by_uv = faces.by_uv_selection(context)
        return RelaxTask(
            targets.target_objects(context),
            properties.plain_values(self, SETTINGS),
            threads=preferences.preference(context, "threads"),
            by_uv=self.by_uv,
        )

    def _finish(self, context, task, relaxed):
        outcome = task.write(relaxed)
        last_result.compare()
        for text in outcome.warnings:
            self.report({"WARNING"}, text)
        self.report({"INFO"}, f"{self.bl_label}: {outcome.summary}")
        redraw(context)
        return {"FINISHED"}


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap_relax)


def unregister():
    bpy.utils.unregister_class(UV_OT_ble_unwrap_relax)
