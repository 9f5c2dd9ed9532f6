"""What is built for which platform, and what an extension says of itself: the scripts in `.ci`, with made-up wheels.

No wheel is built here. That the real archives are valid is for Blender to say: `.ci/validate_extensions`.
"""

import importlib.machinery
import importlib.util
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / ".ci"))

import platforms  # noqa: E402

MANIFEST = (ROOT / "addon/blender_manifest.toml").read_text(encoding="utf-8")
VERSION = tomllib.loads(MANIFEST)["version"]
WORKFLOW = (ROOT / ".github/workflows/release.yml").read_text(encoding="utf-8")
NAMES = ["linux-x64", "linux-arm64", "windows-x64", "macos-arm64", "macos-x64"]
# Of those that a manifest may name, see Blender's manual on extensions.
BLENDERS = {"windows-x64", "windows-arm64", "macos-x64", "macos-arm64", "linux-x64", "linux-arm64"}


def script(name):
    """A script of `.ci` as a module."""
    loader = importlib.machinery.SourceFileLoader(f"ci_{name}", str(ROOT / ".ci" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


def wheel_name(platform, version=VERSION):
    return f"ble_unwrap_native-{version}-cp311-abi3-{platform.tag}.whl"


def wheels(folder, version=VERSION):
    """A made-up wheel for every platform."""
    folder.mkdir(exist_ok=True)
    for platform in platforms.PLATFORMS:
        (folder / wheel_name(platform, version)).write_bytes(f"made for {platform.name}".encode())
    return sorted(folder.glob("*.whl"))


@pytest.fixture
def build_extension(tmp_path, monkeypatch):
    """The script, with an add-on that has what must not be packed."""
    module = script("build_extension")
    addon = tmp_path / "addon"
    files = {
        "__init__.py": b"",
        "part/code.py": b"x = 1\n",
        "wheels/stray-0-cp311-abi3-win_amd64.whl": b"of another build",
        "wheels/.built": b"",
        "__pycache__/a.pyc": b"",
        ".hidden/file": b"",
    }
    for name, data in files.items():
        path = addon / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    (addon / "blender_manifest.toml").write_text(MANIFEST, encoding="utf-8")
    monkeypatch.setattr(module, "SOURCE", addon)
    return module


@pytest.fixture
def build_wheel():
    return script("build_wheel")


# The table ----------------------------------------------------------------------------------------------------------


def test_there_are_these_platforms_and_blender_knows_them():
    assert [platform.name for platform in platforms.PLATFORMS] == NAMES
    assert set(NAMES) <= BLENDERS
    for platform in platforms.PLATFORMS:
        assert platforms.named(platform.name) is platform
    with pytest.raises(SystemExit, match="amiga: no such platform; there are linux-x64, "):
        platforms.named("amiga")


@pytest.mark.parametrize("platform", platforms.PLATFORMS, ids=NAMES)
def test_a_wheel_tells_its_platform_and_so_does_a_compiler(platform):
    assert platforms.of_wheel(wheel_name(platform)) is platform
    assert platforms.of_triple(platform.target) is platform


@pytest.mark.parametrize(
    ("tag", "name"),
    [
        ("linux_x86_64", "linux-x64"),  # where nothing is said of the oldest system
        ("manylinux_2_34_aarch64", "linux-arm64"),
        ("manylinux_2_17_x86_64.manylinux2014_x86_64", "linux-x64"),
        ("macosx_13_0_arm64", "macos-arm64"),
        ("macosx_12_0_x86_64", "macos-x64"),
    ],
)
def test_another_oldest_system_is_the_same_platform(tag, name):
    assert platforms.of_wheel(f"some-1-cp311-abi3-{tag}.whl").name == name


@pytest.mark.parametrize("tag", ["win_arm64", "win32", "musllinux_1_2_x86_64", "manylinux_2_28_armv7l", "any"])
def test_a_wheel_for_another_system_is_refused(tag):
    with pytest.raises(SystemExit, match="no platform that Blender knows"):
        platforms.of_wheel(f"some-1-cp311-abi3-{tag}.whl")


def test_windows_is_windows_by_either_linker_and_not_on_another_processor():
    assert platforms.of_triple("x86_64-pc-windows-msvc").name == "windows-x64"
    with pytest.raises(SystemExit, match="aarch64-pc-windows-msvc"):
        platforms.of_triple("aarch64-pc-windows-msvc")


# The extension ------------------------------------------------------------------------------------------------------


def test_the_manifest_in_the_sources_names_all_platforms_and_their_wheels():
    manifest = tomllib.loads(MANIFEST)
    assert manifest["platforms"] == NAMES
    assert manifest["wheels"] == [f"./wheels/{wheel_name(platform)}" for platform in platforms.PLATFORMS]


def test_every_archive_holds_and_names_its_own_wheel_alone(build_extension, tmp_path):
    build_extension.main([tmp_path / "out", *wheels(tmp_path / "w")])
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"ble_unwrap-{VERSION}-{name.replace('-', '_')}.zip" for name in NAMES
    }
    rest = {key: value for key, value in tomllib.loads(MANIFEST).items() if key not in ("platforms", "wheels")}
    for platform in platforms.PLATFORMS:
        with zipfile.ZipFile(tmp_path / "out" / f"ble_unwrap-{VERSION}-{platform.archive_name}.zip") as archive:
            wheel = f"wheels/{wheel_name(platform)}"
            assert archive.namelist() == ["__init__.py", "blender_manifest.toml", "part/code.py", wheel]
            assert archive.read(wheel) == f"made for {platform.name}".encode()
            assert archive.read("part/code.py") == b"x = 1\n"
            manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        assert manifest == {**rest, "platforms": [platform.name], "wheels": [f"./{wheel}"]}


def test_archives_are_the_same_bytes_every_time(build_extension, tmp_path):
    made = []
    for out in ("first", "second"):
        (tmp_path / "addon/__init__.py").touch()
        build_extension.main([tmp_path / out, *wheels(tmp_path / out)])
        made.append([path.read_bytes() for path in sorted((tmp_path / out).glob("*.zip"))])
    assert made[0] == made[1] and len(made[0]) == len(NAMES)


def test_wheels_that_do_not_fit_are_refused(build_extension, tmp_path):
    with pytest.raises(SystemExit, match=r"is not of version"):
        build_extension.main([tmp_path / "out", *wheels(tmp_path / "old", "0.0.1")])
    with pytest.raises(SystemExit, match="no wheel is given"):
        build_extension.main([tmp_path / "out"])
    several = [tmp_path / f"ble_unwrap_native-{VERSION}-cp311-abi3-{tag}.whl" for tag in ("linux_x86_64", "win_amd64")]
    also = tmp_path / wheel_name(platforms.named("linux-x64"))
    with pytest.raises(SystemExit, match="several wheels are for linux-x64"):
        build_extension.main([tmp_path / "out", *several, also])
    assert not list(tmp_path.glob("out/*"))


# The wheel ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "target", "linker"),
    [
        ("linux-x64", "x86_64-unknown-linux-gnu", ["--zig", "--compatibility", "manylinux_2_28"]),
        ("linux-arm64", "aarch64-unknown-linux-gnu", ["--zig", "--compatibility", "manylinux_2_28"]),
        ("windows-x64", "x86_64-pc-windows-gnu", []),
        ("macos-arm64", "aarch64-apple-darwin", ["--zig"]),
        ("macos-x64", "x86_64-apple-darwin", ["--zig"]),
    ],
)
def test_what_links_on_linux(build_wheel, monkeypatch, name, target, linker):
    monkeypatch.setattr(sys, "platform", "linux")
    platform = platforms.named(name)
    assert platform.target == target
    command = build_wheel.maturin(platform.target, platform)
    assert command[command.index("--target") + 1 :] == [target, *linker]


def test_other_systems_link_by_their_own_linker(build_wheel, monkeypatch):
    for system, name, host in [
        ("win32", "windows-x64", "x86_64-pc-windows-msvc"),
        ("darwin", "macos-arm64", "aarch64-apple-darwin"),
    ]:
        monkeypatch.setattr(sys, "platform", system)
        assert build_wheel.maturin(host, platforms.named(name))[-2:] == ["--target", host]


def test_what_cannot_be_built_here_is_said_before_anything_is_run(build_wheel, monkeypatch):
    monkeypatch.setattr(build_wheel.subprocess, "run", lambda *_a, **_k: pytest.fail("something was run"))
    for system, target in [("win32", "x86_64-unknown-linux-gnu"), ("darwin", "x86_64-pc-windows-gnu")]:
        monkeypatch.setattr(sys, "platform", system)
        with pytest.raises(SystemExit, match=f"{target} can only be built for on Linux"):
            build_wheel.check_that_it_can_be_built(target)


def test_a_new_wheel_takes_the_place_of_the_old_one_of_its_platform_alone(build_wheel, tmp_path, monkeypatch):
    wheels(tmp_path)
    ran = []
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(build_wheel, "run", lambda *command, **_k: ran.append([str(part) for part in command]))
    host = platforms.named("linux-x64")
    build_wheel.build(host, "x86_64-unknown-linux-gnu", tmp_path)
    left = {platforms.of_wheel(path.name).name for path in tmp_path.glob("*.whl")}
    assert left == set(NAMES) - {"linux-x64"}
    licences, maturin = ran
    assert Path(licences[1]).name == "third_party_licenses" and licences[-1] == host.target
    assert maturin[:2] == ["maturin", "build"] and maturin[-2:] == ["--out", str(tmp_path)]


# The release --------------------------------------------------------------------------------------------------------


def test_the_workflow_builds_every_platform_on_a_machine_of_its_system():
    rows = re.findall(r"(?m)^ +- platform: (\S+)\n +runner: (\S+)$", WORKFLOW)
    assert [name for name, _ in rows] == NAMES
    systems = {"linux": "ubuntu", "windows": "windows", "macos": "macos"}
    for name, runner in rows:
        assert runner.startswith(systems[name.split("-")[0]]), name
    runners = dict(rows)
    assert runners["linux-arm64"].endswith("-arm") and not runners["linux-x64"].endswith("-arm")
    assert runners["macos-x64"].endswith("-intel") and not runners["macos-arm64"].endswith("-intel")


def test_the_workflow_releases_only_what_was_tested_and_on_a_tag_alone():
    release = WORKFLOW[WORKFLOW.index("\n  release:\n") :]
    assert "if: startsWith(github.ref, 'refs/tags/v')" in release
    assert "needs: [build, extension]" in release
    assert release.index(".ci/check_release") < release.index("gh release create")
    assert "out/release/*.whl out/release/*.zip" in release
    assert WORKFLOW.count("contents: write") == 1 == release.count("contents: write")


def test_the_workflow_runs_what_is_there():
    named = set(re.findall(r"(?<![\w.])(?:\.ci|tests)/[\w./]+", WORKFLOW)) - {"tests/test_"}
    listed = re.search(r"tests/test_\{([\w,]+)\}\.py", WORKFLOW)[1].split(",")
    named |= {f"tests/test_{name}.py" for name in listed}
    assert {".ci/build_wheel", ".ci/build_extension", ".ci/requirements.txt", "tests/test_native_api.py"} <= named
    assert [name for name in sorted(named) if not (ROOT / name).is_file()] == []
    requirements = (ROOT / ".ci/requirements.txt").read_text(encoding="utf-8")
    chosen = re.search(r"grep -E '\^\(([\w|]+)\)", WORKFLOW)[1].split("|")
    assert [name for name in chosen if not re.search(rf"(?m)^{name}\b", requirements)] == []


def test_a_release_is_checked_for_completeness(build_extension, tmp_path):
    check, folder = script("check_release"), tmp_path / "w"
    build_extension.main([folder, *wheels(folder)])
    assert list(check.complaints(f"v{VERSION}", folder)) == []
    assert len(list(check.complaints("v99.0", folder))) == len(NAMES) + 1

    (folder / f"ble_unwrap-{VERSION}-windows_x64.zip").unlink()
    (missing,) = check.complaints(f"v{VERSION}", folder)
    assert missing.startswith("The extensions are ")

    build_extension.main([folder, *folder.glob("*.whl")])
    (folder / wheel_name(platforms.named("macos-x64"))).write_bytes(b"built anew")
    (stale,) = check.complaints(f"v{VERSION}", folder)
    assert "macos_x64.zip does not hold" in stale

    (folder / wheel_name(platforms.named("macos-x64"))).unlink()
    assert len(list(check.complaints(f"v{VERSION}", folder))) == 2, "a wheel that is missing, an archive without one"


def test_an_emulator_is_asked_for_by_platform(tmp_path):
    """Before it makes anything: a platform without an emulator is no failure, and a folder without its wheel is one."""
    command = [ROOT / ".ci/emulated_tests"]
    none = subprocess.run([*command, "macos-arm64", tmp_path], capture_output=True, text=True, check=False)
    assert none.returncode == 3 and "no emulator of macos-arm64" in none.stderr
    wheels(tmp_path)
    (tmp_path / wheel_name(platforms.named("linux-arm64"))).unlink()
    empty = subprocess.run([*command, "linux-arm64", tmp_path], capture_output=True, text=True, check=False)
    assert empty.returncode == 2 and "holds 0 wheels for linux-arm64" in empty.stderr
