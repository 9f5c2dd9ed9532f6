"""Files of meshes and points into Blender and out again; nothing half-written is ever left in place of a file.

`load` reads a file, `prepare` makes ready what the output's format is going to hold, and `save` writes it.
"""

from .contents import Contents, prepare
from .formats import (
    INPUT_FORMATS,
    OUTPUT_FORMATS,
    POINT_FORMATS,
    AssetError,
    default_output_format,
    default_settings,
    file_format,
    keeps_points,
)
from .loading import load, new_scene
from .named_files import named_files
from .saving import save

__all__ = [
    "INPUT_FORMATS",
    "OUTPUT_FORMATS",
    "POINT_FORMATS",
    "AssetError",
    "Contents",
    "default_output_format",
    "default_settings",
    "file_format",
    "keeps_points",
    "load",
    "named_files",
    "new_scene",
    "prepare",
    "save",
]
