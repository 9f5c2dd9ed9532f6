"""The report of a batch: valid JSON at any moment of the run, and enough to go on from after any end of it.

While the batch runs, the report is written anew whenever that costs little beside the work, and each finished asset is
added at once as a line of `<report>.journal`, which the last writing takes away. So a process that is killed leaves a
valid report, and report and journal together list all that was done.
"""

import json
import math
import os
import time
from pathlib import Path

# Writing the report anew may take this share of a run's time; it costs more the more assets there are.
SHARE_OF_TIME = 0.05


class ReportFile:
    """The report of one run. `head` is what it says of the run; `earlier` are assets of previous ones.

    Assets of previous runs that this one has not done anew stay in the report as `earlier`, so that nothing known is
    lost when this run is stopped, too.
    """

    def __init__(self, path, head, earlier):
        self.path = Path(path)
        self.head = head
        self._earlier = {pair: _text(asset) for pair, asset in earlier.items()}
        self._assets = []  # texts, each made once
        self._counts = {"assets": 0, "ok": 0, "violated": 0, "failed": 0}
        self._journal = None
        self._due = 0.0

    def start(self):
        """Writes the report of nothing done yet, and begins the journal. Raises `OSError`."""
        self._write("running", {})
        self._journal = journal_of(self.path).open("w", encoding="utf-8")  # what was in it is in `earlier`

    def add(self, asset):
        """Adds a finished asset. Raises `OSError` where that could not be written; a later writing holds it, too."""
        text = _text(asset)
        self._assets.append(text)
        self._earlier.pop(pair_of(asset), None)
        self._counts["assets"] += 1
        self._counts[asset["status"]] += 1
        self._journal.write(text + "\n")
        self._journal.flush()
        if time.monotonic() >= self._due:
            self._write("running", {})

    def finish(self, state, **more):
        """Writes the report for good: "complete" or "interrupted". Raises `OSError`."""
        self._write(state, more)
        if self._journal:
            self._journal.close()
            journal_of(self.path).unlink(missing_ok=True)

    def _write(self, state, more):
        started = time.monotonic()
        _replace(self.path, self._parts({**self.head, "state": state, **more, "summary": self._counts}))
        ended = time.monotonic()
        self._due = ended + (ended - started) / SHARE_OF_TIME

    def _parts(self, head):
        yield "{\n"
        for name, value in head.items():
            yield f"{_text(name)}: {_text(value)},\n"
        for name, texts in (("earlier", self._earlier.values()), ("assets", self._assets)):
            yield f'"{name}": ['
            for number, text in enumerate(texts):
                yield ("," if number else "") + "\n" + text
            yield "\n],\n" if name == "earlier" else "\n]\n"
        yield "}\n"


def pair_of(asset):
    """What an asset is known by from run to run: the names of its input and output."""
    return asset["in"], asset["out"]


def journal_of(path):
    return Path(f"{path}.journal")


def earlier_assets(path):
    """Assets of the runs that wrote a report and its journal, by input and output; of several entries the last one."""
    found = {}
    try:
        report = json.loads(Path(path).read_text(encoding="utf-8"))
        entries = [*report.get("earlier", ()), *report["assets"]]
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        entries = []
    try:
        lines = journal_of(path).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    for line in lines:
        try:
            entries.append(json.loads(line))
        except ValueError:  # the line that was being written when the process was killed
            continue
    for entry in entries:
        if isinstance(entry, dict) and isinstance(entry.get("in"), str) and isinstance(entry.get("out"), str):
            found[pair_of(entry)] = entry
    return found


def write_json(path, value):
    """Writes JSON under a temporary name, then renames: a reader never sees half a file."""
    _replace(path, [json.dumps(_plain(value), indent=1, allow_nan=False) + "\n"])


def _replace(path, parts):
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    work = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with work.open("w", encoding="utf-8") as stream:
            stream.writelines(parts)
        work.replace(path)
    finally:
        work.unlink(missing_ok=True)


def _text(value):
    """JSON on one line, so that a report lists an asset a line, as its journal does."""
    return json.dumps(_plain(value), allow_nan=False)


def _plain(value):
    """A value as JSON can hold it: NumPy's scalars and arrays as numbers, what is not finite as null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
