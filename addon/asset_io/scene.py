"""Which objects there are, and which of them a file of a format is going to hold."""

from contextlib import contextmanager

import bpy

# Collection in which Blender's glTF importer keeps what it made for display only.
NOT_EXPORTED = "glTF_not_exported"


def bone_shapes():
    """Objects that only show how bones look: those of a glTF import, and hidden ones that a bone has as its shape."""
    shapes = {obj for c in bpy.data.collections if c.name.split(".")[0] == NOT_EXPORTED for obj in c.all_objects}
    for obj in bpy.data.objects:
        for bone in obj.pose.bones if obj.pose else ():
            if bone.custom_shape and not bone.custom_shape.visible_get():
                shapes.add(bone.custom_shape)
    return shapes


def written(kind):
    """The objects that an exporter writes, in order of name: all of the file, of its scenes, or what the current one
    shows; and what collections have in them that are instanced there."""
    layer = bpy.context.view_layer
    layer.update()
    if kind == "blend":
        found = set(bpy.data.objects)
    elif kind in ("glb", "gltf"):
        found = {obj for scene in bpy.data.scenes for obj in scene.objects}
    elif kind == "fbx":
        found = set(layer.objects)
    else:
        instances = bpy.context.evaluated_depsgraph_get().object_instances
        found = {entry.object.original for entry in instances if entry.is_instance or entry.show_self}
    return sorted(_with_instanced(found), key=lambda obj: obj.name_full)


def _with_instanced(found):
    """Objects, and those of collections that any of them instances, and so on."""
    waiting, seen = list(found), set()
    while waiting:
        obj = waiting.pop()
        if obj in seen:
            continue
        seen.add(obj)
        if obj.instance_type == "COLLECTION" and obj.instance_collection:
            waiting.extend(obj.instance_collection.all_objects)
    return seen


@contextmanager
def evaluated(objects):
    """A view layer that shows all of some local objects, for a while.

    What is hidden, in an excluded collection or in another scene is not evaluated otherwise: its modifiers make
    nothing, and even its place in the world is unknown.
    """
    hidden = [obj for obj in objects if obj.hide_viewport]
    scene = bpy.data.scenes.new("BLE Unwrap")
    scene.frame_current = bpy.context.scene.frame_current
    try:
        for obj in objects:
            scene.collection.objects.link(obj)
        for obj in hidden:
            obj.hide_viewport = False
        layer = scene.view_layers[0]
        layer.update()
        yield layer
    finally:
        for obj in hidden:
            obj.hide_viewport = True
        bpy.data.scenes.remove(scene)
        bpy.context.view_layer.update()


def make_local():
    """Makes all linked objects and their data the scene's own: for a file that cannot link to others.

    Collections come first: what only they use becomes local in place then, instead of being copied.
    """
    libraries = (bpy.data.collections, bpy.data.objects, bpy.data.meshes, bpy.data.curves, bpy.data.pointclouds)
    before = None
    while linked := [item for library in libraries for item in library if item.library is not None]:
        if before is not None and len(linked) >= before:  # the rest is used by what stays linked, and has been copied
            return
        before = len(linked)
        for item in linked:
            if item.library is not None:
                item.make_local()
