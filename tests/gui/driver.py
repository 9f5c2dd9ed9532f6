"""Runs one test after the other in the window that Blender shows, without ever blocking it.

A test is a generator function that takes a `window.Window`. It acts by events and waits by `yield`: for a condition
that is to become true, or for the next turn where it yields nothing. A condition that does not come true in time fails
the test at the line that waits for it.
"""

import inspect
import json
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

import bpy

TURN_SECONDS = 0.02  # between two turns: Blender handles events and draws meanwhile
LIMIT_SECONDS = 30.0  # for a condition to become true: software OpenGL on a busy machine is slow


class Late(AssertionError):
    """A condition did not become true in time."""


@dataclass(frozen=True)
class Wait:
    """A condition, what it is called in a message, and how long it may take."""

    condition: object
    what: str
    seconds: float = LIMIT_SECONDS


class Driver:
    """Runs tests from a timer and writes what became of each to a file, so that a crash leaves the others' results."""

    def __init__(self, tests, window, results, *, prepare, finish):
        """`prepare()` runs as a part of each test, before it; `finish()` is called after the last one."""
        self._tests = list(tests)
        self._prepare = prepare
        self._window = window
        self._path = Path(results)
        self._finish = finish
        self._results = []
        self._running = None
        self._wait = None

    def start(self):
        # Persistent, because tests load files.
        bpy.app.timers.register(self._turn, first_interval=1.0, persistent=True)

    def _turn(self):
        try:
            if self._running is None and not self._begin():
                self._finish()
                return None
            self._step()
        except Exception:  # of this driver itself: end, or the window would stay open for ever
            traceback.print_exc()
            self._finish()
            return None
        return TURN_SECONDS

    def _begin(self):
        if not self._tests:
            return False
        test = self._tests.pop(0)
        self._results.append({"name": test.__name__, "outcome": "broken off", "text": "", "seconds": 0.0})
        self._write()
        self._begun = time.monotonic()
        self._wait = None
        self._running = self._with_preparation(test)
        return True

    def _with_preparation(self, test):
        yield from self._prepare()
        running = test(self._window)
        if not inspect.isgenerator(running):
            raise TypeError(f"{test.__name__} is no generator function: it would not wait for the window")
        yield from running

    def _step(self):
        try:
            if self._wait is not None:
                if not self._wait.condition():
                    if time.monotonic() < self._until:
                        return
                    wait, self._wait = self._wait, None
                    self._take(self._running.throw(Late(f"not within {wait.seconds:g} s: {wait.what}")))
                    return
                self._wait = None
            self._take(next(self._running))
        except StopIteration:
            self._end("passed", "")
        except Exception as error:
            self._end("failed", "".join(traceback.format_exception(error)))

    def _take(self, wait):
        self._wait = wait
        if wait is not None:
            self._until = time.monotonic() + wait.seconds

    def _end(self, outcome, text):
        result = self._results[-1]
        if outcome != "passed":
            self._window.screenshot(f"failed_{result['name']}")
        result |= {"outcome": outcome, "text": text, "seconds": time.monotonic() - self._begun}
        self._running = None
        self._write()

    def _write(self):
        partial = self._path.with_suffix(".partial")
        partial.write_text(json.dumps(self._results), encoding="utf-8")
        partial.replace(self._path)
