"""What is drawn over meshes in the 3D views: a checker, stretch, islands, and where the map is cut.

Nothing of it is in the file: no attribute, no material, no image. It is kept here, by the session, and drawn by a
handler of the 3D views, which is there only while something is shown; loading a file turns it off. It is shown on the
selected meshes, those in edit mode there, and where none is selected on those that it was shown on before.

What is drawn is made once and kept. When a mesh, its map or its scale is another one than it was, undo included, it is
made anew: at once where that is quick, so that it follows what is dragged, else when Blender has been quiet for a
moment, and until then it is not drawn.
"""

import time
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import handlers, map_state, overlay_mesh, textures
from .mesh_arrays import MeshError

FILLS = ("CHECKER", "STRETCH", "ISLANDS")  # one of them is shown at a time
SEAMS = "SEAMS"  # beside any of them, or alone
QUICK_SECONDS = 0.05  # what takes no longer to make is made while something is dragged
QUIET_SECONDS = 0.3  # after the last change, before anything else is made anew
SOON_SECONDS = 0.01
SCALE_TOLERANCE = 1e-4  # relative: what turning an object changes by rounding
ISLAND_COLOURS = 997  # objects begin at different ones of so many colours


@dataclass(frozen=True)
class _State:
    """What an object was when its picture was made, as far as that is told at once."""

    mesh_uid: int
    map_name: str
    mode: str
    settings: tuple
    scale: np.ndarray

    @classmethod
    def of(cls, obj, settings):
        layer = obj.data.uv_layers.active
        mode = "EDIT" if obj.mode == "EDIT" else "OBJECT"
        return cls(obj.data.session_uid, layer.name if layer else "", mode, settings, map_state.scale(obj))

    def holds(self, obj, settings):
        now = _State.of(obj, settings)
        same = (self.mesh_uid, self.map_name, self.mode, self.settings)
        if same != (now.mesh_uid, now.map_name, now.mode, now.settings):
            return False
        tolerance = SCALE_TOLERANCE * np.abs(self.scale).max()
        return np.allclose(self.scale, now.scale, rtol=0.0, atol=tolerance, equal_nan=True)


@dataclass
class _Kept:
    """The picture of one object."""

    name: str
    uid: int
    state: _State
    picture: overlay_mesh.Picture | None  # None where the mesh that Blender shows has no such map
    seconds: float  # that it took to make
    changed: bool = False  # the mesh may be another one since
    batches: dict = field(default_factory=dict)  # on the graphics card, made when first drawn

    @property
    def object(self):
        obj = map_state.find(self.name, self.uid)
        return obj if obj is not None and obj.type == "MESH" else None


class _Shown:
    """What is shown."""

    fill, seams = "", False
    kept = {}  # by `session_uid` of the object
    layer = None  # the view layer that these are of, as `_layer` tells it
    handle = None
    changed_at = None  # when something changed last that is not made anew yet


def is_shown(kind):
    """Whether this of `FILLS`, or `SEAMS`, is on."""
    return _Shown.seams if kind == SEAMS else _Shown.fill == kind


def is_on():
    """Whether anything is shown."""
    return bool(_Shown.fill or _Shown.seams)


def worst():
    """Factors by which lines of all shown faces are longer and shorter at most; None unless stretch is shown."""
    found = [kept.picture.worst for kept in _Shown.kept.values() if kept.picture is not None and kept.picture.worst]
    return tuple(max(factors) for factors in zip(*found, strict=True)) if found else None


def pictures():
    """What would be drawn now: (object, its picture), in no order."""
    settings = _settings(bpy.context)
    return [
        (obj, kept.picture)
        for kept in _Shown.kept.values()
        if kept.picture is not None and (obj := kept.object) is not None and _is_drawn(kept, obj, settings)
    ]


def toggle(context, kind):
    """Turns this of `FILLS`, or `SEAMS`, on or off; of the fills the one that was on makes room.

    Raises `MeshError` where there is nothing to show it on; then what was on stays.
    """
    before = _Shown.fill, _Shown.seams
    if kind == SEAMS:
        _Shown.seams = not _Shown.seams
    else:
        _Shown.fill = "" if _Shown.fill == kind else kind
    if not is_on():
        turn_off()
        return
    was_on = any(before)
    try:
        refresh(context)
        if not any(kept.picture is not None for kept in _Shown.kept.values()):
            raise MeshError("The selected meshes have no UV map to show, or their modifiers leave none")
    except MeshError:
        _Shown.fill, _Shown.seams = before
        if not was_on:
            turn_off()
        raise
    if _Shown.handle is None and not bpy.app.background:
        _Shown.handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def turn_off():
    """Shows nothing any more, and forgets what it was shown on."""
    _Shown.fill, _Shown.seams = "", False
    _Shown.kept = {}
    _Shown.changed_at = None
    if _Shown.handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_Shown.handle, "WINDOW")
        _Shown.handle = None
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)


def refresh(context):
    """Makes what is missing or out of date, and drops what is not shown any more."""
    settings = _settings(context)
    objects = _targets(context)
    depsgraph = context.evaluated_depsgraph_get()
    kept = {}
    for obj in objects:
        old = _Shown.kept.get(obj.session_uid)
        if old is not None and not old.changed and old.state.holds(obj, settings):
            kept[obj.session_uid] = old
        else:
            kept[obj.session_uid] = _make(obj, settings, depsgraph)
    _Shown.kept, _Shown.layer = kept, _layer(context)
    _Shown.changed_at = None


def _layer(context):
    """What tells the view layer of a context, or of a window, from others."""
    return context.scene.session_uid, context.view_layer.name


def _make(obj, settings, depsgraph):
    started = time.perf_counter()
    state = _State.of(obj, settings)
    surface = overlay_mesh.read(obj, state.map_name, depsgraph) if state.map_name else None
    picture = None
    if surface is not None:
        fill, size, proportioned = settings
        if proportioned:
            size, _ = textures.proportioned_size([obj], [state.map_name], size)
        first = obj.session_uid % ISLAND_COLOURS
        picture = overlay_mesh.picture(surface, fill, matrix=obj.matrix_world, texture_size=size, first=first)
    return _Kept(obj.name, obj.session_uid, state, picture, time.perf_counter() - started)


def _settings(context):
    settings = context.scene.ble_unwrap
    return _Shown.fill, tuple(settings.texture_size), settings.correct_aspect


def _targets(context):
    """The meshes that it is shown on."""
    if context.mode == "EDIT_MESH":
        return [obj for obj in context.objects_in_mode if obj.type == "MESH"]
    chosen = [obj for obj in context.view_layer.objects.selected if obj.type == "MESH"]
    return chosen or [obj for kept in _Shown.kept.values() if (obj := kept.object) is not None]


def _is_drawn(kept, obj, settings):
    """Whether the picture is one of what is there; while it is quick to make, also until it is made anew."""
    if kept.changed and kept.seconds > QUICK_SECONDS:
        return False
    return kept.state.holds(obj, settings)


def _draw():
    """Draws in one 3D view; called by Blender."""
    from . import overlay_drawing  # needs a window, which there is by now

    context = bpy.context
    view = context.space_data
    if _layer(context) != _Shown.layer:
        # Windows may show several scenes: it is shown in one, so that they do not take it from each other for ever.
        if not any(_layer(window) == _Shown.layer for window in context.window_manager.windows):
            _later(SOON_SECONDS)
        return
    settings = _settings(context)
    if {obj.session_uid for obj in _targets(context)} != set(_Shown.kept):
        _later(SOON_SECONDS)
    shown = []
    for kept in _Shown.kept.values():
        obj = kept.object
        if obj is None or context.view_layer.objects.get(obj.name) != obj:
            continue
        if not _is_drawn(kept, obj, settings):
            _later(SOON_SECONDS)
        elif kept.picture is not None and obj.visible_get(viewport=view) and view.overlay.show_overlays:
            shown.append((kept, obj.matrix_world.copy(), obj.mode == "EDIT"))
    try:
        overlay_drawing.draw(context, shown, _Shown.fill, _Shown.seams, settings[1])
    except Exception:
        # Told once, not at every redraw. A handler cannot be removed while it runs.
        bpy.app.timers.register(turn_off)
        raise


def _later(seconds):
    if not bpy.app.background and not bpy.app.timers.is_registered(_settle):
        bpy.app.timers.register(_settle, first_interval=seconds)


def _settle():
    """Makes anew what is out of date, once Blender is quiet; returns how long to wait before it is asked again."""
    if not is_on():
        return None
    slow = any(kept.changed and kept.seconds > QUICK_SECONDS for kept in _Shown.kept.values())
    if slow and _Shown.changed_at is not None:
        left = QUIET_SECONDS - (time.monotonic() - _Shown.changed_at)
        if left > 0:
            return left
    try:
        refresh(bpy.context)
    except Exception:
        turn_off()  # told once, not again and again
        raise
    redraw()
    return None


def redraw():
    """Shows in all 3D views, and in the panels, what is on now."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"IMAGE_EDITOR", "VIEW_3D"}:
                area.tag_redraw()


def _change(uids=None):
    """What is drawn on these objects or meshes, or on all, may be out of date."""
    changed = [kept for kept in _Shown.kept.values() if uids is None or uids & {kept.uid, kept.state.mesh_uid}]
    for kept in changed:
        kept.changed = True
    if changed:
        _Shown.changed_at = time.monotonic()
        _later(SOON_SECONDS)


@bpy.app.handlers.persistent
def changed(_scene, depsgraph):
    """After every change in Blender."""
    if _Shown.kept:
        _change({update.id.original.session_uid for update in depsgraph.updates if update.is_updated_geometry})


@bpy.app.handlers.persistent
def undone(*_):
    """After undo or redo, whether or not Blender counts them as changes."""
    _change()


@bpy.app.handlers.persistent
def forget(*_):
    """Another file is loaded."""
    turn_off()


HANDLERS = (("depsgraph_update_post", changed), ("undo_post", undone), ("redo_post", undone), ("load_post", forget))


def register():
    handlers.add(HANDLERS)


def unregister():
    handlers.remove(HANDLERS)
    turn_off()
