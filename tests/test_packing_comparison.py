"""`make packing`: that the check of layouts finds what is too near, and what the tables make of several packers."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

PACKING = Path(__file__).resolve().parent.parent / "native/evaluation/packing"
sys.path.insert(0, str(PACKING))

import packing_report  # noqa: E402

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def ring():
    """A square ring from 4 to 10 wide, as points and triangles."""
    points = np.concatenate([(2 * SQUARE - 1) * 5.0, (2 * SQUARE - 1) * 2.0])
    sides = [(k, (k + 1) % 4) for k in range(4)]
    return points, np.array([t for a, b in sides for t in ((a, b, 4 + a), (b, 4 + b, 4 + a))])


@pytest.fixture
def modules():
    pytest.importorskip("shapely")
    pytest.importorskip("ble_unwrap_native")
    import islands
    import layout_check

    return islands, layout_check


def test_gaps_are_those_of_outlines_and_holes_are_open(modules):
    islands, layout_check = modules
    square = islands.Island(SQUARE, np.array([[0, 1, 2], [0, 2, 3]]))
    around = islands.Island(*ring())
    assert [len(loop) for loop in around.loops] == [4, 4]
    assert np.ptp(around.points[around.loops[0]], axis=0).max() == 10
    assert around.area == 100 - 16
    both = [square, around]
    assert layout_check.least_gap(both, [SQUARE, around.points]) == pytest.approx(1.0)
    assert layout_check.least_gap(both, [SQUARE + 3, around.points]) == 0.0, "inside the ring's body"
    assert layout_check.least_gap(both, [SQUARE + np.array([4.5, 0]), around.points]) == 0.0, "across its side"
    assert layout_check.least_gap(both, [SQUARE + np.array([7.0, 0]), around.points]) == pytest.approx(2.0)


def test_layouts_are_scaled_to_the_square_with_half_a_margin_around(modules):
    islands, layout_check = modules
    square = islands.Island(SQUARE, np.array([[0, 1, 2], [0, 2, 3]]))
    placed, scale = layout_check.scaled_to_square([SQUARE * 3 + 7])
    low, high = placed[0].min(), placed[0].max()
    assert (low, high) == (layout_check.MARGIN / 2, layout_check.SIZE - layout_check.MARGIN / 2)
    assert scale == pytest.approx((layout_check.SIZE - layout_check.MARGIN) / 3)
    common, off = layout_check.rigid_scale([square, square], [SQUARE * 3, SQUARE * 3 + 9])
    assert (common, off) == (pytest.approx(3.0), pytest.approx(0.0))


def test_tables_compare_what_both_packers_did():
    def packed(cover, cpu):
        return SimpleNamespace(cover=cover, cpu=cpu)

    rows = [
        (2, {"ours": packed(0.6, 0.1), "other": packed(0.3, 0.2)}),
        (3, {"ours": packed(0.6, 0.1), "other": None}),
        (40, {"ours": packed(0.8, 0.1), "other": packed(0.8, 0.1)}),
    ]
    lines = packing_report.tables(rows, ["ours", "other"], "ours")
    of_other = next(line for line in lines if line.startswith("other"))
    assert "0.3000 (0.500) of 1" in of_other and "0.8000 (1.000)" in of_other
    assert packing_report.class_of(300) == "51-300" and packing_report.class_of(301) == "above"
    assert packing_report.geometric_mean([]) is None
