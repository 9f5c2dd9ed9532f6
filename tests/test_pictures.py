"""The scripts' pictures: layouts in the right colours, text that fits, files that can be read again."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import grid

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "blender_scripts"))

import pictures


def sheet(columns=4):
    """A flat sheet of quads as the add-on reads it, and its own plane as UVs in the middle of the texture."""
    positions, corners, offsets = grid(columns, columns)
    quads = corners.reshape(-1, 4)
    number = np.arange(4 * len(quads)).reshape(-1, 4)
    triangles = number[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    selection = SimpleNamespace(
        positions=positions, corner_vertices=corners, face_offsets=offsets, corner_triangles=triangles
    )
    return selection, (0.25 + 0.5 * positions[corners, :2]).astype(np.float32)


def share(picture, colour):
    return (np.abs(picture.astype(int) - np.asarray(colour, int)).max(axis=2) <= 1).mean()


def test_a_flat_sheet_is_drawn_in_the_colour_of_no_stretch():
    picture = pictures.layout(*sheet(), 200)
    assert picture.shape == (200, 200, 3)
    assert share(picture, pictures.STRETCH_COLOURS[0][1]) == pytest.approx(0.25, abs=0.02)
    assert share(picture, pictures.EMPTY) == pytest.approx(0.75, abs=0.02)
    assert share(picture, pictures.OVERLAP) == share(picture, pictures.FLIP) == 0
    assert share(picture[60:140, 60:140], pictures.STRETCH_COLOURS[0][1]) == 1, "no line where two faces meet"


def test_the_border_is_drawn_and_smooth():
    picture = pictures.layout(*sheet(), 201).astype(int)
    row = picture[100].sum(axis=1)
    dark, empty, chart = pictures.BORDER.sum(), pictures.EMPTY.sum(), sum(pictures.STRETCH_COLOURS[0][1])
    edge = row[45:56]
    assert edge[0] == empty and abs(edge[-1] - chart) <= 3 and edge.min() < (dark + empty) / 2
    assert len(set(edge)) > 3, "there are shades between"


def test_no_border_is_drawn_where_only_vertices_are_split():
    """As a file has it that stores every face with vertices of its own."""
    selection, uv = sheet()
    whole = pictures.layout(selection, uv, 200)
    selection.positions = selection.positions[selection.corner_vertices]
    selection.corner_vertices = np.arange(len(uv), dtype=np.int32)
    assert np.array_equal(pictures.layout(selection, uv, 200), whole)


def test_up_is_up():
    selection, uv = sheet()
    uv[:, 1] += 0.25
    picture = pictures.layout(selection, uv, 100)
    assert share(picture[51:], pictures.EMPTY) > 0.95 > share(picture[:50], pictures.EMPTY)


def test_overlaps_are_white():
    """The right half of the sheet lies on the left half, turned by 180 degrees so that nothing is flipped."""
    selection, uv = sheet()
    right = np.repeat(uv.reshape(-1, 4, 2).mean(axis=1)[:, 0] > 0.5, 4)
    uv[right] = 1 - uv[right]
    picture = pictures.layout(selection, uv, 200)
    assert share(picture, pictures.OVERLAP) == pytest.approx(0.125, abs=0.02)
    assert share(picture, pictures.FLIP) == 0


def test_flipped_faces_are_magenta():
    selection, uv = sheet()
    uv[:, 0] = 1 - uv[:, 0]
    assert share(pictures.layout(selection, uv, 200), pictures.FLIP) == pytest.approx(0.25, abs=0.02)


def test_coverage_counts_each_pixel_of_a_tiling_once():
    selection, uv = sheet(7)
    count = pictures._coverage((uv.astype(float) * 97)[selection.corner_triangles], 97)
    assert set(np.unique(count)) == {0, 1} and count.sum() == pytest.approx(0.25 * 97**2, rel=0.05)


def test_points_are_dots_of_their_colour():
    uv = np.array([[0.25, 0.75], [0.75, 0.25], [np.nan, 0.5]])
    picture = pictures.point_layout(uv, np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]), 64)
    assert tuple(picture[16, 16]) == (255, 0, 0) and tuple(picture[48, 48]) == (0, 255, 0)
    assert share(picture, (0, 0, 255)) == 0


def test_text_is_drawn_where_it_is_said_to_be():
    canvas = pictures.plain(40, 300)
    end = pictures.draw_text(canvas, "3 charts, stretch 1.05 (30°)", 10, 8)
    drawn = np.argwhere((canvas != pictures.BACKGROUND).any(axis=2))
    assert drawn[:, 0].min() >= 8 and drawn[:, 0].max() < 8 + pictures.line_height()
    assert drawn[:, 1].min() >= 10 and end - 4 <= drawn[:, 1].max() < end
    assert len(np.unique(canvas.reshape(-1, 3), axis=0)) > 8, "letters are smooth"


@pytest.mark.parametrize("width", [0, 5, 40, 100, 150])
def test_text_is_shortened_to_a_width(width):
    text = pictures.shortened("overlapping faces", width)
    assert pictures.text_width(text) <= width
    assert text in ("", "overlapping faces") or text.endswith("...")
    assert pictures.shortened("overlapping faces", 1000) == "overlapping faces"


@pytest.mark.parametrize("width", [120, 700, 1800])
def test_legend_has_the_width_that_is_asked_for(width):
    assert pictures.legend(width).shape[1] == min(width, 700) if width < 700 else width


def test_a_file_can_be_read_again(tmp_path):
    picture = np.random.default_rng(1).integers(0, 256, (20, 30, 3), dtype=np.uint8)
    pictures.write_png(tmp_path / "a.png", picture)
    assert np.array_equal(pictures.read_png(tmp_path / "a.png"), picture)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
