"""Open surfaces with holes, handles and notches, where geodesics go round: no plane figure has their lengths.

Classical scaling takes every distance at its word; the likelihood hardly asks of two points that are far apart how far.
Every surface is a sheet of quads, bent and with waves, from which some are left out. The kinds were chosen before
anything was measured, how far each goes after a first and easier set, of which most were one chart with either model.
None was left out for its result.
"""

import numpy as np
import shapes

CELLS = 48  # of the longer side: a few thousand triangles


def _sheet(name, columns, rows, place, left_out):
    """Quads of the unit square but those whose middle is left out, each corner where `place` puts it."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    positions = np.stack(np.broadcast_arrays(*place(u, v)), axis=-1).reshape(-1, 3)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    quads = first[:, None] + [0, 1, columns + 2, columns + 1]
    s, t = (np.stack([u, v], axis=-1).reshape(-1, 2)[quads].mean(axis=1)).T
    kept = quads[~left_out(s, t)]
    return shapes.largest_piece(shapes.of_polygons(name, positions, kept), name)


def _holes(across, down, radius, aspect=1.0):
    """Round holes in rows; `aspect` is that of the sheet, across over down."""

    def left_out(s, t):
        x = (s * across) % 1 - 0.5
        y = ((t * down) % 1 - 0.5) * across / (down * aspect)
        return np.hypot(x, y) < radius

    return left_out


def _waves(height, across=2.0, down=1.5, phase=0.0):
    return lambda u, v: height * np.sin(2 * np.pi * across * u + phase) * np.cos(2 * np.pi * down * v + 0.5 * phase)


def _flat(height, aspect=1.0, turn=0.6, **waves):
    """A sheet with waves, rolled by `turn` of a cylinder: a flat one starts from its projection, with no embedding."""
    wave = _waves(height, **waves)

    def place(u, v):
        a, r = 2 * np.pi * turn * (u - 0.5), aspect / (2 * np.pi * turn) + wave(u, v)
        return r * np.sin(a), v, r * np.cos(a)

    return place


def _torus(ring, tube, turn, wave=0.0):
    """A part of a torus: `turn` of the ring along u, all of the tube along v."""

    def place(u, v):
        a, b = 2 * np.pi * turn * u, 2 * np.pi * v
        r = tube * (1 + wave * np.sin(5 * a) * np.cos(2 * b))
        return (ring + r * np.cos(b)) * np.cos(a), (ring + r * np.cos(b)) * np.sin(a), r * np.sin(b)

    return place


def _dome(angle, wave=0.0):
    """A square of a dome, `angle` (in degrees) from its pole to the middle of a side."""

    def place(u, v):
        x, y = np.radians(angle) * (2 * u - 1), np.radians(angle) * (2 * v - 1)
        r = np.maximum(np.hypot(x, y), 1e-9)
        size = 1 + wave * np.cos(5 * x) * np.cos(4 * y)
        return size * np.sin(r) * x / r, size * np.sin(r) * y / r, size * np.cos(r)

    return place


def _bent(turn, wave):
    """A plate rolled by `turn` of a cylinder that bellies."""

    def place(u, v):
        a = 2 * np.pi * turn * (u - 0.5)
        r = 1 / (2 * np.pi * turn) * (1.6 + wave * np.sin(np.pi * v) + 0.2 * wave * np.cos(6 * a))
        return r * np.sin(a), 1.4 * v, r * np.cos(a)

    return place


def _ramp(turns, pitch, wave):
    """A winding ramp."""

    def place(u, v):
        a, r = 2 * np.pi * turns * u, 0.5 + v
        return r * np.cos(a), r * np.sin(a), pitch * turns * u + wave * np.sin(7 * a) * np.sin(3 * v)

    return place


def _arms(count, waist):
    """What is not a star of so many arms."""

    def left_out(s, t):
        x, y = 2 * s - 1, 2 * t - 1
        return np.hypot(x, y) > waist + (1 - waist) * np.maximum(np.cos(count * np.arctan2(y, x)), 0) ** 1.5

    return left_out


def _comb(teeth, depth):
    return lambda s, t: (t > 1 - depth) & ((s * (2 * teeth - 1)).astype(int) % 2 == 1)


def _spiral(turns, width, dome):
    """A band in a spiral on a dome: `width` of the room between its turns, and `dome` the curvature."""

    def place(u, v):
        a = 2 * np.pi * turns * u
        r = (0.4 + turns * u + width * v) / (0.4 + turns + width)
        return r * np.cos(a), r * np.sin(a), np.sqrt(1 - (dome * r) ** 2) / dome

    return place


def _ring(inner, gap):
    """What is not a ring with a gap."""

    def left_out(s, t):
        x, y = 2 * s - 1, 2 * t - 1
        r = np.hypot(x, y)
        return (r > 1) | (r < inner) | ((np.abs(y) < gap) & (x > 0))

    return left_out


def _windows(across, down, share):
    return lambda s, t: (np.abs((s * across) % 1 - 0.5) < share / 2) & (np.abs((t * down) % 1 - 0.5) < share / 2)


def _none(s, t):
    return np.zeros(s.shape, dtype=bool)


def _either(*parts):
    return lambda s, t: np.logical_or.reduce([part(s, t) for part in parts])


def _notch(low, high, depth):
    return lambda s, t: (s > low) & (s < high) & (t > 1 - depth)


def surfaces(cells=CELLS):
    """One by one, each with a name of its own; several of a kind, from easy to hard."""
    n = cells
    for turn in (0.4, 0.7):
        yield _sheet(f"sheet with a hole, rolled {turn}", n, n, _flat(0.12, turn=turn), _holes(1, 1, 0.25))
        yield _sheet(f"sheet with nine holes, rolled {turn}", n, n, _flat(0.08, turn=turn), _holes(3, 3, 0.3))
        place = _flat(0.1, 4.0, turn=turn, across=5)
        yield _sheet(f"long sheet with holes, rolled {turn}", 2 * n, n // 2, place, _holes(4, 1, 0.3, 4.0))
        notches = _either(_notch(0.2, 0.3, 0.7), _notch(0.6, 0.7, 0.5))
        yield _sheet(f"notched sheet, rolled {turn}", n, n, _flat(0.12, turn=turn, across=1.5), notches)
        yield _sheet(f"plate with windows, bent {turn}", n, n, _bent(turn, 0.35), _windows(3, 2, 0.55))
        yield _sheet(f"star, rolled {turn}", n, n, _flat(0.15, turn=turn, across=1.2), _arms(5, 0.3))
    for teeth in (3, 4, 6):
        yield _sheet(f"comb of {teeth}", n, n, _flat(0.08), _comb(teeth, 0.75))
    for inner, angle in ((0.5, 65), (0.55, 100), (0.75, 130)):
        yield _sheet(f"ring of a dome of {angle}", n, n, _dome(angle), _ring(inner, 0.06))
        yield _sheet(f"ring with a gap, {inner}", n, n, _flat(0.15), _ring(inner, 0.08))
    for angle, holes in ((50, 4), (75, 3), (90, 5)):
        yield _sheet(f"perforated dome of {angle}", n, n, _dome(angle), _holes(holes, holes, 0.3))
        slit = _either(_notch(0.45, 0.55, 0.45), _holes(3, 3, 0.15))
        yield _sheet(f"notched dome of {angle}", n, n, _dome(angle, 0.03), slit)
    for turns in (1.5, 2.5, 4.0):
        yield _sheet(f"spiral of {turns}", 4 * n, n // 6, _spiral(turns, 0.75, 0.9), _none)
        yield _sheet(f"ramp of {turns}", 3 * n, n // 3, _ramp(turns, 0.5, 0.05), _holes(6, 1, 0.2, 5.0))
    for turn in (0.4, 0.6, 0.93):
        yield _sheet(f"bent tube, {turn}", n, n // 2, _torus(1.0, 0.35, turn), _none)
        yield _sheet(f"notched tube, {turn}", n, n // 2, _torus(1.0, 0.35, turn, 0.1), _notch(0.3, 0.7, 0.4))
        yield _sheet(f"torus with a slit, {turn}", 2 * n, n // 2, _torus(1.0, 0.4, turn), _notch(0.4, 0.6, 0.5))
        slit = _either(_notch(0, 1, 0.1), _holes(4, 3, 0.25))
        yield _sheet(f"slit tube with holes, {turn}", n, n, _torus(1.2, 0.4, turn, 0.05), slit)
