"""The islands of a UV map, whoever made it, and which of them lie on each other. Knows nothing of Blender."""

import itertools

import numpy as np

# Of the longer side of the texture: UVs that are nearer to each other than this count as one place when stacks are
# looked for. It is half a pixel at 4096, less than anybody sees, and far more than single precision rounds by.
STACK_TOLERANCE = 1.0 / 8192
NEIGHBOURS = np.array(list(itertools.product((-1, 0, 1), repeat=2)), np.int64)


def islands(positions, corner_vertices, face_offsets, uv, part_of_face):
    """A number for each corner's place, (c,), and the island of each face, (f,) int32; -1 where a UV is not finite.

    Islands are numbered by their lowest face.

    Faces of one mesh are of one island where they touch: a corner of each is at the same place, on the surface as in
    the map. Whether both places belong to one vertex does not matter, since files often split vertices at every face.
    `part_of_face` is the number of each face's mesh, (f,).
    """
    sizes = np.diff(face_offsets)
    if not len(sizes):
        return np.empty(0, np.int64), np.empty(0, np.int32)
    mapped = np.logical_and.reduceat(np.isfinite(uv).all(axis=1), face_offsets[:-1])
    face_of_corner = np.repeat(np.arange(len(sizes)), sizes)
    corners = np.flatnonzero(mapped[face_of_corner])
    found = np.full(len(sizes), -1, np.int32)
    of_corners = np.full(len(face_of_corner), -1, np.int64)
    if not len(corners):
        return of_corners, found
    vertex_place = _vertex_places(positions, corner_vertices, part_of_face[face_of_corner])
    place, count = _corner_places(vertex_place[corner_vertices[corners]], _bits(uv[corners]))
    of_corners[corners] = place
    face = face_of_corner[corners]
    first = np.flatnonzero(np.append(True, face[1:] != face[:-1]))
    sizes_here = np.diff(np.append(first, len(face)))
    label = _connected(count, np.repeat(place[first], sizes_here), place)[place[first]]
    faces = face[first]
    # Numbers from 0 in the order of the lowest face.
    _, lowest, number = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(lowest), np.int32)
    rank[np.argsort(lowest)] = np.arange(len(lowest), dtype=np.int32)
    found[faces] = rank[number.reshape(-1)]
    return of_corners, found


def welded(positions, corner_vertices, part_of_corner):
    """The vertex of each corner, (c,) int32: of all vertices of its mesh that are at one place, the lowest."""
    place = _vertex_places(positions, corner_vertices, part_of_corner)
    _, lowest = np.unique(place, return_index=True)
    return lowest[place[corner_vertices]].astype(np.int32)


def _corner_places(on_surface, in_map):
    """A number for each corner, the same for those at one place on the surface and in the map; and a bound of these.

    `on_surface` is the number of each corner's place on the surface, `in_map` its UV as integers, (c, 2). Where the map
    is not cut, all corners of a place are together: so each is compared with one of them, and only those that are
    elsewhere, which are few as a rule, are sorted.
    """
    count = int(on_surface.max()) + 1
    one = np.empty(count, np.int64)
    one[on_surface] = np.arange(len(on_surface))
    in_map = np.ascontiguousarray(in_map).view(np.uint64).reshape(-1)
    elsewhere = np.flatnonzero(in_map != in_map[one[on_surface]])
    place = on_surface.copy()
    if len(elsewhere):
        others = in_map[elsewhere]
        halves = np.stack([others & np.uint64(0xFFFFFFFF), others >> np.uint64(32)], axis=1)
        rows = np.column_stack([on_surface[elsewhere].astype(np.uint32), halves.astype(np.uint32)])
        number, more = _equal_rows(rows)
        place[elsewhere] = count + number
        count += more
    return place, count


def _vertex_places(positions, corner_vertices, part_of_corner):
    """A number for each vertex, (n,), the same for those of one mesh that are at one place."""
    part = np.zeros((len(positions), 1), np.float32)
    part[corner_vertices] = part_of_corner[:, None]
    return _equal_rows(_bits(np.concatenate([part, positions], axis=1)))[0]


def _bits(numbers):
    """Single-precision numbers as integers that are equal where they are; of the two zeros it makes one."""
    return np.ascontiguousarray(numbers + np.float32(0.0), np.float32).view(np.uint32)


def _equal_rows(rows):
    """A number for each row of 32-bit integers, the same for equal rows, and how many numbers there are."""
    # Sorting by one number that equal rows share is several times as fast as sorting by all columns. Should others
    # share it, too, that shows where two of these come next to each other, and all columns are sorted by.
    mixed = _mixed(rows)
    order = np.argsort(mixed)
    new = _differ(rows, order)
    by_mixed = mixed[order]
    if not (new[1:] == (by_mixed[1:] != by_mixed[:-1])).all():
        order = np.lexsort(rows.T)
        new = _differ(rows, order)
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(new) - 1
    return number, int(new.sum())


def _mixed(rows):
    """A number for each row of integers, the same for equal rows, which different ones hardly ever share."""
    mixed = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        mixed = (mixed ^ column) * np.uint64(0x9E3779B97F4A7C15)  # odd: no two numbers become one by it
        mixed ^= mixed >> np.uint64(32)
    return mixed


def _differ(rows, order):
    """Which rows differ from the one before them, in this order, (n,) bool; the first does."""
    new = np.ones(len(order), bool)
    new[1:] = False
    for column in rows.T:
        ordered = column[order]
        new[1:] |= ordered[1:] != ordered[:-1]
    return new


def _connected(count, one, other):
    """The least element that each of `count` elements is connected to, where one[i] is connected to other[i]."""
    label = np.arange(count)
    while True:
        a, b = label[one], label[other]
        apart = a != b
        if not apart.any():
            return label
        one, other, a, b = one[apart], other[apart], a[apart], b[apart]
        # Every root but the least of its component is hung below a lower one, whichever that is: no circle can arise.
        label[np.maximum(a, b)] = np.minimum(a, b)
        while True:
            further = label[label]
            if (further == label).all():
                break
            label = further


def boxes(corner_island, count, points):
    """Least and greatest coordinates of each island's points, two of (k, 2); of one without points infinite.

    `corner_island` is the island of each point, (c,); -1 for those that are left out.
    """
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    order, starts, found = _by_island(corner_island, count)
    if len(found):
        for axis in (0, 1):
            values = points[:, axis][order]
            low[found, axis] = np.minimum.reduceat(values, starts[found])
            high[found, axis] = np.maximum.reduceat(values, starts[found])
    return low, high


def _by_island(corner_island, count):
    """The corners of islands, one island after the other; where each begins, (k,); and those that have any."""
    inside = np.flatnonzero(corner_island >= 0)
    of_inside = corner_island[inside]
    if (of_inside[1:] < of_inside[:-1]).any():
        inside = inside[np.argsort(of_inside, kind="stable")]
    order = inside
    sizes = np.bincount(of_inside, minlength=count)
    return order, np.cumsum(sizes) - sizes, np.flatnonzero(sizes)


def stacks(island, face_offsets, uv):
    """A number for each island that islands share which lie on each other; -1 for those that lie alone, (k,) int32.

    Islands lie on each other where each UV of one is at a UV of the other, mirrored or not: nobody makes that by
    accident. Islands without any extent are in no stack.
    """
    count = int(island.max(initial=-1)) + 1
    found = np.full(count, -1, np.int32)
    if count < 2:
        return found
    corner_island = np.repeat(island, np.diff(face_offsets))
    order, starts, _ = _by_island(corner_island, count)
    if not len(order):
        return found
    ends = np.append(starts[1:], len(order))
    box = np.concatenate(boxes(corner_island, count, uv), axis=1)
    # A box is looked for in its own cell and in those beside it, so that rounding parts none. Two cells may have one
    # key, which only costs a comparison.
    factors = np.array([1, 1_000_003, 998_244_353, 1_000_000_007], np.int64)
    keys = np.floor(box / (4 * STACK_TOLERANCE)).astype(np.int64) @ factors
    steps = np.array(list(itertools.product((-1, 0, 1), repeat=4)), np.int64) @ factors
    bottom = {}  # key of a box's cell -> the lowest islands of the piles that have it
    pile = np.arange(count)
    for number in range(count):
        if (box[number, 2:] - box[number, :2]).max() <= 4 * STACK_TOLERANCE:
            continue
        near = (keys[number] + steps).tolist()
        for other in itertools.chain.from_iterable(bottom[key] for key in near if key in bottom):
            same_box = np.abs(box[other] - box[number]).max() <= STACK_TOLERANCE
            if same_box and _same_places(*(uv[order[starts[k] : ends[k]]].astype(np.float64) for k in (number, other))):
                pile[number] = other
                break
        else:
            bottom.setdefault(int(keys[number]), []).append(number)
    _, number_of_pile, size = np.unique(pile, return_inverse=True, return_counts=True)
    shared = size > 1
    rank = np.cumsum(shared) - 1
    number_of_pile = number_of_pile.reshape(-1)
    found[shared[number_of_pile]] = rank[number_of_pile[shared[number_of_pile]]]
    return found


def _same_places(ones, others):
    """Whether each place of either set has one of the other set near it."""
    if len(ones) == len(others) and (np.abs(ones - others) <= STACK_TOLERANCE).all():
        return True  # copies, as a rule, have their corners in the same order
    sets = [np.unique(np.floor(places / STACK_TOLERANCE).astype(np.int64), axis=0) for places in (ones, others)]
    keys = [_keys(cells) for cells in sets]
    return all(
        np.logical_or.reduce([np.isin(_keys(cells + step), other) for step in NEIGHBOURS]).all()
        for cells, other in zip(sets, reversed(keys), strict=True)
    )


def _keys(cells):
    """One number for each cell."""
    return cells[:, 0] * np.int64(1 << 32) + cells[:, 1]
