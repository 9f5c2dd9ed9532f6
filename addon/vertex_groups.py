"""The weights of a vertex group, read in bulk.

Python is shown them by vertex alone, which takes half a second for a million corners. Geometry nodes read them as an
attribute, so they are given a copy of the mesh, in a scene of its own that is never shown; all of it is removed again.
"""

from contextlib import ExitStack

import bpy
import numpy as np

from .mesh_arrays import read_array

# Names within the copy: that of a group may be that of an attribute which nodes read in its place, such as `position`.
GROUP, COPIED = "ble_unwrap_group", "ble_unwrap_copied"


def weights(obj, name):
    """The weight of each vertex of a mesh object in the group of this name, (n,) float32; 0 of those outside it.

    A mesh in edit mode has to be up to date.
    """
    with ExitStack() as made:

        def temporary(collection, item):
            made.callback(collection.remove, item)
            return item

        mesh = temporary(bpy.data.meshes, obj.data.copy())
        copy = temporary(bpy.data.objects, bpy.data.objects.new(GROUP, mesh))
        scene = temporary(bpy.data.scenes, bpy.data.scenes.new(GROUP))
        tree = temporary(bpy.data.node_groups, bpy.data.node_groups.new(GROUP, "GeometryNodeTree"))
        _remove_shape_keys(copy)
        scene.collection.objects.link(copy)
        group = copy.vertex_groups[name]
        group.name = GROUP
        _copy_group(tree, group.name)
        copy.modifiers.new(GROUP, "NODES").node_group = tree
        layer = scene.view_layers[0]
        layer.update()
        evaluated = copy.evaluated_get(layer.depsgraph).data
        return read_array(evaluated.attributes[COPIED].data, "value", np.float32)


def _remove_shape_keys(obj):
    """Removes the shape keys of an object's mesh, which in some versions of Blender outlive it."""
    if obj.data.shape_keys is None:
        return
    uid = obj.data.shape_keys.session_uid
    obj.shape_key_clear()
    # Looked for anew: in other versions they are freed by now.
    bpy.data.batch_remove([keys for keys in bpy.data.shape_keys if keys.session_uid == uid])


def _copy_group(tree, group):
    """Makes nodes that copy a vertex group to the attribute `COPIED`."""
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    given, result = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    read, store = tree.nodes.new("GeometryNodeInputNamedAttribute"), tree.nodes.new("GeometryNodeStoreNamedAttribute")
    read.data_type = store.data_type = "FLOAT"
    store.domain = "POINT"
    read.inputs["Name"].default_value, store.inputs["Name"].default_value = group, COPIED
    for one, other in (
        (given.outputs[0], store.inputs["Geometry"]),
        (read.outputs["Attribute"], store.inputs["Value"]),
        (store.outputs["Geometry"], result.inputs[0]),
    ):
        tree.links.new(one, other)
