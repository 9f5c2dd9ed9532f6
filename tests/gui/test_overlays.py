"""What is drawn over a mesh is seen, leaves nothing in the file, and is gone once it is turned off."""

import bpy
import numpy as np
import scenes
from driver import Wait

KINDS = ("CHECKER", "STRETCH", "ISLANDS", "SEAMS")
SETTLED = 60  # turns after which neither highlights nor the sidebar change any more


def traces(obj):
    """All that a drawing could leave behind."""
    mesh = obj.data
    data = [
        len(getattr(bpy.data, kind)) for kind in ("meshes", "objects", "materials", "images", "textures", "brushes")
    ]
    attributes = [(a.name, a.domain, a.data_type) for a in mesh.attributes]
    return scenes.fingerprint(obj), scenes.uvs(obj).tobytes(), attributes, len(mesh.materials), data


def viewport(window):
    """The 3D view without what lies over it at its sides."""
    picture = window.picture_of(window.region("WINDOW")).astype(int)
    height, width = picture.shape[:2]
    return picture[height // 4 : -height // 4, width // 4 : 2 * width // 3]


def drawn(window, plain):
    """How many pixels are clearly other than they were without anything drawn."""
    return int((np.abs(viewport(window) - plain).max(axis=2) > 40).sum())


def test_overlays_are_drawn_and_leave_no_trace(window):
    obj = scenes.sphere()
    scenes.select(obj)
    with window.context():
        bpy.ops.uv.ble_unwrap()
        bpy.ops.view3d.view_selected()
    region = yield from window.sidebar()
    yield from window.rest()
    yield from window.turns(SETTLED)
    before, plain = traces(obj), viewport(window)
    for number, kind in enumerate(KINDS):
        along = 0.5 if kind == "SEAMS" else 0.2 + 0.3 * number
        wanted = f"bpy.ops.uv.ble_unwrap_show(kind='{kind}')"
        x, y = yield from window.find(region, lambda text, wanted=wanted: text == wanted, along)
        yield from window.click(x, y)
        yield from window.rest()

        # A line of seams is some hundred pixels; what gets lighter under the pointer is none of them.
        yield Wait(lambda: drawn(window, plain) > 150, f"{kind} is drawn")
        yield from window.turns(4)
        window.screenshot(f"overlay_{kind.lower()}")
        assert traces(obj) == before
        yield from window.click(x, y)
        yield from window.rest()
        yield Wait(lambda: drawn(window, plain) < 20, f"{kind} is gone again")
        assert traces(obj) == before
