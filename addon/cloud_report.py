"""Judging the map of a cloud: a certificate, one line, and the lines of the panel. For surfaces: surface_report.py."""

from .certificate import STRETCH_SLACK, Certificate
from .wording import counted, number_text


def measured(result, written, held):
    """The native report with what is counted from the UVs that Blender holds, (n, 2) float32.

    `points_unmapped` are in no chart, since their coordinates are not finite; `points_lost` are mapped, but hold other
    UVs than those that were written.
    """
    mapped = result.chart >= 0
    kept = (held == written).all(axis=1)
    return {
        **result.report,
        "points": len(held),
        "points_mapped": int(mapped.sum()),
        "points_unmapped": int((~mapped).sum()),
        "points_lost": int((mapped & ~kept).sum()),
    }


def certify(found, *, stretch_limit=None, warnings=()):
    """Judges a cloud's measurement. Folds and overlaps are notes: what the surface is, a cloud does not quite say."""
    certificate = Certificate(found, warnings=list(warnings))
    if found["points_lost"]:
        certificate.violations.append(f"{points_text(found['points_lost'])} without the UVs that were computed")
    if found["points_unmapped"]:
        certificate.violations.append(f"{points_text(found['points_unmapped'])} without UVs: not finite")
    worst = found.get("l2_worst_chart")
    if stretch_limit is not None and worst is not None and not worst <= stretch_limit + STRETCH_SLACK:
        certificate.violations.append(f"worst chart has stretch {worst:.3f}, limit is {stretch_limit:g}")
    return certificate


def summary(found, seconds=None):
    """One line about the map of a cloud."""
    parts = [
        points_text(found["points"]),
        counted(found.get("charts"), "chart"),
        f"stretch {number_text(found.get('l2'))} (worst chart {number_text(found.get('l2_worst_chart'))})",
    ]
    for key, word in (("overlaps", "overlap"), ("folded_points", "folded point")):
        if found.get(key):
            parts.append(counted(found[key], word))
    if found["points_unmapped"]:
        parts.append(f"{points_text(found['points_unmapped'])} without UVs")
    parts.append(f"{100 * float(found.get('packing_efficiency') or 0):.0f}% used")
    if seconds is not None:
        parts.append(f"{seconds:.1f} s")
    return ", ".join(parts)


def lines(certificate, *, stretch_limit, attribute):
    """The certificate for display: (status, text), status one of OK, BAD, WARN, INFO."""
    found = certificate.measured
    worst = found.get("l2_worst_chart")
    stretch_ok = worst is not None and worst <= stretch_limit + STRETCH_SLACK
    without = found["points_lost"] + found["points_unmapped"]
    pieces, charts = counted(found.get("pieces"), "piece"), counted(found.get("charts"), "chart")
    result = [
        ("INFO", f"{points_text(found['points'])}, {pieces}, {charts}"),
        ("OK" if stretch_ok else "BAD", f"Stretch {number_text(found.get('l2'))}, worst chart {number_text(worst)}"),
        ("BAD" if without else "OK", f"{points_text(without)} without UVs"),
    ]
    if not found.get("overlaps") and not found.get("folded_points"):
        result.append(("OK", "0 overlaps, 0 folded points"))  # else the native module's warning says it
    result.append(("INFO", f"{100 * float(found.get('packing_efficiency') or 0):.1f}% of the texture used"))
    result.append(("INFO", f"In attribute {attribute}"))
    return result + [("WARN", text) for text in certificate.warnings]


def points_text(count):
    return counted(count, "point")
