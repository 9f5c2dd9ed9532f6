"""What is drawn over meshes: that the file holds nothing of it, and that it is of what is there.

Without a window nothing is drawn; what would be is made all the same, and that is looked at here.
"""

import bmesh
import bpy
import numpy as np
import pytest
from scenes import add_mesh, attribute_names, cube, edit, fingerprint, grid, select, set_uvs, sphere, uvs
from test_check import flat_grid

show = bpy.ops.uv.ble_unwrap_show
FILLS = ("CHECKER", "STRETCH", "ISLANDS")


@pytest.fixture
def overlay(addon):
    module = addon("overlay")
    yield module
    module.turn_off()


@pytest.fixture
def pictures(overlay):
    """What would be drawn now, by object."""
    return lambda: {obj.name: picture for obj, picture in overlay.pictures()}


@pytest.fixture
def turn_on(overlay):
    def toggle(kind):
        bpy.context.view_layer.update()
        overlay.toggle(bpy.context, kind)

    return toggle


@pytest.fixture
def refresh(overlay):
    """What the timer does in a window when Blender is quiet."""

    def settle():
        bpy.context.view_layer.update()
        overlay.refresh(bpy.context)

    return settle


def inventory():
    """Every data-block with its number of users, and the custom properties of scene and window manager."""
    # Until 5.0 settings are there, empty, once anybody has looked at them, as the panel does.
    assert bpy.context.scene.ble_unwrap and bpy.context.window_manager.ble_unwrap_certificate
    blocks = {}
    for name in dir(bpy.data):
        collection = getattr(bpy.data, name)
        if isinstance(collection, bpy.types.bpy_prop_collection):
            blocks[name] = sorted((block.name, block.users) for block in collection if isinstance(block, bpy.types.ID))
    keys = sorted(bpy.context.scene.keys()), sorted(bpy.context.window_manager.keys())
    return blocks, keys


def in_faces(obj, picture):
    """The colour of each face of a mesh without modifiers, (f, 3)."""
    return picture.colours[[face.loop_start for face in obj.data.polygons], :3]


def test_without_a_window_it_is_refused_with_the_reason(overlay):
    flat_grid()
    before = inventory()
    with pytest.raises(RuntimeError, match="runs without a window"):
        show(kind="STRETCH")
    assert not overlay.is_on() and inventory() == before


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_the_file_holds_nothing_of_it(overlay, turn_on, pictures, mode):
    one, other = flat_grid(name="One"), sphere()
    other.data.uv_layers.new(name="UVMap")
    other.modifiers.new("Subdivision", "SUBSURF")
    select(one, other)
    if mode == "EDIT":
        edit(one, other, faces=[3])
    bpy.context.view_layer.update()

    def state():
        arrays = [uvs(obj).tobytes() for obj in (one, other)] if mode == "OBJECT" else []
        return [(fingerprint(obj), attribute_names(obj)) for obj in (one, other)], arrays, inventory()

    before = state()
    for kind in (*FILLS, "SEAMS"):
        turn_on(kind)
        assert set(pictures()) == {"One", "Sphere"}
        assert state() == before, kind
    turn_on("SEAMS")
    turn_on("ISLANDS")
    assert not overlay.is_on() and not pictures() and state() == before
    assert bpy.context.view_layer.objects.active == one


def test_one_fill_at_a_time_and_seams_beside_it(overlay, turn_on):
    flat_grid()
    turn_on("CHECKER")
    turn_on("SEAMS")
    turn_on("STRETCH")
    assert [overlay.is_shown(kind) for kind in (*FILLS, "SEAMS")] == [False, True, False, True]
    turn_on("STRETCH")
    assert [overlay.is_shown(kind) for kind in (*FILLS, "SEAMS")] == [False, False, False, True]
    turn_on("SEAMS")
    assert not overlay.is_on()


def test_where_there_is_no_map_it_stays_off(overlay, turn_on, addon):
    select(cube())
    with pytest.raises(addon("mesh_arrays").MeshError, match="no UV map"):
        turn_on("CHECKER")
    assert not overlay.is_on()


def test_a_checker_is_the_map_itself(turn_on, pictures):
    obj = flat_grid(3)
    turn_on("CHECKER")
    picture = pictures()["Grid"]
    assert (picture.uv == uvs(obj)).all() and picture.colours is None
    assert len(picture.triangles) == 18 and picture.triangles.max() < len(picture.positions) == 36
    corners = [obj.data.vertices[loop.vertex_index].co for loop in obj.data.loops]
    assert picture.positions == pytest.approx(np.array(corners))


def test_stretch_is_shown_where_it_is(turn_on, pictures, overlay, addon):
    obj = flat_grid()
    turn_on("STRETCH")
    neutral = addon("overlay_colours").NEUTRAL
    assert in_faces(obj, pictures()["Grid"]) == pytest.approx(np.tile(neutral, (36, 1)), abs=1e-3)
    assert overlay.worst() == pytest.approx((1.0, 1.0), abs=1e-4)
    values = uvs(obj).copy()
    values[values[:, 0] > 0.6, 0] += 1 / 12  # the column between is twice as wide in the map
    set_uvs(obj, values)
    obj.data.update()
    bpy.context.view_layer.update()
    overlay.refresh(bpy.context)
    colours = in_faces(obj, pictures()["Grid"])
    column = np.array([0.66 < face.center.x < 0.84 for face in obj.data.polygons])
    assert colours[~column] == pytest.approx(np.tile(neutral, (30, 1)), abs=1e-3)
    assert colours[column] == pytest.approx(np.tile(addon("overlay_colours").legend()[2][1], (6, 1)), abs=1e-3)
    assert overlay.worst() == pytest.approx((1.0, 2.0), rel=1e-3)


def test_stretch_is_that_of_the_shape_in_the_scene(turn_on, overlay, refresh):
    obj = flat_grid()
    turn_on("STRETCH")
    for scale, worst in (((5, 5, 5), 1.0), ((4, 1, 1), 2.0)):
        obj.scale = scale
        refresh()
        assert overlay.worst() == pytest.approx((worst, worst), rel=1e-3)


def test_each_island_has_its_colour_in_all_objects(turn_on, pictures):
    objects = []
    for name in ("One", "Other"):
        positions = [(x, y, k) for k in range(3) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        obj = add_mesh(name, positions, [tuple(range(4 * k, 4 * k + 4)) for k in range(3)])
        obj.data.uv_layers.new(name="UVMap")
        objects.append(obj)
    select(*objects)
    turn_on("ISLANDS")
    shown = np.concatenate([in_faces(obj, pictures()[obj.name]) for obj in objects])
    assert len(np.unique(shown.round(3), axis=0)) == 6


def test_lines_are_where_the_map_is_cut(turn_on, pictures):
    obj = flat_grid(2)
    turn_on("SEAMS")
    assert not len(pictures()["Grid"].lines), "the border of the mesh is no cut"
    turn_on("SEAMS")
    values = uvs(obj).copy()
    for face in obj.data.polygons:
        if face.center.x > 0.5:
            values[list(face.loop_indices), 0] += 0.1
    set_uvs(obj, values)
    obj.data.update()
    turn_on("SEAMS")
    lines = pictures()["Grid"].lines.reshape(2, 2, 3)
    assert lines[..., 0] == pytest.approx(0.5) and set(lines[..., 1].round(3).ravel()) == {0, 0.5, 1}


def test_modifiers_are_drawn_upon(turn_on, pictures):
    obj = flat_grid(2)
    obj.modifiers.new("Array", "ARRAY").count = 3
    turn_on("CHECKER")
    picture = pictures()["Grid"]
    assert len(picture.positions) == 3 * 16 and picture.positions[:, 0].max() > 2.9


def test_what_modifiers_round_is_no_cut(turn_on, pictures):
    obj = sphere(cells=6)
    select(obj)
    bpy.ops.uv.ble_unwrap()
    turn_on("ISLANDS")
    turn_on("SEAMS")
    before = pictures()["Sphere"]
    turn_on("ISLANDS")
    turn_on("SEAMS")
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 3
    turn_on("ISLANDS")
    turn_on("SEAMS")
    after = pictures()["Sphere"]
    assert len(before.lines) and len(after.lines) == 8 * len(before.lines), "each side became eight"
    assert len(np.unique(after.colours, axis=0)) == len(np.unique(before.colours, axis=0))


def test_objects_that_share_a_mesh_are_both_shown(turn_on, pictures):
    obj = flat_grid(2)
    twin = bpy.data.objects.new("Twin", obj.data)
    bpy.context.collection.objects.link(twin)
    select(obj, twin)
    turn_on("CHECKER")
    assert set(pictures()) == {"Grid", "Twin"}


def test_hidden_faces_are_left_out_in_edit_mode(turn_on, pictures, refresh):
    obj = flat_grid()
    edit(obj, faces=list(range(18)))
    bpy.ops.mesh.hide()
    turn_on("STRETCH")
    assert len(pictures()["Grid"].triangles) == 36
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not pictures(), "another mode: it is out of date"
    refresh()
    assert len(pictures()["Grid"].triangles) == 72, "as Blender shows all faces there"


def test_what_is_edited_is_what_is_shown(turn_on, pictures, refresh):
    obj = flat_grid(2)
    edit(obj)
    turn_on("CHECKER")
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    layer = edit_mesh.loops.layers.uv.active
    edit_mesh.faces.ensure_lookup_table()
    edit_mesh.faces[0].loops[0][layer].uv = (0.875, 0.0625)
    edit_mesh.verts.ensure_lookup_table()
    edit_mesh.verts[8].co = (9, 9, 9)
    bmesh.update_edit_mesh(obj.data)
    refresh()
    picture = pictures()["Grid"]
    assert tuple(picture.uv[0]) == (0.875, 0.0625) and picture.positions.max() == 9


def test_a_slow_picture_that_is_out_of_date_is_not_drawn(turn_on, pictures, refresh, overlay, monkeypatch):
    monkeypatch.setattr(overlay, "QUICK_SECONDS", -1.0)
    obj = flat_grid(2)
    turn_on("CHECKER")
    before = pictures()["Grid"]
    obj.location.x = 5
    obj.data.materials.append(None)
    bpy.context.view_layer.update()
    obj.data.vertices[0].co.z = 1
    obj.data.update()
    bpy.context.view_layer.update()
    assert not pictures()
    refresh()
    assert pictures()["Grid"] is not before and pictures()["Grid"].positions.max() == 1


def test_what_is_still_true_is_not_made_again(turn_on, pictures, refresh):
    one, other = flat_grid(2, name="One"), flat_grid(2, name="Other")
    select(one, other)
    turn_on("STRETCH")
    before = pictures()
    one.location.x, one.rotation_euler.z = 3, 1
    other.data.vertices[0].co.z = 1
    other.data.update()
    refresh()
    assert pictures()["One"] is before["One"] and pictures()["Other"] is not before["Other"]


def test_another_active_map_or_texture_is_noticed_at_once(turn_on, pictures, refresh):
    obj = flat_grid(2)
    other = obj.data.uv_layers.new(name="Other")
    turn_on("CHECKER")
    assert pictures()
    obj.data.uv_layers.active = other
    assert not pictures()
    refresh()
    assert pictures()
    bpy.context.scene.ble_unwrap.texture_size = (512, 256)
    assert not pictures()


def test_it_follows_the_selection(turn_on, pictures, refresh):
    one, other = flat_grid(2, name="One"), flat_grid(2, name="Other")
    select(one)
    turn_on("CHECKER")
    assert set(pictures()) == {"One"}
    select(other)
    refresh()
    assert set(pictures()) == {"Other"}
    other.select_set(False)
    refresh()
    assert set(pictures()) == {"Other"}, "nothing is selected: to look at it without an outline"
    bpy.data.objects.remove(other)
    assert not pictures()
    refresh()
    assert not pictures()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_undo_and_redo_bring_what_is_there_then(turn_on, pictures, refresh, overlay, monkeypatch, mode):
    monkeypatch.setattr(overlay, "QUICK_SECONDS", -1.0)
    obj = flat_grid(2)
    if mode == "EDIT":
        edit(obj)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.translate(value=(0, 0, 2))
    bpy.ops.object.mode_set(mode=mode)
    bpy.ops.ed.undo_push(message="moved")
    turn_on("CHECKER")
    assert pictures()["Grid"].positions[:, 2].max() == 2
    for step, height in ((bpy.ops.ed.undo, 0), (bpy.ops.ed.redo, 2)):
        step()
        assert not pictures(), "it is not known yet what is there"
        refresh()
        assert pictures()["Grid"].positions[:, 2].max() == height


def test_loading_a_file_turns_it_off(turn_on, overlay):
    flat_grid()
    turn_on("STRETCH")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not overlay.is_on() and not overlay.pictures() and overlay.worst() is None


def test_taking_the_addon_away_turns_it_off(turn_on, overlay, addon):
    flat_grid()
    turn_on("STRETCH")
    registration = addon("registration")
    registration.unregister()
    try:
        assert not overlay.is_on()
        functions = [f for event, _ in overlay.HANDLERS for f in getattr(bpy.app.handlers, event)]
        assert not any(f.__module__ == overlay.__name__ for f in functions)
        assert not bpy.app.timers.is_registered(overlay._settle)
    finally:
        registration.register()


def test_a_map_that_modifiers_drop_is_said(turn_on, overlay, addon):
    obj = flat_grid(2)
    tree = bpy.data.node_groups.new("Other", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    made, out = tree.nodes.new("GeometryNodeMeshCube"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(made.outputs["Mesh"], out.inputs[0])
    obj.modifiers.new("Other", "NODES").node_group = tree
    with pytest.raises(addon("mesh_arrays").MeshError, match="modifiers leave none"):
        turn_on("CHECKER")
    assert not overlay.is_on()


def test_panels_have_the_toggles_in_both_editors():
    for space in ("IMAGE", "VIEW3D"):
        panel = getattr(bpy.types, f"{space}_PT_ble_unwrap_show")
        assert panel.bl_parent_id == f"{space}_PT_ble_unwrap"


def test_a_map_of_nothing_but_broken_faces_is_shown(turn_on, pictures, overlay):
    obj = flat_grid(2)
    set_uvs(obj, np.full((16, 2), np.nan))
    for kind in FILLS:
        turn_on(kind)
        picture = pictures()["Grid"]
        assert np.isfinite(picture.uv).all() and (picture.colours is None or np.isfinite(picture.colours).all())
    assert overlay.worst() is None


def test_large_meshes_are_made_in_bulk(turn_on, pictures):
    obj = grid(350, bump=0.2)
    obj.data.uv_layers.new(name="UVMap")
    select(obj)
    for kind in FILLS:
        turn_on(kind)
        assert len(pictures()["Grid"].triangles) == 2 * 350 * 350
