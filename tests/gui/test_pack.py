"""Pack Only moves the islands that are there and keeps their shape."""

import bpy
import numpy as np
import scenes
from driver import Wait


def test_pack_only_fills_the_texture_with_the_islands_that_are_there(window):
    obj = scenes.sphere()
    scenes.select(obj)
    with window.context():
        bpy.ops.uv.ble_unwrap(margin=4.0)
    small = scenes.uvs(obj) * 0.2 + 0.05
    scenes.set_uvs(obj, small)
    with window.context():
        bpy.ops.ed.undo_push(message="Shrunk")
    region = yield from window.sidebar()
    yield from window.press(region, "uv.ble_unwrap_pack(")
    yield Wait(lambda: not np.array_equal(scenes.uvs(obj), small), "the islands move")
    packed = scenes.assert_good(obj)
    growth = scenes.triangle_areas(obj, packed) / scenes.triangle_areas(obj, small)
    assert growth.min() > 10.0 and np.ptp(growth) < 1e-2 * growth.mean(), "all islands grow by one factor"
    with window.context():
        bpy.ops.ed.undo()
    yield from window.turns(10)
    assert np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), small)
