"""When operators on UV maps that are there can run."""


def has_map(cls, context):
    """Whether there is a mesh with a UV map to work on; else says why the operator `cls` is greyed out."""
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        cls.poll_message_set("Works in Object Mode and in Edit Mode of a mesh")
        return False
    objects = context.selected_objects if context.mode == "OBJECT" else context.objects_in_mode_unique_data
    if not any(obj.type == "MESH" and obj.data.uv_layers for obj in objects):
        cls.poll_message_set("Select a mesh that has a UV map")
        return False
    return True
