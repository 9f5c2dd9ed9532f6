"""What an artist has marked or painted on a mesh, and what the operator makes of it."""

import bpy
import numpy as np
import pytest
from scenes import add_mesh, assert_good, certificate, cube, edit, fingerprint, grid, is_cut, select, sphere

unwrap = bpy.ops.uv.ble_unwrap


def cut_columns(obj, cells):
    """Seams along the middle line of a grid."""
    mesh = obj.data
    middle = cells // 2
    for edge in mesh.edges:
        edge.use_seam = all(vertex // (cells + 1) == middle for vertex in edge.vertices)


def test_existing_seams_are_cut_unless_told_not_to():
    obj = grid(6)
    cut_columns(obj, 6)
    seams = [edge.index for edge in obj.data.edges if edge.use_seam]
    assert len(seams) == 6
    unwrap()
    assert all(is_cut(obj, index) for index in seams)
    assert_good(obj)
    unwrap(use_seams=False)  # borders may follow them, but there need not be any
    assert not any(is_cut(obj, index) for index in seams)


def marked_cap(kind):
    """A sphere whose upper third is marked off by seams, sharp edges or a material of its own; the edges around it."""
    obj = sphere()
    mesh = obj.data
    slanted = np.array([0.5, 0.3, 0.8])  # along no axis, where borders might be by themselves
    upper = {face.index for face in mesh.polygons if slanted @ face.center > 0.35}
    sides = {}
    for face in mesh.polygons:
        for key in face.edge_keys:
            sides.setdefault(key, set()).add(face.index in upper)
    around = [edge for edge in mesh.edges if len(sides[tuple(sorted(edge.vertices))]) == 2]
    for edge in around:
        edge.use_seam, edge.use_edge_sharp = kind == "seams", kind == "sharp"
    if kind == "materials":
        for name in ("Lower", "Upper"):
            mesh.materials.append(bpy.data.materials.new(name))
        for index in upper:
            mesh.polygons[index].material_index = 1
    return obj, [edge.index for edge in around]


@pytest.mark.parametrize("kind", ["seams", "sharp", "materials"])
def test_borders_follow_what_is_marked_unless_told_not_to(kind):
    obj, around = marked_cap(kind)
    before = fingerprint(obj)
    share = {}
    for follow in (True, False):
        unwrap(**{f"follow_{kind}": follow}, use_seams=False)
        assert_good(obj)
        share[follow] = sum(is_cut(obj, index) for index in around) / len(around)
    assert share[True] > 0.9 > 0.6 > share[False], share
    assert fingerprint(obj) == before


@pytest.mark.parametrize("kind", ["seams", "sharp", "materials"])
def test_all_that_is_marked_is_cut_where_that_is_wished(kind):
    obj, around = marked_cap(kind)
    before = fingerprint(obj)
    unwrap(**{f"use_{kind}": True})
    assert_good(obj)
    assert all(is_cut(obj, index) for index in around)
    assert fingerprint(obj) == before


def painted_ball(kind):
    """A ball with half of it in a vertex group or an attribute of the name "Painted"."""
    obj = sphere(cells=10)
    for vertex in obj.data.vertices:  # neither side is like the other
        x, y, z = vertex.co
        vertex.co *= 1 + 0.25 * np.sin(3 * x + 1) * np.cos(2 * y + 0.5) + 0.2 * np.sin(4 * z + x)
    half = [v.index for v in obj.data.vertices if v.co.x > 0.1 * obj.dimensions.x]
    if kind == "group":
        obj.vertex_groups.new(name="Painted").add(half, 1.0, "REPLACE")
    else:
        attribute = obj.data.attributes.new("Painted", "FLOAT", "POINT")
        for index in half:
            attribute.data[index].value = 1.0
    return obj, set(half)


def seam_share(obj, vertices):
    """The share of the seams' edges that lie between these vertices."""
    cut = [edge for edge in obj.data.edges if is_cut(obj, edge.index)]
    return sum(vertices.issuperset(edge.vertices) for edge in cut) / len(cut)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("kind", ["group", "attribute"])
def test_seams_keep_away_from_what_is_painted_or_run_there(kind, mode):
    obj, half = painted_ball(kind)
    before = fingerprint(obj)
    share = {}
    for name in ("seams_away", "seams_here"):
        if mode == "EDIT":
            edit(obj)
        unwrap(**{name: "Painted"})
        bpy.ops.object.mode_set(mode="OBJECT")
        share[name] = seam_share(obj, half)
        assert_good(obj)
    assert share["seams_away"] < 0.1 < 0.6 < share["seams_here"], share
    if mode == "OBJECT":
        assert fingerprint(obj) == before


def test_what_is_painted_stays_at_its_vertices_where_some_faces_of_several_objects_are_unwrapped(addon):
    painted, half = painted_ball("group")
    plain = sphere("Plain", cells=4)
    edit(painted, plain, faces=np.arange(0, len(painted.data.polygons), 3))
    chosen = addon("mesh_bridge").gather([painted, plain], only_selected=True, seams_away="Painted")
    count = len(chosen.positions)
    assert chosen.seam_weights.shape == (count,)
    of_painted = np.unique(chosen.corner_vertices[chosen.parts[0].corners])
    assert 0 < len(of_painted) < min(count, len(painted.data.vertices))
    faces = [painted.data.polygons[face].vertices for face in chosen.parts[0].source_faces]
    is_half = np.isin(sorted({vertex for face in faces for vertex in face}), sorted(half))
    np.testing.assert_allclose(chosen.seam_weights[of_painted], np.where(is_half, 10.0, 1.0), rtol=1e-6)
    others = np.setdiff1d(np.arange(count), of_painted)
    assert (chosen.seam_weights[others] == 1.0).all()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_painted_group_that_is_not_there_is_named():
    painted_ball("group")
    unwrap(seams_away="Painted", seams_here="Nowhere")
    texts = [text for status, text in certificate() if status == "WARN"]
    assert any('"Nowhere"' in text and '"Painted"' not in text for text in texts), texts


def test_edges_over_an_angle_are_cut():
    obj = cube()
    unwrap(use_sharp=True, sharp_angle=89.0)
    assert all(is_cut(obj, edge.index) for edge in obj.data.edges)
    assert_good(obj)
    for angle in (91.0, 180.0):
        unwrap(use_sharp=True, sharp_angle=angle)
        assert not all(is_cut(obj, edge.index) for edge in obj.data.edges)


def test_only_edges_between_two_faces_with_area_are_sharp_by_their_angle(addon):
    mesh = bpy.data.meshes.new("Corner")
    # Two squares at a right angle, a triangle without area beside the first, and an edge of no face.
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1), (0, 0.5, 0), (5, 5, 5), (6, 5, 5)]
    mesh.from_pydata(points, [(7, 8)], [(0, 1, 2, 3), (1, 4, 5, 2), (0, 3, 6)])
    marks = addon("mesh_bridge").read_mesh(mesh, None, 60.0)["marks"]
    assert [sorted(edge) for edge in marks["sharp"].tolist()] == [[1, 2]]
    assert not len(addon("mesh_bridge").read_mesh(mesh, None, 91.0)["marks"]["sharp"])


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_angles_are_those_of_the_shape_that_is_seen(addon, mode):
    """A roof of 2 × 20° that is scaled to three times its height is one of 2 × 47.5°, also mirrored and turned."""
    height = float(np.tan(np.radians(20.0)))
    points = [(-1, 0, 0), (-1, 1, 0), (0, 0, height), (0, 1, height), (1, 0, 0), (1, 1, 0)]
    obj = add_mesh("Roof", points, [(0, 2, 3, 1), (2, 4, 5, 3)])
    edit(obj) if mode == "EDIT" else select(obj)

    def is_sharp(angle):
        bpy.context.view_layer.update()
        sharp = addon("mesh_bridge").gather([obj], sharp_angle=angle).marks["sharp"]
        assert [sorted(edge) for edge in sharp.tolist()] in ([], [[2, 3]])
        return len(sharp) == 1

    assert is_sharp(39.9) and not is_sharp(40.1)
    seen = 2 * float(np.degrees(np.arctan(3.0 * height)))
    obj.rotation_euler = (0.4, 0.3, 0.9)
    for scale in ((1, 1, 3), (-1, 1, 3), (2, 2, 6)):
        obj.scale = scale
        assert is_sharp(seen - 0.1) and not is_sharp(seen + 0.1)


def test_marks_of_selected_faces_are_read(addon):
    obj, around = marked_cap("seams")
    bridge = addon("mesh_bridge")
    whole = bridge.gather([obj])
    assert {kind: len(edges) for kind, edges in whole.marks.items()} == {
        "seams": len(around),
        "sharp": 0,
        "materials": 0,
    }
    edit(obj, faces=[face.index for face in obj.data.polygons if face.center.z > -0.7])
    part = bridge.gather([obj], only_selected=True)
    ends = [selection.positions[selection.marks["seams"]] for selection in (whole, part)]
    assert np.array_equal(np.sort(ends[0].reshape(-1, 6), axis=0), np.sort(ends[1].reshape(-1, 6), axis=0))
    assert part.marked(()) is None and part.marked(("sharp",)) is None
    bpy.ops.object.mode_set(mode="OBJECT")


def test_seams_of_the_result_are_marked_on_request():
    obj = cube()
    unwrap(mark_seams=True)
    for edge in obj.data.edges:
        assert edge.use_seam == is_cut(obj, edge.index)
    assert any(edge.use_seam for edge in obj.data.edges)
