"""Which objects an unwrap is about, and as what: a surface (a mesh with faces) or a cloud (points without)."""

EDIT_MODES = ("EDIT_MESH", "EDIT_POINTCLOUD")
TYPES = ("MESH", "POINTCLOUD")
CONVERTIBLE = ("CURVE", "FONT", "META", "SURFACE")  # which Blender shows, and most files hold, as meshes


def is_surface(obj):
    """Whether an object is a mesh with faces; loose vertices beside them do not matter."""
    return obj.type == "MESH" and len(obj.data.polygons) > 0


def is_cloud(obj):
    """Whether an object has points and nothing else: a point cloud, or a mesh of vertices without edges and faces."""
    if obj.type == "POINTCLOUD":
        return len(obj.data.points) > 0
    return obj.type == "MESH" and len(obj.data.vertices) > 0 and not obj.data.edges and not obj.data.polygons


def target_objects(context):
    """Objects to unwrap, one per data-block: those in edit mode, else the selected ones, the active one first."""
    if context.mode in EDIT_MODES:
        objects = list(context.objects_in_mode_unique_data)
    else:
        objects = list(context.selected_objects)
    active = context.view_layer.objects.active
    objects.sort(key=lambda obj: (obj != active, obj.name_full))
    return unique_data(objects)


def unique_data(objects):
    """Meshes and point clouds without those that share the data of an earlier one."""
    seen, result = set(), []
    for obj in objects:
        if obj.type in TYPES and obj.data.session_uid not in seen:
            seen.add(obj.data.session_uid)
            result.append(obj)
    return result


def shown_kinds(context):
    """Whether surfaces and whether clouds are among the targets, for the panel; both where nothing is."""
    objects = context.objects_in_mode_unique_data if context.mode in EDIT_MODES else context.selected_objects
    surfaces = clouds = False
    for obj in objects:
        surfaces = surfaces or is_surface(obj)
        clouds = clouds or is_cloud(obj)
        if surfaces and clouds:
            break
    return (surfaces, clouds) if surfaces or clouds else (True, True)
