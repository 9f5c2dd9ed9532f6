"""The surfaces of the paper's figures, generated, and meshes read from OBJ files.

Their models (a face, a skull, a goblin, a cat, the camel's head) are not public or not ours to hand on, so there are
look-alikes here: of the same kind and size, with the same difficulties. Every mesh is a `Mesh` of polygons as corner
lists.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Mesh:
    """Polygons as flat arrays, as the native module takes them."""

    name: str
    positions: np.ndarray
    corner_vertices: np.ndarray
    face_offsets: np.ndarray
    view: tuple = (0.62, -1.0, 0.42)  # where the camera stands, seen from the model

    @property
    def arrays(self):
        return self.positions, self.corner_vertices, self.face_offsets

    def polygons(self):
        """The corners of every face, as a list of arrays."""
        return np.split(self.corner_vertices, self.face_offsets[1:-1])

    def corner_triangles(self):
        """Corners of a fan of triangles a face, (t, 3)."""
        sizes = np.diff(self.face_offsets)
        parts = []
        for size in np.unique(sizes):
            corner = self.face_offsets[:-1][sizes == size][:, None] + np.arange(size)
            parts += [corner[:, [0, k, k + 1]] for k in range(1, size - 1)]
        return np.concatenate(parts).astype(np.int32)

    def triangles(self):
        """Vertices of the same triangles."""
        return self.corner_vertices[self.corner_triangles()]

    def part(self, faces, name):
        """Some of the faces as a mesh of their own; a mask or indices."""
        faces = np.flatnonzero(faces) if np.asarray(faces).dtype == bool else np.asarray(faces)
        polygons = self.polygons()
        chosen = [polygons[f] for f in faces]
        used, corners = np.unique(np.concatenate(chosen), return_inverse=True)
        offsets = np.concatenate([[0], np.cumsum([len(p) for p in chosen])])
        corners, offsets = corners.reshape(-1).astype(np.int32), offsets.astype(np.int32)
        return Mesh(name, self.positions[used], corners, offsets, self.view)


def of_polygons(name, positions, polygons, **more):
    """A mesh of positions and a list (or an array) of polygons."""
    sizes = [len(p) for p in polygons]
    corners = np.concatenate([np.asarray(p) for p in polygons]).astype(np.int32)
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    return Mesh(name, np.asarray(positions, float), corners, offsets, **more)


def read_obj(path):
    """The polygons of an OBJ file; everything else in it is left out."""
    positions, polygons = [], []
    with Path(path).open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if words[:1] == ["v"]:
                positions.append([float(x) for x in words[1:4]])
            elif words[:1] == ["f"]:
                index = [int(word.split("/")[0]) for word in words[1:]]
                polygons.append([i - 1 if i > 0 else len(positions) + i for i in index])
    return of_polygons(Path(path).stem, positions, polygons)


# Patches: one chart each, about 1,000 vertices ------------------------------------------------------------------------


def _grid(name, columns, rows, place, **more):
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    positions = np.stack(np.broadcast_arrays(*place(u, v)), axis=-1).reshape(-1, 3)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    quads = first[:, None] + [0, 1, columns + 2, columns + 1]
    return of_polygons(name, positions, quads, **more)


def _disc(rings):
    """Radius in [0, 1], angle and triangles of a disc of rings, the k-th with 6k points."""
    radius, angle, triangles, start = [0.0], [0.0], [], [0, 1]
    for ring in range(1, rings + 1):
        radius += [ring / rings] * (6 * ring)
        angle += list(2 * np.pi * np.arange(6 * ring) / (6 * ring))
        start.append(start[-1] + 6 * ring)
        for sector in range(6):
            for k in range(ring):
                outer = [start[ring] + (sector * ring + k + d) % (6 * ring) for d in (0, 1)]
                inner = [start[ring - 1] + (sector * (ring - 1) + k + d) % max(6 * (ring - 1), 1) for d in (0, 1)]
                triangles.append([outer[0], outer[1], inner[0]])
                if k < ring - 1:
                    triangles.append([inner[0], outer[1], inner[1]])
    return np.array(radius), np.array(angle), np.array(triangles)


def face(cells=31):
    """A face of about 1,000 vertices: brows, eye sockets, a nose that overhangs, lips and a chin on an oval dome."""

    def place(u, v):
        s, t = 2 * u - 1, 2 * v - 1
        x, y = s * np.sqrt(1 - t * t / 2), t * np.sqrt(1 - s * s / 2)  # a square to a disc

        def bump(cx, cy, wx, wy):
            return np.exp(-(((x - cx) / wx) ** 2) - ((y - cy) / wy) ** 2)

        def pair(cx, cy, wx, wy):
            return bump(cx, cy, wx, wy) + bump(-cx, cy, wx, wy)

        dome = 0.75 * np.sqrt(1 - 0.8 * (x * x + y * y))
        nose = 0.34 * bump(0, -0.1, 0.13, 0.16) + 0.16 * bump(0, 0.15, 0.09, 0.25)
        relief = 0.10 * pair(0.3, 0.38, 0.28, 0.1) - 0.16 * pair(0.33, 0.2, 0.17, 0.11)
        relief += 0.05 * pair(0.35, -0.1, 0.2, 0.2) + 0.09 * bump(0, -0.42, 0.25, 0.05)
        relief += 0.08 * bump(0, -0.54, 0.22, 0.05) - 0.06 * bump(0, -0.48, 0.27, 0.03)
        relief += 0.1 * bump(0, -0.78, 0.25, 0.14)
        # Upright: y up, the nose towards the viewer at -y.
        return 0.8 * x, -(dome + nose + relief), y - 0.35 * nose

    return _grid("face", cells, cells, place, view=(0.5, -1.0, 0.16))


def hemisphere(rings=18):
    radius, angle, triangles = _disc(rings)
    theta = radius * np.pi / 2
    points = np.stack([np.sin(theta) * np.cos(angle), np.sin(theta) * np.sin(angle), np.cos(theta)], axis=1)
    return of_polygons("hemisphere", points, triangles, view=(0.3, -1.0, 0.9))


def camel_head(rings=18):
    """The upper side of a head with a long muzzle, ears and eye sockets: far from developable, yet one chart."""
    radius, angle, triangles = _disc(rings)
    theta = radius * np.pi / 2
    d = np.stack([np.sin(theta) * np.cos(angle), np.sin(theta) * np.sin(angle), np.cos(theta)], axis=1)

    def bump(direction, width):
        direction = np.array(direction, float) / np.linalg.norm(direction)
        return np.exp((d @ direction - 1) / width)

    size = 1 + 0.5 * bump((0.25, 0, 1), 0.2)
    size += 0.15 * (bump((-0.75, 0.55, 0.35), 0.04) + bump((-0.75, -0.55, 0.35), 0.04))
    size -= 0.08 * (bump((-0.1, 0.75, 0.6), 0.03) + bump((-0.1, -0.75, 0.6), 0.03))
    points = d * size[:, None] * (0.95, 0.8, 1.0)
    # The muzzle, up to here along z, points forward (-y).
    points = np.stack([points[:, 1], -points[:, 2], -points[:, 0]], axis=1)
    return of_polygons("camel head", points, triangles, view=(0.8, -1.0, 0.35))


def l_shape(cells=20):
    mesh = _grid("L shape", 2 * cells, 2 * cells, lambda u, v: (2 * u, 2 * v, 0 * u))
    polygons = np.array(mesh.polygons())
    centre = mesh.positions[polygons].mean(axis=1)
    return mesh.part(~((centre[:, 0] > 1) & (centre[:, 1] > 1)), "L shape")


def rectangle(cells=18):
    return _grid("rectangle 3:1", 3 * cells, cells, lambda u, v: (3 * u, v, 0 * u))


def patches():
    return [face(), hemisphere(), camel_head(), l_shape(), rectangle()]


def largest_half(mesh, name):
    """The faces on the side of the larger x of the middle of a mesh: of a symmetric head, a half that is one chart."""
    centre = np.array([mesh.positions[p].mean(axis=0) for p in mesh.polygons()])
    middle = (mesh.positions[:, 0].min() + mesh.positions[:, 0].max()) / 2
    return largest_piece(mesh.part(centre[:, 0] > middle, name), name)


def largest_piece(mesh, name):
    """The faces of the component with most of them, by shared vertices."""
    label = np.arange(len(mesh.positions))
    first = np.repeat(mesh.corner_vertices[mesh.face_offsets[:-1]], np.diff(mesh.face_offsets))
    while True:  # labels sink along faces and to their own labels: some log n rounds
        lowest = label.copy()
        np.minimum.at(lowest, first, label[mesh.corner_vertices])
        np.minimum.at(lowest, mesh.corner_vertices, lowest[first])
        lowest = lowest[lowest]
        if np.array_equal(lowest, label):
            break
        label = lowest
    of_face = label[mesh.corner_vertices[mesh.face_offsets[:-1]]]
    names, count = np.unique(of_face, return_counts=True)
    return mesh.part(of_face == names[count.argmax()], name)


# Complex models: closed surfaces out of a distance field -------------------------------------------------------------


def surface_net(name, distance, low, high, cell, **more):
    """The zero surface of a function as nearly square quads, its largest piece; manifold."""
    for attempt in range(16):
        # Once in a while two sheets of the net meet in one cell; a shifted grid parts them.
        mesh = _surface_net(name, distance, np.asarray(low, float) - 0.137 * attempt * cell, high, cell, **more)
        edges = np.concatenate([np.stack([p, np.roll(p, -1)], axis=1) for p in mesh.polygons()])
        if len(np.unique(edges, axis=0)) == len(edges):
            break
    return mesh


def _surface_net(name, distance, low, high, cell, **more):
    """A vertex a mixed cell, at the mean of the crossings of its edges; a quad an edge that the surface crosses."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    count = np.ceil((high - low) / cell).astype(int) + 1
    axes = [low[k] + cell * np.arange(count[k]) for k in range(3)]
    value = distance(*np.meshgrid(*axes, indexing="ij"))
    inside = value < 0
    cells = tuple(count - 1)
    crossings, total = np.zeros(cells), np.zeros((*cells, 3))
    for axis in range(3):
        a, b = (tuple(slice(s, count[k] - 1 + s) if k == axis else slice(None) for k in range(3)) for s in (0, 1))
        change = inside[a] != inside[b]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(change, value[a] / (value[a] - value[b]), 0.0)
        others = [k for k in range(3) if k != axis]
        for shift in ((0, 0), (0, 1), (1, 0), (1, 1)):
            view = [slice(None)] * 3
            offset = np.zeros(3)
            for k, s in zip(others, shift, strict=True):
                view[k] = slice(s, count[k] - 1 + s)
                offset[k] = s
            here, where = change[tuple(view)], share[tuple(view)]
            crossings += here
            for k in range(3):
                total[..., k] += here * (where if k == axis else offset[k])
    mixed = crossings > 0
    index = np.cumsum(mixed).reshape(cells) - 1
    base = np.stack(np.nonzero(mixed), axis=1)
    points = low + cell * (base + total[mixed] / crossings[mixed][:, None])
    quads = []
    for axis in range(3):
        a, b = (tuple(slice(s, count[k] - 1 + s) if k == axis else slice(None) for k in range(3)) for s in (0, 1))
        change = inside[a] != inside[b]
        second, third = (axis + 1) % 3, (axis + 2) % 3
        at = np.stack(np.nonzero(change), axis=1)
        at = at[(at[:, [second, third]] > 0).all(axis=1)]
        at = at[(at[:, second] < cells[second]) & (at[:, third] < cells[third])]
        around = [(0, 0), (1, 0), (1, 1), (0, 1)]
        corner = []
        for s, t in around:
            place = at.copy()
            place[:, second] += s - 1
            place[:, third] += t - 1
            corner.append(index[tuple(place.T)])
        quad = np.stack(corner, axis=1)
        leaving = inside[a][tuple(at.T)]
        quads.append(np.where(leaving[:, None], quad, quad[:, ::-1]))
    return largest_piece(of_polygons(name, points, np.concatenate(quads), **more), name)


def _capsule(x, y, z, a, b, ra, rb):
    a, b = np.asarray(a, float), np.asarray(b, float)
    along = b - a
    t = np.clip(((x - a[0]) * along[0] + (y - a[1]) * along[1] + (z - a[2]) * along[2]) / (along @ along), 0, 1)
    away = np.sqrt((x - a[0] - t * along[0]) ** 2 + (y - a[1] - t * along[1]) ** 2 + (z - a[2] - t * along[2]) ** 2)
    return away - (ra + t * (rb - ra))


def _ball(x, y, z, centre, radii):
    """About the distance to an ellipsoid."""
    radii = np.broadcast_to(np.asarray(radii, float), 3)
    scaled = np.sqrt(sum(((p - c) / r) ** 2 for p, c, r in zip((x, y, z), centre, radii, strict=True)))
    return (scaled - 1) * radii.min()


def _join(a, b, blend):
    h = np.maximum(blend - np.abs(a - b), 0) / blend
    return np.minimum(a, b) - 0.25 * blend * h * h


def _carve(a, b, blend):
    return -_join(-a, b, blend)


def _pair(x, shape):
    """A shape at |x|: left and right at once."""
    return shape(np.abs(x))


def cat(cell=0.045):
    """A sitting cat: body, head with pointed ears, four legs and a tail."""

    def distance(x, y, z):
        d = _capsule(x, y, z, (0, 0.25, -0.45), (0, -0.1, 0.25), 0.5, 0.33)
        d = _join(d, _ball(x, y, z, (0, -0.28, 0.75), (0.33, 0.3, 0.28)), 0.18)
        d = _join(d, _ball(x, y, z, (0, -0.54, 0.68), (0.15, 0.12, 0.1)), 0.1)
        d = _join(d, _pair(x, lambda s: _capsule(s, y, z, (0.19, -0.2, 0.95), (0.27, -0.16, 1.22), 0.11, 0.03)), 0.06)
        d = _join(d, _pair(x, lambda s: _capsule(s, y, z, (0.2, -0.25, 0.1), (0.2, -0.42, -0.85), 0.15, 0.1)), 0.1)
        d = _join(d, _pair(x, lambda s: _ball(s, y, z, (0.21, -0.5, -0.88), (0.12, 0.2, 0.09))), 0.06)
        d = _join(d, _pair(x, lambda s: _ball(s, y, z, (0.38, 0.12, -0.55), (0.22, 0.4, 0.36))), 0.12)
        d = _join(d, _pair(x, lambda s: _ball(s, y, z, (0.4, -0.25, -0.87), (0.13, 0.26, 0.1))), 0.08)
        d = _join(d, _capsule(x, y, z, (0, 0.6, -0.75), (0.45, 0.85, -0.82), 0.12, 0.1), 0.1)
        return _join(d, _capsule(x, y, z, (0.45, 0.85, -0.82), (0.8, 0.5, -0.84), 0.1, 0.07), 0.06)

    return surface_net("cat", distance, (-0.85, -1, -1.15), (1.0, 1.1, 1.4), cell, view=(0.7, -1.0, 0.35))


def skull(cell=0.042):
    """A skull: cranium, eye sockets, nose opening, cheekbones, jaw with a row of teeth."""

    def distance(x, y, z):
        d = _ball(x, y, z, (0, 0.12, 0.3), (0.62, 0.78, 0.62))
        d = _join(d, _ball(x, y, z, (0, -0.42, -0.12), (0.42, 0.34, 0.4)), 0.2)
        d = _join(d, _ball(x, y, z, (0, -0.5, -0.52), (0.32, 0.26, 0.22)), 0.12)
        d = _join(d, _pair(x, lambda s: _capsule(s, y, z, (0.36, -0.55, -0.12), (0.55, -0.1, -0.02), 0.1, 0.08)), 0.08)
        d = _carve(d, _pair(x, lambda s: _ball(s, y, z, (0.24, -0.8, 0.1), (0.17, 0.3, 0.15))), 0.08)
        d = _carve(d, _ball(x, y, z, (0, -0.85, -0.2), (0.1, 0.22, 0.14)), 0.06)
        teeth = 0.02 * np.sin(34 * x) * np.exp(-(((z + 0.5) / 0.09) ** 2)) * (y < -0.45)
        groove = 0.03 * np.exp(-(((z + 0.5) / 0.025) ** 2)) * (y < -0.4)
        return d + teeth + groove

    return surface_net("skull", distance, (-0.85, -1.0, -0.95), (0.85, 1.05, 1.1), cell, view=(0.55, -1.0, 0.12))


def goblin(cell=0.042):
    """A goblin's bust: long ears, hooked nose, brow, chin, shoulders."""

    def distance(x, y, z):
        d = _ball(x, y, z, (0, 0, 0.35), (0.5, 0.52, 0.55))
        d = _join(d, _capsule(x, y, z, (0, 0.1, -0.1), (0, 0.12, -0.55), 0.24, 0.3), 0.15)
        d = _join(d, _ball(x, y, z, (0, 0.15, -0.78), (0.85, 0.42, 0.3)), 0.2)
        ears = _pair(x, lambda s: _capsule(s, y, z, (0.42, 0.05, 0.4), (1.05, 0.25, 0.72), 0.17, 0.03))
        d = _join(d, ears, 0.1)
        d = _carve(d, _pair(x, lambda s: _capsule(s, y, z, (0.58, -0.12, 0.45), (0.9, 0.05, 0.62), 0.09, 0.02)), 0.06)
        d = _join(d, _capsule(x, y, z, (0, -0.48, 0.42), (0, -0.78, 0.16), 0.13, 0.08), 0.08)
        d = _join(d, _pair(x, lambda s: _capsule(s, y, z, (0.06, -0.47, 0.55), (0.34, -0.36, 0.64), 0.1, 0.07)), 0.08)
        d = _carve(d, _pair(x, lambda s: _ball(s, y, z, (0.2, -0.55, 0.43), 0.1)), 0.06)
        d = _join(d, _capsule(x, y, z, (-0.08, -0.44, -0.08), (0.08, -0.44, -0.08), 0.15, 0.15), 0.12)
        mouth = 0.04 * np.exp(-(((z - 0.03) / 0.03) ** 2)) * (y < -0.3) * (np.abs(x) < 0.32)
        return d + mouth

    return surface_net("goblin", distance, (-1.25, -1.0, -1.25), (1.25, 0.9, 1.1), cell, view=(0.5, -1.0, 0.18))


def complex_models(cell=None):
    """Of some 6,000 faces each, or in cells of a given size."""
    return [make(cell) if cell else make() for make in (skull, goblin, cat)]
