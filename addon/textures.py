"""Image textures of materials: which of them use a UV map, and what proportions they give a layout."""

from dataclasses import dataclass

import bpy

RATIO_TOLERANCE = 1e-3  # relative; sizes in whole pixels of images halved a few times differ by less


@dataclass(frozen=True)
class ImageUse:
    """An image texture that reads a UV map; `moved` where a Mapping node stands between them."""

    material: bpy.types.Material
    image: bpy.types.Image
    moved: bool


def image_uses(obj, map_name):
    """The image textures of an object's materials that read this UV map, the active material's first.

    With `map_name` None they are those that read the map for rendering, which is what a first UV map becomes.
    """
    rendered = next((layer.name for layer in obj.data.uv_layers if layer.active_render), None)
    names = {map_name} | ({""} if map_name in (None, rendered) else set())
    slots = [slot.material for slot in obj.material_slots if slot.material is not None]
    result = []
    for material in sorted(dict.fromkeys(slots), key=lambda material: material != obj.active_material):
        if material.node_tree is None:
            continue
        for node, parents in _image_nodes(material.node_tree, ()):
            for name, moved in _maps_read(node.inputs["Vector"], parents, False, set()):
                if name in names:
                    result.append(ImageUse(material, node.image, moved))
                    break
    return result


def _image_nodes(tree, parents):
    """Image texture nodes with an image, and the group nodes they are in, the outermost first."""
    for node in sorted(tree.nodes, key=lambda node: node != tree.nodes.active):
        if node.type == "TEX_IMAGE" and node.image is not None:
            yield node, parents
        elif node.type == "GROUP" and node.node_tree is not None and node not in parents:
            yield from _image_nodes(node.node_tree, (*parents, node))


def _maps_read(socket, parents, moved, seen):
    """(name, moved) of each UV map that a node's vector comes from; "" is the map for rendering."""
    if not socket.is_linked and socket.node.type == "TEX_IMAGE":
        yield "", moved
    for link in socket.links:
        node, output = link.from_node, link.from_socket
        if (node, output.identifier, parents) in seen:
            continue
        seen.add((node, output.identifier, parents))
        inputs, inside = node.inputs, parents
        if node.type == "UVMAP":
            yield node.uv_map, moved
        elif node.type == "TEX_COORD":
            if output.identifier == "UV":
                yield "", moved
        elif node.type == "ATTRIBUTE":
            yield node.attribute_name, moved
        elif node.type == "GROUP_INPUT":
            inputs = [entry for entry in parents[-1].inputs if entry.identifier == output.identifier] if parents else []
            inside = parents[:-1]
        elif node.type == "GROUP" and node.node_tree is not None:
            ends = [end for end in node.node_tree.nodes if end.type == "GROUP_OUTPUT" and end.is_active_output]
            inputs = [entry for end in ends for entry in end.inputs if entry.identifier == output.identifier]
            inside = (*parents, node)
        for entry in inputs:
            if entry.is_linked:
                yield from _maps_read(entry, inside, moved or node.type == "MAPPING", seen)


def replaced_note(obj, map_name):
    """A sentence about the textures that use a UV map which is to be replaced, or None where there are none.

    Blender's own test patterns are none: they fit any layout.
    """
    uses = [use for use in image_uses(obj, map_name) if not _is_pattern(use.image)]
    if not uses:
        return None
    first, more = uses[0], len({use.image for use in uses}) - 1
    others = f" and {more} more" if more else ""
    moved = ", and its Mapping node moves it" if any(use.moved for use in uses) else ""
    return (
        f"{obj.name}: the UV map {map_name} was replaced, which material {first.material.name} uses for the image "
        f"{first.image.name}{others}{moved}. Such an image no longer fits the surface; to keep the old map, undo, and "
        "set UV Map to By Name"
    )


def _is_pattern(image):
    return image.source == "GENERATED" and image.generated_type != "BLANK" and not image.is_dirty


def proportioned_size(objects, map_names, texture_size):
    """The texture's width and height in the proportions of the image that the objects' materials show, and a note.

    The first object's active material decides. A texture size that is not square was chosen, and stays; else the
    image's proportions win, the longer side being that of the texture size. The note is None where nothing changed.
    """
    width, height = texture_size
    if width != height:
        return texture_size, None
    ratios = {}
    for obj, map_name in zip(objects, map_names, strict=True):
        for use in image_uses(obj, map_name):
            x, y = (n * a for n, a in zip(use.image.size, use.image.display_aspect, strict=True))
            if x > 0 and y > 0:
                ratios.setdefault(use.image, x / y)
    if not ratios:
        return texture_size, None
    image, ratio = next(iter(ratios.items()))
    size = (width, max(1, round(width / ratio))) if ratio > 1 else (max(1, round(width * ratio)), width)
    mixed = any(abs(other - ratio) > RATIO_TOLERANCE * ratio for other in ratios.values())
    if size == texture_size and not mixed:
        return texture_size, None
    note = f"Laid out for {size[0]} × {size[1]} pixels, the proportions of the image {image.name}"
    return size, f"{note}; other images have other proportions" if mixed else note
