"""Adjust Last Operation and the sidebar show the same settings, and what is changed there is kept for the next run."""

import bpy
import numpy as np
import scenes
from driver import Wait


def test_changed_values_reach_the_sidebar_and_the_next_run(window):
    obj = scenes.sphere()
    scenes.select(obj)
    obj.data.uv_layers.new(name="UVMap")
    before = scenes.uvs(obj)
    with window.context():
        bpy.ops.ed.undo_push(message="Made")
    settings = bpy.context.scene.ble_unwrap
    settings.margin = 7.0
    region = yield from window.sidebar()
    yield from window.press(region, "uv.ble_unwrap(")
    yield Wait(lambda: not np.array_equal(scenes.uvs(obj), before), "the button changes the UVs")
    first = scenes.uvs(obj)

    hud = yield from window.adjust()
    yield from window.find(hud, lambda text: text.startswith("7.0"), 0.7)
    window.screenshot("adjust_last_operation")
    yield from window.paste("11")
    yield Wait(lambda: not np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), first), "the map is made anew")
    assert bpy.context.scene.ble_unwrap.margin == 11.0, "the sidebar has the value of the panel"
    second = scenes.uvs(bpy.data.objects["Sphere"])
    yield from window.turns(10)
    yield from window.find(window.region("UI"), lambda text: text.startswith("11.0"))

    yield from window.rest()
    yield from window.key("Z", ctrl=True)
    yield Wait(lambda: np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), before), "one undo takes all of it back")
    bpy.context.scene.ble_unwrap.margin = 11.0  # the undone step had the scene's settings, too
    yield from window.press(window.region("UI"), "uv.ble_unwrap(")
    yield Wait(lambda: np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), second), "the next run has the value")


def test_popup_of_f9_repeats_with_the_changed_value(window):
    obj = scenes.sphere()
    scenes.select(obj)
    obj.data.uv_layers.new(name="UVMap")
    with window.context():
        bpy.ops.ed.undo_push(message="Made")
    bpy.context.scene.ble_unwrap.margin = 7.0
    region = yield from window.sidebar()
    yield from window.press(region, "uv.ble_unwrap(")
    yield Wait(lambda: scenes.uvs(obj).any(), "the button makes UVs")
    first = scenes.uvs(obj)
    yield from window.rest()
    x, y = window.pointer
    yield from window.key("F9")
    yield from window.turns(6)
    window.screenshot("popup_of_f9")
    # The popup opens at the pointer, with the names of the settings there and their values to the right.
    for down in range(0, 300, 9):
        yield from window.move(x + 230, y - down)
        if found := (yield from window.copied()).startswith("7.0"):
            break
    assert found, "the popup shows the margin"
    yield from window.paste("12")
    yield Wait(lambda: not np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), first), "the map is made anew")
    assert bpy.context.scene.ble_unwrap.margin == 12.0
    yield from window.key("ESC")
