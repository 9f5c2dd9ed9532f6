"""Looks at a file before Blender's importers do, without Blender: what it names, and how much it says to hold.

Importers trust a file: they open whatever it names, be it a device without end or somebody's secrets, and allocate
what its header declares. So a file is refused here, with the reason, where it names anything but ordinary files (glTF:
in its own folder), declares more than it can hold, or would take more than `MOST_BYTES` when it is unpacked.
"""

import mmap
import stat
import struct
import zlib
from pathlib import Path

from . import gltf_file, obj_file, ply_header, zstd_frames
from .formats import AssetError, file_format

# Bytes of an input with the files that belong to it, unpacked: about a hundred million triangles. The tightest of the
# formats, .glb, ends at half of it.
MOST_BYTES = 8 << 30
UNPACKED_AT_ONCE = 1 << 20  # bytes


def check(path):
    """Raises `AssetError` where a file must not be given to Blender; `path` is absolute."""
    size = regular_size(path)
    checks = {"blend": _blend, "obj": _obj, "ply": _ply, "fbx": _fbx, "glb": _gltf, "gltf": _gltf}
    try:
        _within_bound(size)
        checks.get(file_format(path), lambda *_: None)(path, size)
    except OSError as error:
        raise AssetError(f"cannot be read: {error.strerror or error}") from error


def regular_size(path, name=None):
    """Bytes of an ordinary file; `AssetError` for a device, a pipe, a folder, or nothing."""
    what = f"names {name!r}, which" if name else ""
    try:
        found = Path(path).stat()
    except FileNotFoundError as error:
        raise AssetError(f"{what} is missing" if name else "no such file") from error
    except (OSError, ValueError) as error:
        text = getattr(error, "strerror", None) or error
        raise AssetError(f"{what} cannot be read: {text}".strip()) from error
    if not stat.S_ISREG(found.st_mode):
        raise AssetError(f"{what} is not a regular file".strip())
    return found.st_size


def _within_bound(size):
    if size > MOST_BYTES:
        raise AssetError(f"would take {size / (1 << 30):,.1f} GB in memory, and the most is {MOST_BYTES >> 30} GB")


# glTF ---------------------------------------------------------------------------------------------------------------


def _gltf(path, size):
    document, _ = gltf_file.read_document(path)
    folder = Path(path).resolve().parent
    total = size + gltf_file.declared_bytes(document)
    for uri in {uri for _, uri in gltf_file.external_uris(document)}:
        target = (Path(path).parent / gltf_file.uri_path(uri)).resolve()
        if not target.is_relative_to(folder):
            raise AssetError(f"names {uri!r} as a part of it: only files in its own folder are read")
        if target.exists() or target.is_symlink():  # a missing image is the importer's to report, and no harm
            total += regular_size(target, uri)
    for buffer in gltf_file.entries(document, "buffers"):
        if isinstance(buffer.get("byteLength"), int):
            total += max(0, buffer["byteLength"] - size) if "uri" not in buffer else 0
    _within_bound(total)


# Blender's own ------------------------------------------------------------------------------------------------------


def _blend(path, size):
    with Path(path).open("rb") as stream:
        magic = stream.read(4)
        if magic[:2] == b"\x1f\x8b":
            stream.seek(0)
            _within_bound(_gzip_size(stream))
        elif magic == zstd_frames.MAGIC:
            _within_bound(_zstd_size(stream, size))


def _gzip_size(stream):
    """Bytes that a gzip stream unpacks to; not counted beyond the bound."""
    unpacker, total = zlib.decompressobj(31), 0
    while data := stream.read(UNPACKED_AT_ONCE):
        while data and total <= MOST_BYTES:
            try:
                total += len(unpacker.decompress(data, UNPACKED_AT_ONCE))
            except zlib.error as error:
                raise AssetError(f"its compressed data is damaged: {error}") from error
            data = unpacker.unconsumed_tail
        if total > MOST_BYTES or unpacker.eof:
            break
    return total


def _zstd_size(stream, size):
    """Bytes that a Zstandard file unpacks to at most; not counted beyond the bound."""
    total = 0
    for block in zstd_frames.blocks(stream, size):
        total += block or 0
        if total > MOST_BYTES:
            break
    return total


# Text formats -------------------------------------------------------------------------------------------------------

MATERIAL_BYTES = 1 << 30  # of one .mtl file


def _obj(path, _size):
    """The material libraries that it names, and their textures, are ordinary files where they exist."""
    folder = Path(path).parent
    for name in sorted(obj_file.libraries(path)):
        for library in (folder / part for part in obj_file.ways_to_read(name)):
            if not _is_there(library) or library.is_dir():
                continue
            if regular_size(library, name) > MATERIAL_BYTES:
                raise AssetError(f"names {name!r}, which is larger than {MATERIAL_BYTES >> 20} MB")
            for name_of_texture in obj_file.textures(library):
                for part in obj_file.ways_to_read(name_of_texture):
                    texture = library.parent / part
                    if _is_there(texture) and not texture.is_dir():  # an option's word may be the name of a folder
                        regular_size(texture, part)


def _is_there(path):
    try:
        return path.exists() or path.is_symlink()
    except (OSError, ValueError):  # a name that no file can have
        return False


def _ply(path, size):
    """The header's counts fit into the file."""
    header = ply_header.read(path)
    least = 0
    for element in header.elements:
        # A value as text takes a digit and a blank; a list is at least its length.
        widths = [2 if header.is_text else item.width for item in element.properties]
        least += element.count * max(1, sum(widths))
        if least > size - header.start + 1:  # the last blank may be missing
            raise AssetError(
                f"is cut short: its header says {element.count:,} of {element.name}, more than the file can hold"
            )


# FBX ----------------------------------------------------------------------------------------------------------------

FBX_MAGIC = b"Kaydara FBX Binary  \0"
FBX_BYTES = dict(zip("CBYIFDL", (1, 1, 2, 4, 4, 8, 8), strict=True))  # by the letter of a property's kind
FBX_ARRAYS = {"b": 1, "c": 1, "i": 4, "f": 4, "l": 8, "d": 8}
MOST_NODES = 20_000_000  # a million keys of animation have about as many


def _fbx(path, size):
    """Arrays of a binary file unpack to what they say, and to no more than the bound in all."""
    if size < 27:
        raise AssetError("is cut short")
    with Path(path).open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data[: len(FBX_MAGIC)] != FBX_MAGIC:
            return
        (version,) = struct.unpack_from("<I", data, 23)
        head = struct.Struct("<QQQB" if version >= 7500 else "<IIIB")
        try:
            _fbx_arrays(data, head, size)
        except (struct.error, IndexError, zlib.error) as error:  # beyond the end; or no compressed data
            raise AssetError("is cut short or damaged") from error


def _fbx_arrays(data, head, size):
    position, total, depth = 27, size, 0
    for _ in range(MOST_NODES):
        end, properties, length, name = head.unpack_from(data, position)
        position += head.size
        if end == 0:  # ends the children of a node, or the file's own nodes
            if depth == 0:
                return
            depth -= 1
            continue
        position += name
        after = position + length
        if after > size:
            raise AssetError("is cut short: a node reaches beyond its end")
        for _ in range(properties):
            kind = chr(data[position])
            position += 1
            if kind in FBX_BYTES:
                position += FBX_BYTES[kind]
            elif kind in FBX_ARRAYS:
                count, packed, stored = struct.unpack_from("<III", data, position)
                position += 12
                expected = count * FBX_ARRAYS[kind]
                total += expected
                _within_bound(total)
                if packed and _unpacked_size(data[position : position + stored], expected) != expected:
                    raise AssetError("is damaged: an array in it unpacks to another size than it says")
                position += stored
            else:
                position += 4 + struct.unpack_from("<I", data, position)[0]
            if position > after:
                raise AssetError("is damaged: a property in it reaches beyond its node")
        position = after
        depth += end > after
    raise AssetError(f"has more than {MOST_NODES:,} nodes")


def _unpacked_size(data, expected):
    """Bytes that compressed data unpacks to; not counted much beyond what is expected."""
    unpacker, total = zlib.decompressobj(), 0
    while data and total <= expected:
        total += len(unpacker.decompress(data, UNPACKED_AT_ONCE))
        data = unpacker.unconsumed_tail
    return total
