"""What is shown after a run: settings, the last result, its messages, and a way to the edges they are about."""

import json

import bmesh
import bpy
import numpy as np
import pytest
from scenes import add_mesh, cube, edit, grid, select, sphere, uvs, vertices_only

unwrap = bpy.ops.uv.ble_unwrap


def scene_settings():
    return bpy.context.scene.ble_unwrap


def shown_lines():
    return json.loads(bpy.context.window_manager.ble_unwrap_certificate.lines)


def is_true(addon):
    return addon("last_result").is_true(bpy.context)


# Settings -----------------------------------------------------------------------------------------------------------


def test_a_preset_chosen_in_the_redo_panel_shows_what_will_run(addon):
    properties = addon("properties")
    operator = bpy.context.window_manager.operator_properties_last("uv.ble_unwrap")
    operator.margin = 9
    solvers = {"PAPER": "LINE_SEARCH", "LIGHTMAP": "NEWTON", "DEFAULT": "NEWTON", "ISO_CHARTS": "LINE_SEARCH"}
    for preset, solver in solvers.items():
        operator.preset = preset
        runs = {**properties.default_values(preset), **properties.values(operator)}
        shown = {name: getattr(operator, name) for name in properties.annotations()}
        shown["texture_size"] = tuple(shown["texture_size"])
        assert {
            name: pytest.approx(value, rel=1e-6) if isinstance(value, float) else value for name, value in runs.items()
        } == shown
        assert (operator.stretch_solver, operator.margin) == (solver, 9)


def test_a_preset_and_back_keeps_margin_texture_size_and_limit():
    settings = scene_settings()
    settings.margin, settings.texture_size, settings.stretch_limit = 9, (512, 256), 1.05
    settings.crease_weight = 0.5
    for preset in ("PAPER", "DEFAULT"):
        settings.preset = preset
        assert (settings.margin, *settings.texture_size) == (9, 512, 256)
        assert settings.stretch_limit == pytest.approx(1.05)
    assert settings.crease_weight == 1.0, "the preset's own value"


@pytest.mark.parametrize("preset", ["PAPER", "ISO_CHARTS"])
def test_a_preset_runs_at_the_margin_that_is_shown(addon, preset):
    cube("A")
    task = addon("task").UnwrapTask([bpy.data.objects["A"]], {"preset": preset})
    shown = addon("properties").default_values(preset)
    assert (task.native["margin"], task.native["texture_size"]) == (shown["margin"], shown["texture_size"])


def test_the_sidebar_takes_over_what_the_redo_panel_sets():
    cube()
    settings = scene_settings()
    settings.margin = 7
    unwrap(from_sidebar=True, preset="PAPER", margin=3.0, seed=5, use_seams=False)
    assert (settings.preset, settings.margin, settings.seed) == ("PAPER", 3, 5)
    assert (settings.stretch_solver, settings.use_seams) == ("LINE_SEARCH", False)
    unwrap(from_sidebar=True, margin=4.0)
    assert (settings.preset, settings.margin, settings.stretch_solver) == ("DEFAULT", 4, "NEWTON")


def test_a_script_leaves_the_sidebar_alone():
    cube()
    settings = scene_settings()
    settings.margin = 7
    unwrap(margin=3.0, seed=5)
    assert (settings.margin, settings.seed) == (7, 0)


# Last Result --------------------------------------------------------------------------------------------------------


def test_the_result_goes_with_its_objects(addon):
    first, second = cube("A"), sphere("B")
    select(first, second)
    assert not is_true(addon)
    unwrap()
    assert is_true(addon)
    first.name = "Renamed"
    assert is_true(addon)
    bpy.data.objects.remove(second)
    assert not is_true(addon)


def test_the_result_goes_with_the_map_and_the_faces(addon):
    obj = cube()
    unwrap()
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    assert not is_true(addon)
    unwrap()
    assert is_true(addon)
    edit(obj)
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not is_true(addon)


def test_the_result_of_points_goes_with_them(addon):
    obj = vertices_only()
    unwrap()
    assert is_true(addon)
    bpy.data.objects.remove(obj)
    assert not is_true(addon)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_undo_takes_the_result_back_and_redo_brings_it_again(addon, mode):
    obj = cube()
    obj.data.uv_layers.new(name="UVMap")
    if mode == "EDIT":
        edit(obj)
    bpy.ops.ed.undo_push(message="before")
    unwrap()
    bpy.ops.ed.undo_push(message="unwrap")
    assert is_true(addon)
    bpy.ops.ed.undo()
    assert not is_true(addon)
    bpy.ops.ed.redo()
    assert is_true(addon)


def test_undo_of_something_else_keeps_the_result(addon):
    obj = cube()
    unwrap()
    bpy.ops.ed.undo_push(message="unwrap")
    obj.location.x = 3
    bpy.ops.ed.undo_push(message="move")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Cube"].location.x == 0
    assert is_true(addon)


def test_another_file_has_no_result(addon):
    cube()
    unwrap()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    cube()
    assert not is_true(addon)


# Messages -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "scale", "size", "unit"),
    [
        ("METRIC", 1.0, 2.0, " m"),
        ("METRIC", 1.0, 2e-6, " µm"),
        ("METRIC", 0.001, 2.0, " cm"),
        ("IMPERIAL", 1.0, 2.0, "'"),
        ("NONE", 1.0, 2.0, " units"),
    ],
)
def test_lengths_have_units(system, scale, size, unit):
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length = system, scale
    cube(size=size)
    unwrap()
    (text,) = (text for _, text in shown_lines() if text.startswith("Seams"))
    assert text.removesuffix(" long").endswith(unit), text
    assert "e-" not in text


def test_one_is_singular(addon):
    report = addon("surface_report")
    measured = {"charts": 1, "faces": 1, "overlaps": 1, "flips": 1, "unmapped_faces": 1, "overlaps_with_kept": 1}
    certificate = report.certify(measured, margin=4)
    assert certificate.violations == ["1 overlapping pair of faces", "1 flipped face", "1 face without UVs"]
    texts = [text for _, text in report.lines(certificate, margin=4, stretch_limit=1.1)]
    assert texts[0] == "1 face in 1 chart"
    assert "1 overlap, 1 with faces that were not unwrapped" in texts and "1 flipped face" in texts
    many = {**measured, "charts": 1200, "faces": 2, "overlaps": 2, "flips": 2, "unmapped_faces": 2}
    certificate = report.certify(many, margin=4)
    assert certificate.violations == ["2 overlapping pairs of faces", "2 flipped faces", "2 faces without UVs"]
    assert report.lines(certificate, margin=4, stretch_limit=1.1)[0] == ("INFO", "2 faces in 1,200 charts")


def test_what_was_found_is_said(addon):
    report = addon("surface_report")
    assert report.found({"rungs": {"plane": 2}}) == report.found({}) == []
    assert report.found({"rungs": {"mirrored": 1, "copied": 3, "straighten": 2, "fold": 1}}) == [
        "1 mirrored piece: seams on one half are those of the other",
        "3 pieces with the map of another one like them",
        "2 charts with sides laid along the axes",
        "1 cut so that more of the texture is covered",
    ]
    bpy.ops.mesh.primitive_monkey_add()
    unwrap()
    assert any("mirrored piece" in text for _, text in shown_lines())


def book(name="Book", pages=3):
    """Sheets that share an edge: more than two faces have it."""
    positions = [(0, 0, 0), (0, 0, 1)]
    faces = []
    for page in range(pages):
        angle = np.pi * page / pages
        positions += [(np.cos(angle), np.sin(angle), 0), (np.cos(angle), np.sin(angle), 1)]
        faces.append((0, 2 + 2 * page, 3 + 2 * page, 1))
    return add_mesh(name, positions, faces)


def test_edges_of_a_warning_can_be_selected(addon):
    first, second, plain = book("First"), book("Second", pages=4), cube()
    second.location.x = 5
    select(plain, first, second)
    unwrap()
    certificate = bpy.context.window_manager.ble_unwrap_certificate
    assert certificate.crowded == 2
    assert any("more than two faces" in text for status, text in shown_lines() if status == "WARN")
    assert bpy.ops.mesh.ble_unwrap_select_edges() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    assert tuple(bpy.context.scene.tool_settings.mesh_select_mode) == (False, True, False)
    for obj in (first, second):
        picked = [edge for edge in bmesh.from_edit_mesh(obj.data).edges if edge.select]
        assert [sorted(vertex.index for vertex in edge.verts) for edge in picked] == [[0, 1]]
    assert plain.mode == "OBJECT"
    assert is_true(addon)


def test_where_a_one_sided_band_is_cut_can_be_selected():
    """A Möbius strip: its faces turn against each other across one edge, wherever they begin."""
    count = 12
    turn = 2 * np.pi * np.arange(count) / count
    side = np.stack([np.cos(turn / 2) * np.cos(turn), np.cos(turn / 2) * np.sin(turn), np.sin(turn / 2)], axis=1) / 3
    middle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    faces = [(k, k + 1, count + k + 1, count + k) for k in range(count - 1)]
    faces.append((count - 1, count, 0, 2 * count - 1))
    obj = add_mesh("Band", np.concatenate([middle + side, middle - side]).tolist(), faces)
    select(obj)
    unwrap()
    certificate = bpy.context.window_manager.ble_unwrap_certificate
    assert (certificate.crowded, certificate.opposed) == (0, 1)
    assert any("one side" in text for status, text in shown_lines() if status == "WARN")
    assert bpy.ops.mesh.ble_unwrap_select_edges(kind="OPPOSED") == {"FINISHED"}
    picked = [edge for edge in bmesh.from_edit_mesh(obj.data).edges if edge.select]
    assert [sorted(vertex.index for vertex in edge.verts) for edge in picked] == [[0, count]]


def test_no_edges_to_select_where_there_are_none():
    grid()
    unwrap()
    certificate = bpy.context.window_manager.ble_unwrap_certificate
    assert (certificate.crowded, certificate.opposed) == (0, 0)
    assert uvs(bpy.data.objects["Grid"]).any()
    assert bpy.ops.mesh.ble_unwrap_select_edges() == {"CANCELLED"}
