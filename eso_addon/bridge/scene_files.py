# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of meshes through Blender's importers and exporters, for the command line: Y forward, Z up, quiet, atomic."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.chains import Chain
from ..files.atomic import atomic_output
from ..files.off import FileFormatError, read_off, write_off
from . import level_info
from .export_levels import LevelGroup, export_levels
from .hulls import add_hulls
from .level_names import check_free, fitting_names
from .lod_sources import name_meshes, read_sources, write_chain
from .objects import add_object, level_collection, replace_mesh, select_only
from .place_levels import LevelMesh
from .quiet import quiet
from .read_mesh import read_mesh
from .write_mesh import Simplified, write_mesh

_AXES = {"forward_axis": "Y", "up_axis": "Z"}
_LIVE = ("ARMATURE",)  # a file's levels are posed by what poses it


class Profile(Protocol):
    """What an engine wants."""

    @property
    def key(self) -> str:
        """The word for it."""

    @property
    def layout(self) -> str:
        """How levels stand to each other."""

    def name(self, base: str, level: int) -> str:
        """Name a level, 0 being the finest."""

    def hull_name(self, base: str, number: int) -> str:
        """Name a collision hull, counted from 1."""


class SceneFile:
    """The visible meshes of a file, open in Blender in the place of what was open before.

    Parameters
    ----------
    path
        A file whose ending is in `READERS`.

    Attributes
    ----------
    sources : list of LodSource
        Each mesh once, with the objects that show it.
    parts : list of (str, (n, 3) float64, (m, 3) int64)
        Name, vertices and triangles of each, in the size that it has in the scene.
    carried : list of dict
        What each carries, as options of the engine.
    copies : list of int
        How many objects show each.
    left_behind : list of str
        What simplified meshes lose, for each mesh that loses anything.

    Raises
    ------
    FileFormatError
        If Blender cannot read the file, or finds no triangles in it.
    OSError
        If the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        with open(path, "rb"):
            pass  # says why a file cannot be opened better than Blender does
        with quiet(f"cannot read {path.name}"):
            READERS[path.suffix.lower()](path)
            self.sources = read_sources(visible_meshes(), apply_modifiers=True, live_types=_LIVE)
        if not self.sources:
            raise FileFormatError(f"{path.name} has no visible mesh with faces: nothing to work on")
        self.objects = [obj for source in self.sources for obj in source.objects]
        self.carried = [source.arrays.carried for source in self.sources]
        self.copies = [len(source.objects) for source in self.sources]
        self.parts = [(s.objects[0].name, s.arrays.vertices, s.arrays.triangles) for s in self.sources]
        losses = [(s.objects[0].name, ", ".join(s.arrays.left_behind)) for s in self.sources if s.arrays.left_behind]
        losses += [(path.name, missing) for missing in missing_libraries()]
        self.left_behind = [f"{name}: not carried over: {names}" for name, names in losses]

    def write_simplified(self, path: Path, results: Sequence[Simplified]) -> list[Path]:
        """Put each result in the place of its mesh, and write them all to a file.

        Parameters
        ----------
        path
            A file whose ending is in `WRITERS`.
        results
            One for each of `parts`.

        Returns
        -------
        list of Path
            The file written.
        """
        with quiet(f"cannot write {path.name}"):
            for source, result in zip(self.sources, results, strict=True):
                mesh = write_mesh(result, source.arrays, source.objects[0].data.name)
                for obj in source.objects:
                    replace_mesh(obj, mesh, modifiers_applied=True, live=source.live)
            write_scene(path, self.objects)
        return [path]

    def write_levels(self, path: Path, chains: Sequence[Chain], profile: Profile, *,
                     settings: str = "", hulls: str = "none") -> list[Path]:
        """Write every level as an object of its own, in the place of the meshes.

        Parameters
        ----------
        path
            A file whose ending is in `WRITERS`. Where the format holds no names of objects, each level gets a file
            of its own, named in the same way.
        chains
            One for each of `parts`.
        profile
            Names the levels and says how they stand to each other.
        settings
            What the levels store about how they were made.
        hulls
            "none", "one" for each object, or "parts": one for each of its parts.

        Returns
        -------
        list of Path
            The files written.

        Raises
        ------
        MeshError
            Two levels would have the same name.
        """
        with quiet(f"cannot write {path.name}"):
            groups = self._add_levels(chains, profile, settings, hulls)
            if path.suffix.lower() in NAMELESS:
                return _write_each_level(path, groups, profile)
            if path.suffix.lower() == ".blend":
                write_scene(path, [obj for group in groups for obj in [*group.levels, *group.hulls]])
            else:
                export_levels(path, groups, profile.layout, WRITERS[path.suffix.lower()])
        return [path]

    def _add_levels(self, chains: Sequence[Chain], profile: Profile, settings: str, hulls: str) -> list[LevelGroup]:
        """Put objects for all levels in the place of the sources."""
        bases = {obj: obj.name for obj in self.objects}
        most = max(len(chain.levels) for chain in chains)
        names = {obj: fitting_names(base, most, profile.name) for obj, base in bases.items()}
        check_free([name for every in names.values() for name in every], self.objects)
        for number, obj in enumerate(self.objects):
            obj.name = f"eso_lod source {number}"
        for source in self.sources:
            source.objects[0].data.name = "eso_lod source"
        made: dict[bpy.types.Object, LevelGroup] = {}
        for source, chain in zip(self.sources, chains, strict=True):
            levels = write_chain(source, chain, names[source.objects[0]])
            for obj in source.objects:
                levels_of_one = self._add_objects(obj, levels, names[obj], bases[obj], source.live)
                for level in levels_of_one:
                    level[level_info.SETTINGS], level[level_info.PROFILE] = settings, profile.key
                added = add_hulls(levels_of_one[0], levels_of_one[0], bases[obj], profile.hull_name, hulls)
                made[obj] = LevelGroup(bases[obj], {level: level.name for level in levels_of_one},
                                       {hull: hull.name for hull in added})
            name_meshes(levels, names[source.objects[0]])
        for obj in self.objects:
            bpy.data.objects.remove(obj)
        return list(made.values())

    def _add_objects(self, obj: bpy.types.Object, levels: Sequence[LevelMesh], names: Sequence[str], base: str,
                     live: Sequence[str]) -> list[bpy.types.Object]:
        collection = level_collection(fitting_names(base, 1, lambda base, _: f"{base}_LODs")[0], bpy.context.scene)
        made = []
        for level, name in zip(levels, names, strict=False):
            properties = {**level.properties, level_info.SOURCE: base}
            new = add_object(obj, level.mesh, name, [collection], modifiers_applied=True, live=live,
                             properties=properties)
            if new.parent in self.objects:  # which goes with the other sources
                new.parent, new.matrix_world = None, obj.matrix_world
            made.append(new)
        return made


def _write_each_level(path: Path, groups: Sequence[LevelGroup], profile: Profile) -> list[Path]:
    """Write a file for each level, of all objects; those with fewer levels are there with their last."""
    most = max(len(group.levels) for group in groups)
    paths = [path.with_stem(profile.name(path.stem, number)) for number in range(most)]
    for number, level_path in enumerate(paths):
        write_scene(level_path, [list(group.levels)[min(number, len(group.levels) - 1)] for group in groups])
    return paths


def world_triangles(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read all visible meshes of a file as one, where they stand in the world.

    Parameters
    ----------
    path
        A file whose ending is in `READERS`.

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Raises
    ------
    FileFormatError, OSError
        As `SceneFile`.
    """
    return _joined(SceneFile(path).objects)


def write_stage(path: Path) -> None:
    """Write the scene in the window, and nothing else of the file, as a .blend file."""
    bpy.data.libraries.write(str(path), {bpy.context.scene}, path_remap="ABSOLUTE")


def write_scene(path: Path, objects: Sequence[bpy.types.Object]) -> None:
    """Write objects to a file that appears whole or not at all; a .blend file takes the rest of the scene too.

    Parameters
    ----------
    path
        A file whose ending is in `WRITERS`.
    objects
        Mesh objects of the scene.

    Raises
    ------
    RuntimeError
        If Blender cannot write them.
    OSError
        If the file cannot be written.
    """
    view_layer = bpy.context.view_layer
    view_layer.update()
    select_only(list(objects), view_layer)
    with atomic_output(path) as draft:
        WRITERS[path.suffix.lower()](draft)


def visible_meshes() -> list[bpy.types.Object]:
    """List what a user sees, less the shapes that stand for bones."""
    bpy.context.view_layer.update()
    scene = bpy.context.scene.objects
    bone_shapes = {bone.custom_shape for obj in scene if obj.pose for bone in obj.pose.bones}
    return [obj for obj in scene if obj.type == "MESH" and obj.visible_get() and obj not in bone_shapes]


def _joined(objects: Sequence[bpy.types.Object]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    meshes = [read_mesh(obj, transform=np.array(obj.matrix_world, dtype=np.float64)) for obj in objects]
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces)


def start_empty() -> None:
    """Open an empty file."""
    # Not read_factory_settings, which would switch this add-on off while it runs.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def _import_with(operator: str, **options: object) -> Callable[[Path], None]:
    """Make a reader from the name of one of Blender's import operators."""

    def read(path: Path) -> None:
        start_empty()
        _operator(operator)(filepath=str(path), **options)

    return read


def _export_with(operator: str, **options: object) -> Callable[[Path], None]:
    """Make a writer from the name of one of Blender's export operators."""

    def write(path: Path) -> None:
        _operator(operator)(filepath=str(path), check_existing=False, **options)

    return write


def _operator(name: str) -> Callable[..., set[str]]:
    """Find an operator; glTF and FBX are add-ons of Blender's own, which a user may have switched off."""
    group, short_name = name.split(".")
    if group.endswith("_scene"):
        import addon_utils

        addon_utils.enable("io_scene_fbx" if short_name == "fbx" else "io_scene_gltf2")
    return getattr(getattr(bpy.ops, group), short_name)


def _read_blend(path: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
    _make_local()
    _make_instances_real()


def _make_local() -> None:
    """Put data of the file's own in the place of what it links from others, and of library overrides."""
    if len(bpy.data.libraries):
        active = bpy.context.view_layer.objects.active
        if active is not None and active.mode != "OBJECT":  # as the file was saved; there it is not allowed
            bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.object.make_local(type="ALL")


def missing_libraries() -> list[str]:
    """Name what the open file links from files that are not there."""
    names = [bpy.path.basename(library.filepath) for library in bpy.data.libraries
             if getattr(library, "is_missing", False)]
    return [f"what is linked from files that are not there ({', '.join(names)})"] if names else []


def _make_instances_real() -> None:
    """Put objects that share their meshes in the place of the empties that instance collections of them."""
    layer = bpy.context.view_layer
    layer.update()
    empties = [obj for obj in layer.objects
               if obj.type == "EMPTY" and obj.instance_collection is not None and obj.visible_get()]
    if empties:
        select_only(empties, layer)
        bpy.ops.object.duplicates_make_real()


def _write_blend(path: Path) -> None:
    # The draft stands in another folder than the file will.
    bpy.ops.file.make_paths_absolute()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, copy=True, relative_remap=False)


def _read_off(path: Path) -> None:
    vertices, faces = read_off(path)
    start_empty()
    mesh = bpy.data.meshes.new(path.stem)
    mesh.from_pydata(vertices, (), faces.tolist())
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(path.stem, mesh))


def _write_off(path: Path) -> None:
    write_off(path, *_joined(bpy.context.selected_objects))


def _export_gltf(kind: str) -> Callable[[Path], None]:
    """Make a writer of glTF; it applies modifiers that stayed live, at the cost of shape keys."""

    def write(path: Path) -> None:
        live = {modifier.type for obj in bpy.context.selected_objects for modifier in obj.modifiers} - {"ARMATURE"}
        # a folder of its own: textures of two models may have the same name
        folder = {"export_texture_dir": f"{path.stem}_textures"} if kind == "GLTF_SEPARATE" else {}
        _export_with("export_scene.gltf", use_selection=True, use_active_scene=True, export_format=kind,
                     export_apply=bool(live), **folder)(path)

    return write


# Textures are named by absolute paths, since the exporters write in another folder than the file will stand in.
_IN_PLACE = {"path_mode": "ABSOLUTE"}
# Engines want textures in the file, smoothing told, and no bones that nobody made.
_IN_FBX = {"path_mode": "COPY", "embed_textures": True, "mesh_smooth_type": "FACE", "add_leaf_bones": False}

READERS: dict[str, Callable[[Path], None]] = {
    ".blend": _read_blend,
    ".fbx": _import_with("import_scene.fbx"),
    ".glb": _import_with("import_scene.gltf"),
    ".gltf": _import_with("import_scene.gltf"),
    ".obj": _import_with("wm.obj_import", **_AXES),
    ".off": _read_off,
    ".ply": _import_with("wm.ply_import", **_AXES),
    ".stl": _import_with("wm.stl_import", **_AXES),
}
WRITERS: dict[str, Callable[[Path], None]] = {
    ".blend": _write_blend,
    ".fbx": _export_with("export_scene.fbx", use_selection=True, axis_forward="Y", axis_up="Z", **_IN_FBX),
    ".glb": _export_gltf("GLB"),
    ".gltf": _export_gltf("GLTF_SEPARATE"),
    ".obj": _export_with("wm.obj_export", export_selected_objects=True, **_AXES, **_IN_PLACE),
    ".off": _write_off,
    ".ply": _export_with("wm.ply_export", export_selected_objects=True, **_AXES),
    ".stl": _export_with("wm.stl_export", export_selected_objects=True, **_AXES),
}
NAMELESS = {".off", ".ply", ".stl"}  # formats that hold one mesh without a name
