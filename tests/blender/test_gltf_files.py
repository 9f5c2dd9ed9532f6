"""glTF to glTF: what such a file has besides meshes is still there, or the report says what is not."""

import gltf_samples
import numpy as np
import pytest
from test_files import process


def converted(addon, tmp_path, made, kind="glb"):
    """Writes a made file, runs it, and returns (document, array of an accessor) before and after, and the report."""
    source = made.write(tmp_path / f"a.{kind}")
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    return gltf_samples.read(source), gltf_samples.read(tmp_path / f"out/a.{kind}"), asset


@pytest.mark.parametrize("kind", ["glb", "gltf"])
def test_cameras_lights_and_custom_data_are_kept(addon, tmp_path, kind):
    _, (document, array), asset = converted(addon, tmp_path, gltf_samples.full(), kind)
    by_name = {node["name"]: node for node in document["nodes"]}
    assert document["cameras"][by_name["camera"]["camera"]]["perspective"]["yfov"] == pytest.approx(0.7, abs=1e-5)
    lights = document["extensions"]["KHR_lights_punctual"]["lights"]
    light = lights[by_name["light"]["extensions"]["KHR_lights_punctual"]["light"]]
    assert light["type"] == "point" and light["intensity"] == pytest.approx(50, rel=1e-4)
    assert by_name["cube"]["extras"]["health"] == 7
    (mesh,) = document["meshes"]
    assert mesh["extras"]["maker"] == "somebody"
    attributes = mesh["primitives"][0]["attributes"]
    assert {"TEXCOORD_0", "COLOR_0", "_TEMPERATURE"} <= set(attributes)
    assert set(array(attributes["_TEMPERATURE"])) == set(range(8))
    assert not asset["warnings"]


def test_skin_whose_nodes_are_not_in_bind_pose_stays_where_it_is(addon, tmp_path):
    before, after, _ = converted(addon, tmp_path, gltf_samples.skinned())
    places = [gltf_samples.world_of_skin(*file) for file in (before, after)]
    assert places[0].shape == places[1].shape
    assert np.abs(places[0] - places[1]).max() < 1e-4
    for node in before[0]["nodes"][:2]:
        now = next(other for other in after[0]["nodes"] if other["name"] == node["name"])
        for key in ("translation", "rotation"):
            default = (0, 0, 0) if key == "translation" else (0, 0, 0, 1)
            assert np.allclose(node.get(key, default), now.get(key, default), atol=1e-5)
    inverse = [array(document["skins"][0]["inverseBindMatrices"]) for document, array in (before, after)]
    names = [
        [document["nodes"][joint]["name"] for joint in document["skins"][0]["joints"]]
        for document, _ in (before, after)
    ]
    order = [names[1].index(name) for name in names[0]]
    assert np.allclose(inverse[0], inverse[1][order], atol=1e-5)


def test_bone_shapes_take_no_place_in_the_atlas(addon, tmp_path):
    """The importer makes an icosphere for bones to look like; it had 80 faces of the atlas and was not written."""
    _, after, asset = converted(addon, tmp_path, gltf_samples.skinned())
    assert asset["objects"][0]["names"] == ["bar"]
    assert asset["objects"][0]["measured"]["faces"] == 32
    assert [mesh["name"] for mesh in after[0]["meshes"]] == ["mesh0"]
    assert not asset["warnings"]


@pytest.mark.parametrize("kind", ["obj", "fbx", "blend"])
def test_bone_shapes_are_not_mapped_for_other_formats(addon, tmp_path, kind):
    source = gltf_samples.skinned().write(tmp_path / "a.glb")
    code, asset = process(addon, tmp_path, source, tmp_path / f"out/a.{kind}")
    assert code == 0, asset
    assert asset["objects"][0]["names"] == ["bar"]


def test_more_than_four_influences_are_kept(addon, tmp_path):
    made = gltf_samples.skinned()
    attributes = made.document["meshes"][0]["primitives"][0]["attributes"]
    count = made.document["accessors"][attributes["POSITION"]]["count"]
    for name in "ab":
        tip = made.node(root=False, name=name, translation=[0, 1, 0])
        made.document["nodes"][1].setdefault("children", []).append(tip)
        made.document["skins"][0]["joints"].append(tip)
    # Five influences a vertex, 1/8 each of two more bones and of one twice: only together they add up.
    joints = np.tile(np.array([0, 1, 2, 3], np.uint8), (count, 1))
    attributes["JOINTS_0"] = made.accessor(joints)
    attributes["WEIGHTS_0"] = made.accessor(np.full((count, 4), 0.2, np.float32))
    extra = made.node(root=False, name="c", translation=[0, 1, 0])
    made.document["nodes"][1]["children"].append(extra)
    made.document["skins"][0]["joints"].append(extra)
    attributes["JOINTS_1"] = made.accessor(np.tile(np.array([4, 0, 0, 0], np.uint8), (count, 1)))
    attributes["WEIGHTS_1"] = made.accessor(np.tile(np.array([0.2, 0, 0, 0], np.float32), (count, 1)))
    inverse = np.tile(np.eye(4, dtype=np.float32), (5, 1, 1))
    inverse[1:, 3, 1] = -2.0
    made.document["skins"][0]["inverseBindMatrices"] = made.accessor(inverse)
    _, (document, _), _ = converted(addon, tmp_path, made)
    assert "WEIGHTS_1" in document["meshes"][0]["primitives"][0]["attributes"]


def test_gpu_instances_are_kept_or_named(addon, tmp_path):
    _, (document, array), asset = converted(addon, tmp_path, gltf_samples.instanced())
    (entry,) = asset["objects"]
    assert entry["measured"]["faces"] == 12, "the mesh is mapped once"
    if "EXT_mesh_gpu_instancing" in document.get("extensionsUsed", ()):
        (extension,) = (node["extensions"] for node in document["nodes"] if "extensions" in node)
        attributes = extension["EXT_mesh_gpu_instancing"]["attributes"]
        assert sorted(array(attributes["TRANSLATION"])[:, 0]) == [0, 3, 6]
    else:
        assert "the input's GPU instances were expanded to objects" in asset["warnings"]


def test_draco_is_kept_and_does_not_round_uvs(addon, tmp_path):
    import bpy
    from scenes import assert_good, sphere

    sphere()
    source = tmp_path / "a.glb"
    bpy.ops.export_scene.gltf(filepath=str(source), export_draco_mesh_compression_enable=True)
    if b"KHR_draco_mesh_compression" not in source.read_bytes():
        pytest.skip("this Blender was built without Draco")
    code, asset = process(addon, tmp_path, source, tmp_path / "out")
    assert code == 0, asset
    assert b"KHR_draco_mesh_compression" in (tmp_path / "out/a.glb").read_bytes()
    assert any("compressed by Draco as the input was" in text for text in asset["warnings"])
    addon("asset_io").load(tmp_path / "out/a.glb")
    objects = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    assert_good(objects[0])
    measured = addon("comparison").measure_active(objects, margin=4, texture_size=(2048, 2048))
    assert measured["overlaps"] == measured["flips"] == 0
    assert measured["charts"] == asset["objects"][0]["measured"]["charts"]


def test_what_blender_does_not_keep_is_named(addon, tmp_path):
    made = gltf_samples.full()
    made.document["extensionsUsed"].append("EXT_somebody_s_own")
    _, _, asset = converted(addon, tmp_path, made)
    assert "the output is without the input's EXT_somebody_s_own, which Blender does not write" in asset["warnings"]
