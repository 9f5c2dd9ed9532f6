"""Names of file formats, what each can hold, and the error that all of reading and writing raises."""

import re
from pathlib import Path

INPUT_FORMATS = ("blend", "obj", "glb", "gltf", "ply", "stl", "fbx")
OUTPUT_FORMATS = ("blend", "glb", "gltf", "obj", "fbx", "ply")
# Formats that keep a vertex once for each of its normals and UVs.
SPLIT_FORMATS = ("glb", "gltf", "ply", "stl")
# Formats that keep the UVs of points without faces; in PLY, of one cloud by itself.
POINT_FORMATS = ("blend", "ply")
# Formats that keep bones and shape keys; in the others a mesh is written in the pose that it has.
POSED_FORMATS = ("glb", "gltf", "fbx")
# What a format becomes unless another is asked for: .gltf one file, .stl one that holds UVs.
DEFAULT_OUTPUT = {"gltf": "glb", "stl": "glb"}

MEGABYTE = 1 << 20


class AssetError(Exception):
    """A file cannot be read or written; the text is for the user."""


def file_format(path):
    return Path(path).suffix.lower().lstrip(".")


def default_settings(path):
    """The settings whose defaults depend on the format of the file that meshes come from."""
    return {"weld": file_format(path) in SPLIT_FORMATS}


def default_output_format(path):
    return DEFAULT_OUTPUT.get(file_format(path), file_format(path))


def keeps_points(kind, *, surfaces, clouds):
    """Whether a file of a format can hold the UVs of the scene's clouds."""
    return kind == "blend" or (kind == "ply" and not surfaces and clouds == 1)


def reason(error):
    """The telling words of an error of an operator, without Blender's traceback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if not lines:
        return type(error).__name__
    if any(line.startswith(("Traceback", "Error: Python: Traceback")) for line in lines):
        told = next((line for line in reversed(lines) if "Error" in line.split(":")[0]), lines[-1])
        name, _, text = told.partition(": ")
        if system := re.match(r"\[Errno \d+\] (.*)", text):
            return system[1]
        return f"Blender's own code for this format failed on it ({name.rsplit('.', 1)[-1]}: {text or 'no details'})"
    return lines[-1].removeprefix("Error: ")


def named(noun, names):
    """Names after the word for what they are: "modifier A", "modifiers A and B"."""
    names = list(names)
    return f"{noun}{'' if len(names) == 1 else 's'} {listed(names)}"


def listed(names, most=5):
    """Names as a list in a sentence; the first few where there are many."""
    names = list(names)
    rest = len(names) - most
    if rest > 1:
        return f"{', '.join(names[:most])} and {rest} more"
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
