"""What of a loaded file the output is going to hold, made ready to be unwrapped: no mesh is left out without a word.

A `.blend` keeps everything: modifiers, links, texts; its base meshes are unwrapped, wherever in the file they are. The
other formats hold what modifiers make, so those are applied first, and it is the result that is unwrapped, certified
and written. Where that would lose shape keys, the modifiers are not applied.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from .. import modifiers, targets
from . import scene
from .formats import POSED_FORMATS, AssetError, file_format, listed, named
from .read_back import Expected


@dataclass
class Contents:
    """Objects that the output is going to hold and whose maps can be written, and what there is to say of the rest."""

    kind: str
    objects: list
    notes: list = field(default_factory=list)

    def expected(self):
        """The least that the output must hold."""
        meshes = [obj.data for obj in self.objects if targets.is_surface(obj)]
        return Expected(sum(len(mesh.polygons) for mesh in meshes), sum(len(mesh.loops) for mesh in meshes))

    def bare(self):
        """What the output has faces of and no UVs for, each with the remedy; asked for after the unwrap."""
        if self.kind != "blend":
            return []  # the file itself is asked, see `saving.save`
        bare = [
            f"{obj.name} has no UVs: its mesh is linked from {_library(obj.data)}; unwrap that file"
            for obj in bpy.data.objects
            if targets.is_surface(obj) and not obj.data.is_editable and not obj.data.uv_layers
        ]
        made = [obj for obj in self.objects if any(m.type == "NODES" and m.show_viewport for m in obj.modifiers)]
        if made:
            with scene.evaluated(made) as layer:
                found = modifiers.bare_faces(layer)
            bare += [modifiers.bare_text(name) for name, obj in sorted(found.items()) if obj in made]
        return bare


def prepare(target):
    """Makes the loaded scene ready for an output file: `Contents`. Raises `AssetError` where nothing is left."""
    kind = file_format(target)
    shapes = scene.bone_shapes()
    missing = _missing()
    contents = _keep_all(kind, shapes) if kind == "blend" else _flatten(kind, shapes)
    contents.notes += missing
    if not contents.objects:
        raise AssetError("; ".join(["holds no mesh that can be unwrapped", *contents.notes]))
    return contents


def _missing():
    """Notes about what is linked from files that are not there."""
    pairs = {
        (_library(item), item.name)
        for kind in (bpy.data.objects, bpy.data.collections, bpy.data.meshes)
        for item in kind
        if item.is_missing
    }
    return [f"{listed(names)}: linked from {name}, which is missing" for name, names in _grouped(sorted(pairs)).items()]


def _keep_all(kind, shapes):
    """A `.blend`: every mesh in it but linked ones, and a note on what the certificate is not about."""
    found = [obj for obj in scene.written(kind) if obj not in shapes]
    linked = [obj for obj in found if obj.type in targets.TYPES and not obj.data.is_editable]
    objects = [obj for obj in found if obj.type in targets.TYPES and obj.data.is_editable]
    contents = Contents(kind, objects)
    for library, names in _grouped((_library(obj.data), obj.name) for obj in linked).items():
        contents.notes.append(f"{listed(names)}: linked from {library} and left as it is there; unwrap that file")
    _note_unmapped(contents, found)
    surfaces = filter(targets.is_surface, objects)
    remade = _grouped((tuple(m.name for m in modifiers.remaking(obj)), obj.name) for obj in surfaces)
    remade.pop((), None)
    for names, of in remade.items():
        contents.notes.append(
            f"{listed(of)}: the mesh was unwrapped without {named('modifier', names)}, and nothing is promised of the "
            "faces and UVs made there; to have these unwrapped, apply modifiers first"
        )
    _place(objects)
    used = {obj.data for obj in bpy.data.objects if obj.type == "MESH"}
    unused = [mesh.name for mesh in bpy.data.meshes if mesh.users and mesh.polygons and mesh not in used]
    if unused:
        contents.notes.append(f"{listed(unused)}: no object uses these meshes, so they were left as they are")
    return contents


def _place(objects):
    """Gives objects that the current scene does not show their place in the world, and so their size."""
    unknown = [obj for obj in objects if obj.library is None and not obj.visible_get()]
    if unknown:
        with scene.evaluated(unknown):
            pass


def _library(data):
    return Path(bpy.path.abspath(data.library.filepath)).name if data.library else "another file"


def _note_unmapped(contents, found):
    names = [obj.name for obj in found if obj.type in targets.CONVERTIBLE]
    if names:
        contents.notes.append(
            f"{listed(names)}: text, curve or surface, which has no UV map of its own and was left as it is; convert "
            "it to a mesh first"
        )


def _flatten(kind, shapes):
    """Every other format: links made local, modifiers applied, texts and curves turned into meshes."""
    contents = Contents(kind, [])
    _drop(shapes)
    scene.make_local()
    before = scene.written(kind)
    others = [obj for obj in before if obj.type in targets.CONVERTIBLE]
    _apply([obj for obj in before if obj.type == "MESH"], kind, contents.notes)
    _convert(others, contents.notes)
    found = scene.written(kind)
    everything = {obj for obj in bpy.data.objects if targets.is_surface(obj)}
    left = sorted(obj.name for obj in everything - set(found) - shapes)
    if left:
        contents.notes.append(
            f"{listed(left)}: not in the .{kind} file, because hidden, in an excluded collection or in another scene"
        )
    contents.objects = [obj for obj in found if obj.type in targets.TYPES and obj.data.is_editable]
    _place(contents.objects)
    return contents


def _drop(shapes):
    """Takes the objects that only show how bones look out of all scenes, so that no exporter writes them."""
    for obj in shapes:
        for collection in obj.users_collection:
            collection.objects.unlink(obj)


def _apply(objects, kind, notes):
    keeps_pose = kind in POSED_FORMATS
    applied, left = [], []
    off = _grouped((tuple(m.name for m in modifiers.off_in_viewport(obj)), obj.name) for obj in objects)
    off.pop((), None)
    notes += [
        f"{listed(of)}: {named('modifier', names)} not applied, since turned off in the viewport"
        for names, of in off.items()
    ]
    for obj in objects:
        if modifiers.to_apply(obj, keeps_pose) or (obj.data.shape_keys and not keeps_pose):
            (left if keeps_pose and obj.data.shape_keys else applied).append(obj)
    kept_off = _grouped((tuple(m.name for m in modifiers.to_apply(obj, keeps_pose)), obj.name) for obj in left)
    for names, of in kept_off.items():
        notes.append(f"{listed(of)}: {named('modifier', names)} not applied, since the shape keys would be lost")
    for obj in left:
        for modifier in modifiers.to_apply(obj, keeps_pose):
            obj.modifiers.remove(modifier)
    made = _grouped((tuple(m.name for m in modifiers.to_apply(obj, keeps_pose)), obj.name) for obj in applied)
    for names, of in made.items():
        if names:
            notes.append(f"{listed(of)}: {named('modifier', names)} applied, and the result unwrapped")
    if applied:
        with scene.evaluated(applied) as layer:
            modifiers.apply(applied, layer, keeps_pose=keeps_pose)


def _convert(objects, notes):
    """Turns texts, curves and the like that have faces into meshes, in the same place of the scene."""
    if not objects:
        return
    made = []
    with scene.evaluated(objects) as layer:
        graph = layer.depsgraph
        for obj in objects:
            try:
                mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(graph), depsgraph=graph)
            except RuntimeError:  # all of a family of metaballs is in the mesh of the first
                continue
            made.append((obj, mesh, obj.matrix_world.copy()))
    converted = []
    for obj, mesh, matrix in made:
        if not mesh.polygons:
            bpy.data.meshes.remove(mesh)
            continue
        while mesh.uv_layers:  # Blender's own, by the length along a curve, which would be taken for a map to keep
            mesh.uv_layers.remove(mesh.uv_layers[0])
        converted.append(obj.name)
        _replace(obj, mesh, matrix)
    if converted:
        notes.append(f"{listed(converted)}: turned into a mesh, and unwrapped")


def _replace(obj, mesh, matrix):
    """Puts an object with a mesh in the place of one of another kind: name, collections, parent and children."""
    name = obj.name
    new = bpy.data.objects.new(name, mesh)
    for collection in obj.users_collection:
        collection.objects.link(new)
    new.parent, new.parent_type, new.parent_bone = obj.parent, obj.parent_type, obj.parent_bone
    new.matrix_parent_inverse = obj.matrix_parent_inverse
    for key, value in obj.items():
        new[key] = value
    new.matrix_world = matrix
    for child in obj.children:
        inverse = child.matrix_parent_inverse.copy()
        child.parent = new
        child.matrix_parent_inverse = inverse
    for collection in obj.users_collection:  # not removed: others may follow it as their path
        collection.objects.unlink(obj)
    obj.name = f"{name} before"
    new.name = mesh.name = name


def _grouped(pairs):
    groups = defaultdict(list)
    for key, value in pairs:
        groups[key].append(value)
    return dict(groups)
