"""Checking UV maps, whoever made them: what is said, when it is no longer true, and the faces that are selected."""

import bmesh
import bpy
import numpy as np
import pytest
from scenes import add_mesh, attribute_names, edit, fingerprint, grid, select, set_uvs, sphere, uvs
from test_pack_islands import corner_vertices, rectangles

check = bpy.ops.uv.ble_unwrap_check
select_faulty = bpy.ops.mesh.ble_unwrap_select_faulty


def flat_grid(cells=6, name="Grid"):
    """A grid whose map is its own shape, at half size, in the middle of the texture."""
    obj = grid(cells, name=name)
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, np.array([vertex.co[:2] for vertex in obj.data.vertices])[corner_vertices(obj)] * 0.5 + 0.25)
    select(obj)
    return obj


@pytest.fixture
def shown(addon):
    """The lines of the check as (status, text, kind)."""
    last_check = addon("last_check")
    return lambda: [(line.status, line.text, line.kind) for line in last_check.lines()]


@pytest.fixture
def current(addon):
    def ask():
        bpy.context.view_layer.update()
        return addon("last_check").is_current(bpy.context)

    return ask


def selected_faces(obj):
    bpy.ops.object.mode_set(mode="OBJECT")
    return {face.index for face in obj.data.polygons if face.select}


def test_a_faithful_map_is_told_in_numbers(addon, shown, current):
    obj = flat_grid()
    bpy.context.scene.ble_unwrap.texture_size = (1024, 1024)
    before = fingerprint(obj), attribute_names(obj), uvs(obj).tobytes()
    assert check() == {"FINISHED"}
    assert addon("last_check").title() == "Grid: UVMap" and current()
    assert shown() == [
        ("INFO", "36 faces in 1 island", ""),
        ("OK", "Stretch 0.0 %, worst island 0.0 %", ""),
        ("OK", "No overlaps", ""),
        ("OK", "No flipped faces", ""),
        ("INFO", "25 % of the texture used", ""),
        ("INFO", "512 px/m", ""),
        ("INFO", "Seams 0 m long", ""),
    ]
    assert (fingerprint(obj), attribute_names(obj), uvs(obj).tobytes()) == before, "nothing is changed"


def test_densities_are_in_the_units_of_the_scene(shown):
    obj = flat_grid()
    bpy.context.scene.ble_unwrap.texture_size = (1024, 1024)
    obj.scale = (2, 2, 2)
    units = bpy.context.scene.unit_settings
    for system, scale, text in (
        ("METRIC", 1.0, "256 px/m"),
        ("METRIC", 0.01, "25,600 px/m"),
        ("IMPERIAL", 1.0, "78 px/ft"),
        ("NONE", 1.0, "256 px per unit"),
    ):
        units.system, units.scale_length = system, scale
        bpy.context.view_layer.update()
        check()
        assert shown()[5][1] == text


def test_islands_of_different_densities_are_told(shown):
    rectangles([(0.1, 0.1, 0.2, 0.2), (0.5, 0.5, 0.4, 0.4)])
    bpy.context.scene.ble_unwrap.texture_size = (1000, 1000)
    obj = bpy.context.object
    for vertex in obj.data.vertices[4:]:
        vertex.co = (*(obj.data.vertices[vertex.index - 4].co[:2]), 1.0)  # as large as the other one on the surface
    check()
    (told,) = (text for _, text, _ in shown() if "px/m" in text)
    assert told == "1,580 px/m, islands 1,000 to 2,000"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_flips_and_overlaps_are_found_and_selected(shown, mode):
    obj = flat_grid(8)
    values = uvs(obj).copy()
    right = values[:, 0] > 0.625
    values[right, 0] = 1.25 - values[right, 0]  # the last two columns are folded back over the two before them
    set_uvs(obj, values)
    folded = {face.index for face in obj.data.polygons if face.center.x > 0.75}
    beneath = {face.index for face in obj.data.polygons if 0.5 < face.center.x < 0.75}
    if mode == "EDIT":
        edit(obj, faces=[0])
    check()
    assert ("BAD", "32 faces overlap", "OVERLAPPING") in shown()
    assert ("BAD", "16 flipped faces", "FLIPPED") in shown()
    assert obj.mode == mode
    assert select_faulty(kind="FLIPPED") == {"FINISHED"}
    assert obj.mode == "EDIT" and selected_faces(obj) == folded
    assert select_faulty(kind="OVERLAPPING") == {"FINISHED"}
    assert selected_faces(obj) == folded | beneath


def test_overlaps_between_objects_and_outside_of_the_selection_count(shown):
    one, other = flat_grid(name="One"), flat_grid(name="Other")
    set_uvs(other, uvs(other) + 0.25)
    select(one, other)
    check()
    # A quarter of each, and no more: the third and fourth row of faces ends where the other map begins.
    assert [line for line in shown() if line[2]] == [("BAD", "18 faces overlap", "OVERLAPPING")]
    assert select_faulty(kind="OVERLAPPING") == {"FINISHED"}
    assert {obj.name for obj in bpy.context.objects_in_mode} == {"One", "Other"}
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = [[face.center for face in obj.data.polygons if face.select] for obj in (one, other)]
    assert all(center.x > 0.5 and center.y > 0.5 for center in chosen[0]) and len(chosen[0]) == 9
    assert all(center.x < 0.5 and center.y < 0.5 for center in chosen[1]) and len(chosen[1]) == 9
    # Nothing is selected and half of it hidden: it is the whole map all the same.
    edit(one, other)
    bpy.ops.mesh.select_all(action="DESELECT")
    check()
    assert ("BAD", "18 faces overlap", "OVERLAPPING") in shown()


@pytest.mark.parametrize("change", [0.2, -0.05])
def test_too_much_stretch_is_selected_where_it_is(shown, change):
    obj = flat_grid()
    values = uvs(obj).copy()
    values[values[:, 0] > 0.6, 0] += change  # the column of faces between is drawn out or pressed together
    set_uvs(obj, values)
    bpy.context.scene.ble_unwrap.stretch_limit = 1.05
    check()
    (line,) = (line for line in shown() if line[1].startswith("Stretch"))
    assert line[0] == "BAD" and line[2] == "STRETCHED"
    assert select_faulty(kind="STRETCHED") == {"FINISHED"}
    column = {face.index for face in obj.data.polygons if 0.66 < face.center.x < 0.84}
    assert selected_faces(obj) == column
    bpy.context.scene.ble_unwrap.stretch_limit = 2.0
    check()
    assert shown()[1][0] == "OK" and not shown()[1][2]


def test_faces_without_area_and_without_uvs(shown):
    obj = rectangles([(0.1, 0.1, 0.2, 0.2), (0.4, 0.4, 0.2, 0.2), (0.7, 0.7, 0.2, 0.2)])
    values = uvs(obj).copy()
    values[4:8] = 0.5
    values[8] = np.nan
    set_uvs(obj, values)
    check()
    assert ("BAD", "1 face without area in the map", "COLLAPSED") in shown()
    assert ("BAD", "1 face without UVs", "UNMAPPED") in shown()
    for kind, faces in (("COLLAPSED", {1}), ("UNMAPPED", {2})):
        assert select_faulty(kind=kind) == {"FINISHED"}
        assert selected_faces(obj) == faces


def test_stacks_are_told_apart_from_overlaps(shown):
    obj = rectangles([(0.1, 0.1, 0.2, 0.2), (0.4, 0.4, 0.2, 0.2), (0.1, 0.1, 0.2, 0.2), (0.45, 0.45, 0.2, 0.2)])
    check()
    assert ("WARN", "2 islands share pixels in 1 stack", "STACKED") in shown()
    assert ("BAD", "2 faces overlap", "OVERLAPPING") in shown()
    select_faulty(kind="STACKED")
    assert selected_faces(obj) == {0, 2}
    select_faulty(kind="OVERLAPPING")
    assert selected_faces(obj) == {1, 3}


def test_mirrored_islands_are_told_and_are_no_flips(shown):
    obj = rectangles([(0.1, 0.1, 0.2, 0.2), (0.4, 0.4, 0.2, 0.2)])
    values = uvs(obj).copy()
    values[4:] = values[:3:-1]
    set_uvs(obj, values)
    check()
    assert ("OK", "No flipped faces", "") in shown()
    assert ("WARN", "1 mirrored island", "MIRRORED") in shown()
    select_faulty(kind="MIRRORED")
    assert selected_faces(obj) == {1}


def test_distance_and_tiles(shown):
    obj = rectangles([(0.1, 0.1, 0.2, 0.2), (0.3 + 2 / 1024, 0.1, 0.2, 0.2)])
    bpy.context.scene.ble_unwrap.texture_size = (1024, 1024)
    check()
    assert ("WARN", "Islands 2.0 px apart (margin 4 px)", "") in shown()
    values = uvs(obj).copy()
    values[4:] += (1, 0)
    set_uvs(obj, values)
    check()
    assert ("OK", "Islands ≥ 8.0 px apart (margin 4 px)", "") in shown()
    assert ("INFO", "4 % of 2 tiles used", "") in shown()
    set_uvs(obj, np.add(values, (0.6, 0)))
    check()
    assert ("WARN", "Islands beyond the texture, or across tiles", "") in shown()


def test_what_the_add_on_made_is_found_to_be_as_promised(shown):
    obj = sphere(cells=6)
    select(obj)
    bpy.ops.uv.ble_unwrap()
    check()
    assert not [line for line in shown() if line[0] in {"BAD", "WARN"}]


# When it is no longer true ------------------------------------------------------------------------------------------


def move_a_uv(obj):
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    layer = edit_mesh.loops.layers.uv.active
    edit_mesh.faces.ensure_lookup_table()
    edit_mesh.faces[3].loops[0][layer].uv.x += 0.01
    bmesh.update_edit_mesh(obj.data)


def test_the_check_goes_out_of_date_when_uvs_change_and_comes_back(current):
    obj = flat_grid()
    check()
    values = uvs(obj).copy()
    set_uvs(obj, np.add(values, (0.01, 0)))
    obj.data.update()
    assert not current()
    set_uvs(obj, values)
    obj.data.update()
    assert current()
    edit(obj)
    assert current(), "edit mode alone changes nothing"
    bpy.ops.mesh.select_all(action="DESELECT")
    assert current(), "nor does a selection"
    move_a_uv(obj)
    assert not current()


def test_the_check_goes_out_of_date_when_the_shape_changes(current):
    obj = flat_grid()
    edit(obj)
    check()
    assert current()
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    edit_mesh.verts.ensure_lookup_table()
    edit_mesh.verts[10].co.z += 0.3
    bmesh.update_edit_mesh(obj.data)
    assert not current()
    edit_mesh.verts[10].co.z -= 0.3
    check()
    bpy.ops.mesh.subdivide()
    assert not current()


def test_the_check_goes_out_of_date_with_scale_map_settings_and_active_object(current):
    obj, other = flat_grid(), grid(2, name="Other")
    select(obj)
    scene = bpy.context.scene.ble_unwrap
    check()
    obj.location.x, obj.rotation_euler.z = 3.0, 0.7
    assert current(), "neither place nor rotation matters"
    obj.scale = (2, 2, 2)
    assert not current()
    obj.scale = (1, 1, 1)
    assert current()
    scene.margin = 9
    assert not current()
    scene.property_unset("margin")
    assert current()
    bpy.context.view_layer.objects.active = other
    assert not current()
    bpy.context.view_layer.objects.active = obj
    obj.data.uv_layers.active = obj.data.uv_layers.new(name="Second")
    assert not current()
    obj.data.uv_layers.active = obj.data.uv_layers["UVMap"]
    assert current()
    obj.name = "Renamed"
    assert current()
    bpy.data.objects.remove(obj)
    assert not current()


def test_undo_and_redo_are_noticed(current):
    name = flat_grid().name
    bpy.ops.ed.undo_push(message="before")
    check()
    bpy.ops.uv.ble_unwrap(stretch_limit=1.05)
    bpy.ops.ed.undo_push(message="unwrap")
    assert not current()
    bpy.ops.ed.undo()
    assert bpy.data.objects[name].data.uv_layers.active.name == "UVMap"
    assert current()
    bpy.ops.ed.redo()
    assert not current()


def test_comparing_is_no_change_itself(addon):
    """Else every comparison would be followed by another one, for as long as Blender is open."""
    obj = flat_grid()
    edit(obj)
    check()
    bpy.context.view_layer.update()
    changes = []

    def note(_scene, depsgraph):
        changes.extend(update.id.name for update in depsgraph.updates if update.is_updated_geometry)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        addon("last_check").compare()
        bpy.context.view_layer.update()
        assert not changes
        obj.update_from_editmode()
        bpy.context.view_layer.update()
        assert changes, "else this test says nothing"
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)


def test_another_file_has_no_check(addon):
    flat_grid()
    check()
    assert addon("last_check").title()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not addon("last_check").title() and not select_faulty.poll()


def test_what_cannot_be_checked_is_said():
    obj = add_mesh("Bare", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    select(obj)
    assert not check.poll()


def test_selecting_what_is_gone_says_so():
    obj = flat_grid()
    values = uvs(obj).copy()
    values[:4] += 0.1
    set_uvs(obj, values)
    check()
    obj.hide_set(True)
    assert select_faulty(kind="OVERLAPPING") == {"CANCELLED"}
