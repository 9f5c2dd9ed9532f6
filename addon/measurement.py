"""Measuring UVs, whoever made them: arrays in, the native report out. Knows nothing of Blender."""

import numpy as np

from . import engine


def measure(selection, uv, *, texture_size, margin, tiles=1, weld=True, weld_distance=0.0):
    """Measures any UVs of a selection, whoever made them; the keys of the native report.

    With `weld`, charts run across vertices at one place as in `unwrap`: files often split vertices at every face.
    """
    settings = {"texture_size": texture_size, "margin": float(margin), "tiles": tiles}
    settings |= {"weld": weld, "weld_distance": weld_distance}
    return dict(
        engine.call(
            lambda module: module.measure(
                selection.positions,
                selection.corner_vertices,
                selection.face_offsets,
                np.ascontiguousarray(uv, np.float32),
                corner_triangles=selection.corner_triangles,
                **engine.native_settings(settings),
            )
        )
    )


def overlaps_between(first, second):
    """Number of pairs of triangles that share area in UVs, one of each set of faces.

    A set is (positions, corner_vertices, face_offsets, corner_triangles, uv). Overlaps within a set are not counted.
    """
    counts = [_overlaps(faces) for faces in (_together(first, second), first, second)]
    return max(counts[0] - counts[1] - counts[2], 0)


def _together(first, second):
    vertices, corners = len(first[0]), len(first[1])
    bases = (0, vertices, 0, corners, 0)
    joined = [np.concatenate([a, b + base]) for a, b, base in zip(first, second, bases, strict=True)]
    joined[2] = np.concatenate([first[2], second[2][1:] + corners])
    return joined


def _overlaps(faces):
    kinds = (np.float32, np.int32, np.int32, np.int32, np.float32)
    *mesh, triangles, uv = (np.ascontiguousarray(array, kind) for array, kind in zip(faces, kinds, strict=True))
    options = {"corner_triangles": triangles, "texture_size": 1024, "margin": 0.0}
    return int(engine.call(lambda module: module.measure(*mesh, uv, **options))["overlaps"])
