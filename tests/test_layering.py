"""Who may import whom: the layers of native/ARCHITECTURE.md, kept by a test.

A rule without a test leaks. The core's modules are read as text (comments, strings and unit tests apart), the add-on
and the scripts as syntax trees. A new module has to be entered in the table below.
"""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "native/ble_unwrap_core/src"

FOUNDATION = {
    "choice",
    "collections",
    "error_kind",
    "memory",
    "predicates",
    "progress",
    "random",
    "rounds",
    "linalg",
    "mesh",
}
TOOLS = FOUNDATION | {"geodesics", "distortion"}
# In the order of the pipeline. A stage sees the types that earlier stages put out, never their functions.
STAGES = ["segmentation", "charts", "embedding", "stretch", "packing"]
JUDGES = {"metrics", "verify", "rounding", "report"}
# Errors and settings gather those of the stages.
GATHERED = {"error", "settings"}
RESULTS = {"atlas", "clock", "report"}
# Module of the core -> modules all of whose public items it may use.
MAY_USE = {
    "choice": set(),
    "collections": set(),
    "error_kind": set(),
    "memory": set(),
    "progress": {"error_kind", "memory"},
    "predicates": set(),
    "random": set(),
    "rounds": {"progress"},
    "linalg": {"memory", "progress"},
    "mesh": {"collections", "error_kind", "memory", "predicates", "progress", "random"},
    "geodesics": FOUNDATION,
    "distortion": FOUNDATION,
    **dict.fromkeys(STAGES, TOOLS),
    "metrics": TOOLS - {"geodesics"},
    "verify": TOOLS - {"geodesics"} | {"metrics"},
    "rounding": TOOLS - {"geodesics"},
    "report": {"metrics"},
    "atlas": {"error", "report", "verify"},
    "clock": set(),
    "error": {"error_kind", "memory", "mesh", "metrics", "packing", "progress", "verify"},
    "settings": {"choice", "embedding", "error", "geodesics", "mesh", "packing", "segmentation", "stretch"},
    "cache": TOOLS,
    "visibility": FOUNDATION,
    "flattening": TOOLS | {"cache", "charts", "embedding", "settings", "stretch"},
    # From surfaces to charts, and from charts to atlases.
    "cutting": TOOLS | set(STAGES) - {"packing"} | {"cache", "flattening", "settings"},
    "layout": TOOLS | set(STAGES) | JUDGES | GATHERED | RESULTS | {"cache", "cutting", "flattening"},
    # What sees several stages. None of the three sees another.
    "unwrap": FOUNDATION | GATHERED | RESULTS | {"cache", "cutting", "layout", "visibility"},
    "cloud": TOOLS | set(STAGES) | GATHERED | {"clock", "report"},
    "standalone": TOOLS | set(STAGES) | JUDGES | GATHERED | {"clock", "flattening"},
    # The benchmarks' and tests' window into the stages.
    "internals": TOOLS | set(STAGES) | JUDGES,
    "lib": {
        "atlas",
        "cloud",
        "error",
        "error_kind",
        "mesh",
        "packing",
        "progress",
        "report",
        "settings",
        "unwrap",
        "verify",
    },
}
# Module -> modules of which it may name types (in CamelCase) only.
MAY_NAME_TYPES_OF = {
    **{stage: set(STAGES[:i]) for i, stage in enumerate(STAGES)},
    # Its settings say nothing of charts, and are left out of a fingerprint of what makes them.
    "cutting": {"packing"},
    "metrics": {"charts", "packing"},
    "verify": {"charts", "packing"},
}


def without_comments_and_tests(source: str) -> str:
    """Rust source without comments, string contents and the unit tests at its end."""
    source = re.sub(r"(?ms)^\s*#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*mod \w+ \{.*", "", source)
    source = re.sub(r"(?m)^\s*#\[cfg\(test\)\]\s*\n\s*(?:pub(?:\([^)]*\))?\s+)?(?:mod|use) [^;]*;", "", source)
    source = re.sub(r'"(?:\\.|[^"\\])*"', '""', source, flags=re.S)
    source = re.sub(r"//[^\n]*", "", source)
    return re.sub(r"/\*.*?\*/", "", source, flags=re.S)


def use_tree(text: str, prefix: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """The paths of a `use` tree such as `crate::{mesh::{TriMesh, FaceId as F}, progress::Cancelled}`."""
    parts, depth, start = [], 0, 0
    for i, c in enumerate(text):
        depth += (c == "{") - (c == "}")
        if c == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    parts.append(text[start:])
    paths = []
    for part in filter(None, (p.strip() for p in parts)):
        if "{" in part:
            head, tail = part.split("{", 1)
            names = tuple(n for n in head.strip().split("::") if n)
            paths += use_tree(tail.rsplit("}", 1)[0], prefix + names)
        else:
            names = tuple(part.split(" as ")[0].strip().split("::"))
            paths.append(prefix + names)
    return paths


def module_path(file: Path) -> tuple[str, ...]:
    parts = file.relative_to(CORE).with_suffix("").parts
    return parts[:-1] if parts[-1] == "mod" else parts


def absolute(path: tuple[str, ...], module: tuple[str, ...]) -> tuple[str, ...] | None:
    """A path from the root of the crate, or `None` for a path into another crate or into the module itself."""
    path = tuple(name.strip() for name in path)
    if path[0] == "crate":
        return path[1:]
    here = module
    while path and path[0] == "super":
        here, path = here[:-1], path[1:]
    return here + path if here != module else None


def references(file: Path) -> set[tuple[str, ...]]:
    """Every path of a core file that leads to another module of the core, from the root of the crate."""
    source = without_comments_and_tests(file.read_text(encoding="utf-8"))
    module = module_path(file)
    found = []
    for tree in re.findall(r"\buse\s+([^;]+);", source):
        found += use_tree(tree)
    found += [tuple(p.split("::")) for p in re.findall(r"\b((?:crate|super)(?:::\w+)+)", source)]
    paths = {absolute(path, module) for path in found}
    return {path for path in paths if path}


def reexports() -> dict[str, str]:
    """Name at the root of the crate -> module it comes from."""
    source = without_comments_and_tests((CORE / "lib.rs").read_text(encoding="utf-8"))
    names = {}
    for tree in re.findall(r"\bpub use\s+([^;]+);", source):
        for path in use_tree(tree):
            path = path[1:] if path[0] in ("crate", "self") else path
            if len(path) > 1:
                names[path[-1]] = path[0]
    return names


def files_of_tests() -> set[Path]:
    """Files of modules that a `#[cfg(test)]` keeps out of the library."""
    found = set()
    for file in CORE.rglob("*.rs"):
        source = file.read_text(encoding="utf-8")
        folder = file.parent if file.name in ("mod.rs", "lib.rs") else file.with_suffix("")
        for name in re.findall(r"(?m)^\s*#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod (\w+);", source):
            found |= {folder / f"{name}.rs", *(folder / name).rglob("*.rs")}
    return found


def library_files() -> list[Path]:
    return sorted(set(CORE.rglob("*.rs")) - files_of_tests())


def offences(file: Path, root_names: dict[str, str]) -> list[str]:
    me = (module_path(file) or ("lib",))[0]
    if me not in MAY_USE:
        return [f"{file.name}: the module {me} is not in the table of layers"]
    allowed, types_of = MAY_USE[me], MAY_NAME_TYPES_OF.get(me, set())
    found = []
    for path in sorted(references(file)):
        target, item = (root_names[path[0]], path[0]) if path[0] in root_names else (path[0], path[-1])
        is_type = item[:1].isupper() and item != "*"
        if target == me or target in allowed or (target in types_of and (is_type or len(path) == 1)):
            continue
        what = f"{me} uses {'::'.join(path)}"
        if target in types_of:
            what += f": of {target} only types, not functions"
        found.append(f"{file.relative_to(CORE)}: {what}")
    return found


def test_core_layers():
    root_names = reexports()
    files = library_files()
    assert len(files) > 5, "the core was not found"
    assert not [offence for file in files for offence in offences(file, root_names)]


# From a surface to charts: a file, or a folder as a whole, uses those of the rows above its own.
CUTTING = [
    {"charted", "rigid_motion", "measured", "merged"},
    {"state", "edit", "cost"},
    {"border", "history", "copied", "touch_up"},
    {"moves/mod"},
    {"moves/split", "moves/dart", "moves/net", "moves/lobe"},
    {"attempt"},
    {"trial", "divide"},
    {"search"},
    {"moves/join", "moves/partial_join", "moves/hand_over", "moves/across", "moves/zip", "moves/face"},
    {"whole", "atlas_limit", "moves/fold"},
    {"level/carry", "level/prolong", "level/mod"},
    {"symmetric", "alike"},
    {"originals", "folded"},
    {"component"},
    {"mod"},
]


def files_used(file: Path) -> set[Path]:
    """The files of the core that a file uses, the face of its own folder apart."""
    used = set()
    for path in references(file):
        for length in range(len(path), 0, -1):
            stem = CORE.joinpath(*path[:length])
            found = [f for f in (stem.with_suffix(".rs"), stem / "mod.rs") if f.is_file()]
            if found:
                used |= set(found) - {file, file.parent / "mod.rs"}
                break
    return used


def test_cutting_goes_one_way():
    folder = CORE / "cutting"
    floor = {name: i for i, row in enumerate(CUTTING) for name in row}
    names = {f: f.relative_to(folder).with_suffix("").as_posix() for f in library_files() if folder in f.parents}
    assert set(names.values()) == set(floor), "every file of the folder is in the table, and no other"
    upward = [
        f"{name} uses {names[used]}"
        for file, name in names.items()
        for used in files_used(file)
        if used in names and floor[names[used]] > floor[name]
    ]
    assert not upward


def test_no_files_use_each_other_in_a_circle():
    uses = {file: files_used(file) for file in library_files()}
    finished, open_files = set(), []

    def visit(file):
        if file in open_files:
            names = [str(f.relative_to(CORE)) for f in open_files[open_files.index(file) :]]
            raise AssertionError(f"a circle: {' uses '.join([*names, names[0]])}")
        if file in finished or file not in uses:
            return
        open_files.append(file)
        for used in sorted(uses[file]):
            visit(used)
        finished.add(open_files.pop())

    for file in uses:
        visit(file)


def test_core_neither_prints_nor_opens_files():
    forbidden = re.compile(r"\b(?:std::(?:fs|io|net|process|env)\b|e?print(?:ln)?!|dbg!|Instant::now|SystemTime)")
    found = [
        f"{file.relative_to(CORE)}: {match[0]}"
        for file in library_files()
        for match in [forbidden.search(without_comments_and_tests(file.read_text(encoding="utf-8")))]
        if match
        # Seconds of the report.
        and not (match[0] == "Instant::now" and module_path(file) == ("clock",))
        # How much memory is left is in files of /proc.
        and not (match[0] == "std::fs" and module_path(file)[:1] == ("memory",))
    ]
    assert not found


@pytest.mark.parametrize(
    ("crate", "allowed"),
    [
        ("ble_unwrap_core", {"faer", "glam", "nalgebra", "obvhs", "pulp", "rayon", "robust", "thiserror"}),
        ("ble_unwrap_fixtures", {"toml", "serde"}),
        ("ble_unwrap_native", {"ble_unwrap_core", "pyo3", "rayon"}),
    ],
)
def test_crate_dependencies(crate, allowed):
    manifest = tomllib.loads((ROOT / "native" / crate / "Cargo.toml").read_text(encoding="utf-8"))
    assert set(manifest.get("dependencies", {})) <= allowed


def test_the_binding_uses_the_core_by_its_public_names_only():
    """No algorithm in the binding: it neither loops over faces nor names the core's connectivity."""
    inner = re.compile(r"\b(?:FaceId|HalfedgeId|VertexId|TriMesh|nalgebra|faer)\b")
    for file in sorted((ROOT / "native/ble_unwrap_native/src").glob("*.rs")):
        match = inner.search(without_comments_and_tests(file.read_text(encoding="utf-8")))
        assert not match, f"{file.name} names {match[0]}"


# Python -------------------------------------------------------------------------------------------------------------

PYTHON = sorted([*(ROOT / "addon").rglob("*.py"), *(ROOT / "blender_scripts").rglob("*.py")])


def imports(file: Path) -> set[str]:
    """Names of imported modules, wherever in the file: absolute ones as they are, relative ones with one leading dot
    and, below it, the path from the root of the add-on."""
    package = file.relative_to(ROOT).parts[1:-1]
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"), str(file))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            if node.level == 0:
                found.add(node.module)
                continue
            base = list(package[: len(package) - (node.level - 1)])
            base += node.module.split(".") if node.module else []
            if node.module:
                found.add("." + ".".join(base))
            else:
                found |= {"." + ".".join([*base, alias.name]) for alias in node.names}
    return found


def tops(names: set[str]) -> set[str]:
    """First components; a relative name keeps its dot."""
    return {("." if n.startswith(".") else "") + n.lstrip(".").split(".")[0] for n in names}


# The add-on's way to the native module and back, and the judges: they know plain arrays and numbers, and run without
# Blender. Each with all that it may import besides the standard library.
PLAIN_MAY_IMPORT = {
    "engine.py": {"ble_unwrap_native", ".settings_table"},
    "kept_analysis.py": {"numpy", ".engine"},
    "computation.py": {"numpy", ".engine", ".kept_analysis"},
    "measurement.py": {"numpy", ".engine"},
    "certificate.py": set(),
    "wording.py": {"numpy"},
    "uv_islands.py": {"numpy"},
    "uv_align.py": {"numpy", ".uv_islands"},
    "triangle_shapes.py": {"numpy"},
    "overlay_colours.py": {"numpy", ".triangle_shapes"},
    "layout_picture.py": {"numpy"},
    "comparison_table.py": {"numpy", ".check_report", ".wording"},
    "check_report.py": {"numpy", ".certificate", ".surface_report", ".wording"},
    "surface_report.py": {"numpy", ".certificate", ".wording"},
    "cloud_report.py": {".certificate", ".wording"},
}
NATIVE = {"ble_unwrap_native", ".engine", ".kept_analysis", ".computation", ".measurement"}
BRIDGES = {".mesh_bridge", ".cloud_bridge"}

# Every other file of the add-on -> what it never imports.
NEVER = {
    **{
        f"{name}.py": NATIVE | BRIDGES | {".properties"}
        for name in (
            "mesh_arrays",
            "faces",
            "seams",
            "vertex_groups",
            "painted",
            "uv_maps",
            "map_state",
            "textures",
            "units",
        )
    },
    "settings_table.py": NATIVE | BRIDGES | {"bpy", "bmesh", "numpy", ".properties"},
    "last_result.py": NATIVE | BRIDGES,
    "last_check.py": NATIVE | BRIDGES,
    "last_comparison.py": NATIVE | BRIDGES,
    "comparison_image.py": NATIVE | BRIDGES | {".properties"},
    # What is drawn over surfaces is read, never written; only what draws needs a window.
    "overlay_mesh.py": NATIVE | BRIDGES | {"bpy", "gpu", ".properties"},
    "overlay_drawing.py": NATIVE | BRIDGES | {"bpy", ".properties"},
    "overlay_legend.py": NATIVE | BRIDGES | {"gpu"},
    "overlay.py": NATIVE | BRIDGES | {"gpu", ".properties"},
    "mesh_bridge.py": NATIVE | {".cloud_bridge"},
    "cloud_bridge.py": NATIVE,
    "point_file.py": NATIVE | BRIDGES | {"bpy", "bmesh"},
    "asset_io": NATIVE | {".run", ".task", ".batch"},
    # What looks at files from others or reads them back needs no Blender, so that nothing is opened by it.
    **{
        f"asset_io/{name}.py": {"bpy", "bmesh"}
        for name in (
            "formats",
            "gltf_file",
            "input_check",
            "named_files",
            "obj_file",
            "ply_header",
            "read_back",
            "zstd_frames",
        )
    },
    "modifiers.py": NATIVE,
    "input_file.py": NATIVE | {"bpy", "bmesh", "numpy", ".asset_io"},
    "batch/report.py": NATIVE | {"bpy", "bmesh", ".asset_io"},
    "batch/stop_signals.py": NATIVE | {"bpy", "bmesh"},
    "batch/plan.py": NATIVE | {"bpy", "bmesh"},
    "batch/resume.py": {"bmesh"},
    "targets.py": NATIVE | BRIDGES,
    "panel.py": NATIVE | BRIDGES,
    "menu.py": NATIVE | BRIDGES,
    "preferences.py": NATIVE | BRIDGES,
    "properties.py": NATIVE | BRIDGES,
}


@pytest.mark.skipif(not PYTHON, reason="there is no add-on in this tree")
@pytest.mark.parametrize("file", PYTHON, ids=lambda f: str(f.relative_to(ROOT)))
def test_python_layers(file):
    names = tops(imports(file))
    folder, key, *rest = file.relative_to(ROOT).parts
    if folder == "addon":
        assert not names & (NEVER.get(key, set()) | NEVER.get("/".join([key, *rest]), set()))
        if key in PLAIN_MAY_IMPORT:
            assert names - set(sys.stdlib_module_names) <= PLAIN_MAY_IMPORT[key]
    if (folder, key) != ("addon", "engine.py"):
        assert "ble_unwrap_native" not in names, "only addon/engine.py talks to the native module"
    if folder == "addon":
        # An extension's absolute name varies with the repository it is installed from.
        allowed = {"bpy", "bmesh", "mathutils", "numpy", "addon_utils", "bl_ext", "gpu", "ble_unwrap_native"}
        allowed |= {"io_scene_gltf2"}  # of Blender's own
        foreign = {n for n in names if not n.startswith(".")} - allowed - set(sys.stdlib_module_names)
        assert not foreign, "an extension has only Blender's Python; its own modules are imported relatively"


PACKAGE = ROOT / "native/ble_unwrap_native/python/ble_unwrap_native"
# Module of the Python package around the native one -> what it may import besides the standard library. Blender's
# Python has no scikit-learn, and the package shall load where there is no NumPy either.
PACKAGE_MAY_IMPORT = {
    "__init__.py": {"._native"},
    "estimator.py": {".", "joblib", "numpy", "scipy", "sklearn"},
}


@pytest.mark.parametrize("file", sorted(PACKAGE.glob("*.py")), ids=lambda f: f.name)
def test_package_layers(file):
    assert file.name in PACKAGE_MAY_IMPORT, "the module is not in the table of layers"
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"), str(file))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add("." * node.level + (node.module or "") if node.level else node.module.split(".")[0])
    assert found - set(sys.stdlib_module_names) <= PACKAGE_MAY_IMPORT[file.name]


# The test itself ----------------------------------------------------------------------------------------------------


def test_use_trees_are_read():
    tree = "crate::{mesh::{TriMesh, FaceId as F}, progress::Cancelled, settings}"
    assert use_tree(tree) == [
        ("crate", "mesh", "TriMesh"),
        ("crate", "mesh", "FaceId"),
        ("crate", "progress", "Cancelled"),
        ("crate", "settings"),
    ]
    assert absolute(("super", "super", "mesh", "X"), ("stretch", "newton")) == ("mesh", "X")
    assert absolute(("super", "energy"), ("stretch", "newton")) == ("stretch", "energy")
    assert absolute(("std", "fmt"), ("stretch",)) is None


@pytest.mark.parametrize(
    ("path", "source", "offended"),
    [
        ("mesh/repair.rs", "use crate::linalg::solve;", True),
        ("mesh/repair.rs", "use crate::progress::Cancelled;", False),
        ("mesh/repair.rs", "#[cfg(test)]\nmod tests { use crate::packing::pack; }", False),
        ("linalg/sparse.rs", "fn f() { crate::mesh::measure::area() }", True),
        ("charts/extract.rs", "use crate::segmentation::Parts;", False),
        ("charts/extract.rs", "use crate::segmentation::segment;", True),
        ("charts/extract.rs", "use super::super::embedding::Chart;", True),
        ("charts/extract.rs", "// use crate::packing::pack;", False),
        ("packing/place.rs", "use crate::Settings;", True),
        ("unheard/of.rs", "", True),
    ],
)
def test_an_offence_is_found(path, source, offended, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "CORE", tmp_path)
    file = tmp_path / path
    file.parent.mkdir()
    file.write_text(source, encoding="utf-8")
    assert bool(offences(file, {"Settings": "settings"})) is offended
