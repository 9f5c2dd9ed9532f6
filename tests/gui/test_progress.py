"""Long work shows how far it is, in the sidebar and where settings are adjusted afterwards, and can be stopped."""

import time
from contextlib import contextmanager

import addon_loader
import bpy
import numpy as np
import scenes
from driver import Wait

LONG = 70  # cells along a side of a ball of 29,400 faces: some seconds of work on one core
MOVES_WITHIN = 2.0  # seconds: the bar has new text each second; the rest is for a busy machine that draws by software


def running():
    return addon_loader.load("running")


def long_work(window):
    """A ball that takes long, with UVs, and the sidebar open; returns it and the sidebar's region."""
    obj = scenes.sphere(cells=LONG)
    scenes.select(obj)
    obj.data.uv_layers.new(name="UVMap")
    with window.context():
        bpy.ops.ed.undo_push(message="Made")
    # Out of sight: software OpenGL takes most of a second to draw it, and what is looked at is the sidebar.
    window.area().spaces.active.region_3d.view_location = (1000.0, 0.0, 0.0)
    region = yield from window.sidebar()
    return obj, region


@contextmanager
def held_up():
    """Work in the background is not over before it is cancelled or the function that is given is called.

    However fast or busy the machine is, there is time to press buttons meanwhile.
    """
    job = addon_loader.load("computation").Job
    is_finished, cancel = job.is_finished, job.cancel
    released = []
    job.is_finished = lambda self: bool(released) and is_finished(self)
    job.cancel = lambda self: (released.append(True), cancel(self))
    try:
        yield lambda: released.append(True)
    finally:
        job.is_finished, job.cancel = is_finished, cancel


def held_up_work(window):
    """A small ball that is worked on in the background; returns it, its UVs before and the sidebar's region."""
    addon = bpy.context.preferences.addons[addon_loader.package()]
    addon.preferences.modal_threshold = 0
    obj = scenes.sphere()
    scenes.select(obj)
    obj.data.uv_layers.new(name="UVMap")
    with window.context():
        bpy.ops.ed.undo_push(message="Made")
    region = yield from window.sidebar()
    return obj, scenes.uvs(obj), region


def unwrap(window):
    with window.context():
        bpy.ops.uv.ble_unwrap("INVOKE_DEFAULT")
    assert running().is_there(), "it is done in the background"
    yield from window.turns(6)


def is_over():
    return not running().is_there()


def bar(window, region):
    """How many pixels of the bar, which is in the place of the button, have the colour of what is done."""
    row = window.picture_of(region)[40:60].astype(int)
    red, blue = row[..., 0], row[..., 2]
    return int((blue > red + 40).any(axis=0).sum())


def test_progress_is_shown_and_goes_up(window):
    obj, region = yield from long_work(window)
    before = scenes.uvs(obj)
    yield from window.press(region, "uv.ble_unwrap(")
    yield Wait(running().is_there, "the button begins the work")
    shares, texts, filled = [], [], []
    still = slowest = 0.0  # seconds: of what is shown, and of a turn, which on a busy machine has to wait
    moved = turn = time.monotonic()
    while running().is_there():
        now = time.monotonic()
        slowest, turn = max(slowest, now - turn), now
        shown = running().progress_text(), running().time_text()
        if not texts or shown != texts[-1]:
            texts.append(shown)
            still, moved = max(still, now - moved), now
        if not shares or running().share() > shares[-1]:
            shares.append(running().share())
            yield from window.turns()
            filled.append(bar(window, region))
            window.screenshot(f"progress_{len(filled)}")
            moved = turn = time.monotonic()  # this program has held Blender up meanwhile
        yield None
    assert not np.array_equal(scenes.uvs(obj), before)
    assert len(shares) > 1 and filled == sorted(filled), (shares, filled)
    assert filled[-1] > filled[0] + 40, f"the bar grows on the screen: {filled}"
    assert len({progress for progress, _ in texts}) > 1 and len({passed for _, passed in texts}) > 1, texts
    assert still < MOVES_WITHIN + 3 * slowest, f"what is shown stood still for {still:.1f} s, a turn {slowest:.1f} s"


def test_escape_cancels_and_leaves_the_uvs(window):
    obj, before, _region = yield from held_up_work(window)
    state = scenes.fingerprint(obj)
    with held_up():
        yield from unwrap(window)
        yield from window.rest()
        yield from window.key("ESC")
        yield Wait(is_over, "Esc stops it")
    yield from window.turns(10)
    assert np.array_equal(scenes.uvs(obj), before) and scenes.fingerprint(obj) == state


def test_the_button_cancels_and_all_others_wait(window):
    obj, before, region = yield from held_up_work(window)
    with held_up():
        yield from unwrap(window)
        top = region.y + region.height
        for below in (180, 387, 450, 540):  # Texture Size, Check UV Map, Stretch, Compare with Smart UV Project
            yield from window.click(region.x + region.width // 2, top - below)
        yield from window.move(region.x + 30, region.y + 30)
        yield from window.key("LEFTMOUSE")
        yield from window.turns(6)
        assert running().is_there(), "the work goes on"
        assert obj.select_get() and bpy.context.active_object == obj, "a click beside the sidebar selects nothing else"
        assert not addon_loader.load("last_check").title() and not addon_loader.load("overlay").is_on()
        # While work is going on keys are not for buttons, so the pointer has to find this one by its place.
        yield from window.move(region.x + int(0.75 * region.width), top - 78)
        window.screenshot("cancel_button")
        yield from window.key("LEFTMOUSE")
        yield Wait(is_over, "the button stops it")
    yield from window.turns(10)
    assert np.array_equal(scenes.uvs(obj), before)


def adjust_margin(window, old, new):
    """Changes the margin in Adjust Last Operation, which is unfolded."""
    yield from window.turns(10)
    yield from window.find(window.region("HUD"), lambda copied: copied.startswith(old), 0.7)
    yield from window.paste(new)
    yield Wait(running().is_there, "it is done in the background")
    yield from window.turns(6)


def test_adjusting_is_done_in_the_background_and_can_be_cancelled(window):
    obj, before, _region = yield from held_up_work(window)
    bpy.context.scene.ble_unwrap.margin = 7.0
    yield from unwrap(window)
    yield Wait(is_over, "the first run ends")
    first = scenes.uvs(obj)
    assert not np.array_equal(first, before)
    yield from window.adjust()
    with held_up():
        yield from adjust_margin(window, "7.0", "11")
        window.screenshot("adjusting")
        yield from window.key("ESC")
        yield Wait(is_over, "Esc stops it")

    def now():
        return scenes.uvs(bpy.data.objects["Sphere"])

    yield Wait(lambda: np.array_equal(now(), first), "the former result is there again")
    assert bpy.context.scene.ble_unwrap.margin == 7.0, "what was not done is not kept"


def test_what_was_adjusted_in_the_background_is_one_step_of_undo(window):
    obj, before, _region = yield from held_up_work(window)
    bpy.context.scene.ble_unwrap.margin = 7.0
    yield from unwrap(window)
    yield Wait(is_over, "the first run ends")
    first = scenes.uvs(obj)
    yield from window.adjust()
    with held_up() as release:
        yield from adjust_margin(window, "7.0", "12")
        release()
        yield Wait(is_over, "the adjusted run ends")

    def now():
        return scenes.uvs(bpy.data.objects["Sphere"])

    assert not np.array_equal(now(), first) and bpy.context.scene.ble_unwrap.margin == 12.0
    yield from window.rest()
    yield from window.key("Z", ctrl=True)
    yield Wait(lambda: np.array_equal(now(), before), "it has taken the place of the first run")
