"""Lengths as the scene's units write them."""

import bpy

METERS_OF = {"METRIC": (1.0, "m"), "IMPERIAL": (0.3048, "ft")}


def density(pixels_per_unit):
    """Pixels for each unit of length of the scene as a number of a metre or foot, and what the number is of."""
    units = bpy.context.scene.unit_settings
    if units.system == "NONE":
        return pixels_per_unit, "px per unit"
    meters, name = METERS_OF[units.system]
    return pixels_per_unit / units.scale_length * meters, f"px/{name}"


def length_text(length):
    """A length of the scene with its unit, three digits after the point; in a scene without units, a number."""
    units = bpy.context.scene.unit_settings
    if units.system == "NONE":
        return f"{length:.4g} units"
    meters = length * units.scale_length
    return bpy.utils.units.to_string(units.system, "LENGTH", meters, precision=4).strip()
