"""Files of meshes and points into Blender and out again; nothing half-written is ever left in place of a file."""

import shutil
import tempfile
from pathlib import Path

import bpy

from . import cloud_bridge, input_file, point_file, targets

INPUT_FORMATS = ("blend", "obj", "glb", "gltf", "ply", "stl", "fbx")
OUTPUT_FORMATS = ("blend", "glb", "obj", "fbx", "ply")
# Formats that keep a vertex once for each of its normals and UVs.
SPLIT_FORMATS = ("glb", "gltf", "ply", "stl")
# Formats that keep the UVs of points without faces; in PLY, of one cloud by itself.
POINT_FORMATS = ("blend", "ply")
# Formats that cannot be written, or hold no UVs, become another one.
DEFAULT_OUTPUT = {"gltf": "glb", "stl": "glb"}


class AssetError(Exception):
    """A file cannot be read or written; the text is for the user."""


def file_format(path):
    return Path(path).suffix.lower().lstrip(".")


def default_output_format(path):
    return DEFAULT_OUTPUT.get(file_format(path), file_format(path))


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
    """Replaces the scene by a file's contents and returns its meshes and point clouds, in order of name."""
    path = Path(path).absolute()  # Blender takes relative paths from $PWD, not from the working directory
    kind = file_format(path)
    if kind not in INPUT_FORMATS:
        raise AssetError(f"cannot read '.{kind}' files; known are {', '.join(INPUT_FORMATS)}")
    if problem := input_file.why_unreadable(path):
        raise AssetError(problem)
    try:
        if kind == "blend":
            done = _replace_scene(lambda: bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False))
        else:
            new_scene()
            done = _import(path, kind)
    except Exception as error:  # importers are add-ons and raise whatever they like on a broken file
        raise AssetError(f"cannot be read: {_reason(error)}") from error
    if "FINISHED" not in done:
        raise AssetError("cannot be read: the importer gave up")
    if bpy.context.mode != "OBJECT" and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")
    objects = [obj for obj in bpy.context.view_layer.objects if obj.type in targets.TYPES]
    if not objects:
        raise AssetError("holds no mesh")
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
        _enable("io_scene_fbx")
        return bpy.ops.import_scene.fbx(filepath=name)
    _enable("io_scene_gltf2")
    return bpy.ops.import_scene.gltf(filepath=name)


def keeps_points(kind, *, surfaces, clouds):
    """Whether a file of a format can hold the UVs of the scene's clouds."""
    return kind == "blend" or (kind == "ply" and not surfaces and clouds == 1)


def save(path, *, cloud=None):
    """Writes the scene as the format of the file's name: into a directory beside it first, then moved into place.

    For PLY, `cloud` names the one object to write and the attribute that holds the UVs of its points.
    """
    path = Path(path).absolute()
    kind = file_format(path)
    if kind not in OUTPUT_FORMATS:
        raise AssetError(f"cannot write '.{kind}' files; known are {', '.join(OUTPUT_FORMATS)}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=".ble_unwrap_", dir=path.parent))
    except OSError as error:
        raise AssetError(f"cannot write to {path.parent}: {error.strerror or error}") from error
    try:
        if kind == "ply" and cloud is not None:
            point_file.write_points(work / path.name, cloud_bridge.point_columns(*cloud))
        elif "FINISHED" not in _export(work / path.name, kind):
            raise AssetError(f"cannot write {path}: the exporter gave up")
        if not (work / path.name).is_file():
            raise AssetError(f"cannot write {path}: the exporter gave up")
        companions = [name for name in work.iterdir() if name.name != path.name]
        for source in (*companions, work / path.name):  # the named file last: when it is there, all is there
            source.replace(path.parent / source.name)
    except AssetError:
        raise
    except Exception as error:
        raise AssetError(f"cannot write {path}: {_reason(error)}") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _export(path, kind):
    name = str(path)
    if kind == "blend":
        return bpy.ops.wm.save_as_mainfile(filepath=name, copy=True, check_existing=False)
    if kind == "obj":
        return bpy.ops.wm.obj_export(filepath=name, check_existing=False, export_materials=True)
    if kind == "ply":
        return bpy.ops.wm.ply_export(filepath=name, check_existing=False, export_uv=True)
    if kind == "fbx":
        _enable("io_scene_fbx")
        return bpy.ops.export_scene.fbx(filepath=name, check_existing=False)
    _enable("io_scene_gltf2")
    return bpy.ops.export_scene.gltf(filepath=name, check_existing=False, export_format="GLB")


def _enable(addon):
    """Blender's own import add-ons are on by default, but not where preferences turned them off."""
    import addon_utils

    if not addon_utils.check(addon)[1]:
        addon_utils.enable(addon)


def _reason(error):
    """The telling line of an operator's error."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[-1] if lines else type(error).__name__).removeprefix("Error: ")
