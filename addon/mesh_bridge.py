"""Blender's meshes to flat arrays, and UVs back; cloud_bridge.py builds upon it for points without faces.

Arrays cross in bulk (`foreach_get`, `foreach_set`), in edit mode from a copy of the mesh; what Blender keeps for edit
mode alone is asked for element by element. Reading changes nothing. Writing happens in one go at the end, and only on
meshes that are still as they were read.
"""

import hashlib
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import painted, seams, uv_maps
from .faces import chosen_faces
from .mesh_arrays import (
    MeshError,
    NothingToUnwrap,
    in_bulk,
    object_mode,
    read_array,
    read_corner_edges,
    read_corner_vertices,
    read_edge_flags,
    read_edge_vertices,
    read_face_offsets,
    read_positions,
    renumber,
)

MARKS = ("seams", "sharp", "materials")  # what an artist marks edges by
ONLY_MARKED = 180.0  # degrees; no edge is sharper, so that only those that are marked sharp are
ACTIVE_MAP = uv_maps.MapChoice()
# Of the square of a face's length: a face of less area is a line but for what single precision rounds.
LEAST_AREA = 1e-6
SCALE_TOLERANCE = 1e-3  # relative difference of an object's axes from which its scale counts as non-uniform


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
    group_names: frozenset  # of vertex groups, with which UV maps share their names
    fingerprint: bytes


@dataclass
class Selection:
    """All that is unwrapped together into one atlas, as concatenated arrays."""

    parts: list[MeshPart]
    positions: np.ndarray  # (n, 3) float32, in the scene's unit of length
    corner_vertices: np.ndarray  # (c,) int32
    face_offsets: np.ndarray  # (f + 1,) int32
    corner_triangles: np.ndarray | None  # (t, 3) int32 corners; None: only triangles
    marks: dict[str, np.ndarray]  # of each kind in MARKS the edges that have it, (m, 2) int32 vertices; empty: not read
    seam_weights: np.ndarray | None  # (n,) float32, what a seam at each vertex counts for; None: its length everywhere
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


def gather(
    objects,
    *,
    only_selected=False,
    by_uv=False,
    whole=False,
    marks=True,
    target=ACTIVE_MAP,
    move_pinned=True,
    sharp_angle=ONLY_MARKED,
    seams_away="",
    seams_here="",
):
    """Reads the objects' base meshes (before modifiers and shape keys) as one `Selection`.

    `only_selected` and `by_uv` as in `chosen_faces`; they matter for objects in edit mode. With `whole` all faces are
    read, in edit mode hidden ones, too; without `marks` no marked edges are, which islands that are there have no use
    for. `target` is the UV map that will be written, or None where none will be;
    `sharp_angle` is in degrees, `seams_away` and `seams_here` name what is painted (`painted`). Raises
    `MeshError` where the map cannot be written, or where pinned UVs would be moved and may not be.
    """
    warnings, parts, blocks, reasons, found = [], [], [], [], set()
    vertex_base = corner_base = face_base = 0
    for obj in objects:
        mesh = obj.data
        if target is not None:
            uv_maps.check_writable(obj, target)
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        if not mesh.polygons:
            continue
        try:
            chosen = None if whole else chosen_faces(obj, only_selected=only_selected, by_uv=by_uv)
        except NothingToUnwrap as error:
            reasons.append(error)
            continue
        with in_bulk(mesh) as readable:
            block = read_mesh(readable, chosen, sharp_angle if marks else None, obj.matrix_world)
        if not move_pinned:
            uv_maps.check_pins(obj, target, block["source_corners"])
        weights, names = painted.seam_weights(obj, seams_away, seams_here)
        found |= names
        positions = block["positions"]
        if block["note"]:
            warnings.append(f"{obj.name}: {block['note']}")
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
                group_names=uv_maps.group_names(obj),
                fingerprint=fingerprint(mesh),
            )
        )
        blocks.append(
            (
                positions,
                block["corner_vertices"] + vertex_base,
                block["face_sizes"],
                block["triangles"] + corner_base,
                weights if block["source_vertices"] is None else weights[block["source_vertices"]],
                *(edges + vertex_base for edges in block["marks"].values()),
            )
        )
        vertex_base += len(positions)
        corner_base += corner_count
        face_base += face_count
    if not parts:
        raise reasons[0] if reasons else NothingToUnwrap("There are no faces to unwrap")
    if max(vertex_base, corner_base) > np.iinfo(np.int32).max:
        raise MeshError("The selection is too large: more than two thousand million corners")
    if missing := [name for name in dict.fromkeys((seams_away, seams_here)) if name and name not in found]:
        names = " or ".join(f'"{name}"' for name in missing)
        warnings.append(f"There is no vertex group and no float attribute on points named {names}")
    positions, corner_vertices, sizes, triangles, weights, *marked = (
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
        seam_weights=np.ascontiguousarray(weights, np.float32) if found else None,
        marks={
            kind: np.ascontiguousarray(edges, np.int32)
            for kind, edges in zip(MARKS if marks else (), marked, strict=True)
        },
        warnings=warnings,
    )


def read_mesh(mesh, chosen, sharp_angle=None, matrix_world=None):
    """Arrays of one mesh that is `in_bulk`, compacted to the chosen faces, (f,) bool; None: all.

    With a `matrix_world` the mesh is as large as it is in the scene, and a `note` may say what came of that. Without a
    `sharp_angle` marked edges are not read.
    """
    positions, note = read_positions(mesh), None
    if matrix_world is not None:
        positions, note = scale_as_in_scene(positions, matrix_world)
    corner_vertices = read_corner_vertices(mesh)
    offsets = read_face_offsets(mesh)
    sizes = np.diff(offsets)
    marks = {} if sharp_angle is None else read_marks(mesh, positions, corner_vertices, offsets, sharp_angle)
    mesh.calc_loop_triangles()
    triangles = read_array(mesh.loop_triangles, "loops", np.int32, 3)
    source_faces = source_corners = source_vertices = None
    if chosen is not None:
        source_faces = np.flatnonzero(chosen).astype(np.int32)
        corner_chosen = np.repeat(chosen, sizes)
        source_corners = np.flatnonzero(corner_chosen).astype(np.int32)
        triangles = renumber(triangles[corner_chosen[triangles[:, 0]]], corner_chosen)
        corner_vertices = corner_vertices[source_corners]
        vertex_chosen = np.zeros(len(positions), bool)
        vertex_chosen[corner_vertices] = True
        source_vertices = np.flatnonzero(vertex_chosen)
        corner_vertices = renumber(corner_vertices, vertex_chosen)
        marks = {
            kind: renumber(edges[vertex_chosen[edges].all(axis=1)], vertex_chosen) for kind, edges in marks.items()
        }
        positions = positions[source_vertices]
        sizes = sizes[source_faces]
    return {
        "positions": positions,
        "note": note,
        "corner_vertices": corner_vertices,
        "face_sizes": sizes,
        "triangles": triangles,
        "marks": marks,
        "source_faces": source_faces,
        "source_corners": source_corners,
        "source_vertices": source_vertices,
    }


def read_marks(mesh, positions, corner_vertices, offsets, sharp_angle):
    """The edges of each kind in `MARKS` as pairs of vertices: the artist's seams, sharp edges, borders of materials.

    Angles are those between faces at these positions.
    """
    edges = read_edge_vertices(mesh)
    corner_edges = read_corner_edges(mesh)
    sharp = read_edge_flags(mesh, "use_edge_sharp")
    if sharp_angle < ONLY_MARKED:
        sharp = sharp | bends(positions, corner_vertices, offsets, corner_edges, len(edges), sharp_angle)
    border = np.zeros(len(edges), bool)
    if len(mesh.materials) > 1:
        material = np.repeat(read_array(mesh.polygons, "material_index", np.int32), np.diff(offsets))
        any_of = np.zeros(len(edges), np.int32)
        any_of[corner_edges] = material
        border[corner_edges[material != any_of[corner_edges]]] = True
    return {"seams": edges[seams.wished_seams(mesh)], "sharp": edges[sharp], "materials": edges[border]}


def bends(positions, corner_vertices, offsets, corner_edges, edge_count, least_angle):
    """The edges at which the normals of two faces are at least so many degrees apart, (e,) bool."""
    normals, known_normal = face_normals(positions, corner_vertices, offsets)
    face = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    order = np.argsort(corner_edges, kind="stable")
    of_edge = np.bincount(corner_edges, minlength=edge_count)
    first = np.cumsum(of_edge) - of_edge
    with_two = np.flatnonzero(of_edge == 2)
    one, other = (face[order[first[with_two] + side]] for side in (0, 1))
    # Positions are known to single precision, and with them the angles.
    known = known_normal[one] & known_normal[other]
    bent = np.zeros(edge_count, bool)
    bent[with_two] = known & ((normals[one] * normals[other]).sum(axis=1) <= np.cos(np.radians(least_angle)) + 1e-6)
    return bent


def face_normals(positions, corner_vertices, offsets):
    """The unit normal of each face, (f, 3), of n-gons the mean one; and which faces have one, (f,) bool."""
    starts, sizes = offsets[:-1], np.diff(offsets)
    following = np.arange(1, len(corner_vertices) + 1)
    following[offsets[1:] - 1] = starts
    places = positions[corner_vertices].astype(np.float64)
    places -= np.repeat(places[starts], sizes, axis=0)
    with np.errstate(all="ignore"):  # of what is not finite or has no area
        doubled = np.add.reduceat(np.cross(places, places[following]), starts)
        length = np.linalg.norm(doubled, axis=1)
        extent = np.maximum.reduceat((places**2).sum(axis=1), starts)
        return doubled / length[:, None], length > LEAST_AREA * extent


def scale_as_in_scene(positions, matrix_world):
    """Positions as large as the object is in the scene, not turned; and a note where its axes differ.

    The scale is the symmetric factor S of the polar decomposition M = R·S, so the shape is what is seen, up to a
    rotation, and a uniform scale is a plain factor.
    """
    matrix = np.array(matrix_world.to_3x3(), np.float64)
    if not np.isfinite(matrix).all():
        return positions, "its transform is not finite and was ignored"
    values, vectors = np.linalg.eigh(matrix.T @ matrix)
    scales = np.sqrt(np.maximum(values, 0.0))
    if scales[0] <= 1e-6 * max(scales[-1], 1e-30):
        return positions, "its scale is zero along an axis and was ignored"
    if scales[-1] - scales[0] <= SCALE_TOLERANCE * scales[-1]:
        return (positions * np.float32(np.cbrt(scales.prod()))), None
    factor = (vectors * scales) @ vectors.T
    return (positions.astype(np.float64) @ factor).astype(np.float32), (
        "non-uniform scale; it was unwrapped with the proportions that it has in the scene"
    )


def fingerprint(mesh):
    """Digest of a mesh's faces and corners: equal as long as UVs by corner still fit."""
    digest = hashlib.blake2b(digest_size=16)
    digest.update(np.array([len(mesh.vertices), len(mesh.polygons), len(mesh.loops)], np.int64).tobytes())
    with in_bulk(mesh) as readable:
        digest.update(read_face_offsets(readable))
        digest.update(read_corner_vertices(readable))
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


def check_parts(selection, target=ACTIVE_MAP):
    """The meshes of all parts, or `MeshError` where one is gone, edited or full."""
    meshes = [find_mesh(part) for part in selection.parts]
    for part, mesh in zip(selection.parts, meshes, strict=True):
        uv_maps.map_to_write(mesh, target, part.group_names)
    return meshes


def active_maps(selection):
    """Names of the active UV maps of all parts."""
    return [find_mesh(part).uv_layers.active.name for part in selection.parts]


def write_uvs(selection, uv, *, target=ACTIVE_MAP, mark_seams=False, chart=None):
    """Writes one UV per corner to all parts, and returns what each mesh holds afterwards, a list of (c, 2) float32.

    With `mark_seams` the borders of charts become seams; `chart` names the chart of each face, where UVs do not tell.

    Nothing is changed when any mesh is gone, edited or full. Only the corners of the selection are written; what is
    returned are those of the whole mesh.
    """
    uv = np.ascontiguousarray(uv, np.float32)
    meshes = check_parts(selection, target)
    corner_chart = None if chart is None else np.repeat(chart, np.diff(selection.face_offsets))
    held = []
    with object_mode(meshes):
        for part, mesh in zip(selection.parts, meshes, strict=True):
            layer = uv_maps.writable_layer(mesh, target, part.group_names)
            layer_name = layer.name
            if part.source_corners is None:
                values = uv[part.corners]
            else:
                values = read_array(layer.uv, "vector", np.float32, 2)
                values[part.source_corners] = uv[part.corners]
            write_layer(mesh, layer_name, values)
            if mark_seams:
                seams.mark_chart_borders(mesh, values, part.source_faces, _of_mesh(part, values, corner_chart))
            mesh.update()
            held.append(read_array(mesh.uv_layers[layer_name].uv, "vector", np.float32, 2))
    return held


def _of_mesh(part, values, corner_chart):
    """The charts of the corners of a part's whole mesh, which has `values`; -1 for those that are not in the part."""
    if corner_chart is None or part.source_corners is None:
        return corner_chart if corner_chart is None else corner_chart[part.corners]
    whole = np.full(len(values), -1, np.int32)
    whole[part.source_corners] = corner_chart[part.corners]
    return whole


def of_selection(selection, held):
    """From the UVs of whole meshes those of the selection's corners, (c, 2) float32."""
    result = np.empty((selection.face_offsets[-1], 2), np.float32)
    for part, values in zip(selection.parts, held, strict=True):
        result[part.corners] = values if part.source_corners is None else values[part.source_corners]
    return result


def by_part(selection, is_meant):
    """From flags of the selection's faces, (f,) bool, the numbers of those meant in the mesh of each part, a list."""
    found = []
    for part in selection.parts:
        faces = np.flatnonzero(is_meant[part.faces]).astype(np.int32)
        found.append(faces if part.source_faces is None else part.source_faces[faces])
    return found


def kept_faces(selection, held):
    """The faces of the selection's meshes that are not in it and have finite UVs, given the UVs of whole meshes.

    (positions, corner_vertices, face_offsets, corner_triangles, uv), all meshes together; None where there is no face.
    """
    columns = []
    vertex_base = corner_base = 0
    for part, uv in zip(selection.parts, held, strict=True):
        if part.source_faces is None:
            continue
        mesh = find_mesh(part)
        kept = np.logical_and.reduceat(np.isfinite(uv).all(axis=1), read_face_offsets(mesh)[:-1])
        kept[part.source_faces] = False
        if not kept.any():
            continue
        with in_bulk(mesh) as readable:
            block = read_mesh(readable, kept)
        columns.append(
            (
                block["positions"],
                block["corner_vertices"] + vertex_base,
                block["face_sizes"],
                block["triangles"] + corner_base,
                uv[block["source_corners"]],
            )
        )
        vertex_base += len(block["positions"])
        corner_base += len(block["corner_vertices"])
    if not columns:
        return None
    positions, corner_vertices, sizes, triangles, uv = map(np.concatenate, zip(*columns, strict=True))
    return positions, corner_vertices, np.append(0, np.cumsum(sizes)), triangles, uv


def write_layer(mesh, name, values):
    """Sets all UVs of a map.

    Not through `uv_layers[name].uv`: until 5.0 that writes in place into memory which may be shared with duplicates
    of the mesh and with the undo history. Attributes are made the mesh's own before they are written.
    """
    mesh.attributes[name].data.foreach_set("vector", np.ascontiguousarray(values, np.float32).reshape(-1))


def read_uvs(selection, target=ACTIVE_MAP):
    """UVs that the maps to write hold for the corners of the selection, (c, 2) float32; None where a map is missing."""
    meshes = [find_mesh(part) for part in selection.parts]
    maps = [
        uv_maps.map_to_write(mesh, target, part.group_names) for part, mesh in zip(selection.parts, meshes, strict=True)
    ]
    if not all(there for _, there in maps):
        return None
    held = [uv_maps.read_map(mesh, name) for mesh, (name, _) in zip(meshes, maps, strict=True)]
    return of_selection(selection, held)
