"""What `make quality` unwraps: generated meshes of several kinds, and any mesh shuffled."""

import sys
from pathlib import Path

import numpy as np

REPO = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(REPO / "native" / "evaluation" / "scaling"), str(REPO / "native" / "paper")]

import scaling_meshes  # noqa: E402
import shapes  # noqa: E402

# Of models that are else as in the paper's figures: below the size from which a coarse mesh is made, and far above.
SMALL_CELL = 0.085
LARGE_CELL = 0.021


# Machine parts: flat sides, creases, handles, and a body far longer than it is thick.


def drilled_plate(cell=0.06):
    """A square plate with nine holes."""

    def distance(x, y, z):
        d = np.maximum.reduce([np.abs(x) - 1.0, np.abs(y) - 1.0, np.abs(z) - 0.15])
        for column in (-2 / 3, 0, 2 / 3):
            for row in (-2 / 3, 0, 2 / 3):
                d = np.maximum(d, 0.17 - np.hypot(x - column, y - row))
        return d

    return shapes.surface_net("drilled plate", distance, (-1.1, -1.1, -0.3), (1.1, 1.1, 0.3), cell)


def gear(cell=0.05):
    """A wheel with eleven teeth and a bore."""

    def distance(x, y, z):
        radius = np.hypot(x, y)
        teeth = 0.85 + 0.15 * np.clip(2 * np.sin(11 * np.arctan2(y, x)), -1, 1)
        return np.maximum.reduce([0.7 * (radius - teeth), 0.3 - radius, np.abs(z) - 0.2])

    return shapes.surface_net("gear", distance, (-1.1, -1.1, -0.3), (1.1, 1.1, 0.3), cell)


def spring(cell=0.07, turns=4, pitch=0.55):
    """A wire in turns about an axis."""

    def distance(x, y, z):
        angle = np.arctan2(y, x) / (2 * np.pi)
        turn = np.clip(np.round(z / pitch - angle), 0, turns - 1)
        return np.hypot(np.hypot(x, y) - 1.0, z - pitch * (turn + angle)) - 0.17

    return shapes.surface_net("spring", distance, (-1.3, -1.3, -0.6), (1.3, 1.3, pitch * turns + 0.3), cell)


# Functions, as a mesh is made when its turn comes.
GENERATED = {
    "small skull": lambda: shapes.skull(SMALL_CELL),
    "small goblin": lambda: shapes.goblin(SMALL_CELL),
    "small cat": lambda: shapes.cat(SMALL_CELL),
    "drilled plate": drilled_plate,
    "gear": gear,
    "spring": spring,
    "sculpt": lambda: scaling_meshes.sculpt(4_000),
    "parts": lambda: scaling_meshes.parts(16_000),
    "skull": shapes.skull,
    "goblin": shapes.goblin,
    "cat": shapes.cat,
    "large goblin": lambda: shapes.goblin(LARGE_CELL),
    "large sculpt": lambda: scaling_meshes.sculpt(32_000),
}


def shuffled(mesh, number):
    """The same surface with its vertices, faces and the first corner of each face in another order.

    Number 0 is the mesh as it is; of every other the order is a function of the number and the counts alone.
    """
    if number == 0:
        return mesh
    random = np.random.default_rng(number)
    vertices = random.permutation(len(mesh.positions))
    place = np.empty_like(vertices)
    place[vertices] = np.arange(len(vertices))
    sizes = np.diff(mesh.face_offsets)
    faces = random.permutation(len(sizes))
    sizes = sizes[faces]
    first = random.integers(0, np.maximum(sizes, 1))
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    # For each corner: its place within its face, turned, and from there the corner that it was.
    within = np.arange(offsets[-1]) - np.repeat(offsets[:-1], sizes)
    within = (within + np.repeat(first, sizes)) % np.repeat(sizes, sizes)
    corners = mesh.corner_vertices[np.repeat(mesh.face_offsets[:-1][faces], sizes) + within]
    return shapes.Mesh(mesh.name, mesh.positions[vertices], place[corners].astype(np.int32), offsets, mesh.view)
