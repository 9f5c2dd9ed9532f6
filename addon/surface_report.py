"""Judging the atlas of surfaces: a certificate, one line, and the lines of the panel. For clouds: cloud_report.py."""

import numpy as np

from .certificate import STRETCH_SLACK, Certificate
from .wording import counted, number_text

MARGIN_SLACK_TEXELS = 0.01  # what float32 coordinates cannot express
# Gaps are searched for up to this distance, or twice the margin: what is reported at that value may be larger.
SEARCHED_TEXELS = 8


def certify(measured, *, margin, stretch_limit=None, limit_over="CHART", warnings=()):
    """Judges a measurement against what was promised."""
    certificate = Certificate(measured, warnings=list(warnings))
    if measured.get("overlaps"):
        certificate.violations.append(counted(measured["overlaps"], "overlapping pair") + " of faces")
    if measured.get("flips"):
        certificate.violations.append(counted(measured["flips"], "flipped face"))
    if measured.get("unmapped_faces"):
        certificate.violations.append(counted(measured["unmapped_faces"], "face") + " without UVs")
    gap = measured.get("gap_texels")
    # Asked the way round in which what could not be measured, NaN, does not pass.
    if gap is not None and measured.get("charts", 0) > 1 and not gap >= margin - MARGIN_SLACK_TEXELS:
        certificate.violations.append(f"charts {gap:.2f} px apart, margin is {margin:g} px")
    limited, name = _limited(measured, limit_over)
    if stretch_limit is not None and limited is not None and not limited <= stretch_limit + STRETCH_SLACK:
        found = "a stretch that could not be measured" if np.isnan(limited) else f"stretch {limited:.3f}"
        certificate.violations.append(f"{name} has {found}, limit is {stretch_limit:g}")
    return certificate


def _limited(measured, limit_over):
    """The stretch that the limit is for, and whose it is."""
    if limit_over == "ATLAS":
        return measured.get("l2_chart_scale"), "the atlas"
    return measured.get("l2_worst_chart"), "worst chart"


def summary(measured, seconds=None):
    """One line about a measurement."""
    parts = [
        counted(measured.get("charts"), "chart") + (f" ({text})" if (text := _stacks_text(measured)) else ""),
        f"stretch {number_text(measured.get('l2'))} (worst chart {number_text(measured.get('l2_worst_chart'))})",
        _overlaps_text(measured),
        counted(measured.get("flips"), "flip"),
        f"{100 * float(measured.get('packing_efficiency') or 0):.0f}% used",
    ]
    if seconds is not None:
        parts.append(f"{seconds:.1f} s")
    return ", ".join(parts)


def _used_text(measured):
    """How much of the texture, or of its tiles, is used, and at which texel density."""
    tiles = int(measured.get("tiles") or 1)
    of = "the texture" if tiles == 1 else f"{tiles} tiles"
    text = f"{100 * float(measured.get('packing_efficiency') or 0):.1f}% of {of} used"
    density = measured.get("texels_per_unit")
    return f"{text}, {float(f'{density:.4g}'):.10g} px per unit of length" if density else text


def _overlaps_text(measured):
    """The overlaps, also with faces that were not unwrapped: of these there is no promise, so they are always told."""
    overlaps, kept = counted(measured.get("overlaps"), "overlap"), measured.get("overlaps_with_kept")
    if kept is None:
        return overlaps
    return f"{overlaps}, {f'{kept:,}' if kept else 'none'} with faces that were not unwrapped"


def _stacks_text(measured):
    """How many charts lie on each other, if any do."""
    stacked = measured.get("stacked")
    return f"{stacked:,} in {counted(measured.get('stacks'), 'stack')}" if stacked else ""


def found(report):
    """What was found on the meshes and made use of, a line each."""
    rungs = report.get("rungs", {})
    said = {
        "mirrored": lambda count: f"{counted(count, 'mirrored piece')}: seams on one half are those of the other",
        "copied": lambda count: f"{counted(count, 'piece')} with the map of another one like them",
        "straighten": lambda count: f"{counted(count, 'chart')} with sides laid along the axes",
        "fold": lambda count: f"{counted(count, 'cut')} so that more of the texture is covered",
    }
    lines = [text(rungs[name]) for name, text in said.items() if rungs.get(name)]
    if snapped := report.get("snapped_charts"):
        lines.append(f"{counted(snapped, 'rectangle')} on whole texels")
    return lines


def lines(certificate, *, margin, stretch_limit, limit_over="CHART", notes=(), length_text="{:.4g}".format):
    """The certificate for display: (status, text), status one of OK, BAD, WARN, INFO.

    `notes` say what was done besides; `length_text` writes a length of the scene with its unit.
    """
    measured = certificate.measured
    charts = int(measured.get("charts") or 0)
    worst, gap = measured.get("l2_worst_chart"), measured.get("gap_texels")
    limited, _ = _limited(measured, limit_over)
    stretch_ok = limited is not None and limited <= stretch_limit + STRETCH_SLACK
    gap_ok = charts < 2 or gap is None or gap >= margin - MARGIN_SLACK_TEXELS
    overlaps, flips, unmapped = (int(measured.get(key) or 0) for key in ("overlaps", "flips", "unmapped_faces"))
    with_kept = measured.get("overlaps_with_kept")
    result = [
        ("INFO", f"{counted(measured.get('faces'), 'face')} in {counted(charts, 'chart')}"),
        ("OK" if stretch_ok else "BAD", f"Stretch {number_text(measured.get('l2'))}, worst chart {number_text(worst)}"),
        ("BAD" if overlaps else "WARN" if with_kept else "OK", _overlaps_text(measured)),
        ("BAD" if flips else "OK", counted(flips, "flipped face")),
    ]
    if text := _stacks_text(measured):
        result.insert(1, ("INFO", f"{text}: they share their pixels"))
    if charts > 1 and gap is not None:
        least = "≥ " if gap >= max(SEARCHED_TEXELS, 2 * margin) else ""
        result.append(("OK" if gap_ok else "BAD", f"Charts {least}{gap:.1f} px apart (margin {margin:g} px)"))
    if unmapped:
        result.append(("BAD", f"{counted(unmapped, 'face')} without UVs"))
    result.append(("INFO", _used_text(measured)))
    if measured.get("seam_length_absolute") is not None:
        result.append(("INFO", f"Seams {length_text(float(measured['seam_length_absolute']))} long"))
    return result + [("INFO", text) for text in notes] + [("WARN", text) for text in certificate.warnings]
