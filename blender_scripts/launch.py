"""Finds or makes a Blender to run scripts in: a real one, or PyPI's bpy in an environment of its own.

Standard library only, and run by any Python from 3.11 on; the scripts it starts are what runs in Blender.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

REPO = Path(__file__).resolve().parent.parent
SCRIPTS = REPO / "blender_scripts"
CACHE = REPO / ".cache"
OLDEST_BLENDER = (4, 2)
ENVIRONMENT = 3  # exit code where there is no Blender to be had
# Every bpy is built for one Python.
PYTHON_OF_BPY = {"4.2": "3.11", "4.5": "3.11", "5.0": "3.11", "5.1": "3.13", "5.2": "3.13"}


class Unavailable(Exception):
    """This machine cannot provide it; the text says why."""


def say(text):
    print(text, flush=True)


def find_python(version):
    """An interpreter of this version that runs and can make environments."""
    candidates = [sys.executable, shutil.which(f"python{version}"), shutil.which("python3"), shutil.which("python")]
    candidates += sorted(Path.home().glob(f".pyenv/versions/{version}*/bin/python"), reverse=True)
    if uv := shutil.which("uv"):
        found = subprocess.run([uv, "python", "find", version], capture_output=True, text=True, check=False)
        candidates.append(found.stdout.strip())
    probe = "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"
    for candidate in filter(None, map(str, candidates)):
        try:
            found = subprocess.run([candidate, "-c", probe], capture_output=True, text=True, check=False, timeout=60)
        except (OSError, subprocess.TimeoutExpired):
            continue
        if found.stdout.strip() == version:
            return candidate
    raise Unavailable(f"no Python {version} with venv was found")


class BpyModule:
    """PyPI's bpy of one version, in an environment under `.cache/`, made on first use (370 MB download)."""

    def __init__(self, version):
        self.name = f"bpy {version}"
        self.key = f"bpy-{version}"
        if version not in PYTHON_OF_BPY:
            raise Unavailable(f"bpy {version} is unknown; known are {', '.join(PYTHON_OF_BPY)}")
        python_version = PYTHON_OF_BPY[version]
        home = CACHE / self.key
        self.python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        ready = home / ".ready"
        if ready.exists() and self._works():
            return
        python = find_python(python_version)
        say(f"Installing {self.name} for Python {python_version} in {home.relative_to(REPO)} (about 370 MB, once)")
        install = [self.python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        try:
            subprocess.run([python, "-m", "venv", "--clear", home], check=True)
            subprocess.run([*install, f"bpy=={version}.*", "numpy", "pytest"], check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            raise Unavailable(f"{self.name} could not be installed: {error}") from error
        if not self._works():
            raise Unavailable(f"{self.name} does not start; a system library may be missing:\n{self._error}")
        ready.touch()

    def _works(self):
        done = subprocess.run(
            [self.python, "-c", "import bpy; print(bpy.app.version_string)"],
            capture_output=True,
            text=True,
            check=False,
        )
        self._error = done.stderr.strip()
        return done.returncode == 0

    def command(self, script, arguments):
        return [self.python, script, *arguments]


class BlenderProgram:
    """A real Blender, run without a window."""

    def __init__(self, path):
        self.path = shutil.which(path) or path
        try:
            found = subprocess.run([self.path, "--version"], capture_output=True, text=True, check=False)
        except OSError as error:
            raise Unavailable(f"{path} does not run: {error}") from error
        match = re.search(r"Blender (\d+)\.(\d+)\S*", found.stdout)
        if not match:
            raise Unavailable(f"{path} does not say which Blender it is")
        if (int(match[1]), int(match[2])) < OLDEST_BLENDER:
            raise Unavailable(f"{path} is {match[0]}, and 4.2 is the oldest with extensions")
        self.name = match[0]
        self.key = match[0].lower().replace(" ", "-")

    def command(self, script, arguments):
        options = ["--background", "--factory-startup", "--python-exit-code", "9"]
        return [self.path, *options, "--python", script, "--", *arguments]


def find_blender(versions=("5.0", "5.2", "4.2")):
    """$BLENDER, else a recent enough `blender` on PATH, else bpy."""
    if named := os.environ.get("BLENDER"):
        return BlenderProgram(named)
    reasons = []
    if on_path := shutil.which("blender"):
        try:
            return BlenderProgram(on_path)
        except Unavailable as error:
            reasons.append(str(error))
    for version in versions:
        try:
            return BpyModule(version)
        except Unavailable as error:
            reasons.append(str(error))
    raise Unavailable("; ".join(reasons))


class Profile:
    """A throw-away Blender profile, so that nothing of the user's own is read or changed."""

    def __init__(self, blender):
        self.blender = blender
        CACHE.mkdir(exist_ok=True)
        self.home = Path(tempfile.mkdtemp(prefix=f"profile-{blender.key}-", dir=CACHE))

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        shutil.rmtree(self.home, ignore_errors=True)

    def run(self, script, *arguments, **keywords):
        """Runs a script in Blender under this profile; the finished process."""
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(self.home), "PYTHONDONTWRITEBYTECODE": "1"}
        environment.pop("PYTHONPATH", None)  # what is tested is what was installed
        environment.update(keywords.pop("environment", {}))
        command = [str(part) for part in self.blender.command(script, [str(a) for a in arguments])]
        return subprocess.run(command, env=environment, check=False, **keywords)

    def install(self, archive):
        """Installs the extension as a user does with Install from Disk, and checks in a new process that it runs."""
        done = self.run(SCRIPTS / "install_extension.py", archive, capture_output=True, text=True)
        if done.returncode:
            raise Unavailable(f"{self.blender.name} did not install {archive}:\n{done.stdout}{done.stderr}")


def find_archive(given=None):
    """The extension's zip: the given one, else the newest that `make zip` built."""
    if given:
        path = Path(given).resolve()
        if not path.is_file():
            raise Unavailable(f"{given}: no such file")
        return path
    archives = sorted((REPO / "out").glob("ble_unwrap-*.zip"), key=lambda path: path.stat().st_mtime)
    if not archives:
        raise Unavailable("the extension was not built yet: run `make zip` first")
    return archives[-1]


def xatlas_library(blender):
    """A directory with xatlas for the Python of a Blender, made on first use; None where it cannot be: why is printed.

    It is kept apart from the Blender and its packages.
    """
    if not isinstance(blender, BpyModule):
        say("xatlas is left out of the comparison: it is installed for PyPI's bpy only")
        return None
    target = CACHE / f"xatlas-{blender.key}"
    if not any(target.glob("xatlas*")):
        requirements = (REPO / ".ci" / "requirements.txt").read_text(encoding="utf-8")
        wanted = re.search(r"(?m)^xatlas.*$", requirements)[0]
        install = [blender.python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
        done = subprocess.run([*install, "--only-binary", ":all:", "--target", target, wanted], check=False)
        if done.returncode:
            say("xatlas is left out of the comparison: it could not be installed")
            return None
    return target


def run_with_extension(script, arguments, archive=None, *, peers=False):
    """Runs one of the scripts in a throw-away Blender that the extension is installed in; its exit code.

    With `peers`, the script finds xatlas where it can be had. Where there is no Blender or no extension to be had,
    `ENVIRONMENT`; why is printed.
    """
    try:
        archive = find_archive(archive)
        say("Looking for a Blender")
        blender = find_blender()
        with Profile(blender) as profile:
            say(f"Installing {archive.name} into a throw-away profile of {blender.name}")
            profile.install(archive)
            library = xatlas_library(blender) if peers else None
            environment = {"BLE_XATLAS_LIBRARY": str(library)} if library else {}
            return profile.run(SCRIPTS / script, *arguments, environment=environment).returncode
    except Unavailable as error:
        print(f"{Path(sys.argv[0]).stem}: {error}", file=sys.stderr)
        return ENVIRONMENT
