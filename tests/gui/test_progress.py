"""Long work shows how far it is, in the sidebar and where settings are adjusted afterwards, and can be stopped."""

import time

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


def unwrap(window):
    with window.context():
        bpy.ops.uv.ble_unwrap("INVOKE_DEFAULT")
    assert running().is_there(), "so much work is done in the background"
    yield from window.turns()


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
            turn = time.monotonic()
        yield None
    assert not np.array_equal(scenes.uvs(obj), before)
    assert len(shares) > 1 and filled == sorted(filled), (shares, filled)
    assert filled[-1] > filled[0] + 40, f"the bar grows on the screen: {filled}"
    assert len({progress for progress, _ in texts}) > 1 and len({passed for _, passed in texts}) > 1, texts
    assert still < MOVES_WITHIN + 3 * slowest, f"what is shown stood still for {still:.1f} s, a turn {slowest:.1f} s"


def test_escape_cancels_and_leaves_the_uvs(window):
    obj, _region = yield from long_work(window)
    before = scenes.uvs(obj)
    state = scenes.fingerprint(obj)
    yield from unwrap(window)
    yield Wait(lambda: running().share() > 0.0, "work is under way")
    yield from window.rest()
    yield from window.key("ESC")
    yield Wait(lambda: not running().is_there(), "Esc stops it", 5.0)
    yield from window.turns(10)
    assert np.array_equal(scenes.uvs(obj), before) and scenes.fingerprint(obj) == state


def test_the_button_cancels_and_all_others_wait(window):
    obj, region = yield from long_work(window)
    before = scenes.uvs(obj)
    yield from unwrap(window)
    yield Wait(lambda: running().share() > 0.0, "work is under way")
    top = region.y + region.height
    for below in (180, 387, 450, 540):  # Texture Size, Check UV Map, Stretch, Compare with Smart UV Project
        yield from window.click(region.x + region.width // 2, top - below)
    yield from window.rest()
    yield from window.key("LEFTMOUSE")
    assert running().is_there(), "the work goes on"
    assert obj.select_get() and bpy.context.active_object == obj, "a click beside the sidebar selects nothing else"
    assert not addon_loader.load("last_check").title() and not addon_loader.load("overlay").is_on()
    # While work is running keys are not for buttons, so the pointer has to find this one by its place.
    x, y = region.x + int(0.75 * region.width), top - 78
    yield from window.move(x, y)
    window.screenshot("cancel_button")
    yield from window.key("LEFTMOUSE")
    yield Wait(lambda: not running().is_there(), "the button stops it", 5.0)
    assert np.array_equal(scenes.uvs(obj), before)


def test_adjusting_a_long_run_shows_progress_and_can_be_cancelled(window):
    obj, _region = yield from long_work(window)
    before = scenes.uvs(obj)
    bpy.context.scene.ble_unwrap.margin = 7.0
    yield from unwrap(window)
    yield Wait(lambda: not running().is_there(), "the first run ends", 120.0)
    first = scenes.uvs(obj)
    assert not np.array_equal(first, before)

    def adjust(text):
        yield from window.turns(10)
        yield from window.find(window.region("HUD"), lambda copied: copied.startswith("7.0"), 0.7)
        yield from window.paste(text)
        yield Wait(running().is_there, "it runs in the background")

    yield from window.adjust()
    yield from adjust("11")
    yield Wait(lambda: running().share() > 0.0, "work is under way")
    window.screenshot("adjusting")
    yield from window.key("ESC")
    yield Wait(lambda: not running().is_there(), "Esc stops it", 5.0)
    yield from window.turns(10)
    obj = bpy.data.objects["Sphere"]
    assert np.array_equal(scenes.uvs(obj), first), "the former result is there again"
    assert bpy.context.scene.ble_unwrap.margin == 7.0
    with window.context():
        bpy.ops.uv.ble_unwrap("INVOKE_DEFAULT")
    yield Wait(lambda: not running().is_there(), "another run ends", 120.0)
    yield from adjust("12")
    yield Wait(lambda: not running().is_there(), "the adjusted run ends", 120.0)
    second = scenes.uvs(bpy.data.objects["Sphere"])
    assert not np.array_equal(second, first) and bpy.context.scene.ble_unwrap.margin == 12.0
    yield from window.rest()
    yield from window.key("Z", ctrl=True)
    yield Wait(
        lambda: np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), first), "one undo takes back the last run"
    )
    yield from window.key("Z", ctrl=True)
    yield Wait(lambda: np.array_equal(scenes.uvs(bpy.data.objects["Sphere"]), before), "and one more the first")
