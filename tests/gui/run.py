"""Tests the add-on in the windows of real Blenders, by mouse and keys, on a screen that exists in memory only.

python tests/gui/run.py [--suite trixie sid] [--zip FILE] [--minutes N] [--allow-none] [FILE or WORD ...]

A suite is a release of Debian, which .ci/real_blender installs into a directory of its own: trixie has Blender 4.3, sid
5.2. What cannot be had is named and skipped; if nothing is left the exit code is 3, or 0 with --allow-none.
$BLE_GUI_LIBRARY names a directory with the native package: then no extension is installed, but the add-on of this
checkout is linked into the profile, to try a change at once. Pictures are kept in out/gui.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPO = HERE.parent.parent
sys.path.insert(0, str(REPO / "blender_scripts"))

import launch  # noqa: E402

REAL_BLENDER = REPO / ".ci" / "real_blender"
SUITES = ("trixie", "sid")
CANNOT = 3  # exit code of real_blender where the machine cannot have one
FILE_SECONDS = 420  # for the tests of one file; the slowest takes a quarter of it on two cores
PICTURES = REPO / "out" / "gui"


class WindowedBlender(launch.BlenderProgram):
    """The Blender of a suite, which can also be run in a window."""

    def __init__(self, suite):
        self.suite = suite
        environment = {**os.environ, "BLE_SUITE": suite}
        done = subprocess.run([REAL_BLENDER, "wrapper"], env=environment, capture_output=True, text=True, check=False)
        if done.returncode:
            raise launch.Unavailable(done.stderr.strip() or f"real_blender ended with {done.returncode}")
        super().__init__(done.stdout.strip().splitlines()[-1])

    def run_in_window(self, script, arguments, environment, seconds):
        """Runs a script in a window until it ends Blender; False where that failed or took longer than `seconds`."""
        command = [
            REAL_BLENDER,
            "gui",
            "blender",
            "--enable-event-simulate",
            "--window-geometry",
            "0",
            "0",
            "1600",
            "900",
        ]
        if "PYTHONPATH" in environment:
            command.append("--python-use-system-env")
        command += ["--python-exit-code", "9", "--python", script, "--", *arguments]
        # A session of its own, so that the screen ends with Blender.
        running = subprocess.Popen(
            [str(part) for part in command],
            env={**environment, "BLE_SUITE": self.suite},
            cwd=REPO,
            start_new_session=True,
        )
        try:
            return running.wait(seconds) == 0
        except subprocess.TimeoutExpired:
            return False
        finally:
            if running.poll() is None:
                os.killpg(running.pid, signal.SIGTERM)
                running.wait(30)


def prepare(profile, archive, library):
    """Gives the profile the extension; returns the environment to run Blender in."""
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(profile.home), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("PYTHONPATH", None)
    if library is None:
        profile.install(archive)
        return environment
    extensions = profile.home / "extensions" / "user_default"
    extensions.mkdir(parents=True)
    (extensions / "ble_unwrap").symlink_to(REPO / "addon")
    return environment | {"PYTHONPATH": str(library)}


def run_file(blender, profile, environment, path, words, until):
    """Runs the tests of a file, at the longest until a time; returns their results."""
    results = profile.home / f"{path.stem}.json"
    launch.say(f"-- {path.name}")
    seconds = min(FILE_SECONDS, until - time.perf_counter())
    if seconds <= 0:
        launch.say("not begun: the time is up")
        return [{"outcome": "broken off"}]
    arguments = [path.stem, PICTURES, results, *words]
    ended = blender.run_in_window(HERE / "inside.py", arguments, environment, seconds)
    found = json.loads(results.read_text(encoding="utf-8")) if results.is_file() else []
    for result in found:
        launch.say(f"{result['outcome']:>10}  {result['name']}  {result['seconds']:.1f} s")
        if result["text"]:
            launch.say(result["text"])
    if not ended or (not found and not words):
        launch.say(f"{path.name}: Blender did not get to the end of its tests")
        found.append({"outcome": "broken off"})
    return found


def chosen_files(extra):
    """The files of tests and the words by which tests of them are chosen."""
    files = [Path(text) for text in extra if text.endswith(".py")]
    return files or sorted(HERE.glob("test_*.py")), [text for text in extra if not text.endswith(".py")]


def main():
    parser = argparse.ArgumentParser(prog="tests/gui/run.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("--suite", nargs="*", default=SUITES, choices=SUITES, help="releases of Debian (default: both)")
    parser.add_argument("--zip", help="the extension (default: the one that `make zip` built)")
    parser.add_argument("--minutes", type=float, default=60.0, help="for everything (default: 60)")
    parser.add_argument("--allow-none", action="store_true", help="success where there is no real Blender to be had")
    options, extra = parser.parse_known_args()
    started = time.perf_counter()
    until = started + 60 * options.minutes
    files, words = chosen_files(extra)
    library = os.environ.get("BLE_GUI_LIBRARY")
    total, names, skipped = {}, [], []
    for suite in options.suite:
        try:
            blender = WindowedBlender(suite)
            archive = None if library else launch.find_archive(options.zip)
        except launch.Unavailable as error:
            skipped.append(f"{suite}: {error}")
            continue
        names.append(blender.name)
        launch.say(f"\n==== {blender.name} ====")
        with launch.Profile(blender) as profile:
            try:
                environment = prepare(profile, archive, library)
            except launch.Unavailable as error:
                launch.say(str(error))
                total["broken off"] = total.get("broken off", 0) + 1
                continue
            for path in files:
                for result in run_file(blender, profile, environment, path, words, until):
                    total[result["outcome"]] = total.get(result["outcome"], 0) + 1
    for reason in skipped:
        launch.say(f"SKIPPED {reason}")
    if not names:
        launch.say("No real Blender could be had: nothing was tested in a window")
        return 0 if options.allow_none else CANNOT
    parts = ", ".join(f"{count} {outcome}" for outcome, count in sorted(total.items())) or "nothing ran"
    launch.say(f"\n==== {parts} in {time.perf_counter() - started:.1f}s ({', '.join(names)}) ====")
    return 0 if set(total) == {"passed"} else 1


if __name__ == "__main__":
    # So that the window ends with this program, whoever ends it.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    sys.exit(main())
