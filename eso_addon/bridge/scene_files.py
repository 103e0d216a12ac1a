# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of meshes through Blender's importers and exporters, for the command line: Y forward, Z up, quiet, atomic."""

from collections.abc import Callable, Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..files.atomic import atomic_output
from ..files.off import FileFormatError, read_off, write_off
from .objects import add_object, replace_mesh, select_only
from .quiet import quiet
from .read_mesh import MeshArrays, read_mesh
from .write_mesh import Simplified, write_mesh

_AXES = {"forward_axis": "Y", "up_axis": "Z"}


class SceneFile:
    """The visible meshes of a file, open in Blender in the place of what was open before.

    Parameters
    ----------
    path
        A file whose ending is in `READERS`.

    Attributes
    ----------
    parts : list of (str, (n, 3) float64, (m, 3) int64)
        Name, vertices and triangles of each mesh, in the size that it has in the scene.
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
            meshes = [(obj, read_mesh(obj)) for obj in _visible_meshes()]
        self.objects: list[bpy.types.Object] = [obj for obj, mesh in meshes if len(mesh.triangles)]
        self.meshes: list[MeshArrays] = [mesh for _, mesh in meshes if len(mesh.triangles)]
        if not self.objects:
            raise FileFormatError(f"{path.name} has no visible mesh with faces: nothing to work on")
        pairs = list(zip(self.objects, self.meshes, strict=True))
        self.parts = [(obj.name, mesh.vertices, mesh.triangles) for obj, mesh in pairs]
        losses = [(obj.name, ", ".join(mesh.left_behind)) for obj, mesh in pairs if mesh.left_behind]
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
            for obj, mesh, result in zip(self.objects, self.meshes, results, strict=True):
                replace_mesh(obj, write_mesh(result, mesh, obj.data.name), modifiers_applied=True)
            write_scene(path, self.objects)
        return [path]

    def write_levels(
        self, path: Path, levels: Sequence[Sequence[Simplified]], name_level: Callable[[str, int], str]
    ) -> list[Path]:
        """Write every level as an object of its own, in the place of the meshes.

        Parameters
        ----------
        path
            A file whose ending is in `WRITERS`. Where the format holds no names of objects, each level gets a file
            of its own, named in the same way.
        levels
            For each level one result for each of `parts`.
        name_level
            Gives the name of a level from the name of its mesh and the level's index.

        Returns
        -------
        list of Path
            The files written.
        """
        paths = [path]
        with quiet(f"cannot write {path.name}"):
            objects = self._add_levels(levels, name_level)
            if path.suffix.lower() in NAMELESS:
                paths = [path.with_stem(name_level(path.stem, index)) for index in range(len(levels))]
                for level_path, level in zip(paths, objects, strict=True):
                    write_scene(level_path, level)
            else:
                write_scene(path, [obj for level in objects for obj in level])
        return paths

    def _add_levels(
        self, levels: Sequence[Sequence[Simplified]], name_level: Callable[[str, int], str]
    ) -> list[list[bpy.types.Object]]:
        """Put objects for all levels in the place of the sources."""
        names = self._set_sources_aside()
        collections = [bpy.context.scene.collection]
        objects: list[list[bpy.types.Object]] = []
        for index, results in enumerate(levels):
            objects.append([])
            for name, source, mesh, result in zip(names, self.objects, self.meshes, results, strict=True):
                data = write_mesh(result, mesh, name_level(name, index))
                properties = {"eso_level": index}
                level = add_object(source, data, data.name, collections, modifiers_applied=True, properties=properties)
                if level.parent in self.objects:  # which goes with the other sources
                    level.parent, level.matrix_world = None, source.matrix_world
                objects[-1].append(level)
        for source in self.objects:
            bpy.data.objects.remove(source)
        return objects

    def _set_sources_aside(self) -> list[str]:
        """Give the sources' names, and free them for levels."""
        names = [obj.name for obj in self.objects]
        for obj in self.objects:
            obj.name = f"{obj.name}.source"
            obj.data.name = obj.name
        return names


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


def write_triangles(path: Path, vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> None:
    """Write one mesh of triangles to a file, in a scene of its own.

    Parameters
    ----------
    path
        A file whose ending is in `WRITERS`.
    vertices : (n, 3) float32
    faces : (m, 3) int32
    """
    with quiet(f"cannot write {path.name}"):
        _start_empty()
        mesh = bpy.data.meshes.new(path.stem)
        mesh.from_pydata(vertices, (), faces.tolist())
        obj = bpy.data.objects.new(path.stem, mesh)
        bpy.context.scene.collection.objects.link(obj)
        write_scene(path, [obj])


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


def _visible_meshes() -> list[bpy.types.Object]:
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


def _start_empty() -> None:
    # Not read_factory_settings, which would switch this add-on off while it runs.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def _import_with(operator: str, **options: object) -> Callable[[Path], None]:
    """Make a reader from the name of one of Blender's import operators."""

    def read(path: Path) -> None:
        _start_empty()
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


def _write_blend(path: Path) -> None:
    # The draft stands in another folder than the file will.
    bpy.ops.file.make_paths_absolute()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, copy=True, relative_remap=False)


def _read_off(path: Path) -> None:
    vertices, faces = read_off(path)
    _start_empty()
    mesh = bpy.data.meshes.new(path.stem)
    mesh.from_pydata(vertices, (), faces.tolist())
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(path.stem, mesh))


def _write_off(path: Path) -> None:
    write_off(path, *_joined(bpy.context.selected_objects))


# Textures are named by absolute paths, since the exporters write in another folder than the file will stand in.
_IN_PLACE = {"path_mode": "ABSOLUTE"}

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
    ".fbx": _export_with("export_scene.fbx", use_selection=True, axis_forward="Y", axis_up="Z", **_IN_PLACE),
    ".glb": _export_with("export_scene.gltf", use_selection=True, export_format="GLB"),
    ".gltf": _export_with("export_scene.gltf", use_selection=True, export_format="GLTF_SEPARATE"),
    ".obj": _export_with("wm.obj_export", export_selected_objects=True, **_AXES, **_IN_PLACE),
    ".off": _write_off,
    ".ply": _export_with("wm.ply_export", export_selected_objects=True, **_AXES),
    ".stl": _export_with("wm.stl_export", export_selected_objects=True, **_AXES),
}
NAMELESS = {".off", ".ply", ".stl"}  # formats that hold one mesh without a name
