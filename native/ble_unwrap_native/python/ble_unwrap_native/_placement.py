"""Placing points by what is known of them and landmarks that stay where they are, in NumPy.

The same logistic regression as the compiled one, from plain arrays: an estimator that was pickled, or that measures its
distances itself, has nothing else. Terms: m points are placed in q dimensions by k landmarks.
"""

import numpy as np

# Pairs of a point and a landmark at work at once: half a megabyte an array, so that all stay in a core's cache.
PAIRS_AT_ONCE = 1 << 16
# Newton steps of a point; four or five are usual, and each halving counts. One that uses them up keeps its best place.
MOST_STEPS = 50
# A Newton step shorter than this, in units of √σ, is the last: the next would be of its square.
LAST_STEP = 1e-6
# Share of its trace that is added to the diagonal of a curvature, for landmarks on a line. As in the fit.
RIDGE = 1e-9
# Weight of a point's place by least squares against its likelihood. A pair of affinity ½ weighs ¼: this decides only
# where all affinities are of this order or below, and the likelihood says no more than that the point is far away.
PRIOR = 1e-6
# Least relative weight of a pair in least squares: a point far away is placed by more than the landmark next to it.
LEAST_WEIGHT = 1e-3
# Affinities count as this far from 0 and 1 where their log-odds are taken.
LEAST_AFFINITY = 1e-12
# Beyond it exp underflows.
LARGEST_EXPONENT = 700.0


def affinities(squared: np.ndarray, sigma: float, kernel: str) -> np.ndarray:
    """Affinities of points at these squared distances: 1/(1 + exp(d²/2σ)), or exp(-d²/2σ)."""
    u = np.minimum(squared / (2 * sigma), LARGEST_EXPONENT)
    return 1 / (1 + np.exp(u)) if kernel == "logistic" else np.exp(-u)


def log_odds(squared: np.ndarray, sigma: float, kernel: str) -> np.ndarray:
    """log(p/(1 − p)) of the affinities of these squared distances; finite, and exact however small p is."""
    u = squared / (2 * sigma)
    return -u if kernel == "logistic" else -u - np.log(-np.expm1(-np.maximum(u, LEAST_AFFINITY)))


def affinity_log_odds(p: np.ndarray) -> np.ndarray:
    """log(p/(1 − p)) of given affinities, those of 0 and 1 taken as nearly so."""
    p = np.clip(p, LEAST_AFFINITY, 1 - LEAST_AFFINITY)
    return np.log(p / (1 - p))


class LandmarkRegression:
    """Landmarks as a design for logistic regressions, one for each point to be placed.

    Parameters
    ----------
    coordinates : (k, q) float64
        Places of the landmarks, in units of √σ.
    intercepts : (k,) or (0,) float64
        Their intercepts; none for the published model.
    """

    def __init__(self, coordinates: np.ndarray, intercepts: np.ndarray) -> None:
        k, self.dimensions = coordinates.shape
        with_intercepts = len(intercepts) > 0
        self.design = np.column_stack([coordinates, np.ones(k)]) if with_intercepts else coordinates
        self.offset = intercepts if with_intercepts else np.zeros(k)
        self.parameters = self.design.shape[1]
        self.products = (self.design[:, :, None] * self.design[:, None, :]).reshape(k, -1)

    def place(self, p: np.ndarray, odds: np.ndarray) -> np.ndarray:
        """Places points by their affinities to the landmarks.

        Parameters
        ----------
        p : (m, k) float64
            Affinities.
        odds : (m, k) float64
            Log-odds of the same, before any truncation. Their weighted least squares are the start and, where all
            affinities are next to 0, the answer.

        Returns
        -------
        (m, q) float64
            In units of √σ; finite. The maximum of each point's likelihood, which is concave, by damped Newton steps:
            to `LAST_STEP`, or the best place within `MOST_STEPS`. O(mk(q + 1)²).
        """
        start = self._least_squares(odds)
        theta = start.copy()
        value, step = self._newton(theta, start, p)
        active = np.arange(len(p))
        for _ in range(MOST_STEPS):
            if len(active) == 0:
                break
            there = theta[active] + step[active]
            found, further = self._newton(there, start[active], p[active])
            last = np.abs(step[active]).max(axis=1) < LAST_STEP
            better = found > value[active]
            theta[active[better | last]] = there[better | last]
            value[active[better]] = found[better]
            step[active] = np.where(better[:, None], further, 0.5 * step[active])
            active = active[~last]
        return theta[:, : self.dimensions]

    def _least_squares(self, odds: np.ndarray) -> np.ndarray:
        """Berkson's estimate: linear, with weights p(1 − p), and exact where the model is. The weights are relative to
        the largest of a row, so that points far from all landmarks have one."""
        weight = -np.abs(odds) - 2 * np.log1p(np.exp(-np.abs(odds)))
        weight = np.maximum(np.exp(weight - weight.max(axis=1, keepdims=True)), LEAST_WEIGHT)
        return self._solve(self._curvature(weight), (weight * (odds - self.offset)) @ self.design)

    def _newton(self, theta: np.ndarray, start: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log-likelihood with prior of each point, and its step."""
        t = theta @ self.design.T + self.offset
        small = np.exp(-np.abs(t))
        q = np.where(t >= 0, 1.0, small) / (1 + small)
        aside = theta - start
        value = np.sum(p * t - np.maximum(t, 0) - np.log1p(small), axis=1) - 0.5 * PRIOR * np.sum(aside**2, axis=1)
        curvature = self._curvature(small / (1 + small) ** 2)
        diagonal = np.arange(self.parameters)
        curvature[:, diagonal, diagonal] += PRIOR
        return value, self._solve(curvature, (p - q) @ self.design - PRIOR * aside)

    def _curvature(self, weight: np.ndarray) -> np.ndarray:
        return (weight @ self.products).reshape(-1, self.parameters, self.parameters)

    def _solve(self, curvature: np.ndarray, right: np.ndarray) -> np.ndarray:
        diagonal = np.arange(self.parameters)
        trace = np.trace(curvature, axis1=1, axis2=2)
        curvature[:, diagonal, diagonal] += (RIDGE * trace)[:, None]
        # Only a design of zeros, all landmarks at the origin of the published model, has no trace.
        curvature[trace == 0] = np.eye(self.parameters)
        return np.linalg.solve(curvature, right[..., None])[..., 0]


class LandmarkScaling:
    """Landmarks of classical scaling, by which further points are placed (de Silva and Tenenbaum, 2004).

    Parameters
    ----------
    coordinates : (k, q) float64
        Places of the landmarks by classical scaling.
    squared : (k, k) float64
        Their squared distances.
    """

    def __init__(self, coordinates: np.ndarray, squared: np.ndarray) -> None:
        eigenvalues = np.sum(coordinates**2, axis=0)
        # A dimension without extent stays empty.
        safe = np.where(eigenvalues > 0, eigenvalues, 1.0)
        self.projection = coordinates / (2 * safe)
        self.mean_squared = squared.mean(axis=0)

    def place(self, squared: np.ndarray) -> np.ndarray:
        """Places points by their (m, k) squared distances to the landmarks. Exact for the landmarks themselves."""
        return (self.mean_squared - squared) @ self.projection


def chunks(known: np.ndarray) -> list[np.ndarray]:
    """The rows of a matrix of points and landmarks, in parts of no more than `PAIRS_AT_ONCE` pairs."""
    count, landmarks = known.shape
    size = max(1, PAIRS_AT_ONCE // landmarks)
    return [known[begin : begin + size] for begin in range(0, count, size)]
