"""Files in and out: paths still lead somewhere, all of the output is mapped, nothing is lost when a disk is full."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import addon_loader
import bpy
import numpy as np
import pytest
from scenes import assert_good, cube, grid, point_cloud, sphere, uvs, vertices_only

FORMATS = ("blend", "glb", "gltf", "obj", "fbx", "ply")
FLAT_FORMATS = FORMATS[1:]  # which hold what modifiers make


def process(addon, tmp_path, source, target, *options):
    """Runs the command line on one file: exit code and the report's entry."""
    report = tmp_path / "report.json"
    report.unlink(missing_ok=True)
    arguments = [source, "-o", target, "--report", report, "--quiet", *options]
    code = addon("batch").main([str(argument) for argument in arguments])
    return code, json.loads(report.read_text())["assets"][0]


def notes(asset):
    return "\n".join(asset["warnings"])


def save_blend(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def write_picture(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    image = bpy.data.images.new("made", 4, 4)
    image.pixels = [1.0, 0.0, 0.0, 1.0] * 16
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
    return path


def give_texture(obj, path):
    material = bpy.data.materials.new("painted")
    if material.node_tree is None:
        material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(path))
    shader = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(node.outputs[0], shader.inputs["Base Color"])
    obj.data.materials.append(material)


def link_object(path, name):
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.objects = [name]
    bpy.context.collection.objects.link(wanted.objects[0])
    return wanted.objects[0]


def nodes(*kinds):
    """Geometry nodes of the kinds, one after the other by their first sockets; what is instanced is a small cube."""
    tree = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    before = tree.nodes.new("NodeGroupInput").outputs[0]
    for kind in kinds:
        node = tree.nodes.new(kind)
        tree.links.new(before, node.inputs[0])
        if kind == "GeometryNodeInstanceOnPoints":
            small = tree.nodes.new("GeometryNodeMeshCube")
            small.inputs["Size"].default_value = (0.01, 0.01, 0.01)
            tree.links.new(small.outputs["Mesh"], node.inputs["Instance"])
        before = node.outputs[0]
    tree.links.new(before, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


def faces_with_uvs(path):
    """Faces of the objects that a file shows, when every one of their meshes has good UVs."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    addon_loader.load("asset_io").load(path)
    objects = [obj for obj in bpy.context.scene.objects if obj.type == "MESH" and obj.data.polygons]
    for obj in objects:
        assert_good(obj)
    return sum(len(obj.data.polygons) for obj in objects)


# Paths --------------------------------------------------------------------------------------------------------------


@pytest.fixture
def scene_with_paths(tmp_path):
    """A .blend in `in/` with a picture in `in/tex/` and a cube linked from `lib/`, all by relative paths."""
    cube("Linked").data.uv_layers.new(name="UVMap")
    library = save_blend(tmp_path / "lib/lib.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    give_texture(cube(), write_picture(tmp_path / "in/tex/a picture.png"))
    link_object(library, "Linked")
    save_blend(tmp_path / "in/scene.blend")
    bpy.ops.file.make_paths_relative()
    bpy.ops.wm.save_mainfile()
    assert bpy.data.images[0].filepath == "//tex/a picture.png"
    return tmp_path / "in/scene.blend"


def test_relative_paths_of_a_blend_lead_from_the_outputs_folder(addon, tmp_path, scene_with_paths):
    code, asset = process(addon, tmp_path, scene_with_paths, tmp_path / "out/deep")
    assert code == 0, asset
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/deep/scene.blend"))
    assert bpy.data.images[0].filepath == "//../../in/tex/a picture.png"
    assert bpy.data.libraries[0].filepath == "//../../lib/lib.blend"
    assert len(bpy.data.objects["Linked"].data.polygons) == 6, "the library was found"


def test_texture_of_an_mtl_is_relative(addon, tmp_path, scene_with_paths):
    code, asset = process(addon, tmp_path, scene_with_paths, tmp_path / "out/deep/a.obj")
    assert code == 0, asset
    (line,) = re.findall("map_Kd.*", (tmp_path / "out/deep/a.mtl").read_text())
    assert line == "map_Kd ../../in/tex/a picture.png"
    assert "\nmtllib a.mtl\n" in (tmp_path / "out/deep/a.obj").read_text()
    code, asset = process(addon, tmp_path, tmp_path / "out/deep/a.obj", tmp_path / "b.obj")
    assert code == 0, asset
    assert re.findall("map_Kd.*", (tmp_path / "b.mtl").read_text()) == ["map_Kd in/tex/a picture.png"]


@pytest.mark.parametrize("kind", ["gltf", "glb", "fbx"])
def test_textures_are_found_from_other_formats(addon, tmp_path, scene_with_paths, kind):
    code, asset = process(addon, tmp_path, scene_with_paths, tmp_path / f"out/deep/a.{kind}")
    assert code == 0, asset
    # Moved with what lies beside it; the FBX names the picture where it is, relative to itself.
    if kind != "fbx":
        shutil.move(tmp_path / "out/deep", tmp_path / "moved")
        shutil.rmtree(tmp_path / "in")
    addon("asset_io").load(tmp_path / ("out/deep" if kind == "fbx" else "moved") / f"a.{kind}")
    (image,) = [image for image in bpy.data.images if image.users and image.type == "IMAGE"]
    assert tuple(image.size) == (4, 4)
    if kind == "fbx":
        assert b"../../in/tex/a picture.png" in (tmp_path / "out/deep/a.fbx").read_bytes()


@pytest.mark.parametrize("kind", ["obj", "fbx"])
def test_packed_textures_are_written_too(addon, tmp_path, kind):
    give_texture(cube(), write_picture(tmp_path / "in/a.png"))
    bpy.data.images[0].pack()
    source = save_blend(tmp_path / "in/scene.blend")
    (tmp_path / "in/a.png").unlink()
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    addon("asset_io").load(tmp_path / f"out/a.{kind}")
    (image,) = [image for image in bpy.data.images if image.users and image.type == "IMAGE"]
    assert tuple(image.size) == (4, 4)


def test_gltf_outputs_of_one_folder_keep_their_own_textures(addon, tmp_path):
    for name, colour in (("a", 0.0), ("b", 1.0)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        picture = write_picture(tmp_path / name / "same name.png")
        picture.write_bytes(picture.read_bytes() + bytes([int(colour)]))
        give_texture(cube(), picture)
        save_blend(tmp_path / name / f"{name}.blend")
    for name in "ab":
        code, asset = process(addon, tmp_path, tmp_path / name / f"{name}.blend", tmp_path / f"out/{name}.gltf")
        assert code == 0, asset
    documents = [json.loads((tmp_path / f"out/{name}.gltf").read_text()) for name in "ab"]
    assert documents[0]["images"][0]["uri"] != documents[1]["images"][0]["uri"]


# Modifiers ----------------------------------------------------------------------------------------------------------


def add_modified():
    """A cube that is mirrored beside itself and repeated, and a ball that is subdivided: 24 and 1,536 faces."""
    boxes, ball = cube("Boxes", 1.0), sphere("Ball")
    for vertex in boxes.data.vertices:
        vertex.co.x += 2.0
    boxes.modifiers.new("Mirror", "MIRROR")
    array = boxes.modifiers.new("Array", "ARRAY")
    array.relative_offset_displace = (0, 1.5, 0)
    ball.location.z = 5
    ball.modifiers.new("Subdivision", "SUBSURF")


@pytest.mark.parametrize("kind", FLAT_FORMATS)
def test_what_modifiers_make_is_unwrapped_and_written(addon, tmp_path, kind):
    add_modified()
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    assert sum(entry["measured"]["faces"] for entry in asset["objects"]) == 24 + 1536
    assert "Boxes: modifiers Mirror and Array applied" in notes(
        asset
    ) and "Ball: modifier Subdivision applied" in notes(asset)
    faces = 2 * 24 + 2 * 1536 if kind in ("glb", "gltf") else 24 + 1536
    assert faces_with_uvs(tmp_path / f"out/a.{kind}") == faces
    selected = [obj for obj in bpy.context.view_layer.objects if obj.type == "MESH"]
    assert addon("comparison").overlapping_faces(selected) == 0


def test_a_blend_keeps_modifiers_and_says_what_is_certified(addon, tmp_path):
    add_modified()
    sphere("Posed").modifiers.new("Cast", "CAST")
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / "out")
    assert code == 0, asset
    assert "Boxes: the mesh was unwrapped without modifiers Mirror and Array" in notes(asset)
    assert "Cast" not in notes(asset), "it moves vertices only"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/a.blend"))
    assert [m.type for m in bpy.data.objects["Boxes"].modifiers] == ["MIRROR", "ARRAY"]


@pytest.mark.parametrize("kind", FLAT_FORMATS)
def test_shape_keys_and_bones_are_not_lost_to_modifiers(addon, tmp_path, kind):
    keyed, boned = cube("Keyed"), cube("Boned")
    keyed.shape_key_add(name="Basis")
    keyed.shape_key_add(name="up").data[0].co.z += 1
    keyed.modifiers.new("Mirror", "MIRROR").use_axis = (False, True, False)
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("bone").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    boned.vertex_groups.new(name="bone").add(range(8), 1.0, "REPLACE")
    boned.modifiers.new("Armature", "ARMATURE").object = rig
    boned.modifiers.new("Array", "ARRAY")
    boned.parent = rig
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    addon("asset_io").load(tmp_path / f"out/a.{kind}")
    triangles = sum(len(p.vertices) - 2 for m in bpy.data.meshes for p in m.polygons if m.name != "Icosphere")
    if kind in ("obj", "ply"):
        assert triangles == 24 + 24
        return
    assert "Keyed: modifier Mirror not applied, since the shape keys would be lost" in notes(asset)
    assert triangles == 12 + 24
    by_name = {obj.name: obj for obj in bpy.data.objects if obj.type == "MESH"}
    assert [key.name for key in by_name["Keyed"].data.shape_keys.key_blocks][1:] == ["up"]
    assert [m.type for m in by_name["Boned"].modifiers] == ["ARMATURE"]
    assert [group.name for group in by_name["Boned"].vertex_groups] == ["bone"]


def test_objects_with_the_same_modifiers_go_on_sharing_their_mesh(addon, tmp_path):
    first = sphere("First")
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.collection.objects.link(second)
    for obj in (first, second):
        obj.modifiers.new("Subdivision", "SUBSURF")
    source = save_blend(tmp_path / "a.blend")
    _, asset = process(addon, tmp_path, source, tmp_path / "out/a.glb")
    assert asset["objects"][0]["measured"]["faces"] == 1536


# All there is -------------------------------------------------------------------------------------------------------


def add_places():
    """A cube in each place where geometry may be: shown, hidden, excluded, instanced, in another scene; and a text."""
    cube("Shown")
    cube("Hidden").hide_viewport = True
    for name in ("Excluded", "Source"):
        collection = bpy.data.collections.new(name)
        obj = cube(name)
        bpy.context.collection.objects.unlink(obj)
        collection.objects.link(obj)
        if name == "Excluded":
            bpy.context.scene.collection.children.link(collection)
            bpy.context.view_layer.layer_collection.children[name].exclude = True
    instancer = bpy.data.objects.new("Instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", bpy.data.collections["Source"]
    instancer.location.x = 5
    bpy.context.collection.objects.link(instancer)
    other = cube("Other")
    bpy.context.collection.objects.unlink(other)
    bpy.data.scenes.new("Second").collection.objects.link(other)
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude = "Io", 0.1
    bpy.context.collection.objects.link(bpy.data.objects.new("Text", text))


@pytest.mark.parametrize("kind", FORMATS)
def test_every_mesh_of_the_output_has_uvs(addon, tmp_path, kind):
    add_places()
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    names = set(asset["objects"][0]["names"])
    everywhere = {"Shown", "Hidden", "Excluded", "Source", "Other"}
    expected = {
        "blend": everywhere,
        "glb": everywhere | {"Text"},
        "gltf": everywhere | {"Text"},
        "fbx": {"Shown", "Hidden", "Source", "Text"},
    }.get(kind, {"Shown", "Source", "Text"})
    assert names == expected
    for name in everywhere - expected:
        assert name in notes(asset), "what is not written is named"
    assert "Text" in notes(asset)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    addon("asset_io").load(tmp_path / f"out/a.{kind}")
    meshes = [mesh for mesh in bpy.data.meshes if mesh.polygons and mesh.users]
    assert meshes and all(mesh.uv_layers for mesh in meshes)


@pytest.mark.parametrize("kind", ["glb", "obj"])
def test_curve_turned_into_a_mesh_is_still_a_path(addon, tmp_path, kind):
    """A flat circle is filled, so it is written with faces; the cube that goes around it must stay where it is."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=4)
    circle = bpy.context.object
    circle.name = "Path"
    circle.data.dimensions, circle.data.fill_mode = "2D", "BOTH"
    follower = cube("Follower", 0.5)
    constraint = follower.constraints.new("FOLLOW_PATH")
    constraint.target, constraint.use_fixed_location, constraint.offset_factor = circle, True, 0.25
    bpy.context.view_layer.update()
    place = follower.matrix_world.translation.copy()
    assert place.length == pytest.approx(4, abs=0.1)
    code, asset = process(addon, tmp_path, save_blend(tmp_path / "a.blend"), tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    assert sorted(asset["objects"][0]["names"]) == ["Follower", "Path"]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    addon("asset_io").load(tmp_path / f"out/a.{kind}")
    written = bpy.data.objects["Follower"]
    corners = np.array([written.matrix_world @ vertex.co for vertex in written.data.vertices])
    assert np.allclose(corners.mean(axis=0), place, atol=1e-3)


def test_size_of_what_is_not_shown_counts(addon, tmp_path):
    """Blender knows the scale of an object that it shows only; texels are for all alike."""
    cube("Shown")
    hidden = cube("Hidden")
    hidden.hide_viewport, hidden.scale = True, (3, 3, 3)
    source = save_blend(tmp_path / "a.blend")
    assert process(addon, tmp_path, source, tmp_path / "out")[0] == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/a.blend"))
    sides = [uvs(bpy.data.objects[name])[:2] for name in ("Shown", "Hidden")]
    sizes = [np.linalg.norm(side[1] - side[0]) for side in sides]
    assert sizes[1] == pytest.approx(3 * sizes[0], rel=0.02)


def test_linked_mesh_is_named_and_the_others_are_mapped(addon, tmp_path):
    cube("Linked")
    library = save_blend(tmp_path / "lib.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    cube("Own")
    link_object(library, "Linked")
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / "out")
    assert (code, asset["status"]) == (4, "violated"), "a mesh that the output shows has no UVs"
    assert asset["objects"][0]["names"] == ["Own"]
    assert "Linked has no UVs: its mesh is linked from lib.blend" in asset["error"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/a.blend"))
    assert_good(bpy.data.objects["Own"])
    code, asset = process(addon, tmp_path, source, tmp_path / "out/a.glb")
    assert (code, sorted(asset["objects"][0]["names"])) == (0, ["Linked", "Own"]), "a .glb links to nothing"


def test_instances_of_a_linked_collection_are_mapped_where_the_format_has_no_links(addon, tmp_path):
    obj = cube("Part")
    collection = bpy.data.collections.new("Parts")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)
    library = save_blend(tmp_path / "lib.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.collections = ["Parts"]
    instancer = bpy.data.objects.new("Instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", wanted.collections[0]
    bpy.context.collection.objects.link(instancer)
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / "out/a.obj")
    assert code == 0, asset
    assert faces_with_uvs(tmp_path / "out/a.obj") == 6


def test_missing_library_is_named(addon, tmp_path):
    cube("Linked")
    library = save_blend(tmp_path / "lib.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    cube("Own")
    link_object(library, "Linked")
    source = save_blend(tmp_path / "a.blend")
    library.unlink()
    _, asset = process(addon, tmp_path, source, tmp_path / "out/a.glb")
    assert asset["objects"][0]["names"] == ["Own"]
    assert "lib.blend" in notes(asset) and "missing" in notes(asset)


def test_selection_with_a_linked_mesh(tmp_path):
    """In the window, too: the others are mapped and it is named."""
    cube("Linked")
    library = save_blend(tmp_path / "lib.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    own = cube("Own")
    linked = link_object(library, "Linked")
    for obj in (own, linked):
        obj.select_set(True)
    assert bpy.ops.uv.ble_unwrap() == {"FINISHED"}
    assert_good(own)
    assert "Linked: its mesh is linked from another file" in bpy.context.window_manager.ble_unwrap_certificate.lines
    own.select_set(False)
    with pytest.raises(RuntimeError, match="linked from another file"):
        bpy.ops.uv.ble_unwrap()


@pytest.mark.parametrize("make", [vertices_only, point_cloud])
def test_faces_that_geometry_nodes_make_of_points(addon, tmp_path, make):
    obj = make(name="Seeds")
    obj.modifiers.new("nodes", "NODES").node_group = nodes("GeometryNodeInstanceOnPoints")
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / "out")
    assert (code, asset["status"]) == (4, "violated")
    assert "Seeds: the faces that its geometry nodes make have no UVs; apply the modifier" in asset["error"]
    assert asset["objects"][0]["kind"] == "cloud"
    bpy.ops.wm.open_mainfile(filepath=str(source))
    bpy.data.objects["Seeds"].select_set(True)
    bpy.ops.uv.ble_unwrap()
    assert "have no UVs; apply the modifier" in bpy.context.window_manager.ble_unwrap_certificate.lines


@pytest.mark.parametrize("kind", ["glb", "obj"])
def test_instances_of_geometry_nodes_become_part_of_the_mesh(addon, tmp_path, kind):
    obj = grid(2)
    obj.modifiers.new("nodes", "NODES").node_group = nodes("GeometryNodeInstanceOnPoints")
    source = save_blend(tmp_path / "a.blend")
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    assert asset["objects"][0]["measured"]["faces"] == 9 * 6


# Full disks ---------------------------------------------------------------------------------------------------------

LIMITED = """
import resource, sys
sys.path.insert(0, {scripts!r})
import addon_loader
batch = addon_loader.load("batch")
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, resource.RLIM_INFINITY))
addon_loader.run(lambda arguments: batch.main({arguments!r}))
"""


@pytest.mark.skipif(os.name == "nt", reason="needs a limit on the size of files")
@pytest.mark.skipif(not addon_loader.is_module(), reason="starts Python with bpy")
@pytest.mark.parametrize("share", [0.3, 0.97])
@pytest.mark.parametrize("kind", FORMATS)
def test_what_does_not_fit_on_the_disk_leaves_the_old_output(addon, tmp_path, kind, share):
    """A limit on the size of files ends writing as a full disk does, at any byte."""
    sphere(cells=40)
    source = save_blend(tmp_path / "a.blend")
    target = tmp_path / f"out/a.{kind}"
    code, asset = process(addon, tmp_path, source, target)
    assert code == 0, asset
    before = {file.name: file.read_bytes() for file in target.parent.iterdir()}
    largest = max(len(data) for data in before.values())
    arguments = [str(source), "-o", str(target)]
    scripts = str(Path(addon_loader.__file__).parent)
    script = LIMITED.format(scripts=scripts, limit=int(share * largest), arguments=arguments)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "cannot write" in done.stderr and f"the disk of {target.parent} has" in done.stderr
    assert {file.name: file.read_bytes() for file in target.parent.iterdir()} == before


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs to mount a small disk")
@pytest.mark.parametrize("kind", FORMATS)
def test_full_disk(addon, tmp_path, kind):
    sphere(cells=60)
    source = save_blend(tmp_path / "a.blend")
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", disk], check=False)
    if mounted.returncode:
        pytest.skip("cannot mount a small disk")
    try:
        old = disk / f"a.{kind}"
        old.write_bytes(b"the old output")
        code, asset = process(addon, tmp_path, source, old)
        assert code == 1 and f"the disk of {disk} has" in asset["error"], asset
        assert [file.name for file in disk.iterdir()] == [old.name]
        assert old.read_bytes() == b"the old output"
    finally:
        subprocess.run(["umount", "--lazy", disk], check=True)


def test_folder_in_place_of_the_output(addon, tmp_path):
    cube()
    source = save_blend(tmp_path / "a.blend")
    (tmp_path / "out/a.glb").mkdir(parents=True)
    code, asset = process(addon, tmp_path, source, tmp_path / "out", "--format", "glb")
    assert code == 1 and "there is a folder of that name" in asset["error"]


# What a run leaves behind ---------------------------------------------------------------------------------------------


def test_no_temporary_folder_is_left(run_script, files, tmp_path):
    cube()
    source = files("a.obj")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    done = run_script("unwrap.py", source, "-o", "out", environment={"TMPDIR": str(temporary)})
    assert done.returncode == 0, done.stdout
    assert not list(temporary.iterdir())
