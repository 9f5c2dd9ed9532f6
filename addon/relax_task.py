"""Relaxing islands that are there, or unwrapping them anew, from objects to message."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from . import computation, uv_islands
from .island_choice import IslandChoice, part_of_face
from .mesh_arrays import MeshError
from .wording import counted


@dataclass
class Outcome:
    """What relaxing came to."""

    summary: str
    warnings: list


class RelaxTask:
    """Reads the meshes when made, then computes (`run` or `start`), then writes (`write`).

    Islands are relaxed from how they are, or with `anew` unwrapped without regard to that, and go back to where they
    were. `settings` are `texture_size` and `correct_aspect`. Which islands move is for `IslandChoice` to say; pinned
    UVs stay. Raises `mesh_arrays.MeshError`, `engine.EngineMissing`, `engine.EngineError`; whenever it does, nothing
    was changed.
    """

    def __init__(self, objects, settings, *, anew=False, threads=0, by_uv=False):
        self.anew = anew
        self.islands = IslandChoice(objects, lock_pinned=False, by_uv=by_uv)
        self.settings = {"texture_size": self.islands.texture_size(settings), "threads": threads}

    @property
    def element_count(self):
        return self.islands.selection.face_count

    def _arguments(self):
        """What the native module relaxes: faces hang together where `uv_islands` says so, within each mesh."""
        islands = self.islands
        selection = islands.selection
        offsets = selection.face_offsets
        part = np.repeat(part_of_face(selection), np.diff(offsets))
        vertices = uv_islands.welded(selection.positions, selection.corner_vertices, part)
        rules = {
            "pinned": islands.pinned_corners(),
            "start": "anew" if self.anew else "as_they_are",
            "selected": np.append(islands.moves, False)[islands.island],
            "corner_triangles": selection.corner_triangles,
        }
        return ((selection.positions, vertices, offsets), islands.uv, self.settings), rules

    def run(self):
        """Computes the result at once."""
        arguments, rules = self._arguments()
        return computation.relax(*arguments, **rules)

    def start(self):
        """Computes the result on another thread: a `computation.Job`."""
        arguments, rules = self._arguments()
        return computation.submit_relax(*arguments, **rules)

    def write(self, relaxed):
        """Writes the UVs of the islands that moved, and says what was done. Raises `MeshError` where none could be."""
        report = relaxed.report
        left = told_of_left(report["islands"])
        if not report["relaxed"] and not report["kept"]:
            raise MeshError(f"Nothing was {self._done}: {'; '.join([*left, *self.islands.left])}")
        if report["relaxed"]:
            self.islands.write(relaxed.uv)
        return Outcome("; ".join([*told(report, self._done), *left, *self.islands.left]), self.islands.warnings)

    @property
    def _done(self):
        """What was done to islands, in a word or two."""
        return "unwrapped anew" if self.anew else "relaxed"


def told(report, done):
    """What was done with islands, in parts of a sentence."""
    parts = []
    if count := report["relaxed"]:
        moved = [island for island in report["islands"] if island["moved"]]
        before, after = (stretch(moved, name) for name in ("l2_before", "l2_after"))
        parts.append(f"{counted(count, 'island')} {done}, stretch {before} to {after}")
    if count := report["kept"]:
        parts.append(f"{counted(count, 'island')} had the least stretch already")
    return parts


def told_of_left(islands):
    """How many islands were left as they were, and why, one text for each reason."""
    reasons = Counter(island["left"] for island in islands if island["left"] is not None)
    return [
        f"{counted(count, 'island')} left as {'it was, because' if count == 1 else 'they were, each because'} {reason}"
        for reason, count in reasons.items()
    ]


def stretch(islands, name):
    """The stretch of islands together: the root of the mean of the squares, weighted by area."""
    areas = np.array([island["area"] for island in islands])
    squares = np.array([island[name] for island in islands]) ** 2
    value = float(np.sqrt((areas * squares).sum() / areas.sum()))
    return f"{value:.2f}" if value < 99.995 else "over 100"
