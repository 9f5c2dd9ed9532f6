"""Functions that Blender calls after an event, such as undo: added and taken back."""

import bpy


def add(handlers):
    """Has each function called after its event; `handlers` are pairs of the name of an event and a function."""
    for event, function in handlers:
        getattr(bpy.app.handlers, event).append(function)


def remove(handlers):
    """Takes back what was added."""
    for event, function in handlers:
        getattr(bpy.app.handlers, event).remove(function)
