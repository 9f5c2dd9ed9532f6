"""The comparison table, as text."""

COLUMNS = (
    ("charts", "charts", "{:.0f}"),
    ("stretch", "l2", "{:.3f}"),
    ("worst", "l2_worst_chart", "{:.3f}"),
    ("overlaps", "overlaps", "{:.0f}"),
    ("flips", "flips", "{:.0f}"),
    ("seams", "seam_length", "{:.2f}"),
    ("gap px", "gap_texels", "{:.1f}"),
    ("used", "packing_efficiency", "{:.1%}"),
    ("seconds", "seconds_total", "{:.2f}"),
)
LABELS = {
    "ble_unwrap": "BLE Unwrap",
    "smart_uv_best": "Smart UV, best",
    "smart_uv_default": "Smart UV",
    "xatlas": "xatlas",
}


def label(name, row):
    return f"{LABELS[name]} {row['angle']}°" if "angle" in row else LABELS[name]


def table(models):
    """Lines for {model: {method: measurement}}, numbers under each other."""
    lines = [["model", "method", *(title for title, _, _ in COLUMNS)]]
    for model, rows in models.items():
        for number, (name, row) in enumerate(rows.items()):
            cells = [text.format(row[key]) if row.get(key) is not None else "-" for _, key, text in COLUMNS]
            lines.append([model if number == 0 else "", label(name, row), *cells])
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    texts = []
    for line in lines:
        left = [line[k].ljust(widths[k]) for k in range(2)]
        texts.append("  ".join(left + [line[k].rjust(widths[k]) for k in range(2, len(line))]).rstrip())
    texts.insert(1, "-" * max(map(len, texts)))
    return texts


def caption(name, row):
    """Two short lines about one layout."""
    charts = f"{row['charts']} chart{'' if row['charts'] == 1 else 's'}"
    return [
        label(name, row),
        f"{charts}, stretch {row['l2']:.3f}, {row['overlaps']} overlaps, {100 * row['packing_efficiency']:.0f}% used",
    ]
