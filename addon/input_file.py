"""Files as they lie on disk: what can be read, which other files a file names, and digests of all.

Standard library only.
"""

import errno
import hashlib
import json
import mmap
import re
import stat
import struct
from pathlib import Path
from urllib.parse import unquote

# Kinds of a file that are no regular file, in the words of the user.
KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
GLB_MAGIC, GLB_JSON = b"glTF", 0x4E4F534A
# A URI with a scheme (`data:`, `https:`) names no file; one letter is a drive of Windows.
SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")


def why_unreadable(path):
    """Why a path cannot be read as an input, or None where it is a regular file that can be opened.

    Only regular files are opened: reading a pipe would wait for somebody who may never write.
    """
    path = Path(path)
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            kind = next((name for test, name in KINDS if test(mode)), "something else")
            return f"is {kind}, not a regular file"
        with path.open("rb"):
            return None
    except (FileNotFoundError, NotADirectoryError):
        return "is a link to a file that is not there" if path.is_symlink() else "no such file"
    except OSError as error:
        if error.errno == errno.ELOOP:
            return "is a loop of symbolic links"
        return f"cannot be read: {error.strerror or error}"


class Digests:
    """SHA-256 of files, each read once as long as its size and times stay the same."""

    def __init__(self):
        self._known = {}

    def of(self, path):
        """The digest in hexadecimal digits, or None for what is no regular file or cannot be read."""
        try:
            found = Path(path).stat()
            if not stat.S_ISREG(found.st_mode):
                return None
            state = found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
            known = self._known.get(str(path))
            if known is None or known[0] != state:
                with Path(path).open("rb") as stream:
                    known = state, hashlib.file_digest(stream, "sha256").hexdigest()
                self._known[str(path)] = known
            return known[1]
        except OSError:
            return None


def named_files(path):
    """Files beside a file that it names and that are read with it: glTF's buffers and images, OBJ's materials.

    Those that are not there are among them. What cannot be understood names nothing: whoever reads it will say why.
    """
    path = Path(path)
    kind = path.suffix.lower()
    try:
        if kind in (".gltf", ".glb"):
            names = _names_in_gltf(path)
        elif kind == ".obj":
            names = _names_in_obj(path)
        else:
            names = []
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, struct.error):
        names = []
    return list(dict.fromkeys(path.parent / name for name in names))


def _names_in_gltf(path):
    with path.open("rb") as stream:
        if stream.read(4) == GLB_MAGIC:
            _version, _length, length, kind = struct.unpack("<4I", stream.read(16))
            if kind != GLB_JSON:
                return []
            content = json.loads(stream.read(length))
        else:
            stream.seek(0)
            content = json.load(stream)
    uris = [entry.get("uri") for key in ("buffers", "images") for entry in content.get(key, ())]
    return [unquote(uri) for uri in uris if uri and not SCHEME.match(uri)]


def _names_in_obj(path):
    names = []
    if path.stat().st_size:
        with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
            found = [match[1] for match in re.finditer(rb"(?m)^[ \t]*mtllib[ \t]+([^\r\n]+)", content)]
        for text in (match.decode("utf-8", "surrogateescape").strip() for match in found):
            # The format separates names by spaces; Blender takes the line for one name, which may hold some.
            names += [text] if (path.parent / text).is_file() else text.split()
    return [*names, path.with_suffix(".mtl").name]  # Blender reads the namesake, named or not
