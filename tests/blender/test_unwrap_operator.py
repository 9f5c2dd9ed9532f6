"""The operator on every kind of selection."""

import bpy
import numpy as np
import pytest
from scenes import (
    add_mesh,
    assert_good,
    certificate,
    cube,
    edit,
    fingerprint,
    grid,
    n_gons,
    select,
    set_uvs,
    sphere,
    surface_areas,
    triangle_areas,
    uvs,
)

unwrap = bpy.ops.uv.ble_unwrap


def overlaps(addon, *objects):
    return addon("comparison").overlapping_faces(list(objects))


def refused(match, **settings):
    """The operator reports an error, which Python sees as an exception."""
    with pytest.raises(RuntimeError, match=match):
        unwrap(**settings)


def test_object_mode(addon):
    obj = sphere()
    before = fingerprint(obj)
    assert unwrap() == {"FINISHED"}
    assert fingerprint(obj) == before
    assert [layer.name for layer in obj.data.uv_layers] == ["UVMap"]
    assert_good(obj)
    assert overlaps(addon, obj) == 0
    assert all(status in {"OK", "INFO"} for status, _ in certificate())


def test_edit_mode_gives_the_same_uvs_and_stays_in_edit_mode():
    obj = sphere()
    unwrap()
    expected = uvs(obj)
    edit(obj)
    assert unwrap() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj), expected)


def test_flat_sheet_is_reproduced():
    obj = grid(8)
    unwrap(margin=0.0)
    ratio = triangle_areas(obj, uvs(obj)) / surface_areas(obj)
    assert np.ptp(ratio) < 1e-3 * ratio.mean()


def test_several_objects_share_one_atlas_and_one_density(addon):
    first, second = cube("A"), sphere("B")
    second.scale = (3, 3, 3)
    second.location.x = 5
    bpy.context.view_layer.update()
    select(first, second)
    assert unwrap() == {"FINISHED"}
    for obj in (first, second):
        assert_good(obj)
    assert overlaps(addon, first, second) == 0
    density = [
        triangle_areas(obj, uvs(obj)).sum() / (surface_areas(obj).sum() * obj.scale.x**2) for obj in (first, second)
    ]
    assert density[1] == pytest.approx(density[0], rel=0.05)


def test_several_objects_in_edit_mode(addon):
    first, second = cube("A"), sphere("B")
    edit(first, second)
    assert unwrap() == {"FINISHED"}
    assert {obj.mode for obj in (first, second)} == {"EDIT"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_good(first)
    assert_good(second)
    assert overlaps(addon, first, second) == 0


def test_edit_mode_leaves_selected_objects_outside_it_alone():
    edited, other = cube("A"), sphere("B")
    edit(edited)
    other.select_set(True)
    assert unwrap() == {"FINISHED"}
    assert (edited.mode, other.mode) == ("EDIT", "OBJECT")
    assert other.select_get()
    assert len(other.data.uv_layers) == 0


def test_linked_duplicates_are_unwrapped_once(addon):
    first = cube("A")
    second = first.copy()
    bpy.context.collection.objects.link(second)
    bpy.context.view_layer.update()
    select(first, second)
    assert len(addon("targets").target_objects(bpy.context)) == 1
    assert unwrap() == {"FINISHED"}
    assert_good(first)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_copies_of_the_mesh_are_left_alone(mode):
    """Blender shares the arrays of copied meshes until one is written: writing must not reach through."""
    obj = sphere("A")
    obj.data.uv_layers.new(name="UVMap")
    copy = obj.copy()
    copy.data = obj.data.copy()
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.update()
    select(obj)
    before, seams = uvs(copy).copy(), fingerprint(copy)
    if mode == "EDIT":
        edit(obj)
    unwrap(mark_seams=True)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(copy), before)
    assert fingerprint(copy) == seams


def test_selected_faces_only():
    obj = grid(6, bump=0.3)
    unwrap()
    before = uvs(obj).copy()
    chosen = [0, 1, 6, 7, 20]
    edit(obj, faces=chosen)
    assert unwrap(use_selection=True) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    after = uvs(obj)
    inside = np.repeat(np.isin(np.arange(36), chosen), 4)
    assert np.array_equal(after[~inside], before[~inside])
    assert (after[inside] != before[inside]).any(axis=1).all()
    picked = np.empty(len(obj.data.polygons), bool)
    obj.data.polygons.foreach_get("select", picked)
    assert np.flatnonzero(picked).tolist() == chosen


def test_all_faces_in_edit_mode_when_asked():
    obj = grid(6)
    edit(obj, faces=[3])
    unwrap(use_selection=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_good(obj)


def test_selection_keeps_its_place_in_the_texture():
    obj = grid(6)
    unwrap()
    values = uvs(obj) * np.float32(0.25) + np.float32((0.5, 0.125))
    set_uvs(obj, values)
    edit(obj)
    assert unwrap(use_original_bounds=True, texture_size=(1024, 1024), margin=2.0) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = assert_good(obj)
    assert (uv.min(axis=0) >= values.min(axis=0) - 1e-6).all()
    assert (uv.max(axis=0) <= values.max(axis=0) + 1e-6).all()


def test_a_texel_density_counts_in_lengths_of_the_scene_over_tiles():
    obj = cube()
    obj.scale = (2, 2, 2)
    for edge in obj.data.edges:
        edge.use_seam = True
    bpy.context.view_layer.update()
    pixels = 512
    assert unwrap(tiles=20, texel_density=60.0, texture_size=(pixels, pixels)) == {"FINISHED"}
    uv = uvs(obj)
    density = np.sqrt(triangle_areas(obj, uv) * pixels**2 / (surface_areas(obj) * 4))
    np.testing.assert_allclose(density, 60, rtol=1e-3)
    # Four squares of 240 pixels have room in a tile.
    assert len(np.unique(np.floor(uv).astype(int), axis=0)) == 2
    assert all(status in {"OK", "INFO"} for status, _ in certificate())
    (line,) = [text for _, text in certificate() if " used" in text]
    assert "2 tiles used, 60 px per unit of length" in line


def test_a_texel_density_that_does_not_fit_is_a_warning():
    cube()
    assert unwrap(tiles=2, texel_density=9000.0, texture_size=(256, 256)) == {"FINISHED"}
    assert any(status == "WARN" and "does not fit into 2 tiles" in text for status, text in certificate())


def test_a_place_that_is_kept_has_no_tiles():
    obj = grid(4)
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, uvs(obj) * np.float32(0.25) + np.float32((0.5, 0.125)))
    edit(obj)
    assert unwrap(use_original_bounds=True, tiles=4, texture_size=(1024, 1024)) == {"FINISHED"}
    assert any("there is only one tile" in text for _, text in certificate())
    bpy.ops.object.mode_set(mode="OBJECT")
    assert uvs(obj).max() <= 1


def test_nothing_selected_is_an_error():
    obj = grid()
    edit(obj, faces=[])
    refused("No faces are selected")
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.uv_layers) == 0


def test_hidden_faces_are_unwrapped_in_object_mode():
    obj = grid()
    obj.data.polygons[4].hide = True
    unwrap()
    assert_good(obj)
    assert obj.data.polygons[4].hide


def test_n_gons():
    obj = n_gons()
    before = fingerprint(obj)
    unwrap()
    assert_good(obj)
    assert fingerprint(obj) == before


def test_shape_keys_and_modifiers_are_left_alone():
    obj = sphere()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Tall")
    for point in key.data:
        point.co.z *= 3
    key.value = 1.0
    obj.modifiers.new("Subdivision", "SUBSURF")
    before = fingerprint(obj)
    tall = [tuple(point.co) for point in key.data]
    assert unwrap() == {"FINISHED"}
    assert_good(obj)
    assert fingerprint(obj) == before
    assert [tuple(point.co) for point in obj.data.shape_keys.key_blocks["Tall"].data] == tall
    assert [modifier.type for modifier in obj.modifiers] == ["SUBSURF"]


def test_edit_mode_with_shape_keys():
    obj = sphere()
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Other")
    obj.active_shape_key_index = 1
    edit(obj)
    assert unwrap() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_good(obj)


def test_active_map_is_written_and_others_are_kept():
    obj = cube()
    maps = obj.data.uv_layers
    maps.new(name="first")
    maps.new(name="second")
    maps.active = maps["second"]
    before = uvs(obj, "first").copy()
    unwrap()
    assert np.array_equal(uvs(obj, "first"), before)
    assert maps.active.name == "second"
    assert_good(obj)


def test_new_map_is_made_by_name():
    obj = cube()
    obj.data.uv_layers.new(name="old")
    before = uvs(obj, "old").copy()
    unwrap(uv_map="NEW", uv_map_name="baked")
    assert obj.data.uv_layers.active.name == "baked"
    assert np.array_equal(uvs(obj, "old"), before)
    assert_good(obj)


def test_eight_maps():
    obj = cube()
    for number in range(8):
        obj.data.uv_layers.new(name=f"map {number}")
    before = [uvs(obj, f"map {number}").copy() for number in range(8)]
    refused("8 UV maps already", uv_map="NEW")
    assert all(np.array_equal(uvs(obj, f"map {number}"), before[number]) for number in range(8))
    active = obj.data.uv_layers.active.name
    assert unwrap() == {"FINISHED"}
    assert len(obj.data.uv_layers) == 8
    assert obj.data.uv_layers.active.name == active
    assert_good(obj)


def test_a_limit_over_the_atlas_is_certified_as_such(addon):
    obj = sphere(cells=12)
    unwrap(stretch_limit=1.01)
    alone = certificate()
    unwrap(stretch_limit=1.01, limit_over="ATLAS")
    together = certificate()
    assert_good(obj)
    for lines in (alone, together):
        assert all(status in {"OK", "INFO"} for status, _ in lines), lines
    charts = [int(lines[0][1].split(" in ")[1].split()[0]) for lines in (alone, together)]
    assert charts[1] <= charts[0], charts
    surface_report = addon("surface_report")
    measured = {"l2_worst_chart": 1.2, "l2_chart_scale": 1.05}
    assert surface_report.certify(measured, margin=4, stretch_limit=1.1, limit_over="ATLAS").holds
    assert not surface_report.certify(measured, margin=4, stretch_limit=1.1).holds
    broken = surface_report.certify(measured, margin=4, stretch_limit=1.01, limit_over="ATLAS").violations
    assert broken == ["the atlas has stretch 1.050, limit is 1.01"]


def test_the_redo_panel_finds_the_analysis_and_gives_the_same(addon):
    kept_analysis = addon("kept_analysis")
    obj = sphere()
    results, first = [], None
    for limit in (1.1, 1.01, 1.1):
        unwrap(stretch_limit=limit)
        results.append(uvs(obj).copy())
        kept = kept_analysis._Kept.analysis
        assert kept is not None and (first is None or kept is first)
        first = kept
    assert np.array_equal(results[0], results[2]) and not np.array_equal(results[0], results[1])
    kept_analysis.forget()
    unwrap(stretch_limit=1.01)
    assert np.array_equal(uvs(obj), results[1]) and kept_analysis._Kept.analysis is not first
    first = kept_analysis._Kept.analysis
    obj.data.vertices[0].co.z += 0.1
    unwrap(stretch_limit=1.01)
    assert kept_analysis._Kept.analysis is not first, "another mesh"
    first = kept_analysis._Kept.analysis
    unwrap(stretch_limit=1.01, weld=True)
    assert kept_analysis._Kept.analysis is not first, "another surface"
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert kept_analysis._Kept.analysis is None


def triangle_soup(noise):
    """A bent sheet as triangles that share no vertex, every coordinate a little off."""
    x, y = (a.reshape(-1) for a in np.meshgrid(np.linspace(0, 2, 13), np.linspace(0, 1, 9), indexing="ij"))
    positions = np.stack([x, y, 0.3 * np.sin(4 * x)], axis=1)
    first = (np.arange(12)[:, None] * 9 + np.arange(8)).reshape(-1, 1)
    corners = (first + np.array([0, 9, 10, 0, 10, 1])).reshape(-1)
    noise = np.random.default_rng(22).normal(0, noise, (len(corners), 3))
    return add_mesh("Soup", positions[corners] + noise, np.arange(len(corners)).reshape(-1, 3))


def test_welding_takes_the_last_digits_of_coordinates_or_a_distance_that_is_given():
    obj = triangle_soup(noise=1e-7)
    before = fingerprint(obj)
    assert unwrap(weld=True) == {"FINISHED"}
    assert fingerprint(obj) == before
    assert "in 1 chart" in certificate()[0][1], certificate()
    assert len(np.unique(uvs(obj), axis=0)) == 117
    coarse = triangle_soup(noise=1e-3)
    unwrap(weld=True, weld_distance=0.01)
    # The written UVs are measured with the same distance: no seams, one chart.
    assert "in 1 chart" in certificate()[0][1], certificate()
    assert len(np.unique(uvs(coarse), axis=0)) == 117


def test_non_uniform_scale_unwraps_what_is_seen():
    obj = grid(8)
    obj.scale = (4, 1, 1)
    bpy.context.view_layer.update()
    unwrap(margin=0.0, rotation="NONE")
    uv = uvs(obj)
    # The sheet is seen as 4 by 1: its UVs must be so too, in whichever direction they lie.
    extent = np.sort(np.ptp(uv, axis=0))
    assert extent[1] / extent[0] == pytest.approx(4, rel=0.01)
    assert any("non-uniform scale" in text for status, text in certificate() if status == "WARN")


def test_mirrored_object_is_not_flipped():
    obj = sphere()
    obj.scale = (-1, 1, 1)
    bpy.context.view_layer.update()
    unwrap()
    assert_good(obj)


def test_non_square_texture_keeps_proportions():
    obj = grid(8)
    unwrap(texture_size=(2048, 1024), margin=0.0, rotation="NONE")
    extent = np.ptp(uvs(obj), axis=0) * (2048, 1024)
    assert extent[0] / extent[1] == pytest.approx(1, rel=0.01)


def test_empty_mesh():
    obj = add_mesh("Empty", np.zeros((0, 3)), [])
    before = fingerprint(obj)
    refused("no faces")
    assert fingerprint(obj) == before
    assert len(obj.data.uv_layers) == 0


def test_empty_mesh_among_others():
    empty, full = add_mesh("Empty", np.zeros((0, 3)), []), cube()
    select(empty, full)
    assert unwrap() == {"FINISHED"}
    assert_good(full)


def test_degenerate_mesh_does_not_fail():
    positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (5, 5, 5), (5, 5, 5), (5, 5, 5)]
    obj = add_mesh("Degenerate", positions, [(0, 1, 2), (0, 1, 3), (4, 5, 6)])
    assert unwrap() == {"FINISHED"}
    assert np.isfinite(uvs(obj)).all()


def test_vertex_that_is_not_finite_is_named_and_changes_nothing_or_is_reported():
    obj = grid()
    obj.data.vertices[10].co.x = float("nan")
    before = fingerprint(obj)
    try:
        unwrap()
    except RuntimeError as error:
        assert "finite" in str(error)
        assert len(obj.data.uv_layers) == 0
    else:
        assert any(status in {"BAD", "WARN"} for status, _ in certificate())
        assert np.isfinite(uvs(obj)).all()
    assert fingerprint(obj) == before


def test_setting_out_of_range_of_the_engine_is_refused(addon):
    """An error of the native module reaches the user in its own words, and no mesh is touched."""
    obj = cube()
    obj.data.uv_layers.new(name="UVMap")
    before = uvs(obj).copy()
    engine, task = addon("engine"), addon("task")
    with pytest.raises(engine.EngineError, match="stretch_limit"):
        task.UnwrapTask([obj], {"preset": "DEFAULT", "stretch_limit": 0.5}).run()
    assert np.array_equal(uvs(obj), before)


def test_topology_change_meanwhile_is_refused(addon):
    obj = cube()
    task = addon("task").UnwrapTask([obj], {"preset": "DEFAULT"})
    result = task.run()
    edit(obj)
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    with pytest.raises(addon("mesh_bridge").MeshError, match="edited meanwhile"):
        task.write(result)
    assert len(obj.data.uv_layers) == 0


def test_removed_mesh_meanwhile_is_refused(addon):
    obj = cube()
    task = addon("task").UnwrapTask([obj], {"preset": "DEFAULT"})
    result = task.run()
    bpy.data.meshes.remove(obj.data)
    with pytest.raises(addon("mesh_bridge").MeshError, match="removed meanwhile"):
        task.write(result)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_undo_and_redo_are_one_step(mode):
    name = cube().name
    obj = bpy.data.objects[name]
    obj.data.uv_layers.new(name="UVMap")
    before = uvs(obj).copy()
    if mode == "EDIT":
        edit(obj)
    bpy.ops.ed.undo_push(message="before")
    unwrap()
    bpy.ops.ed.undo_push(message="unwrap")
    bpy.ops.ed.undo()
    obj = bpy.data.objects[name]
    assert obj.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj), before)


def test_wrong_mode_is_refused_by_poll():
    obj = cube()
    bpy.ops.object.mode_set(mode="SCULPT")
    assert not unwrap.poll()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert unwrap.poll()
    obj.select_set(False)
    assert not unwrap.poll()


def test_job_reports_progress_and_cancels(addon):
    obj = sphere(cells=64)
    engine, task = addon("engine"), addon("task")
    job = task.UnwrapTask([obj], {"preset": "DEFAULT"}).start()
    seen = [job.progress()]
    job.cancel()
    with pytest.raises(engine.EngineCancelled):
        job.result()
    seen.append(job.progress())
    assert all(0 <= value <= 1 for value in seen)
    assert job.is_finished()
    assert len(obj.data.uv_layers) == 0


def test_same_uvs_for_any_number_of_threads(addon):
    obj = sphere(cells=12)
    results = [
        addon("task").UnwrapTask([obj], {"preset": "DEFAULT"}, threads=threads).run().uv.tobytes()
        for threads in (1, 2, 3)
    ]
    assert results[0] == results[1] == results[2]


def test_spiral_ramp_is_beyond_smart_uv_project(addon):
    import demo_meshes

    obj = demo_meshes.spiral_ramp()
    comparison = addon("comparison")
    rows = comparison.compare([obj], {})
    assert rows["ble_unwrap"]["overlaps"] == 0
    assert rows["ble_unwrap"]["blender_overlapping_faces"] == 0
    assert rows["smart_uv_best"]["overlaps"] > 0
    assert rows["smart_uv_best"]["blender_overlapping_faces"] > 0


def test_suzannes_face_is_whole_and_her_seams_are_mirrored():
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.object
    unwrap()
    assert_good(obj)
    mesh, place = obj.data, uvs(obj)
    sides: dict[int, list] = {}
    for polygon in mesh.polygons:
        loops = list(polygon.loop_indices)
        for here, after in zip(loops, [*loops[1:], loops[0]], strict=True):
            ends = {mesh.loops[loop].vertex_index: tuple(place[loop]) for loop in (here, after)}
            sides.setdefault(mesh.loops[here].edge_index, []).append(ends)
    seams = [mesh.edges[edge] for edge, maps in sides.items() if len(maps) == 2 and maps[0] != maps[1]]
    ends = [[mesh.vertices[v] for v in edge.vertices] for edge in seams]
    in_the_middle = [pair for pair in ends if all(abs(v.co.x) < 1e-4 and v.normal.y < -0.3 for v in pair)]
    assert ends and not in_the_middle
    middles = {tuple(np.round((a.co + b.co) / 2, 4) + 0.0) for a, b in ends}
    assert {tuple(np.array((-x, y, z)) + 0.0) for x, y, z in middles} == middles
