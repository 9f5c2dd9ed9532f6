"""The colours of stretch and of islands, by numbers alone."""

from dataclasses import dataclass

import numpy as np
import pytest


@dataclass
class Mesh:
    """As much of a surface as shapes are made of."""

    positions: np.ndarray
    corner_vertices: np.ndarray
    face_offsets: np.ndarray
    corner_triangles: np.ndarray | None = None

    @property
    def face_count(self):
        return len(self.face_offsets) - 1


@pytest.fixture
def colours(addon):
    return addon("overlay_colours")


@pytest.fixture
def stretch(addon, colours):
    """The factors of faces that are right triangles with unit sides on the surface, each an island or all one."""

    def measure(uv, island, size=(64, 64)):
        uv = np.array(uv, np.float32).reshape(-1, 2)
        corner = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        mesh = Mesh(
            np.array(corner * (len(uv) // 3), np.float32),
            np.arange(len(uv), dtype=np.int32),
            np.arange(0, len(uv) + 1, 3, dtype=np.int32),
        )
        shapes = addon("triangle_shapes").Shapes.of(mesh, uv, size)
        return colours.face_stretch(shapes, np.array(island, np.int32))

    return measure


def triangle(width=1.0, height=1.0, shear=0.0):
    return [(0.0, 0.0), (width, 0.0), (shear, height)]


def test_an_island_at_another_scale_is_not_stretched(stretch, colours):
    longer, shorter = stretch([triangle(), triangle(0.01, 0.01), triangle(7, 7)], [0, 1, 2])
    assert longer == pytest.approx(1.0) and shorter == pytest.approx(1.0)
    assert colours.stretch_colours(longer, shorter) == pytest.approx(np.tile(colours.NEUTRAL, (3, 1)))


def test_faces_are_told_by_how_their_lines_compare_with_the_rest_of_the_island(stretch):
    # Three that are alike decide what is usual; one has half their length in u, one twice that in both.
    longer, shorter = stretch([triangle()] * 3 + [triangle(0.5, 1.0), triangle(2.0, 2.0)], [0] * 5)
    assert longer == pytest.approx([1, 1, 1, 2, 1], rel=1e-6)
    assert shorter == pytest.approx([1, 1, 1, 1, 2], rel=1e-6)


def test_shear_that_keeps_area_is_no_neutral_colour(stretch, colours):
    longer, shorter = stretch([triangle()] * 3 + [triangle(2.0, 0.5)], [0] * 4)
    assert (longer[3], shorter[3]) == pytest.approx((2.0, 2.0))
    darkest = colours.stretch_colours(longer, shorter)[3]
    assert darkest.max() < 0.3, "both colours lie on each other"


def test_the_proportions_of_the_texture_count(stretch):
    longer, shorter = stretch([triangle()] * 3, [0] * 3, size=(128, 64))
    assert longer == pytest.approx(np.sqrt(2)) and shorter == pytest.approx(np.sqrt(2))
    longer, shorter = stretch([triangle(0.5, 1.0)] * 3, [0] * 3, size=(128, 64))
    assert longer == pytest.approx(1.0) and shorter == pytest.approx(1.0)


def test_flipped_collapsed_and_unmapped_faces_have_a_colour_of_their_own(stretch, colours):
    nan = float("nan")
    flipped = [(0, 0), (0, 1), (1, 0)]
    line = [(0, 0), (1, 0), (2, 0)]
    faces = [triangle()] * 3 + [flipped, line, [(nan, 0), (1, 0), (0, 1)]]
    longer, shorter = stretch(faces, [0, 0, 0, 0, 0, -1])
    assert np.isfinite(longer[:3]).all() and np.isnan(longer[3:]).all() and np.isnan(shorter[3:]).all()
    assert colours.stretch_colours(longer, shorter)[3:] == pytest.approx(np.tile(colours.BROKEN, (3, 1)))
    # An island that is mirrored as a whole is not flipped.
    longer, _ = stretch([flipped] * 3, [0] * 3)
    assert longer == pytest.approx(1.0)


def test_nothing_but_broken_faces_is_no_error(stretch):
    longer, shorter = stretch([[(0, 0), (0, 0), (0, 0)]], [0])
    assert np.isnan(longer).all() and np.isnan(shorter).all()
    longer, _ = stretch([[(np.nan, 0), (0, 0), (0, 0)]], [-1])
    assert np.isnan(longer).all()


def test_a_face_has_the_stretch_of_its_worst_triangle(addon, colours):
    # A quad whose second half is drawn out in the map, beside two faithful quads that decide what is usual.
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uv = np.array([p[:2] for p in square] * 3, np.float32)
    uv[11] = (0, 0.25)
    mesh = Mesh(
        np.array(square * 3, np.float32),
        np.arange(12, dtype=np.int32),
        np.arange(0, 13, 4, dtype=np.int32),
        np.array([t for k in (0, 4, 8) for t in ((k, k + 1, k + 2), (k, k + 2, k + 3))], np.int32),
    )
    shapes = addon("triangle_shapes").Shapes.of(mesh, uv, (1, 1))
    longer, shorter = colours.face_stretch(shapes, np.zeros(3, np.int32))
    assert longer[:2] == pytest.approx(1.0) and longer[2] > 3
    assert shorter[:2] == pytest.approx(1.0)


def test_the_scale_goes_one_way_and_ends(colours):
    factors = np.linspace(1.0, colours.FULL, 9)
    ones = np.ones(9)
    for shown in (colours.stretch_colours(factors, ones), colours.stretch_colours(ones, factors)):
        light = luminance(shown)
        assert (np.diff(light) < 0).all(), "the further off, the darker"
        assert ((shown >= 0) & (shown <= 1)).all()
    beyond = colours.stretch_colours([100.0, colours.FULL], [1.0, 1.0])
    assert beyond[0] == pytest.approx(beyond[1])


def luminance(colour):
    return linear_light(colour) @ np.array((0.2126, 0.7152, 0.0722))


def linear_light(colour):
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


# What is seen by those who lack one kind of cone, of linear light: Viénot, Brettel, Mollon, "Digital video colourmaps
# for checking the legibility of displays by dichromats" (1999), for protanopes and deuteranopes.
DICHROMATS = {
    "protanope": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    "deuteranope": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
}


@pytest.mark.parametrize("kind", DICHROMATS)
def test_colour_blind_people_tell_the_ends_and_the_middle_apart(colours, kind):
    half = np.sqrt(colours.FULL)
    halves = colours.stretch_colours([half, 1.0], [1.0, half])
    shown = {name: colour for name, colour, _ in colours.legend()}
    between = dict(zip(("half stretched", "half squeezed"), halves, strict=True))
    linear, names = linear_light(np.array([*shown.values(), *between.values()])), [*shown, *between]
    seen = np.clip(linear @ np.array(DICHROMATS[kind]).T, 0.0, 1.0) ** (1 / 2.2)
    for i in range(len(seen)):
        for j in range(i):
            assert np.abs(seen[i] - seen[j]).max() > 0.15, (names[i], names[j])


def test_islands_have_colours_that_differ_from_their_neighbours(colours):
    shown = colours.island_colours(40)
    assert shown.shape == (40, 3) and ((shown >= 0) & (shown <= 1)).all()
    assert len(np.unique(shown.round(3), axis=0)) == 40
    assert np.abs(np.diff(shown, axis=0)).max(axis=1).min() > 0.15
    assert colours.island_colours(3, first=5) == pytest.approx(shown[5:8])
    assert colours.island_colours(0).shape == (0, 3)


def test_the_range_is_told_in_words(colours):
    assert colours.range_text(1.25, 2 / 1.5) == "25 % longer, 25 % shorter"
    assert colours.range_text(21.47, 8.0) == "21.5 × longer, 8.0 × shorter"
