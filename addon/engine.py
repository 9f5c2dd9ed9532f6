"""Settings and arrays in, plain results out: alone imports `ble_unwrap_native`, and knows nothing of Blender."""

import hashlib
from dataclasses import dataclass, field

import numpy as np

from .settings_table import ZERO_STANDS_FOR_NONE

# Slack of the certificate for what float32 coordinates cannot express.
MARGIN_SLACK_TEXELS = 0.01
STRETCH_SLACK = 1e-3

# Gaps are searched for up to this distance, or twice the margin: what is reported at that value may be larger.
SEARCHED_TEXELS = 8


class EngineMissing(Exception):
    """The native library cannot be loaded; the text says what to do."""


class EngineError(Exception):
    """The native library refused or failed; the text is its own."""


class EngineCancelled(Exception):
    """The computation was cancelled; nothing came of it."""


@dataclass
class Result:
    """One UV per corner and a chart per face of a mesh, or one of both per point of a cloud; and the native report."""

    uv: np.ndarray  # (c, 2) float32
    chart: np.ndarray  # (f,) int32; of a point that is in no chart: -1
    report: dict


@dataclass
class Certificate:
    """What was measured, and which promises it breaks (none, as a rule)."""

    measured: dict
    violations: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def holds(self):
        return not self.violations


def native():
    """The native module; loaded on first use, so that the add-on registers without it."""
    try:
        import ble_unwrap_native
    except ImportError as error:
        raise EngineMissing(
            f"The native library of BLE Unwrap cannot be loaded ({error}). Install the add-on from its zip file, which "
            "holds the library for your system; for Blender as a Python module, `pip install` the wheel that "
            "`make wheel` writes"
        ) from error
    return ble_unwrap_native


def version():
    """Version of the native library, or None."""
    try:
        return getattr(native(), "__version__", None)
    except EngineMissing:
        return None


def default_settings(preset):
    """The native module's own values of a preset, in its words."""
    return dict(native().default_settings(preset.lower()))


def native_settings(settings):
    """Settings in the native module's words: enum values in lower case, bridge settings left out by the caller."""
    result = {}
    for name, value in settings.items():
        if isinstance(value, str):
            value = value.lower()
        elif name in ZERO_STANDS_FOR_NONE and value == 0:
            value = None
        elif name == "texture_size" and not isinstance(value, int):
            value = tuple(value)
        result[name] = value
    return result


def _mesh(selection, cut, follow):
    """The arrays of a mesh, by position and by name. `cut` and `follow` are kinds of marked edges."""
    return (
        (selection.positions, selection.corner_vertices, selection.face_offsets),
        {
            "corner_triangles": selection.corner_triangles,
            "seams": selection.marked(cut),
            "guides": selection.marked(follow),
        },
    )


class _Kept:
    """The analysis of the mesh that was unwrapped last: with other settings it is unwrapped again in less time."""

    key = analysis = None


def forget():
    """Frees what `keep` keeps."""
    _Kept.key = _Kept.analysis = None


def _analysis(mesh, welding, threads):
    """The kept analysis if it is of this mesh and this welding, else a new one in its place."""
    positional, named = mesh
    digest = hashlib.blake2b(digest_size=16)
    for array in (*positional, *named.values()):
        values = np.ascontiguousarray(array if array is not None else ()).reshape(-1)
        digest.update(f"{values.dtype} {values.shape} ".encode())
        digest.update(values.view(np.uint8))
    key = digest.digest(), *welding.values()
    if _Kept.key != key:
        forget()
        _Kept.analysis = _translated(lambda module: module.analyse(*positional, **named, **welding, threads=threads))
        _Kept.key = key
    return _Kept.analysis


def _caller(name, mesh, settings, keep):
    """A call of the function `name` of the native module, or where the analysis is kept of its method."""
    settings = native_settings(settings)
    if keep:
        welding = {"weld": settings.pop("weld", False), "weld_distance": settings.pop("weld_distance", None)}
        analysis = _analysis(mesh, welding, settings.get("threads", 0))
        return lambda module: getattr(analysis, name)(**settings)
    return lambda module: getattr(module, name)(*mesh[0], **mesh[1], **settings)


def _translated(call, *arguments, **keywords):
    """Calls into the native module and turns its exceptions into ours."""
    module = native()
    try:
        return call(module, *arguments, **keywords)
    except module.Cancelled as error:
        raise EngineCancelled(str(error) or "cancelled") from error
    except module.BleUnwrapError as error:
        raise EngineError(str(error)) from error
    except (TypeError, ValueError, MemoryError, RuntimeError) as error:
        raise EngineError(f"{type(error).__name__}: {error}") from error


def _result(atlas):
    return Result(np.asarray(atlas.uv, np.float32), np.asarray(atlas.chart, np.int32), dict(atlas.report))


def unwrap(selection, settings, *, cut=(), follow=(), keep=False):
    """Unwraps at once. Raises `EngineMissing`, `EngineError`.

    `cut` and `follow` are kinds of marked edges: all cut, or where borders are drawn to. With `keep`, the analysis of
    the mesh is kept for the next call, until another mesh's is or `forget` is called.
    """
    return _result(_translated(_caller("unwrap", _mesh(selection, cut, follow), settings, keep)))


def unwrap_points(positions, settings):
    """Maps a cloud at once. Raises `EngineMissing`, `EngineError`."""
    return _result(_translated(lambda module: module.unwrap_points(positions, **native_settings(settings))))


def submit_unwrap(selection, settings, *, cut=(), follow=(), keep=False):
    """As `unwrap`, on another thread: a `Job`. Raises `EngineMissing`, `EngineError`."""
    return Job(_translated(_caller("submit_unwrap", _mesh(selection, cut, follow), settings, keep)))


def submit_unwrap_points(positions, settings):
    """Maps a cloud on another thread: a `Job`. Raises `EngineMissing`, `EngineError`."""
    return Job(_translated(lambda module: module.submit_unwrap_points(positions, **native_settings(settings))))


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
        """The result of a finished job. Raises `EngineError`, `EngineCancelled`."""
        return _result(_translated(lambda module: self._job.result()))


def measure(selection, uv, *, texture_size, margin, weld=True, weld_distance=0.0):
    """Measures any UVs of a selection, whoever made them; the keys of the native report.

    With `weld`, charts run across vertices at one place as in `unwrap`: files often split vertices at every face.
    """
    settings = {"texture_size": texture_size, "margin": float(margin), "weld": weld, "weld_distance": weld_distance}
    return dict(
        _translated(
            lambda module: module.measure(
                selection.positions,
                selection.corner_vertices,
                selection.face_offsets,
                np.ascontiguousarray(uv, np.float32),
                corner_triangles=selection.corner_triangles,
                **native_settings(settings),
            )
        )
    )


def overlaps_between(first, second):
    """Number of pairs of triangles that share area in UVs, one of each set of faces.

    A set is (positions, corner_vertices, face_offsets, corner_triangles, uv). Overlaps within a set are not counted.
    """
    counts = [_overlaps(faces) for faces in (_together(first, second), first, second)]
    return max(counts[0] - counts[1] - counts[2], 0)


def _together(first, second):
    vertices, corners = len(first[0]), len(first[1])
    bases = (0, vertices, 0, corners, 0)
    joined = [np.concatenate([a, b + base]) for a, b, base in zip(first, second, bases, strict=True)]
    joined[2] = np.concatenate([first[2], second[2][1:] + corners])
    return joined


def _overlaps(faces):
    kinds = (np.float32, np.int32, np.int32, np.int32, np.float32)
    *mesh, triangles, uv = (np.ascontiguousarray(array, kind) for array, kind in zip(faces, kinds, strict=True))
    options = {"corner_triangles": triangles, "texture_size": 1024, "margin": 0.0}
    return int(_translated(lambda module: module.measure(*mesh, uv, **options))["overlaps"])


def certify(measured, *, margin, stretch_limit=None, limit_over="CHART", warnings=()):
    """Judges a measurement against what was promised."""
    certificate = Certificate(measured, warnings=list(warnings))
    if measured.get("overlaps"):
        certificate.violations.append(counted(measured["overlaps"], "overlapping pair") + " of faces")
    if measured.get("flips"):
        certificate.violations.append(counted(measured["flips"], "flipped face"))
    if measured.get("unmapped_faces"):
        certificate.violations.append(counted(measured["unmapped_faces"], "face") + " without UVs")
    gap = measured.get("gap_texels")
    # Asked the way round in which what could not be measured, NaN, does not pass.
    if gap is not None and measured.get("charts", 0) > 1 and not gap >= margin - MARGIN_SLACK_TEXELS:
        certificate.violations.append(f"charts {gap:.2f} px apart, margin is {margin:g} px")
    limited, name = _limited(measured, limit_over)
    if stretch_limit is not None and limited is not None and not limited <= stretch_limit + STRETCH_SLACK:
        found = "a stretch that could not be measured" if np.isnan(limited) else f"stretch {limited:.3f}"
        certificate.violations.append(f"{name} has {found}, limit is {stretch_limit:g}")
    return certificate


def _limited(measured, limit_over):
    """The stretch that the limit is for, and whose it is."""
    if limit_over == "ATLAS":
        return measured.get("l2_chart_scale"), "the atlas"
    return measured.get("l2_worst_chart"), "worst chart"


def summary(measured, seconds=None):
    """One line about a measurement."""
    parts = [
        counted(measured.get("charts"), "chart"),
        f"stretch {number_text(measured.get('l2'))} (worst chart {number_text(measured.get('l2_worst_chart'))})",
        _overlaps_text(measured),
        counted(measured.get("flips"), "flip"),
        f"{100 * float(measured.get('packing_efficiency') or 0):.0f}% used",
    ]
    if seconds is not None:
        parts.append(f"{seconds:.1f} s")
    return ", ".join(parts)


def _overlaps_text(measured):
    """The overlaps, also with faces that were not unwrapped: of these there is no promise, so they are always told."""
    overlaps, kept = counted(measured.get("overlaps"), "overlap"), measured.get("overlaps_with_kept")
    if kept is None:
        return overlaps
    return f"{overlaps}, {f'{kept:,}' if kept else 'none'} with faces that were kept"


def lines(certificate, *, margin, stretch_limit, limit_over="CHART", notes=(), length_text="{:.4g}".format):
    """The certificate for display: (status, text), status one of OK, BAD, WARN, INFO.

    `notes` say what was done besides; `length_text` writes a length of the scene with its unit.
    """
    measured = certificate.measured
    charts = int(measured.get("charts") or 0)
    worst, gap = measured.get("l2_worst_chart"), measured.get("gap_texels")
    limited, _ = _limited(measured, limit_over)
    stretch_ok = limited is not None and limited <= stretch_limit + STRETCH_SLACK
    gap_ok = charts < 2 or gap is None or gap >= margin - MARGIN_SLACK_TEXELS
    overlaps, flips, unmapped = (int(measured.get(key) or 0) for key in ("overlaps", "flips", "unmapped_faces"))
    with_kept = measured.get("overlaps_with_kept")
    result = [
        ("INFO", f"{counted(measured.get('faces'), 'face')} in {counted(charts, 'chart')}"),
        ("OK" if stretch_ok else "BAD", f"Stretch {number_text(measured.get('l2'))}, worst chart {number_text(worst)}"),
        ("BAD" if overlaps else "WARN" if with_kept else "OK", _overlaps_text(measured)),
        ("BAD" if flips else "OK", counted(flips, "flipped face")),
    ]
    if charts > 1 and gap is not None:
        least = "≥ " if gap >= max(SEARCHED_TEXELS, 2 * margin) else ""
        result.append(("OK" if gap_ok else "BAD", f"Charts {least}{gap:.1f} px apart (margin {margin:g} px)"))
    if unmapped:
        result.append(("BAD", f"{counted(unmapped, 'face')} without UVs"))
    result.append(("INFO", f"{100 * float(measured.get('packing_efficiency') or 0):.1f}% of the texture used"))
    if measured.get("seam_length_absolute") is not None:
        result.append(("INFO", f"Seams {length_text(float(measured['seam_length_absolute']))} long"))
    return result + [("INFO", text) for text in notes] + [("WARN", text) for text in certificate.warnings]


def counted(number, word):
    """A number, by thousands, and what it counts, in the plural where it is not one."""
    number = int(number or 0)
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def number_text(value):
    """A measurement with three digits, or a question mark."""
    return f"{float(value):.3f}" if value is not None and np.isfinite(value) else "?"
