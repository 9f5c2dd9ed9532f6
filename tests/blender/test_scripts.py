"""The headless scripts: formats, reports, every exit code, nothing lost."""

import importlib.util
import json
import os
import sys
from pathlib import Path

import addon_loader
import bpy
import numpy as np
import pictures
import pytest
from scenes import add_mesh, assert_good, cube, grid, sphere, uvs


def test_all_fine_is_0(run_script, files, tmp_path):
    sphere()
    source = files("ball.blend")
    done = run_script("unwrap.py", source, "-o", "out", "--report", "report.json", "--margin", "6")
    assert done.returncode == 0, done.stdout
    report = json.loads((tmp_path / "report.json").read_text())
    asset = report["assets"][0]
    assert asset["status"] == "ok" and len(asset["sha256"]) == 64
    assert report["params"]["margin"] == 6
    assert report["summary"] == {"assets": 1, "ok": 1, "violated": 0, "failed": 0}
    entry = asset["objects"][0]
    assert entry["certificate"] == {"holds": True, "violations": []}
    assert entry["measured"]["overlaps"] == entry["measured"]["flips"] == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/ball.blend"))
    assert_good(bpy.data.objects["Sphere"])


@pytest.mark.parametrize("name", ["a.obj", "a.glb", "a.gltf", "a.ply", "a.stl", "a.fbx"])
def test_formats(run_script, files, tmp_path, addon, name):
    grid(5, bump=0.2)
    source = files(name)
    done = run_script("unwrap.py", source, "-o", "out", "--report", "r.json")
    assert done.returncode == 0, done.stdout
    out = json.loads((tmp_path / "r.json").read_text())["assets"][0]["out"]
    assert out.endswith({"a.gltf": "a.glb", "a.stl": "a.glb"}.get(name, name))
    objects = addon("asset_io").load(tmp_path / out)
    assert sum(len(obj.data.polygons) for obj in objects) in (25, 50)
    assert_good(objects[0])
    assert not list((tmp_path / "out").glob(".*")), "no temporary files are left"


@pytest.mark.parametrize("name", ["a.obj", "a.blend"])
def test_context_names_no_freed_scene_after_a_load(run_script, files, tmp_path, name):
    """Else the glTF exporter, which sets a property through the context, may crash Blender. In a process of its own:
    the owner that is noted here would outlive this test's scene."""
    grid(3)
    source = files(name)
    script = tmp_path / "load.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(Path(addon_loader.__file__).parent)!r})\n"
        "import addon_loader, bpy\n"
        "asset_io = addon_loader.load('asset_io')\n"
        "_ = bpy.context.tool_settings  # in Blender 4.2 this makes the scene the owner of the context\n"
        f"asset_io.load({str(source)!r})\n"
        "addon_loader.leave(0 if bpy.context.id_data in (None, bpy.context.scene) else 5)\n"
    )
    done = run_script(script)
    assert done.returncode == 0, done.stdout


def test_split_glb_is_charted_across_its_seams(run_script, files, tmp_path):
    """A file whose vertices are split at every face still gives one chart for a sheet."""
    obj = grid(5)
    uvs_of = obj.data.uv_layers.new(name="split").uv
    uvs_of.foreach_set("vector", np.random.default_rng(1).random(2 * len(obj.data.loops)).astype(np.float32))
    source = files("split.glb")
    done = run_script("unwrap.py", source, "-o", "out", "--report", "r.json")
    assert done.returncode == 0, done.stdout
    measured = json.loads((tmp_path / "r.json").read_text())["assets"][0]["objects"][0]["measured"]
    assert measured["charts"] == 1


def test_files_weld_the_last_digits_of_coordinates_and_a_distance_that_is_given(run_script, files, tmp_path):
    """STL repeats its vertices at every triangle; programs that transform them first do not repeat every digit."""
    obj = grid(5, bump=0.1)
    corners = np.array([obj.data.vertices[v].co for face in obj.data.polygons for v in face.vertices])
    for name, noise in (("digits", 1e-7), ("coarse", 1e-3)):
        bpy.data.meshes.remove(obj.data)
        noise = np.random.default_rng(4).normal(0, noise, corners.shape)
        obj = add_mesh(name, corners + noise, np.arange(len(corners)).reshape(-1, 4))
        source = files(f"{name}.stl")
        given = [] if name == "digits" else ["--weld-distance", "0.01"]
        done = run_script("unwrap.py", source, "-o", "out", "--report", f"{name}.json", *given)
        assert done.returncode == 0, done.stdout
        measured = json.loads((tmp_path / f"{name}.json").read_text())["assets"][0]["objects"][0]["measured"]
        assert measured["charts"] == 1, name


def test_some_failed_is_1_and_the_others_are_written(run_script, files, tmp_path):
    cube()
    good = files("good.obj")
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"not a mesh at all")
    done = run_script("unwrap.py", good, bad, tmp_path / "missing.obj", "-o", "out", "--report", "r.json")
    assert done.returncode == 1, done.stdout
    assert "no such file" in done.stdout
    assert "Traceback" not in done.stdout.split("missing.obj")[-1]
    assert (tmp_path / "out/good.obj").is_file()
    statuses = [asset["status"] for asset in json.loads((tmp_path / "r.json").read_text())["assets"]]
    assert statuses == ["ok", "failed", "failed"]


def test_file_of_edges_alone_is_1(run_script, tmp_path):
    path = tmp_path / "wire.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n")
    done = run_script("unwrap.py", path, "-o", "out")
    assert done.returncode == 1, done.stdout
    assert "Traceback" not in done.stdout
    assert "holds no faces and no points" in done.stdout


def test_vertex_that_is_not_finite(run_script, files, tmp_path):
    obj = grid()
    obj.data.vertices[3].co.y = float("nan")
    source = files("nan.blend")
    done = run_script("unwrap.py", source, "-o", "out", "--report", "r.json")
    asset = json.loads((tmp_path / "r.json").read_text())["assets"][0]
    assert "Traceback" not in done.stdout
    assert (done.returncode, asset["status"]) in {(1, "failed"), (4, "violated")}
    assert "finite" in done.stdout


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="needs a user who may not write everywhere")
def test_directory_without_permission_is_1(run_script, files, tmp_path):
    cube()
    source = files("a.obj")
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    done = run_script("unwrap.py", source, "-o", closed)
    assert done.returncode == 1, done.stdout
    assert "cannot write" in done.stdout


def test_output_that_cannot_be_a_directory_is_1(run_script, files, tmp_path):
    cube()
    source = files("a.obj")
    (tmp_path / "file").write_text("in the way")
    done = run_script("unwrap.py", source, "-o", tmp_path / "file" / "sub")
    assert done.returncode == 1, done.stdout
    assert "cannot write" in done.stdout and "Traceback" not in done.stdout
    assert (tmp_path / "file").read_text() == "in the way"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "required"),
        (("a.obj",), "required"),
        (("a.obj", "-o", "out", "--stretch-limit", "0.5"), "not between"),
        (("a.obj", "-o", "out", "--texture-size", "1", "2", "3"), "one or two numbers"),
        (("a.obj", "-o", "out", "--preset", "fast"), "invalid choice"),
        (("a.obj", "-o", "."), "overwritten by its own result"),
        (("a.obj", "b.obj", "-o", "one.obj"), "several inputs"),
        (("a.obj", "-o", "out.xyz"), "cannot write"),
    ],
)
def test_wrong_usage_is_2(run_script, files, arguments, message):
    cube()
    files("a.obj")
    done = run_script("unwrap.py", *arguments)
    assert done.returncode == 2, done.stdout
    assert message in done.stdout and "Traceback" not in done.stdout


def test_missing_library_is_3(run_script, files, tmp_path):
    cube()
    source = files("a.obj")
    done = run_script("unwrap.py", source, "-o", "out", environment={"BLENDER_USER_RESOURCES": str(tmp_path / "empty")})
    assert done.returncode == 3, done.stdout
    assert "native library" in done.stdout
    assert not (tmp_path / "out").exists()


def test_broken_promise_is_4(addon, monkeypatch, files, tmp_path, capsys):
    """A measurement with an overlap fails the asset's certificate; the file is written all the same."""
    cube()
    source = files("a.obj")
    measurement, batch = addon("measurement"), addon("batch")
    measure = measurement.measure
    monkeypatch.setattr(measurement, "measure", lambda *args, **kw: {**measure(*args, **kw), "overlaps": 2})
    code = batch.main([str(source), "-o", str(tmp_path / "out"), "--report", str(tmp_path / "r.json")])
    assert code == 4
    assert "2 overlapping pairs" in capsys.readouterr().err
    assert (tmp_path / "out/a.obj").is_file()
    assert json.loads((tmp_path / "r.json").read_text())["assets"][0]["status"] == "violated"


def test_help_lists_every_setting(run_script, addon):
    done = run_script("unwrap.py", "--help")
    assert done.returncode == 0
    for name in addon("properties").annotations():
        if name not in addon("batch.arguments").EXCLUDED_SETTINGS:
            assert "--" + name.replace("_", "-") in done.stdout


def test_resume_skips_what_is_done(addon, files, tmp_path, capsys):
    cube()
    source = files("a.obj")
    batch = addon("batch")
    arguments = [str(source), "-o", str(tmp_path / "out"), "--report", str(tmp_path / "r.json"), "--resume"]
    assert batch.main(arguments) == 0
    assert "done already" not in capsys.readouterr().out
    written = (tmp_path / "out/a.obj").stat().st_mtime_ns
    assert batch.main(arguments) == 0
    assert "done already" in capsys.readouterr().out
    assert (tmp_path / "out/a.obj").stat().st_mtime_ns == written
    assert batch.main([*arguments, "--seed", "4"]) == 0
    assert "done already" not in capsys.readouterr().out


def test_several_objects_one_atlas_or_one_each(addon, files, tmp_path):
    cube("A")
    sphere("B")
    source = files("two.blend")
    batch = addon("batch")
    for atlas, count in (("asset", 1), ("object", 2)):
        report = tmp_path / f"{atlas}.json"
        assert batch.main([str(source), "-o", str(tmp_path / atlas), "--atlas", atlas, "--report", str(report)]) == 0
        assert len(json.loads(report.read_text())["assets"][0]["objects"]) == count


def test_compare_option_leaves_no_trace_in_the_file(addon, files, tmp_path):
    cube()
    source = files("a.blend")
    report = tmp_path / "r.json"
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out"), "--compare", "--report", str(report)]) == 0
    entry = json.loads(report.read_text())["assets"][0]["objects"][0]
    assert entry["baseline_smart_uv"]["by_angle"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/a.blend"))
    assert [layer.name for layer in bpy.data.objects["Cube"].data.uv_layers] == ["UVMap"]


def test_batch_result_equals_the_operators(addon, files, tmp_path):
    obj = sphere()
    source = files("a.blend")
    bpy.ops.uv.ble_unwrap()
    expected = uvs(obj).copy()
    assert addon("batch").main([str(source), "-o", str(tmp_path / "out")]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out/a.blend"))
    assert np.array_equal(uvs(bpy.data.objects["Sphere"]), expected)


def test_compare_script(run_script, files, tmp_path):
    sphere()
    source = files("ball.obj")
    done = run_script("compare.py", source, "-o", "out", "--picture-size", "256")
    assert done.returncode == 0, done.stdout
    rows = json.loads((tmp_path / "out/compare.json").read_text())["models"]["ball"]
    assert set(rows) - {"xatlas"} == {"ble_unwrap", "smart_uv_best", "smart_uv_default"}
    assert ("xatlas" in rows) is ("no row by xatlas: xatlas is not installed" not in done.stdout)
    assert "BLE Unwrap" in done.stdout and "Smart UV" in done.stdout
    picture = pictures.read_png(tmp_path / "out/ball_layout.png")
    assert picture.shape[1] > 512 and picture.shape[0] > 256
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3
    assert (tmp_path / "out/ball.blend").is_file()


def test_scripts_weld_what_a_format_splits(run_script, files, tmp_path):
    """A .glb has every face of the sphere apart: the charts are those of the mesh all the same."""
    sphere()
    source = files("ball.glb")
    done = run_script("compare.py", source, "-o", "out", "--picture-size", "128", "--no-blend")
    assert done.returncode == 0, done.stdout
    assert json.loads((tmp_path / "out/compare.json").read_text())["models"]["ball"]["ble_unwrap"]["charts"] < 10
    done = run_script("contact_sheet_inside.py", source, "-o", "sheet.png", "--size", "64")
    assert done.returncode == 0, done.stdout
    assert json.loads((tmp_path / "sheet.json").read_text())["models"]["ball"]["charts"] < 10


XATLAS = """
import numpy as np

class ChartOptions: pass
class PackOptions: pass

class Atlas:
    # Every triangle a chart of its own, in a row of a texture four times as wide as high.
    atlas_count, width, height, utilization = 1, 400, 100, 0.5

    def add_mesh(self, positions, triangles):
        assert positions.dtype == np.float32 and triangles.dtype == np.uint32
        self.chart_count = len(triangles)

    def generate(self, charts, packing):
        assert packing.padding == 2 and packing.resolution == 2048

    def __getitem__(self, _number):
        left = np.arange(self.chart_count)[:, None] / self.chart_count
        x = left + np.array([0.1, 0.9, 0.1]) / self.chart_count
        uv = np.stack([x, np.broadcast_to([0.1, 0.1, 0.9], x.shape)], axis=-1).reshape(-1, 2).astype(np.float32)
        return None, np.arange(len(uv), dtype=np.uint32).reshape(-1, 3), uv
"""


@pytest.mark.skipif(importlib.util.find_spec("xatlas") is not None, reason="the one that is installed goes first")
def test_compare_script_with_xatlas(run_script, files, tmp_path):
    """The row is in the table and the report, measured on the triangles of the same objects."""
    cube()
    source = files("box.blend")
    (tmp_path / "library").mkdir()
    (tmp_path / "library/xatlas.py").write_text(XATLAS)
    arguments = ["compare.py", source, "-o", "out", "--picture-size", "128", "--no-blend"]
    done = run_script(*arguments, environment={"BLE_XATLAS_LIBRARY": str(tmp_path / "library")})
    assert done.returncode == 0, done.stdout
    report = json.loads((tmp_path / "out/compare.json").read_text())
    row = report["models"]["box"]["xatlas"]
    assert (row["charts"], row["faces"], row["texture_size"]) == (12, 12, [400, 100])
    assert row["overlaps"] == row["flips"] == 0 and report["left_out"] == {}
    assert any(line.split()[:2] == ["xatlas", "12"] for line in done.stdout.splitlines())
    (tmp_path / "library/xatlas.py").write_text("raise RuntimeError('broken')")
    done = run_script(*arguments, environment={"BLE_XATLAS_LIBRARY": str(tmp_path / "library")})
    assert done.returncode == 0 and "no row by xatlas: xatlas failed: RuntimeError: broken" in done.stdout
    report = json.loads((tmp_path / "out/compare.json").read_text())
    assert "xatlas" not in report["models"]["box"] and "broken" in report["left_out"]["box"]


def test_compare_script_without_pillow(run_script, files, tmp_path):
    """All but the picture is written, and a sentence says what to install."""
    cube()
    (tmp_path / "none/PIL").mkdir(parents=True)
    (tmp_path / "none/PIL/__init__.py").write_text("raise ImportError('none here')")
    arguments = [files("box.blend"), "-o", "out", "--no-blend"]
    done = run_script("compare.py", *arguments, environment={"PYTHONPATH": str(tmp_path / "none")})
    if "no pictures" not in done.stdout and not addon_loader.is_module():
        pytest.skip("a real Blender does not read PYTHONPATH")
    assert done.returncode == 0, done.stdout
    assert "no pictures" in done.stdout and "none here" in done.stdout and "pip install" in done.stdout
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["compare.json"]


def test_compare_script_names_what_failed(run_script, tmp_path):
    done = run_script("compare.py", "missing.obj", "-o", "out")
    assert done.returncode == 1
    assert "no such file" in done.stdout and "Traceback" not in done.stdout


def test_render_script(run_script, files, tmp_path):
    obj = sphere()
    bpy.ops.uv.ble_unwrap()
    assert obj.data.uv_layers.active
    source = files("ball.blend")
    done = run_script("render.py", source, "-o", "picture.png", "--size", "96", "64", "--samples", "1")
    assert done.returncode == 0, done.stdout
    image = bpy.data.images.load(str(tmp_path / "picture.png"))
    assert tuple(image.size) == (96, 64)
    pixels = np.array(image.pixels[:]).reshape(64, 96, -1)[:, :, :3]
    corner, middle = pixels[:6, :6].reshape(-1, 3), pixels[24:40, 36:60].reshape(-1, 3)
    assert np.ptp(corner, axis=0).max() < 0.1, "the background is even and the model within the picture"
    assert np.ptp(middle, axis=0).max() > 0.15, "the grid shows"


def test_render_without_uvs_is_1(run_script, files):
    cube()
    done = run_script("render.py", files("a.obj"), "-o", "picture.png")
    assert done.returncode == 1 and "has no UV map" in done.stdout, done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="no command entry to start there")
def test_command_entry(addon, tmp_path, files):
    """What `blender --command ble_unwrap` calls."""
    cube()
    source = files("a.obj")
    assert addon("command")._run([str(source), "-o", str(tmp_path / "out")]) == 0
    assert addon("command")._run([str(tmp_path / "none.obj"), "-o", str(tmp_path / "out")]) == 1
