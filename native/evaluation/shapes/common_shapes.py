"""Common shapes, each in three proportions: what `make shapes` draws and `tests/test_shapes.py` has expectations of.

The front of all of them is -y, and z is up, as in Blender. `SHAPES` lists them; `variants` gives a mesh as it is
modelled, in triangles, and turned.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

REPO = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(REPO / "blender_scripts"), str(REPO / "native" / "paper")]

import sculpt_mesh  # noqa: E402
import shapes  # noqa: E402

FULL_TURN = 2 * np.pi
# Sides of what is round: few enough for a game, enough to look round.
SIDES = 24
HEAD_CELLS = 16  # along each side of the cube that a head is made of
FROM_ABOVE = (0.4, -1.0, 1.2)  # where flat things are seen from


# Parts that shapes are made of: (positions, polygons) -----------------------------------------------------------------


def grid(columns, rows, place, wrapped=(False, False)):
    """Quads whose vertices are place(u, v), u and v from 0 to 1; wrapped, the last column (row) meets the first."""
    across, along = columns + (not wrapped[0]), rows + (not wrapped[1])
    u, v = np.meshgrid(np.arange(across) / columns, np.arange(along) / rows)
    positions = np.stack(np.broadcast_arrays(*place(u, v)), axis=-1).reshape(-1, 3).astype(float)
    row, column = np.mgrid[0:rows, 0:columns]
    above, right = (row + 1) % along, (column + 1) % across
    corners = [row * across + column, row * across + right, above * across + right, above * across + column]
    return positions, list(np.stack(corners, axis=-1).reshape(-1, 4))


def turned_profile(profile, sides=SIDES, closed=False, caps=True):
    """A body of revolution around z from (radius, height), upwards; a closed profile makes a ring, others get caps."""
    radius, height = np.array(profile, float).T
    rows = len(radius) if closed else len(radius) - 1

    def place(u, v):
        row = np.rint(v * rows).astype(int)
        return radius[row] * np.cos(FULL_TURN * u), radius[row] * np.sin(FULL_TURN * u), height[row]

    positions, polygons = grid(sides, rows, place, (True, closed))
    if caps and not closed:
        ring = np.arange(sides)
        polygons += [ring[::-1], rows * sides + ring]
    return positions, polygons


def box(size, cells=(1, 1, 1)):
    """A box around the origin, its sides divided into so many quads along each axis."""
    size, cells = np.array(size, float), np.array(cells)
    positions, polygons, first = [], [], 0
    for axis in range(3):
        across, along = (axis + 1) % 3, (axis + 2) % 3
        for side in (-0.5, 0.5):

            def place(u, v, axis=axis, across=across, along=along, side=side):
                point = [None, None, None]
                point[axis], point[across], point[along] = side + 0 * u, u - 0.5, v - 0.5
                return [p * s for p, s in zip(point, size, strict=True)]

            points, quads = grid(cells[across], cells[along], place)
            positions.append(points)
            polygons += [first + (q if side > 0 else q[::-1]) for q in quads]
            first += len(points)
    return welded(np.concatenate(positions), polygons)


def welded(positions, polygons):
    """The same with vertices at one place as one, in the order of their first use."""
    _, first, place = np.unique(np.round(positions, 9), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    number = rank[place.reshape(-1)]
    return positions[first[order]], [number[np.asarray(p)] for p in polygons]


def joined(parts):
    """Several parts as one mesh, not joined to each other."""
    first = np.cumsum([0, *(len(positions) for positions, _ in parts)])
    polygons = [np.asarray(p) + start for (_, of_part), start in zip(parts, first, strict=False) for p in of_part]
    return np.concatenate([positions for positions, _ in parts]), polygons


def moved(part, by=(0, 0, 0), turn=0.0, scale=(1, 1, 1)):
    """A part scaled, turned about z and moved."""
    positions, polygons = part
    c, s = math.cos(turn), math.sin(turn)
    return positions * scale @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + by, polygons


def plate(outlines, height):
    """A flat plate between rings of as many points each, the outer first: two flat sides, and a wall for each ring."""
    outer, inner = outlines
    n = len(outer)
    levels = [np.column_stack([ring, np.full(n, z)]) for ring in (outer, inner) for z in (0.0, height)]
    polygons = []
    for k in range(n):
        a, b = k, (k + 1) % n
        polygons += [
            [a, b, n + b, n + a],
            [2 * n + b, 2 * n + a, 3 * n + a, 3 * n + b],
            [b, a, 2 * n + a, 2 * n + b],
            [n + a, n + b, 3 * n + b, 3 * n + a],
        ]
    return np.concatenate(levels), polygons


def tube(path, radius, sides, caps=False):
    """A tube around a line of points, its cross-sections at right angles to it and not twisted."""
    path = np.array(path, float)
    ahead = np.gradient(path, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    side = np.cross(ahead[0], (0.0, 0.0, 1.0) if abs(ahead[0, 2]) < 0.9 else (1.0, 0.0, 0.0))
    rings = []
    for point, direction in zip(path, ahead, strict=True):
        side = side - direction * (side @ direction)
        side /= np.linalg.norm(side)
        other = np.cross(direction, side)
        angle = FULL_TURN * np.arange(sides)[:, None] / sides
        rings.append(point + radius * (np.cos(angle) * side + np.sin(angle) * other))
    rows = len(path) - 1
    _, polygons = grid(sides, rows, lambda u, v: (u, v, 0 * u), (True, False))
    if caps:
        polygons += [np.arange(sides)[::-1], rows * sides + np.arange(sides)]
    return np.concatenate(rings), polygons


# The shapes -----------------------------------------------------------------------------------------------------------


def cylinder(height):
    return turned_profile([(1, 0), (1, height)])


def rows_cylinder(height):
    return turned_profile([(1, z) for z in np.linspace(0, height, 9)])


def barrel(bulge):
    return turned_profile([(1 - bulge * t * t, 1.25 * t) for t in np.linspace(-1, 1, 9)])


def bottle(height, neck):
    turn = np.linspace(0, np.pi, 7)[1:]
    shoulder = [(1 - (1 - neck) * 0.5 * (1 - math.cos(t)), height + t / np.pi) for t in turn]
    wall = [(1.0, z) for z in np.linspace(0, height, 5)]
    return turned_profile([*wall, *shoulder, (neck, height + 1.5)])


def cone(height):
    angle = FULL_TURN * np.arange(SIDES) / SIDES
    positions = np.vstack([np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), (0, 0, height)])
    return positions, [np.arange(SIDES)[::-1], *([k, (k + 1) % SIDES, SIDES] for k in range(SIDES))]


def pyramid(height):
    positions = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, height)]
    return np.array(positions, float), [[3, 2, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


def bevelled_box(flat, bevel, strips):
    """A box with flat sides of these lengths between round bevels of so many quads."""
    cells = 2 * strips + 1
    positions, polygons = box((cells,) * 3, (cells,) * 3)
    sign = np.sign(positions)
    out = sign * np.tan(0.25 * np.pi * (np.abs(positions) - 0.5) / strips)
    core = sign * 0.5 * np.array(flat, float)
    return core + bevel * out / np.linalg.norm(out, axis=1)[:, None], polygons


def frame(inner):
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    positions, polygons = plate((corner, inner * corner), 0.3)
    return positions[:, [0, 2, 1]] * (1, -1, 1), polygons  # upright, as it hangs on a wall


def crate(size):
    """A box whose sides are sunk between their rims."""
    positions, polygons = box(size)
    points, faces = [*positions], []
    rim, depth = 0.12 * min(size), 0.06 * min(size)
    for polygon in polygons:
        corner = positions[polygon]
        middle = corner.mean(axis=0)
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        normal /= np.linalg.norm(normal)
        # Each corner moved by the width of the rim along both sides that meet in it.
        toward = [(np.roll(corner, -k, axis=0) - corner) for k in (1, -1)]
        inset = corner + sum(rim * t / np.linalg.norm(t, axis=1)[:, None] for t in toward)
        assert np.allclose(inset.mean(axis=0), middle), "the rim is as wide on all sides"
        first = len(points)
        points += [*inset, *(inset - depth * normal)]
        for k in range(4):
            a, b = k, (k + 1) % 4
            faces += [
                [polygon[a], polygon[b], first + b, first + a],
                [first + a, first + b, first + 4 + b, first + 4 + a],
            ]
        faces.append([first + 4 + k for k in range(4)])
    return np.array(points), faces


def pipe_bend(radius, turn):
    """An open pipe of radius 0.5 that bends by an angle around z at this distance from the axis."""

    def place(u, v):
        away = radius + 0.5 * np.cos(FULL_TURN * u)
        return away * np.cos(turn * v), away * np.sin(turn * v), -0.5 * np.sin(FULL_TURN * u)

    return grid(12, round(12 * turn / (0.5 * np.pi)), place, (True, False))


def cable(turns, length):
    """A thin tube with round ends left out, that winds about the x axis."""
    t = np.linspace(0, 1, 61)
    angle = FULL_TURN * turns * t
    return tube(np.column_stack([length * t, 0.6 * np.cos(angle), 0.6 * np.sin(angle)]), 0.08, 8)


def belt(distance, width):
    """A closed band around two wheels of radius 1 and 0.6, thin beside its width."""
    sides = 16
    lean = math.asin(0.4 / distance)  # of the straight parts, which touch both wheels
    high = np.linspace(0.5 * np.pi - lean, 1.5 * np.pi + lean, sides + 1)
    low = np.linspace(-0.5 * np.pi + lean, 0.5 * np.pi - lean, sides + 1)

    def ring(more):
        large = (1 + more) * np.column_stack([np.cos(high), np.sin(high)])
        small = (0.6 + more) * np.column_stack([np.cos(low), np.sin(low)]) + (distance, 0)
        return np.concatenate([large, small])

    positions, polygons = plate((ring(0.06), ring(0.0)), width)
    return positions[:, [0, 2, 1]] * (1, -1, 1), polygons


def road(bend, rise):
    """A sheet 1 wide that follows a line: an arc, two arcs against each other, or a hill."""
    t = np.linspace(0, 1, 41)
    heading = bend(t)
    step = 12.0 / 40
    x = np.concatenate([[0], np.cumsum(step * np.cos(0.5 * (heading[1:] + heading[:-1])))])
    y = np.concatenate([[0], np.cumsum(step * np.sin(0.5 * (heading[1:] + heading[:-1])))])
    z = rise * np.sin(np.pi * t) ** 2

    def place(u, v):
        k = np.rint(40 * u).astype(int)
        across = v - 0.5
        return x[k] - across * np.sin(heading[k]), y[k] + across * np.cos(heading[k]), z[k] + 0 * v

    return grid(40, 2, place)


def skirt(front, flare):
    """An open tube as a skirt is: its front this much deeper than its back, wider below, round over the hips."""

    def place(u, v):
        angle = FULL_TURN * u
        wide = 1 + flare * (1 - v) + 0.25 * np.sin(3 * (1 - v)) * (1 + 0.4 * np.cos(2 * angle))
        deep = np.where(np.cos(angle) > 0, front, 1.0)
        return 1.1 * wide * np.sin(angle), -wide * deep * np.cos(angle), 2 * v + 0 * u

    return grid(SIDES, 8, place, (True, False))


def torus(thickness):
    def place(u, v):
        away = 1 + thickness * np.cos(FULL_TURN * v)
        return away * np.cos(FULL_TURN * u), away * np.sin(FULL_TURN * u), thickness * np.sin(FULL_TURN * v)

    return grid(32, 16, place, (True, True))


def uv_sphere(segments, rings):
    angle = np.linspace(0, np.pi, rings + 1)[1:-1]
    positions, polygons = turned_profile(np.column_stack([np.sin(angle), -np.cos(angle)]), segments, caps=False)
    south, north, last = len(positions), len(positions) + 1, (rings - 2) * segments
    for k in range(segments):
        then = (k + 1) % segments
        polygons += [[south, then, k], [north, last + k, last + then]]
    return np.vstack([positions, (0, 0, -1), (0, 0, 1)]), polygons


def ball(cells):
    return sculpt_mesh.cube_sphere(cells)


def gear(teeth):
    steps = [(0.0, 1.0), (0.15, 1.25), (0.35, 1.25), (0.5, 1.0)]
    angle = FULL_TURN * np.array([k + along for k in range(teeth) for along, _ in steps]) / teeth
    radius = np.array([r for _ in range(teeth) for _, r in steps])
    hole = FULL_TURN * np.arange(4 * teeth) / (4 * teeth)
    outer = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return plate((outer, 0.4 * np.column_stack([np.cos(hole), np.sin(hole)])), 0.4)


def flange(height):
    """A machined part: a wide foot, a neck and a bore through both."""
    return turned_profile([(0.4, 0), (1.2, 0), (1.2, 0.25), (0.7, 0.25), (0.7, height), (0.4, height)], closed=True)


def bracket(length):
    """A machined part: two flat arms at a right angle, of one thickness, with edges that are not bevelled."""
    outline = np.array([(0, 0), (length, 0), (length, 0.25), (0.25, 0.25), (0.25, 1), (0, 1)], float)
    n = len(outline)
    positions = np.concatenate([np.column_stack([outline[:, 0], 0 * outline[:, 0] + y, outline[:, 1]]) for y in (0, 1)])
    walls = [[k, n + k, n + (k + 1) % n, (k + 1) % n] for k in range(n)]
    # Both flat sides begin in the corner from which all of the others are seen, so that a fan cuts them into triangles.
    return positions, [np.arange(n), n + np.roll(np.arange(n)[::-1], 1), *walls]


def fence(posts):
    spacing = 0.8
    parts = [moved(box((0.12, 0.12, 1.2)), (spacing * k, 0, 0.6)) for k in range(posts)]
    rail = box((spacing * (posts - 1) + 0.3, 0.06, 0.14))
    return joined([*parts, *(moved(rail, (0.5 * spacing * (posts - 1), -0.09, z)) for z in (0.4, 0.9))])


def table(length):
    leg = turned_profile([(0.05, 0), (0.07, 0.35), (0.08, 0.7)], 8)
    places = [(x * (0.5 * length - 0.12), y * 0.3, 0) for x in (-1, 1) for y in (-1, 1)]
    return joined([*(moved(leg, by) for by in places), moved(box((length, 0.8, 0.06)), (0, 0, 0.73))])


def bricks(rows):
    """A wall of equal bricks, every other row moved by half of one and each laid with a little play."""
    random = np.random.default_rng(rows)
    parts = []
    for row in range(rows):
        for k in range(rows):
            by = (0.26 * k + 0.13 * (row % 2), 0.004 * random.normal(), 0.08 * row)
            parts.append(moved(bevelled_box((0.22, 0.09, 0.05), 0.01, 1), by, 0.03 * random.normal()))
    return joined(parts)


def leaf():
    """A leaf: open, pointed at both ends, bent along and across."""

    def place(u, v):
        half = 0.22 * np.sin(np.pi * v) ** 0.8 + 0.01
        across = 2 * u - 1
        return half * across, v, 0.15 * v * v - 0.25 * half * across**2

    return grid(4, 8, place)


def leaves(count):
    """The same leaf on many places of a stem."""
    return joined([moved(leaf(), (0, 0, 0.25 * k), 2.4 * k) for k in range(count)])


def head(neck):
    """A head: brows, eye sockets, nose, lips, chin, ears and a neck that is open below; left and right are alike."""
    positions, polygons = sculpt_mesh.cube_sphere(HEAD_CELLS)
    x, y, z = positions.T

    def bump(at, width):
        at = np.array(at, float) / np.linalg.norm(at)
        return np.exp((positions @ at - 1) / width)

    def pair(at, width):
        return bump(at, width) + bump((-at[0], *at[1:]), width)

    radius = 1 + 0.32 * bump((0, -1, -0.12), 0.012) + 0.12 * bump((0, -1, 0.08), 0.015)
    radius += 0.08 * pair((0.35, -1, 0.32), 0.03) - 0.12 * pair((0.36, -1, 0.12), 0.02)
    radius += 0.10 * bump((0, -1, -0.45), 0.012) + 0.18 * bump((0, -1, -0.85), 0.03)
    radius += 0.35 * pair((1, 0.05, 0), 0.012) - 0.08 * pair((1, -0.25, 0), 0.02)
    shape = positions * radius[:, None] * (0.78, 0.95, 1.08)
    # By the rings of quads around the middle below, so that the neck's border is one of them.
    from_below = np.arctan2(np.maximum(np.abs(x), np.abs(y)), -z)
    stem = np.clip((0.75 - from_below) / 0.3, 0, 1)
    stem = stem * stem * (3 - 2 * stem)
    shape[:, 2] -= neck * stem
    shape[:, 1] += 0.25 * stem
    # Of the patch below, its middle is left out.
    centre = 0.5 * (HEAD_CELLS - 1)
    row, column = np.divmod(np.arange(HEAD_CELLS**2), HEAD_CELLS)
    middle = np.maximum(np.abs(row - centre), np.abs(column - centre)) < HEAD_CELLS / 4
    polygons = np.delete(polygons, HEAD_CELLS**2 + np.flatnonzero(middle), axis=0)
    used, number = np.unique(polygons, return_inverse=True)
    return shape[used], number.reshape(polygons.shape)


def rock(seed):
    """A stone: a ball under noise of four sizes, broken flat in places."""
    positions, polygons = sculpt_mesh.cube_sphere(12)
    random = np.random.default_rng(seed)
    radius = np.ones(len(positions))
    for octave in range(4):
        waves, phases = random.normal(size=(5, 3)) * 1.5 * 1.9**octave, random.uniform(0, FULL_TURN, 5)
        radius += 0.14 / 1.9**octave * np.sin(positions @ waves.T + phases).sum(axis=1) / math.sqrt(5)
    shape = positions * radius[:, None] * (1.2, 1.0, 0.8)
    for normal in random.normal(size=(6, 3)):
        normal /= np.linalg.norm(normal)
        beyond = np.clip(shape @ normal - 0.75, 0, None)
        shape -= 0.9 * beyond[:, None] * normal
    return shape, polygons


@dataclass(frozen=True)
class Shape:
    """A kind of shape in three proportions; what an artist expects of its layout is said in one sentence."""

    make: callable
    proportions: tuple
    expected: str
    view: tuple = (0.62, -1.0, 0.42)  # where the camera stands, seen from the shape


def _arc(t):
    return 1.2 * t


def _two_arcs(t):
    return 1.1 * np.sin(FULL_TURN * t)


def _straight(t):
    return 0 * t


_NET = "a net or six rectangles, every edge along an axis"
_WALL = "a rectangle, cut along its back, and two round discs"
_STRIP = "one straight strip, cut along the side that is hidden"
_COPIES = "one solution, copied to all parts that are alike"

SHAPES = {
    "box": Shape(box, (((1, 1, 1),), ((1, 2, 3), (2, 4, 6)), ((6, 1, 0.25), (6, 1, 1))), _NET),
    "cylinder": Shape(cylinder, ((0.5,), (2,), (8,)), _WALL),
    "cylinder in rows": Shape(rows_cylinder, ((0.5,), (2,), (8,)), _WALL),
    "barrel": Shape(barrel, ((0.1,), (0.25,), (0.4,)), _WALL),
    "bottle": Shape(bottle, ((2, 0.5), (3, 0.35), (6, 0.25)), "a rectangle, a shoulder as a fan, a neck, round ends"),
    "cone": Shape(cone, ((0.5,), (2,), (6,)), "a fan and a disc"),
    "pyramid": Shape(pyramid, ((1.5,), (2.5,), (4,)), "a net, or a fan and a square"),
    "bevelled box": Shape(
        bevelled_box,
        (((2, 2, 2), 0.15, 1), ((6, 1.5, 0.6), 0.08, 1), ((1.4, 1.4, 1.4), 0.3, 3)),
        "flat sides as rectangles, bevels as straight strips beside them",
    ),
    "frame": Shape(frame, ((0.7,), (0.8,), (0.9,)), "planes at right angles, upright"),
    "crate": Shape(crate, (((1, 1, 1),), ((1, 2, 1),), ((3, 1, 0.8),)), "planes at right angles, sides alike"),
    "pipe bend": Shape(pipe_bend, ((4, 0.5 * np.pi), (2, 0.5 * np.pi), (1.5, np.pi)), _STRIP),
    "cable": Shape(cable, ((0.5, 4), (1, 4), (2, 8)), _STRIP),
    "belt": Shape(belt, ((2.5, 0.4), (4, 0.4), (4, 1)), "four straight strips"),
    "road": Shape(road, ((_arc, 0), (_two_arcs, 0), (_straight, 1.5)), "one straight strip", FROM_ABOVE),
    "skirt": Shape(skirt, ((0.8, 0), (0.8, 0.3), (1.2, 0)), "one piece, cut along its back"),
    "torus": Shape(torus, ((0.15,), (0.35,), (0.6,)), "one or two straight strips, cut along the inner equator"),
    "UV sphere": Shape(uv_sphere, ((16, 8), (24, 12), (32, 16)), "two to six like pieces or gores"),
    "ball": Shape(ball, ((3,), (6,), (10,)), "two to six like pieces"),
    "gear": Shape(gear, ((8,), (12,), (20,)), "two flat rings, the hole and the teeth as straight strips"),
    "flange": Shape(flange, ((0.6,), (1,), (2.5,)), "rings round, walls as rectangles, cut at hard edges"),
    "bracket": Shape(bracket, ((0.8,), (1.5,), (3,)), "planes at right angles"),
    "fence": Shape(fence, ((3,), (6,), (10,)), _COPIES),
    "table": Shape(table, ((1,), (1.6,), (2.6,)), _COPIES),
    "bricks": Shape(bricks, ((2,), (3,), (5,)), _COPIES),
    "leaves": Shape(leaves, ((3,), (8,), (20,)), _COPIES, FROM_ABOVE),
    "head": Shape(head, ((0.3,), (0.6,), (1.2,)), "cut over the back and below the chin; the face whole and upright"),
    "rock": Shape(rock, ((1,), (2,), (3,)), "few charts, seams in hollows and below, smooth borders"),
}


# What is done with each -----------------------------------------------------------------------------------------------


def mesh(name, number):
    """A shape in one of its proportions, 0 to 2, as it is modelled."""
    shape = SHAPES[name]
    return shapes.of_polygons(f"{name} {number + 1}", *shape.make(*shape.proportions[number]), view=shape.view)


def triangulated(given):
    """The same with each polygon cut into triangles from its first corner on."""
    return shapes.of_polygons(f"{given.name}, triangles", given.positions, given.triangles(), view=given.view)


def turned(given):
    """The same in another place, turned about an axis that is none of the coordinates'."""
    axis = np.array([1.0, 2.0, 3.0]) / math.sqrt(14)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + math.sin(0.8) * cross + (1 - math.cos(0.8)) * cross @ cross
    positions = given.positions @ rotation.T + (3.0, -1.0, 2.0)
    return shapes.Mesh(f"{given.name}, turned", positions, given.corner_vertices, given.face_offsets, given.view)


def variants(name, number):
    """A shape as it is modelled, in triangles, and turned."""
    given = mesh(name, number)
    return [given, triangulated(given), turned(given)]
