# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape keys as displacements from the first of them, and back, with their settings, drivers and animation."""

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

_SETTINGS = ("slider_min", "slider_max", "mute", "lock_shape", "vertex_group", "interpolation", "value")


@dataclass(frozen=True, eq=False)
class ShapeKeys:
    """The shape keys of a mesh.

    Attributes
    ----------
    neutral : ndarray, (n, 3) float32
        The first of them, in object space.
    offsets : ndarray, (keys, n, 3) float32
        From the neutral shape.
    names : tuple of str
    frames : tuple of float
        Of absolute keys.
    relative_to : tuple of int
    settings : tuple of dict
    use_relative : bool
    eval_time : float
    source : bpy.types.Key
        For its drivers and animation.
    """

    neutral: NDArray[np.float32]
    offsets: NDArray[np.float32]
    names: tuple[str, ...]
    frames: tuple[float, ...]
    relative_to: tuple[int, ...]
    settings: tuple[dict[str, object], ...]
    use_relative: bool
    eval_time: float
    source: bpy.types.Key


def read_keys(mesh: bpy.types.Mesh) -> ShapeKeys | None:
    """Read the shape keys of a stored mesh; None if it has none."""
    if mesh.shape_keys is None or not len(mesh.shape_keys.key_blocks):
        return None
    return _keys_of(mesh.shape_keys, np.stack([_points(block) for block in mesh.shape_keys.key_blocks]))


def with_shapes(keys: ShapeKeys, shapes: NDArray[np.float32]) -> ShapeKeys:
    """Give the keys other shapes, (keys, n, 3): those that modifiers make of them."""
    return _keys_of(keys.source, shapes)


def _keys_of(key: bpy.types.Key, shapes: NDArray[np.float32]) -> ShapeKeys:
    blocks = list(key.key_blocks)
    return ShapeKeys(
        neutral=shapes[0],
        offsets=shapes - shapes[:1],
        names=tuple(block.name for block in blocks),
        frames=tuple(block.frame for block in blocks),
        relative_to=tuple(blocks.index(block.relative_key) for block in blocks),
        settings=tuple({name: getattr(block, name) for name in _SETTINGS} for block in blocks),
        use_relative=key.use_relative,
        eval_time=key.eval_time,
        source=key,
    )


def _points(block: bpy.types.ShapeKey) -> NDArray[np.float32]:
    points = np.zeros(len(block.points) * 3, np.float32)
    block.points.foreach_get("co", points)
    return points.reshape(-1, 3)


def write_keys(obj: bpy.types.Object, keys: ShapeKeys, offsets: NDArray[np.float32]) -> None:
    """Write shape keys to an object whose mesh has none.

    Parameters
    ----------
    obj : bpy.types.Object
    keys : ShapeKeys
        Names and settings.
    offsets : ndarray, (keys, vertices, 3) float32
        From the mesh as it stands.
    """
    positions = np.zeros(len(obj.data.vertices) * 3, np.float32)
    obj.data.vertices.foreach_get("co", positions)
    for number, name in enumerate(keys.names):
        if number:  # absolute keys stand at the time at which they are added
            obj.data.shape_keys.eval_time = keys.frames[number]
        block = obj.shape_key_add(name=name, from_mix=False)
        if number == 0:
            obj.data.shape_keys.use_relative = keys.use_relative
        block.points.foreach_set("co", positions + offsets[number].ravel())
    written = obj.data.shape_keys
    for block, relative, settings in zip(written.key_blocks, keys.relative_to, keys.settings, strict=True):
        block.relative_key = written.key_blocks[relative]
        for name, value in settings.items():
            setattr(block, name, value)
    written.eval_time = keys.eval_time
    _copy_animation(keys.source, written)


def _copy_animation(source: bpy.types.Key, target: bpy.types.Key) -> None:
    """Copy drivers and the action of shape keys."""
    animation = source.animation_data
    if animation is None:
        return
    copy = target.animation_data_create()
    copy.action = animation.action
    if animation.action is not None and hasattr(copy, "action_slot"):  # since 4.4
        copy.action_slot = animation.action_slot
    for driver in animation.drivers:
        copy.drivers.from_existing(src_driver=driver)
