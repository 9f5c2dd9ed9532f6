"""One picture of many models: each under a checker from two sides, beside its layout coloured by stretch.

python blender_scripts/contact_sheet.py [MODEL ...] [-o out/contact_sheet.png] [--compare smart] [--zip FILE]

What `make contact-sheet` runs once the extension's zip is built. Without models it takes those of ../shared/models
beside this checkout, and where there are none the meshes of the demonstration. Finds a Blender as demo.py does; the
sheet itself is drawn by contact_sheet_inside.py, in one Blender process for all models.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import launch

DEVELOPMENT_MODELS = launch.REPO.parent / "shared" / "models"


def development_models(directory=DEVELOPMENT_MODELS):
    """The models beside the checkout, small ones first; none if there is no such directory."""
    return sorted(directory.glob("*.obj"), key=lambda path: (path.stat().st_size, path.name))


def main():
    parser = argparse.ArgumentParser(
        prog="contact_sheet.py",
        description="One picture of many models with a checker texture, each beside its UV layout.",
    )
    parser.add_argument(
        "models", nargs="*", metavar="MODEL", help="files of meshes: .blend .obj .glb .gltf .ply .stl .fbx"
    )
    parser.add_argument(
        "-o",
        "--output",
        default=launch.REPO / "out" / "contact_sheet.png",
        help="the picture to write (default: out/contact_sheet.png)",
    )
    parser.add_argument("--compare", choices=["smart"], help="add the layout of Smart UV Project to every model")
    parser.add_argument("--zip", help="the extension (default: the one that `make zip` built)")
    options = parser.parse_args()
    for model in options.models:
        if not Path(model).is_file():
            parser.error(f"{model}: no such file")
    models = [Path(model).resolve() for model in options.models] or development_models()
    arguments = ["-o", Path(options.output).resolve(), *models]
    if options.compare:
        arguments += ["--compare", options.compare]
    return launch.run_with_extension("contact_sheet_inside.py", arguments, options.zip)


if __name__ == "__main__":
    sys.exit(main())
