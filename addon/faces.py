"""Which faces of a mesh an operator is about."""

import bmesh
import bpy
import numpy as np

from .mesh_arrays import NothingToUnwrap, in_bulk, read_array, read_face_flags, read_face_offsets


def chosen_faces(obj, *, only_selected, by_uv=False):
    """Which faces are unwrapped, (f,) bool; None: all. Raises `NothingToUnwrap` where there are faces but none is.

    In object mode all of them, whether hidden or not, since nothing shows that they are. In edit mode those that are
    visible, and of these the selected ones where asked; with `by_uv`, those whose UVs are selected, too.
    """
    mesh = obj.data
    if obj.mode != "EDIT":
        return None
    with in_bulk(mesh) as readable:
        hidden, selected = (read_face_flags(readable, name) for name in ("hide", "select"))
    chosen = ~hidden
    if not chosen.any():
        raise NothingToUnwrap("All faces are hidden")
    if only_selected:
        chosen &= selected
        if not chosen.any():
            raise NothingToUnwrap("No faces are selected")
        if by_uv and mesh.uv_layers:
            chosen &= uv_selected_faces(mesh)
            if not chosen.any():
                raise NothingToUnwrap("No faces are selected in the UV Editor")
    return None if chosen.all() else chosen


def selected_and_hidden(obj, *, by_uv=False):
    """Which faces are selected, and which are hidden, two of (f,) bool; in object mode all and none.

    In edit mode they are those that are selected in the 3D view; with `by_uv`, those whose UVs are selected, too.
    """
    mesh = obj.data
    if obj.mode != "EDIT":
        return np.ones(len(mesh.polygons), bool), np.zeros(len(mesh.polygons), bool)
    with in_bulk(mesh) as readable:
        hidden, selected = (read_face_flags(readable, name) for name in ("hide", "select"))
    selected &= ~hidden
    return (selected & uv_selected_faces(mesh) if by_uv and mesh.uv_layers else selected), hidden


def by_uv_selection(context):
    """Whether an operator called here is about what is selected in the UV Editor rather than in the 3D view."""
    area = context.area
    return (
        area is not None
        and area.type == "IMAGE_EDITOR"
        and context.mode == "EDIT_MESH"
        and not context.scene.tool_settings.use_uv_select_sync
    )


def uv_selected_faces(mesh):
    """Faces whose UVs are selected in the active map, (f,) bool, as the UV Editor shows them.

    The mesh is in edit mode and up to date. Of a face all corners are, or in the UV Editor's edge mode all sides, which
    is Blender's own rule.
    """
    if hasattr(bmesh.types.BMFace, "uv_select"):  # 5.0 and later
        faces = bmesh.from_edit_mesh(mesh).faces
        return np.fromiter((face.uv_select for face in faces), bool, len(faces))
    with in_bulk(mesh) as readable:
        layer = readable.uv_layers.active
        by_edge = bpy.context.scene.tool_settings.uv_select_mode == "EDGE"
        corners = layer.edge_selection if by_edge else layer.vertex_selection
        if not len(corners):
            return np.zeros(len(readable.polygons), bool)
        return np.logical_and.reduceat(read_array(corners, "value", bool), read_face_offsets(readable)[:-1])
