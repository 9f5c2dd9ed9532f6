"""`embed`: the embedding for points, distances and affinities of any kind, as Python sees it. Its mathematics is tested
beside the core's code."""

import itertools
import multiprocessing

import ble_unwrap_native as native
import numpy as np
import pytest
from numpy.testing import assert_allclose


def distances_of(points):
    return np.linalg.norm(points[:, None] - points[None], axis=-1)


def roll(count, seed=0):
    """Random points of a rolled sheet, and where they are on the sheet."""
    u, v = np.random.default_rng(seed).random((2, count))
    t = 1.5 * np.pi * (1 + 2 * u)
    flat = np.column_stack([(t * np.sqrt(1 + t * t) + np.arcsinh(t)) / 2, 21 * v])
    return np.column_stack([t * np.cos(t), 21 * v, t * np.sin(t)]), flat


def in_unit_of_distance(embedding):
    return np.asarray(embedding.coordinates) * np.sqrt(embedding.report["sigma"])


def misfit(found, expected):
    """Root mean square distance after the best rigid motion or mirroring, over the size."""
    found, expected = found - found.mean(axis=0), expected - expected.mean(axis=0)
    u, _, v = np.linalg.svd(found.T @ expected)
    return np.linalg.norm(found @ u @ v - expected) / np.linalg.norm(expected)


# Results ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["points", "distances"])
def test_points_of_the_plane_come_back(kind):
    points = np.random.default_rng(3).random((60, 2))
    lifted = points @ np.linalg.qr(np.random.default_rng(4).normal(size=(5, 5)))[0][:2]
    result = native.embed(lifted if kind == "points" else distances_of(lifted), kind=kind)
    assert result.coordinates.shape == (60, 2) and result.coordinates.format == "d"
    assert misfit(in_unit_of_distance(result), points) < 1e-6
    assert np.asarray(result.intercepts).shape == (60,)
    report = result.report
    trace = report["trace"]
    assert all(b >= a - 1e-9 * abs(a) for a, b in itertools.pairwise(trace)), "the likelihood fell"
    assert report["log_likelihood"] == trace[-1] and report["bregman"] >= -1e-6
    assert report["converged"] and report["sweeps"] <= 60 and 0 < report["mean_affinity"] < 0.5
    assert sorted(np.asarray(report["landmarks"])) == list(range(60))


def test_the_printed_model_from_affinities():
    points = np.random.default_rng(5).random((40, 3))
    affinity = np.exp(-4 * distances_of(points) ** 2)
    settings = {"preset": "paper", "seed": 7, "max_sweeps": 30, "threads": 2}
    result = native.embed(affinity, kind="affinities", dimensions=3, **settings)
    assert result.coordinates.shape == (40, 3) and result.intercepts.shape == (0,)
    assert result.report["sigma"] == 1 and 1 <= result.report["sweeps"] <= 30
    again = native.embed(affinity, kind="affinities", dimensions=3, **settings)
    assert bytes(again.coordinates) == bytes(result.coordinates)
    other = native.embed(affinity, kind="affinities", dimensions=3, **(settings | {"seed": 8}))
    assert bytes(other.coordinates) != bytes(result.coordinates)


@pytest.mark.parametrize("update", ["serial", "parallel"])
@pytest.mark.parametrize("model", ["default", "paper"])
def test_the_likelihood_never_falls(model, update):
    affinity = np.random.default_rng(6).random((50, 50))
    for relaxation in (0.5, 1.0, 1.5, 1.9):
        options = {"model": model, "update": update, "relaxation": relaxation, "initial": "random", "tolerance": 1e-15}
        report = native.embed(affinity, kind="affinities", **options).report
        trace = np.array(report["trace"])
        assert (np.diff(trace) >= -1e-9 * np.abs(trace[1:])).all(), relaxation
        assert trace[-1] > trace[0]


def test_a_rolled_sheet_is_unrolled_along_its_graph():
    points, flat = roll(1500)
    for landmarks in (None, 100):
        result = native.embed(points, metric="geodesic", landmarks=landmarks)
        assert misfit(in_unit_of_distance(result), flat) < 0.06
        assert len(result.report["landmarks"]) == (landmarks or 1500)
    assert misfit(in_unit_of_distance(native.embed(points)), flat) > 0.3, "straight distances cannot unroll it"


def test_landmarks_and_transform_place_points_of_the_plane_where_they_are():
    points = np.random.default_rng(7).random((900, 2))
    result = native.embed(points[:800], landmarks=30)
    assert misfit(in_unit_of_distance(result), points[:800]) < 1e-6
    placed = np.asarray(result.transform(points[800:])) * np.sqrt(result.report["sigma"])
    everything = np.vstack([in_unit_of_distance(result), placed])
    assert misfit(everything, points) < 1e-6
    assert_allclose(result.transform(points[:800]), result.coordinates, atol=1e-6)


def test_transform_takes_distances_and_affinities_to_the_landmarks():
    points = np.random.default_rng(8).random((120, 2))
    d = distances_of(points)
    for kind, data in (("distances", d), ("affinities", 1 / (1 + np.exp(2 * d**2)))):
        result = native.embed(data, kind=kind, landmarks=25)
        landmarks = np.asarray(result.report["landmarks"])
        assert_allclose(result.transform(data[:, landmarks]), result.coordinates, atol=1e-6)


@pytest.mark.parametrize("landmarks", [None, 20])
def test_isomap_is_scaling_of_the_same_distances(landmarks):
    points = np.random.default_rng(9).random((80, 2))
    result = native.embed(points, model="isomap", landmarks=landmarks)
    assert misfit(np.asarray(result.coordinates), points) < 1e-6
    report = result.report
    assert report["log_likelihood"] is None and report["bregman"] is None and report["trace"] == []
    assert report["sigma"] == 1 and report["converged"]
    assert_allclose(result.transform(points), result.coordinates, atol=1e-6)


def test_a_given_start_is_taken_up():
    affinity = np.random.default_rng(10).random((30, 30))
    first = native.embed(affinity, kind="affinities", initial="random", max_sweeps=3)
    start = np.asarray(first.coordinates)
    again = native.embed(affinity, kind="affinities", initial=start, max_sweeps=1)
    other = native.embed(affinity, kind="affinities", initial=start[::-1].copy(), max_sweeps=1)
    assert again.report["trace"][0] > other.report["trace"][0]


def test_widths_by_any_of_their_three_names():
    points = np.random.default_rng(11).random((50, 3))
    square = distances_of(points)[np.triu_indices(50, 1)] ** 2
    assert_allclose(native.embed(points, kernel_width=0.3).report["sigma"], 0.3 * square.mean())
    assert native.embed(points, sigma=0.07).report["sigma"] == 0.07
    by_mean = native.embed(points, mean_affinity=0.31).report
    assert_allclose(by_mean["mean_affinity"], 0.31, rtol=1e-5)
    assert_allclose((1 / (1 + np.exp(square / 2 / by_mean["sigma"]))).mean(), 0.31, rtol=1e-5)


def test_asymmetric_affinities_count_as_their_mean():
    p = np.random.default_rng(12).random((25, 25))
    mean = (p + p.T) / 2
    for options in ({}, {"preset": "paper"}):
        a, b = (native.embed(x, kind="affinities", dimensions=3, **options) for x in (p, mean))
        assert bytes(a.coordinates) == bytes(b.coordinates)
        # The likelihood (4) over ordered pairs, with the matrix as given.
        x, i = np.asarray(a.coordinates), np.asarray(a.intercepts)
        t = x @ x.T + (i[:, None] + i[None] if len(i) else 0)
        terms = -p * np.logaddexp(0, -t) - (1 - p) * np.logaddexp(0, t)
        assert_allclose(terms[~np.eye(25, dtype=bool)].sum(), a.report["log_likelihood"], rtol=1e-10)


def test_truncation_cuts_what_it_says():
    points, _ = roll(400)
    options = {"metric": "geodesic", "sigma": 20.0, "max_sweeps": 5}
    whole, cut = (native.embed(points, truncation=t, **options).report for t in (0.0, 0.05))
    assert cut["mean_affinity"] < whole["mean_affinity"]
    d = np.asarray(native.graph_distances(points))
    p = 1 / (1 + np.exp(d * d / 40))
    off = ~np.eye(400, dtype=bool)
    assert_allclose(cut["mean_affinity"], np.where(p < 0.05, 0, p)[off].mean(), rtol=1e-9)


@pytest.mark.parametrize("options", [{}, {"landmarks": 40, "metric": "geodesic"}, {"update": "parallel"}])
def test_the_same_bytes_for_any_number_of_threads(options):
    points, _ = roll(600)
    results = [native.embed(points, threads=threads, **options) for threads in (1, 2, 8)]
    assert len({bytes(r.coordinates) for r in results}) == 1
    placed = {bytes(results[0].transform(points[:100] + 0.01, threads=threads)) for threads in (1, 2, 8)}
    assert len(placed) == 1


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    native.embed(CLOUD)
    child = multiprocessing.get_context("fork").Process(target=native.embed, args=(CLOUD,))
    child.start()
    child.join(60)
    stuck = child.is_alive()
    child.kill()
    child.join()
    assert not stuck and child.exitcode == 0


# Wrong input --------------------------------------------------------------------------------------------------------

CLOUD = np.random.default_rng(13).random((20, 3))
NAN = np.where(np.arange(60).reshape(20, 3) == 16, np.nan, CLOUD)
NEGATIVE = distances_of(CLOUD) - np.eye(20, k=3)
INFINITE = np.where(np.add.outer(np.arange(20) < 8, np.arange(20) < 8) == 1, np.inf, distances_of(CLOUD))
APART = np.vstack([CLOUD, CLOUD + 100])


@pytest.mark.parametrize(
    ("data", "options", "text"),
    [
        (CLOUD, {"kind": "distances"}, r"a square matrix of distances, found shape \(20, 3\)"),
        (CLOUD, {"kind": "graph"}, "kind: expected 'points', 'distances' or 'affinities'"),
        (CLOUD, {"dimensions": 20}, "20 points do not span 20 dimensions"),
        (CLOUD[:2], {}, "2 points do not span 2 dimensions"),
        (CLOUD, {"dimensions": -1}, "dimensions: expected a whole number from 1 to"),
        (NAN, {}, "component 1 of point 5 is not finite"),
        (NEGATIVE, {"kind": "distances"}, "from point 0 to point 3 is -.*must be finite and not negative"),
        (
            INFINITE,
            {"kind": "distances"},
            "point 0 to point 1 is inf.*no path between them are embedded each by itself",
        ),
        (2 * distances_of(CLOUD), {"kind": "affinities"}, "the affinity of points .* must lie between 0 and 1"),
        (np.zeros((9, 2)), {}, "all points lie at distance zero"),
        (APART, {"metric": "geodesic"}, "falls into 2 pieces, the largest of 20"),
        (distances_of(CLOUD), {"kind": "distances", "metric": "geodesic"}, "metric: 'geodesic' is for kind='points'"),
        (CLOUD, {"relaxation": 2.0}, "relaxation: expected a number above 0 and below 2"),
        (CLOUD, {"relaxation": 0.0}, "relaxation"),
        (CLOUD, {"kernel_width": 0.0}, "kernel_width"),
        (CLOUD, {"sigma": 0.0}, "sigma is 0|kernel_width is 0"),
        (CLOUD, {"sigma": -1.0}, "-1"),
        (CLOUD, {"mean_affinity": 0.5}, "mean.affinity is 0.5, but must be above 0 and below"),
        (CLOUD, {"sigma": 1.0, "kernel_width": 0.2}, "at most one of kernel_width, mean_affinity and sigma"),
        (CLOUD, {"truncation": 1.5}, "truncation is 1.5"),
        (CLOUD, {"truncation": "all"}, "truncation: expected a number"),
        (CLOUD, {"landmarks": 2}, "landmarks is 2, but must be above the number of dimensions"),
        (np.repeat(CLOUD[:2], 9, axis=0), {"landmarks": 5}, "2 distinct places only"),
        (1e-157 * CLOUD, {}, "the largest coordinate is .*e-158; scale the data"),
        (1e40 * distances_of(CLOUD), {"kind": "distances"}, "the largest distance is .*e40; scale the data"),
        (CLOUD, {"initial": np.zeros((20, 3))}, r"initial: expected shape \(20, 2\), a row for each point"),
        (CLOUD, {"initial": np.full((20, 2), np.nan)}, "component 0 of point 0 of the start is not finite"),
        (CLOUD, {"initial": np.zeros((20, 2))}, "the start is 0 for all points, a saddle"),
        (CLOUD, {"initial": "pca"}, "initial: expected 'mds' or 'random'"),
        (CLOUD, {"stretch_limit": 1.1}, r"embed\(\) has no setting 'stretch_limit'"),
    ],
)
def test_what_is_wrong_is_named(data, options, text):
    with pytest.raises(native.InvalidArgumentError, match=text):
        native.embed(data, **options)


def test_transform_names_what_is_wrong():
    result = native.embed(CLOUD)
    with pytest.raises(native.InvalidArgumentError, match="expected 3"):
        result.transform(CLOUD[:, :2])
    with pytest.raises(native.InvalidArgumentError, match="component 1 of point 5"):
        result.transform(NAN)
    with pytest.raises(native.InvalidArgumentError, match=r"transform\(\) has no setting 'model'"):
        result.transform(CLOUD, model="paper")
    by_distances = native.embed(distances_of(CLOUD), kind="distances", landmarks=10)
    with pytest.raises(native.InvalidArgumentError, match="expected 10"):
        by_distances.transform(distances_of(CLOUD))
    assert result.transform(np.zeros((0, 3))).shape == (0, 2)


def test_both_take_a_job():
    for call in (lambda job: native.embed(CLOUD, job=job), lambda job: native.embed(CLOUD).transform(CLOUD, job=job)):
        job = native.Job()
        result = call(job)
        assert job.result() is result and job.progress() == 1
        job = native.Job()
        job.cancel()
        with pytest.raises(native.Cancelled):
            call(job)
