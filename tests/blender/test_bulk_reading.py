"""Meshes are read in bulk: operators run no more Python for a larger mesh."""

import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes

OPERATIONS = ("check", "unwrap", "pack", "align", "relax")


def painted_grid(cells):
    """A bumpy sheet in two islands, with a pin, marked edges and a painted vertex group."""
    obj = scenes.grid(cells=cells, bump=0.2)
    mesh = obj.data
    mesh.uv_layers.new(name="UVMap")
    corners = np.array([loop.vertex_index for loop in mesh.loops])
    places = np.array([tuple(vertex.co) for vertex in mesh.vertices])
    middle = np.repeat([face.center.x > 0.5 for face in mesh.polygons], 4)
    scenes.set_uvs(obj, 0.4 * places[corners, :2] + np.where(middle, 0.3, 0.0)[:, None])
    mesh.edges[3].use_seam = mesh.edges[5].use_edge_sharp = True
    obj.vertex_groups.new(name="painted").add(range(0, len(mesh.vertices), 2), 0.5, "REPLACE")
    return obj


def steps(function, package):
    """How many lines and calls of the add-on's Python a function takes."""
    folder = str(Path(sys.modules[package].__file__).parent)
    counted = [0]

    def trace(frame, event, _argument):
        if not frame.f_code.co_filename.startswith(folder):
            return None
        counted[0] += 1
        return trace

    def profile(frame, event, _argument):
        counted[0] += event == "c_call" and frame.f_code.co_filename.startswith(folder)

    before = sys.gettrace(), sys.getprofile()
    sys.settrace(trace)
    sys.setprofile(profile)
    try:
        function()
    finally:
        sys.settrace(before[0])
        sys.setprofile(before[1])
    return counted[0]


def run(addon, operation, obj):
    scene = bpy.context.scene
    if operation == "check":
        addon("map_check").check([obj], addon("properties").values(scene.ble_unwrap))
    elif operation == "unwrap":
        work = addon("run").Run([obj], {"seams_away": "painted", "mark_seams": True, "sharp_angle": 60.0})
        work.write(work.run())
    else:
        assert getattr(bpy.ops.uv, f"ble_unwrap_{operation}")() == {"FINISHED"}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_larger_mesh_takes_no_more_steps_of_python(addon, operation, mode):
    taken = []
    run(addon, operation, _ready(4, mode))  # what is loaded and kept by the first run is not counted
    for cells in (10, 20):
        obj = _ready(cells, mode)
        taken.append(steps(lambda obj=obj: run(addon, operation, obj), _package(addon)))
    # Connected pieces are found in rounds, of which a larger mesh takes a few more.
    assert abs(taken[1] - taken[0]) < 100, f"{taken} steps for 100 and 400 faces"


def _ready(cells, mode):
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    obj = painted_grid(cells)
    scenes.select(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    return obj


def _package(addon):
    return addon("registration").__package__


def test_the_count_of_steps_notices_a_loop_over_vertices(addon):
    """The test above can fail: code of the add-on that is run for each vertex is counted."""
    source = "def loop(vertices):\n for vertex in vertices:\n  vertex.index"
    names = {}
    exec(compile(source, str(Path(sys.modules[_package(addon)].__file__).parent / "loop.py"), "exec"), names)
    vertices = painted_grid(4).data.vertices
    counts = [steps(lambda n=n: names["loop"](vertices[:n]), _package(addon)) for n in (2, 25)]
    assert counts[1] - counts[0] >= 25 - 2


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_weights_of_a_vertex_group_are_those_of_the_vertices(addon, mode):
    """Also in a group whose name is that of an attribute, beside others, with shape keys and modifiers."""
    obj = scenes.grid(cells=5)
    obj.vertex_groups.new(name="other").add(range(20), 1.0, "REPLACE")
    # Blender gives a group no name of an attribute that is there; its own of positions does not count.
    group = obj.vertex_groups.new(name="position")
    weights = np.zeros(36, np.float32)
    for vertex in range(3, 36, 4):
        weights[vertex] = np.float32(vertex / 40)
        group.add([vertex], float(weights[vertex]), "REPLACE")
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Other").value = 1.0
    obj.modifiers.new("Subdivision", "SUBSURF")
    scenes.edit(obj) if mode == "EDIT" else scenes.select(obj)
    before = data_blocks()
    assert np.array_equal(addon("vertex_groups").weights(obj, group.name), weights)
    values, found = addon("painted").seam_weights(obj, group.name, "")
    assert found == {group.name} and np.allclose(values, 10.0**weights)
    assert data_blocks() == before and obj.mode == mode and len(obj.modifiers) == 1


def test_reading_a_mesh_in_edit_mode_leaves_nothing_behind(addon):
    obj = painted_grid(4)
    obj.shape_key_add(name="Basis")
    scenes.edit(obj)
    before = data_blocks()
    for operation in ("check", "pack"):
        run(addon, operation, obj)
    assert data_blocks() == before and obj.mode == "EDIT"


def data_blocks():
    kinds = ("meshes", "objects", "scenes", "node_groups", "shape_keys", "collections", "worlds")
    return {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}


def test_corners_are_told_apart_by_all_of_their_numbers(addon, monkeypatch):
    """Rows are sorted by a number that others may share: then, too, only equal rows are one."""
    islands = addon("uv_islands")
    rows = np.random.default_rng(3).integers(0, 5, (400, 3)).astype(np.uint32)
    number, count = islands._equal_rows(rows)
    _, expected = np.unique(rows, axis=0, return_inverse=True)
    assert count == expected.max() + 1 == len(set(zip(number, expected.reshape(-1), strict=True)))
    monkeypatch.setattr(islands, "_mixed", lambda rows: rows[:, 0].astype(np.uint64))
    number, count = islands._equal_rows(rows)
    assert count == expected.max() + 1 == len(set(zip(number, expected.reshape(-1), strict=True)))


def test_corners_at_one_vertex_are_one_place_only_where_their_uvs_are_equal(addon):
    """Four quads around a vertex of which two corners lie elsewhere in the map, at one place."""
    obj = scenes.grid(cells=2)
    selection = addon("mesh_bridge").gather([obj], target=None)
    uv = selection.positions[selection.corner_vertices][:, :2].copy()
    uv[8:] += np.float32(5.0)
    part = np.zeros(4, np.int32)
    place, island = addon("uv_islands").islands(
        selection.positions, selection.corner_vertices, selection.face_offsets, uv, part
    )
    _, expected = np.unique(np.column_stack([selection.corner_vertices, uv]), axis=0, return_inverse=True)
    pairs = set(zip(place.tolist(), expected.reshape(-1).tolist(), strict=True))
    assert len(pairs) == len(set(place.tolist())) == expected.max() + 1
    assert island.tolist() == [0, 0, 1, 1]
