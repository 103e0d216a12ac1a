# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the pictures of README and docs that need no window: make_pictures.py OUTPUT_FOLDER."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent.parent))

from demo.meshes import sample_mesh
from demo.picture import contact_sheet
from eso_addon import SimplifyResult, lod_chain, measure
from eso_addon.bridge.quiet import quiet
from eso_addon.bridge.scene_files import SceneFile


def main(folder: Path) -> None:
    """Picture the bunny at all, a tenth and a fiftieth of its triangles, and the cow's levels."""
    folder.mkdir(parents=True, exist_ok=True)
    _sheet(folder / "bunny.png", "bunny.obj", ratios=[0.1, 0.02])
    _sheet(folder / "levels.png", "cow.obj", faces_targets=[2320, 1740, 1160, 580, 290])


def _sheet(path: Path, name: str, **targets: list[float] | list[int]) -> None:
    scene = SceneFile(sample_mesh(name))
    _, vertices, faces = scene.parts[0]
    pictures = [(f"original: {len(faces):,} triangles", _mesh("original", vertices, faces))]
    levels = lod_chain(vertices, faces, **targets)  # type: ignore[arg-type]
    pictures += [(_label(level, vertices, faces), _mesh("level", level.vertices, level.faces)) for level in levels]
    with quiet("cannot render the picture"):
        contact_sheet(path, pictures, width=1650, tall=len(pictures) == 3)


def _label(level: SimplifyResult, vertices: object, faces: object) -> str:
    deviation = measure(vertices, faces, level.vertices, level.faces)  # type: ignore[arg-type]
    return f"{len(level.faces):,} triangles, error {deviation.symmetric.maximum / deviation.diagonal:.2%}"


def _mesh(name: str, vertices: object, faces: object) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())  # type: ignore[attr-defined]
    return mesh


if __name__ == "__main__":
    main(Path(sys.argv[1]))
