"""Whole unwraps with the paper's model and with Isomap in its place: charts, seam, stretch and CPU seconds as ratios.

python native/paper/rivals.py [MODEL ...] [--limit 1.1 1.02] [--price 0 default] [--repeat 1] [--json FILE]

Everything else is the same: `unwrap` with `model="default"` against `model="isomap"`. Models are .obj, .ply or .ply.gz;
without any, the generated ones of `make quality` and the open surfaces of `notched.py`. A ratio is the exponential of
the mean logarithm of BLE's figure over Isomap's, so below 1 BLE has less. A mesh counts once, by its mean over the
settings, and the standard error is that over meshes. Each unwrap runs on one thread, the two models by turns; of
several runs the least CPU counts. Exit code 1: an atlas has flips or overlaps.
"""

import argparse
import json
import math
import sys
import time
from pathlib import Path

REPO = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(REPO / "native" / part) for part in ("paper", "evaluation/scaling", "evaluation/quality")]

import ble_unwrap_native as ble  # noqa: E402
import notched  # noqa: E402

MODELS = ("default", "isomap")
LIMITS, PRICES = (1.1, 1.02), ("0", "default")
# Column -> key of a figure.
FIGURES = {"charts": "charts", "seam": "seam_length", "L2² - 1": "excess", "CPU": "cpu"}
# Below this a seam or an excess is 0, of which there is no logarithm: an open sheet in one chart has no seam.
NOTHING = 1e-9
OF_QUALITY, OF_NOTCHED = "of `make quality`", "with holes and notches"


def unwrapped(mesh, model, settings, repeat=1):
    """What one model makes of a mesh. `excess` is L2² - 1, which is 0 for an isometry."""
    cpu = math.inf
    for _ in range(repeat):
        begin = time.process_time()
        report = ble.unwrap(*mesh.arrays, model=model, threads=1, **settings).report
        cpu = min(cpu, time.process_time() - begin)
    keys = ("charts", "seam_length", "l2", "l2_worst_chart", "packing_efficiency", "flips", "overlaps")
    return {key: report[key] for key in keys} | {"cpu": cpu, "excess": report["l2"] ** 2 - 1}


def settings_of(limit, price):
    return {"stretch_limit": limit} | ({} if price == "default" else {"stretch_price": float(price)})


def compared(kind, mesh, limits=LIMITS, prices=PRICES, repeat=1):
    """The rows of a mesh: one for each limit and price, with what both models make of it."""
    return [
        {
            "kind": kind,
            # A model may come in several sizes under one name.
            "mesh": f"{mesh.name} ({len(mesh.face_offsets) - 1:,} faces)",
            "settings": f"limit {limit:g}, stretch price {price}",
            **{model: unwrapped(mesh, model, settings_of(limit, price), repeat) for model in MODELS},
        }
        for limit in limits
        for price in prices
    ]


def ratio(rows, key):
    """Ratio of BLE's figure to Isomap's, its standard error, and of how many meshes: those where neither is 0."""
    logarithms = {}
    for row in rows:
        ours, theirs = (row[model][key] for model in MODELS)
        if min(ours, theirs) > NOTHING:
            logarithms.setdefault((row["kind"], row["mesh"]), []).append(math.log(ours / theirs))
    means = [sum(each) / len(each) for each in logarithms.values()]
    if not means:
        return None
    mean = sum(means) / len(means)
    variance = sum((x - mean) ** 2 for x in means) / max(len(means) - 1, 1)
    return math.exp(mean), math.exp(mean) * math.sqrt(variance / len(means)), len(means)


def alike(rows):
    """Of how many rows the atlas is the same, by charts, seam and stretch to three places."""

    def same(ours, theirs):
        return (ours["charts"], ours["seam_length"]) == (theirs["charts"], theirs["seam_length"])

    pairs = [[row[model] for model in MODELS] for row in rows]
    return sum(same(*pair) and abs(pair[0]["l2"] - pair[1]["l2"]) < 1e-3 for pair in pairs)


def table(rows):
    """Markdown: a line for each kind of mesh and each setting, for each kind, and for all."""
    lines = [
        f"| meshes | settings | unwraps | the same | charts in all | {' | '.join(FIGURES)} |",
        f"|---|---|{'--:|' * (3 + len(FIGURES))}",
    ]
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    settings = list(dict.fromkeys(row["settings"] for row in rows))
    groups = [(kind, one) for kind in kinds for one in ([*settings, None] if len(settings) > 1 else settings)]
    for kind, one in [*groups, *([(None, None)] if len(kinds) > 1 else [])]:
        mine = [row for row in rows if kind in (None, row["kind"]) and one in (None, row["settings"])]
        if not mine:
            continue
        charts = " and ".join(f"{sum(row[model]['charts'] for row in mine)}" for model in MODELS)
        found = [ratio(mine, key) for key in FIGURES.values()]
        cells = ["-" if f is None else f"{f[0]:.3f} ± {f[1]:.3f}" for f in found]
        lines.append(
            f"| {kind or 'all'} | {one or 'all'} | {len(mine)} | {alike(mine)} | {charts} | {' | '.join(cells)} |"
        )
    return "\n".join(lines)


def generated(quick=False):
    """Kind and function of every generated mesh; functions, as a mesh is made when its turn comes."""
    import quality_meshes

    surfaces = list(notched.surfaces(24 if quick else notched.CELLS))
    found = [(OF_NOTCHED, lambda mesh=mesh: mesh) for mesh in (surfaces[:6] if quick else surfaces)]
    return found + ([] if quick else [(OF_QUALITY, make) for make in quality_meshes.GENERATED.values()])


def measured(makes, limits=LIMITS, prices=PRICES, repeat=1, say=print):
    """The rows of meshes, each of some kind."""
    rows = []
    for kind, make in makes:
        for row in compared(kind, make(), limits, prices, repeat):
            rows.append(row)
            said = (
                f"{model} {row[model]['charts']} charts, seam {row[model]['seam_length']:.3f},"
                f" L2 {row[model]['l2']:.4f}, {row[model]['cpu']:.2f} s"
                for model in MODELS
            )
            say(f"{row['mesh']}, {row['settings']}: {'; '.join(said)}")
    return rows


def main():
    import scaling_meshes

    parser = argparse.ArgumentParser(prog="rivals.py", description="Whole unwraps with BLE and with Isomap.")
    parser.add_argument("models", nargs="*", metavar="MODEL", help=".obj, .ply or .ply.gz instead of generated meshes")
    parser.add_argument("--limit", nargs="+", type=float, default=LIMITS, help="stretch limits (default: 1.1 1.02)")
    parser.add_argument("--price", nargs="+", default=PRICES, help="stretch prices (default: 0 default)")
    parser.add_argument("--repeat", type=int, default=1, help="runs of each, the least CPU counts (default: 1)")
    parser.add_argument("--json", type=Path, help="also write all figures there")
    options = parser.parse_args()
    for path in options.models:
        if not Path(path).is_file():
            parser.error(f"{path}: no such file")
    given = [("given", lambda path=path: scaling_meshes.read(path)) for path in options.models]
    rows = measured(given or generated(), options.limit, options.price, options.repeat)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    print("", table(rows), sep="\n")
    return 1 if any(row[model]["flips"] + row[model]["overlaps"] for row in rows for model in MODELS) else 0


if __name__ == "__main__":
    sys.exit(main())
