"""`flatten`: one patch to one chart, step by step."""

import threading

import ble_unwrap_native as native
import conftest
import numpy as np
import pytest


def hill(cells=14, height=0.4):
    return conftest.grid(cells, cells, lambda x, y: height * np.exp(-9 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)))


def signed_areas(mesh, uv):
    quads = mesh[1].reshape(-1, 4)
    corners = uv[quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def test_arrays_and_report():
    mesh = hill()
    flat = native.flatten(*mesh)
    assert flat.embedded.shape == flat.uv.shape == (225, 2)
    assert np.asarray(flat.uv).dtype == np.asarray(flat.embedded).dtype == np.float64
    report = flat.report
    assert set(report) == {
        *("model", "vertices", "triangles", "landmarks", "sigma", "sweeps", "converged", "log_likelihood", "trace"),
        *("flips_before", "flips_after", "l2_before", "l2_after", "l_infinity_before", "l_infinity_after"),
        *("distance_correlation_before", "distance_correlation_after"),
        *("rung", "stretch_iterations", "boundary_is_simple", "seconds"),
    }
    assert set(report["seconds"]) == {"condition", "distances", "embedding", "flips", "stretch"}
    assert (report["model"], report["vertices"], report["triangles"], report["landmarks"]) == ("default", 225, 392, 48)
    assert report["log_likelihood"] == report["trace"][-1] and len(report["trace"]) == report["sweeps"] + 1
    assert report["flips_before"] == report["flips_after"] == 0 and report["rung"] == "embedding"
    assert 1 < report["l2_after"] < report["l2_before"] < 1.2
    assert "l2_before" in repr(flat) and "vertices=225" in repr(flat)


def test_figures_agree_with_the_arrays():
    mesh = hill()
    flat = native.flatten(*mesh, preset="paper")
    for uv, when in ((flat.embedded, "before"), (flat.uv, "after")):
        area = signed_areas(mesh, np.asarray(uv))
        # The native side may divide a quad along its other diagonal, so the counts need not be equal.
        assert (flat.report[f"flips_{when}"] > 0) == bool((area <= 0).any())
    assert flat.report["flips_before"] > 0 == flat.report["flips_after"]
    # Distances to all from all, measured apart, correlate as the report says.
    vertices = np.arange(225, dtype=np.int32)
    geodesic = np.asarray(native.geodesic_distances(*mesh, vertices)).astype(float)
    uv = np.asarray(flat.uv)
    plane = np.linalg.norm(uv[:, None] - uv[None], axis=2)
    pairs = ~np.eye(225, dtype=bool)
    found = np.corrcoef(geodesic[pairs], plane[pairs])[0, 1]
    assert abs(found - flat.report["distance_correlation_after"]) < 1e-5


def test_a_triangle_mesh_is_measured_as_it_is():
    """With triangles nobody has to choose a diagonal: flips and L2 equal those of a few lines of NumPy."""
    positions, corners, _ = hill()
    quads = corners.reshape(-1, 4)
    triangles = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    offsets = np.arange(0, triangles.size + 1, 3, dtype=np.int32)
    flat = native.flatten(positions, triangles.ravel(), offsets, preset="paper")
    for uv, when in ((flat.embedded, "before"), (flat.uv, "after")):
        p, q = positions[triangles], np.asarray(uv)[triangles]
        a, b = p[:, 1:] - p[:, :1], q[:, 1:] - q[:, :1]
        surface = 0.5 * np.linalg.norm(np.cross(a[:, 0], a[:, 1]), axis=1)
        plane = 0.5 * (b[:, 0, 0] * b[:, 1, 1] - b[:, 0, 1] * b[:, 1, 0])
        # The map from the plane to the surface, a 3×2 matrix J with J b = a.
        jacobian = np.einsum("tij,tjk->tik", np.swapaxes(a, 1, 2), np.linalg.inv(np.swapaxes(b, 1, 2)))
        energy = 0.5 * (jacobian**2).sum(axis=(1, 2)) * surface
        l2 = np.sqrt(energy.sum() * np.abs(plane).sum()) / surface.sum()
        assert flat.report[f"flips_{when}"] == (plane <= 0).sum()
        assert flat.report[f"l2_{when}"] == pytest.approx(l2, rel=1e-6)
        singular = np.linalg.svd(jacobian, compute_uv=False)[:, 0].max()
        l_infinity = singular * np.sqrt(np.abs(plane).sum() / surface.sum())
        assert flat.report[f"l_infinity_{when}"] == pytest.approx(l_infinity, rel=1e-6)


@pytest.mark.parametrize("model", ["default", "paper", "isomap"])
def test_models_end_without_flips(model):
    mesh = hill()
    flat = native.flatten(*mesh, model=model, landmark_fraction=1.0)
    report = flat.report
    assert report["landmarks"] == 225 and report["flips_after"] == 0 and report["boundary_is_simple"]
    assert (signed_areas(mesh, np.asarray(flat.uv)) > 0).all()
    assert report["l2_after"] < 1.1
    if model == "isomap":
        assert report["log_likelihood"] is None and report["trace"] == [] and report["sweeps"] == 0
    else:
        assert np.all(np.diff(report["trace"]) >= -1e-9 * abs(report["log_likelihood"]))


def test_unit_pose_and_unused_vertices():
    """A flat 30 by 10 sheet far from the origin comes out 30 by 10, lying along u, its centroid at 0."""
    positions, corners, offsets = conftest.grid(6, 18)
    positions = positions * (10, 30, 1) + (500, -70, 3)
    positions = np.concatenate([positions, [[1, 2, 3]]])
    flat = native.flatten(positions, corners, offsets)
    for uv in (np.asarray(flat.embedded), np.asarray(flat.uv)):
        assert np.isnan(uv[-1]).all()
        plane = np.linalg.norm(uv[:-1, None] - uv[None, :-1], axis=2)
        sheet = np.linalg.norm(positions[:-1, None] - positions[None, :-1], axis=2)
        assert np.allclose(plane, sheet, atol=1e-4)
        # The diagonals of the quads all run one way, which turns the principal axes a little.
        assert np.allclose(np.ptp(uv[:-1], axis=0), (30, 10), rtol=0.02)
    assert flat.report["l2_before"] < 1 + 1e-6


def test_minimise_off_and_presets():
    mesh = hill()
    full = native.flatten(*mesh, preset="paper")
    quick = native.flatten(*mesh, preset="paper", minimise=False)
    assert np.array_equal(quick.embedded, full.embedded)
    assert quick.report["stretch_iterations"] == 0 == quick.report["flips_after"]
    assert quick.report["l2_after"] > full.report["l2_after"]
    assert full.report["landmarks"] == 225
    assert native.flatten(*mesh, preset="paper", together_max=100).report["landmarks"] == 3
    charts = native.flatten(*mesh, preset="iso_charts").report
    assert charts["model"] == "isomap" and charts["landmarks"] == 225
    assert native.flatten(*mesh, **flatten_settings("paper")).report["trace"] == full.report["trace"]


def flatten_settings(preset):
    """The settings of a preset that `flatten` takes."""
    unwraps = {"stretch_limit", "limit_over", "coarse", "moves", "stretch_price", "holes", "chart_scale"}
    unwraps |= {"hide_seams", "front", "symmetry", "stack", "style", "straighten", "cover_price"}
    unwraps |= {"crease_weight", "margin", "texture_size", "rotation", "quality", "tiles", "texel_density"}
    unwraps |= {"cut_angle", "mip_levels", "snap", "shrink_margin"}
    return {name: value for name, value in native.default_settings(preset).items() if name not in unwraps}


def test_threads_do_not_matter():
    mesh = hill()
    one, two = (native.flatten(*mesh, initial="random", seed=3, threads=t) for t in (1, 2))
    assert bytes(one.uv) == bytes(two.uv) and bytes(one.embedded) == bytes(two.embedded)
    assert bytes(native.flatten(*mesh, initial="random", seed=4).embedded) != bytes(one.embedded)


def test_holes_are_allowed():
    positions, corners, _ = hill()
    quads = corners.reshape(-1, 4)
    kept = np.delete(quads, [45, 46, 59, 60, 130], axis=0)
    flat = native.flatten(positions, kept.ravel(), np.arange(0, kept.size + 1, 4, dtype=np.int32))
    assert flat.report["flips_after"] == 0 and flat.report["boundary_is_simple"]


def apart():
    positions, corners, offsets = conftest.grid(2, 2)
    return (
        np.concatenate([positions, positions + 5]),
        np.concatenate([corners, corners + 9]),
        np.concatenate([offsets, offsets[1:] + 16]),
    )


def not_finite():
    positions, corners, offsets = conftest.grid(2, 2)
    positions[0, 0] = np.inf
    return positions, corners, offsets


def tube_with_a_handle():
    """A torus without one face."""
    a, b = np.meshgrid(np.arange(8) / 8 * 2 * np.pi, np.arange(6) / 6 * 2 * np.pi)
    positions = np.stack([(3 + np.cos(b)) * np.cos(a), (3 + np.cos(b)) * np.sin(a), np.sin(b)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(8), np.arange(6))
    quads = np.stack([i + 8 * j, (i + 1) % 8 + 8 * j, (i + 1) % 8 + 8 * ((j + 1) % 6), i + 8 * ((j + 1) % 6)], axis=-1)
    quads = quads.reshape(-1, 4)[:-1]
    return positions, quads.astype(np.int32).ravel(), np.arange(0, quads.size + 1, 4, dtype=np.int32)


def bow_tie():
    positions = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], float)
    return positions, np.array([0, 1, 2, 0, 3, 4], np.int32), np.array([0, 3, 6], np.int32)


def line():
    return np.zeros((4, 3)), np.array([0, 1, 2, 1, 3, 2], np.int32), np.array([0, 3, 6], np.int32)


@pytest.mark.parametrize(
    ("mesh", "text"),
    [
        (apart, "2 pieces, one with face 0 and another with face 4; flatten them one at a time, or use unwrap"),
        (lambda: conftest.sphere(12, 8), "the surface is closed; .* or use unwrap"),
        (tube_with_a_handle, "has 1 handles; cut them open, or use unwrap"),
        (not_finite, "face 0 has a vertex with non-finite coordinates"),
        (bow_tie, "comes in 2 pieces"),
        (line, "no area"),
        (lambda: (np.zeros((0, 3)), np.zeros(0, np.int32), np.zeros(1, np.int32)), "no faces"),
    ],
)
def test_what_is_no_patch_is_refused(mesh, text):
    with pytest.raises(native.InvalidMeshError, match=text):
        native.flatten(*mesh())


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"stretch_limit": 1.2}, r"flatten\(\) has no setting 'stretch_limit'"),
        ({"model": "best"}, "model: expected 'default', 'paper' or 'isomap'; found 'best'"),
        ({"together_max": 30_000}, "together_max: expected a whole number from 0 to 20000; found 30000"),
        ({"minimise": "yes"}, "minimise: expected True or False; found 'yes'"),
        ({"relaxation": 2.0}, "relaxation: expected a number above 0 and below 2; found 2.0"),
    ],
)
def test_wrong_settings_are_refused(settings, text):
    with pytest.raises(native.InvalidArgumentError, match=text):
        native.flatten(*hill(4), **settings)


def test_cancel():
    job = native.Job()
    job.cancel()
    with pytest.raises(native.Cancelled):
        native.flatten(*hill(), job=job)
    job, errors = native.Job(), []

    def run():
        try:
            native.flatten(*hill(60), landmark_fraction=1.0, job=job)
        except native.Cancelled as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    job.cancel()
    thread.join(20)
    assert not thread.is_alive() and len(errors) == 1 and job.is_cancelled()
