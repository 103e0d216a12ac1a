# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the LOD levels of the paper's Table 7, measure them beside Decimate's, and picture them."""

import math
import sys
import time
from pathlib import Path

import bpy

from eso_addon import SimplifyResult, lod_chain, measure
from eso_addon.bridge.quiet import quiet
from eso_addon.bridge.scene_files import SceneFile
from eso_addon.bridge.stream_objects import read_objects, stream_steps
from eso_addon.core.chains import Chain, Level
from eso_addon.core.screen import Screen
from eso_addon.core.steps import run_to_end
from eso_addon.files.off import write_off
from eso_addon.settings.profiles import PROFILES

from .meshes import Mesh, decimate, sample_mesh
from .picture import contact_sheet
from .table import markdown_table

OUT = Path("out/demo")
# Triangles of the cow's levels, and the Hausdorff distances that the paper prints for them in its Table 7.
TABLE_7 = {2321: 0.00415, 1741: 0.00497, 1160: 0.00636, 580: 0.01126, 290: 0.01813}


def main() -> int:
    """Do the whole demo; everything goes to out/demo/."""
    OUT.mkdir(parents=True, exist_ok=True)
    cow = SceneFile(sample_mesh("cow.obj"))
    _, vertices, faces = cow.parts[0]
    started = time.perf_counter()
    levels = lod_chain(vertices, faces, faces_targets=list(TABLE_7))
    seconds = time.perf_counter() - started
    print(f"The cow, {len(faces)} triangles: {len(levels)} levels from one run in {seconds:.2f} s")

    table = _measured(cow, (vertices, faces), levels)
    (OUT / "table.md").write_text(table, encoding="utf-8")
    print("\nDeviations relative to the diagonal of the bounding box:\n\n" + table)

    write_off(OUT / "cow.off", vertices, faces)
    stream = OUT / "cow.esopm"
    cow.objects[0].rotation_euler.x = math.pi / 2  # the file has Y up, a scene Z
    bpy.context.view_layer.update()
    size = run_to_end(stream_steps(*read_objects(cow.objects[:1]), {})).save(stream)
    print(f"The progressive stream: {size} bytes for the exact original")

    original = cow.objects[0].data.copy()
    plain = PROFILES["plain"]
    screen = Screen()
    chain = Chain(tuple(Level(level, screen.distance_for_error(level.error)) for level in levels), ())
    written = cow.write_levels(OUT / "cow.blend", [chain], plain)
    made = [bpy.data.objects[plain.name("cow", index)] for index in range(len(levels))]
    pictures = [(f"original: {len(faces)} triangles", original)]
    pictures += [(f"{len(level.faces)} triangles", obj.data) for level, obj in zip(levels, made, strict=True)]
    with quiet("cannot render the contact sheet"):
        contact_sheet(OUT / "contact_sheet.png", pictures)
    for path in (OUT / "cow.off", *written, stream, OUT / "table.md", OUT / "contact_sheet.png"):
        print(path)
    return 0


def _measured(cow: SceneFile, original: Mesh, levels: list[SimplifyResult]) -> str:
    ours = [(len(level.faces), measure(*original, level.vertices, level.faces)) for level in levels]
    others = [decimate(cow.objects[0], count) for count in TABLE_7]
    decimated = [(len(mesh[1]), measure(*original, *mesh)) for mesh in others]
    return markdown_table(ours, decimated, list(TABLE_7.values()))


if __name__ == "__main__":
    sys.exit(main())
