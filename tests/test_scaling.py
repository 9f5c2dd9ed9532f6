"""`make scaling`: what it fits, reads and says, and that a process's memory is its own."""

import gzip
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
SCALING = ROOT / "native/evaluation/scaling"
sys.path.insert(0, str(SCALING))

import scaling_meshes  # noqa: E402
import scaling_report  # noqa: E402


def row(faces, family="sculpt", **more):
    given = {"name": f"{family} {faces}", "family": family, "faces": faces, "charts": 3, "wall": 1.0}
    return {**given, "cpu": 1e-6 * faces, "peak": 512.0 * faces, **more}


@pytest.mark.parametrize("power", [0.5, 1.0, 1.1, 2.0])
def test_slope_of_known_numbers(power):
    sizes = [1_000, 3_000, 10_000, 500_000]
    assert scaling_report.slope(sizes, [7e-5 * n**power for n in sizes]) == pytest.approx(power, abs=1e-12)


def test_slope_of_noisy_numbers():
    """A line through points that lie alternately a tenth above and below it is that line, nearly."""
    sizes = 1_000 * 2.0 ** np.arange(11)
    values = 1e-5 * sizes**1.1 * 1.1 ** (-1.0) ** np.arange(11)
    assert scaling_report.slope(sizes, values) == pytest.approx(1.1, abs=0.02)


def test_two_points_make_no_slope():
    assert scaling_report.slope([1_000, 2_000], [1.0, 2.0]) is None
    assert scaling_report.slope([1_000, 1_000, 2_000], [1.0, 1.1, 2.0]) is None
    assert scaling_report.slopes([row(1_000), row(2_000)]) == {}


def test_small_meshes_do_not_decide():
    """Fixed costs flatten the slope over all sizes; the sentence says both and judges by the large."""
    rows = [row(n, cpu=0.03 + 1e-6 * n**1.2) for n in (1_000, 4_000, 16_000, 64_000, 256_000, 1_024_000)]
    everywhere, large = scaling_report.slopes(rows)["sculpt"]["cpu"]
    assert everywhere < 1 < large
    said = scaling_report.verdicts(rows)
    assert f"power {everywhere:.2f}" in said[0] and f"{large:.2f} (aim: at most 1.1; " in said[0]
    assert said[0].endswith("NOT met)" if large > 1.1 else "; met)")


def test_verdict_on_memory():
    said = scaling_report.verdicts([row(1_000, peak=9e9), row(16_000), row(32_000, peak=48_000 * 1024)])
    assert said[-1].startswith("memory: at most 1.50 KiB a face from 16,000 faces on (sculpt 32000;")
    assert said[-1].endswith("NOT met)"), "small meshes do not count, large ones do"


def test_table_and_plot(tmp_path):
    rows = [row(n) for n in (1_000, 16_000, 64_000, 256_000)]
    rows += [
        row(871_414, "models", name="dragon"),
        {"name": "bad", "family": "models", "faces": 8, "failed": "no room"},
    ]
    lines = scaling_report.table(rows).splitlines()
    assert len(lines) == 2 + len(rows) and len({line.count("|") for line in lines}) == 1
    assert lines[2] == "| sculpt 1000 | 1,000 | 3 | 0.00 | 1.00 | 1 | 0.5 | 0.50 |"
    assert "no room" in lines[-1]
    page = scaling_report.page(rows, "a machine")
    assert "Measured on a machine." in page and "power 1.00" in page and "scaling.png" in page
    pytest.importorskip("matplotlib")
    scaling_report.plot(rows, tmp_path / "scaling.png")
    assert (tmp_path / "scaling.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("family", sorted(scaling_meshes.FAMILIES))
@pytest.mark.parametrize("faces", [1_000, 5_000])
def test_families(family, faces):
    """Closed, oriented, and about as many triangles as was asked for."""
    mesh = scaling_meshes.FAMILIES[family](faces)
    assert abs(scaling_meshes.triangle_count(mesh) / faces - 1) < 0.1
    edges = np.concatenate([np.stack([p, np.roll(p, -1)], axis=1) for p in mesh.polygons()])
    forward = {tuple(edge) for edge in edges.tolist()}
    assert len(forward) == len(edges) and all((b, a) in forward for a, b in forward)
    pieces = {"sculpt": 1, "parts": round(faces / 972)}[family]
    assert len(mesh.positions) - len(edges) // 2 + len(mesh.face_offsets) - 1 == 2 * pieces, "Euler: that many spheres"


TEXT_HEADER = """ply
format {kind} 1.0
comment a pyramid with a square base
element vertex 5
property float x
property float y
property float z
property uchar red
element face 5
property list uchar int vertex_indices
end_header
"""
POINTS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 1, 1.5)]
FACES = [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]


def ply(kind, faces=FACES):
    header = TEXT_HEADER.format(kind=kind).replace("face 5", f"face {len(faces)}").encode()
    if kind == "ascii":
        lines = [f"{x} {y} {z} 255" for x, y, z in POINTS] + [f"{len(f)} {' '.join(map(str, f))}" for f in faces]
        return header + "\n".join(lines).encode() + b"\n"
    order = "<" if kind == "binary_little_endian" else ">"
    points = np.array([(*p, 255) for p in POINTS], [(k, order + "f4") for k in "xyz"] + [("red", "u1")])
    return header + points.tobytes() + b"".join(bytes([len(f)]) + np.array(f, order + "i4").tobytes() for f in faces)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("faces", [FACES, FACES[1:]], ids=["mixed", "triangles"])
def test_ply(tmp_path, kind, faces):
    path = tmp_path / "pyramid.ply.gz"
    path.write_bytes(gzip.compress(ply(kind, faces)))
    mesh = scaling_meshes.read(path)
    assert mesh.name == "pyramid"
    assert np.array_equal(mesh.positions, np.array(POINTS, float))
    assert [tuple(p) for p in mesh.polygons()] == faces
    assert scaling_meshes.triangle_count(mesh) == sum(len(f) - 2 for f in faces)


def test_what_cannot_be_read_is_named(tmp_path):
    for name, data in (("a.stl", b"solid"), ("b.ply", b"no header"), ("c.ply", ply("ascii").replace(b"ascii", b"odd"))):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ValueError, match=name.split(".")[0]):
            scaling_meshes.read(tmp_path / name)


def test_a_run_has_memory_of_its_own(tmp_path):
    """The process that starts it holds much; that must not show, as getrusage would have it."""
    held = np.ones(40_000_000)
    mesh = scaling_meshes.sculpt(1_000)
    for name in ("positions", "corner_vertices", "face_offsets"):
        np.save(tmp_path / f"{name}.npy", getattr(mesh, name))

    def run(*arguments):
        command = [sys.executable, SCALING / "one_run.py", tmp_path, "--threads", "1", *arguments]
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    empty, full = run("--empty"), run()
    assert held.nbytes > 300e6
    if sys.platform == "linux":
        assert empty["peak"] < 200e6
    assert full["charts"] >= 1 and full["flips"] == full["overlaps"] == 0
    assert full["peak"] > empty["peak"] and full["cpu"] > empty["cpu"]


def command(*arguments):
    line = [sys.executable, SCALING, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, check=False, timeout=300)


def test_whole_program(tmp_path):
    """Sizes, a model and a file that is no mesh: everything is written, and the exit code tells of the failure."""
    pytest.importorskip("matplotlib")
    (tmp_path / "pyramid.ply").write_bytes(ply("ascii"))
    (tmp_path / "empty.obj").write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    out = tmp_path / "out"
    done = command("--largest", 1000, "--threads", 1, "-o", out, tmp_path / "pyramid.ply", tmp_path / "empty.obj")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    rows = json.loads((out / "scaling.json").read_text())
    assert [r["name"] for r in rows] == ["sculpt 1000", "parts 1000", "pyramid", "empty"]
    assert [r["faces"] for r in rows] == [972, 972, 6, 1]
    assert "failed" in rows[3] and all(r["cpu"] > 0 and r["peak"] > 0 for r in rows[:3])
    assert "| pyramid | 6 |" in (out / "README.md").read_text() and (out / "scaling.png").is_file()


@pytest.mark.parametrize("wrong", [["--largest", 10], ["--threads", -1], ["none.obj"], ["--largest", "many"]])
def test_wrong_arguments(wrong, tmp_path):
    done = command("-o", tmp_path / "out", *wrong)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
