"""`make scaling`: time and peak memory of an unwrap against the number of faces.

python native/evaluation/scaling [MODEL ...] [-o out/scaling] [--largest 1024000] [--threads N] [--no-models]

Generated families from 1,000 faces on, doubling, and models: those given (.obj, .ply, .ply.gz), else those of
../shared/models beside this checkout, if it is there. Writes README.md with the table, scaling.png and scaling.json. It
reports: that something took long is no failure, that an unwrap failed is.
"""

# ruff: noqa: E402

import argparse
import json
import sys
from pathlib import Path

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "native" / "paper"))

import machine
import own_process
import scaling_meshes
import scaling_report

DEVELOPMENT_MODELS = REPO.parent / "shared" / "models"
SMALLEST = 1_000
LARGEST = 1_024_000
# Meshes of many parts stop here: their charts are as many as the parts.
LARGEST_OF_PARTS = 256_000
RUNS_OF_SMALL = 3


def measured(mesh, family, threads):
    """The row of a mesh: several runs of a small one, of which the least count, as what they take varies upwards."""
    row = {"name": mesh.name, "family": family, "faces": scaling_meshes.triangle_count(mesh)}
    with own_process.stored(mesh) as directory:
        arguments = ["--threads", str(threads)]
        try:
            empty = own_process.run(directory, "--empty", *arguments)
            runs = RUNS_OF_SMALL if row["faces"] < scaling_report.LARGE else 1
            found = [own_process.run(directory, *arguments) for _ in range(runs)]
        except own_process.Failed as error:
            return {**row, "failed": str(error)}
    least = {key: min(f[key] for f in found) for key in ("cpu", "wall", "peak")}
    # Of a mesh of a few faces the difference may be a page or none: the logarithm needs something.
    return {**row, **found[0], **least, "peak": max(least["peak"] - empty["peak"], 4096)}


def sources(options):
    """(family, function that makes the mesh) of everything that is measured, small to large."""
    found = []
    for family, make in scaling_meshes.FAMILIES.items():
        largest = min(options.largest, LARGEST_OF_PARTS) if family == "parts" else options.largest
        size = SMALLEST
        while size <= largest:
            found.append((family, lambda make=make, size=size: make(size)))
            size *= 2
    paths = [Path(path) for path in options.models]
    if not paths and options.use_models and DEVELOPMENT_MODELS.is_dir():
        paths = [path for path in DEVELOPMENT_MODELS.iterdir() if path.name.endswith((".obj", ".ply", ".ply.gz"))]
        paths.sort(key=lambda path: (path.stat().st_size, path.name))
    return found + [("models", lambda path=path: scaling_meshes.read(path)) for path in paths]


def main():
    parser = argparse.ArgumentParser(prog="scaling", description="Time and memory of an unwrap against its faces.")
    parser.add_argument("models", nargs="*", metavar="MODEL", help=".obj, .ply or .ply.gz")
    parser.add_argument("-o", "--output", default=REPO / "out" / "scaling", type=Path)
    parser.add_argument("--largest", type=int, default=LARGEST, help="faces of the largest generated mesh")
    parser.add_argument("--threads", type=int, default=0, help="of an unwrap (default: as many as there are cores)")
    parser.add_argument("--models", dest="use_models", action=argparse.BooleanOptionalAction, default=True)
    options = parser.parse_args()
    if options.largest < SMALLEST or options.threads < 0:
        parser.error(f"--largest must be at least {SMALLEST}, --threads not negative")
    for path in options.models:
        if not Path(path).is_file():
            parser.error(f"{path}: no such file")
    rows = []
    todo = sources(options)
    options.output.mkdir(parents=True, exist_ok=True)
    for number, (family, make) in enumerate(todo, 1):
        mesh = make()
        row = measured(mesh, family, options.threads)
        rows.append(row)
        said = f"{row['name']}: {row['faces']:,} faces, "
        said += row.get("failed") or (
            f"{row['charts']} charts, {row['cpu']:.2f} s of CPU, {row['wall']:.2f} s, {row['peak'] / 1e6:.0f} MB"
        )
        print(f"[{number}/{len(todo)}] {said}", flush=True)
        (options.output / "scaling.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    (options.output / "README.md").write_text(scaling_report.page(rows, machine.described()), encoding="utf-8")
    scaling_report.plot(rows, options.output / "scaling.png")
    print(
        "", scaling_report.table(rows), "", *scaling_report.verdicts(rows), "", f"written to {options.output}", sep="\n"
    )
    return 1 if any("failed" in row for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
