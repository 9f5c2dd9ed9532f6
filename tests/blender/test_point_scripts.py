"""Clouds through the headless scripts: which files keep their UVs, what is said where a file cannot."""

import json

import bpy
import numpy as np
import pytest
from scenes import (
    assert_good,
    assert_points_mapped,
    attribute_names,
    cube,
    place_of_points,
    point_cloud,
    point_map,
    select,
    sheet_points,
    vertices_only,
)


def write_ascii_ply(path, columns, end="\n"):
    """A PLY file as scanners' software writes them."""
    lines = ["ply", "format ascii 1.0", "comment made by a test", f"element vertex {len(next(iter(columns.values())))}"]
    lines += [f"property {'uchar' if v.dtype == np.uint8 else 'float'} {name}" for name, v in columns.items()]
    rows = [" ".join(str(value) for value in row) for row in zip(*columns.values(), strict=True)]
    path.write_bytes(end.join([*lines, "end_header", *rows, ""]).encode("ascii"))


def scan_columns(points):
    """Coordinates, normals, colours and a number of its own for every point."""
    count = len(points)
    columns = dict(zip("xyz", points.astype(np.float32).T, strict=True))
    normals = np.stack([np.zeros(count), np.sin(np.arange(count)), np.cos(np.arange(count))], axis=1)
    columns |= dict(zip(("nx", "ny", "nz"), normals.astype(np.float32).T, strict=True))
    for name, factor in (("red", 1), ("green", 3), ("blue", 7)):
        columns[name] = (factor * np.arange(count) % 256).astype(np.uint8)
    return columns | {"intensity": np.arange(count).astype(np.float32) / count}


def read_ply(path):
    """A binary PLY file as the dictionary of its vertices' columns."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    words = [line.split() for line in head.decode().splitlines()]
    assert ["format", "binary_little_endian", "1.0"] in words
    types = {"float": "<f4", "uchar": "u1", "int": "<i4", "char": "i1"}
    dtype = [(word[2], types[word[1]]) for word in words if word[0] == "property"]
    rows = np.frombuffer(body, dtype)
    assert len(rows) == next(int(word[2]) for word in words if word[0] == "element")
    return {name: rows[name] for name in rows.dtype.names}


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_ply_of_points(run_script, tmp_path, end):
    columns = scan_columns(sheet_points())
    source = tmp_path / "scan.ply"
    write_ascii_ply(source, columns, end)
    done = run_script("unwrap.py", source, "-o", "out", "--report", "r.json", "--neighbours", "10")
    assert done.returncode == 0, done.stdout
    assert "400 points" in done.stdout
    entry = json.loads((tmp_path / "r.json").read_text())["assets"][0]["objects"][0]
    assert (entry["kind"], entry["points"], entry["uv_maps"]) == ("cloud", 400, ["UVMap"])
    assert entry["certificate"]["holds"] and entry["measured"]["points_mapped"] == 400
    written = read_ply(tmp_path / "out/scan.ply")
    for name, values in columns.items():
        assert np.allclose(written[name].astype(float), values.astype(float), atol=1e-6), name
    uv = np.stack([written["s"], written["t"]], axis=1)
    assert uv.min() >= 0 and uv.max() <= 1 and np.ptp(uv, axis=0).max() > 0.5


def test_ply_of_points_is_read_back_with_its_map(run_script, tmp_path, addon):
    """What unwrap.py writes is what render.py, and unwrap.py itself, can go on with."""
    source = tmp_path / "scan.ply"
    write_ascii_ply(source, scan_columns(sheet_points()))
    assert run_script("unwrap.py", source, "-o", "out").returncode == 0
    written = read_ply(tmp_path / "out/scan.ply")
    (obj,) = addon("asset_io").load(tmp_path / "out/scan.ply")
    assert np.array_equal(point_map(obj), np.stack([written["s"], written["t"]], axis=1))
    done = run_script("unwrap.py", tmp_path / "out/scan.ply", "-o", "again", "--report", "r.json")
    assert done.returncode == 0, done.stdout
    assert json.loads((tmp_path / "r.json").read_text())["assets"][0]["objects"][0]["uv_maps"] == ["UVMap"]
    assert (tmp_path / "again/scan.ply").read_bytes() == (tmp_path / "out/scan.ply").read_bytes()


def test_blend_with_a_mesh_and_clouds(run_script, files, tmp_path):
    cube("Box")
    vertices_only(name="Loose")
    point_cloud(name="Cloud")
    source = files("mixed.blend")
    done = run_script("unwrap.py", source, "-o", "out", "--report", "r.json")
    assert done.returncode == 0, done.stdout
    entries = json.loads((tmp_path / "r.json").read_text())["assets"][0]["objects"]
    assert [(entry["kind"], entry["names"]) for entry in entries] == [
        ("surface", ["Box"]),
        ("cloud", ["Cloud"]),
        ("cloud", ["Loose"]),
    ]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/mixed.blend"))
    assert_good(bpy.data.objects["Box"])
    assert_points_mapped(bpy.data.objects["Loose"])
    assert_points_mapped(bpy.data.objects["Cloud"])


def test_point_cloud_to_ply_is_written_where_it_is(addon, files, tmp_path):
    """Blender's own exporter writes no point of a point cloud; places are those in the world."""
    obj = point_cloud()
    obj.location = (1, 2, 3)
    obj.scale = (2, 2, 2)
    source = files("cloud.blend")
    assert addon("batch").main([str(source), "-o", str(tmp_path / "cloud.ply")]) == 0
    written = read_ply(tmp_path / "cloud.ply")
    places = np.stack([written[axis] for axis in "xyz"], axis=1)
    assert np.allclose(places, place_of_points(bpy.data.objects["Cloud"]) * 2 + (1, 2, 3), atol=1e-5)
    assert {"s", "t"} <= set(written)


@pytest.mark.parametrize("name", ["points.obj", "points.glb"])
def test_formats_that_keep_no_uvs_of_points(addon, files, tmp_path, capsys, name):
    vertices_only()
    if name.endswith("glb"):
        source = tmp_path / name
        bpy.ops.export_scene.gltf(filepath=str(source), export_format="GLB", use_mesh_vertices=True)
    else:
        source = files(name)
    batch = addon("batch")
    assert batch.main([str(source), "-o", str(tmp_path / "out")]) == 1
    assert "files cannot store UVs of points: use --format blend or ply" in capsys.readouterr().err
    assert not list((tmp_path / "out").glob("*"))
    assert batch.main([str(source), "-o", str(tmp_path / "out"), "--format", "ply"]) == 0
    assert len(read_ply(tmp_path / "out/points.ply")["s"]) == 400


def test_clouds_are_left_out_beside_a_mesh_where_the_format_cannot_keep_them(addon, files, tmp_path, capsys):
    cube("Box")
    vertices_only(name="Loose")
    source = files("mixed.blend")
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out"), "--format", "obj"]) == 0
    assert "note: Loose: left out" in capsys.readouterr().out
    assert_good(bpy.data.objects["Box"])
    assert attribute_names(bpy.data.objects["Loose"]) == []


def test_several_clouds_in_one_ply_are_refused(addon, files, tmp_path, capsys):
    vertices_only(name="A")
    vertices_only(name="B")
    source = files("two.blend")
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out"), "--format", "ply"]) == 1
    assert "use --format blend" in capsys.readouterr().err


def test_fewer_than_4_points_is_1(run_script, tmp_path):
    source = tmp_path / "three.ply"
    write_ascii_ply(source, scan_columns(sheet_points(2)[:3]))
    done = run_script("unwrap.py", source, "-o", "out")
    assert done.returncode == 1, done.stdout
    assert "has 3 points; a map needs at least 4" in done.stdout and "Traceback" not in done.stdout


def test_points_that_are_not_finite_are_4(addon, files, tmp_path):
    points = sheet_points()
    points[9] = np.nan
    vertices_only(points)
    source = files("nan.blend")
    report = tmp_path / "r.json"
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out"), "--report", str(report)]) == 4
    entry = json.loads(report.read_text())["assets"][0]["objects"][0]
    assert entry["certificate"]["violations"] == ["1 point without UVs: not finite"]
    assert entry["measured"]["points_mapped"] == 399


def test_resume_skips_clouds_that_are_done(addon, tmp_path, capsys):
    source = tmp_path / "scan.ply"
    write_ascii_ply(source, scan_columns(sheet_points()))
    batch = addon("batch")
    arguments = [str(source), "-o", str(tmp_path / "out"), "--report", str(tmp_path / "r.json"), "--resume"]
    for expected in (False, True):
        assert batch.main(arguments) == 0
        assert ("done already" in capsys.readouterr().out) is expected
    assert batch.main([*arguments, "--neighbours", "9"]) == 0
    assert "done already" not in capsys.readouterr().out


def test_compare_option_measures_meshes_only(addon, files, tmp_path):
    cube("Box")
    vertices_only(name="Loose")
    source = files("mixed.blend")
    report = tmp_path / "r.json"
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out"), "--compare", "--report", str(report)]) == 0
    box, loose = json.loads(report.read_text())["assets"][0]["objects"]
    assert "baseline_smart_uv" in box and "baseline_smart_uv" not in loose


def test_batch_result_equals_the_operators(addon, files, tmp_path):
    obj = vertices_only()
    source = files("a.blend")
    select(obj)
    bpy.ops.uv.ble_unwrap()
    expected = point_map(obj).copy()
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out")]) == 0
    assert np.array_equal(point_map(bpy.data.objects["Points"]), expected)


@pytest.mark.parametrize("make", [vertices_only, point_cloud])
def test_render_script(run_script, files, tmp_path, make):
    obj = make()
    bpy.ops.uv.ble_unwrap()
    assert attribute_names(obj) == ["UVMap"]
    source = files("cloud.blend")
    done = run_script("render.py", source, "-o", "p.png", "--size", "96", "64", "--samples", "1", "--cells", "4")
    assert done.returncode == 0, done.stdout
    image = bpy.data.images.load(str(tmp_path / "p.png"))
    pixels = np.array(image.pixels[:]).reshape(64, 96, -1)[:, :, :3]
    corner, middle = pixels[:6, :6].reshape(-1, 3), pixels[24:40, 36:60].reshape(-1, 3)
    assert np.ptp(corner, axis=0).max() < 0.1, "the background is even and the cloud within the picture"
    assert np.ptp(middle, axis=0).max() > 0.15, "the checker shows"


def test_render_without_a_map_is_1(run_script, files):
    vertices_only()
    done = run_script("render.py", files("a.blend"), "-o", "picture.png")
    assert done.returncode == 1 and "has no UV map" in done.stdout, done.stdout


@pytest.mark.parametrize(
    "text", [b"", b"ply\n", b"ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nend_header\n"]
)
def test_extras_of_a_broken_file_are_none(addon, tmp_path, text):
    path = tmp_path / "broken.ply"
    path.write_bytes(text)
    assert addon("point_file").read_extras(path, 5) == (None, None)


@pytest.mark.parametrize(("kind", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
def test_extras_of_binary_files(addon, tmp_path, kind, order):
    rows = np.zeros(3, [("x", order + "f8"), ("flags", "u1"), ("u", order + "f4"), ("v", order + "f4")])
    rows["u"], rows["v"] = (0, 0.25, 0.5), (1, 0.75, 0.5)
    head = f"ply\nformat {kind} 1.0\nelement vertex 3\nproperty double x\nproperty uchar flags\n"
    head += "property float u\nproperty float v\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
    path = tmp_path / "extras.ply"
    path.write_bytes(head.encode() + rows.tobytes())
    uv, normals = addon("point_file").read_extras(path, 3)
    assert uv.tolist() == [[0, 1], [0.25, 0.75], [0.5, 0.5]] and normals is None
    assert addon("point_file").read_extras(path, 4) == (None, None)
