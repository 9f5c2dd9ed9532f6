"""The operator `uv.ble_unwrap`: gather, compute with progress and Esc, write back, report."""

import bpy
from bpy.props import BoolProperty

from .. import engine, faces, kept_analysis, last_result, mesh_bridge, preferences, properties, targets
from ..panel import panel_settings
from ..run import Run

# The add-on's failures that are the user's business; anything else is a bug and may show its traceback.
USER_ERRORS = (mesh_bridge.MeshError, engine.EngineMissing, engine.EngineError)

POLL_SECONDS = 0.1
CANCEL_POLLS = 100  # after Esc, wait at most this many polls for the worker before letting it go

# While a job runs the view may be moved and zoomed; everything else waits, so that the mesh stays as it was read.
PASSED_EVENTS = {
    "MIDDLEMOUSE",
    "MOUSEMOVE",
    "INBETWEEN_MOUSEMOVE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "TRACKPADPAN",
    "TRACKPADZOOM",
    "MOUSEROTATE",
    "WINDOW_DEACTIVATE",
}


class UV_OT_ble_unwrap(bpy.types.Operator):
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
        properties.copy_unset(self.properties, context.scene.ble_unwrap)
        self.from_sidebar = True
        if bpy.app.background:
            return self.execute(context)
        try:
            run = self._run(context)
            if run.element_count < preferences.preference(context, "modal_threshold"):
                return self._finish(context, run, run.run())
            self._start(context, run)
        except USER_ERRORS as error:
            return self._fail(error)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            run = self._run(context)
            return self._finish(context, run, run.run())
        except USER_ERRORS as error:
            return self._fail(error)

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            self._cancel_requested = True
            self._job.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in PASSED_EVENTS else {"RUNNING_MODAL"}
        if self._cancel_requested:
            self._cancel_polls += 1
            if self._job.is_finished() or self._cancel_polls > CANCEL_POLLS:
                self._stop(context)
                self.report({"WARNING"}, "BLE Unwrap: cancelled, nothing was changed")
                return {"CANCELLED"}
            return {"RUNNING_MODAL"}
        if not self._job.is_finished():
            self._show_progress(context)
            return {"RUNNING_MODAL"}
        job = self._job
        self._stop(context)
        try:
            return self._finish(context, self._running, job.result())
        except engine.EngineCancelled:
            self.report({"WARNING"}, "BLE Unwrap: cancelled, nothing was changed")
            return {"CANCELLED"}
        except USER_ERRORS as error:
            return self._fail(error)

    def cancel(self, context):
        """Blender itself ends the operator: a file is loaded or the window closes."""
        self._job.cancel()
        self._stop(context)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        for name in panel_settings(self, context, ("preset", *properties.MAIN_SETTINGS)):
            column.prop(self, name)
        for title, names in properties.ADVANCED_SETTINGS:
            names = panel_settings(self, context, names)
            if not names:
                continue
            header, body = layout.panel(f"BLE_UNWRAP_{title}", default_closed=True)
            header.label(text=title)
            if body:
                for name in names:
                    body.prop(self, name)

    def _run(self, context):
        if not self.properties.is_property_set("by_uv"):
            self.by_uv = faces.by_uv_selection(context)
        return Run(
            targets.target_objects(context),
            properties.values(self.properties),
            threads=preferences.preference(context, "threads"),
            keep=True,  # the redo panel unwraps the same meshes again
            by_uv=self.by_uv,
        )

    def _start(self, context, run):
        self._running = run
        self._job = run.start()
        self._cancel_requested = False
        self._cancel_polls = 0
        manager = context.window_manager
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 100)
        self._show_progress(context)

    def _show_progress(self, context):
        percent = int(100 * self._job.progress())
        context.window_manager.progress_update(percent)
        context.workspace.status_text_set(f"BLE Unwrap: {percent}%  {self._job.stage()}    [Esc] cancel")

    def _stop(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)

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

    def _fail(self, error):
        self.report({"ERROR"}, f"BLE Unwrap: {error}")
        return {"CANCELLED"}


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


def redraw(context):
    """Shows new UVs and the certificate in every editor."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"IMAGE_EDITOR", "VIEW_3D"}:
                area.tag_redraw()


@bpy.app.handlers.persistent
def forget(*_):
    """Frees the analysis kept for the redo panel: another file is loaded."""
    kept_analysis.forget()


def register():
    bpy.utils.register_class(UV_OT_ble_unwrap)
    bpy.app.handlers.load_post.append(forget)


def unregister():
    bpy.app.handlers.load_post.remove(forget)
    kept_analysis.forget()
    bpy.utils.unregister_class(UV_OT_ble_unwrap)
