"""All that one press of the button does: the surfaces together, then every cloud by itself, written all or none."""

from . import cloud_bridge, engine, modifiers, properties, targets, uv_maps
from .cloud_task import CloudTask
from .mesh_arrays import MeshError, NothingToUnwrap
from .task import UnwrapTask, finished

# Parts below this many faces or points are computed while they are asked for: not worth a thread and a wait each.
SMALL_PART = 500
# So many faces and points are computed at most each time that a job is asked whether it is finished.
SMALL_PARTS_AT_ONCE = 2000


class Run:
    """Reads all objects when made, then computes (`run` or `start`), then writes (`write`).

    Surfaces share one atlas (`one_atlas=False`: have one each); a cloud has a texture to itself. With `keep`, the
    analysis of the one atlas is kept for the next run. `by_uv` as in `faces.chosen_faces`. What cannot be written, or
    has neither faces nor enough points, is left out as long as anything else is there, with a note unless it is empty.
    Raises what the tasks raise; whenever it does, nothing was changed.
    """

    def __init__(self, objects, settings, *, threads=0, one_atlas=True, keep=False, by_uv=False):
        settings = {"preset": "DEFAULT", "use_selection": False, **settings}
        for obj in objects:
            if obj.type == "MESH" and obj.mode == "EDIT":
                obj.update_from_editmode()  # faces may have been made or deleted since edit mode was entered
        self.tasks, self.notes = [], []
        reasons = []
        defaults = properties.default_values(settings["preset"])
        objects, refused = _writable(objects, uv_maps.chosen({**defaults, **settings}))
        surfaces = [obj for obj in objects if targets.is_surface(obj)]
        for group in [surfaces] if one_atlas and surfaces else [[obj] for obj in surfaces]:
            try:
                self.tasks.append(UnwrapTask(group, settings, threads=threads, keep=keep and one_atlas, by_uv=by_uv))
            except NothingToUnwrap as error:
                reasons.append(str(error))
        for obj in filter(targets.is_cloud, objects):
            cloud = cloud_bridge.read_cloud(obj, only_selected=settings["use_selection"])
            if cloud is None:
                reasons.append("No points are selected")
            elif short := cloud_bridge.too_few(cloud):
                self.notes.append(short)
            else:
                self.tasks.append(CloudTask(cloud, settings, threads=threads))
                if modifiers.makes_faces(obj):
                    self.notes.append(modifiers.bare_text(obj.name))
        if not self.tasks:
            raise MeshError(next(iter([*refused, *self.notes, *reasons]), None) or _why_nothing(objects))
        self.notes += [f"{text}; it was left out" for text in refused]

    @property
    def element_count(self):
        """Faces and points in all."""
        return sum(task.element_count for task in self.tasks)

    def run(self):
        """Computes all results at once."""
        results = []
        for task in self.tasks:
            results.append(_named(task, task.run))
            task.timer.pause()
        return results

    def start(self):
        """Computes the results on another thread, one part after the other: a `RunJob`.

        What is wrong from the start is raised here, the rest by the job's `result`.
        """
        job = RunJob(self.tasks)
        job.raise_error()
        return job

    def write(self, results, *, measure_again=True):
        """Writes all results, or none where one cannot be; returns an `Outcome` for each."""
        for task in self.tasks:
            task.check()
        outcomes = [
            task.write(result, measure_again=measure_again) for task, result in zip(self.tasks, results, strict=True)
        ]
        outcomes[-1].certificate.warnings.extend(self.notes)
        outcomes[-1].lines.extend(["WARN", text] for text in self.notes)
        return outcomes

    def maps(self, outcomes):
        """Every object that was written with the name of its map, after `write`."""
        pairs = zip(self.tasks, outcomes, strict=True)
        return [pair for task, outcome in pairs for pair in zip(task.written, outcome.maps, strict=True)]

    def narrow_faces(self, outcomes):
        """Every object with faces of charts narrower than two texels, and the numbers of these, after `write`."""
        pairs = zip(self.tasks, outcomes, strict=True)
        return [
            (obj, faces)
            for task, outcome in pairs
            for obj, faces in zip(task.written, outcome.narrow_faces, strict=False)
            if len(faces)
        ]


class RunJob:
    """The parts of a `Run` one after the other, asked like a `computation.Job`: asking is what starts the next one."""

    def __init__(self, tasks):
        self._waiting = list(reversed(tasks))
        self._total = max(sum(task.element_count for task in tasks), 1)
        self._count = len(tasks)
        self._done = 0  # faces and points
        self._results = []
        self._task = self._job = self._error = None
        self._cancelled = False
        self._advance()

    def _advance(self):
        """Collects what is finished and starts what is next."""
        small = 0
        while self._error is None and not self._cancelled:
            try:
                if self._job is not None:
                    if not self._job.is_finished():
                        return
                    self._keep(_named(self._task, self._job.result))
                if not self._waiting or small > SMALL_PARTS_AT_ONCE:
                    return
                self._task = self._waiting.pop()
                if self._count > 1 and self._task.element_count < SMALL_PART:
                    small += self._task.element_count
                    self._keep(_named(self._task, self._task.run))
                else:
                    self._job = _named(self._task, self._task.start)
            except Exception as error:  # it belongs to whoever asks for the result
                self._error = error

    def _keep(self, result):
        self._task.timer.pause()
        self._results.append(result)
        self._done += self._task.element_count
        self._job = None

    def progress(self):
        """Share of the work done, 0 to 1, by number of faces and points."""
        running = self._job.progress() * self._task.element_count if self._job is not None else 0.0
        return (self._done + running) / self._total

    def stage(self):
        """What is being done, in a word or two; and on what, where there are several."""
        stage = self._job.stage() if self._job is not None else ""
        return f"{self._task.title}: {stage}" if self._count > 1 else stage

    def is_finished(self):
        self._advance()
        if self._cancelled:
            return self._job is None or self._job.is_finished()
        return self._error is not None or len(self._results) == self._count

    def cancel(self):
        self._cancelled = True
        if self._job is not None:
            self._job.cancel()

    def result(self):
        """The results of a finished job. Raises `engine.EngineError`, `engine.EngineCancelled`."""
        if self._cancelled:
            raise engine.EngineCancelled("cancelled")
        self.raise_error()
        return self._results

    def raise_error(self):
        """Raises what went wrong so far, if anything did."""
        if self._error is not None:
            raise self._error


def _writable(objects, choice):
    """The objects whose maps can be written, and why the others' cannot."""
    writable, refused = [], []
    for obj in objects:
        try:
            if targets.is_surface(obj):
                uv_maps.check_writable(obj, choice)
            elif targets.is_cloud(obj):
                cloud_bridge.check_writable(obj)
            writable.append(obj)
        except MeshError as error:
            refused.append(str(error))
    return writable, refused


def _named(task, call):
    """Calls, and puts the cloud's name before the native module's error: which of several would not be clear."""
    try:
        return call()
    except engine.EngineError as error:
        if isinstance(task, CloudTask):
            raise engine.EngineError(f"{task.title}: {error}") from error
        raise


def _why_nothing(objects):
    wire = next((obj for obj in objects if obj.type == "MESH" and obj.data.edges and not obj.data.polygons), None)
    if wire is not None:
        return f"{wire.name}: has edges but no faces; without the edges its vertices can be mapped as a cloud"
    return "There are no faces or points to unwrap"


def run_objects(objects, settings, *, threads=0, one_atlas=True, progress=None):
    """Unwraps objects of any kind and writes them; returns the `Run` and the `Outcome`s of its tasks.

    `settings` as in the panel, missing ones at their defaults; `progress(fraction, stage)` is called while it runs.
    """
    run = Run(targets.unique_data(objects), settings, threads=threads, one_atlas=one_atlas)
    return run, run.write(finished(run.start(), progress))
