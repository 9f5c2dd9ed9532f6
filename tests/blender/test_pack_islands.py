"""Packing islands that are there: which move, which stay, and that they keep their shape."""

import itertools
import time

import bmesh
import bpy
import numpy as np
import pytest
from scenes import (
    add_mesh,
    attribute_names,
    certificate,
    cube,
    edit,
    fingerprint,
    grid,
    select,
    set_uvs,
    sphere,
    triangle_areas,
    uvs,
)
from test_artist_state import pin, select_uv_faces

pack = bpy.ops.uv.ble_unwrap_pack

# Lower left corners and extents: two lie on each other in part, one is beyond the texture.
BOXES = [
    (0.1, 0.1, 0.3, 0.2),
    (0.2, 0.15, 0.3, 0.3),
    (1.5, 0.2, 0.1, 0.4),
    (0.6, 0.6, 0.2, 0.1),
    (0.0, 0.7, 0.25, 0.25),
]
UNIT = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)


def rectangles(boxes=BOXES, name="Rectangles"):
    """A mesh of loose quads, each an island of the UV map that lies where its box is."""
    corners = np.concatenate([np.array(box[:2]) + UNIT * box[2:] for box in boxes])
    places = np.column_stack([corners, np.repeat(np.arange(len(boxes)), 4)])
    obj = add_mesh(name, places, np.arange(4 * len(boxes)).reshape(-1, 4))
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, corners)
    select(obj)
    return obj


def shapes(obj, corners_of, size=(1, 1)):
    """All distances between the corners of each island, in the proportions of a texture."""
    uv = uvs(obj).astype(float) * size
    return [np.linalg.norm(uv[corners][:, None] - uv[corners][None], axis=-1) for corners in corners_of]


def assert_one_scale(before, after):
    """What is left of islands that were moved, turned and scaled by one factor; returns the factor."""
    factor = sum(map(np.sum, after)) / sum(map(np.sum, before))
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(other, factor * one, atol=2e-6 * max(1.0, other.max()))
    return factor


def quads(obj):
    return np.arange(len(obj.data.loops)).reshape(-1, 4)


def measured(addon, *objects, size=(2048, 2048), margin=4):
    return addon("comparison").measure_active(list(objects), margin=margin, texture_size=size)


def task(addon, *objects, **settings):
    """A task as the operator makes it, its own settings at their defaults."""
    properties = addon("properties")
    settings = {name: properties.default_values()[name] for name in properties.PACK_SETTINGS} | settings
    own = {"scale": "UNIFORM", "keep_unselected": True, "lock_pinned": True, "keep_stacks": True}
    return addon("pack_task").PackTask(list(objects), own | settings)


def test_all_islands_of_an_object_keep_their_shape_and_their_margin(addon):
    obj = rectangles()
    before, state, attributes = shapes(obj, quads(obj)), fingerprint(obj), attribute_names(obj)
    assert pack(rotation="ANY") == {"FINISHED"}
    assert_one_scale(before, shapes(obj, quads(obj)))
    found = measured(addon, obj)
    assert (found["islands"], found["overlaps"], found["flips"]) == (5, 0, 0)
    assert found["gap_texels"] >= 4 - 0.01 and found["packing_efficiency"] > 0.5
    assert uvs(obj).min() >= 0 and uvs(obj).max() <= 1
    assert (fingerprint(obj), attribute_names(obj)) == (state, attributes)
    once = uvs(obj).copy()
    pack(rotation="ANY")
    assert measured(addon, obj)["overlaps"] == 0 and once.shape == uvs(obj).shape


def test_several_objects_get_one_layout(addon):
    objects = [rectangles(name="A"), rectangles(BOXES[:2], name="B")]
    select(*objects)
    before = [shape for obj in objects for shape in shapes(obj, quads(obj))]
    assert pack(keep_stacks=False) == {"FINISHED"}
    assert_one_scale(before, [shape for obj in objects for shape in shapes(obj, quads(obj))])
    found = measured(addon, *objects)
    assert (found["islands"], found["overlaps"]) == (7, 0)


@pytest.mark.parametrize("by_uv", [False, True])
def test_unselected_islands_stay_and_are_packed_around(addon, by_uv):
    obj = rectangles([(0.4, 0.4, 0.2, 0.2), *BOXES])
    before = uvs(obj).copy()
    edit(obj, faces=None if by_uv else [1, 3, 5])
    if by_uv:
        select_uv_faces(obj, {1, 3, 5})
    assert pack(by_uv=by_uv) == {"FINISHED"}
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = (uvs(obj) != before).any(axis=1).reshape(-1, 4)
    assert moved.any(axis=1).tolist() == [False, True, False, True, False, True]
    # The three that moved overlap nothing; two of those that stayed did so before.
    for one, other in itertools.combinations(range(6), 2):
        if {one, other} & {1, 3, 5}:
            gap = box_gap(uvs(obj)[quads(obj)[one]], uvs(obj)[quads(obj)[other]]) * 2048
            assert gap >= 4 - 0.01 or max(one, other) == 3, (one, other, gap)
    select(obj)


def box_gap(one, other):
    """Distance of two rectangles along the axes."""
    apart = np.maximum(other.min(axis=0) - one.max(axis=0), one.min(axis=0) - other.max(axis=0))
    return np.linalg.norm(np.maximum(apart, 0)) if (apart > 0).any() else apart.max()


def test_an_island_moves_as_a_whole_where_one_face_is_selected():
    obj = grid(4)
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, np.array([vertex.co[:2] for vertex in obj.data.vertices])[corner_vertices(obj)] * 0.3 + 0.5)
    before = shapes(obj, [np.arange(64)])
    edit(obj, faces=[5])
    assert pack() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert assert_one_scale(before, shapes(obj, [np.arange(64)])) > 3


def corner_vertices(obj):
    found = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", found)
    return found


def test_islands_in_part_hidden_stay_and_are_told(addon):
    obj = grid(4)
    obj.data.uv_layers.new(name="UVMap")
    places = np.array([vertex.co[:2] for vertex in obj.data.vertices])[corner_vertices(obj)]
    set_uvs(obj, np.where(np.repeat(np.arange(16) < 8, 4)[:, None], places * 0.4, places * 0.4 + (0.5, 0)))
    before = uvs(obj).copy()
    edit(obj)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.data.polygons[3].hide = True
    bpy.ops.object.mode_set(mode="EDIT")
    work = task(addon, obj)
    assert work.write(work.run()).summary.endswith(
        "around 1 island that stayed, 1 island left in place, in part hidden"
    )
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = (uvs(obj) != before).any(axis=1)
    assert not moved[:32].any() and moved[32:].all()


@pytest.mark.parametrize("lock", [False, True])
def test_pinned_islands_stay_unless_they_may_move(addon, lock):
    obj = rectangles()
    pin(obj, [5])
    before = uvs(obj).copy()
    assert pack(lock_pinned=lock) == {"FINISHED"}
    moved = (uvs(obj) != before).any(axis=1).reshape(-1, 4).any(axis=1)
    assert moved.tolist() == [True, not lock, True, True, True]
    assert measured(addon, obj)["overlaps"] == 0
    pins = np.zeros(20, bool)
    obj.data.uv_layers.active.pin.foreach_get("value", pins)
    assert np.flatnonzero(pins).tolist() == [5]


def test_where_all_is_pinned_nothing_is_done():
    obj = rectangles(BOXES[:1])
    pin(obj, [0])
    before = uvs(obj).copy()
    with pytest.raises(RuntimeError, match="Nothing can be moved: 1 island left in place, pinned"):
        pack()
    assert np.array_equal(uvs(obj), before)


def test_stacks_stay_stacked_unless_they_are_to_be_parted(addon):
    first = np.array([(0.1, 0.1), (0.5, 0.1), (0.4, 0.3), (0.1, 0.35)])
    mirrored = (first * (-1, 1) + (0.6, 0.0))[::-1]
    obj = rectangles([(0, 0, 1, 1)] * 5)
    # Three copies, one of them beginning at another corner and a thousandth of a pixel off; a mirrored one elsewhere,
    # and one that covers the same place but is another shape.
    values = np.concatenate([first, np.roll(first, 1, axis=0) + 5e-7, first[::-1], mirrored, 0.97 * first + 0.02])
    set_uvs(obj, values)
    before = shapes(obj, quads(obj))
    work = task(addon, obj)
    outcome = work.write(work.run())
    assert outcome.summary.startswith("5 islands packed (3 in 1 stack), ")
    assert_one_scale(before, shapes(obj, quads(obj)))
    uv = uvs(obj).reshape(5, 4, 2)
    np.testing.assert_allclose(uv[2], uv[0][::-1], atol=1e-6)
    np.testing.assert_allclose(uv[1], np.roll(uv[0], 1, axis=0), atol=1e-5)
    assert (triangle_areas(obj, uvs(obj)).reshape(5, 2).sum(axis=1) < 0).tolist() == [False, False, True, False, False]
    stacked = np.ptp(uv[0], axis=0).max()
    assert pack(keep_stacks=False) == {"FINISHED"}
    assert measured(addon, obj)["overlaps"] == 0
    assert np.ptp(uvs(obj).reshape(5, 4, 2)[0], axis=0).max() < stacked


def test_islands_of_one_box_but_another_shape_are_no_stack(addon):
    """Whichever comes first: all corners of a square are corners of one with a notch, too."""
    square = UNIT * 0.2 + 0.1
    notched = np.concatenate([square, [(0.2, 0.2)]])
    islands = [square, notched, *(np.add(island, (0.5, 0.0)) for island in (notched, square))]
    points = np.concatenate(islands)
    ends = np.cumsum([len(island) for island in islands])
    faces = [tuple(range(end - len(island), end)) for end, island in zip(ends, islands, strict=True)]
    obj = add_mesh("Notched", np.column_stack([points, np.arange(len(points))]), faces)
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, points)
    select(obj)
    work = task(addon, obj)
    assert work.write(work.run()).summary.startswith("4 islands packed, ")


def test_islands_in_the_proportions_of_the_image_keep_them(addon):
    obj = rectangles()
    image = bpy.data.images.new("Wide", 1024, 256)
    material = bpy.data.materials.new("M")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    obj.data.materials.append(material)
    before = shapes(obj, quads(obj), (4, 1))
    assert pack(rotation="QUARTER", texture_size=(1024, 1024)) == {"FINISHED"}
    assert_one_scale(before, shapes(obj, quads(obj), (4, 1)))
    assert measured(addon, obj, size=(1024, 256))["overlaps"] == 0
    assert measured(addon, obj, size=(1024, 256))["gap_texels"] >= 4 - 0.01


def test_a_size_that_is_kept_and_an_error_that_changes_nothing(addon):
    obj = rectangles()
    before = shapes(obj, quads(obj))
    assert pack(scale="FIXED") == {"FINISHED"}
    assert assert_one_scale(before, shapes(obj, quads(obj))) == pytest.approx(1.0, abs=1e-6)
    set_uvs(obj, 3 * uvs(obj))
    large = uvs(obj).copy()
    edit(obj)
    with pytest.raises(RuntimeError, match="times as large"):
        pack(scale="FIXED")
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj), large)


def test_where_what_stays_leaves_no_room_the_way_out_is_named():
    obj = rectangles([(0, 0, 1, 1), (0.2, 0.2, 0.1, 0.1)])
    edit(obj, faces=[1])
    with pytest.raises(RuntimeError, match=r"no room for 1 chart.* turn off Around Unselected"):
        pack()
    assert pack(keep_unselected=False) == {"FINISHED"}


def test_islands_are_spread_over_tiles(addon):
    obj = rectangles()
    before = shapes(obj, quads(obj))
    pack(tiles=4)
    assert_one_scale(before, shapes(obj, quads(obj)))
    assert uvs(obj).max() > 1
    assert not (np.ptp(np.floor(uvs(obj).reshape(5, 4, 2)), axis=1) > 0).any(), "no island crosses a border of tiles"


def test_undo_gives_back_the_very_uvs():
    obj = rectangles()
    name, before = obj.name, uvs(obj).copy()
    bpy.ops.ed.undo_push(message="before")
    pack()
    bpy.ops.ed.undo_push(message="after")
    packed = uvs(bpy.data.objects[name]).copy()
    assert not np.array_equal(packed, before)
    bpy.ops.ed.undo()
    assert np.array_equal(uvs(bpy.data.objects[name]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(uvs(bpy.data.objects[name]), packed)


def test_what_cannot_be_packed_is_said():
    obj = cube()
    select(obj)
    assert not pack.poll(), "there is no UV map"
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, np.full((24, 2), np.nan))
    with pytest.raises(RuntimeError, match="no finite UVs"):
        pack()
    set_uvs(obj, np.zeros((24, 2)))
    with pytest.raises(RuntimeError, match="no larger than a point"):
        pack()
    edit(obj)
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="No islands are selected"):
        pack()


def test_an_object_without_a_map_is_left_out_with_a_note(addon):
    obj, bare = rectangles(), cube("Bare")
    select(obj, bare)
    work = task(addon, obj, bare)
    assert work.write(work.run()).warnings == ["Bare: no UV map, so there are no islands"]
    assert not bare.data.uv_layers


def test_a_job_on_another_thread_gives_the_same_and_can_be_cancelled(addon):
    obj = rectangles()
    work, other = task(addon, obj), task(addon, obj)
    job = work.start()
    assert np.array_equal(job.result().uv, other.run().uv) and job.is_finished()
    rng = np.random.default_rng(1)
    boxes = np.column_stack([np.zeros((20_000, 2)), 0.1 + rng.random((20_000, 2))])
    many = rectangles(boxes, name="Many")
    before = uvs(many).copy()
    job = task(addon, many, quality="HIGH", keep_stacks=False).start()
    while job.stage() == "waiting" and not job.is_finished():
        time.sleep(0.01)
    assert job.progress() < 0.2, "packing is all that is to be done, not the end of an unwrap"
    job.cancel()
    with pytest.raises(addon("engine").EngineCancelled):
        job.result()
    assert np.array_equal(uvs(many), before)


def test_settings_come_from_the_sidebar_and_go_back_to_it(addon):
    """By the functions that the operator does it with: without a window, Blender invokes none."""
    properties = addon("properties")
    scene = bpy.context.scene.ble_unwrap
    scene.margin, scene.rotation, scene.preset = 16, "NONE", "LIGHTMAP"
    operator = bpy.context.window_manager.operator_properties_last("uv.ble_unwrap_pack")
    operator.quality = "HIGH"
    properties.copy_unset(operator, scene, properties.PACK_SETTINGS)
    assert (operator.margin, operator.rotation, operator.quality) == (16, scene.rotation, "HIGH")
    assert operator.mip_levels == scene.mip_levels == 2
    operator.margin, operator.texture_size = 9, (512, 512)
    properties.copy_named(operator, scene, properties.PACK_SETTINGS)
    assert (scene.margin, *scene.texture_size, scene.quality) == (9, 512, 512, "HIGH")
    obj = rectangles()
    pack(margin=5)
    assert scene.margin == 9, "a script's call is its own affair"
    assert obj.data.uv_layers.active.name == "UVMap"


def test_the_uv_selection_is_left_as_it_was():
    obj = rectangles()
    edit(obj)
    select_uv_faces(obj, {1, 3})
    pack(by_uv=True)
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    if hasattr(bmesh.types.BMFace, "uv_select"):
        chosen = {face.index for face in edit_mesh.faces if face.uv_select}
    else:
        layer = edit_mesh.loops.layers.uv.active
        chosen = {face.index for face in edit_mesh.faces if all(loop[layer].select for loop in face.loops)}
    assert chosen == {1, 3}


def test_split_vertices_do_not_part_an_island(addon):
    """Files often split vertices at every face: what touches on the surface and in the map is one island."""
    positions = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0)], float
    )
    obj = add_mesh("Split", positions, [(0, 1, 2, 3), (4, 5, 6, 7)])
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, positions[:, :2] * 0.2)
    select(obj)
    before = shapes(obj, [np.arange(8)])
    pack()
    assert_one_scale(before, shapes(obj, [np.arange(8)]))


def test_linked_meshes_stay_and_are_named(addon, tmp_path):
    obj = rectangles(name="Linked")
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {obj})
    bpy.data.objects.remove(obj)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Linked"]
    (linked,) = wanted.objects
    bpy.context.collection.objects.link(linked)
    own = rectangles(name="Own")
    select(own, linked)
    work = task(addon, own, linked)
    assert work.write(work.run()).warnings == ["Linked: linked from another file, so its islands stay"]
    assert measured(addon, own)["overlaps"] == 0
    select(linked)
    with pytest.raises(RuntimeError, match="Linked: its mesh is linked"):
        pack()


def test_the_last_result_is_put_away_until_undo(addon):
    """It was of the UVs before."""
    obj = cube()
    select(obj)
    bpy.ops.uv.ble_unwrap()
    bpy.ops.ed.undo_push(message="unwrap")
    holds = addon("last_result").is_true
    assert holds(bpy.context)
    pack(margin=40)
    assert not holds(bpy.context)
    bpy.ops.ed.undo_push(message="pack")
    bpy.ops.ed.undo()
    assert holds(bpy.context)


def test_what_was_unwrapped_alone_is_packed_around_the_rest(addon):
    obj = sphere(cells=6)
    select(obj)
    bpy.ops.uv.ble_unwrap()
    before = uvs(obj).copy()
    chosen = [face.index for face in obj.data.polygons if face.center.z > 0.3]
    edit(obj, faces=chosen)
    bpy.ops.uv.ble_unwrap()
    assert any("press Pack Only" in text for _, text in certificate())
    pack()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert measured(addon, obj)["overlaps"] == 0
    kept = ~np.repeat(np.isin(np.arange(len(obj.data.polygons)), chosen), 4)
    assert np.array_equal(uvs(obj)[kept], before[kept])
