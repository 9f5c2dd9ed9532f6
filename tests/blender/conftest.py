"""Fixtures for tests inside Blender. Elsewhere there is nothing to collect here: run.py starts these tests."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

if "BLE_ARCHIVE" not in os.environ:
    collect_ignore_glob = ["test_*.py"]
else:
    import addon_loader
    import bpy

REPO = Path(__file__).resolve().parent.parent.parent


@pytest.fixture(autouse=True)
def empty_scene():
    """An empty scene, the add-on enabled in it."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    package = addon_loader.package()
    assert package.startswith("bl_ext."), "what is tested is the installed extension"
    bpy.context.preferences.addons[package].preferences.threads = 2


@pytest.fixture
def addon():
    """Loads a module of the installed add-on by name."""
    return addon_loader.load


@pytest.fixture
def run_script(tmp_path):
    """Runs a script of blender_scripts in a Blender process of its own: finished process with merged output."""

    def run(name, *arguments, environment=None):
        script = REPO / "blender_scripts" / name
        if addon_loader.is_module():
            command = [sys.executable, script]
        else:
            command = [bpy.app.binary_path, "--background", "--factory-startup", "--python", script, "--"]
        return subprocess.run(
            [*map(str, command), *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, **(environment or {})},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            timeout=600,
        )

    return run


@pytest.fixture
def files(tmp_path, addon):
    """Writes the present scene to a file of a format."""

    def write(name):
        path = tmp_path / name
        if path.suffix == ".stl":
            bpy.ops.wm.stl_export(filepath=str(path))
        elif path.suffix == ".gltf":
            bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLTF_SEPARATE")
        else:
            addon("asset_io").save(path)
        return path

    return write
