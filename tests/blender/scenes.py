"""Meshes for the tests, and what is read off their UVs and off the panel."""

import json

import bpy
import demo_meshes
import numpy as np
import sculpt_mesh

add_mesh = demo_meshes.add_mesh


def grid(cells=6, name="Grid", bump=0.0):
    """A sheet of cells² quads on the unit square, raised in the middle."""
    t = np.linspace(0.0, 1.0, cells + 1)
    x, y = (a.reshape(-1) for a in np.meshgrid(t, t, indexing="ij"))
    z = bump * np.sin(np.pi * x) * np.sin(np.pi * y)
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    return add_mesh(name, np.stack([x, y, z], axis=1), quads)


def cube(name="Cube", size=2.0):
    h = size / 2
    positions = [(x, y, z) for x in (-h, h) for y in (-h, h) for z in (-h, h)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return add_mesh(name, positions, faces)


def sphere(name="Sphere", cells=8):
    return add_mesh(name, *sculpt_mesh.cube_sphere(cells))


def n_gons(name="N-gons"):
    """A pentagon, a concave hexagon and a triangle around it in one plane."""
    positions = [(0, 0, 0), (2, 0, 0), (3, 2, 0), (1, 3, 0), (-1, 2, 0), (1, -2, 0), (1, -1, 0), (3, -2, 0), (4, 0, 0)]
    return add_mesh(name, positions, [(0, 1, 2, 3, 4), (0, 5, 6, 7, 8, 1), (1, 8, 2)])


def select(*objects):
    bpy.context.view_layer.update()  # before it, objects that were removed are still there, and new ones are not
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def edit(*objects, faces=None):
    """Edit mode of the objects with all faces selected, or with these of the first one only."""
    select(*objects)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    if faces is not None:
        bpy.ops.object.mode_set(mode="OBJECT")
        mesh = objects[0].data
        mesh.vertices.foreach_set("select", np.zeros(len(mesh.vertices), bool))
        mesh.edges.foreach_set("select", np.zeros(len(mesh.edges), bool))
        mesh.polygons.foreach_set("select", np.isin(np.arange(len(mesh.polygons)), faces))
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.scene.tool_settings.mesh_select_mode = (False, False, True)


def uvs(obj, name=None):
    """UVs by corner, (c, 2) float32; of a mesh in object mode."""
    assert obj.mode == "OBJECT", "UV maps are empty in edit mode"
    layer = obj.data.uv_layers[name] if name else obj.data.uv_layers.active
    assert layer is not None, f"{obj.name} has no UV map"
    values = np.empty(2 * len(obj.data.loops), np.float32)
    layer.uv.foreach_get("vector", values)
    return values.reshape(-1, 2)


def set_uvs(obj, values):
    """Sets the UVs of the active map as the add-on must: see mesh_bridge.write_layer."""
    name = obj.data.uv_layers.active.name
    obj.data.attributes[name].data.foreach_set("vector", np.asarray(values, np.float32).reshape(-1))


def is_cut(obj, edge_index):
    """Whether the two faces at an edge have different UVs along it."""
    corners = {}
    uv = uvs(obj)
    edge = obj.data.edges[edge_index]
    for loop in obj.data.loops:
        if loop.vertex_index in edge.vertices:
            corners.setdefault(loop.vertex_index, {})[loop.index] = tuple(uv[loop.index])
    faces = [face for face in obj.data.polygons if set(edge.vertices) <= set(face.vertices)]
    for vertex in edge.vertices:
        found = {corners[vertex][loop] for face in faces for loop in face.loop_indices if loop in corners[vertex]}
        if len(found) > 1:
            return True
    return False


def triangle_areas(obj, uv):
    """Signed UV areas of Blender's own triangulation: positive is not flipped."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    a, b, c = uv.astype(float)[loops.reshape(-1, 3)].transpose(1, 0, 2)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def surface_areas(obj):
    mesh = obj.data
    mesh.calc_loop_triangles()
    values = np.empty(len(mesh.loop_triangles), np.float32)
    mesh.loop_triangles.foreach_get("area", values)
    return values.astype(float)


def assert_good(obj):
    """Finite UVs within the square, no triangle flipped or collapsed."""
    uv = uvs(obj)
    assert np.isfinite(uv).all()
    assert uv.min() >= 0 and uv.max() <= 1
    assert (triangle_areas(obj, uv) > 0).all()
    return uv


def certificate():
    """The lines of Last Result in the panel, each with its status."""
    return json.loads(bpy.context.window_manager.ble_unwrap_certificate.lines)


def fingerprint(obj):
    """Everything about a mesh and its object that an unwrap must leave alone."""
    mesh = obj.data
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    flags = [np.empty(len(mesh.polygons), bool) for _ in range(2)]
    mesh.polygons.foreach_get("select", flags[0])
    mesh.polygons.foreach_get("hide", flags[1])
    materials = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", materials)
    seams = np.empty(len(mesh.edges), bool)
    mesh.edges.foreach_get("use_seam", seams)
    arrays = (positions, corners, *flags, materials, seams)
    return (obj.mode, obj.select_get(), *(a.tobytes() for a in arrays))


def sheet_points(cells=20, bump=0.15, offset=(0.0, 0.0, 0.0)):
    """Points of a bumpy sheet, (cells², 3), in a grid that is shaken so that no two distances are equal."""
    random = np.random.default_rng(5)
    t = np.linspace(0.0, 1.0, cells)
    x, y = (a.reshape(-1) for a in np.meshgrid(t, t, indexing="ij"))
    shake = random.uniform(-0.2, 0.2, (2, len(x))) / cells
    x, y = x + shake[0], y + shake[1]
    return np.stack([x, y, bump * np.sin(np.pi * x) * np.sin(np.pi * y)], axis=1) + offset


def vertices_only(points=None, name="Points"):
    """A mesh of vertices alone."""
    return add_mesh(name, sheet_points() if points is None else points, [])


def point_cloud(points=None, name="Cloud"):
    """A point cloud object. Every Blender since 4.2 makes one by applying geometry nodes; no other way is in all."""
    source = vertices_only(points, f"{name} source")
    obj = bpy.data.objects.new(name, bpy.data.pointclouds.new(name))
    bpy.context.collection.objects.link(obj)
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    info, to_points = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeMeshToPoints")
    out = tree.nodes.new("NodeGroupOutput")
    info.inputs["Object"].default_value = source
    tree.links.new(info.outputs["Geometry"], to_points.inputs["Mesh"])
    tree.links.new(to_points.outputs["Points"], out.inputs[0])
    obj.modifiers.new("points", "NODES").node_group = tree
    select(obj)
    bpy.ops.object.modifier_apply(modifier="points")
    data = source.data
    bpy.data.objects.remove(source)
    bpy.data.meshes.remove(data)
    bpy.data.node_groups.remove(tree)
    for name in [a.name for a in obj.data.attributes if a.name.startswith(".select")]:
        obj.data.attributes.remove(obj.data.attributes[name])
    assert obj.type == "POINTCLOUD" and len(obj.data.points) == len(sheet_points() if points is None else points)
    return obj


def point_map(obj, name="UVMap"):
    """The UVs of points that an attribute holds, (n, 2) float32; of an object that is not a mesh in edit mode."""
    attribute = obj.data.attributes[name]
    assert (attribute.domain, attribute.data_type) == ("POINT", "FLOAT2")
    values = np.empty(2 * len(attribute.data), np.float32)
    attribute.data.foreach_get("vector", values)
    return values.reshape(-1, 2)


def set_point_map(obj, values, name="UVMap"):
    if name not in obj.data.attributes:
        obj.data.attributes.new(name, "FLOAT2", "POINT")
    obj.data.attributes[name].data.foreach_set("vector", np.asarray(values, np.float32).reshape(-1))


def place_of_points(obj):
    attribute = obj.data.attributes["position"]
    values = np.empty(3 * len(attribute.data), np.float32)
    attribute.data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def attribute_names(obj):
    """Attributes apart from Blender's own, which come and go with selection and edit mode."""
    own = {"position", "radius", "sharp_face", "material_index"}
    return sorted(a.name for a in obj.data.attributes if not a.name.startswith(".") and a.name not in own)


def assert_points_mapped(obj, name="UVMap", which=slice(None)):
    """Points have finite UVs within the square, and near ones stay near: the map is one of the surface."""
    uv = point_map(obj, name)[which].astype(float)
    assert np.isfinite(uv).all() and uv.min() >= 0 and uv.max() <= 1
    points = place_of_points(obj)[which].astype(float)
    middle = len(points) // 2
    near = np.argsort(((points - points[middle]) ** 2).sum(axis=1))[1:5]
    spread = np.ptp(uv, axis=0).max()
    assert spread > 0.1
    assert (np.linalg.norm(uv[near] - uv[middle], axis=1) < 0.25 * spread).all()
    return uv
