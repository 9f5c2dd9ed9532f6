"""Runs the tests of one file in Blender's window; started by run.py."""

import importlib
import inspect
import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "blender"), str(HERE.parent.parent / "blender_scripts")]

import addon_loader  # noqa: E402
import bpy  # noqa: E402
from driver import Driver, Wait  # noqa: E402
from window import Window  # noqa: E402

PACKAGE = addon_loader.package()

PREFERENCES = bpy.context.preferences
PREFERENCES.view.show_splash = False
PREFERENCES.filepaths.use_auto_save_temporary_files = False


def tests_of(module, words):
    """The test functions of a module in the order in which they stand there, or those named with any of the words."""
    functions = [
        function
        for name, function in vars(module).items()
        if name.startswith("test_") and inspect.getmodule(function) is module
    ]
    return [f for f in functions if not words or any(word in f.__name__ for word in words)]


def empty_scene():
    """What each test starts from: the screen of the factory settings, and no objects."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield Wait(lambda: bpy.context.window is None or bpy.context.view_layer, "the file is loaded")
    for _ in range(10):
        yield None
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    preferences = PREFERENCES.addons[PACKAGE].preferences
    # One thread, so that software OpenGL has a core to itself where there are two.
    preferences.threads, preferences.modal_threshold = 1, 2000


def main(module, pictures, results, *words):
    assert PACKAGE.startswith("bl_ext."), "what is tested is the installed extension"
    window = Window(pictures, f"{bpy.app.version[0]}.{bpy.app.version[1]}")
    tests = tests_of(importlib.import_module(module), words)
    # Blender would ask whether to save, and at its end take seconds to free what nobody needs any more.
    Driver(tests, window, results, prepare=empty_scene, finish=lambda: os._exit(0)).start()


main(*addon_loader.arguments())
