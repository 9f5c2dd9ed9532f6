"""The operator `uv.ble_unwrap_align`: turns islands that are there, so that what is straight lies along the axes."""

import bpy
import numpy as np
from bpy.props import BoolProperty

from .. import faces, last_result, properties, targets, uv_align
from ..island_choice import IslandChoice
from ..wording import counted
from .map_poll import has_map
from .with_progress import USER_ERRORS, draw_properties, redraw

SETTINGS = ("texture_size", "correct_aspect")
# Radians: islands that would be turned by less are left as they are, to the bit.
LEAST_TURN = 1e-5


class UV_OT_ble_unwrap_align(bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_align"
    bl_label = "Align Islands (BLE)"
    bl_description = (
        "Turn each selected island in its place, by at most 45 degrees, so that its longest straight borders lie along "
        "the axes; where it has none, so that the box around it is smallest"
    )
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = properties.operator_annotations(SETTINGS) | {
        "lock_pinned": BoolProperty(
            name="Lock Pinned", description="Leave islands with a pinned UV as they are", default=True
        ),
        # Kept with a run, so that the redo panel repeats it: whether the UV Editor's selection counts.
        "by_uv": BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
    }

    @classmethod
    def poll(cls, context):
        return has_map(cls, context)

    def invoke(self, context, _event):
        properties.copy_unset(self.properties, context.scene.ble_unwrap, SETTINGS)
        return self.execute(context)

    def execute(self, context):
        if not self.properties.is_property_set("by_uv"):
            self.by_uv = faces.by_uv_selection(context)
        try:
            islands = IslandChoice(targets.target_objects(context), lock_pinned=self.lock_pinned, by_uv=self.by_uv)
            size = np.array(islands.texture_size(properties.plain_values(self, SETTINGS)), np.float64)
            count = aligned(islands, size)
        except USER_ERRORS as error:
            self.report({"ERROR"}, f"{self.bl_label}: {error}")
            return {"CANCELLED"}
        last_result.compare()
        for text in islands.warnings:
            self.report({"WARNING"}, text)
        told = [f"{counted(count, 'island')} turned"]
        if rest := int(islands.moves.sum()) - count:
            told.append(f"{rest:,} lay along the axes already")
        self.report({"INFO"}, f"{self.bl_label}: {', '.join([*told, *islands.left])}")
        redraw(context)
        return {"FINISHED"}

    def draw(self, _context):
        draw_properties(self, (*SETTINGS, "lock_pinned"))


def aligned(islands, size):
    """Turns the islands that move, in a texture of this size, (2,), and returns how many of them were turned."""
    points = islands.uv * size
    moving = np.append(islands.moves, False)[islands.island]
    of_faces = np.where(moving, islands.island, -1)
    offsets = islands.selection.face_offsets
    angles = uv_align.turns(islands.place, offsets, of_faces, islands.count, points)
    is_turned = islands.moves & (np.abs(angles) >= LEAST_TURN)
    if is_turned.any():
        corners = islands.moving_corners & np.append(is_turned, False)[islands.corner_island]
        new = uv_align.turned(points, np.where(corners, islands.corner_island, -1), islands.count, angles)
        islands.write(np.where(corners[:, None], (new / size).astype(np.float32), islands.uv))
    return int(is_turned.sum())


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap_align)


def unregister():
    bpy.utils.unregister_class(UV_OT_ble_unwrap_align)
