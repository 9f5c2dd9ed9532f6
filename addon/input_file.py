"""Files as they lie on disk: what can be read, and digests.

Standard library only.
"""

import errno
import hashlib
import stat
from pathlib import Path

# Kinds of a file that are no regular file, in the words of the user.
KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


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
