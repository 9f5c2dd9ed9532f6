"""The islands of the active UV maps of objects: which of them an operator may move, and writing those that it moved."""

import numpy as np

from . import faces, mesh_bridge, textures, uv_islands, uv_maps
from .mesh_arrays import MeshError
from .wording import counted

# Islands that are no longer than this along either axis, in UVs, are a point: there is nothing to be moved.
POINT = 1e-7


class IslandChoice:
    """Read when made; nothing is changed before `write`.

    Islands with a selected face move, as wholes, unless a face of them is hidden or, with `lock_pinned`, a UV of them
    pinned. Selected faces are those of `faces.selected_and_hidden`. Raises `MeshError` where no island may move.
    """

    def __init__(self, objects, *, lock_pinned, by_uv=False):
        meshes = [obj for obj in objects if obj.type == "MESH"]
        for obj in meshes:
            if obj.mode == "EDIT":
                obj.update_from_editmode()  # faces may have been made or deleted since edit mode was entered
        with_faces = [obj for obj in meshes if obj.data.polygons]
        mapped = [obj for obj in with_faces if obj.data.uv_layers.active]
        if not mapped:
            raise MeshError("There is no UV map with islands")
        editable = [obj for obj in mapped if obj.data.is_editable]
        self.warnings = []
        for which, why in (
            ([obj for obj in with_faces if obj not in mapped], "no UV map, so there are no islands"),
            ([obj for obj in mapped if obj not in editable], "linked from another file, so its islands stay"),
        ):
            if which:
                self.warnings.append(f"{', '.join(obj.name for obj in which)}: {why}")
        # Where no mesh is editable, this says so.
        self.selection = mesh_bridge.gather(editable or mapped, whole=True, marks=False)
        self.objects = editable
        states = [faces.selected_and_hidden(obj, by_uv=by_uv) for obj in editable]
        self.uv = mesh_bridge.read_uvs(self.selection)
        self.maps = mesh_bridge.active_maps(self.selection)
        self._find()
        self._choose(lock_pinned, *map(np.concatenate, zip(*states, strict=True)))

    def _find(self):
        selection = self.selection
        self.place, self.island = uv_islands.islands(
            selection.positions, selection.corner_vertices, selection.face_offsets, self.uv, part_of_face(selection)
        )
        self.count = int(self.island.max(initial=-1)) + 1
        self.corner_island = np.repeat(self.island, np.diff(selection.face_offsets))
        self.low, self.high = uv_islands.boxes(self.corner_island, self.count, self.uv)

    def _choose(self, lock_pinned, selected, hidden):
        self.selected, hidden = self._with(selected), self._with(hidden)
        if not self.selected.any():
            raise MeshError("No islands are selected" if self.count else "The UV maps hold no finite UVs")
        self.is_point = (self.high - self.low).max(axis=1) <= POINT
        pinned = self._pinned() if lock_pinned else np.zeros(self.count, bool)
        self.moves = self.selected & ~hidden & ~pinned & ~self.is_point
        self.left = []  # what is said of those that are selected and stay
        for which, why in (
            (self.selected & hidden, "in part hidden"),
            (self.selected & ~hidden & pinned, "pinned"),
            (self.selected & ~hidden & ~pinned & self.is_point, "no larger than a point"),
        ):
            if count := int(which.sum()):
                self.left.append(f"{counted(count, 'island')} left in place, {why}")
        if not self.moves.any():
            raise MeshError(f"Nothing can be moved: {'; '.join(self.left)}")

    def _with(self, is_meant):
        """Which islands have a face, (f,) bool, that is meant."""
        found = np.zeros(self.count, bool)
        found[self.island[is_meant & (self.island >= 0)]] = True
        return found

    def pinned_corners(self):
        """The corners whose UV is pinned, (c,) bool."""
        pairs = zip(self.objects, self.maps, strict=True)
        return np.concatenate([uv_maps.pinned_corners(obj.data, name) for obj, name in pairs])

    def _pinned(self):
        """Which islands have a pinned UV."""
        pinned = self.pinned_corners()
        found = np.zeros(self.count, bool)
        found[self.corner_island[pinned & (self.corner_island >= 0)]] = True
        return found

    @property
    def moving_corners(self):
        """The corners of the islands that move, (c,) bool."""
        if not self.count:
            return np.zeros(len(self.uv), bool)
        return (self.corner_island >= 0) & self.moves[self.corner_island]

    def texture_size(self, settings):
        """Width and height of the texture: those of the settings, or in the proportions of the materials' image."""
        size = settings["texture_size"]
        if settings["correct_aspect"]:
            size, _ = textures.proportioned_size(self.objects, self.maps, size)
        return size

    def write(self, uv):
        """Writes the UVs of the islands that move, given one for each corner. Raises `MeshError` where it cannot."""
        moving = self.moving_corners
        if not np.isfinite(uv[moving]).all():
            raise MeshError("the native library returned UVs that are not finite; nothing was changed")
        written = self.uv.copy()
        written[moving] = uv[moving]
        mesh_bridge.write_uvs(self.selection, written)


def part_of_face(selection):
    """The number of the mesh that each face of a selection is of, (f,)."""
    counts = [part.faces.stop - part.faces.start for part in selection.parts]
    return np.repeat(np.arange(len(counts)), counts)
