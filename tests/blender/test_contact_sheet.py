"""The contact sheet: cells, rows, captions, and the whole script on two small meshes."""

import json

import bpy
import contact_sheet
import contact_sheet_inside as inside
import numpy as np
import pictures
import pytest
from scenes import cube, sphere

MEASURED = {
    "charts": 1, "faces": 12946, "flips": 0, "overlaps": 3, "l2": 1.0271, "l2_worst_chart": 1.0382, "l_infinity": 2.234,
    "seam_length": 2.321, "packing_efficiency": 0.6472,
}  # fmt: skip


def test_caption():
    name, counts, figures = inside.caption("fandisk", MEASURED, 0.519)
    assert name == "fandisk"
    assert counts == "12,946 faces, 1 chart, 0.52 s, 3 overlaps"
    assert figures == "stretch 1.027, worst chart 1.038, L-infinity 2.23, seams 2.32, 64.7% used"


def test_a_caption_fits_its_cell():
    """The longest line there may be, in the smallest letters, over the pictures of the usual size."""
    line = inside.caption(
        "a", {**MEASURED, "charts": 1234, "faces": 1_234_567, "flips": 12, "l_infinity": 123.45}, 999.9
    )
    room = 3 * inside.SIZE + 2 * inside.GAP
    assert max(pictures.text_width(text, inside.TEXT_SIZE) for text in line[1:]) <= room


def plain(height, width, colour):
    return np.full((height, width, 3), colour, np.uint8)


def test_titled():
    cell = inside.titled([plain(40, 40, 200), plain(40, 40, 100)], ["AB", "C"], gap=5)
    head = inside.head_height(2)
    assert cell.shape == (head + 40, 85, 3)
    assert (cell[head:, :40] == 200).all() and (cell[head:, 45:] == 100).all()
    assert (cell[head:, 40:45] == pictures.BACKGROUND).all()
    written = (cell[:head] != pictures.BACKGROUND).any(axis=2)
    first = inside.head_height(1) - 4
    assert written[:first].any() and written[first:].any()


def test_titled_cuts_off_what_is_too_long():
    cell = inside.titled([plain(8, 100, 0)], ["W" * 99])
    assert cell.shape[1] == 100
    assert (cell[:-8, 99] == pictures.BACKGROUND).all(), "no half letter at the edge"
    assert (cell[:-8] != pictures.BACKGROUND).any()


@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 3, 1), (3, 3, 1), (4, 3, 2), (7, 2, 4)])
def test_sheet(count, columns, rows):
    cells = [plain(30, 400, 60 + number) for number in range(count)]
    sheet = inside.sheet(cells, columns, gap=4)
    across = min(columns, count)
    legend = pictures.legend(across * 408).shape[0]
    assert sheet.shape == (rows * 38 + legend + 4, across * 408, 3)
    for number in range(count):
        top, left = 38 * (number // across) + 4, 408 * (number % across) + 4
        assert (sheet[top : top + 30, left : left + 400] == 60 + number).all()
    assert (sheet[-legend - 4 : -4] == pictures.legend(across * 408)).all()


def test_development_models(tmp_path):
    assert contact_sheet.development_models(tmp_path / "none") == []
    for name, size in (("b.obj", 9), ("a.obj", 9), ("large.obj", 99), ("dragon.ply.gz", 1)):
        (tmp_path / name).write_bytes(size * b"#")
    assert [path.name for path in contact_sheet.development_models(tmp_path)] == ["a.obj", "b.obj", "large.obj"]


def test_whole_sheet(run_script, files, tmp_path):
    """Two meshes and a file that is none."""
    cube()
    first = files("box.obj")
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    sphere()
    second = files("ball.obj")
    (tmp_path / "broken.obj").write_text("v 0 0 0\n")
    done = run_script(
        "contact_sheet_inside.py", first, second, "broken.obj", "-o", "sheet.png", "--size", "200", "--columns", "2"
    )
    assert done.returncode == 1, done.stdout
    assert "Traceback" not in done.stdout and "[3/3] broken: failed" in done.stdout
    report = json.loads((tmp_path / "sheet.json").read_text())
    assert set(report["models"]) == {"box", "ball"} and set(report["failed"]) == {"broken"}
    assert report["models"]["box"]["overlaps"] == 0 and report["models"]["box"]["seconds_total"] > 0
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".sheet")], "no render is left behind"
    image = bpy.data.images.load(str(tmp_path / "sheet.png"))
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, -1)[::-1, :, :3]
    cell = 3 * 200 + 2 * inside.GAP
    assert width == 2 * (cell + 2 * inside.GAP)
    assert pictures.read_png(tmp_path / "sheet.png").shape == (height, width, 3)
    head = inside.head_height(3) + inside.GAP
    for number in range(2):
        left = number * (cell + 2 * inside.GAP) + inside.GAP
        first, second, layout = (pixels[head : head + 200, left + k * (200 + inside.GAP) :][:, :200] for k in range(3))
        for render in (first, second):
            corner, middle = render[:8, :8].reshape(-1, 3), render[70:130, 70:130].reshape(-1, 3)
            assert corner.mean() > 0.3 and np.ptp(corner, axis=0).max() < 0.1, "an even background, not black"
            assert np.ptp(middle, axis=0).max() > 0.15, "the checker shows"
        assert np.abs(first - second).max() > 0.2, "two sides of the model"
        layout = layout.reshape(-1, 3)
        empty = np.abs(layout - pictures.EMPTY / 255).max(axis=1) < 0.01
        assert 0.2 < 1 - empty.mean() < 0.95, "charts are drawn, and room is left between"


def test_smart_as_well(run_script, files, tmp_path):
    cube()
    source = files("box.obj")
    done = run_script("contact_sheet_inside.py", source, "-o", "sheet.png", "--size", "160", "--compare", "smart")
    assert done.returncode == 0, done.stdout
    assert pictures.read_png(tmp_path / "sheet.png").shape[1] == 4 * 160 + 3 * inside.GAP + 2 * inside.GAP


@pytest.mark.parametrize("wrong", [["--size", "8"], ["--columns", "0"], ["--compare", "other"]])
def test_wrong_arguments(run_script, wrong, tmp_path):
    done = run_script("contact_sheet_inside.py", "a.obj", "-o", "sheet.png", *wrong)
    assert done.returncode == 2 and "Traceback" not in done.stdout
    assert not (tmp_path / "sheet.png").exists()
