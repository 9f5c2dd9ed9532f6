"""What OBJ files and their material libraries name, without Blender."""

import mmap
import re
from pathlib import Path

# Blank of an OBJ file within a line: a backslash at the end of a line goes on with the next one.
_BLANK = rb"(?:[ \t]|\\\r?\n)"
_REST = rb"((?:[^\r\n\\]|\\(?!\r?\n)|\\\r?\n)*)"
_LIBRARY = re.compile(rb"mtllib" + _BLANK + rb"+" + _REST)
_TEXTURE = re.compile(rb"(?mi)^[ \t]*(?:map_\w+|bump|norm|disp|decal|refl)[ \t]+([^\r\n]*)")
MOST_OPTIONS = 32  # words before the name of a texture; the format has eleven options of up to four words


def libraries(path):
    """The material libraries that a file may name, as written there, and its namesake, which Blender reads anyway."""
    path = Path(path)
    names = {path.with_suffix(".mtl").name}
    if path.stat().st_size:
        with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
            names |= set(_libraries(data))
    return names


def textures(library):
    """The textures that a material library names, each with the options before it."""
    return [_text(match[1]) for match in _TEXTURE.finditer(Path(library).read_bytes())]


def _libraries(data):
    """The rest of every line of an OBJ file that may name a material library; also of a comment, which does no harm."""
    at = data.find(b"mtllib")
    while at >= 0:
        if match := _LIBRARY.match(data, at):
            yield _text(match[1])
        at = data.find(b"mtllib", at + 1)


def _text(data):
    return re.sub(rb"\\\r?\n", b" ", data).decode("utf-8", "surrogateescape").strip().strip('"')


def ways_to_read(text):
    """The names that the rest of a line may hold: all of it, or, since options come first, what follows a blank."""
    parts = text.replace("\\", "/").split(maxsplit=MOST_OPTIONS)
    return {" ".join(parts[k:]) for k in range(len(parts))} | ({text} if text else set())
