"""The header of a PLY file: what elements it declares, without reading them."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from .formats import AssetError

HEADER_LIMIT = 1 << 16  # bytes within which a header must end
BYTES = {
    **dict.fromkeys(("char", "int8", "uchar", "uint8"), 1),
    **dict.fromkeys(("short", "int16", "ushort", "uint16"), 2),
    **dict.fromkeys(("int", "int32", "uint", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("double", "float64"), 8),
}


@dataclass
class Property:
    name: str
    width: int  # bytes: of the value, or of the length of a list
    item: int | None  # bytes of an item of a list; None: not a list


@dataclass
class Element:
    name: str
    count: int
    properties: list = field(default_factory=list)


@dataclass
class Header:
    is_text: bool
    elements: list
    start: int  # of the data, in bytes


def read(path):
    """The header of a file. Raises `AssetError` where it has none that can be understood."""
    with Path(path).open("rb") as stream:
        head = stream.read(HEADER_LIMIT)
    end = re.search(rb"end_header\r?\n?", head)
    if not head.startswith(b"ply") or end is None:
        raise AssetError("is no PLY file: its header has no end")
    is_text, elements = True, []
    for words in (line.split() for line in head[: end.start()].decode("ascii", "replace").splitlines()):
        if words[:1] == ["format"] and len(words) > 1:
            is_text = words[1] == "ascii"
        elif words[:1] == ["element"] and len(words) > 2:
            if not words[2].isdecimal():
                raise AssetError(f"its header has {words[2]!r} where a count of {words[1]} is due")
            elements.append(Element(words[1], int(words[2])))
        elif words[:1] == ["property"] and len(words) > 2 and elements:
            is_list = words[1] == "list" and len(words) > 4
            width, item = (words[2], BYTES.get(words[3], 1)) if is_list else (words[1], None)
            elements[-1].properties.append(Property(words[-1], BYTES.get(width, 1), item))
    return Header(is_text, elements, end.end())
