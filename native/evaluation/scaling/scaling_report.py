"""What `make scaling` found: slopes, a table and a plot."""

import numpy as np

# The aims, which are reported and never enforced: times are of the machine.
MOST_SLOPE = 1.1
MOST_KIB = 1.0
# Below, times are those of starting threads and of packing a handful of charts, whatever the mesh.
LARGE = 16_000
COLOURS = ("#1f77b4", "#d1661b", "#3a923a", "#8e5bb5")
KIB = 1024


def slope(sizes, values):
    """Power with which values grow with sizes: the least-squares slope in log-log. None for fewer than three sizes."""
    if len(set(sizes)) < 3:
        return None
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def slopes(rows):
    """{family: {"cpu" or "peak": (slope over all sizes, over the large ones)}} of families with three sizes or more."""
    found = {}
    for family in dict.fromkeys(row["family"] for row in rows):
        members = [row for row in rows if row["family"] == family and "cpu" in row]
        large = [row for row in members if row["faces"] >= LARGE]
        if len({row["faces"] for row in members}) >= 3:
            found[family] = {
                key: tuple(slope([r["faces"] for r in group], [r[key] for r in group]) for group in (members, large))
                for key in ("cpu", "peak")
            }
    return found


def verdicts(rows):
    """A sentence a family about the power of its times, and one about memory."""
    said = []
    for family, of in slopes(rows).items():
        everywhere, large = of["cpu"]
        said.append(f"{family}: CPU seconds grow with the power {everywhere:.2f} of the faces")
        if large is not None:
            said[-1] += f", from {LARGE:,} faces on with {large:.2f}"
        decisive = everywhere if large is None else large
        said[-1] += f" (aim: at most {MOST_SLOPE}; {'met' if decisive <= MOST_SLOPE else 'NOT met'})"
    measured = [row for row in rows if "cpu" in row and row["faces"] >= LARGE]
    if measured:
        worst = max(measured, key=lambda row: row["peak"] / row["faces"])
        kib = worst["peak"] / worst["faces"] / KIB
        said.append(
            f"memory: at most {kib:.2f} KiB a face from {LARGE:,} faces on ({worst['name']}; aim: at most {MOST_KIB:g};"
            f" {'met' if kib <= MOST_KIB else 'NOT met'})"
        )
    return said


def table(rows):
    """Markdown, a row a mesh."""
    lines = [
        "| mesh | faces | charts | CPU s | wall s | µs a face | peak MB | KiB a face |",
        "|---|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for row in rows:
        if "cpu" not in row:
            lines.append(f"| {row['name']} | {row['faces']:,} | failed: {row['failed']} ||||||")
            continue
        faces, cpu, peak = row["faces"], row["cpu"], row["peak"]
        cells = [row["name"], f"{faces:,}", f"{row['charts']:,}", f"{cpu:.2f}", f"{row['wall']:.2f}"]
        cells += [f"{1e6 * cpu / faces:.0f}", f"{peak / 1e6:.1f}", f"{peak / KIB / faces:.2f}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def page(rows, machine):
    listed = "\n".join(f"- {line}" for line in verdicts(rows))
    return f"""# Time and memory against size

Each mesh is unwrapped at default settings in a process of its own; faces are triangles. CPU seconds are those of all
threads, user and system, of the call alone; the peak is that above a process that loads the same mesh and does not
unwrap it; of meshes below {LARGE:,} faces the least of a few runs. Measured on {machine}.

{listed}

![CPU seconds and memory against faces](scaling.png)

{table(rows)}
"""


def plot(rows, path):
    """Both figures against faces: families as lines, models as named points."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    measured = [row for row in rows if "cpu" in row]
    figure, (times, memory) = plt.subplots(1, 2, figsize=(13, 5.6))
    found = slopes(rows)
    for number, family in enumerate(dict.fromkeys(row["family"] for row in measured)):
        members = sorted((row for row in measured if row["family"] == family), key=lambda row: row["faces"])
        faces = np.array([row["faces"] for row in members])
        cpu, kib = np.array([row["cpu"] for row in members]), np.array([row["peak"] / KIB for row in members]) / faces
        style = {"color": COLOURS[number % len(COLOURS)], "marker": "o", "markersize": 4}
        label = family
        if family == "models":
            style |= {"linestyle": "none", "marker": "s"}
            for x, y, z, row in zip(faces, cpu, kib, members, strict=True):
                for axes, height in ((times, y), (memory, z)):
                    name = row["name"]
                    axes.annotate(name, (x, height), (3, 3), textcoords="offset points", fontsize=6, color="#555555")
        elif family in found:
            everywhere, large = found[family]["cpu"]
            label = f"{family}: slope {everywhere:.2f}" + (f", {large:.2f} from {LARGE:,}" if large else "")
        times.plot(faces, cpu, label=label, **style)
        memory.plot(faces, kib, label=family, **style)
    if measured:
        low, high = (bound(row["faces"] for row in measured) for bound in (min, max))
        middle = float(np.exp(np.median(np.log([row["cpu"] / row["faces"] for row in measured]))))
        x = np.array([low, high], float)
        centre = np.sqrt(low * high)
        for power, dashes in ((1.0, ":"), (MOST_SLOPE, "--")):
            line = middle * centre * (x / centre) ** power
            times.plot(x, line, dashes, color="#999999", linewidth=1, label=f"slope {power:g}", zorder=0)
        memory.axhline(MOST_KIB, color="#999999", linestyle="--", linewidth=1, label=f"aim: {MOST_KIB:g}", zorder=0)
    times.set(xscale="log", yscale="log", xlabel="faces (triangles)", ylabel="CPU seconds", title="time")
    memory.set(xscale="log", xlabel="faces (triangles)", ylabel="peak memory, KiB a face", title="memory")
    memory.set_ylim(0, _ceiling(measured))
    if measured:
        times.set_xlim(0.7 * low, 2.5 * high)  # the name of the largest model needs room
        memory.set_xlim(0.7 * low, 2.5 * high)
    for axes in (times, memory):
        axes.grid(True, which="major", alpha=0.3)
        axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _ceiling(measured):
    """Of the memory plot: small meshes, whose fixed costs are many KiB a face, may run out of it."""
    large = [row["peak"] / KIB / row["faces"] for row in measured if row["faces"] >= LARGE]
    return 1.25 * max([MOST_KIB, *large]) if large else None
