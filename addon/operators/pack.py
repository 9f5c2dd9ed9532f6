"""The operator `uv.ble_unwrap_pack`: packs the islands that are there, whoever made them."""

import bpy
from bpy.props import BoolProperty, EnumProperty

from .. import faces, preferences, properties, targets
from ..pack_task import PackTask
from . import again
from .map_poll import has_map
from .with_progress import WithProgress

# The settings that are not those of an unwrap. Blender remembers them from the last run.
OWN_SETTINGS = ("scale", "keep_unselected", "lock_pinned", "keep_stacks")


class UV_OT_ble_unwrap_pack(WithProgress, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_pack"
    bl_label = "Pack Islands (BLE)"
    bl_description = (
        "Move, turn and scale the selected islands, whoever made them, so that they fill the texture and keep the "
        "margin. All get the same scale and keep their shape. In Object Mode all islands of the selected meshes are "
        "packed into one texture"
    )
    bl_options = {"REGISTER", "UNDO"}
    shown = (*properties.PACK_SETTINGS, *OWN_SETTINGS)

    __annotations__ = properties.operator_annotations(properties.PACK_SETTINGS) | {
        "scale": EnumProperty(
            name="Scale",
            description="How large the islands become",
            items=(
                ("UNIFORM", "Fill", "All are scaled by the same factor, the greatest that is found"),
                ("FIXED", "Keep", "All keep the size that they have; an error says by how much they are too large"),
            ),
            default="UNIFORM",
        ),
        "keep_unselected": BoolProperty(
            name="Around Unselected",
            description=(
                "Keep clear of the islands of these meshes that are not selected or hidden, which stay where they are. "
                "Without it they stay, too, but islands may be laid on them"
            ),
            default=True,
        ),
        "lock_pinned": BoolProperty(
            name="Lock Pinned",
            description="Leave islands with a pinned UV where they are, and keep clear of them",
            default=True,
        ),
        "keep_stacks": BoolProperty(
            name="Keep Stacks",
            description=(
                "Move islands that lie exactly on each other, mirrored or not, together, so that they go on to share "
                "their pixels. Without it each gets a place of its own"
            ),
            default=True,
        ),
        # Kept with a run, so that the redo panel repeats it: whether the UV Editor's selection counts, and whether
        # the sidebar takes over what is set in the redo panel.
        "by_uv": BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
        "from_sidebar": BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
    }

    @classmethod
    def poll(cls, context):
        return has_map(cls, context)

    def invoke(self, context, _event):
        if not again.is_invoked():
            properties.copy_unset(self.properties, context.scene.ble_unwrap, properties.PACK_SETTINGS)
        self.from_sidebar = True
        return self.compute(context, in_background=not bpy.app.background)

    def _prepare(self, context):
        if not self.properties.is_property_set("by_uv"):
            self.by_uv = faces.by_uv_selection(context)
        return PackTask(
            targets.target_objects(context),
            properties.plain_values(self, self.shown),
            threads=preferences.preference(context, "threads"),
            by_uv=self.by_uv,
        )

    def _finish(self, context, task, packed):
        outcome = task.write(packed)
        if self.from_sidebar:
            properties.copy_named(self.properties, context.scene.ble_unwrap, properties.PACK_SETTINGS)
        return self._tell(context, outcome.warnings, outcome.summary)

    def _fail(self, error):
        if "obstacles" in str(error):
            error = f"{error}. Obstacles are the islands that stay: select them, too, or turn off Around Unselected"
        return super()._fail(error)


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap_pack)


def unregister():
    bpy.utils.unregister_class(UV_OT_ble_unwrap_pack)
