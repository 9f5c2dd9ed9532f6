"""A model drawn with its seams, what is behind hidden: by NumPy alone, so that it looks the same on any machine."""

import numpy as np

# Pixels tested at a time, which bounds the memory.
CHUNK_PIXELS = 2_000_000
# Seams lie in the surface: so much of the model's size nearer to the eye they are still seen.
IN_FRONT = 0.002
SMOOTHING = 2  # a picture is made so many times as large, then reduced
SEAM_RADIUS = 0.8  # pixels
BRIGHTNESS_ASIDE = 0.4  # of what is seen from its edge, against 1 for what faces the eye


def seen_from(positions, view):
    """Positions as right, up and towards the eye, which looks at them from the direction `view`; z is up."""
    toward = np.array(view, float) / np.linalg.norm(view)
    right = np.cross((0.0, 0.0, 1.0), toward)
    right /= np.linalg.norm(right)
    return positions @ np.stack([right, np.cross(toward, right), toward], axis=1)


def nearest(corners, size):
    """For each pixel the triangle that is seen there, or -1, and how near it is: two arrays (size, size).

    Triangles (t, 3, 3) are in pixels to the right and down, and nearness. Of two that are as near, the first is seen.
    """
    depth = np.full(size * size, -np.inf)
    seen = np.full(size * size, len(corners))
    low = np.clip(np.floor(corners[..., :2].min(axis=1)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(corners[..., :2].max(axis=1)), 0, size).astype(np.int64)
    extent = np.maximum((high - low).max(axis=1), 1)
    side_class = np.ceil(np.log2(extent)).astype(int)
    found = []
    for power in np.unique(side_class):  # triangles of about the same size at once
        side = 1 << int(power)
        members = np.flatnonzero(side_class == power)
        step = max(1, CHUNK_PIXELS // (side * side))
        for start in range(0, len(members), step):
            index = members[start : start + step]
            which, pixel, near = _covered(corners[index], low[index], side, size)
            np.maximum.at(depth, pixel, near)
            keep = near >= depth[pixel]
            found.append((index[which[keep]], pixel[keep], near[keep]))
    for index, pixel, near in found:
        front = near >= depth[pixel]
        np.minimum.at(seen, pixel[front], index[front])
    seen[seen == len(corners)] = -1
    return seen.reshape(size, size), depth.reshape(size, size)


def _covered(corners, low, side, size):
    """Which triangles cover the centres of which pixels, and how near they are there: three arrays as long."""
    offset = np.arange(side)
    x = (low[:, 0][:, None] + offset)[:, None, :] + 0.5
    y = (low[:, 1][:, None] + offset)[:, :, None] + 0.5
    a, b, c = (corners[:, k, :, None, None] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        of_b = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
        of_c = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / area
        inside = (of_b >= 0) & (of_c >= 0) & (of_b + of_c <= 1) & (area != 0)
    which, row, column = np.nonzero(inside)
    rows, columns = low[which, 1] + row, low[which, 0] + column
    fits = (rows < size) & (columns < size)
    which, row, column = which[fits], row[fits], column[fits]
    b_share, c_share = of_b[which, row, column], of_c[which, row, column]
    z = corners[which, :, 2]
    near = z[:, 0] + b_share * (z[:, 1] - z[:, 0]) + c_share * (z[:, 2] - z[:, 0])
    return which, rows[fits] * size + columns[fits], near


def picture(positions, triangles, colours, seams, view, size, background, seam_colour):
    """A model as (size, size, 3) uint8: its triangles in their colours and its seams, pairs of vertices, as lines."""
    large = size * SMOOTHING
    used = np.unique(triangles)
    turned = seen_from(positions - positions[used].mean(axis=0), view)
    low, high = turned[used].min(axis=0), turned[used].max(axis=0)
    extent = max((high - low)[:2].max(), np.finfo(float).tiny)
    scale = 0.92 * large / extent
    flat = np.empty_like(turned)
    flat[:, 0] = 0.5 * large + scale * (turned[:, 0] - 0.5 * (low[0] + high[0]))
    flat[:, 1] = 0.5 * large - scale * (turned[:, 1] - 0.5 * (low[1] + high[1]))
    flat[:, 2] = turned[:, 2] / extent
    seen, depth = nearest(flat[triangles], large)
    a, b, c = np.moveaxis(turned[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    facing = np.abs(normal[:, 2]) / np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    shaded = colours * (BRIGHTNESS_ASIDE + (1 - BRIGHTNESS_ASIDE) * facing)[:, None]
    canvas = np.empty((large, large, 3))
    canvas[:] = background
    canvas[seen >= 0] = shaded[seen[seen >= 0]]
    canvas[_seam_pixels(flat, seams, depth)] = seam_colour
    return canvas.reshape(size, SMOOTHING, size, SMOOTHING, 3).mean(axis=(1, 3)).round().astype(np.uint8)


def _seam_pixels(flat, seams, depth):
    """Where seams are seen: a mask of the picture."""
    mask = np.zeros(depth.shape, bool)
    if not len(seams):
        return mask
    large = len(depth)
    start, end = flat[seams[:, 0]], flat[seams[:, 1]]
    steps = np.ceil(2 * np.abs(end - start)[:, :2].max(axis=1)).astype(int) + 1
    which = np.repeat(np.arange(len(seams)), steps)
    share = (np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)) / np.repeat(
        np.maximum(steps - 1, 1), steps
    )
    point = start[which] + share[:, None] * (end - start)[which]
    column, row = (np.clip(np.floor(point[:, k]).astype(int), 0, large - 1) for k in (0, 1))
    # The farthest surface around the pixel, since on a slope that of the pixel itself may be nearer than the seam.
    around = np.full(len(point), np.inf)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            there = depth[np.clip(row + down, 0, large - 1), np.clip(column + right, 0, large - 1)]
            around = np.where(np.isfinite(there), np.minimum(around, there), around)
    visible = (point[:, 2] + IN_FRONT >= around) | ~np.isfinite(around)
    row, column = row[visible], column[visible]
    reach = int(np.ceil(SEAM_RADIUS * SMOOTHING))
    for down in range(-reach, reach + 1):
        for right in range(-reach, reach + 1):
            if np.hypot(down, right) <= SEAM_RADIUS * SMOOTHING:
                mask[np.clip(row + down, 0, large - 1), np.clip(column + right, 0, large - 1)] = True
    return mask
