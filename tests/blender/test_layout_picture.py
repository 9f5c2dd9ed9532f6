"""Pictures of UV layouts, pixel by pixel."""

import numpy as np
import pytest

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
NO_LINES = np.zeros((0, 2), np.int32)


@pytest.fixture
def pictures(addon):
    return addon("layout_picture")


@pytest.fixture
def layout(pictures):
    def make(uv, triangles, colours, borders=NO_LINES):
        return pictures.Layout(np.array(uv, np.float32), np.array(triangles), np.array(colours), np.array(borders))

    return make


def square(left, bottom, right, top):
    return [(left, bottom), (right, bottom), (right, top), (left, top)]


HALVES = [(0, 1, 2), (0, 2, 3)]


def test_a_square_fills_its_pixels_and_no_others(pictures, layout):
    drawn = pictures.drawn(layout(square(0.25, 0.5, 0.75, 1.0), HALVES, [RED, RED]), 64, 32)
    assert drawn.shape == (32, 64, 3)
    inside = np.zeros((32, 64), bool)
    inside[16:, 16:48] = True
    assert (drawn[inside] == RED).all() and drawn[~inside] == pytest.approx(np.tile(pictures.EMPTY, (1536, 1)))


def test_triangles_side_by_side_leave_no_gap_however_small(pictures, layout):
    steps = np.linspace(0.0, 1.0, 301)  # three to a pixel and more
    x, y = np.meshgrid(steps, steps)
    corner = np.arange(301 * 301).reshape(301, 301)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    drawn = pictures.drawn(
        layout(np.stack([x.ravel(), y.ravel()], axis=1), triangles, [GREEN] * len(triangles)), 64, 64
    )
    assert (drawn == GREEN).all()


def test_what_is_outside_or_no_number_does_not_matter(pictures, layout):
    nan, far = float("nan"), 1e30
    uv = [*square(-3, -3, -2, -2), *square(0, 0, 0.5, 0.5), (nan, 0), (1, 0), (0, far), (far, -far)]
    triangles = [*HALVES, (4, 5, 6), (4, 6, 7), (8, 9, 5), (9, 10, 11)]
    lines = [(0, 8), (0, 1), (10, 11)]
    drawn = pictures.drawn(layout(uv, triangles, [RED, RED, BLUE, BLUE, GREEN, GREEN], lines), 32, 32)
    assert np.isfinite(drawn).all() and (drawn[2:14, 2:14] == BLUE).all()


def test_the_order_of_triangles_counts_not_how_many_are_filled_at_a_time(pictures, layout, monkeypatch):
    random = np.random.default_rng(3)
    uv = random.random((90, 2))
    made = layout(uv, np.arange(90).reshape(30, 3), random.random((30, 3)))
    whole = pictures.drawn(made, 50, 50)
    monkeypatch.setattr(pictures, "CHUNK_PIXELS", 1)
    assert (pictures.drawn(made, 50, 50) == whole).all()


def test_borders_are_the_sides_that_no_other_face_shares(pictures):
    # Two quads that share a side in the map, and one that lies alone.
    place = np.array([0, 1, 2, 3, 1, 4, 5, 2, 6, 7, 8, 9])
    found = pictures.borders(place, np.array([0, 4, 8, 12]))
    sides = {tuple(sorted(side)) for side in place[found].tolist()}
    assert sides == {(0, 1), (2, 3), (0, 3), (1, 4), (4, 5), (2, 5), (6, 7), (7, 8), (8, 9), (6, 9)}


def test_lines_are_drawn_from_end_to_end(pictures, layout):
    drawn = pictures.drawn(layout(square(0.25, 0.25, 0.75, 0.75), HALVES, [RED, RED], [(0, 1)]), 64, 64)
    dark = (drawn < 0.15).all(axis=2)
    assert dark[16, 16:48].all() or dark[15, 16:48].all()
    assert not dark[20:].any() and not dark[:14].any()


def test_layouts_lie_side_by_side_in_the_proportions_of_the_texture(pictures, layout):
    one = layout(square(0, 0, 1, 1), HALVES, [RED, RED])
    other = layout(square(0, 0, 1, 1), HALVES, [BLUE, BLUE])
    whole = pictures.side_by_side([one, other], (2048, 1024))
    side, gap = pictures.SIDE, pictures.GAP
    assert whole.shape == (side // 2 + 2 * gap, 2 * side + 3 * gap, 3)
    assert (whole[gap + 5, gap + 5] == RED).all() and (whole[gap + 5, side + 2 * gap + 5] == BLUE).all()
    assert whole[2, 2] == pytest.approx(pictures.AROUND) and whole[gap + 5, gap + side + 3] == pytest.approx(
        pictures.AROUND
    )
