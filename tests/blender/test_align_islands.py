"""Turning islands that are there, so that what is straight on them lies along the axes."""

import bpy
import numpy as np
import pytest
from scenes import add_mesh, edit, select, set_uvs, uvs
from test_artist_state import pin
from test_pack_islands import UNIT, assert_one_scale, quads, rectangles, shapes

align = bpy.ops.uv.ble_unwrap_align


def turn(points, degrees, middle=(0.5, 0.5)):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return (np.asarray(points) - middle) @ np.array([(c, s), (-s, c)]) + middle


def tilted(angles):
    """Rectangles in a row, each turned by its angle."""
    obj = rectangles([(0, 0, 1, 1)] * len(angles))
    boxes = [turn(UNIT * (0.3, 0.1) + (0.4 * k, 0.3), angle, (0.15 + 0.4 * k, 0.35)) for k, angle in enumerate(angles)]
    set_uvs(obj, np.concatenate(boxes))
    return obj


def is_level(uv, tolerance=1e-5):
    sides = np.abs(np.roll(uv, -1, axis=0) - uv)
    return (sides.min(axis=1) < tolerance).all()


@pytest.mark.parametrize("angle", [0.3, 17, 44, -44, 46, 100])
def test_rectangles_are_level_after_the_shorter_turn_about_their_middle(angle):
    obj = tilted([angle])
    before = uvs(obj).copy()
    assert align() == {"FINISHED"}
    after = uvs(obj)
    assert is_level(after)
    middle = [0.5 * (uv.min(axis=0) + uv.max(axis=0)) for uv in (before, after)]
    np.testing.assert_allclose(middle[1], middle[0], atol=1e-6)
    assert_one_scale(shapes_of(before), shapes_of(after))
    least = (angle + 45) % 90 - 45
    np.testing.assert_allclose(after, turn(before, -least, middle[0]), atol=1e-5)


def shapes_of(uv):
    return [np.linalg.norm(uv[:, None] - uv[None], axis=-1)]


def test_what_is_level_stays_to_the_bit_and_pins_hold():
    obj = tilted([0, 20, 30])
    pin(obj, [9])
    before = uvs(obj).copy()
    assert align() == {"FINISHED"}
    same = (uvs(obj) == before).reshape(3, 8).all(axis=1)
    assert same.tolist() == [True, False, True]
    assert align(lock_pinned=False) == {"FINISHED"}
    assert all(is_level(uv) for uv in uvs(obj).reshape(3, 4, 2))


def test_only_selected_islands_are_turned():
    obj = tilted([20, 20, 20])
    before = uvs(obj).copy()
    edit(obj, faces=[1])
    align()
    bpy.ops.object.mode_set(mode="OBJECT")
    same = (uvs(obj) == before).reshape(3, 8).all(axis=1)
    assert same.tolist() == [True, False, True]


def mapped_as_is(name, points, faces):
    """A flat mesh whose UVs are its own points."""
    obj = add_mesh(name, np.column_stack([points, np.zeros(len(points))]), faces)
    obj.data.uv_layers.new(name="UVMap")
    set_uvs(obj, points[np.concatenate(faces)])
    select(obj)
    return obj


def test_one_long_straight_border_is_enough():
    # Half a disk: of its border, the straight side is 39 %.
    angles = np.linspace(0, np.pi, 25)
    rim = np.column_stack([np.cos(angles), np.sin(angles)])
    points = turn(np.concatenate([[(0, 0)], rim]) * 0.3 + 0.5, 33)
    obj = mapped_as_is("Half", points, [(0, k, k + 1) for k in range(1, 25)])
    align()
    uv = uvs(obj).reshape(-1, 3, 2)
    assert uv[0, 0, 1] == pytest.approx(uv[0, 1, 1], abs=1e-5) == pytest.approx(uv[-1, 2, 1], abs=1e-5)


def test_inner_edges_do_not_count():
    # A square cut into slanting slices, whose sides are three times as long as its border.
    heights = np.linspace(0, 0.7, 11)
    left, right = (np.column_stack([np.full(11, x), heights + 0.3 * x]) for x in (0, 1))
    square = np.concatenate([left, right, [(1, 0), (0, 1)]]) * 0.5 + 0.25
    faces = [(k, 11 + k, 12 + k, k + 1) for k in range(10)] + [(0, 22, 11), (10, 21, 23)]
    obj = mapped_as_is("Slices", turn(square, 12), faces)
    align()
    np.testing.assert_allclose(np.ptp(uvs(obj), axis=0), (0.5, 0.5), atol=1e-5)


def test_without_straight_borders_the_box_gets_smallest():
    angles = np.arange(60) * np.pi / 30
    ellipse = turn(0.5 + np.column_stack([0.4 * np.cos(angles), 0.1 * np.sin(angles)]), 25)
    obj = mapped_as_is("Ellipse", ellipse, [tuple(range(60))])
    align()
    np.testing.assert_allclose(np.ptp(uvs(obj), axis=0), (0.8, 0.2), atol=2e-3)


def test_the_proportions_of_the_texture_count():
    obj = tilted([0])
    wide = turn(UNIT * (1.2, 0.1), 30, (0, 0)) * (0.25, 1.0)  # a rectangle in a texture four times as wide as high
    set_uvs(obj, wide + 0.1)
    before = shapes(obj, quads(obj), (4, 1))
    align(texture_size=(1024, 256))
    assert is_level(uvs(obj))
    assert_one_scale(before, shapes(obj, quads(obj), (4, 1)))
