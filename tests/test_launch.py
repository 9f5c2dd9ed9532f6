"""How the scripts find a Blender and put packages beside it, with stand-ins for Blender and for pip."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "blender_scripts"))

import launch  # noqa: E402

BLENDER = """#!/bin/sh
if [ "$1" = --version ]; then echo "Blender {version}"; exit; fi
exec "{python}" -c "$4"
"""
PIP = """
import pathlib, sys
target = pathlib.Path(sys.argv[sys.argv.index("--target") + 1])
target.parent.mkdir(parents=True, exist_ok=True)
(target.parent / "asked").write_text("\\n".join(sys.argv[1:]))
if {installs}:
    (target / "pillow-99.dist-info").mkdir(parents=True)
sys.exit({code})
"""


def blender(folder, version="4.2.1", python=sys.executable):
    path = folder / "blender"
    path.write_text(BLENDER.format(version=version, python=python))
    path.chmod(0o755)
    return launch.BlenderProgram(str(path))


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(launch, "CACHE", tmp_path / "cache")
    return tmp_path / "cache"


def with_pip(program, folder, *, installs=True, code=0):
    path = folder / "pip.py"
    path.write_text(PIP.format(installs=installs, code=code))
    program.pip = [sys.executable, str(path)]
    return program


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is a shell script")
def test_a_real_blender_is_asked_for_its_python(tmp_path):
    assert blender(tmp_path).python_version == f"{sys.version_info[0]}.{sys.version_info[1]}"
    with pytest.raises(launch.Unavailable, match="oldest"):
        blender(tmp_path, version="4.1.0")
    with pytest.raises(launch.Unavailable, match="does not run Python"):
        blender(tmp_path, python="/bin/false")


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is a shell script")
def test_a_package_is_installed_once_as_the_requirements_ask(tmp_path, cache):
    program = with_pip(blender(tmp_path), tmp_path)
    target = launch.library(program, "pillow")
    assert target == launch.library_directory("pillow", program.python_version) and target.parent == cache
    asked = (cache / "asked").read_text().splitlines()
    assert asked[-1] in (ROOT / ".ci/requirements.txt").read_text().splitlines() and asked[-1].startswith("pillow")
    assert asked[asked.index("--python-version") + 1] == program.python_version
    assert launch.library(with_pip(program, tmp_path, installs=False, code=1), "pillow") == target, (
        "it is there already"
    )


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is a shell script")
def test_a_package_that_cannot_be_installed_is_named(tmp_path, cache):
    with pytest.raises(launch.Unavailable, match="pillow could not be installed for Blender"):
        launch.library(with_pip(blender(tmp_path), tmp_path, installs=False, code=1), "pillow")
