"""The scene into a file of a format: written under another name in its folder, read back, then moved into place."""

import os
import re
import secrets
import shutil
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy

from .. import cloud_bridge, point_file
from . import gltf, read_back
from .formats import MEGABYTE, OUTPUT_FORMATS, AssetError, file_format, reason
from .loading import enable

# Formats of several files, whose names follow from that of the first: they are written in a folder of their own.
FILES_TOGETHER = ("obj", "gltf")


@dataclass
class Saved:
    """What there is to say of a written file."""

    notes: list  # what of the input it has not, or has otherwise
    bare: list  # what has faces and no UVs in it


def save(path, *, source=None, cloud=None, contents=None):
    """Writes the scene as the format of the file's name: what came of it, as `Saved`.

    `source` is the file that the scene is from: what its format has of its own is kept (see gltf.py). For PLY, `cloud`
    names the one object to write and the attribute that holds the UVs of its points. `contents` (of `prepare`) is what
    the file must hold. Raises `AssetError`, with whatever was at `path` before still there.
    """
    path = Path(path).absolute()
    kind = file_format(path)
    if kind not in OUTPUT_FORMATS:
        raise AssetError(f"cannot write '.{kind}' files; known are {', '.join(OUTPUT_FORMATS)}")
    if path.is_dir():
        raise AssetError(f"cannot write {path}: there is a folder of that name")
    stem = f".ble_unwrap_{secrets.token_hex(4)}"
    together = kind in FILES_TOGETHER or (kind == "fbx" and _has_packed_images())
    work = path.parent / stem / path.name if together else path.parent / f"{stem}.{kind}"
    try:
        work.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AssetError(f"cannot write to {path.parent}: {error.strerror or error}") from error
    try:
        if kind == "ply" and cloud is not None:
            point_file.write_points(work, cloud_bridge.point_columns(*cloud))
        elif "FINISHED" not in _export(work, kind, source):
            raise AssetError("the exporter gave up")
        if not work.is_file():
            raise AssetError("the exporter gave up")
        if kind == "obj":
            _relative_textures(work.with_suffix(".mtl"), path.parent)
        found = read_back.check(work, contents.expected() if contents else read_back.Expected(), together=together)
        notes = gltf.changes(source, work)
        _move(work, path, together)
    except Exception as error:  # exporters are add-ons and raise whatever they like
        text = error.strerror if isinstance(error, OSError) and error.strerror else reason(error)
        raise AssetError(f"cannot write {path}: {text}{_disk(path.parent)}") from error
    finally:
        for left in path.parent.glob(f"{stem}*"):
            shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink(missing_ok=True)
    bare = [f"{name} has no UVs in the output" for name in found]
    return Saved(notes, (contents.bare() if contents else []) + bare)


def _disk(folder):
    """How full the disk is: what exporters say of a full one is seldom that it is full."""
    try:
        free = shutil.disk_usage(folder).free
    except OSError:
        return ""
    return f" (the disk of {folder} has {free / MEGABYTE:,.0f} MB free)"


def _move(work, path, together):
    """Moves what was written into place; the named file last, so that when it is there, all is there."""
    folder = work.parent
    files = sorted(file for file in folder.rglob("*") if file.is_file() and file != work) if together else []
    targets = [path.parent / file.relative_to(folder) for file in files]
    for target in targets:
        if target.is_dir():
            raise AssetError(f"there is a folder of the name {target.name}")
    for file, target in zip(files, targets, strict=True):
        target.parent.mkdir(exist_ok=True)
        file.replace(target)
    work.replace(path)


def _export(path, kind, source):
    name = str(path)
    if kind == "blend":
        return bpy.ops.wm.save_as_mainfile(filepath=name, copy=True, check_existing=False, relative_remap=True)
    if kind == "obj":
        with _unpacked_images(path):
            return bpy.ops.wm.obj_export(
                filepath=name, check_existing=False, export_materials=True, path_mode="ABSOLUTE", export_uv=True
            )
    if kind == "ply":
        return bpy.ops.wm.ply_export(filepath=name, check_existing=False, export_uv=True, ascii_format=False)
    if kind == "fbx":
        enable("io_scene_fbx")
        embed = {"path_mode": "COPY", "embed_textures": True}
        paths = embed if _has_packed_images() else {"path_mode": "RELATIVE"}
        return bpy.ops.export_scene.fbx(filepath=name, check_existing=False, **paths)
    enable("io_scene_gltf2")
    return gltf.export(name, separate=kind == "gltf", source=source)


def _has_packed_images():
    return any(image.packed_file for image in bpy.data.images)


@contextmanager
def _unpacked_images(path):
    """Files of the images that are packed in the scene, beside a file that is to name them.

    Blender's exporter names a packed image by the last part of its path, and leaves writing it to others.
    """
    named = []
    try:
        for image in bpy.data.images:
            if image.packed_file and image.users:
                extension = Path(image.filepath_raw).suffix or f".{image.file_format.lower()}"
                clean = re.sub(r"[^\w.-]", "_", image.name).removesuffix(extension)
                file = path.parent / f"{path.stem}_{clean}{extension}"
                file.write_bytes(image.packed_file.data)
                named.append((image, image.filepath_raw))
                image.filepath_raw = str(file)
        yield
    finally:
        for image, before in named:
            image.filepath_raw = before


def _relative_textures(library, folder):
    """Makes the paths of textures relative to the folder in which a material library is going to be."""
    if not library.is_file():
        return
    paths = {}
    for image in bpy.data.images:
        if image.filepath:
            absolute = os.path.normpath(bpy.path.abspath(image.filepath, library=image.library)).replace("\\", "/")
            try:
                paths[absolute] = bpy.path.relpath(absolute, start=str(folder)).removeprefix("//").replace("\\", "/")
            except ValueError:  # on another drive
                continue
    lines = library.read_text(encoding="utf-8", errors="surrogateescape").split("\n")
    for number, line in enumerate(lines):
        found = max((end for end in paths if line.rstrip().endswith(f" {end}")), key=len, default=None)
        if found:
            lines[number] = line.rstrip().removesuffix(found) + paths[found]
    library.write_text("\n".join(lines), encoding="utf-8", errors="surrogateescape")
