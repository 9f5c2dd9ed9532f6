"""Every setting of the add-on.

`BLEUnwrapSettings` holds them in the scene, where the panel shows them. The operator, the command line and the
reports derive theirs from its annotations, so a setting added here appears everywhere. What the native module has, too,
is `declared` by its name there: label, tooltip, default and range come from the core's table (`settings_table`), and
only how it is shown is said here. The others are handled on Blender's side (`BRIDGE_SETTINGS`).
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, IntVectorProperty, StringProperty

from . import settings_table

# What an artist wants of the result whatever the method: presets leave these alone, and the native module, whose
# presets have values of their own for them, always gets them.
KEPT_BY_PRESETS = ("stretch_limit", "texture_size", "margin", "tiles", "texel_density", "front")
# Preset -> the UV map that it is for: a lightmap has its own beside that of the materials, found again by its name.
PRESET_MAPS = {"LIGHTMAP": {"uv_map": "NEW", "uv_map_name": "Lightmap"}}
# Preset -> what it differs in from the defaults; shown in the panel when the preset is chosen.
PRESET_VALUES = {
    preset: settings_table.differences(preset, KEPT_BY_PRESETS) | PRESET_MAPS.get(preset, {})
    for preset in settings_table.PRESETS
}


def declared(name, **presentation):
    """The property of a setting, or of a further argument, of the native module. `presentation` is how it is shown."""
    row = settings_table.SETTINGS.get(name) or settings_table.ARGUMENTS[name]
    default = settings_table.value(name) if name in settings_table.SETTINGS else row["default"]
    keywords = {"name": row["label"], "description": settings_table.tooltip(row), "default": default, **presentation}
    match row["kind"]:
        case "flag":
            return BoolProperty(**keywords)
        case "choice":
            return EnumProperty(items=settings_table.items(row["choices"]), **keywords)
        case "real":
            return FloatProperty(**settings_table.bounds(row, presentation["precision"]), **keywords)
        case "whole":
            return IntProperty(**settings_table.bounds(row), **keywords)
        case "size":
            return IntVectorProperty(size=2, **settings_table.bounds(row), **keywords)
    raise ValueError(f"{name}: no property holds a {row['kind']}")


def _apply_preset(settings, _context):
    """Shows the preset's own values: what the panel displays is what will run."""
    for name in annotations():
        if name not in (*BRIDGE_SETTINGS, *KEPT_BY_PRESETS, "preset"):
            settings.property_unset(name)
    for chosen in PRESET_MAPS.values():
        # Another preset is not to write the map that the one before was for.
        if all(getattr(settings, name) == value for name, value in chosen.items()):
            for name in chosen:
                settings.property_unset(name)
    for name, value in PRESET_VALUES.get(settings.preset, {}).items():
        setattr(settings, name, value)


class BLEUnwrapSettings(bpy.types.PropertyGroup):
    """Settings of BLE Unwrap, kept with the scene."""

    preset: EnumProperty(
        name="Preset",
        description=(
            "How it is done: values of all settings but stretch limit, texture size, margin, tiles, texel density and "
            "the result's; a lightmap also gets a UV map of its own"
        ),
        items=settings_table.preset_items(),
        default="DEFAULT",
        update=_apply_preset,
    )

    # ---- what an artist needs
    stretch_limit: declared("stretch_limit", soft_min=1.01, soft_max=1.5, step=1, precision=3)
    limit_over: declared("limit_over")
    texture_size: declared("texture_size", soft_min=256, soft_max=8192)
    margin: declared("margin", soft_max=32.0, step=50, precision=1, subtype="PIXEL")
    rotation: declared("rotation")
    stack: declared("stack")
    quality: declared("quality")
    mip_levels: declared("mip_levels")
    shrink_margin: declared("shrink_margin")
    snap: declared("snap")
    tiles: declared("tiles", soft_max=20)
    # Lengths are those of the scene, in its units: objects are unwrapped at the scale that they have there.
    texel_density: declared("texel_density", soft_max=8192.0, step=1000, precision=3)
    use_seams: BoolProperty(
        name="Cut at Seams",
        description=(
            "Cut along the seams that the mesh has, but for those of an earlier Mark Seams, and wherever the stretch "
            "limit needs more"
        ),
        default=True,
    )
    use_sharp: BoolProperty(
        name="Cut at Sharp Edges",
        description="Cut along all edges that are sharp: marked so, or bent by at least Sharp Angle",
        default=False,
    )
    use_materials: BoolProperty(
        name="Cut at Materials",
        description="Cut along all borders between materials, so that no chart has two of them",
        default=False,
    )
    sharp_angle: FloatProperty(
        name="Sharp Angle",
        description=(
            "Edges at which the normals of two faces are at least so many degrees apart count as sharp, whether or not "
            "they are marked; at 180 only marked ones do. Measured on the mesh itself, without the object's scale"
        ),
        default=180.0,
        min=1.0,
        max=180.0,
        step=100,
        precision=1,
    )
    follow_seams: BoolProperty(
        name="Follow Seams",
        description="Where a chart needs a border, draw it to seams of the mesh, without cutting all of them",
        default=True,
    )
    follow_sharp: BoolProperty(
        name="Follow Sharp Edges",
        description=(
            "Where a chart needs a border, draw it to edges that are sharp: marked so, or bent by at least Sharp Angle"
        ),
        default=True,
    )
    follow_materials: BoolProperty(
        name="Follow Materials",
        description="Where a chart needs a border, draw it to borders between materials",
        default=True,
    )
    seams_away: StringProperty(
        name="Keep Seams Away",
        description=(
            "A vertex group, or a float attribute on points, that says where seams are to keep away: at a "
            "weight of 1 a seam counts for ten times its length"
        ),
        default="",
    )
    seams_here: StringProperty(
        name="Seams Here",
        description=(
            "A vertex group, or a float attribute on points, that says where seams are welcome: at a weight of "
            "1 a seam counts for a tenth of its length"
        ),
        default="",
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
    weld: declared("weld")
    weld_distance: declared("weld_distance", soft_max=1.0, step=0.1, precision=6, unit="LENGTH")
    cut_angle: declared("cut_angle", step=100, precision=1)
    coarse: declared("coarse")
    stretch_price: declared("stretch_price", soft_max=100.0, step=100, precision=2)
    hide_seams: declared("hide_seams", soft_max=4.0, step=10, precision=2)
    # In Blender figures look along -Y.
    front: declared("front", default="-Y")
    symmetry: declared("symmetry")
    style: declared("style")
    straighten: declared("straighten", soft_max=1.0, step=5, precision=2)
    cover_price: declared("cover_price", soft_max=10.0, step=50, precision=2)
    moves: declared("moves")
    holes: declared("holes")
    chart_scale: declared("chart_scale")
    crease_weight: declared("crease_weight", step=10, precision=2)
    seed: declared("seed")

    neighbours: declared("neighbours", soft_max=64)

    # ---- landmarks and distances
    geodesics: declared("geodesics")
    landmark_fraction: declared("landmark_fraction", soft_max=0.1, step=1, precision=4)
    landmark_min: declared("landmark_min", soft_max=1000)
    landmark_max: declared("landmark_max", soft_max=2000)
    together_max: declared("together_max", soft_max=2000)

    # ---- embedding
    model: declared("model")
    kernel_width: declared("kernel_width", soft_max=1.0, step=1, precision=3)
    relaxation: declared("relaxation", step=10, precision=2)
    max_sweeps: declared("max_sweeps", soft_max=500)
    tolerance: declared("tolerance", soft_max=0.1, step=1, precision=7)
    update: declared("update")
    initial: declared("initial")

    # ---- stretch
    stretch_solver: declared("stretch_solver")
    stretch_iterations: declared("stretch_iterations", soft_max=500)


# Settings that the native module never sees.
BRIDGE_SETTINGS = tuple(
    name
    for name in BLEUnwrapSettings.__annotations__
    if name not in {"preset", *settings_table.SETTINGS, *settings_table.ARGUMENTS}
)
# What means something for surfaces only, or for clouds only; the other one's functions do not take it.
SURFACE_SETTINGS = (
    *("use_seams", "use_sharp", "use_materials", "sharp_angle"),
    *("follow_seams", "follow_sharp", "follow_materials", "seams_away", "seams_here", "mark_seams"),
    *("move_pinned", "correct_aspect"),
    *sorted(settings_table.taken_by("unwrap") - settings_table.taken_by("unwrap_points")),
)
CLOUD_SETTINGS = ("neighbours",)
# What packing islands that are there has in common with an unwrap, in the order in which it is shown.
PACK_SETTINGS = ("texture_size", "correct_aspect", "margin", "mip_levels", "rotation", "quality", "tiles")

# What the panel shows at once, and what it folds away, by title.
MAIN_SETTINGS = ("stretch_limit", "texture_size", "margin", "rotation", "use_seams", "use_selection")
ADVANCED_SETTINGS = (
    ("Result", ("uv_map", "uv_map_name", "correct_aspect", "use_original_bounds", "move_pinned", "mark_seams")),
    (
        "Borders",
        (
            *("cut_angle", "use_sharp", "use_materials", "sharp_angle"),
            *("follow_seams", "follow_sharp", "follow_materials", "crease_weight"),
            *("seams_away", "seams_here", "hide_seams", "front", "symmetry", "style", "straighten"),
        ),
    ),
    (
        "Charts",
        (
            *("stretch_price", "limit_over", "neighbours", "weld", "weld_distance", "coarse"),
            *("moves", "holes", "chart_scale", "seed"),
        ),
    ),
    ("Distances", ("geodesics", "landmark_fraction", "landmark_min", "landmark_max", "together_max")),
    ("Embedding", ("model", "kernel_width", "relaxation", "max_sweeps", "tolerance", "update", "initial")),
    ("Stretch", ("stretch_solver", "stretch_iterations")),
    ("Packing", ("cover_price", "stack", "quality", "mip_levels", "shrink_margin", "snap", "tiles", "texel_density")),
)


def annotations():
    """The declared settings: name -> deferred property, in order of declaration."""
    return BLEUnwrapSettings.__annotations__


def native_values(settings, left_out):
    """Settings for a native function: those of the bridge and those that it does not take left out."""
    return {name: value for name, value in settings.items() if name not in BRIDGE_SETTINGS and name not in left_out}


def operator_annotations(names=None):
    """The same settings, or those of these names, for an operator.

    They are not remembered from its last run, since the scene keeps them: what a call leaves out comes from the scene
    (interactively) or from the defaults (in a script).
    """
    return {
        name: deferred.function(**{**deferred.keywords, "options": {"SKIP_SAVE"}})
        for name, deferred in annotations().items()
        if names is None or name in names
    }


def copy_unset(target, source, names=None):
    """Gives `target` the values of `source` for every setting, or those of `names`, that it does not have set."""
    names = annotations() if names is None else names
    explicit = {name for name in names if target.is_property_set(name)}
    # A preset named in the call brings its own values: the scene's must not override them.
    kept = (*BRIDGE_SETTINGS, *KEPT_BY_PRESETS)
    names = [name for name in names if "preset" not in explicit or name in kept]
    for name in names:
        if name not in explicit and source.is_property_set(name):
            setattr(target, name, getattr(source, name))


def copy_changed(source, target):
    """Gives `target` the values of `source` wherever they differ; the preset first, which brings others."""
    copy_named(source, target, annotations())


def values(settings):
    """Settings as plain values; those of the native module only where they were set, so that its presets hold."""
    always = (*BRIDGE_SETTINGS, *KEPT_BY_PRESETS, "preset")
    found = {
        name: _plain(name, getattr(settings, name))
        for name in annotations()
        if name in always or settings.is_property_set(name)
    }
    chosen = PRESET_MAPS.get(settings.preset, {})
    unset = {name: value for name, value in chosen.items() if not settings.is_property_set(name)}
    return found | unset


def copy_named(source, target, names):
    """Gives `target` the values of `source` for these settings, wherever they differ."""
    for name in names:
        value = getattr(source, name)
        if _plain(name, getattr(target, name)) != _plain(name, value):
            setattr(target, name, value)


def plain_values(settings, names):
    """These settings as plain values."""
    return {name: _plain(name, getattr(settings, name)) for name in names}


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
