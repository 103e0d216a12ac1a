# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws over the scene: colours on an object's surface, lines, a legend; and a level while its slider is dragged."""

from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix

from ..operators import shown
from ..operators.colors import ramp
from ..operators.shown import Overlay

_CLAY = (0.72, 0.74, 0.78, 1.0)
# The facets are lit by their own normals, so that none has to be made; nearer by a hair than the mesh below.
_VERTEX = """
void main() {
  vec4 at = view * vec4(pos, 1.0);
  place = at.xyz;
  tint = color;
  gl_Position = projection * at;
  gl_Position.z -= 0.0004 * gl_Position.w;
}
"""
_FRAGMENT = """
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.35 + 0.65 * abs(normal.z);
  result = vec4(pow(tint.rgb * light, vec3(2.2)), tint.a);
}
"""
_shaders: dict[str, Any] = {}


def _surface_shader() -> Any:  # noqa: ANN401 - gpu has no stubs
    if "surface" not in _shaders:
        link = gpu.types.GPUStageInterfaceInfo("eso_surface")
        link.smooth("VEC3", "place")
        link.smooth("VEC4", "tint")
        info = gpu.types.GPUShaderCreateInfo()
        info.push_constant("MAT4", "view")
        info.push_constant("MAT4", "projection")
        info.vertex_in(0, "VEC3", "pos")
        info.vertex_in(1, "VEC4", "color")
        info.vertex_out(link)
        info.fragment_out(0, "VEC4", "result")
        info.vertex_source(_VERTEX)
        info.fragment_source(_FRAGMENT)
        _shaders["surface"] = gpu.shader.create_from_info(info)
    return _shaders["surface"]


def _surface_batch(overlay: Overlay) -> Any:  # noqa: ANN401
    if "surface" not in overlay.cache:
        colors = overlay.colors
        if colors is None:
            colors = np.broadcast_to(np.array(_CLAY, np.float32), (len(overlay.vertices), 4))
        layout = gpu.types.GPUVertFormat()
        layout.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
        layout.attr_add(id="color", comp_type="F32", len=4, fetch_mode="FLOAT")
        buffer = gpu.types.GPUVertBuf(layout, len(overlay.vertices))
        buffer.attr_fill("pos", np.ascontiguousarray(overlay.vertices, np.float32))
        buffer.attr_fill("color", np.ascontiguousarray(colors, np.float32))
        index = gpu.types.GPUIndexBuf(type="TRIS", seq=np.ascontiguousarray(overlay.faces, np.uint32))
        overlay.cache["surface"] = gpu.types.GPUBatch(type="TRIS", buf=buffer, elem=index)
    return overlay.cache["surface"]


def _line_batches(overlay: Overlay, shader: Any) -> list[Any]:  # noqa: ANN401
    if "lines" not in overlay.cache:
        overlay.cache["lines"] = [
            (color, batch_for_shader(shader, "LINES", {"pos": np.ascontiguousarray(ends.reshape(-1, 3), np.float32)}))
            for _, color, ends in overlay.lines
            if len(ends)
        ]
    return overlay.cache["lines"]


def draw_scene() -> None:
    """Draw surface and lines, in the viewport's space."""
    overlay, context = shown.shown(), bpy.context
    obj = context.scene.objects.get(overlay.name) if overlay else None
    if overlay is None or obj is None or not (overlay.kind == "level" or obj.visible_get()):
        return
    region = context.region_data
    gpu.state.depth_test_set("LESS_EQUAL")
    if len(overlay.faces) and (overlay.colors is not None or overlay.kind == "level"):
        gpu.state.depth_mask_set(True)
        shader = _surface_shader()
        shader.bind()
        shader.uniform_float("view", region.view_matrix @ obj.matrix_world)
        shader.uniform_float("projection", region.window_matrix)
        _surface_batch(overlay).draw(shader)
        gpu.state.depth_mask_set(False)
    if overlay.lines:
        _draw_lines(overlay, obj, region)
    gpu.state.depth_test_set("NONE")


def _draw_lines(overlay: Overlay, obj: bpy.types.Object, region: bpy.types.RegionView3D) -> None:
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.multiply_matrix(obj.matrix_world)
        gpu.matrix.load_projection_matrix(_pulled(region.window_matrix))
        for color, batch in _line_batches(overlay, shader):
            shader.bind()
            shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
            shader.uniform_float("lineWidth", 2.5)
            shader.uniform_float("color", color)
            batch.draw(shader)


def _pulled(projection: Matrix) -> Matrix:
    """Give a projection that puts everything a hair nearer."""
    pulled = projection.copy()
    pulled[2] = projection[2] - 0.0008 * projection[3]
    return pulled


def draw_legend() -> None:
    """Draw what the colours mean, below on the left."""
    overlay = shown.shown()
    if overlay is None or not (overlay.title or overlay.lines) or bpy.context.region.type != "WINDOW":
        return
    scale = bpy.context.preferences.system.ui_scale or 1.0
    left, bottom = 90 * scale, 70 * scale
    if overlay.colors is not None:
        _draw_ramp(left, bottom, 180 * scale, 14 * scale)
        _write(overlay.low, left, bottom - 18 * scale, scale)
        _write(overlay.high, left + 180 * scale, bottom - 18 * scale, scale, right=True)
        bottom += 24 * scale
    for label, color, _ in overlay.lines:
        _draw_box(left, bottom, 24 * scale, 4 * scale, [color] * 2)
        _write(label, left + 32 * scale, bottom - 4 * scale, scale)
        bottom += 20 * scale
    _write(bpy.app.translations.pgettext_iface(overlay.title), left, bottom, scale)


def _draw_ramp(left: float, bottom: float, width: float, height: float) -> None:
    colors = ramp(np.linspace(0, 1, 33), 0.0, 1.0)
    _draw_box(left, bottom, width, height, colors.tolist())


def _draw_box(left: float, bottom: float, width: float, height: float, colors: list[Any]) -> None:
    """Draw a box whose colours go from left to right."""
    across = np.linspace(left, left + width, len(colors))
    points = [(float(x), y) for x in across for y in (bottom, bottom + height)]
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch = batch_for_shader(
        shader, "TRI_STRIP", {"pos": [(*p, 0.0) for p in points], "color": [c for c in colors for _ in (0, 1)]}
    )
    batch.draw(shader)


def _write(text: str, x: float, y: float, scale: float, *, right: bool = False) -> None:
    import blf  # only a window has it

    blf.size(0, 12 * scale)
    blf.color(0, 1, 1, 1, 1)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0, 0, 0, 0.8)
    blf.position(0, x - (blf.dimensions(0, text)[0] if right else 0), y, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)
