"""xatlas beside us on a dozen generated meshes: one yardstick for both, which says of xatlas what it says of itself.

Its settings are its defaults, at our margin and texture size. Ours are the defaults but for the stretch limit, which
is so low that the mean stretch is no higher than that of xatlas: what is compared is how many charts and how long
seams that takes.
"""

import sys
from pathlib import Path

import ble_unwrap_native as native
import numpy as np
import peer_meshes
import pytest

SCRIPTS = Path(__file__).resolve().parent.parent / "blender_scripts"
sys.path.append(str(SCRIPTS))

import xatlas_peer  # noqa: E402

MARGIN, TEXTURE_SIZE = 4, 1024
# L2 stretch of each of our charts at most, see above.
LIMIT = 1.006
# Of these, what xatlas says of itself is compared with what we measure, without a margin, which it counts as used.
MEASURED = ("sculpt", "gear", "table", "vase", "soup", "terrain")


def triangles_of(mesh):
    """A mesh as triangles alone, which is all that xatlas knows: the arrays of the native module."""
    triangles = np.ascontiguousarray(mesh.triangles(), np.int32)
    return mesh.positions, triangles.ravel(), np.arange(0, triangles.size + 1, 3, dtype=np.int32)


def by_xatlas(arrays, margin):
    """What xatlas made, and our measurement of it."""
    positions, corners, _ = arrays
    peer = xatlas_peer.unwrap(positions, corners, margin=margin, texture_size=(TEXTURE_SIZE, TEXTURE_SIZE), timeout=60)
    return peer, native.measure(*arrays, peer.uv, texture_size=peer.texture_size, margin=margin)


@pytest.fixture(scope="module")
def both():
    """For each of the dozen our measurement of our layout and of that by xatlas."""
    found = {}
    for name, make in peer_meshes.DOZEN.items():
        arrays = triangles_of(make())
        atlas = native.unwrap(*arrays, stretch_limit=LIMIT, margin=MARGIN, texture_size=TEXTURE_SIZE)
        ours = native.measure(*arrays, atlas.uv, texture_size=TEXTURE_SIZE, margin=MARGIN)
        found[name] = ours, by_xatlas(arrays, MARGIN)[1]
    return found


def geometric_mean(values):
    return float(np.exp(np.mean(np.log(values))))


def border_texels(uv, texture_size):
    """Length of the borders of all charts in texels: edges of the UV triangles that no other shares."""
    texels = uv.astype(float) * texture_size
    _, vertex = np.unique(uv, axis=0, return_inverse=True)
    edges = np.arange(len(uv)).reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, count = np.unique(
        np.sort(vertex.reshape(-1)[edges], axis=1), axis=0, return_index=True, return_counts=True
    )
    ends = texels[edges[first[count == 1]]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


@pytest.mark.parametrize("name", MEASURED)
def test_we_say_of_xatlas_what_it_says(name):
    """As many charts; and as much of the texture used, where it counts each texel that a chart reaches, with those that
    bilinear filtering reaches beyond: up to about a texel and a half along the border, on both sides of a corner."""
    peer, measured = by_xatlas(triangles_of(peer_meshes.DOZEN[name]()), margin=0)
    assert measured["charts"] == peer.charts
    texels = peer.texture_size[0] * peer.texture_size[1]
    border = border_texels(peer.uv, peer.texture_size)
    reached = (peer.utilization - measured["packing_efficiency"]) * texels
    assert 0.5 * border < reached < 1.5 * border + 9 * peer.charts


def test_a_uv_divided_by_width_and_height_is_measured_in_texels():
    """The size of its texture is part of what xatlas returns: by another one the same layout is stretched."""
    arrays = triangles_of(peer_meshes.shapes.rectangle())
    peer, measured = by_xatlas(arrays, MARGIN)
    width, height = peer.texture_size
    assert max(width, height) > 2 * min(width, height), (
        "a rectangle of 3 by 1 is packed into one of its own proportions"
    )
    as_square = native.measure(*arrays, peer.uv, texture_size=TEXTURE_SIZE, margin=MARGIN)
    assert measured["l2"] == pytest.approx(1, abs=1e-3) and as_square["l2"] > 1.25


def test_ours_hold_what_is_promised(both):
    for name, (ours, theirs) in both.items():
        assert (ours["flips"], ours["overlaps"], ours["unmapped_faces"]) == (0, 0, 0), name
        assert ours["l2_worst_chart"] <= LIMIT + 1e-3, name
        assert min(ours["gap_texels"], theirs["gap_texels"]) >= MARGIN - 0.01, name


def test_fewer_charts_and_shorter_seams_at_no_more_stretch(both):
    """In the mean over the dozen, each mesh counting alike."""
    ours, theirs = zip(*both.values(), strict=True)
    mean = {
        key: [geometric_mean([figures[key] for figures in side]) for side in (ours, theirs)]
        for key in ("l2", "charts", "packing_efficiency")
    }
    seams = [
        (a["seam_length"], b["seam_length"]) for a, b in both.values() if min(a["seam_length"], b["seam_length"]) > 0
    ]
    mean["seam_length"] = [geometric_mean(side) for side in zip(*seams, strict=True)]
    for name, (a, b) in both.items():
        print(f"{name:14}", *(f"{key} {a[key]:.4g} {b[key]:.4g}" for key in (*mean, "overlaps", "flips")), sep="  ")
    print(mean)
    assert mean["l2"][0] <= mean["l2"][1]
    assert mean["charts"][0] < 0.3 * mean["charts"][1]
    assert mean["seam_length"][0] < 0.5 * mean["seam_length"][1]


# The process that xatlas runs in --------------------------------------------------------------------------------------


TRIANGLE = np.eye(3), [[0, 1, 2]]


def with_module(tmp_path, monkeypatch, text):
    """Puts a module in the place of xatlas."""
    (tmp_path / "xatlas.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("raise ImportError", "is not installed"),
        ("import os; os.abort()", "exit code -6"),
        ("raise RuntimeError('too bad')", "too bad"),
        ("import time; time.sleep(30)", "not done after 1 s"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="aborts otherwise there")
def test_what_happens_to_xatlas_is_said(tmp_path, monkeypatch, text, message):
    with_module(tmp_path, monkeypatch, text)
    with pytest.raises(xatlas_peer.Unavailable, match=message):
        xatlas_peer.unwrap(*TRIANGLE, margin=4, texture_size=(64, 64), timeout=1 if "sleep" in text else 60)


def test_vertices_that_are_not_finite_never_reach_xatlas():
    positions = np.concatenate([np.eye(3), [[np.nan, 0, 0]]])
    peer = xatlas_peer.unwrap(positions, [[0, 1, 2], [1, 2, 3]], margin=2, texture_size=(64, 64))
    assert np.isfinite(peer.uv[:3]).all() and np.isnan(peer.uv[3:]).all() and peer.charts == 1


def test_library_for_pythons_without_xatlas_goes_after_what_is_installed(tmp_path, monkeypatch):
    (tmp_path / "xatlas.py").write_text("raise SystemExit(77)")
    monkeypatch.setenv(xatlas_peer.LIBRARY, str(tmp_path))
    assert xatlas_peer.unwrap(*TRIANGLE, margin=2, texture_size=(64, 64)).charts == 1
