"""Installs an extension's zip into the current Blender profile and enables it, as Install from Disk does.

Started by launch.py in Blender. Exit code 0: installed, enabled, and the native library loads.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader


def main(argv):
    import bpy

    archive = Path(argv[0]).resolve()
    done = bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True, overwrite=True
    )
    if "FINISHED" not in done:
        print(f"Blender refused {archive}", file=sys.stderr)
        return 1
    name = addon_loader.package()
    if not name.startswith("bl_ext."):
        print("The extension is not enabled after it was installed", file=sys.stderr)
        return 1
    bpy.ops.wm.save_userpref()
    print(f"{name}, native library {addon_loader.load('engine').version()}")
    return 0 if addon_loader.load("engine").version() else 1


if __name__ == "__main__":
    addon_loader.run(main)
