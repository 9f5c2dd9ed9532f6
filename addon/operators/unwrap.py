"""The operator `uv.ble_unwrap`: gather, compute with progress and Esc, write back, report."""

import bpy
from bpy.props import BoolProperty

from .. import faces, handlers, kept_analysis, last_result, preferences, properties, targets
from ..panel import panel_settings
from ..run import Run
from . import again
from .with_progress import WithProgress, draw_properties, redraw


class UV_OT_ble_unwrap(WithProgress, bpy.types.Operator):
    bl_idname = "uv.ble_unwrap"
    bl_label = "BLE Unwrap"
    bl_description = (
        "Cut meshes into charts (UV islands), flatten and pack them, so that none is stretched beyond a limit, "
        "overlaps or is flipped. Point clouds get UVs, too"
    )
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = properties.operator_annotations() | {
        # Kept with a run, so that the redo panel repeats it: whether the UV Editor's selection counts, and whether
        # the sidebar takes over what is set in the redo panel.
        "by_uv": BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
        "from_sidebar": BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
    }

    @classmethod
    def poll(cls, context):
        if context.mode not in {"OBJECT", *targets.EDIT_MODES}:
            cls.poll_message_set("Works in Object Mode and in Edit Mode of a mesh or point cloud")
            return False
        if context.mode == "OBJECT" and not any(obj.type in targets.TYPES for obj in context.selected_objects):
            cls.poll_message_set("Select a mesh or a point cloud")
            return False
        return True

    def invoke(self, context, _event):
        if not again.is_invoked():
            properties.copy_unset(self.properties, context.scene.ble_unwrap)
        self.from_sidebar = True
        return self.compute(context, in_background=not bpy.app.background)

    def _draw_settings(self, context):
        layout = draw_properties(self, panel_settings(self, context, ("preset", *properties.MAIN_SETTINGS)))
        for title, names in properties.ADVANCED_SETTINGS:
            names = panel_settings(self, context, names)
            if not names:
                continue
            header, body = layout.panel(f"BLE_UNWRAP_{title}", default_closed=True)
            header.label(text=title)
            if body:
                for name in names:
                    body.prop(self, name)

    def _prepare(self, context):
        if not self.properties.is_property_set("by_uv"):
            self.by_uv = faces.by_uv_selection(context)
        return Run(
            targets.target_objects(context),
            properties.values(self.properties),
            threads=preferences.preference(context, "threads"),
            keep=True,  # the redo panel unwraps the same meshes again
            by_uv=self.by_uv,
        )

    def _finish(self, context, run, results):
        outcomes = run.write(results, measure_again=preferences.preference(context, "measure_again"))
        if self.from_sidebar:
            properties.copy_changed(self.properties, context.scene.ble_unwrap)
        last_result.show(
            context,
            titles(outcomes),
            certificate_lines(outcomes),
            run.maps(outcomes),
            narrow=run.narrow_faces(outcomes),
            narrow_charts=sum(len(outcome.report.get("narrow_charts", ())) for outcome in outcomes),
        )
        for outcome in outcomes:
            for text in outcome.certificate.warnings:
                self.report({"WARNING"}, text)
        for outcome in outcomes:
            name = f" {outcome.title}:" if len(outcomes) > 1 else ""
            if outcome.certificate.holds:
                self.report({"INFO"}, f"BLE Unwrap:{name} {outcome.summary}")
            else:
                broken = "; ".join(outcome.certificate.violations)
                self.report({"WARNING"}, f"BLE Unwrap:{name} {outcome.summary}. Not as promised: {broken}")
        redraw(context)
        return {"FINISHED"}


def titles(outcomes):
    """What the result is of, in a few words."""
    return outcomes[0].title if len(outcomes) == 1 else f"{sum(len(outcome.maps) for outcome in outcomes)} objects"


def certificate_lines(outcomes):
    """The lines of all certificates; below the name of each, where there are several."""
    result = []
    for outcome in outcomes:
        if len(outcomes) > 1:
            result.append(("HEAD", outcome.title))
        result.extend(outcome.lines)
    return result


@bpy.app.handlers.persistent
def forget(*_):
    """Frees the analysis kept for the redo panel: another file is loaded."""
    kept_analysis.forget()


HANDLERS = (("load_post", forget),)


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap)
    handlers.add(HANDLERS)


def unregister():
    handlers.remove(HANDLERS)
    kept_analysis.forget()
    bpy.utils.unregister_class(UV_OT_ble_unwrap)
