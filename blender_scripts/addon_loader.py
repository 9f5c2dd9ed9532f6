"""Finds the add-on for a script: installed as an extension, or the `addon` directory of this checkout."""

# ruff: noqa: I001

import importlib
import importlib.util
import os
import shutil
import sys
import traceback
from pathlib import Path

ENVIRONMENT = 3  # exit code, see the add-on's batch.py
SOURCE = Path(__file__).resolve().parent.parent / "addon"


def load(name):
    """A module of the add-on, as `load("batch")`."""
    return importlib.import_module(f"{package()}.{name}")


def package():
    """Name of the add-on's package: an enabled extension, else one that can be enabled, else the checkout."""
    try:
        import bpy  # first: as a Python module it brings the others along
        import addon_utils
    except ImportError as error:
        print(f"This needs Blender, or Python with `pip install bpy` ({error})", file=sys.stderr)
        sys.exit(ENVIRONMENT)
    for enabled in bpy.context.preferences.addons:
        if _is_ours(enabled.module):
            return enabled.module
    if os.environ.get("BLE_UNWRAP_SOURCE") != "1":
        for module in addon_utils.modules(refresh=True):
            if _is_ours(module.__name__) and addon_utils.enable(module.__name__, default_set=True) is not None:
                return module.__name__
    if "ble_unwrap" not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            "ble_unwrap", SOURCE / "__init__.py", submodule_search_locations=[str(SOURCE)]
        )
        module = importlib.util.module_from_spec(spec)
        sys.modules["ble_unwrap"] = module
        spec.loader.exec_module(module)
    return "ble_unwrap"


def _is_ours(module):
    return module.startswith("bl_ext.") and module.endswith(".ble_unwrap")


def arguments():
    """A script's own arguments, under `blender -b -P script.py -- ARGS` and `python script.py ARGS` alike."""
    if is_module():
        return sys.argv[1:]
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


def is_module():
    """Whether Blender runs inside Python, not Python inside Blender."""
    import bpy

    return not bpy.app.binary_path


def run(main):
    """Runs a script's `main(arguments) -> exit code` and ends the process with that code, whatever happens."""
    try:
        code = main(arguments())
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except KeyboardInterrupt:
        code = 130
    except BaseException:
        traceback.print_exc()
        code = 1
    leave(code)


def leave(code):
    """Ends the process with an exit code, which Blender would otherwise not pass on."""
    sys.stdout.flush()
    sys.stderr.flush()
    if is_module():
        remove_session_folder()
        # Blender 4.2 as a Python module crashes in its own static destructors when panels are registered.
        os._exit(code)
    sys.exit(code)


def remove_session_folder():
    """Removes the folder that Blender made in the temporary directory, as it does itself when it ends in order."""
    import bpy

    folder = Path(bpy.app.tempdir)
    if folder.name.startswith("blender_"):  # it is the temporary directory itself where none could be made
        shutil.rmtree(folder, ignore_errors=True)
