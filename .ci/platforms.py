"""The platforms that there is a wheel and an extension for, and what each is called by Blender, Rust and Python.

What builds, packs or tests for a platform asks here; on which machine a release of it is built says
`.github/workflows/release.yml`. Standard library only.
"""

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Platform:
    """One row of the table."""

    name: str  # in Blender's manifests
    target: str  # for Rust, where another machine builds for it
    tag: str  # at the end of the wheel's name: the oldest system that will do

    @property
    def archive_name(self):
        """As `blender --command extension build --split-platforms` writes it in the names of archives."""
        return self.name.replace("-", "_")

    def is_of(self, triple):
        """Whether what is compiled for this triple runs here: on Windows, whichever linker it was made with."""
        return triple.split("-")[:3] == self.target.split("-")[:3]


# glibc 2.28 is what official Blender asks for. Rust itself supports no older macOS than these two. On Intel's Macs,
# Blender 4.5 was the last.
PLATFORMS = (
    Platform("linux-x64", "x86_64-unknown-linux-gnu", "manylinux_2_28_x86_64"),
    Platform("linux-arm64", "aarch64-unknown-linux-gnu", "manylinux_2_28_aarch64"),
    Platform("windows-x64", "x86_64-pc-windows-gnu", "win_amd64"),
    Platform("macos-arm64", "aarch64-apple-darwin", "macosx_11_0_arm64"),
    Platform("macos-x64", "x86_64-apple-darwin", "macosx_10_12_x86_64"),
)


def named(name):
    """The platform of this name. Raises `SystemExit`."""
    for platform in PLATFORMS:
        if platform.name == name:
            return platform
    raise SystemExit(f"{name}: no such platform; there are {', '.join(p.name for p in PLATFORMS)}")


def of_triple(triple):
    """The platform of a machine whose compiler calls it so. Raises `SystemExit`."""
    for platform in PLATFORMS:
        if platform.is_of(triple):
            return platform
    raise SystemExit(f"{triple}: Blender runs on no such platform")


def of_wheel(name):
    """The platform of a wheel by its file name, whichever version of the system it asks for. Raises `SystemExit`."""
    tag = name.removesuffix(".whl").split("-")[-1].split(".")[0]
    for platform in PLATFORMS:
        if family(tag) == family(platform.tag):
            return platform
    raise SystemExit(f"{name}: made for no platform that Blender knows")


def family(tag):
    """A wheel's tag without the version of the system: `manylinux_2_28_x86_64` and `linux_x86_64` are of one family."""
    return re.sub(r"^(?:many)?(linux|macosx)(?:_\d+_\d+)?_", r"\1_", tag)
