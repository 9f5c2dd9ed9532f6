"""The meshes of the demonstration, generated."""

import math

import bpy
import numpy as np
import sculpt_mesh

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
    shape, faces = sculpt_mesh.sculpt_arrays(cells, seed)
    obj = add_mesh("Sculpt", shape, faces)
    obj.data.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    return obj
