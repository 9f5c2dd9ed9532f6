"""Bernoulli logistic embedding as an estimator of scikit-learn.

Needs NumPy, SciPy and scikit-learn 1.6 or later (``pip install ble_unwrap_native[estimator]``), which the package
itself does not; hence it is imported by its full name:

>>> from ble_unwrap_native.estimator import BernoulliLogisticEmbedding
"""

import warnings
from numbers import Integral, Real
from typing import Any, Literal

import numpy as np
from joblib import effective_n_jobs  # type: ignore[import-untyped]
from scipy.spatial.distance import cdist  # type: ignore[import-untyped]
from sklearn.base import (  # type: ignore[import-untyped]
    BaseEstimator,
    ClassNamePrefixFeaturesOutMixin,
    TransformerMixin,
)
from sklearn.exceptions import ConvergenceWarning  # type: ignore[import-untyped]
from sklearn.neighbors import NearestNeighbors  # type: ignore[import-untyped]
from sklearn.utils import check_random_state, check_scalar  # type: ignore[import-untyped]
from sklearn.utils.validation import check_is_fitted, validate_data  # type: ignore[import-untyped]

from . import InvalidArgumentError, embed, graph_distances, place

__all__ = ["BernoulliLogisticEmbedding"]

# σ over the mean squared distance, of the default model. The unwrapper's 0.2 serves surfaces, which any width from
# 0.1 to 0.3 lays flat alike; of data that no width lays flat a narrower one keeps the neighbours. Below 0.05 little is
# gained, and sweeps are many. See the notes of the class.
DEFAULT_RELATIVE_WIDTH = 0.05
# What sets σ for the published model, as in `embed`: near it the folds are fewest.
PUBLISHED_MEAN_AFFINITY = 0.57
# Up to so many points each is a landmark; scaling takes O(n³) and a sweep O(n²).
MOST_POINTS_WITHOUT_LANDMARKS = 2_000
# Landmarks of more points than that. On digits, tori and rolls 200 lose nothing against all points.
DEFAULT_LANDMARKS = 500

# To type checkers of Python 3.11 a NumPy array is no buffer, which the compiled functions take.
Bytes = Any

CHOICES = {
    "metric": ("euclidean", "geodesic", "precomputed", "precomputed_affinity"),
    "connect": ("bridge", "error"),
    "model": ("default", "paper", "isomap"),
    "update": ("serial", "parallel"),
}


class BernoulliLogisticEmbedding(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):
    """Nonlinear embedding by Bernoulli logistic regression of affinities.

    Each pair of points has an affinity p, which falls with their distance, and the embedding makes the Bernoulli
    likelihood of the p greatest: log-odds ``x_i · x_j + a_i + a_j`` in the default model, which for points in the plane
    are minus half their squared distance. Wide kernels weigh all pairs alike, and the result is next to that of
    classical scaling (Isomap); narrower ones let distant pairs go and keep neighbours.

    Parameters
    ----------
    n_components : int, default=2
        Number of dimensions of the embedding, below the number of points.

    metric : {"euclidean", "geodesic", "precomputed", "precomputed_affinity"}, default="euclidean"
        What the rows of ``X`` are, and how far apart:

        - "euclidean": points at straight distances.
        - "geodesic": points, at the lengths of shortest paths through the graph of ``n_neighbors`` nearest neighbours,
          as in Isomap.
        - "precomputed": row i of the square ``X`` has the distances of point i from all points, all at least 0. Of an
          asymmetric matrix the mean with its transpose counts; the diagonal does not.
        - "precomputed_affinity": the same of affinities, between 0 and 1.

    n_neighbors : int, default=12
        Neighbours a point is joined to, for ``metric="geodesic"``; all others where there are fewer.

    connect : {"bridge", "error"}, default="bridge"
        What happens to a graph in several pieces, for ``metric="geodesic"``: they are joined by their shortest edges
        with a warning, or it is an error.

    n_landmarks : int, default=None
        Points that are fitted against each other, drawn at random; every other point is placed by its distances to
        them, as are new ones. None: all points up to 2,000, of more 500. No more than there are points are taken.

    model : {"default", "paper", "isomap"}, default="default"
        The model with intercepts and the affinity ``1 / (1 + exp(d² / 2σ))``, exact for points in ``n_components``
        dimensions; the model as published, ``exp(-d² / 2σ)`` without intercepts, which folds even flat sheets; or
        classical scaling, which has no likelihood and is there for comparison.

    kernel_width : float, default=None
        σ as a multiple of the mean squared distance of the landmarks. None: 0.05, for the published model what makes
        the mean affinity 0.57. Not used by "isomap" and "precomputed_affinity".

    mean_affinity : float, default=None
        Instead of ``kernel_width``: the mean affinity of all pairs of landmarks, by which σ is then chosen. Above 0 and
        below the affinity at distance 0, which is 0.5, or 1 in the published model.

    relaxation : float, default=1.6
        Relaxation ω of a step, inside (0, 2).

    max_sweeps : int, default=500
        Most passes over all landmarks. A fit that uses them up warns.

    tolerance : float, default=1e-5
        The fit ends when a sweep changes the log-likelihood by less than this share of it.

    update : {"serial", "parallel"}, default="serial"
        One landmark after another, by which the likelihood never falls, or all at once.

    initial : {"mds", "random"} or array-like of shape (n_samples, n_components), default="mds"
        The start: classical scaling, random, or given in the scale of ``embedding_``.

    truncation : float, default=0.0
        Affinities below this count as 0.

    random_state : int, RandomState instance or None, default=None
        Draws landmarks and the random start. Nothing else is random: with all points as landmarks and the start by
        classical scaling every fit is the same.

    n_jobs : int, default=None
        Threads of fit and neighbour search, as everywhere in scikit-learn: None is 1 and -1 all. The result does not
        depend on it.

    Attributes
    ----------
    embedding_ : ndarray of shape (n_samples, n_components)
        The embedding of the training data, along its principal axes. In the unit of the distances (in the default model
        the likelihood's coordinates times ``sqrt(sigma_)``) and centred; for the published model, whose log-odds are
        no distances, the likelihood's own coordinates, without unit and not to be shifted.

    landmark_indices_ : ndarray of shape (n_landmarks,)
        Training points that are landmarks, ascending.

    intercepts_ : ndarray of shape (n_landmarks,)
        Intercepts of the landmarks in the default model, else empty.

    sigma_ : float
        The kernel width, a squared distance. 1 for ``metric="precomputed_affinity"``, NaN for ``model="isomap"``.

    log_likelihood_ : float
        Log-likelihood of the affinities of the landmarks; NaN for ``model="isomap"``.

    trace_ : ndarray of shape (n_iter_ + 1,)
        Log-likelihood at the start and after each sweep; empty for ``model="isomap"``.

    bregman_ : float
        Bregman distance from affinities to model: 0 for a perfect fit; NaN for ``model="isomap"``.

    n_iter_ : int
        Number of sweeps.

    converged_ : bool
        Whether the fit ended by ``tolerance``, not by ``max_sweeps``.

    n_features_in_ : int
        Number of features seen by ``fit``.

    feature_names_in_ : ndarray of shape (n_features_in_,)
        Names of features seen by ``fit``; only if ``X`` has names that are all strings.

    See Also
    --------
    sklearn.manifold.Isomap : Classical scaling of geodesic distances.
    ble_unwrap_native.embed : The compiled function, without NumPy.

    Notes
    -----
    Pairs count in the fit by p(1 − p), which falls to a tenth at d² ≈ 7σ. With the default width this is at 0.6 of the
    radius of a round cloud in the plane. Where points lie in ``n_components`` dimensions every width finds them. Where
    they do not (curved surfaces, noise, more dimensions) a wide kernel serves all distances alike, far ones of which
    there are most, and which a graph measures worst; a narrow one keeps neighbours, as trustworthiness and continuity
    measure, at hardly less correlation of all distances. Below 0.03 a fit takes hundreds of sweeps more for little,
    and from a random start folds are likely to stay. Of points far from all others the likelihood says little more than
    that, and serial sweeps move them slowly.

    `transform` places each point by itself, by the likelihood of its affinities to the landmarks, which is concave; the
    landmarks stay. A point that coincides with a landmark is put where that is, so that the training data are placed
    as in the fit. In the graph a new point is joined to its ``n_neighbors`` nearest training points. For the
    precomputed metrics `transform` takes the distances or affinities of m new points to all n training points, (m, n).

    A fit takes O(k³) for scaling and O(k²) a sweep with k landmarks, and O(nk) to place the others; in the graph
    O(kn log n) and 8nk bytes, which are kept. Not guaranteed: the global maximum, and a fit with ``update="parallel"``
    better than its start.

    References
    ----------
    Bernoulli Embedding Model and Its Application in Texture Mapping, 2006, sections 3 to 5.

    Examples
    --------
    >>> from sklearn.datasets import make_swiss_roll
    >>> from sklearn.manifold import trustworthiness
    >>> X, _ = make_swiss_roll(600, random_state=0)
    >>> flat = BernoulliLogisticEmbedding(metric="geodesic").fit_transform(X)
    >>> flat.shape
    (600, 2)
    >>> bool(trustworthiness(X, flat, n_neighbors=12) > 0.995)
    True
    """

    def __init__(
        self,
        n_components: int = 2,
        *,
        metric: Literal["euclidean", "geodesic", "precomputed", "precomputed_affinity"] = "euclidean",
        n_neighbors: int = 12,
        connect: Literal["bridge", "error"] = "bridge",
        n_landmarks: int | None = None,
        model: Literal["default", "paper", "isomap"] = "default",
        kernel_width: float | None = None,
        mean_affinity: float | None = None,
        relaxation: float = 1.6,
        max_sweeps: int = 500,
        tolerance: float = 1e-5,
        update: Literal["serial", "parallel"] = "serial",
        initial: Any = "mds",
        truncation: float = 0.0,
        random_state: Any = None,
        n_jobs: int | None = None,
    ) -> None:
        self.n_components = n_components
        self.metric = metric
        self.n_neighbors = n_neighbors
        self.connect = connect
        self.n_landmarks = n_landmarks
        self.model = model
        self.kernel_width = kernel_width
        self.mean_affinity = mean_affinity
        self.relaxation = relaxation
        self.max_sweeps = max_sweeps
        self.tolerance = tolerance
        self.update = update
        self.initial = initial
        self.truncation = truncation
        self.random_state = random_state
        self.n_jobs = n_jobs

    def fit(self, X: Any, y: Any = None) -> "BernoulliLogisticEmbedding":
        """Embed the training data.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features) or (n_samples, n_samples)
            Points, or distances or affinities of all pairs, by ``metric``.

        y : Ignored
            There for scikit-learn's conventions.

        Returns
        -------
        self : BernoulliLogisticEmbedding
            The estimator itself.

        Raises
        ------
        ValueError
            If data or a parameter are out of range, the points all coincide, or are in several pieces with
            ``connect="error"``.
        """
        self._check_parameters()
        X = validate_data(self, X, dtype=(np.float64, np.float32), ensure_min_samples=2)
        n = X.shape[0]
        if n <= self.n_components:
            raise ValueError(f"n_components={self.n_components} needs more points than that; found n_samples = {n}")
        data = np.ascontiguousarray(X, dtype=np.float64)
        random = check_random_state(self.random_state)
        seed = int(random.randint(np.iinfo(np.int32).max))
        k = self._landmark_count(n)
        self.landmark_indices_ = np.arange(n) if k == n else np.sort(random.permutation(n)[:k])

        known = self._measure_training(data)
        landmarks = self._fit_landmarks(known[self.landmark_indices_], self._start(n), seed)
        placed = landmarks
        if k < n:
            placed = self._place(known)
            placed[self.landmark_indices_] = landmarks
        self.embedding_ = (placed * self._unit()).astype(X.dtype, copy=False)
        self._n_features_out = self.n_components
        if not self.converged_:
            warnings.warn(
                f"The likelihood has not settled in max_sweeps={self.max_sweeps}; more, or a larger tolerance or "
                "kernel_width, let it",
                ConvergenceWarning,
                stacklevel=2,
            )
        return self

    def fit_transform(self, X: Any, y: Any = None) -> np.ndarray:
        """Embed the training data and return the embedding, as `fit` and `embedding_` do.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features) or (n_samples, n_samples)
            Points, or distances or affinities of all pairs, by ``metric``.

        y : Ignored
            There for scikit-learn's conventions.

        Returns
        -------
        ndarray of shape (n_samples, n_components)
            The embedding of the training data.
        """
        return self.fit(X).embedding_

    def transform(self, X: Any) -> np.ndarray:
        """Place further points among the landmarks, each by itself.

        Parameters
        ----------
        X : array-like of shape (m, n_features) or (m, n_samples)
            Points, or their distances or affinities to all training points, by ``metric``.

        Returns
        -------
        ndarray of shape (m, n_components)
            Places in the frame and the unit of ``embedding_``.
        """
        check_is_fitted(self)
        X = validate_data(self, X, dtype=(np.float64, np.float32), reset=False)
        data = np.ascontiguousarray(X, dtype=np.float64)
        if self.metric.startswith("precomputed"):
            known = self._in_range(data)[:, self.landmark_indices_]
        elif self.metric == "geodesic":
            known = self._through_neighbours(data)
        else:
            known = cdist(data, self._landmark_points)
        return (self._place(known) * self._unit()).astype(X.dtype, copy=False)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.pairwise = tags.input_tags.positive_only = str(self.metric).startswith("precomputed")
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags

    # Parameters ---------------------------------------------------------------------------------------------------

    def _check_parameters(self) -> None:
        check_scalar(self.n_components, "n_components", Integral, min_val=1)
        check_scalar(self.n_neighbors, "n_neighbors", Integral, min_val=1)
        check_scalar(self.max_sweeps, "max_sweeps", Integral, min_val=1)
        if self.n_landmarks is not None:
            least = self.n_components + 1
            check_scalar(self.n_landmarks, "n_landmarks", Integral, min_val=least)
        for name in ("kernel_width", "mean_affinity"):
            if getattr(self, name) is not None:
                check_scalar(getattr(self, name), name, Real, min_val=0, include_boundaries="neither")
        if self.kernel_width is not None and self.mean_affinity is not None:
            raise ValueError("kernel_width and mean_affinity both decide the kernel: only one of them can be given")
        check_scalar(self.relaxation, "relaxation", Real, min_val=0, max_val=2, include_boundaries="neither")
        check_scalar(self.tolerance, "tolerance", Real, min_val=0, max_val=1, include_boundaries="neither")
        check_scalar(self.truncation, "truncation", Real, min_val=0, max_val=self._most(), include_boundaries="left")
        for name, words in CHOICES.items():
            if getattr(self, name) not in words:
                raise ValueError(f"{name} must be one of {', '.join(map(repr, words))}; found {getattr(self, name)!r}")
        if isinstance(self.initial, str) and self.initial not in ("mds", "random"):
            raise ValueError(f"initial must be 'mds', 'random' or an array; found {self.initial!r}")
        if self.model == "isomap" and self.metric == "precomputed_affinity":
            raise ValueError("model='isomap' scales distances, and metric='precomputed_affinity' has none")

    def _most(self) -> float:
        """Affinity at distance 0."""
        return 1.0 if self.model == "paper" else 0.5

    def _landmark_count(self, n: int) -> int:
        if self.n_landmarks is not None:
            return min(int(self.n_landmarks), n)
        return n if n <= MOST_POINTS_WITHOUT_LANDMARKS else max(DEFAULT_LANDMARKS, 2 * self.n_components)

    def _start(self, n: int) -> np.ndarray | None:
        """The given start of the landmarks, in the scale of the embedding."""
        if isinstance(self.initial, str):
            return None
        start = np.asarray(self.initial, dtype=np.float64)
        if start.shape != (n, self.n_components) or not np.isfinite(start).all():
            raise ValueError(
                f"initial must be finite and of shape (n_samples, n_components) = ({n}, {self.n_components}); found "
                f"shape {start.shape}"
            )
        return start[self.landmark_indices_]

    # Distances ----------------------------------------------------------------------------------------------------

    def _measure_training(self, data: np.ndarray) -> np.ndarray:
        """Distances, or affinities, of all training points to the landmarks, (n, k); keeps what `transform` needs."""
        chosen = self.landmark_indices_
        if self.metric == "euclidean":
            self._landmark_points = data[chosen]
            return cdist(data, self._landmark_points)
        if self.metric == "geodesic":
            self._to_landmarks = self._along_graph(data)
            self._training_points = data
            neighbours = min(int(self.n_neighbors), len(data) - 1)
            self._neighbours = NearestNeighbors(n_neighbors=neighbours, n_jobs=self.n_jobs).fit(data)
            return self._to_landmarks
        if data.shape[0] != data.shape[1]:
            raise ValueError(f"metric={self.metric!r} needs a square matrix of all pairs; found shape {data.shape}")
        data = self._in_range(data)
        known = 0.5 * (data[:, chosen] + data[chosen].T)
        known[chosen, np.arange(len(chosen))] = 0
        return known

    def _in_range(self, data: np.ndarray) -> np.ndarray:
        """Distances or affinities, if they can be such."""
        bad = data < 0
        if bad.any():
            row, column = np.argwhere(bad)[0]
            raise ValueError(
                f"Negative values in data passed to X of BernoulliLogisticEmbedding with metric={self.metric!r}: "
                f"{data[row, column]} in row {row}, column {column}"
            )
        if self.metric == "precomputed_affinity" and (data > 1).any():
            row, column = np.argwhere(data > 1)[0]
            raise ValueError(f"affinities must lie in [0, 1]; found {data[row, column]} in row {row}, column {column}")
        return data

    def _along_graph(self, data: Bytes) -> np.ndarray:
        sources: Bytes = self.landmark_indices_
        options: dict[str, Any] = {
            "neighbours": min(int(self.n_neighbors), len(data) - 1),
            "threads": effective_n_jobs(self.n_jobs),
        }
        try:
            distances = graph_distances(data, sources, connect="error", **options)
        except InvalidArgumentError as error:
            if self.connect == "error":
                raise ValueError(f"{error} (n_neighbors={self.n_neighbors}, connect='error')") from error
            try:
                distances = graph_distances(data, sources, connect="bridge", **options)
            except InvalidArgumentError as other:
                raise ValueError(str(other)) from other
            warnings.warn(f"Pieces of the graph were joined by their shortest edges. {error}", stacklevel=4)
        return np.ascontiguousarray(np.asarray(distances).T)

    def _through_neighbours(self, data: np.ndarray) -> np.ndarray:
        """Distances of new points to the landmarks: to a neighbour, and on from there."""
        known = np.full((len(data), self._to_landmarks.shape[1]), np.inf)
        for neighbour in self._neighbours.kneighbors(data, return_distance=False).T:
            # In many dimensions the search's own lengths are rounded, and a point is not at 0 from itself.
            length = np.linalg.norm(data - self._training_points[neighbour], axis=1)
            np.minimum(known, self._to_landmarks[neighbour] + length[:, None], out=known)
        return known

    # Fit and placement --------------------------------------------------------------------------------------------

    def _fit_landmarks(self, own: Bytes, start: np.ndarray | None, seed: int) -> np.ndarray:
        """Fits the landmarks by their distances, or affinities, among themselves; their places, in units of √σ."""
        options: dict[str, Any] = {"dimensions": int(self.n_components), "threads": effective_n_jobs(self.n_jobs)}
        options["model"] = self.model
        is_affinity = self.metric == "precomputed_affinity"
        if is_affinity:
            self.sigma_ = 1.0
        else:
            mean_squared = _mean_over_pairs(own**2)
            if not np.isfinite(mean_squared):
                raise ValueError("distances are too large: their squares overflow")
            if mean_squared == 0:
                raise ValueError("all points coincide, or are too close together for the squares of their distances")
            self.sigma_ = self._kernel_width(own, mean_squared)
            if self.model != "isomap":
                options["sigma"] = self.sigma_
        if self.model != "isomap":
            options |= {
                "relaxation": float(self.relaxation),
                "max_sweeps": int(self.max_sweeps),
                "tolerance": float(self.tolerance),
                "update": self.update,
                "seed": seed,
                "initial": self.initial if start is None else start / self._unit(),
            }
            if self.truncation > 0:
                options["truncation"] = float(self.truncation)
        try:
            fit = embed(own, kind="affinities" if is_affinity else "distances", **options)
        except InvalidArgumentError as error:
            raise ValueError(str(error)) from error

        report, places = fit.report, np.asarray(fit.coordinates).copy()
        self.intercepts_ = np.asarray(fit.intercepts).copy()
        if self.model == "isomap":
            self.log_likelihood_ = self.bregman_ = float("nan")
            self.trace_, self.n_iter_, self.converged_ = np.empty(0), 0, True
            self._mean_squared = np.mean(own**2, axis=0)
        else:
            self.log_likelihood_, self.bregman_ = report["log_likelihood"], report["bregman"]
            self.trace_ = np.asarray(report["trace"])
            self.n_iter_, self.converged_ = report["sweeps"], report["converged"]
            places = self._in_standard_pose(places)
        self._landmarks = places
        return places

    def _kernel_width(self, own: Bytes, mean_squared: float) -> float:
        """σ of the landmarks with these distances."""
        if self.model == "isomap":
            return float("nan")
        if self.mean_affinity is None and (self.kernel_width is not None or self.model == "default"):
            return float(self.kernel_width or DEFAULT_RELATIVE_WIDTH) * mean_squared
        target = PUBLISHED_MEAN_AFFINITY if self.mean_affinity is None else float(self.mean_affinity)
        # However narrow the kernel, pairs that coincide have its affinity at distance 0.
        least = self._most() * _mean_over_pairs(own == 0)
        if not least < target < self._most():
            raise ValueError(
                f"mean_affinity == {target}: no kernel width has it; it must be above {least} and below the affinity "
                f"at distance 0, {self._most()}"
            )
        # The compiled fit chooses σ; one sweep, for a start may have to be scaled by σ before the fit that counts.
        options: dict[str, Any] = {"initial": "random", "max_sweeps": 1, "threads": effective_n_jobs(self.n_jobs)}
        chosen = embed(own, kind="distances", dimensions=1, model=self.model, mean_affinity=target, **options)
        return float(chosen.report["sigma"])

    def _unit(self) -> float:
        """What makes lengths of the likelihood's coordinates."""
        return float(np.sqrt(self.sigma_)) if self.model == "default" else 1.0

    def _in_standard_pose(self, places: np.ndarray) -> np.ndarray:
        """Along the principal axes, the larger side positive; with intercepts also centred. All log-odds stay."""
        mean = places.mean(axis=0)
        axes = np.linalg.svd(places - mean, full_matrices=False)[2]
        if len(self.intercepts_):
            # x·y + a + b with x = x' + c is x'·y' + (a + x'·c + c²/2) + (b + y'·c + c²/2).
            places = places - mean
            self.intercepts_ = self.intercepts_ + places @ mean + 0.5 * mean @ mean
        places = places @ axes.T
        largest = np.abs(places).argmax(axis=0)
        return places * np.where(places[largest, np.arange(places.shape[1])] < 0, -1.0, 1.0)

    def _place(self, known: Bytes) -> np.ndarray:
        """Places points by their distances, or affinities, to the landmarks, in units of √σ."""
        options: dict[str, Any] = {"model": self.model, "threads": effective_n_jobs(self.n_jobs)}
        if self.model == "isomap":
            options["mean_squared"] = self._mean_squared
        else:
            options |= {"sigma": self.sigma_, "truncation": float(self.truncation)}
        if self.metric == "precomputed_affinity":
            options["kind"] = "affinities"
        landmarks: Bytes = self._landmarks
        intercepts: Bytes = self.intercepts_
        try:
            return np.array(place(known, landmarks, intercepts, **options))
        except InvalidArgumentError as error:
            raise ValueError(str(error)) from error


def _mean_over_pairs(matrix: np.ndarray) -> float:
    """Mean off the diagonal of a symmetric matrix."""
    k = len(matrix)
    return float((matrix.sum() - np.trace(matrix)) / (k * (k - 1)))
