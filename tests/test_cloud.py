"""Point clouds through the native module: types, errors, jobs, threads."""

import ble_unwrap_native as native
import numpy as np
import pytest
from numpy.testing import assert_array_equal

QUICK = {"texture_size": 256, "rotation": "none"}


def ball(n, seed=0):
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def unwrap(points, **settings):
    return native.unwrap_points(points, **(QUICK | settings))


def test_types_and_report():
    points = ball(1500)
    points[7] = np.nan
    atlas = unwrap(points)
    uv, chart = np.asarray(atlas.uv), np.asarray(atlas.chart)
    assert (uv.shape, uv.dtype, chart.shape, chart.dtype) == ((1500, 2), np.float32, (1500,), np.int32)
    assert chart[7] == -1 and tuple(uv[7]) == (0, 0)
    assert uv.min() >= 0 and uv.max() <= 1
    report = atlas.report
    assert set(np.delete(chart, 7)) == set(range(report["charts"]))
    assert (report["points"], report["unmapped_points"], report["pieces"]) == (1500, 1, 1)
    assert 1 <= report["l2"] <= 1.1 and report["charts"] >= 2
    assert report["landmarks"] > 0 and report["sweeps"] > 0 and report["seconds"] and report["rungs"]
    assert "points=1500" in repr(atlas)


def test_single_precision_and_strided_input_are_the_same_cloud():
    points = ball(600).astype(np.float32)
    wide = np.zeros((600, 6), np.float32)
    wide[:, ::2] = points
    assert_array_equal(np.asarray(unwrap(points).uv), np.asarray(unwrap(wide[:, ::2]).uv))
    assert_array_equal(np.asarray(unwrap(points).uv), np.asarray(unwrap(points.astype(float)).uv))


def test_duplicates_share_their_place():
    points = np.concatenate([ball(500)] * 2)
    atlas = unwrap(points)
    uv = np.asarray(atlas.uv)
    assert atlas.report["duplicate_points"] == 500
    assert_array_equal(uv[:500], uv[500:])


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_few_points(n):
    atlas = unwrap(ball(n))
    assert np.asarray(atlas.uv).shape == (n, 2)
    assert (np.asarray(atlas.chart) >= 0).all()


def test_settings_have_an_effect():
    points = ball(1500)
    strict = unwrap(points, stretch_limit=1.01).report["charts"]
    assert strict > unwrap(points).report["charts"]
    assert unwrap(points, model="isomap").report["sweeps"] == 0
    assert unwrap(points, neighbours=20).report["pieces"] == 1


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"neighbours": 3}, "neighbours"),
        ({"neighbours": True}, "neighbours"),
        ({"stretch_limit": 1.0}, "stretch_limit"),
        ({"holes": "cut"}, "unwrap_points"),
        ({"margin": 500}, "margin"),
    ],
)
def test_wrong_settings(settings, text):
    with pytest.raises(native.InvalidArgumentError, match=text):
        unwrap(ball(100), **settings)


def test_wrong_points():
    for wrong in [np.zeros((5, 2)), np.zeros(6), np.zeros((4, 3), np.int32), [[0, 0, 0]]]:
        with pytest.raises(native.InvalidArgumentError, match="positions"):
            unwrap(wrong)
    with pytest.raises(native.InvalidArgumentError, match="finite"):
        unwrap(np.full((4, 3), np.nan))


def test_jobs_threads_and_cancel():
    points = ball(3000)
    job = native.submit_unwrap_points(points, **QUICK)
    expected = np.asarray(job.result().uv)
    assert job.progress() == 1 and isinstance(job.result(), native.PointAtlas)
    for threads in (1, 2, 8):
        assert_array_equal(np.asarray(unwrap(points, threads=threads).uv), expected)
    job = native.Job()
    job.cancel()
    with pytest.raises(native.Cancelled):
        unwrap(points, job=job)
