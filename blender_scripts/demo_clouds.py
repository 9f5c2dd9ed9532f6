"""The point cloud of the demonstration, generated: three things as a scanner leaves them, points without faces."""

import bpy
import demo_meshes
import numpy as np

SPACING = 0.016  # edge of the voxels of which each keeps one point, as scans are thinned out
SAMPLES_PER_VOXEL = 6  # random points drawn for one that is kept, so that few voxels of the surface stay empty


def scan(spacing=SPACING, seed=3):
    """Points of a mask, a rolled sheet and a vase, (n, 3): some 50,000 at the usual spacing."""
    random = np.random.default_rng(seed)
    # In a row across the view of render.py.
    parts = [
        sampled(mask, (-1, 1), (-1, 1), spacing, random) @ turn(0.55).T,
        sampled(vase, (0, 1), (0, 1), spacing, random) @ turn(0.4).T + (1.05, 0.65, -0.8),
        sampled(roll, (0, 1), (0, 1), spacing, random) @ turn(0.2).T + (2.15, 1.33, -0.25),
    ]
    return np.concatenate(parts)


def turn(angle):
    """Rotation about the vertical."""
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def add_scan(name="Scan", spacing=SPACING, seed=3):
    """The points as a mesh of vertices alone, which is what the import of a scan gives."""
    points = scan(spacing, seed)
    obj = demo_meshes.add_mesh(name, np.zeros((0, 3)), [])
    obj.data.vertices.add(len(points))
    obj.data.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
    obj.data.update()
    bpy.context.view_layer.update()
    return obj


def mask(u, v):
    """A face-like relief over an oval, its front towards -y."""
    x, z = 0.72 * u * np.sqrt(1 - 0.42 * v * v), 0.95 * v * np.sqrt(1 - 0.42 * u * u)

    def bump(x0, z0, width, height, tall=1.0):
        return height * np.exp(-(((x - x0) / width) ** 2) - ((z - z0) / (width * tall)) ** 2)

    depth = 0.62 * np.sqrt(np.maximum(1.02 - (x / 0.82) ** 2 - (z / 1.12) ** 2, 0.05))
    depth = depth + bump(0, -0.02, 0.13, 0.26, 2.0) + bump(0, -0.42, 0.2, 0.07, 0.45) + bump(0, -0.72, 0.2, 0.09)
    for side in (-0.27, 0.27):
        depth = depth - bump(side, 0.22, 0.14, 0.13, 0.75) + bump(side, 0.4, 0.19, 0.05, 0.4)
        depth = depth + bump(1.25 * side, -0.2, 0.2, 0.05)
    return np.stack([x, -depth, z], axis=1)


def roll(u, v):
    """A sheet that is rolled up one and a half times: near in space is not near on the sheet."""
    angle = 2 * np.pi * (0.25 + 1.5 * u)
    radius = 0.16 + 0.105 * angle / np.pi
    return np.stack([radius * np.cos(angle), 1.3 * (v - 0.5), radius * np.sin(angle)], axis=1)


def vase(u, v):
    """A round vase with an open top and no bottom."""
    angle, height = 2 * np.pi * u, 1.1 * v
    radius = 0.3 + 0.13 * np.sin(2.1 * np.pi * v + 0.5) + 0.02 * np.sin(6 * angle) * np.sin(np.pi * v)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def sampled(surface, u_range, v_range, spacing, random):
    """Points of a parametric surface at about one density: drawn by area, one kept in every voxel that has any."""
    cells = 256
    u, v = (
        grid.reshape(-1)
        for grid in np.meshgrid(np.linspace(*u_range, cells + 1)[:-1], np.linspace(*v_range, cells + 1)[:-1])
    )
    du, dv = ((high - low) / cells for low, high in (u_range, v_range))
    here = surface(u, v)
    area = np.linalg.norm(np.cross(surface(u + du, v) - here, surface(u, v + dv) - here), axis=1)
    count = int(SAMPLES_PER_VOXEL * area.sum() / spacing**2)
    cell = random.choice(len(area), count, p=area / area.sum())
    points = surface(u[cell] + du * random.random(count), v[cell] + dv * random.random(count))
    voxel = np.floor(points / spacing).astype(np.int64)
    off_centre = ((points / spacing - voxel - 0.5) ** 2).sum(axis=1)
    order = np.lexsort((off_centre, *voxel.T))
    sorted_voxels = voxel[order]
    first = np.ones(count, bool)
    first[1:] = (sorted_voxels[1:] != sorted_voxels[:-1]).any(axis=1)
    return points[order[first]]
