"""One cloud, from points to certificate; the counterpart of task.py, with the same steps."""

import bpy
import numpy as np

from . import cloud_bridge, cloud_report, computation, properties
from .task import Outcome, Timer, bounds_to_keep, placed


class CloudTask:
    """Holds the points of a cloud, computes (`run` or `start`), then writes (`write`). A cloud has a texture to itself.

    Raises `mesh_bridge.MeshError`, `engine.EngineMissing`, `engine.EngineError`; whenever it does, nothing was changed.
    """

    def __init__(self, cloud, settings, *, threads=0):
        self.cloud = cloud
        self.settings = {**properties.default_values(settings.get("preset", "DEFAULT")), **settings}
        self.native = properties.native_values(settings, properties.SURFACE_SETTINGS)
        kept = [name for name in properties.KEPT_BY_PRESETS if name not in properties.SURFACE_SETTINGS]
        self.native |= {name: self.settings[name] for name in kept}
        self.native["threads"] = threads
        self.bounds = None
        if self.settings["use_original_bounds"]:
            self._keep_place()
        self.timer = Timer()

    def _keep_place(self):
        held = cloud_bridge.read_uvs(self.cloud, self.settings["uv_map_name"])
        self.bounds, why_not = bounds_to_keep(held, self.settings["texture_size"])
        if self.bounds is None:
            self.cloud.warnings.append(f"{self.title}: {why_not[0].lower()}{why_not[1:]}")
        else:
            self.native["texture_size"] = self.bounds.pixels

    @property
    def title(self):
        return self.cloud.title

    @property
    def written(self):
        return [bpy.data.objects[self.cloud.object_name]]

    @property
    def element_count(self):
        return len(self.cloud.positions)

    def run(self):
        """Computes the result at once."""
        self.timer.start()
        return computation.unwrap_points(self.cloud.positions, self.native)

    def start(self):
        """Computes the result on another thread: an `computation.Job`."""
        self.timer.start()
        return computation.submit_unwrap_points(self.cloud.positions, self.native)

    def check(self):
        """Raises `mesh_bridge.MeshError` where `write` would."""
        cloud_bridge.check(self.cloud, map_name=self.settings["uv_map_name"])

    def write(self, result, *, measure_again=True):
        """Writes a result to the points and judges what they hold afterwards. Unmapped points are put at (0, 0)."""
        del measure_again  # without faces there is nothing to measure but what is compared here at no cost
        self.timer.start()
        mapped = (result.chart >= 0)[:, None]
        uv = np.where(mapped, result.uv, np.float32(0))
        uv = np.where(mapped, placed(uv, self.bounds), np.float32(0))
        held, attribute = cloud_bridge.write_uvs(self.cloud, uv, map_name=self.settings["uv_map_name"])
        warnings = [*self.cloud.warnings, *(f"{self.title}: {text}" for text in result.report.get("warnings", ()))]
        if attribute != (self.settings["uv_map_name"] or cloud_bridge.DEFAULT_NAME):
            warnings.append(f"{self.title}: its UVs are in {attribute}, since the name was taken by other data")
        limit = self.settings["stretch_limit"]
        found = cloud_report.measured(result, uv, held)
        certificate = cloud_report.certify(found, stretch_limit=limit, warnings=warnings)
        seconds = self.timer.seconds()
        return Outcome(
            title=self.title,
            certificate=certificate,
            report=result.report,
            seconds=seconds,
            summary=cloud_report.summary(found, seconds),
            lines=cloud_report.lines(certificate, stretch_limit=limit, attribute=attribute),
            maps=[attribute],
        )
