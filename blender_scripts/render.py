"""A picture of a model with a numbered colour grid on its UVs, so that distortion and seams show.

blender -b -P blender_scripts/render.py -- IN -o PICTURE.png [--uv-map NAME] [--size 960 720] [--samples 32]
python blender_scripts/render.py IN -o PICTURE.png [...]

Rendered by Cycles on the processor: no graphics card and no screen are needed.
"""

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader
import render_points

FIELD_OF_VIEW = math.radians(30)
FILL = 0.92  # share of the picture that the model may take
VIEW_FROM = (0.62, -1.0, 0.42)  # where the camera stands, seen from the model
GRID_CELL_PIXELS = 128  # of Blender's colour grid, whatever the size of the image


def grid_material(uv_map, cells):
    """A matt material that shows Blender's numbered colour grid through a UV map."""
    import bpy

    side = cells * GRID_CELL_PIXELS
    image = bpy.data.images.new("BLE grid", side, side)
    image.generated_type = "COLOR_GRID"
    material = bpy.data.materials.new("BLE grid")
    if not material.use_nodes:  # always on from 5.0
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    surface.inputs["Roughness"].default_value = 0.6
    texture, coordinates = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeUVMap")
    texture.image = image
    coordinates.uv_map = uv_map
    links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    return material


def world_points(objects):
    """World positions of all vertices as they are rendered, (n, 3)."""
    import bpy
    import numpy as np

    graph = bpy.context.evaluated_depsgraph_get()
    clouds = []
    for obj in objects:
        if is_cloud(obj):
            clouds.append(render_points.world_points(obj))
            continue
        evaluated = obj.evaluated_get(graph)
        mesh = evaluated.to_mesh()
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        matrix = np.array(evaluated.matrix_world)
        clouds.append(points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
        evaluated.to_mesh_clear()
    points = np.concatenate(clouds)
    return points[np.isfinite(points).all(axis=1)]


def is_cloud(obj):
    return addon_loader.load("targets").is_cloud(obj)


def place_camera(scene, points, aspect, view=None):
    """A camera that sees all points as large as they fit; `view` is where it stands, seen from the model."""
    import bpy
    import mathutils
    import numpy as np

    backward = np.array(VIEW_FROM if view is None else view, float)
    backward /= np.linalg.norm(backward)
    right = np.cross((0.0, 0.0, 1.0), backward)
    right /= np.linalg.norm(right)
    up = np.cross(backward, right)
    frame = np.stack([right, up, backward])
    tangent = np.array([math.tan(FIELD_OF_VIEW / 2), math.tan(FIELD_OF_VIEW / 2) / aspect])
    if aspect < 1:
        tangent *= aspect
    tangent *= FILL
    local = points @ frame.T
    target = (local.min(axis=0) + local.max(axis=0)) / 2
    for _ in range(4):  # centre the silhouette in the picture; perspective makes this a short iteration
        offset = local - target
        distance = (offset[:, 2:3] + np.abs(offset[:, :2]) / tangent).max()
        seen = offset[:, :2] / (distance - offset[:, 2:3])
        target[:2] += (seen.min(axis=0) + seen.max(axis=0)) / 2 * distance
    distance = ((local - target)[:, 2:3] + np.abs((local - target)[:, :2]) / tangent).max()
    data = bpy.data.cameras.new("BLE camera")
    data.angle = FIELD_OF_VIEW
    data.clip_start, data.clip_end = distance / 1000, distance * 100
    camera = bpy.data.objects.new("BLE camera", data)
    position = (target + np.array([0.0, 0.0, distance])) @ frame
    camera.matrix_world = mathutils.Matrix(
        [[*frame[:, row], position[row]] for row in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
    )
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def place_lights(scene, camera):
    """A soft key from the upper left of the camera, and a grey world."""
    import bpy
    import mathutils

    data = bpy.data.lights.new("BLE key", "SUN")
    data.energy, data.angle = 2.6, math.radians(20)
    key = bpy.data.objects.new("BLE key", data)
    turn = mathutils.Euler((math.radians(-38), math.radians(-32), 0.0)).to_matrix().to_4x4()
    key.matrix_world = camera.matrix_world.to_3x3().to_4x4() @ turn
    scene.collection.objects.link(key)
    world = bpy.data.worlds.new("BLE world")
    scene.world = world
    if not world.use_nodes:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.42, 0.45, 0.5, 1.0)
    background.inputs["Strength"].default_value = 0.8
    return key, world


def render_objects(objects, path, uv_map, *, size=(960, 720), samples=32, cells=16, plain=False, view=None):
    """Renders objects through a UV map to a PNG file. Their materials and other objects' visibility are put back.

    `plain` shows a checker without numbers, which small pictures can tell; `view` as for `place_camera`. Clouds appear
    as a ball a point, in the colour of that checker at the point's UV.
    """
    import addon_utils
    import bpy

    addon_utils.enable("cycles")
    scene = bpy.context.scene
    material = grid_material(uv_map, cells)
    clouds = [obj for obj in objects if is_cloud(obj)]
    surfaces = [obj for obj in objects if obj not in clouds]
    before = {obj: [slot.material for slot in obj.material_slots] for obj in surfaces}
    hidden = {obj: obj.hide_render for obj in scene.objects}
    old_world, old_camera = scene.world, scene.camera
    for obj in scene.objects:
        obj.hide_render = obj not in before
    for obj in surfaces:
        if not obj.material_slots:
            obj.data.materials.append(None)
        for slot in obj.material_slots:
            slot.material = material
    camera = place_camera(scene, world_points(objects), size[0] / size[1], view)
    key, world = place_lights(scene, camera)
    settings = scene.render
    settings.engine = "CYCLES"
    settings.resolution_x, settings.resolution_y = size
    settings.resolution_percentage = 100
    settings.image_settings.file_format = "PNG"
    settings.image_settings.color_mode = "RGB"
    settings.filepath = str(Path(path).resolve())
    scene.view_settings.view_transform = "Standard"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.max_bounces = 3
    scene.cycles.use_denoising = False  # not in every build, and it would smear the grid's numbers
    scene.cycles.seed = 0
    point_image = render_points.checker_image(cells)
    point_material = render_points.point_material(material, uv_map, point_image)
    texture = next(node for node in material.node_tree.nodes if node.type == "TEX_IMAGE")
    grid_image = texture.image
    if plain:
        texture.image = point_image
    try:
        with render_points.stand_ins(clouds, point_material, scene):
            bpy.ops.render.render(write_still=True)
    finally:
        for obj, materials in before.items():
            if not materials:
                obj.data.materials.clear()
            for slot, old in zip(obj.material_slots, materials, strict=False):
                slot.material = old
        for obj, state in hidden.items():
            obj.hide_render = state
        scene.world, scene.camera = old_world, old_camera
        camera_data, key_data = camera.data, key.data
        bpy.data.objects.remove(camera)
        bpy.data.objects.remove(key)
        bpy.data.cameras.remove(camera_data)
        bpy.data.lights.remove(key_data)
        bpy.data.worlds.remove(world)
        bpy.data.materials.remove(material)
        bpy.data.materials.remove(point_material)
        bpy.data.images.remove(point_image)
        bpy.data.images.remove(grid_image)


def map_names(objects):
    """Names of the UV maps that objects show: the active one of a surface, all of a cloud."""
    names = set()
    for obj in objects:
        if is_cloud(obj):
            names |= {a.name for a in obj.data.attributes if (a.domain, a.data_type) == ("POINT", "FLOAT2")}
        elif obj.data.uv_layers.active:
            names.add(obj.data.uv_layers.active.name)
    return names


def has_map(obj, name):
    return name in (map_names([obj]) if is_cloud(obj) else obj.data.uv_layers)


def main(argv):
    batch, asset_io = addon_loader.load("batch"), addon_loader.load("asset_io")
    parser = argparse.ArgumentParser(
        prog="render.py", description="Render a model with a numbered colour grid as its texture."
    )
    parser.add_argument("input", metavar="IN", help="a file with UVs")
    parser.add_argument("-o", "--output", required=True, metavar="PICTURE.png", help="the picture to write")
    parser.add_argument("--uv-map", help="UV map to show (default: the active one)")
    parser.add_argument("--size", type=int, nargs=2, default=(960, 720), metavar=("WIDTH", "HEIGHT"), help="in pixels")
    parser.add_argument("--samples", type=int, default=32, help="light paths a pixel (default: 32)")
    parser.add_argument("--cells", type=int, default=16, help="cells along each side of the grid (default: 16)")
    options = parser.parse_args(argv)
    if not all(16 <= side <= 8192 for side in options.size) or not 1 <= options.samples <= 4096:
        parser.error("--size must be within 16 and 8192, --samples within 1 and 4096")
    if not 1 <= options.cells <= 64:
        parser.error("--cells must be within 1 and 64")
    try:
        targets = addon_loader.load("targets")
        objects = [obj for obj in asset_io.load(options.input) if targets.is_surface(obj) or targets.is_cloud(obj)]
        if not objects:
            raise asset_io.AssetError("holds no faces and no points")
        uv_map = options.uv_map or next(iter(sorted(map_names(objects))), None)
        if uv_map is None or not all(has_map(obj, uv_map) for obj in objects):
            raise asset_io.AssetError(f"has no UV map {uv_map!r}" if uv_map else "has no UV map; unwrap it first")
        Path(options.output).resolve().parent.mkdir(parents=True, exist_ok=True)
        render_objects(objects, options.output, uv_map, size=options.size, samples=options.samples, cells=options.cells)
    except (asset_io.AssetError, RuntimeError, OSError) as error:
        print(f"{options.input}: {error}", file=sys.stderr)
        return batch.SOME_FAILED
    print(f"written to {options.output}")
    return batch.OK


if __name__ == "__main__":
    addon_loader.run(main)
