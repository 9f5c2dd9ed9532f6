"""Judging the map of a cloud: a certificate, one line, and the lines of the panel. For surfaces, see engine.py."""

import numpy as np

from .engine import STRETCH_SLACK, Certificate, number_text


def measured(result, written, held, positions):
    """The native report with what is counted from the UVs that Blender holds, (n, 2) float32.

    `points_lost` are mapped points whose UVs are not those that were written; `points_not_finite` are points without a
    place, which no map can hold.
    """
    mapped = result.chart >= 0
    kept = (held == written).all(axis=1)
    return {
        **result.report,
        "points": len(held),
        "points_mapped": int(mapped.sum()),
        "points_unmapped": int((~mapped).sum()),
        "points_not_finite": int((~np.isfinite(positions).all(axis=1)).sum()),
        "points_lost": int((mapped & ~kept).sum()),
    }


def certify(found, *, stretch_limit=None, warnings=()):
    """Judges a cloud's measurement. Stray points, which are in no piece, are a note and no violation."""
    certificate = Certificate(found, warnings=list(warnings))
    if found["points_lost"]:
        certificate.violations.append(f"{found['points_lost']:,} points do not hold the UVs that were computed")
    if found["points_not_finite"]:
        certificate.violations.append(f"{_points(found['points_not_finite'])} without UVs: not finite")
    if not found["points_mapped"]:
        certificate.violations.append("no point has UVs")
    worst = found.get("l2_worst_chart")
    if stretch_limit is not None and worst is not None and worst > stretch_limit + STRETCH_SLACK:
        certificate.violations.append(f"worst chart has stretch {worst:.3f}, limit is {stretch_limit:g}")
    for key, text in (("flips", "flipped triangles"), ("overlaps", "overlapping pairs of triangles")):
        if found.get(key):
            certificate.violations.append(f"{found[key]} {text} between neighbours")
    strays = found["points_unmapped"] - found["points_not_finite"]
    if strays > 0:
        certificate.warnings.append(f"{_points(strays)} without UVs: too far from the others")
    return certificate


def summary(found, seconds=None):
    """One line about the map of a cloud."""
    parts = [
        _points(found["points"]),
        f"{_charts(found)}",
        f"stretch {number_text(found.get('l2'))} (worst chart {number_text(found.get('l2_worst_chart'))})",
    ]
    if found["points_unmapped"]:
        parts.append(f"{found['points_unmapped']:,} without UVs")
    if found.get("packing_efficiency") is not None:
        parts.append(f"{100 * float(found['packing_efficiency']):.0f}% used")
    if seconds is not None:
        parts.append(f"{seconds:.1f} s")
    return ", ".join(parts)


def lines(certificate, *, stretch_limit, attribute):
    """The certificate for display: (status, text), status one of OK, BAD, WARN, INFO."""
    found = certificate.measured
    worst = found.get("l2_worst_chart")
    stretch_ok = worst is not None and worst <= stretch_limit + STRETCH_SLACK
    result = [
        ("INFO", f"{_points(found['points'])} in {_charts(found)}"),
        ("OK" if stretch_ok else "BAD", f"Stretch {number_text(found.get('l2'))}, worst chart {number_text(worst)}"),
    ]
    if found["points_lost"] or found["points_not_finite"]:
        result.append(("BAD", f"{_points(found['points_lost'] + found['points_not_finite'])} without UVs"))
    if found.get("packing_efficiency") is not None:
        result.append(("INFO", f"{100 * float(found['packing_efficiency']):.1f}% of the texture used"))
    result.append(("INFO", f"In attribute {attribute}"))
    return result + [("WARN", text) for text in certificate.warnings]


def _points(count):
    return f"{count:,} point{'' if count == 1 else 's'}"


def _charts(found):
    charts = int(found.get("charts") or 0)
    return f"{charts:,} chart{'' if charts == 1 else 's'}"
