# SPDX-License-Identifier: GPL-3.0-or-later
"""Six views of textured meshes by Workbench, and how much the pictures of two versions differ from the original's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

Shown = Sequence[tuple[bpy.types.Object, bpy.types.Mesh, bpy.types.Mesh]]
_VIEWS = ((1, 0, 0.3), (-1, 0, 0.3), (0, 1, 0.3), (0, -1, 0.3), (0.3, 0.2, 1), (0.3, 0.2, -1))
_SIZE = 400


def rendered_difference(shown: Shown, folder: Path, name: str, light: str = "STUDIO") -> tuple[float, float]:
    """Render the original and two versions of it, and compare.

    Parameters
    ----------
    shown : sequence of (object, mesh, mesh)
    folder : Path
        Where the pictures go.
    name : str
        Of the pictures.
    light : str
        As Workbench has it: "STUDIO", or "FLAT" for the texture alone.

    Returns
    -------
    one, other : float
        Root mean square of the differences of colour from 0 to 1, over all pixels of six views.
    """
    folder.mkdir(parents=True, exist_ok=True)
    camera = _scene(shown)
    bpy.context.scene.display.shading.light = light
    originals = [obj.data for obj, _, _ in shown]
    for obj, _, _ in shown:
        if obj.data.shape_keys is not None:
            obj.show_only_shape_key, obj.active_shape_key_index = True, 0
    frame = _frame(shown)
    pictures = [_render(camera, frame, folder / f"{name}_original.png")]
    for which, title in ((1, "ours"), (2, "decimate")):
        for entry in shown:
            entry[0].data = entry[which]
        pictures.append(_render(camera, frame, folder / f"{name}_{title}.png"))
    for (obj, _, _), data in zip(shown, originals, strict=True):
        obj.data = data
    original, one, other = pictures
    return tuple(float(np.sqrt(((picture - original) ** 2).mean())) for picture in (one, other))  # type: ignore[return-value]


def _scene(shown: Shown) -> bpy.types.Object:
    scene = bpy.context.scene
    keep = {obj for obj, _, _ in shown}
    for obj in scene.objects:
        obj.hide_render = obj not in keep
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type = "ORTHO"
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.shading.color_type = "TEXTURE"
    scene.display.render_aa = "5"
    scene.render.resolution_x = scene.render.resolution_y = _SIZE
    scene.render.film_transparent = False
    scene.view_settings.view_transform = "Standard"
    return camera


def _frame(shown: Shown) -> tuple[np.ndarray, float]:
    """Return where the originals are, and how large: every version is seen from the same place."""
    corners = np.array([obj.matrix_world @ Vector(corner) for obj, _, _ in shown for corner in obj.bound_box])
    return (corners.min(axis=0) + corners.max(axis=0)) / 2, np.ptp(corners, axis=0).max() * 0.6


def _render(camera: bpy.types.Object, frame: tuple[np.ndarray, float], path: Path) -> np.ndarray:
    """Render six views side by side, and give their pixels."""
    center, radius = frame
    camera.data.ortho_scale = 2 * radius
    camera.data.clip_end = 10 * radius
    images = []
    for view in _VIEWS:
        direction = Vector(view).normalized()
        camera.location = Vector(center) + direction * radius * 4
        camera.rotation_euler = direction.to_track_quat("Z", "Y").to_euler()
        bpy.context.scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(str(path))
        pixels = np.zeros(_SIZE * _SIZE * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        images.append(pixels.reshape(_SIZE, _SIZE, 4))
    sheet = np.concatenate([np.concatenate(images[:3], axis=1), np.concatenate(images[3:], axis=1)])
    picture = bpy.data.images.new(path.stem, sheet.shape[1], sheet.shape[0])
    picture.pixels.foreach_set(sheet.ravel())
    picture.filepath_raw = str(path)
    picture.file_format = "PNG"
    picture.save()
    return sheet[..., :3]
