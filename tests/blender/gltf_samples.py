"""Small glTF files made by hand, with what Blender's own exporter would not write."""

import json
import struct

import numpy as np

COMPONENTS = {"float32": 5126, "uint8": 5121, "uint16": 5123, "uint32": 5125}
KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class Gltf:
    """A document with one buffer, to which arrays are added."""

    def __init__(self):
        self.document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": []}
        self.document |= {"accessors": [], "bufferViews": [], "buffers": [], "meshes": []}
        self.binary = b""

    def view(self, data):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.document["bufferViews"]) - 1

    def accessor(self, array):
        array = np.ascontiguousarray(array)
        entry = {"componentType": COMPONENTS[array.dtype.name], "count": len(array), "type": KINDS[array.shape[1:]]}
        if array.dtype == np.float32 and array.ndim == 2:
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.document["accessors"].append({"bufferView": self.view(array.tobytes()), **entry})
        return len(self.document["accessors"]) - 1

    def mesh(self, positions, triangles, **attributes):
        """Adds a mesh; `attributes` are arrays by name."""
        arrays = {"POSITION": np.asarray(positions, np.float32), **attributes}
        primitive = {"attributes": {name: self.accessor(array) for name, array in arrays.items()}}
        primitive["indices"] = self.accessor(np.asarray(triangles, np.uint32).reshape(-1))
        self.document["meshes"].append({"name": f"mesh{len(self.document['meshes'])}", "primitives": [primitive]})
        return len(self.document["meshes"]) - 1

    def node(self, *, root=True, **entry):
        self.document["nodes"].append(entry)
        number = len(self.document["nodes"]) - 1
        if root:
            self.document["scenes"][0]["nodes"].append(number)
        return number

    def write(self, path):
        """Writes a `.glb`, or a `.gltf` with its buffer beside it."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        if path.suffix == ".gltf":
            path.with_suffix(".bin").write_bytes(self.binary)
            self.document["buffers"][0]["uri"] = path.with_suffix(".bin").name
            path.write_text(json.dumps(self.document))
            return path
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(self.binary), 0x004E4942) + self.binary
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


def read(path):
    """The document of a written file, and a function from the number of an accessor to its array."""
    if path.suffix == ".gltf":
        document = json.loads(path.read_text())
        binary = (path.parent / document["buffers"][0]["uri"]).read_bytes()
    else:
        data = path.read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        document, binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def array(number):
        entry = document["accessors"][number]
        dtype = {code: name for name, code in COMPONENTS.items()}[entry["componentType"]]
        shape = {kind: shape for shape, kind in KINDS.items()}[entry["type"]]
        start = document["bufferViews"][entry["bufferView"]].get("byteOffset", 0) + entry.get("byteOffset", 0)
        count = entry["count"] * int(np.prod(shape, dtype=int))
        return np.frombuffer(binary, dtype, count, start).reshape(entry["count"], *shape)

    return document, array


CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
CUBE_TRIANGLES = np.array(
    [q for a, b, c, d in [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
     for q in ((a, b, c), (a, c, d))]
)  # fmt: skip


def full():
    """A cube with custom properties, a custom attribute and vertex colours, under a camera and a light."""
    gltf = Gltf()
    colours = np.linspace(0, 1, 32, dtype=np.float32).reshape(8, 4)
    mesh = gltf.mesh(CUBE, CUBE_TRIANGLES, _TEMPERATURE=np.arange(8, dtype=np.float32), COLOR_0=colours)
    gltf.document["meshes"][mesh]["extras"] = {"maker": "somebody"}
    gltf.node(name="cube", mesh=mesh, extras={"health": 7})
    gltf.document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 100.0}}]
    gltf.node(name="camera", camera=0, translation=[0, 0, 8])
    lights = [{"type": "point", "color": [1, 1, 1], "intensity": 50.0}]
    gltf.document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    gltf.document["extensionsUsed"] = ["KHR_lights_punctual"]
    gltf.node(name="light", translation=[0, 5, 0], extensions={"KHR_lights_punctual": {"light": 0}})
    return gltf


def skinned():
    """A bar of two bones whose second is, by its node, bent and moved away from the pose that the skin was bound in."""
    gltf = Gltf()
    t = np.arange(5, dtype=np.float32)
    rings = [(x, y, z) for y in t for x, z in ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2))]
    faces = []
    for ring in range(4):
        for side in range(4):
            a, b = 4 * ring + side, 4 * ring + (side + 1) % 4
            faces += [(a, a + 4, b), (b, a + 4, b + 4)]
    share = np.clip((np.array(rings)[:, 1] - 1) / 2, 0, 1).astype(np.float32)
    weights = np.stack([1 - share, share, 0 * share, 0 * share], axis=1)
    joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (len(rings), 1))
    mesh = gltf.mesh(rings, faces, JOINTS_0=joints, WEIGHTS_0=weights)
    half = np.pi / 8
    tip = gltf.node(root=False, name="tip", translation=[0.3, 2.5, 0.4], rotation=[np.sin(half), 0, 0, np.cos(half)])
    base = gltf.node(name="base", translation=[0, 0, 0], children=[tip])
    gltf.node(name="bar", mesh=mesh, skin=0)
    inverse = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    inverse[1, 3, 1] = -2.0  # column-major: bound with the tip at a height of 2
    gltf.document["skins"] = [{"joints": [base, tip], "inverseBindMatrices": gltf.accessor(inverse), "skeleton": base}]
    return gltf


def instanced():
    """A cube drawn three times by EXT_mesh_gpu_instancing."""
    gltf = Gltf()
    mesh = gltf.mesh(CUBE, CUBE_TRIANGLES)
    places = gltf.accessor(np.array([(0, 0, 0), (3, 0, 0), (6, 0, 0)], np.float32))
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}
    gltf.node(name="cubes", mesh=mesh, extensions=extension)
    gltf.document |= {"extensionsUsed": ["EXT_mesh_gpu_instancing"], "extensionsRequired": ["EXT_mesh_gpu_instancing"]}
    return gltf


def world_of_skin(document, array):
    """Places of a skinned mesh's vertices in the world, by the glTF specification, in order of height at rest."""

    def local(node):
        if "matrix" in node:
            return np.array(node["matrix"], float).reshape(4, 4).T
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        matrix = np.eye(4)
        matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)))
        matrix[:3, 3] = node.get("translation", (0, 0, 0))
        return matrix

    world = {}

    def walk(number, above):
        world[number] = above @ local(document["nodes"][number])
        for child in document["nodes"][number].get("children", ()):
            walk(child, world[number])

    for root in document["scenes"][0]["nodes"]:
        walk(root, np.eye(4))
    node = next(node for node in document["nodes"] if "skin" in node and "mesh" in node)
    skin = document["skins"][node["skin"]]
    inverse = array(skin["inverseBindMatrices"]).transpose(0, 2, 1).astype(float)
    joints = np.stack([world[joint] @ inverse[k] for k, joint in enumerate(skin["joints"])])
    (primitive,) = document["meshes"][node["mesh"]]["primitives"]
    rest, which, weights = (array(primitive["attributes"][k]) for k in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
    homogeneous = np.concatenate([rest, np.ones((len(rest), 1))], axis=1)
    matrices = (joints[which] * weights[:, :, None, None]).sum(axis=1)
    places = np.einsum("nij,nj->ni", matrices, homogeneous)[:, :3]
    return np.unique(np.round(places, 4), axis=0)
