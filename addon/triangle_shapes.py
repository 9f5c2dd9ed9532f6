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
        with np.errstate(all="ignore"):
            a, b, c = selection.positions.astype(np.float64)[selection.corner_vertices[triangles]].transpose(1, 0, 2)
            one, other = b - a, c - a
            surface = 0.5 * np.linalg.norm(np.cross(one, other), axis=1)
            a, b, c = (uv.astype(np.float64) * size)[triangles].transpose(1, 0, 2)
            (ax, ay), (bx, by) = (b - a).T, (c - a).T
            twice = ax * by - ay * bx
            along_u = (one * by[:, None] - other * ay[:, None]) / twice[:, None]
            along_v = (other * ax[:, None] - one * bx[:, None]) / twice[:, None]
            uu, uv_, vv = ((p * q).sum(axis=1) for p, q in ((along_u, along_u), (along_u, along_v), (along_v, along_v)))
            longest = np.sqrt(0.5 * (uu + vv + np.hypot(uu - vv, 2 * uv_)))
            pixels = 0.5 * twice
            shortest = surface / np.abs(pixels) / longest
        return cls(face, surface, pixels, longest, shortest)


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
