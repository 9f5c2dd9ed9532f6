"""Draws pictures of `overlay_mesh` over the surfaces in a 3D view. Needs a window: the graphics card is asked.

Every vertex is moved towards the eye by a thousandth of its distance, which changes no place on the screen, so that
what is drawn is seen before the surface that it lies on, and behind whatever is before that.
"""

import gpu
import numpy as np
from mathutils import Matrix

# Of the distance from the eye. Edit mode's own edges lie so little before the surface that less has to do there.
FORWARD = {False: 1e-3, True: 1e-4}
LINE_FORWARD = 2e-3  # lines lie before what they border
CELLS = 32  # of the checker, along the shorter side of the texture
# Edit mode's own points and edges are seen through what is drawn.
ALPHA = {False: 1.0, True: 0.75}
# A line is seen on any colour: light with a dark border.
LINES = ((4.0, (0.02, 0.02, 0.02, 1.0)), (2.0, (1.0, 1.0, 1.0, 1.0)))

VERTEX = """
void main()
{
  place = pos;
  shade = value;
  gl_Position = projection * vec4(pos, 1.0);
}
"""
# A face that is seen at an angle is darker, so that the shape is seen. Its normal comes from neighbouring pixels.
# Colours are those of the screen, as in the legend, but what 3D views are drawn into takes linear ones.
LIGHT = """
vec4 in_linear_light(vec3 colour)
{
  vec3 high = pow((colour + 0.055) / 1.055, vec3(2.4));
  return vec4(mix(colour / 12.92, high, step(vec3(0.04045), colour)), alpha);
}

float light()
{
  vec3 normal = cross(dFdx(place), dFdy(place));
  vec3 look = eye.w > 0.0 ? eye.xyz - place : eye.xyz;
  float lengths = length(normal) * length(look);
  return lengths > 0.0 ? 0.72 + 0.28 * abs(dot(normal, look)) / lengths : 1.0;
}
"""
COLOURED = (
    LIGHT
    + """
void main()
{
  fragColor = in_linear_light(shade.rgb * light());
}
"""
)
# The mean of the checker over a pixel, so that it does not flicker where its squares are smaller than pixels; after
# Inigo Quilez, "Filtering the checkerboard pattern". Each eight squares have another tint: they show where in the
# texture a place is, and how large.
CHECKER = (
    LIGHT
    + """
float checker(vec2 cell, vec2 width)
{
  vec2 low = abs(fract((cell - 0.5 * width) * 0.5) - 0.5);
  vec2 high = abs(fract((cell + 0.5 * width) * 0.5) - 0.5);
  vec2 mean = 2.0 * (low - high) / width;
  return 0.5 - 0.5 * mean.x * mean.y;
}

void main()
{
  vec2 cell = shade * cells;
  vec2 width = max(fwidth(cell), vec2(1e-5));
  vec3 tint = mix(vec3(0.62, 0.80, 1.0), vec3(1.0, 0.82, 0.55), checker(cell / 8.0, width / 8.0));
  fragColor = in_linear_light(tint * mix(0.45, 0.95, checker(cell, width)) * light());
}
"""
)

_shaders = {}


def _shader(fill):
    name = "CHECKER" if fill == "CHECKER" else "COLOURED"
    if name not in _shaders:
        width = "VEC2" if name == "CHECKER" else "VEC4"
        between = gpu.types.GPUStageInterfaceInfo("ble_unwrap_overlay")
        between.smooth("VEC3", "place")
        between.smooth(width, "shade")
        info = gpu.types.GPUShaderCreateInfo()
        info.push_constant("MAT4", "projection")
        info.push_constant("VEC4", "eye")
        info.push_constant("FLOAT", "alpha")
        if name == "CHECKER":  # what a shader does not use it does not have
            info.push_constant("VEC2", "cells")
        info.vertex_in(0, "VEC3", "pos")
        info.vertex_in(1, width, "value")
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "fragColor")
        info.vertex_source(VERTEX)
        info.fragment_source(CHECKER if name == "CHECKER" else COLOURED)
        _shaders[name] = gpu.shader.create_from_info(info)
    return _shaders[name]


def draw(context, shown, fill, seams, texture_size):
    """Draws what was kept of objects, (kept, matrix, whether it is edited) each, in the 3D view of the context."""
    region = context.region_data
    before = {name: getattr(gpu.state, f"{name}_get")() for name in ("blend", "depth_test", "depth_mask")}
    try:
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.blend_set("ALPHA")
        if fill:
            gpu.state.depth_mask_set(True)
            for kept, matrix, edited in shown:
                _draw_surface(region, kept, matrix, fill, edited, texture_size)
        if seams:
            gpu.state.depth_mask_set(False)
            for kept, matrix, _ in shown:
                _draw_lines(context, kept, matrix)
    finally:
        for name, value in before.items():
            getattr(gpu.state, f"{name}_set")(value)


def nearer(region, share):
    """The projection of a view with everything moved towards the eye by this share of its distance."""
    if region.is_perspective:
        return region.window_matrix @ Matrix.Diagonal((1.0 - share, 1.0 - share, 1.0 - share, 1.0))
    return region.window_matrix @ Matrix.Translation((0.0, 0.0, share * region.view_distance))


def _draw_surface(region, kept, matrix, fill, edited, texture_size):
    shader = _shader(fill)
    batch = kept.batches.get("surface")
    if batch is None:
        batch = kept.batches["surface"] = _surface_batch(shader, kept.picture)
    in_object = matrix.inverted_safe()
    backwards = region.view_matrix.inverted_safe()
    if region.is_perspective:
        eye = (*(in_object @ backwards.translation), 1.0)
    else:
        eye = (*(in_object.to_3x3() @ backwards.col[2].to_3d()), 0.0)
    shader.bind()
    shader.uniform_float("projection", nearer(region, FORWARD[edited]) @ region.view_matrix @ matrix)
    shader.uniform_float("eye", eye)
    shader.uniform_float("alpha", ALPHA[edited])
    if fill == "CHECKER":
        shader.uniform_float("cells", [CELLS * side / min(texture_size) for side in texture_size])
    batch.draw(shader)


def _surface_batch(shader, picture):
    values = picture.uv if picture.colours is None else picture.colours
    form = gpu.types.GPUVertFormat()
    form.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
    form.attr_add(id="value", comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(form, len(values))
    vertices.attr_fill("pos", np.ascontiguousarray(picture.positions))
    vertices.attr_fill("value", np.ascontiguousarray(values))
    corners = gpu.types.GPUIndexBuf(type="TRIS", seq=picture.triangles)
    return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=corners)


def _draw_lines(context, kept, matrix):
    if not len(kept.picture.lines):
        return
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    batch = kept.batches.get("lines")
    if batch is None:
        form = gpu.types.GPUVertFormat()
        form.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
        ends = gpu.types.GPUVertBuf(form, len(kept.picture.lines))
        ends.attr_fill("pos", np.ascontiguousarray(kept.picture.lines))
        batch = kept.batches["lines"] = gpu.types.GPUBatch(type="LINES", buf=ends)
    region = context.region_data
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_projection_matrix(nearer(region, LINE_FORWARD))
        gpu.matrix.load_matrix(region.view_matrix @ matrix)
        shader.bind()
        shader.uniform_float("viewportSize", (context.region.width, context.region.height))
        for width, colour in LINES:
            shader.uniform_float("lineWidth", width)
            shader.uniform_float("color", colour)
            batch.draw(shader)
