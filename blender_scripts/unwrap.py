"""Unwrap files of meshes and point clouds without a window.

blender -b -P blender_scripts/unwrap.py -- IN... -o OUT [--report report.json] [settings]
python blender_scripts/unwrap.py IN... -o OUT [--report report.json] [settings]

`--help` lists formats and settings; exit codes: 0 all fine, 1 some assets failed, 2 usage, 3 environment,
4 a result is not as promised, 5 stopped by a signal.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import addon_loader

if __name__ == "__main__":
    addon_loader.run(addon_loader.load("batch").main)
