"""The colours that are drawn on a surface: stretch by face and islands. Knows nothing of Blender.

Stretch is told by orange and blue, which people with any of the common kinds of colour blindness tell apart, and by
lightness: what is as it should be is nearly white, and the further off, the darker. A face may be drawn out along one
line and pressed together along another at once, so both colours are laid on each other and none hides the other: where
both are strong the face is nearly black. It is white only where no line of it is longer or shorter than it should be.
"""

import colorsys

import numpy as np

from . import triangle_shapes

FULL = 1.5  # lines that are longer, or shorter, than they should be by this factor have the full colour
NEUTRAL = np.array((0.93, 0.93, 0.91))
# What is left of the neutral colour where stretch is full, by red, green and blue.
STRETCHED = np.array((0.96, 0.45, 0.05))
SQUEEZED = np.array((0.06, 0.38, 0.80))
# Flipped, without area or without UVs: there is no number for these. Yellow is far from all the others to anybody.
BROKEN = np.array((0.97, 0.97, 0.05))
MANY = 2.0  # a factor from which on it is told as one, not in per cent
# Neighbouring numbers are far apart in hue and differ in lightness.
GOLDEN = 0.618033988749895
LIGHTNESS = (0.95, 0.65, 0.80)
SATURATION = (0.55, 0.75)


def face_stretch(shapes, island):
    """How far the lines of each face are off, two of (f,): the most that any is longer, and shorter, than it should be.

    Both are factors of 1 and more, where the texture looks larger on the surface and where it looks smaller. The lines
    of an island should be as long as those of half its area are, so that an island is not stretched for being scaled.
    Where a face is flipped against its island, or has no area or no UVs, both are NaN. `island` is that of each face,
    -1 without UVs.
    """
    count = int(island.max(initial=-1)) + 1
    of = island[shapes.face]
    known = (of >= 0) & np.isfinite(shapes.longest) & np.isfinite(shapes.shortest) & (shapes.shortest > 0)
    with np.errstate(all="ignore"):
        mean = np.sqrt(shapes.longest * shapes.shortest)
        usual = triangle_shapes.medians(mean[known], shapes.surface[known], of[known], count)
        usual = np.append(usual, np.nan)[of]
        longer, shorter = np.maximum(shapes.longest / usual, 1.0), np.maximum(usual / shapes.shortest, 1.0)
        behind = np.append(triangle_shapes.mirrored(island, shapes), False)[of]
        broken = ~known | ((shapes.pixels < 0) != behind)
    return tuple(_worst(np.where(broken, np.nan, factor), shapes.face, len(island)) for factor in (longer, shorter))


def _worst(values, face, count):
    """The greatest value of the triangles of each face, NaN where any is; triangles are in the order of faces."""
    if not len(values):
        return np.full(count, np.nan)
    starts = np.searchsorted(face, np.arange(count))
    worst = np.maximum.reduceat(values, np.minimum(starts, len(values) - 1))
    return np.where(np.bincount(face, minlength=count) > 0, worst, np.nan)


def stretch_colours(longer, shorter):
    """The colour of each face, (f, 3) of 0 to 1, by the factors of `face_stretch`."""
    longer, shorter = np.asarray(longer, np.float64), np.asarray(shorter, np.float64)
    strengths = [np.clip(np.log(factor) / np.log(FULL), 0.0, 1.0)[..., None] for factor in (longer, shorter)]
    tints = [1.0 - s * (1.0 - colour) for s, colour in zip(strengths, (STRETCHED, SQUEEZED), strict=True)]
    unknown = np.isnan(longer) | np.isnan(shorter)
    return np.where(unknown[..., None], BROKEN, NEUTRAL * tints[0] * tints[1])


def island_colours(count, first=0):
    """A colour for each of `count` islands, (k, 3) of 0 to 1; `first` is where in the row of colours they begin."""
    colours = [
        colorsys.hsv_to_rgb(n * GOLDEN % 1.0, SATURATION[n % len(SATURATION)], LIGHTNESS[n % len(LIGHTNESS)])
        for n in range(first, first + count)
    ]
    return np.array(colours).reshape(-1, 3)


def range_text(longer, shorter):
    """How far the lines of all faces are off at most, in words."""
    more = f"{100 * (longer - 1):.0f} %" if longer < MANY else f"{longer:.1f} ×"
    less = f"{100 * (1 - 1 / shorter):.0f} %" if shorter < MANY else f"{shorter:.1f} ×"
    return f"{more} longer, {less} shorter"


def legend():
    """What the colours of stretch say: (name, colour, text)."""
    ends = {"stretched": (FULL, 1.0), "squeezed": (1.0, FULL), "both": (FULL, FULL)}
    colours = {name: stretch_colours(*factors) for name, factors in ends.items()}
    more, less = 100 * (FULL - 1), 100 * (1 - 1 / FULL)
    return (
        ("none", NEUTRAL, "No stretch"),
        ("stretched", colours["stretched"], f"Stretched: {more:.0f} % longer or more"),
        ("squeezed", colours["squeezed"], f"Squeezed: {less:.0f} % shorter or more"),
        ("both", colours["both"], "Both: one way each"),
        ("broken", BROKEN, "Flipped, or without area"),
    )
