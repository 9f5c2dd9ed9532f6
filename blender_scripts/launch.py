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
        self.python_version = PYTHON_OF_BPY[version]
        home = CACHE / self.key
        self.python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        self.pip = [self.python, "-m", "pip"]
        ready = home / ".ready"
        if ready.exists() and self._works():
            return
        python = find_python(self.python_version)
        say(f"Installing {self.name} for Python {self.python_version} in {home.relative_to(REPO)} (370 MB, once)")
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
        self.python_version = self._asked_python_version()
        self.pip = [sys.executable, "-m", "pip"]

    def _asked_python_version(self):
        ask = "import sys; print('its Python is %d.%d' % sys.version_info[:2])"
        command = [self.path, "--background", "--factory-startup", "--python-expr", ask]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
        match = re.search(r"its Python is (\d+\.\d+)", found.stdout)
        if not match:
            raise Unavailable(f"{self.path} does not run Python:\n{found.stderr.strip()}")
        return match[1]

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


def library_directory(name, python_version):
    """Where `library` puts a package for Pythons of a version, such as "3.11"."""
    return CACHE / f"{name}-python-{python_version}"


def library(blender, name):
    """A directory with a package for the Python of a Blender, installed on first use as .ci/requirements.txt asks.

    It is kept apart from the Blender and its packages, which stay as they are. Raises `Unavailable`.
    """
    target = library_directory(name, blender.python_version)
    if not any(target.glob(f"{name}-*.dist-info")):
        requirements = (REPO / ".ci" / "requirements.txt").read_text(encoding="utf-8")
        wanted = re.search(rf"(?m)^{name}\b.*$", requirements)[0]
        install = [*blender.pip, "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--target", target]
        # With a version, so that the pip of any Python installs for that of a real Blender.
        version = ["--only-binary", ":all:", "--python-version", blender.python_version]
        done = subprocess.run([*install, *version, wanted], check=False)
        if done.returncode:
            raise Unavailable(f"{name} could not be installed for {blender.name}")
    return target


def xatlas_library(blender):
    """A directory with xatlas for the Python of a Blender; None where there cannot be one: why is printed."""
    if not isinstance(blender, BpyModule):
        say("xatlas is left out of the comparison: it is installed for PyPI's bpy only")
        return None
    try:
        return library(blender, "xatlas")
    except Unavailable as error:
        say(f"xatlas is left out of the comparison: {error}")
        return None


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
            library(blender, "pillow")  # where pictures.py looks for it
            xatlas = xatlas_library(blender) if peers else None
            environment = {"BLE_XATLAS_LIBRARY": str(xatlas)} if xatlas else {}
            return profile.run(SCRIPTS / script, *arguments, environment=environment).returncode
    except Unavailable as error:
        print(f"{Path(sys.argv[0]).stem}: {error}", file=sys.stderr)
        return ENVIRONMENT
