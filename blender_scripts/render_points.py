"""Clouds made visible for rendering: every point a small ball in the colour that a texture has at its UV."""

import numpy as np

NEIGHBOURS = 5  # nearest points by whose distance the size of the balls is told
BALL = 0.72  # radius of a ball over the usual distance to the last of them
SAMPLE = 400  # points that are asked for it
IMAGE_SIDE = 1024  # pixels of the checker's image


def ball_radius(points):
    """Radius at which the balls of neighbouring points just close the surface."""
    from mathutils import kdtree

    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 2:
        return 0.01
    tree = kdtree.KDTree(len(points))
    for number, point in enumerate(points):
        tree.insert(point, number)
    tree.balance()
    asked = points[np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(int)]
    nearest = [max(distance for _, _, distance in tree.find_n(point, 1 + NEIGHBOURS)) for point in asked]
    spread = float(np.ptp(points, axis=0).max())
    return BALL * max(float(np.median(nearest)), 1e-4 * spread) or 0.01


def checker_colours(uv, cells):
    """sRGB colours of a checker at UVs, (n, 3) in 0..1: light and dark cells, the hue from their place."""
    cell = np.floor(np.asarray(uv, float) * cells)
    light = ((cell[:, 0] + cell[:, 1]) % 2).astype(bool)
    across, up = ((cell + 0.5) / cells).T
    hue = 6 * ((0.78 * across + 0.22 * up) % 1.0)
    wheel = np.clip(np.abs((hue[:, None] + (0.0, 4.0, 2.0)) % 6 - 3) - 1, 0, 1)
    strength = np.where(light, 0.30, 0.75)[:, None]
    return np.where(light, 0.98, 0.62)[:, None] * (1 - strength + strength * wheel)


def checker_image(cells):
    """The checker as an image in Blender. Unlike a numbered grid it can be told by one point in a dozen pixels."""
    import bpy

    t = (np.arange(IMAGE_SIDE) + 0.5) / IMAGE_SIDE
    uv = np.stack(np.meshgrid(t, t), axis=-1).reshape(-1, 2)
    pixels = np.ones((IMAGE_SIDE * IMAGE_SIDE, 4), np.float32)
    pixels[:, :3] = checker_colours(uv, cells)
    image = bpy.data.images.new("BLE checker", IMAGE_SIDE, IMAGE_SIDE)
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()
    return image


def point_material(grid_material, uv_map, image):
    """A copy of a grid material that shows another image by the attribute of points."""
    material = grid_material.copy()
    nodes, links = material.node_tree.nodes, material.node_tree.links
    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = uv_map
    texture = next(node for node in nodes if node.type == "TEX_IMAGE")
    texture.image, texture.interpolation = image, "Closest"
    links.new(attribute.outputs["Vector"], texture.inputs["Vector"])
    return material


class stand_ins:
    """Point cloud objects that show clouds, meshes of vertices alone and point clouds alike, while in the context."""

    def __init__(self, objects, material, scene):
        self.objects, self.material, self.scene = objects, material, scene

    def __enter__(self):
        import bpy

        self.made = []
        for obj in self.objects:
            data = bpy.data.pointclouds.new("BLE points")
            stand_in = bpy.data.objects.new("BLE points", data)
            self.scene.collection.objects.link(stand_in)
            tree = self._tree(obj)
            stand_in.modifiers.new("BLE points", "NODES").node_group = tree
            self.made.append((stand_in, data, tree))
        bpy.context.view_layer.update()
        return [stand_in for stand_in, _, _ in self.made]

    def _tree(self, obj):
        import bpy

        tree = bpy.data.node_groups.new("BLE points", "GeometryNodeTree")
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        info = tree.nodes.new("GeometryNodeObjectInfo")
        info.transform_space = "RELATIVE"  # the stand-in is at the origin: places in the world
        info.inputs["Object"].default_value = obj
        geometry = info.outputs["Geometry"]
        if obj.type == "MESH":
            to_points = tree.nodes.new("GeometryNodeMeshToPoints")
            tree.links.new(geometry, to_points.inputs["Mesh"])
            geometry = to_points.outputs["Points"]
        radius, shown = tree.nodes.new("GeometryNodeSetPointRadius"), tree.nodes.new("GeometryNodeSetMaterial")
        out = tree.nodes.new("NodeGroupOutput")
        radius.inputs["Radius"].default_value = ball_radius(world_points(obj))
        shown.inputs["Material"].default_value = self.material
        tree.links.new(geometry, radius.inputs["Points"])
        tree.links.new(radius.outputs["Points"], shown.inputs["Geometry"])
        tree.links.new(shown.outputs["Geometry"], out.inputs[0])
        return tree

    def __exit__(self, *_error):
        import bpy

        for stand_in, data, tree in self.made:
            bpy.data.objects.remove(stand_in)
            bpy.data.pointclouds.remove(data)
            bpy.data.node_groups.remove(tree)


def map_of(obj, name):
    """UVs of a cloud's points, (n, 2)."""
    attribute = obj.data.attributes[name]
    uv = np.empty(2 * len(attribute.data), np.float32)
    attribute.data.foreach_get("vector", uv)
    return uv.reshape(-1, 2)


def world_points(obj):
    """World positions of a cloud's points, (n, 3)."""
    attribute = obj.data.attributes["position"]
    points = np.empty(3 * len(attribute.data), np.float32)
    attribute.data.foreach_get("vector", points)
    matrix = np.array(obj.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
