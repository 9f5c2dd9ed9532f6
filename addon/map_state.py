"""What a UV map and its object were when they were looked at, by which one can tell later whether they still are."""

import hashlib

import bmesh
import bpy
import numpy as np

from .mesh_arrays import read_array, read_corner_vertices, read_positions

# In edit mode meshes are read element by element, which takes a second a million corners: of larger ones there are no
# digests, which are asked for again and again.
MOST_EDITED_FACES = 50_000


def find(name, uid):
    """The object of this `session_uid` in a scene, whatever its name is by now; None where it is gone."""
    obj = bpy.data.objects.get(name)
    if obj is None or obj.session_uid != uid:
        obj = next((other for other in bpy.data.objects if other.session_uid == uid), None)  # it was renamed
    return obj if obj is not None and obj.users_scene else None


def corner_count(obj):
    """Face corners of a mesh; 0 where there are only points."""
    return len(obj.data.loops) if obj.type == "MESH" else 0


def read_uv(obj, map_name):
    """The UVs by corner or point, (n, 2) float32, in either mode; None where there are none."""
    data = obj.data
    if obj.type == "MESH" and data.is_editmode:
        edit_mesh = bmesh.from_edit_mesh(data)
        layer = edit_mesh.loops.layers.uv.get(map_name)
        if layer is None:
            return None
        numbers = (x for face in edit_mesh.faces for loop in face.loops for x in loop[layer].uv)
        return np.fromiter(numbers, np.float32).reshape(-1, 2)
    attribute = data.attributes.get(map_name)
    if attribute is None or attribute.data_type != "FLOAT2":
        return None
    return read_array(attribute.data, "vector", np.float32, 2)


def uv_digest(obj, map_name):
    """Digest of the UVs, the same in either mode; None where there are none or it would take too long."""
    uv = None if _is_too_large(obj) else read_uv(obj, map_name)
    return None if uv is None else _digest(uv)


def _is_too_large(obj):
    """Whether a digest would take too long."""
    in_edit_mode = obj.type == "MESH" and obj.data.is_editmode
    return in_edit_mode and len(bmesh.from_edit_mesh(obj.data).faces) > MOST_EDITED_FACES


def shape_digest(obj):
    """Digest of the faces and the shape of a mesh, the same in either mode; None where it would take too long.

    A mesh in edit mode is asked itself, and not brought up to date for it: Blender would take that for a change.
    """
    mesh = obj.data
    if not mesh.is_editmode:
        return _digest(read_positions(mesh), read_corner_vertices(mesh))
    if _is_too_large(obj):
        return None
    edit_mesh = bmesh.from_edit_mesh(mesh)
    positions = np.array([tuple(vertex.co) for vertex in edit_mesh.verts], np.float32).reshape(-1, 3)
    edit_mesh.verts.index_update()
    corners = [loop.vert.index for face in edit_mesh.faces for loop in face.loops]
    return _digest(positions, np.array(corners, np.int32))


def scale(obj):
    """How an object's transform stretches lengths, (3, 3), whatever its place and rotation are."""
    matrix = np.array(obj.matrix_world.to_3x3(), np.float64)
    return matrix.T @ matrix


def _digest(*arrays):
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
