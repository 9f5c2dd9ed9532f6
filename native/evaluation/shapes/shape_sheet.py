"""Cells and pages of the sheet that `make shapes` draws: a layout beside the model from the front and from the back."""

import colorsys
import sys
from pathlib import Path

import numpy as np

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "blender_scripts"))

import model_view  # noqa: E402
import pictures  # noqa: E402

# pictures knows where Pillow is.
from PIL import Image, ImageDraw  # noqa: E402

BENT = (255, 0, 0)
SEAM = (8, 8, 10)
BORDER_WIDTH = 1.5  # pixels
SMOOTHING = 3  # a layout is drawn so many times as large, then reduced: Pillow draws without smoothing
MOST_WIRES = 3000  # faces; the sides of more would cover the charts
GOLDEN = 0.618034  # of the circle of hues from one chart to the next: those that follow each other differ
NAME_SIZE, TEXT_SIZE, TITLE_SIZE = 17, 14, 20  # of the captions, in pixels
GAP = 8


def chart_colours(count):
    """A colour for each chart, (count, 3), 0 to 255."""
    hues = (0.58 + GOLDEN * np.arange(max(count, 1))) % 1.0
    light = [0.62 + 0.12 * (k // 5 % 2) for k in range(len(hues))]
    rgb = [colorsys.hls_to_rgb(h, lightness, 0.55) for h, lightness in zip(hues.tolist(), light, strict=True)]
    return 255.0 * np.array(rgb)


def layout_picture(layout, size):
    """The charts in their colours, sides of faces thin, borders thick, bent quads red."""
    mesh, large = layout.mesh, size * SMOOTHING
    image = Image.new("RGB", (large, large), tuple(pictures.EMPTY.tolist()))
    draw = ImageDraw.Draw(image)
    points = layout.uv * large
    points[:, 1] = large - points[:, 1]
    colours = chart_colours(layout.chart.max() + 1).astype(int)
    bent = layout.bent()
    wires = len(layout.chart) <= MOST_WIRES
    for face, (first, last) in enumerate(zip(mesh.face_offsets[:-1], mesh.face_offsets[1:], strict=True)):
        if layout.chart[face] >= 0 and last - first > 2:
            colour = BENT if bent[face] else tuple(colours[layout.chart[face]].tolist())
            edge = tuple(int(0.8 * c) for c in colour) if wires else None
            draw.polygon(points[first:last].ravel().tolist(), fill=colour, outline=edge)
    for side in np.flatnonzero(layout.is_border):
        ends = points[[side, layout.following[side]]]
        draw.line(ends.ravel().tolist(), fill=SEAM, width=round(BORDER_WIDTH * SMOOTHING))
    return np.array(image.reduce(SMOOTHING))


def model_pictures(layout, size):
    """The model from the front and from the back, its charts in the colours that they have in the layout."""
    triangles = layout.mesh.corner_triangles()
    face = layout.face_of_corner[triangles[:, 0]]
    colours = chart_colours(layout.chart.max() + 1)[layout.chart[face]]
    colours[layout.chart[face] < 0] = 90
    colours[layout.bent()[face]] = BENT
    vertices = layout.mesh.corner_vertices[triangles]
    x, y, z = layout.mesh.view
    return [
        model_view.picture(
            layout.mesh.positions, vertices, colours, layout.seam_vertices, view, size, pictures.BACKGROUND, SEAM
        )
        for view in ((x, y, z), (-x, -y, z))
    ]


def figures(layout, report):
    """One line of what was measured."""
    charts, bent = report["charts"], int(layout.bent().sum())
    said = [
        f"{charts} chart{'s' * (charts != 1)}",
        f"seam {report['seam_length']:.2f}",
        f"L2 {report['l2']:.4f}",
        f"aligned {layout.aligned():.0%}",
        f"rectangles {layout.rectangles():.0%}",
        *([f"{bent} BENT"] if bent else []),
    ]
    return ", ".join(said)


def cell(layout, report, size):
    """Layout, front and back side by side under the name and the figures."""
    parts = [layout_picture(layout, size), *model_pictures(layout, size)]
    picture = pictures.side_by_side(parts, GAP)
    named = pictures.with_captions(picture, [figures(layout, report)], TEXT_SIZE)
    return pictures.with_captions(named, [layout.mesh.name], NAME_SIZE)


def failed_cell(name, text, size):
    """A cell of the same size that says why there is no picture."""
    empty = pictures.plain(size, 3 * size + 4 * GAP)
    return pictures.with_captions(pictures.with_captions(empty, [text], TEXT_SIZE), [name], NAME_SIZE)


def titled(row, title):
    """Cells under a line of text as wide as they are."""
    return pictures.with_captions(row, [title], TITLE_SIZE)


def rows_of(cells, columns):
    """Cells of equal size in rows of so many."""
    empty = pictures.plain(*cells[0].shape[:2])
    filled = [*cells, *[empty] * (-len(cells) % columns)]
    return [np.concatenate(filled[k : k + columns], axis=1) for k in range(0, len(filled), columns)]


def write_pages(path, pages):
    """Pages of equal width: the first under the path itself, the others with their number in the name."""
    names = [path] + [path.with_name(f"{path.stem}-{k}{path.suffix}") for k in range(2, len(pages) + 1)]
    for name, page in zip(names, pages, strict=True):
        pictures.write_png(name, page)
    return names
