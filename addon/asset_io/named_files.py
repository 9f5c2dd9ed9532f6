"""Files beside a file that it names and that are read with it, without Blender."""

from pathlib import Path
from urllib.parse import unquote

from . import gltf_file, obj_file
from .formats import AssetError, file_format


def named_files(path):
    """The buffers and images of a glTF and the material libraries of an OBJ file, whether they are there or not.

    What cannot be understood names nothing: whoever reads it will say why.
    """
    path = Path(path)
    kind = file_format(path)
    try:
        if kind in ("gltf", "glb"):
            document, _ = gltf_file.read_document(path)
            names = [unquote(uri) for _, uri in gltf_file.external_uris(document)]
        elif kind == "obj":
            names = sorted({part for name in obj_file.libraries(path) for part in obj_file.ways_to_read(name)})
        else:
            names = []
    except (AssetError, OSError, ValueError):
        names = []
    return list(dict.fromkeys(path.parent / name for name in names))
