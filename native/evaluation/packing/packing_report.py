"""What `make packing` found: geometric means by class of size, and ratios to our own packer."""

import math

CLASSES = {"1-3": (1, 3), "4-9": (4, 9), "10-50": (10, 50), "51-300": (51, 300), "above": (301, 10**9)}


def geometric_mean(values):
    return math.exp(sum(map(math.log, values)) / len(values)) if values else None


def class_of(count):
    return next(name for name, (low, high) in CLASSES.items() if low <= count <= high)


def tables(rows, packers, base):
    """Lines of text: covered share, its ratio to that of `base`, and CPU seconds with theirs, by class and packer.

    A ratio is that over the sets that both packed. `rows` are pairs of a set's islands' number and {packer: Packed or
    None}.
    """
    lines = []
    for title, value, text in (
        ("covered share of the square, geometric mean (ratio to " + base + ")", lambda p: p.cover, "{:.4f}"),
        ("CPU seconds, geometric mean (ratio to " + base + ")", lambda p: max(p.cpu, 1e-4), "{:.3f}"),
    ):
        table = [[title, *(f"{name} ({_count(rows, name)})" for name in CLASSES)]]
        for packer in packers:
            cells = [packer]
            for name in CLASSES:
                of = [found for count, found in rows if class_of(count) == name]
                own = [value(found[packer]) for found in of if found.get(packer)]
                both = [found for found in of if found.get(packer) and found.get(base)]
                mean = geometric_mean(own)
                ratio = geometric_mean([value(found[packer]) / value(found[base]) for found in both])
                cell = "-" if mean is None else text.format(mean) + ("" if ratio is None else f" ({ratio:.3f})")
                cells.append(cell + (f" of {len(own)}" if own and len(own) < len(of) else ""))
            table.append(cells)
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines += ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in table] + [""]
    return lines


def _count(rows, name):
    return sum(class_of(count) == name for count, _ in rows)
