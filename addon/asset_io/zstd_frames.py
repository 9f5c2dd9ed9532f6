"""Zstandard files by the headers of their frames and blocks (RFC 8878), without unpacking anything."""

import struct

from .formats import AssetError

MAGIC = b"\x28\xb5\x2f\xfd"
FRAME, SKIPPED = 0xFD2FB528, 0x184D2A50  # the last four bits of the latter are free
MOST_IN_BLOCK = 128 << 10  # bytes that a block unpacks to at most
REPEATED, COMPRESSED = 1, 2


def blocks(stream, size):
    """Of every block the bytes that it unpacks to at most; None for a frame that is skipped, such as the table with
    which Blender ends a file. Raises `AssetError` where the frames do not end with the file."""
    position = 0
    while position < size:
        magic, word = struct.unpack("<II", _bytes(stream, position, 8))
        if magic & 0xFFFFFFF0 == SKIPPED:
            position += 8 + word
            yield None
            continue
        if magic != FRAME:
            raise AssetError("its compressed data is damaged")
        flags = word & 0xFF
        single = flags >> 5 & 1
        position += 5 + (not single) + (0, 1, 2, 4)[flags & 3] + (single, 2, 4, 8)[flags >> 6]
        last = 0
        while not last:
            block = int.from_bytes(_bytes(stream, position, 3), "little")
            last, kind, length = block & 1, block >> 1 & 3, block >> 3
            position += 3 + (1 if kind == REPEATED else length)
            yield MOST_IN_BLOCK if kind == COMPRESSED else length
        position += 4 * (flags >> 2 & 1)  # a checksum
    if position != size:
        raise AssetError("is cut short")


def _bytes(stream, position, count):
    stream.seek(position)
    data = stream.read(count)
    if len(data) < count:
        raise AssetError("is cut short")
    return data
