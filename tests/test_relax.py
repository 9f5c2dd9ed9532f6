"""`relax`: islands of any map with less stretch, where they were, with their pins held and their seams kept.

What is promised is checked here by plain NumPy, from the coordinates that are returned and by no code of the core.
"""

import contextlib
import pickle
import threading
import time
from fractions import Fraction

import ble_unwrap_native as native
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal


def grid(n, height=0.4):
    """A hill over the unit square, of n by n quads: positions, corners and offsets; and its plan, (c, 2)."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1)))
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    corners = (first[:, None] + [0, 1, n + 2, n + 1]).ravel().astype(np.int32)
    positions = np.column_stack([x, y, height * np.exp(-9 * ((x - 0.5) ** 2 + (y - 0.5) ** 2))])
    return (positions, corners, np.arange(0, 4 * n * n + 1, 4, dtype=np.int32)), positions[corners, :2]


def relaxed(mesh, uv, **rules):
    found = native.relax(*mesh, np.asarray(uv, np.float32), **rules)
    return np.asarray(found.uv), found.report


def bits(uv):
    return np.ascontiguousarray(uv, np.float32).view(np.uint32)


def places(mesh, uv):
    """A number for each corner, equal where vertex and UV are."""
    rows = np.column_stack([mesh[1], bits(np.asarray(uv, np.float32) + np.float32(0))])
    return np.unique(rows, axis=0, return_inverse=True)[1].ravel()


def triangles(uv):
    """Both triangles of each quad by its first diagonal."""
    quads = np.asarray(uv, np.float64).reshape(-1, 4, 2)
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 2)


def areas(uv):
    a, b, c = np.moveaxis(triangles(uv), 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def centroid(uv):
    area = np.abs(areas(uv))
    return (triangles(uv).mean(axis=1) * area[:, None]).sum(axis=0) / area.sum()


def is_turned(uv):
    """Exactly, for quads divided along the shorter diagonal on the surface or along either: none is turned over."""

    def sign(a, b, c):
        (ax, ay), (bx, by), (cx, cy) = ([Fraction(float(x)) for x in p] for p in (a, b, c))
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    quads = np.asarray(uv, np.float32).reshape(-1, 4, 2)
    both = ([(0, 1, 2), (0, 2, 3)], [(1, 2, 3), (1, 3, 0)])
    return [all(any(sign(*quad[list(t)]) <= 0 for t in halves) for halves in both) for quad in quads]


def test_an_island_loses_stretch_and_stays_where_it_was():
    mesh, plan = grid(12)
    uv = (0.1, 0.5) + 0.3 * plan
    found, report = relaxed(mesh, uv)
    (island,) = report["islands"]
    assert island["moved"] and island["left"] is None and island["left_at"] == []
    assert (island["island"], island["face"], island["faces"], island["pinned"]) == (0, 0, 144, 0)
    assert island["area"] == pytest.approx(1)
    for values, name in ((uv, "l2_before"), (found, "l2_after")):
        assert native.measure(*mesh, values)["l2"] == pytest.approx(island[name], abs=1e-6)
        assert report[name] == island[name]
    assert 1 < island["l2_after"] < 1 + 0.8 * (island["l2_before"] - 1)
    assert_allclose(np.abs(areas(found)).sum(), np.abs(areas(uv)).sum(), rtol=1e-5)
    assert_allclose(centroid(found), centroid(uv), atol=1e-6)
    assert not any(is_turned(found))
    measured = native.measure(*mesh, found)
    assert (measured["flips"], measured["overlaps"]) == (0, 0)
    assert (report["relaxed"], report["kept"], report["left"]) == (1, 0, 0)


def test_the_start_may_be_turned_mirrored_and_anywhere():
    mesh, plan = grid(10)
    straight, _ = relaxed(mesh, 0.3 * plan)
    for turn, shift in (([[0, 1], [-1, 0]], (3.0, -2.0)), ([[-1, 0], [0, 1]], (0.0, 0.0))):
        found, _ = relaxed(mesh, 0.3 * plan @ turn + shift)
        assert_allclose(found, straight @ turn + shift, atol=2e-4)


def test_what_is_flat_stays_to_the_bit():
    mesh, plan = grid(5, height=0.0)
    uv = np.float32(0.2) + np.float32(0.1) * plan.astype(np.float32)
    found, report = relaxed(mesh, uv)
    assert_array_equal(bits(found), bits(uv))
    assert (report["relaxed"], report["kept"], report["left"]) == (0, 1, 0)


def test_pins_stay_to_the_bit():
    mesh, plan = grid(10)
    uv = (0.3 * plan).astype(np.float32)
    pinned = plan[:, 0] == 0
    found, report = relaxed(mesh, uv, pinned=pinned)
    assert_array_equal(bits(found)[pinned], bits(uv)[pinned])
    assert report["islands"][0]["pinned"] == 11
    free, _ = relaxed(mesh, uv)
    one = (plan == 0).all(axis=1)
    found, _ = relaxed(mesh, uv, pinned=one)
    assert_array_equal(bits(found)[one], bits(uv)[one])
    shift = found - free
    assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-6)
    found, report = relaxed(mesh, uv, pinned=np.ones(len(uv), bool))
    assert_array_equal(found, uv)
    assert (report["left"], report["islands"][0]["left"]) == (1, "all of it is pinned")


def test_two_pins_give_scale_and_turn():
    """All follows what is pinned: a flat grid whose corners were dragged apart is only scaled and turned."""
    mesh, plan = grid(8, height=0.0)
    goal = 0.5 * plan @ [[0.8, 0.6], [-0.6, 0.8]] + 0.3
    pinned = (plan == (0, 0)).all(axis=1) | (plan == (1, 1)).all(axis=1)
    uv = np.where(pinned[:, None], goal, goal.mean(axis=0) + 0.5 * (goal - goal.mean(axis=0)))
    found, report = relaxed(mesh, uv, pinned=pinned)
    assert_allclose(found, goal, atol=0.01)
    assert report["l2_after"] < 1.01


@pytest.mark.parametrize("far", [0.05, 0.15, 0.3])
def test_a_pin_that_was_dragged_takes_the_rest_along(far):
    mesh, plan = grid(30, height=0.3)
    corners = np.isin(plan, (0, 1)).all(axis=1)
    dragged = np.isclose(plan, 0.5).all(axis=1)
    uv = np.where(dragged[:, None], plan + np.array([far, 0.02]), plan).astype(np.float32)
    assert native.measure(*mesh, uv)["flips"] > 0
    found, report = relaxed(mesh, uv, pinned=corners | dragged)
    assert report["relaxed"] == 1, report["islands"]
    assert_array_equal(found[corners | dragged], uv[corners | dragged])
    measured = native.measure(*mesh, found)
    assert (measured["flips"], measured["overlaps"]) == (0, 0) and measured["l2"] < 1.1


def test_flips_and_overlap_are_cleared_unless_pins_forbid_it():
    mesh, plan = grid(10)
    folded = np.column_stack([np.abs(plan[:, 0] - 0.45), plan[:, 1]])
    found, report = relaxed(mesh, folded)
    assert report["relaxed"] == 1 and not any(is_turned(found)) and report["l2_after"] < 1.2
    pinned = (plan[:, 0] < 0.25) | (plan[:, 0] > 0.75)
    found, report = relaxed(mesh, folded, pinned=pinned)
    assert_array_equal(found, folded.astype(np.float32))
    assert report["islands"][0]["left"] == "its pinned vertices turn faces over"
    assert np.isnan(report["l2_after"]), "nothing was relaxed"


def test_islands_may_start_anew():
    """A sheet rolled to more than a turn, whose map lies on itself: what no relaxing undoes an embedding does."""
    (positions, corners, offsets), plan = grid(16, height=0.0)
    angle = 7 * positions[:, 0]
    mesh = (np.column_stack([np.cos(angle) / 7, np.sin(angle) / 7, positions[:, 1]]), corners, offsets)
    uv = 0.3 + 0.5 * mesh[0][corners] @ np.array([[1, 0], [0, 1], [0, 0.1]])
    found, report = relaxed(mesh, uv, start="anew")
    assert report["relaxed"] == 1 and report["l2_after"] < 1.001
    assert_allclose(np.abs(areas(found)).sum(), np.abs(areas(uv)).sum(), rtol=1e-4)
    assert_allclose(centroid(found), centroid(uv), atol=1e-5)
    assert len(set(places(mesh, found))) == len(set(places(mesh, uv)))
    # Pins hold, and what has the least stretch already stays as it is.
    mesh, plan = grid(12)
    pinned = plan[:, 0] == 0
    found, report = relaxed(mesh, 0.3 * plan, pinned=pinned, start="anew")
    assert report["relaxed"] == 1
    assert_array_equal(bits(found)[pinned], bits(0.3 * plan)[pinned])
    good, first = relaxed(mesh, 0.3 * plan)
    _, again = relaxed(mesh, good, start="anew")
    assert again["l2_after"] == pytest.approx(first["l2_after"], abs=1e-3)
    with pytest.raises(native.InvalidArgumentError, match="start: expected 'as_they_are' or 'anew'"):
        relaxed(mesh, plan, start="again")


def test_seams_stay_and_only_selected_islands_move():
    mesh, plan = grid(12)
    right = np.repeat(np.arange(144) % 12 >= 6, 4)
    uv = (0.3 * plan + np.where(right[:, None], (0.05, 0), 0)).astype(np.float32)
    selected = np.arange(144) == 7
    found = native.relax(*mesh, uv, selected=selected)
    moved = (np.asarray(found.uv) != uv).any(axis=1)
    assert moved[right].any() and not moved[~right].any()
    assert_array_equal(np.asarray(found.island), np.where(np.arange(144) % 12 >= 6, 1, 0))
    both, report = relaxed(mesh, uv)
    assert report["relaxed"] == 2
    assert_array_equal(both[right], np.asarray(found.uv)[right])
    pairs = set(zip(places(mesh, uv), places(mesh, both), strict=True))
    assert len(pairs) == len(set(places(mesh, uv))) == len(set(places(mesh, both)))


def test_vertices_at_one_place_hang_together_only_where_they_are_welded():
    (positions, corners, offsets), plan = grid(6)
    split = (positions[corners], np.arange(len(corners), dtype=np.int32), offsets)
    uv = (0.3 * plan).astype(np.float32)
    apart = native.relax(*split, uv)
    assert len(apart.report["islands"]) == 36
    found = native.relax(*split, uv, weld=True)
    assert len(found.report["islands"]) == 1
    whole, _ = relaxed((positions, corners, offsets), uv)
    assert_allclose(np.asarray(found.uv), whole, atol=1e-5)


def test_the_proportions_of_the_texture_count():
    mesh, plan = grid(5, height=0.0)
    uv = (0.2 * plan * (1, 2)).astype(np.float32)
    assert relaxed(mesh, uv, texture_size=(1024, 512))[1]["kept"] == 1
    assert relaxed(mesh, uv)[1]["relaxed"] == 1


def test_iterations_are_bounded():
    mesh, plan = grid(14, height=1.5)
    few = native.relax(*mesh, plan, stretch_iterations=1).report["islands"][0]
    many = native.relax(*mesh, plan, stretch_iterations=100, preset="paper").report["islands"][0]
    assert few["iterations"] <= 2 < many["iterations"]
    assert many["l2_after"] < few["l2_after"] < few["l2_before"]


def test_numbers_that_are_not_finite_concern_their_faces_only():
    (positions, corners, offsets), plan = grid(6)
    uv = plan.astype(np.float32)
    uv[5] = (np.nan, 0.25)
    positions[40] = np.inf
    found = native.relax(positions, corners, offsets, uv)
    island = np.asarray(found.island)
    assert island[1] == -1 and (island == 0).sum() == 36 - 5
    assert_array_equal(bits(np.asarray(found.uv))[5], bits(uv)[5])
    assert found.report["relaxed"] == 1


def test_what_cannot_lie_flat_is_named():
    corners = np.array([0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 1, 3, 7, 5, 3, 2, 6, 7, 2, 0, 4, 6], np.int32)
    positions = np.array([(k & 1, k >> 1 & 1, k >> 2) for k in range(8)], float)
    cube = (positions, corners, np.arange(0, 25, 4, dtype=np.int32))
    _, report = relaxed(cube, positions[corners, :2] + 0.1 * positions[corners, 2:])
    assert "no border" in report["islands"][0]["left"]
    _, report = relaxed(cube, np.zeros((24, 2)))
    assert report["left"] == 1
    # A chain of quads that hang together at their corners only moves around these.
    squares = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (2, 1), (2, 2), (1, 2)], float)
    chain = np.array([0, 1, 2, 3, 2, 4, 5, 6], np.int32)
    mesh = (np.column_stack([squares, 0 * squares[:, 0]]), chain, np.array([0, 4, 8], np.int32))
    uv = (squares[chain] * (0.1, 0.2)).astype(np.float32)
    found, report = relaxed(mesh, uv)
    assert report["relaxed"] == 1
    assert_array_equal(found[[2, 4]], uv[[2, 4]])
    assert_allclose(np.linalg.norm(np.diff(found[:4], axis=0), axis=1), 0.02**0.5, rtol=1e-2)


def test_wrong_arguments_are_named():
    mesh, plan = grid(3)
    with pytest.raises(native.InvalidArgumentError, match="5 UVs, but 36 corners"):
        native.relax(*mesh, plan[:5])
    with pytest.raises(native.InvalidArgumentError, match="2 flags for pins, but 36 corners"):
        native.relax(*mesh, plan, pinned=np.ones(2, bool))
    with pytest.raises(native.InvalidArgumentError, match="1 flags for selected faces, but 9 faces"):
        native.relax(*mesh, plan, selected=np.ones(1, bool))
    with pytest.raises(native.InvalidArgumentError, match=r"pinned: expected a bool array of shape \(c,\)"):
        native.relax(*mesh, plan, pinned=np.ones(36))
    with pytest.raises(native.InvalidArgumentError, match=r"relax\(\) has no setting 'margin'"):
        native.relax(*mesh, plan, margin=2)
    with pytest.raises(native.InvalidMeshError, match="vertex 16"):
        native.relax(mesh[0], mesh[1] + 1, mesh[2], plan)
    empty = native.relax(np.zeros((0, 3)), np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 2)))
    assert np.asarray(empty.uv).shape == (0, 2) and empty.report["islands"] == []


def test_the_result_can_be_kept():
    mesh, plan = grid(4)
    found = native.relax(*mesh, plan)
    again = pickle.loads(pickle.dumps(found))
    assert isinstance(again, native.RelaxedMap) and again.report == found.report
    assert_array_equal(np.asarray(again.uv), np.asarray(found.uv))
    assert_array_equal(np.asarray(again.island), np.asarray(found.island))


def many_hills(count=6):
    (positions, corners, offsets), plan = grid(20)
    numbers = np.arange(count)
    return (
        np.concatenate([positions + np.array([2 * k, 0, 0]) for k in numbers]),
        np.concatenate([corners + k * len(positions) for k in numbers]).astype(np.int32),
        np.append(np.concatenate([offsets[:-1] + k * len(corners) for k in numbers]), count * len(corners)),
    ), np.concatenate([plan * (1 + 0.1 * k, 1) for k in numbers])


def test_threads_do_not_matter():
    mesh, plan = many_hills()
    pinned = np.arange(len(plan)) % 311 == 0
    found = [relaxed(mesh, plan, pinned=pinned, threads=threads) for threads in (1, 2, 8)]
    for uv, report in found[1:]:
        assert_array_equal(bits(uv), bits(found[0][0]))
        assert report == found[0][1]


def test_a_call_can_be_watched_and_cancelled():
    mesh, plan = many_hills(12)
    job = native.Job()
    seen = []

    def work():
        with contextlib.suppress(native.Cancelled):
            native.relax(*mesh, plan, stretch_iterations=10_000, job=job)
            seen.append("finished")

    thread = threading.Thread(target=work)
    thread.start()
    while job.stage() == "waiting" and thread.is_alive():
        time.sleep(0.001)
    job.cancel()
    thread.join(timeout=60)
    assert not thread.is_alive() and job.is_cancelled()
    assert 0 <= job.progress() <= 1 and len(seen) <= 1


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    seed=st.integers(0, 2**32 - 1),
    shake=st.floats(0, 0.3),
    height=st.floats(0, 2),
    pins=st.lists(st.integers(0, 48), max_size=5),
    cut=st.integers(0, 6),
)
def test_any_map_keeps_what_is_promised(seed, shake, height, pins, cut):
    mesh, plan = grid(6, height)
    vertices = mesh[1]
    moved = plan + shake * np.random.default_rng(seed).uniform(-1, 1, (49, 2))[vertices]
    right = np.repeat(np.arange(36) % 6 >= cut, 4)
    uv = (moved + np.where(right[:, None], (3, 0), 0)).astype(np.float32)
    pinned = np.isin(vertices, pins)
    result = native.relax(*mesh, uv, pinned=pinned)
    found, island = np.asarray(result.uv), np.asarray(result.island)
    assert_array_equal(bits(found)[pinned], bits(uv)[pinned])
    before, after = places(mesh, uv), places(mesh, found)
    assert len(set(zip(before, after, strict=True))) == len(set(before)) == len(set(after)), "joined as before"
    for row in result.report["islands"]:
        own = np.repeat(island == row["island"], 4)
        if row["moved"]:
            chart = np.where(island == row["island"], 0, -1).astype(np.int32)
            measured = native.measure(*mesh, found, chart=chart)
            assert (measured["flips"], measured["overlaps"]) == (0, 0)
        else:
            assert_array_equal(bits(found)[own], bits(uv)[own])
