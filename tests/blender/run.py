"""Tests the add-on where it lives: installs the built zip into a throw-away profile of every Blender that can be had.

python tests/blender/run.py [--bpy 4.2 5.0 5.2] [--blender PATH] [--zip FILE] [pytest arguments]

By default: bpy 4.2, 5.0 and 5.2, and $BLENDER if it is set. What this machine cannot provide is named and skipped; at
least one must run. Every Blender gets a process and a profile of its own. The last line sums up, as pytest's does.
"""

import argparse
import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPO = HERE.parent.parent
sys.path.insert(0, str(REPO / "blender_scripts"))

import launch  # noqa: E402

DEFAULT_VERSIONS = ("4.2", "5.0", "5.2")


def pytest_library(blenders):
    """A directory with pytest for Pythons that have none, such as a real Blender's."""
    target = launch.CACHE / "pytest-library"
    if not (target / "pytest").is_dir():
        pip = [sys.executable, "-m", "pip"]
        for blender in blenders:
            if isinstance(blender, launch.BpyModule):
                pip = [str(blender.python), "-m", "pip"]
        done = subprocess.run([*pip, "install", "--quiet", "--target", target, "pytest"], check=False)
        if done.returncode:
            raise launch.Unavailable("pytest could not be installed")
    return target


def run_tests(blender, archive, library, extra):
    """Runs the tests in one Blender; counts by outcome, or None where pytest did not get to its end."""
    with launch.Profile(blender) as profile:
        profile.install(archive)
        launch.library(blender, "pillow")  # where pictures.py looks for it
        results = profile.home / "junit.xml"
        profile.run(
            HERE / "inside.py",
            f"--junitxml={results}",
            *extra,
            environment={
                "BLE_PYTEST_LIBRARY": str(library),
                "BLE_ARCHIVE": str(archive),
                "BLE_TEST_DIR": str(profile.home),
            },
        )
        if not results.is_file():
            return None
        suite = ElementTree.parse(results).getroot().find("testsuite")
        count = {name: int(suite.get(name, 0)) for name in ("tests", "failures", "errors", "skipped")}
        count["passed"] = count["tests"] - count["failures"] - count["errors"] - count["skipped"]
        return count


def main():
    parser = argparse.ArgumentParser(prog="tests/blender/run.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("--bpy", nargs="*", metavar="VERSION", help=f"versions of bpy (default: {DEFAULT_VERSIONS})")
    parser.add_argument("--blender", action="append", default=[], metavar="PATH", help="a real Blender; then no bpy")
    parser.add_argument("--zip", help="the extension (default: the one that `make zip` built)")
    options, extra = parser.parse_known_args()
    started = time.perf_counter()
    programs = options.blender or ([os.environ["BLENDER"]] if os.environ.get("BLENDER") else [])
    versions = options.bpy if options.bpy is not None else ([] if options.blender else DEFAULT_VERSIONS)
    blenders, skipped = [], []
    for kind, which in [(launch.BpyModule, v) for v in versions] + [(launch.BlenderProgram, p) for p in programs]:
        try:
            blenders.append(kind(which))
        except launch.Unavailable as error:
            skipped.append(f"{which}: {error}")
    total = dict.fromkeys(("passed", "failures", "errors", "skipped"), 0)
    broken = []
    try:
        archive = launch.find_archive(options.zip)
        library = pytest_library(blenders)
        for blender in blenders:
            launch.say(f"\n==== {blender.name}: {archive.name} ====")
            try:
                count = run_tests(blender, archive, library, extra)
            except launch.Unavailable as error:
                launch.say(str(error))
                count = None
            if count is None:
                broken.append(blender.name)
                continue
            for name in total:
                total[name] += count[name]
    except launch.Unavailable as error:
        launch.say(str(error))
        broken.append("set-up")
    for reason in skipped:
        launch.say(f"SKIPPED {reason}")
    if not blenders:
        launch.say("No Blender could be had: nothing was tested")
        broken.append("everything")
    words = {"failures": "failed", "passed": "passed", "skipped": "skipped", "errors": "errors"}
    parts = [f"{total[name]} {word}" for name, word in words.items() if total[name] or name == "passed"]
    parts += [f"broken off: {', '.join(broken)}"] if broken else []
    names = ", ".join(blender.name for blender in blenders) or "no Blender"
    launch.say(f"\n==== {', '.join(parts)} in {time.perf_counter() - started:.1f}s ({names}) ====")
    return 1 if broken or total["failures"] or total["errors"] or not total["passed"] else 0


if __name__ == "__main__":
    sys.exit(main())
