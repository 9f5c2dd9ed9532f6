"""Comparing with Smart UV Project: two maps, one choice, and everything else as it was."""

import bpy
import demo_meshes
import numpy as np
import pytest
from scenes import assert_good, attribute_names, cube, edit, fingerprint, grid, select, set_uvs, sphere, uvs
from test_overlay import inventory

compare = bpy.ops.uv.ble_unwrap_compare
keep = bpy.ops.uv.ble_unwrap_keep
discard = bpy.ops.uv.ble_unwrap_discard
look = bpy.ops.uv.ble_unwrap_look
IMAGE = "BLE Unwrap | Smart UV Project"


def mapped(obj, name="UVMap"):
    obj.data.uv_layers.new(name=name)
    set_uvs(obj, np.random.default_rng(0).random((len(obj.data.loops), 2)))
    return obj


def map_names(obj):
    return [layer.name for layer in obj.data.uv_layers]


def state():
    """All that nothing but keeping may change: data, selection, modes, active maps and UVs, by object."""
    objects = {}
    for obj in bpy.data.objects:
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        maps = obj.data.uv_layers
        objects[obj.name] = (
            fingerprint(obj),
            attribute_names(obj),
            maps.active.name if maps.active else None,
            [layer.name for layer in maps if layer.active_render],
            [uvs(obj, name).tobytes() for name in map_names(obj)] if obj.mode == "OBJECT" else [],
            obj.hide_get(),
        )
    active = bpy.context.view_layer.objects.active
    tools = bpy.context.scene.tool_settings
    return objects, active.name, tools.use_uv_select_sync, tuple(tools.mesh_select_mode), inventory()


@pytest.fixture
def scene():
    """A sphere and a cube that are selected, with hidden faces and seams, and others that are not."""
    one, other, third, hidden = mapped(sphere()), cube(), mapped(grid(2, name="Third")), mapped(grid(2, name="Hidden"))
    one.data.uv_layers.new(name="Rendered").active_render = True
    one.data.uv_layers.active = one.data.uv_layers["UVMap"]
    one.data.edges[5].use_seam = True
    one.shape_key_add(name="Basis")
    one.shape_key_add(name="Other")
    other.modifiers.new("Subdivision", "SUBSURF")
    other.scale = (1, 2, 3)
    third.location.x = 4
    hidden.hide_set(True)
    select(one, other)
    return one, other


@pytest.fixture
def is_there(addon):
    return addon("last_comparison").is_there


@pytest.fixture
def rows(addon):
    return lambda: {label: (ours, theirs) for label, ours, theirs in addon("last_comparison").rows()}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_two_maps_come_and_go_and_nothing_else_changes(scene, is_there, mode):
    if mode == "EDIT":
        edit(*scene, faces=[1, 2, 3])
        bpy.ops.mesh.hide()
    bpy.context.scene.ble_unwrap.mark_seams = True
    before = state()
    assert compare() == {"FINISHED"} and is_there()
    assert bpy.data.images.keys() == [IMAGE]
    assert map_names(scene[0]) == ["UVMap", "Rendered", "BLE Unwrap", "Smart UV Project"]
    assert map_names(scene[1]) == ["BLE Unwrap", "Smart UV Project"]
    maps = scene[0].data.uv_layers
    assert maps.active.name == "UVMap" and maps["Rendered"].active_render
    assert all(obj.mode == mode for obj in scene) and bpy.context.view_layer.objects.active == scene[0]
    with pytest.raises(RuntimeError, match="first"):
        compare()
    assert discard() == {"FINISHED"} and not is_there()
    assert state() == before


def test_the_maps_are_those_that_both_would_make(scene, addon, rows):
    one, other = scene
    settings = bpy.context.scene.ble_unwrap
    settings.margin, settings.texture_size = 7, (512, 512)
    compare()
    found = {name: [uvs(obj, name).copy() for obj in scene] for name in ("BLE Unwrap", "Smart UV Project")}
    for obj in scene:
        obj.data.uv_layers.active = obj.data.uv_layers["BLE Unwrap"]
        assert_good(obj)
    bpy.ops.uv.ble_unwrap(margin=7, texture_size=(512, 512), uv_map="NEW", uv_map_name="Ours")
    assert all((uvs(obj, "Ours") == held).all() for obj, held in zip(scene, found["BLE Unwrap"], strict=True))
    angle = int(rows()["Angle limit"][1].rstrip("°"))
    addon("comparison").smart_uv([one, other], margin=7, texture_size=(512, 512), angle=angle, map_name="Theirs")
    for obj, held in zip(scene, found["Smart UV Project"], strict=True):
        assert uvs(obj, "Theirs") == pytest.approx(held, abs=1e-5)


def test_the_table_tells_what_was_measured(rows):
    select(demo_meshes.spiral_ramp())
    compare()
    table = rows()
    assert list(table) == [
        *("Islands", "Seams", "Stretch", "Worst island", "Texture used", "Overlapping", "Flipped"),
        *("Seconds", "Angle limit"),
    ]
    assert table["Overlapping"] == ("0 faces", "120 faces"), "Smart UV Project lays two turns of a ramp on each other"
    assert table["Flipped"][0] == "0 faces"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("side", ["BLE", "SMART"])
def test_what_is_kept_replaces_the_active_map(scene, is_there, side, mode):
    compare()
    name = {"BLE": "BLE Unwrap", "SMART": "Smart UV Project"}[side]
    wanted = [uvs(obj, name).copy() for obj in scene]
    rendered = uvs(scene[0], "Rendered").copy()
    seams = fingerprint(scene[0])[-1]
    if mode == "EDIT":
        edit(*scene)
    assert keep(side=side) == {"FINISHED"}
    assert not is_there() and not bpy.data.images and all(obj.mode == mode for obj in scene)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [map_names(obj) for obj in scene] == [["UVMap", "Rendered"], ["UVMap"]]
    assert [obj.data.uv_layers.active.name for obj in scene] == ["UVMap", "UVMap"]
    assert all((uvs(obj) == held).all() for obj, held in zip(scene, wanted, strict=True))
    assert (uvs(scene[0], "Rendered") == rendered).all() and scene[0].data.uv_layers["Rendered"].active_render
    assert fingerprint(scene[0])[-1] == seams


def test_by_name_one_new_map_is_left(scene):
    settings = bpy.context.scene.ble_unwrap
    settings.uv_map, settings.uv_map_name = "NEW", "Bake"
    before = uvs(scene[0]).copy()
    compare()
    wanted = [uvs(obj, "Smart UV Project").copy() for obj in scene]
    keep(side="SMART")
    assert [map_names(obj) for obj in scene] == [["UVMap", "Rendered", "Bake"], ["Bake"]]
    assert all(obj.data.uv_layers.active.name == "Bake" for obj in scene)
    assert all((uvs(obj, "Bake") == held).all() for obj, held in zip(scene, wanted, strict=True))
    assert (uvs(scene[0], "UVMap") == before).all()


def test_a_map_that_has_the_name_of_a_side_is_left_alone():
    obj = mapped(cube(), "BLE Unwrap")
    select(obj)
    before = uvs(obj).copy()
    compare()
    assert map_names(obj) == ["BLE Unwrap", "BLE Unwrap.001", "Smart UV Project"]
    assert (uvs(obj) == before).all()
    bpy.context.scene.ble_unwrap.uv_map = "NEW"
    bpy.context.scene.ble_unwrap.uv_map_name = "Smart UV Project"
    keep(side="BLE")
    assert map_names(obj) == ["BLE Unwrap", "Smart UV Project"] and (uvs(obj, "BLE Unwrap") == before).all()


def test_mark_seams_holds_for_ours(scene):
    bpy.context.scene.ble_unwrap.mark_seams = True
    for side, marked in (("SMART", False), ("BLE", True)):
        compare()
        keep(side=side)
        assert (sum(edge.use_seam for edge in scene[0].data.edges) > 1) == marked


def test_pins_are_not_overwritten_unasked(scene):
    pinned = scene[0]
    edit(pinned)
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.pin()
    bpy.ops.object.mode_set(mode="OBJECT")
    select(*scene)
    compare()
    before = state()
    with pytest.raises(RuntimeError, match="pinned in UVMap"):
        keep(side="BLE")
    assert state() == before
    bpy.context.scene.ble_unwrap.move_pinned = True
    assert keep(side="BLE") == {"FINISHED"}


def test_one_is_looked_at_meanwhile(scene):
    compare()
    look(side="SMART")
    assert all(obj.data.uv_layers.active.name == "Smart UV Project" for obj in scene)
    discard()
    assert [map_names(obj) for obj in scene] == [["UVMap", "Rendered"], []]
    assert scene[0].data.uv_layers.active.name == "UVMap"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_undo_is_one_step(is_there, mode):
    obj = mapped(sphere())
    select(obj)
    if mode == "EDIT":
        edit(obj)
    bpy.ops.ed.undo_push(message="before")
    compare()
    bpy.ops.ed.undo_push(message="compare")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["Sphere"]
    assert not is_there() and map_names(obj) == ["UVMap"] and not bpy.data.images and obj.mode == mode
    assert list(bpy.data.objects.keys()) == list(bpy.data.meshes.keys()) == ["Sphere"]
    bpy.ops.ed.redo()
    assert is_there() and bpy.data.images.keys() == [IMAGE]
    assert_drawn()
    keep(side="BLE")
    bpy.ops.ed.undo_push(message="keep")
    assert not is_there()
    bpy.ops.ed.undo()
    assert is_there(), "one may choose anew"
    assert_drawn()
    assert discard() == {"FINISHED"} and map_names(bpy.data.objects["Sphere"]) == ["UVMap"]


def assert_drawn():
    image = bpy.data.images[IMAGE]
    pixels = np.empty(np.prod(image.size) * 4, np.float32)
    image.pixels.foreach_get(pixels)
    assert len(np.unique(pixels)) > 10, "Blender brings the image back without its pixels"


def test_an_image_of_the_same_name_is_left_alone(scene):
    mine = bpy.data.images.new(IMAGE, 8, 8)
    compare()
    assert set(bpy.data.images.keys()) == {IMAGE, f"{IMAGE}.001"}
    keep(side="BLE")
    assert bpy.data.images.keys() == [IMAGE] and bpy.data.images[0] == mine
    select(*scene)
    compare()
    discard()
    assert bpy.data.images.keys() == [IMAGE]


def test_too_many_maps_are_refused_in_words(scene):
    for number in range(5):
        scene[0].data.uv_layers.new(name=f"More{number}")
    before = state()
    with pytest.raises(RuntimeError, match="has 7 UV maps, and Blender allows 8; a comparison adds 2"):
        compare()
    assert state() == before


def test_nothing_to_compare_is_said():
    obj = demo_meshes.add_mesh("Points", [(0, 0, 0), (1, 0, 0)], [])
    select(obj)
    before = state()
    with pytest.raises(RuntimeError, match="no faces to unwrap"):
        compare()
    assert state() == before


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("where", ["ours", "theirs", "measuring", "writing"])
def test_after_an_error_nothing_has_changed(scene, addon, monkeypatch, is_there, mode, where):
    if mode == "EDIT":
        edit(*scene, faces=[0, 1])
    errors = addon("engine").EngineError("on purpose"), addon("mesh_arrays").MeshError("on purpose")
    calls = []

    def fail(error, after=0):
        def function(*arguments, **keywords):
            calls.append(1)
            if len(calls) > after:
                raise error
            return original(*arguments, **keywords)

        return function

    bridge = addon("mesh_bridge")
    original = bridge.write_layer
    before = state()
    with monkeypatch.context() as patch:
        if where == "ours":
            patch.setattr(addon("computation"), "unwrap", fail(errors[0]))
        elif where == "theirs":
            original = addon("comparison").smart_uv
            patch.setattr(addon("comparison"), "smart_uv", fail(RuntimeError("on purpose"), after=2))
        elif where == "measuring":
            original = addon("measurement").measure
            patch.setattr(addon("measurement"), "measure", fail(errors[0], after=1))
        else:
            patch.setattr(bridge, "write_layer", fail(errors[1], after=3))
        with pytest.raises(RuntimeError, match="on purpose"):
            compare()
    assert calls and state() == before and not is_there()
    assert compare() == {"FINISHED"}


def test_esc_leaves_everything_as_it_was(scene, addon):
    before = state()
    work = addon("smart_comparison").SmartComparison(list(scene), {})
    job = work.start()
    job.cancel()
    with pytest.raises(addon("engine").EngineCancelled):
        while not job.is_finished():
            pass
        job.result()
    assert state() == before


def test_faces_that_change_meanwhile_are_refused(scene, addon):
    work = addon("smart_comparison").SmartComparison(list(scene), {})
    result = work.run()
    edit(scene[1])
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    before = state()
    with pytest.raises(addon("mesh_arrays").MeshError, match="edited meanwhile"):
        work.finish(bpy.context, result)
    assert state() == before


def test_a_map_that_is_gone_ends_the_comparison(scene, is_there):
    compare()
    maps = scene[1].data.uv_layers
    maps.remove(maps["Smart UV Project"])
    assert not is_there()
    with pytest.raises(RuntimeError, match="no comparison to choose from"):
        keep(side="BLE")


def test_another_file_has_no_comparison(scene, is_there):
    compare()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not is_there()
