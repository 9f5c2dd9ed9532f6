"""`make packing`: how much of the square packers cover with the same islands at the same distance.

python native/evaluation/packing [MODEL ...] [--packers ours xatlas sparrow blender] [--keep DIRECTORY] [--seconds 20]

The islands are the charts of our own atlases (at the default limit on stretch and at a tight one) and of xatlas's, of
models given as .obj, .ply or .ply.gz, else of generated meshes. All packers get the same islands; two are to be
2 texels apart and 1 from the border, in a square of 1024. Every result is checked by GEOS, whatever its packer says;
one that keeps less does not count. CPU seconds are those of one thread, for packers that have to be asked several times
those of the best one. Sparrow gets `--seconds` a set, in all. `--keep` stores the islands, so that two versions of the
packer see the same ones. Exit code 1: a result of our own does not keep the distance.
"""

import argparse
import pickle
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))

import islands
import packers
import packing_report


def stored(options):
    """The sets of islands: from the directory where they are kept, if they are there, else made and kept there."""
    names = "-".join(Path(model).name.split(".")[0] for model in options.models) or "generated"
    kept = Path(options.keep) / f"{names[:80]}.islands" if options.keep else None
    if kept and kept.is_file():
        return pickle.loads(kept.read_bytes())
    found = list(islands.made(islands.sets(options.models), options.most))
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(pickle.dumps(found))
    return found


def main():
    parser = argparse.ArgumentParser(prog="packing", description="Packers compared on the same islands.")
    parser.add_argument("models", nargs="*", metavar="MODEL", help=".obj, .ply or .ply.gz instead of generated meshes")
    parser.add_argument("--packers", nargs="+", default=[], help="beginnings of names, else all that are installed")
    parser.add_argument("--seconds", type=float, default=20, help="of sparrow, a set (default: %(default)s)")
    parser.add_argument("--most", type=int, default=islands.MOST_ISLANDS, help="islands a set (default: %(default)s)")
    parser.add_argument("--least", type=int, default=1, help="islands a set (default: %(default)s)")
    parser.add_argument("--keep", metavar="DIRECTORY", help="where islands are stored for the next time")
    options = parser.parse_args()
    for path in options.models:
        if not Path(path).is_file():
            parser.error(f"{path}: no such file")
    chosen = packers.available(options.packers, options.seconds)
    if not chosen:
        parser.error("none of the packers is installed")
    sets = [one for one in stored(options) if options.least <= len(one.islands) <= options.most]
    rows, failed = [], 0
    for number, one in enumerate(sorted(sets, key=lambda one: len(one.islands)), 1):
        found = {name: packers.run(packer, one.islands) for name, packer in chosen.items()}
        failed += sum(found[name] is None for name in found if name.startswith("ours"))
        rows.append((len(one.islands), found))
        said = "  ".join(f"{name} {f'{p.cover:.3f} {p.cpu:.2f}s' if p else '-'}" for name, p in found.items())
        print(f"[{number}/{len(sets)}] {one.name}, {len(one.islands)} islands: {said}", flush=True)
    print("", *packing_report.tables(rows, list(chosen), next(iter(chosen))), sep="\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
