"""The demonstration: what `make demo` runs once the extension's zip is built.

python blender_scripts/demo.py [MESH] [-o out] [--zip FILE] [--no-render]

Finds a Blender ($BLENDER, else `blender` 4.2 or later on PATH, else PyPI's bpy, which is downloaded once), installs the
extension into a throw-away profile as a user would, and runs demo_inside.py there, with xatlas at hand to compare with
where it can be had.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import launch


def main():
    parser = argparse.ArgumentParser(
        prog="demo.py",
        description="Unwrap demonstration meshes, or one of your own, and compare with Smart UV Project.",
    )
    parser.add_argument(
        "mesh",
        nargs="?",
        help="a file of your own in place of the demonstration's: .blend .obj .glb .gltf .ply .stl .fbx",
    )
    parser.add_argument("-o", "--output", default=launch.REPO / "out", help="directory for the results (default: out)")
    parser.add_argument("--zip", help="the extension (default: the one that `make zip` built)")
    parser.add_argument(
        "--render", action=argparse.BooleanOptionalAction, default=True, help="also render the models (default: yes)"
    )
    options = parser.parse_args()
    if options.mesh and not Path(options.mesh).is_file():
        parser.error(f"{options.mesh}: no such file")
    arguments = ["-o", Path(options.output).resolve()]
    if options.mesh:
        arguments += ["--mesh", Path(options.mesh).resolve()]
    if not options.render:
        arguments.append("--no-render")
    return launch.run_with_extension("demo_inside.py", arguments, options.zip, peers=True)


if __name__ == "__main__":
    sys.exit(main())
