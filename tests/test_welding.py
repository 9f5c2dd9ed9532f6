"""Vertices that count as one: edges of no length, which always are a point, and welding within a distance."""

from itertools import pairwise

import ble_unwrap_native as native
import numpy as np
import pytest
from conftest import grid
from native_calls import arrays
from numpy.testing import assert_array_equal

# Room for hundreds of charts, where welding fails.
QUICK = {"texture_size": 256, "margin": 1, "rotation": "none"}


def unwrap(*mesh, **settings):
    return native.unwrap(*mesh, **(QUICK | settings))


def flat(faces):
    """Lists of vertices as corner_vertices and face_offsets."""
    sizes = [len(face) for face in faces]
    return np.concatenate(faces).astype(np.int32), np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)


def fanned(faces):
    return [[face[0], face[k], face[k + 1]] for face in faces for k in range(1, len(face) - 1)]


def doubled(triangles):
    """A bent sheet of 36 quads of which every fifth has a corner twice, by a vertex of its own at the same place."""
    positions, corners, _ = grid(6, 6, lambda x, y: 0.3 * x * y)
    faces = [list(face) for face in corners.reshape(-1, 4)]
    copies = [faces[k][0] for k in range(0, 36, 5)]
    for number, k in enumerate(range(0, 36, 5)):
        faces[k].insert(0, len(positions) + number)
    return np.concatenate([positions, positions[copies]]), fanned(faces) if triangles else faces


def soup(noise=1e-7):
    """Triangles that share no vertex, each coordinate off by a few last digits of single precision."""
    positions, corners, _ = grid(12, 8, lambda x, y: 0.15 * np.sin(8 * x))
    triangles = np.array(fanned(corners.reshape(-1, 4)))
    apart = 2 * positions[triangles.ravel()] + np.random.default_rng(22).normal(0, noise, (triangles.size, 3))
    return apart, np.arange(triangles.size, dtype=np.int32), np.arange(0, triangles.size + 1, 3, dtype=np.int32)


def turned(positions, size=1.0, offset=0.0):
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    return size * positions @ rotation.T + offset


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("weld", [False, True])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_edges_of_no_length_cost_no_chart_and_no_seam(triangles, weld, size):
    positions, faces = doubled(triangles)
    positions = turned(positions, size)
    corners, offsets = flat(faces)
    atlas = unwrap(positions, corners, offsets, weld=weld)
    report = atlas.report
    assert (report["charts"], report["seam_length"], report["unmapped_faces"]) == (1, 0, 0)
    assert report["l2"] < 1.005
    assert any("8 edges have no length" in text for text in report["warnings"])
    uv, chart = arrays(atlas)
    assert (chart == 0).all()
    # What lies at one place of the surface lies at one place of the texture.
    for v in range(49, 57):
        original = np.flatnonzero((positions == positions[v]).all(axis=1))
        assert len(np.unique(uv[np.isin(corners, original)], axis=0)) == 1
    # Every triangle with an area has one in the texture, whichever way its face is triangulated.
    for first, last in pairwise(offsets):
        for k in range(first + 1, last - 1):
            a, b, c = uv[[first, k, k + 1]].astype(float)
            p, q, r = positions[corners[[first, k, k + 1]]]
            flat_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            assert flat_area > 0 or np.linalg.norm(np.cross(q - p, r - p)) == 0


def test_faces_that_are_a_segment_follow_a_neighbour():
    # Two sheets whose border is joined by quads without width, and one triangle that is a point.
    positions, corners, _ = grid(4, 4)
    other = positions + np.array([1.0, 0.0, 0.0])
    faces = [*corners.reshape(-1, 4), *(corners.reshape(-1, 4) + 25)]
    faces += [[25 + 5 * j, 30 + 5 * j, 9 + 5 * j, 4 + 5 * j] for j in range(4)] + [[7, 7, 7]]
    corners, offsets = flat(faces)
    atlas = unwrap(np.concatenate([positions, other]), corners, offsets)
    assert (atlas.report["charts"], atlas.report["seam_length"]) == (1, 0)
    uv, chart = arrays(atlas)
    assert (chart == 0).all()
    for face in range(32, 37):
        for corner in range(offsets[face], offsets[face + 1]):
            assert (uv[corner] == uv[:128][corners[:128] == corners[corner]]).all(axis=1).any()


# Far from the origin single precision has longer steps: 6e-5 at 1000.
@pytest.mark.parametrize(
    ("size", "offset", "noise"),
    [(1, 0, 1e-7), (1e-3, 0, 1e-7), (1e3, 0, 1e-7), (1, 1000, 1e-5), (1e-3, 1, 1e-5)],
)
def test_last_digits_weld_at_any_size_and_place(size, offset, noise):
    positions, corners, offsets = soup(noise)
    placed = turned(positions, size, offset).astype(np.float32)
    together = unwrap(placed, corners, offsets, weld=True).report
    assert (together["charts"], together["seam_length"]) == (1, 0)
    assert together["l2"] < 1.001
    assert unwrap(placed, corners, offsets, weld=True, weld_distance=0).report["charts"] > 1
    assert unwrap(placed, corners, offsets).report["charts"] == len(offsets) - 1


def test_a_weld_distance_is_in_the_unit_of_the_positions():
    coarse = soup(noise=1e-3)
    assert unwrap(*coarse, weld=True).report["charts"] > 100
    assert unwrap(*coarse, weld=True, weld_distance=0.01).report["charts"] == 1
    assert unwrap(*coarse, weld=False, weld_distance=0.01).report["charts"] == 192
    # However long, no face is welded to itself: all have a place in the texture.
    far = unwrap(*coarse, weld=True, weld_distance=10.0)
    assert far.report["unmapped_faces"] == far.report["flips"] == far.report["overlaps"] == 0


def test_the_order_of_vertices_does_not_decide_what_is_welded():
    positions, corners, offsets = soup(noise=1e-3)
    order = np.random.default_rng(5).permutation(len(positions))
    place = np.argsort(order).astype(np.int32)
    plain = unwrap(positions, corners, offsets, weld=True, weld_distance=0.01)
    shuffled = unwrap(positions[order], place[corners], offsets, weld=True, weld_distance=0.01)
    assert_array_equal(*(arrays(atlas)[0] for atlas in (plain, shuffled)))


def test_an_analysis_keeps_its_weld_distance():
    coarse = soup(noise=1e-3)
    analysis = native.analyse(*coarse, weld=True, weld_distance=0.01)
    assert (analysis.weld, analysis.weld_distance) == (True, 0.01)
    assert native.analyse(*coarse).weld_distance is None
    expected = unwrap(*coarse, weld=True, weld_distance=0.01)
    for again in (analysis.unwrap(**QUICK), analysis.unwrap(**QUICK, weld=True, weld_distance=0.01)):
        assert_array_equal(arrays(again)[0], arrays(expected)[0])
    for other in (None, 0.02):
        with pytest.raises(
            native.InvalidArgumentError, match=r"weld_distance .* it must be what it was in the analysis"
        ):
            analysis.unwrap(weld_distance=other)


def test_measure_welds_as_unwrap_does():
    coarse = soup(noise=1e-3)
    atlas = unwrap(*coarse, weld=True, weld_distance=0.01)
    welded = native.measure(*coarse, atlas.uv, weld=True, weld_distance=0.01, texture_size=256)
    assert (welded["charts"], welded["seam_length"]) == (1, 0)
    assert native.measure(*coarse, atlas.uv, texture_size=256)["charts"] == 192
    stacked = np.tile(np.asarray(atlas.uv)[:3], (192, 1))
    assert native.measure(*coarse, stacked, weld=True, weld_distance=0.01, texture_size=256)["seam_length"] > 1


def test_single_steps_know_edges_of_no_length():
    positions, faces = doubled(False)
    flattening = native.flatten(positions, *flat(faces))
    places = np.asarray(flattening.uv)
    assert np.isfinite(places).all()
    distances = np.asarray(native.geodesic_distances(positions, *flat(faces), np.array([0, 48])))
    for v in range(49, 57):
        original = np.flatnonzero((positions[:49] == positions[v]).all(axis=1))[0]
        assert_array_equal(places[v], places[original])
        assert_array_equal(distances[:, v], distances[:, original])
