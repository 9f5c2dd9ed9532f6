"""Meshes of vertices alone and point cloud objects, by the operator."""

import bpy
import numpy as np
import pytest
from scenes import (
    add_mesh,
    assert_good,
    assert_points_mapped,
    attribute_names,
    certificate,
    cube,
    edit,
    fingerprint,
    place_of_points,
    point_cloud,
    point_map,
    select,
    set_point_map,
    sheet_points,
    uvs,
    vertices_only,
)

unwrap = bpy.ops.uv.ble_unwrap
BOTH = pytest.mark.parametrize("make", [vertices_only, point_cloud])
HAS_POINT_CLOUD_EDIT_MODE = bpy.app.version >= (4, 5)


def refused(match, **settings):
    with pytest.raises(RuntimeError, match=match):
        unwrap(**settings)


def select_points(obj, chosen):
    """Edit mode with these points selected."""
    chosen = np.isin(np.arange(len(place_of_points(obj))), chosen)
    select(obj)
    if obj.type == "MESH":
        obj.data.vertices.foreach_set("select", chosen)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
        return
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.pointcloud.select_all(action="SELECT")
    bpy.ops.pointcloud.select_all(action="DESELECT")  # now Blender has noted a selection
    obj.data.attributes[".selection"].data.foreach_set("value", chosen)


@BOTH
def test_object_mode(make):
    obj = make()
    places, mode = place_of_points(obj).copy(), obj.mode
    assert unwrap() == {"FINISHED"}
    assert np.array_equal(place_of_points(obj), places) and obj.mode == mode and obj.select_get()
    assert attribute_names(obj) == ["UVMap"]
    assert_points_mapped(obj)
    assert certificate()[0] == ["INFO", "400 points, 1 piece, 1 chart"]
    assert all(status in {"OK", "INFO"} for status, _ in certificate())


@BOTH
def test_both_kinds_get_the_same_map(make):
    obj = make()
    unwrap()
    expected = point_map(obj).copy()
    other = point_cloud(name="other") if make is vertices_only else vertices_only(name="other")
    select(other)
    unwrap()
    assert np.array_equal(point_map(other), expected)


def test_mixed_selection(addon):
    """Meshes share an atlas, clouds have one each; wires and empty meshes are left out."""
    first, second = cube("A"), cube("B")
    loose, cloud = vertices_only(), point_cloud()
    wire = add_mesh("Wire", sheet_points(4), [])
    wire.data.edges.add(1)
    wire.data.edges[0].vertices = (0, 1)
    empty = add_mesh("Empty", np.zeros((0, 3)), [])
    select(first, second, loose, cloud, wire, empty)
    assert unwrap() == {"FINISHED"}
    assert_good(first)
    assert_good(second)
    assert addon("comparison").overlapping_faces([first, second]) == 0
    assert np.array_equal(point_map(loose), point_map(cloud)), "each has the whole texture to itself"
    assert_points_mapped(loose)
    assert attribute_names(wire) == attribute_names(empty) == []
    assert [text for status, text in certificate() if status == "HEAD"] == ["A and 1 more", "Cloud", "Points"]
    assert bpy.context.window_manager.ble_unwrap_certificate.title == "4 objects"


def test_mesh_with_loose_vertices_stays_a_surface():
    points = np.concatenate([sheet_points(2), sheet_points(10, offset=(3, 0, 0))])
    obj = add_mesh("Face and points", points, [(0, 2, 3, 1)])
    assert unwrap() == {"FINISHED"}
    assert [layer.name for layer in obj.data.uv_layers] == ["UVMap"]
    assert obj.data.attributes["UVMap"].domain == "CORNER"
    assert_good(obj)


def test_wire_alone_is_refused_with_the_remedy():
    obj = add_mesh("Wire", sheet_points(4), [])
    obj.data.edges.add(1)
    obj.data.edges[0].vertices = (0, 1)
    refused("without the edges its vertices can be mapped")
    assert attribute_names(obj) == []


@BOTH
def test_fewer_than_4_points(make):
    obj = make(sheet_points(2)[:3])
    refused("has 3 points; a map needs at least 4")
    assert attribute_names(obj) == []


def test_single_vertex_among_meshes_is_left_out_with_a_note():
    surface, single = cube(), vertices_only([(5, 5, 5)], "Single")
    select(surface, single)
    assert unwrap() == {"FINISHED"}
    assert_good(surface)
    assert attribute_names(single) == []
    assert any(text.startswith("Single: has 1 point;") for status, text in certificate() if status == "WARN")


@BOTH
def test_points_that_are_not_finite(make):
    points = sheet_points()
    points[7, 1] = np.nan
    points[50] = np.inf
    obj = make(points)
    replaced = np.isfinite(place_of_points(obj)).all()  # some Blenders do that when a cloud is made
    assert unwrap() == {"FINISHED"}
    bad = ~np.isfinite(place_of_points(obj)).all(axis=1)
    assert np.flatnonzero(bad).tolist() == ([] if replaced else [7, 50])
    assert (point_map(obj)[bad] == 0).all()
    assert_points_mapped(obj, which=~bad)
    assert (["BAD", "2 points without UVs"] in certificate()) == (not replaced)


def test_nothing_but_points_that_are_not_finite():
    obj = vertices_only(np.full((10, 3), np.nan))
    refused("no points whose coordinates are finite")
    assert attribute_names(obj) == []


def test_duplicates_share_their_place():
    points = sheet_points()
    obj = vertices_only(np.concatenate([points, points[:50]]))
    assert unwrap() == {"FINISHED"}
    uv = assert_points_mapped(obj)
    assert np.array_equal(uv[:50], uv[400:])


def test_pieces_have_their_own_place():
    obj = vertices_only(np.concatenate([sheet_points(), sheet_points(offset=(30, 0, 0))]))
    assert unwrap() == {"FINISHED"}
    uv = point_map(obj)
    low, high = ((part.min(axis=0), part.max(axis=0)) for part in (uv[:400], uv[400:]))
    apart = (low[0] > high[1]) | (high[0] < low[1])
    assert apart.any() or len(np.unique(uv.round(4), axis=0)) == 800


@BOTH
def test_copies_of_the_data_are_left_alone(make):
    obj = make()
    set_point_map(obj, np.zeros((400, 2)))
    copy = obj.copy()
    copy.data = obj.data.copy()
    bpy.context.collection.objects.link(copy)
    select(obj)
    unwrap()
    assert (point_map(copy) == 0).all()


@BOTH
def test_linked_duplicates_are_mapped_once(make, addon):
    first = make()
    second = first.copy()
    bpy.context.collection.objects.link(second)
    bpy.context.view_layer.update()
    select(first, second)
    assert len(addon("targets").target_objects(bpy.context)) == 1
    assert unwrap() == {"FINISHED"}
    assert_points_mapped(second)


@BOTH
def test_own_map_is_written_again(make):
    obj = make()
    set_point_map(obj, np.full((400, 2), 0.5))
    unwrap()
    unwrap()
    assert attribute_names(obj) == ["UVMap"]
    assert_points_mapped(obj)


@BOTH
def test_new_map_and_its_name(make):
    obj = make()
    set_point_map(obj, np.full((400, 2), 0.5), "scan")
    for _ in range(2):
        unwrap(uv_map="NEW", uv_map_name="second")
    assert attribute_names(obj) == ["scan", "second"]
    assert (point_map(obj, "scan") == 0.5).all()
    assert_points_mapped(obj, "second")
    unwrap(uv_map_name="third")
    assert_points_mapped(obj, "third")


@BOTH
@pytest.mark.parametrize("kind", ["FLOAT", "FLOAT_VECTOR", "FLOAT_COLOR"])
def test_other_data_under_the_name_is_kept(make, kind):
    obj = make()
    obj.data.attributes.new("UVMap", kind, "POINT")
    for _ in range(2):  # the second time finds its own
        assert unwrap() == {"FINISHED"}
        assert attribute_names(obj) == ["UVMap", "UVMap.001"]
        assert obj.data.attributes["UVMap"].data_type == kind
        assert_points_mapped(obj, "UVMap.001")
        assert any("UVMap.001" in text for status, text in certificate() if status == "WARN")


def test_empty_uv_map_that_deleted_faces_left_is_kept():
    obj = cube()
    unwrap()
    edit(obj)
    bpy.ops.mesh.delete(type="EDGE_FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert obj.data.attributes["UVMap"].domain == "CORNER"
    assert unwrap() == {"FINISHED"}
    assert obj.data.attributes["UVMap"].domain == "CORNER"
    assert len(point_map(obj, "UVMap.001")) == 8


def test_vertex_group_of_the_name_is_kept():
    """Attributes share their names with vertex groups."""
    obj = vertices_only()
    obj.vertex_groups.new(name="UVMap")
    for _ in range(2):
        unwrap()
        assert attribute_names(obj) == ["UVMap.001"]
    assert [group.name for group in obj.vertex_groups] == ["UVMap"]


@BOTH
def test_non_uniform_scale_maps_what_is_seen(make):
    obj = make(sheet_points(bump=0.0))
    obj.scale = (4, 1, 1)
    bpy.context.view_layer.update()
    unwrap(margin=0.0, rotation="QUARTER")
    extent = np.sort(np.ptp(point_map(obj), axis=0))
    assert extent[1] / extent[0] == pytest.approx(4, rel=0.1)
    assert any("non-uniform scale" in text for status, text in certificate() if status == "WARN")


def test_whole_cloud_in_edit_mode():
    obj = vertices_only()
    unwrap()
    expected = point_map(obj).copy()
    select_points(obj, np.arange(400))
    set_back = np.zeros((400, 2), np.float32)
    bpy.ops.object.mode_set(mode="OBJECT")
    set_point_map(obj, set_back)
    bpy.ops.object.mode_set(mode="EDIT")
    assert unwrap() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(point_map(obj), expected)


def makers_with_edit_mode():
    return [vertices_only, point_cloud] if HAS_POINT_CLOUD_EDIT_MODE else [vertices_only]


@pytest.mark.parametrize("make", makers_with_edit_mode())
def test_selected_points_only(make):
    obj = make()
    set_point_map(obj, np.full((400, 2), 0.75))
    chosen = np.arange(100, 260)
    select_points(obj, chosen)
    mode = bpy.context.mode
    assert unwrap() == {"FINISHED"}
    assert bpy.context.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    others = np.setdiff1d(np.arange(400), chosen)
    assert (point_map(obj)[others] == 0.75).all()
    assert_points_mapped(obj, which=chosen)


@pytest.mark.parametrize("make", makers_with_edit_mode())
def test_nothing_selected_is_an_error(make):
    obj = make()
    select_points(obj, [])
    refused("No points are selected")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert attribute_names(obj) == []


@pytest.mark.parametrize("make", makers_with_edit_mode())
def test_all_points_in_edit_mode_when_asked(make):
    obj = make()
    select_points(obj, [3])
    assert unwrap(use_selection=False) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_points_mapped(obj)


@pytest.mark.skipif(not HAS_POINT_CLOUD_EDIT_MODE, reason="point clouds have no edit mode yet")
def test_point_cloud_never_selected_in_is_mapped_whole():
    obj = point_cloud()
    bpy.ops.object.mode_set(mode="EDIT")
    assert unwrap() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_POINTCLOUD"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_points_mapped(obj)


def test_faces_deleted_in_edit_mode_make_it_a_cloud():
    """What counts is the mesh as it is being edited, not as it was before."""
    obj = cube()
    edit(obj)
    bpy.ops.mesh.delete(type="EDGE_FACE")
    bpy.ops.mesh.select_all(action="SELECT")
    assert unwrap() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(point_map(obj)) == 8


def test_surface_and_cloud_in_edit_mode_together(addon):
    surface, loose = cube(), vertices_only()
    edit(surface, loose)
    assert unwrap() == {"FINISHED"}
    assert {surface.mode, loose.mode} == {"EDIT"}
    bpy.ops.mesh.select_mode(type="FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_good(surface)
    assert_points_mapped(loose)
    before = uvs(surface).copy()
    set_point_map(loose, np.zeros((400, 2)))
    surface.data.polygons.foreach_set("select", np.zeros(6, bool))
    surface.data.vertices.foreach_set("select", np.zeros(8, bool))
    loose.data.vertices.foreach_set("select", np.ones(400, bool))
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    bpy.ops.object.mode_set(mode="EDIT")
    assert unwrap() == {"FINISHED"}, "no face is selected, but points are"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_points_mapped(loose)
    assert np.array_equal(uvs(surface), before)


def test_shape_keys_are_left_alone():
    obj = vertices_only()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Tall")
    key.data[5].co.z += 3
    tall = [tuple(point.co) for point in key.data]
    obj.active_shape_key_index = 1
    edit(obj)
    assert unwrap() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [tuple(point.co) for point in obj.data.shape_keys.key_blocks["Tall"].data] == tall
    assert len(point_map(obj)) == 400


@BOTH
def test_undo_is_one_step(make):
    name = make().name
    set_point_map(bpy.data.objects[name], np.full((400, 2), 0.5), "kept")
    bpy.ops.ed.undo_push(message="before")
    unwrap()
    assert attribute_names(bpy.data.objects[name]) == ["UVMap", "kept"]
    bpy.ops.ed.undo_push(message="unwrap")
    bpy.ops.ed.undo()
    obj = bpy.data.objects[name]
    assert attribute_names(obj) == ["kept"]
    assert (point_map(obj, "kept") == 0.5).all()
    bpy.ops.ed.redo()
    assert_points_mapped(bpy.data.objects[name])


@pytest.mark.skipif(not HAS_POINT_CLOUD_EDIT_MODE, reason="point clouds have no edit mode yet")
def test_undo_in_edit_mode_of_a_point_cloud():
    name = point_cloud().name
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.ed.undo_push(message="before")
    unwrap()
    bpy.ops.ed.undo_push(message="unwrap")
    bpy.ops.ed.undo()
    obj = bpy.data.objects[name]
    assert obj.mode == "EDIT" and attribute_names(obj) == []


@BOTH
def test_keeps_its_place_in_the_texture(make):
    obj = make()
    unwrap()
    values = point_map(obj) * np.float32(0.25) + np.float32((0.5, 0.125))
    set_point_map(obj, values)
    assert unwrap(use_original_bounds=True, texture_size=(1024, 1024), margin=2.0) == {"FINISHED"}
    uv = point_map(obj)
    assert (uv.min(axis=0) >= values.min(axis=0) - 1e-6).all()
    assert (uv.max(axis=0) <= values.max(axis=0) + 1e-6).all()
    assert np.ptp(uv, axis=0).max() > 0.1


def test_error_in_one_part_leaves_all_untouched(addon, monkeypatch):
    """The cloud fails after the mesh is computed: neither is written."""
    surface, loose = cube(), vertices_only()
    select(surface, loose)
    engine = addon("engine")

    def fail(*_arguments, **_keywords):
        raise engine.EngineError("on purpose")

    monkeypatch.setattr(addon("computation"), "unwrap_points", fail)
    before = fingerprint(surface)
    refused("Points: on purpose")
    assert fingerprint(surface) == before
    assert len(surface.data.uv_layers) == 0 and attribute_names(loose) == []


def test_error_of_the_native_module_names_the_cloud(addon):
    loose = vertices_only()
    run, engine = addon("run"), addon("engine")
    with pytest.raises(engine.EngineError, match=r"Points: .*stretch_limit"):
        run.Run([loose], {"stretch_limit": 0.5}).run()
    assert attribute_names(loose) == []


@BOTH
def test_edited_or_removed_meanwhile_is_refused(make, addon):
    surface, cloud = cube(), make()
    run = addon("run").Run([surface, cloud], {})
    results = run.run()
    place = place_of_points(cloud)
    place[3] += 1
    cloud.data.attributes["position"].data.foreach_set("vector", place.reshape(-1))
    error = addon("mesh_bridge").MeshError
    with pytest.raises(error, match="edited meanwhile"):
        run.write(results)
    assert len(surface.data.uv_layers) == 0, "all or none"
    run = addon("run").Run([surface, cloud], {})
    results = run.run()
    (bpy.data.meshes if cloud.type == "MESH" else bpy.data.pointclouds).remove(cloud.data)
    with pytest.raises(error, match="removed meanwhile"):
        run.write(results)
    assert len(surface.data.uv_layers) == 0


@BOTH
def test_linked_from_another_file_is_refused(make, addon, tmp_path):
    obj = make()
    obj_name, data_name = obj.name, obj.data.name
    path = tmp_path / "library.blend"
    addon("asset_io").save(path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = [obj_name]
    obj = bpy.data.objects[obj_name]
    bpy.context.collection.objects.link(obj)
    select(obj)
    assert obj.data.name == data_name
    refused("linked from another file")
    assert attribute_names(obj) == []


def test_job_over_several_parts_reports_progress_and_cancels(addon):
    engine = addon("engine")
    parts = [cube(), vertices_only(), point_cloud(), vertices_only(sheet_points(40), "More")]
    job = addon("run").Run(parts, {}).start()
    seen = [job.progress()]
    while not job.is_finished():
        seen.append(job.progress())
        assert job.stage()
    seen.append(job.progress())
    assert len(job.result()) == 4
    assert all(0 <= value <= 1 for value in seen) and seen == sorted(seen) and seen[-1] == 1
    job = addon("run").Run(parts, {}).start()
    job.cancel()
    with pytest.raises(engine.EngineCancelled):
        while not job.is_finished():
            pass
        job.result()
    assert all(attribute_names(obj) == [] for obj in parts)


def test_poll():
    obj = point_cloud()
    assert unwrap.poll()
    obj.select_set(False)
    assert not unwrap.poll()


def test_panel_shows_what_matters(addon):
    shown, settings = addon("panel").panel_settings, bpy.context.scene.ble_unwrap
    names = list(addon("properties").annotations())
    surface, loose = cube(), vertices_only()

    def of(*objects):
        select(*objects)
        return set(shown(settings, bpy.context, names))

    for name in (
        "use_seams",
        "follow_sharp",
        "limit_over",
        "mark_seams",
        "weld",
        "weld_distance",
        "moves",
        "stretch_price",
        "holes",
        "geodesics",
        "stretch_solver",
    ):
        assert name in of(surface) and name not in of(loose) and name in of(surface, loose)
    assert "neighbours" in of(loose) and "neighbours" not in of(surface)
    assert "uv_map_name" in of(loose) and "uv_map_name" not in of(surface)
    assert "use_selection" not in of(surface, loose)
    edit(surface)
    assert "use_selection" in set(shown(settings, bpy.context, names))


def test_seconds_of_parts_do_not_count_each_other(addon, monkeypatch):
    task = addon("task")
    clock = iter(range(100))
    monkeypatch.setattr(task.time, "perf_counter", lambda: next(clock))
    timer = task.Timer()
    timer.start()  # 0
    timer.pause()  # 1
    next(clock)  # another task's time
    timer.start()  # 3
    assert timer.seconds() == 1 + 1
