"""Where an artist has painted that seams are to keep away, or are welcome."""

import numpy as np

from . import vertex_groups
from .mesh_arrays import in_bulk, read_array

FULL_WEIGHT = 10.0  # at full weight a seam counts for so many times its length, or for that share of it


def seam_weights(obj, away, here):
    """What a seam at each vertex of a mesh object counts for, (n,) float32, and those of the two names that it has.

    `away` and `here` name a vertex group, or a float attribute on points, whose values from 0 to 1 say where
    seams are to keep away, and where they are welcome; without a name, or where the object has neither, nowhere. A mesh
    in edit mode has to be up to date.
    """
    exponents, found = np.zeros(len(obj.data.vertices), np.float32), set()
    for name, sign in ((away, 1.0), (here, -1.0)):
        values = _values(obj, name) if name else None
        if values is not None:
            found.add(name)
            exponents += sign * np.clip(np.nan_to_num(values), 0.0, 1.0)
    return np.float32(FULL_WEIGHT) ** exponents, found


def _values(obj, name):
    """The values of a vertex group or an attribute at each vertex; None where there is none of that name."""
    if name in obj.vertex_groups:
        return vertex_groups.weights(obj, name)
    with in_bulk(obj.data) as mesh:
        attribute = mesh.attributes.get(name)
        if attribute is None or (attribute.domain, attribute.data_type) != ("POINT", "FLOAT"):
            return None
        return read_array(attribute.data, "value", np.float32)
