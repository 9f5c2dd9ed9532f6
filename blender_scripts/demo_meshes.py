"""The meshes of the demonstration, generated."""

import math

import bpy
import numpy as np

SCULPT_CELLS = 96  # quads along a side of each of the six patches: 55,296 in all


def add_mesh(name, positions, faces):
    """A new object in the scene from (n, 3) positions and a list or array of faces; it becomes the active one."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(positions, float).tolist(), [], [list(map(int, face)) for face in faces])
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


def suzanne():
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.object
    for layer in list(obj.data.uv_layers):  # it comes with UVs of its own
        obj.data.uv_layers.remove(layer)
    return obj


def spiral_ramp(turns=2.0, steps=120, rise=0.01):
    """A ramp that winds above itself: seen from above, its turns cover each other, which no projection can tell."""
    angle = np.linspace(0.0, 2 * math.pi * turns, steps + 1)
    height = rise * np.arange(steps + 1)
    rim = [np.stack([r * np.cos(angle), r * np.sin(angle), height], axis=1) for r in (0.5, 1.0)]
    positions = np.concatenate(rim)
    low = np.arange(steps)
    faces = np.stack([low, low + steps + 1, low + steps + 2, low + 1], axis=1)
    return add_mesh("Spiral ramp", positions, faces)


def sculpt(cells=SCULPT_CELLS, seed=7):
    """A closed quad mesh of 6·cells² faces, of the kind a sculptor makes: a body with horns, dents and ripples."""
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
    shape = positions * radius[:, None] * (1.0, 0.85, 1.15)
    obj = add_mesh("Sculpt", shape, faces)
    obj.data.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    return obj


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
