"""An unwrap by the mouse changes the UVs, and undo and redo restore them exactly."""

import bpy
import numpy as np
import scenes
from driver import Wait


def changed(obj, before):
    return lambda: not np.array_equal(scenes.uvs(obj), before)


def test_button_of_the_sidebar_unwraps(window):
    obj = scenes.sphere()
    scenes.select(obj)
    obj.data.uv_layers.new(name="UVMap")
    before = scenes.uvs(obj)
    region = yield from window.sidebar()
    yield from window.press(region, "uv.ble_unwrap(")
    yield Wait(changed(obj, before), "the button changes the UVs")
    scenes.assert_good(obj)
    yield from window.turns(10)
    window.screenshot("last_result")


def test_menu_of_the_3d_view_unwraps(window):
    obj = scenes.sphere()
    scenes.select(obj)
    yield from window.rest()
    with window.context():
        bpy.ops.wm.call_menu("INVOKE_DEFAULT", name="VIEW3D_MT_object")
    yield from window.turns(4)
    for _ in range(60):
        yield from window.key("DOWN_ARROW")
        if (yield from window.copied()).startswith("bpy.ops.uv.ble_unwrap("):
            break
    yield from window.key("RET")
    yield Wait(lambda: obj.data.uv_layers, "the entry makes a UV map")
    scenes.assert_good(obj)


def test_undo_and_redo_restore_exactly(window):
    obj = scenes.sphere()
    scenes.select(obj)
    obj.data.uv_layers.new(name="UVMap")
    before = scenes.uvs(obj)
    with window.context():
        bpy.ops.ed.undo_push(message="Made")
    region = yield from window.sidebar()
    yield from window.press(region, "uv.ble_unwrap(")
    yield Wait(changed(obj, before), "the button changes the UVs")
    after = scenes.uvs(obj)
    state = scenes.fingerprint(obj)
    for _ in range(2):
        yield from window.rest()
        yield from window.key("Z", ctrl=True)
        yield Wait(lambda: np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), before), "undo brings back the UVs")
        yield from window.key("Z", ctrl=True, shift=True)
        yield Wait(lambda: np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), after), "redo brings them again")
        assert scenes.fingerprint(bpy.data.objects["Sphere"]) == state


def test_two_objects_in_edit_mode_share_an_atlas(window):
    objects = [scenes.sphere("Left"), scenes.grid(name="Right", bump=0.3)]
    scenes.edit(*objects)
    region = yield from window.sidebar()
    yield from window.press(region, "uv.ble_unwrap(")
    with window.context():
        yield Wait(lambda: all(obj.data.uv_layers for obj in objects), "both get a UV map")
    assert bpy.context.mode == "EDIT_MESH" and all(obj.mode == "EDIT" for obj in objects)
    window.screenshot("two_objects")
    with window.context():
        bpy.ops.object.mode_set(mode="OBJECT")
    boxes = [(uv.min(axis=0), uv.max(axis=0)) for uv in map(scenes.assert_good, objects)]
    density = [(scenes.triangle_areas(obj, scenes.uvs(obj)).sum() / scenes.surface_areas(obj).sum()) for obj in objects]
    assert 0.8 < density[0] / density[1] < 1.25, f"both at one texel density: {density}"
    assert not np.allclose(boxes[0], boxes[1]), "they do not lie on each other"
