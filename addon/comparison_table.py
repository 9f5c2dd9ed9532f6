"""Two measurements of the same meshes side by side, in words. Knows nothing of Blender."""

import numpy as np

from .check_report import percent
from .wording import counted


def rows(measured, seconds, *, length_text):
    """The rows of a table: a label, and a text for each of the measurements.

    `length_text` writes a length of the scene with its unit; `seconds` are those that each took.
    """
    return [
        ("Islands", *(f"{int(one['islands']):,}" for one in measured)),
        ("Seams", *(_length(one, length_text) for one in measured)),
        ("Stretch", *(percent(one["l2_chart_scale"]) for one in measured)),
        ("Worst island", *(percent(one["l2_worst_chart"]) for one in measured)),
        ("Texture used", *(_used(one) for one in measured)),
        ("Overlapping", *(_overlaps(one) for one in measured)),
        ("Flipped", *(counted(len(one["flipped_faces"]), "face") for one in measured)),
        ("Seconds", *(f"{taken:.2f}" if taken < 10 else f"{taken:,.0f}" for taken in seconds)),
    ]


def _length(measured, length_text):
    length = float(measured["seam_length_absolute"])
    return length_text(length) if np.isfinite(length) else "?"


def _used(measured):
    used = float(measured["packing_efficiency"])
    return f"{100 * used:.0f} %" if np.isfinite(used) else "?"


def _overlaps(measured):
    least = "" if measured["overlaps_complete"] else "≥ "
    return f"{least}{counted(len(measured['overlapping_faces']), 'face')}"
