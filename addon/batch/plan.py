"""Where the results of a batch go: no input is overwritten, no two results meet, nothing foreign is replaced."""

import itertools
import os
from dataclasses import dataclass, field
from pathlib import Path

from .. import asset_io


class PlanError(Exception):
    """The command line asks for what would lose a file; the text is for the user."""


@dataclass
class Planned:
    """One input, the file its result is written to, and why it must not be, if so."""

    source: Path
    target: Path
    problem: str | None = None
    notes: list[str] = field(default_factory=list)


def plan_outputs(inputs, output, *, kind=None, overwrite=False, written_before=frozenset()):
    """A `Planned` for each input, in their order, and notes about all of them. Raises `PlanError`.

    `output` is a directory, or a file for a single input; `kind` the format of all results (default: the input's own).
    Results lie flat in the directory, each under its input's name. Where inputs of several folders would meet there,
    all results lie in the inputs' folders below the one they have in common; where inputs of one folder would meet
    (`model.stl` and `model.glb`, both written as .glb), one of them gets a longer name, and a note.

    A file that exists is replaced if it was named itself, has the input's own name, or is in `written_before`, pairs of
    input and output of earlier runs; anything else only with `overwrite`.
    """
    output, notes, places = Path(output), [], _Places()
    sources = _without_repeats([Path(name) for name in inputs], places, notes)
    as_file = _is_file_name(output, sources, kind)
    plan = [Planned(sources[0], output)] if as_file else _planned_in_directory(sources, output, kind, notes)
    for planned in plan:
        if places.of(planned.target) == places.of(planned.source):
            raise PlanError(f"{planned.source} would be overwritten by its own result: give another -o")
    # Results under their input's own name come first, so that these keep it.
    for planned in sorted(plan, key=lambda planned: planned.target.name != planned.source.name):
        _take_free_name(planned, places, as_file)
        for file in files_of(planned.target):
            places.take(file, planned.source)
        known = (str(planned.source), str(planned.target)) in written_before
        if not (as_file or overwrite or known or planned.target.name == planned.source.name):
            planned.problem = _why_not_replaced(planned)
    return plan, notes


def files_of(target):
    """The files that a result consists of: itself, and the materials beside an .obj."""
    return [target, target.with_suffix(".mtl")] if asset_io.file_format(target) == "obj" else [target]


def is_among(path, plan):
    """Whether a path is an input or an output of a plan."""
    places = _Places()
    files = (file for planned in plan for file in (planned.source, *files_of(planned.target)))
    return places.of(Path(path)) in set(map(places.of, files))


class _Places:
    """Where paths lead to, and which of these places are inputs or results: the input that each belongs to.

    Never fails, not for a loop of links either.
    """

    def __init__(self):
        self._folders = {}  # each is looked up once
        self._holders = {}

    def of(self, path):
        """A text that is the same for all paths to a place."""
        if path.is_symlink() or path.name in ("", ".."):
            return os.path.normcase(os.path.realpath(path))
        if path.parent not in self._folders:
            self._folders[path.parent] = os.path.realpath(path.parent)
        return os.path.normcase(f"{self._folders[path.parent]}{os.sep}{path.name}")

    def take(self, path, source):
        self._holders[self.of(path)] = source

    def holder(self, target):
        """The input that has one of the files of a result, as itself or as its own result, or None."""
        return next((holder for file in files_of(target) if (holder := self._holders.get(self.of(file)))), None)

    def __len__(self):
        return len(self._holders)


def _without_repeats(sources, places, notes):
    """The inputs, taken, each place once."""
    found = {}
    for source in sources:
        first = found.setdefault(places.of(source), source)
        if first is not source:
            notes.append(f"{source} is the same file as {first}: unwrapped once")
    for source in found.values():
        places.take(source, source)
    return list(found.values())


def _is_file_name(output, sources, kind):
    """Whether the output is the name of a file, not of a directory."""
    as_file = asset_io.file_format(output) in asset_io.OUTPUT_FORMATS and not output.is_dir()
    if as_file and len(sources) > 1:
        raise PlanError("-o names a file, but there are several inputs: give a directory")
    if output.suffix and not as_file and not output.is_dir() and len(sources) == 1:
        known = ", ".join(asset_io.OUTPUT_FORMATS)
        raise PlanError(f"cannot write '{output.suffix}' files; known are {known} (a directory may have no such name)")
    if as_file and kind and kind != asset_io.file_format(output):
        raise PlanError(f"-o {output} and --format {kind} contradict each other")
    if not as_file and os.path.lexists(output) and not output.is_dir():
        raise PlanError(f"-o {output} is not a directory")
    return as_file


def _planned_in_directory(sources, output, kind, notes):
    names = [f"{source.stem}.{kind or asset_io.default_output_format(source)}" for source in sources]
    folders = [os.path.normpath(source.parent.absolute()) for source in sources]
    folder_of = {}
    for name, folder in zip(names, folders, strict=True):
        folder_of.setdefault(os.path.normcase(name), set()).add(folder)
    if all(len(several) == 1 for several in folder_of.values()):
        return [Planned(source, output / name) for source, name in zip(sources, names, strict=True)]
    try:
        common = os.path.commonpath(folders)
    except ValueError as error:  # drives of Windows
        raise PlanError("inputs of the same name lie on several drives: unwrap those of each by themselves") from error
    notes.append(f"inputs in several folders have the same name: their folders below {common} are repeated in {output}")
    return [
        Planned(source, output / os.path.relpath(folder, common) / name)
        for source, name, folder in zip(sources, names, folders, strict=True)
    ]


def _take_free_name(planned, places, as_file):
    """Gives the result a longer name where another input or result has its own."""
    wanted = planned.target
    holder = places.holder(wanted)
    if holder is None:
        return
    if as_file:
        raise PlanError(f"-o {wanted} would overwrite {holder}")
    # Each place that is taken stands in the way of one name only, so one of these is free.
    numbers = itertools.chain([""], (f".{number}" for number in range(2, len(places) + 3)))
    longer = (wanted.with_name(f"{planned.source.name}{number}{wanted.suffix}") for number in numbers)
    planned.target = next(target for target in longer if places.holder(target) is None)
    planned.notes.append(f"{wanted} is taken by {holder}: written to {planned.target}")


def _why_not_replaced(planned):
    there = next((file for file in files_of(planned.target) if os.path.lexists(file)), None)
    if there is None:
        return None
    if there.is_dir():
        return f"{there} cannot be written: there is a folder of that name; give another -o"
    return (
        f"{there} exists and is not known as a result of {planned.source.name}, so it is left as it is: give another "
        "-o, the --report of the run that wrote it, or --overwrite"
    )
