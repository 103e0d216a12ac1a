# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshes that get levels: each read once, however many objects show it, and its levels written once."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..core.chains import Chain
from ..core.mesh import MeshError
from . import level_info
from .alike import alike
from .fingerprint import fingerprint
from .instances import inside, is_instancer
from .level_names import take_name
from .modifiers import live_modifiers
from .place_levels import LevelMesh, note_materials
from .read_mesh import MeshArrays, read_mesh
from .regions import group_options
from .write_mesh import write_mesh


@dataclass(frozen=True)
class LodSource:
    """A mesh, and the objects that show it.

    Attributes
    ----------
    objects : list of bpy.types.Object
        The first one was read: the largest.
    arrays : MeshArrays
    live : list of str
        Modifiers that are not in the arrays.
    """

    objects: list[bpy.types.Object]
    arrays: MeshArrays
    live: list[str]


def meshes_behind(things: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """List the mesh objects that stand behind objects, each once: a level stands for its source, an empty for what it
    instances, and for what that instances.
    """
    found: dict[bpy.types.Object, None] = {}
    for obj in things:
        if is_instancer(obj):
            found.update(dict.fromkeys(filter(None, map(_source_or_itself, inside(obj)))))
        elif obj.type == "MESH":
            found[_source_or_itself(obj) or obj] = None
    return list(found)


def _source_or_itself(obj: bpy.types.Object) -> bpy.types.Object | None:
    if level_info.is_level(obj) or level_info.is_hull(obj):
        return level_info.find_source(obj)
    return obj if obj.type == "MESH" else None


def read_sources(meshes: Iterable[bpy.types.Object], *, apply_modifiers: bool,
                 live_types: Collection[str]) -> list[LodSource]:
    """Read mesh objects, those together that show the same mesh once their modifiers are applied.

    Parameters
    ----------
    meshes : iterable of bpy.types.Object
    apply_modifiers : bool
    live_types : collection of str
        Kinds of modifiers that stay live where they can.

    Returns
    -------
    list of LodSource
        Without meshes that have no faces.

    Raises
    ------
    MeshError
        A mesh that cannot be read.
    """
    sources = []
    for group in alike(meshes, apply_modifiers=apply_modifiers, live_types=live_types):
        group.sort(key=_volume, reverse=True)
        live = live_modifiers(group[0], live_types) if apply_modifiers else []
        arrays = read_mesh(group[0], apply_modifiers=apply_modifiers, live=live, carry=True)
        if len(arrays.triangles):
            sources.append(LodSource(group, arrays, live))
    return sources


def _volume(obj: bpy.types.Object) -> float:
    return abs(float(np.linalg.det(np.array(obj.matrix_world, np.float64)[:3, :3])))


def engine_inputs(source: LodSource, group: Mapping[str, Any]) -> dict[str, Any]:
    """Give what the engine takes besides the user's options: what the mesh carries, and a vertex group's weights."""
    arrays = source.arrays
    if not has_group(source, group):
        return arrays.carried
    chosen = group_options(arrays, group["vertex_group"], use=group["group_use"], factor=group["group_factor"],
                           invert=group["invert_group"])
    return {**arrays.carried, **chosen}


def has_group(source: LodSource, group: Mapping[str, Any]) -> bool:
    """Tell whether a mesh has the vertex group that is asked for."""
    groups = source.arrays.groups
    return groups is not None and group.get("vertex_group", "") in groups.names


def check_group(sources: Sequence[LodSource], group: Mapping[str, Any]) -> None:
    """Make sure that at least one of several meshes has the vertex group that is asked for, if any is."""
    if group and not any(has_group(source, group) for source in sources):
        raise MeshError(f"there is no vertex group '{group['vertex_group']}': choose another, or none")


def write_chain(source: LodSource, chain: Chain, names: Sequence[str],
                writing: Mapping[str, Any] | None = None) -> list[LevelMesh]:
    """Make the meshes of a chain, the finest first, with what is told of each but for its source.

    Parameters
    ----------
    source : LodSource
    chain : Chain
    names : sequence of str
        Of the meshes.
    writing : mapping, optional
        Options of `write_mesh`.
    """
    written: list[LevelMesh] = []
    before = len(source.arrays.triangles)
    for number, (level, name) in enumerate(zip(chain.levels, names, strict=False)):
        after = len(level.result.faces)
        last = written[-1] if written else None
        if last is not None and last.properties[level_info.TRIANGLES] == after:
            mesh = last.mesh  # a budget left this mesh as it was
        else:
            mesh = write_mesh(level.result, source.arrays, name, **(writing or {}))
            note_materials(mesh)
        short = "" if level.result.reached else level.result.messages[-1]
        told = level_info.level_properties(source.objects[0], number, before, after, level.result.error,
                                           level.distance, short)
        written.append(LevelMesh(mesh, told))
    return written


def write_chains(sources: Sequence[LodSource], chains: Sequence[Chain], names: Sequence[Sequence[str]],
                 writing: Mapping[str, Any]) -> list[list[LevelMesh]]:
    """Make the meshes of several chains, all of them or none; see `write_chain`."""
    written: list[list[LevelMesh]] = []
    before = set(bpy.data.meshes)
    try:
        for source, chain, own in zip(sources, chains, names, strict=True):
            written.append(write_chain(source, chain, own, writing))
    except MeshError:
        for mesh in set(bpy.data.meshes) - before:
            bpy.data.meshes.remove(mesh)
        raise
    return written


def told_of(level: LevelMesh, obj: bpy.types.Object, settings: str, profile: str) -> LevelMesh:
    """Have a level tell which object it was made from, and how."""
    own = {level_info.SOURCE: obj.name, level_info.MESH: obj.data.name, level_info.HASH: fingerprint(obj),
           level_info.SETTINGS: settings, level_info.PROFILE: profile}
    return LevelMesh(level.mesh, {**level.properties, **own})


def name_meshes(levels: Sequence[LevelMesh], names: Sequence[str]) -> None:
    """Give the meshes their names, when those that had them are gone."""
    for level, name in reversed(list(zip(levels, names, strict=False))):  # the finest of several that share one
        take_name(level.mesh, name, bpy.data.meshes)
