"""`make quality`: how good atlases are, over several triangulations of each mesh.

python native/evaluation/quality [MODEL ...] [--shuffles 4]

Of a single triangulation the number of charts is chance by a few per cent up and down: whether a change is for the
better shows in the mean over some. Each mesh (models given as .obj, .ply or .ply.gz, else generated ones) is unwrapped
at default settings as it is and with its vertices, faces and first corners shuffled; the table has a row a mesh, and
the geometric means over all. CPU seconds are those of an unwrap on one thread in a process of its own, two processes
at once. Exit code 1: an unwrap failed, or an atlas has flips or overlaps.
"""

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent / "scaling"))

import own_process
import quality_meshes
import quality_report
import scaling_meshes

SHUFFLES = 4
AT_ONCE = 2


def measured(name, make, shuffles, pool):
    """The row of the mesh that a function makes; its runs share the pool."""

    def run(number):
        with own_process.stored(quality_meshes.shuffled(mesh, number)) as directory:
            return own_process.run(directory, "--threads", "1")

    try:
        mesh = make()
        return quality_report.row(name, scaling_meshes.triangle_count(mesh), list(pool.map(run, range(shuffles))))
    except (own_process.Failed, OSError, ValueError) as error:
        return {"name": name, "failed": str(error)}


def main():
    parser = argparse.ArgumentParser(prog="quality", description="How good atlases are, over several triangulations.")
    parser.add_argument("models", nargs="*", metavar="MODEL", help=".obj, .ply or .ply.gz instead of generated meshes")
    parser.add_argument("--shuffles", type=int, default=SHUFFLES, help="triangulations of each (default: %(default)s)")
    options = parser.parse_args()
    if options.shuffles < 1:
        parser.error("--shuffles must be at least 1")
    for path in options.models:
        if not Path(path).is_file():
            parser.error(f"{path}: no such file")
    todo = [(Path(path).name.split(".")[0], lambda path=path: scaling_meshes.read(path)) for path in options.models]
    todo = todo or list(quality_meshes.GENERATED.items())
    rows = []
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for number, (name, make) in enumerate(todo, 1):
            row = measured(name, make, options.shuffles, pool)
            rows.append(row)
            charts = " ".join(map(str, row.get("of_each", ()))) + " charts"
            print(f"[{number}/{len(todo)}] {name}: {row.get('failed', charts)}", flush=True)
    print("", *quality_report.table(rows), sep="\n")
    good = [row for row in rows if "failed" not in row]
    if error := quality_report.error_of_charts(good):
        print(f"\nThe mean of the charts is known to ±{error:.1%} (one standard error, from the spread over shuffles).")
    return 1 if len(good) < len(rows) or any(row["bad"] for row in good) else 0


if __name__ == "__main__":
    sys.exit(main())
