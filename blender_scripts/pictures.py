"""Pictures drawn with Pillow: UV layouts coloured by stretch, captions, PNG files. A picture is (h, w, 3) uint8.

Blender's Python has no Pillow of its own: launch.py puts one into `.cache/`. Where there is none, importing this module
raises `ImportError` with a sentence that says what to do.
"""

import functools
import sys
from pathlib import Path

import launch
import numpy as np

if (_library := launch.library_directory("pillow", f"{sys.version_info[0]}.{sys.version_info[1]}")).is_dir():
    sys.path.append(str(_library))  # behind the Python's own packages
try:
    from PIL import Image, ImageDraw, ImageFont
except ImportError as _error:
    raise ImportError(
        f"pictures are drawn with Pillow, which this Python lacks ({_error}); to install it where it is looked for: "
        f"{sys.executable} -m pip install --target {_library} pillow"
    ) from _error

BACKGROUND = np.array([24, 26, 30], np.uint8)
EMPTY = np.array([44, 47, 53], np.uint8)
TEXT = np.array([232, 234, 238], np.uint8)
BORDER = np.array([12, 13, 15], np.uint8)
OVERLAP = np.array([255, 255, 255], np.uint8)
FLIP = np.array([235, 60, 235], np.uint8)
# L2 stretch of a face -> colour; linear in between.
STRETCH_COLOURS = (
    (1.00, (64, 140, 190)),
    (1.05, (70, 178, 160)),
    (1.20, (150, 200, 90)),
    (1.50, (240, 190, 60)),
    (2.00, (220, 70, 50)),
)
TEXT_SIZE = 16  # pixels
BORDER_WIDTH = 1.3  # pixels
SMOOTHING = 3  # a drawing is made so many times as large, then reduced: Pillow draws without smoothing
LARGEST_DRAWING = 8192  # pixels along a side, which bounds the memory
CHUNK_PIXELS = 4_000_000  # pixels tested at a time, which bounds the memory


def write_png(path, picture):
    """Writes a picture as a PNG file, under a temporary name first."""
    path = Path(path)
    work = path.with_name(f".{path.name}.tmp")
    Image.fromarray(np.ascontiguousarray(picture, np.uint8)).save(work, "PNG", optimize=True)
    work.replace(path)


def read_png(path):
    """The picture in a file."""
    with Image.open(path) as image:
        return np.array(image.convert("RGB"))


@functools.cache
def _font(size):
    return ImageFont.load_default(size)


def line_height(size=TEXT_SIZE):
    """Pixels from one line of text to the next."""
    return round(1.4 * size)


def text_width(text, size=TEXT_SIZE):
    """Pixels that a line of text takes."""
    return int(np.ceil(_font(size).getlength(text)))


def shortened(text, width, size=TEXT_SIZE):
    """The text, or as much of its beginning as fits into a width, with dots after it."""
    if text_width(text, size) <= width:
        return text
    while text and text_width(f"{text}...", size) > width:
        text = text[:-1]
    return f"{text}..." if text else ""


def draw_text(canvas, text, x, y, size=TEXT_SIZE):
    """Draws a line of text with its upper left corner at (x, y), as far as there is room; returns where it ends."""
    image = Image.fromarray(canvas)
    ImageDraw.Draw(image).text((x, y), text, font=_font(size), fill=tuple(TEXT.tolist()))
    canvas[:] = np.asarray(image)
    return x + text_width(text, size)


def plain(height, width, colour=BACKGROUND):
    """A picture of one colour."""
    canvas = np.empty((height, width, 3), np.uint8)
    canvas[:] = colour
    return canvas


def side_by_side(pictures, gap=16):
    """Pictures of equal height in a row."""
    bar = plain(pictures[0].shape[0], gap)
    parts = [bar]
    for picture in pictures:
        parts += [picture, bar]
    return np.concatenate(parts, axis=1)


def stacked(pictures):
    """Pictures of equal width above each other."""
    return np.concatenate(pictures)


def with_captions(picture, captions, size=TEXT_SIZE):
    """A picture below lines of text."""
    head = plain(line_height(size) * len(captions) + 8, picture.shape[1])
    for number, text in enumerate(captions):
        draw_text(head, shortened(text, head.shape[1] - 2, size), 2, 4 + number * line_height(size), size)
    return np.concatenate([head, picture])


def layout(selection, uv, size=900):
    """A UV layout as (size, size, 3): faces by stretch, flips magenta, overlaps white, chart borders dark."""
    triangles = corner_triangles(selection)
    points = uv.astype(np.float64) * size
    points[:, 1] = size - points[:, 1]
    colours = _face_colours(*_stretch(selection, uv, triangles))
    drawing = _Drawing(size)
    for corners, colour in zip(points[triangles], colours.tolist(), strict=True):
        drawing.polygon(corners, colour)
    drawing.paint(_coverage(points[triangles], size) > 1, OVERLAP)
    for ends in points[_border_edges(selection, uv)]:
        drawing.line(ends, BORDER.tolist(), BORDER_WIDTH)
    return drawing.picture()


def point_layout(uv, colours, size=900):
    """The UVs of points as (size, size, 3): a dot each in its colour, (n, 3) in 0..1."""
    inside = np.isfinite(uv).all(axis=1)
    points, colours = (
        uv[inside].astype(np.float64) * size,
        (np.clip(colours[inside], 0, 1) * 255 + 0.5).astype(np.uint8),
    )
    points[:, 1] = size - points[:, 1]
    radius = max(1.0, 0.6 * size / np.sqrt(max(len(points), 1)))
    drawing = _Drawing(size)
    for point, colour in zip(points, colours.tolist(), strict=True):
        drawing.dot(point, radius, colour)
    return drawing.picture()


def legend(width, height=26):
    """The scale of stretch colours as a strip; of a narrow one the right end is cut off."""
    top, room = 4, height - 8
    strip = plain(height, max(width, 700))
    x = draw_text(strip, "stretch 1", 4, 3) + 8
    strip[top : top + room, x : x + 200] = _ramp(np.linspace(1.0, 2.0, 200))
    x = draw_text(strip, "2", x + 208, 3) + 30
    for colour, word in ((FLIP, "flipped"), (OVERLAP, "overlap")):
        strip[top : top + room, x : x + 20] = colour
        x = draw_text(strip, word, x + 28, 3) + 30
    return strip[:, :width]


class _Drawing:
    """A square canvas that is drawn upon larger than it is asked for, in pixels of what is asked for."""

    def __init__(self, size):
        self._times = max(1, min(SMOOTHING, LARGEST_DRAWING // size))
        self._image = Image.new("RGB", (size * self._times,) * 2, tuple(EMPTY.tolist()))
        self._draw = ImageDraw.Draw(self._image)

    def _at(self, points):
        return (points * self._times - 0.5).ravel().tolist()

    def polygon(self, corners, colour):
        self._draw.polygon(self._at(corners), fill=tuple(colour))

    def line(self, ends, colour, width):
        self._draw.line(self._at(ends), fill=tuple(colour), width=max(1, round(width * self._times)))

    def dot(self, centre, radius, colour):
        self._draw.ellipse(self._at(np.array([centre - radius, centre + radius])), fill=tuple(colour))

    def paint(self, chosen, colour):
        """Colours whole pixels, (size, size) bool."""
        mask = Image.fromarray(chosen.astype(np.uint8) * 255).resize(self._image.size, Image.Resampling.NEAREST)
        self._image.paste(tuple(colour.tolist()), mask=mask)

    def picture(self):
        return np.array(self._image.reduce(self._times))


def corner_triangles(selection):
    """Corner indices of all triangles, (t, 3)."""
    if selection.corner_triangles is not None:
        return selection.corner_triangles
    return np.arange(len(selection.corner_vertices), dtype=np.int32).reshape(-1, 3)


def _stretch(selection, uv, triangles):
    """L2 stretch of every triangle at the scale of the whole atlas, and whether it is flipped."""
    position = selection.positions.astype(np.float64)[selection.corner_vertices[triangles]]
    flat = uv.astype(np.float64)[triangles]
    a, b = position[:, 1] - position[:, 0], position[:, 2] - position[:, 0]
    p, q = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = 0.5 * np.linalg.norm(np.cross(a, b), axis=1)
    signed = 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    # Gram matrix of the map from the plane to the surface: the columns of [a b]·[p q]⁻¹ squared and summed.
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (a * q[:, 1:2] - b * p[:, 1:2]) / (2 * signed[:, None])
        t = (b * p[:, 0:1] - a * q[:, 0:1]) / (2 * signed[:, None])
        energy = 0.5 * ((s * s).sum(axis=1) + (t * t).sum(axis=1))
        stretch = np.sqrt(energy * np.abs(signed).sum() / area.sum())
    return np.where(np.isfinite(stretch), stretch, 99.0), signed <= 0


def _ramp(values):
    at = [stop for stop, _ in STRETCH_COLOURS]
    return np.stack([np.interp(values, at, [c[k] for _, c in STRETCH_COLOURS]) for k in range(3)], axis=1)


def _face_colours(stretch, flipped):
    colours = _ramp(stretch).astype(np.uint8)
    colours[flipped] = FLIP
    return colours


def _coverage(corners, size):
    """How many triangles, (t, 3, 2), cover the centre of each pixel, (size, size).

    By hand, since neither Pillow nor Matplotlib counts: they fill shared sides twice, or blend what lies above.
    """
    count = np.zeros((size, size), np.int32)
    low = np.floor(np.clip(corners.min(axis=1), 0, size)).astype(np.int64)
    high = np.ceil(np.clip(corners.max(axis=1), 0, size)).astype(np.int64)
    extent = np.maximum((high - low).max(axis=1), 1)
    side_class = np.ceil(np.log2(extent)).astype(int)
    for power in np.unique(side_class):  # triangles of about the same size at once
        side = 1 << int(power)
        members = np.flatnonzero(side_class == power)
        step = max(1, CHUNK_PIXELS // (side * side))
        offset = np.arange(side)
        for start in range(0, len(members), step):
            index = members[start : start + step]
            x = (low[index, 0][:, None] + offset)[:, None, :] + 0.5
            y = (low[index, 1][:, None] + offset)[:, :, None] + 0.5
            triangle = corners[index]
            inside_left = inside_right = True
            for k in range(3):
                from_, to = triangle[:, k, :, None, None], triangle[:, (k + 1) % 3, :, None, None]
                side_of = (to[:, 0] - from_[:, 0]) * (y - from_[:, 1]) - (to[:, 1] - from_[:, 1]) * (x - from_[:, 0])
                inside_left, inside_right = inside_left & (side_of > 0), inside_right & (side_of < 0)
            which, row, column = np.nonzero(inside_left | inside_right)
            rows, columns = low[index[which], 1] + row, low[index[which], 0] + column
            fits = (rows < size) & (columns < size)
            np.add.at(count, (rows[fits], columns[fits]), 1)
    return count


def _border_edges(selection, uv):
    """Corner pairs of UV edges that belong to one face only: the borders of charts."""
    corners = len(selection.corner_vertices)
    following = np.arange(1, corners + 1)
    following[selection.face_offsets[1:] - 1] = selection.face_offsets[:-1]
    _, place = np.unique(selection.positions, axis=0, return_inverse=True)  # files split vertices at every face
    key = np.empty((corners, 3), np.int64)
    key[:, 0] = place.reshape(-1)[selection.corner_vertices]
    key[:, 1:] = np.ascontiguousarray(uv, np.float32).view(np.int32)
    _, point = np.unique(key, axis=0, return_inverse=True)
    point = point.reshape(-1)
    ends = np.sort(np.stack([point, point[following]], axis=1), axis=1)
    _, first, uses = np.unique(ends, axis=0, return_index=True, return_counts=True)
    first = first[uses == 1]
    return np.stack([first, following[first]], axis=1)
