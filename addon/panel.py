"""Sidebar panels of the UV editor and the 3D view: the button, the settings, the last certificate."""

import json

import bpy

from . import (
    last_check,
    last_comparison,
    last_result,
    overlay,
    overlay_colours,
    overlay_legend,
    properties,
    running,
    targets,
)

CATEGORY = "BLE Unwrap"
STATUS_ICONS = {"HEAD": "DOT", "OK": "CHECKMARK", "BAD": "ERROR", "WARN": "INFO", "INFO": "BLANK1"}
PAINTED = ("seams_away", "seams_here")  # settings that name a vertex group or an attribute
LINE_CHARACTERS = 36  # of a line of the panel at its usual width


def draw_settings(layout, context, names):
    settings = context.scene.ble_unwrap
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    for name in panel_settings(settings, context, names):
        obj = context.active_object
        if name in PAINTED and obj is not None and obj.type == "MESH":
            column.prop_search(settings, name, obj, "vertex_groups", results_are_suggestions=True)
        else:
            column.prop(settings, name)


def panel_settings(settings, context, names):
    """Those of the settings that matter to what is selected and to the other settings."""
    surfaces, clouds = targets.shown_kinds(context)
    left_out = set()
    if context.mode not in targets.EDIT_MODES:
        left_out.add("use_selection")
    if settings.uv_map != "NEW" and not clouds:
        left_out.add("uv_map_name")  # a cloud has no active map: its attribute goes by name
    if not surfaces:
        left_out.update(properties.SURFACE_SETTINGS)
    for name in names:
        if name.startswith("follow_") and getattr(settings, name.replace("follow_", "use_", 1)):
            left_out.add(name)  # they are all cut
    if not clouds:
        left_out.update(properties.CLOUD_SETTINGS)
    return [name for name in names if name not in left_out]


class _InSidebar:
    bl_category = CATEGORY
    bl_region_type = "UI"


class _Main(_InSidebar):
    bl_label = "BLE Unwrap"

    def draw(self, context):
        layout = self.layout
        if running.is_there():
            running.draw(layout)
        else:
            row = layout.row()
            row.scale_y = 1.4
            row.operator_context = "INVOKE_DEFAULT"
            row.operator("uv.ble_unwrap", icon="UV")
            row = layout.row()
            row.operator_context = "INVOKE_DEFAULT"
            row.operator("uv.ble_unwrap_pack", text="Pack Only")
        column = layout.column()
        column.enabled = not running.is_there()  # it would come too late
        draw_settings(column, context, ("preset", *properties.MAIN_SETTINGS))


class _Certificate(_InSidebar):
    bl_label = "Last Result"

    @classmethod
    def poll(cls, context):
        return last_result.is_true(context)

    def draw(self, context):
        self.layout.enabled = not running.is_there()
        certificate = context.window_manager.ble_unwrap_certificate
        column = self.layout.column(align=True)
        column.label(text=certificate.title, icon="UV")
        for status, text in json.loads(certificate.lines):
            icon = STATUS_ICONS.get(status, "BLANK1")
            for line in wrapped(text):
                column.label(text=line, icon=icon)
                icon = "BLANK1"
        for kind, count, what in (
            ("CROWDED", certificate.crowded, "with More than Two Faces"),
            ("OPPOSED", certificate.opposed, "between Opposed Faces"),
        ):
            if count:
                text = f"Select {count:,} Edge{'' if count == 1 else 's'} {what}"
                self.layout.operator("mesh.ble_unwrap_select_edges", text=text, icon="EDGESEL").kind = kind
        if narrow := certificate.narrow_charts:
            text = f"Select {narrow:,} Narrow Chart{'' if narrow == 1 else 's'}"
            self.layout.operator("mesh.ble_unwrap_select_narrow", text=text, icon="FACESEL")


class _Check(_InSidebar):
    bl_label = "Check"

    def draw(self, context):
        self.layout.enabled = not running.is_there()
        layout = self.layout
        layout.operator("uv.ble_unwrap_check", icon="VIEWZOOM")
        if not last_check.title():
            return
        column = layout.column(align=True)
        current = last_check.is_current(context)
        column.active = current
        title = last_check.title() if current else f"{last_check.title()} (out of date)"
        column.label(text=title, icon="UV" if current else "FILE_REFRESH")
        for line in last_check.lines():
            icon = STATUS_ICONS.get(line.status, "BLANK1")
            for text in wrapped(line.text):
                column.label(text=text, icon=icon)
                icon = "BLANK1"
            if line.kind:
                row = column.row()
                row.label(icon="BLANK1")
                row.operator("mesh.ble_unwrap_select_faulty", text="Select", icon="FACESEL").kind = line.kind


class _Show(_InSidebar):
    bl_label = "Show"

    def draw(self, _context):
        self.layout.enabled = not running.is_there()
        layout = self.layout
        row = layout.row(align=True)
        for kind, text in (("CHECKER", "Checker"), ("STRETCH", "Stretch"), ("ISLANDS", "Islands")):
            row.operator("uv.ble_unwrap_show", text=text, depress=overlay.is_shown(kind)).kind = kind
        layout.operator("uv.ble_unwrap_show", text="Seams", depress=overlay.is_shown("SEAMS")).kind = "SEAMS"
        if not overlay.is_shown("STRETCH"):
            return
        column = layout.column(align=True)
        column.label(text="Lines of the texture on the surface:")
        for icon, text in overlay_legend.lines():
            column.label(text=text, icon_value=icon)
        if factors := overlay.worst():
            column.label(text=f"Worst here: {overlay_colours.range_text(*factors)}")


class _Compare(_InSidebar):
    bl_label = "Compare"

    def draw(self, _context):
        self.layout.enabled = not running.is_there()
        layout = self.layout
        if not last_comparison.is_there():
            layout.operator_context = "INVOKE_DEFAULT"
            layout.operator("uv.ble_unwrap_compare", icon="MOD_UVPROJECT")
            return
        layout.label(text=last_comparison.title(), icon="UV")
        table = layout.column(align=True)
        for label, *texts in (("", "BLE Unwrap", "Smart UV"), *last_comparison.rows()):
            row = table.split(factor=0.36)
            row.label(text=label)
            row = row.split(factor=0.5)
            for text in texts:
                row.label(text=text)
        for side, name in (("BLE", "BLE Unwrap"), ("SMART", "Smart UV")):
            row = layout.split(factor=0.36)
            row.label(text=name)
            row = row.row(align=True)
            row.operator("uv.ble_unwrap_look", text="", icon="HIDE_OFF").side = side
            row.operator("uv.ble_unwrap_keep", icon="CHECKMARK").side = side
        layout.operator("uv.ble_unwrap_discard", icon="X")


class _Advanced(_InSidebar):
    bl_label = "Advanced"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        self.layout.enabled = not running.is_there()
        for title, names in properties.ADVANCED_SETTINGS:
            if not panel_settings(context.scene.ble_unwrap, context, names):
                continue
            header, body = self.layout.panel(f"BLE_UNWRAP_{title}", default_closed=title != "Result")
            header.label(text=title)
            if body:
                draw_settings(body, context, names)


def wrapped(text):
    """A text in lines that fit the panel."""
    lines, line = [], ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > LINE_CHARACTERS:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return [*lines, line]


# What the sidebars hold, in this order: the suffix of a panel's name, and what it draws.
PARTS = (
    ("", _Main),
    ("_certificate", _Certificate),
    ("_check", _Check),
    ("_show", _Show),
    ("_compare", _Compare),
    ("_advanced", _Advanced),
)


@classmethod
def _of_uv_editor(cls, context):
    """Whether an Image Editor shows UVs."""
    return context.space_data.mode == "UV"


def _panels(prefix, space, poll=None):
    """The panel of the add-on in one kind of editor, and those inside it."""
    main = f"{prefix}_PT_ble_unwrap"
    for suffix, part in PARTS:
        own = {"bl_space_type": space, "__module__": __name__}
        if suffix:
            own["bl_parent_id"] = main
        elif poll is not None:
            own["poll"] = poll
        yield type(f"{main}{suffix}", (part, bpy.types.Panel), own)


CLASSES = (*_panels("IMAGE", "IMAGE_EDITOR", _of_uv_editor), *_panels("VIEW3D", "VIEW_3D"))


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
