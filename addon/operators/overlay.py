"""The operator `uv.ble_unwrap_show`: turns on and off what is drawn over the meshes in the 3D views."""

import bpy
from bpy.props import EnumProperty

from .. import overlay
from .map_poll import has_map
from .with_progress import USER_ERRORS

# What an artist gains by each.
TEXTS = {
    "CHECKER": (
        "Checker",
        "Draw a checker through the active UV map: squares that stay square and equally large show an even map, "
        "and where lines break there is a seam",
    ),
    "STRETCH": (
        "Stretch",
        "Colour each face by how far lines of the texture are too long (orange) or too short (blue) on it, against the "
        "rest of its island; white is faithful",
    ),
    "ISLANDS": (
        "Islands",
        "Give each island of the active UV map a colour of its own: one sees at once what is in one piece",
    ),
    "SEAMS": ("Seams", "Draw a line wherever the active UV map is cut, whether or not the edge is marked as a seam"),
}
TRACELESS = (
    ". Drawn in the 3D views, on the selected meshes; nothing is put into the file, and loading a file turns it off"
)


class UV_OT_ble_unwrap_show(bpy.types.Operator):
    bl_idname = "uv.ble_unwrap_show"
    bl_label = "Show on the Surface"
    bl_description = f"Turn on or off what is drawn over the meshes{TRACELESS}"
    # No step of Blender's undo: there is nothing to be undone.

    kind: EnumProperty(
        name="What", items=[(kind, name, text) for kind, (name, text) in TEXTS.items()], default="CHECKER"
    )

    @classmethod
    def description(cls, _context, properties):
        return TEXTS[properties.kind][1] + TRACELESS

    @classmethod
    def poll(cls, context):
        # What is on can always be turned off.
        return overlay.is_on() or has_map(cls, context)

    def execute(self, context):
        if bpy.app.background:
            self.report({"ERROR"}, f"{self.bl_label}: Blender runs without a window, so there is nothing to draw in")
            return {"CANCELLED"}
        try:
            overlay.toggle(context, self.kind)
        except USER_ERRORS as error:
            self.report({"ERROR"}, f"{TEXTS[self.kind][0]}: {error}")
            return {"CANCELLED"}
        finally:
            overlay.redraw()
        return {"FINISHED"}


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap_show)


def unregister():
    bpy.utils.unregister_class(UV_OT_ble_unwrap_show)
