"""Signals that ask a batch to stop: it ends what cannot be broken off, writes its report, and says so.

A signal sets a flag, nothing else. Raising from the handler would end up in the middle of Blender's operators, which
take any exception of Python for a failure of their own and go on.
"""

import signal
import threading

# Ctrl-C, the request of schedulers and of the operating system, a terminal that was closed.
NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Stopped(KeyboardInterrupt):
    """A signal asked to stop; its name is the text."""


class StopRequest:
    """Watches for signals while it is entered. A second one is not held back: it ends the process at once."""

    def __init__(self):
        self.name = None
        self._before = {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            for name in NAMES:
                number = getattr(signal, name, None)
                # What was ignored (`nohup`, a job in the background) stays so; None is a handler that is not Python's.
                if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._note) or signal.SIG_DFL
        return self

    def __exit__(self, *_error):
        self._restore()

    def _note(self, number, _frame):
        self.name = signal.Signals(number).name
        self._restore()

    def _restore(self):
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def check(self):
        """Raises `Stopped` where a signal has come."""
        if self.name:
            raise Stopped(self.name)
