"""`make shapes`: its measures and pictures have known answers, and the program says what it could not do."""

import subprocess
import sys
from pathlib import Path

import conftest
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
SHAPES = ROOT / "native/evaluation/shapes"
sys.path.append(str(SHAPES))

import common_shapes  # noqa: E402
import layout_measures  # noqa: E402
import model_view  # noqa: E402
import shape_sheet  # noqa: E402

FRONT, BACK = (0.0, -1.0, 0.001), (0.0, 1.0, 0.001)


def sheet(columns=4, chart=None, place=lambda uv: uv):
    """A flat sheet of quads and itself as its layout, in one chart or in those given."""
    positions, corners, offsets = conftest.grid(columns, columns)
    mesh = common_shapes.shapes.Mesh("sheet", positions, corners, offsets)
    chart = np.zeros(len(offsets) - 1, int) if chart is None else chart
    return layout_measures.Layout(mesh, place(positions[corners, :2]), chart)


def turned(uv, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return uv @ np.array([[c, s], [-s, c]])


def test_a_square_is_a_rectangle_along_the_axes_until_it_is_turned():
    layout = sheet()
    assert layout.aligned() == layout.rectangles() == 1 and layout.is_border.sum() == 16 and not len(layout.seams)
    assert layout.areas == pytest.approx([1.0]) and layout.filled == pytest.approx([1.0])
    aslant = sheet(place=lambda uv: turned(uv, 20))
    assert aslant.aligned() == aslant.rectangles() == 0
    assert sheet(place=lambda uv: turned(uv, 0.9)).aligned() == 1


def test_seams_are_where_charts_part():
    layout = sheet(chart=np.repeat([0, 1], 8))
    assert len(layout.seams) == 4 and layout.is_border.sum() == 2 * 12
    assert (layout.mesh.positions[layout.seam_vertices][..., 1] == 0.5).all()
    assert layout.aligned(0) == 1 and layout.areas == pytest.approx([0.5, 0.5])


def test_an_outline_runs_once_around_and_turns_at_the_corners():
    (loop,) = sheet().outlines(0)
    assert len(loop) == 16
    points = sheet().uv[loop]
    assert layout_measures.corner_angles(points) == pytest.approx(4 * [90])
    # Without one corner's quad there is a corner that turns the other way.
    chart = np.zeros(16, int)
    chart[0] = -1
    layout = sheet(chart=chart)
    assert sorted(layout_measures.corner_angles(layout.uv[layout.outlines(0)[0]])) == pytest.approx(5 * [90] + [270])
    hole = np.zeros(16, int)
    hole[5] = -1
    assert [len(loop) for loop in sheet(chart=hole).outlines(0)] == [16, 4]


def test_roundness():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = np.column_stack([3 + np.cos(angle), np.sin(angle)])
    assert layout_measures.roundness(circle) < 1e-12
    assert layout_measures.roundness(circle * (1.1, 1.0)) == pytest.approx(0.1, abs=0.03)


def test_a_quad_is_bent_where_a_corner_goes_in():
    def dented(uv):
        uv = uv.copy()
        uv[(uv == 0).all(axis=1)] = 0.2
        return uv

    assert not sheet().bent().any()
    assert sheet(place=dented).bent().tolist() == [True] + 15 * [False]


def drawn(positions, triangles, seams, view, size=60):
    colours = np.tile([200.0, 100.0, 50.0], (len(triangles), 1))
    seams = np.array(seams).reshape(-1, 2)
    return model_view.picture(positions, triangles, colours, seams, view, size, (0, 0, 255), (0, 255, 0))


def test_what_is_behind_is_hidden_and_so_are_its_seams():
    mesh = common_shapes.triangulated(common_shapes.mesh("box", 0))
    at_back = np.flatnonzero(mesh.positions[:, 1] > 0)
    diagonal = [at_back[np.argmin(mesh.positions[at_back] @ (1, 0, s))] for s in (1, -1)]
    seam = [[diagonal[0], at_back[np.argmax(mesh.positions[at_back] @ (1, 0, 1))]]]
    green = [(drawn(mesh.positions, mesh.triangles(), seam, v) == (0, 255, 0)).all(axis=2).sum() for v in (FRONT, BACK)]
    assert green[0] == 0 and green[1] > 50


def test_a_square_fills_the_pixels_that_it_covers_and_the_nearer_one_is_seen():
    corners = np.array([[10, 10, 0], [30, 10, 0], [30, 20, 0], [10, 20, 0]], float)
    behind, before = corners - (0, 0, 1), corners + np.array((5, 0, 1))
    triangles = np.concatenate([square[[[0, 1, 2], [0, 2, 3]]] for square in (behind, before)])
    seen, depth = model_view.nearest(triangles, 40)
    assert (seen >= 0).sum() == 25 * 10
    assert (seen[10:20, 15:35] >= 2).all() and (seen[10:20, 10:15] < 2).all()
    assert (depth[10:20, 15:35] == 1).all() and np.isneginf(depth[seen < 0]).all()
    assert not (seen[:, :10] >= 0).any() and not (seen[:10] >= 0).any()


def test_up_is_up_and_right_is_right_from_the_front():
    right, up, toward = model_view.seen_from(np.eye(3), (0.0, -1.0, 0.0)).T
    assert right == pytest.approx([1, 0, 0]) and up == pytest.approx([0, 0, 1]) and toward == pytest.approx([0, -1, 0])


def test_a_layout_is_drawn_in_the_colours_of_its_charts():
    layout = sheet(chart=np.repeat([0, 1], 8))
    picture = shape_sheet.layout_picture(layout, 100)
    colours = shape_sheet.chart_colours(2).astype(int)
    # The first rows of quads are below, and pixels beside lines are looked at.
    assert np.abs(picture[87, 12] - colours[0]).max() <= 1 and np.abs(picture[12, 87] - colours[1]).max() <= 1


@pytest.mark.parametrize("name", common_shapes.SHAPES)
def test_shapes_are_oriented_and_have_no_loose_vertices(name):
    for number in range(3):
        for mesh in common_shapes.variants(name, number):
            edges = np.concatenate([np.stack([p, np.roll(p, -1)], axis=1) for p in mesh.polygons()])
            assert len({tuple(edge) for edge in edges.tolist()}) == len(edges)
            assert len(np.unique(mesh.corner_vertices)) == len(mesh.positions)
            a, b, c = np.moveaxis(mesh.positions[mesh.triangles()], 1, 0)
            assert name in ("road", "leaves", "head") or (np.cross(a, b) * c).sum() > 0, "outwards"


def command(*arguments):
    line = [sys.executable, SHAPES, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=300)


def test_whole_program(tmp_path):
    cube = [f"v {k & 1} {k >> 1 & 1} {k >> 2}" for k in range(8)]
    cube += ["f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"]
    (tmp_path / "cube.obj").write_text("\n".join(cube))
    (tmp_path / "bad.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    out = tmp_path / "sheet.png"
    done = command(tmp_path / "cube.obj", tmp_path / "bad.obj", "-o", out, "--size", 32)
    assert done.returncode == 1 and "Traceback" not in done.stderr, done.stderr
    assert "cube  " in done.stdout and "bad: failed: " in done.stdout
    assert out.read_bytes().startswith(b"\x89PNG")
    done = command("--only", "box", "pyramid", "-o", out, "--size", 32)
    assert done.returncode == 0 and done.stdout.count("1 chart,") == 18, done.stdout + done.stderr


@pytest.mark.parametrize("wrong", [["--size", 4], ["none.obj"], ["--only", "hat"], ["--front", "w"]])
def test_wrong_arguments(wrong, tmp_path):
    done = command("-o", tmp_path / "sheet.png", *wrong)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())
