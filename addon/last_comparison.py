"""The last comparison with Smart UV Project, for the panel, as long as both of its maps are there.

It belongs to the session: undo takes the maps away, and the table with them, and redo brings both back.
"""

from dataclasses import dataclass

import bpy

from . import comparison_image, handlers, map_state


@dataclass(frozen=True)
class _Entry:
    """One object that was compared."""

    name: str
    uid: int
    mesh_uid: int
    maps: dict  # side -> name of its map
    before: tuple  # names of the map that was active and of the one that was rendered; None where none was

    @property
    def object(self):
        """The object, where both maps are there; else None."""
        obj = map_state.find(self.name, self.uid)
        if obj is None or obj.type != "MESH" or obj.data.session_uid != self.mesh_uid:
            return None
        return obj if all(name in obj.data.uv_layers for name in self.maps.values()) else None


class _Shown:
    entries = ()
    title, rows = "", ()


def show(context, compared):
    """Puts up what was `smart_comparison.Compared`."""
    found = zip(compared.objects, compared.maps, compared.active, strict=True)
    _Shown.entries = tuple(
        _Entry(obj.name, obj.session_uid, obj.data.session_uid, dict(maps), before) for obj, maps, before in found
    )
    _Shown.title, _Shown.rows = compared.title, tuple(compared.rows)
    comparison_image.put_up(context, compared.picture)


def is_there():
    """Whether there is a comparison to choose from."""
    return bool(_Shown.entries) and all(entry.object is not None for entry in _Shown.entries)


def title():
    return _Shown.title


def rows():
    """The table: a label and a text for each side."""
    return _Shown.rows


def entries():
    """What was compared, as `smart_comparison.keep` takes it; empty where it is gone."""
    return [(entry.object, entry.maps, entry.before) for entry in _Shown.entries] if is_there() else []


@bpy.app.handlers.persistent
def undone(*_):
    """After undo or redo: the maps may be gone or there again, and with them the image."""
    if not _Shown.entries:
        return
    if is_there():
        comparison_image.draw_again(bpy.context)
    else:
        comparison_image.restore_editors(bpy.context)


@bpy.app.handlers.persistent
def forget(*_):
    """Another file is loaded."""
    _Shown.entries, _Shown.title, _Shown.rows = (), "", ()
    comparison_image.forget()


HANDLERS = (("undo_post", undone), ("redo_post", undone), ("load_post", forget))


def register():
    handlers.add(HANDLERS)


def unregister():
    handlers.remove(HANDLERS)
    forget()
