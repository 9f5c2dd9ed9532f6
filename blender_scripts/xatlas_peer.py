"""xatlas on plain arrays, a peer to compare with: https://github.com/jpcy/xatlas, on PyPI as `xatlas`.

`unwrap` runs it in a process of its own, since on some meshes it crashes or takes hours. NumPy only; whoever has no
xatlas gets `Unavailable` with a sentence that says so.

python xatlas_peer.py IN.npz OUT.npz is that process.
"""

import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Name of the variable that holds a directory with xatlas, where it is not among the packages of this Python.
LIBRARY = "BLE_XATLAS_LIBRARY"
# Seconds after which it is given up: a dozen meshes of up to some ten thousand triangles take it one to ten, the
# 110,592 triangles of the demonstration's sculpt 160 of processor time, for which nobody waits.
TIMEOUT = 60
NOT_INSTALLED = 3  # exit code of the process


class Unavailable(Exception):
    """There is no layout by xatlas; the text says why."""


@dataclass
class PeerAtlas:
    """What xatlas made of triangles, and what it says of it."""

    uv: np.ndarray  # (3t, 2) float32: of the corners of the triangles, NaN where it made none
    texture_size: tuple  # width and height in texels; `uv` is divided by them, each coordinate by its own
    charts: int
    utilization: float  # share of the texels that it counts as used
    seconds: float


def unwrap(positions, triangles, *, margin, texture_size, timeout=TIMEOUT):
    """An atlas by xatlas, its charts cut by its defaults, of triangles as (t, 3) indices into (n, 3) positions.

    `margin` is the distance that charts have at least, in texels. xatlas makes a texture of a size of its own, which it
    tries to bring near that of a square as long as the longer side of `texture_size`. Raises `Unavailable`.
    """
    with tempfile.TemporaryDirectory(prefix="ble_xatlas_") as work:
        given, made = Path(work) / "given.npz", Path(work) / "made.npz"
        np.savez(
            given,
            positions=np.asarray(positions, np.float32),
            triangles=np.asarray(triangles, np.uint32).reshape(-1, 3),
            padding=math.ceil(margin / 2),  # xatlas keeps it around every chart, so twice between two
            resolution=max(texture_size),
        )
        try:
            done = subprocess.run(
                [sys.executable, __file__, given, made], capture_output=True, text=True, check=False, timeout=timeout
            )
        except subprocess.TimeoutExpired as error:
            raise Unavailable(f"xatlas was not done after {timeout} s") from error
        except OSError as error:
            raise Unavailable(f"no process for xatlas could be started: {error}") from error
        if done.returncode == NOT_INSTALLED:
            raise Unavailable("xatlas is not installed (pip install xatlas)")
        if done.returncode or not made.is_file():
            lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
            raise Unavailable(f"xatlas failed: {lines[-1]}")
        with np.load(made) as found:
            size = tuple(int(pixels) for pixels in found["size"])
            return PeerAtlas(
                found["uv"], size, int(found["charts"]), float(found["utilization"]), float(found["seconds"])
            )


def main(given, made):
    """Reads arrays, runs xatlas, writes arrays; the exit code."""
    if os.environ.get(LIBRARY):
        sys.path.append(os.environ[LIBRARY])
    try:
        import xatlas
    except ImportError:
        return NOT_INSTALLED
    with np.load(given) as arrays:
        positions, triangles = arrays["positions"], arrays["triangles"]
        padding, resolution = int(arrays["padding"]), int(arrays["resolution"])
    finite = np.isfinite(positions).all(axis=1)[triangles].all(axis=1)
    charts, packing = xatlas.ChartOptions(), xatlas.PackOptions()
    packing.padding, packing.resolution = padding, resolution
    atlas = xatlas.Atlas()
    started = time.perf_counter()
    atlas.add_mesh(positions, np.ascontiguousarray(triangles[finite]))
    atlas.generate(charts, packing)
    seconds = time.perf_counter() - started
    if atlas.atlas_count != 1:
        print(f"it made {atlas.atlas_count} textures instead of one", file=sys.stderr)
        return 1
    _vertex_of, corners, uv = atlas[0]
    uv_of_corners = np.full((len(triangles), 3, 2), np.nan, np.float32)
    uv_of_corners[finite] = uv[corners]
    np.savez(
        made,
        uv=uv_of_corners.reshape(-1, 2),
        size=(atlas.width, atlas.height),
        charts=atlas.chart_count,
        utilization=atlas.utilization,
        seconds=seconds,
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
