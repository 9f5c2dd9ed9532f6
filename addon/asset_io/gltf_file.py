"""glTF files as they lie on the disk, without Blender: the JSON in them, and what the files hold."""

import json
import struct
from pathlib import Path
from urllib.parse import unquote

from .formats import AssetError

MAGIC = b"glTF"
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
# Bytes of JSON from which a file is refused: a million nodes take about 200 MB.
MOST_JSON = 1 << 30
DRACO, INSTANCING = "KHR_draco_mesh_compression", "EXT_mesh_gpu_instancing"
COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
TRIANGLES = (4, 5, 6)  # modes of primitives that have faces


def read_document(path):
    """The JSON of a `.gltf` or `.glb` file as a dictionary, and the bytes of its binary chunk (0: none).

    Raises `AssetError` where the file is no glTF, is cut short or declares more than it holds.
    """
    path = Path(path)
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(4)
        if head != MAGIC:
            if size > MOST_JSON:
                raise AssetError(f"its JSON is larger than {MOST_JSON >> 20} MB")
            return _parsed(head + stream.read(MOST_JSON)), 0
        chunks = _chunks(stream, size)
        if not chunks or chunks[0][0] != JSON_CHUNK:
            raise AssetError("is no complete glTF file: its first chunk is not JSON")
        _, start, length = chunks[0]
        if length > MOST_JSON:
            raise AssetError(f"its JSON is larger than {MOST_JSON >> 20} MB")
        stream.seek(start)
        document = _parsed(stream.read(length))
    return document, next((length for kind, _, length in chunks[1:] if kind == BINARY_CHUNK), 0)


def _chunks(stream, size):
    """Kind, start and length of every chunk of a `.glb`."""
    head = stream.read(8)
    if len(head) < 8 or struct.unpack("<I", head[4:])[0] != size:
        raise AssetError("is cut short: it is not as long as its header says")
    found, position = [], 12
    while position + 8 <= size:
        stream.seek(position)
        length, kind = struct.unpack("<II", stream.read(8))
        if position + 8 + length > size:
            raise AssetError("is cut short: a chunk reaches beyond its end")
        found.append((kind, position + 8, length))
        position += 8 + length + (-length % 4)
    return found


def _parsed(data):
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise AssetError(f"its JSON cannot be read: {error}") from error
    if not isinstance(document, dict):
        raise AssetError("its JSON is not an object")
    return document


def entries(document, name):
    """The dictionaries of one of the document's arrays, whatever a broken file has in its place."""
    array = document.get(name)
    return [entry for entry in array if isinstance(entry, dict)] if isinstance(array, list) else []


def external_uris(document):
    """What buffers and images name outside the file: ("buffer" or "image", URI as it is written)."""
    found = []
    for kind in ("buffer", "image"):
        for entry in entries(document, kind + "s"):
            uri = entry.get("uri")
            if isinstance(uri, str) and uri[:5].lower() != "data:":
                found.append((kind, uri))
    return found


def uri_path(uri):
    """The relative path that a URI names; `AssetError` for any that is absolute or of a scheme."""
    path = unquote(uri).replace("\\", "/")
    scheme = path.split("/", 1)[0]
    if ":" in scheme or path.startswith("/") or "\0" in path:
        raise AssetError(f"names {uri!r} as a part of it: only files in its own folder are read")
    return path


def uses(document, extension):
    used = document.get("extensionsUsed")
    return isinstance(used, list) and extension in used


def primitives(document):
    """Name of the mesh and the primitive, of all primitives with faces."""
    for number, mesh in enumerate(entries(document, "meshes")):
        for primitive in entries(mesh, "primitives"):
            if primitive.get("mode", 4) in TRIANGLES:
                yield str(mesh.get("name", f"mesh {number}")), primitive


def attributes(primitive):
    found = primitive.get("attributes")
    return found if isinstance(found, dict) else {}


def declared_bytes(document):
    """Bytes that the document's accessors have when they are unpacked, by what it says of them."""
    total = 0
    for accessor in entries(document, "accessors"):
        count = accessor.get("count")
        if not isinstance(count, int) or count < 0:
            raise AssetError("an accessor in it has no valid count")
        total += count * COMPONENT_BYTES.get(accessor.get("componentType"), 4) * WIDTHS.get(accessor.get("type"), 16)
    return total


def inventory(document):
    """How many there are of what an import and export may lose, by the words for it; and the extensions by name."""
    nodes, meshes = entries(document, "nodes"), entries(document, "meshes")
    found = list(primitives(document))
    lights = [node for node in nodes if "KHR_lights_punctual" in (node.get("extensions") or {})]
    names = {name for _, primitive in found for name in attributes(primitive)}
    used = document.get("extensionsUsed")
    return {
        "cameras": sum("camera" in node for node in nodes),
        "lights": len(lights),
        "objects with custom properties": sum(bool(entry.get("extras")) for entry in nodes),
        "meshes with custom properties": sum(bool(entry.get("extras")) for entry in meshes),
        "custom attributes": sum(name.startswith("_") for name in names),
        "layers of vertex colours": sum(name.startswith("COLOR_") for name in names),
        "skins": len(entries(document, "skins")),
        "meshes with shape keys": sum(any("targets" in p for p in entries(mesh, "primitives")) for mesh in meshes),
        "animations": len(entries(document, "animations")),
        "extensions": set(filter(lambda name: isinstance(name, str), used if isinstance(used, list) else ())),
    }
