"""What is measured beside the table: time against size, the likelihood over the sweeps, trustworthiness."""

import time

import ble_unwrap_native as ble
import numpy as np
import shapes

SIZES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
# Of meshes: `flatten` also removes flips, of which single precision makes some where edges are ever so short.
MOST_OF_A_MESH = 100_000
RELAXATIONS = (0.5, 1.0, 1.5, 1.9)
NEIGHBOURS = 12


def sheet(vertices):
    """A rippled sheet of about so many vertices."""
    side = round(np.sqrt(vertices)) - 1
    u, v = np.meshgrid(np.linspace(0, 1, side + 1), np.linspace(0, 1, side + 1))
    positions = np.stack([u, v, 0.05 * np.sin(7 * u) * np.cos(5 * v)], axis=-1).reshape(-1, 3)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    quads = (first[:, None] + [0, 1, side + 2, side + 1]).astype(np.int32)
    offsets = np.arange(0, quads.size + 1, 4, dtype=np.int32)
    return shapes.Mesh("sheet", positions, quads.ravel(), offsets)


def time_of_surfaces(sizes=SIZES):
    """(vertices, seconds of the distances, seconds of the embedding) with the unwrapper's own 64 landmarks."""
    found = []
    for size in (size for size in sizes if size <= MOST_OF_A_MESH):
        report = ble.flatten(*sheet(size).arrays, minimise=False, landmark_min=64).report
        found.append((report["vertices"], report["seconds"]["distances"], report["seconds"]["embedding"]))
    return found


def time_of_points(sizes=SIZES, landmarks=100):
    """(points, seconds) of `embed` with landmarks, on points of a curved sheet; empty where `embed` has none."""
    found = []
    for size in sizes:
        points = np.random.default_rng(0).uniform(size=(size, 2))
        points = np.concatenate([points, 0.3 * points[:, :1] ** 2], axis=1)
        begin = time.perf_counter()
        try:
            ble.embed(points, landmarks=landmarks)
        except (ble.InvalidArgumentError, TypeError):
            return []
        found.append((size, time.perf_counter() - begin))
    return found


def geodesic_matrix(mesh):
    """Distances between all vertices."""
    vertices = np.arange(len(mesh.positions), dtype=np.int32)
    return np.asarray(ble.geodesic_distances(*mesh.arrays, vertices), dtype=np.float64)


def traces(mesh=None, sweeps=40):
    """The log-likelihood over the sweeps from one random start: {(model, label): values}."""
    distances = geodesic_matrix(mesh or shapes.face())
    found = {}
    common = {"kind": "distances", "initial": "random", "max_sweeps": sweeps, "tolerance": 1e-12}
    for model in ("default", "paper"):
        for relaxation in RELAXATIONS:
            fit = ble.embed(distances, model=model, relaxation=relaxation, **common)
            found[model, f"serial, ω = {relaxation:g}"] = list(fit.report["trace"])
        for relaxation in (0.5, 1.5):
            fit = ble.embed(distances, model=model, relaxation=relaxation, update="parallel", **common)
            found[model, f"parallel, ω = {relaxation:g}"] = list(fit.report["trace"])
    return found


def trustworthiness_table(samples=1500):
    """[(data set, method, trustworthiness, seconds)]; all in one run, with 12 neighbours."""
    from ble_unwrap_native.estimator import BernoulliLogisticEmbedding
    from sklearn.datasets import load_digits, make_swiss_roll
    from sklearn.manifold import TSNE, Isomap, SpectralEmbedding, trustworthiness
    from threadpoolctl import threadpool_limits

    roll, _ = make_swiss_roll(samples, random_state=0)
    found = []
    for name, points in (("swiss roll", roll), ("digits", load_digits().data)):
        methods = {
            "BLE, graph distances": BernoulliLogisticEmbedding(metric="geodesic").fit_transform,
            "BLE, Euclidean distances": BernoulliLogisticEmbedding().fit_transform,
            "Isomap": lambda x: Isomap(n_neighbors=NEIGHBOURS, n_components=2).fit_transform(x),
            "SpectralEmbedding": lambda x: SpectralEmbedding(n_neighbors=NEIGHBOURS, random_state=0).fit_transform(x),
            "t-SNE": lambda x: TSNE(random_state=0).fit_transform(x),
        }
        for method, embed in methods.items():
            begin = time.perf_counter()
            with threadpool_limits(1):  # idle OpenMP threads spin, which on a busy machine takes minutes
                flat = embed(np.ascontiguousarray(points, dtype=np.float64))
            seconds = time.perf_counter() - begin
            found.append((name, method, trustworthiness(points, flat, n_neighbors=NEIGHBOURS), seconds))
    return found


def markdown_of_trustworthiness(rows):
    lines = ["| data | method | trustworthiness | seconds |", "|---|---|--:|--:|"]
    last = None
    for name, method, value, seconds in rows:
        lines.append(f"| {name if name != last else ''} | {method} | {value:.4f} | {seconds:.2f} |")
        last = name
    return "\n".join(lines)
