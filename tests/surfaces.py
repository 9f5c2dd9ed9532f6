"""Triangulated surfaces whose distances are known, or can be had from an exact algorithm: positions and triangles."""

import numpy as np
from scipy.spatial import Delaunay


def as_mesh(positions, triangles):
    """The three arrays the native module takes."""
    triangles = np.ascontiguousarray(triangles, dtype=np.int32)
    return positions, triangles.ravel(), np.arange(0, triangles.size + 1, 3, dtype=np.int32)


def edge_lengths(positions, triangles):
    return np.linalg.norm(positions[triangles] - positions[np.roll(triangles, 1, axis=1)], axis=-1)


def obtuse_share(positions, triangles):
    """Share of the triangles with an angle of more than a right one."""
    squares = np.sort(edge_lengths(positions, triangles) ** 2, axis=1)
    return np.mean(squares[:, 2] > squares[:, 0] + squares[:, 1])


def scattered(count, width, height, seed):
    """Points of a rectangle, evenly spread but in no order, and their Delaunay triangles."""
    rng = np.random.default_rng(seed)
    spacing = np.sqrt(width * height / count)
    columns, rows = max(2, round(width / spacing)), max(2, round(height / spacing))
    x, y = np.meshgrid(np.arange(columns + 1) * width / columns, np.arange(rows + 1) * height / rows)
    inside = (x > 0) & (x < width) & (y > 0) & (y < height)
    jitter = 0.35 * spacing * rng.uniform(-1, 1, (2, *x.shape)) * inside
    points = np.stack([x + jitter[0], y + jitter[1]], axis=-1).reshape(-1, 2)
    triangles = Delaunay(points).simplices
    # Jittered points of the border are on it, but slivers between them are not wanted.
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return points, triangles[np.abs(area) > 1e-9 * width * height]


def plane(count=2000, seed=1):
    points, triangles = scattered(count, 3.0, 2.0, seed)
    return np.column_stack([points, 0 * points[:, 0]]), triangles


def hills(count=2000, seed=2, stretch=1.0):
    """A sheet with hills and hollows, open at the border. Stretched along y, nearly all its triangles are slivers."""
    points, triangles = scattered(count, 3.0, 2.0, seed)
    x, y = points.T
    z = 0.35 * np.sin(2.1 * x) * np.cos(3.3 * y) + 0.1 * np.sin(5 * x + 2)
    return np.column_stack([x, stretch * y, z]), triangles


def icosphere(levels):
    """The regular icosahedron, its triangles quartered so many times, on the unit sphere."""
    golden = (1 + 5**0.5) / 2
    corners = [[s, t * golden, 0] for s in (-1, 1) for t in (-1, 1)]
    positions = np.array([np.roll(c, shift) for shift in range(3) for c in corners])
    distance = np.linalg.norm(positions[:, None] - positions[None], axis=-1)
    triangles = [
        [i, j, k]
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if max(distance[i, j], distance[j, k], distance[i, k]) < 2.1
    ]
    triangles = np.array([t if np.linalg.det(positions[t]) > 0 else t[::-1] for t in triangles])
    for _ in range(levels):
        sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, middle = np.unique(sides, axis=0, return_inverse=True)
        a, b, c = triangles.T
        ab, bc, ca = len(positions) + middle.reshape(-1, 3).T
        triangles = np.concatenate([np.stack(t, axis=1) for t in ([a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca])])
        positions = np.concatenate([positions, positions[unique].mean(axis=1)])
    return positions / np.linalg.norm(positions, axis=1, keepdims=True), triangles


def on_sphere(positions, source):
    """Distances along the unit sphere."""
    return 2 * np.arcsin(np.clip(np.linalg.norm(positions - positions[source], axis=1) / 2, 0, 1))


def cylinder(segments, rows, height=3.0):
    """An open tube of radius 1 around z, its vertices on the round cylinder; every other row turned by half a step."""
    row, column = np.mgrid[0 : rows + 1, 0:segments]
    angle = (column + 0.5 * (row % 2)) * 2 * np.pi / segments
    positions = np.stack([np.cos(angle), np.sin(angle), row * height / rows], axis=-1).reshape(-1, 3)
    triangles = []
    for r in range(rows):
        here, above = r * segments, (r + 1) * segments
        for s in range(segments):
            t = (s + 1) % segments
            if r % 2 == 0:
                triangles += [[here + s, here + t, above + s], [here + t, above + t, above + s]]
            else:
                triangles += [[here + s, here + t, above + t], [here + s, above + t, above + s]]
    return positions, np.array(triangles)


def on_cylinder(positions, source):
    """Distances along the round cylinder of radius 1."""
    angle = np.arctan2(positions[:, 1], positions[:, 0])
    turn = np.abs(angle - angle[source])
    return np.hypot(np.minimum(turn, 2 * np.pi - turn), positions[:, 2] - positions[source, 2])


def torus(segments, sides, tube=0.4):
    """A ring of radius 1 around z, triangulated in rows and columns."""
    i, j = np.mgrid[0:segments, 0:sides]
    around, about = 2 * np.pi * i / segments, 2 * np.pi * (j + 0.5 * (i % 2)) / sides
    radius = 1 + tube * np.cos(about)
    positions = np.stack([radius * np.cos(around), radius * np.sin(around), tube * np.sin(about)], axis=-1)
    triangles = []
    at = lambda i, j: (i % segments) * sides + j % sides  # noqa: E731
    for i in range(segments):
        for j in range(sides):
            if i % 2 == 0:
                triangles += [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]]
            else:
                triangles += [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    return positions.reshape(-1, 3), np.array(triangles)


def load_obj(path):
    """Positions and polygons, cut into fans, of a Wavefront file."""
    positions, triangles = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
            triangles += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return np.array(positions), np.array(triangles)
