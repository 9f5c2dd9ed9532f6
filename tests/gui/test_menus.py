"""The UV menus of both editors have the add-on's entries, and each of them once."""

import re

import bpy
import scenes


def all_entries(window, name, ui_type):
    """The commands of a menu and of the menus in it."""
    commands = yield from window.menu(name, ui_type)
    for command in list(commands):
        if inner := re.match(r'bpy\.ops\.wm\.call_menu\(name="(\w+)"\)', command):
            commands += yield from all_entries(window, inner[1], ui_type)
    return commands


def count(commands, operator):
    return sum(command.startswith(f"bpy.ops.{operator}(") for command in commands)


def test_uv_menu_of_the_3d_view_has_the_entry_once(window):
    scenes.edit(scenes.cube())
    commands = yield from all_entries(window, "VIEW3D_MT_uv_map", "VIEW_3D")
    assert count(commands, "uv.unwrap") > 0, f"Blender's own are there: {commands}"
    assert count(commands, "uv.ble_unwrap") == 1, commands


def test_uv_menu_of_the_uv_editor_has_every_entry_once(window):
    scenes.edit(scenes.cube())
    window.area("TIMELINE").ui_type = "UV"
    window.area("VIEW_3D").ui_type = "UV"
    yield from window.turns(10)
    commands = yield from all_entries(window, "IMAGE_MT_uvs", "UV")
    ours = ("uv.ble_unwrap", "uv.ble_unwrap_pack", "uv.ble_unwrap_align", "uv.ble_unwrap_relax", "uv.ble_unwrap_anew")
    assert {name: count(commands, name) for name in ours} == dict.fromkeys(ours, 1), commands


def test_object_menu_has_the_entry_once(window):
    scenes.select(scenes.cube())
    commands = yield from window.menu("VIEW3D_MT_object")
    assert bpy.context.mode == "OBJECT"
    assert count(commands, "uv.ble_unwrap") == 1, commands
