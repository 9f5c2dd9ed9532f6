"""Entries in Blender's own menus."""

import bpy


def menu_names():
    """Menus that get an entry. From 4.3 on the 3D view's UV menu shows the UV editor's Unwrap menu: once is enough.

    Point clouds have no UV menu: theirs are the Object menu and that of their edit mode.
    """
    names = ["IMAGE_MT_uvs_unwrap", "VIEW3D_MT_object", "VIEW3D_MT_edit_pointcloud"]
    if bpy.app.version < (4, 3, 0):
        names.append("VIEW3D_MT_uv_map")
    return names


def draw_entry(self, _context):
    self.layout.separator()
    self.layout.operator_context = "INVOKE_DEFAULT"
    self.layout.operator("uv.ble_unwrap", icon="UV")


def draw_island_entries(self, _context):
    self.layout.separator()
    self.layout.operator_context = "INVOKE_DEFAULT"
    self.layout.operator("uv.ble_unwrap_pack")
    self.layout.operator("uv.ble_unwrap_align")
    self.layout.operator("uv.ble_unwrap_relax")
    self.layout.operator("uv.ble_unwrap_anew")


def register():
    for name in menu_names():
        getattr(bpy.types, name).append(draw_entry)
    # Beside Blender's own Pack Islands, which the 3D view's menu has not.
    bpy.types.IMAGE_MT_uvs.append(draw_island_entries)


def unregister():
    bpy.types.IMAGE_MT_uvs.remove(draw_island_entries)
    for name in menu_names():
        getattr(bpy.types, name).remove(draw_entry)
