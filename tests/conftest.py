"""Meshes as plain arrays, for tests that need no Blender.

Those that do are in tests/blender and tests/gui, and run in its Python.
"""

import numpy as np
import pytest

collect_ignore = ["blender", "gui"]


def grid(columns, rows, height=lambda x, y: 0.0 * x):
    """A sheet of quads over the unit square, with z = height(x, y): positions, corner_vertices, face_offsets."""
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    positions = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    corners = (first[:, None] + [0, 1, columns + 2, columns + 1]).astype(np.int32).ravel()
    return positions, corners, np.arange(0, len(corners) + 1, 4, dtype=np.int32)


def sphere(segments, rings):
    """A closed sphere of radius 1: triangles at the poles, quads between."""
    theta = np.linspace(0, np.pi, rings + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    ring = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1)
    positions = np.concatenate([[[0, 0, 1]], ring.reshape(-1, 3), [[0, 0, -1]]])
    last = len(positions) - 1
    faces = []
    for s in range(segments):
        t = (s + 1) % segments
        faces.append([0, 1 + s, 1 + t])
        for r in range(rings - 2):
            a, b = 1 + r * segments, 1 + (r + 1) * segments
            faces.append([a + s, b + s, b + t, a + t])
        a = 1 + (rings - 2) * segments
        faces.append([a + s, last, a + t])
    sizes = [len(f) for f in faces]
    corners = np.array([v for f in faces for v in f], dtype=np.int32)
    return positions, corners, np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)


@pytest.fixture
def square():
    """One quad."""
    return grid(1, 1)


@pytest.fixture
def hill():
    """A sheet with a bump, 400 quads: one chart."""
    return grid(20, 20, lambda x, y: 0.3 * np.exp(-12 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)))


@pytest.fixture
def ball():
    """A closed sphere of 384 faces: several charts."""
    return sphere(24, 16)


@pytest.fixture(scope="session")
def large_ball():
    """A closed sphere of 16,384 faces: work for a while."""
    return sphere(128, 128)
