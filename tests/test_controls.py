"""What steers the borders of charts and what the limit bounds; the analysis that several calls share."""

import gc
import threading

import ble_unwrap_native as native
import conftest
import numpy as np
import pytest
from native_calls import QUICK, arrays, submit, unwrap
from numpy.testing import assert_array_equal


@pytest.fixture(scope="module")
def blob():
    """A closed surface with bumps, 1,536 faces."""
    positions, corners, offsets = conftest.sphere(48, 32)
    x, y, z = positions.T
    radius = 1 + 0.25 * np.sin(7 * x + 1) * np.cos(8 * y) + 0.2 * np.sin(9 * z)
    return positions * radius[:, None], corners, offsets


def sides(mesh, keep):
    """The sides of faces both of whose ends are kept, as pairs of vertices, lower first."""
    _, corners, offsets = mesh
    following = np.arange(1, len(corners) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    ends = np.sort(np.stack([corners, corners[following]], axis=1), axis=1)
    return np.unique(ends[keep[ends].all(axis=1)], axis=0).astype(np.int32)


def seam_middles(mesh, uv):
    """The middles of the sides of two faces at which UVs differ, (s, 3)."""
    positions, corners, offsets = mesh
    following = np.arange(1, len(corners) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    ends = np.stack([corners, corners[following]], axis=1)
    found = {}
    for (a, b), here, there in zip(ends.tolist(), uv.tolist(), uv[following].tolist(), strict=True):
        side, lies = ((a, b), (here, there)) if a < b else ((b, a), (there, here))
        found.setdefault(side, []).append(lies)
    seams = [side for side, lies in found.items() if len(lies) > 1 and any(lie != lies[0] for lie in lies)]
    return positions[np.array(seams, int).reshape(-1, 2)].mean(axis=1)


def borders(mesh, chart):
    """The sides with a chart of their own on either side."""
    _, corners, offsets = mesh
    following = np.arange(1, len(corners) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    owner = np.repeat(chart, np.diff(offsets))
    found = {}
    for a, b, c in zip(corners, corners[following], owner, strict=True):
        found.setdefault((min(a, b), max(a, b)), set()).add(c)
    return {side for side, charts in found.items() if len(charts) > 1}


# Guides and creases ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("index", [np.int32, np.int64])
def test_borders_follow_guides(ball, index):
    height = ball[0][:, 2]
    level = np.unique(height.round(9))[9]
    guides = sides(ball, np.isclose(height, level))
    assert len(guides) == 24
    wanted = set(map(tuple, guides.tolist()))
    share = {}
    for name, given in {"with": {"guides": guides.astype(index)}, "without": {}}.items():
        chart = arrays(unwrap(*ball, **given))[1]
        share[name] = len(borders(ball, chart) & wanted) / len(wanted)
    assert share["with"] > 0.9 > 0.6 > share["without"], share


def test_guides_cut_nothing_that_needs_no_border(hill):
    everything = sides(hill, np.ones(len(hill[0]), bool))
    report = unwrap(*hill, guides=everything).report
    assert report["charts"] == 1
    cut = unwrap(*hill, seams=sides(hill, hill[0][:, 0] == 0.5)).report
    assert cut["charts"] == 2, "seams are cut"


@pytest.mark.parametrize("real", [np.float32, np.float64])
def test_seams_run_where_they_are_welcome_and_keep_away_from_where_they_are_not(blob, real):
    x = blob[0][:, 0]
    share = {}
    for weight in (10.0, 1.0, 0.1):
        painted = np.where(x > 0.1, weight, 1.0).astype(real)
        middles = seam_middles(blob, arrays(unwrap(*blob, seam_weights=painted))[0])
        share[weight] = (middles[:, 0] > 0.1).mean()
    assert share[10.0] < 0.15 < 0.3 < share[1.0] < 0.6 < 0.7 < share[0.1], share


def test_seams_stay_mirrored_where_one_side_is_painted():
    positions, corners, offsets = conftest.sphere(32, 24)
    x, y, z = positions.T
    radius = 1 + 0.3 * np.cos(3 * z + 1) + 0.2 * np.sin(4 * y)  # left and right alike, the others not
    body = positions * radius[:, None], corners, offsets
    painted = np.where((x > 0.3) & (y > 0.2), 50.0, 1.0)
    middles = seam_middles(body, arrays(unwrap(*body, seam_weights=painted))[0])
    assert len(middles)
    assert {tuple(m) for m in (middles * (-1, 1, 1)).round(6) + 0.0} == {tuple(m) for m in middles.round(6) + 0.0}
    assert not ((abs(middles[:, 0]) > 0.5) & (middles[:, 1] > 0.4)).any(), "they keep away on both sides"


def test_like_parts_are_copies_only_where_they_are_painted_alike(blob):
    positions, corners, offsets = blob
    count = len(positions)
    both = (
        np.concatenate([positions, positions + np.array([5, 0, 0])]),
        np.concatenate([corners, corners + count]),
        np.concatenate([offsets, offsets[1:] + offsets[-1]]),
    )
    weights = np.where(positions[:, 0] > 0.1, 10.0, 1.0)
    alike = unwrap(*both, seam_weights=np.tile(weights, 2))
    assert alike.report["rungs"]["copied"] == 1
    different = unwrap(*both, seam_weights=np.concatenate([np.ones(count), weights]))
    assert "copied" not in different.report["rungs"]
    for atlas, first_keeps_away in ((alike, True), (different, False)):
        x = seam_middles(both, arrays(atlas)[0])[:, 0]
        first, second = x[x < 2.5], x[x > 2.5] - 5
        assert ((first > 0.1).mean() < 0.15) == first_keeps_away
        assert (second > 0.1).mean() < 0.15


def test_wrong_seam_weights_are_named(square):
    with pytest.raises(native.InvalidArgumentError, match=r"seam_weights: .* of shape \(n,\)"):
        native.unwrap(*square, seam_weights=np.ones((4, 1)))
    with pytest.raises(native.InvalidMeshError, match="3 seam weights, but 4 vertices"):
        native.unwrap(*square, seam_weights=np.ones(3))
    for wrong in (0.0, -1.0, 1001.0, np.nan):
        with pytest.raises(
            native.InvalidMeshError, match=r"seam weight of vertex 2 is not a number from 0\.001 to 1000"
        ):
            native.unwrap(*square, seam_weights=np.array([1.0, 1.0, wrong, 1.0]))


def test_wrong_guides_are_named(square):
    with pytest.raises(native.InvalidArgumentError, match=r"guides: .* of shape \(g, 2\)"):
        native.unwrap(*square, guides=np.zeros((1, 3), np.int32))
    with pytest.raises(native.InvalidMeshError, match="guide 1 names vertex 7"):
        native.unwrap(*square, guides=np.array([[0, 1], [1, 7]], np.int32))


def test_crease_weight_draws_borders_to_creases():
    """A barrel with bulging sides: the rims are creases, and not where the shortest borders are."""
    unit, corners, offsets = conftest.sphere(48, 32)
    along = 4 * np.arccos(np.clip(unit[:, 2], -1, 1)) / np.pi  # the lids below 1 and above 3
    radius = np.interp(along, [0, 1, 3, 4], [0, 1, 1, 0]) + 0.6 * np.sin(np.pi * np.clip((along - 1) / 2, 0, 1))
    angle = np.arctan2(unit[:, 1], unit[:, 0])
    height = np.interp(along, [0, 1, 3, 4], [1.3, 1, -1, -1.3])
    mesh = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1), corners, offsets
    rims = set(map(tuple, sides(mesh, np.isclose(along, 1) | np.isclose(along, 3)).tolist()))
    assert len(rims) == 96
    on_rim = {}
    for weight in (0, 1, 2):
        atlas = unwrap(*mesh, crease_weight=weight, stretch_limit=1.02, moves="split")
        on_rim[weight] = len(borders(mesh, arrays(atlas)[1]) & rims)
    assert on_rim[0] < 10 and min(on_rim[1], on_rim[2]) > 30, on_rim


@pytest.mark.parametrize("value", [-0.1, 5, "much", None, float("nan")])
def test_crease_weight_out_of_range(square, value):
    with pytest.raises(native.InvalidArgumentError, match="crease_weight: expected a number at least 0 and at most 2"):
        native.unwrap(*square, crease_weight=value)


# Front ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("front", "up"), [("-y", 2), ("x", 2), ("z", 1)])
@pytest.mark.parametrize("turn", [0, 1, 2, 3])
@pytest.mark.parametrize(("size", "unit"), [((512, 512), 1), ((512, 512), 1e-3), ((512, 512), 1e3), ((512, 256), 1)])
def test_what_is_up_where_a_front_is_given_is_up_in_the_layout(front, up, turn, size, unit):
    """A leaf that stands, its vertices beginning anywhere, so that the plane that it is flattened in has any turn."""
    outline = np.array([(-1, 0), (1, 0), (0.7, 2), (0, 2.6), (-0.7, 2)], float)
    positions = np.zeros((5, 3))
    positions[:, (up + 1) % 3], positions[:, up] = unit * np.roll(outline, turn, axis=0).T
    width, height = size
    options = {"texture_size": size} if width != height else {"texture_size": width}
    result = native.unwrap(positions, np.arange(5, dtype=np.int32), np.array([0, 5], np.int32), front=front, **options)
    uv, _ = arrays(result)
    tip, foot = uv[(3 + turn) % 5], uv[[turn % 5, (1 + turn) % 5]].mean(axis=0)
    upright = (tip - foot) * size
    # It may lean, which is denser; and where the texture is no square, it may lie on its side, but not on its head.
    assert upright[1] > (abs(upright[0]) if width == height else -0.01 * width)
    assert result.certificate["valid"]


@pytest.mark.parametrize("unit", [1e-3, 1, 1e3])
def test_a_layout_of_which_no_side_is_up_is_not_turned(unit):
    """A floor, which is packed as without a front, whatever the unit."""
    outline = unit * np.array([(-1, 0, 0), (1, 0, 0), (0.7, 2, 0), (0, 2.6, 0), (-0.7, 2, 0)])
    mesh = outline, np.arange(5, dtype=np.int32), np.array([0, 5], np.int32)
    assert_array_equal(native.unwrap(*mesh, front="-y").uv, native.unwrap(*mesh).uv)


# Limit over the atlas -------------------------------------------------------------------------------------------------


def test_a_limit_over_the_atlas(blob):
    charts = unwrap(*blob, stretch_limit=1.03).report
    atlas = unwrap(*blob, stretch_limit=1.03, limit_over="atlas").report
    assert charts["chart_limit"] == 1.03 and charts["atlas_limit"] is None
    assert atlas["chart_limit"] == pytest.approx(1.12) and atlas["atlas_limit"] == 1.03
    assert atlas["charts"] <= charts["charts"] and atlas["seam_length"] < charts["seam_length"]
    assert 1.03 < atlas["l2_worst_chart"] <= 1.12, "single charts have more than the limit"
    assert atlas["l2"] <= 1.03
    assert atlas["charts_over_limit"] == [] and atlas["warnings"] == []
    assert atlas["flips"] == atlas["overlaps"] == 0
    with pytest.raises(native.InvalidArgumentError, match="limit_over: expected 'chart' or 'atlas'; found 'mesh'"):
        unwrap(*blob, limit_over="mesh")


# Analysis -------------------------------------------------------------------------------------------------------------


def same(one, other):
    for a, b in zip(arrays(one), arrays(other), strict=True):
        assert_array_equal(a, b)
    reports = [{key: value for key, value in x.report.items() if key != "seconds"} for x in (one, other)]
    assert str(reports[0]) == str(reports[1])


def test_an_analysis_gives_what_unwrap_gives(blob):
    analysis = native.analyse(*blob)
    assert not analysis.weld and repr(analysis) == "Analysis(faces=1536, weld=False)"
    for settings in (
        {},
        {"stretch_limit": 1.02},
        {"stretch_limit": 1.3},
        {"stretch_limit": 1.05, "limit_over": "atlas"},
        {"stretch_limit": 1.05, "margin": 8, "seed": 2, "threads": 1},
        {"stretch_limit": 1.02, "model": "isomap"},
        {"stretch_limit": 1.02},
    ):
        same(analysis.unwrap(**QUICK | settings), unwrap(*blob, **settings))


def test_an_analysis_keeps_marks_and_welding(ball):
    positions, corners, offsets = ball
    marks = sides(ball, np.isclose(positions[:, 2], positions[:, 2].round(9)[100]))
    split = positions[corners], np.arange(len(corners), dtype=np.int32), offsets
    analysis = native.analyse(*split, weld=True)
    assert analysis.weld
    same(analysis.unwrap(**QUICK), unwrap(*split, weld=True))
    with pytest.raises(native.InvalidArgumentError, match="weld is false; it must be true, as in the analysis"):
        analysis.unwrap(weld=False)
    weights = np.where(positions[:, 0] > 0.1, 10.0, 1.0)
    for name, value in {"seams": marks, "guides": marks, "seam_weights": weights}.items():
        given = {name: value}
        same(native.analyse(*ball, **given).unwrap(**QUICK), unwrap(*ball, **given))


def test_wrong_arguments_of_an_analysis_are_named(square):
    with pytest.raises(native.InvalidArgumentError, match=r"analyse\(\) has no setting 'stretch_limit'"):
        native.analyse(*square, stretch_limit=1.1)
    with pytest.raises(native.InvalidArgumentError, match="positions: expected"):
        native.analyse(None, *square[1:])
    with pytest.raises(native.InvalidMeshError, match="corner 0"):
        native.analyse(square[0], square[1] + 40, square[2])
    analysis = native.analyse(*square)
    with pytest.raises(native.InvalidArgumentError, match="stretch_limit"):
        analysis.unwrap(stretch_limit=1.0)
    with pytest.raises(native.InvalidArgumentError, match="job: expected a new Job"):
        job = native.Job()
        native.analyse(*square, job=job)
        analysis.unwrap(job=job)
    with pytest.raises(TypeError):
        native.Analysis()


def test_an_analysis_serves_several_threads_and_jobs(blob):
    analysis = native.analyse(*blob)
    limits = [1.02, 1.1, 1.05, 1.02]
    jobs = [analysis.submit_unwrap(**QUICK, stretch_limit=limit) for limit in limits]
    del analysis
    gc.collect()  # the jobs keep what they need
    expected = {limit: unwrap(*blob, stretch_limit=limit) for limit in set(limits)}
    for limit, job in zip(limits, jobs, strict=True):
        same(job.result(), expected[limit])

    analysis = native.analyse(*blob)
    found = {}

    def run(limit):
        found[limit] = analysis.unwrap(**QUICK, stretch_limit=limit)

    threads = [threading.Thread(target=run, args=(limit,)) for limit in expected]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for limit, atlas in found.items():
        same(atlas, expected[limit])


def test_a_cancelled_call_leaves_the_analysis_good(large_ball):
    analysis = native.analyse(*large_ball)
    job = analysis.submit_unwrap(**QUICK)
    job.cancel()
    with pytest.raises(native.Cancelled):
        job.result()
    same(analysis.unwrap(**QUICK), submit(*large_ball).result())
    job = native.Job()
    job.cancel()
    with pytest.raises(native.Cancelled):
        native.analyse(*large_ball, job=job)


# Tiles and texel density ----------------------------------------------------------------------------------------------


def tiles_of(result, offsets):
    """The tile of each chart, whose faces must all lie in the same one."""
    uv, chart = arrays(result)
    number = np.floor(uv).astype(int) @ [1, 10]
    owner = np.repeat(chart, np.diff(offsets))
    found = {c: set(number[owner == c].tolist()) for c in np.unique(chart)}
    assert all(len(tiles) == 1 for tiles in found.values()), found
    return {c: tiles.pop() for c, tiles in found.items()}


def cube():
    """A cube of side 1, whose corners are its vertices."""
    positions = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return positions, np.array(quads, np.int32).ravel(), np.arange(0, 25, 4, dtype=np.int32)


def test_an_atlas_in_four_tiles_is_proven_on_any_number_of_threads(blob):
    options = {"tiles": 4, "texture_size": 256, "stretch_limit": 1.02}
    results = [native.unwrap(*blob, threads=threads, **options) for threads in (1, 2)]
    (uv, chart), (again, _) = map(arrays, results)
    assert_array_equal(uv.view(np.uint32), again.view(np.uint32))
    report, certificate = results[0].report, results[0].certificate
    assert certificate["valid"] and certificate["out_of_range"] == 0 and certificate["gap_texels"] >= 4
    tiles = tiles_of(results[0], blob[2])
    assert report["tiles"] == len(set(tiles.values())) == min(4, report["charts"]) and report["charts"] > 1
    measured = native.measure(*blob, uv, chart=chart, texture_size=256, tiles=4)
    assert measured["tiles"] == report["tiles"]
    assert measured["packing_efficiency"] == pytest.approx(report["packing_efficiency"])
    single = native.unwrap(*blob, **(options | {"tiles": 1})).report
    assert report["texels_per_unit"] > 1.1 * single["texels_per_unit"]
    # What lies in tiles that the texture has not is out of range.
    assert native.measure(*blob, uv, chart=chart, texture_size=256)["tiles"] == 0


@pytest.mark.parametrize(("size", "most"), [(4096, 1), (1024, 6), (600, 6)])
def test_a_cube_gets_the_texel_density_asked_for(size, most):
    mesh = cube()
    seams = np.array([[a, b] for a in range(8) for b in range(a) if bin(a ^ b).count("1") == 1], np.int32)
    result = native.unwrap(*mesh, seams=seams, texel_density=512, tiles=20, texture_size=size)
    uv, _ = arrays(result)
    assert result.certificate["valid"] and result.report["warnings"] == []
    sides = uv.astype(float).reshape(6, 4, 2) * size
    lengths = np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=-1)
    np.testing.assert_allclose(lengths, 512, rtol=1e-4)
    assert result.report["texels_per_unit"] == pytest.approx(512, rel=1e-6)
    assert result.report["tiles"] == len(set(tiles_of(result, mesh[2]).values())) == most


def test_a_texel_density_that_does_not_fit_warns(blob):
    result = native.unwrap(*blob, texel_density=5000, tiles=2, texture_size=128)
    (warning,) = [text for text in result.report["warnings"] if "texel density" in text]
    assert "5000 does not fit into 2 tiles" in warning
    assert result.certificate["valid"] and result.report["texels_per_unit"] < 5000
