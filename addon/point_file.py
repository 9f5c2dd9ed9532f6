"""PLY files of points with UVs, which Blender's own exporter writes without: plain arrays in and out, no bpy.

A map of points is kept as the vertex properties `s` and `t`, as other tools do for vertices.
"""

import re
import warnings
from pathlib import Path

import numpy as np

HEADER_LIMIT = 1 << 16  # bytes within which the header of a file must end
NUMPY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
PLY_TYPES = {"i1": "char", "u1": "uchar", "i2": "short", "i4": "int", "f4": "float"}
UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
NORMAL_NAMES = ("nx", "ny", "nz")


def write_points(path, columns):
    """Writes equally long one-dimensional arrays as the properties of PLY's vertices, binary, in the order given."""
    dtype = np.dtype([(name, np.asarray(values).dtype.newbyteorder("<")) for name, values in columns.items()])
    rows = np.empty(len(next(iter(columns.values()))), dtype)
    for name, values in columns.items():
        rows[name] = values
    properties = [f"property {PLY_TYPES[dtype[name].str[1:]]} {name}" for name in dtype.names]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}", *properties, "end_header", ""]
    Path(path).write_bytes("\n".join(header).encode("ascii") + rows.tobytes())


def read_extras(path, count):
    """UVs (n, 2) and normals (n, 3) as float32 of a PLY file's points, each None where the file has none.

    Of these Blender's importer keeps neither for vertices without faces. Both are None, too, for a file that is not a
    plain list of `count` vertices: they are an addition to what was imported, not a reason to refuse it.
    """
    try:
        rows = _vertices(Path(path))
    except (OSError, ValueError, KeyError, UnicodeDecodeError):
        return None, None
    if rows is None or len(rows) != count:
        return None, None
    return next(filter(_some, (_columns(rows, names) for names in UV_NAMES)), None), _columns(rows, NORMAL_NAMES)


def _some(array):
    return array is not None


def _columns(rows, names):
    if not set(names) <= set(rows.dtype.names):
        return None
    return np.stack([rows[name] for name in names], axis=1).astype(np.float32)


def _vertices(path):
    """Vertices as a structured array; None where they are not the first element or have lists."""
    with path.open("rb") as stream:
        head = stream.read(HEADER_LIMIT)
        end = re.search(rb"end_header\r?\n", head)
        if end is None:
            return None
        lines = [line.split() for line in head[: end.start()].decode("ascii", "replace").splitlines() if line.strip()]
        kind = next(line[1] for line in lines if line[0] == "format")
        first = next((number for number, line in enumerate(lines) if line[0] == "element"), None)
        if first is None or lines[first][1] != "vertex":
            return None
        fields = []
        for line in lines[first + 1 :]:
            if line[0] == "element":
                break
            if line[0] == "property":
                if line[1] == "list":
                    return None
                fields.append((line[2], NUMPY_TYPES[line[1]]))
        count = int(lines[first][2])
        stream.seek(end.end())
        if kind == "ascii":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of missing lines, which the assignment below refuses
                text = np.loadtxt(stream, max_rows=count, ndmin=2, comments=None)
            rows = np.empty(count, fields)
            for number, (name, _) in enumerate(fields):
                rows[name] = text[:, number]
            return rows
        order = ">" if kind == "binary_big_endian" else "<"
        return np.fromfile(stream, np.dtype([(name, order + code) for name, code in fields]), count)
