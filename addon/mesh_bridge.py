"""Blender's meshes to flat arrays, and UVs back: the only file that touches mesh data; cloud_bridge.py builds upon it
for points without faces.

Everything crosses in bulk (`foreach_get`, `foreach_set`); no loop runs over elements. Reading changes nothing.
Writing happens in one go at the end, and only on meshes that are still as they were read.
"""

import hashlib
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

MARKS = ("seams", "sharp", "materials")  # what an artist marks edges by
MAX_UV_MAPS = 8  # Blender's own limit
SCALE_TOLERANCE = 1e-3  # relative difference of an object's axes from which its scale counts as non-uniform


class MeshError(Exception):
    """The selection cannot be unwrapped, or not any more; the text is for the user."""


class NothingToUnwrap(MeshError):
    """There is no face, or none is selected."""


@dataclass
class MeshPart:
    """One mesh within the arrays of a `Selection`, and how to find it again."""

    mesh_uid: int
    mesh_name: str
    object_name: str
    corners: slice  # of the concatenated corner arrays
    faces: slice  # of the concatenated faces
    source_corners: np.ndarray | None  # corner indices in the mesh; None: all
    source_faces: np.ndarray | None  # face indices in the mesh; None: all
    fingerprint: bytes


@dataclass
class Selection:
    """All that is unwrapped together into one atlas, as concatenated arrays."""

    parts: list[MeshPart]
    positions: np.ndarray  # (n, 3) float32, in the scene's unit of length
    corner_vertices: np.ndarray  # (c,) int32
    face_offsets: np.ndarray  # (f + 1,) int32
    corner_triangles: np.ndarray | None  # (t, 3) int32 corners; None: only triangles
    marks: dict[str, np.ndarray]  # of each kind in MARKS the edges that have it, (m, 2) int32 vertices
    warnings: list[str] = field(default_factory=list)

    def marked(self, kinds):
        """The edges of these kinds, (m, 2) int32 vertices; None where there are none."""
        edges = np.concatenate([self.marks[kind] for kind in kinds]) if kinds else ()
        return edges if len(edges) else None

    @property
    def title(self):
        first = self.parts[0].object_name
        return first if len(self.parts) == 1 else f"{first} and {len(self.parts) - 1} more"

    @property
    def face_count(self):
        return len(self.face_offsets) - 1


def unique_meshes(objects):
    """Mesh objects without those that share the data of an earlier one."""
    seen, result = set(), []
    for obj in objects:
        if obj.type == "MESH" and obj.data.session_uid not in seen:
            seen.add(obj.data.session_uid)
            result.append(obj)
    return result


def gather(objects, *, only_selected=False, make_new_map=False):
    """Reads the objects' base meshes (before modifiers and shape keys) as one `Selection`.

    Positions are scaled as the objects are in the scene, so that all share one texel density. With `only_selected`,
    only faces selected in edit mode are read. Raises `MeshError` where nothing can be unwrapped or written.
    """
    warnings, parts, blocks = [], [], []
    vertex_base = corner_base = face_base = 0
    for obj in objects:
        mesh = obj.data
        check_writable(obj, make_new_map)
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        block = read_mesh(mesh, only_selected and obj.mode == "EDIT")
        if block is None:
            continue
        positions, note = scale_as_in_scene(block["positions"], obj.matrix_world)
        if note:
            warnings.append(f"{obj.name}: {note}")
        corner_count, face_count = len(block["corner_vertices"]), len(block["face_sizes"])
        parts.append(
            MeshPart(
                mesh_uid=mesh.session_uid,
                mesh_name=mesh.name_full,
                object_name=obj.name,
                corners=slice(corner_base, corner_base + corner_count),
                faces=slice(face_base, face_base + face_count),
                source_corners=block["source_corners"],
                source_faces=block["source_faces"],
                fingerprint=fingerprint(mesh),
            )
        )
        blocks.append(
            (
                positions,
                block["corner_vertices"] + vertex_base,
                block["face_sizes"],
                block["triangles"] + corner_base,
                *(block["marks"][kind] + vertex_base for kind in MARKS),
            )
        )
        vertex_base += len(positions)
        corner_base += corner_count
        face_base += face_count
    if not parts:
        chosen = only_selected and any(obj.mode == "EDIT" and obj.data.polygons for obj in objects)
        raise NothingToUnwrap("No faces are selected" if chosen else "There are no faces to unwrap")
    if max(vertex_base, corner_base) > np.iinfo(np.int32).max:
        raise MeshError("The selection is too large: more than two thousand million corners")
    positions, corner_vertices, sizes, triangles, *marks = (
        np.concatenate(column) for column in zip(*blocks, strict=True)
    )
    offsets = np.zeros(len(sizes) + 1, np.int32)
    np.cumsum(sizes, out=offsets[1:])
    return Selection(
        parts=parts,
        positions=np.ascontiguousarray(positions, np.float32),
        corner_vertices=np.ascontiguousarray(corner_vertices, np.int32),
        face_offsets=offsets,
        corner_triangles=None if (sizes == 3).all() else np.ascontiguousarray(triangles, np.int32),
        marks={kind: np.ascontiguousarray(edges, np.int32) for kind, edges in zip(MARKS, marks, strict=True)},
        warnings=warnings,
    )


def check_writable(obj, make_new_map):
    """Raises `MeshError` where a UV map could not be written, before any time is spent."""
    mesh = obj.data
    if not mesh.is_editable:
        raise MeshError(f"{obj.name}: its mesh is linked from another file and cannot be changed")
    if make_new_map and len(mesh.uv_layers) >= MAX_UV_MAPS:
        raise MeshError(f"{obj.name}: has {MAX_UV_MAPS} UV maps already, the most Blender allows; write the active one")


def read_array(collection, attribute, dtype, width=1):
    """One attribute of all elements as an array, (n,) or (n, width)."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(attribute, values)
    return values.reshape(-1, width) if width > 1 else values


def read_positions(mesh):
    attribute = mesh.attributes.get("position")
    if attribute is not None and len(attribute.data) == len(mesh.vertices):
        return read_array(attribute.data, "vector", np.float32, 3)
    return read_array(mesh.vertices, "co", np.float32, 3)


def read_corner_vertices(mesh):
    attribute = mesh.attributes.get(".corner_vert")  # ten times as fast as asking the loops
    if attribute is not None and len(attribute.data) == len(mesh.loops):
        return read_array(attribute.data, "value", np.int32)
    return read_array(mesh.loops, "vertex_index", np.int32)


def read_face_offsets(mesh):
    starts = read_array(mesh.polygons, "loop_start", np.int32)
    return np.append(starts, np.int32(len(mesh.loops)))


def read_mesh(mesh, only_selected):
    """Arrays of one mesh, compacted to its selected faces where asked; None where no face is left."""
    if not mesh.polygons:
        return None
    positions = read_positions(mesh)
    corner_vertices = read_corner_vertices(mesh)
    offsets = read_face_offsets(mesh)
    sizes = np.diff(offsets)
    marks = read_marks(mesh, sizes)
    mesh.calc_loop_triangles()
    triangles = read_array(mesh.loop_triangles, "loops", np.int32, 3)
    source_faces = source_corners = None
    if only_selected:
        chosen = read_array(mesh.polygons, "select", bool)
        if not chosen.any():
            return None
        if not chosen.all():
            source_faces = np.flatnonzero(chosen).astype(np.int32)
            corner_chosen = np.repeat(chosen, sizes)
            source_corners = np.flatnonzero(corner_chosen).astype(np.int32)
            triangles = renumber(triangles[corner_chosen[triangles[:, 0]]], corner_chosen)
            corner_vertices = corner_vertices[source_corners]
            vertex_chosen = np.zeros(len(positions), bool)
            vertex_chosen[corner_vertices] = True
            corner_vertices = renumber(corner_vertices, vertex_chosen)
            marks = {
                kind: renumber(edges[vertex_chosen[edges].all(axis=1)], vertex_chosen) for kind, edges in marks.items()
            }
            positions = positions[vertex_chosen]
            sizes = sizes[source_faces]
    return {
        "positions": positions,
        "corner_vertices": corner_vertices,
        "face_sizes": sizes,
        "triangles": triangles,
        "marks": marks,
        "source_faces": source_faces,
        "source_corners": source_corners,
    }


def read_marks(mesh, face_sizes):
    """The edges of each kind in `MARKS` as pairs of vertices: seams, sharp edges, borders of materials."""
    edges = read_array(mesh.edges, "vertices", np.int32, 2)
    marks = {
        "seams": edges[read_array(mesh.edges, "use_seam", bool)],
        "sharp": edges[read_array(mesh.edges, "use_edge_sharp", bool)],
        "materials": edges[:0],
    }
    if len(mesh.materials) > 1:
        corner_edges = read_array(mesh.loops, "edge_index", np.int32)
        material = np.repeat(read_array(mesh.polygons, "material_index", np.int32), face_sizes)
        any_of = np.zeros(len(edges), np.int32)
        any_of[corner_edges] = material
        border = np.zeros(len(edges), bool)
        border[corner_edges[material != any_of[corner_edges]]] = True
        marks["materials"] = edges[border]
    return marks


def renumber(indices, chosen):
    """Indices into the elements that remain when only the chosen ones are kept."""
    return (np.cumsum(chosen, dtype=np.int32) - 1)[indices].reshape(indices.shape)


def scale_as_in_scene(positions, matrix_world):
    """Positions as large as the object is in the scene, not turned; and a note where its axes differ.

    The scale is the symmetric factor S of the polar decomposition M = R·S, so the shape is what is seen, up to a
    rotation, and a uniform scale is a plain factor.
    """
    matrix = np.array(matrix_world.to_3x3(), np.float64)
    if not np.isfinite(matrix).all():
        return positions, "its transform is not finite and was left out"
    values, vectors = np.linalg.eigh(matrix.T @ matrix)
    scales = np.sqrt(np.maximum(values, 0.0))
    if scales[0] <= 1e-6 * max(scales[-1], 1e-30):
        return positions, "its scale is zero along an axis and was left out"
    if scales[-1] - scales[0] <= SCALE_TOLERANCE * scales[-1]:
        return (positions * np.float32(np.cbrt(scales.prod()))), None
    factor = (vectors * scales) @ vectors.T
    return (positions.astype(np.float64) @ factor).astype(np.float32), (
        "non-uniform scale; unwrapped as it appears in the scene"
    )


def fingerprint(mesh):
    """Digest of a mesh's faces and corners: equal as long as UVs by corner still fit."""
    digest = hashlib.blake2b(digest_size=16)
    digest.update(np.array([len(mesh.vertices), len(mesh.polygons), len(mesh.loops)], np.int64).tobytes())
    digest.update(read_face_offsets(mesh).tobytes())
    digest.update(read_corner_vertices(mesh).tobytes())
    return digest.digest()


def find_mesh(part):
    """The mesh of a part, or `MeshError` where it is gone or its faces have changed."""
    mesh = bpy.data.meshes.get(part.mesh_name)
    if mesh is None or mesh.session_uid != part.mesh_uid:
        mesh = next((other for other in bpy.data.meshes if other.session_uid == part.mesh_uid), None)
    if mesh is None:
        raise MeshError(f"{part.object_name} was removed meanwhile; nothing was changed")
    if mesh.is_editmode:
        for obj in bpy.data.objects:
            if obj.data == mesh and obj.mode == "EDIT":
                obj.update_from_editmode()
    if fingerprint(mesh) != part.fingerprint:
        raise MeshError(f"{part.object_name} was edited meanwhile; nothing was changed")
    return mesh


@contextmanager
def object_mode(meshes):
    """Leaves edit mode for a while if any of the meshes is in it: UV maps are empty arrays there."""
    if not any(mesh.is_editmode for mesh in meshes):
        yield
        return
    view_layer = bpy.context.view_layer
    editing = [obj for obj in view_layer.objects if obj.type == "MESH" and obj.mode == "EDIT"]
    selected = {obj: obj.select_get() for obj in editing}
    active = view_layer.objects.active
    if not editing:
        raise MeshError("The mesh is in edit mode in another scene or view layer; leave it there first")
    if active not in editing:
        view_layer.objects.active = editing[0]
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        for obj in editing:
            obj.select_set(True)  # edit mode takes every selected object of the active one's type
        others = [obj for obj in view_layer.objects if obj.type == "MESH" and obj.select_get() and obj not in editing]
        for obj in others:
            obj.select_set(False)
        bpy.ops.object.mode_set(mode="EDIT")
        for obj in others:
            obj.select_set(True)
        for obj, state in selected.items():
            obj.select_set(state)
        view_layer.objects.active = active


def check_parts(selection, make_new_map=False):
    """The meshes of all parts, or `MeshError` where one is gone, edited or full."""
    meshes = [find_mesh(part) for part in selection.parts]
    if make_new_map and any(len(mesh.uv_layers) >= MAX_UV_MAPS for mesh in meshes):
        raise MeshError(f"A mesh has {MAX_UV_MAPS} UV maps already; nothing was changed")
    return meshes


def active_maps(selection):
    """Names of the active UV maps of all parts."""
    return [find_mesh(part).uv_layers.active.name for part in selection.parts]


def write_uvs(selection, uv, *, make_new_map=False, map_name="UVMap", mark_seams=False):
    """Writes one UV per corner to all parts, and returns what the meshes hold afterwards, (c, 2) float32.

    Nothing is changed when any mesh is gone, edited or full. Only the corners of the selection are written.
    """
    uv = np.ascontiguousarray(uv, np.float32)
    meshes = check_parts(selection, make_new_map)
    held = np.empty_like(uv)
    with object_mode(meshes):
        for part, mesh in zip(selection.parts, meshes, strict=True):
            layer = writable_layer(mesh, make_new_map, map_name)
            layer_name = layer.name
            if part.source_corners is None:
                values = uv[part.corners]
            else:
                values = read_array(layer.uv, "vector", np.float32, 2)
                values[part.source_corners] = uv[part.corners]
            write_layer(mesh, layer_name, values)
            if mark_seams:
                mark_chart_borders(mesh, values, part.source_faces)
            mesh.update()
            after = read_array(mesh.uv_layers[layer_name].uv, "vector", np.float32, 2)
            held[part.corners] = after if part.source_corners is None else after[part.source_corners]
    return held


def write_layer(mesh, name, values):
    """Sets all UVs of a map.

    Not through `uv_layers[name].uv`: until 5.0 that writes in place into memory which may be shared with duplicates
    of the mesh and with the undo history. Attributes are made the mesh's own before they are written.
    """
    mesh.attributes[name].data.foreach_set("vector", np.ascontiguousarray(values, np.float32).reshape(-1))


def writable_layer(mesh, make_new_map, map_name):
    """The UV map to write: the active one, or a new one that becomes active."""
    layer = mesh.uv_layers.active
    if layer is None or make_new_map:
        layer = mesh.uv_layers.new(name=map_name or "UVMap")
        if layer is None:
            raise MeshError(f"{mesh.name}: Blender could not add a UV map")
        mesh.uv_layers.active = layer
    return layer


def read_uvs(selection):
    """UVs of the active maps for the corners of the selection, (c, 2) float32; None where a mesh has no map."""
    meshes = [find_mesh(part) for part in selection.parts]
    if any(mesh.uv_layers.active is None for mesh in meshes):
        return None
    held = np.empty((selection.face_offsets[-1], 2), np.float32)
    with object_mode(meshes):
        for part, mesh in zip(selection.parts, meshes, strict=True):
            values = read_array(mesh.uv_layers.active.uv, "vector", np.float32, 2)
            held[part.corners] = values if part.source_corners is None else values[part.source_corners]
    return held


def mark_chart_borders(mesh, uv, source_faces):
    """Adds a seam on every edge where the UVs of two neighbouring faces differ, at least one of them unwrapped."""
    corner_vertices = read_corner_vertices(mesh)
    offsets = read_face_offsets(mesh)
    sizes = np.diff(offsets)
    corner_edges = read_array(mesh.loops, "edge_index", np.int32)
    following = np.arange(1, len(corner_vertices) + 1, dtype=np.int32)
    following[offsets[1:] - 1] = offsets[:-1]
    # UVs at both ends of a corner's edge, the lower vertex first, so that neighbours compare whatever their winding.
    ends = np.concatenate([uv, uv[following]], axis=1)
    turned = corner_vertices > corner_vertices[following]
    ends[turned] = ends[turned][:, [2, 3, 0, 1]]
    first = np.full(len(mesh.edges), -1, np.int32)
    first[corner_edges[::-1]] = np.arange(len(corner_edges) - 1, -1, -1, dtype=np.int32)
    differs = (ends != ends[first[corner_edges]]).any(axis=1)
    border = np.zeros(len(mesh.edges), bool)
    border[corner_edges[differs]] = True
    if source_faces is not None:
        chosen = np.zeros(len(mesh.polygons), bool)
        chosen[source_faces] = True
        touched = np.zeros(len(mesh.edges), bool)
        touched[corner_edges[np.repeat(chosen, sizes)]] = True
        border &= touched
    seams = read_array(mesh.edges, "use_seam", bool)
    mesh.edges.foreach_set("use_seam", seams | border)
