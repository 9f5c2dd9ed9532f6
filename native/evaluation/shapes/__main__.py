"""`make shapes`: common shapes as they come out at default settings, to be looked at.

python native/evaluation/shapes [MODEL ...] [-o out/shapes.png] [--front=-y] [--up z] [--only NAME ...] [--size 240]

Each shape of common_shapes.py in three proportions, as it is modelled, in triangles and turned, or the models that are
given (.obj, .ply or .ply.gz; an .obj is turned as Blender does, so that its y is up). A cell shows the layout, its
charts in colours, and the model from the front and from the back with its seams; quads that are bent are red. Pages
after the first are out/shapes-2.png and so on. The figures are printed, too. Exit code 1: an unwrap failed, or an atlas
has flips or overlaps.
"""

# ruff: noqa: E402

import argparse
import sys
from pathlib import Path

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "native" / "evaluation" / "scaling"))

import ble_unwrap_native as native
import common_shapes
import layout_measures
import numpy as np
import scaling_meshes
import shape_sheet

SIZE = 240  # pixels of each of the three pictures of a cell
FRONT = "-y"  # as the add-on has it; the Python module's own default is no front
SHAPES_ON_A_PAGE = 3
COLUMNS_OF_MODELS, ROWS_OF_MODELS = 2, 5


def model(path, up):
    """A model from a file, upright; without a word on what is up, as Blender's importers have it."""
    mesh = scaling_meshes.read(path)
    if (up or ("y" if path.suffix == ".obj" else "z")) == "y":
        mesh.positions = mesh.positions[:, [0, 2, 1]] * (1, -1, 1)
    return mesh


class Sheet:
    """Draws cells, prints their figures and counts what went wrong."""

    def __init__(self, size, front):
        self.size, self.front, self.bad = size, front, 0

    def cell(self, mesh):
        try:
            atlas = native.unwrap(*mesh.arrays, front=self.front)
        except native.BleUnwrapError as error:
            self.bad += 1
            print(f"{mesh.name}: failed: {error}", flush=True)
            return shape_sheet.failed_cell(mesh.name, str(error), self.size)
        layout = layout_measures.Layout(mesh, np.asarray(atlas.uv), np.asarray(atlas.chart))
        self.bad += atlas.report["flips"] > 0 or atlas.report["overlaps"] > 0
        print(f"{mesh.name:34} {shape_sheet.figures(layout, atlas.report)}", flush=True)
        return shape_sheet.cell(layout, atlas.report, self.size)

    def of_shape(self, name):
        """Three rows under what is expected of the shape."""
        cells = [self.cell(mesh) for number in range(3) for mesh in common_shapes.variants(name, number)]
        rows = np.concatenate(shape_sheet.rows_of(cells, 3))
        return shape_sheet.titled(rows, f"{name}: {common_shapes.SHAPES[name].expected}")

    def of_models(self, paths, up):
        """Rows of two models."""
        return shape_sheet.rows_of([self.cell(model(path, up)) for path in paths], COLUMNS_OF_MODELS)


def main():
    parser = argparse.ArgumentParser(prog="shapes", description="Layouts of common shapes, to be looked at.")
    parser.add_argument("models", nargs="*", metavar="MODEL", type=Path, help=".obj, .ply or .ply.gz instead of shapes")
    parser.add_argument("-o", "--output", default=REPO / "out" / "shapes.png", type=Path)
    parser.add_argument("--only", nargs="+", choices=common_shapes.SHAPES, metavar="NAME", help="these shapes alone")
    parser.add_argument("--front", default=FRONT, choices=["none", "x", "-x", "y", "-y", "z", "-z"])
    parser.add_argument("--up", choices=["y", "z"], help="of models (default: y for .obj, z for .ply)")
    parser.add_argument("--size", type=int, default=SIZE, help="pixels of a picture (default: %(default)s)")
    options = parser.parse_args()
    if not 16 <= options.size <= 2048:
        parser.error("--size must be from 16 to 2048")
    for path in options.models:
        if not path.is_file():
            parser.error(f"{path}: no such file")
    sheet = Sheet(options.size, options.front)
    if options.models:
        rows, on_a_page = sheet.of_models(options.models, options.up), ROWS_OF_MODELS
    else:
        rows, on_a_page = [sheet.of_shape(name) for name in options.only or common_shapes.SHAPES], SHAPES_ON_A_PAGE
    options.output.parent.mkdir(parents=True, exist_ok=True)
    pages = [np.concatenate(rows[k : k + on_a_page]) for k in range(0, len(rows), on_a_page)]
    for path in shape_sheet.write_pages(options.output, pages):
        print(f"written to {path}")
    return 1 if sheet.bad else 0


if __name__ == "__main__":
    sys.exit(main())
