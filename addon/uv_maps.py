"""Which UV map of a mesh is written, and what would be lost by it: pinned UVs."""

from dataclasses import dataclass

import numpy as np

from .mesh_arrays import MeshError, in_bulk, read_array

DEFAULT_NAME = "UVMap"
MAX_UV_MAPS = 8  # Blender's own limit


@dataclass(frozen=True)
class MapChoice:
    """The active UV map, or with `by_name` the one of this name; under which it is made where there is none."""

    by_name: bool = False
    name: str = DEFAULT_NAME


def chosen(settings):
    """The map that settings ask for, missing ones at their defaults."""
    return MapChoice(settings.get("uv_map") == "NEW", settings.get("uv_map_name", DEFAULT_NAME))


def group_names(obj):
    """Names of an object's vertex groups, which Blender gives to no UV map of its mesh."""
    return frozenset(group.name for group in obj.vertex_groups)


def map_to_write(mesh, choice, groups=frozenset()):
    """Name of the UV map to write, and whether it is there already. Raises `MeshError` where it cannot be made.

    By name it is the first of NAME, NAME.001, NAME.002 … that is a UV map or free: other data may have the name.
    """
    maps = mesh.uv_layers
    if maps.active is not None and not choice.by_name:
        return maps.active.name, True
    taken = {attribute.name for attribute in mesh.attributes} | groups
    base = choice.name or DEFAULT_NAME
    for number in range(len(taken) + 1):
        name = f"{base}.{number:03d}" if number else base
        if name in maps:
            return name, True
        if name not in taken:
            break
    if len(maps) >= MAX_UV_MAPS:
        raise MeshError(
            f"{mesh.name}: has {MAX_UV_MAPS} UV maps already, the most Blender allows, and none is called {base}; "
            "write the active one or name one of them"
        )
    return name, False


def check_writable(obj, choice):
    """Raises `MeshError` where a UV map could not be written, before any time is spent."""
    if not obj.data.is_editable:
        raise MeshError(f"{obj.name}: its mesh is linked from another file and cannot be changed")
    map_to_write(obj.data, choice, group_names(obj))


def writable_layer(mesh, choice, groups):
    """The UV map to write, which becomes the active one; of a mesh in object mode."""
    maps = mesh.uv_layers
    name, there = map_to_write(mesh, choice, groups)
    layer = maps[name] if there else maps.new(name=name)
    if layer is None:
        raise MeshError(f"{mesh.name}: Blender could not add a UV map")
    maps.active = layer
    return layer


def check_pins(obj, choice, corners):
    """Raises `MeshError` where some of these corners, or any (None), have a pinned UV in the map to write."""
    name, there = map_to_write(obj.data, choice, group_names(obj))
    if not there:
        return
    pinned = pinned_corners(obj.data, name)
    count = int((pinned if corners is None else pinned[corners]).sum())
    if count:
        raise MeshError(
            f"{obj.name}: {count} face corner{' is' if count == 1 else 's are'} pinned in {name} and would be moved. "
            "Unpin (Alt P in the UV Editor), leave the faces out of the selection, or allow it by Move Pinned"
        )


def pinned_corners(mesh, map_name):
    """Corners whose UV is pinned, (c,) bool; of a mesh that is up to date, in either mode."""
    with in_bulk(mesh) as readable:
        pins = readable.uv_layers[map_name].pin
        # Since Blender 5.0 there are none before the first is set.
        return read_array(pins, "value", bool) if len(pins) else np.zeros(len(readable.loops), bool)


def read_map(mesh, map_name):
    """The UVs of a map by corner, (c, 2) float32; of a mesh that is up to date, in either mode."""
    with in_bulk(mesh) as readable:
        return read_array(readable.uv_layers[map_name].uv, "vector", np.float32, 2)
