"""Seams of a mesh: whose they are, and marking the borders of charts.

Seams that we marked are remembered in an attribute of edges, as integers: of booleans Python sees none in
edit mode in Blender 4.2. They are no wish of the artist's: the next unwrap neither
cuts nor follows them, and replaces them by its own. All others are the artist's and stay as they are.
"""

import numpy as np

from .mesh_arrays import read_array, read_corner_edges, read_corner_vertices, read_edge_flags, read_face_offsets

OWN_SEAMS = ".ble_unwrap_seam"  # the leading dot keeps it out of Blender's lists of attributes


def wished_seams(mesh):
    """The artist's own seams, (e,) bool; of a mesh that is `in_bulk`."""
    return read_edge_flags(mesh, "use_seam") & ~remembered(mesh)


def remembered(mesh):
    """Edges that we marked and that the artist may have cleared since, (e,) bool; of a mesh that is `in_bulk`."""
    if _is_ours(attribute := mesh.attributes.get(OWN_SEAMS)):
        return read_array(attribute.data, "value", np.int32) != 0
    return np.zeros(len(mesh.edges), bool)


def _is_ours(attribute):
    return attribute is not None and (attribute.domain, attribute.data_type) == ("EDGE", "INT")


def mark_chart_borders(mesh, uv, source_faces, chart=None):
    """Marks the edges at which the UVs of neighbouring faces differ as seams, in the place of those we marked before.

    Of a mesh in object mode. `chart` names the chart of each corner: halves that lie on each other have the same UVs
    where they meet. With `source_faces`, only edges of these faces are looked at. One of our seams that the
    artist has cleared is not marked again, unless all of them were cleared, which is to begin anew.
    """
    seams, ours = read_edge_flags(mesh, "use_seam"), remembered(mesh)
    looked_at = _edges_of(mesh, source_faces)
    border = chart_borders(mesh, uv, chart) & looked_at
    own_left = ours & seams
    cleared = ours & ~seams & (border | ~looked_at) if own_left.any() else np.zeros_like(ours)
    wished = seams & ~ours
    kept = own_left & ~looked_at
    new = border & ~wished & ~cleared
    mesh.edges.foreach_set("use_seam", wished | kept | new)
    _remember(mesh, kept | new | cleared)


def _remember(mesh, ours):
    attribute = mesh.attributes.get(OWN_SEAMS)
    if not _is_ours(attribute):
        if attribute is not None:
            mesh.attributes.remove(attribute)
        attribute = mesh.attributes.new(OWN_SEAMS, "INT", "EDGE")
    attribute.data.foreach_set("value", ours.astype(np.int32))


def _edges_of(mesh, faces):
    """Edges of these faces, or of all, (e,) bool."""
    result = np.zeros(len(mesh.edges), bool)
    corner_edges = read_corner_edges(mesh)
    if faces is None:
        result[corner_edges] = True
    else:
        chosen = np.zeros(len(mesh.polygons), bool)
        chosen[faces] = True
        result[corner_edges[np.repeat(chosen, np.diff(read_face_offsets(mesh)))]] = True
    return result


def chart_borders(mesh, uv, chart=None, tolerance=0.0):
    """Edges where the UVs, by more than a tolerance, or the charts of two neighbouring faces differ, (e,) bool."""
    corner_vertices = read_corner_vertices(mesh)
    offsets = read_face_offsets(mesh)
    corner_edges = read_corner_edges(mesh)
    following = np.arange(1, len(corner_vertices) + 1, dtype=np.int32)
    following[offsets[1:] - 1] = offsets[:-1]
    # UVs at both ends of a corner's edge, the lower vertex first, so that neighbours compare whatever their winding.
    ends = np.concatenate([uv, uv[following]], axis=1)
    turned = corner_vertices > corner_vertices[following]
    ends[turned] = ends[turned][:, [2, 3, 0, 1]]
    first = np.full(len(mesh.edges), -1, np.int32)
    first[corner_edges[::-1]] = np.arange(len(corner_edges) - 1, -1, -1, dtype=np.int32)
    others = ends[first[corner_edges]]
    with np.errstate(invalid="ignore"):  # what is not finite differs
        differs = ((ends != others) & ~(np.abs(ends - others) <= tolerance)).any(axis=1)
    if chart is not None:
        differs |= chart != chart[first[corner_edges]]
    border = np.zeros(len(mesh.edges), bool)
    border[corner_edges[differs]] = True
    return border
