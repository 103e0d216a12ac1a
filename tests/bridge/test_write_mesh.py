# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import dataclass

import bpy
import numpy as np
import pytest

from eso_addon.bridge.read_mesh import MeshArrays, read_mesh
from eso_addon.bridge.write_mesh import write_mesh
from eso_addon.core.mesh import MeshError
from tests.bridge.blender_scenes import add_cube, add_mesh, add_sphere, arrays


@dataclass
class Result:
    """The part of a simplified mesh that is written."""

    vertices: np.ndarray
    faces: np.ndarray
    face_map: np.ndarray


def everything(source: MeshArrays) -> Result:
    """Keep all of the source."""
    count = len(source.triangles)
    return Result(source.vertices, source.triangles.astype(np.int32), np.arange(count, dtype=np.int32))


def test_a_mesh_comes_back_as_read() -> None:
    obj = add_sphere()
    mesh = write_mesh(everything(read_mesh(obj)), read_mesh(obj), "Back")
    obj2 = bpy.data.objects.new("Back", mesh)
    for before, after in zip(arrays(obj), arrays(obj2), strict=True):
        assert np.array_equal(before, after)
    assert len(mesh.edges) == len(obj.data.edges)
    assert not mesh.validate()


@pytest.mark.parametrize("scale", [(3, 3, 3), (1, 2, 0.5), (-1, 1, 2)])
def test_scale_is_undone(scale: tuple) -> None:
    obj = add_sphere(subdivisions=2)
    obj.scale = scale
    obj.rotation_euler = (0.3, 1.1, -2.0)
    bpy.context.view_layer.update()
    source = read_mesh(obj)
    back = bpy.data.objects.new("Back", write_mesh(everything(source), source, "Back"))
    assert np.allclose(arrays(back)[0], arrays(obj)[0], atol=1e-6)


def test_materials_and_smooth_faces_follow_the_face_map() -> None:
    obj = add_cube()
    for name in ("Red", "Blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    obj.data.materials.append(None)
    for polygon in obj.data.polygons:
        polygon.material_index = polygon.index % 3
        polygon.use_smooth = polygon.index > 2
    source = read_mesh(obj)
    kept = np.array([11, 4, 6, 0, 7])
    result = Result(source.vertices, source.triangles[kept].astype(np.int32), kept)
    mesh = write_mesh(result, source, "Part")
    kept = kept[:4]  # the last belongs to the quad of the third, which is whole
    assert [material and material.name for material in mesh.materials] == ["Red", "Blue", None]
    assert [polygon.material_index for polygon in mesh.polygons] == list(source.material_index[kept])
    assert [polygon.use_smooth for polygon in mesh.polygons] == list(source.smooth[kept])


def test_faces_with_the_same_vertices_are_written_once() -> None:
    source = read_mesh(add_mesh("Tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    result = Result(source.vertices, np.array([[0, 1, 2], [2, 1, 0]], np.int32), np.array([0, 0]))
    mesh = write_mesh(result, source, "Twice")
    assert len(mesh.polygons) == 1
    assert not mesh.validate()


def test_nothing_gives_an_empty_mesh() -> None:
    source = read_mesh(add_mesh("Nothing", [], []))
    assert len(write_mesh(everything(source), source, "Nothing").vertices) == 0


def test_what_single_precision_cannot_hold_is_refused_and_leaves_nothing() -> None:
    source = read_mesh(add_cube())
    result = everything(source)
    result.vertices = result.vertices * 1e39
    with pytest.raises(MeshError, match="too large"):
        write_mesh(result, source, "Huge")
    assert "Huge" not in bpy.data.meshes
