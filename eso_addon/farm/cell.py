# SPDX-License-Identifier: GPL-3.0-or-later
"""One cell of a mesh larger than memory: the engine's run on it, kept on disk, and a level of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.blocks import Blocks
from ..core.collapse import collapse_steps
from ..core.mesh import Bools, Floats, Ints, morton_weld
from ..core.options import Options, options_of
from ..core.prepare import Prepared, prepare
from ..core.record import CollapseRecord
from ..core.refit import refit
from ..core.steps import run_to_end
from ..core.variation import surface_variation
from ..core.weigh import factors, initial_quadrics

STEPS = 512  # points of a ladder


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Run or cut one cell: "do" names which, the rest are the function's arguments."""
    work = dict(request)
    try:
        return run_cell(**work) if work.pop("do") == "run" else cut_cell(**work)
    except MemoryError:
        return {"error": "a cell does not fit into the memory of a worker: raise --memory-limit"}
    except Exception as error:  # told by the one who asked
        return {"error": " ".join(f"{type(error).__name__}: {error}".split())}


def run_cell(folder: str, cell: int, dtype: str, least: int, scale: float, threads: int,
             options: dict[str, Any]) -> dict[str, Any]:
    """Run the engine on a cell with its border held, and keep the record beside it.

    Parameters
    ----------
    folder, cell, dtype
        Where `cells.deal` put it.
    least
        Triangles at which the run stops.
    scale
        The length in which weights are reckoned: the same for all cells, so that their costs can be compared.
    threads
    options
        What `simplify` takes.

    Returns
    -------
    dict
        "left" and "cost", about STEPS each: triangles left once all collapses up to a cost are done.
    """
    place = Path(folder)
    chosen = options_of(options.get("preset", "default"), {k: v for k, v in options.items() if k != "preset"})
    points, faces, held = _load(place, cell, np.dtype(dtype))
    if not _has_a_triangle(faces):
        return {"left": [0], "cost": [0.0]}
    mesh = prepare(points, faces, join=False)
    locked = np.zeros(mesh.points.shape[1], bool)
    locked[mesh.vertex[held & (mesh.vertex >= 0)]] = True
    blocks = Blocks(threads)
    try:
        quadrics = _quadrics(mesh, chosen, scale)
        run = collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, locked, least, chosen.rules, blocks)
        record = run_to_end(run)
    finally:
        blocks.close()
    position = record.position * mesh.size + mesh.center
    position[record.stays] = points[mesh.source[record.kept[record.stays]]]
    np.savez(place / f"record_{cell}.npz", points=points[mesh.source], corners=mesh.faces.astype(np.int32),
             locked=locked, turned=np.zeros(0, bool) if mesh.turned is None else mesh.turned, position=position,
             removed=record.removed.astype(np.int32), kept=record.kept.astype(np.int32),
             left=record.faces_left.astype(np.int32), before=record.faces_before)
    cost = np.maximum.accumulate(np.nan_to_num(record.cost.astype(np.float64)).clip(0))
    chosen_steps = np.unique(np.linspace(0, len(record) - 1, min(STEPS, len(record))).astype(np.int64))
    power = 4 if chosen.area_weighted else 2
    return {"left": [record.faces_before, *record.faces_left[chosen_steps].tolist()],
            "cost": [0.0, *(cost[chosen_steps] * mesh.size**power).tolist()]}


def cut_cell(folder: str, cell: int, count: int, fit: bool) -> dict[str, Any]:
    """Write the level of a cell that has so many triangles, as points, corners and held.

    Parameters
    ----------
    folder, cell
    count
        Triangles at most, if the record goes so far.
    fit
        Whether to fit the level to the cell's mesh.
    """
    place = Path(folder)
    with np.load(place / f"record_{cell}.npz") as kept:
        data = {name: kept[name] for name in kept.files}
    ends = len(data["removed"])
    record = CollapseRecord(data["removed"].astype(np.int64), data["kept"].astype(np.int64), data["position"],
                            data["left"].astype(np.int64), np.zeros(ends, np.float32), np.zeros(1, np.int64),
                            int(data["before"]), np.zeros(ends, bool))
    faces = np.ascontiguousarray(data["corners"].T.astype(np.int64))
    length = record.length_for(count)
    points, corners, face_map, survivor = record.level(data["points"], faces, length)
    used = np.zeros(len(points), bool)
    used[corners] = True
    number = np.cumsum(used) - 1
    placed, corners, held = points[used], number[corners], data["locked"][used]
    turned = data["turned"][face_map] if len(data["turned"]) else np.zeros(len(corners), bool)
    if fit and length:
        merged = np.where(used[survivor], number[survivor], -1)
        # no edge flips at a border: nobody knows whether the new one is there already on the other side
        group = np.where(held[corners].any(axis=1), np.arange(len(corners)) + 1, -turned.astype(np.int64))
        fitted = refit(placed, corners, data["points"], faces, vertex_map=merged, fixed=held, group=group)
        placed, corners = fitted.vertices, corners.ravel().take(fitted.corner)
    corners[turned, 1:] = corners[turned, :0:-1]
    for name, values in (("points", placed), ("corners", corners.astype(np.int32)), ("held", held)):
        np.save(place / f"{name}_{cell}.npy", values)
    return {"faces": len(corners)}


def _load(folder: Path, cell: int, dtype: np.dtype) -> tuple[Floats, Ints, Bools]:
    """Read a cell's triangles, join what stands at one place, and tell the vertices that are held."""
    parts = []
    for kind in ("inner", "mixed", "held"):
        path = folder / f"cell_{cell}.{kind}"
        parts.append(np.fromfile(path, dtype).reshape(-1, 3) if path.is_file() else np.zeros((0, 3), dtype))
    inner, corners = len(parts[0]), len(parts[0]) + len(parts[1])
    points = np.concatenate(parts).astype(np.float64)
    order, new = morton_weld(points)
    number = np.zeros(len(points), np.int64)
    number[order] = np.cumsum(new) - 1
    held = np.zeros(int(np.count_nonzero(new)), bool)
    held[number[inner:]] = True
    return points[order[new]], number[:corners].reshape(-1, 3), held


def _has_a_triangle(faces: Ints) -> bool:
    a, b, c = faces.T
    return bool(((a != b) & (b != c) & (c != a)).any())


def _quadrics(mesh: Prepared, options: Options, scale: float) -> NDArray[np.float64]:
    """Weigh a cell as its whole mesh would be: Equation 9 without the mean, which only the whole mesh has."""
    plain = replace(options, method="qem") if options.method in ("so", "eso") else options
    quadrics = initial_quadrics(mesh, plain)
    if plain is not options:
        rings = 1 if options.method == "so" else int(options.rings)
        weights = surface_variation(mesh.points.T, mesh.faces.T, rings) * (scale / mesh.size)
        quadrics *= factors(weights, options)[:, None]
    return quadrics


if __name__ == "__main__":
    from .serving import serve

    serve(answer)
