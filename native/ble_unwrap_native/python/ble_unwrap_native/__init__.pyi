"""Automatic UV unwrapping under a stretch bound, by Bernoulli logistic embedding."""

import sys
from collections.abc import Sequence
from typing import Any, Literal, TypedDict, Unpack, final, type_check_only

from typing_extensions import Buffer  # of collections.abc from Python 3.12 on

__all__ = [
    "Analysis",
    "Array",
    "Atlas",
    "BleUnwrapError",
    "Cancelled",
    "Embedding",
    "Flattening",
    "InternalError",
    "InvalidArgumentError",
    "InvalidMeshError",
    "Job",
    "OutOfMemoryError",
    "PackedCharts",
    "PointAtlas",
    "UnprovenError",
    "__version__",
    "analyse",
    "default_settings",
    "embed",
    "flatten",
    "geodesic_distances",
    "graph_distances",
    "measure",
    "pack",
    "place",
    "submit_unwrap",
    "submit_unwrap_points",
    "unwrap",
    "unwrap_points",
]

__version__: str

class BleUnwrapError(Exception): ...
class InvalidMeshError(BleUnwrapError): ...
class InvalidArgumentError(BleUnwrapError): ...
class Cancelled(BleUnwrapError): ...
class OutOfMemoryError(BleUnwrapError, MemoryError): ...

class UnprovenError(BleUnwrapError):
    certificate: dict[str, Any]

class InternalError(BleUnwrapError): ...

@type_check_only
class _Threads(TypedDict, total=False):
    preset: Literal["default", "paper", "iso_charts"]
    threads: int

@type_check_only
class _PlaceSettings(_Threads, total=False):
    model: Literal["default", "paper", "isomap"]

@type_check_only
class _GeodesicSettings(_Threads, total=False):
    geodesics: Literal["fast_marching", "dijkstra"]

@type_check_only
class _FitSettings(_Threads, total=False):
    seed: int
    model: Literal["default", "paper", "isomap"]
    kernel_width: float | None
    relaxation: float
    max_sweeps: int
    tolerance: float
    update: Literal["serial", "parallel"]

@type_check_only
class _EmbeddingSettings(_FitSettings, total=False):
    initial: Literal["mds", "random"]

@type_check_only
class _WeldSettings(TypedDict, total=False):
    weld: bool
    weld_distance: float | None

@type_check_only
class _TextureSettings(_Threads, total=False):
    margin: float
    texture_size: int | Sequence[int]

@type_check_only
class _MeasureSettings(_TextureSettings, _WeldSettings, total=False): ...

@type_check_only
class _PackSettings(_TextureSettings, total=False):
    rotation: Literal["any", "quarter", "none"]

@type_check_only
class _CloudSettings(_EmbeddingSettings, _PackSettings, total=False):
    stretch_limit: float
    coarse: bool
    landmark_fraction: float
    landmark_min: int
    landmark_max: int | None

@type_check_only
class _FlattenSettings(_GeodesicSettings, _EmbeddingSettings, _WeldSettings, total=False):
    landmark_fraction: float
    landmark_min: int
    landmark_max: int | None
    together_max: int
    stretch_solver: Literal["newton", "line_search"]
    stretch_iterations: int

@type_check_only
class _Settings(_FlattenSettings, _PackSettings, total=False):
    stretch_limit: float
    limit_over: Literal["chart", "atlas"]
    coarse: bool
    merge: bool
    least_sewn: float
    holes: Literal["keep", "cut"]
    chart_scale: Literal["uniform", "stretch"]
    crease_weight: float

@type_check_only
class _AnalyseSettings(_Threads, _WeldSettings, total=False): ...

@final
class Analysis:
    @property
    def weld(self) -> bool: ...
    @property
    def weld_distance(self) -> float | None: ...
    def unwrap(self, *, job: Job | None = None, **settings: Unpack[_Settings]) -> Atlas: ...
    def submit_unwrap(self, *, job: Job | None = None, **settings: Unpack[_Settings]) -> Job: ...

@final
class Array(Buffer):
    def __new__(cls, data: bytes, format: Literal["f", "d", "i"], shape: Sequence[int], /) -> Array: ...
    def __reduce__(self) -> tuple[type[Array], tuple[bytes, str, tuple[int, ...]]]: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def format(self) -> str: ...
    def __len__(self) -> int: ...
    if sys.version_info >= (3, 12):
        def __buffer__(self, flags: int, /) -> memoryview: ...

@final
class Atlas:
    def __new__(cls, uv: Array, chart: Array, report: dict[str, Any], certificate: dict[str, Any], /) -> Atlas: ...
    def __reduce__(self) -> tuple[type[Atlas], tuple[Array, Array, dict[str, Any], dict[str, Any]]]: ...
    @property
    def certificate(self) -> dict[str, Any]: ...
    @property
    def uv(self) -> Array: ...
    @property
    def chart(self) -> Array: ...
    @property
    def report(self) -> dict[str, Any]: ...

@final
class Embedding:
    @property
    def coordinates(self) -> Array: ...
    @property
    def intercepts(self) -> Array: ...
    @property
    def report(self) -> dict[str, Any]: ...
    def transform(self, data: Buffer, *, job: Job | None = None, **settings: Unpack[_Threads]) -> Array: ...

@final
class Flattening:
    def __new__(cls, embedded: Array, uv: Array, report: dict[str, Any], /) -> Flattening: ...
    def __reduce__(self) -> tuple[type[Flattening], tuple[Array, Array, dict[str, Any]]]: ...
    @property
    def embedded(self) -> Array: ...
    @property
    def uv(self) -> Array: ...
    @property
    def report(self) -> dict[str, Any]: ...

@final
class PackedCharts:
    def __new__(cls, uv: Array, report: dict[str, Any], /) -> PackedCharts: ...
    def __reduce__(self) -> tuple[type[PackedCharts], tuple[Array, dict[str, Any]]]: ...
    @property
    def uv(self) -> Array: ...
    @property
    def report(self) -> dict[str, Any]: ...

@final
class PointAtlas:
    def __new__(cls, uv: Array, chart: Array, report: dict[str, Any], /) -> PointAtlas: ...
    def __reduce__(self) -> tuple[type[PointAtlas], tuple[Array, Array, dict[str, Any]]]: ...
    @property
    def uv(self) -> Array: ...
    @property
    def chart(self) -> Array: ...
    @property
    def report(self) -> dict[str, Any]: ...

@final
class Job:
    def __new__(cls) -> Job: ...
    def progress(self) -> float: ...
    def stage(self) -> str: ...
    def cancel(self) -> None: ...
    def is_cancelled(self) -> bool: ...
    def is_finished(self) -> bool: ...
    def wait(self, timeout: float | None = None) -> bool: ...
    # An `Atlas` after `submit_unwrap`, a `PointAtlas` after `submit_unwrap_points`, else what the call that was given the job returned.
    def result(self) -> Any: ...

def unwrap(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    seams: Buffer | None = None,
    guides: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_Settings],
) -> Atlas: ...
def submit_unwrap(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    seams: Buffer | None = None,
    guides: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_Settings],
) -> Job: ...
def analyse(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    seams: Buffer | None = None,
    guides: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_AnalyseSettings],
) -> Analysis: ...
def unwrap_points(
    positions: Buffer,
    *,
    neighbours: int = 12,
    job: Job | None = None,
    **settings: Unpack[_CloudSettings],
) -> PointAtlas: ...
def submit_unwrap_points(
    positions: Buffer,
    *,
    neighbours: int = 12,
    job: Job | None = None,
    **settings: Unpack[_CloudSettings],
) -> Job: ...
def embed(
    data: Buffer,
    *,
    kind: Literal["points", "distances", "affinities"] = "points",
    dimensions: int = 2,
    metric: Literal["euclidean", "geodesic"] = "euclidean",
    neighbours: int = 12,
    landmarks: int | None = None,
    initial: Literal["mds", "random"] | Buffer | None = None,
    mean_affinity: float | None = None,
    sigma: float | None = None,
    truncation: float = 0.0,
    job: Job | None = None,
    **settings: Unpack[_FitSettings],
) -> Embedding: ...
def flatten(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    minimise: bool = True,
    job: Job | None = None,
    **settings: Unpack[_FlattenSettings],
) -> Flattening: ...
def geodesic_distances(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    sources: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_GeodesicSettings],
) -> Array: ...
def graph_distances(
    points: Buffer,
    sources: Buffer | None = None,
    *,
    neighbours: int = 12,
    connect: Literal["error", "bridge", "separate"] = "error",
    radius: float | None = None,
    job: Job | None = None,
    **settings: Unpack[_Threads],
) -> Array: ...
def measure(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    uv: Buffer,
    *,
    chart: Buffer | None = None,
    corner_triangles: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_MeasureSettings],
) -> dict[str, Any]: ...
def pack(
    points: Buffer,
    triangles: Buffer,
    chart: Buffer,
    *,
    job: Job | None = None,
    **settings: Unpack[_PackSettings],
) -> PackedCharts: ...
def place(
    data: Buffer,
    coordinates: Buffer,
    intercepts: Buffer | None = None,
    *,
    kind: Literal["distances", "affinities"] = "distances",
    sigma: float = 1.0,
    truncation: float = 0.0,
    mean_squared: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_PlaceSettings],
) -> Array: ...
def default_settings(preset: Literal["default", "paper", "iso_charts"] = "default") -> dict[str, Any]: ...
