"""Whether islands lie in the square a margin apart, found by GEOS and by none of our code; and how much they cover."""

import numpy as np
import shapely

SIZE = 1024  # texels a side of the square
MARGIN = 2.0  # least distance of two islands in texels; half of it is kept to the border of the square
# What single precision moves a coordinate by is far below, and a packer that works with it is not to fail by that.
TOLERANCE = 1e-3


def scaled_to_square(placed):
    """The same positions, moved and scaled so that half a margin is left between islands and square."""
    every = np.concatenate(placed)
    low, high = every.min(axis=0), every.max(axis=0)
    scale = (SIZE - MARGIN) / (high - low).max()
    return [(points - low) * scale + MARGIN / 2 for points in placed], scale


def least_gap(islands, placed):
    """Least distance of two islands, 0 where two overlap, infinite where none are nearer than twice the margin."""
    shapes = [_shape(island, points) for island, points in zip(islands, placed, strict=True)]
    borders = shapely.boundary(np.array(shapes, dtype=object))
    tree = shapely.STRtree(borders)
    ones, others = tree.query(borders, predicate="dwithin", distance=2 * MARGIN)
    apart = ones < others
    least = np.inf
    if apart.any():
        least = float(shapely.distance(borders[ones[apart]], borders[others[apart]]).min())
    # One inside another: a point of it is in the other's inside.
    inside, around = shapely.STRtree(np.array(shapes, dtype=object)).query(
        shapely.points([points[island.loops[0][0]] for island, points in zip(islands, placed, strict=True)]),
        predicate="within",
    )
    return 0.0 if (inside != around).any() else least


def _shape(island, points):
    rings = [points[loop] for loop in island.loops if len(loop) >= 3]
    return shapely.Polygon(rings[0], rings[1:])


def cover(islands, scale):
    """Share of the square that the islands cover at so many texels to a unit."""
    return sum(island.area for island in islands) * scale**2 / SIZE**2


def rigid_scale(islands, placed):
    """The scale that all islands have, from their areas, and by which share theirs differ from it at most."""
    scales, weights = [], []
    for island, points in zip(islands, placed, strict=True):
        a, b, c = (points[island.triangles[:, k]] for k in range(3))
        area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum()
        scales.append(np.sqrt(area / island.area))
        weights.append(island.area)
    scales, weights = np.array(scales), np.array(weights)
    common = float(np.sqrt((scales**2 * weights).sum() / weights.sum()))
    return common, float(np.abs(scales / common - 1).max())
