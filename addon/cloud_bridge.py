"""Points to flat arrays, and UVs back as an attribute of the points: what mesh_bridge.py is for surfaces.

A cloud is a mesh of vertices alone or a point cloud object. Its UVs are an attribute of two floats on points, which
geometry nodes and the Attribute node of materials read by name. Nothing that is there under that name is lost: where
it is something else, the next free name is taken (`attribute_to_write`).
"""

import hashlib
import re
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import mesh_bridge
from .mesh_bridge import MeshError, read_array

LEAST_POINTS = 4  # fewer have no neighbourhood to be flattened
DEFAULT_NAME = "UVMap"
NORMAL_NAME = "normal"
MOST_NUMBERED_NAMES = 1000


@dataclass
class Cloud:
    """The points of one data-block that are mapped together, and how to find it again."""

    data_uid: int
    data_name: str
    object_name: str
    is_mesh: bool
    taken_names: frozenset  # vertex groups, with which attributes share their names
    positions: np.ndarray  # (n, 3) float32, in the scene's unit of length
    source_points: np.ndarray | None  # point indices in the data; None: all
    fingerprint: bytes
    warnings: list[str] = field(default_factory=list)

    @property
    def title(self):
        return self.object_name


def read_cloud(obj, *, only_selected=False):
    """Reads the points of an object, before modifiers and shape keys; those selected in edit mode where asked.

    Returns None where no point is chosen. Raises `MeshError` where the attribute could not be written.
    """
    data = obj.data
    check_writable(obj)
    if obj.type == "MESH" and obj.mode == "EDIT":
        obj.update_from_editmode()
    positions = point_positions(data)
    source_points = None
    if only_selected and obj.mode == "EDIT":
        chosen = selected_points(data, len(positions))
        if not chosen.all():
            source_points = np.flatnonzero(chosen).astype(np.int32)
    digest = fingerprint(positions)
    if source_points is not None:
        positions = positions[source_points]
    if not len(positions):
        return None
    positions, note = mesh_bridge.scale_as_in_scene(positions, obj.matrix_world)
    return Cloud(
        data_uid=data.session_uid,
        data_name=data.name_full,
        object_name=obj.name,
        is_mesh=obj.type == "MESH",
        taken_names=frozenset(group.name for group in obj.vertex_groups) if obj.type == "MESH" else frozenset(),
        positions=np.ascontiguousarray(positions, np.float32),
        source_points=source_points,
        fingerprint=digest,
        warnings=[f"{obj.name}: {note}"] if note else [],
    )


def check_writable(obj):
    """Raises `MeshError` where the attribute could not be written."""
    if not obj.data.is_editable:
        raise MeshError(f"{obj.name}: its points are linked from another file and cannot be changed")


def too_few(cloud):
    """Why a cloud has not enough points to be mapped, or None."""
    finite = int(np.isfinite(cloud.positions).all(axis=1).sum())
    if finite >= LEAST_POINTS:
        return None
    which = "" if finite == len(cloud.positions) else " whose coordinates are finite"
    points = f"{finite or 'no'} point{'' if finite == 1 else 's'}"
    return f"{cloud.object_name}: has {points}{which}; a map needs at least {LEAST_POINTS}"


def point_positions(data):
    """Positions of all points, (n, 3) float32."""
    if isinstance(data, bpy.types.Mesh):
        return mesh_bridge.read_positions(data)
    attribute = data.attributes.get("position")
    if attribute is not None and len(attribute.data) == len(data.points):
        return read_array(attribute.data, "vector", np.float32, 3)
    return read_array(data.points, "co", np.float32, 3)


def selected_points(data, count):
    """Which points are selected in edit mode; all of them where Blender has not noted any selection."""
    if isinstance(data, bpy.types.Mesh):
        return read_array(data.vertices, "select", bool)
    attribute = data.attributes.get(".selection")
    if attribute is None or attribute.data_type != "BOOLEAN" or len(attribute.data) != count:
        return np.ones(count, bool)
    return read_array(attribute.data, "value", bool)


def fingerprint(positions):
    """Digest of the points: equal as long as they are the same ones in the same order and place."""
    return hashlib.blake2b(np.ascontiguousarray(positions).tobytes(), digest_size=16).digest()


def find_data(cloud):
    """The data-block of a cloud, or `MeshError` where it is gone or its points have changed."""
    library = bpy.data.meshes if cloud.is_mesh else bpy.data.pointclouds
    data = library.get(cloud.data_name)
    if data is None or data.session_uid != cloud.data_uid:
        data = next((other for other in library if other.session_uid == cloud.data_uid), None)
    if data is None:
        raise MeshError(f"{cloud.object_name} was removed meanwhile; nothing was changed")
    if cloud.is_mesh and data.is_editmode:
        for obj in bpy.data.objects:
            if obj.data == data and obj.mode == "EDIT":
                obj.update_from_editmode()
    if fingerprint(point_positions(data)) != cloud.fingerprint:
        raise MeshError(f"{cloud.object_name} was edited meanwhile; nothing was changed")
    return data


def edited_meshes(cloud):
    """The data as a list for `mesh_bridge.object_mode`: attributes of meshes are empty arrays in edit mode, those of
    point clouds are not."""
    return [find_data(cloud)] if cloud.is_mesh else []


def check(cloud, *, map_name=DEFAULT_NAME):
    """Raises `MeshError` where the data is gone or edited, or no name is left for the attribute."""
    attribute_to_write(find_data(cloud), map_name, False, cloud.taken_names)


def write_uvs(cloud, uv, *, map_name=DEFAULT_NAME):
    """Writes one UV per point, and returns what the data holds afterwards, (n, 2) float32, with the attribute's name.

    Only the points of the cloud are written. Nothing is changed when the data is gone or edited.
    """
    uv = np.ascontiguousarray(uv, np.float32)
    data = find_data(cloud)
    with mesh_bridge.object_mode(edited_meshes(cloud)):
        name = attribute_to_write(data, map_name, False, cloud.taken_names)
        made = data.attributes.get(name) is None
        if made:
            name = add_attribute(data, name, cloud.object_name)
        values = uv
        if cloud.source_points is not None:
            values = read_array(data.attributes[name].data, "vector", np.float32, 2)
            values[cloud.source_points] = uv
        data.attributes[name].data.foreach_set("vector", np.ascontiguousarray(values).reshape(-1))
        if made:
            data.attributes.active = data.attributes[name]
        data.update() if cloud.is_mesh else data.update_tag()
        after = read_array(data.attributes[name].data, "vector", np.float32, 2)
    return (after if cloud.source_points is None else after[cloud.source_points]), name


def is_point_map(attribute):
    return (attribute.domain, attribute.data_type) == ("POINT", "FLOAT2")


def attribute_to_write(data, map_name, make_new, taken_names=frozenset()):
    """The first of NAME, NAME.001, NAME.002 … that is free or, unless a new one is asked for, holds UVs of points.

    A UV map of face corners, even an empty one that deleted faces have left, or other data of the name is kept.
    """
    base = map_name or DEFAULT_NAME
    for number in range(MOST_NUMBERED_NAMES):
        name = f"{base}.{number:03d}" if number else base
        attribute = data.attributes.get(name)
        if attribute is None:
            if name not in taken_names:
                return name
        elif is_point_map(attribute) and not make_new:
            return name
    raise MeshError(f"{data.name}: all names from {base} to {name} are taken; choose another name")


def add_attribute(data, name, object_name):
    """Adds an empty attribute for UVs; returns the name that Blender gave it."""
    try:
        attribute = data.attributes.new(name, "FLOAT2", "POINT")
    except RuntimeError as error:
        raise MeshError(f"{object_name}: Blender could not add the attribute {name}: {error}") from error
    if attribute is None:
        raise MeshError(f"{object_name}: Blender could not add the attribute {name}")
    return attribute.name


def read_uvs(cloud, map_name=DEFAULT_NAME):
    """UVs that the attribute to be written holds now, (n, 2) float32; None where there is none yet."""
    data = find_data(cloud)
    with mesh_bridge.object_mode(edited_meshes(cloud)):
        name = attribute_to_write(data, map_name, False, cloud.taken_names)
        if data.attributes.get(name) is None:
            return None
        values = read_array(data.attributes[name].data, "vector", np.float32, 2)
    return values if cloud.source_points is None else values[cloud.source_points]


def add_point_data(data, uv=None, normals=None, uv_name=DEFAULT_NAME):
    """Gives the points of a mesh UVs and normals that a file has and its import left out.

    An empty UV map of face corners that the import made under the name goes, so that the points can have it.
    """
    if uv is not None:
        empty = data.uv_layers.get(uv_name)
        if empty is not None and not data.loops:
            data.uv_layers.remove(empty)
        name = add_attribute(data, attribute_to_write(data, uv_name, True), data.name)
        data.attributes[name].data.foreach_set("vector", np.ascontiguousarray(uv, np.float32).reshape(-1))
    if normals is not None and data.attributes.get(NORMAL_NAME) is None:
        attribute = data.attributes.new(NORMAL_NAME, "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", np.ascontiguousarray(normals, np.float32).reshape(-1))


def point_columns(obj, uv_name):
    """All that a file of points can hold, as one-dimensional arrays by name: place in the world, normal, UV as `s` and
    `t`, colour, and other numbers of the points under their own names."""
    data = obj.data
    matrix = np.array(obj.matrix_world, np.float64)
    positions = point_positions(data).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    columns = dict(zip("xyz", positions.astype(np.float32).T, strict=True))
    others, coloured = {}, False
    for attribute in data.attributes:
        kind, name = attribute.data_type, re.sub(r"\s", "_", attribute.name)
        if attribute.domain != "POINT" or name.startswith(".") or name == "position" or not name.isascii():
            continue
        if kind in {"FLOAT_COLOR", "BYTE_COLOR"} and not coloured:
            values = read_array(attribute.data, "color_srgb", np.float32, 4)
            values = np.clip(np.nan_to_num(values) * 255 + 0.5, 0, 255).astype(np.uint8)
            others |= dict(zip(("red", "green", "blue", "alpha"), values.T, strict=True))
            coloured = True
        elif attribute.name == uv_name and is_point_map(attribute):
            columns |= dict(zip("st", read_array(attribute.data, "vector", np.float32, 2).T, strict=True))
        elif kind in {"FLOAT_VECTOR", "FLOAT2"}:
            width = 3 if kind == "FLOAT_VECTOR" else 2
            values = read_array(attribute.data, "vector", np.float32, width).T
            if name == NORMAL_NAME:
                values = normals_as_turned(values.T, matrix[:3, :3]).T
                others |= dict(zip(("nx", "ny", "nz"), values, strict=True))
            else:
                others |= {f"{name}_{axis}": column for axis, column in zip("xyz", values, strict=False)}
        elif kind in {"FLOAT", "INT", "INT8"}:
            dtype = {"FLOAT": np.float32, "INT": np.int32, "INT8": np.int32}[kind]
            others[name] = read_array(attribute.data, "value", dtype).astype(np.int8 if kind == "INT8" else dtype)
    return columns | {name: values for name, values in others.items() if name not in columns}


def normals_as_turned(normals, matrix):
    """Unit normals of a surface that a 3×3 matrix has moved; as they are where it has no inverse."""
    try:
        turned = normals.astype(np.float64) @ np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return normals
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return (turned / np.where(length > 0, length, 1.0)).astype(np.float32)
