"""What `make packing` packs: the charts of our own atlases and of xatlas's, as flat triangles, a set an atlas."""

import functools
import sys
from dataclasses import dataclass, field
from pathlib import Path

import ble_unwrap_native
import numpy as np

REPO = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(REPO / "native" / "evaluation" / part) for part in ("quality", "scaling")]

import quality_meshes  # noqa: E402
import scaling_meshes  # noqa: E402

# Limits on stretch at which our own atlases are made: the default, and one that makes several times as many charts.
LIMITS = (None, 1.002)
MOST_ISLANDS = 2_500


@dataclass
class Island:
    """A chart: points in any unit that all islands of a set share, counter-clockwise triangles, and its outlines."""

    points: np.ndarray
    triangles: np.ndarray
    loops: list = field(default_factory=list)  # closed chains of point numbers, the outer one first

    def __post_init__(self):
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        signed = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        self.area = float(np.abs(signed).sum())
        if not self.loops:
            self.loops = _loops(self.triangles)
            self.loops.sort(key=lambda loop: -np.ptp(self.points[loop], axis=0).prod())


@dataclass
class IslandSet:
    name: str
    islands: list

    @property
    def area(self):
        return sum(island.area for island in self.islands)


def _loops(triangles):
    """The boundary of triangles as closed chains: what has a triangle on one side only."""
    sides = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)}
    after = {}
    for a, b in sides:
        if (b, a) not in sides:
            after.setdefault(a, []).append(b)
    loops = []
    while after:
        start = next(iter(after))
        chain = [start]
        while True:
            following = after[chain[-1]]
            at = following.pop()
            if not following:
                del after[chain[-1]]
            if at == start or at not in after:
                break
            chain.append(at)
        loops.append(np.array(chain))
    return loops


def _islands(uv, triangles, chart):
    """Charts as islands; corners at the same place are one point. Charts without area are left out."""
    found = []
    for number in range(int(chart.max(initial=-1)) + 1):
        corners = triangles[chart == number]
        if not len(corners):
            continue
        points, index = np.unique(uv[corners.reshape(-1)], axis=0, return_inverse=True)
        own = index.reshape(-1, 3)
        a, b, c = (points[own[:, k]] for k in range(3))
        turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        own = np.where((turn < 0)[:, None], own[:, ::-1], own)[turn != 0]
        if len(own):
            found.append(Island(points.astype(float), own))
    return found


def of_our_atlas(mesh, limit):
    settings = {} if limit is None else {"stretch_limit": limit}
    atlas = ble_unwrap_native.unwrap(*mesh.arrays, **settings)
    sizes = np.diff(mesh.face_offsets)
    face = np.repeat(np.arange(len(sizes)), sizes)
    corners = mesh.corner_triangles()
    chart = np.asarray(atlas.chart)[face[corners[:, 0]]]
    return _islands(np.asarray(atlas.uv, np.float64), corners, chart)


def of_xatlas(mesh):
    import xatlas

    vertices, triangles, uv = xatlas.parametrize(mesh.positions.astype(np.float32), mesh.triangles().astype(np.uint32))
    return _islands(uv.astype(np.float64), triangles.astype(np.int64), _pieces(triangles, len(vertices)))


def _pieces(triangles, points):
    """The connected piece of each triangle: xatlas does not tell which chart a triangle is of."""
    label = np.arange(points)
    while True:
        least = label[triangles].min(axis=1)
        before = label.copy()
        for k in range(3):
            np.minimum.at(label, triangles[:, k], least)
        label = label[label]
        if (label == before).all():
            break
    return np.unique(label[triangles[:, 0]], return_inverse=True)[1]


def sets(models):
    """Sets of islands one by one, of models given as files or else of generated meshes."""
    todo = [(Path(path).name.split(".")[0], lambda path=path: scaling_meshes.read(path)) for path in models]
    for name, make in todo or quality_meshes.GENERATED.items():
        mesh = make()
        for limit in LIMITS:
            yield f"{name}, ours" + (f" at {limit}" if limit else ""), functools.partial(of_our_atlas, mesh, limit)
        yield f"{name}, xatlas's", functools.partial(of_xatlas, mesh)


def made(todo, most):
    """The sets that can be made, of 1 to `most` islands; says why another cannot."""
    for name, make in todo:
        try:
            found = make()
        except (ble_unwrap_native.BleUnwrapError, ValueError, ImportError) as error:
            print(f"{name}: {error}", flush=True)
            continue
        if 1 <= len(found) <= most:
            yield IslandSet(name, found)
