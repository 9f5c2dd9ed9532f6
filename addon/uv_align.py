"""By how much islands are turned so that what is straight on them lies along the axes. Knows nothing of Blender."""

import numpy as np

from . import uv_islands

QUARTER = 0.5 * np.pi
# Directions of borders are collected by whole degrees; those at most this many apart count as one.
BINS, NEAR_BINS = 90, 1
# An island has straight borders where this share of their length runs one way or across it: four sides of a circle of
# 90 corners are a twentieth.
STRAIGHT = 0.3
# Where there is none, boxes are tried at so many angles, and then finer around the best of them.
COARSE_ANGLES, FINE_ANGLES = 90, 41


def turns(place, face_offsets, island, count, points):
    """The angle by which each of `count` islands is turned, (k,), by no more than 45 degrees.

    `place` is the number of each corner's place as `uv_islands.islands` gives it, `points` are the corners' UVs in the
    proportions of the texture, `island` is that of each face, -1 for those that are left out. The longest straight
    borders of an island lie along the axes then, or else the sides of the smallest box around it.
    """
    ends, owner = _borders(place, face_offsets, island)
    along = points[ends[:, 1]] - points[ends[:, 0]]
    length = np.hypot(*along.T)
    angle = np.arctan2(along[:, 1], along[:, 0]) % QUARTER
    bins = np.minimum((angle / QUARTER * BINS).astype(np.int64), BINS - 1)
    found = np.zeros((count, BINS))
    np.add.at(found, (owner, bins), length)
    near = sum(np.roll(found, step, axis=1) for step in range(-NEAR_BINS, NEAR_BINS + 1))
    best = near.argmax(axis=1)
    total = found.sum(axis=1)
    straight = (near.max(axis=1, initial=0.0) >= STRAIGHT * total) & (total > 0)
    # The mean of the directions around the best one, which may be on either side of an axis.
    middle = (best + 0.5) / BINS * QUARTER
    away = (angle - middle[owner] + 0.5 * QUARTER) % QUARTER - 0.5 * QUARTER
    counts = np.abs(away) <= (NEAR_BINS + 0.5) / BINS * QUARTER
    weight = np.bincount(owner[counts], length[counts], count)
    mean = np.bincount(owner[counts], (length * away)[counts], count) / np.maximum(weight, 1e-300)
    result = np.where(straight, -(middle + mean), 0.0)
    order = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[order], np.arange(count + 1))
    for k in np.flatnonzero(~straight & (total > 0)):
        result[k] = _to_smallest_box(points[ends[order[starts[k] : starts[k + 1]], 0]])
    return (result + 0.5 * QUARTER) % QUARTER - 0.5 * QUARTER


def _borders(place, face_offsets, island):
    """The sides of faces that no other face of the islands has, as two corners (b, 2), and the island of each, (b,)."""
    following = np.arange(1, len(place) + 1)
    following[face_offsets[1:] - 1] = face_offsets[:-1]
    corner_island = np.repeat(island, np.diff(face_offsets))
    sides = np.flatnonzero(corner_island >= 0)
    pairs = np.sort(np.stack([place[sides], place[following[sides]]], axis=1), axis=1)
    order = np.lexsort(pairs.T)
    ordered = pairs[order]
    new = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))[: len(order)]
    group = np.cumsum(new) - 1
    alone = sides[order[np.bincount(group, minlength=1)[group] == 1]] if len(order) else sides
    return np.stack([alone, following[alone]], axis=1), corner_island[alone]


def _to_smallest_box(points):
    """The angle by which points are turned for the smallest box along the axes around them."""
    centred = points - points.mean(axis=0)
    step = QUARTER / COARSE_ANGLES

    def best_of(angles):
        cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
        x, y = cos * centred[:, 0] - sin * centred[:, 1], sin * centred[:, 0] + cos * centred[:, 1]
        return angles[(np.ptp(x, axis=1) * np.ptp(y, axis=1)).argmin()]

    return best_of(best_of(np.arange(COARSE_ANGLES) * step) + np.linspace(-step, step, FINE_ANGLES))


def turned(points, island, count, angles):
    """The points, each turned by the angle of its island around the middle of the island's box.

    Points of no island, -1, stay.
    """
    inside = island >= 0
    low, high = uv_islands.boxes(island, count, points)
    middle = 0.5 * (low[island[inside]] + high[island[inside]])
    cos, sin = np.cos(angles)[island[inside]], np.sin(angles)[island[inside]]
    x, y = (points[inside] - middle).T
    result = points.copy()
    result[inside] = middle + np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
    return result
