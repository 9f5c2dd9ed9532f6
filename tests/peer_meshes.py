"""A dozen generated meshes of the kinds that people unwrap, small enough to be unwrapped by two programs in a test."""

import sys
from pathlib import Path

import numpy as np

REPO = Path(__file__).resolve().parent.parent
sys.path.append(str(REPO / "native" / "evaluation" / "quality"))

import quality_meshes  # noqa: E402
import scaling_meshes  # noqa: E402
import shapes  # noqa: E402


def terrain(cells=40, seed=3):
    """A square of land: ridges of four sizes, each half as high as the one before."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1))
    height = np.zeros_like(x)
    for octave in range(4):
        for _ in range(3):
            wave, phase = random.normal(size=2) * 4 * 2**octave, random.uniform(0, 2 * np.pi)
            height += 0.02 / 2**octave * np.abs(np.sin(wave[0] * x + wave[1] * y + phase))
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    return shapes.of_polygons("terrain", np.stack([x, y, height], axis=-1).reshape(-1, 3), quads)


def vase(segments=40, rings=24):
    """A turned vase with a wall: outside, lip and inside in one profile, closed at the bottom on both sides."""
    t = np.linspace(0, np.pi, rings)
    outside = np.stack([0.35 + 0.25 * np.sin(1.4 * t) + 0.05 * np.cos(3 * t), 0.5 * t], axis=1)
    profile = np.concatenate([outside, outside[::-1] - (0.06, 0.0)])
    profile[rings:, 1] = np.maximum(profile[rings:, 1], 0.08)
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    round_ = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rows = [np.column_stack([radius * round_, np.full(segments, height)]) for radius, height in profile]
    positions = np.concatenate([*rows, [[0, 0, 0], [0, 0, 0.08]]])
    here = np.arange(segments)
    then = (here + 1) % segments
    quads = [
        np.stack(
            [row * segments + here, row * segments + then, (row + 1) * segments + then, (row + 1) * segments + here], 1
        )
        for row in range(len(profile) - 1)
    ]
    bottom, floor = len(positions) - 2, len(positions) - 1
    last = (len(profile) - 1) * segments
    polygons = [*np.concatenate(quads), *([bottom, b, a] for a, b in zip(here, then, strict=True))]
    polygons += [[floor, last + a, last + b] for a, b in zip(here, then, strict=True)]
    return shapes.of_polygons("vase", positions, polygons)


def box(low, high):
    """Corners and sides of a box, the sides outwards."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.where(corners, high, low).astype(float), np.array(sides)


def table():
    """A table of five boxes beside each other, none joined with another."""
    legs = [((x, y, 0), (x + 0.08, y + 0.08, 0.7)) for x in (0.04, 1.48) for y in (0.04, 0.68)]
    return joined("table", [box(*of_leg) for of_leg in legs] + [box((0, 0, 0.7), (1.6, 0.8, 0.76))])


def barrel(segments=24):
    """A barrel of staves with two lids, of few and long quads."""
    height = np.array([0.0, 0.12, 0.5, 0.88, 1.0])
    radius = 0.36 + 0.09 * np.sin(np.pi * height)
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rows = [
        np.stack([r * np.cos(angle), r * np.sin(angle), 0 * angle + z], 1) for r, z in zip(radius, height, strict=True)
    ]
    here = np.arange(segments)
    then = (here + 1) % segments
    staves = [
        np.stack([k * segments + here, k * segments + then, (k + 1) * segments + then, (k + 1) * segments + here], 1)
        for k in range(len(height) - 1)
    ]
    lids = [here[::-1], (len(height) - 1) * segments + here]
    return shapes.of_polygons("barrel", np.concatenate(rows), [*np.concatenate(staves), *lids])


def soup(count=160, seed=5):
    """Triangles through each other that share vertices at random: edges of one face, of two and of many."""
    random = np.random.default_rng(seed)
    positions = random.random((count // 2, 3))
    triangles = [random.choice(len(positions), 3, replace=False) for _ in range(count)]
    return shapes.of_polygons("soup", positions, triangles)


def joined(name, parts):
    """One mesh of several (positions, polygons), not joined to each other."""
    first = np.cumsum([0, *(len(positions) for positions, _ in parts)])
    polygons = [polygon + start for (_, sides), start in zip(parts, first[:-1], strict=True) for polygon in sides]
    return shapes.of_polygons(name, np.concatenate([positions for positions, _ in parts]), polygons)


# Kind and name of each -> function, as a mesh is made when its turn comes.
DOZEN = {
    "sculpt": lambda: scaling_meshes.sculpt(3_000),
    "skull": lambda: shapes.skull(0.1),
    "goblin": lambda: shapes.goblin(0.1),
    "cat": lambda: shapes.cat(0.1),
    "drilled plate": lambda: quality_meshes.drilled_plate(0.1),
    "gear": lambda: quality_meshes.gear(0.09),
    "spring": lambda: quality_meshes.spring(0.12),
    "table": table,
    "vase": vase,
    "barrel": barrel,
    "soup": soup,
    "terrain": terrain,
}
