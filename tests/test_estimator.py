"""`BernoulliLogisticEmbedding` by scikit-learn's own checks, against its peers, and against the compiled functions.

The table of peers: ``pytest -s -k trustworthiness tests/test_estimator.py``.
"""

import doctest
import pickle
import subprocess
import sys
import time
import warnings

import ble_unwrap_native as native
import numpy as np
import pytest
from scipy.spatial import procrustes
from scipy.spatial.distance import pdist, squareform

pytest.importorskip("sklearn")
from ble_unwrap_native import estimator
from ble_unwrap_native.estimator import BernoulliLogisticEmbedding
from sklearn.base import clone
from sklearn.datasets import load_breast_cancer, load_digits, load_wine, make_s_curve, make_swiss_roll
from sklearn.exceptions import ConvergenceWarning, NotFittedError
from sklearn.manifold import TSNE, Isomap, SpectralEmbedding, trustworthiness
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler, scale
from sklearn.utils.estimator_checks import parametrize_with_checks

LIFT = np.linalg.qr(np.random.default_rng(4).normal(size=(5, 2)))[0]
FLAT = np.random.default_rng(3).uniform(size=(60, 2)) * [3.0, 1.0]
# The same plane in five dimensions.
PLANE = FLAT @ LIFT.T + 7
BALL = np.random.default_rng(5).normal(size=(80, 4))


def misfit(a, b):
    """Procrustes disparity: 0 for the same shape, 1 for none in common."""
    return procrustes(a, b)[2]


def gap(a, b):
    """Root mean square distance of corresponding points, in extents of the first."""
    return np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1)) / np.mean(np.sum((a - a.mean(axis=0)) ** 2, axis=1)))


# scikit-learn's own checks ------------------------------------------------------------------------------------------


class FromAnything(BernoulliLogisticEmbedding):
    """Embeds x²/(1 + x²) as affinities: the checks have only scalar products of random points to offer, which
    ``metric="precomputed_affinity"`` rightly refuses for not lying in [0, 1]."""

    def __init__(self, n_components=2, *, metric="precomputed_affinity", n_landmarks=None, random_state=None):
        super().__init__(n_components, metric=metric, n_landmarks=n_landmarks, random_state=random_state)

    def _in_range(self, data):
        return super()._in_range(np.where(data < 0, data, data**2 / (1 + data**2)))


def may_fail(estimator):
    """A row of affinities does not tell that it is a landmark's, whose affinity with itself the fit leaves out."""
    if estimator.metric != "precomputed_affinity":
        return {}
    reason = "places of training data are near those of the fit, not within 0.01"
    return dict.fromkeys(["check_transformer_general", "check_transformer_data_not_an_array"], reason)


@pytest.mark.filterwarnings("ignore")
@parametrize_with_checks(
    [
        *(
            BernoulliLogisticEmbedding(metric=metric, model=model)
            for metric in ("euclidean", "geodesic", "precomputed")
            for model in ("default", "paper", "isomap")
        ),
        BernoulliLogisticEmbedding(n_landmarks=8),
        BernoulliLogisticEmbedding(metric="geodesic", n_landmarks=8),
        BernoulliLogisticEmbedding(metric="precomputed", n_landmarks=8),
        BernoulliLogisticEmbedding(initial="random", update="parallel", mean_affinity=0.1, truncation=1e-3),
        FromAnything(),
        FromAnything(n_landmarks=8),
    ],
    expected_failed_checks=may_fail,
)
def test_scikit_learn_checks(estimator, check):
    check(estimator)


def test_the_example_of_the_documentation_runs():
    assert doctest.testmod(estimator) == doctest.TestResults(failed=0, attempted=7)


def test_clone_pickle_and_pipeline():
    model = BernoulliLogisticEmbedding(3, metric="geodesic", n_landmarks=30, kernel_width=0.1, random_state=2)
    assert clone(model).get_params() == model.get_params()
    model.fit(BALL)
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.transform(BALL[:9] + 0.1), model.transform(BALL[:9] + 0.1))
    assert np.array_equal(again.embedding_, model.embedding_)
    assert list(model.get_feature_names_out()) == [f"bernoullilogisticembedding{i}" for i in range(3)]
    chain = make_pipeline(StandardScaler(), BernoulliLogisticEmbedding())
    assert chain.fit(BALL).transform(BALL).shape == (80, 2)
    with pytest.raises(NotFittedError):
        clone(model).transform(BALL)


def test_the_package_alone_needs_neither_numpy_nor_scikit_learn():
    """Blender's Python has no scikit-learn; and the native module is to load where there is no NumPy."""
    code = (
        "import sys\n"
        "class Absent:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('numpy', 'scipy', 'sklearn', 'joblib'):\n"
        "            raise ModuleNotFoundError(name)\n"
        "sys.meta_path.insert(0, Absent())\n"
        "import ble_unwrap_native\n"
        "assert ble_unwrap_native.embed and not {'numpy', 'scipy', 'sklearn', 'joblib'} & set(sys.modules)\n"
        "try:\n"
        "    import ble_unwrap_native.estimator\n"
        "except ModuleNotFoundError: print('absent')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.strip() == "absent", done.stderr


# Against the peers --------------------------------------------------------------------------------------------------


def torus(n):
    u, v = np.random.default_rng(0).uniform(0, 2 * np.pi, (2, n))
    return np.c_[(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)]


@pytest.fixture(scope="module")
def clouds():
    return {
        "swiss roll": make_swiss_roll(1000, random_state=0)[0],
        "noisy roll": make_swiss_roll(1000, noise=0.5, random_state=1)[0],
        "s curve": make_s_curve(800, random_state=0)[0],
        "torus": torus(800),
        "digits": load_digits().data,
        "wine": scale(load_wine().data),
        "breast cancer": scale(load_breast_cancer().data),
    }


PEERS = {
    "BLE, geodesic": lambda: BernoulliLogisticEmbedding(metric="geodesic"),
    "BLE, geodesic, 200 landmarks": lambda: BernoulliLogisticEmbedding(
        metric="geodesic", n_landmarks=200, random_state=0
    ),
    "BLE, euclidean": lambda: BernoulliLogisticEmbedding(),
    "BLE as printed, geodesic": lambda: BernoulliLogisticEmbedding(metric="geodesic", model="paper"),
    "Isomap": lambda: Isomap(n_neighbors=12),
    "SpectralEmbedding": lambda: SpectralEmbedding(n_neighbors=12, random_state=0),
    "t-SNE": lambda: TSNE(random_state=0, n_jobs=1, max_iter=500),
}
# The slow ones are shown only on the data that the goals name.
SHOWN_EVERYWHERE = ("BLE, geodesic", "BLE, euclidean", "Isomap")
SHOWN_WITH_ALL = ("swiss roll", "digits")


@pytest.mark.filterwarnings("ignore:Graph is not fully connected")
def test_trustworthiness_against_peers(clouds):
    """Twelve neighbours, of which the graphs are made, too. Default settings throughout."""
    print(f"\n{'data':14} {'method':30} {'trustworthiness':>15} {'continuity':>10} {'seconds':>8}")
    found = {}
    for data, points in clouds.items():
        for method in PEERS if data in SHOWN_WITH_ALL else SHOWN_EVERYWHERE:
            begin = time.perf_counter()
            places = PEERS[method]().fit_transform(points)
            seconds = time.perf_counter() - begin
            found[data, method] = trust = trustworthiness(points, places, n_neighbors=12)
            # Continuity is trustworthiness with the parts exchanged: are neighbours torn apart?
            continuity = trustworthiness(places, points, n_neighbors=12)
            print(f"{data:14} {method:30} {trust:15.4f} {continuity:10.4f} {seconds:8.2f}", flush=True)
    assert found["swiss roll", "BLE, geodesic"] >= 0.999
    assert found["s curve", "BLE, geodesic"] >= 0.999
    for data in clouds:
        assert found[data, "BLE, geodesic"] > found[data, "Isomap"], data
    # Where there is much to gain, much is gained.
    assert found["digits", "BLE, geodesic"] > found["digits", "Isomap"] + 0.05
    assert found["digits", "BLE, geodesic, 200 landmarks"] > found["digits", "Isomap"] + 0.05
    assert found["noisy roll", "BLE, geodesic"] > found["noisy roll", "Isomap"] + 0.01


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
def test_a_narrow_kernel_keeps_neighbours_and_a_wide_one_is_near_classical_scaling(clouds):
    """The reason for the default width, where no width lays the data flat."""
    digits = clouds["digits"][:500]
    own = squareform(pdist(digits))
    scaling = BernoulliLogisticEmbedding(metric="precomputed", model="isomap").fit_transform(own)
    trust, unlike = [], []
    for width in (0.05, 0.2, 1.0):
        places = BernoulliLogisticEmbedding(metric="precomputed", kernel_width=width).fit_transform(own)
        trust.append(trustworthiness(digits, places, n_neighbors=12))
        unlike.append(misfit(scaling, places))
    assert trust[0] > trust[1] + 0.02 and trust[1] > trust[2], trust
    assert unlike[0] > unlike[1] > unlike[2] and unlike[2] < 0.01, unlike


# What comes out -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("data", [FLAT, PLANE])
def test_a_plane_comes_back_in_its_own_unit(data):
    for factor in (1e-3, 1.0, 1e4):
        model = BernoulliLogisticEmbedding().fit(factor * data)
        assert np.allclose(pdist(model.embedding_), factor * pdist(FLAT), rtol=1e-6)
        assert model.converged_ and model.bregman_ < 1e-6 and abs(model.embedding_.mean()) < 1e-9 * factor
        # Along the principal axes, the longer first, the larger side positive.
        cross = model.embedding_.T @ model.embedding_
        assert abs(cross[0, 1]) < 1e-6 * cross[0, 0] and cross[0, 0] > cross[1, 1]
        assert (model.embedding_.max(axis=0) >= -model.embedding_.min(axis=0)).all()
        elsewhere = np.array([[1.5, 0.5], [9.0, -4.0]])
        places = model.transform(factor * (elsewhere if data is FLAT else elsewhere @ LIFT.T + 7))
        both = np.vstack([model.embedding_, places])
        assert np.allclose(pdist(both), factor * pdist(np.vstack([FLAT, elsewhere])), rtol=1e-5)


@pytest.mark.parametrize("metric", ["euclidean", "geodesic", "precomputed", "precomputed_affinity"])
@pytest.mark.parametrize("landmarks", [None, 40])
@pytest.mark.parametrize("model", ["default", "paper", "isomap"])
def test_fit_transform_is_fit_then_embedding_then_transform(metric, landmarks, model):
    data = BALL
    if metric.startswith("precomputed"):
        data = squareform(pdist(BALL))
        if metric == "precomputed_affinity":
            if model == "isomap":
                pytest.skip("affinities have no classical scaling")
            data = np.exp(-(data**2) / 10) if model == "paper" else 1 / (1 + np.exp(data**2 / 4))
    make = lambda: BernoulliLogisticEmbedding(  # noqa: E731
        metric=metric, n_landmarks=landmarks, model=model, random_state=1, tolerance=1e-9, max_sweeps=5000
    )
    fitted = make().fit(data)
    assert np.array_equal(make().fit_transform(data), fitted.embedding_)
    assert fitted.embedding_.shape == (80, 2) and fitted.landmark_indices_.shape == (landmarks or 80,)
    # Affinities do not tell a landmark from a point at distance 0 from it.
    within = 0.1 if metric == "precomputed_affinity" else 1e-9
    assert gap(fitted.embedding_, fitted.transform(data)) < within


def test_precomputed_is_what_the_metric_would_have_computed():
    own = squareform(pdist(BALL))
    a = BernoulliLogisticEmbedding().fit(BALL)
    b = BernoulliLogisticEmbedding(metric="precomputed").fit(own)
    assert np.allclose(a.embedding_, b.embedding_, atol=1e-9) and a.sigma_ == pytest.approx(b.sigma_)
    new = BALL[:7] + 0.3
    to_all = np.linalg.norm(new[:, None] - BALL, axis=2)
    assert np.allclose(a.transform(new), b.transform(to_all), atol=1e-6)
    p = 1 / (1 + np.exp(own**2 / (2 * a.sigma_)))
    c = BernoulliLogisticEmbedding(metric="precomputed_affinity").fit(p)
    assert c.log_likelihood_ == pytest.approx(a.log_likelihood_, rel=1e-3)
    assert misfit(a.embedding_, c.embedding_) < 0.02
    graph = np.asarray(native.graph_distances(BALL, neighbours=12))
    d = BernoulliLogisticEmbedding(metric="precomputed").fit_transform(graph)
    assert np.allclose(BernoulliLogisticEmbedding(metric="geodesic").fit_transform(BALL), d, atol=1e-9)


def test_of_an_asymmetric_matrix_the_mean_with_its_transpose_counts():
    own = squareform(pdist(BALL))
    skew = np.random.default_rng(0).uniform(-0.1, 0.1, own.shape)
    skew -= skew.T
    crooked = own + np.minimum(own, own.T) * skew
    np.fill_diagonal(crooked, 5.0)
    straight = BernoulliLogisticEmbedding(metric="precomputed").fit_transform(own)
    assert np.allclose(BernoulliLogisticEmbedding(metric="precomputed").fit_transform(crooked), straight, atol=1e-6)


def test_agrees_with_the_compiled_function():
    model = BernoulliLogisticEmbedding(kernel_width=0.1).fit(BALL)
    compiled = native.embed(BALL, kernel_width=0.1, max_sweeps=500)
    assert model.sigma_ == pytest.approx(compiled.report["sigma"], rel=1e-12)
    assert model.log_likelihood_ == pytest.approx(compiled.report["log_likelihood"], rel=1e-9)
    assert model.trace_ == pytest.approx(np.asarray(compiled.report["trace"]), rel=1e-9)
    assert np.allclose(pdist(model.embedding_), np.sqrt(model.sigma_) * pdist(np.asarray(compiled.coordinates)))
    # So do landmarks, and the placement of the rest.
    by_landmarks = BernoulliLogisticEmbedding(kernel_width=0.3, n_landmarks=40, random_state=0).fit(BALL)
    own = squareform(pdist(BALL))
    chosen = by_landmarks.landmark_indices_
    compiled_landmarks = native.embed(
        own[np.ix_(chosen, chosen)], kind="distances", sigma=by_landmarks.sigma_, max_sweeps=500
    )
    rest = np.setdiff1d(np.arange(80), chosen)
    placed = np.vstack(
        [compiled_landmarks.coordinates, compiled_landmarks.transform(np.ascontiguousarray(own[np.ix_(rest, chosen)]))]
    )
    here = by_landmarks.embedding_[np.concatenate([chosen, rest])]
    assert np.allclose(pdist(here), np.sqrt(by_landmarks.sigma_) * pdist(placed), atol=1e-3)
    # The standard pose leaves every log-odds as it is.
    x, a = model.embedding_ / np.sqrt(model.sigma_), model.intercepts_
    y, b = np.asarray(compiled.coordinates), np.asarray(compiled.intercepts)
    assert np.allclose(x @ x.T + a[:, None] + a, y @ y.T + b[:, None] + b, atol=1e-6)


def test_landmarks_find_the_shape_that_all_points_find(clouds):
    for data, most in (("swiss roll", 1e-3), ("torus", 0.02)):
        everything = BernoulliLogisticEmbedding(metric="geodesic").fit_transform(clouds[data])
        for count in (100, 300):
            model = BernoulliLogisticEmbedding(metric="geodesic", n_landmarks=count, random_state=0)
            assert misfit(everything, model.fit_transform(clouds[data])) < most, (data, count)


def test_many_points_are_embedded_by_landmarks():
    points = make_swiss_roll(2500, random_state=4)[0]
    model = BernoulliLogisticEmbedding(metric="geodesic", random_state=0).fit(points)
    assert model.landmark_indices_.shape == (500,) and (np.diff(model.landmark_indices_) > 0).all()
    assert trustworthiness(points, model.embedding_, n_neighbors=12) > 0.999


def test_new_points_are_placed_among_their_neighbours(clouds):
    for metric in ("euclidean", "geodesic"):
        points = clouds["s curve" if metric == "geodesic" else "torus"]
        known, new = points[::2], points[1::2]
        model = BernoulliLogisticEmbedding(metric=metric).fit(known)
        together = np.vstack([model.embedding_, model.transform(new)])
        whole = BernoulliLogisticEmbedding(metric=metric).fit_transform(points)
        assert misfit(np.vstack([whole[::2], whole[1::2]]), together) < 0.01, metric


def test_random_state_decides_and_threads_do_not():
    def run(**options):
        return BernoulliLogisticEmbedding(metric="geodesic", **options).fit_transform(BALL)

    random = {"n_landmarks": 40, "initial": "random"}
    assert np.array_equal(run(random_state=3, **random), run(random_state=3, **random))
    assert not np.array_equal(run(random_state=3, **random), run(random_state=4, **random))
    state = np.random.RandomState(3)
    assert np.array_equal(run(random_state=3, **random), run(random_state=state, **random))
    assert np.array_equal(run(random_state=3), run(random_state=4)), "nothing is random by default"
    for jobs in (2, -1):
        assert np.array_equal(run(random_state=3, n_jobs=jobs, **random), run(random_state=3, n_jobs=1, **random))


@pytest.mark.parametrize("metric", ["euclidean", "geodesic"])
def test_a_permutation_of_the_points_permutes_the_result(metric):
    order = np.random.default_rng(0).permutation(len(BALL))
    options = {"metric": metric, "tolerance": 1e-10, "max_sweeps": 5000}
    a = BernoulliLogisticEmbedding(**options).fit_transform(BALL)
    b = BernoulliLogisticEmbedding(**options).fit_transform(BALL[order])
    assert misfit(a[order], b) < 1e-4


def test_the_likelihood_rises_and_the_fit_says_how_it_ended():
    for relaxation in (0.5, 1.0, 1.6, 1.9):
        model = BernoulliLogisticEmbedding(initial="random", random_state=0, relaxation=relaxation).fit(BALL)
        assert (np.diff(model.trace_) >= -1e-9 * abs(model.log_likelihood_)).all()
        assert len(model.trace_) == model.n_iter_ + 1 and model.trace_[-1] == model.log_likelihood_
    with pytest.warns(ConvergenceWarning, match="max_sweeps=3"):
        model = BernoulliLogisticEmbedding(max_sweeps=3, tolerance=1e-12).fit(BALL)
    assert not model.converged_ and model.n_iter_ == 3
    isomap = BernoulliLogisticEmbedding(model="isomap").fit(BALL)
    assert np.isnan([isomap.log_likelihood_, isomap.bregman_, isomap.sigma_]).all()
    assert isomap.converged_ and isomap.n_iter_ == 0 and isomap.trace_.shape == (0,)


def test_isomap_is_that_of_scikit_learn(clouds):
    points = clouds["swiss roll"][:400]
    ours = BernoulliLogisticEmbedding(metric="geodesic", model="isomap").fit(points)
    theirs = Isomap(n_neighbors=12).fit(points)
    assert misfit(theirs.embedding_, ours.embedding_) < 1e-8
    assert np.allclose(np.abs(theirs.embedding_), np.abs(ours.embedding_), atol=1e-4)
    new = make_swiss_roll(50, random_state=9)[0]
    assert np.allclose(np.abs(theirs.transform(new)), np.abs(ours.transform(new)), atol=0.05)


def test_the_kernel_is_chosen_by_width_or_by_mean_affinity():
    own = pdist(BALL) ** 2
    for model, at_zero in (("default", 0.5), ("paper", 1.0)):
        for mean in (0.01, 0.2, 0.9 * at_zero):
            sigma = BernoulliLogisticEmbedding(model=model, mean_affinity=mean).fit(BALL).sigma_
            p = np.exp(-own / (2 * sigma)) if model == "paper" else 1 / (1 + np.exp(own / (2 * sigma)))
            assert p.mean() == pytest.approx(mean, rel=1e-6)
        assert BernoulliLogisticEmbedding(kernel_width=0.3).fit(BALL).sigma_ == pytest.approx(0.3 * own.mean())
    assert BernoulliLogisticEmbedding().fit(BALL).sigma_ == pytest.approx(0.05 * own.mean())
    sigma = BernoulliLogisticEmbedding(model="paper").fit(BALL).sigma_
    assert np.exp(-own / (2 * sigma)).mean() == pytest.approx(0.57)


def test_a_given_start_is_in_the_scale_of_the_embedding():
    data = PLANE + 0.02 * np.random.default_rng(0).normal(size=PLANE.shape)
    first = BernoulliLogisticEmbedding().fit(data)

    def start(factor):
        return BernoulliLogisticEmbedding(initial=factor * first.embedding_).fit(data)

    assert start(1.0).trace_[0] == pytest.approx(first.log_likelihood_, rel=1e-3)
    assert start(1.0).trace_[0] > max(start(0.7).trace_[0], start(1.4).trace_[0])
    assert misfit(first.embedding_, start(1.0).embedding_) < 1e-6
    by_landmarks = BernoulliLogisticEmbedding(initial=first.embedding_, n_landmarks=50, random_state=0).fit(data)
    assert misfit(first.embedding_, by_landmarks.embedding_) < 1e-3


def test_a_given_start_is_scaled_by_the_width_that_the_mean_affinity_has():
    data = PLANE + 0.02 * np.random.default_rng(0).normal(size=PLANE.shape)
    first = BernoulliLogisticEmbedding(mean_affinity=0.1).fit(data)
    again = BernoulliLogisticEmbedding(mean_affinity=0.1, initial=first.embedding_).fit(data)
    assert again.sigma_ == first.sigma_ and again.trace_[0] == pytest.approx(first.log_likelihood_, rel=1e-3)


def test_truncation_drops_small_affinities():
    full, cut = (BernoulliLogisticEmbedding(truncation=t).fit(BALL) for t in (0.0, 1e-4))
    assert full.log_likelihood_ != cut.log_likelihood_ and misfit(full.embedding_, cut.embedding_) < 0.01
    far = np.full((1, 4), 60.0)
    assert np.isfinite(cut.transform(far)).all()


def test_far_lone_and_coincident_points_have_a_place():
    """Of a point far from all landmarks the likelihood says only that; least squares say where."""
    model = BernoulliLogisticEmbedding().fit(FLAT)
    far = np.array([[500.0, 0.0], [0.0, -3e4]])
    both = pdist(np.vstack([model.embedding_, model.transform(far)]))
    assert np.allclose(both, pdist(np.vstack([FLAT, far])), rtol=5e-3)
    doubled = BernoulliLogisticEmbedding(metric="geodesic").fit(np.vstack([PLANE, PLANE[:5], PLANE[:1]]))
    assert np.allclose(doubled.embedding_[:5], doubled.embedding_[60:65], atol=0.02)
    outlier = BernoulliLogisticEmbedding(metric="geodesic").fit(np.vstack([PLANE, PLANE.mean(axis=0) + 1e3]))
    assert np.isfinite(outlier.embedding_).all()


# What does not come out ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"n_components": 0}, "n_components == 0, must be >= 1"),
        ({"n_components": 80}, "n_components=80 needs more points than that; found n_samples = 80"),
        ({"metric": "cosine"}, "metric must be one of 'euclidean', 'geodesic', 'precomputed', 'precomputed_affinity'"),
        ({"model": "isochart"}, "model must be one of"),
        ({"update": "random"}, "update must be one of"),
        ({"connect": "separate"}, "connect must be one of"),
        ({"initial": "pca"}, "initial must be 'mds', 'random' or an array; found 'pca'"),
        ({"initial": np.zeros((80, 3))}, r"shape \(n_samples, n_components\) = \(80, 2\); found shape \(80, 3\)"),
        ({"initial": np.full((80, 2), np.nan)}, "initial must be finite"),
        ({"n_neighbors": 0}, "n_neighbors == 0, must be >= 1"),
        ({"n_landmarks": 2}, "n_landmarks == 2, must be >= 3"),
        ({"kernel_width": 0.0}, "kernel_width == 0.0, must be > 0"),
        ({"kernel_width": -1.0}, "kernel_width == -1.0, must be > 0"),
        ({"mean_affinity": 0.0}, "mean_affinity == 0.0, must be > 0"),
        ({"mean_affinity": 0.5}, "below the affinity at distance 0, 0.5"),
        ({"mean_affinity": 0.1, "kernel_width": 0.1}, "only one of them can be given"),
        ({"relaxation": 0.0}, "relaxation == 0.0, must be > 0"),
        ({"relaxation": 2.0}, "relaxation == 2.0, must be < 2"),
        ({"max_sweeps": 0}, "max_sweeps == 0, must be >= 1"),
        ({"tolerance": 0.0}, "tolerance == 0.0, must be > 0"),
        ({"truncation": 0.5}, "truncation == 0.5, must be < 0.5"),
        ({"truncation": -0.1}, "truncation == -0.1, must be >= 0"),
        ({"metric": "precomputed_affinity", "model": "isomap"}, "scales distances"),
        ({"metric": "precomputed"}, r"square matrix of all pairs; found shape \(80, 4\)"),
    ],
)
def test_parameters_out_of_range_are_named(options, text):
    with pytest.raises(ValueError, match=text):
        BernoulliLogisticEmbedding(**options).fit(BALL)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("metric", ["euclidean", "geodesic", "precomputed"])
def test_values_that_are_not_finite_are_named(metric, bad):
    data = squareform(pdist(BALL)) if metric == "precomputed" else BALL.copy()
    data[3, 1] = bad
    with pytest.raises(ValueError, match="NaN" if np.isnan(bad) else "infinity"):
        BernoulliLogisticEmbedding(metric=metric).fit(data)


def test_matrices_with_impossible_values_are_refused():
    own = squareform(pdist(BALL))
    own[3, 4] = -0.5
    with pytest.raises(ValueError, match=r"Negative values in data .*: -0.5 in row 3, column 4"):
        BernoulliLogisticEmbedding(metric="precomputed").fit(own)
    fitted = BernoulliLogisticEmbedding(metric="precomputed").fit(np.abs(own))
    with pytest.raises(ValueError, match="Negative values"):
        fitted.transform(own)
    p = np.full((9, 9), 0.3)
    p[2, 1] = 1.5
    with pytest.raises(ValueError, match=r"affinities must lie in \[0, 1\]; found 1.5 in row 2, column 1"):
        BernoulliLogisticEmbedding(metric="precomputed_affinity").fit(p)


def test_points_without_extent_are_refused():
    for metric in ("euclidean", "geodesic"):
        with pytest.raises(ValueError, match="all points coincide"):
            BernoulliLogisticEmbedding(metric=metric).fit(np.ones((20, 3)))
    doubled = np.vstack([FLAT[:2]] * 20)
    with pytest.raises(ValueError, match=r"mean_affinity == 0.1: no kernel width has it; it must be above 0.24"):
        BernoulliLogisticEmbedding(1, mean_affinity=0.1).fit(doubled)
    with pytest.raises(ValueError, match="their squares overflow"):
        BernoulliLogisticEmbedding().fit(1e200 * BALL)


def test_a_cloud_in_pieces_is_joined_with_a_warning_or_refused():
    pieces = np.vstack([BALL, BALL[:50] + 100])
    with pytest.raises(ValueError, match=r"pieces(.|\n)*n_neighbors=12, connect='error'"):
        BernoulliLogisticEmbedding(metric="geodesic", connect="error").fit(pieces)
    with pytest.warns(UserWarning, match="joined by their shortest edges"):
        joined = BernoulliLogisticEmbedding(metric="geodesic").fit(pieces)
    apart = joined.embedding_[:80].mean(axis=0) - joined.embedding_[80:].mean(axis=0)
    assert 100 < np.linalg.norm(apart) < 300, "as far as they are"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        BernoulliLogisticEmbedding(metric="geodesic", connect="error").fit(BALL)
