"""Registers the add-on's modules in order, and takes them back in reverse."""

from . import (
    command,
    last_check,
    last_comparison,
    last_result,
    menu,
    overlay,
    overlay_legend,
    panel,
    preferences,
    properties,
)
from .operators import (
    again,
    align,
    cancel,
    check,
    compare,
    pack,
    relax,
    select_edges,
    select_faulty,
    select_narrow,
    unwrap,
)
from .operators import overlay as show

MODULES = (
    *(preferences, properties, last_result, last_check, last_comparison, overlay, overlay_legend),
    *(again, cancel, unwrap, pack, align, relax, check, show, compare, select_edges, select_narrow, select_faulty),
    *(panel, menu, command),
)


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
