"""Large work from Adjust Last Operation, the redo panel, runs with progress and Esc, too.

When a setting is changed there, Blender takes the operator's step back, calls `execute`, and does nothing else until
that returns. So `execute` of large work only asks to be invoked here, and returns as cancelled, upon which Blender puts
the former result back. As soon as it has, the step is taken back once more and the operator is invoked with the
settings of the panel, as by its button. If that ends without a result, the former one comes back.

Repeat Last calls `execute` likewise, but takes no step back and puts none back: then none is taken back here.
"""

import bpy

from .. import handlers


class _Asked:
    name = None  # of the operator that is to be invoked
    values = None  # what its settings are
    was_put_back = False  # whether Blender has put the former result back since
    is_invoked = False  # while the operator is being invoked from here


def ask(operator):
    """Has an operator invoked with the settings that it has, as soon as Blender can handle events again."""
    properties = operator.properties
    names = [name for name in properties.bl_rna.properties.keys() if name != "rna_type"]  # noqa: SIM118
    _Asked.values = {name: _plain(getattr(properties, name)) for name in names if properties.is_property_set(name)}
    _Asked.name, _Asked.was_put_back = operator.bl_idname, False
    bpy.app.timers.register(_invoke, first_interval=0.0)


def is_invoked():
    """Whether an operator that is being invoked was asked for here."""
    return _Asked.is_invoked


def bring_back():
    """Brings the former result back, as soon as Blender can: what was to replace it has not been computed."""
    bpy.app.timers.register(_bring_back, first_interval=0.0)


def _plain(value):
    return value if isinstance(value, (bool, int, float, str, set)) else tuple(value)


def _invoke():
    group, name = _Asked.name.lower().split("_ot_") if "_OT_" in _Asked.name else _Asked.name.split(".")
    with bpy.context.temp_override(window=_window()):
        if _Asked.was_put_back:
            bpy.ops.ed.undo()
        _Asked.is_invoked = _Asked.was_put_back
        try:
            getattr(getattr(bpy.ops, group), name)("INVOKE_DEFAULT", **_Asked.values)
        finally:
            _Asked.is_invoked = False


def _bring_back():
    with bpy.context.temp_override(window=_window()):
        bpy.ops.ed.redo()


def _window():
    return bpy.context.window or bpy.context.window_manager.windows[0]


@bpy.app.handlers.persistent
def put_back(*_):
    """Blender has gone forward by a step."""
    _Asked.was_put_back = True


HANDLERS = (("redo_post", put_back),)


def register():
    handlers.add(HANDLERS)


def unregister():
    handlers.remove(HANDLERS)
    for function in (_invoke, _bring_back):
        if bpy.app.timers.is_registered(function):
            bpy.app.timers.unregister(function)
