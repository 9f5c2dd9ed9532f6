"""The figures, drawn by matplotlib around pictures that Blender rendered."""

import io
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import compare
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from PIL import Image

FACE = "#b9cbe0"
FLIPPED = "#e0218a"
EDGE = "#33445a"
DARKEST = 0.5  # of a surface, where no light falls
DPI = 110
COLOURS = 200  # of a saved picture: enough for shading, and a third of the size
# Of charts, light enough for a checker upon them.
CHART_COLOURS = np.array(
    [
        (0.45, 0.65, 0.90), (0.96, 0.70, 0.38), (0.55, 0.80, 0.50), (0.90, 0.50, 0.52), (0.70, 0.60, 0.86),
        (0.78, 0.65, 0.55), (0.94, 0.66, 0.82), (0.72, 0.76, 0.40), (0.45, 0.80, 0.82), (0.86, 0.82, 0.50),
    ]
)  # fmt: skip

plt.rcParams.update({"font.size": 9, "axes.titlesize": 9.5, "font.family": "DejaVu Sans"})


def save(figure, path):
    """A PNG of few colours."""
    stream = io.BytesIO()
    figure.savefig(stream, dpi=DPI, facecolor="white")
    plt.close(figure)
    stream.seek(0)
    picture = Image.open(stream).convert("RGB")
    picture = picture.quantize(COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)


def camera(view):
    """Right, up and backward of a camera that looks along -view."""
    backward = np.array(view, float) / np.linalg.norm(view)
    right = np.cross((0, 0, 1), backward)
    right /= np.linalg.norm(right)
    return right, np.cross(backward, right), backward


def draw_surface(axes, mesh):
    """The mesh in space with the edges of its polygons, lit from the upper left; nearer faces are drawn over others."""
    right, up, backward = camera(mesh.view)
    light = -0.45 * right + 0.6 * up + 0.66 * backward
    polygons = mesh.polygons()
    polygons = [polygons[f] for f in np.argsort([mesh.positions[p].mean(axis=0) @ backward for p in polygons])]
    place = np.stack([mesh.positions @ right, mesh.positions @ up], axis=1)
    colours = [_shade(mesh.positions[p], light, backward) for p in polygons]
    shape = [place[p] for p in polygons]
    axes.add_collection(PolyCollection(shape, facecolors=colours, edgecolors=EDGE, linewidths=0.25))
    frame(axes, place)


def _shade(points, light, backward):
    """The colour of a polygon; both of its sides are lit."""
    normal = sum(np.cross(points[k], points[(k + 1) % len(points)]) for k in range(len(points)))
    normal = normal / max(np.linalg.norm(normal), 1e-30)
    normal = normal * (np.sign(normal @ backward) or 1.0)
    shade = DARKEST + (1 - DARKEST) * max(normal @ light, 0)
    return np.clip(1.15 * shade * np.array(matplotlib.colors.to_rgb(FACE)), 0, 1)


def frame(axes, points, half=None):
    """Equal scales; `half` is half the side of what is shown, so that several panels can share it."""
    points = points[np.isfinite(points).all(axis=1)]
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    half = half or 0.53 * np.ptp(points, axis=0).max()
    axes.set_xlim(centre[0] - half, centre[0] + half)
    axes.set_ylim(centre[1] - half, centre[1] + half)
    axes.set_aspect("equal")
    axes.axis("off")


def upright(mesh, uv, reference=None):
    """A map turned so that it lies as the surface is seen: by the best rotation, no mirror."""
    right, up, _ = camera(mesh.view)
    seen = np.stack([mesh.positions @ right, mesh.positions @ up], axis=1) if reference is None else reference
    used = np.isfinite(uv).all(axis=1)
    a, b = uv[used] - uv[used].mean(axis=0), seen[used] - seen[used].mean(axis=0)
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(angle), np.sin(angle)
    return (uv - uv[used].mean(axis=0)) @ np.array([[c, s], [-s, c]])


def draw_map(axes, mesh, uv, half):
    """The mesh in the plane; triangles turned over in magenta, upon the others."""
    triangles = mesh.triangles()
    wrong = compare.flipped(mesh, uv)
    good = PolyCollection(uv[triangles[~wrong]], facecolors=FACE, edgecolors="none", alpha=0.75)
    axes.add_collection(good)
    edges = np.concatenate([np.stack([p, np.roll(p, -1)], axis=1) for p in mesh.polygons()])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    axes.add_collection(LineCollection(uv[edges], colors=EDGE, linewidths=0.22))
    if wrong.any():
        shape = uv[triangles[wrong]]
        axes.add_collection(PolyCollection(shape, facecolors=FLIPPED, edgecolors=FLIPPED, linewidths=0.5, alpha=0.65))
    frame(axes, uv, half)


def half_extent(*maps):
    return 0.53 * max(np.ptp(uv[np.isfinite(uv).all(axis=1)], axis=0).max() for uv in maps)


def flips_text(report, when):
    count, of = report[f"flips_{when}"], report["triangles"]
    return f"{count} of {of:,} triangles flipped" if count else "no triangle flipped"


def figure_2a(mesh, rows, path):
    """The face and its flattening by the printed and by the default model."""
    figure, panels = plt.subplots(1, 3, figsize=(9.6, 3.75))
    draw_surface(panels[0], mesh)
    panels[0].set_title(f"{len(mesh.positions):,} vertices")
    maps = [upright(mesh, row.embedded) for row in rows]
    half = half_extent(*maps)
    for axes, row, uv in zip(panels[1:], rows, maps, strict=True):
        draw_map(axes, mesh, uv, half)
        report = row.report
        name = "the model as printed" if report["model"] == "paper" else "the default model"
        milliseconds = compare.milliseconds(report["seconds"]["embedding"])
        axes.set_title(f"{name}: {report['sweeps']} sweeps, {milliseconds} ms\n{flips_text(report, 'before')}")
        if report["flips_before"]:
            magnify_flips(axes, mesh, uv, half)
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.02, top=0.87, wspace=0.1)
    save(figure, path)


def magnify_flips(axes, mesh, uv, half, share=0.13):
    """An inset upon the middle of the map: where most of the flips at its lower edge are, several times larger."""
    centre = uv[mesh.triangles()[compare.flipped(mesh, uv)]].mean(axis=1)
    lower = centre[centre[:, 1] < np.nanmean(uv[:, 1])]
    if not len(lower):
        lower = centre
    place = np.median(lower, axis=0)
    inset = axes.inset_axes([0.28, 0.3, 0.44, 0.44])
    draw_map(inset, mesh, uv, None)
    inset.collections[-1].set_linewidth(0)
    inset.set_xlim(place[0] - share * half, place[0] + share * half)
    inset.set_ylim(place[1] - share * half, place[1] + share * half)
    inset.axis("on")
    inset.set_xticks([])
    inset.set_yticks([])
    axes.indicate_inset_zoom(inset, edgecolor="black", alpha=0.8)


def show(axes, path):
    axes.imshow(np.asarray(Image.open(path)))
    axes.axis("off")


def figure_2b(mesh, rows, pictures, path):
    """A patch before and after its stretch is minimised, textured and as a mesh; a line for each model."""
    figure, panels = plt.subplots(len(rows), 5, figsize=(12.2, 2.95 * len(rows)))
    maps = {}
    for row in rows:
        embedded = upright(mesh, row.embedded)
        maps[row.method] = [embedded, upright(mesh, row.uv, embedded)]
    half = half_extent(*(uv for pair in maps.values() for uv in pair))
    for line, row in zip(panels, rows, strict=True):
        report = row.report
        draw_surface(line[0], mesh)
        line[0].set_title(f"(b) the patch, {report['vertices']:,} vertices\n{row.method}")
        for axes, when, letter in ((line[1], "before", "c"), (line[2], "after", "d")):
            show(axes, pictures[row.method, when])
            axes.set_title(f"({letter}) textured, {when}\nL2 stretch {compare.number(report[f'l2_{when}'])}")
        for axes, when, letter, uv in zip(line[3:], ("before", "after"), "ef", maps[row.method], strict=True):
            draw_map(axes, mesh, uv, half)
            axes.set_title(f"({letter}) the mesh, {when}\n{flips_text(report, when)}")
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.005, top=0.92, wspace=0.03, hspace=0.22)
    save(figure, path)


def chart_colours(chart):
    colours = CHART_COLOURS[np.maximum(chart, 0) % len(CHART_COLOURS)]
    return np.where((chart >= 0)[:, None], colours, 0.3)


def figure_3(models, path):
    """Atlases: each model with a checker, its charts in colours, and where they lie in the texture."""
    figure, panels = plt.subplots(len(models), 3, figsize=(9.2, 3.2 * len(models)), squeeze=False)
    for line, (mesh, atlas, pictures) in zip(panels, models, strict=True):
        report, chart, uv = atlas.report, np.asarray(atlas.chart), np.asarray(atlas.uv, dtype=float)
        show(line[0], pictures["checker"])
        line[0].set_title(f"{mesh.name}, {report['faces']:,} faces")
        show(line[1], pictures["charts"])
        charts = compare.charts_text(report["charts"])
        line[1].set_title(f"{charts}, L2 {report['l2']:.3f}, worst {report['l2_worst_chart']:.3f}")
        axes = line[2]
        shapes = np.split(uv, mesh.face_offsets[1:-1])
        axes.add_collection(PolyCollection(shapes, facecolors=chart_colours(chart), edgecolors=EDGE, linewidths=0.12))
        axes.set_xlim(0, 1)
        axes.set_ylim(0, 1)
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_title(f"texture used: {100 * report['packing_efficiency']:.0f} %")
    top = 1 - 0.3 / (3.2 * len(models))
    figure.subplots_adjust(left=0.01, right=0.985, bottom=0.012, top=top, wspace=0.05, hspace=0.12)
    save(figure, path)


def figure_scaling(surfaces, points, likelihoods, path):
    """Time against size, and the likelihood over the sweeps of both models."""
    figure, (left, *right) = plt.subplots(1, 3, figsize=(12.2, 3.9))
    n, distances, embedding = np.array(surfaces).T
    left.loglog(n, distances, "s-", ms=4, color="#8a8f98", label="distances, 64 landmarks")
    left.loglog(n, embedding, "o-", ms=4, color="#2b6cb0", label="embedding of a mesh")
    if points:
        n_points, seconds = np.array(points).T
        left.loglog(n_points, seconds, "^-", ms=4, color="#c05621", label="embed(points), 100 landmarks")
    left.loglog(n, embedding[-1] * n / n[-1], ":", color="#2b6cb0", lw=1, label="proportional to n")
    left.set_xlabel("vertices or points")
    left.set_ylabel("seconds")
    left.set_title("time, fixed number of landmarks")
    left.grid(alpha=0.3)
    left.set_ylim(bottom=embedding.min() / 40)  # room for the legend below the curves
    left.legend(frameon=False, loc="lower right")
    shades = ["#9ecae1", "#6baed6", "#3182bd", "#08519c", "#fdae6b", "#d94801"]
    for axes, model in zip(right, ("default", "paper"), strict=True):
        mine = {label: values for (of, label), values in likelihoods.items() if of == model}
        best = max(max(values) for values in mine.values())
        for shade, (label, values) in zip(shades, mine.items(), strict=True):
            gap = np.maximum(best - np.array(values), 1e-3 * abs(best) * 1e-3)
            axes.semilogy(gap / abs(best), color=shade, label=label, lw=1.6, ls="-" if "serial" in label else "--")
        axes.set_xlabel("sweeps")
        axes.set_title(f"likelihood below the best, {'default' if model == 'default' else 'printed'} model")
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=8)
    right[0].set_ylabel("(F_best − F) / |F_best|")
    figure.tight_layout()
    save(figure, path)


def corner_uv(mesh, uv):
    """A position for each corner, from one for each vertex."""
    return uv[mesh.corner_vertices]


def total_size(directory):
    return sum(path.stat().st_size for path in Path(directory).glob("*.png"))
