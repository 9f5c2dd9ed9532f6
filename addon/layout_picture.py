"""Pictures of UV layouts, drawn by NumPy alone since Blender's Python has nothing else. Knows nothing of Blender.

A picture is (h, w, 3) of 0 to 1, its lowest row first, as Blender has them.
"""

from dataclasses import dataclass

import numpy as np

SIDE = 512  # pixels, of the longer side of a texture
GAP = 16  # pixels, between two layouts and around them
SMOOTHING = 2  # a drawing is made so many times as large, then reduced
AROUND, EMPTY, BORDER = (0.10, 0.10, 0.11), (0.19, 0.19, 0.21), (0.02, 0.02, 0.02)
CHUNK_PIXELS = 4_000_000  # filled at a time, which bounds the memory
# Of one layout, all triangles together: only where most lie on each other dozens deep it takes more, and then nothing
# is seen any more of what is left out.
MOST_PIXELS = 100_000_000


@dataclass
class Layout:
    """What is drawn of one UV map."""

    uv: np.ndarray  # (c, 2)
    triangles: np.ndarray  # (t, 3) corners
    colours: np.ndarray  # (t, 3) of 0 to 1
    borders: np.ndarray  # (m, 2) corners, the ends of lines


def side_by_side(layouts, texture_size):
    """One picture of all layouts in textures of this size, from left to right."""
    width, height = (max(1, round(SIDE * side / max(texture_size))) for side in texture_size)
    whole = np.empty((height + 2 * GAP, len(layouts) * (width + GAP) + GAP, 3), np.float32)
    whole[:] = AROUND
    for number, layout in enumerate(layouts):
        left = GAP + number * (width + GAP)
        whole[GAP : GAP + height, left : left + width] = drawn(layout, width, height)
    return whole


def drawn(layout, width, height):
    """The picture of one layout."""
    large = np.empty((SMOOTHING * height, SMOOTHING * width, 3), np.float32)
    large[:] = EMPTY
    places = layout.uv.astype(np.float64) * (SMOOTHING * width, SMOOTHING * height)
    known = np.isfinite(places).all(axis=1)
    there = known[layout.triangles].all(axis=1)
    _fill(large, places[layout.triangles[there]], np.asarray(layout.colours, np.float32)[there])
    _draw_lines(large, places[layout.borders[known[layout.borders].all(axis=1)]])
    return large.reshape(height, SMOOTHING, width, SMOOTHING, 3).mean(axis=(1, 3))


def borders(place, face_offsets):
    """Sides of faces that no other face shares in the map, (m, 2) corners. `place` as of `uv_islands.islands`."""
    following = np.arange(1, len(place) + 1)
    following[face_offsets[1:] - 1] = face_offsets[:-1]
    ends = np.sort(np.stack([place, place[following]], axis=1), axis=1)
    _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
    alone = first[count == 1]
    return np.stack([alone, following[alone]], axis=1)


def _fill(picture, points, colours):
    """Fills triangles, (t, 3, 2) in pixels: every pixel whose middle is inside, the later triangle over the earlier."""
    height, width = picture.shape[:2]
    low, high = points.min(axis=1), points.max(axis=1)
    # As many pixels as a triangle can have at most, to take as many triangles at a time as memory allows.
    sides = np.maximum(np.minimum(high, (width, height)) - np.maximum(low, 0.0), 0.0) + 1.0
    sums = np.cumsum(sides.prod(axis=1))
    begin = 0
    while begin < len(points) and (begin == 0 or sums[begin - 1] < MOST_PIXELS):
        before = sums[begin - 1] if begin else 0.0
        end = max(int(np.searchsorted(sums, before + CHUNK_PIXELS, side="right")), begin + 1)
        _fill_some(picture, points[begin:end], colours[begin:end])
        begin = end


def _fill_some(picture, points, colours):
    height, width = picture.shape[:2]
    first, last = _middles(points[..., 1].min(axis=1), points[..., 1].max(axis=1), height)
    triangle, row = _steps(first, last)
    middle = row + 0.5
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for k in range(3):
        (ax, ay), (bx, by) = points[triangle, k].T, points[triangle, (k + 1) % 3].T
        crossed = (ay <= middle) != (by <= middle)
        with np.errstate(all="ignore"):
            x = np.where(crossed, ax + (middle - ay) / (by - ay) * (bx - ax), np.nan)
        left, right = np.fmin(left, x), np.fmax(right, x)
    crossed = left <= right
    triangle, row = triangle[crossed], row[crossed]
    first, last = _middles(left[crossed], right[crossed], width)
    span, column = _steps(first, last)
    picture[row[span], column] = colours[triangle[span]]


def _middles(low, high, count):
    """The first pixel whose middle is not before `low`, and the first whose middle is not before `high`."""
    return tuple(np.clip(np.ceil(end - 0.5), 0, count).astype(np.int64) for end in (low, high))


def _steps(first, last):
    """All whole numbers from `first` up to `last`, without it, one range after the other: (number of the range, it)."""
    counts = np.maximum(last - first, 0)
    of = np.repeat(np.arange(len(counts)), counts)
    return of, first[of] + np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)


def _draw_lines(picture, ends):
    """Draws lines, (m, 2, 2) in pixels, as wide as two pixels."""
    height, width = picture.shape[:2]
    bounds = np.array((width, height), np.float64)
    ends = np.clip(ends, -bounds, 2 * bounds)  # lines far outside are not followed there
    counts = np.ceil(np.abs(ends[:, 1] - ends[:, 0]).max(axis=1, initial=0.0)).astype(np.int64) + 1
    of, step = _steps(np.zeros_like(counts), counts)
    share = (step / np.maximum(counts[of] - 1, 1))[:, None]
    places = np.floor(ends[of, 0] + share * (ends[of, 1] - ends[of, 0])).astype(np.int64)
    for shift in ((0, 0), (-1, 0), (0, -1), (-1, -1)):
        x, y = (places + shift).T
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        picture[y[inside], x[inside]] = BORDER
