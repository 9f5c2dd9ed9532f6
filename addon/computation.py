"""Atlases computed at once or on another thread: arrays and settings in, UVs out. Knows nothing of Blender."""

import threading
from dataclasses import dataclass

import numpy as np

from . import engine, kept_analysis

# Settings that a mesh is analysed with, and those that come with a preset.
ANALYSED = ("preset", "weld", "weld_distance", "cut_angle")


@dataclass
class Result:
    """One UV per corner and a chart per face of a mesh, or one of both per point of a cloud; and the native report.

    `stack` has a number per chart that charts share which lie on each other; -1 for those that lie alone.
    """

    uv: np.ndarray  # (c, 2) float32
    chart: np.ndarray  # (f,) int32; of a point that is in no chart: -1
    report: dict
    stack: np.ndarray  # (k,) int32; of a cloud: empty

    @property
    def stacks(self):
        """The charts and their stacks where some lie on each other, as `measurement.measure` takes them; else None."""
        return (self.chart, self.stack) if (self.stack >= 0).any() else None


def _mesh(selection, cut, follow):
    """The arrays of a mesh, by position and by name. `cut` and `follow` are kinds of marked edges."""
    return (
        (selection.positions, selection.corner_vertices, selection.face_offsets),
        {
            "corner_triangles": selection.corner_triangles,
            "seams": selection.marked(cut),
            "guides": selection.marked(follow),
            "seam_weights": selection.seam_weights,
        },
    )


def _caller(name, mesh, settings, keep):
    """A call of the function `name` of the native module, or where the analysis is kept of its method."""
    settings = engine.native_settings(settings)
    if keep:
        analysed = {name: settings[name] for name in ANALYSED if name in settings}
        analysis = kept_analysis.of(*mesh, analysed, settings.get("threads", 0))
        return lambda module: getattr(analysis, name)(**settings)
    return lambda module: getattr(module, name)(*mesh[0], **mesh[1], **settings)


def _result(atlas):
    uv, chart = np.asarray(atlas.uv, np.float32), np.asarray(atlas.chart, np.int32)
    return Result(uv, chart, dict(atlas.report), np.asarray(getattr(atlas, "stack", ()), np.int32))


def unwrap(selection, settings, *, cut=(), follow=(), keep=False):
    """Unwraps at once. Raises `engine.EngineMissing`, `engine.EngineError`.

    `cut` and `follow` are kinds of marked edges: all cut, or where borders are drawn to. With `keep`, the analysis of
    the mesh is kept for the next call, until another mesh is analysed or `kept_analysis.forget` is called.
    """
    return _result(engine.call(_caller("unwrap", _mesh(selection, cut, follow), settings, keep)))


def unwrap_points(positions, settings):
    """Maps a cloud at once. Raises `engine.EngineMissing`, `engine.EngineError`."""
    return _result(engine.call(lambda module: module.unwrap_points(positions, **engine.native_settings(settings))))


def submit_unwrap(selection, settings, *, cut=(), follow=(), keep=False):
    """As `unwrap`, on another thread: a `Job`. Raises `engine.EngineMissing`, `engine.EngineError`."""
    return Job(engine.call(_caller("submit_unwrap", _mesh(selection, cut, follow), settings, keep)))


def submit_unwrap_points(positions, settings):
    """Maps a cloud on another thread: a `Job`. Raises `engine.EngineMissing`, `engine.EngineError`."""
    return Job(engine.call(lambda module: module.submit_unwrap_points(positions, **engine.native_settings(settings))))


@dataclass
class Packed:
    """One place per point, and the native report."""

    uv: np.ndarray  # (n, 2) float32
    report: dict


def pack(points, triangles, island, settings, **rules):
    """Packs islands at once. Raises `engine.EngineMissing`, `engine.EngineError`.

    `island` is that of each triangle; `rules` are what the native `pack` takes beside its settings, such as
    `obstacles`.
    """
    return engine.call(_packer(points, triangles, island, settings, rules))


def submit_pack(points, triangles, island, settings, **rules):
    """As `pack`, on another thread: a `Job`."""
    return ThreadJob(_packer(points, triangles, island, settings, rules))


def _packer(points, triangles, island, settings, rules):
    settings = engine.native_settings(settings)

    def call(module, job=None):
        packed = module.pack(points, triangles, island, **rules, **settings, job=job)
        return Packed(np.asarray(packed.uv, np.float32), dict(packed.report))

    return call


@dataclass
class Relaxed:
    """One UV per corner, and the native report."""

    uv: np.ndarray  # (c, 2) float32
    report: dict


def relax(mesh, uv, settings, **rules):
    """Relaxes islands at once. Raises `engine.EngineMissing`, `engine.EngineError`.

    `mesh` are positions, vertices of corners and offsets of faces; `rules` are what the native `relax` takes beside
    its settings, such as `pinned`.
    """
    return engine.call(_relaxer(mesh, uv, settings, rules))


def submit_relax(mesh, uv, settings, **rules):
    """As `relax`, on another thread: a `Job`."""
    return ThreadJob(_relaxer(mesh, uv, settings, rules))


def _relaxer(mesh, uv, settings, rules):
    settings = engine.native_settings(settings)

    def call(module, job=None):
        relaxed = module.relax(*mesh, uv, **rules, **settings, job=job)
        return Relaxed(np.asarray(relaxed.uv, np.float32), dict(relaxed.report))

    return call


class Job:
    """A computation on the native module's own thread."""

    def __init__(self, native_job):
        self._job = native_job

    def progress(self):
        """Share of the work done, 0 to 1."""
        return float(self._job.progress())

    def stage(self):
        """What is being done, in a word or two."""
        return str(self._job.stage()).replace("_", " ")

    def is_finished(self):
        return bool(self._job.is_finished())

    def cancel(self):
        self._job.cancel()

    def result(self):
        """The result of a finished job. Raises `engine.EngineError`, `engine.EngineCancelled`."""
        return _result(engine.call(lambda module: self._job.result()))


class ThreadJob(Job):
    """A call of the native module on a thread of ours, for functions that have none of their own."""

    def __init__(self, call):
        super().__init__(engine.native().Job())
        self._result = self._error = self._begun_at = None
        self._thread = threading.Thread(target=self._work, args=(call,), daemon=True)
        self._thread.start()

    def _work(self, call):
        try:
            self._result = engine.call(lambda module: call(module, job=self._job))
        except Exception as error:  # it belongs to whoever asks for the result
            self._error = error

    def progress(self):
        """Share of the work done, 0 to 1: the native module counts a step as the part of an unwrap that it is."""
        share = super().progress()
        if self._begun_at is None and share > 0.0:
            self._begun_at = share
        return (share - self._begun_at) / (1.0 - self._begun_at) if self._begun_at not in (None, 1.0) else share

    def is_finished(self):
        return not self._thread.is_alive()

    def result(self):
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._result
