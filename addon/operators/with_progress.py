"""What operators have in common that compute for long: a job on another thread, its progress, and Esc."""

import bpy

from .. import engine, last_result, mesh_bridge, preferences, running
from . import again

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


class WithProgress:
    """An operator made of a `_prepare`, which reads, and a `_finish`, which writes what was computed in between.

    `shown` names the properties in its redo panel.

    `_prepare(context)` returns the work: it has an `element_count`, and computes at once by `run` or on another thread
    by `start`. `_finish(context, work, result)` writes the result, reports and returns what an operator returns.
    Whenever either raises one of `USER_ERRORS`, nothing has been changed.
    """

    shown = ()
    _replaces = False  # whether this is a run in the place of a former one, from the redo panel

    def execute(self, context):
        return self.compute(context, in_background=False)

    def draw(self, context):
        if running.is_there():
            running.draw(self.layout)
        else:
            self._draw_settings(context)

    def _draw_settings(self, _context):
        draw_properties(self, self.shown)

    def compute(self, context, *, in_background):
        """Everything from reading to writing; `in_background` where the work is large and there are events to wait for.

        Returns what the operator returns.
        """
        self._replaces = again.is_invoked()
        try:
            work = self._prepare(context)
            is_large = work.element_count >= preferences.preference(context, "modal_threshold")
            if is_large and not in_background and self._is_redone():
                again.ask(self)
                return {"CANCELLED"}
            if not in_background or not is_large:
                return self._finish(context, work, work.run())
            self._start(context, work)
        except USER_ERRORS as error:
            return self._fail(error)
        return {"RUNNING_MODAL"}

    def _is_redone(self):
        """Whether the redo panel runs it: only what was invoked before has been told to keep the sidebar's settings."""
        return not bpy.app.background and getattr(self, "from_sidebar", False)

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            running.stop()
        if event.type != "TIMER":
            passed = event.type in PASSED_EVENTS or (event.type == "LEFTMOUSE" and _is_on_button(context, event))
            return {"PASS_THROUGH"} if passed else {"RUNNING_MODAL"}
        if self._cancel_requested:
            self._cancel_polls += 1
            if self._job.is_finished() or self._cancel_polls > CANCEL_POLLS:
                self._stop(context)
                return self._cancelled()
            return {"RUNNING_MODAL"}
        if not self._job.is_finished():
            self._show_progress(context)
            return {"RUNNING_MODAL"}
        job = self._job
        self._stop(context)
        try:
            return self._finish(context, self._running, job.result())
        except engine.EngineCancelled:
            return self._cancelled()
        except USER_ERRORS as error:
            return self._fail(error)

    def cancel(self, context):
        """Blender itself ends the operator: a file is loaded or the window closes."""
        self._ask_to_stop()
        self._stop(context)

    def _start(self, context, work):
        self._running = work
        self._job = work.start()
        self._cancel_requested = False
        self._cancel_polls = 0
        running.begin(self._ask_to_stop)
        manager = context.window_manager
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 100)
        self._show_progress(context)

    def _ask_to_stop(self):
        self._cancel_requested = True
        self._job.cancel()

    def _show_progress(self, context):
        running.tell(self._job.progress(), self._job.stage())
        context.window_manager.progress_update(int(100 * running.share()))
        context.workspace.status_text_set(
            f"{self.bl_label}: {running.progress_text()}    {running.time_text()}    [Esc] cancel"
        )

    def _stop(self, context):
        running.end()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)

    def _tell(self, context, warnings, text):
        """Ends a `_finish` that has written UVs: says what was done, and shows them."""
        last_result.compare()
        for warning in warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"{self.bl_label}: {text}")
        redraw(context)
        return {"FINISHED"}

    def _cancelled(self):
        if self._replaces:
            again.bring_back()
        self.report({"WARNING"}, f"{self.bl_label}: cancelled, nothing was changed")
        return {"CANCELLED"}

    def _fail(self, error):
        if self._replaces:
            again.bring_back()
        self.report({"ERROR"}, f"{self.bl_label}: {error}")
        return {"CANCELLED"}


def _is_on_button(context, event):
    """Whether the pointer is on a button that runs an operator where the computation is shown: the only such is Cancel.

    All others are greyed out meanwhile, and beside the buttons a click would select what lies behind the sidebar.
    """
    for area, region in running.regions(context.window):
        x, y = event.mouse_x - region.x, event.mouse_y - region.y
        if 0 <= x < region.width and 0 <= y < region.height:
            with context.temp_override(area=area, region=region):
                # There is no other way to ask Blender what the pointer is on.
                return bpy.ops.ui.copy_python_command_button.poll()
    return False


def draw_properties(operator, names):
    """Draws these properties in the redo panel of an operator, and returns the panel's layout."""
    layout = operator.layout
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    for name in names:
        column.prop(operator, name)
    return layout


def redraw(context):
    """Shows new UVs and what was measured of them in every editor."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"IMAGE_EDITOR", "VIEW_3D"}:
                area.tag_redraw()
