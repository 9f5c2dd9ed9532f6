"""One unwrap in a process of its own, so that its peak of memory is its own: prints what it took as a line of JSON.

python one_run.py DIRECTORY [--empty] [--threads N]

DIRECTORY holds positions.npy, corner_vertices.npy and face_offsets.npy. `--empty` loads all the same and unwraps
nothing.
"""

import argparse
import json
import resource
import sys
import time
from pathlib import Path

import ble_unwrap_native
import numpy as np

SHOWN = (
    "charts", "l2", "l2_worst_chart", "l_infinity", "seam_length", "packing_efficiency", "flips", "overlaps",
)  # fmt: skip


def peak_bytes():
    """Most memory that this process had resident.

    Linux carries the figure of getrusage over from the process that started this one, so it is asked for that of the
    program itself.
    """
    try:
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def main():
    parser = argparse.ArgumentParser(prog="one_run.py")
    parser.add_argument("directory", type=Path)
    parser.add_argument("--empty", action="store_true")
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args()
    arrays = [np.load(options.directory / f"{name}.npy") for name in ("positions", "corner_vertices", "face_offsets")]
    found = {}
    wall, cpu = time.perf_counter(), time.process_time()
    if not options.empty:
        report = ble_unwrap_native.unwrap(*arrays, threads=options.threads).report
        found = {name: report[name] for name in SHOWN}
    found |= {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu, "peak": peak_bytes()}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
