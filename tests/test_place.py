"""`place`: new points among landmarks that are plain arrays."""

import ble_unwrap_native as native
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.distance import cdist, pdist

CLOUD = np.random.default_rng(1).normal(size=(60, 3))
NEW = np.random.default_rng(2).normal(size=(25, 3))


def affinities(distances, sigma, model):
    u = distances**2 / (2 * sigma)
    return np.exp(-u) if model == "paper" else 1 / (1 + np.exp(u))


@pytest.mark.parametrize("model", ["default", "paper", "isomap"])
def test_places_as_the_embedding_does(model):
    for landmarks in (None, 40):
        fitted = native.embed(CLOUD, model=model, landmarks=landmarks, kernel_width=0.2)
        chosen = np.asarray(fitted.report["landmarks"])
        parts = [np.asarray(fitted.coordinates)[chosen]]
        options = {"model": model, "sigma": fitted.report["sigma"]}
        if model == "default":
            parts.append(np.asarray(fitted.intercepts)[chosen])
        if model == "isomap":
            options["mean_squared"] = np.mean(cdist(CLOUD[chosen], CLOUD[chosen]) ** 2, axis=0)
        to_landmarks = cdist(NEW, CLOUD[chosen])
        expected = np.asarray(fitted.transform(NEW))
        assert_allclose(native.place(to_landmarks, *parts, **options), expected, atol=1e-9)
        for threads in (1, 2, 7):
            again = native.place(to_landmarks, *parts, threads=threads, **options)
            assert bytes(again) == bytes(native.place(to_landmarks, *parts, **options))
        if model != "isomap":
            p = affinities(to_landmarks, fitted.report["sigma"], model)
            by_affinities = native.place(p, *parts, kind="affinities", model=model)
            assert_allclose(by_affinities, expected, atol=1e-2)
        # Fitted points, which are at distance 0 from themselves, are where they are.
        own = native.place(cdist(CLOUD[chosen], CLOUD[chosen]), *parts, **options)
        assert_allclose(own, parts[0], atol=1e-9)


def test_is_the_maximum_of_the_likelihood():
    random = np.random.default_rng(8)
    for model in ("default", "paper"):
        landmarks = random.normal(size=(30, 3))
        intercepts = random.normal(size=30) - 1 if model == "default" else np.empty(0)
        p = random.uniform(size=(40, 30)) ** 3
        places = np.asarray(native.place(p, landmarks, intercepts, kind="affinities", model=model))
        design = np.column_stack([landmarks, np.ones(30)]) if model == "default" else landmarks
        offset = intercepts if model == "default" else np.zeros(30)
        # The intercept is not returned: take the best for each place by Newton's method, then all slopes vanish.
        a = np.zeros(40)
        for _ in range(60 if model == "default" else 0):
            q = 1 / (1 + np.exp(-(places @ landmarks.T + a[:, None] + offset)))
            a += (p - q).sum(axis=1) / (q * (1 - q)).sum(axis=1)
        q = 1 / (1 + np.exp(-(places @ landmarks.T + a[:, None] + offset)))
        assert np.abs((p - q) @ design).max() < 1e-4


def test_far_points_have_a_place():
    flat = np.random.default_rng(3).uniform(size=(60, 2)) * [3.0, 1.0]
    far = np.array([[500.0, 0.0], [0.0, -3e4], [1.0, 30.0]])
    fitted = native.embed(flat, kernel_width=0.05, max_sweeps=500)
    sigma = fitted.report["sigma"]
    by_place = native.place(cdist(far, flat), fitted.coordinates, fitted.intercepts, sigma=sigma)
    for placed in (by_place, fitted.transform(far)):
        both = np.vstack([fitted.coordinates, placed]) * np.sqrt(sigma)
        assert_allclose(pdist(both), pdist(np.vstack([flat, far])), rtol=5e-3)


def test_a_truncated_affinity_is_none():
    x = np.random.default_rng(4).normal(size=(30, 2))
    a = -0.5 * np.sum(x**2, axis=1)
    d = cdist(NEW[:, :2], x)
    p = affinities(d, 1.0, "default")
    cut = native.place(np.where(p < 0.02, 0, p), x, a, kind="affinities", truncation=0.02)
    assert_allclose(native.place(d, x, a, truncation=0.02), cut, atol=1e-3)
    assert not np.allclose(native.place(d, x, a), cut, atol=1e-3)


def test_takes_any_reals_no_points_and_a_job():
    x, a = np.eye(3, 2, dtype=np.float32), np.zeros(3, dtype=np.float32)
    assert native.place(np.empty((0, 3)), x, a).shape == (0, 2)
    job = native.Job()
    placed = native.place(np.ones((4, 3), dtype=np.float32), x, a, job=job)
    assert placed is job.result() and job.progress() == 1
    cancelled = native.Job()
    cancelled.cancel()
    with pytest.raises(native.Cancelled):
        native.place(np.ones((4, 3)), x, a, job=cancelled)


X, A, D = np.eye(3, 2), np.zeros(3), np.ones((4, 3))


@pytest.mark.parametrize(
    ("arguments", "options", "text"),
    [
        ((D[:, :2], X, A), {}, r"data: expected 3 columns, one for each landmark, found shape \(4, 2\)"),
        ((D, X[:0], A), {}, r"coordinates: expected at least one landmark of one dimension, found shape \(0, 2\)"),
        ((D, X), {}, "intercepts: expected 3 values for model='default', found 0"),
        ((D, X, A[:2]), {}, "intercepts: expected 3 values for model='default', found 2"),
        ((D, X, A), {"model": "paper"}, "intercepts: expected 0 values for model='paper', found 3"),
        ((D, X), {"model": "isomap"}, "mean_squared: expected 3 values for model='isomap', found 0"),
        ((D, X, A), {"mean_squared": A}, "mean_squared: expected 0 values for model='default', found 3"),
        ((D, X, X), {}, r"intercepts: expected a float32 or float64 array of shape \(k,\)"),
        ((-D, X, A), {}, "the distance from point 0 to point 0 is -1"),
        ((2 * D, X, A), {"kind": "affinities"}, "the affinity of points 0 and 0 is 2"),
        ((D, X * np.nan, A), {}, "component 0 of point 0 is not finite"),
        ((D, X, A + np.inf), {}, "component 2 of point 0 is not finite"),
        ((D, X, A), {"kind": "points"}, "kind: expected 'distances' or 'affinities'; found 'points'"),
        ((D, X, A), {"sigma": 0.0}, "sigma: expected a number above 0; found 0.0"),
        ((D, X, A), {"truncation": 0.5}, "truncation is 0.5, but must be not negative, and below"),
        ((D, X, A), {"model": "pca"}, "model: expected 'default', 'paper' or 'isomap'; found 'pca'"),
        ((D, X, A), {"tolerance": 0.1}, r"place\(\) has no setting 'tolerance'"),
    ],
)
def test_names_what_is_wrong(arguments, options, text):
    with pytest.raises(native.InvalidArgumentError, match=text):
        native.place(*arguments, **options)
