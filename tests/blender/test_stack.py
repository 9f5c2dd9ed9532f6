"""Like parts whose charts lie on each other: written, measured, shown and marked."""

import bpy
import numpy as np
from scenes import add_mesh, certificate, edit, is_cut, select, set_uvs, triangle_areas, uvs

unwrap = bpy.ops.uv.ble_unwrap


def plank(name, place=(0.0, 0.0, 0.0), mirrored=False):
    """A board, askew and cut off aslant: not its own mirror image."""
    lower = np.array([(0, 0, 0), (3, 0, 0), (3.4, 1, 0), (0, 0.8, 0)])
    positions = np.concatenate([lower, lower + np.array([[0, 0, 0.3 + 0.1 * x + 0.2 * y] for x, y, _ in lower])])
    faces = [(3, 2, 1, 0), (4, 5, 6, 7), *((k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4))]
    if mirrored:
        positions *= (-1, 1, 1)
        faces = [face[::-1] for face in faces]
    return add_mesh(name, positions + place, faces)


def horned():
    """A blob that is its own mirror image in x = 0, along edges, with two horns on either side."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=20)
    obj = bpy.context.view_layer.objects.active
    for vertex in obj.data.vertices:
        x, y, z = vertex.co
        horns = sum(
            3.0 * np.exp(-10 * ((abs(x) - a) ** 2 + (y - b) ** 2 + (z - c) ** 2))
            for a, b, c in ((0.6, 0.64, 0.48), (0.8, -0.36, -0.48))
        )
        vertex.co *= 1 + 0.15 * y + 0.1 * np.sin(2 * z) + horns
    return obj


def texts():
    return [text for _, text in certificate()]


def test_equal_parts_share_their_pixels_and_that_is_no_overlap(addon):
    planks = [plank(f"Plank {k}", (0.0, 2.0 * k, 0.0)) for k in range(4)]
    select(*planks)
    unwrap()
    spread = [uvs(obj) for obj in planks]
    assert not any(np.array_equal(uv, spread[0]) for uv in spread[1:])
    assert not any("stack" in text for text in texts())
    assert unwrap(stack="EQUAL") == {"FINISHED"}
    stacked = [uvs(obj) for obj in planks]
    assert all(np.array_equal(uv, stacked[0]) for uv in stacked[1:])
    assert np.ptp(stacked[0], axis=0).min() > np.ptp(spread[0], axis=0).min()
    assert ["OK", "0 overlaps"] in certificate() and not any(status == "BAD" for status, _ in certificate())
    charts = texts()[0].rsplit(" in ")[-1].split()[0]
    assert f"{charts} in {int(charts) // 4} stack{'s' if int(charts) > 4 else ''}: they share their pixels" in texts()
    assert addon("comparison").overlapping_faces(planks) > 0, "Blender knows of no stacks"


def test_mirrored_parts_are_turned_over_as_wholes():
    planks = [plank("Left", (-1.0, 0.0, 0.0), mirrored=True), plank("Right"), plank("Other", (0.0, 3.0, 0.0))]
    for how, is_turned in (("EQUAL", False), ("MIRRORED", True)):
        select(*planks)
        unwrap(stack=how)
        left, right, other = (triangle_areas(obj, uvs(obj)) for obj in planks)
        assert (right > 0).all() and (other > 0).all()
        assert (left < 0).all() if is_turned else (left > 0).all()
        assert not any(status == "BAD" for status, _ in certificate())


def test_seams_are_marked_where_halves_meet():
    """Halves that lie on each other have the same UVs there, so UVs alone would not tell."""
    obj = horned()
    unwrap(stack="MIRRORED", mark_seams=True, stretch_limit=1.002, stretch_price=1000.0, front="NONE")
    assert any("stack" in text for text in texts())
    seams = np.zeros(len(obj.data.edges), bool)
    obj.data.edges.foreach_get("use_seam", seams)
    uv = uvs(obj)
    turned = triangle_areas(obj, uv) < 0
    face = np.array([triangle.polygon_index for triangle in obj.data.loop_triangles])
    side = np.zeros(len(obj.data.polygons), bool)
    side[face] = turned
    owners = {}
    for polygon in obj.data.polygons:
        for key in polygon.edge_keys:
            owners.setdefault(tuple(sorted(key)), set()).add(bool(side[polygon.index]))
    between = [edge.index for edge in obj.data.edges if len(owners[tuple(sorted(edge.vertices))]) == 2]
    assert len(between) > 0 and seams[between].all()
    assert any(not is_cut(obj, edge) for edge in between), "else this test says nothing"


def test_overlaps_of_a_stack_with_faces_that_stay_are_told():
    planks = [plank(f"Plank {k}", (0.0, 2.0 * k, 0.0)) for k in range(3)]
    select(*planks)
    bpy.ops.object.join()
    obj = bpy.context.view_layer.objects.active
    unwrap(stack="EQUAL")
    assert ["OK", "0 overlaps"] in certificate()
    for away, ending in ((0.0, "faces that were not unwrapped"), (5.0, "none with faces that were not unwrapped")):
        values = uvs(obj).copy()
        values[48:] = values[:24] + away
        set_uvs(obj, values)
        edit(obj, faces=list(range(12)))
        unwrap(stack="EQUAL")
        bpy.ops.object.mode_set(mode="OBJECT")
        assert any("stack" in text for text in texts())
        (told,) = (text for text in texts() if text.startswith("0 overlaps"))
        assert told.endswith(ending) and ("none" in told) == (away > 0)


def test_a_stack_is_told_in_one_line_and_the_certificate_holds(addon):
    report = addon("surface_report")
    measured = {"charts": 26, "faces": 90, "overlaps": 0, "flips": 0, "stacked": 24, "stacks": 3}
    found = report.certify(measured, margin=4)
    assert found.holds
    lines = [text for _, text in report.lines(found, margin=4, stretch_limit=1.1)]
    assert lines[:2] == ["90 faces in 26 charts", "24 in 3 stacks: they share their pixels"]
    assert report.summary(measured).startswith("26 charts (24 in 3 stacks), ")
    single = {**measured, "stacked": 2, "stacks": 1}
    assert report.summary(single).startswith("26 charts (2 in 1 stack), ")
