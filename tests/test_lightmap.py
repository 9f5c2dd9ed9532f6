"""The preset for lightmaps: hard edges cut, mip levels kept apart, rectangles on whole texels, narrow charts told."""

import ble_unwrap_native as native
import conftest
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import ConvexHull

# Meshes -------------------------------------------------------------------------------------------------------------


def mesh(positions, faces):
    sizes = [len(face) for face in faces]
    corners = np.concatenate([np.asarray(face, np.int32) for face in faces])
    return np.asarray(positions, float), corners, np.append(0, np.cumsum(sizes)).astype(np.int32)


def joined(meshes):
    positions, corners, offsets = zip(*meshes, strict=True)
    vertices = np.cumsum([0, *map(len, positions)])
    starts = np.cumsum([0, *map(len, corners)])
    return (
        np.concatenate(positions),
        np.concatenate([c + v for c, v in zip(corners, vertices, strict=False)]).astype(np.int32),
        np.concatenate([[0], *[o[1:] + s for o, s in zip(offsets, starts, strict=False)]]).astype(np.int32),
    )


def box(size=(1.0, 1.0, 1.0), at=(0.0, 0.0, 0.0)):
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) * size + at
    return mesh(corners, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


def table():
    legs = [box((0.08, 0.11, 0.7), (x, y, 0)) for x in (0.1, 1.3) for y in (0.1, 0.7)]
    return joined([box((1.5, 0.9, 0.05), (0, 0, 0.7)), *legs])


def cylinder(sides=32):
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rings = [np.stack([np.cos(angles), np.sin(angles), np.full(sides, z)], axis=1) for z in (0.0, 2.0)]
    following = (np.arange(sides) + 1) % sides
    walls = [[k, n, n + sides, k + sides] for k, n in enumerate(following)]
    return mesh(np.concatenate(rings), [*walls, list(range(sides))[::-1], list(range(sides, 2 * sides))])


MESHES = {"box": box((1.0, 0.7, 0.45)), "table": table(), "cylinder": cylinder(), "ball": conftest.sphere(24, 16)}


def lightmap(*arrays, **options):
    return native.unwrap(*arrays, preset="lightmap", **options)


def texels(uv, size):
    """UVs in texels, as what single precision holds."""
    return np.asarray(uv).astype(float) * size


def faces_of(arrays, result, number):
    """Corners of the faces of a chart, one after the other."""
    offsets = arrays[2]
    return [np.arange(offsets[f], offsets[f + 1]) for f in np.flatnonzero(np.asarray(result.chart) == number)]


# Hard edges ---------------------------------------------------------------------------------------------------------


def test_hard_edges_are_cut_and_soft_ones_are_not():
    assert lightmap(*box()).report["charts"] == 6
    assert native.unwrap(*box()).report["charts"] == 1, "a net, by default"
    assert lightmap(*table()).report["charts"] == 30
    assert lightmap(*cylinder(32)).report["charts"] == 3, "a wall and two caps"
    # The sides of a hexagon are 60° apart, those of an octagon 45°.
    assert lightmap(*cylinder(6)).report["charts"] == 8
    assert lightmap(*cylinder(8)).report["charts"] == 3


@settings(max_examples=25, deadline=None)
@given(angle=st.floats(5.0, 175.0), off=st.sampled_from([-0.5, 0.0, 0.5]))
def test_an_edge_is_cut_from_its_angle_on(angle, off):
    bend = np.radians(angle)
    positions = [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]]
    positions += [[1 + np.cos(bend), 1, np.sin(bend)], [1 + np.cos(bend), 0, np.sin(bend)]]
    arrays = mesh(positions, [[0, 3, 2, 1], [3, 5, 4, 2]])
    charts = native.unwrap(*arrays, cut_angle=angle + off, texture_size=64, moves="split").report["charts"]
    assert charts == (1 if off > 0 else 2)


def test_an_analysis_is_of_one_angle():
    arrays = MESHES["table"]
    once = lightmap(*arrays)
    analysis = native.analyse(*arrays, preset="lightmap")
    assert analysis.cut_angle == 50.0
    assert bytes(analysis.unwrap(preset="lightmap").uv) == bytes(once.uv)
    assert analysis.unwrap().report["charts"] == 30, "the angle is the analysis's where none is said"
    with pytest.raises(native.InvalidArgumentError, match=r"cut_angle.*as in the analysis"):
        native.analyse(*arrays).unwrap(preset="lightmap")
    with pytest.raises(native.InvalidArgumentError, match=r"cut_angle.*50, as in the analysis"):
        analysis.unwrap(cut_angle=60.0)
    assert native.analyse(*arrays, cut_angle=50).unwrap(cut_angle=50).report["charts"] == 30


# Mip levels ---------------------------------------------------------------------------------------------------------


def covered(arrays, result, size, level):
    """The chart of each texel of a mip level, -1 where there is none; a texel of two charts fails.

    A texel is on a chart where the square and a triangle meet in more than a border: no axis separates them.
    """
    shape = np.array([side >> level for side in size])
    of = np.full(tuple(shape), -1)
    at = texels(result.uv, size) * shape / size
    for number in range(result.report["charts"]):
        for corners in faces_of(arrays, result, number):
            for k in range(1, len(corners) - 1):
                triangle = at[corners[[0, k, k + 1]]]
                low = np.maximum(np.floor(triangle.min(axis=0)).astype(int), 0)
                high = np.minimum(np.ceil(triangle.max(axis=0)).astype(int), shape)
                x, y = (np.arange(low[axis], high[axis]) for axis in (0, 1))
                middles = np.stack(np.meshgrid(x + 0.5, y + 0.5, indexing="ij"), axis=-1)
                meets = np.ones(middles.shape[:2], bool)
                sides = np.roll(triangle, -1, axis=0) - triangle
                for axis in np.concatenate([np.eye(2), np.stack([-sides[:, 1], sides[:, 0]], axis=1)]):
                    along, half = triangle @ axis, 0.5 * np.abs(axis).sum()
                    middle = middles @ axis
                    meets &= (middle + half > along.min() + 1e-9) & (middle - half < along.max() - 1e-9)
                part = of[low[0] : high[0], low[1] : high[1]]
                assert np.isin(part[meets], (-1, number)).all(), f"a texel of level {level} is on two charts"
                part[meets] = number
    return of


def assert_no_neighbours(of):
    """No texel of a chart has one of another chart next to it, not at a corner either: of four texels that bilinear
    filtering reads together, two are on two charts only where they are next to each other."""
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        one = of[dx:, max(dy, 0) : of.shape[1] + min(dy, 0)]
        other = of[: of.shape[0] - dx, max(-dy, 0) : of.shape[1] - max(dy, 0)]
        assert not ((one >= 0) & (other >= 0) & (one != other)).any()


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize(("size", "levels"), [((256, 256), 1), ((256, 256), 3), ((256, 128), 2), ((500, 250), 2)])
def test_no_mip_level_mixes_two_charts(name, size, levels):
    arrays = MESHES[name]
    result = lightmap(*arrays, texture_size=size, mip_levels=levels, margin=0)
    margin = result.report["margin_texels"]
    assert margin == pytest.approx(2 * np.sqrt(2) * max(side / (side >> levels) for side in size))
    assert result.certificate["margin_texels"] == margin and result.certificate["valid"]
    for level in range(levels + 1):
        assert_no_neighbours(covered(arrays, result, size, level))


def test_the_raster_sees_what_a_narrower_margin_mixes():
    """The judge itself: with the margin of no mip level the same texels touch."""
    arrays = MESHES["table"]
    result = lightmap(*arrays, texture_size=256, mip_levels=0, margin=2)
    with pytest.raises(AssertionError):
        assert_no_neighbours(covered(arrays, result, (256, 256), 3))


def test_a_wider_margin_is_kept_and_none_is_raised_unasked():
    arrays = MESHES["box"]
    assert lightmap(*arrays, margin=40).report["margin_texels"] == 40
    assert native.unwrap(*arrays).report["margin_texels"] == 4
    assert native.unwrap(*arrays, margin=0).report["margin_texels"] == 0
    with pytest.raises(native.InvalidArgumentError, match=r"a margin of 724\.\d+ texels leaves no room"):
        lightmap(*arrays, texture_size=512, mip_levels=8)
    points = np.random.default_rng(1).random((40, 3))
    assert native.unwrap_points(points, mip_levels=2, texture_size=256).report["charts"] >= 1


def test_a_margin_shrinks_with_a_word_where_it_may():
    arrays = MESHES["table"]
    options = {"texture_size": 64, "mip_levels": 3}
    with pytest.raises(native.InvalidArgumentError, match="30 charts with a margin of"):
        lightmap(*arrays, **options)
    result = lightmap(*arrays, shrink_margin=True, **options)
    asked, kept = 16 * np.sqrt(2), result.report["margin_texels"]
    assert kept in (asked / 2, asked / 4, asked / 8) and result.certificate["margin_texels"] == kept
    assert result.certificate["valid"] and result.report["gap_texels"] >= kept
    (told,) = [text for text in result.report["warnings"] if "margin" in text and "leaves no room" in text]
    assert told.startswith("a margin of 22.63 texels") and f"made {round(kept, 2):g} texels" in told
    loose = lightmap(*arrays, texture_size=512, shrink_margin=True)
    assert bytes(loose.uv) == bytes(lightmap(*arrays, texture_size=512).uv)
    packed = native.pack(*rectangles([(1, 1)] * 9), texture_size=16, margin=8, shrink_margin=True)
    assert packed.report["warnings"] == [
        "a margin of 8 texels leaves no room for the charts in this texture, so it was made 4 texels; choose a larger "
        "texture for more"
    ]


# Whole texels -------------------------------------------------------------------------------------------------------


def off_texels(at):
    return np.abs(at - np.round(at)).max()


@pytest.mark.parametrize("size", [64, 256, 1024, (512, 256), 300])
@pytest.mark.parametrize("name", ["box", "table"])
def test_rectangles_have_their_borders_on_whole_texels(name, size):
    arrays = MESHES[name]
    result = lightmap(*arrays, texture_size=size, mip_levels=0, margin=1)
    at = texels(result.uv, np.broadcast_to(size, 2))
    whole = is_power = np.log2(size) % 1 == 0
    snapped, left = 0, 0
    for number in range(result.report["charts"]):
        (corners,) = faces_of(arrays, result, number)
        box_size = np.ptp(at[corners], axis=0)
        if box_size.min() < 0.99:
            continue
        snapped += 1
        off = off_texels(at[corners])
        # One of a few texels that is nearly stretched to the limit keeps its shape.
        if box_size.max() < 4 and off > 1e-4:
            left += 1
            continue
        # Single precision holds whole texels of a power of two exactly.
        assert off == 0 if np.all(is_power) else off < 1e-4, number
    assert snapped >= 5 and left <= 1 and np.all(whole == is_power)


def test_walls_are_laid_on_whole_texels_with_all_that_is_on_them():
    arrays = cylinder(32)
    result = lightmap(*arrays, texture_size=512)
    at = texels(result.uv, 512)
    wall = np.asarray(result.chart)[0]
    corners = np.concatenate(faces_of(arrays, result, wall))
    low, high = at[corners].min(axis=0), at[corners].max(axis=0)
    assert off_texels(low) == off_texels(high) == 0
    # Every corner of the wall is on one of its two long sides, all of them exactly.
    along = int(np.argmin(high - low))
    assert set(at[corners, along]) == {low[along], high[along]}


def test_what_is_no_rectangle_keeps_its_shape():
    arrays = cylinder(6)
    result = lightmap(*arrays, texture_size=512)
    at = texels(result.uv, 512)
    caps = [faces_of(arrays, result, number)[0] for number in range(8)]
    caps = [corners for corners in caps if len(corners) == 6]
    assert result.report["snapped_charts"] == 6
    for corners in caps:
        sides = np.linalg.norm(at[corners] - np.roll(at[corners], 1, axis=0), axis=1)
        assert_allclose(sides, sides.mean(), rtol=1e-4)
    assert len(caps) == 2


@pytest.mark.parametrize("limit", [1.0005, 1.01, 1.1])
def test_the_stretch_limit_holds_afterwards(limit):
    """Where laying a chart on texels would stretch it beyond the limit, it is left as it is."""
    arrays = table()
    result = lightmap(*arrays, texture_size=128, stretch_limit=limit, mip_levels=0, margin=1)
    assert result.report["charts_over_limit"] == [] and result.report["l2_worst_chart"] <= limit
    again = native.measure(*arrays, result.uv, texture_size=128, margin=1)
    assert again["l2_worst_chart"] == pytest.approx(result.report["l2_worst_chart"], rel=1e-6)
    at = texels(result.uv, 128)
    off = [off_texels(at[np.concatenate(faces_of(arrays, result, n))]) for n in range(result.report["charts"])]
    assert (max(off) > 0) == (limit < 1.1)


def test_no_chart_shares_a_place_and_no_threads_matter():
    for arrays in MESHES.values():
        results = [lightmap(*arrays, texture_size=256, threads=threads) for threads in (1, 2, 8)]
        assert len({bytes(result.uv) for result in results}) == 1
        assert results[0].report["overlaps"] == 0 and results[0].report["tiles"] == 1


def test_the_preset_only_sets_values():
    differing = {
        name: value
        for name, value in native.default_settings("lightmap").items()
        if value != native.default_settings()[name]
    }
    assert differing == {
        "preset": "lightmap",
        "cut_angle": 50.0,
        "mip_levels": 2,
        "snap": True,
        "texture_size": (1024, 1024),
    }
    del differing["preset"]
    for arrays in MESHES.values():
        assert bytes(native.unwrap(*arrays, **differing).uv) == bytes(lightmap(*arrays).uv)


def rectangles(sizes):
    """Points, triangles and charts of rectangles."""
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    points = np.concatenate([unit * size for size in sizes]).astype(float)
    first = 4 * np.arange(len(sizes))
    triangles = np.concatenate([first[:, None] + [0, 1, 2], first[:, None] + [0, 2, 3]], axis=1).reshape(-1, 3)
    return points, triangles.astype(np.int32), np.repeat(np.arange(len(sizes)), 2).astype(np.int32)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    sizes=st.lists(st.tuples(st.floats(0.3, 9.0), st.floats(0.3, 9.0)), min_size=1, max_size=12),
    margin=st.sampled_from([0.0, 1.0, 3.5]),
    rotation=st.sampled_from(["aligned", "quarter", "none"]),
    border=st.sampled_from([None, 0.0, 5.0]),
    size=st.sampled_from([(128, 128), (256, 128)]),
)
def test_packed_rectangles_fill_texels_and_keep_their_margin(sizes, margin, rotation, border, size):
    options = {"margin": margin, "rotation": rotation, "border_margin": border, "texture_size": size}
    packed = native.pack(*rectangles(sizes), snap=True, **options)
    at = texels(packed.uv, size).reshape(-1, 4, 2)
    low, high = at.min(axis=1), at.max(axis=1)
    scale = packed.report["texels_per_unit"]
    for number, wanted in enumerate(np.array(sizes) * scale):
        found = high[number] - low[number]
        if wanted.min() >= 1:
            assert off_texels(at[number]) == 0
            assert np.abs(np.sort(found) - np.sort(wanted)).max() < 1 + 1e-3
        else:
            assert_allclose(np.sort(found)[::-1] / found.max(), np.sort(wanted)[::-1] / wanted.max(), rtol=1e-2)
    edge = margin / 2 if border is None else border
    assert low.min() >= edge and (high <= np.array(size) - edge).all()
    for a in range(len(sizes)):
        for b in range(a):
            gap = np.maximum(np.maximum(low[a] - high[b], low[b] - high[a]), 0)
            assert np.hypot(*gap) >= margin and (gap.max() > 0 or margin == 0)


def test_pack_leaves_charts_alone_unless_asked():
    arrays = rectangles([(3.0, 2.0), (1.7, 1.1)])
    plain = native.pack(*arrays, texture_size=128)
    assert_array_equal(np.asarray(plain.uv), np.asarray(native.pack(*arrays, texture_size=128, snap=False).uv))
    assert off_texels(texels(plain.uv, 128)) > 0
    with pytest.raises(native.InvalidArgumentError, match="a margin of 40 texels leaves no room"):
        native.pack(*arrays, texture_size=40, margin=40, snap=True)
    raised = native.pack(*arrays, texture_size=128, mip_levels=2, rotation="none")
    same = native.pack(*arrays, texture_size=128, margin=8 * np.sqrt(2), rotation="none")
    assert_array_equal(np.asarray(raised.uv), np.asarray(same.uv))


# Narrow charts ------------------------------------------------------------------------------------------------------


def width(points):
    """The least distance of two parallel lines around points: one runs along a side of their hull."""
    hull = points[ConvexHull(points).vertices]
    sides = np.roll(hull, -1, axis=0) - hull
    normals = np.stack([-sides[:, 1], sides[:, 0]], axis=1) / np.linalg.norm(sides, axis=1)[:, None]
    return np.ptp(hull @ normals.T, axis=0).min()


@pytest.mark.parametrize("name", ["box", "table", "cylinder"])
@pytest.mark.parametrize("size", [24, 64, 200, 1024])
@pytest.mark.parametrize("preset", ["default", "lightmap"])
def test_narrow_charts_are_counted(name, size, preset):
    arrays = MESHES[name]
    result = native.unwrap(*arrays, preset=preset, texture_size=size, margin=0.5, mip_levels=0)
    at = texels(result.uv, size)
    charts = range(result.report["charts"])
    widths = np.array([width(at[np.concatenate(faces_of(arrays, result, number))]) for number in charts])
    narrow = result.report["narrow_charts"]
    assert narrow == list(np.flatnonzero(widths < 2 - 1e-3))
    told = [text for text in result.report["warnings"] if "narrower than two texels" in text]
    assert len(told) == (1 if narrow else 0)
    if narrow:
        assert told[0].startswith(f"{len(narrow)} chart") and f"chart {np.argmin(widths)} with" in told[0]
        assert f"with {widths.min():.2f}:" in told[0]


def test_some_are_narrow_and_some_are_not():
    """So that the test above means something."""
    few, all_of = (
        lightmap(*MESHES["table"], texture_size=size, margin=0.5, mip_levels=0).report["narrow_charts"]
        for size in (64, 24)
    )
    assert 0 < len(few) < len(all_of) <= 30


def test_a_slanting_strip_is_narrow_though_its_box_is_wide():
    strip = np.array([[0, 0, 0], [40, 40, 0], [39.5, 40.5, 0], [-0.5, 0.5, 0]])
    arrays = mesh(strip, [[0, 1, 2, 3]])
    result = native.unwrap(*arrays, texture_size=64, rotation="none", margin=0)
    assert result.report["narrow_charts"] == [0]
