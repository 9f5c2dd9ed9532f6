"""What README.md tells a newcomer to type, as far as it can be tried without Blender."""

import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
FIRST_SCREEN = README[: README.index("\n## ")]


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_the_python_runs_from_top_to_bottom(capsys):
    """Every block, in one session, as someone would paste them."""
    pytest.importorskip("sklearn")
    names = {}
    for number, block in enumerate(blocks(README, "python"), 1):
        exec(compile(block, f"README.md, Python block {number}", "exec"), names)
    assert names["atlas"].certificate["valid"] and names["uv"].shape == (24, 2) and names["chart"].shape == (6,)
    assert np.array_equal(np.asarray(names["first"].uv), names["uv"])
    assert names["model"].embedding_.shape == (300, 2)
    assert capsys.readouterr().out.startswith("1 [[")


def test_the_first_screen_fits_a_screen_and_holds_a_first_use_of_everything():
    assert FIRST_SCREEN.count("\n") <= 50
    assert all(
        word in FIRST_SCREEN for word in ("![", "make zip", "pip install", "**In Blender**", "--command ble_unwrap")
    )
    assert len(blocks(FIRST_SCREEN, "python")) == 1


def test_what_the_page_leads_to_is_there():
    targets = re.findall(r"\]\(([^)#:]+)\)", README)
    assert len(targets) > 8
    assert [target for target in targets if not (ROOT / target).exists()] == []
    headings = {re.sub(r"[^a-z ]", "", h.lower()).replace(" ", "-") for h in re.findall(r"(?m)^#+ (.*)$", README)}
    assert set(re.findall(r"\]\(#([^)]+)\)", README)) <= headings


def test_every_make_target_that_is_named_exists():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    documents = README + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"(?m)(?:`|^)make ([a-z][a-z-]*)", documents))
    assert len(named) > 8
    assert [name for name in sorted(named) if not re.search(rf"(?m)^{name}:", makefile)] == []


def test_every_script_that_is_named_exists():
    for name in re.findall(r"blender_scripts/\w+\.py|tests/\w+\.py", README):
        assert (ROOT / name).is_file(), name
