"""The core's interface: which names it has, how they may grow, and that the binding forgets none of what they hold.

The names are those of the table in native/ARCHITECTURE.md, so that none comes in unnoticed. That nothing else is
reachable is the compiler's to say: the lints `unreachable_pub` and `unnameable_types` are on.
"""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "native/ble_unwrap_core/src"
BINDING = ROOT / "native/ble_unwrap_native/src"
PAGE = ROOT / "native/ARCHITECTURE.md"

# Types that do not say `non_exhaustive`, and why.
BUILT_BY_CALLERS = {
    "MeshInput",
    "Settings",
    "GeodesicSettings",
    "SegmentationSettings",
    "EmbeddingSettings",
    "StretchSettings",
    "PackSettings",
    "EmbedOptions",
    "CloudDistanceSettings",
    "RelaxRules",
    "RepackRules",
    "FittedLandmarks",
}
KNOWN_TO_HOSTS_IN_FULL = {"ErrorKind", "Setting", "Kind", "Value", "Interval", "Argument", "Named"}
COMPLETE = {"Defect"}  # a count and the first of what is counted


def code(file: Path) -> str:
    """Without comments and without the unit tests at the end."""
    source = re.sub(r"//[^\n]*", "", file.read_text(encoding="utf-8"))
    return re.sub(r"(?ms)^#\[cfg\(test\)\]\s*mod \w+ \{.*", "", source)


def names_in(source: str) -> set[str]:
    """What a module exports itself or from others."""
    names = set(re.findall(r"(?m)^pub (?:const )?(?:fn|struct|enum|trait|type|const|static) (\w+)", source))
    for tree in re.findall(r"(?m)^pub use ([^;]+);", source):
        names |= {part.strip().split("::")[-1] for part in re.sub(r".*\{|\}", "", tree, flags=re.S).split(",")} - {""}
    return names


def public_names() -> dict[str, set[str]]:
    root = code(CORE / "lib.rs")
    modules = re.findall(r"(?m)^(?<!\(hidden\)\]\n)pub mod (\w+);", root)
    return {"root": names_in(root)} | {name: names_in(code(CORE / name / "mod.rs")) for name in modules}


def listed_names() -> dict[str, set[str]]:
    """Those in the table of the page."""
    section = PAGE.read_text(encoding="utf-8").split("## What is public\n")[1].split("\n## ")[0]
    rows = re.findall(r"(?m)^\| `(\w+)` \|[^|]*\|([^|]*)\|$", section)
    return {module: set(re.findall(r"`(\w+)`", names)) for module, names in rows}


def definitions() -> dict[str, str]:
    """Public structures and enumerations: what is before the name and what follows it."""
    found = {}
    for file in CORE.rglob("*.rs"):
        if file.name == "internals.rs":
            continue
        for match in re.finditer(
            r"(?ms)^((?:#\[[^\n]*\]\n)*)pub (struct|enum) (\w+)[^{;]*(?:\{(.*?)^\}|;)", code(file)
        ):
            found[match[3]] = match[1] + match[2] + (match[4] or "")
    return found


def fields(definition: str) -> list[str]:
    return re.findall(r"(?m)^    pub (\w+):", definition)


def test_the_page_lists_every_public_name():
    assert public_names() == listed_names()


def test_what_may_grow_says_so():
    public = set().union(*public_names().values())
    known = definitions()
    types = {name for name in known if name in public}
    assert len(types) > 50, "the definitions were not found"
    closed = {
        name
        for name in types
        if "#[non_exhaustive]" not in known[name] and ("enum" in known[name] or fields(known[name]))
    }
    assert closed == BUILT_BY_CALLERS | KNOWN_TO_HOSTS_IN_FULL | COMPLETE


def test_no_other_crate_is_in_a_public_signature():
    foreign = re.compile(r"\b(?:Point[23]|Vector[23]|Matrix\w*|nalgebra|faer)\b")
    signatures = []
    for file in CORE.rglob("*.rs"):
        if file.name != "internals.rs":
            signatures += re.findall(r"\bpub (?:const )?fn [^{;]*", code(file))
    for name, definition in definitions().items():
        signatures += [f"{name}: {line}" for line in re.findall(r"(?m)^    pub .*$", definition)]
    assert len(signatures) > 100, "the signatures were not found"
    assert not [signature for signature in signatures if foreign.search(signature)]


# Results of which the binding makes dictionaries, and fields that it leaves out on purpose.
@pytest.mark.parametrize(
    ("name", "left_out"),
    [
        ("Report", set()),
        ("Certificate", set()),
        ("CloudReport", set()),
        ("FlattenReport", set()),
        ("MapQuality", set()),
        ("LayoutMeasures", set()),
        ("RelaxedIsland", set()),
        # Faces without UVs are counted as faces, not as triangles; the charts found have no numbers outside.
        ("Measures", {"unmapped_faces", "nonfinite_faces", "worst_chart"}),
    ],
)
def test_the_binding_delivers_every_field(name, left_out):
    wanted = set(fields(definitions()[name])) - left_out
    assert wanted
    binding = "\n".join(code(file) for file in BINDING.glob("*.rs"))
    pattern = re.search(rf"let {name} \{{([^}}]*)\}}", binding)
    delivered = set(re.findall(r"\w+", pattern[1]) if pattern else re.findall(r"\bmeasures\.(\w+)", binding))
    assert delivered == wanted


def test_names_are_read():
    source = "pub use a::{B, c};\npub use d::E;\npub fn f() {}\npub(crate) use x::Y;\nmod z;\npub const G: u8 = 1;"
    assert names_in(source) == {"B", "c", "E", "f", "G"}
