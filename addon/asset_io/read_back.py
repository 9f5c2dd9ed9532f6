"""Reads written files back, without Blender: whether all of it got to the disk, and which meshes have UVs in it.

Blender's exporters of .obj and .ply do not notice a full disk. What is read is headers, counts and ends, not the
geometry: it costs little beside the writing.
"""

import mmap
import os
import re
from collections import deque
from dataclasses import dataclass

from . import gltf_file, ply_header, zstd_frames
from .formats import AssetError, file_format

CUT_SHORT = "what was written is cut short"
FBX_END = bytes.fromhex("f85a8c6adef5d97eece90ce3758f290b")
CHUNK = 1 << 24  # bytes that are looked through at once
BLOCK_HEADS = (24, 32)  # bytes of the last block of a .blend, which is nothing but a head, until 5.0 and since


@dataclass
class Expected:
    """The least that a file must hold: the surfaces that were unwrapped for it."""

    faces: int = 0
    corners: int = 0


def check(path, expected, *, together):
    """Names of meshes without UVs in a written file, where the format tells. Raises `AssetError` where it is cut short,
    `OSError` where the system says that it could not be written. `together`: all of its folder was written for it."""
    for file in path.parent.rglob("*") if together else [path]:
        _synchronise(file)
    checks = {"blend": _blend, "glb": _gltf, "gltf": _gltf, "obj": _obj, "ply": _ply, "fbx": _fbx}
    return checks[file_format(path)](path, expected)


def _synchronise(path):
    """Waits until the disk has a file: some file systems tell only then that they are full."""
    if path.is_file():
        with path.open("rb+") as stream:
            os.fsync(stream.fileno())


def _tail(path, size):
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - size))
        return stream.read()


def _blend(path, _expected):
    size = path.stat().st_size
    with path.open("rb") as stream:
        is_packed = stream.read(len(zstd_frames.MAGIC)) == zstd_frames.MAGIC
        try:
            if is_packed and list(deque(zstd_frames.blocks(stream, size), 1)) != [None]:
                raise AssetError("its last frame is no table")
        except AssetError as error:
            raise AssetError(CUT_SHORT) from error
    tail = _tail(path, max(BLOCK_HEADS))
    if not is_packed and not any(tail[-head:][:4] == b"ENDB" for head in BLOCK_HEADS):
        raise AssetError(CUT_SHORT)
    return []


def _fbx(path, _expected):
    if _tail(path, len(FBX_END)) != FBX_END:
        raise AssetError(CUT_SHORT)
    return []


def _gltf(path, _expected):
    try:
        document, binary = gltf_file.read_document(path)
    except AssetError as error:
        raise AssetError(f"{CUT_SHORT}: {error}") from error
    for buffer in gltf_file.entries(document, "buffers"):
        uri, size = buffer.get("uri"), buffer.get("byteLength", 0)
        if uri is None and binary < size:
            raise AssetError(CUT_SHORT)
    for kind, uri in gltf_file.external_uris(document):
        file = path.parent / gltf_file.uri_path(uri)
        sizes = [b["byteLength"] for b in gltf_file.entries(document, "buffers") if b.get("uri") == uri]
        if not file.is_file() or file.stat().st_size < max(sizes, default=1):
            raise AssetError(f"{CUT_SHORT}: its {kind} {uri}")
    found = gltf_file.primitives(document)
    return sorted({name for name, primitive in found if "TEXCOORD_0" not in gltf_file.attributes(primitive)})


def _ply(path, expected):
    header = ply_header.read(path)
    data = path.stat().st_size - header.start
    if header.is_text:
        raise AssetError("was written as text, whose length cannot be told")
    faces = items = 0
    for element in header.elements:
        data -= element.count * sum(item.width for item in element.properties)
        lists = [item.item for item in element.properties if item.item is not None]
        if lists:
            faces, items = element.count, lists[0]
    if data < 0 or faces < expected.faces or (data < items * expected.corners if items else data > 0):
        raise AssetError(CUT_SHORT)
    vertex = next((element for element in header.elements if element.name == "vertex"), None)
    has_uvs = vertex is not None and {"s", "t"} <= {item.name for item in vertex.properties}
    return [] if has_uvs or not faces else [path.stem]


def _obj(path, expected):
    """Counts its faces. Every face of a file that Blender writes stands on a line of its own."""
    if not path.stat().st_size or _tail(path, 1) != b"\n":
        raise AssetError(CUT_SHORT)
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        # One line begins where another ends; a chunk begins with the last two bytes of the one before.
        chunks = (data[max(0, at - 2) : at + CHUNK] for at in range(0, len(data), CHUNK))
        faces = sum(chunk.count(b"\nf ") for chunk in chunks)
        materials = {data[at + 8 : data.find(b"\n", at + 1)].strip() for at in places(data, b"\nusemtl ")} - {b""}
        # Blender writes normals: a corner without UVs is a vertex and a normal with nothing in between.
        bare = _objects_without_uvs(data, path.stem) if data.find(b"//") >= 0 else []
    if faces < expected.faces:
        raise AssetError(CUT_SHORT)
    library = path.with_suffix(".mtl")
    defined = library.read_bytes() if library.is_file() else b""
    known = {match[1] for match in re.finditer(rb"(?m)^newmtl (.*)$", defined)}
    if not materials <= known or (materials and not defined.endswith(b"\n")):
        raise AssetError(f"{CUT_SHORT}: {library.name}")
    return bare


def places(data, text):
    """Where a text begins in mapped memory, one place after the other."""
    at = data.find(text)
    while at >= 0:
        yield at
        at = data.find(text, at + 1)


def _objects_without_uvs(data, name):
    found = []
    for match in re.finditer(rb"(?m)^(?:o (.*)|f \d+(?:/(\d*))?.*)$", data):
        if match[1] is not None:
            name = match[1].decode("utf-8", "replace").strip()
        elif not match[2] and name not in found[-1:]:
            found.append(name)
    return found
