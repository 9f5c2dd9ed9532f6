"""Compare with Smart UV Project, and both ends of it."""

import addon_loader
import bpy
import numpy as np
import scenes
from driver import Wait


def compared(window):
    """A ball with a map of its own that has been compared; returns it, its UVs before and the sidebar's region."""
    obj = scenes.sphere()
    scenes.select(obj)
    with window.context():
        bpy.ops.uv.ble_unwrap(margin=20.0)
        bpy.ops.ed.undo_push(message="Unwrapped")
    window.area("TIMELINE").ui_type = "IMAGE_EDITOR"
    before = scenes.uvs(obj)
    region = yield from window.sidebar()
    yield from window.scroll_to_end(region)
    yield from window.press(region, "uv.ble_unwrap_compare(")
    yield Wait(addon_loader.load("last_comparison").is_there, "both maps are made")
    yield from window.turns(20)
    yield from window.scroll_to_end(region)
    assert len(obj.data.uv_layers) == 3 and np.array_equal(scenes.uvs(obj), before)
    return obj, before, region


def is_over():
    return not addon_loader.load("last_comparison").is_there()


def names(obj):
    return [layer.name for layer in obj.data.uv_layers]


def test_keep_this_one_puts_its_uvs_in_the_place_of_the_active_map(window):
    obj, before, region = yield from compared(window)
    window.screenshot("compared")
    maps = addon_loader.load("last_comparison").entries()[0][1]
    smart = scenes.uvs(obj, maps["SMART"])
    wanted = "bpy.ops.uv.ble_unwrap_keep(side='SMART')"
    x, y = yield from window.find(region, lambda text: text.startswith(wanted))
    yield from window.click(x, y)
    yield Wait(is_over, "the comparison ends")
    assert len(names(obj)) == 1 and np.array_equal(scenes.uvs(obj), smart)
    with window.context():
        bpy.ops.ed.undo()
    yield from window.turns(10)
    assert len(names(bpy.data.objects["Sphere"])) == 3, "it is one step of undo"
    assert np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), before)


def test_discard_both_leaves_what_was_there(window):
    obj, before, region = yield from compared(window)
    images = len(bpy.data.images)
    yield from window.press(region, "uv.ble_unwrap_discard(")
    yield Wait(is_over, "the comparison ends")
    assert len(names(obj)) == 1 and np.array_equal(scenes.uvs(obj), before)
    assert len(bpy.data.images) < images, "its picture is gone, too"
