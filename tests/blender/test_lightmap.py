"""The preset for lightmaps: a UV map of its own, found again by its name; the one that is rendered with stays."""

import json

import bmesh
import bpy
import numpy as np
import pytest
from scenes import add_mesh, assert_good, certificate, cube, edit, grid, select, set_uvs, uvs

unwrap = bpy.ops.uv.ble_unwrap


def maps(obj):
    return [layer.name for layer in obj.data.uv_layers]


def rendered(obj):
    (name,) = [layer.name for layer in obj.data.uv_layers if layer.active_render]
    return name


def with_materials_map(obj):
    """Gives an object the map that its materials use, and returns what is in it."""
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, np.random.default_rng(3).random((len(obj.data.loops), 2)))
    return uvs(obj)


def test_a_lightmap_has_a_second_map_and_leaves_the_first_alone():
    obj = cube()
    before = with_materials_map(obj)
    for _ in range(2):
        assert unwrap(preset="LIGHTMAP", texture_size=(256, 256)) == {"FINISHED"}
        assert maps(obj) == ["UVMap", "Lightmap"], "found again by its name"
        assert rendered(obj) == "UVMap" and obj.data.uv_layers.active.name == "Lightmap"
        np.testing.assert_array_equal(uvs(obj, "UVMap"), before)
    at = assert_good(obj).astype(float) * 256
    assert (at == np.round(at)).all(), "the six sides lie on whole texels"
    lines = certificate()
    assert ("INFO", "6 faces in 6 charts") in [tuple(line) for line in lines]
    assert any("margin 11.3" in text for status, text in lines if status == "OK")
    assert ("INFO", "6 rectangles on whole texels") in [tuple(line) for line in lines]
    assert not [text for status, text in lines if status == "WARN"]


def test_a_lightmap_without_another_map_is_told():
    obj = cube()
    for _ in range(2):
        assert unwrap(preset="LIGHTMAP") == {"FINISHED"}
        assert maps(obj) == ["Lightmap"]
        assert any("is its only UV map" in text for status, text in certificate() if status == "WARN")
    assert unwrap(uv_map="NEW", uv_map_name="Other") == {"FINISHED"}
    assert not any("is its only UV map" in text for _, text in certificate())


def test_the_panel_shows_the_map_and_another_preset_takes_it_back():
    settings = bpy.context.scene.ble_unwrap
    settings.preset = "LIGHTMAP"
    assert (settings.uv_map, settings.uv_map_name, settings.snap) == ("NEW", "Lightmap", True)
    assert settings.cut_angle == pytest.approx(50) and settings.mip_levels == 2
    settings.preset = "DEFAULT"
    assert (settings.uv_map, settings.uv_map_name, settings.snap) == ("ACTIVE", "UVMap", False)
    # A map that the artist has chosen stays.
    settings.uv_map, settings.uv_map_name = "NEW", "Mine"
    settings.preset = "PAPER"
    assert (settings.uv_map, settings.uv_map_name) == ("NEW", "Mine")


def test_what_is_set_besides_the_preset_holds():
    obj = cube()
    with_materials_map(obj)
    options = {"uv_map": "NEW", "uv_map_name": "Baked", "cut_angle": 0.0}
    assert unwrap(preset="LIGHTMAP", **options) == {"FINISHED"}
    assert maps(obj) == ["UVMap", "Baked"]
    assert ("INFO", "6 faces in 1 chart") in [tuple(line) for line in certificate()], "nothing is cut: a net"


def test_the_redo_panel_goes_from_one_preset_to_another():
    """The analysis that is kept is of one angle."""
    obj = cube()
    with_materials_map(obj)
    for preset, charts in (("DEFAULT", 1), ("LIGHTMAP", 6), ("DEFAULT", 1)):
        assert unwrap(preset=preset, uv_map="NEW", uv_map_name="Lightmap") == {"FINISHED"}
        assert any(f"in {charts} chart" in text for _, text in certificate())


def test_a_place_that_is_kept_begins_at_whole_texels():
    obj = grid(4)
    obj.data.uv_layers.new(name="Lightmap")
    set_uvs(obj, uvs(obj) * np.float32(0.25) + np.float32((0.5014, 0.1252)))
    edit(obj)
    options = {"use_original_bounds": True, "texture_size": (512, 512), "margin": 1.0, "mip_levels": 0}
    assert unwrap(preset="LIGHTMAP", **options) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    at = uvs(obj).astype(float) * 512
    for corner in (at.min(axis=0), at.max(axis=0)):
        np.testing.assert_array_equal(corner, np.round(corner))


def plank(name, at):
    """A long face with a narrow one beside it, at a right angle."""
    positions = [(at, 0, 0), (at + 20, 0, 0), (at + 20, 4, 0), (at, 4, 0), (at, 0, 0.05), (at + 20, 0, 0.05)]
    return add_mesh(name, positions, [(0, 1, 2, 3), (0, 4, 5, 1)])


def test_faces_of_narrow_charts_can_be_selected(addon):
    first, second, plain = plank("First", 0), plank("Second", 30), cube()
    select(plain, first, second)
    assert unwrap(preset="LIGHTMAP", texture_size=(128, 128), margin=1.0, mip_levels=0) == {"FINISHED"}
    shown = bpy.context.window_manager.ble_unwrap_certificate
    assert shown.narrow_charts == 2
    assert any("narrower than two texels" in text for status, text in certificate() if status == "WARN")
    assert bpy.ops.mesh.ble_unwrap_select_narrow() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    assert tuple(bpy.context.scene.tool_settings.mesh_select_mode) == (False, False, True)
    for obj in (first, second):
        assert [face.index for face in bmesh.from_edit_mesh(obj.data).faces if face.select] == [1]
    assert plain.mode == "OBJECT" and addon("last_result").is_true(bpy.context)


def test_narrow_charts_of_selected_faces_are_those_of_the_mesh():
    obj = plank("Plank", 0)
    edit(obj, faces=[1])
    # A chart alone fills the texture in its length.
    assert unwrap(preset="LIGHTMAP", texture_size=(128, 128), margin=1.0, mip_levels=0) == {"FINISHED"}
    assert bpy.ops.mesh.ble_unwrap_select_narrow() == {"FINISHED"}
    assert [face.index for face in bmesh.from_edit_mesh(obj.data).faces if face.select] == [1]


def test_there_may_be_none_to_select():
    cube()
    unwrap(preset="LIGHTMAP")
    assert bpy.context.window_manager.ble_unwrap_certificate.narrow_charts == 0
    assert bpy.ops.mesh.ble_unwrap_select_narrow() == {"CANCELLED"}


def test_the_command_line_has_it(addon, files, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    obj = cube()
    with_materials_map(obj)
    source = files("box.blend")
    options = ["--preset", "lightmap", "--texture-size", "256", "--report", "report.json", "-o", "out"]
    assert addon("batch").main([str(source), *options]) == 0
    (asset,) = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["assets"]
    (entry,) = asset["objects"]
    assert entry["uv_maps"] == ["Lightmap"] and entry["measured"]["charts"] == 6
    assert entry["measured"]["margin_texels"] == pytest.approx(8 * np.sqrt(2))
    assert entry["certificate"]["holds"]
