"""BLE Unwrap and Smart UV Project on the same meshes, each into a UV map of its own, measured alike.

Smart UV Project is an operator that works on what is selected in edit mode, so it runs on copies: the artist's own
selection, hidden faces and maps are not touched by it. Both results are written at the end, or nothing is.
"""

from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from . import (
    comparison,
    comparison_table,
    layout_picture,
    measurement,
    mesh_bridge,
    overlay_colours,
    seams,
    textures,
    units,
    uv_islands,
    uv_maps,
)
from .island_choice import part_of_face
from .mesh_arrays import MeshError, object_mode, read_array
from .task import UnwrapTask, placed
from .triangle_shapes import Shapes

BLE, SMART = "BLE", "SMART"
NAMES = {BLE: comparison.BLE_MAP, SMART: comparison.SMART_MAP}  # of the sides, and of their maps where these are free


@dataclass
class Compared:
    """What was written and found."""

    objects: list
    maps: list  # for each object the name of its map by side
    active: list  # for each object the names of the maps that were active and that were rendered; None where none was
    title: str
    rows: list  # of `comparison_table.rows`
    picture: np.ndarray  # of `layout_picture`


class SmartComparison:
    """Reads the meshes when made, then computes ours (`run` or `start`); `finish` does the rest and writes both maps.

    All faces count, selected or not, hidden or not. Raises what `UnwrapTask` raises; whenever it does, nothing was
    changed.
    """

    def __init__(self, objects, settings, *, threads=0):
        self.objects = [obj for obj in mesh_bridge.unique_meshes(objects) if obj.data.polygons or obj.mode == "EDIT"]
        if not self.objects:
            raise MeshError("There are no faces to unwrap")
        for obj in self.objects:
            if len(obj.data.uv_layers) + len(NAMES) > uv_maps.MAX_UV_MAPS:
                raise MeshError(
                    f"{obj.name}: has {len(obj.data.uv_layers)} UV maps, and Blender allows {uv_maps.MAX_UV_MAPS}; a "
                    f"comparison adds {len(NAMES)}, so remove some first"
                )
        self.threads = threads
        name = self._free_name(NAMES[BLE])
        settings = {"preset": "DEFAULT", **settings, **comparison.ALIKE, "uv_map": "NEW", "uv_map_name": name}
        self.task = UnwrapTask(self.objects, settings, threads=threads, whole=True)
        self.objects = self.task.written
        self._take_proportions()

    def _free_name(self, base):
        """A name that no UV map has: there, a map would not be a new one."""
        taken = {layer.name for obj in self.objects for layer in obj.data.uv_layers}
        names = (base, *(f"{base}.{number:03d}" for number in range(1, len(taken) + 2)))
        return next(name for name in names if name not in taken)

    def _take_proportions(self):
        """Lays out for the image of the map that is active: the new ones, which both layouts come into, have none."""
        self.size = self.task.settings["texture_size"]
        if self.task.settings["correct_aspect"]:
            maps = [layer.name if (layer := obj.data.uv_layers.active) else None for obj in self.objects]
            self.size, _ = textures.proportioned_size(self.objects, maps, self.size)
        self.task.settings["texture_size"] = self.task.native["texture_size"] = self.size

    @property
    def element_count(self):
        return self.task.element_count

    def run(self):
        """Computes ours at once."""
        return self.task.run()

    def start(self):
        """Computes ours on another thread."""
        return self.task.start()

    def finish(self, context, result):
        """Runs Smart UV Project, measures both, and writes them; returns what was `Compared`."""
        self.task.timer.pause()
        selection = self.task.selection
        meshes = mesh_bridge.check_parts(selection, self.task.target)
        margin = result.report["margin_texels"]  # mip levels may have raised it
        uv = {BLE: placed(result.uv, None)}
        seconds = {BLE: self.task.timer.seconds()}
        with object_mode(meshes):
            rank = comparison.short_seams(self.task.settings["stretch_limit"])
            uv[SMART], seconds[SMART], angle = _smart_uv(context, self.objects, margin, self.size, rank)
        measured = [
            measurement.measure(
                selection, uv[side], texture_size=self.size, margin=margin, by_face=True, threads=self.threads
            )
            for side in NAMES
        ]
        rows = comparison_table.rows(measured, [seconds[side] for side in NAMES], length_text=units.length_text)
        found = Compared(
            objects=self.objects,
            maps=[],
            active=[_active_names(mesh) for mesh in meshes],
            title=selection.title,
            rows=[*rows, ("Angle limit", "none", f"{angle}°")],
            picture=layout_picture.side_by_side([_layout(selection, uv[side], self.size) for side in NAMES], self.size),
        )
        found.maps = _write(selection, meshes, uv, found.active)
        return found


def _active_names(mesh):
    active = mesh.uv_layers.active
    rendered = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    return (active.name if active else None), rendered


def _smart_uv(context, objects, margin, size, rank):
    """The UVs of Smart UV Project at its best angle, (c, 2), the seconds that this took, and the angle in degrees.

    Of meshes in object mode.
    """
    with _copies(context, objects) as copies:
        try:
            by_angle, best = comparison.best_smart_uv(copies, margin=margin, texture_size=size, rank=rank)
        except RuntimeError as error:  # of Blender's operators
            raise MeshError(f"Smart UV Project did not run: {str(error).strip()}") from error
        held = [read_array(obj.data.uv_layers[comparison.SMART_MAP].uv, "vector", np.float32, 2) for obj in copies]
    return np.concatenate(held), by_angle[best]["seconds_total"], best


@contextmanager
def _copies(context, objects):
    """Copies of objects without their UV maps, modifiers and shape keys; selection and active object are put back."""
    view_layer = context.view_layer
    selected = [obj for obj in view_layer.objects if obj.select_get()]
    active = view_layer.objects.active
    copies = []
    try:
        for obj in objects:
            # Without shape keys, of which a copy of the mesh would leave its own behind.
            copy = bpy.data.objects.new(obj.name, bpy.data.meshes.new_from_object(obj))
            copies.append(copy)
            for name in [layer.name for layer in copy.data.uv_layers]:
                copy.data.uv_layers.remove(copy.data.uv_layers[name])
            copy.matrix_world = obj.matrix_world
            context.scene.collection.objects.link(copy)
        view_layer.update()
        space = context.space_data
        if space is not None and space.type == "VIEW_3D" and space.local_view:
            for copy in copies:
                copy.local_view_set(space, True)  # operators of this view see nothing else
        yield copies
    finally:
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        for copy in copies:
            mesh = copy.data
            bpy.data.objects.remove(copy)
            bpy.data.meshes.remove(mesh)
        view_layer.update()
        for obj in view_layer.objects:
            if obj.select_get() != (obj in selected):
                obj.select_set(obj in selected)
        view_layer.objects.active = active


def _layout(selection, uv, size):
    """What is drawn of a map: its triangles by stretch, and the borders of its islands."""
    place, island = uv_islands.islands(
        selection.positions, selection.corner_vertices, selection.face_offsets, uv, part_of_face(selection)
    )
    shapes = Shapes.of(selection, uv, size)
    colours = overlay_colours.stretch_colours(*overlay_colours.face_stretch(shapes, island))
    triangles = selection.corner_triangles
    if triangles is None:
        triangles = np.arange(len(uv), dtype=np.int32).reshape(-1, 3)
    return layout_picture.Layout(
        uv, triangles, colours[shapes.face], layout_picture.borders(place, selection.face_offsets)
    )


def _write(selection, meshes, uv, active):
    """Writes both maps to all meshes, or to none; returns for each mesh their names by side."""
    names = []
    with object_mode(meshes):
        try:
            for part, mesh in zip(selection.parts, meshes, strict=True):
                names.append({})
                for side, base in NAMES.items():
                    layer = mesh.uv_layers.new(name=base, do_init=False)
                    if layer is None:
                        raise MeshError(f"{mesh.name}: Blender could not add a UV map")
                    names[-1][side] = layer.name
                    mesh_bridge.write_layer(mesh, layer.name, uv[side][part.corners])
        except Exception:
            for mesh, maps, before in zip(meshes, names, active, strict=False):
                _remove(mesh, maps, before)
            raise
        for mesh, before in zip(meshes, active, strict=True):
            _activate(mesh, *before)
            mesh.update()
    return names


def _activate(mesh, active, rendered):
    """Makes these maps, where they are there, the active one and the one that is rendered."""
    layers = mesh.uv_layers
    if active and active in layers:
        layers.active = layers[active]
    if rendered and rendered in layers:
        layers[rendered].active_render = True


def _remove(mesh, maps, before):
    for name in maps.values():
        if (layer := mesh.uv_layers.get(name)) is not None:
            mesh.uv_layers.remove(layer)
    _activate(mesh, *before)


def discard(entries):
    """Removes both maps; `entries` are (object, names of the maps by side, maps that were active before)."""
    meshes = [obj.data for obj, _, _ in entries]
    _check_editable(entries)
    with object_mode(meshes):
        for mesh, (_, maps, before) in zip(meshes, entries, strict=True):
            _remove(mesh, maps, before)
            mesh.update()


def keep(entries, side, settings):
    """Removes both maps and writes that of one side where an unwrap would: into the map that `uv_map` asks for.

    `entries` as for `discard`; `settings` are `uv_map`, `uv_map_name`, `move_pinned` and `mark_seams`. Returns what is
    to be said. Raises `MeshError`; then nothing was changed.
    """
    _check_editable(entries)
    choices, notes = [], []
    for obj, maps, (active, _) in entries:
        choice = uv_maps.chosen(settings)
        if not choice.by_name and active and active in obj.data.uv_layers:
            choice = uv_maps.MapChoice(by_name=True, name=active)
        choices.append(choice)
        if choice.by_name and choice.name in obj.data.uv_layers and choice.name not in maps.values():
            if not settings["move_pinned"]:
                uv_maps.check_pins(obj, choice, None)
            if note := textures.replaced_note(obj, choice.name):
                notes.append(note)
    meshes = [obj.data for obj, _, _ in entries]
    with object_mode(meshes):
        for mesh, choice, (obj, maps, before) in zip(meshes, choices, entries, strict=True):
            held = read_array(mesh.uv_layers[maps[side]].uv, "vector", np.float32, 2)
            _remove(mesh, maps, before)
            layer = uv_maps.writable_layer(mesh, choice, uv_maps.group_names(obj))
            mesh_bridge.write_layer(mesh, layer.name, held)
            if side == BLE and settings["mark_seams"]:
                seams.mark_chart_borders(mesh, held, None)
            mesh.update()
    return notes


def _check_editable(entries):
    for obj, maps, _ in entries:
        if not obj.data.is_editable:
            raise MeshError(f"{obj.name}: its mesh is linked from another file and cannot be changed")
        if not all(name in obj.data.uv_layers for name in maps.values()):
            raise MeshError(f"{obj.name}: a map of the comparison is gone")
