"""What `make quality` found: means over shuffles, geometric means over models, and a table of both."""

import math

# Column -> key of a run, and how its figure is written.
COLUMNS = {
    "charts": ("charts", "{:.2f}"),
    "L2": ("l2", "{:.4f}"),
    "worst chart": ("l2_worst_chart", "{:.4f}"),
    "L∞": ("l_infinity", "{:.2f}"),
    "most L∞": ("most_l_infinity", "{:.2f}"),
    "seam": ("seam_length", "{:.3f}"),
    "packing": ("packing_efficiency", "{:.4f}"),
    "CPU s": ("cpu", "{:.3f}"),
}
MEANS = [key for key, _ in COLUMNS.values() if key != "most_l_infinity"]


def row(name, triangles, runs):
    """The row of a model: of its runs, one a shuffle, the charts one by one, the means, and what must be 0 in all."""
    found = {key: sum(run[key] for run in runs) / len(runs) for key in MEANS}
    return {
        "name": name,
        "triangles": triangles,
        "of_each": [run["charts"] for run in runs],
        **found,
        "most_l_infinity": max(run["l_infinity"] for run in runs),
        "bad": sum(run["flips"] + run["overlaps"] for run in runs),
    }


def geometric_mean(values):
    """Of the values above 0: an open sheet in one chart has no seam. None if there are none."""
    logarithms = [math.log(value) for value in values if value > 0]
    return math.exp(sum(logarithms) / len(logarithms)) if logarithms else None


def total(rows):
    """The last row: geometric means of the models' figures, so that each counts alike; flips and overlaps added up."""
    means = {key: geometric_mean([row[key] for row in rows]) for key, _ in COLUMNS.values()}
    return {"name": "geometric mean", "bad": sum(row["bad"] for row in rows), **means}


def error_of_charts(rows):
    """Standard error of the geometric mean of the charts, as a share of it, by how they differ between shuffles.

    None with one shuffle, which tells nothing of it.
    """
    variance = 0.0
    for each in (row["of_each"] for row in rows):
        if len(each) < 2:
            return None
        mean = sum(each) / len(each)
        if mean > 0:
            of_one = sum((count - mean) ** 2 for count in each) / (len(each) - 1)
            variance += of_one / len(each) / mean**2
    return math.sqrt(variance) / len(rows) if rows else None


def table(rows):
    """Lines of text, numbers under each other: a row a model, those that failed with why, and the geometric means."""
    good = [row for row in rows if "failed" not in row]
    lines = [["model", "triangles", "charts of each", *COLUMNS, "flips+overlaps"]]
    for row in [*good, *([total(good)] if good else [])]:
        triangles = f"{row['triangles']:,}" if "triangles" in row else ""
        of_each = " ".join(map(str, row.get("of_each", [])))
        figures = ["-" if row[key] is None else text.format(row[key]) for key, text in COLUMNS.values()]
        lines.append([row["name"], triangles, of_each, *figures, str(row["bad"])])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    texts = ["  ".join([c[0].ljust(w[0]), *map(str.rjust, c[1:], w[1:])]) for c, w in ((c, widths) for c in lines)]
    rule = "-" * len(texts[0])
    texts.insert(1, rule)
    if good:
        texts.insert(-1, rule)
    return texts + [f"{row['name']}: failed: {row['failed']}" for row in rows if "failed" in row]
