"""What the add-on adds to Blender, and that all of it goes away again."""

import subprocess
import sys
import types
from pathlib import Path

import addon_loader
import bpy
import numpy as np
import pytest


def entries(menu, addon):
    """Draw functions of the add-on in a menu."""
    draw = addon("menu").draw_entry
    functions = getattr(getattr(bpy.types, menu).draw, "_draw_funcs", [])
    return sum(function is draw for function in functions)


def test_menus_have_one_entry_each(addon):
    assert entries("IMAGE_MT_uvs_unwrap", addon) == 1
    assert entries("VIEW3D_MT_object", addon) == 1
    assert entries("VIEW3D_MT_edit_pointcloud", addon) == 1
    # From 4.3 on this menu shows the one above: an entry of its own would be there twice.
    assert entries("VIEW3D_MT_uv_map", addon) == int(bpy.app.version < (4, 3, 0))


def test_all_settings_are_properties_of_scene_and_operator(addon):
    names = set(addon("properties").annotations())
    assert names <= set(bpy.context.scene.ble_unwrap.bl_rna.properties.keys())
    assert names <= set(bpy.ops.uv.ble_unwrap.get_rna_type().properties.keys())
    shown = set(addon("properties").MAIN_SETTINGS)
    for _, group in addon("properties").ADVANCED_SETTINGS:
        shown |= set(group)
    assert shown == names - {"preset"}, "every setting is in the panel"


def test_every_setting_has_a_tooltip(addon):
    for name, deferred in addon("properties").annotations().items():
        text = deferred.keywords["description"]
        assert len(text) > 10 and not text.endswith("."), name


@pytest.mark.parametrize("preset", ["DEFAULT", "PAPER", "ISO_CHARTS", "LIGHTMAP"])
def test_presets_are_those_of_the_native_module(addon, preset):
    properties, engine = addon("properties"), addon("engine")
    settings = bpy.context.scene.ble_unwrap
    settings.preset = preset
    shown = {
        name: getattr(settings, name)
        for name in properties.annotations()
        if name not in (*properties.BRIDGE_SETTINGS, *properties.CLOUD_SETTINGS, *properties.KEPT_BY_PRESETS)
    }
    ours = engine.native_settings(shown)
    theirs = engine.default_settings(preset)
    for name in ("threads", *properties.KEPT_BY_PRESETS):
        theirs.pop(name)
    assert set(ours) == set(theirs)
    for name, value in theirs.items():
        expected = pytest.approx(value, rel=1e-6) if isinstance(value, float) else value
        assert ours[name] == expected, name


@pytest.mark.parametrize("preset", ["DEFAULT", "PAPER"])
def test_front_is_told_to_the_native_module_though_nobody_has_set_it(addon, preset):
    """Which way figures look is the host's to know."""
    properties, engine = addon("properties"), addon("engine")
    settings = bpy.context.scene.ble_unwrap
    settings.preset = preset
    assert engine.native_settings(properties.values(settings))["front"] == "-y"
    assert engine.default_settings(preset)["front"] == "none"


def test_settings_of_surfaces_are_those_that_clouds_do_not_take(addon):
    """The table in properties.py against the native module, setting by setting."""
    properties, engine, computation = (addon(name) for name in ("properties", "engine", "computation"))
    points = np.random.default_rng(0).random((8, 3)).astype(np.float32)
    defaults = properties.default_values()
    for name in properties.annotations():
        if name in properties.BRIDGE_SETTINGS:
            continue
        try:
            computation.unwrap_points(points, {name: defaults[name]})
            taken = True
        except engine.EngineError:
            taken = False
        assert taken is (name not in properties.SURFACE_SETTINGS), name


def test_what_a_property_can_hold_the_native_module_takes(addon):
    """At both ends of every property as Blender keeps it, in single precision."""
    properties, engine, table = addon("properties"), addon("engine"), addon("settings_table")
    computation = addon("computation")
    cloud = np.zeros((0, 3), np.float32)
    rna = bpy.context.scene.ble_unwrap.bl_rna.properties
    for name in (*table.SETTINGS, "neighbours"):
        if rna[name].type not in {"INT", "FLOAT"}:
            continue
        row = table.SETTINGS.get(name) or table.ARGUMENTS[name]
        for value in (rna[name].hard_min, rna[name].hard_max):
            # Bounds of landmarks that contradict each other, and a margin as wide as the texture, are refused for that.
            others = {"landmark_min": {"landmark_max": 0}, "landmark_max": {"landmark_min": 3}}
            others |= {"texture_size": {"margin": 0.0}, "margin": {"texture_size": (4096, 4096)}}
            given = {**others.get(name, {}), name: (value, value) if name == "texture_size" else value}
            if name in properties.SURFACE_SETTINGS:
                empty = np.zeros((0, 3), np.float32), np.zeros(0, np.int32), np.zeros(1, np.int32)
                engine.native().unwrap(*empty, **engine.native_settings(given))
            else:
                computation.unwrap_points(cloud, given)
            ends = (row["least"], row["most"] if row["most"] is not None else np.inf)
            zero = name in table.ZERO_STANDS_FOR_NONE and value == 0
            assert zero or ends[0] <= value <= ends[1], (name, value)


def test_choosing_a_preset_keeps_where_the_result_goes():
    settings = bpy.context.scene.ble_unwrap
    settings.uv_map = "NEW"
    settings.preset = "PAPER"
    assert (settings.uv_map, settings.stretch_solver) == ("NEW", "LINE_SEARCH")
    settings.preset = "DEFAULT"
    assert (settings.uv_map, settings.stretch_solver) == ("NEW", "NEWTON")


def test_scene_settings_fill_what_a_call_leaves_out(addon):
    properties = addon("properties")

    class Target:
        """Stands for an operator's properties."""

        def __init__(self, **given):
            self.__dict__.update(given)

        def is_property_set(self, name):
            return name in self.__dict__

    scene = bpy.context.scene.ble_unwrap
    scene.margin = 7
    scene.seed = 3
    scene.crease_weight = 0.5
    target = Target(seed=5)
    properties.copy_unset(target, scene)
    assert (target.margin, target.seed, target.crease_weight) == (7, 5, 0.5)
    target = Target(preset="PAPER")
    properties.copy_unset(target, scene)
    assert target.margin == 7 and not target.is_property_set("crease_weight")


def test_unregister_leaves_nothing_and_register_works_again(addon):
    registration = addon("registration")
    classes = {name for name in dir(bpy.types) if "ble_unwrap" in name.lower()}
    assert classes
    called = called_after_events(addon)
    assert {event for event, _ in called} == {"depsgraph_update_post", "undo_post", "redo_post", "load_post"}
    registration.unregister()
    try:
        assert not called_after_events(addon)
        assert not {name for name in dir(bpy.types) if "ble_unwrap" in name.lower()}
        assert not hasattr(bpy.types.Scene, "ble_unwrap")
        assert not hasattr(bpy.types.WindowManager, "ble_unwrap_certificate")
        assert not hasattr(bpy.types, "UV_OT_ble_unwrap")
        for menu in ("IMAGE_MT_uvs_unwrap", "VIEW3D_MT_object", "VIEW3D_MT_uv_map"):
            assert entries(menu, addon) == 0
    finally:
        registration.register()
    assert {name for name in dir(bpy.types) if "ble_unwrap" in name.lower()} == classes
    assert entries("IMAGE_MT_uvs_unwrap", addon) == 1
    assert sorted(called_after_events(addon)) == sorted(called)


def called_after_events(addon):
    """The functions of the add-on that Blender calls, each with the name of the event."""
    package = addon("registration").__package__
    lists = {event: getattr(bpy.app.handlers, event) for event in dir(bpy.app.handlers)}
    return [
        (event, f"{function.__module__}.{function.__name__}")
        for event, functions in lists.items()
        if isinstance(functions, list)
        for function in functions
        if function.__module__.startswith(package)
    ]


def test_both_editors_have_the_same_panels(addon):
    """A panel that holds the others, each drawn by the same code; in Image Editors only where these show UVs."""
    found = {}
    for prefix, space in (("IMAGE", "IMAGE_EDITOR"), ("VIEW3D", "VIEW_3D")):
        main = f"{prefix}_PT_ble_unwrap"
        panels = {name: getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith(main)}
        assert len(panels) == 6
        for name, panel in panels.items():
            assert (panel.bl_space_type, panel.bl_region_type, panel.bl_category) == (space, "UI", "BLE Unwrap")
            assert getattr(panel, "bl_parent_id", None) == (None if name == main else main)
        found[prefix] = {name.removeprefix(main): panel.draw for name, panel in panels.items()}
    assert found["IMAGE"] == found["VIEW3D"]
    for mode, shown in (("UV", True), ("PAINT", False)):
        context = types.SimpleNamespace(space_data=types.SimpleNamespace(mode=mode))
        assert addon("panel").CLASSES[0].poll(context) == shown


def test_failed_registration_takes_back_what_was_registered(addon, monkeypatch):
    registration, panel = addon("registration"), addon("panel")
    registration.unregister()

    def fail():
        raise RuntimeError("on purpose")

    with monkeypatch.context() as patch:
        patch.setattr(panel, "register", fail)
        with pytest.raises(RuntimeError, match="on purpose"):
            registration.register()
        assert not hasattr(bpy.types.Scene, "ble_unwrap")
    registration.register()


def test_missing_library_is_a_clear_error(addon, monkeypatch):
    from scenes import cube

    obj = cube()
    monkeypatch.setitem(sys.modules, "ble_unwrap_native", None)
    with pytest.raises(RuntimeError, match="native library of BLE Unwrap cannot be loaded"):
        bpy.ops.uv.ble_unwrap()
    assert len(obj.data.uv_layers) == 0


def test_preferences_are_found(addon):
    preference = addon("preferences").preference
    assert preference(bpy.context, "threads") == 2
    assert preference(bpy.context, "modal_threshold") > 0


def test_archive_is_a_valid_extension():
    import os

    import addon_utils

    tool = next((Path(path) / "bl_pkg/cli/blender_ext.py" for path in addon_utils.paths() if "core" in path), None)
    if tool is None or not tool.is_file():
        pytest.skip("this Blender does not bring blender_ext.py along")
    python = sys.executable
    if not addon_loader.is_module() and "python" not in Path(python).name:
        pytest.skip("no Python executable beside this Blender")
    done = subprocess.run(
        [python, str(tool), "validate", os.environ["BLE_ARCHIVE"]], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
