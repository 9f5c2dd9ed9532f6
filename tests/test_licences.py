"""The wheel carries the licences of all that is compiled into it, and so does the extension, which holds the wheel.

What must be in it is asked of `cargo tree`, by another way than that of the script which writes the file.
"""

import importlib.metadata
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPO / ".ci"))

import platforms  # noqa: E402

SCRIPT = REPO / ".ci" / "third_party_licenses"


@pytest.fixture(scope="module")
def script():
    """The functions of the script that the build runs."""
    return runpy.run_path(str(SCRIPT), run_name="third_party_licenses")


@pytest.fixture(scope="module")
def carried():
    """Crate and version -> texts, as the installed wheel carries them."""
    files = importlib.metadata.distribution("ble_unwrap_native").files or ()
    found = [file for file in files if re.search(r"\.dist-info/licenses/THIRD_PARTY_LICENSES\.txt$", str(file))]
    assert len(found) == 1, "the wheel has no file of licences"
    rule = "=" * 100 + "\n"
    parts = re.split(rf"(?m)^{rule}Of (.*)\n{rule}", found[0].read_text(encoding="utf-8"))
    texts = {}
    for crates, text in zip(parts[1::2], parts[2::2], strict=True):
        for crate in crates.split(", "):
            texts.setdefault(crate, []).append(text)
    return texts


def licences_by_cargo_tree(*options):
    """Crate and version -> licence, of what the wheel is compiled from."""
    tree = ["cargo", "tree", "--locked", "-p", "ble_unwrap_native", "-e", "normal", "--prefix", "none", *options]
    lines = subprocess.run(
        [*tree, "--format", "{p}|{l}"], cwd=REPO, check=True, stdout=subprocess.PIPE, text=True
    ).stdout.splitlines()
    licences = {}
    for line in lines:
        package, licence = line.removesuffix(" (*)").split("|")
        name, version = package.split()[:2]
        if not name.startswith("ble_unwrap"):
            licences[f"{name} {version.removeprefix('v')}"] = licence
    assert len(licences) > 20, "cargo tree lists no dependencies"
    return licences


def test_every_crate_of_the_wheel_is_covered(carried, script):
    """Each with the text of the licence that it is under, not just with any text."""
    licences = licences_by_cargo_tree()
    assert set(licences) <= set(carried)
    for crate, licence in licences.items():
        assert all(text.strip() for text in carried[crate]), crate
        assert script["is_covered"](licence, carried[crate]), f"{crate} is under {licence}"


@pytest.mark.parametrize("target", [*(p.target for p in platforms.PLATFORMS), "x86_64-pc-windows-msvc"])
def test_every_platform_has_the_licences_of_its_own_crates(script, target):
    """For Macs, crates are compiled that no other platform has."""
    crates = script["compiled_crates"](target)
    named = {f"{crate['name']} {crate['version']}" for crate in crates}
    assert set(licences_by_cargo_tree("--target", target)) <= named
    assert any(name.startswith("sysctl ") for name in named) == ("apple" in target)
    assert any(name.startswith("private-gemm-x86 ") for name in named) == target.startswith("x86_64")
    for crate in crates:
        assert all(text.strip() for text in script["texts_of"](crate)), crate["name"]


def test_what_mingw_links_for_windows_is_covered(script, tmp_path, monkeypatch):
    """And only that: neither Microsoft's linker nor another platform brings its C library."""
    linked = script["linked_libraries"]
    copyright_file = tmp_path / "copyright"
    copyright_file.write_text("The terms of MinGW's C library\n", encoding="utf-8")
    monkeypatch.setitem(linked.__globals__, "MINGW_LICENCES", (tmp_path / "nowhere", copyright_file))
    macros = "#define __MINGW64_VERSION_MAJOR 10\n#define __MINGW64_VERSION_MINOR 2\n"
    monkeypatch.setitem(linked.__globals__, "output_of", lambda *_command: macros)
    (package,) = linked("x86_64-pc-windows-gnu")
    assert (package["name"], package["version"]) == ("mingw-w64-runtime", "10.2")
    assert script["texts_of"](package) == ["The terms of MinGW's C library\n"]
    others = {platform.target for platform in platforms.PLATFORMS} - {"x86_64-pc-windows-gnu"}
    assert [target for target in (*others, "x86_64-pc-windows-msvc") if linked(target)] == []
    copyright_file.unlink()
    with pytest.raises(SystemExit, match="licences of MinGW"):
        linked("x86_64-pc-windows-gnu")


def test_the_standard_library_is_covered(carried, script):
    (standard,) = [crate for crate in carried if crate.startswith("std ")]
    assert script["is_covered"]("MIT", carried[standard])
    assert any("Rust Project Contributors" in text for text in carried[standard])


def test_no_directory_of_the_machine_is_named(carried):
    home = str(Path.home())
    assert not [crate for crate, texts in carried.items() if any(home in text or str(REPO) in text for text in texts)]


@pytest.mark.parametrize(
    ("expression", "there", "covered"),
    [
        ("MIT", ("MIT",), True),
        ("MIT", ("Apache-2.0",), False),
        ("MIT OR Apache-2.0", ("Apache-2.0",), True),
        ("MIT/Apache-2.0", ("MIT",), True),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", ("MIT",), False),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", ("MIT", "Unicode-3.0"), True),
        ("Apache-2.0 WITH LLVM-exception", ("Apache-2.0",), True),
        ("Zlib OR MIT AND ISC", ("MIT",), False),
        ("Unheard-1.0", ("MIT", "Apache-2.0"), False),
    ],
)
def test_expressions_of_licences_are_understood(script, expression, there, covered):
    texts = [f"Some\n words, {script['TELLTALE'][name].upper()}\nmore" for name in there]
    assert script["is_covered"](expression, texts) is covered


def package(tmp_path, licence, files=(), authors=("A. Uthor <a@example.org>",)):
    for name, text in files:
        (tmp_path / name).write_text(text, encoding="utf-8")
    return {
        "name": "some",
        "version": "1.0.0",
        "license": licence,
        "license_file": None,
        "authors": list(authors),
        "manifest_path": str(tmp_path / "Cargo.toml"),
        "repository": None,
    }


def test_crate_without_a_text_gets_that_of_mit_or_fails_the_build(script, tmp_path):
    (text,) = script["texts_of"](package(tmp_path, "MIT OR Apache-2.0"))
    assert "Copyright (c) A. Uthor\n" in text and "WITHOUT WARRANTY OF ANY KIND" in text
    with pytest.raises(SystemExit, match=r"some 1\.0\.0 says 'MPL-2\.0'"):
        script["texts_of"](package(tmp_path, "MPL-2.0"))
    with pytest.raises(SystemExit, match="says ''"):
        script["texts_of"](package(tmp_path, None))


def test_texts_of_code_that_a_crate_took_over_stay_beside_its_own(script, tmp_path):
    """As in faer: texts of others' licences, and none of its own."""
    texts = script["texts_of"](package(tmp_path, "MIT", [("COPYING.LAPACK.BSD", "Redistribution and so on")]))
    assert len(texts) == 2 and "A. Uthor" in texts[0] and texts[1].startswith("Redistribution")


def test_empty_text_is_no_text(script, tmp_path):
    with pytest.raises(SystemExit, match="has no text"):
        script["texts_of"](package(tmp_path, "Apache-2.0", [("LICENSE", " \n")]))
