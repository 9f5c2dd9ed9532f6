"""Geodesic distances: how accurate they are, against exact polyhedral distances and against surfaces whose distances
are known; what they promise; and what the functions say to wrong input.

    pytest -s tests/test_geodesics.py -k accuracy

prints the tables of accuracy.
"""

import threading
from pathlib import Path

import ble_unwrap_native as native
import numpy as np
import pytest
import surfaces
from conftest import grid
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import coo_matrix, csgraph
from scipy.spatial import cKDTree

MODELS = Path(__file__).resolve().parents[2] / "shared/models"


def marched(surface, sources, **options):
    return np.asarray(native.geodesic_distances(*surfaces.as_mesh(*surface), np.array(sources), **options)).astype(
        float
    )


def exact(surface, sources):
    """Exact distances on the polyhedron, by the algorithm of Mitchell, Mount and Papadimitriou (1987)."""
    geodesic = pytest.importorskip("pygeodesic.geodesic", reason="pygeodesic, the reference, has no wheel here")
    positions, triangles = surface
    search = geodesic.PyGeodesicAlgorithmExact(positions, np.ascontiguousarray(triangles, dtype=np.int32))
    return np.array([search.geodesicDistances(np.array([source]), None)[0] for source in sources])


def errors(found, expected, least=0.0):
    """Relative errors where the distance is above `least`."""
    counted = expected > least
    return (found[counted] - expected[counted]) / expected[counted]


def spread(count, sources=4):
    """Sources all over the numbering of the vertices, which the generators order by place."""
    return np.linspace(0, count - 1, sources + 2).astype(int)[1:-1] + np.arange(sources)


# Accuracy -----------------------------------------------------------------------------------------------------------

# Surface -> greatest mean and greatest single error of fast marching, in per cent; a half above what is measured.
GENERATED = {
    "plane": (surfaces.plane, 5e-6, 2e-5),
    "hills": (surfaces.hills, 0.22, 1.5),
    "hills, slivers": (lambda: surfaces.hills(stretch=10.0), 0.008, 0.07),
    "hills, folded flat": (lambda: surfaces.hills(stretch=0.2), 0.23, 2.6),
    "sphere, 642": (lambda: surfaces.icosphere(3), 0.5, 3.2),
    "sphere, 2562": (lambda: surfaces.icosphere(4), 0.3, 1.8),
    "cylinder": (lambda: surfaces.cylinder(60, 30), 5e-5, 0.1),
    "torus": (lambda: surfaces.torus(60, 24), 0.4, 2.3),
    "torus, slivers": (lambda: surfaces.torus(120, 12), 0.5, 1.8),
}
# The same for models that lie beside the repository, if they do.
MODEL = {
    "camelhead": (0.3, 2.4),
    "cat": (0.5, 3.7),
    "fandisk": (0.23, 3.0),
    "plane_holes": (0.54, 4.3),
    "rocker_arm": (0.34, 2.3),
}


@pytest.fixture(scope="module")
def table():
    """Rows of the tables of accuracy, of meshes and of clouds, printed in the end."""
    meshes, clouds = rows = ([], [])
    yield rows

    def show(heading, rows):
        if rows:
            print(f"\n\n| {' | '.join(heading)} |\n|---|{'--:|' * (len(heading) - 1)}")
            for name, count, share, *figures in rows:
                cells = [f"{figure:.1e}" if 0 < figure < 1e-3 else f"{figure:.3g}" for figure in figures]
                print(f"| {' | '.join([name, str(count), str(share), *cells])} |")

    show(["surface", "vertices", "obtuse", "fast marching: mean %", "max %", "along edges: mean %", "max %"], meshes)
    show(["cloud", "points", "neighbours", "mean %", "max %"], clouds)


def measure(name, surface, mean_limit, max_limit, table):
    positions = surface[0]
    sources = spread(len(positions))
    reference = exact(surface, sources)
    fast = 100 * errors(marched(surface, sources), reference)
    along_edges = 100 * errors(marched(surface, sources, geodesics="dijkstra"), reference)
    figures = [np.abs(fast).mean(), np.abs(fast).max(), along_edges.mean(), along_edges.max()]
    table[0].append([name, len(positions), f"{surfaces.obtuse_share(*surface):.0%}", *figures])
    assert figures[0] < mean_limit and figures[1] < max_limit, figures
    assert along_edges.min() > -1e-4, "an edge path is as long as the shortest path at least"
    assert (fast < along_edges + 1e-3).all()
    assert along_edges.mean() > 3, "marching across triangles must be worth its while"


@pytest.mark.parametrize("name", GENERATED)
def test_accuracy_on_generated_surfaces(name, table):
    surface, mean_limit, max_limit = GENERATED[name]
    measure(name, surface(), mean_limit, max_limit, table)


@pytest.mark.parametrize("name", MODEL)
def test_accuracy_on_models(name, table):
    file = MODELS / f"{name}.obj"
    if not file.exists():
        pytest.skip("the models do not lie beside the repository")
    measure(name, surfaces.load_obj(file), *MODEL[name], table)


def test_the_surfaces_of_slivers_are_full_of_obtuse_corners():
    for name in ("hills, slivers", "torus, slivers"):
        assert surfaces.obtuse_share(*GENERATED[name][0]()) > 0.9
    assert surfaces.obtuse_share(*surfaces.icosphere(3)) == 0


def slope(edges, measured):
    """Order of convergence: slope of log error over log edge length."""
    return np.polyfit(np.log(edges), np.log(measured), 1)[0]


def test_convergence_on_the_sphere_is_of_first_order():
    edges, smooth, polyhedral = [], [], []
    for levels in (2, 3, 4, 5):
        surface = positions, _ = surfaces.icosphere(levels)
        sources = spread(len(positions), 3)
        found = marched(surface, sources)
        known = np.array([surfaces.on_sphere(positions, source) for source in sources])
        # Towards the antipode, where paths of all directions meet, errors shrink more slowly.
        near = known < 1.6
        edges.append(surfaces.edge_lengths(*surface).mean())
        smooth.append(np.abs(found - known)[near].max())
        polyhedral.append(np.abs(errors(found, exact(surface, sources), 0.3)).mean())
    assert 0.9 < slope(edges, smooth) < 1.3, smooth
    assert 0.7 < slope(edges, polyhedral) < 1.3, polyhedral
    assert polyhedral[3] < 0.65 * polyhedral[2], "halving the edges nearly halves the error"
    assert smooth[3] < 4e-3


def test_convergence_on_hills_is_of_first_order():
    edges, measured = [], []
    for count in (150, 600, 2400, 9600):
        surface = surfaces.hills(count)
        sources = spread(len(surface[0]), 3)
        edges.append(surfaces.edge_lengths(*surface).mean())
        measured.append(np.abs(errors(marched(surface, sources), exact(surface, sources), 0.3)).mean())
    assert 0.6 < slope(edges, measured) < 1.3, measured
    assert measured[3] < 0.65 * measured[2], measured


def test_convergence_on_the_cylinder_is_of_second_order():
    """The prism is marched over exactly, so only its distance from the round cylinder is left."""
    edges, smooth = [], []
    for segments in (16, 32, 64, 128):
        surface = positions, _ = surfaces.cylinder(segments, segments // 2)
        sources = spread(len(positions), 3)
        found = marched(surface, sources)
        known = np.array([surfaces.on_cylinder(positions, source) for source in sources])
        edges.append(surfaces.edge_lengths(*surface).mean())
        smooth.append(np.abs(errors(found, known, 0.3)).mean())
        assert np.abs(errors(found, exact(surface, sources), 0.3)).mean() < 1e-4
    assert 1.8 < slope(edges, smooth) < 2.2, smooth


# What distances on meshes promise -------------------------------------------------------------------------------------


def rotation(seed, dimension=3):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(dimension, dimension)))[0]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-6, 6), st.sampled_from(["fast_marching", "dijkstra"]))
def test_a_rigid_motion_or_scale_changes_nothing(seed, exponent, metric):
    positions, triangles = surfaces.hills(300, seed=seed % 5)
    sources, scale = [0, 77, 200], 10.0**exponent
    turned = scale * (positions @ rotation(seed).T + np.random.default_rng(seed).uniform(-3, 3, 3))
    before = marched((positions, triangles), sources, geodesics=metric)
    after = marched((turned, triangles), sources, geodesics=metric)
    assert_allclose(after / scale, before, rtol=2e-5, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 100), st.sampled_from([0.2, 1.0, 6.0]))
def test_distances_on_a_mesh_are_nearly_a_metric(seed, stretch):
    surface = positions, _ = surfaces.hills(700, seed=seed, stretch=stretch)
    chosen = np.random.default_rng(seed).choice(len(positions), 15, replace=False)
    d = marched(surface, chosen)[:, chosen]
    assert (np.diag(d) == 0).all() and (d[~np.eye(15, dtype=bool)] > 0).all()
    assert_allclose(d, d.T, rtol=0.04)
    assert (d[:, None, :] <= 1.04 * (d[:, :, None] + d[None, :, :])).all(), "d(i, k) <= d(i, j) + d(j, k)"
    along_edges = marched(surface, chosen, geodesics="dijkstra")[:, chosen]
    assert_allclose(along_edges, along_edges.T, rtol=1e-6)
    through_space = np.linalg.norm(positions[chosen, None] - positions[chosen], axis=-1)
    assert (d >= through_space * (1 - 1e-6)).all() and (d <= along_edges * (1 + 1e-5)).all()


def test_on_a_flat_sheet_distances_are_exact():
    positions, corners, offsets = sheet = grid(24, 16)
    sources = np.array([0, 24, 212])
    d = np.asarray(native.geodesic_distances(*sheet, sources))
    assert d.shape == (3, len(positions)) and d.dtype == np.float32
    straight = np.linalg.norm(positions[sources, None] - positions[None], axis=-1)
    assert_allclose(d, straight, atol=1e-5)
    along_edges = np.asarray(native.geodesic_distances(*sheet, sources, geodesics="dijkstra", threads=1))
    assert (along_edges >= d - 1e-5).all() and along_edges.max() > d.max() + 0.01
    scaled = native.geodesic_distances(1e3 * positions + 7, corners, offsets, sources)
    assert_allclose(np.asarray(scaled), 1e3 * straight, atol=1e-2)


def test_distances_that_do_not_exist_are_infinite():
    positions, corners, offsets = grid(2, 2)
    two = (
        np.concatenate([positions, positions + 5, [[9, 9, 9]]]),
        np.concatenate([corners, corners + len(positions)]),
        np.concatenate([offsets, offsets[1:] + len(corners)]),
    )
    d = np.asarray(native.geodesic_distances(*two, np.array([0, 18])))
    assert np.isfinite(d[0, :9]).all() and np.isinf(d[0, 9:]).all()
    assert d[1, 18] == 0 and np.isinf(d[1, :18]).all()


def test_geodesic_distances_name_what_is_wrong(square):
    with pytest.raises(native.InvalidArgumentError, match="source 1 is vertex 4, but the vertices are numbered 0 to 4"):
        native.geodesic_distances(*square, np.array([0, 4]))
    with pytest.raises(native.InvalidArgumentError, match=r"sources: expected an int32 or int64 array of shape \(k,\)"):
        native.geodesic_distances(*square, 0)
    with pytest.raises(native.InvalidArgumentError, match=r"geodesic_distances\(\) has no setting 'model'"):
        native.geodesic_distances(*square, np.array([0]), model="paper")
    with pytest.raises(native.InvalidMeshError, match="vertex 9"):
        native.geodesic_distances(square[0], np.array([0, 1, 3, 9]), square[2], np.array([0]))


# Point clouds ---------------------------------------------------------------------------------------------------------


def between(points, sources=None, **options):
    return np.asarray(native.graph_distances(points, None if sources is None else np.array(sources), **options))


def cloud(kind, count, seed=0):
    """Random points of a surface, and a function that tells the distances from one of them on it."""
    u, v = np.random.default_rng(seed).random((2, count))
    if kind == "sphere":
        z, angle = 2 * u - 1, 2 * np.pi * v
        radius = np.sqrt(1 - z * z)
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
        return points, lambda i: surfaces.on_sphere(points, i)
    if kind == "swiss roll":
        t = 1.5 * np.pi * (1 + 2 * u)
        flat = np.column_stack([(t * np.sqrt(1 + t * t) + np.arcsinh(t)) / 2, 21 * v])
        points = np.column_stack([t * np.cos(t), flat[:, 1], t * np.sin(t)])
    else:
        flat = np.column_stack([3 * u, 2 * v])
        points = np.column_stack([flat, np.zeros(count)]) @ rotation(5).T
    return points, lambda i: np.linalg.norm(flat - flat[i], axis=1)


@pytest.mark.parametrize(("neighbours", "least", "most"), [(6, 5.0, 14.0), (12, 1.5, 4.0), (24, 0.4, 1.3)])
@pytest.mark.parametrize("kind", ["plane", "sphere", "swiss roll"])
def test_accuracy_of_clouds(kind, neighbours, least, most, table):
    """Zigzags are some per cent too long, by the number of neighbours and not by that of the points."""
    points, known = cloud(kind, 4000)
    sources = np.arange(6)
    known = np.array([known(i) for i in sources])
    error = 100 * errors(between(points, sources, neighbours=neighbours), known, known.max() / 10)
    table[1].append([kind, len(points), neighbours, error.mean(), error.max()])
    assert least < error.mean() < most
    assert error.min() > -0.5, "no way is much shorter than the surface allows"


def test_too_many_neighbours_leave_the_surface():
    """As documented: where a swiss roll has few points, edges to many neighbours jump from turn to turn."""
    points, known = cloud("swiss roll", 500)
    sources = np.arange(8)
    known = np.array([known(i) for i in sources])
    assert errors(between(points, sources, neighbours=6), known).min() > -0.1
    assert errors(between(points, sources, neighbours=30), known).min() < -0.3


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 20), st.integers(2, 150))
def test_graph_distances_are_those_of_another_implementation(seed, dimension, neighbours, count):
    points = np.random.default_rng(seed).normal(size=(count, dimension))
    k = min(neighbours, count - 1)
    length, other = cKDTree(points).query(points, k + 1)
    rows = np.repeat(np.arange(count), k)
    graph = coo_matrix((length[:, 1:].ravel(), (rows, other[:, 1:].ravel())), (count, count)).tocsr()
    expected = csgraph.dijkstra(graph, directed=False)
    d = between(points, neighbours=neighbours, connect="separate")
    assert d.dtype == np.float64
    assert_allclose(d, expected, rtol=1e-12)
    assert_array_equal(d, d.T)
    assert (d[:, None, :] <= (d[:, :, None] + d[None, :, :]) * (1 + 1e-12)).all()
    radius = float(np.median(d[np.isfinite(d)])) + 0.1
    assert_array_equal(between(points, neighbours=neighbours, connect="separate", radius=radius) < np.inf, d <= radius)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(-150, 150))
def test_a_rigid_motion_or_scale_changes_no_cloud(seed, dimension, exponent):
    rng = np.random.default_rng(seed)
    points, scale = rng.normal(size=(120, dimension)), 10.0**exponent
    moved = scale * (points @ rotation(seed, dimension).T + rng.uniform(-3, 3, dimension))
    options = {"neighbours": 9, "connect": "bridge"}
    assert_allclose(between(moved, **options) / scale, between(points, **options), rtol=1e-9, atol=1e-12)


def pieces():
    """A sheet of 400 points, 30 points above it, 20 outliers."""
    rng = np.random.default_rng(3)
    sheet = np.column_stack([10 * rng.random((400, 2)), np.zeros(400)])
    return np.concatenate([sheet, sheet[:30] * 0.1 + [0, 0, 40], sheet[:20] * 0.01 + [300, 0, 0]])


def test_a_cloud_in_pieces_says_how_to_mend_it():
    points = pieces()
    with pytest.raises(native.InvalidArgumentError) as raised:
        between(points)
    text = str(raised.value)
    assert "450 points in 3 pieces: 400 points about point 0, 30 about 400, 20 about 430" in text
    assert "30 neighbours would connect them" in text and "bridge" in text
    assert np.isfinite(between(points, [0], neighbours=30)).all()
    with pytest.raises(native.InvalidArgumentError, match="30 neighbours would connect them"):
        between(points, [0], neighbours=29)
    with pytest.raises(native.InvalidArgumentError, match="no number of neighbours up to 64 connects them"):
        between(np.concatenate([points, points + 1e4]))


def test_a_cloud_in_pieces_is_bridged_or_left_alone():
    points = pieces()
    apart, joined = between(points, connect="separate"), between(points, connect="bridge")
    piece = np.repeat([0, 1, 2], [400, 30, 20])
    same = piece[:, None] == piece
    assert np.isinf(apart[~same]).all()
    assert_array_equal(apart[same], joined[same])
    gap = np.linalg.norm(points[:400, None] - points[None, 400:430], axis=-1)
    i, j = np.unravel_index(gap.argmin(), gap.shape)
    assert joined[i, 400 + j] == pytest.approx(gap.min(), rel=1e-12)
    assert_allclose(joined[7, 400:430], joined[7, i] + gap.min() + joined[400 + j, 400:430], rtol=1e-12)


@pytest.mark.parametrize("connect", ["error", "bridge", "separate"])
def test_coincident_points_are_no_island(connect):
    points = np.random.default_rng(1).random((300, 2))
    repeated = np.concatenate([points, np.repeat(points[:5], 40, axis=0)])
    d = between(repeated, connect=connect)
    origin = np.concatenate([np.arange(300), np.repeat(np.arange(5), 40)])
    assert_array_equal(d, between(points, connect=connect)[np.ix_(origin, origin)])
    assert (d[0, 300:340] == 0).all()


def test_clouds_of_any_dimension_layout_and_type():
    points = np.random.default_rng(2).random((90, 6))
    whole = between(points)
    assert_array_equal(between(np.asfortranarray(points)), whole)
    assert_array_equal(between(np.repeat(points, 2, axis=1)[:, ::2]), whole)
    assert_allclose(between(points.astype(np.float32)), whole, rtol=1e-5, atol=1e-6)
    assert_allclose(between(points, [5, 3, 5]), whole[[5, 3, 5]], rtol=1e-15)
    assert_array_equal(between(points, threads=1), between(points, threads=3))
    line = np.sort(np.random.default_rng(4).random((50, 1)), axis=0)
    assert_allclose(between(line, neighbours=2, connect="bridge"), np.abs(line - line.T), rtol=1e-9, atol=1e-12)
    for shape, sources, expected in [((0, 3), None, (0, 0)), ((1, 2), None, (1, 1)), ((8, 2), [], (0, 8))]:
        sources = None if sources is None else np.zeros(0, dtype=np.int32)
        assert np.asarray(native.graph_distances(np.zeros(shape), sources)).shape == expected


@pytest.mark.parametrize(
    ("arguments", "options", "text"),
    [
        (([[1.0, 2.0]],), {}, r"points: expected a float32 or float64 array of shape \(n, p\)"),
        ((np.zeros(5),), {}, r"points: .* shape \(5,\)"),
        ((np.zeros((5, 0)),), {}, r"at least 1 coordinate a point, found shape \(5, 0\)"),
        (
            (np.array([[0.0], [np.nan], [1.0], [np.inf]]),),
            {},
            "point 1 has a coordinate that is not finite, and so has 1",
        ),
        ((np.eye(3), np.array([0, 3])), {}, r"source 1 is point 3, but the points are numbered 0 to 3 \(exclusive\)"),
        ((np.eye(3), np.array([0.5])), {}, "sources: expected an int32 or int64"),
        ((np.eye(3),), {"neighbours": 0}, "neighbours: expected a whole number from 1 to"),
        ((np.eye(3),), {"neighbours": 2.5}, "neighbours: expected a whole number"),
        ((np.eye(3),), {"connect": "always"}, "connect: expected 'error', 'bridge' or 'separate'; found 'always'"),
        ((np.eye(3),), {"radius": 0.0}, "radius: expected a number above 0, or None for no bound; found 0.0"),
        ((np.eye(3),), {"radius": np.nan}, "radius: expected"),
        ((np.eye(3),), {"model": "paper"}, r"graph_distances\(\) has no setting 'model'"),
        (
            (np.lib.stride_tricks.as_strided(np.zeros(1), (5 * 10**6, 1), (0, 0)), None),
            {"connect": "separate"},
            "memory",
        ),
    ],
)
def test_graph_distances_name_what_is_wrong(arguments, options, text):
    with pytest.raises(native.InvalidArgumentError, match=text):
        native.graph_distances(*arguments, **options)


def test_graph_distances_take_a_job_and_release_the_interpreter():
    points = np.random.default_rng(0).random((1500, 3))
    job = native.Job()
    assert native.graph_distances(points, job=job) is job.result() and job.progress() == 1
    job = native.Job()
    job.cancel()
    with pytest.raises(native.Cancelled):
        native.graph_distances(points, job=job)
    # Another thread runs meanwhile, and stops what would take long.
    job = native.Job()
    stopper = threading.Timer(0.2, job.cancel)
    stopper.start()
    with pytest.raises(native.Cancelled):
        native.graph_distances(np.random.default_rng(0).random((8_000, 3)), job=job)
    stopper.join()
