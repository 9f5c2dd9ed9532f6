"""Packing islands that are there, from objects to message: what moves, what stays, and where it goes."""

from dataclasses import dataclass

import numpy as np

from . import computation, faces, mesh_bridge, textures, uv_islands, uv_maps
from .mesh_arrays import MeshError
from .wording import counted

MOST_COLUMNS = 10  # of tiles in a row, as UDIM has them
# So many textures beyond the tiles are searched for what is to stay: farther away it is in nobody's way.
NEAR = 1.0
# Islands that are no longer than this along either axis, in UVs, are a point: there is nothing to be packed.
POINT = 1e-7


@dataclass
class Outcome:
    """What a written packing came to."""

    summary: str
    warnings: list


class PackTask:
    """Reads the meshes when made, then computes (`run` or `start`), then writes (`write`).

    `settings` are those of `properties.PACK_SETTINGS`, and `scale`, `keep_unselected`, `lock_pinned` and `keep_stacks`.
    Islands with a selected face move, as wholes, unless a face of them is hidden or, with `lock_pinned`, a UV of them
    pinned. Raises `MeshError`, `engine.EngineMissing`, `engine.EngineError`; whenever it does, nothing was changed.
    """

    def __init__(self, objects, settings, *, threads=0, by_uv=False):
        for obj in objects:
            if obj.mode == "EDIT":
                obj.update_from_editmode()  # faces may have been made or deleted since edit mode was entered
        mapped = [obj for obj in objects if obj.type == "MESH" and obj.data.polygons and obj.data.uv_layers.active]
        if not mapped:
            raise MeshError("There is no UV map to pack")
        self.warnings = []
        if without := [obj.name for obj in objects if obj.type == "MESH" and obj.data.polygons and obj not in mapped]:
            self.warnings.append(f"{', '.join(without)}: no UV map, so there was nothing to pack")
        self.selection = mesh_bridge.gather(mapped, whole=True)
        parts = {part.mesh_uid for part in self.selection.parts}
        self.objects = [obj for obj in mapped if obj.data.session_uid in parts]
        states = [faces.selected_and_hidden(obj, by_uv=by_uv) for obj in self.objects]
        self.uv = mesh_bridge.read_uvs(self.selection)
        self.settings, self.threads = dict(settings), threads
        if self.settings["correct_aspect"]:
            names = mesh_bridge.active_maps(self.selection)
            size, _ = textures.proportioned_size(self.objects, names, self.settings["texture_size"])
            self.settings["texture_size"] = size
        self._find_islands()
        self._choose(*map(np.concatenate, zip(*states, strict=True)))

    def _find_islands(self):
        selection = self.selection
        part_of_face = np.repeat(
            np.arange(len(selection.parts)), [part.faces.stop - part.faces.start for part in selection.parts]
        )
        self.island = uv_islands.islands(
            selection.positions, selection.corner_vertices, selection.face_offsets, self.uv, part_of_face
        )
        self.count = int(self.island.max(initial=-1)) + 1
        self.corner_island = np.repeat(self.island, np.diff(selection.face_offsets))
        mapped = self.corner_island >= 0
        low, high = np.full((self.count, 2), np.inf), np.full((self.count, 2), -np.inf)
        np.minimum.at(low, self.corner_island[mapped], self.uv[mapped])
        np.maximum.at(high, self.corner_island[mapped], self.uv[mapped])
        self.low, self.high = low, high

    def _choose(self, selected, hidden):
        """Decides which islands move, and which of the others are in the way, by these faces, two of (f,) bool."""
        selected, hidden = self._with(selected), self._with(hidden)
        if not selected.any():
            raise MeshError("No islands are selected" if self.count else "The UV maps hold no finite UVs")
        is_point = (self.high - self.low).max(axis=1) <= POINT
        pinned = self._pinned() if self.settings["lock_pinned"] else np.zeros(self.count, bool)
        self.moves = selected & ~hidden & ~pinned & ~is_point
        self.left = []
        for which, why in (
            (selected & hidden, "in part hidden"),
            (selected & ~hidden & pinned, "pinned"),
            (selected & ~hidden & ~pinned & is_point, "no larger than a point"),
        ):
            if count := int(which.sum()):
                self.left.append(f"{counted(count, 'island')} left in place, {why}")
        if not self.moves.any():
            raise MeshError(f"Nothing can be packed: {'; '.join(self.left)}")
        tiles = self.settings["tiles"]
        most = np.array([min(tiles, MOST_COLUMNS), -(-tiles // MOST_COLUMNS)])
        near = ((self.low < most + NEAR) & (self.high > -NEAR)).all(axis=1)
        stays = ~self.moves & ~is_point & near
        # What is left of the selection is in the way in any case.
        self.stays = stays if self.settings["keep_unselected"] else stays & selected

    def _with(self, is_meant):
        """Which islands have a face, (f,) bool, that is meant."""
        found = np.zeros(self.count, bool)
        found[self.island[is_meant & (self.island >= 0)]] = True
        return found

    def _pinned(self):
        """Which islands have a pinned UV."""
        names = mesh_bridge.active_maps(self.selection)
        pinned = np.concatenate(
            [uv_maps.pinned_corners(obj.data, name) for obj, name in zip(self.objects, names, strict=True)]
        )
        found = np.zeros(self.count, bool)
        found[self.corner_island[pinned & (self.corner_island >= 0)]] = True
        return found

    @property
    def element_count(self):
        return self.selection.face_count

    def _arguments(self):
        """What the native module packs: moving islands in the proportions of the texture, the others as they are."""
        triangles = self.selection.corner_triangles
        if triangles is None:
            triangles = np.arange(len(self.uv), dtype=np.int32).reshape(-1, 3)
        island = self.corner_island[triangles[:, 0]]
        packed = np.flatnonzero((island >= 0) & (self.moves | self.stays)[island])
        triangles, island = triangles[packed], island[packed]
        width, height = self.settings["texture_size"]
        points = np.where(np.isfinite(self.uv), self.uv, 0.0).astype(np.float64)
        points[self._moving(), 1] *= height / width
        rules = {"obstacles": self.stays[island], "scale": self.settings["scale"].lower()}
        if self.settings["keep_stacks"]:
            rules["groups"] = self._stacks()[island]
        names = ("texture_size", "margin", "mip_levels", "rotation", "quality", "tiles")
        native = {name: self.settings[name] for name in names} | {"threads": self.threads}
        return (points, triangles, island.astype(np.int32), native), rules

    def _moving(self):
        """The corners of moving islands, (c,) bool."""
        return (self.corner_island >= 0) & self.moves[self.corner_island]

    def _stacks(self):
        """The stack of each moving island; -1 of those that lie alone, and of those that stay."""
        moving = np.where((self.island >= 0) & self.moves[self.island], self.island, -1)
        numbers, compact = np.unique(moving, return_inverse=True)
        compact = (compact.reshape(-1) - (numbers[0] < 0)).astype(np.int32)
        found = np.full(self.count, -1, np.int32)
        found[numbers[numbers >= 0]] = uv_islands.stacks(compact, self.selection.face_offsets, self.uv)
        self.stack = found
        return found

    def run(self):
        """Computes the result at once."""
        arguments, rules = self._arguments()
        return computation.pack(*arguments, **rules)

    def start(self):
        """Computes the result on another thread: a `computation.Job`."""
        arguments, rules = self._arguments()
        return computation.submit_pack(*arguments, **rules)

    def write(self, packed):
        """Writes the UVs of the islands that moved, and says what was done."""
        moving = self._moving()
        if not np.isfinite(packed.uv[moving]).all():
            raise MeshError("the native library returned UVs that are not finite; nothing was changed")
        uv = self.uv.copy()
        uv[moving] = packed.uv[moving]
        mesh_bridge.write_uvs(self.selection, uv)
        return Outcome(self._summary(packed.report), [*self.warnings, *packed.report["warnings"]])

    def _summary(self, report):
        moved = int(self.moves.sum())
        tiles = int(report["tiles"])
        of = "the texture" if tiles <= 1 else f"{tiles} tiles"
        parts = [f"{counted(moved, 'island')} packed"]
        if self.settings["keep_stacks"] and (stacked := int((self.stack >= 0).sum())):
            parts[0] += f" ({stacked:,} in {counted(self.stack.max() + 1, 'stack')})"
        parts.append(f"{100 * float(report['packing_efficiency']):.0f} % of {of} used")
        if self.settings["scale"] == "UNIFORM":
            scale = float(report["texels_per_unit"]) / self.settings["texture_size"][0]
            parts.append(f"{scale:.3g} times as large")
        if specks := report["specks"]:
            parts.append(f"{counted(specks, 'island')} smaller than a pixel enlarged to one")
        if around := int((self.stays & ~self.moves).sum()):
            parts.append(f"around {counted(around, 'island')} that stayed")
        return ", ".join([*parts, *self.left])
