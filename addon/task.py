"""One unwrap of surfaces, from objects to certificate: what the operator and the command line share."""

import time
from dataclasses import dataclass, field

import numpy as np

from . import computation, engine, measurement, mesh_bridge, properties, surface_report, textures, units, uv_maps
from .certificate import Certificate
from .wording import counted

POLL_SECONDS = 0.02
SMALLEST_BOUNDS = 1e-4  # of the unit square: a smaller rectangle is no place to pack into


@dataclass
class Outcome:
    """What a written unwrap came to."""

    title: str
    certificate: Certificate
    report: dict  # of the native module
    seconds: float
    summary: str
    lines: list
    maps: list  # name of the UV map or point attribute of every object
    # Numbers of the faces of every object that are in charts narrower than two texels; empty for points.
    narrow_faces: list = field(default_factory=list)


class Timer:
    """Seconds of a task: computing and writing, without waiting for other tasks in between."""

    def __init__(self):
        self._started, self._before = None, 0.0

    def start(self):
        self._started = time.perf_counter()

    def pause(self):
        self._before, self._started = self.seconds(), None

    def seconds(self):
        return self._before + (time.perf_counter() - self._started if self._started is not None else 0.0)


class UnwrapTask:
    """Reads the meshes when made, then computes (`run` or `start`), then writes (`write`).

    Raises `mesh_bridge.MeshError`, `engine.EngineMissing`, `engine.EngineError`; whenever it does, no mesh was changed.
    """

    def __init__(self, objects, settings, *, threads=0, keep=False, by_uv=False, whole=False):
        self.objects = list(objects)
        self.settings = {**properties.default_values(settings.get("preset", "DEFAULT")), **settings}
        self.target = uv_maps.chosen(self.settings)
        self.selection = mesh_bridge.gather(
            objects,
            only_selected=self.settings["use_selection"],
            by_uv=by_uv,
            whole=whole,
            target=self.target,
            move_pinned=self.settings["move_pinned"],
            **{name: self.settings[name] for name in ("sharp_angle", "seams_away", "seams_here")},
        )
        self.native = properties.native_values(settings, properties.CLOUD_SETTINGS)
        self.native |= {name: self.settings[name] for name in properties.KEPT_BY_PRESETS}
        self.native["threads"] = threads
        self.notes = []  # what was done, for the panel; no reason to worry
        self._look_at_textures()
        self.keep = keep  # the analysis, for the next unwrap of the same meshes
        self.bounds = None
        if self.settings["use_original_bounds"]:
            self._keep_place()
        self.timer = Timer()

    def _look_at_textures(self):
        """Takes the proportions of the materials' images, and warns where a UV map that they use is replaced."""
        objects = self.written
        maps = [uv_maps.map_to_write(obj.data, self.target, uv_maps.group_names(obj)) for obj in objects]
        for obj, (name, there) in zip(objects, maps, strict=True):
            if there and (note := textures.replaced_note(obj, name)):
                self.selection.warnings.append(note)
            if self.settings["preset"] == "LIGHTMAP" and not any(layer.name != name for layer in obj.data.uv_layers):
                self.selection.warnings.append(
                    f"{obj.name}: {name} is its only UV map; engines look for lightmaps in the second one, so unwrap "
                    "it for its materials into another one first"
                )
        if self.settings["correct_aspect"]:
            # The first map of a mesh becomes the one that textures use.
            names = [name if obj.data.uv_layers else None for obj, (name, _) in zip(objects, maps, strict=True)]
            size, note = textures.proportioned_size(objects, names, self.settings["texture_size"])
            self.settings["texture_size"] = self.native["texture_size"] = size
            self.notes += [note] if note else []

    def _keep_place(self):
        """Packs for the part of the texture that the old UVs fill, so that margin and density come out right."""
        held = mesh_bridge.read_uvs(self.selection, self.target)
        snap = self.settings["snap"]
        self.bounds, why_not = bounds_to_keep(held, self.settings["texture_size"], whole_texels=snap)
        if self.bounds is not None and self.native["tiles"] > 1 and self.bounds.extent.max() > 1.0:
            self.bounds = None
            why_not = "The old UVs take more than one tile, so no place was kept; all tiles were used"
        if self.bounds is None:
            self.selection.warnings.append(why_not)
        else:
            self.native["texture_size"] = self.bounds.pixels
            if self.native["tiles"] > 1:
                # A part of one tile has no tiles of its own.
                self.settings["tiles"] = self.native["tiles"] = 1
                self.selection.warnings.append("With Keep Place there is only one tile")

    @property
    def title(self):
        return self.selection.title

    @property
    def written(self):
        """The objects whose meshes are written: those with faces that are to be unwrapped."""
        parts = {part.mesh_uid for part in self.selection.parts}
        return [obj for obj in self.objects if obj.data.session_uid in parts]

    @property
    def element_count(self):
        return self.selection.face_count

    def _call(self, function):
        cut = [kind for kind in mesh_bridge.MARKS if self.settings[f"use_{kind}"]]
        follow = [kind for kind in mesh_bridge.MARKS if self.settings[f"follow_{kind}"] and kind not in cut]
        self.timer.start()
        return function(self.selection, self.native, cut=cut, follow=follow, keep=self.keep)

    def run(self):
        """Computes the result at once."""
        return self._call(computation.unwrap)

    def start(self):
        """Computes the result on another thread: an `computation.Job`."""
        return self._call(computation.submit_unwrap)

    def check(self):
        """Raises `mesh_bridge.MeshError` where `write` would: several tasks are written together or not at all."""
        mesh_bridge.check_parts(self.selection, self.target)

    def write(self, result, *, measure_again=True):
        """Writes a result to the meshes and judges what they hold afterwards."""
        self.timer.start()
        uv = placed(result.uv, self.bounds)
        stacks = result.stacks
        marks = {"mark_seams": self.settings["mark_seams"], "chart": stacks and stacks[0]}
        whole = mesh_bridge.write_uvs(self.selection, uv, target=self.target, **marks)
        held = mesh_bridge.of_selection(self.selection, whole)
        margin = result.report["margin_texels"]  # mip levels may have raised it
        limit = {name: self.settings[name] for name in ("stretch_limit", "limit_over")}
        measured = result.report
        warnings = [*self.selection.warnings, *result.report.get("warnings", ())]
        if measure_again:
            given = {name: self.settings[name] for name in ("texture_size", "tiles", "weld", "weld_distance")}
            try:
                measured = measurement.measure(self.selection, held, margin=margin, stacks=stacks, **given)
                measured["margin_texels"] = margin
                measured |= {name: result.report[name] for name in ("texels_per_unit", "stacked", "stacks")}
            except engine.EngineError as error:  # the UVs are written: say what is known
                warnings.append(f"The written UVs could not be measured: {error}")
        if kept := mesh_bridge.kept_faces(self.selection, whole):
            overlaps = self._overlaps(held, kept, stacks)
            measured = {**measured, "overlaps_with_kept": overlaps}
            if overlaps:
                warnings.append(
                    f"New charts overlap faces that were not unwrapped ({counted(overlaps, 'pair')} of triangles): "
                    "press Pack Only, which packs the selected islands around the others, or select those faces, too"
                )
        certificate = surface_report.certify(measured, margin=margin, warnings=warnings, **limit)
        notes = [*self.notes, *surface_report.found(result.report)]
        seconds = self.timer.seconds()
        return Outcome(
            title=self.selection.title,
            certificate=certificate,
            report=result.report,
            seconds=seconds,
            summary=surface_report.summary(measured, seconds),
            lines=surface_report.lines(certificate, margin=margin, **limit, notes=notes, length_text=units.length_text),
            maps=mesh_bridge.active_maps(self.selection),
            narrow_faces=mesh_bridge.by_part(
                self.selection, np.isin(result.chart, np.array(result.report["narrow_charts"], np.int32))
            ),
        )

    def _overlaps(self, held, kept, stacks):
        """Pairs of triangles, one unwrapped and one kept, that share area in the UV map."""
        chosen = self.selection
        triangles = chosen.corner_triangles
        if triangles is None:
            triangles = np.arange(len(chosen.corner_vertices), dtype=np.int32).reshape(-1, 3)
        unwrapped = (chosen.positions, chosen.corner_vertices, chosen.face_offsets, triangles, held)
        return measurement.overlaps_between(unwrapped, kept, stacks)


@dataclass
class Bounds:
    """The part of the texture to pack into: its lower corner and extent in UVs, and its size in whole pixels."""

    low: np.ndarray  # (2,)
    extent: np.ndarray  # (2,)
    pixels: tuple


def bounds_to_keep(uv, texture_size, *, whole_texels=False):
    """The rectangle that UVs (n, 2) fill, in whole pixels, and None; or None and why there is nothing to pack into.

    With `whole_texels` its lower corner, too, is where texels of the texture meet, as their sides are to be.
    """
    if uv is None or not np.isfinite(uv).all():
        return None, "There were no old UVs whose place could be kept; the whole texture was used"
    low, high = uv.min(axis=0).astype(float), uv.max(axis=0).astype(float)
    if (high - low).min() < SMALLEST_BOUNDS:
        return None, "The old UVs lie on one line or point, so they have no place to keep; the whole texture was used"
    if whole_texels:
        # What is a thousandth of a pixel off is so by rounding to single precision.
        low = np.ceil(low * texture_size - 1e-3) / texture_size
    pixels = np.maximum(1, np.floor((high - low) * texture_size + (1e-3 if whole_texels else 0.0))).astype(int)
    return Bounds(low, pixels / texture_size, (int(pixels[0]), int(pixels[1]))), None


def placed(uv, bounds):
    """UVs of the unit square, moved into the bounds if there are any. Raises `engine.EngineError` where not finite."""
    if not np.isfinite(uv).all():
        raise engine.EngineError("the native library returned UVs that are not finite; nothing was changed")
    if bounds is None:
        return uv
    return (bounds.low + uv.astype(np.float64) * bounds.extent).astype(np.float32)


def finished(job, progress=None):
    """Waits for a job and returns its result; `progress(fraction, stage)` is called meanwhile."""
    try:
        while not job.is_finished():
            if progress:
                progress(job.progress(), job.stage())
            time.sleep(POLL_SECONDS)
    except KeyboardInterrupt:
        job.cancel()
        raise
    return job.result()


def unwrap_objects(objects, settings, *, threads=0, progress=None):
    """Unwraps mesh objects into one atlas and writes it; returns the `Outcome`.

    `settings` as in the panel, missing ones at their defaults; `progress(fraction, stage)` is called while it runs.
    """
    settings = {"preset": "DEFAULT", "use_selection": False, **settings}
    task = UnwrapTask(mesh_bridge.unique_meshes(objects), settings, threads=threads)
    result = finished(task.start(), progress)
    task.timer.pause()
    return task.write(result)
