"""The native module as Python sees it: arrays, settings, exceptions, jobs. No Blender, and no mathematics, which the
core tests itself."""

import array
import ast
import ctypes
import gc
import io
import subprocess
import sys
import tomllib
from pathlib import Path

import ble_unwrap_native as native
import numpy as np
import pytest
from conftest import grid
from native_calls import arrays, submit, unwrap
from numpy.testing import assert_array_equal

HERE = Path(__file__).parent


# Results ------------------------------------------------------------------------------------------------------------


def test_shapes_and_dtypes(ball):
    _, corners, offsets = ball
    uv, chart = arrays(unwrap(*ball))
    assert uv.shape == (len(corners), 2) and uv.dtype == np.float32
    assert chart.shape == (len(offsets) - 1,) and chart.dtype == np.int32
    assert np.isfinite(uv).all() and uv.min() >= 0 and uv.max() <= 1
    assert chart.min() == 0 and set(chart) == set(range(chart.max() + 1))


def test_report_describes_the_result(ball):
    atlas = native.unwrap(*ball)
    report = atlas.report
    assert report["charts"] == np.asarray(atlas.chart).max() + 1
    assert report["unmapped_faces"] == report["flips"] == report["overlaps"] == 0
    assert 1 <= report["l2"] <= report["l2_worst_chart"] <= 1.1 + 1e-6
    assert 0 < report["packing_efficiency"] <= 1
    assert report["charts_over_limit"] in (0, [])
    for key in ("l2_chart_scale", "l_infinity", "angle_distortion", "area_distortion", "seam_length"):
        assert np.isfinite(report[key]), key
    assert report["seam_length_absolute"] > 0 and report["gap_texels"] >= 4 - 1e-3
    assert isinstance(report["rungs"], dict) and isinstance(report["warnings"], list)
    assert "Atlas(" in repr(atlas)


def test_every_atlas_carries_its_proof(hill):
    atlas = unwrap(*hill, margin=7, texture_size=512)
    proof = atlas.certificate
    assert proof["valid"] is True and proof["complete"] is True and proof["charts"] == atlas.report["charts"]
    broken = ("out_of_range", "flipped", "crossings_inside", "crossings_between", "nested", "bad_loops")
    assert all(proof[name] == 0 for name in broken) and proof["faulty_charts"] == []
    assert proof["margin_texels"] == 7 and proof["gap_texels"] >= 7


def test_a_square_is_unwrapped_without_distortion(square):
    atlas = unwrap(*square)
    assert atlas.report["charts"] == 1
    assert atlas.report["l2"] == pytest.approx(1, abs=1e-6)


def test_results_are_views_of_rust_memory(hill):
    atlas = unwrap(*hill)
    first, second = np.asarray(atlas.uv), np.asarray(atlas.uv)
    assert np.shares_memory(first, second), "asarray copied"
    assert not first.flags.owndata and not first.flags.writeable and first.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 0
    copy = np.array(atlas.uv)
    copy[0] = 0.5
    assert not np.shares_memory(copy, first)


def test_views_keep_the_memory_alive(hill):
    atlas = unwrap(*hill)
    expected = np.array(atlas.uv)
    view = np.asarray(atlas.uv)
    del atlas
    gc.collect()
    noise = [np.random.default_rng(i).random(expected.shape, np.float32) for i in range(50)]
    assert_array_equal(view, expected)
    del noise


def test_result_buffers_are_well_formed(hill):
    atlas = unwrap(*hill)
    view = memoryview(atlas.uv)
    assert (view.format, view.itemsize, view.ndim, view.readonly) == ("f", 4, 2, True)
    assert view.shape == atlas.uv.shape == (len(atlas.uv), 2) and view.strides == (8, 4)
    assert atlas.uv.format == "f" and atlas.chart.format == "i"
    assert bytes(atlas.chart) == np.asarray(atlas.chart).tobytes()
    assert repr(atlas.chart) == f'Array(format="i", shape=({len(atlas.chart)},))'
    with pytest.raises(TypeError, match="read-write"):
        io.BytesIO(b"12345678").readinto(atlas.uv)
    with pytest.raises(TypeError):
        native.Array()


def test_an_empty_mesh_gives_an_empty_atlas():
    uv, chart = arrays(native.unwrap(np.zeros((0, 3)), np.zeros(0, np.int32), np.zeros(1, np.int32)))
    assert uv.shape == (0, 2) and chart.shape == (0,)


# Arrays in ----------------------------------------------------------------------------------------------------------


def variants(mesh):
    positions, corners, offsets = mesh
    yield "int64", (positions, corners.astype(np.int64), offsets.astype(np.int64))
    yield "unsigned", (positions, corners.astype(np.uint32), offsets.astype(np.uint64))
    yield "memoryview", (memoryview(positions), memoryview(corners), memoryview(offsets))
    yield "array.array", (positions, array.array("i", corners), array.array("i", offsets))
    yield "ctypes", (positions, (ctypes.c_int32 * len(corners))(*corners), offsets)
    yield "fortran order", (np.asfortranarray(positions), corners, offsets)
    padded = np.zeros((len(positions), 5))
    padded[:, 1:4] = positions
    yield "strided", (padded[:, 1:4], np.repeat(corners, 2)[::2], offsets[::-1].copy()[::-1])
    record = np.zeros(len(positions), np.dtype([("tag", "u1"), ("p", "<f8", 3)]))
    record["p"] = positions
    yield "unaligned", (record["p"], corners, offsets)
    frozen = positions.copy()
    frozen.flags.writeable = False
    yield "read-only", (frozen, corners, offsets)


def test_any_buffer_gives_the_same_result(hill):
    expected = arrays(unwrap(*hill))
    for name, mesh in variants(hill):
        found = arrays(unwrap(*mesh))
        assert_array_equal(found[0], expected[0], err_msg=name)
        assert_array_equal(found[1], expected[1], err_msg=name)


def test_float32_positions(hill):
    positions, corners, offsets = hill
    single = positions.astype(np.float32)
    expected = arrays(unwrap(single.astype(np.float64), corners, offsets))
    assert_array_equal(arrays(unwrap(single, corners, offsets))[0], expected[0])


SQUARE = grid(1, 1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"positions": SQUARE[0].tolist()},
            "positions: expected a float32 or float64 array of shape (n, 3), found list; pass a numpy array",
        ),
        (
            {"positions": SQUARE[0][:, :2]},
            "positions: expected a float32 or float64 array of shape (n, 3), found ndarray of float64 and shape (4, 2)",
        ),
        ({"positions": SQUARE[0].ravel()}, "of shape (n, 3), found ndarray of float64 and shape (12,)"),
        ({"positions": SQUARE[0].astype(np.float16)}, "found ndarray of float16 and shape (4, 3)"),
        ({"positions": SQUARE[0].astype(np.int32)}, "expected a float32 or float64 array"),
        ({"positions": SQUARE[0].astype(">f8")}, "found ndarray of >f8 and shape (4, 3)"),
        ({"positions": SQUARE[0].astype(object)}, "positions: expected a float32 or float64 array"),
        ({"positions": np.zeros((4, 3), "S0")}, "positions: expected a float32 or float64 array"),
        ({"positions": np.array(1.0)}, "of shape (n, 3), found ndarray"),
        ({"positions": None}, "found NoneType; pass a numpy array"),
        (
            {"corner_vertices": SQUARE[1].astype(np.float32)},
            "corner_vertices: expected an int32 or int64 array of shape (c,), found ndarray of float32 and shape (4,)",
        ),
        ({"corner_vertices": SQUARE[1].astype(bool)}, "corner_vertices: expected"),
        ({"corner_vertices": b"abcd"}, "found bytes of format 'B' and shape (4,)"),
        ({"corner_vertices": SQUARE[1].reshape(1, 4)}, "of shape (c,), found ndarray of int32 and shape (1, 4)"),
        (
            {"corner_vertices": np.array([0, 1, 2, 2**31])},
            "corner_vertices[3]: expected an index of 32 bits, found 2147483648",
        ),
        ({"face_offsets": [0, 4]}, "face_offsets: expected an int32 or int64 array of shape (f + 1,), found list"),
        (
            {"corner_triangles": np.zeros((1, 4), np.int32)},
            "corner_triangles: expected an int32 or int64 array of shape",
        ),
        ({"seams": np.zeros((1, 3), np.int32)}, "of shape (s, 2), found ndarray of int32 and shape (1, 3)"),
        ({"seams": np.array([[0, -(2**40)]])}, "seams[0, 1]: expected an index of 32 bits, found -1099511627776"),
        (
            {"seams": np.broadcast_to(np.int32(0), (2**33, 2))},
            "seams: expected at most 2147483647 rows that fit in memory, found shape (8589934592, 2)",
        ),
    ],
)
@pytest.mark.parametrize("call", [native.unwrap, native.submit_unwrap])
def test_wrong_arrays_are_named(call, change, message):
    arguments = dict(zip(("positions", "corner_vertices", "face_offsets"), SQUARE, strict=True)) | change
    with pytest.raises(native.InvalidArgumentError) as raised:
        call(**arguments)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("change", "element"),
    [
        ({"corner_vertices": np.array([0, 1, 3, 4], np.int32)}, "corner 3"),
        ({"corner_vertices": np.array([0, -1, 3, 2], np.int32)}, "vertex -1"),
        ({"face_offsets": np.array([0, 2, 4], np.int32)}, "face 0"),
        ({"face_offsets": np.array([0, 5], np.int32)}, "5"),
        ({"face_offsets": np.array([], np.int32)}, "offsets"),
        ({"corner_triangles": np.array([[0, 1, 2], [0, 2, 9]], np.int32)}, "triangle 1"),
        ({"seams": np.array([[0, 1], [1, 7]], np.int32)}, "seam 1"),
        ({"positions": np.full((4, 3), np.nan)}, "finite"),
    ],
)
def test_wrong_meshes_are_named(change, element):
    arguments = dict(zip(("positions", "corner_vertices", "face_offsets"), SQUARE, strict=True)) | change
    with pytest.raises(native.InvalidMeshError, match=element):
        native.unwrap(**arguments)
    job = native.submit_unwrap(**arguments)
    for _ in range(2):
        with pytest.raises(native.InvalidMeshError, match=element):
            job.result()
    assert job.is_finished() and not job.is_cancelled()


def test_the_arrays_are_copied_before_the_call_returns(hill):
    expected = arrays(unwrap(*hill))
    scratch = [a.copy() for a in hill]
    job = submit(*scratch)
    for a in scratch:
        a.fill(0)
    assert_array_equal(arrays(job.result())[0], expected[0])


def test_exceptions_are_one_tree():
    kinds = [native.InvalidMeshError, native.InvalidArgumentError, native.Cancelled]
    kinds += [native.UnprovenError, native.InternalError]
    assert issubclass(native.BleUnwrapError, Exception)
    for kind in kinds:
        assert kind.__bases__ == (native.BleUnwrapError,) and kind.__doc__
        assert kind.__module__ == "ble_unwrap_native"


# Settings -----------------------------------------------------------------------------------------------------------


def test_defaults_are_those_of_the_design():
    found = native.default_settings()
    expected = {
        "preset": "default",
        "stretch_limit": 1.1,
        "holes": "keep",
        "geodesics": "fast_marching",
        "landmark_fraction": 0.01,
        "landmark_min": 48,
        "landmark_max": 64,
        "model": "default",
        "relaxation": 1.6,
        "max_sweeps": 60,
        "tolerance": 1e-5,
        "update": "serial",
        "initial": "mds",
        "stretch_solver": "newton",
        "margin": 4.0,
        "texture_size": (2048, 2048),
        "rotation": "aligned",
        "threads": 0,
    }
    assert {key: found[key] for key in expected} == expected
    paper = native.default_settings("paper")
    assert paper.keys() == found.keys()
    expected = {
        "preset": "paper",
        "model": "paper",
        "holes": "cut",
        "stretch_solver": "line_search",
        "initial": "random",
    }
    assert {key: paper[key] for key in expected} == expected
    assert paper["landmark_max"] is None and paper["margin"] == 2 and paper["texture_size"] == (1024, 1024)


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_settings_go_round(hill, preset):
    all_of_them = native.default_settings(preset) | {"texture_size": 64}
    spelled = arrays(native.unwrap(*hill, **all_of_them))
    named = arrays(native.unwrap(*hill, preset=preset, texture_size=64))
    assert_array_equal(spelled[0], named[0])
    assert_array_equal(spelled[1], named[1])


def test_a_given_setting_beats_the_preset(ball):
    strict = unwrap(*ball, preset="default", stretch_limit=1.004).report
    loose = unwrap(*ball, stretch_limit=1.3).report
    assert strict["seam_length"] > loose["seam_length"]
    assert strict["l2_worst_chart"] <= 1.004 + 1e-6


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("stretch_limit", 1, "stretch_limit: expected a number above 1 and at most 1000; found 1"),
        ("stretch_limit", float("nan"), "found nan"),
        ("stretch_limit", "1.1", "found '1.1'"),
        ("weld", "yes", "weld: expected True or False; found 'yes'"),
        ("weld_distance", -1, "or None for what single precision cannot tell apart; found -1"),
        ("weld_distance", float("inf"), "weld_distance: expected a number at least 0, or None"),
        ("weld_distance", float("nan"), "found nan"),
        ("seed", -1, "seed: expected a whole number from 0 to 18446744073709551615; found -1"),
        ("seed", 1.5, "found 1.5"),
        ("seed", True, "found True"),
        ("holes", "fill", "holes: expected 'keep' or 'cut'; found 'fill'"),
        ("model", 3, "model: expected 'default', 'paper' or 'isomap'; found 3"),
        ("preset", "best", "preset: expected 'default', 'paper', 'iso_charts' or 'lightmap'; found 'best'"),
        ("kernel_width", 0, "or None for the model's own; found 0"),
        ("landmark_min", 2, "landmark_min: expected a whole number from 3 to 100000; found 2"),
        ("landmark_max", 1, "or None for no limit; found 1"),
        ("relaxation", 2, "relaxation: expected a number above 0 and below 2; found 2"),
        ("margin", -0.5, "margin: expected a number at least 0 and at most 1024; found -0.5"),
        ("texture_size", 0, "texture_size: expected a whole number from 1 to"),
        ("texture_size", (512, 0), "texels, or a pair of them; found (512, 0)"),
        ("texture_size", (1, 2, 3), "found (1, 2, 3)"),
        ("threads", 5000, "threads: expected a whole number from 0 to 1024; found 5000"),
    ],
)
def test_wrong_settings_are_named(square, name, value, message):
    with pytest.raises(native.InvalidArgumentError) as raised:
        native.unwrap(*square, **{name: value})
    assert message in str(raised.value)


def test_unknown_settings_are_named_with_near_ones(square):
    with pytest.raises(native.InvalidArgumentError) as raised:
        unwrap(*square, strech_limit=1.2)
    assert str(raised.value).startswith("unwrap() has no setting 'strech_limit'; did you mean 'stretch_limit'")
    with pytest.raises(native.InvalidArgumentError, match=r"the settings are preset, stretch_limit, .*, threads"):
        unwrap(*square, zzz=1)
    with pytest.raises(native.InvalidArgumentError, match=r"pack\(\) has no setting 'stretch_limit'"):
        native.pack(np.zeros((0, 2)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32), stretch_limit=1.2)
    presets = "'default', 'paper', 'iso_charts' or 'lightmap'"
    with pytest.raises(native.InvalidArgumentError, match=f"preset: expected {presets}"):
        native.default_settings("artist")


def test_settings_that_contradict_each_other_are_named(square):
    with pytest.raises(native.InvalidArgumentError, match="landmark_max"):
        unwrap(*square, landmark_min=100, landmark_max=50)


# The single steps ---------------------------------------------------------------------------------------------------


def test_measure_agrees_with_the_report_of_unwrap(ball):
    atlas = native.unwrap(*ball, texture_size=256, margin=2)
    measured = native.measure(*ball, atlas.uv, texture_size=256, margin=2)
    for key in ("charts", "faces", "unmapped_faces", "flips", "bent_quads", "overlaps"):
        assert measured[key] == atlas.report[key], key
    for key in ("l2", "l2_chart_scale", "l2_worst_chart", "l_infinity", "angle_distortion", "area_distortion"):
        assert measured[key] == pytest.approx(atlas.report[key], rel=1e-9), key
    for key in ("seam_length", "seam_length_absolute", "packing_efficiency", "gap_texels"):
        assert measured[key] == pytest.approx(atlas.report[key], rel=1e-9), key
    assert len(measured["chart_l2"]) == measured["charts"] and measured["islands"] <= measured["charts"]
    assert measured["triangles"] == 24 * (2 + 2 * 14)
    assert measured["overlaps_complete"] and measured["gap_complete"]


def test_measure_knows_a_bad_layout(square):
    positions, corners, offsets = grid(2, 1)
    uv = positions[corners, :2].astype(np.float32)
    good = native.measure(positions, corners, offsets, uv)
    assert (good["charts"], good["flips"], good["overlaps"], good["unmapped_faces"]) == (1, 0, 0, 0)
    assert good["l2"] == pytest.approx(1) and good["packing_efficiency"] == pytest.approx(1)
    assert good["bent_quads"] == 0
    bent = uv.copy()
    bent[2] = [0.4, 0.4] @ np.stack([uv[1] - uv[0], uv[3] - uv[0]]) + uv[0]
    assert native.measure(positions, corners, offsets, bent)["bent_quads"] == 1
    np.testing.assert_allclose(good["uv_box"], [[0, 0], [1, 1]])
    stacked = uv.copy()
    stacked[4:] = uv[:4]
    on_top = native.measure(positions, corners, offsets, stacked)
    assert on_top["charts"] == 2 and on_top["overlaps"] > 0 and on_top["seam_length_absolute"] == pytest.approx(1)
    uv[5] = np.nan
    assert native.measure(positions, corners, offsets, uv)["unmapped_faces"] == 1
    assert native.measure(positions, corners, offsets, stacked, chart=np.array([0, -1]))["unmapped_faces"] == 1
    with pytest.raises(native.InvalidArgumentError, match="there are 3 UVs, but 4 corners"):
        native.measure(*square, np.zeros((3, 2)))
    with pytest.raises(native.InvalidArgumentError, match=r"uv: expected a float32 or float64 array of shape \(c, 2\)"):
        native.measure(*square, np.zeros((4, 3)))
    with pytest.raises(native.InvalidArgumentError, match="there are 2 chart numbers, but 1 faces"):
        native.measure(*square, np.zeros((4, 2)), chart=np.zeros(2, np.int32))


def test_measure_says_which_faces_its_numbers_are_from():
    positions, corners, offsets = grid(4, 4)
    uv = positions[corners, :2].astype(np.float32)
    right = uv[:, 0] > 0.75
    uv[right, 0] = 1.5 - uv[right, 0]  # the last column of faces is folded back over the one before it
    uv[0] = np.nan
    uv[4 * 13 : 4 * 14, 1] = 0.75  # nothing but a line
    plain = native.measure(positions, corners, offsets, uv)
    found = native.measure(positions, corners, offsets, uv, by_face=True)
    faces = {name: np.asarray(found.pop(name)) for name in set(found) - set(plain)}
    assert found.keys() == plain.keys() and repr(found) == repr(plain)
    assert all(array.dtype == np.int32 for array in faces.values())
    chart = faces.pop("face_chart")
    assert chart.shape == (16,) and np.flatnonzero(chart < 0).tolist() == [0]
    assert chart.max() == found["charts"] - 1
    assert {name: numbers.tolist() for name, numbers in faces.items()} == {
        "flipped_faces": [3, 7, 11, 15],
        "overlapping_faces": [2, 3, 6, 7, 10, 11, 14, 15],
        "collapsed_faces": [13],
    }
    assert (found["flips"], found["uv_degenerate_triangles"]) == (8, 2)


def test_pack_keeps_shapes_and_the_margin():
    count, size, margin = 12, (256, 128), 3.0
    sides = 0.5 + np.arange(count) / count
    points = (np.array([[0, 0], [1, 0], [1, 2], [0, 2]]) * sides[:, None, None]).reshape(-1, 2)
    triangles = (np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(count)[:, None, None]).reshape(-1, 3)
    chart = np.repeat(np.arange(count), 2)
    packed = native.pack(points, triangles, chart, texture_size=size, margin=margin, rotation="quarter")
    uv = np.asarray(packed.uv)
    assert uv.shape == (4 * count, 2) and uv.dtype == np.float32 and uv.min() >= 0 and uv.max() <= 1
    texels = (uv * size).reshape(count, 4, 2)
    scale = packed.report["texels_per_unit"]
    np.testing.assert_allclose(np.linalg.norm(texels[:, 1] - texels[:, 0], axis=1), sides * scale, rtol=1e-4)
    low, high = texels.min(1), texels.max(1)
    for a in range(count):
        for b in range(a):
            apart = np.maximum(low[a] - high[b], low[b] - high[a])
            assert np.linalg.norm(np.maximum(apart, 0)) >= margin - 1e-3, (a, b)
    covered = (2 * (sides * scale) ** 2).sum() / (size[0] * size[1])
    assert packed.report["packing_efficiency"] == pytest.approx(covered, rel=1e-3)
    assert covered > 0.6 and packed.report["charts"] == count and packed.report["texture_size"] == size


def test_pack_names_what_is_wrong():
    points = np.zeros((3, 2))
    with pytest.raises(
        native.InvalidArgumentError, match="triangle 0 names point 3, but the points are numbered 0 to 3"
    ):
        native.pack(points, np.array([[0, 1, 3]]), np.array([0]))
    with pytest.raises(native.InvalidArgumentError, match="point 0 belongs to charts 0 and 1"):
        native.pack(points, np.array([[0, 1, 2], [0, 1, 2]]), np.array([0, 1]))
    with pytest.raises(native.InvalidArgumentError, match="there are 2 chart numbers, but 1 triangles"):
        native.pack(points, np.array([[0, 1, 2]]), np.array([0, 1]))
    triangle = np.array([[0.0, 0], [1, 0], [0, 1]])
    with pytest.raises(native.InvalidArgumentError, match="margin"):
        native.pack(triangle, np.array([[0, 1, 2]]), np.array([0]), texture_size=8, margin=100)


def test_single_steps_take_a_job(hill):
    positions, corners, _offsets = hill
    triangles, chart = np.array([[0, 1, 2]]), np.array([0])
    calls = [
        lambda job: native.embed(positions, job=job),
        lambda job: native.geodesic_distances(*hill, np.array([0]), job=job),
        lambda job: native.measure(*hill, positions[corners, :2], job=job),
        lambda job: native.pack(np.eye(3)[:, :2], triangles, chart, texture_size=32, job=job),
    ]
    for call in calls:
        job = native.Job()
        result = call(job)
        assert job.result() is result and job.progress() == 1
        job = native.Job()
        job.cancel()
        with pytest.raises(native.Cancelled):
            call(job)


# The module itself --------------------------------------------------------------------------------------------------


def test_versions_agree():
    root = HERE.parent
    workspace = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))
    assert native.__version__ == workspace["workspace"]["package"]["version"]
    manifest = root / "addon/blender_manifest.toml"
    if manifest.exists():
        assert tomllib.loads(manifest.read_text(encoding="utf-8"))["version"] == native.__version__


def test_the_stub_describes_the_module(tmp_path):
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "ble_unwrap_native"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stub_lists_every_setting():
    """Settings are keywords of one dictionary at run time, which stubtest cannot see into."""
    package = HERE.parent / "native/ble_unwrap_native/python/ble_unwrap_native"
    stub = ast.parse((package / "__init__.pyi").read_text(encoding="utf-8"))
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}

    def fields(name):
        node = classes[name]
        own = {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
        return own.union(*(fields(base.id) for base in node.bases if base.id in classes))

    assert fields("_UnwrapSettings") == set(native.default_settings())
    functions = {
        "_EmbedSettings": lambda **settings: native.embed(np.zeros((1, 1)), **settings),
        "_GeodesicDistancesSettings": lambda **settings: native.geodesic_distances(*SQUARE, np.array([9]), **settings),
        "_MeasureSettings": lambda **settings: native.measure(*SQUARE, np.zeros((1, 2)), **settings),
        "_PackSettings": lambda **settings: native.pack(np.zeros((0, 2)), *[np.zeros((1, 3), int)] * 2, **settings),
    }
    for name, call in functions.items():
        for setting, value in native.default_settings().items():
            if (name, setting) == ("_EmbedSettings", "initial"):
                continue  # an argument of its own there
            with pytest.raises(native.InvalidArgumentError) as raised:
                call(**{setting: value})
            assert ("has no setting" in str(raised.value)) == (setting not in fields(name)), (name, setting)


def test_everything_is_documented():
    for name in native.__all__:
        if name != "__version__":
            assert getattr(native, name).__doc__, name
    for kind in (native.Job,):
        for name, member in vars(kind).items():
            assert name.startswith("_") or member.__doc__, name
