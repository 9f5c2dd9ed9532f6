"""Relaxing islands that are there: which lose stretch, where they lie then, what is held, and what is told."""

import time

import bpy
import numpy as np
import pytest
from scenes import (
    attribute_names,
    cube,
    edit,
    fingerprint,
    grid,
    select,
    set_uvs,
    triangle_areas,
    uvs,
)
from test_artist_state import pin, select_uv_faces

relax, anew = bpy.ops.uv.ble_unwrap_relax, bpy.ops.uv.ble_unwrap_anew


def corner_vertices(obj):
    found = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", found)
    return found


def plan(obj):
    """Where each corner is, seen from above, (c, 2)."""
    return np.array([vertex.co[:2] for vertex in obj.data.vertices])[corner_vertices(obj)]


def hill(cells=8, name="Hill", bump=0.6):
    """A hill that is projected from above, into the lower left of the texture."""
    obj = grid(cells, name, bump)
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, 0.4 * plan(obj) + 0.05)
    select(obj)
    return obj


def halved(obj):
    """The map cut in two along the middle: which corners are in the second island, (c,) bool."""
    cells = round(len(obj.data.polygons) ** 0.5)
    second = np.repeat(np.arange(cells**2) >= cells**2 // 2, 4)
    set_uvs(obj, np.where(second[:, None], uvs(obj) + np.array([0.45, 0]), uvs(obj)))
    return second


def stretch(addon, *objects):
    return addon("comparison").measure_active(list(objects), margin=4, texture_size=(2048, 2048))["l2_chart_scale"]


def task(addon, *objects):
    return addon("relax_task").RelaxTask(list(objects), {"texture_size": (1024, 1024), "correct_aspect": True})


def summary(addon, *objects):
    """What relaxing these objects tells."""
    work = task(addon, *objects)
    return work.write(work.run()).summary


def area_and_centroid(obj):
    uv = uvs(obj)
    mesh = obj.data
    mesh.calc_loop_triangles()
    triangles = np.array([triangle.loops[:] for triangle in mesh.loop_triangles])
    areas = np.abs(triangle_areas(obj, uv))
    middles = uv.astype(float)[triangles].mean(axis=1)
    return areas.sum(), (middles * areas[:, None]).sum(axis=0) / areas.sum()


def test_an_island_loses_stretch_and_keeps_its_place_and_size(addon):
    obj = hill()
    state, attributes = fingerprint(obj), attribute_names(obj)
    before, (area, middle) = stretch(addon, obj), area_and_centroid(obj)
    assert relax() == {"FINISHED"}
    after, (area_after, middle_after) = stretch(addon, obj), area_and_centroid(obj)
    assert 1 < after < 1 + 0.8 * (before - 1)
    assert area_after == pytest.approx(area, rel=1e-4)
    np.testing.assert_allclose(middle_after, middle, atol=1e-5)
    assert (triangle_areas(obj, uvs(obj)) > 0).all()
    assert (fingerprint(obj), attribute_names(obj)) == (state, attributes)


def test_what_was_done_is_told(addon):
    obj = hill()
    text = summary(addon, obj)
    assert text.startswith("1 island relaxed, stretch 1.") and " to 1." in text
    flat = hill(name="Flat", bump=0.0)
    before = uvs(flat).copy()
    assert summary(addon, flat) == "1 island had the least stretch already"
    assert np.array_equal(uvs(flat), before)


@pytest.mark.parametrize("by_uv", [False, True])
def test_only_selected_islands_move(by_uv):
    obj = hill()
    second = halved(obj)
    before = uvs(obj).copy()
    edit(obj, faces=None if by_uv else [63])
    if by_uv:
        select_uv_faces(obj, {63})
    assert relax(by_uv=by_uv) == {"FINISHED"}
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = (uvs(obj) != before).any(axis=1)
    assert moved[second].any() and not moved[~second].any()


def test_pins_stay_to_the_bit_and_remain():
    obj = hill()
    pinned = np.flatnonzero(plan(obj)[:, 0] == 0)
    pin(obj, pinned)
    before = uvs(obj).copy()
    edit(obj)
    assert relax() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj)[pinned], before[pinned])
    assert not np.array_equal(uvs(obj), before)
    flags = np.zeros(len(obj.data.loops), bool)
    obj.data.uv_layers.active.pin.foreach_get("value", flags)
    assert np.flatnonzero(flags).tolist() == pinned.tolist()


def test_what_is_joined_stays_joined_and_seams_stay_open():
    obj = hill()
    halved(obj)

    def places():
        rows = np.column_stack([corner_vertices(obj), uvs(obj).view(np.uint32)])
        return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)

    before = places()
    relax()
    after = places()
    pairs = set(zip(before.tolist(), after.tolist(), strict=True))
    assert len(pairs) == len(set(before.tolist())) == len(set(after.tolist()))


def test_islands_with_hidden_faces_stay(addon):
    obj = hill()
    second = halved(obj)
    before = uvs(obj).copy()
    obj.data.polygons[3].hide = True
    edit(obj)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.data.polygons[3].hide = True
    bpy.ops.object.mode_set(mode="EDIT")
    text = summary(addon, obj)
    assert text.startswith("1 island relaxed") and text.endswith("1 island left in place, in part hidden")
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = (uvs(obj) != before).any(axis=1)
    assert moved[second].any() and not moved[~second].any()


def test_an_island_that_pins_keep_folded_is_named_and_the_others_are_relaxed(addon):
    obj, other = hill(name="Folded"), hill(name="Other")
    x, y = plan(obj).T
    set_uvs(obj, 0.4 * np.column_stack([np.abs(x - 0.45), y]))
    pin(obj, np.flatnonzero((x < 0.3) | (x > 0.7)))
    before = uvs(obj).copy()
    edit(obj, other)
    text = summary(addon, obj, other)
    assert text.endswith("; 1 island left as it was, because its pinned vertices turn faces over"), text
    assert text.startswith("1 island relaxed, ")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj), before)
    select(obj)
    with pytest.raises(RuntimeError, match="Nothing was relaxed: 1 island left as it was, because its pinned"):
        relax()
    pin(obj, [])
    select(obj)
    assert relax() == {"FINISHED"}
    assert (triangle_areas(obj, uvs(obj)) > 0).all()


def test_several_objects_in_edit_mode_are_islands_of_their_own():
    """Even where they lie on each other, on the surface as in the map."""
    one, other = hill(name="One"), hill(name="Other")
    alone = hill(name="Alone")
    select(alone)
    relax()
    goal = uvs(alone).copy()
    edit(one, other)
    assert relax() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    for obj in (one, other):
        np.testing.assert_allclose(uvs(obj), goal, atol=1e-6)


def test_split_vertices_do_not_part_an_island(addon):
    obj = hill()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.edge_split()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.vertices) == len(obj.data.loops)
    assert summary(addon, obj).startswith("1 island relaxed, ")
    places = np.column_stack([plan(obj), uvs(obj)])
    assert len(np.unique(places, axis=0)) == 81, "what was joined is still"


def test_undo_gives_back_the_very_uvs():
    obj = hill()
    name, before = obj.name, uvs(obj).copy()
    bpy.ops.ed.undo_push(message="before")
    relax()
    bpy.ops.ed.undo_push(message="after")
    relaxed = uvs(bpy.data.objects[name]).copy()
    assert not np.array_equal(relaxed, before)
    bpy.ops.ed.undo()
    assert np.array_equal(uvs(bpy.data.objects[name]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(uvs(bpy.data.objects[name]), relaxed)


def test_a_job_on_another_thread_gives_the_same_and_can_be_cancelled(addon):
    obj = hill()
    work, other = task(addon, obj), task(addon, obj)
    job = work.start()
    assert np.array_equal(job.result().uv, other.run().uv) and job.is_finished()
    large = hill(120, name="Large", bump=2.0)
    before = uvs(large).copy()
    job = task(addon, large).start()
    while job.stage() == "waiting" and not job.is_finished():
        time.sleep(0.01)
    job.cancel()
    with pytest.raises(addon("engine").EngineCancelled):
        job.result()
    assert np.array_equal(uvs(large), before)


def test_what_cannot_be_relaxed_is_said():
    obj = cube()
    select(obj)
    assert not relax.poll(), "there is no UV map"
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, np.full((24, 2), np.nan))
    with pytest.raises(RuntimeError, match="no finite UVs"):
        relax()
    set_uvs(obj, np.array([vertex.co for vertex in obj.data.vertices])[corner_vertices(obj)] @ np.eye(3, 2))
    with pytest.raises(RuntimeError, match=r"Nothing was relaxed: 1 island .* it has no border; give it seams"):
        relax()
    edit(obj)
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="No islands are selected"):
        relax()


def test_islands_are_unwrapped_anew_with_the_seams_that_they_have(addon):
    obj = hill()
    second = halved(obj)
    x, y = uvs(obj).T
    crushed = np.column_stack([np.abs(x - 0.2), y])
    set_uvs(obj, np.where(second[:, None], crushed, uvs(obj)))
    before = uvs(obj).copy()
    edit(obj, faces=[63])
    assert anew() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = (uvs(obj) != before).any(axis=1)
    assert moved[second].any() and not moved[~second].any()
    assert (triangle_areas(obj, uvs(obj)) > 0).all()
    np.testing.assert_allclose(np.mean(uvs(obj)[second], axis=0), np.mean(before[second], axis=0), atol=0.05)
    select(obj)
    work = addon("relax_task").RelaxTask([obj], {"texture_size": (64, 64), "correct_aspect": True}, anew=True)
    assert "island" in work.write(work.run()).summary
    pin(obj, np.flatnonzero(second))
    with pytest.raises(RuntimeError, match=r"Nothing was unwrapped anew: 1 island .* all of it is pinned"):
        edit(obj, faces=[63])
        anew()


def test_the_proportions_of_the_image_count(addon):
    obj = hill(bump=0.0)
    set_uvs(obj, 0.2 * plan(obj) * (1, 4))
    material = bpy.data.materials.new("M")
    material.use_nodes = True
    material.node_tree.nodes.new("ShaderNodeTexImage").image = bpy.data.images.new("Wide", 1024, 256)
    obj.data.materials.append(material)
    assert summary(addon, obj) == "1 island had the least stretch already"


def test_the_menu_has_an_entry(addon):
    functions = getattr(bpy.types.IMAGE_MT_uvs.draw, "_draw_funcs", [])
    assert sum(function is addon("menu").draw_island_entries for function in functions) == 1
    assert relax.get_rna_type().name == "Relax Islands (BLE)"
    assert anew.get_rna_type().name == "Re-unwrap Islands (BLE)"
