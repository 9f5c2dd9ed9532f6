"""What `make scaling` unwraps: families of generated meshes of any size, and models from files."""

import gzip
import sys
from pathlib import Path

import numpy as np

REPO = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(REPO / "blender_scripts"), str(REPO / "native" / "paper")]

import sculpt_mesh  # noqa: E402
import shapes  # noqa: E402

PART_CELLS = 9  # of the parts that make up a mesh of many parts: 972 triangles each
# Types of PLY properties as NumPy has them.
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


def triangle_count(mesh):
    """Triangles of a mesh once its polygons are cut up: called faces here, since the work grows with them."""
    return len(mesh.corner_vertices) - 2 * (len(mesh.face_offsets) - 1)


def sculpt(faces):
    """A closed body with horns, dents and ripples in quads: one component, about so many triangles."""
    cells = max(2, round((faces / 12) ** 0.5))
    return shapes.of_polygons(f"sculpt {faces}", *sculpt_mesh.sculpt_arrays(cells))


def parts(faces):
    """About so many triangles in bodies of 972 side by side, no two alike: as models of many parts are made."""
    count = max(1, round(faces / (12 * PART_CELLS**2)))
    positions, quads, first = [], [], 0
    for number in range(count):
        shape, faces_of_part = sculpt_mesh.sculpt_arrays(PART_CELLS, seed=number)
        place = np.array([number % 32, number // 32 % 32, number // 1024]) * 8.0
        positions.append(shape * (0.4 + 0.6 * (0.618 * number % 1.0)) + place)
        quads.append(faces_of_part + first)
        first += len(shape)
    return shapes.of_polygons(f"parts {faces}", np.concatenate(positions), np.concatenate(quads))


FAMILIES = {"sculpt": sculpt, "parts": parts}


def read(path):
    """The polygons of an .obj or .ply file, either of them perhaps gzipped."""
    path = Path(path)
    kind = next((suffix for suffix in reversed(path.suffixes) if suffix != ".gz"), "")
    if kind == ".obj" and path.suffix != ".gz":
        return shapes.read_obj(path)
    if kind != ".ply":
        raise ValueError(f"{path.name}: neither .obj nor .ply nor .ply.gz")
    with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
        return read_ply(file.read(), path.name.split(".")[0])


def read_ply(data, name):
    """Vertices and faces of a PLY file, text or binary; other elements and properties are left out."""
    end = data.find(b"end_header")
    start = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or start == 0:
        raise ValueError(f"{name}: no PLY header")
    kind, elements = "", []
    for words in (line.split() for line in data[:end].decode("ascii", "replace").splitlines()):
        if words[:1] == ["format"]:
            kind = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    if kind == "ascii":
        reader = _Text(data[start:])
    elif kind in ("binary_little_endian", "binary_big_endian"):
        reader = _Binary(data[start:], "<" if "little" in kind else ">")
    else:
        raise ValueError(f"{name}: unknown PLY format '{kind}'")
    positions, polygons = np.zeros((0, 3)), []
    for element, count, properties in elements:
        if element == "face":
            polygons = reader.lists(count, properties)
        else:
            rows = reader.scalars(count, properties)
            if element == "vertex":
                positions = np.stack([rows[axis] for axis in "xyz"], axis=1)
    return shapes.of_polygons(name, positions, polygons)


class _Text:
    """Elements of a PLY file in text: one a line."""

    def __init__(self, body):
        self.lines = iter(body.decode("ascii").split("\n"))

    def scalars(self, count, properties):
        rows = np.array([next(self.lines).split() for _ in range(count)], dtype=float)
        return {words[-1]: rows[:, k] for k, words in enumerate(properties)}

    def lists(self, count, properties):
        """The first list of every row."""
        skip = next(k for k, words in enumerate(properties) if words[0] == "list")
        polygons = []
        for _ in range(count):
            numbers = next(self.lines).split()[skip:]
            polygons.append([int(word) for word in numbers[1 : 1 + int(numbers[0])]])
        return polygons


class _Binary:
    """Elements of a binary PLY file, one after the other."""

    def __init__(self, body, order):
        self.body, self.order, self.at = body, order, 0

    def scalars(self, count, properties):
        row = np.dtype([(words[-1], self.order + PLY_TYPES[words[0]]) for words in properties])
        rows = np.frombuffer(self.body, row, count, self.at)
        self.at += count * row.itemsize
        return {name: rows[name].astype(float) for name in row.names}

    def lists(self, count, properties):
        if len(properties) != 1 or properties[0][0] != "list":
            return self._mixed_lists(count, properties)
        of_count, of_index = (self.order + PLY_TYPES[word] for word in properties[0][1:3])
        row = np.dtype([("n", of_count), ("v", of_index, 3)])
        if self.at + count * row.itemsize <= len(self.body):
            rows = np.frombuffer(self.body, row, count, self.at)
            if (rows["n"] == 3).all():  # all triangles, which is the rule: no loop
                self.at += count * row.itemsize
                return rows["v"].astype(np.int32)
        return self._mixed_lists(count, properties)

    def _mixed_lists(self, count, properties):
        polygons = []
        for _ in range(count):
            for words in properties:
                if words[0] != "list":
                    self.at += np.dtype(PLY_TYPES[words[0]]).itemsize
                    continue
                size, kind = (np.dtype(self.order + PLY_TYPES[word]) for word in words[1:3])
                (n,) = np.frombuffer(self.body, size, 1, self.at)
                values = np.frombuffer(self.body, kind, int(n), self.at + size.itemsize)
                self.at += size.itemsize + int(n) * kind.itemsize
                if words[-1] in ("vertex_indices", "vertex_index"):
                    polygons.append(values.astype(np.int32))
        return polygons
