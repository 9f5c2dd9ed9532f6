"""One unwrap from objects to certificate: what the operator and the command line share."""

import time
from dataclasses import dataclass

import numpy as np

from . import engine, mesh_bridge, properties

POLL_SECONDS = 0.02
SMALLEST_BOUNDS = 1e-4  # of the unit square: a smaller rectangle is no place to pack into


@dataclass
class Outcome:
    """What a written unwrap came to."""

    title: str
    certificate: engine.Certificate
    report: dict  # of the native module
    seconds: float
    summary: str
    lines: list


class UnwrapTask:
    """Reads the meshes when made, then computes (`run` or `start`), then writes (`write`).

    Raises `mesh_bridge.MeshError`, `engine.EngineMissing`, `engine.EngineError`; whenever it does, no mesh was changed.
    """

    def __init__(self, objects, settings, *, threads=0):
        self.settings = {**properties.default_values(settings.get("preset", "DEFAULT")), **settings}
        self.make_new_map = self.settings["uv_map"] == "NEW"
        self.selection = mesh_bridge.gather(
            objects, only_selected=self.settings["use_selection"], make_new_map=self.make_new_map
        )
        self.native = {name: value for name, value in settings.items() if name not in properties.BRIDGE_SETTINGS}
        self.native["threads"] = threads
        self.bounds = None
        if self.settings["use_original_bounds"]:
            self._keep_place()
        self.started = time.perf_counter()

    def _keep_place(self):
        """Packs for the part of the texture that the old UVs fill, so that margin and density come out right."""
        held = mesh_bridge.read_uvs(self.selection)
        if held is None or not np.isfinite(held).all():
            self.selection.warnings.append("There were no UVs whose place could be kept")
            return
        low, high = held.min(axis=0).astype(float), held.max(axis=0).astype(float)
        width, height = self.settings["texture_size"]
        if (high - low).min() < SMALLEST_BOUNDS:
            self.selection.warnings.append("The old UVs fill no rectangle; the whole square was used")
            return
        pixels = np.maximum(1, np.floor((high - low) * (width, height))).astype(int)
        self.bounds = (low, pixels / (width, height))
        self.native["texture_size"] = (int(pixels[0]), int(pixels[1]))

    @property
    def use_seams(self):
        return self.settings["use_seams"]

    def run(self):
        """Computes the result at once."""
        return engine.unwrap(self.selection, self.native, use_seams=self.use_seams)

    def start(self):
        """Computes the result on another thread: an `engine.Job`."""
        return engine.Job(self.selection, self.native, use_seams=self.use_seams)

    def write(self, result, *, measure_again=True):
        """Writes a result to the meshes and judges what they hold afterwards."""
        if not np.isfinite(result.uv).all():
            raise engine.EngineError("the native library returned UVs that are not finite; nothing was changed")
        uv = result.uv
        if self.bounds is not None:
            low, extent = self.bounds
            uv = (low + uv.astype(np.float64) * extent).astype(np.float32)
        held = mesh_bridge.write_uvs(
            self.selection,
            uv,
            make_new_map=self.make_new_map,
            map_name=self.settings["uv_map_name"],
            mark_seams=self.settings["mark_seams"],
        )
        margin, limit = self.settings["margin"], self.settings["stretch_limit"]
        measured = result.report
        warnings = [*self.selection.warnings, *result.report.get("warnings", ())]
        if measure_again:
            size, weld = self.settings["texture_size"], self.settings["weld"]
            try:
                measured = engine.measure(self.selection, held, texture_size=size, margin=margin, weld=weld)
            except engine.EngineError as error:  # the UVs are written: say what is known
                warnings.append(f"The written UVs could not be measured: {error}")
        certificate = engine.certify(measured, margin=margin, stretch_limit=limit, warnings=warnings)
        seconds = time.perf_counter() - self.started
        return Outcome(
            title=self.selection.title,
            certificate=certificate,
            report=result.report,
            seconds=seconds,
            summary=engine.summary(measured, seconds),
            lines=engine.lines(certificate, margin=margin, stretch_limit=limit),
        )


def unwrap_objects(objects, settings, *, threads=0, progress=None):
    """Unwraps mesh objects into one atlas and writes it; returns the `Outcome`.

    `settings` as in the panel, missing ones at their defaults; `progress(fraction, stage)` is called while it runs.
    """
    settings = {"preset": "DEFAULT", "use_selection": False, **settings}
    task = UnwrapTask(mesh_bridge.unique_meshes(objects), settings, threads=threads)
    job = task.start()
    try:
        while not job.is_finished():
            if progress:
                progress(job.progress(), job.stage())
            time.sleep(POLL_SECONDS)
    except KeyboardInterrupt:
        job.cancel()
        raise
    return task.write(job.result())
