"""Pictures of generated surfaces for `make paper`: textured with a checker, with their charts in colours, or bare.

python blender_scripts/paper_render.py JOBS.json

JOBS.json is a list of {"mesh": FILE.npz, "picture": FILE.png, "view": [x, y, z], "size": [w, h], "samples": n,
"cells": checker fields a unit of the UVs}. The mesh holds positions (n, 3), corner_vertices (c,) and face_offsets
(f + 1,); uv (c, 2), if there, is shown as a checker; colours (f, 3), if there, tint the faces.
"""

import json
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader
import render

DARK = 0.5  # of the checker's dark fields, as a share of the light ones
BARE = (0.62, 0.66, 0.72)


def add_mesh(data):
    """The object of one job, with its UV map and the colours of its faces."""
    import bpy
    import numpy as np

    mesh = bpy.data.meshes.new("surface")
    corners, offsets = data["corner_vertices"], data["face_offsets"]
    mesh.vertices.add(len(data["positions"]))
    mesh.loops.add(len(corners))
    mesh.polygons.add(len(offsets) - 1)
    mesh.vertices.foreach_set("co", data["positions"].astype(np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", corners.astype(np.int32))
    mesh.polygons.foreach_set("loop_start", offsets[:-1].astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(offsets) - 1, bool))
    mesh.update(calc_edges=True)
    if "uv" in data:
        layer = mesh.uv_layers.new(name="map")
        layer.uv.foreach_set("vector", data["uv"].astype(np.float32).ravel())
    if "colours" in data:
        colours = mesh.attributes.new("tint", "FLOAT_COLOR", "FACE")
        rgba = np.concatenate([data["colours"], np.ones((len(offsets) - 1, 1))], axis=1)
        colours.data.foreach_set("color", rgba.astype(np.float32).ravel())
    obj = bpy.data.objects.new("surface", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def material(data, cells):
    """Matt; a checker through the UV map, in the colours of the faces where there are some."""
    import bpy

    made = bpy.data.materials.new("paper")
    if not made.use_nodes:  # always on from 5.0
        made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    surface = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    surface.inputs["Roughness"].default_value = 0.7
    colour = nodes.new("ShaderNodeRGB").outputs[0]
    colour.default_value = (*BARE, 1.0) if "uv" not in data else (0.8, 0.8, 0.8, 1.0)
    if "colours" in data:
        attribute = nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = "tint"
        colour = attribute.outputs["Color"]
    if "uv" in data:
        coordinates, checker = nodes.new("ShaderNodeUVMap"), nodes.new("ShaderNodeTexChecker")
        coordinates.uv_map = "map"
        checker.inputs["Scale"].default_value = cells
        checker.inputs["Color1"].default_value = (1.0, 1.0, 1.0, 1.0)
        checker.inputs["Color2"].default_value = (DARK**2, DARK**2, DARK**1.7, 1.0)
        links.new(coordinates.outputs["UV"], checker.inputs["Vector"])
        product = nodes.new("ShaderNodeVectorMath")
        product.operation = "MULTIPLY"
        links.new(colour, product.inputs[0])
        links.new(checker.outputs["Color"], product.inputs[1])
        colour = product.outputs[0]
    links.new(colour, surface.inputs["Base Color"])
    return made


def picture(job):
    import addon_utils
    import bpy
    import numpy as np

    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("cycles")
    with np.load(job["mesh"]) as stored:
        data = dict(stored)
    obj = add_mesh(data)
    obj.data.materials.append(material(data, job["cells"]))
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = job["samples"]
    scene.cycles.use_denoising = False
    scene.cycles.seed = 0
    scene.render.resolution_x, scene.render.resolution_y = job["size"]
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"
    render.VIEW_FROM = tuple(job["view"])
    camera = render.place_camera(scene, render.world_points([obj]), job["size"][0] / job["size"][1])
    key, world = render.place_lights(scene, camera)
    key.data.energy, key.data.angle = 2.6, math.radians(12)
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.9, 0.93, 1.0, 1.0)
    background.inputs["Strength"].default_value = 0.38
    scene.render.filepath = job["picture"]
    bpy.ops.render.render(write_still=True)


def main(argv):
    for job in json.loads(Path(argv[0]).read_text(encoding="utf-8")):
        picture(job)
    return 0


if __name__ == "__main__":
    addon_loader.run(main)
