"""Charts that lie on each other on purpose: like parts, mirrored parts and mirrored halves."""

import pickle
from itertools import pairwise

import ble_unwrap_native as native
import conftest
import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as drawn
from hypothesis import strategies as st
from native_calls import QUICK, unwrap
from numpy.testing import assert_array_equal

# One turn and shift for each of a dozen copies.
TURNS = np.random.default_rng(7).normal(size=(12, 4))
PLACES = 3.0 * np.stack([np.arange(12) % 4, np.arange(12) // 4, np.zeros(12)], axis=1)


def turned(positions, quaternion):
    """Positions after the rotation of a quaternion of any length."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return positions @ np.array(matrix).T


def together(*meshes):
    """Several meshes as one."""
    positions = np.concatenate([mesh[0] for mesh in meshes])
    vertices = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])
    corners = np.concatenate([mesh[1] + base for mesh, base in zip(meshes, vertices, strict=False)])
    sizes = np.concatenate([np.diff(mesh[2]) for mesh in meshes])
    return positions, corners.astype(np.int32), np.append(0, np.cumsum(sizes)).astype(np.int32)


def copies(mesh, count, mirrored=()):
    """Copies of a mesh, turned and side by side, some of them mirrored."""
    made = []
    for number in range(count):
        positions, corners, offsets = mesh
        if number in mirrored:
            positions = positions * [-1, 1, 1]
            corners = np.concatenate([face[::-1] for face in np.split(corners, offsets[1:-1])])
        made.append((turned(positions, TURNS[number]) + PLACES[number], corners, offsets))
    return together(*made)


def lump(seed=0):
    """A closed surface of 96 faces that is not its own mirror image, and not alike for two seeds."""
    positions, corners, offsets = conftest.sphere(12, 8)
    waves = np.random.default_rng(seed).normal(size=(3, 3))
    radius = 1 + 0.12 * np.sin(2 * positions @ waves + np.arange(3)).sum(axis=1)
    return positions * radius[:, None], corners, offsets


def bolt(sides=6):
    """A head on a shaft, closed: the same from many sides, and mirrored in many planes."""
    angle = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    profile = [(1.0, 0.5), (1.0, 0.0), (0.5, 0.0), (0.5, -1.5)]
    positions = np.concatenate([np.column_stack([r * ring, np.full(sides, z)]) for r, z in profile])
    faces = [list(range(sides)), [3 * sides + k for k in reversed(range(sides))]]
    for level in range(3):
        for k in range(sides):
            a, b = level * sides + k, level * sides + (k + 1) % sides
            faces.append([b, a, a + sides, b + sides])
    offsets = np.append(0, np.cumsum([len(face) for face in faces]))
    return positions, np.concatenate(faces).astype(np.int32), offsets.astype(np.int32)


def head():
    """A surface that is its own mirror image in x = 0, along edges, with two horns on either side."""
    positions, corners, offsets = conftest.sphere(32, 20)
    x, y, z = positions.T
    horns = sum(3.0 * np.exp(-10 * ((abs(x) - a) ** 2 + (y - b) ** 2 + (z - c) ** 2)) for a, b, c in HORNS)
    radius = 1 + 0.15 * y + 0.1 * np.sin(2 * z) + horns
    return positions * (radius[:, None] * [1, 1.2, 1]), corners, offsets


HORNS = ((0.6, 0.64, 0.48), (0.8, -0.36, -0.48))
# Under these some charts stay on their side of the plane.
MANY_CHARTS = {"stretch_limit": 1.003, "stretch_price": 200.0}


def areas(mesh, uv):
    """Twice the signed area of each face in UV."""
    _, _, offsets = mesh
    found = []
    for first, last in pairwise(offsets):
        x, y = uv[first:last].astype(float).T
        found.append(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return np.array(found)


def outlines(mesh, atlas):
    """For each chart the UVs of its corners as a sorted set."""
    uv, chart = np.asarray(atlas.uv), np.asarray(atlas.chart)
    owner = np.repeat(chart, np.diff(mesh[2]))
    return [np.unique(uv[owner == number], axis=0) for number in range(chart.max() + 1)]


def check(mesh, atlas):
    """All that is promised of stacks, from the arrays alone."""
    uv, chart, stack = (np.asarray(array) for array in (atlas.uv, atlas.chart, atlas.stack))
    report = atlas.report
    assert stack.dtype == np.int32 and stack.shape == (chart.max() + 1,)
    assert report["stacked"] == (stack >= 0).sum() == atlas.certificate["stacked"]
    assert report["stacks"] == stack.max(initial=-1) + 1
    assert atlas.certificate["valid"] and atlas.certificate["apart"] == 0 == report["overlaps"] == report["flips"]
    firsts = [np.flatnonzero(stack == number)[0] for number in range(report["stacks"])]
    assert firsts == sorted(firsts)
    sets = outlines(mesh, atlas)
    for number in range(report["stacks"]):
        members = np.flatnonzero(stack == number)
        assert len(members) > 1
        for member in members[1:]:
            assert_array_equal(sets[member], sets[members[0]])
    sign = np.sign(areas(mesh, uv))
    for number in range(len(stack)):
        assert len(set(sign[chart == number])) == 1, "a chart is turned over as a whole or not at all"
    assert (sign[np.append(stack, -1)[chart] < 0] > 0).all(), "what lies alone is never mirrored"
    mirrored = np.array([(sign[chart == number] < 0).all() for number in range(len(stack))])
    for number in range(report["stacks"]):
        assert mirrored[stack == number].mean() <= 0.5, "as few as can be are mirrored"
    given = {"texture_size": QUICK["texture_size"]}
    measured = native.measure(*mesh, uv, chart=chart, stacks=stack, **given)
    for name in ("overlaps", "flips", "charts", "packing_efficiency", "l2", "gap_texels"):
        assert measured[name] == report[name], name
    assert native.measure(*mesh, uv, chart=chart, **given)["overlaps"] > 0 or report["stacks"] == 0
    return sign


# What is stacked ------------------------------------------------------------------------------------------------------


def test_a_dozen_bolts_take_the_place_of_one():
    mesh = copies(bolt(), 12)
    off, on = unwrap(*mesh), unwrap(*mesh, stack="equal")
    assert off.report["stacked"] == 0 and (np.asarray(off.stack) == -1).all()
    sign = check(mesh, on)
    assert (sign > 0).all(), "equal parts are not mirrored"
    assert on.report["charts"] == on.report["stacked"] == 12 * on.report["stacks"]
    # The root of twelve, were the packing as dense.
    assert on.report["texels_per_unit"] > 3.0 * off.report["texels_per_unit"]


@pytest.mark.parametrize("how", ["equal", "mirrored"])
def test_mirrored_parts_lie_on_the_others_only_where_that_is_asked_for(how):
    mesh = copies(lump(), 6, mirrored={1, 2})
    atlas = unwrap(*mesh, stack=how)
    sign = check(mesh, atlas)
    one = len(np.unique(np.asarray(atlas.chart)[:96]))
    assert atlas.report["charts"] == 6 * one == atlas.report["stacked"]
    parts = (sign.reshape(6, -1) < 0).all(axis=1)
    if how == "equal":
        assert atlas.report["stacks"] == 2 * one and (sign > 0).all()
    else:
        assert atlas.report["stacks"] == one
        assert parts.tolist() == [False, True, True, False, False, False]


def test_mirrored_halves_lie_on_each_other():
    mesh = head()
    off, equal, on = (unwrap(*mesh, stack=how, **MANY_CHARTS) for how in ("off", "equal", "mirrored"))
    assert bytes(off.uv) == bytes(equal.uv) and equal.report["stacked"] == 0
    sign = check(mesh, on)
    chart, stack = np.asarray(on.chart), np.asarray(on.stack)
    assert on.report["stacks"] > 0 and (np.bincount(stack[stack >= 0]) == 2).all()
    middle = np.add.reduceat(mesh[0][mesh[1], 0], mesh[2][:-1])
    for number in range(on.report["stacks"]):
        first, second = np.flatnonzero(stack == number)
        assert (middle[chart == first] * middle[chart == first][0] > 0).all(), "it keeps to its half"
        assert middle[chart == first][0] * middle[chart == second][0] < 0
        assert (sign[chart == second] < 0).all()
    assert_array_equal(chart, np.asarray(off.chart))
    assert on.report["texels_per_unit"] > off.report["texels_per_unit"]


def test_halves_of_copies_lie_on_each_other_too():
    positions, corners, offsets = head()
    mesh = together((positions, corners, offsets), (turned(positions, TURNS[3]) + 4.0, corners, offsets))
    atlas = unwrap(*mesh, stack="mirrored", **MANY_CHARTS)
    check(mesh, atlas)
    count = np.bincount(np.asarray(atlas.stack)[np.asarray(atlas.stack) >= 0])
    assert set(count.tolist()) <= {2, 4} and 4 in count, "both halves of both, or what reaches across the plane of both"


def test_parts_that_are_not_alike_stay_apart():
    mesh = together(*((lump(seed)[0] + PLACES[seed], *lump(seed)[1:]) for seed in range(4)))
    off, on = unwrap(*mesh), unwrap(*mesh, stack="mirrored")
    check(mesh, on)
    assert on.report["stacked"] == 0
    assert bytes(off.uv) == bytes(on.uv)


def test_what_was_not_copied_is_not_stacked():
    mesh = copies(lump(), 2)
    count = len(mesh[0]) // 2
    away = np.ones(2 * count)
    away[count:][mesh[0][count:, 2] > 0] = 10.0
    painted = unwrap(*mesh, stack="equal", seam_weights=away)
    assert painted.report["stacked"] == 0
    corners = mesh[1][len(mesh[1]) // 2 :]
    seams = np.stack([corners[:8], corners[1:9]], axis=1)
    assert unwrap(*mesh, stack="equal", guides=seams).report["stacked"] == 0
    assert unwrap(*mesh, stack="equal", seam_weights=np.tile(away[count:], 2)).report["stacked"] > 0


@pytest.mark.parametrize("settings", [{"limit_over": "atlas"}, {"moves": "join"}, {"preset": "paper"}])
def test_settings_under_which_nothing_is_copied(settings):
    for mesh in (copies(lump(), 3), copies(ribbon(), 2)):
        off, on = (unwrap(*mesh, stack=how, **settings) for how in ("off", "mirrored"))
        assert on.report["stacked"] == 0 and bytes(off.uv) == bytes(on.uv)


def ribbon():
    """A wavy strip of 200 quads, fifty times as long as it is wide."""
    x, y = np.meshgrid(np.arange(101.0), np.arange(3.0))
    positions = np.column_stack([x.ravel(), y.ravel(), 0.3 * np.sin(x.ravel())])
    corner = np.arange(303).reshape(3, 101)
    quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    return positions, quads.ravel().astype(np.int32), np.arange(0, quads.size + 1, 4, dtype=np.int32)


def test_ribbons_too_long_for_the_texture_are_cut_alike():
    mesh = copies(ribbon(), 4)
    atlas = unwrap(*mesh, stack="equal")
    check(mesh, atlas)
    report = atlas.report
    assert report["stacks"] > 1 and report["stacked"] == report["charts"] == 4 * report["stacks"]


def test_leaves_of_one_quad_lie_on_each_other():
    leaf = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0.0]]), np.arange(4, dtype=np.int32), np.array([0, 4])
    small = leaf[0] * 0.5, *leaf[1:]
    mesh = together(copies(leaf, 12), (copies(small, 5)[0] + 40.0, *copies(small, 5)[1:]))
    atlas = unwrap(*mesh, stack="equal")
    check(mesh, atlas)
    assert (atlas.report["stacked"], atlas.report["stacks"]) == (17, 2)


def test_tiles_and_density_are_those_of_one_of_each_stack():
    mesh = copies(bolt(), 12)
    density = unwrap(*mesh, texture_size=256).report["texels_per_unit"]
    wanted = {"texture_size": 256, "texel_density": 1.5 * density, "tiles": 4}
    off, on = unwrap(*mesh, **wanted), unwrap(*mesh, stack="equal", **wanted)
    assert off.report["tiles"] > 1 == on.report["tiles"]
    assert on.report["texels_per_unit"] == pytest.approx(1.5 * density) and not on.report["warnings"]


# What is promised of them ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["off", "equal", "mirrored"])
def test_threads_do_not_matter(how):
    mesh = together(copies(lump(), 4, mirrored={2}), (head()[0] + 30.0, *head()[1:]))
    one, *others = (unwrap(*mesh, stack=how, threads=threads) for threads in (1, 2, 8))
    for other in others:
        assert bytes(other.uv) == bytes(one.uv) and bytes(other.chart) == bytes(one.chart)
        assert bytes(other.stack) == bytes(one.stack)


def test_an_analysis_and_a_job_stack_as_a_call_does():
    mesh = copies(lump(), 3, mirrored={1})
    analysis = native.analyse(*mesh)
    direct = [unwrap(*mesh, stack=how) for how in ("mirrored", "off", "equal")]
    kept = [analysis.unwrap(**QUICK, stack=how) for how in ("mirrored", "off", "equal")]
    assert [bytes(atlas.uv) for atlas in kept] == [bytes(atlas.uv) for atlas in direct]
    assert [bytes(atlas.stack) for atlas in kept] == [bytes(atlas.stack) for atlas in direct]
    again = pickle.loads(pickle.dumps(direct[0]))
    assert bytes(again.stack) == bytes(direct[0].stack) and again.certificate == direct[0].certificate


@drawn(max_examples=15, deadline=None)
@given(
    count=st.integers(2, 6),
    mirrored=st.sets(st.integers(0, 5)),
    seed=st.integers(0, 50),
    how=st.sampled_from(["equal", "mirrored"]),
    noise=st.sampled_from([0.0, 1e-5, 1e-2]),
)
def test_any_copies_keep_all_promises(count, mirrored, seed, how, noise):
    positions, corners, offsets = copies(lump(seed), count, mirrored)
    shake = np.random.default_rng(seed).uniform(-noise, noise, positions.shape)
    mesh = positions + shake, corners, offsets
    atlas = unwrap(*mesh, stack=how)
    check(mesh, atlas)
    if noise == 0.0:
        assert atlas.report["stacked"] > 0 or (how == "equal" and count == 2 and len(mirrored & {0, 1}) == 1)


# Measuring ------------------------------------------------------------------------------------------------------------


def squares():
    """Three unit squares side by side, their UVs on the same place, and their charts."""
    x = np.repeat([0.0, 3.0, 6.0], 4) + np.tile([0.0, 1.0, 1.0, 0.0], 3)
    positions = np.column_stack([x, np.tile([0.0, 0.0, 1.0, 1.0], 3), np.zeros(12)])
    mesh = positions, np.arange(12, dtype=np.int32), np.arange(0, 13, 4, dtype=np.int32)
    uv = np.tile(np.array([[0.1, 0.1], [0.3, 0.1], [0.3, 0.3], [0.1, 0.3]], np.float32), (3, 1))
    return mesh, uv, np.arange(3, dtype=np.int32)


def test_overlap_that_is_meant_is_none_and_any_other_is_counted():
    mesh, uv, chart = squares()
    given_settings = {"texture_size": 100, "margin": 2.0}

    def measured(stack, uv=uv):
        return native.measure(*mesh, uv, chart=chart, stacks=stack, **given_settings)

    assert native.measure(*mesh, uv, **given_settings)["overlaps"] == 6
    alone = measured(np.array([-1, -1, -1]))
    assert alone["overlaps"] == 6 and alone["gap_texels"] == 0
    all_of_them = measured(np.array([4, 4, 4]))
    assert (all_of_them["overlaps"], all_of_them["flips"], all_of_them["charts"]) == (0, 0, 3)
    assert all_of_them["packing_efficiency"] == pytest.approx(0.04) and all_of_them["gap_texels"] == 8
    # Two triangles of the stack's place and two of the third.
    two = measured(np.array([0, 0, -1], np.int64))
    assert two["overlaps"] == 2 and two["gap_texels"] == 0
    # A member that lies half beside its stack: the place of one is covered, and nothing unmeant overlaps.
    moved = uv.copy()
    moved[4:8] += 0.1
    assert measured(np.array([0, 0, 0]), moved)["overlaps"] == 0


def test_hundreds_of_copies_are_measured_at_once():
    cells = np.arange(400)
    quad = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    positions = np.concatenate([np.column_stack([quad[:, 0] + 2 * k, quad[:, 1], np.zeros(4)]) for k in cells])
    mesh = positions, np.arange(1600, dtype=np.int32), np.arange(0, 1601, 4, dtype=np.int32)
    uv = np.tile(0.5 * quad + 0.25, (400, 1))
    given_settings = {"chart": cells, "stacks": np.zeros(400, np.int32), "texture_size": 64}
    measured = native.measure(*mesh, uv, **given_settings)
    assert measured["overlaps"] == 0 and measured["overlaps_complete"] and measured["gap_complete"]
    assert measured["packing_efficiency"] == pytest.approx(0.25)


def test_stacks_that_cannot_be_are_refused():
    mesh, uv, chart = squares()
    with pytest.raises(native.InvalidArgumentError, match="chart 2"):
        native.measure(*mesh, uv, chart=chart, stacks=np.zeros(2, np.int32))
    with pytest.raises(native.InvalidArgumentError, match="no chart numbers"):
        native.measure(*mesh, uv, stacks=np.zeros(3, np.int32))
    with pytest.raises(native.InvalidArgumentError, match="stacks"):
        native.measure(*mesh, uv, chart=chart, stacks=np.zeros(3, np.float32))
    with pytest.raises(native.InvalidArgumentError, match="stack"):
        unwrap(*mesh, stack="everything")
