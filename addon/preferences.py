"""Preferences of the add-on: what belongs to the machine, not to the scene."""

import bpy
from bpy.props import BoolProperty, IntProperty

from . import settings_table

THREADS = settings_table.ARGUMENTS["threads"]


class BLEUnwrapPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    threads: IntProperty(
        name=THREADS["label"],
        description=settings_table.tooltip(THREADS),
        default=THREADS["default"],
        soft_max=64,
        **settings_table.bounds(THREADS),
    )
    modal_threshold: IntProperty(
        name="Show Progress From",
        description="Meshes with at least this many faces are unwrapped in the background with progress and Esc",
        default=2000,
        min=0,
        soft_max=1_000_000,
    )
    measure_again: BoolProperty(
        name="Certify",
        description="After writing, read the UVs back from the mesh and measure these, not those that were computed",
        default=True,
    )

    def draw(self, _context):
        column = self.layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        for name in type(self).__annotations__:
            column.prop(self, name)


def preference(context, name):
    """A preference's value; its default when the add-on runs from source without being installed."""
    addon = context.preferences.addons.get(__package__)
    if addon is not None and addon.preferences is not None:
        return getattr(addon.preferences, name)
    return BLEUnwrapPreferences.__annotations__[name].keywords["default"]


def register():
    bpy.utils.register_class(BLEUnwrapPreferences)


def unregister():
    bpy.utils.unregister_class(BLEUnwrapPreferences)
