"""Which faces of a mesh an operator is about."""

import bmesh
import bpy
import numpy as np

from .mesh_arrays import NothingToUnwrap, read_array


def chosen_faces(obj, *, only_selected, by_uv=False):
    """Which faces are unwrapped, (f,) bool; None: all. Raises `NothingToUnwrap` where there are faces but none is.

    In object mode all of them, whether hidden or not, since nothing shows that they are. In edit mode those that are
    visible, and of these the selected ones where asked; with `by_uv`, those whose UVs are selected, too.
    """
    mesh = obj.data
    if obj.mode != "EDIT":
        return None
    chosen = ~read_array(mesh.polygons, "hide", bool)
    if not chosen.any():
        raise NothingToUnwrap("All faces are hidden")
    if only_selected:
        chosen &= read_array(mesh.polygons, "select", bool)
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
    hidden = read_array(mesh.polygons, "hide", bool)
    selected = read_array(mesh.polygons, "select", bool) & ~hidden
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
    """Faces whose UVs are selected in the active map, (f,) bool, as the UV Editor shows them; of a mesh in edit mode.

    Of a face all corners are, or in the UV Editor's edge mode all sides, which is Blender's own rule.
    """
    edit_mesh = bmesh.from_edit_mesh(mesh)
    faces = edit_mesh.faces
    if hasattr(bmesh.types.BMFace, "uv_select"):  # 5.0 and later
        return np.fromiter((face.uv_select for face in faces), bool, len(faces))
    layer = edit_mesh.loops.layers.uv.active
    flag = "select_edge" if bpy.context.scene.tool_settings.uv_select_mode == "EDGE" else "select"
    return np.fromiter((all(getattr(loop[layer], flag) for loop in face.loops) for face in faces), bool, len(faces))
