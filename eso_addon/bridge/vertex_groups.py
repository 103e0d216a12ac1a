# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups as an array of weights, and back: interpolated weights, normalised, with a limit of influences."""

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class VertexGroups:
    """The vertex groups of an object.

    Attributes
    ----------
    names : tuple of str
    weights : ndarray, (n, groups) float32
    deforms : ndarray, (groups,) bool
        Groups that an armature moves vertices by.
    locked : tuple of bool
    active : int
    """

    names: tuple[str, ...]
    weights: NDArray[np.float32]
    deforms: NDArray[np.bool_]
    locked: tuple[bool, ...]
    active: int

    @property
    def influences(self) -> int:
        """The most bones that move a vertex."""
        return int((self.weights[:, self.deforms] > 0).sum(axis=1).max(initial=0))


def read_groups(obj: bpy.types.Object, mesh: bpy.types.Mesh, owner: bpy.types.Object) -> VertexGroups | None:
    """Read the groups of a mesh that an object shows; None if there are none.

    Parameters
    ----------
    obj : bpy.types.Object
    mesh : bpy.types.Mesh
    owner : bpy.types.Object
        The object, or as it is evaluated: geometry nodes may bring groups, and put them in another order.
    """
    groups = owner.vertex_groups
    if not len(groups):
        return None
    weights = read_weights(mesh, len(groups), absent=0)
    weights = np.nan_to_num(weights, nan=0.0, posinf=1.0, neginf=0.0).clip(0, 1)
    bones = _deforming_bones(obj)
    return VertexGroups(
        names=tuple(group.name for group in groups),
        weights=weights,
        deforms=np.array([group.name in bones for group in groups], bool),
        locked=tuple(group.lock_weight for group in groups),
        active=max(groups.find(obj.vertex_groups.active.name), 0) if obj.vertex_groups.active else 0,
    )


def read_weights(mesh: bpy.types.Mesh, count: int, *, absent: float) -> NDArray[np.float32]:
    """Read the weights of a mesh in so many groups, (n, count); `absent` where a vertex is not in one."""
    weights = np.full((len(mesh.vertices), count), absent, np.float32)
    rows = [(vertex.index, element.group, element.weight) for vertex in mesh.vertices for element in vertex.groups
            if element.group < count]
    if rows:
        vertex, group, weight = zip(*rows, strict=True)
        weights[list(vertex), list(group)] = weight
    return weights


def _deforming_bones(obj: bpy.types.Object) -> set[str]:
    """Name the bones that move an object's vertices, through a modifier or as its parent."""
    armatures = [modifier.object for modifier in obj.modifiers if modifier.type == "ARMATURE" and modifier.object]
    if obj.parent is not None and obj.parent.type == "ARMATURE" and obj.parent_type == "ARMATURE":
        armatures.append(obj.parent)
    return {bone.name for armature in armatures if armature.type == "ARMATURE"
            for bone in armature.data.bones if bone.use_deform}


def limited(weights: NDArray[np.float32], deforms: NDArray[np.bool_], limit: int) -> NDArray[np.float32]:
    """Keep the strongest influences of each vertex, and give their sum what all of them had.

    Parameters
    ----------
    weights : ndarray, (n, groups) float32
    deforms : ndarray, (groups,) bool
        Only these are counted, the others stay as they are.
    limit : int
        Influences a vertex may have; 0 for any number.

    Returns
    -------
    ndarray, (n, groups) float32
        Where a vertex has weights of deforming groups at all, they sum to one.
    """
    weights = weights.copy()
    bones = weights[:, deforms].astype(np.float64)
    if limit and bones.shape[1] > limit:
        weak = np.argsort(-bones, axis=1, kind="stable")[:, limit:]
        np.put_along_axis(bones, weak, 0.0, axis=1)
    total = bones.sum(axis=1, keepdims=True)
    weights[:, deforms] = np.where(total > 0, bones / np.where(total > 0, total, 1), 0)
    return weights


def write_groups(obj: bpy.types.Object, groups: VertexGroups, weights: NDArray[np.float32]) -> None:
    """Write the groups to an object whose mesh has none, with these weights, (vertices, groups) float32."""
    for number, name in enumerate(groups.names):
        group = obj.vertex_groups.new(name=name)
        group.lock_weight = groups.locked[number]
        fill_group(group, weights[:, number], np.flatnonzero(weights[:, number] > 0))
    obj.vertex_groups.active_index = groups.active


def fill_group(group: bpy.types.VertexGroup, weights: NDArray[np.float32], members: NDArray[np.int64]) -> None:
    """Put vertices in a group, with their weights of all, (n,); Blender takes vertices of one weight at a time."""
    values, inverse = np.unique(weights[members], return_inverse=True)
    order = np.argsort(inverse.ravel(), kind="stable")
    ends = np.searchsorted(inverse.ravel()[order], np.arange(1, len(values)))
    for chosen, weight in zip(np.split(members[order], ends), values.tolist(), strict=False):
        group.add(chosen.tolist(), weight, "REPLACE")
