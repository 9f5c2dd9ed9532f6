"""The Check block turns grey as soon as what it says is no longer true, and back when undo makes it true again."""

import addon_loader
import bpy
import numpy as np
import scenes
from driver import Wait


def test_check_goes_grey_after_the_uvs_change(window):
    obj = scenes.sphere()
    scenes.select(obj)
    with window.context():
        bpy.ops.uv.ble_unwrap()
        bpy.ops.ed.undo_push(message="Unwrapped")
    last_check = addon_loader.load("last_check")
    region = yield from window.sidebar()
    _, y = yield from window.press(region, "uv.ble_unwrap_check(")
    yield Wait(last_check.title, "the check is shown")
    yield from window.turns(20)
    assert last_check.is_current(bpy.context)
    window.screenshot("check")
    fresh = window.picture_of(window.region("UI")).astype(int)

    with window.context():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.reset()
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.ed.undo_push(message="Reset")
    yield Wait(lambda: not last_check.is_current(bpy.context), "it is out of date")
    yield from window.turns(20)
    window.screenshot("check_out_of_date")
    stale = window.picture_of(window.region("UI")).astype(int)
    # Eight lines of text stand below the button; their letters are what is bright there.
    below = region.y + region.height - y + 15
    bright = [int((picture[below : below + 100].min(axis=2) > 180).sum()) for picture in (fresh, stale)]
    assert bright[0] > 100 > bright[1], f"it is drawn in grey: {bright}"

    yield from window.rest()
    yield from window.key("Z", ctrl=True)
    yield Wait(lambda: last_check.is_current(bpy.context), "undo brings back what was measured")
    assert np.ptp(scenes.uvs(bpy.data.objects["Sphere"]), axis=0).max() > 0.5
