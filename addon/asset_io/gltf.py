"""glTF through Blender, so that what it leaves out by itself is kept: options by what the source file has."""

from pathlib import Path

import bpy

from . import gltf_file
from .formats import file_format, listed

FORMATS = ("glb", "gltf")
# Bits to which Draco rounds. UVs keep single precision's: with its default of 12 charts would touch and flip.
DRACO_BITS = {"position": 20, "normal": 14, "texcoord": 24, "color": 10, "generic": 16}


def source_document(source):
    """The JSON of the file that the scene is from; an empty one where that is no glTF."""
    if source is None or file_format(source) not in FORMATS:
        return {}
    return gltf_file.read_document(source)[0]


def export(name, *, separate, source):
    """Writes the scene by Blender's exporter; returns the operator's result."""
    options = {"export_format": "GLTF_SEPARATE" if separate else "GLB", "check_existing": False}
    options |= dict.fromkeys(("export_cameras", "export_lights", "export_extras", "export_attributes"), True)
    if separate:  # images of one name in several assets of a folder would replace each other
        options["export_texture_dir"] = f"{Path(name).stem}_textures"
    document = source_document(source)
    if gltf_file.entries(document, "skins"):
        # The importer takes the bind pose for the rest pose, and the nodes' own for the pose: that is what to write.
        options["export_rest_position_armature"] = False
    attributes = {name for _, primitive in gltf_file.primitives(document) for name in gltf_file.attributes(primitive)}
    if "JOINTS_1" in attributes:
        options["export_all_influences"] = True
    if gltf_file.uses(document, gltf_file.INSTANCING):
        options["export_gpu_instances"] = True
    if gltf_file.uses(document, gltf_file.DRACO) and _can_compress():
        options["export_draco_mesh_compression_enable"] = True
        options |= {f"export_draco_{kind}_quantization": bits for kind, bits in DRACO_BITS.items()}
    if "COLOR_0" in attributes:
        options |= {"export_vertex_color": "ACTIVE", "export_all_vertex_colors": True}
    known = bpy.ops.export_scene.gltf.get_rna_type().properties
    return bpy.ops.export_scene.gltf(filepath=name, **{key: options[key] for key in options if key in known})


def _can_compress():
    """Whether this Blender has the library that compresses meshes."""
    try:
        from io_scene_gltf2.io.com.draco import dll_exists
    except ImportError:
        return False
    return dll_exists(quiet=True)


def changes(source, path):
    """What a glTF source has and the glTF file written from it has not, or has rounded, as notes."""
    if source is None or not {file_format(source), file_format(path)} <= set(FORMATS):
        return []
    before, after = (gltf_file.inventory(gltf_file.read_document(file)[0]) for file in (source, path))
    notes = [
        f"of the input's {count} {what} the output has {after[what] or 'none'}"
        for what, count in before.items()
        if what != "extensions" and after[what] < count
    ]
    gone = before["extensions"] - after["extensions"]
    if gltf_file.DRACO in gone:
        notes.append("the input's compression by Draco was undone")
    if gltf_file.INSTANCING in gone:
        notes.append("the input's GPU instances were expanded to objects")
    if gltf_file.DRACO in after["extensions"]:
        uv, position = DRACO_BITS["texcoord"], DRACO_BITS["position"]
        notes.append(f"compressed by Draco as the input was: UVs rounded to {uv} bits, positions to {position}")
    gone -= {gltf_file.DRACO, gltf_file.INSTANCING}
    if gone:
        notes.append(f"the output is without the input's {listed(sorted(gone))}, which Blender does not write")
    return notes
