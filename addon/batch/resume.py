"""What a result depends on, noted beside it in the report, and whether all of it is still as it was.

A result is the same as long as these are: every setting and option that changes it, the versions of the tool and of
Blender, every file that was read, and every file that was written. Textures count as read: some formats carry them.
"""

import hashlib
import json
import os
from pathlib import Path

import bpy

from .. import asset_io, engine, input_file, properties
from .plan import files_of

# Of the options: what changes no result.
IRRELEVANT = ("threads",)


class Evidence:
    """Notes and checks, for one run; each file is read once for both."""

    def __init__(self, settings, options):
        full = {**properties.default_values(settings["preset"]), **settings}
        facts = {
            "settings": {name: value for name, value in full.items() if name not in IRRELEVANT},
            "options": options,
            "native": engine.version(),
            "blender": bpy.app.version_string,
        }
        self.key = hashlib.sha256(json.dumps(facts, sort_keys=True, default=list).encode()).hexdigest()
        self._digests = input_file.Digests()

    def digest(self, path):
        """SHA-256 of a file in hexadecimal digits, or None where there is no regular file."""
        return self._digests.of(path)

    def note(self, planned, digest, external):
        """The facts about a result that was just written. `digest` is the input's before it was read.

        `external` are the files that Blender read besides.
        """
        read = {path: self.digest(path) for path in [*asset_io.named_files(planned.source), *external]}
        return {
            "key": self.key,
            "read": _relative(read, planned.source.parent) | {planned.source.name: digest},
            "written": _relative(
                {path: self.digest(path) for path in written_files(planned.target)}, planned.target.parent
            ),
        }

    def is_done(self, planned, asset):
        """Whether the asset of an earlier run is what this one would make."""
        try:
            facts = asset["resume"]
            if asset["status"] != "ok" or facts["key"] != self.key:
                return False
            written = facts["written"]
            if planned.source.name not in facts["read"] or None in written.values() or not written:
                return False
            return all(
                self.digest(folder / name) == digest
                for folder, digests in ((planned.source.parent, facts["read"]), (planned.target.parent, written))
                for name, digest in digests.items()
            )
        except (KeyError, TypeError, AttributeError, ValueError):  # of another version of the report
            return False


def written_files(target):
    """The files of a result that are there."""
    return [file for file in files_of(target) if file == target or file.is_file()]


def external_files():
    """Files outside the loaded scene that it refers to: linked libraries, images, fonts, caches, whether there or not.

    Blender's own are left out, as its version stands for them. Of a sequence of images the first one is named.
    """
    own = os.path.realpath(bpy.utils.resource_path("LOCAL"))
    found = {}
    for name in bpy.utils.blend_paths(absolute=True, packed=False, local=False):
        path = Path(name)
        if "<UDIM>" in path.name or "<UVTILE>" in path.name:
            pattern = path.name.replace("<UDIM>", "*").replace("<UVTILE>", "*")
            found |= dict.fromkeys(sorted(path.parent.glob(pattern)))
        elif not Path(os.path.realpath(path)).is_relative_to(own):
            found[path] = None
    return list(found)


def _relative(digests, folder):
    """Digests by path relative to a folder, so that they hold where the folders are moved together."""
    return {_relative_name(path, folder): digest for path, digest in digests.items()}


def _relative_name(path, folder):
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive of Windows
        return str(path)
