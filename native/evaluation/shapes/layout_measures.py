"""What an artist looks at in a layout: borders, outlines of charts, sides along the axes, rectangles, bent quads."""

from functools import cached_property

import numpy as np

# A border is along an axis if it is within one degree of it.
ALONG_AXIS = np.tan(np.radians(1.0))
# A chart is a rectangle if it covers so much of its box along the axes.
COVERED_BY_RECTANGLE = 0.98
# The cosine between the normals of a quad's corner and of the whole: one that is warped by more may bend in UV.
WARPED = np.cos(np.radians(20.0))


class Layout:
    """A mesh with a UV a corner and a chart a face. A side of a face is named by the corner that it starts at.

    Given numbers of parts of charts in place of those of charts, it measures the parts, as if they were cut out. Faces
    whose number is negative are left out.
    """

    def __init__(self, mesh, uv, chart):
        self.mesh = mesh
        self.uv = np.asarray(uv, float)
        self.chart = np.asarray(chart)
        corners, offsets = mesh.corner_vertices, mesh.face_offsets
        sizes = np.diff(offsets)
        self.face_of_corner = np.repeat(np.arange(len(sizes)), sizes)
        filled = sizes > 0
        self.following = np.arange(1, len(corners) + 1)
        self.following[offsets[1:][filled] - 1] = offsets[:-1][filled]
        self._find_borders(corners)

    def _find_borders(self, corners):
        owner = self.chart[self.face_of_corner]
        start, end = corners, corners[self.following]
        forward = start < end
        ends = np.stack([np.where(forward, start, end), np.where(forward, end, start)], axis=1)
        here, there = self.uv, self.uv[self.following]
        lies = np.where(forward[:, None], np.hstack([here, there]), np.hstack([there, here]))
        _, number, sharing = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
        number = number.reshape(-1)
        order = np.argsort(number, kind="stable")
        first = np.concatenate([[0], np.cumsum(sharing)[:-1]])
        pairs = sharing == 2
        one, other = order[first[pairs]], order[first[pairs] + 1]
        whole = (lies[one] == lies[other]).all(axis=1) & (owner[one] == owner[other])
        self.is_border = owner >= 0
        self.is_border[one[whole]] = self.is_border[other[whole]] = False
        # A seam has surface on both sides; it is counted once.
        shared = order[first[sharing > 1]]
        self.seams = shared[self.is_border[shared]]

    @property
    def seam_vertices(self):
        """The two ends of each seam, (s, 2)."""
        corners = self.mesh.corner_vertices
        return np.stack([corners[self.seams], corners[self.following[self.seams]]], axis=1)

    @cached_property
    def triangles(self):
        """Corners of all mapped triangles, and the chart of each."""
        triangles = self.mesh.corner_triangles()
        chart = self.chart[self.face_of_corner[triangles[:, 0]]]
        return triangles[chart >= 0], chart[chart >= 0]

    @cached_property
    def areas(self):
        """The UV area of each chart."""
        triangles, chart = self.triangles
        a, b, c = np.moveaxis(self.uv[triangles], 1, 0)
        twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        return np.bincount(chart, 0.5 * np.abs(twice), minlength=self.chart.max() + 1)

    @cached_property
    def boxes(self):
        """Least and greatest UV of each chart, (charts, 2, 2)."""
        owner = self.chart[self.face_of_corner]
        found = np.empty((len(self.areas), 2, 2))
        found[:, 0], found[:, 1] = np.inf, -np.inf
        np.minimum.at(found[:, 0], owner[owner >= 0], self.uv[owner >= 0])
        np.maximum.at(found[:, 1], owner[owner >= 0], self.uv[owner >= 0])
        return found

    @property
    def filled(self):
        """The share of its box that each chart fills."""
        extent = self.boxes[:, 1] - self.boxes[:, 0]
        return self.areas / np.maximum(extent.prod(axis=1), np.finfo(float).tiny)

    def rectangles(self):
        """The share of the UV area in charts that are rectangles along the axes."""
        return self.areas[self.filled >= COVERED_BY_RECTANGLE].sum() / self.areas.sum()

    def aligned(self, chart=None):
        """The share of the borders' length in UV that is along an axis, of all charts or of one."""
        sides = np.flatnonzero(self.is_border)
        if chart is not None:
            sides = sides[self.chart[self.face_of_corner[sides]] == chart]
        step = np.abs(self.uv[self.following[sides]] - self.uv[sides])
        length = np.hypot(*step.T)
        along = step.min(axis=1) <= ALONG_AXIS * step.max(axis=1)
        return length[along].sum() / length.sum() if length.sum() else 1.0

    def bent(self):
        """Whether each face is a quad that is convex on the surface and not in UV."""
        bent = np.zeros(len(self.chart), bool)
        faces = np.flatnonzero((np.diff(self.mesh.face_offsets) == 4) & (self.chart >= 0))
        corner = self.mesh.face_offsets[faces][:, None] + np.arange(4)
        place, flat = self.mesh.positions[self.mesh.corner_vertices[corner]], self.uv[corner]
        side = np.roll(place, -1, axis=1) - place
        turn = np.cross(side, np.roll(side, -1, axis=1))
        normal = np.cross(place[:, 2] - place[:, 0], place[:, 3] - place[:, 1])
        size = np.linalg.norm(turn, axis=2) * np.linalg.norm(normal, axis=1)[:, None]
        convex = (np.einsum("fkx,fx->fk", turn, normal) > WARPED * size).all(axis=1)
        side = np.roll(flat, -1, axis=1) - flat
        after = np.roll(side, -1, axis=1)
        turn = side[..., 0] * after[..., 1] - side[..., 1] * after[..., 0]
        bent[faces] = convex & ~((turn > 0).all(axis=1) | (turn < 0).all(axis=1))
        return bent

    def outlines(self, chart):
        """The borders of a chart, longest first, each as the corners at which its sides start, one after the other."""
        sides = np.flatnonzero(self.is_border & (self.chart[self.face_of_corner] == chart))
        key = {}
        for side in sides.tolist():
            key.setdefault(self._point(side), []).append(side)
        found, left = [], set(sides.tolist())
        for first in sides.tolist():
            loop, side = [], first
            while side in left:
                left.remove(side)
                loop.append(side)
                onward = [s for s in key.get(self._point(self.following[side]), ()) if s in left]
                side = onward[0] if onward else -1
            if loop:
                found.append(np.array(loop))
        return sorted(found, key=lambda loop: -self._length(loop))

    def _point(self, corner):
        return int(self.mesh.corner_vertices[corner]), *self.uv[corner].tolist()

    def _length(self, loop):
        return np.linalg.norm(self.uv[self.following[loop]] - self.uv[loop], axis=1).sum()


def corner_angles(points, least_turn=5.0):
    """The angles inside a closed line in the plane at the points where it turns by more than so many degrees."""
    points = points[np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1) > 0]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = np.degrees(np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)))
    turn *= 1 if turn.sum() >= 0 else -1
    return 180.0 - turn[np.abs(turn) > least_turn]


def roundness(points):
    """By how much the distances of points from their middle differ, as a share of their mean: 0 is a circle."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    return np.ptp(distance) / distance.mean()


def without_motion(points):
    """Distances between all pairs of points, which a motion or a mirror leaves alone, (n, n)."""
    return np.linalg.norm(points[:, None] - points[None], axis=-1)
