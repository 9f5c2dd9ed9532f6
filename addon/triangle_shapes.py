"""What each triangle of a surface is in a UV map: its areas, and its lines that are longest and shortest there.

Knows nothing of Blender.
"""

from dataclasses import dataclass

import numpy as np


@dataclass
class Shapes:
    """What each triangle of a selection is on the surface and in pixels."""

    face: np.ndarray  # (t,)
    surface: np.ndarray  # (t,) area
    pixels: np.ndarray  # (t,) area, negative where it is seen from behind
    longest: np.ndarray  # (t,) most that a line is longer on the surface than in pixels
    shortest: np.ndarray  # (t,) least

    @classmethod
    def of(cls, selection, uv, size):
        triangles = selection.corner_triangles
        if triangles is None:
            triangles = np.arange(len(uv), dtype=np.int32).reshape(-1, 3)
        face = np.repeat(np.arange(selection.face_count), np.diff(selection.face_offsets))[triangles[:, 0]]
        ends = np.ascontiguousarray(triangles.T)  # each coordinate is an array of its own, which is read in one go
        with np.errstate(all="ignore"):
            one, other = _sides(selection.positions, selection.corner_vertices[ends])
            normal = [one[i] * other[j] - one[j] * other[i] for i, j in ((1, 2), (2, 0), (0, 1))]
            surface = 0.5 * np.sqrt(sum(x * x for x in normal))
            (ax, ay), (bx, by) = (
                [side * length for side, length in zip(sides, size, strict=True)] for sides in _sides(uv, ends)
            )
            twice = ax * by - ay * bx
            along_u = [(p * by - q * ay) / twice for p, q in zip(one, other, strict=True)]
            along_v = [(q * ax - p * bx) / twice for p, q in zip(one, other, strict=True)]
            uu, uv_, vv = (
                sum(p * q for p, q in zip(first, second, strict=True))
                for first, second in ((along_u, along_u), (along_u, along_v), (along_v, along_v))
            )
            longest = np.sqrt(0.5 * (uu + vv + np.hypot(uu - vv, 2 * uv_)))
            pixels = 0.5 * twice
            shortest = surface / np.abs(pixels) / longest
        return cls(face, surface, pixels, longest, shortest)


def _sides(points, ends):
    """From the first of each triangle's corners to the second and to the third: each a list of coordinates, (t,).

    `ends` are the first, second and third corners, (3, t).
    """
    a, b, c = ([column[end] for column in points.T.astype(np.float64)] for end in ends)
    return [[y - x for x, y in zip(a, to, strict=True)] for to in (b, c)]


def medians(values, weights, group, count):
    """The median of values by weight in each of `count` groups; 1 where there is no value."""
    order = np.lexsort([values, group])
    group, sums = group[order], np.cumsum(weights[order])
    medians = np.ones(count)
    if len(order):
        first = np.flatnonzero(np.append(True, group[1:] != group[:-1]))
        last = np.append(first[1:], len(order)) - 1
        before = np.where(first > 0, sums[first - 1], 0.0)
        middle = np.searchsorted(sums, 0.5 * (before + sums[last]))
        medians[group[first]] = values[order[np.clip(middle, first, last)]]
    return medians


def mirrored(island, shapes):
    """Which islands lie in the map as they look from behind, for the most part, (k,) bool."""
    of = island[shapes.face]
    known = (of >= 0) & np.isfinite(shapes.pixels)
    return np.bincount(of[known], shapes.pixels[known], int(island.max(initial=-1)) + 1) < 0
