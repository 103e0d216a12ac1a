# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape keys as displacements from the first of them, and back, with their settings, drivers and animation."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

# In this order: a value is held within its limits, and each limit by the other, so that they are set twice.
_SETTINGS = ("slider_min", "slider_max", "value", "mute", "lock_shape", "vertex_group", "interpolation")


@dataclass(frozen=True, eq=False)
class ShapeKeys:
    """The shape keys of a mesh.

    Attributes
    ----------
    neutral : ndarray, (n, 3) float32
        The first of them, in object space.
    offsets : ndarray, (keys, n, 3) float32
        From the neutral shape.
    entries : list of dict
        As `key_entries` gives them.
    timing : dict
        As `timing_of` gives it.
    source : bpy.types.Key
        For its drivers and animation.
    """

    neutral: NDArray[np.float32]
    offsets: NDArray[np.float32]
    entries: list[dict[str, Any]]
    timing: dict[str, Any]
    source: bpy.types.Key

    @property
    def names(self) -> list[str]:
        """What they are called."""
        return [entry["name"] for entry in self.entries]


def read_keys(mesh: bpy.types.Mesh) -> ShapeKeys | None:
    """Read the shape keys of a stored mesh; None if it has none."""
    if mesh.shape_keys is None or not len(mesh.shape_keys.key_blocks):
        return None
    return _keys_of(mesh.shape_keys, np.stack([points_of(block) for block in mesh.shape_keys.key_blocks]))


def with_shapes(keys: ShapeKeys, shapes: NDArray[np.float32]) -> ShapeKeys:
    """Give the keys other shapes, (keys, n, 3): those that modifiers make of them."""
    return _keys_of(keys.source, shapes)


def _keys_of(key: bpy.types.Key, shapes: NDArray[np.float32]) -> ShapeKeys:
    return ShapeKeys(shapes[0], shapes - shapes[:1], key_entries(key), timing_of(key), key)


def key_entries(key: bpy.types.Key) -> list[dict[str, Any]]:
    """Give what is set of each key, as plain data: name, number of the key it is relative to, frame, and so on."""
    blocks = list(key.key_blocks)
    return [{"name": block.name, "relative": blocks.index(block.relative_key), "frame": block.frame,
             **{name: getattr(block, name) for name in _SETTINGS}} for block in blocks]


def timing_of(key: bpy.types.Key) -> dict[str, Any]:
    """Give what is set of all keys together: whether they are relative, and the time of absolute ones."""
    return {"use_relative": key.use_relative, "eval_time": key.eval_time}


def points_of(block: bpy.types.ShapeKey) -> NDArray[np.float32]:
    """Give a key's positions, (n, 3)."""
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
    add_keys(obj, list(positions.reshape(-1, 3) + offsets), keys.entries, keys.timing)
    _copy_animation(keys.source, obj.data.shape_keys)


def add_keys(obj: bpy.types.Object, shapes: Sequence[NDArray[np.float32]], entries: Sequence[Mapping[str, Any]],
             timing: Mapping[str, Any]) -> None:
    """Add shape keys to an object whose mesh has none.

    Parameters
    ----------
    obj : bpy.types.Object
    shapes : sequence of ndarray, (n, 3) float32
        Positions.
    entries, timing
        As `key_entries` and `timing_of` give them; of a file, whatever Blender takes is used.
    """
    if not len(shapes):
        return
    for number, (shape, entry) in enumerate(zip(shapes, entries, strict=True)):
        if number:  # absolute keys stand at the time at which they are added
            _set(obj.data.shape_keys, "eval_time", entry.get("frame", 0.0))
        block = obj.shape_key_add(name=str(entry.get("name", "")), from_mix=False)
        if number == 0:
            _set(obj.data.shape_keys, "use_relative", timing.get("use_relative", True))
        block.points.foreach_set("co", np.ascontiguousarray(shape, np.float32).ravel())
    written = obj.data.shape_keys
    for block, entry in zip(written.key_blocks, entries, strict=True):
        relative = entry.get("relative")
        if type(relative) is int and 0 <= relative < len(shapes):
            block.relative_key = written.key_blocks[relative]
        for name in (*_SETTINGS[:2], *_SETTINGS):
            if name in entry:
                _set(block, name, entry[name])
    _set(written, "eval_time", timing.get("eval_time", 0.0))


def _set(thing: bpy.types.bpy_struct, name: str, value: object) -> None:
    """Set what another Blender, or another program, has told; what this one does not take stays as it is."""
    with suppress(TypeError, ValueError, OverflowError, AttributeError):
        setattr(thing, name, value)


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
