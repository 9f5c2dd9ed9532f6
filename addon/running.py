"""What is being computed in the background, for the panel: stage, share, how long it still takes, and a way to stop it.

One computation at a time: while one runs, the window waits for it. This belongs to the session; no file holds it.
"""

import time

import bpy

from . import remaining_time

SHOWN_IN = {"IMAGE_EDITOR", "VIEW_3D"}  # the editors with our panel
REGIONS = {"UI", "HUD"}  # the sidebar, and Adjust Last Operation


class _Running:
    """The computation that is shown."""

    stop = None  # what asks it to stop; None where nothing runs
    stage, share, begun, asked_to_stop = "", 0.0, 0.0, False
    forecast = None
    shown = None  # what the panel was last told to show


def begin(stop):
    """A computation begins, which `stop()` asks to end early."""
    now = time.monotonic()
    _Running.stop, _Running.stage, _Running.share, _Running.begun = stop, "", 0.0, now
    _Running.forecast, _Running.asked_to_stop = remaining_time.RemainingTime(now), False
    _redraw()


def tell(share, stage):
    """How far it is. The share that is shown never falls."""
    _Running.share, _Running.stage = max(_Running.share, min(share, 1.0)), stage
    _Running.forecast.tell(_Running.share, time.monotonic())
    shown = round(1000 * _Running.share), progress_text(), time_text()
    if shown != _Running.shown:
        _Running.shown = shown
        _redraw()


def end():
    """It is over, for whatever reason."""
    _Running.stop = None
    _redraw()


def is_there():
    return _Running.stop is not None


def stop():
    """Asks it to end early."""
    if is_there():
        _Running.asked_to_stop = True
        _Running.stop()
        _redraw()


def share():
    """What part of the work is done, 0 to 1."""
    return _Running.share


def progress_text():
    """What is being done, and how far everything is."""
    if _Running.asked_to_stop:
        return "Stopping"
    stage = _Running.stage[:1].upper() + _Running.stage[1:]
    return f"{stage}  {int(100 * _Running.share)}%".strip()


def time_text():
    """How long it has been running, which changes every second, and how long it still takes."""
    now = time.monotonic()
    minutes, seconds = divmod(int(now - _Running.begun), 60)
    left = remaining_time.text(_Running.forecast.seconds(now))
    return f"{minutes}:{seconds:02d}, {left}" if left else f"{minutes}:{seconds:02d}"


def regions(window):
    """The parts of a window that show a computation, each with its area."""
    for area in window.screen.areas:
        if area.type in SHOWN_IN:
            for region in area.regions:
                if region.type in REGIONS:
                    yield area, region


def draw(layout):
    """The bar and the button that take the place of the buttons which begin a computation."""
    row = layout.row()
    row.scale_y = 1.4
    row.progress(factor=share(), text=progress_text())
    row = layout.split(factor=0.68)
    row.label(text=time_text())
    row.operator("uv.ble_unwrap_cancel", icon="X")


def _redraw():
    for window in bpy.context.window_manager.windows:
        for _, region in regions(window):
            region.tag_redraw()
