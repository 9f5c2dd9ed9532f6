"""What the native module does when memory is short, when a measure cannot be had, and when results travel."""

import copy
import importlib
import pickle
import subprocess
import sys
import types
from pathlib import Path

import ble_unwrap_native as native
import numpy as np
import pytest
from conftest import grid, sphere
from native_calls import arrays, unwrap
from numpy.testing import assert_array_equal

# Memory -------------------------------------------------------------------------------------------------------------

UNDER_A_LIMIT = """
import hashlib, resource, sys
import numpy as np
import ble_unwrap_native as native
from conftest import sphere
mesh = sphere({segments}, {segments})
size = next(int(l.split()[1]) << 10 for l in open("/proc/self/status") if l.startswith("VmSize:"))
if {room}:
    resource.setrlimit(resource.RLIMIT_AS, (size + ({room} << 20),) * 2)
try:
    atlas = native.unwrap(*mesh, threads={threads})
except MemoryError as error:
    assert isinstance(error, native.OutOfMemoryError), type(error)
    print("refused", error)
else:
    print("made", hashlib.sha256(bytes(atlas.uv) + bytes(atlas.chart)).hexdigest())
"""


def unwrapped_within(room, segments=48, threads=2):
    """What is printed by a process that may take so many MiB of address space beyond those of its start; 0 for any."""
    command = [sys.executable, "-c", UNDER_A_LIMIT.format(room=room, segments=segments, threads=threads)]
    run = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parent, timeout=300)
    assert run.returncode == 0, f"{room} MiB: exit code {run.returncode}\n{run.stdout}{run.stderr[-2000:]}"
    return run.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space are set as Linux has them")
def test_memory_decides_whether_there_is_a_result_never_which():
    whole = unwrapped_within(0)
    assert whole.startswith("made")
    refused, made = [], []
    for room in (80, 120, 160, 240, 400, 700, 1000, 1400, 2000, 2400, 2800, 3600, 6000):
        found = unwrapped_within(room)
        if found.startswith("refused"):
            refused.append(room)
            assert "memory" in found and ("bytes" in found or "threads" in found)
        else:
            assert found == whole, f"{room} MiB: another result"
            made.append(room)
    assert refused and made and max(refused) < min(made)


@pytest.mark.skipif(sys.platform != "linux", reason="the platform tells what is left on Linux only")
@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda ball: native.geodesic_distances(*ball, np.zeros(2**31 - 1, np.int32)), "fewer sources"),
        (lambda ball: native.embed(np.random.default_rng(1).random((300_000, 3)), landmarks=None), "by landmarks"),
    ],
)
def test_what_no_machine_holds_is_refused_with_the_bytes(ball, call, text):
    with pytest.raises(native.BleUnwrapError, match=r"\([0-9]+ bytes\)") as refusal:
        call(ball)
    assert text in str(refusal.value)


def test_the_error_is_of_both_trees():
    assert issubclass(native.OutOfMemoryError, native.BleUnwrapError)
    assert issubclass(native.OutOfMemoryError, MemoryError)
    assert native.OutOfMemoryError.__module__ == "ble_unwrap_native" and native.OutOfMemoryError.__doc__


# Measures -----------------------------------------------------------------------------------------------------------


def test_stretch_that_cannot_be_measured_is_warned_of(square):
    positions, corners, offsets = grid(12, 12)
    report = unwrap(positions * [1e12, 1, 1], corners, offsets).report
    assert np.isfinite(report["l2"]) or any("could not be measured" in w for w in report["warnings"])
    assert not any("could not be measured" in w for w in unwrap(*square).report["warnings"])


def test_many_small_charts_have_a_worst():
    count = 11_000
    rng = np.random.default_rng(3)
    positions = rng.random((count, 1, 3)) * 100 + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    corners = np.arange(3 * count, dtype=np.int32)
    offsets = np.arange(0, 3 * count + 1, 3)
    report = unwrap(positions.reshape(-1, 3), corners, offsets, texture_size=4096, margin=0).report
    assert report["charts"] == count and np.isfinite(report["l2_worst_chart"])


def add_on_module(name):
    """A module of the add-on that needs no Blender, loaded without the package's own `__init__.py`, which does."""
    package = types.ModuleType("ble_add_on")
    package.__path__ = [str(Path(__file__).parent.parent / "addon")]
    sys.modules[package.__name__] = package
    return importlib.import_module(f"{package.__name__}.{name}")


def test_what_could_not_be_measured_is_no_pass():
    surface_report = add_on_module("surface_report")
    good = {"charts": 2, "gap_texels": 4.0, "l2_worst_chart": 1.05, "l2_chart_scale": 1.05}
    for over in ("CHART", "ATLAS"):
        judged = {"margin": 4, "stretch_limit": 1.1, "limit_over": over}
        assert surface_report.certify(good, **judged).holds
        for name in ("l2_worst_chart", "l2_chart_scale", "gap_texels"):
            violations = surface_report.certify(good | {name: float("nan")}, **judged).violations
            counts = name == "gap_texels" or (name == "l2_chart_scale") == (over == "ATLAS")
            assert len(violations) == counts, (over, name, violations)


# Results that travel ------------------------------------------------------------------------------------------------


def results():
    hill = grid(8, 8, lambda x, y: 0.2 * x * x + 0.1 * y)
    points = np.random.default_rng(5).random((200, 2)) @ np.array([[1, 0, 0], [0, 1, 0.2]])
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    yield unwrap(*hill)
    yield native.unwrap_points(points)
    yield native.flatten(*hill)
    yield native.pack(triangle, np.array([[0, 1, 2]]), np.array([0]), texture_size=32)


TRAVELS = [copy.copy, copy.deepcopy] + [
    lambda thing, p=p: pickle.loads(pickle.dumps(thing, p)) for p in range(2, pickle.HIGHEST_PROTOCOL + 1)
]


@pytest.mark.parametrize("travel", TRAVELS)
def test_results_travel_with_the_same_bytes(travel):
    for result in results():
        arrived = travel(result)
        assert type(arrived) is type(result) and arrived.report == result.report
        assert getattr(arrived, "certificate", None) == getattr(result, "certificate", None)
        for name in ("uv", "chart", "embedded"):
            if hasattr(result, name):
                before, after = getattr(result, name), getattr(arrived, name)
                assert bytes(after) == bytes(before)
                assert (after.shape, after.format) == (before.shape, before.format)


def test_arrays_travel_alone_and_empty(hill):
    uv = unwrap(*hill).uv
    for array in (uv, native.Array(b"", "i", (0,)), native.Array(b"", "d", (0, 3))):
        arrived = pickle.loads(pickle.dumps(array))
        assert_array_equal(np.asarray(arrived), np.asarray(array))
        assert np.asarray(arrived).dtype == np.asarray(array).dtype


@pytest.mark.parametrize(
    ("data", "format", "shape"),
    [
        (b"1234567", "f", (1,)),
        (b"12345678", "f", (3,)),
        (b"1234", "q", (1,)),
        (b"1234", "f", ()),
        (b"", "f", (0, 2**62)),
    ],
)
def test_an_array_of_wrong_bytes_is_refused(data, format, shape):
    with pytest.raises(native.InvalidArgumentError):
        native.Array(data, format, shape)


# Settings -----------------------------------------------------------------------------------------------------------

BOOLEANS = [True, False, np.True_, np.False_]


@pytest.mark.parametrize("name", [k for k, v in native.default_settings().items() if type(v) in (int, float)])
@pytest.mark.parametrize("value", BOOLEANS, ids=repr)
def test_no_boolean_is_a_number(square, name, value):
    with pytest.raises(native.InvalidArgumentError, match=rf"^{name}: expected .* number"):
        native.unwrap(*square, **{name: value})


@pytest.mark.parametrize("value", BOOLEANS, ids=repr)
def test_no_boolean_is_a_size(square, value):
    for size in (value, (value, 64), [64, value]):
        with pytest.raises(native.InvalidArgumentError, match=r"^texture_size: "):
            native.unwrap(*square, texture_size=size)


def test_any_sequence_of_two_is_a_pair(square):
    pair = (64, 32)
    expected = arrays(unwrap(*square, texture_size=pair))[0]
    for size in (list(pair), np.array(pair), np.array(pair, np.uint16), range(64, 0, -32)):
        assert_array_equal(arrays(unwrap(*square, texture_size=size))[0], expected)
    for size in ("64", b"@ ", [64], [64, 32, 16], {}, [64.5, 32], None, {64, 32}):
        with pytest.raises(native.InvalidArgumentError, match=r"^texture_size: "):
            unwrap(*square, texture_size=size)


# Faces that use a vertex twice --------------------------------------------------------------------------------------


def test_charts_are_counted_as_they_are_labelled():
    rng = np.random.default_rng(11)
    for _ in range(120):
        vertices, faces = int(rng.integers(4, 9)), int(rng.integers(2, 9))
        sizes = rng.integers(3, 8, faces)
        corners = rng.integers(0, vertices, sizes.sum()).astype(np.int32)
        atlas = unwrap(rng.random((vertices, 3)), corners, np.concatenate([[0], np.cumsum(sizes)]), moves="split")
        labels = set(np.asarray(atlas.chart).tolist()) - {-1}
        assert atlas.report["charts"] == len(labels), (corners.tolist(), sizes.tolist())


def test_large_meshes_are_made_within_their_estimate():
    # Far below what the machines have on which this runs: nothing is refused.
    assert unwrap(*sphere(64, 64)).report["charts"] >= 1
