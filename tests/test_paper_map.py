"""The map from the paper to the code names functions and tests: each of them must be there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MAP = ROOT / "native/paper/map.md"
CORE = ROOT / "native/ble_unwrap_core"


def entries():
    """(file, name, whether it stands in the column of tests) of every `file: name` in the map."""
    found = []
    for line in MAP.read_text(encoding="utf-8").splitlines():
        cells = line.strip("|").split("|")
        for place, cell in enumerate(cells):
            for file, name in re.findall(r"`([\w/]+\.(?:rs|py)): ([\w*]+)`", cell):
                found.append((file, name, place == len(cells) - 1))
    return found


def sources(file):
    """The files that an entry may mean: by path from the root, or the core's by the end of their path."""
    if (ROOT / file).is_file():
        return [ROOT / file]
    return [path for path in CORE.rglob("*.rs") if f"/{path.relative_to(CORE).as_posix()}".endswith(f"/{file}")]


def is_there(name, is_test, text):
    if name == "*":
        return "def test_" in text or "#[test]" in text
    if not is_test:
        return re.search(rf"\bfn {name}\b", text) is not None
    # An attribute or two may stand between; `proptest!` has them, too.
    return re.search(rf"(^def {name}\b|#\[test\](\s*#\[[^\]]*\])*\s*fn {name}\b)", text, re.M) is not None


@pytest.mark.parametrize(("file", "name", "is_test"), sorted(set(entries())))
def test_what_the_map_names_is_there(file, name, is_test):
    files = sources(file)
    assert files, f"no file {file}"
    assert any(is_there(name, is_test, path.read_text(encoding="utf-8")) for path in files), f"no {name} in {file}"


def test_every_equation_has_a_row():
    first_cells = " ".join(line.split("|")[1] for line in MAP.read_text(encoding="utf-8").splitlines() if "|" in line)
    for number in range(1, 14):
        assert f"({number})" in first_cells, f"equation ({number})"
    for figure in ("Fig. 1", "Fig. 2(a)", "Fig. 2(b)", "Fig. 3", "Theorem 4.1", "steps 1 to 5"):
        assert figure in first_cells, figure
    assert len(entries()) > 70
