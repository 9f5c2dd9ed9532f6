"""Threads and jobs of the native module: progress, cancelling, the lock released, the same bytes on any thread."""

import gc
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import ble_unwrap_native as native
import numpy as np
import pytest
from native_calls import arrays, submit, unwrap
from numpy.testing import assert_array_equal

HERE = Path(__file__).parent


def test_other_python_threads_run_meanwhile(large_ball):
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.wait(0.002):
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.perf_counter()
    unwrap(*large_ball)
    seconds = time.perf_counter() - start
    stop.set()
    thread.join()
    within = [t for t in ticks if start < t < start + seconds]
    # One tick every 2 ms if the interpreter is free; a loaded machine gets a tenth of that.
    assert len(within) > 50 * seconds, f"{len(within)} ticks in {seconds:.2f} s"
    assert max(np.diff([start, *within, start + seconds])) < 0.5 * seconds + 0.2


def test_a_job_reports_progress_that_only_rises(large_ball):
    job = submit(*large_ball)
    seen, stages = [job.progress()], set()
    while not job.wait(0.005):
        seen.append(job.progress())
        stages.add(job.stage())
    assert seen == sorted(seen) and seen[0] >= 0 and seen[-1] <= 1
    assert len(set(seen)) > 3, f"progress stood still: {set(seen)}"
    assert len(stages) > 1 and all(stages)
    assert job.progress() == 1 and job.stage() == "done"
    assert job.is_finished() and not job.is_cancelled()
    assert job.result() is job.result()
    assert isinstance(job.result(), native.Atlas)
    assert "finished" in repr(job)


def test_submit_gives_what_unwrap_gives(ball):
    expected = arrays(unwrap(*ball))
    assert_array_equal(arrays(submit(*ball).result())[0], expected[0])


def test_cancel_before(large_ball):
    job = native.Job()
    job.cancel()
    assert job.is_cancelled() and not job.is_finished()
    start = time.perf_counter()
    with pytest.raises(native.Cancelled, match="cancelled"):
        unwrap(*large_ball, job=job)
    assert time.perf_counter() - start < 1
    assert job.is_finished()


def test_cancel_comes_before_the_mesh_but_after_the_arguments(square):
    positions, _corners, offsets = square

    def cancelled():
        job = native.Job()
        job.cancel()
        return job

    wrong = np.array([0, 1, 2, 99], np.int32)
    with pytest.raises(native.Cancelled):
        native.unwrap(positions, wrong, offsets, job=cancelled())
    with pytest.raises(native.InvalidArgumentError, match="positions"):
        native.unwrap(positions[:, :2], wrong, offsets, job=cancelled())
    with pytest.raises(native.InvalidArgumentError, match="seed"):
        native.unwrap(positions, wrong, offsets, job=cancelled(), seed=-1)


def test_cancel_during(large_ball):
    job = submit(*large_ball)
    while job.progress() < 0.03 and not job.is_finished():
        time.sleep(0.001)
    asked = time.perf_counter()
    job.cancel()
    assert job.wait(10), "still running ten seconds after cancel"
    latency = time.perf_counter() - asked
    with pytest.raises(native.Cancelled, match="cancelled"):
        job.result()
    # The promise is a tenth of a second on a free machine.
    assert latency < 1, f"took {latency:.2f} s to stop"
    assert "failed" in repr(job)


def test_cancel_from_another_thread(large_ball):
    job = native.Job()
    threading.Timer(0.05, job.cancel).start()
    with pytest.raises(native.Cancelled):
        unwrap(*large_ball, job=job)


def test_cancel_after(square):
    job = submit(*square)
    atlas = job.result()
    job.cancel()
    assert job.is_cancelled() and job.is_finished() and job.progress() == 1
    assert job.result() is atlas


def test_a_job_serves_one_call(square):
    job = native.Job()
    atlas = unwrap(*square, job=job)
    assert job.result() is atlas
    with pytest.raises(native.InvalidArgumentError, match="job: expected a new Job, found one that has served a call"):
        unwrap(*square, job=job)
    assert submit(*square, job=(given := native.Job())) is given


def test_a_job_without_a_call():
    job = native.Job()
    assert (job.progress(), job.stage(), job.is_finished(), job.is_cancelled()) == (0, "waiting", False, False)
    assert job.wait() is False
    with pytest.raises(native.InvalidArgumentError, match="never given to a call"):
        job.result()
    with pytest.raises(native.InvalidArgumentError, match="timeout: expected seconds"):
        job.wait(-1)
    with pytest.raises(native.InvalidArgumentError, match="timeout: expected seconds"):
        job.wait(float("nan"))


def test_wait_with_a_timeout_returns_in_time(large_ball):
    job = submit(*large_ball)
    start = time.perf_counter()
    assert job.wait(0) is job.is_finished() or job.is_finished()
    job.wait(0.05)
    assert time.perf_counter() - start < 1
    assert job.wait(float("inf")) is True


def test_many_threads_ask_for_one_result(hill):
    job = submit(*hill)
    found = []
    threads = [threading.Thread(target=lambda: found.append(job.result())) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8 and all(atlas is found[0] for atlas in found)


def test_a_dropped_job_stops(large_ball):
    """Nobody waits for it; the interpreter must be able to end while it winds down."""
    for _ in range(3):
        submit(*large_ball)
    gc.collect()


def run_python(code, **environment):
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(HERE), **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_the_interpreter_may_end_while_a_job_runs():
    code = "import conftest, ble_unwrap_native as n; job = n.submit_unwrap(*conftest.sphere(128, 128)); print('end')"
    done = run_python(code)
    assert (done.returncode, done.stdout) == (0, "end\n"), done.stderr


def test_ctrl_c_interrupts():
    code = """
import _thread, signal, threading, time, conftest, ble_unwrap_native as n
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run in the background of a shell
job = n.Job()
mesh = conftest.sphere(768, 768)

def interrupt():
    while job.progress() == 0:
        time.sleep(0.001)
    _thread.interrupt_main()

threading.Thread(target=interrupt).start()
try:
    n.unwrap(*mesh, job=job)
except KeyboardInterrupt:
    print("interrupted", job.is_cancelled(), job.is_finished())
"""
    done = run_python(code)
    assert done.stdout == "interrupted True True\n", done.stderr


HASH = """
import hashlib, conftest, numpy as np, ble_unwrap_native as n
digest = hashlib.sha256()
bump = lambda x, y: 0.4 * np.sin(7 * x) * np.cos(5 * y)
for mesh, settings in [
    (conftest.sphere(64, 48), {}),
    (conftest.grid(40, 40, bump), {}),
    (conftest.grid(12, 12, bump), {"preset": "paper", "seed": 5}),
]:
    atlas = n.unwrap(*mesh, texture_size=256, **settings)
    digest.update(bytes(atlas.uv))
    digest.update(bytes(atlas.chart))
print(digest.hexdigest())
"""


def test_the_same_bytes_for_any_number_of_threads():
    found = {}
    for threads in ("1", "2", "8"):
        done = run_python(HASH, RAYON_NUM_THREADS=threads)
        assert done.returncode == 0, done.stderr
        found[threads] = done.stdout
    assert len(set(found.values())) == 1 and len(found["1"]) == 65, found


def test_the_same_bytes_for_any_threads_setting(ball):
    results = [arrays(unwrap(*ball, threads=threads)) for threads in (0, 1, 2, 8)]
    for uv, chart in results[1:]:
        assert_array_equal(uv, results[0][0])
        assert_array_equal(chart, results[0][1])
