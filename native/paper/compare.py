"""The three methods on the same patches and on the same charts, as rows of a table."""

from dataclasses import dataclass

import ble_unwrap_native as ble
import numpy as np
import shapes

# Share of the surface, where a map is stretched most, that the trimmed stretch leaves out.
TRIMMED = 0.01

# All vertices of a patch together: what the paper does, and the same distances for all three.
METHODS = {
    "BLE (default)": {"landmark_fraction": 1.0},
    "BLE (paper)": {"preset": "paper", "landmark_fraction": 1.0},
    "Isomap": {"model": "isomap", "landmark_fraction": 1.0},
}
# On charts as `unwrap` embeds them: by landmarks; the paper's preset all vertices up to 2,000.
CHART_METHODS = {
    "BLE (default)": {},
    "BLE (paper)": {"preset": "paper"},
    "Isomap": {"model": "isomap"},
}


@dataclass
class Row:
    """One patch by one method."""

    patch: str
    method: str
    report: dict
    trimmed_before: float
    embedded: np.ndarray
    uv: np.ndarray


def face_stretch(positions, triangles, uv):
    """Squared L2 stretch of each triangle (mirror images alike), its area on the surface and in the plane."""
    p, q = positions[triangles], uv[triangles]
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    c, d = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    double = c[:, 0] * d[:, 1] - c[:, 1] * d[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (a * d[:, 1:2] - b * c[:, 1:2]) / double[:, None]
        t = (b * c[:, 0:1] - a * d[:, 0:1]) / double[:, None]
        squared = 0.5 * ((s * s).sum(axis=1) + (t * t).sum(axis=1))
    squared[~np.isfinite(squared)] = np.inf
    return squared, 0.5 * np.linalg.norm(np.cross(a, b), axis=1), 0.5 * double


def trimmed_l2(mesh, uv, trimmed=TRIMMED):
    """L2 stretch of all but the hundredth of the surface that is stretched most.

    Where a map folds, a few triangles are squeezed to almost nothing and alone decide its L2 stretch; this tells of the
    rest.
    """
    squared, surface, plane = face_stretch(mesh.positions, mesh.triangles(), uv)
    order = np.argsort(squared, kind="stable")
    kept = order[np.cumsum(surface[order]) <= (1 - trimmed) * surface.sum()]
    energy = (squared[kept] * surface[kept]).sum()
    return float(np.sqrt(energy * np.abs(plane[kept]).sum()) / surface[kept].sum())


def flipped(mesh, uv):
    """Which triangles of `mesh.triangles()` are turned over."""
    return face_stretch(mesh.positions, mesh.triangles(), uv)[2] <= 0


def flatten(mesh, method, settings, runs=1):
    """One patch by one method; the time of the embedding is the best of some runs, for other work disturbs it."""
    # The same triangles as are drawn and counted here.
    settings = {"corner_triangles": mesh.corner_triangles(), **settings}
    flat = ble.flatten(*mesh.arrays, **settings)
    report = dict(flat.report)
    again = [ble.flatten(*mesh.arrays, minimise=False, **settings).report["seconds"] for _ in range(runs - 1)]
    report["seconds"] = dict(report["seconds"])
    report["seconds"]["embedding"] = min(s["embedding"] for s in [report["seconds"], *again])
    embedded, uv = np.array(flat.embedded), np.array(flat.uv)
    return Row(mesh.name, method, report, trimmed_l2(mesh, embedded), embedded, uv)


def compare_patches(patches, methods=None, runs=1):
    """A row for every patch and method."""
    methods = methods or METHODS
    return [flatten(mesh, name, settings, runs) for mesh in patches for name, settings in methods.items()]


def charts_of(mesh, **settings):
    """An unwrap and its charts as meshes, opened where the atlas is; those of fewer than 50 faces are left out."""
    atlas = ble.unwrap(*mesh.arrays, **settings)
    chart, uv = np.asarray(atlas.chart), np.asarray(atlas.uv)
    names, count = np.unique(chart[chart >= 0], return_counts=True)
    key = np.concatenate([mesh.corner_vertices[:, None].astype(np.float64), uv], axis=1)
    _, first, place = np.unique(key, axis=0, return_index=True, return_inverse=True)
    opened = shapes.Mesh(
        mesh.name,
        mesh.positions[mesh.corner_vertices[first]],
        place.reshape(-1).astype(np.int32),
        mesh.face_offsets,
        mesh.view,
    )
    return atlas, [opened.part(chart == c, f"{mesh.name} {c + 1}") for c in names[count >= 50]]


def compare_charts(mesh, methods=None):
    """The charts of an unwrap by each method: not merged and without darts, since those begin with other maps."""
    _, charts = charts_of(mesh, coarse=False, moves="split")
    return compare_patches(charts, methods or CHART_METHODS)


def milliseconds(seconds):
    return f"{1e3 * seconds:.1f}" if seconds < 0.0995 else f"{1e3 * seconds:.0f}"


def number(value):
    """A stretch: three places, none where folds make it large."""
    return f"{value:.3f}" if value < 10 else (f"{value:.0f}" if np.isfinite(value) else "∞")


def patch_table(rows):
    """The rows as Markdown, patch by patch."""
    lines = [
        "| patch | method | flips | L2 | L2 of 99 % | correlation | sweeps | embedding, ms | flips after | L2 after |"
        " correlation after |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    last = None
    for row in rows:
        report, patch = row.report, ""
        if row.patch != last:
            patch = f"{row.patch} ({report['vertices']:,} vertices)"
            last = row.patch
        lines.append(
            f"| {patch} | {row.method} | {report['flips_before']} | {number(report['l2_before'])} |"
            f" {number(row.trimmed_before)} | {report['distance_correlation_before']:.4f} | {report['sweeps'] or '-'} |"
            f" {milliseconds(report['seconds']['embedding'])} | {report['flips_after']} |"
            f" {number(report['l2_after'])} | {report['distance_correlation_after']:.4f} |"
        )
    return "\n".join(lines)


def charts_text(count):
    return "1 chart" if count == 1 else f"{count} charts"


def chart_table(groups):
    """Rows of the charts of each model, added up: {model: rows}."""
    lines = [
        "| charts of | method | flips | without flips | L2 of 99 % | correlation | sweeps | embedding, ms |"
        " flips after | L2 after |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for model, rows in groups.items():
        for name in dict.fromkeys(row.method for row in rows):
            mine = [row for row in rows if row.method == name]
            vertices = np.array([row.report["vertices"] for row in mine], float)

            def mean(values, weight=vertices):
                return float((np.array(values) * weight).sum() / weight.sum())

            title = (
                f"{model} ({charts_text(len(mine))}, {int(vertices.sum()):,} vertices)" if mine[0] is rows[0] else ""
            )
            lines.append(
                f"| {title} | {name} | {sum(row.report['flips_before'] for row in mine)} |"
                f" {sum(row.report['flips_before'] == 0 for row in mine)} of {len(mine)} |"
                f" {number(mean([row.trimmed_before for row in mine]))} |"
                f" {mean([row.report['distance_correlation_before'] for row in mine]):.4f} |"
                f" {mean([row.report['sweeps'] for row in mine]):.0f} |"
                f" {milliseconds(sum(row.report['seconds']['embedding'] for row in mine))} |"
                f" {sum(row.report['flips_after'] for row in mine)} |"
                f" {number(mean([row.report['l2_after'] for row in mine]))} |"
            )
    return "\n".join(lines)


def advantage(rows, patch):
    """How much less stretch above 1 the default model has than Isomap on a patch, before any minimisation: 0 to 1."""
    l2 = {row.method: row.report["l2_before"] for row in rows if row.patch == patch}
    return 1 - (l2["BLE (default)"] - 1) / (l2["Isomap"] - 1)
