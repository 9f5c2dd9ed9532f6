"""Registers the add-on's modules in order, and takes them back in reverse."""

from . import command, last_result, menu, panel, preferences, properties
from .operators import pack, select_edges, select_narrow, unwrap

MODULES = (preferences, properties, last_result, unwrap, pack, select_edges, select_narrow, panel, menu, command)


def register():
    """Registers everything; when one module fails, those before it are taken back and the error goes on."""
    done = []
    try:
        for module in MODULES:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister():
    for module in reversed(MODULES):
        module.unregister()
