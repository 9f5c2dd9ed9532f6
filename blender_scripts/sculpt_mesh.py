"""The sculpt of the demonstration as arrays, by NumPy alone: benchmarks have use for it without Blender."""

import math

import numpy as np


def sculpt_arrays(cells, seed=7):
    """Positions and 6·cells² quads of a closed mesh of the kind a sculptor makes: horns, dents and ripples."""
    positions, faces = cube_sphere(cells)
    random = np.random.default_rng(seed)
    radius = np.ones(len(positions))
    horns = random.normal(size=(9, 3))
    horns /= np.linalg.norm(horns, axis=1)[:, None]
    for direction, width, height in zip(
        horns, random.uniform(0.02, 0.07, 9), (1.5, 1.3, 1.1, 0.9, 0.7, -0.3, -0.35, 0.5, -0.25), strict=True
    ):
        radius += height * np.exp((positions @ direction - 1.0) / width)
    for octave in range(5):
        frequency, strength = 2.0 * 1.9**octave, 0.09 / 1.8**octave
        waves = random.normal(size=(6, 3)) * frequency
        phases = random.uniform(0, 2 * math.pi, 6)
        radius += strength * np.sin(positions @ waves.T + phases).sum(axis=1) / math.sqrt(6)
    return positions * radius[:, None] * (1.0, 0.85, 1.15), faces


def cube_sphere(cells):
    """Unit sphere of six gridded patches, joined along their sides."""
    t = np.tan(np.linspace(-math.pi / 4, math.pi / 4, cells + 1))  # equal angles give even cells
    u, v = (grid.reshape(-1) for grid in np.meshgrid(t, t, indexing="ij"))
    one = np.ones_like(u)
    patches = [(u, v, one), (v, u, -one), (one, u, v), (-one, v, u), (v, one, u), (u, -one, v)]
    points = np.concatenate([np.stack(patch, axis=1) for patch in patches])
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads + number * len(u) for number in range(6)])
    # The patches share exact coordinates along their sides, up to the last bits of the tangent.
    _, first, index = np.unique(np.round(points * 2**20), axis=0, return_index=True, return_inverse=True)
    points = points[first]
    return points / np.linalg.norm(points, axis=1)[:, None], index.reshape(-1)[faces]
