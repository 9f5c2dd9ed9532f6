"""Every setting of the add-on, declared once.

`BLEUnwrapSettings` holds them in the scene, where the panel shows them. The operator, the command line and the
reports derive theirs from its annotations, so a setting added here appears everywhere. Names equal those of the
native module where it has the setting; the others are handled on Blender's side (`BRIDGE_SETTINGS`).
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, IntVectorProperty, StringProperty

# What the paper's method differs in from the defaults below; shown in the panel when the preset is chosen.
# The native module knows the same presets by name: a test keeps the two in step.
PAPER_VALUES = {
    "model": "PAPER",
    "kernel_width": 0.0,
    "relaxation": 1.7,
    "initial": "RANDOM",
    "geodesics": "FAST_MARCHING",
    "landmark_min": 3,
    "landmark_max": 0,
    "together_max": 2000,
    "holes": "CUT",
    "coarse": False,
    "least_sewn": 1000.0,
    "stretch_solver": "LINE_SEARCH",
    "stretch_iterations": 60,
    "rotation": "QUARTER",
}
# Preset -> what it differs in from the defaults.
PRESET_VALUES = {"PAPER": PAPER_VALUES, "ISO_CHARTS": PAPER_VALUES | {"model": "ISOMAP"}}
# What an artist wants of the result whatever the method: presets leave these alone, and the native module, whose
# presets have values of their own for them, always gets them.
KEPT_BY_PRESETS = ("stretch_limit", "texture_size", "margin")


def _apply_preset(settings, _context):
    """Shows the preset's own values: what the panel displays is what will run."""
    for name in annotations():
        if name not in (*BRIDGE_SETTINGS, *KEPT_BY_PRESETS, "preset"):
            settings.property_unset(name)
    for name, value in PRESET_VALUES.get(settings.preset, {}).items():
        setattr(settings, name, value)


class BLEUnwrapSettings(bpy.types.PropertyGroup):
    """Settings of BLE Unwrap, kept with the scene."""

    preset: EnumProperty(
        name="Preset",
        description="How it is done: values of all settings but stretch limit, texture size, margin and the result's",
        items=(
            ("DEFAULT", "Default", "Extended model, fast solvers: least stretch and fewest charts"),
            ("PAPER", "Paper", "The published method as printed: slower, more charts"),
            ("ISO_CHARTS", "Iso-charts", "The same with Isomap, the method the paper compares itself with"),
        ),
        default="DEFAULT",
        update=_apply_preset,
    )

    # ---- what an artist needs
    stretch_limit: FloatProperty(
        name="Stretch Limit",
        description=(
            "Largest L2 stretch that any chart may have; 1 is none. Lower values give less distortion and more seams"
        ),
        default=1.1,
        min=1.001,
        max=100.0,
        soft_min=1.01,
        soft_max=1.5,
        step=1,
        precision=3,
    )
    limit_over: EnumProperty(
        name="Limit Over",
        description="What may not be stretched beyond the limit",
        items=(
            ("CHART", "Each Chart", "No chart is stretched beyond the limit"),
            (
                "ATLAS",
                "Whole Atlas",
                "All charts together keep the limit, some exceed it, up to fourfold above 1: fewer charts",
            ),
        ),
        default="CHART",
    )
    texture_size: IntVectorProperty(
        name="Texture Size",
        description=(
            "Width and height in pixels of the texture that the UVs are meant for: its proportions and, for the "
            "margin, its resolution"
        ),
        default=(2048, 2048),
        size=2,
        min=16,
        max=16384,
        soft_min=256,
        soft_max=8192,
    )
    margin: FloatProperty(
        name="Margin",
        description="Least distance between two charts, in pixels of the texture; half of it is kept to the border",
        default=4.0,
        min=0.0,
        max=256.0,
        soft_max=32.0,
        step=50,
        precision=1,
        subtype="PIXEL",
    )
    rotation: EnumProperty(
        name="Rotation",
        description="How charts may be turned to pack them tighter",
        items=(
            ("ANY", "Any", "Any angle: tightest"),
            (
                "QUARTER",
                "Quarter Turns",
                "By multiples of 90° from how they were flattened; not set upright",
            ),
            ("NONE", "None", "As they were flattened, at whatever angle that is"),
        ),
        default="ANY",
    )
    use_seams: BoolProperty(
        name="Cut at Seams",
        description=(
            "Cut along the seams that the mesh has, but for those of an earlier Mark Seams, and wherever the stretch "
            "limit needs more"
        ),
        default=True,
    )
    follow_seams: BoolProperty(
        name="Follow Seams",
        description="Where a chart needs a border, draw it to seams of the mesh, without cutting all of them",
        default=True,
    )
    follow_sharp: BoolProperty(
        name="Follow Sharp Edges",
        description="Where a chart needs a border, draw it to edges that are marked sharp",
        default=True,
    )
    follow_materials: BoolProperty(
        name="Follow Materials",
        description="Where a chart needs a border, draw it to borders between materials",
        default=True,
    )
    use_selection: BoolProperty(
        name="Only Selected",
        description=(
            "In Edit Mode, unwrap the selected faces, or points of a cloud, and leave the others as they are; in the "
            "UV Editor without Sync Selection, the faces selected there. Hidden ones are always left"
        ),
        default=True,
    )
    move_pinned: BoolProperty(
        name="Move Pinned",
        description="Unwrap faces with pinned UVs like any others; else they are refused, since pins are to hold",
        default=False,
    )

    # ---- where the result goes
    uv_map: EnumProperty(
        name="UV Map",
        description="Which UV map is written; of a point cloud, which attribute of two numbers a point",
        items=(
            ("ACTIVE", "Active", "Replace the active UV map, of points the one of this name; made where there is none"),
            ("NEW", "By Name", "Replace the UV map of this name, made where there is none, and make it the active one"),
        ),
        default="ACTIVE",
    )
    uv_map_name: StringProperty(
        name="Name",
        description="Name of the UV map and of a cloud's attribute; if other data has it, a number is added",
        default="UVMap",
        maxlen=60,
    )
    correct_aspect: BoolProperty(
        name="Image Proportions",
        description=(
            "Where Texture Size is square, take the proportions of the image that the materials show with the UV map; "
            "Texture Size is its longer side then. A Texture Size that is not square always holds"
        ),
        default=True,
    )
    use_original_bounds: BoolProperty(
        name="Keep Place",
        description="Pack into the rectangle that the faces' UVs fill now, not into the whole square",
        default=False,
    )
    mark_seams: BoolProperty(
        name="Mark Seams",
        description="Mark the borders of the charts as seams of the mesh, in the place of those marked so before",
        default=False,
    )

    # ---- charts
    weld: BoolProperty(
        name="Weld Vertices",
        description="Let charts run across vertices at the same place, as imported files often have; the mesh is kept",
        default=False,
    )
    weld_distance: FloatProperty(
        name="Weld Distance",
        description=(
            "How near to each other vertices are that Weld Vertices takes for one; never two of one face. "
            "0 takes what single precision cannot tell apart at this size"
        ),
        default=0.0,
        min=0.0,
        max=1e6,
        soft_max=1.0,
        step=0.1,
        precision=6,
        unit="LENGTH",
    )
    coarse: BoolProperty(
        name="Coarse First",
        description="Decide on a coarse copy where to cut large pieces of surface, which is many times faster",
        default=True,
    )
    merge: BoolProperty(
        name="Merge Charts",
        description="Join neighbouring charts again where their union stays within the stretch limit",
        default=True,
    )
    holes: EnumProperty(
        name="Holes",
        description="What happens to charts with holes",
        items=(
            ("KEEP", "Keep", "A chart may have holes; other charts may be packed into them"),
            ("CUT", "Cut", "Every chart is cut open to a disk"),
        ),
        default="KEEP",
    )
    chart_scale: EnumProperty(
        name="Chart Scale",
        description="How large charts are relative to each other",
        items=(
            ("UNIFORM", "Uniform", "The same texel density everywhere"),
            ("STRETCH", "By Stretch", "More pixels where a chart is stretched, between half and double"),
        ),
        default="UNIFORM",
    )
    least_sewn: FloatProperty(
        name="Least Sewn",
        description=(
            "Charts are sewn along a part of their border, the rest left open, if that part is this long beside the "
            "width of the smaller one. Less gives fewer charts, more gives compact ones, 1000 makes no darts"
        ),
        default=0.2,
        min=0.0,
        max=1000.0,
        soft_max=2.0,
        step=10,
        precision=2,
    )
    crease_weight: FloatProperty(
        name="Crease Weight",
        description="How strongly borders are drawn to folds of the surface; 0 looks at their length alone",
        default=1.0,
        min=0.0,
        max=2.0,
        step=10,
        precision=2,
    )
    seed: IntProperty(
        name="Seed",
        description="Start of all random choices; the same seed gives the same result on any machine",
        default=0,
        min=0,
    )

    neighbours: IntProperty(
        name="Neighbours",
        description="Nearest points that each point of a cloud is joined to; more bridge gaps, fewer keep sheets apart",
        default=12,
        min=4,
        max=256,
        soft_max=64,
    )

    # ---- landmarks and distances
    geodesics: EnumProperty(
        name="Geodesics",
        description="How distances along the surface are measured",
        items=(
            ("FAST_MARCHING", "Fast Marching", "Wave fronts across triangles: accurate"),
            ("DIJKSTRA", "Dijkstra", "Shortest paths along edges: some 6% too long, faster"),
        ),
        default="FAST_MARCHING",
    )
    landmark_fraction: FloatProperty(
        name="Landmarks",
        description="Share of a chart's vertices that serve as landmarks of the embedding",
        default=0.01,
        min=0.0001,
        max=1.0,
        soft_max=0.1,
        step=1,
        precision=4,
    )
    landmark_min: IntProperty(
        name="At Least",
        description="Fewest landmarks of a chart",
        default=48,
        min=3,
        max=100_000,
        soft_max=1000,
    )
    landmark_max: IntProperty(
        name="At Most",
        description="Most landmarks of a chart; 0 sets no bound",
        default=64,
        min=0,
        max=100_000,
        soft_max=2000,
    )
    together_max: IntProperty(
        name="Together",
        description=(
            "Charts of at most so many vertices are embedded with all their vertices together, as in the paper, at a "
            "cost of the square of their number; larger ones by their landmarks"
        ),
        default=0,
        min=0,
        max=20_000,
        soft_max=2000,
    )

    # ---- embedding
    model: EnumProperty(
        name="Model",
        description="How a chart is laid out in the plane before its stretch is minimised",
        items=(
            ("DEFAULT", "Extended", "Bernoulli logistic embedding with intercepts and logistic affinity"),
            ("PAPER", "As Printed", "Bernoulli logistic embedding as in the paper: Gaussian affinity, no intercepts"),
            ("ISOMAP", "Isomap", "Classical scaling of geodesic distances, for comparison"),
        ),
        default="DEFAULT",
    )
    kernel_width: FloatProperty(
        name="Kernel Width",
        description=(
            "Width of the affinity as a multiple of the mean squared distance; useful from 0.1 to 0.3. "
            "0 takes the model's own"
        ),
        default=0.2,
        min=0.0,
        max=10.0,
        soft_max=1.0,
        step=1,
        precision=3,
    )
    relaxation: FloatProperty(
        name="Relaxation",
        description="Over-relaxation of the sweeps; the likelihood never falls between 0 and 2",
        default=1.6,
        min=0.01,
        max=1.99,
        step=10,
        precision=2,
    )
    max_sweeps: IntProperty(
        name="Sweeps",
        description="Most sweeps over all points",
        default=60,
        min=1,
        max=10000,
        soft_max=500,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Relative change of the likelihood at which the sweeps stop",
        default=1e-5,
        min=1e-7,
        max=0.1,
        step=1,
        precision=7,
    )
    update: EnumProperty(
        name="Update",
        description="Order in which points move",
        items=(
            ("SERIAL", "Serial", "One after another: the likelihood rises at every step"),
            ("PARALLEL", "Parallel", "All at once from the same state: needs a relaxation below 1"),
        ),
        default="SERIAL",
    )
    initial: EnumProperty(
        name="Start",
        description="Where the embedding starts from",
        items=(
            ("MDS", "Classical Scaling", "Multidimensional scaling of the landmarks: fewest sweeps"),
            ("RANDOM", "Random", "Normally distributed points, drawn from the seed"),
        ),
        default="MDS",
    )

    # ---- stretch
    stretch_solver: EnumProperty(
        name="Stretch Solver",
        description="How the stretch of a chart is minimised",
        items=(
            ("NEWTON", "Newton", "Projected Newton steps: fast"),
            ("LINE_SEARCH", "Line Search", "One vertex at a time along random directions, as in the paper"),
        ),
        default="NEWTON",
    )
    stretch_iterations: IntProperty(
        name="Iterations",
        description="Most iterations of the stretch solver",
        default=40,
        min=1,
        max=10000,
        soft_max=500,
    )


# Settings that the native module never sees.
BRIDGE_SETTINGS = (
    *("use_seams", "follow_seams", "follow_sharp", "follow_materials", "use_selection", "move_pinned"),
    *("uv_map", "uv_map_name", "correct_aspect", "use_original_bounds", "mark_seams"),
)
# What means something for surfaces only, or for clouds only; the other one's functions do not take it.
SURFACE_SETTINGS = (
    *("use_seams", "follow_seams", "follow_sharp", "follow_materials", "mark_seams"),
    *("move_pinned", "correct_aspect"),
    *("limit_over", "weld", "weld_distance", "merge", "least_sewn", "holes", "chart_scale"),
    *("crease_weight", "geodesics"),
    *("together_max", "stretch_solver", "stretch_iterations"),
)
CLOUD_SETTINGS = ("neighbours",)

# What the panel shows at once, and what it folds away, by title.
MAIN_SETTINGS = ("stretch_limit", "texture_size", "margin", "rotation", "use_seams", "use_selection")
ADVANCED_SETTINGS = (
    ("Result", ("uv_map", "uv_map_name", "correct_aspect", "use_original_bounds", "move_pinned", "mark_seams")),
    ("Borders", ("follow_seams", "follow_sharp", "follow_materials", "crease_weight")),
    (
        "Charts",
        (
            *("limit_over", "neighbours", "weld", "weld_distance", "coarse", "merge"),
            *("least_sewn", "holes", "chart_scale", "seed"),
        ),
    ),
    ("Distances", ("geodesics", "landmark_fraction", "landmark_min", "landmark_max", "together_max")),
    ("Embedding", ("model", "kernel_width", "relaxation", "max_sweeps", "tolerance", "update", "initial")),
    ("Stretch", ("stretch_solver", "stretch_iterations")),
)


def annotations():
    """The declared settings: name -> deferred property, in order of declaration."""
    return BLEUnwrapSettings.__annotations__


def native_values(settings, left_out):
    """Settings for a native function: those of the bridge and those that it does not take left out."""
    return {name: value for name, value in settings.items() if name not in BRIDGE_SETTINGS and name not in left_out}


def operator_annotations():
    """The same settings for an operator.

    They are not remembered from its last run, since the scene keeps them: what a call leaves out comes from the scene
    (interactively) or from the defaults (in a script).
    """
    return {
        name: deferred.function(**{**deferred.keywords, "options": {"SKIP_SAVE"}})
        for name, deferred in annotations().items()
    }


def copy_unset(target, source):
    """Gives `target` the values of `source` for every setting that `target` does not have set itself."""
    explicit = {name for name in annotations() if target.is_property_set(name)}
    # A preset named in the call brings its own values: the scene's must not override them.
    kept = (*BRIDGE_SETTINGS, *KEPT_BY_PRESETS)
    names = [name for name in annotations() if "preset" not in explicit or name in kept]
    for name in names:
        if name not in explicit and source.is_property_set(name):
            setattr(target, name, getattr(source, name))


def copy_changed(source, target):
    """Gives `target` the values of `source` wherever they differ; the preset first, which brings others."""
    for name in annotations():
        value = getattr(source, name)
        if _plain(name, getattr(target, name)) != _plain(name, value):
            setattr(target, name, value)


def values(settings):
    """Settings as plain values; those of the native module only where they were set, so that its presets hold."""
    always = (*BRIDGE_SETTINGS, *KEPT_BY_PRESETS, "preset")
    return {
        name: _plain(name, getattr(settings, name))
        for name in annotations()
        if name in always or settings.is_property_set(name)
    }


def _plain(name, value):
    if isinstance(value, float):
        return float(f"{value:.7g}")  # Blender keeps 32 bits: 1.1 is meant, not 1.10000002384
    return tuple(value) if name == "texture_size" else value


def default_values(preset="DEFAULT"):
    """The declared default of every setting under a preset, as plain values."""
    result = {name: deferred.keywords.get("default") for name, deferred in annotations().items()}
    if preset in PRESET_VALUES:
        result.update(PRESET_VALUES[preset], preset=preset)
    return result


def register():
    bpy.utils.register_class(BLEUnwrapSettings)
    bpy.types.Scene.ble_unwrap = bpy.props.PointerProperty(type=BLEUnwrapSettings)


def unregister():
    del bpy.types.Scene.ble_unwrap
    bpy.utils.unregister_class(BLEUnwrapSettings)
