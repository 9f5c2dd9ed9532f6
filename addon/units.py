"""Lengths as the scene's units write them."""

import bpy


def length_text(length):
    """A length of the scene with its unit, three digits after the point; in a scene without units, a number."""
    units = bpy.context.scene.unit_settings
    if units.system == "NONE":
        return f"{length:.4g} units"
    meters = length * units.scale_length
    return bpy.utils.units.to_string(units.system, "LENGTH", meters, precision=4).strip()
