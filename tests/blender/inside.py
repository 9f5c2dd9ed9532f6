"""Runs pytest on this directory inside Blender; started by run.py."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "blender_scripts"))

import addon_loader  # noqa: E402


def main(arguments):
    # Blender's Python may have no pytest of its own; where it has, that one comes first.
    sys.path.append(os.environ["BLE_PYTEST_LIBRARY"])
    import pytest

    options = [
        "--rootdir",
        str(HERE),
        "--confcutdir",
        str(HERE),
        "-c",
        str(HERE / "pytest.ini"),
        "-p",
        "no:cacheprovider",
    ]
    return int(pytest.main([*options, *arguments, str(HERE)]))


if __name__ == "__main__":
    addon_loader.run(main)
