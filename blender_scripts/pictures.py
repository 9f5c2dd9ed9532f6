"""Pictures drawn with NumPy alone: UV layouts coloured by stretch, captions, PNG files."""

import struct
import zlib
from pathlib import Path

import numpy as np

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
CHUNK_PIXELS = 4_000_000  # pixels tested at a time, which bounds the memory of the rasteriser

# Five columns by seven rows a glyph, a row in five bits.
_GLYPHS = {
    "A": "0e11111f111111", "B": "1e11111e11111e", "C": "0e11101010110e", "D": "1e11111111111e", "E": "1f10101e10101f",
    "F": "1f10101e101010", "G": "0e11101713110e", "H": "1111111f111111", "I": "0e04040404040e", "J": "0702020202120c",
    "K": "11121418141211", "L": "1010101010101f", "M": "111b1515111111", "N": "11191519131111", "O": "0e11111111110e",
    "P": "1e11111e101010", "Q": "0e11111115120d", "R": "1e11111e141211", "S": "0f10100e01011e", "T": "1f040404040404",
    "U": "1111111111110e", "V": "11111111110a04", "W": "1111111515150a", "X": "11110a040a1111", "Y": "11110a04040404",
    "Z": "1f01020408101f", "0": "0e11131519110e", "1": "040c040404040e", "2": "0e11010204081f", "3": "1f02040201110e",
    "4": "02060a121f0202", "5": "1f101e0101110e", "6": "0608101e11110e", "7": "1f010204080808", "8": "0e11110e11110e",
    "9": "0e11110f01020c", ".": "00000000000c0c", ",": "000000000c0408", ":": "000c0c000c0c00", "-": "0000001f000000",
    "%": "18190204081303", "(": "02040808080402", ")": "08040202020408", "/": "00010204081000", "°": "06090906000000",
    "+": "0004041f040400", "=": "00001f001f0000", "<": "02040810080402", ">": "08040201020408", "_": "0000000000001f",
}  # fmt: skip


def write_png(path, pixels):
    """Writes (h, w, 3) uint8 as a PNG file, under a temporary name first."""
    pixels = np.ascontiguousarray(pixels, np.uint8)
    height, width, _ = pixels.shape
    plain = np.zeros((height, 1 + 3 * width), np.uint8)  # a filter byte before every row: 0 is none
    plain[:, 1:] = pixels.reshape(height, -1)
    differences = plain.copy()
    differences[:, 0] = 1  # each pixel less the one before it, which suits renderings
    differences[:, 4:] -= plain[:, 1:-3]
    body = min((zlib.compress(rows.tobytes(), 9) for rows in (plain, differences)), key=len)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body)
    path = Path(path)
    work = path.with_name(f".{path.name}.tmp")
    work.write_bytes(data + chunk(b"IEND", b""))
    work.replace(path)


def draw_text(canvas, text, x, y, scale=2, colour=TEXT):
    """Draws a line of text with its upper left corner at (x, y); what does not fit is left out."""
    for character in text.upper():
        rows = _GLYPHS.get(character)
        if rows:
            for row in range(7):
                bits = int(rows[2 * row : 2 * row + 2], 16)
                for column in range(5):
                    if bits >> (4 - column) & 1:
                        top, left = y + row * scale, x + column * scale
                        canvas[top : top + scale, left : left + scale] = colour
        x += 6 * scale
    return x


def side_by_side(pictures, gap=16):
    """Pictures of equal height in a row."""
    bar = np.broadcast_to(BACKGROUND, (pictures[0].shape[0], gap, 3))
    parts = [bar]
    for picture in pictures:
        parts += [picture, bar]
    return np.concatenate(parts, axis=1)


def stacked(pictures):
    """Pictures of equal width above each other."""
    return np.concatenate(pictures)


def with_captions(picture, captions, scale=2):
    """A picture below lines of text."""
    line = 10 * scale
    head = np.empty((line * len(captions) + 6, picture.shape[1], 3), np.uint8)
    head[:] = BACKGROUND
    for number, text in enumerate(captions):
        draw_text(head, text, 2, 4 + number * line, scale)
    return np.concatenate([head, picture])


def layout(selection, uv, size=900):
    """A UV layout as (size, size, 3): faces by stretch, flips magenta, overlaps white, chart borders dark."""
    triangles = corner_triangles(selection)
    points = uv.astype(np.float64) * size
    points[:, 1] = size - points[:, 1]
    colours = _face_colours(*_stretch(selection, uv, triangles))
    canvas = np.empty((size, size, 3), np.uint8)
    canvas[:] = EMPTY
    count = np.zeros((size, size), np.uint8)
    for index, rows, columns in _covered_pixels(points[triangles], size):
        canvas[rows, columns] = colours[index]
        np.add.at(count, (rows, columns), 1)
    canvas[count > 1] = OVERLAP
    rows, columns = _line_pixels(points, _border_edges(selection, uv), size)
    canvas[rows, columns] = BORDER
    return canvas


def point_layout(uv, colours, size=900):
    """The UVs of points as (size, size, 3): a dot each in its colour, (n, 3) in 0..1."""
    canvas = np.empty((size, size, 3), np.uint8)
    canvas[:] = EMPTY
    inside = np.isfinite(uv).all(axis=1)
    uv, colours = uv[inside].astype(np.float64), (np.clip(colours[inside], 0, 1) * 255 + 0.5).astype(np.uint8)
    radius = max(1.0, 0.6 * size / np.sqrt(max(len(uv), 1)))
    reach = int(np.ceil(radius))
    column, row = np.floor(uv[:, 0] * size).astype(np.int64), np.floor((1 - uv[:, 1]) * size).astype(np.int64)
    for down in range(-reach, reach + 1):
        for across in range(-reach, reach + 1):
            if across * across + down * down > radius * radius:
                continue
            x, y = column + across, row + down
            fits = (x >= 0) & (x < size) & (y >= 0) & (y < size)
            canvas[y[fits], x[fits]] = colours[fits]
    return canvas


def legend(width, height=22):
    """The scale of stretch colours as a strip; of a narrow one the right end is cut off."""
    strip = np.empty((height, max(width, 310), 3), np.uint8)
    strip[:] = BACKGROUND
    values = np.linspace(1.0, 2.0, 200)
    strip[4 : height - 4, 110:310] = _ramp(values)
    draw_text(strip, "STRETCH 1", 2, 5, 2)
    end = draw_text(strip, "2", 318, 5, 2)
    strip[4 : height - 4, end + 30 : end + 50] = FLIP
    end = draw_text(strip, "FLIPPED", end + 58, 5, 2)
    strip[4 : height - 4, end + 30 : end + 50] = OVERLAP
    draw_text(strip, "OVERLAP", end + 58, 5, 2)
    return strip[:, :width]


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


def _covered_pixels(corners, size):
    """Pixels whose centre lies in a triangle, in portions: (triangle index, rows, columns)."""
    low = np.floor(np.clip(corners.min(axis=1), 0, size)).astype(np.int64)
    high = np.ceil(np.clip(corners.max(axis=1), 0, size)).astype(np.int64)
    extent = np.maximum((high - low).max(axis=1), 1)
    side_class = np.ceil(np.log2(extent)).astype(int)
    for power in np.unique(side_class):
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
            yield index[which][fits], rows[fits], columns[fits]


def _border_edges(selection, uv):
    """Corner pairs of UV edges that belong to one face only: the borders of charts."""
    corners = len(selection.corner_vertices)
    following = np.arange(1, corners + 1)
    following[selection.face_offsets[1:] - 1] = selection.face_offsets[:-1]
    key = np.empty((corners, 3), np.int64)
    key[:, 0] = selection.corner_vertices
    key[:, 1:] = np.ascontiguousarray(uv, np.float32).view(np.int32)
    _, point = np.unique(key, axis=0, return_inverse=True)
    point = point.reshape(-1)
    ends = np.sort(np.stack([point, point[following]], axis=1), axis=1)
    _, first, uses = np.unique(ends, axis=0, return_index=True, return_counts=True)
    first = first[uses == 1]
    return np.stack([first, following[first]], axis=1)


def _line_pixels(points, edges, size):
    """Pixels along line segments."""
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    steps = np.clip(np.ceil(np.abs(end - start).max(axis=1)).astype(int) + 1, 2, 2 * size)
    index = np.repeat(np.arange(len(edges)), steps)
    position = np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = (position / (steps[index] - 1))[:, None]
    pixel = np.floor(start[index] * (1 - share) + end[index] * share).astype(np.int64)
    pixel = pixel[((pixel >= 0) & (pixel < size)).all(axis=1)]
    return pixel[:, 1], pixel[:, 0]
