"""The certificate of the last run, for the panel, as long as it is true of what is in Blender.

It is shown until one of its objects or maps is gone, a mesh has another number of corners, or undo, packing or aligning
has changed the UVs; undo and redo bring it back with them. Other edits of the UVs are not watched.
"""

import json

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from . import handlers
from .map_state import corner_count, find, uv_digest
from .mesh_arrays import crowded_edges, opposed_edges


class BLEUnwrapCertificate(bpy.types.PropertyGroup):
    """What the last run measured from the UVs that Blender holds; of this session only."""

    title: StringProperty(name="Objects", options={"SKIP_SAVE"})
    lines: StringProperty(name="Lines", description="JSON list of [status, text]", options={"SKIP_SAVE"})
    maps: StringProperty(
        name="Maps", description="JSON list of [object, session_uid, map, corners, digest]", options={"SKIP_SAVE"}
    )
    crowded: IntProperty(name="Edges", description="Edges with more than two faces", options={"SKIP_SAVE"})
    opposed: IntProperty(
        name="Edges", description="Edges between faces that turn against each other", options={"SKIP_SAVE"}
    )
    narrow: StringProperty(
        name="Narrow", description="JSON list of [object, session_uid, faces in narrow charts]", options={"SKIP_SAVE"}
    )
    narrow_charts: IntProperty(name="Charts", description="Charts narrower than two texels", options={"SKIP_SAVE"})
    holds: BoolProperty(name="Holds", description="The UVs are those that were measured", options={"SKIP_SAVE"})


def show(context, title, lines, maps, narrow=(), narrow_charts=0):
    """Puts up a certificate; `maps` are the objects it is of, each with the name of its map.

    `narrow` are objects with the numbers of their faces in charts narrower than two texels, of which there are
    `narrow_charts`.
    """
    shown = context.window_manager.ble_unwrap_certificate
    shown.title = title
    shown.lines = json.dumps(lines)
    shown.maps = json.dumps(
        [(obj.name, obj.session_uid, name, corner_count(obj), uv_digest(obj, name)) for obj, name in maps]
    )
    meshes = [obj.data for obj, _ in maps if obj.type == "MESH"]
    shown.crowded = sum(int(crowded_edges(mesh).sum()) for mesh in meshes)
    shown.opposed = sum(int(opposed_edges(mesh).sum()) for mesh in meshes)
    shown.narrow = json.dumps([(obj.name, obj.session_uid, [int(face) for face in faces]) for obj, faces in narrow])
    shown.narrow_charts = narrow_charts
    shown.holds = True


def clear(context):
    """Takes the certificate away: another file is loaded."""
    context.window_manager.ble_unwrap_certificate.property_unset("lines")


def is_true(context):
    """Whether there is a certificate and it is of what is there."""
    shown = context.window_manager.ble_unwrap_certificate
    return bool(shown.lines) and shown.holds and all(_is_there(*entry) for entry in json.loads(shown.maps))


def objects(context):
    """The objects that the certificate is of."""
    entries = json.loads(context.window_manager.ble_unwrap_certificate.maps or "[]")
    found = (find(name, uid) for name, uid, *_ in entries)
    return [obj for obj in found if obj is not None]


def narrow_faces(context):
    """The objects of the certificate that have faces in narrow charts: object -> numbers of these faces."""
    entries = json.loads(context.window_manager.ble_unwrap_certificate.narrow or "[]")
    found = {find(name, uid): faces for name, uid, faces in entries}
    return {obj: faces for obj, faces in found.items() if obj is not None}


def _is_there(name, uid, map_name, corners, _digest):
    obj = find(name, uid)
    return obj is not None and map_name in obj.data.attributes and corner_count(obj) == corners


@bpy.app.handlers.persistent
def compare(*_):
    """After undo, or an operator of ours: whether the UVs are those measured; no where that takes too long to tell."""
    shown = bpy.context.window_manager.ble_unwrap_certificate
    if not shown.lines:
        return
    shown.holds = all(
        (obj := find(name, uid)) is not None and digest is not None and uv_digest(obj, map_name) == digest
        for name, uid, map_name, _, digest in json.loads(shown.maps)
    )


@bpy.app.handlers.persistent
def forget(*_):
    clear(bpy.context)


HANDLERS = (("undo_post", compare), ("redo_post", compare), ("load_post", forget))


def register():
    bpy.utils.register_class(BLEUnwrapCertificate)
    bpy.types.WindowManager.ble_unwrap_certificate = bpy.props.PointerProperty(type=BLEUnwrapCertificate)
    handlers.add(HANDLERS)


def unregister():
    handlers.remove(HANDLERS)
    del bpy.types.WindowManager.ble_unwrap_certificate
    bpy.utils.unregister_class(BLEUnwrapCertificate)
