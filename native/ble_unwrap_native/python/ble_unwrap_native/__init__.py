"""Automatic UV unwrapping under a stretch bound, by Bernoulli logistic embedding.

All here is compiled and needs nothing but Python. What builds upon it in Python, with dependencies of its own, is
imported by its full name.
"""

from ._native import (
    Array,
    Atlas,
    BleUnwrapError,
    Cancelled,
    Embedding,
    Flattening,
    InternalError,
    InvalidArgumentError,
    InvalidMeshError,
    Job,
    PackedCharts,
    PointAtlas,
    __version__,
    default_settings,
    embed,
    flatten,
    geodesic_distances,
    graph_distances,
    measure,
    pack,
    submit_unwrap,
    submit_unwrap_points,
    unwrap,
    unwrap_points,
)

__all__ = [
    "Array",
    "Atlas",
    "BleUnwrapError",
    "Cancelled",
    "Embedding",
    "Flattening",
    "InternalError",
    "InvalidArgumentError",
    "InvalidMeshError",
    "Job",
    "PackedCharts",
    "PointAtlas",
    "__version__",
    "default_settings",
    "embed",
    "flatten",
    "geodesic_distances",
    "graph_distances",
    "measure",
    "pack",
    "submit_unwrap",
    "submit_unwrap_points",
    "unwrap",
    "unwrap_points",
]
