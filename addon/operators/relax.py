"""The operators `uv.ble_unwrap_relax` and `uv.ble_unwrap_anew`: islands that are there get less stretch where they lie.

The first starts from how an island is, the second from nothing but its outline on the surface.
"""

import bpy
from bpy.props import BoolProperty

from .. import faces, preferences, properties, targets
from ..relax_task import RelaxTask
from .map_poll import has_map
from .with_progress import WithProgress

SETTINGS = ("texture_size", "correct_aspect")


class OnIslands(WithProgress):
    """What both have in common. `anew` says which it is."""

    anew = False
    shown = SETTINGS

    @classmethod
    def poll(cls, context):
        return has_map(cls, context)

    def invoke(self, context, _event):
        properties.copy_unset(self.properties, context.scene.ble_unwrap, SETTINGS)
        return self.compute(context, in_background=not bpy.app.background)

    def _prepare(self, context):
        if not self.properties.is_property_set("by_uv"):
            self.by_uv = faces.by_uv_selection(context)
        return RelaxTask(
            targets.target_objects(context),
            properties.plain_values(self, SETTINGS),
            anew=self.anew,
            threads=preferences.preference(context, "threads"),
            by_uv=self.by_uv,
        )

    def _finish(self, context, task, relaxed):
        outcome = task.write(relaxed)
        return self._tell(context, outcome.warnings, outcome.summary)


def annotations():
    """The properties of an operator on islands."""
    # Kept with a run, so that the redo panel repeats it: whether the UV Editor's selection counts.
    by_uv = BoolProperty(options={"HIDDEN", "SKIP_SAVE"})
    return properties.operator_annotations(SETTINGS) | {"by_uv": by_uv}


class UV_OT_ble_unwrap_relax(OnIslands, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_relax"
    bl_label = "Relax Islands (BLE)"
    bl_description = (
        "Lower the stretch of the selected islands, whoever made them, starting from how they are. Pinned UVs and "
        "seams stay, and an island without pins keeps its place, its orientation and its size. No face is turned "
        "over, and no island comes to overlap itself"
    )
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = annotations()


class UV_OT_ble_unwrap_anew(OnIslands, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_anew"
    bl_label = "Re-unwrap Islands (BLE)"
    bl_description = (
        "Unwrap each of the selected islands anew, as one island with the seams that it has in the map, whatever its "
        "shape was. It goes back to where it was, at the size that it had, and pinned UVs stay. Islands that have no "
        "more stretch than they would get stay as they are"
    )
    bl_options = {"REGISTER", "UNDO"}
    anew = True

    __annotations__ = annotations()


CLASSES = (UV_OT_ble_unwrap_relax, UV_OT_ble_unwrap_anew)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
