"""The operator `mesh.ble_unwrap_select_faulty`: shows the faces that a line of the check is about."""

import bpy
from bpy.props import EnumProperty

from .. import last_check
from .edit_selection import show_elements


class MESH_OT_ble_unwrap_select_faulty(bpy.types.Operator):
    bl_idname = "mesh.ble_unwrap_select_faulty"
    bl_label = "Select Faces of the Check"
    bl_description = "In Edit Mode, select the faces that this line of the check is about, and no others"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(
        name="Faces",
        items=(
            ("OVERLAPPING", "Overlapping", "Faces that share a place of the UV map with another face"),
            ("FLIPPED", "Flipped", "Faces that lie in the UV map the other way round than most of their island"),
            (
                "STRETCHED",
                "Stretched",
                "Faces that are drawn out or pressed together, in islands beyond the limit",
            ),
            ("COLLAPSED", "Without Area", "Faces that are a line or a point in the UV map, in part at least"),
            ("UNMAPPED", "Without UVs", "Faces with a UV that is not a number"),
            ("MIRRORED", "Mirrored", "Faces of islands that lie in the UV map as they look from behind"),
            ("STACKED", "Stacked", "Faces of islands that lie exactly on another one"),
        ),
        default="OVERLAPPING",
    )

    @classmethod
    def poll(cls, _context):
        if not last_check.title():
            cls.poll_message_set("Check a UV map first")
            return False
        return True

    def execute(self, context):
        nothing = "No visible face of these meshes is meant; check the UV map again"
        return show_elements(self, context, lambda: last_check.faulty_faces(self.kind), "FACE", nothing)


def register():
    bpy.utils.register_class(MESH_OT_ble_unwrap_select_faulty)


def unregister():
    bpy.utils.unregister_class(MESH_OT_ble_unwrap_select_faulty)
