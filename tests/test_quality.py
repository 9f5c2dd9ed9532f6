"""`make quality`: that shuffling keeps the surface, and what the table makes of several runs."""

import math
import subprocess
import sys
from pathlib import Path

import conftest
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
QUALITY = ROOT / "native/evaluation/quality"
sys.path.insert(0, str(QUALITY))

import quality_meshes  # noqa: E402
import quality_report  # noqa: E402
from quality_meshes import shapes, shuffled  # noqa: E402


def mixed():
    """A ball of triangles and quads, a pentagon and, as files have them, a face without corners."""
    positions, corners, offsets = conftest.sphere(7, 6)
    around = 0.4 * np.pi * np.arange(5)
    positions = np.concatenate([positions, 3 + np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)])
    corners = np.concatenate([corners, len(positions) - 5 + np.arange(5, dtype=np.int32)])
    offsets = np.concatenate([offsets, [len(corners), len(corners)]]).astype(np.int32)
    return shapes.Mesh("mixed", positions, corners, offsets)


def surface(mesh):
    """The polygons by the positions of their corners, each from its least corner on, in no order."""
    found = []
    for polygon in mesh.polygons():
        points = [tuple(mesh.positions[v]) for v in polygon]
        first = points.index(min(points)) if points else 0
        found.append((*points[first:], *points[:first]))
    return sorted(found)


@pytest.mark.parametrize("number", range(4))
def test_shuffling_keeps_the_surface(number):
    mesh = mixed()
    other = shuffled(mesh, number)
    assert surface(other) == surface(mesh), "the same polygons, turned the same way round"
    assert sorted(map(tuple, other.positions)) == sorted(map(tuple, mesh.positions))
    assert [a.dtype for a in other.arrays] == [a.dtype for a in mesh.arrays]
    again = shuffled(mesh, number)
    assert all(np.array_equal(a, b) for a, b in zip(other.arrays, again.arrays, strict=True))


def test_shuffles_differ():
    """In vertices, faces and first corners each; the first is the mesh as it is."""
    mesh = mixed()
    assert shuffled(mesh, 0) is mesh
    first, second = shuffled(mesh, 1), shuffled(mesh, 2)
    for one, other in ((mesh, first), (mesh, second), (first, second)):
        assert not np.array_equal(one.positions, other.positions)
        assert not np.array_equal(one.face_offsets, other.face_offsets)
    corners = {min(tuple(mesh.positions[v]) for v in p): tuple(mesh.positions[p[0]]) for p in mesh.polygons() if len(p)}
    turned = [
        corners[min(tuple(first.positions[v]) for v in p)] != tuple(first.positions[p[0]])
        for p in first.polygons()
        if len(p)
    ]
    assert 0.3 < np.mean(turned) < 0.95


def run(charts=2, **more):
    given = {"l2": 1.02, "l2_worst_chart": 1.05, "l_infinity": 2.0, "seam_length": 3.0, "packing_efficiency": 0.6}
    return {**given, "charts": charts, "cpu": 0.5, "flips": 0, "overlaps": 0, **more}


def test_row():
    runs = [run(1, l_infinity=2.0), run(4, l_infinity=5.0, flips=2), run(4, cpu=2.0, overlaps=1)]
    row = quality_report.row("a", 12, runs)
    assert (row["of_each"], row["charts"], row["bad"]) == ([1, 4, 4], 3.0, 3)
    assert (row["l_infinity"], row["most_l_infinity"], row["cpu"]) == (3.0, 5.0, 1.0)
    assert row["l2"] == pytest.approx(1.02)


def test_last_row():
    rows = [
        quality_report.row("a", 12, [run(1, seam_length=0.0), run(3, seam_length=0.0)]),
        quality_report.row("b", 12, [run(8, seam_length=5.0, overlaps=1)]),
    ]
    last = quality_report.total(rows)
    assert last["charts"] == pytest.approx(4.0), "of the means 2 and 8"
    assert last["seam_length"] == pytest.approx(5.0), "what has no seam does not count"
    assert last["l2"] == pytest.approx(1.02) and last["bad"] == 1
    assert quality_report.total(rows[:1])["seam_length"] is None


def test_error_of_charts():
    """As by first-order propagation: of ten models with the same spread a tenth of √10 times that of one."""
    row = quality_report.row("a", 12, [run(3), run(5), run(4), run(4)])
    one = math.sqrt(2 / 3 / 4) / 4
    assert quality_report.error_of_charts([row]) == pytest.approx(one)
    assert quality_report.error_of_charts(10 * [row]) == pytest.approx(one / math.sqrt(10))
    assert quality_report.error_of_charts([quality_report.row("a", 12, [run(3), run(3)])]) == 0
    assert quality_report.error_of_charts([row, quality_report.row("b", 12, [run(3)])]) is None
    assert quality_report.error_of_charts([]) is None


def test_table():
    rows = [quality_report.row("a model", 12_000, [run(1), run(10)]), {"name": "bad", "failed": "no room"}]
    rows.append(quality_report.row("b", 7, [run(seam_length=0.0), run(seam_length=0.0)]))
    head, _, first, second, _, last, failed = quality_report.table(rows)
    assert len({len(line) for line in (head, first, second, last)}) == 1
    assert first.split()[:5] == ["a", "model", "12,000", "1", "10"] and first.split()[5] == "5.50"
    assert last.startswith("geometric mean") and " 3.32 " in last, "√(5.5 · 2)"
    assert failed == "bad: failed: no room"
    assert quality_report.table(rows[1:2])[-1] == failed
    assert "-" in quality_report.table(rows[2:])[-1].split()


@pytest.mark.parametrize(
    ("make", "handles"), [(quality_meshes.drilled_plate, 9), (quality_meshes.gear, 1), (quality_meshes.spring, 0)]
)
def test_machine_parts(make, handles):
    """Closed, oriented, in one piece, with as many handles as there are holes."""
    mesh = make()
    edges = np.concatenate([np.stack([p, np.roll(p, -1)], axis=1) for p in mesh.polygons()])
    forward = {tuple(edge) for edge in edges.tolist()}
    assert len(forward) == len(edges) and all((b, a) in forward for a, b in forward)
    assert len(mesh.positions) - len(edges) // 2 + len(mesh.face_offsets) - 1 == 2 - 2 * handles


def command(*arguments):
    line = [sys.executable, QUALITY, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=300)


def test_whole_program(tmp_path):
    """A model and a file that is no mesh: the table is there, and the exit code tells of the failure."""
    cube = [f"v {k & 1} {k >> 1 & 1} {k >> 2}" for k in range(8)]
    cube += ["f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"]
    (tmp_path / "cube.obj").write_text("\n".join(cube))
    (tmp_path / "empty.obj").write_text("v 0 0 0\n")
    good = command(tmp_path / "cube.obj", "--shuffles", 3)
    assert good.returncode == 0, good.stdout + good.stderr
    line = next(line for line in good.stdout.splitlines() if line.startswith("cube"))
    assert line.split()[1] == "12" and line.split()[-1] == "0"
    assert float(line.split()[-2]) > 0, "CPU seconds"
    done = command(tmp_path / "empty.obj", tmp_path / "cube.obj", "--shuffles", 1)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "empty: failed: " in done.stdout and "geometric mean" in done.stdout


@pytest.mark.parametrize("wrong", [["--shuffles", 0], ["none.obj"], ["--shuffles", "many"]])
def test_wrong_arguments(wrong):
    done = command(*wrong)
    assert done.returncode == 2 and "Traceback" not in done.stderr
