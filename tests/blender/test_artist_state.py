"""What an artist has set in Blender, and what an unwrap does with it: seams, selections, pins, images, UV maps."""

import bmesh
import bpy
import numpy as np
import pytest
from scenes import (
    assert_good,
    certificate,
    cube,
    edit,
    grid,
    is_cut,
    select,
    set_uvs,
    sphere,
    surface_areas,
    triangle_areas,
    uvs,
)

unwrap = bpy.ops.uv.ble_unwrap
SYNC_IN_MESH = hasattr(bmesh.types.BMFace, "uv_select")  # 5.0 and later keep the UV selection with the mesh


def warnings():
    return [text for status, text in certificate() if status == "WARN"]


def seams(obj):
    found = np.empty(len(obj.data.edges), bool)
    obj.data.edges.foreach_get("use_seam", found)
    return found


def chart_count():
    return certificate()[0][1].split(" in ")[1]


# Seams --------------------------------------------------------------------------------------------------------------


def bent(cells=10):
    """A ball that several charts are needed for, under a low limit."""
    return sphere(cells=cells)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_marking_seams_five_times_gives_the_same(mode):
    obj = bent()
    if mode == "EDIT":
        edit(obj)
    results = []
    for _ in range(5):
        unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
        charts = chart_count()
        bpy.ops.object.mode_set(mode="OBJECT")
        results.append((charts, seams(obj).tobytes(), uvs(obj).tobytes()))
        bpy.ops.object.mode_set(mode=mode)
    assert len(set(results)) == 1, [result[0] for result in results]
    bpy.ops.object.mode_set(mode="OBJECT")
    assert seams(obj).any()


def test_seams_of_the_artist_are_kept_apart_from_ours():
    obj = bent()
    unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
    ours = seams(obj)
    added = int(np.flatnonzero(~ours)[7])
    obj.data.edges[added].use_seam = True
    unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
    assert obj.data.edges[added].use_seam
    assert not unwrap(mark_seams=True, stretch_limit=1.5, stretch_price=0) - {"FINISHED"}
    after = seams(obj)
    assert obj.data.edges[added].use_seam, "the artist's seam is kept whatever the charts are"
    assert after.sum() < ours.sum(), "ours are replaced by those of fewer charts"


def test_our_seam_that_the_artist_clears_is_not_marked_again():
    obj = bent()
    unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
    ours = seams(obj)
    cleared = int(np.flatnonzero(ours)[3])
    obj.data.edges[cleared].use_seam = False
    for _ in range(2):
        unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
        expected = ours.copy()
        expected[cleared] = False
        assert np.array_equal(seams(obj), expected)
    obj.data.edges.foreach_set("use_seam", np.zeros(len(ours), bool))
    unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
    assert np.array_equal(seams(obj), ours), "who clears them all begins anew"


def test_seams_of_a_selection_leave_the_others_alone():
    obj = bent()
    unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
    before = seams(obj)
    chosen = [face.index for face in obj.data.polygons if face.center.z > 0]
    edit(obj, faces=chosen)
    unwrap(mark_seams=True, stretch_limit=1.3)
    bpy.ops.object.mode_set(mode="OBJECT")
    keys = {key: number for number, key in enumerate(tuple(sorted(edge.vertices)) for edge in obj.data.edges)}
    touched = {keys[tuple(sorted(key))] for index in chosen for key in obj.data.polygons[index].edge_keys}
    rest = np.array([number not in touched for number in range(len(before))])
    assert np.array_equal(seams(obj)[rest], before[rest])
    unwrap(mark_seams=True, stretch_limit=1.02, stretch_price=0)
    assert np.array_equal(seams(obj), before), "all of them were ours, and are replaced"


def test_a_cylinder_opens_at_its_marked_seams():
    """Along its length and around both caps: three charts, where the method alone finds one if stretch has no price."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=24)
    obj = bpy.context.object
    for layer in list(obj.data.uv_layers):
        obj.data.uv_layers.remove(layer)
    caps = {key for face in obj.data.polygons if len(face.vertices) > 4 for key in face.edge_keys}
    for edge in obj.data.edges:
        edge.use_seam = tuple(sorted(edge.vertices)) in caps
    upright = next(edge for edge in obj.data.edges if not edge.use_seam)
    upright.use_seam = True
    marked = np.flatnonzero(seams(obj))
    unwrap()
    assert chart_count() == "3 charts"
    assert all(is_cut(obj, index) for index in marked)
    unwrap(use_seams=False, follow_seams=False, stretch_price=0)
    assert chart_count() == "1 chart"


# Selections ---------------------------------------------------------------------------------------------------------


def select_uv_faces(obj, chosen):
    """Selects the UVs of these faces and of no others, as a click in the UV Editor does with Sync Selection off."""
    bpy.context.scene.tool_settings.use_uv_select_sync = False
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    layer = edit_mesh.loops.layers.uv.verify()
    for face in edit_mesh.faces:
        wanted = face.index in chosen
        if SYNC_IN_MESH:
            face.uv_select = wanted
        for loop in face.loops:
            if SYNC_IN_MESH:
                loop.uv_select_vert = loop.uv_select_edge = wanted
            else:
                loop[layer].select = loop[layer].select_edge = wanted
    bmesh.update_edit_mesh(obj.data)


@pytest.mark.parametrize("mode", ["VERTEX", "EDGE", "FACE"])
def test_faces_selected_in_the_uv_editor(mode):
    obj = grid(6, bump=0.3)
    unwrap()
    before = uvs(obj).copy()
    edit(obj)
    bpy.context.scene.tool_settings.uv_select_mode = mode
    chosen = {14, 15, 20, 21}
    select_uv_faces(obj, chosen)
    assert unwrap(by_uv=True) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = (uvs(obj) != before).any(axis=1)
    inside = np.repeat(np.isin(np.arange(36), list(chosen)), 4)
    assert not moved[~inside].any(), "120 corners of one eye, not 1,968 of the head"
    assert moved[inside].all()


def test_the_uv_selection_counts_in_the_uv_editor_without_sync_only(addon):
    by_uv = addon("faces").by_uv_selection

    class Context:
        """Stands for the context of a window, of which there is none here."""

        def __init__(self, area, mode, sync):
            self.area = area and type("Area", (), {"type": area})
            self.mode = mode
            settings = type("ToolSettings", (), {"use_uv_select_sync": sync})
            self.scene = type("Scene", (), {"tool_settings": settings})

    assert by_uv(Context("IMAGE_EDITOR", "EDIT_MESH", False))
    assert not by_uv(Context("IMAGE_EDITOR", "EDIT_MESH", True))
    assert not by_uv(Context("VIEW_3D", "EDIT_MESH", False))
    assert not by_uv(Context("IMAGE_EDITOR", "OBJECT", False))
    assert not by_uv(Context(None, "EDIT_MESH", False))


def test_without_uv_selection_nothing_is_unwrapped():
    obj = grid()
    unwrap()
    edit(obj)
    select_uv_faces(obj, set())
    with pytest.raises(RuntimeError, match="selected in the UV Editor"):
        unwrap(by_uv=True)
    assert unwrap() == {"FINISHED"}, "from the 3D view the faces count"


def test_hidden_faces_are_left_alone_in_edit_mode():
    obj = grid(6)
    unwrap()
    before = uvs(obj).copy()
    edit(obj, faces=[3, 4, 5])
    bpy.ops.mesh.hide()
    bpy.ops.mesh.select_all(action="DESELECT")
    assert unwrap(use_selection=False, rotation="NONE", margin=20.0) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    hidden = np.repeat(np.isin(np.arange(36), [3, 4, 5]), 4)
    moved = (uvs(obj) != before).any(axis=1)
    assert not moved[hidden].any() and moved[~hidden].any()
    edit(obj)
    bpy.ops.mesh.reveal()
    bpy.ops.mesh.hide()
    with pytest.raises(RuntimeError, match="All faces are hidden"):
        unwrap(use_selection=False)


def test_selection_history_and_active_face_are_kept():
    obj = grid(4)
    edit(obj)
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, True)
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    for sequence in (edit_mesh.verts, edit_mesh.faces):
        sequence.ensure_lookup_table()
    edit_mesh.select_history.clear()
    for element in (edit_mesh.verts[7], edit_mesh.faces[2], edit_mesh.verts[3]):
        edit_mesh.select_history.add(element)
    edit_mesh.faces.active = edit_mesh.faces[5]
    unwrap()
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    picked = [edit_mesh.select_history[number] for number in range(len(edit_mesh.select_history))]
    found = [(type(element).__name__, element.index) for element in picked]
    assert found == [("BMVert", 7), ("BMFace", 2), ("BMVert", 3)]
    assert edit_mesh.faces.active.index == 5


def test_uv_selection_is_kept():
    obj = grid(6)
    unwrap()
    edit(obj)
    select_uv_faces(obj, {1, 2})
    unwrap(by_uv=True)
    edit_mesh = bmesh.from_edit_mesh(obj.data)
    layer = edit_mesh.loops.layers.uv.verify()
    picked = [
        face.index
        for face in edit_mesh.faces
        if (face.uv_select if SYNC_IN_MESH else all(loop[layer].select for loop in face.loops))
    ]
    assert picked == [1, 2]


def test_overlap_with_faces_that_were_kept_is_told(addon):
    """Blender's own test finds it, so the report may not say that there is none."""
    obj = grid(6, bump=0.3)
    unwrap()
    edit(obj, faces=list(range(12)))
    unwrap()
    told = [text for text in warnings() if text.startswith("New charts overlap faces that were not unwrapped")]
    summary = next(text for _, text in certificate() if "overlap" in text)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert addon("comparison").overlapping_faces([obj]) > 0
    assert len(told) == 1 and not summary.endswith("none with faces that were not unwrapped")
    # Shrunk into a corner and unwrapped in its place, there is none, which is measured, too.
    values = uvs(obj).copy()
    inside = np.repeat(np.arange(36) < 12, 4)
    values[inside] *= 0.2
    values[~inside] = 0.5 + 0.5 * values[~inside]
    set_uvs(obj, values)
    edit(obj, faces=list(range(12)))
    unwrap(use_original_bounds=True)
    assert ["OK", "0 overlaps, none with faces that were not unwrapped"] in certificate()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert addon("comparison").overlapping_faces([obj]) == 0


def test_overlaps_are_not_searched_where_all_faces_were_unwrapped():
    cube()
    unwrap()
    assert ["OK", "0 overlaps"] in certificate()


def pin(obj, corners):
    layer = obj.data.uv_layers.active
    if hasattr(layer, "pin_ensure"):
        layer.pin_ensure()
    flags = np.zeros(len(obj.data.loops), bool)
    flags[corners] = True
    layer.pin.foreach_set("value", flags)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_pinned_uvs_are_refused_and_named(mode):
    obj = grid(4)
    unwrap()
    pin(obj, [20, 21])
    before = uvs(obj).copy()
    if mode == "EDIT":
        edit(obj)
    with pytest.raises(RuntimeError, match=r"Grid: 2 face corners are pinned in UVMap"):
        unwrap(margin=20.0)
    assert obj.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj), before)
    edit(obj, faces=[0, 1, 2])  # face 5 has the pins
    assert unwrap(margin=20.0) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(obj)[12:], before[12:]) and not np.array_equal(uvs(obj)[:12], before[:12])
    assert unwrap(move_pinned=True, margin=30.0) == {"FINISHED"}
    assert not np.array_equal(uvs(obj)[20:22], before[20:22])


def test_pins_of_another_map_are_no_hindrance():
    obj = grid(4)
    unwrap()
    pin(obj, [3])
    before = uvs(obj).copy()
    for _ in range(2):
        assert unwrap(uv_map="NEW", uv_map_name="baked", margin=20.0) == {"FINISHED"}
    assert np.array_equal(uvs(obj, "UVMap"), before)


# Images and maps ----------------------------------------------------------------------------------------------------


def textured(obj, size, *, name="Wood", mapping=False, uv_map=None, generated=False):
    """Gives an object a material with an image texture; returns the image."""
    image = bpy.data.images.new(f"{name}.png", *size)
    if generated:
        image.generated_type = "UV_GRID"
    else:
        image.pixels[0] = 0.25  # painted upon: not a test pattern
        image.update()
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # until 5.0
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    vector = texture.inputs["Vector"]
    if mapping:
        node = nodes.new("ShaderNodeMapping")
        links.new(node.outputs[0], vector)
        vector = node.inputs["Vector"]
    if uv_map is not None:
        node = nodes.new("ShaderNodeUVMap")
        node.uv_map = uv_map
        links.new(node.outputs[0], vector)
    elif mapping:
        links.new(nodes.new("ShaderNodeTexCoord").outputs["UV"], vector)
    obj.data.materials.append(material)
    return image


def pixel_extent(obj, size):
    """Width over height in pixels of a face that is square on the surface, for the worst one."""
    uv = uvs(obj) * size
    ratios = []
    for face in obj.data.polygons:
        a, b, c, _ = (uv[index] for index in face.loop_indices)
        ratios.append(np.linalg.norm(b - a) / np.linalg.norm(c - b))
    return max(max(ratios), 1 / min(ratios))


@pytest.mark.parametrize("size", [(256, 128), (100, 300)])
def test_squares_are_square_on_the_image(size):
    obj = grid(6)
    textured(obj, size)
    unwrap()
    assert pixel_extent(obj, size) == pytest.approx(1, abs=0.01)  # 2:1 without it: 340 by 679 pixels
    assert any("proportions of the image Wood.png" in text for status, text in certificate() if status == "INFO")
    unwrap(correct_aspect=False)
    assert pixel_extent(obj, (1, 1)) == pytest.approx(1, abs=0.01)


def test_a_texture_size_that_is_not_square_was_chosen():
    obj = grid(6)
    textured(obj, (256, 128))
    unwrap(texture_size=(512, 1024))
    assert pixel_extent(obj, (512, 1024)) == pytest.approx(1, abs=0.01)


def test_the_image_of_another_map_does_not_count():
    obj = grid(6)
    obj.data.uv_layers.new(name="old")
    textured(obj, (256, 128), uv_map="old")
    unwrap(uv_map="NEW", uv_map_name="baked")
    assert pixel_extent(obj, (1, 1)) == pytest.approx(1, abs=0.01)
    assert not warnings()


def test_the_active_material_decides_and_others_are_mentioned():
    obj = grid(6)
    textured(obj, (128, 128), name="Square")
    textured(obj, (256, 128), name="Wide")
    obj.active_material_index = 1
    unwrap()
    assert pixel_extent(obj, (256, 128)) == pytest.approx(1, abs=0.01)
    assert any("Wide.png; other images have other proportions" in text for _, text in certificate())


def test_a_comparison_is_made_at_the_proportions_of_the_image(addon):
    obj = grid(6)
    obj.data.uv_layers.new(name="UVMap")
    textured(obj, (256, 128))
    rows = addon("comparison").compare([obj], {}, angles=(66,))
    assert rows["ble_unwrap"]["l2"] == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("mapping", [False, True])
@pytest.mark.parametrize("uv_map", [None, "UVMap"])
def test_replacing_the_map_of_a_texture_is_told(mapping, uv_map):
    obj = cube()
    obj.data.uv_layers.new(name="UVMap")
    textured(obj, (64, 64), mapping=mapping, uv_map=uv_map)
    unwrap()
    (text,) = warnings()
    assert text.startswith("Cube: the UV map UVMap was replaced, which material Wood uses for the image Wood.png")
    assert ("Mapping node" in text) is mapping
    unwrap(uv_map="NEW", uv_map_name="baked")
    assert not warnings(), "another map: the texture keeps its own"


def test_textures_inside_groups_are_found(addon):
    obj = cube()
    for name in ("UVMap", "second"):
        obj.data.uv_layers.new(name=name)
    textured(obj, (64, 64))
    material = obj.data.materials[0]
    tree = bpy.data.node_groups.new("Placed", "ShaderNodeTree")
    tree.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector")
    entry, texture = tree.nodes.new("NodeGroupInput"), tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Inner.png", 32, 32)
    tree.links.new(entry.outputs[0], texture.inputs["Vector"])
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = tree
    source = material.node_tree.nodes.new("ShaderNodeUVMap")
    source.uv_map = "second"
    material.node_tree.links.new(source.outputs[0], group.inputs[0])
    found = {name: [use.image.name for use in addon("textures").image_uses(obj, name)] for name in ("UVMap", "second")}
    assert found == {"UVMap": ["Wood.png"], "second": ["Inner.png"]}


def test_a_test_pattern_is_no_texture_to_lose():
    obj = cube()
    obj.data.uv_layers.new(name="UVMap")
    textured(obj, (64, 64), generated=True)
    unwrap()
    assert not warnings()


def test_a_map_made_now_replaces_none():
    obj = cube()
    textured(obj, (64, 64))
    unwrap()
    assert not warnings()


def test_a_name_given_again_means_that_map():
    obj = cube()
    obj.data.uv_layers.new(name="UVMap")
    before = uvs(obj, "UVMap").copy()
    for _ in range(10):
        unwrap(uv_map="NEW", uv_map_name="baked")
    assert [layer.name for layer in obj.data.uv_layers] == ["UVMap", "baked"]  # 8 and an error before
    assert obj.data.uv_layers.active.name == "baked"
    assert np.array_equal(uvs(obj, "UVMap"), before)


@pytest.mark.parametrize("other", ["attribute", "vertex group"])
def test_a_name_that_other_data_has_gets_a_number_once(other):
    obj = cube()
    if other == "attribute":
        obj.data.attributes.new("baked", "FLOAT", "POINT")
    else:
        obj.vertex_groups.new(name="baked")
    for _ in range(10):
        unwrap(uv_map="NEW", uv_map_name="baked")
    assert [layer.name for layer in obj.data.uv_layers] == ["baked.001"]
    assert_good(obj)


def test_with_eight_maps_one_of_them_can_be_named():
    obj = cube()
    for number in range(8):
        obj.data.uv_layers.new(name=f"map {number}")
    before = uvs(obj, "map 0").copy()
    assert unwrap(uv_map="NEW", uv_map_name="map 5") == {"FINISHED"}
    assert obj.data.uv_layers.active.name == "map 5"
    assert np.array_equal(uvs(obj, "map 0"), before)
    assert (triangle_areas(obj, uvs(obj, "map 5")) > 0).all()


def test_density_is_even_on_the_image():
    obj = grid(8, bump=0.2)
    textured(obj, (512, 128))
    unwrap()
    density = triangle_areas(obj, uvs(obj)) * 512 * 128 / surface_areas(obj)
    assert density.std() / density.mean() < 0.3


def test_selected_and_other_objects_each_keep_their_own(addon):
    """Two meshes in edit mode, one with nothing chosen: only the other is written and listed."""
    first, second = grid(4, "First"), grid(4, "Second")
    select(first, second)
    unwrap()
    before = uvs(second).copy()
    edit(first, second)
    edit_mesh = bmesh.from_edit_mesh(second.data)
    for face in edit_mesh.faces:
        face.select_set(False)
    bmesh.update_edit_mesh(second.data)
    unwrap(margin=20.0)
    assert [obj.name for obj in addon("last_result").objects(bpy.context)] == ["First"]
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(uvs(second), before)
