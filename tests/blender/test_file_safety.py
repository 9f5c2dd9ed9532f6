"""Files from others: nothing in them runs, nothing outside is read, nothing is allocated that they only declare."""

import base64
import json
import os
import struct
import zlib

import bpy
import gltf_samples
import pytest
from scenes import cube
from test_files import process

HEAD = b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400)
posix = pytest.mark.skipif(os.name == "nt", reason="needs devices, pipes and links of POSIX")


def refused(addon, tmp_path, source):
    """What the command line says of a file that it refuses."""
    code, asset = process(addon, tmp_path, source, tmp_path / "out/a.glb")
    assert code == 1 and not (tmp_path / "out").exists(), asset
    assert "Traceback" not in asset["error"] and "internal error" not in asset["error"]
    return asset["error"]


def test_scripts_in_a_blend_do_not_run(addon, tmp_path):
    """Whatever the preferences say: a text that registers itself, and a driver, write a file when they run."""
    obj = cube()
    marker = tmp_path / "marker"
    text = bpy.data.texts.new("run.py")
    text.write(f"open({str(marker)!r}, 'w').close()\n")
    text.use_module = True
    driver = obj.driver_add("location", 0).driver
    driver.expression = f"len(str(open({str(marker)!r}, 'w')))"
    source = tmp_path / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    marker.unlink(missing_ok=True)
    paths = bpy.context.preferences.filepaths
    before = paths.use_scripts_auto_execute
    paths.use_scripts_auto_execute = True
    try:
        code, asset = process(addon, tmp_path, source, tmp_path / "out")
    finally:
        paths.use_scripts_auto_execute = before
    assert code == 0, asset
    assert not marker.exists()


@pytest.mark.parametrize("link", [False, True])
@pytest.mark.parametrize("what", ["buffers", "images"])
def test_gltf_reads_nothing_outside_its_folder(addon, tmp_path, what, link):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(bytes(4096))
    folder = tmp_path / "in"
    folder.mkdir()
    source = gltf_samples.full().write(folder / "a.gltf")
    document = json.loads(source.read_text())
    uri = "../secret.bin"
    if link:
        if os.name == "nt":
            pytest.skip("needs links of POSIX")
        (folder / "inside.bin").symlink_to(secret)
        uri = "inside.bin"
    document.setdefault(what, [{}])[0] = {"uri": uri, "byteLength": 4096}
    source.write_text(json.dumps(document))
    assert "only files in its own folder are read" in refused(addon, tmp_path, source)


@pytest.mark.parametrize(
    "uri", ["/etc/hostname", "file:///etc/hostname", "..%2Fsecret.bin", "sub/../../secret.bin", "https://a.b/c.bin"]
)
def test_ways_out_of_the_folder(addon, tmp_path, uri):
    (tmp_path / "in/sub").mkdir(parents=True)
    (tmp_path / "secret.bin").write_bytes(bytes(4096))
    source = gltf_samples.full().write(tmp_path / "in/a.gltf")
    document = json.loads(source.read_text())
    document["buffers"][0]["uri"] = uri
    source.write_text(json.dumps(document))
    assert "only files in its own folder are read" in refused(addon, tmp_path, source)


def test_gltf_reads_what_it_may(addon, tmp_path):
    """Sub-folders, escaped names, a link within the folder, data in the URI itself."""
    (tmp_path / "in/sub").mkdir(parents=True)
    source = gltf_samples.full().write(tmp_path / "in/a.gltf")
    data = (tmp_path / "in/a.bin").read_bytes()
    (tmp_path / "in/sub/a b.bin").write_bytes(data)
    inline = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    for uri in ("sub/a%20b.bin", "sub/../sub/a b.bin", inline):
        document = json.loads(source.read_text())
        document["buffers"][0]["uri"] = uri
        source.write_text(json.dumps(document))
        code, asset = process(addon, tmp_path, source, tmp_path / "out/a.glb")
        assert code == 0, asset


@posix
def test_devices_and_pipes_are_refused(addon, tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    os.mkfifo(folder / "pipe")
    source = gltf_samples.full().write(folder / "a.gltf")
    document = json.loads(source.read_text())
    document["buffers"][0]["uri"] = "pipe"
    source.write_text(json.dumps(document))
    assert "not a regular file" in refused(addon, tmp_path, source)
    for line in ("mtllib pipe", "mtllib /dev/zero", "mtllib \\\n/dev/zero", "  mtllib a.mtl"):
        (folder / "a.mtl").write_text("newmtl m\nmap_Kd -s 1 1 1 pipe\n")
        (folder / "b.obj").write_text(f"{line}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
        assert "not a regular file" in refused(addon, tmp_path, folder / "b.obj")
    (folder / "c.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    os.mkfifo(folder / "c.mtl")  # which Blender reads without being told to
    assert "not a regular file" in refused(addon, tmp_path, folder / "c.obj")
    for kind in ("ply", "blend", "stl"):
        os.mkfifo(folder / f"p.{kind}")
        with pytest.raises(addon("asset_io").AssetError, match="not a regular file"):
            addon("asset_io").load(folder / f"p.{kind}")


@pytest.mark.parametrize(
    "header",
    [
        "format binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y",
        "format ascii 1.0\nelement vertex 400000000\nproperty float x\nproperty float y\nproperty float z",
        "format ascii 1.0\nelement vertex 1\nproperty float x\nelement face 99999999999\nproperty list uchar int v",
    ],
)
def test_ply_that_declares_more_than_it_holds(addon, tmp_path, header):
    source = tmp_path / "a.ply"
    source.write_bytes(f"ply\n{header}\nend_header\n".encode() + b"0 0 0\n" * 10)
    assert "more than the file can hold" in refused(addon, tmp_path, source)


def test_gltf_that_declares_too_much(addon, tmp_path):
    made = gltf_samples.full()
    made.document["accessors"][0] |= {"count": 10**12}
    del made.document["accessors"][0]["bufferView"]  # zeros, by the specification
    assert "and the most is 8 GB" in refused(addon, tmp_path, made.write(tmp_path / "a.glb"))


def fbx_array(count, data):
    """A binary FBX file with one node that has one compressed array of doubles."""
    properties = b"d" + struct.pack("<III", count, 1, len(data)) + data
    node = struct.pack("<III", len(HEAD) + 14 + len(properties), 1, len(properties)) + b"\1N" + properties
    return HEAD + node + bytes(13)


@pytest.mark.parametrize(
    ("count", "data", "reason"),
    [
        (1 << 31, zlib.compress(bytes(1 << 20)), "and the most is 8 GB"),
        (1, zlib.compress(bytes(1 << 24)), "unpacks to another size than it says"),
        (2, b"no compressed data", "is cut short or damaged"),
    ],
)
def test_fbx_arrays_that_unpack_to_too_much(addon, tmp_path, count, data, reason):
    source = tmp_path / "a.fbx"
    source.write_bytes(fbx_array(count, data))
    assert reason in refused(addon, tmp_path, source)


def test_blends_that_unpack_to_too_much(addon, tmp_path, monkeypatch):
    """A Zstandard frame of one byte repeated 128 KB at a time, which takes four bytes a block; and one by gzip."""
    monkeypatch.setattr(addon("asset_io.input_check"), "MOST_BYTES", 1 << 24)
    block = struct.pack("<I", (128 << 10) << 3 | 1 << 1)[:3] + b"\0"
    last = struct.pack("<I", (128 << 10) << 3 | 1 << 1 | 1)[:3] + b"\0"
    source = tmp_path / "a.blend"
    source.write_bytes(b"\x28\xb5\x2f\xfd" + b"\0\x58" + 200 * block + last)
    assert "in memory, and the most is" in refused(addon, tmp_path, source)
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    source.write_bytes(packer.compress(bytes(1 << 25)) + packer.flush())
    assert "in memory, and the most is" in refused(addon, tmp_path, source)


def test_compressed_blend_is_read(addon, tmp_path):
    cube()
    source = tmp_path / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(source), compress=True)
    assert source.read_bytes()[:4] == b"\x28\xb5\x2f\xfd"
    code, asset = process(addon, tmp_path, source, tmp_path / "out")
    assert code == 0, asset


# Importers ----------------------------------------------------------------------------------------------------------


def test_fbx_with_a_light(addon, tmp_path):
    cube()
    light = bpy.data.objects.new("Light", bpy.data.lights.new("Light", "POINT"))
    bpy.context.collection.objects.link(light)
    source = tmp_path / "a.fbx"
    bpy.ops.export_scene.fbx(filepath=str(source))
    code, asset = process(addon, tmp_path, source, tmp_path / "out/a.glb")
    assert code == 0, asset
    assert asset["objects"][0]["names"] == ["Cube"]


def test_errors_of_importers_are_in_our_words(addon, tmp_path):
    """Never a line of Blender's traceback."""
    source = tmp_path / "a.gltf"
    node = {"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 5}}]}]}
    source.write_text(json.dumps({**node, "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0}))
    error = refused(addon, tmp_path, source)
    assert "Blender's own code for this format failed on it" in error
    assert "File " not in error and "Location" not in error
    source = tmp_path / "a.fbx"
    source.write_bytes(b"no FBX at all")
    assert "cannot be read" in refused(addon, tmp_path, source) or "is cut short" in refused(addon, tmp_path, source)
