"""What the last check of UV maps found, for the panel, and whether it is still true of what is in Blender.

It holds as long as the maps, the shapes and the scales of its objects are those that were measured, one of them is
active, and the settings that it was judged by are the same. Every change is noticed, undo, too: first the check is
only doubted, and when Blender has been quiet for a moment the meshes are compared with what they were. This belongs to
the session: neither files nor undo hold it.
"""

import time
from dataclasses import dataclass

import bpy
import numpy as np

from . import handlers, map_state

QUIET_SECONDS = 0.4  # after the last change, before meshes are compared: none is read while something is dragged
# A check that has been in doubt for longer counts as out of date meanwhile. Selecting, changing modes and the check
# itself raise doubts that do not last.
DOUBT_SECONDS = 0.8
SCALE_TOLERANCE = 1e-4  # relative: what turning an object changes by rounding
# The settings that figures are in and that they are judged by.
SETTINGS = ("texture_size", "correct_aspect", "margin", "stretch_limit")


@dataclass(frozen=True)
class _Entry:
    """One object that was checked, and what it was then."""

    name: str
    uid: int
    mesh_uid: int
    map_name: str
    corners: int
    digests: tuple
    scale: np.ndarray

    @classmethod
    def of(cls, obj, map_name):
        entry = obj.name, obj.session_uid, obj.data.session_uid, map_name, map_state.corner_count(obj)
        return cls(*entry, _digests(obj, map_name), map_state.scale(obj))

    @property
    def object(self):
        """The object, where it still has as many corners; else None."""
        obj = map_state.find(self.name, self.uid)
        return obj if obj is not None and map_state.corner_count(obj) == self.corners else None

    def is_near(self):
        """What can be told at once: the object is there with this map active, as large as it was."""
        obj = self.object
        if obj is None:
            return False
        active = obj.data.uv_layers.active
        tolerance = SCALE_TOLERANCE * np.abs(self.scale).max()
        same_scale = np.allclose(map_state.scale(obj), self.scale, rtol=0.0, atol=tolerance, equal_nan=True)
        return active is not None and active.name == self.map_name and same_scale

    def is_same(self):
        """Whether UVs and shape are those that were measured; False where that takes too long to tell."""
        obj = self.object
        return obj is not None and None not in self.digests and _digests(obj, self.map_name) == self.digests


class _Shown:
    """The check that is shown."""

    entries = ()
    title, lines, faces, settings = "", (), {}, ()
    same = True  # the meshes were those that were measured when they were last compared
    doubted_from = doubted_at = None  # when something changed since, first and last; None where nothing did


def show(context, check):
    """Puts up a `map_check.Check`, of what is in Blender now."""
    _Shown.entries = tuple(map(_Entry.of, check.objects, check.maps))
    _Shown.title, _Shown.lines, _Shown.faces = check.title, tuple(check.lines), check.faces
    _Shown.settings = _settings(context)
    _Shown.same, _Shown.doubted_from, _Shown.doubted_at = True, None, None


def clear():
    """Takes the check away: another file is loaded."""
    _Shown.entries = ()
    _Shown.title, _Shown.lines, _Shown.faces = "", (), {}


def title():
    """What the check is of; empty where there is none."""
    return _Shown.title


def lines():
    """The lines of the check."""
    return _Shown.lines


def is_current(context):
    """Whether what the check says is true of what is in Blender and of the settings."""
    if not _Shown.entries or _Shown.settings != _settings(context):
        return False
    objects = [entry.object for entry in _Shown.entries]
    if context.view_layer.objects.active not in objects or not all(entry.is_near() for entry in _Shown.entries):
        return False
    if _Shown.doubted_from is not None and bpy.app.background:
        compare()  # without windows there is nobody to wait for
    since = _Shown.doubted_from
    return _Shown.same and (since is None or time.monotonic() - since < DOUBT_SECONDS)


def faulty_faces(kind):
    """The objects of the check that have faces with this fault: object -> numbers of these faces."""
    found = zip(_Shown.entries, _Shown.faces.get(kind, ()), strict=False)
    return {obj: faces for entry, faces in found if len(faces) and (obj := entry.object) is not None}


def compare():
    """Settles whether the meshes are those that were measured."""
    _Shown.same = all(entry.is_same() for entry in _Shown.entries)
    _Shown.doubted_from = _Shown.doubted_at = None


def _digests(obj, map_name):
    return map_state.uv_digest(obj, map_name), map_state.shape_digest(obj)


def _settings(context):
    settings = context.scene.ble_unwrap
    return tuple(
        tuple(value) if name == "texture_size" else value for name in SETTINGS for value in [getattr(settings, name)]
    )


def _doubt():
    _Shown.doubted_at = time.monotonic()
    if _Shown.doubted_from is None:
        _Shown.doubted_from = _Shown.doubted_at
    if not bpy.app.background and not bpy.app.timers.is_registered(_settle):
        bpy.app.timers.register(_settle, first_interval=QUIET_SECONDS)


def _settle():
    """Compares when nothing has changed for a while; returns how long to wait before it is asked again."""
    if _Shown.doubted_at is None:
        return None
    left = QUIET_SECONDS - (time.monotonic() - _Shown.doubted_at)
    if left > 0:
        return left
    compare()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"IMAGE_EDITOR", "VIEW_3D"}:
                area.tag_redraw()
    return None


@bpy.app.handlers.persistent
def changed(_scene, depsgraph):
    """After every change in Blender: doubts the check where one of its meshes may be another one now."""
    if not _Shown.entries:
        return
    uids = {uid for entry in _Shown.entries for uid in (entry.uid, entry.mesh_uid)}
    if any(update.is_updated_geometry and update.id.original.session_uid in uids for update in depsgraph.updates):
        _doubt()


@bpy.app.handlers.persistent
def undone(*_):
    """After undo or redo, whether or not Blender counts them as changes."""
    if _Shown.entries:
        _doubt()


@bpy.app.handlers.persistent
def forget(*_):
    clear()


HANDLERS = (("depsgraph_update_post", changed), ("undo_post", undone), ("redo_post", undone), ("load_post", forget))


def register():
    handlers.add(HANDLERS)


def unregister():
    handlers.remove(HANDLERS)
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)
    clear()
