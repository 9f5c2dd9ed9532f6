"""What a check of UV maps says: a line for each figure, with the kind of fault that it is about."""

from dataclasses import dataclass

import numpy as np

from .certificate import STRETCH_SLACK
from .surface_report import MARGIN_SLACK_TEXELS, SEARCHED_TEXELS
from .wording import counted

# Islands whose pixels for each unit of length differ by more than this factor are told.
DENSITY_RATIO = 1.05


@dataclass(frozen=True)
class Line:
    """One figure; `kind` names the fault whose faces can be selected, and is empty where there are none."""

    status: str  # OK, BAD, WARN or INFO
    text: str
    kind: str = ""


def percent(stretch):
    """A stretch of 1 and more as the share by which lines are longer, or a question mark."""
    return f"{100 * max(stretch - 1, 0.0):.1f} %" if stretch is not None and np.isfinite(stretch) else "?"


def lines(measured, faults, *, margin, stretch_limit, length_text, density_of):
    """The lines of a measurement. `faults` are the numbers of faces with each kind of fault.

    `length_text` writes a length of the scene with its unit; `density_of` makes of pixels for each unit of length the
    number that is shown and the unit that it is in.
    """
    worst = measured["l2_worst_chart"]
    stretched = not worst <= stretch_limit + STRETCH_SLACK
    found = [
        Line("INFO", f"{counted(measured['faces'], 'face')} in {counted(measured['islands'], 'island')}"),
        Line(
            "BAD" if stretched else "OK",
            f"Stretch {percent(measured['l2_chart_scale'])}, worst island {percent(worst)}",
            "STRETCHED" if stretched and faults["STRETCHED"] else "",
        ),
        _overlaps(measured, faults["OVERLAPPING"]),
        _fault("FLIPPED", faults, "flipped face", "No flipped faces"),
    ]
    if faults["COLLAPSED"]:
        found.append(_fault("COLLAPSED", faults, "face", "", " without area in the map"))
    if faults["UNMAPPED"]:
        found.append(_fault("UNMAPPED", faults, "face", "", " without UVs"))
    if measured["mirrored"]:
        found.append(Line("WARN", counted(measured["mirrored"], "mirrored island"), "MIRRORED"))
    if measured["stacked"]:
        text = f"{measured['stacked']:,} islands share pixels in {counted(measured['stacks'], 'stack')}"
        found.append(Line("WARN", text, "STACKED"))
    if measured["islands"] > 1:
        found.append(_gap(measured, margin))
    found.append(_used(measured))
    if "density" in measured:
        found.append(_density(measured, density_of))
    return [*found, Line("INFO", f"Seams {length_text(float(measured['seam_length_absolute']))} long")]


def _fault(kind, faults, word, none, ending=""):
    count = faults[kind]
    return Line("BAD", counted(count, word) + ending, kind) if count else Line("OK", none)


def _overlaps(measured, faces):
    if not measured["overlaps"]:
        return Line("OK", "No overlaps")
    least = "" if measured["overlaps_complete"] else "at least "
    return Line(
        "BAD", f"{least}{counted(faces, 'face')} overlap{'s' if faces == 1 else ''}".capitalize(), "OVERLAPPING"
    )


def _gap(measured, margin):
    gap = measured["gap_texels"]
    enough = gap >= margin - MARGIN_SLACK_TEXELS  # not, too, where it could not be measured
    more = "≥ " if gap >= max(SEARCHED_TEXELS, 2 * margin) else ""
    return Line("OK" if enough else "WARN", f"Islands {more}{gap:.1f} px apart (margin {margin:g} px)")


def _used(measured):
    tiles = int(measured["tiles"])
    if not tiles:
        return Line("WARN", "Islands beyond the texture, or across tiles")
    of = "the texture" if tiles == 1 else f"{tiles} tiles"
    return Line("INFO", f"{100 * float(measured['packing_efficiency']):.0f} % of {of} used")


def _density(measured, density_of):
    middle, unit = density_of(measured["density"])
    low, high = measured["densities"]
    text = f"{_digits(middle)} {unit}"
    if high > DENSITY_RATIO * low:
        text += f", islands {_digits(density_of(low)[0])} to {_digits(density_of(high)[0])}"
    return Line("INFO", text)


def _digits(value):
    """Three digits of a number, by thousands."""
    return f"{float(f'{value:.3g}'):,.10g}"
