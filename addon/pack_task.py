"""Packing islands that are there, from objects to message: what moves, what is in the way, and where it goes."""

from dataclasses import dataclass

import numpy as np

from . import computation, uv_islands
from .island_choice import IslandChoice
from .wording import counted

MOST_COLUMNS = 10  # of tiles in a row, as UDIM has them
# So many textures beyond the tiles are searched for what is to stay: farther away it is in nobody's way.
NEAR = 1.0


@dataclass
class Outcome:
    """What a written packing came to."""

    summary: str
    warnings: list


class PackTask:
    """Reads the meshes when made, then computes (`run` or `start`), then writes (`write`).

    `settings` are those of `properties.PACK_SETTINGS`, and `scale`, `keep_unselected`, `lock_pinned` and `keep_stacks`.
    Which islands move is for `IslandChoice` to say. Raises `mesh_arrays.MeshError`, `engine.EngineMissing`,
    `engine.EngineError`; whenever it does, nothing was changed.
    """

    def __init__(self, objects, settings, *, threads=0, by_uv=False):
        self.islands = islands = IslandChoice(objects, lock_pinned=settings["lock_pinned"], by_uv=by_uv)
        self.settings = {**settings, "texture_size": islands.texture_size(settings)}
        self.threads = threads
        tiles = self.settings["tiles"]
        most = np.array([min(tiles, MOST_COLUMNS), -(-tiles // MOST_COLUMNS)])
        near = ((islands.low < most + NEAR) & (islands.high > -NEAR)).all(axis=1)
        stays = ~islands.moves & ~islands.is_point & near
        # What is left of the selection is in the way in any case.
        self.stays = stays if self.settings["keep_unselected"] else stays & islands.selected

    @property
    def element_count(self):
        return self.islands.selection.face_count

    def _arguments(self):
        """What the native module packs: moving islands in the proportions of the texture, the others as they are."""
        islands = self.islands
        triangles = islands.selection.corner_triangles
        if triangles is None:
            triangles = np.arange(len(islands.uv), dtype=np.int32).reshape(-1, 3)
        island = islands.corner_island[triangles[:, 0]]
        packed = np.flatnonzero((island >= 0) & (islands.moves | self.stays)[island])
        triangles, island = triangles[packed], island[packed]
        width, height = self.settings["texture_size"]
        points = np.where(np.isfinite(islands.uv), islands.uv, 0.0).astype(np.float64)
        points[islands.moving_corners, 1] *= height / width
        rules = {"obstacles": self.stays[island], "scale": self.settings["scale"].lower()}
        if self.settings["keep_stacks"]:
            self.stack = self._stacks()
            rules["groups"] = self.stack[island]
        names = ("texture_size", "margin", "mip_levels", "rotation", "quality", "tiles")
        native = {name: self.settings[name] for name in names} | {"threads": self.threads}
        return (points, triangles, island.astype(np.int32), native), rules

    def _stacks(self):
        """The stack of each moving island; -1 of those that lie alone, and of those that stay."""
        islands = self.islands
        number = np.where(islands.moves, np.cumsum(islands.moves) - 1, -1)
        of_faces = np.append(number, -1)[islands.island].astype(np.int32)
        found = np.full(islands.count, -1, np.int32)
        found[islands.moves] = uv_islands.stacks(of_faces, islands.selection.face_offsets, islands.uv)
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
        self.islands.write(packed.uv)
        return Outcome(self._summary(packed.report), [*self.islands.warnings, *packed.report["warnings"]])

    def _summary(self, report):
        moved = int(self.islands.moves.sum())
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
        if around := int(self.stays.sum()):
            parts.append(f"around {counted(around, 'island')} that stayed")
        return ", ".join([*parts, *self.islands.left])
