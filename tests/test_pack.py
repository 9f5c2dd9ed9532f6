"""`pack`: charts into a texture, around charts that stay, as groups that move together, at a scale that is given.

Distances are measured here by plain NumPy, from the coordinates that are returned and by no code of the core.
"""

import contextlib
import threading
import time

import ble_unwrap_native as native
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

UNIT = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def joined(polygons):
    """Points, triangles and charts of convex polygons, each a chart."""
    points, triangles, chart = [], [], []
    for number, polygon in enumerate(polygons):
        first = sum(map(len, points))
        points.append(polygon)
        triangles += [[first, first + k, first + k + 1] for k in range(1, len(polygon) - 1)]
        chart += [number] * (len(polygon) - 2)
    return np.concatenate(points), np.array(triangles, np.int32), np.array(chart, np.int32)


def ngon(corners, radius, middle=(0.0, 0.0), turn=0.0):
    angles = turn + 2 * np.pi * np.arange(corners) / corners
    return np.array(middle) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def cross(a, b, c):
    return (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]


def distance(ones, others):
    """Least distance of two sets of triangles (n, 3, 2); 0 if two of them meet."""
    ones, others = ones[:, None], others[None]
    least = np.inf
    for s, t in ((ones, others), (others, ones)):
        for i in range(3):
            sides = np.stack(
                np.broadcast_arrays(*(cross(t[..., k, :], t[..., k - 2, :], s[..., i, :]) for k in range(3)))
            )
            if ((sides > 0).all(0) | (sides < 0).all(0)).any():
                return 0.0
            for j in range(3):
                p, a, b = s[..., i, :], t[..., j, :], t[..., j - 2, :]
                along = ((p - a) * (b - a)).sum(-1) / np.maximum(((b - a) ** 2).sum(-1), 1e-300)
                nearest = a + np.clip(along, 0, 1)[..., None] * (b - a)
                least = min(least, np.sqrt(((p - nearest) ** 2).sum(-1)).min())
                q = s[..., i - 2, :]
                if ((cross(p, q, a) * cross(p, q, b) < 0) & (cross(a, b, p) * cross(a, b, q) < 0)).any():
                    return 0.0
    return float(least)


def check(uv, triangles, whole, size, margin, *, border=None, staying=()):
    """Asserts that rigid wholes keep their margins, but for those that stay among each other."""
    texels = np.asarray(uv, np.float64) * size
    parts = {w: texels[triangles[whole == w]] for w in np.unique(whole) if w >= 0}
    low = {w: part.min((0, 1)) for w, part in parts.items()}
    high = {w: part.max((0, 1)) for w, part in parts.items()}
    border = margin / 2 if border is None else border
    for a in parts:
        if a in staying:
            continue
        assert (low[a] >= border).all() and (high[a] <= np.array(size) - border).all(), (a, low[a], high[a])
        for b in parts:
            apart = np.maximum(0, np.maximum(low[a] - high[b], low[b] - high[a]))
            if (b < a or b in staying) and np.linalg.norm(apart) < margin + 1:
                found = distance(parts[a], parts[b])
                assert found >= margin and found > 0, (a, b, found)


def shape(points):
    """What rigid motions leave: all distances."""
    return np.linalg.norm(points[:, None] - points[None], axis=-1)


SIDES = st.integers(3, 8)
PLACE = st.tuples(st.floats(0, 1), st.floats(0, 1))
POLYGONS = st.lists(st.tuples(SIDES, st.floats(0.01, 0.2), PLACE, st.floats(0, 6)), min_size=1, max_size=14)


@given(
    polygons=POLYGONS,
    staying=st.integers(0, 3),
    together=st.integers(0, 4),
    margin=st.sampled_from([0.0, 1.0, 2.5, 6.0]),
    border=st.sampled_from([None, 0.0, 7.5]),
    size=st.sampled_from([(128, 128), (200, 100), (90, 160)]),
    rotation=st.sampled_from(["aligned", "any", "quarter", "none"]),
)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_margins_hold_to_obstacles_and_between_groups(polygons, staying, together, margin, border, size, rotation):
    points, triangles, chart = joined([ngon(*polygon) for polygon in polygons])
    points = points.astype(np.float32)
    obstacles = chart < staying
    groups = np.where(~obstacles & (chart < staying + together), 5, -1).astype(np.int32)
    whole = np.where(groups == 5, staying, chart)
    options = {"margin": margin, "texture_size": size, "rotation": rotation, "border_margin": border}
    try:
        packed = native.pack(points, triangles, chart, obstacles=obstacles, groups=groups, **options)
    except native.InvalidArgumentError as error:
        assert "obstacles leave no room" in str(error) and staying
        return
    uv = np.asarray(packed.uv)
    stays = np.unique(triangles[obstacles])
    assert_array_equal(uv[stays].view(np.uint32), points[stays].view(np.uint32))
    check(uv, triangles, whole, size, margin, border=border, staying=set(range(staying)))
    # What moves together keeps its shape at the common scale; it may only be enlarged as a whole.
    scale = packed.report["texels_per_unit"]
    for number in set(whole[~obstacles]):
        own = np.unique(triangles[whole == number])
        before, after = shape(points[own].astype(float)), shape(uv[own].astype(float) * size)
        factor = after.max() / before.max()
        assert factor >= scale * (1 - 1e-3)
        assert factor <= scale * (1 + 1e-3) or after.max() < 2
        assert_allclose(after, factor * before, atol=1e-3 * max(size) / 100)


def test_copies_of_a_group_stay_stacked():
    points, triangles, chart = joined([ngon(5, 1.0), ngon(5, 1.0), ngon(7, 2.0, (9, 9))])
    packed = native.pack(points, triangles, chart, groups=np.array([3] * 6 + [-1] * 5), texture_size=256)
    uv = np.asarray(packed.uv)
    assert_array_equal(uv[:5], uv[5:10])
    assert packed.report["charts"] == 3
    # A pile of two covers its place once.
    alone = native.pack(points[5:], triangles[6 - 3 :] - 5, chart[3:], texture_size=256)
    assert packed.report["packing_efficiency"] <= alone.report["packing_efficiency"] * 1.1


def test_a_group_of_specks_is_enlarged_as_one():
    big, tiny = ngon(4, 100.0), 1e-3 * UNIT
    points, triangles, chart = joined([big, tiny, tiny + np.array([2e-3, 0])])
    packed = native.pack(points, triangles, chart, groups=np.array([-1, -1, 0, 0, 0, 0]), texture_size=128)
    texels = np.asarray(packed.uv)[4:].astype(float) * 128
    assert packed.report["specks"] == 1
    sides = shape(texels)
    assert sides[0, 5] == pytest.approx(3 * sides[0, 1], rel=1e-2) and 0.9 < np.ptp(texels, 0).max() < 1.1


def test_a_fixed_scale_is_kept_exactly():
    rng = np.random.default_rng(4)
    points, triangles, chart = joined([ngon(3 + k % 5, 0.02 + 0.1 * rng.random(), rng.random(2)) for k in range(12)])
    for size in [(256, 256), (512, 256)]:
        packed = native.pack(points, triangles, chart, scale="fixed", texture_size=size, margin=1)
        uv = np.asarray(packed.uv)
        check(uv, triangles, chart, size, 1.0)
        assert packed.report["texels_per_unit"] == pytest.approx(size[0], rel=1e-9)
        for number in range(12):
            own = np.unique(triangles[chart == number])
            assert_allclose(shape(uv[own].astype(float) * size), size[0] * shape(points[own]), atol=1e-4)
    with pytest.raises(native.InvalidArgumentError, match=r"do not fit at the size they have.* 0\.\d+ times as large"):
        native.pack(4 * points, triangles, chart, scale="fixed", texture_size=256)


def test_what_is_too_large_is_told_by_how_much():
    with pytest.raises(native.InvalidArgumentError, match=r"0\.4[78]\d* times as large"):
        native.pack(2 * UNIT, TWO, np.zeros(2, int), scale="fixed", texture_size=100, margin=4, rotation="none")
    packed = native.pack(0.5 * UNIT, TWO, np.zeros(2, int), scale="fixed", texture_size=100, rotation="none")
    assert_allclose(np.asarray(packed.uv), 0.25 + 0.5 * UNIT, atol=1e-6)


def test_specks_are_not_enlarged_at_a_fixed_scale():
    points, triangles, chart = joined([ngon(4, 0.1), ngon(4, 1e-5, (0.5, 0.5))])
    packed = native.pack(points, triangles, chart, scale="fixed", texture_size=64)
    assert packed.report["specks"] == 0
    assert np.ptp(np.asarray(packed.uv)[4:], 0).max() < 1e-4


def test_obstacles_leave_room_or_say_that_they_do_not():
    points, triangles, chart = joined([UNIT * [1, 0.5], ngon(6, 1.0), ngon(5, 1.0)])
    obstacles = chart == 0
    packed = native.pack(points, triangles, chart, obstacles=obstacles, texture_size=256, margin=4)
    uv = np.asarray(packed.uv)
    check(uv, triangles, chart, (256, 256), 4.0, staying={0})
    assert uv[4:, 1].min() >= 0.5 + 4 / 256
    # The hexagon and the pentagon fill the other half about as well as they would a texture of their own.
    half = native.pack(points[4:], triangles[2:] - 4, chart[2:], texture_size=(256, 126), margin=4)
    assert packed.report["texels_per_unit"] > 0.95 * half.report["texels_per_unit"]
    points[:4] = 3 * UNIT - 1
    with pytest.raises(native.InvalidArgumentError, match="the obstacles leave no room for 2 charts"):
        native.pack(points, triangles, chart, obstacles=obstacles, texture_size=256, margin=4)
    # Beyond the texture, but nearer than the margin.
    points[:4] = UNIT * [0.5, 1] + [1 + 1 / 256, 0]
    packed = native.pack(points, triangles, chart, obstacles=obstacles, texture_size=256, margin=8)
    check(np.asarray(packed.uv), triangles, chart, (256, 256), 8.0, staying={0})
    # All stay.
    kept = native.pack(points, triangles, chart, obstacles=np.ones(len(chart), bool), texture_size=256)
    assert_array_equal(np.asarray(kept.uv), points.astype(np.float32))
    assert kept.report["charts"] == 3


def test_the_whole_stays_if_a_part_of_it_does():
    points, triangles, chart = joined([UNIT / 4, UNIT / 4 + 0.5, ngon(3, 1.0)])
    obstacles = np.zeros(len(chart), bool)
    obstacles[0] = True
    packed = native.pack(
        points, triangles, chart, obstacles=obstacles, groups=np.array([0] * 4 + [-1]), texture_size=128
    )
    assert_array_equal(np.asarray(packed.uv)[:8], points[:8].astype(np.float32))
    check(np.asarray(packed.uv), triangles, np.array([0] * 4 + [1]), (128, 128), 4.0, staying={0})


def test_arguments_are_named_when_they_are_wrong():
    points, triangles, chart = joined([UNIT, UNIT])
    cases = [
        ({"groups": [0, 0, 0]}, "there are 3 group numbers, but 4 triangles"),
        ({"groups": [1, -1, 0, 0]}, "chart 0 is in group 1 and in group -1"),
        ({"obstacles": [True]}, "there are 1 flags for obstacles, but 4 triangles"),
        ({"obstacles": [1, 0, 0, 0]}, r"obstacles: expected a bool array of shape \(t,\)"),
        ({"border_margin": -1}, "a distance of -1 texels to the border"),
        ({"border_margin": 32}, "a distance of 32 texels to the border leaves no room"),
        ({"border_margin": "wide"}, "border_margin: expected a number"),
        ({"scale": "huge"}, "scale: expected 'uniform' or 'fixed'"),
        ({"quality": "best"}, "quality: expected 'fast', 'normal' or 'high'"),
    ]
    for keywords, message in cases:
        keywords = {name: np.array(value) if isinstance(value, list) else value for name, value in keywords.items()}
        with pytest.raises(native.InvalidArgumentError, match=message):
            native.pack(points, triangles, chart, texture_size=64, **keywords)
    shared = np.array([[0, 1, 2], [0, 2, 3]])
    with pytest.raises(native.InvalidArgumentError, match="point 0 belongs to charts 0 and 1"):
        native.pack(UNIT, shared, np.array([0, 1]), texture_size=64)
    # Charts of one group may share points.
    assert native.pack(UNIT, shared, np.array([0, 1]), groups=np.array([2, 2]), texture_size=64).report["charts"] == 2
    for bad in (np.nan, np.inf, 1e200):
        broken = UNIT.copy()
        broken[2, 0] = bad
        with pytest.raises(native.InvalidArgumentError, match="point 2, a corner of triangle 0, has a coordinate"):
            native.pack(broken, TWO, np.zeros(2, int), texture_size=64)
    with pytest.raises(native.InvalidArgumentError, match=r"point 1 of an obstacle is more than .* textures away"):
        native.pack(1e9 * UNIT, TWO, np.zeros(2, int), obstacles=np.ones(2, bool), texture_size=64)


@pytest.mark.parametrize("quality", ["fast", "normal", "high"])
def test_every_quality_keeps_the_margin_and_is_deterministic(quality):
    rng = np.random.default_rng(1)
    points, triangles, chart = joined(
        [ngon(3 + k % 6, 0.2 + rng.random(), turn=k) * [1 + rng.random(), 1] for k in range(24)]
    )
    found = [
        native.pack(
            points, triangles, chart, quality=quality, texture_size=256, margin=2, rotation="any", threads=threads
        )
        for threads in (1, 2)
    ]
    assert_array_equal(np.asarray(found[0].uv), np.asarray(found[1].uv))
    check(np.asarray(found[0].uv), triangles, chart, (256, 256), 2.0)


def test_more_effort_packs_denser():
    rng = np.random.default_rng(2)
    total = dict.fromkeys(("fast", "normal", "high"), 0.0)
    for count in (3, 8, 20):
        points, triangles, chart = joined([ngon(3 + k % 3, 0.3 + rng.random()) * [1 + k % 2, 1] for k in range(count)])
        for quality in total:
            packed = native.pack(points, triangles, chart, quality=quality, rotation="any", texture_size=512)
            total[quality] += packed.report["packing_efficiency"]
    assert total["fast"] < total["normal"] <= total["high"] * 1.01


def test_shapes_that_are_hard_to_pack():
    needle = UNIT * [1.0, 1e-4]
    flat = UNIT * [1.0, 0.0]
    point = UNIT * 0.0
    cases = {
        "one": [ngon(7, 1.0)],
        "one needle": [needle],
        "needles": [ngon(4, 1.0, turn=k) @ np.diag([1.0, 1e-4]) for k in range(30)],
        "identical": [UNIT] * 50,
        "flat": [flat, flat, UNIT],
        "only flat": [flat] * 3,
        "points": [point, point, UNIT],
        "only points": [point] * 3,
        "one huge": [1e6 * UNIT, *[UNIT] * 20],
    }
    for name, polygons in cases.items():
        points, triangles, chart = joined(polygons)
        for options in ({}, {"rotation": "any", "quality": "normal"}):
            packed = native.pack(points, triangles, chart, texture_size=128, margin=1, **options)
            uv = np.asarray(packed.uv)
            assert np.isfinite(uv).all(), name
            check(uv, triangles, chart, (128, 128), 1.0)


def tile_of(uv, triangles, chart):
    """The tile of each chart by the middle of its box, as (column, row)."""
    boxes = [(own.min(0), own.max(0)) for own in (uv[np.unique(triangles[chart == c])] for c in np.unique(chart))]
    return np.floor([(low + high) / 2 for low, high in boxes]).astype(int)


def check_tiles(packed, triangles, chart, size, margin, tiles):
    """Asserts that charts keep their promises in every tile, and that the report counts these."""
    uv = np.asarray(packed.uv).astype(float)
    tile = tile_of(uv, triangles, chart)
    number = tile @ [1, 10]
    assert number.min() >= 0 and number.max() < tiles and (tile[:, 0] < 10).all()
    for k in np.unique(number):
        here = number[chart] == k
        check(uv - tile[number == k][0], triangles[here], chart[here], size, margin)
    assert packed.report["tiles"] == len(np.unique(number))
    return number


def mixed(count, seed):
    rng = np.random.default_rng(seed)
    return joined([ngon(3 + k % 5, 0.3 + rng.random(), turn=k) * [1 + rng.random(), 1] for k in range(count)])


def test_charts_are_spread_over_tiles_on_any_number_of_threads():
    points, triangles, chart = mixed(40, 3)
    options = {"texture_size": (256, 200), "margin": 2.5, "tiles": 4}
    one, two = (native.pack(points, triangles, chart, threads=threads, **options) for threads in (1, 2))
    assert_array_equal(np.asarray(one.uv).view(np.uint32), np.asarray(two.uv).view(np.uint32))
    assert one.report == two.report and one.report["warnings"] == []
    check_tiles(one, triangles, chart, (256, 200), 2.5, 4)
    single = native.pack(points, triangles, chart, **(options | {"tiles": 1})).report
    assert one.report["tiles"] == 4 and single["tiles"] == 1
    assert one.report["texels_per_unit"] > 1.9 * single["texels_per_unit"]
    # The share that is covered is that of the tiles, by the very areas.
    a, b, c = (points[triangles[:, k]] for k in range(3))
    covered = 0.5 * np.abs(cross(a, b, c)).sum() * one.report["texels_per_unit"] ** 2 / (4 * 256 * 200)
    assert one.report["packing_efficiency"] == pytest.approx(covered, rel=1e-3)


@given(
    polygons=POLYGONS,
    tiles=st.integers(1, 25),
    density=st.sampled_from([None, 50.0, 400.0, 3000.0]),
    margin=st.sampled_from([0.0, 2.5, 6.0]),
    size=st.sampled_from([(128, 128), (90, 160)]),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_margins_hold_in_any_number_of_tiles(polygons, tiles, density, margin, size):
    points, triangles, chart = joined([ngon(*polygon) for polygon in polygons])
    options = {"texture_size": size, "margin": margin, "tiles": tiles, "texel_density": density}
    packed = native.pack(points, triangles, chart, **options)
    check_tiles(packed, triangles, chart, size, margin, tiles)
    reached = packed.report["texels_per_unit"]
    if density is not None:
        assert reached == pytest.approx(density, rel=1e-9) or (reached < density and packed.report["warnings"])


def test_a_texel_density_is_exact_in_as_few_tiles_as_needed():
    # The faces of a cube of side 1 with 512 texels to each side: four have room in 2 * 512 + 4 texels between two
    # borders of 2, and a little for rounding.
    points, triangles, chart = joined([UNIT] * 6)
    for size, tiles in ((2048, 1), (1040, 2), (1024, 6), (600, 6)):
        packed = native.pack(points, triangles, chart, texture_size=size, margin=4, tiles=50, texel_density=512)
        assert packed.report["tiles"] == tiles, size
        check_tiles(packed, triangles, chart, (size, size), 4.0, 50)
        sides = np.linalg.norm(np.diff(np.asarray(packed.uv).astype(float).reshape(6, 4, 2), axis=1), axis=-1) * size
        assert_allclose(sides, 512, rtol=1e-4)
        assert packed.report["texels_per_unit"] == pytest.approx(512, rel=1e-9) and not packed.report["warnings"]


def test_a_texel_density_that_does_not_fit_warns_and_is_as_dense_as_can_be():
    points, triangles, chart = joined([ngon(3 + k % 5, 1 + 0.2 * (k % 3), turn=k) for k in range(30)])
    options = {"texture_size": 128, "margin": 1}
    most = native.pack(points, triangles, chart, tiles=3, **options).report["texels_per_unit"]
    packed = native.pack(points, triangles, chart, tiles=3, texel_density=2 * most, **options)
    check_tiles(packed, triangles, chart, (128, 128), 1.0, 3)
    assert 0.95 * most < packed.report["texels_per_unit"] < 1.05 * most
    (warning,) = packed.report["warnings"]
    assert "does not fit into 3 tiles" in warning and "tiles or more" in warning
    (warning,) = native.pack(UNIT, TWO, np.zeros(2, int), tiles=3, texel_density=1000, **options).report["warnings"]
    assert "one chart is larger than a tile" in warning


def test_groups_obstacles_and_a_fixed_size_in_tiles():
    points, triangles, chart = joined([UNIT * 0.9 + [1.05, 0.05], *[0.4 * UNIT] * 6])
    obstacles = chart == 0
    groups = np.where(chart == 1, 7, np.where(chart == 2, 7, -1)).astype(np.int32)
    options = {"texture_size": 128, "margin": 2, "tiles": 4, "obstacles": obstacles, "groups": groups}
    packed = native.pack(points, triangles, chart, scale="fixed", **options)
    uv = np.asarray(packed.uv)
    assert_array_equal(uv[:4], points[:4].astype(np.float32))
    assert_array_equal(uv[4:8], uv[8:12])
    number = tile_of(uv.astype(float), triangles, chart) @ [1, 10]
    # The second tile has no room beside the obstacle; four squares have room in another, and five are to be placed.
    assert number[0] == 1 and set(number[1:]) == {0, 2}
    assert packed.report["texels_per_unit"] == pytest.approx(128)
    with pytest.raises(native.InvalidArgumentError, match="cannot be given a texel density of 9"):
        native.pack(points, triangles, chart, scale="fixed", texel_density=9, **options)


def squares(count, seed=0):
    rng = np.random.default_rng(seed)
    points = (UNIT * np.exp(rng.normal(size=(count, 1, 1)))).reshape(-1, 2)
    triangles = (TWO + 4 * np.arange(count)[:, None, None]).reshape(-1, 3).astype(np.int32)
    return points, triangles, np.repeat(np.arange(count, dtype=np.int32), 2)


def test_twenty_thousand_charts():
    count, margin, size = 20_000, 2.0, 4096
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(count, 3, 2)) * np.exp(rng.normal(size=(count, 1, 1)))
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    packed = native.pack(
        corners.reshape(-1, 2), triangles, np.arange(count, dtype=np.int32), texture_size=size, margin=margin
    )
    texels = (np.asarray(packed.uv).astype(float) * size).reshape(count, 3, 2)
    assert packed.report["charts"] == count and packed.report["packing_efficiency"] > 0.3
    low, high = texels.min(1), texels.max(1)
    assert low.min() >= margin / 2 and high.max() <= size - margin / 2
    # By columns of boxes: those whose sides overlap in x and that come near in y are measured.
    order = np.argsort(low[:, 1])
    low, high, texels = low[order], high[order], texels[order]
    for k in range(0, count, 50):
        near = (low[:, 1] <= high[k, 1] + margin) & (high[:, 1] >= low[k, 1] - margin)
        near &= (low[:, 0] <= high[k, 0] + margin) & (high[:, 0] >= low[k, 0] - margin)
        near[k] = False
        if near.any():
            assert distance(texels[k : k + 1], texels[near]) >= margin


def test_obstacles_are_kept_by_thousands_of_charts():
    points, triangles, chart = squares(9000)
    stays = ngon(6, 0.3, (0.5, 0.5)).astype(np.float32)
    all_points = np.concatenate([stays, points])
    all_triangles = np.concatenate([[[0, k, k + 1] for k in range(1, 5)], triangles + 6])
    all_charts = np.concatenate([np.zeros(4, int), chart + 1])
    packed = native.pack(
        all_points, all_triangles, all_charts, obstacles=all_charts == 0, texture_size=2048, margin=3, border_margin=10
    )
    uv = np.asarray(packed.uv)
    assert_array_equal(uv[:6], stays)
    texels = uv.astype(float) * 2048
    assert texels[6:].min() >= 10 and texels[6:].max() <= 2038
    assert distance(texels[all_triangles[:4]], texels[all_triangles[4:]]) >= 3


@pytest.mark.parametrize("tiles", [{}, {"tiles": 12}, {"tiles": 30, "texel_density": 500.0}])
@pytest.mark.parametrize("count", [2000, 60_000])
def test_cancelling_is_seen_soon(count, tiles):
    points, triangles, chart = squares(count)
    job = native.Job()
    times = []

    def cancel():
        time.sleep(0.15)
        times.append(time.perf_counter())
        job.cancel()

    thread = threading.Thread(target=cancel)
    thread.start()
    with contextlib.suppress(native.Cancelled):  # packing may also have ended before
        native.pack(points, triangles, chart, texture_size=4096, quality="high", job=job, **tiles)
    ended = time.perf_counter()
    thread.join()
    # Much of a second, not a tenth: the machine may be busy with other tests.
    assert ended - times[0] < 1.0
