"""Measuring UVs, whoever made them: arrays in, the native report out. Knows nothing of Blender."""

import numpy as np

from . import engine


def measure(
    selection, uv, *, texture_size, margin, tiles=1, weld=True, weld_distance=0.0, stacks=None, by_face=False, threads=0
):
    """Measures any UVs of a selection, whoever made them; the keys of the native report.

    With `weld`, charts run across vertices at one place as in `unwrap`: files often split vertices at every face.
    `stacks` are the chart of each face and the stack of each chart, where charts lie on each other on purpose: what is
    meant so is no overlap. With `by_face` the numbers of faces are in it, too.
    """
    settings = {"texture_size": texture_size, "margin": float(margin), "tiles": tiles}
    settings |= {"weld": weld, "weld_distance": weld_distance, "threads": threads}
    return dict(
        engine.call(
            lambda module: module.measure(
                selection.positions,
                selection.corner_vertices,
                selection.face_offsets,
                np.ascontiguousarray(uv, np.float32),
                corner_triangles=selection.corner_triangles,
                by_face=by_face,
                **_stacking(stacks),
                **engine.native_settings(settings),
            )
        )
    )


def _stacking(stacks):
    """The arguments of the native module that name charts and stacks."""
    return {} if stacks is None else dict(zip(("chart", "stacks"), stacks, strict=True))


def overlaps_between(first, second, stacks=None):
    """Number of pairs of triangles that share area in UVs, one of each set of faces.

    A set is (positions, corner_vertices, face_offsets, corner_triangles, uv). Overlaps within a set are not counted.
    `stacks` are those of the first, as for `measure`; of triangles that lie on each other one counts.
    """
    both = None
    if stacks is not None:
        # The others are one more chart, which lies alone.
        chart, stack = stacks
        others = np.full(len(second[2]) - 1, len(stack), np.int32)
        both = np.append(chart, others).astype(np.int32), np.append(stack, -1).astype(np.int32)
    counts = [_overlaps(_together(first, second), both), _overlaps(first, stacks), _overlaps(second, None)]
    return max(counts[0] - counts[1] - counts[2], 0)


def _together(first, second):
    vertices, corners = len(first[0]), len(first[1])
    bases = (0, vertices, 0, corners, 0)
    joined = [np.concatenate([a, b + base]) for a, b, base in zip(first, second, bases, strict=True)]
    joined[2] = np.concatenate([first[2], second[2][1:] + corners])
    return joined


def _overlaps(faces, stacks):
    kinds = (np.float32, np.int32, np.int32, np.int32, np.float32)
    *mesh, triangles, uv = (np.ascontiguousarray(array, kind) for array, kind in zip(faces, kinds, strict=True))
    options = {"corner_triangles": triangles, "texture_size": 1024, "margin": 0.0, **_stacking(stacks)}
    return int(engine.call(lambda module: module.measure(*mesh, uv, **options))["overlaps"])
