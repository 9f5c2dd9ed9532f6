"""What modifiers make of a mesh: named, and applied where a file is to hold what they make."""

import hashlib

import bpy
import numpy as np

from . import mesh_arrays, mesh_bridge, targets

# Modifiers that leave faces, corners and UVs as they are: they move vertices, weight them, or make no mesh at all.
KEEP_CORNERS = frozenset({
    "ARMATURE", "CAST", "CLOTH", "COLLISION", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "DYNAMIC_PAINT", "HOOK",
    "LAPLACIANDEFORM", "LAPLACIANSMOOTH", "LATTICE", "MESH_CACHE", "MESH_DEFORM", "NORMAL_EDIT", "PARTICLE_SYSTEM",
    "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "SOFT_BODY", "SURFACE", "SURFACE_DEFORM", "VERTEX_WEIGHT_EDIT",
    "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY", "WARP", "WAVE", "WEIGHTED_NORMAL",
})  # fmt: skip


def remaking(obj):
    """The modifiers of an object, enabled in the viewport, that make other faces or UVs than its mesh has."""
    return [m for m in obj.modifiers if m.show_viewport and m.type not in KEEP_CORNERS]


def off_in_viewport(obj):
    """The modifiers that make other faces or UVs, but only when Blender renders."""
    return [m for m in obj.modifiers if m.show_render and not m.show_viewport and m.type not in KEEP_CORNERS]


def kept(modifier, keeps_pose):
    """Whether a modifier stays when the others are applied: bones where the file has them, and particles."""
    return modifier.type == "PARTICLE_SYSTEM" or (keeps_pose and modifier.type == "ARMATURE")


def to_apply(obj, keeps_pose):
    """The modifiers of an object that are enabled in the viewport and do not stay."""
    return [m for m in obj.modifiers if m.show_viewport and not kept(m, keeps_pose)]


def apply(objects, layer, *, keeps_pose):
    """Gives every object the mesh that its modifiers make, and takes them away; its shape keys, too, where there are.

    What geometry nodes instance becomes part of the mesh. Objects that shared a mesh share the result where it is the
    same. `layer` is a view layer that shows all of them; with `keeps_pose`, bones go on to move the mesh.
    """
    switched = []
    realise = realising_nodes()
    try:
        for obj in objects:
            for modifier in obj.modifiers:
                if modifier.show_viewport and modifier.type == "ARMATURE" and kept(modifier, keeps_pose):
                    modifier.show_viewport = False
                    switched.append(modifier)
            if any(modifier.type == "NODES" for modifier in to_apply(obj, keeps_pose)):
                obj.modifiers.new("Realize Instances", "NODES").node_group = realise
        layer.update()
        graph = layer.depsgraph
        meshes = [
            bpy.data.meshes.new_from_object(obj.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph)
            for obj in objects
        ]
    finally:
        for modifier in switched:
            modifier.show_viewport = True
    shared, replaced, uid = {}, [], {obj: obj.data.session_uid for obj in objects}
    for obj, mesh in zip(objects, meshes, strict=True):
        for modifier in [m for m in obj.modifiers if not kept(m, keeps_pose)]:
            obj.modifiers.remove(modifier)
        old = obj.data
        key = uid[obj], _digest(mesh)
        if key in shared:
            obj.data = shared[key]
            bpy.data.meshes.remove(mesh)
        else:
            obj.data = shared[key] = mesh
            replaced.append((old, mesh))
    for old, mesh in replaced:
        if not old.users:
            name = old.name
            bpy.data.meshes.remove(old)
            mesh.name = name
    bpy.data.node_groups.remove(realise)


def _digest(mesh):
    """What tells two results of the same mesh apart: corners, places and materials."""
    digest = hashlib.blake2b(mesh_bridge.fingerprint(mesh), digest_size=16)
    digest.update(mesh_arrays.read_positions(mesh).tobytes())
    digest.update(mesh_arrays.read_array(mesh.polygons, "material_index", np.int32).tobytes())
    return digest.digest()


def realising_nodes():
    """Geometry nodes that make instances part of the mesh."""
    tree = bpy.data.node_groups.new("BLE Unwrap", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, realise, end = (
        tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeRealizeInstances", "NodeGroupOutput")
    )
    tree.links.new(start.outputs[0], realise.inputs[0])
    tree.links.new(realise.outputs[0], end.inputs[0])
    return tree


def bare_faces(layer, owner=None):
    """The objects, by name, of which a view layer shows faces of meshes that have no UV map; or that one `owner` alone.

    Such faces are what geometry nodes make, also where the object itself is points without faces. Texts and curves are
    left out: Blender gives those UVs of its own.
    """
    found, seen = {}, {}
    for entry in layer.depsgraph.object_instances:
        obj = entry.object
        if obj.type != "MESH":
            continue
        mesh = obj.data
        key = mesh.as_pointer()
        if key not in seen:
            seen[key] = bool(len(mesh.polygons)) and not len(mesh.uv_layers)
        if seen[key]:
            maker = (entry.parent if entry.is_instance and entry.parent else obj).original
            if maker.type in targets.TYPES and owner in (None, maker):
                found[maker.name] = maker
    return found


def makes_faces(obj):
    """Whether an object of points is shown with faces, which its geometry nodes have made of them."""
    if not any(modifier.type == "NODES" and modifier.show_viewport for modifier in obj.modifiers):
        return False
    layer = bpy.context.view_layer
    layer.update()
    return obj.name in bare_faces(layer, owner=obj)


def bare_text(name):
    """What to say of an object of which geometry nodes make faces that have no UVs."""
    return (
        f"{name}: the faces that its geometry nodes make have no UVs; apply the modifier (after a Realize Instances "
        "node where it makes instances), then unwrap"
    )
