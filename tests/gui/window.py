"""Blender's window as somebody at the screen has it: areas to point at, mouse and keys, and what is to be seen.

Everything that acts is a generator, for `yield from`: events are handled when Blender's own loop gets to them.
"""

import subprocess
from pathlib import Path

import bpy
import numpy as np
from driver import Wait

TURNS_OF_AN_EVENT = 2  # the turn in which Blender takes the event, and one in which it has drawn what follows from it
SWEEP_PIXELS = 12  # less than a button's height: none is missed
LONGEST_MENU = 45  # entries; the UV editor's menu of Blender 5.2 has 30


class Window:
    """The only window, and a folder for pictures of it."""

    def __init__(self, pictures, prefix):
        self._pictures = Path(pictures)
        self._prefix = prefix
        self.pointer = (0, 0)

    # ---- what there is

    @property
    def _window(self):
        return bpy.context.window_manager.windows[0]

    def area(self, ui_type="VIEW_3D"):
        """The largest area of a type such as VIEW_3D, UV or IMAGE_EDITOR."""
        found = [area for area in self._window.screen.areas if area.ui_type == ui_type]
        assert found, f"there is no {ui_type} on the screen"
        return max(found, key=lambda area: area.width * area.height)

    def region(self, kind="WINDOW", ui_type="VIEW_3D"):
        return next(region for region in self.area(ui_type).regions if region.type == kind)

    def context(self, ui_type="VIEW_3D"):
        """A context manager in which operators act on this area, as if the pointer were in it."""
        return bpy.context.temp_override(
            window=self._window, area=self.area(ui_type), region=self.region("WINDOW", ui_type)
        )

    def modal_operators(self):
        """Identifiers of the operators that are running in the window."""
        return [operator.bl_idname for operator in self._window.modal_operators]

    # ---- mouse and keys

    def turns(self, count=TURNS_OF_AN_EVENT):
        for _ in range(count):
            yield None

    def _event(self, kind, value, **held):
        x, y = self.pointer
        self._window.event_simulate(type=kind, value=value, x=int(x), y=int(y), **held)

    def move(self, x, y):
        self.pointer = (x, y)
        self._event("MOUSEMOVE", "NOTHING")
        yield from self.turns(1)

    def rest(self, ui_type="VIEW_3D"):
        """Moves the pointer to the middle of an area."""
        region = self.region("WINDOW", ui_type)
        yield from self.move(region.x + region.width // 3, region.y + region.height // 3)

    def click(self, x, y):
        yield from self.move(x, y)
        yield from self.key("LEFTMOUSE")
        yield from self.turns()

    def key(self, kind, **held):
        """Presses and releases a key or mouse button; `held` are ctrl, shift, alt."""
        self._event(kind, "PRESS", **held)
        self._event(kind, "RELEASE", **held)
        yield from self.turns(1)

    def scroll_to_end(self, region):
        """Scrolls a sidebar down as far as it goes."""
        yield from self.move(region.x + region.width // 2, region.y + region.height // 2)
        for _ in range(40):
            self._event("WHEELDOWNMOUSE", "PRESS")
        yield from self.turns(6)

    # ---- what is to be seen

    def pixels(self):
        """The screen, (height, width, 3) bytes, the first row at the top."""
        done = subprocess.run(
            ["import", "-window", "root", "-depth", "8", "ppm:-"], capture_output=True, check=True, timeout=60
        )
        kind, size, most, data = done.stdout.split(b"\n", 3)
        assert (kind, most) == (b"P6", b"255")
        width, height = map(int, size.split())
        return np.frombuffer(data, np.uint8).reshape(height, width, 3)

    def screenshot(self, name):
        self._pictures.mkdir(parents=True, exist_ok=True)
        path = self._pictures / f"{self._prefix}_{name}.png"
        subprocess.run(["import", "-window", "root", str(path)], check=True, timeout=60)

    def picture_of(self, region):
        """The pixels of a region."""
        pixels = self.pixels()
        top = pixels.shape[0] - region.y - region.height
        return pixels[top : top + region.height, region.x : region.x + region.width]

    # ---- buttons

    def copied(self):
        """What Ctrl C copies of the button under the pointer: the command of an operator, the value of a setting."""
        bpy.context.window_manager.clipboard = ""
        yield from self.key("C", ctrl=True)
        return bpy.context.window_manager.clipboard

    def find(self, region, wanted, along=0.6):
        """Points at the first button from the top, at a share of the region's width, that `wanted` accepts.

        It is asked about what Ctrl C copies. Returns where that button is; fails where there is none.
        """
        x = region.x + int(along * region.width)
        rows, seen = [], []
        for y in range(region.y + region.height - SWEEP_PIXELS, region.y, -SWEEP_PIXELS):
            yield from self.move(x, y)
            text = yield from self.copied()
            seen.append(text)
            if wanted(text):
                rows.append(y)
            elif rows:
                break
        assert rows, f"no such button in {region.type}, only {sorted(set(seen))}"
        y = sum(rows) // len(rows)
        yield from self.move(x, y)
        return x, y

    def press(self, region, command, along=0.6):
        """Clicks the button that runs a command such as `uv.ble_unwrap(`; returns where it is."""
        x, y = yield from self.find(region, lambda text: text.startswith(f"bpy.ops.{command}"), along)
        yield from self.click(x, y)
        return x, y

    def paste(self, text):
        """Gives the setting under the pointer a value, by Ctrl V."""
        bpy.context.window_manager.clipboard = text
        yield from self.key("V", ctrl=True)
        yield from self.turns()

    def adjust(self):
        """Unfolds Adjust Last Operation in the corner of the 3D view; returns its region."""
        yield from self.turns(10)
        hud = self.region("HUD")
        folded = hud.height
        yield from self.click(hud.x + hud.width // 2, hud.y + hud.height - 12)
        yield Wait(lambda: self.region("HUD").height > folded, "the settings of the last operation unfold")
        yield from self.turns()
        return self.region("HUD")

    def menu(self, name, ui_type="VIEW_3D"):
        """The commands of a menu's entries from its top, opened at the pointer and walked through by the arrow key."""
        yield from self.rest(ui_type)
        with self.context(ui_type):
            bpy.ops.wm.call_menu("INVOKE_DEFAULT", name=name)
        yield from self.turns(4)
        self.screenshot(f"menu_{name}")
        found = []
        for _ in range(2 * LONGEST_MENU):
            yield from self.key("DOWN_ARROW")
            found.append((yield from self.copied()))
        yield from self.key("ESC")
        yield from self.turns()
        # The arrow goes round and round; an entry that stands there twice must not pass for the end of the round.
        return next(
            found[:length] for length in range(1, LONGEST_MENU + 1) if found[length:] == found[: len(found) - length]
        )

    def sidebar(self, ui_type="VIEW_3D"):
        """Opens the sidebar of an area at the add-on's tab; returns its region."""
        area = self.area(ui_type)
        area.spaces.active.show_region_ui = True
        # Before the sidebar is drawn it has no tabs, and Blender 4.3 crashes when told which of them to show.
        yield from self.turns(10)
        region = self.region("UI", ui_type)
        yield Wait(lambda: region.active_panel_category not in {"", "UNSUPPORTED"}, "the sidebar shows its tabs")
        region.active_panel_category = "BLE Unwrap"
        area.tag_redraw()
        yield from self.turns(4)
        return region
