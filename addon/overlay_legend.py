"""Small squares of the colours of stretch, for the panel. Blender keeps them as icons of the session, in no file."""

import bpy
import bpy.utils.previews
import numpy as np

from . import overlay_colours

PIXELS = 16


class _Icons:
    kept = None


def lines():
    """The icon and the text of each line of the legend."""
    if _Icons.kept is None:
        _Icons.kept = bpy.utils.previews.new()
    for name, colour, text in overlay_colours.legend():
        if name not in _Icons.kept:
            square = _Icons.kept.new(name)
            square.icon_size = (PIXELS, PIXELS)
            square.icon_pixels_float = np.tile([*colour, 1.0], PIXELS * PIXELS).tolist()
        yield _Icons.kept[name].icon_id, text


def register():
    """There is nothing to register: icons are made when they are first shown."""


def unregister():
    if _Icons.kept is not None:
        bpy.utils.previews.remove(_Icons.kept)
        _Icons.kept = None
