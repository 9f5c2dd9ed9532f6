"""Unwraps in processes of their own, for `make scaling` and `make quality`."""

import json
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np

ONE_RUN = Path(__file__).resolve().parent / "one_run.py"
SECONDS_AT_MOST = 3600


class Failed(Exception):
    """An unwrap did not end well; the text is its own."""


@contextmanager
def stored(mesh):
    """A directory with the arrays of a mesh, as long as it is needed."""
    with tempfile.TemporaryDirectory() as scratch:
        for name in ("positions", "corner_vertices", "face_offsets"):
            np.save(Path(scratch) / f"{name}.npy", getattr(mesh, name))
        yield scratch


def run(directory, *arguments):
    """What one process measured."""
    command = [sys.executable, ONE_RUN, directory, *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=SECONDS_AT_MOST)
    except subprocess.TimeoutExpired as error:
        raise Failed(f"not done in {SECONDS_AT_MOST} s") from error
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        raise Failed(lines[-1] if lines else f"exit code {done.returncode}")
    return json.loads(done.stdout.splitlines()[-1])
