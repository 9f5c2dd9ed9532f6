"""Automatic UV unwrapping under a stretch bound, by Bernoulli logistic embedding."""

import sys
from collections.abc import Sequence
from typing import Any, Literal, TypedDict, Unpack, final, type_check_only

from typing_extensions import Buffer  # in collections.abc from Python 3.12 on

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
    "RelaxedMap",
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
    "relax",
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

# made by `make settings`
@type_check_only
class _CallSettings(TypedDict, total=False):
    preset: Literal["default", "paper", "iso_charts", "lightmap"]
    """The preset that gives the values of all settings that are not named in the call. "default": Extended model, fast solvers: least stretch and fewest charts. "paper": The published method as printed: slower, more charts. "iso_charts": The same with Isomap, the method the paper compares itself with. "lightmap": For baked light: hard edges are cut, mip levels do not bleed, and rectangles lie on whole texels."""
    threads: int
    """Processor threads to work with; 0 takes all that the machine has. The result does not depend on it."""

@type_check_only
class _ChartsGroup(TypedDict, total=False):
    limit_over: Literal["chart", "atlas"]
    """What the limit bounds. "chart": No chart is stretched beyond the limit. "atlas": All charts together keep the limit, while some exceed it, up to fourfold above 1: fewer charts."""
    stretch_price: float
    """How much more seam less stretch is worth: the length of seam for an excess of 1 of the squared stretch. 0 makes seams as short as the limit allows; more gives less stretch and more charts."""
    hide_seams: float
    """How strongly seams are drawn to where they are hidden: under chins, behind ears, between limbs. A seam costs as much as this power of how far it can be seen; 0 makes all places alike."""
    front: Literal["none", "x", "-x", "y", "-y", "z", "-z"]
    """Which side is looked at most. The layout is turned so that what is up on the object is up in it. "none": No side more than another. "x": Seams are drawn away from what faces along X. "-x": Seams are drawn away from what faces against X. "y": Seams are drawn away from what faces along Y. "-y": Seams are drawn away from what faces against Y, as the faces of figures do in Blender. "z": Seams are drawn away from what faces along Z. "-z": Seams are drawn away from what faces against Z."""
    symmetry: Literal["auto", "off"]
    """Whether seams of mirrored surfaces are mirrored, too. "auto": Where a piece has a mirror plane along edges, so have its seams. "off": Seams are found without regard to mirror planes."""
    stack: Literal["off", "equal", "mirrored"]
    """Which charts lie on each other, so that like parts share their pixels and all charts get more of them. Nothing is copied, and so nothing stacked, under a limit over the atlas or with fewer moves. "off": Every chart has a place of its own. "equal": Charts of equal parts lie exactly on each other and share their pixels. "mirrored": Charts of mirrored parts and mirrored halves do so, too; there, the texture is mirrored on the surface."""
    style: Literal["auto", "organic", "hard"]
    """Whether planes, cylinders and the like between hard edges keep their shape. "auto": Parts between hard edges that can lie flat without stretch do so if most of a connected piece is made of them, and so do planes and walls between bevels; else only large planes do. "organic": Hard edges are not treated specially. "hard": All parts between hard edges lie flat without stretch, but for thin rings that become strips, whatever the piece is made of; edges count as hard from 40° instead of 50°, and with either from less on a finely divided surface."""
    straighten: float
    """How much seam a straight side along an axis of the texture is worth. Sides of charts that are straight on the surface are made straight, and thin rings become strips, where that costs less in stretch; 0 leaves them as they are."""
    cover_price: float
    """How much longer seams may get for a texture that is covered better: one or two charts that leave much of it empty are cut where their parts then lie closer together, if that makes all seams longer by at most so many per cent for each per cent of the texture; 0 cuts none for it."""
    moves: Literal["split", "join", "all"]
    """What the search for charts may do. "split": Patches are split until they keep the stretch limit. "join": Neighbouring charts are joined again where they keep the limit together. "all": Charts may be cut open, unfolded and joined along a part of their border, too."""
    holes: Literal["keep", "cut"]
    """What happens to charts with holes. "keep": A chart may have holes, and other charts may be packed into them. "cut": Every chart is cut open to a disk."""
    chart_scale: Literal["uniform", "stretch"]
    """How large charts are beside each other. "uniform": The same texel density everywhere. "stretch": More pixels where a chart is stretched, between half and double."""
    crease_weight: float
    """How strongly borders are drawn to folds of the surface; 0 looks at their length alone."""

@type_check_only
class _LimitGroup(TypedDict, total=False):
    stretch_limit: float
    """No chart may have a larger L2 stretch than this; 1 is none. Lower values give less distortion and more seams."""
    coarse: bool
    """Decides on a coarse copy where to cut large pieces of surface, which is many times faster."""

@type_check_only
class _WeldGroup(TypedDict, total=False):
    weld: bool
    """Lets charts run across vertices at the same place, which imported files often have. The mesh itself stays as it is."""
    weld_distance: float | None
    """How near to each other vertices are that are welded. Two vertices of one face never are, unless they coincide. None stands for what single precision cannot tell apart."""

@type_check_only
class _CutGroup(TypedDict, total=False):
    cut_angle: float | None
    """Edges at which the normals of two faces are at least so many degrees apart are all cut. None stands for no edge."""

@type_check_only
class _GeodesicsGroup(TypedDict, total=False):
    geodesics: Literal["fast_marching", "dijkstra"]
    """How distances along the surface are measured. "fast_marching": Wave fronts run across the triangles: accurate. "dijkstra": Shortest paths run along the edges: some 6 % too long, but faster."""

@type_check_only
class _LandmarksGroup(TypedDict, total=False):
    landmark_fraction: float
    """Share of a chart's vertices that serve as landmarks of its embedding."""
    landmark_min: int
    """Fewest landmarks of a chart, where it has as many vertices."""
    landmark_max: int | None
    """Most landmarks of a chart. None stands for no limit."""

@type_check_only
class _ModelGroup(TypedDict, total=False):
    model: Literal["default", "paper", "isomap"]
    """How a chart is laid out in the plane before its stretch is minimised. "default": Bernoulli logistic embedding with intercepts and logistic affinity. "paper": Bernoulli logistic embedding as in the paper: Gaussian affinity, no intercepts. "isomap": Classical scaling of geodesic distances, for comparison."""

@type_check_only
class _FitGroup(TypedDict, total=False):
    seed: int
    """Start of all random choices. The same seed gives the same result on any machine."""
    kernel_width: float | None
    """Width of the affinity as a multiple of the mean squared distance; useful from 0.1 to 0.3. None stands for the model's own."""
    relaxation: float
    """Over-relaxation of the sweeps. Within this range the likelihood never falls."""
    max_sweeps: int
    """Most sweeps of the embedding over all points."""
    tolerance: float
    """The sweeps stop when one changes the likelihood by less than this share of it."""
    update: Literal["serial", "parallel"]
    """The order in which points move in a sweep. "serial": Points move one after another, and the likelihood rises at every step. "parallel": All points move at once from the same state, which needs a relaxation below 1."""

@type_check_only
class _StartGroup(TypedDict, total=False):
    initial: Literal["mds", "random"]
    """Where the embedding starts from. "mds": Multidimensional scaling of the landmarks, which needs the fewest sweeps. "random": Normally distributed points, drawn from the seed."""

@type_check_only
class _FlatteningGroup(TypedDict, total=False):
    together_max: int
    """Charts of at most so many vertices are embedded with all their vertices together, as in the paper, at a cost of the square of their number; larger ones by their landmarks."""
    stretch_solver: Literal["newton", "line_search"]
    """How the stretch of a chart is minimised. "newton": Projected Newton steps, which are fast. "line_search": One vertex at a time along random directions, as in the paper."""

@type_check_only
class _StretchGroup(TypedDict, total=False):
    stretch_iterations: int
    """Most iterations of the stretch solver."""

@type_check_only
class _SizeGroup(TypedDict, total=False):
    texture_size: int | Sequence[int]
    """Width and height, in texels, of the texture that the UVs are meant for: its proportions and, for the margin, its resolution."""

@type_check_only
class _MarginGroup(TypedDict, total=False):
    margin: float
    """Least distance between two charts, in texels, the pixels of the texture; half of it is kept to the border."""
    mip_levels: int
    """On how many mip levels of the texture, besides itself, bilinear filtering mixes no two charts: the margin is raised to 2.83 texels of the last one. 0 leaves it as it is."""

@type_check_only
class _TilesGroup(TypedDict, total=False):
    tiles: int
    """Over how many tiles of the texture charts may be spread: UDIM 1001, 1002 and so on, ten in a row. No chart crosses the border of a tile."""

@type_check_only
class _PackingGroup(TypedDict, total=False):
    rotation: Literal["aligned", "any", "quarter", "none"]
    """How charts may be turned when they are packed. "aligned": Charts with straight borders lie along the axes, symmetric ones upright or level, others at any angle. "any": Charts are turned by any angle, which packs tightest. "quarter": Charts are turned by multiples of 90° from how they were flattened, none set upright by itself. "none": Charts stay as they were flattened, at whatever angle that is."""
    quality: Literal["fast", "normal", "high"]
    """How long a dense placement of the charts is searched for. "fast": A fraction of a second for up to some hundred charts. "normal": Two to four times as long; more angles and arrangements are tried. "high": Ten to twenty times as long, with many more arrangements tried."""

@type_check_only
class _DensityGroup(TypedDict, total=False):
    texel_density: float | None
    """How many texels a unit of length gets, in all charts that are larger than a texel, in as few tiles as are found to do; where there are too few, charts get the greatest density that is found, with a warning. None stands for the greatest that is found."""
    snap: bool
    """Moves the sides of charts that are rectangles to the nearest edges of texels, so that none is covered in part; this scales such a chart by less than a texel along each axis."""
    shrink_margin: bool
    """Halves a margin that leaves no room for the charts in the texture until it does, with a warning; otherwise such a margin is an error."""

@type_check_only
class _UnwrapSettings(
    _CallSettings,
    _ChartsGroup,
    _LimitGroup,
    _WeldGroup,
    _CutGroup,
    _GeodesicsGroup,
    _LandmarksGroup,
    _ModelGroup,
    _FitGroup,
    _StartGroup,
    _FlatteningGroup,
    _StretchGroup,
    _SizeGroup,
    _MarginGroup,
    _TilesGroup,
    _PackingGroup,
    _DensityGroup,
    total=False,
): ...

@type_check_only
class _AnalyseSettings(_CallSettings, _WeldGroup, _CutGroup, total=False): ...

@type_check_only
class _UnwrapPointsSettings(
    _CallSettings,
    _LimitGroup,
    _LandmarksGroup,
    _ModelGroup,
    _FitGroup,
    _StartGroup,
    _SizeGroup,
    _MarginGroup,
    _PackingGroup,
    total=False,
): ...

@type_check_only
class _EmbedSettings(_CallSettings, _ModelGroup, _FitGroup, total=False): ...

@type_check_only
class _FlattenSettings(
    _CallSettings,
    _WeldGroup,
    _GeodesicsGroup,
    _LandmarksGroup,
    _ModelGroup,
    _FitGroup,
    _StartGroup,
    _FlatteningGroup,
    _StretchGroup,
    total=False,
): ...

@type_check_only
class _TransformSettings(_CallSettings, total=False): ...

@type_check_only
class _PlaceSettings(_CallSettings, _ModelGroup, total=False): ...

@type_check_only
class _GeodesicDistancesSettings(_CallSettings, _GeodesicsGroup, total=False): ...

@type_check_only
class _GraphDistancesSettings(_CallSettings, total=False): ...

@type_check_only
class _MeasureSettings(_CallSettings, _WeldGroup, _SizeGroup, _MarginGroup, _TilesGroup, total=False): ...

@type_check_only
class _RelaxSettings(_CallSettings, _WeldGroup, _StretchGroup, _SizeGroup, total=False): ...

@type_check_only
class _PackSettings(
    _CallSettings,
    _SizeGroup,
    _MarginGroup,
    _TilesGroup,
    _PackingGroup,
    _DensityGroup,
    total=False,
): ...

# end of what `make settings` makes

@final
class Analysis:
    @property
    def cut_angle(self) -> float | None: ...
    @property
    def weld(self) -> bool: ...
    @property
    def weld_distance(self) -> float | None: ...
    def unwrap(self, *, job: Job | None = None, **settings: Unpack[_UnwrapSettings]) -> Atlas: ...
    def submit_unwrap(self, *, job: Job | None = None, **settings: Unpack[_UnwrapSettings]) -> Job: ...

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
    def __new__(
        cls, uv: Array, chart: Array, stack: Array, report: dict[str, Any], certificate: dict[str, Any], /
    ) -> Atlas: ...
    def __reduce__(self) -> tuple[type[Atlas], tuple[Array, Array, Array, dict[str, Any], dict[str, Any]]]: ...
    @property
    def stack(self) -> Array: ...
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
    def transform(self, data: Buffer, *, job: Job | None = None, **settings: Unpack[_TransformSettings]) -> Array: ...

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
class RelaxedMap:
    def __new__(cls, uv: Array, island: Array, report: dict[str, Any], /) -> RelaxedMap: ...
    def __reduce__(self) -> tuple[type[RelaxedMap], tuple[Array, Array, dict[str, Any]]]: ...
    @property
    def uv(self) -> Array: ...
    @property
    def island(self) -> Array: ...
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
    # Returns an `Atlas` after `submit_unwrap`, and a `PointAtlas` after `submit_unwrap_points`.
    # After any other call that was given this job, it returns what that call returned.
    def result(self) -> Any: ...

def unwrap(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    seams: Buffer | None = None,
    guides: Buffer | None = None,
    seam_weights: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_UnwrapSettings],
) -> Atlas: ...
def submit_unwrap(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    seams: Buffer | None = None,
    guides: Buffer | None = None,
    seam_weights: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_UnwrapSettings],
) -> Job: ...
def analyse(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    *,
    corner_triangles: Buffer | None = None,
    seams: Buffer | None = None,
    guides: Buffer | None = None,
    seam_weights: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_AnalyseSettings],
) -> Analysis: ...
def unwrap_points(
    positions: Buffer,
    *,
    neighbours: int = 12,
    job: Job | None = None,
    **settings: Unpack[_UnwrapPointsSettings],
) -> PointAtlas: ...
def submit_unwrap_points(
    positions: Buffer,
    *,
    neighbours: int = 12,
    job: Job | None = None,
    **settings: Unpack[_UnwrapPointsSettings],
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
    **settings: Unpack[_EmbedSettings],
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
    **settings: Unpack[_GeodesicDistancesSettings],
) -> Array: ...
def graph_distances(
    points: Buffer,
    sources: Buffer | None = None,
    *,
    neighbours: int = 12,
    connect: Literal["error", "bridge", "separate"] = "error",
    radius: float | None = None,
    job: Job | None = None,
    **settings: Unpack[_GraphDistancesSettings],
) -> Array: ...
def measure(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    uv: Buffer,
    *,
    chart: Buffer | None = None,
    stacks: Buffer | None = None,
    corner_triangles: Buffer | None = None,
    by_face: bool = False,
    job: Job | None = None,
    **settings: Unpack[_MeasureSettings],
) -> dict[str, Any]: ...
def pack(
    points: Buffer,
    triangles: Buffer,
    chart: Buffer,
    *,
    groups: Buffer | None = None,
    obstacles: Buffer | None = None,
    border_margin: float | None = None,
    scale: Literal["uniform", "fixed"] | None = "uniform",
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
def relax(
    positions: Buffer,
    corner_vertices: Buffer,
    face_offsets: Buffer,
    uv: Buffer,
    *,
    pinned: Buffer | None = None,
    selected: Buffer | None = None,
    start: Literal["as_they_are", "anew"] | None = "as_they_are",
    corner_triangles: Buffer | None = None,
    job: Job | None = None,
    **settings: Unpack[_RelaxSettings],
) -> RelaxedMap: ...
def default_settings(preset: Literal["default", "paper", "iso_charts"] = "default") -> dict[str, Any]: ...
