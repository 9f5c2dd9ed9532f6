"""A file of any format into Blender, in place of the scene that is there."""

from pathlib import Path

import bpy

from .. import cloud_bridge, input_file, point_file, targets
from . import input_check
from .formats import INPUT_FORMATS, AssetError, file_format, reason
from .scene import bone_shapes

# Since then Blender has an FBX importer of its own that reads more than the add-on, which fails on lights there.
OWN_FBX_IMPORTER = (5, 0, 0)


def new_scene():
    """An empty scene with factory settings; enabled add-ons stay."""
    _replace_scene(lambda: bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True))


def _replace_scene(operator):
    """Runs an operator that frees the scene, and leaves nothing behind that names the one freed.

    In Blender 4.2 (5.0 has mended it) whoever reads `bpy.context.tool_settings` makes the scene the owner of
    `bpy.context` itself, even when the scene is gone: the next property set through the context, as the glTF exporter
    sets the window's scene, then tags freed memory. Reading the settings anew names the scene that is there now.
    """
    owned = bpy.context.id_data is not None
    done = operator()
    if owned:
        _ = bpy.context.tool_settings
    return done


def load(path):
    """Replaces the scene by a file's contents and returns its meshes and point clouds, in order of name.

    These are what the current scene shows; `contents.prepare` finds the others. Scripts in the file are not run. Raises
    `AssetError`, too, where the file is not safe to read (see input_check.py) or holds no mesh at all.
    """
    path = Path(path).absolute()  # Blender takes relative paths from $PWD, not from the working directory
    kind = file_format(path)
    if kind not in INPUT_FORMATS:
        raise AssetError(f"cannot read '.{kind}' files; known are {', '.join(INPUT_FORMATS)}")
    if problem := input_file.why_unreadable(path):
        raise AssetError(problem)
    input_check.check(path)
    try:
        if kind == "blend":
            done = _replace_scene(
                lambda: bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
            )
        else:
            new_scene()
            done = _import(path, kind)
    except Exception as error:  # importers are add-ons and raise whatever they like on a broken file
        raise AssetError(f"cannot be read: {reason(error)}") from error
    if "FINISHED" not in done:
        raise AssetError("cannot be read: the importer gave up")
    if bpy.context.mode != "OBJECT" and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")
    if not any(obj.type in targets.TYPES or obj.type in targets.CONVERTIBLE for obj in bpy.data.objects):
        raise AssetError("holds no mesh")
    shapes = bone_shapes()
    objects = [obj for obj in bpy.context.view_layer.objects if obj.type in targets.TYPES and obj not in shapes]
    if kind == "ply" and targets.is_cloud(objects[0]):
        uv, normals = point_file.read_extras(path, len(objects[0].data.vertices))
        cloud_bridge.add_point_data(objects[0].data, uv, normals)
    return sorted(objects, key=lambda obj: obj.name_full)


def _import(path, kind):
    name = str(path)
    if kind == "obj":
        return bpy.ops.wm.obj_import(filepath=name)
    if kind == "ply":
        return bpy.ops.wm.ply_import(filepath=name)
    if kind == "stl":
        return bpy.ops.wm.stl_import(filepath=name)
    if kind == "fbx":
        return _import_fbx(name)
    enable("io_scene_gltf2")
    return bpy.ops.import_scene.gltf(filepath=name)


def _import_fbx(name):
    """By the importer that suits this Blender, and by the other one where that fails."""

    def own():
        return bpy.ops.wm.fbx_import(filepath=name)

    def addon():
        enable("io_scene_fbx")
        return bpy.ops.import_scene.fbx(filepath=name)

    importers = [addon]
    if has_operator(bpy.ops.wm.fbx_import):
        importers.insert(0 if bpy.app.version >= OWN_FBX_IMPORTER else 1, own)
    reasons = []
    for importer in importers:
        try:
            if "FINISHED" in (done := importer()):
                return done
            reasons.append("the importer gave up")
        except Exception as error:  # as above
            reasons.append(reason(error))
        new_scene()  # without what it has made so far
    raise AssetError("; ".join(dict.fromkeys(reasons)))


def has_operator(operator):
    """Whether Blender was built with an operator; `bpy.ops` has an attribute of every name."""
    try:
        return operator.get_rna_type() is not None
    except KeyError:
        return False


def enable(addon):
    """Blender's own import add-ons are on by default, but not where preferences turned them off."""
    import addon_utils

    if not addon_utils.check(addon)[1]:
        addon_utils.enable(addon)
