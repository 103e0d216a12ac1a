# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in cells: nothing is lost, no crack opens, the target is met, borders are as good as the rest."""

import itertools
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eso_addon.core.closest import ClosestPoints
from eso_addon.core.deviation import measure
from eso_addon.core.mesh import MeshError
from eso_addon.core.simplify import simplify
from eso_addon.farm import large
from eso_addon.farm.cell import answer
from eso_addon.farm.cells import CUTS, Joined, deal, plant
from eso_addon.farm.large import Large, Plan, _goals, share, simplify_large
from eso_addon.files.pieces import open_triangles
from eso_addon.files.ply import write_ply
from eso_addon.files.stl import write_stl


class Soup:
    """Triangles in memory, as a source."""

    def __init__(self, corners: np.ndarray) -> None:
        self.corners, self.dtype = corners, corners.dtype

    def count(self) -> int:
        return len(self.corners)

    def blocks(self, size: int) -> Iterator[np.ndarray]:
        for start in range(0, len(self.corners), size):
            yield self.corners[start : start + size]

    def sample(self, count: int) -> np.ndarray:
        return self.corners.reshape(-1, 3)


def torus(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Make a closed bumpy torus of 2 rows columns triangles."""
    u, w = np.meshgrid(np.arange(columns) * 2 * np.pi / columns, np.arange(rows) * 2 * np.pi / rows, indexing="ij")
    r = 1 + 0.1 * np.sin(7 * u) * np.cos(5 * w) + 0.01 * np.sin(31 * u + 3 * w)
    ring = 3 + r * np.cos(w)
    vertices = np.stack((ring * np.cos(u), ring * np.sin(u), r * np.sin(w)), -1).reshape(-1, 3).astype(np.float32)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    a, b = i * rows + j, (i + 1) % columns * rows + j
    c, d = (i + 1) % columns * rows + (j + 1) % rows, i * rows + (j + 1) % rows
    return vertices.astype(np.float64), np.stack((a, b, c, a, c, d), -1).reshape(-1, 3)


def run_here(requests: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    return map(answer, requests)


def in_cells(monkeypatch: pytest.MonkeyPatch, folder: Path, source: Soup, goal: int, *, cell: int,
             whole: int) -> Large:
    """Simplify with so many triangles in a cell, and in the engine's hands at once."""
    monkeypatch.setattr(Plan, "in_cell", lambda plan, part=0.0: cell)
    monkeypatch.setattr(Plan, "at_once", lambda plan, goal: whole)
    monkeypatch.setattr(large, "_LEAST_CELL", 0)
    folder.mkdir(exist_ok=True)
    plan = Plan(1 << 30, 1, run_here, lambda text: None)
    return simplify_large(source, lambda before: goal, {}, folder, plan)


def mesh_of(result: Large) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate(list(result.vertices())), np.concatenate(list(result.faces()))


def faces_of_edges(faces: np.ndarray) -> np.ndarray:
    edges = np.sort(np.concatenate((faces[:, :2], faces[:, 1:], faces[:, ::2])), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


@pytest.fixture(scope="module")
def ring() -> tuple[np.ndarray, np.ndarray]:
    return torus(60, 150)


@pytest.mark.parametrize(("goal", "whole"), [(1500, 1), (1500, 4500), (10_000, 1), (1500, 100_000)])
def test_no_crack_and_the_target(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, goal: int, whole: int,
                                 ring: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = ring
    result = in_cells(monkeypatch, tmp_path / "cells", Soup(vertices[faces]), goal, cell=4000, whole=whole)
    points, corners = mesh_of(result)
    assert (faces_of_edges(corners) == 2).all()
    assert len(np.unique(corners)) == len(points) == len(np.unique(points, axis=0))
    assert len(points) - 3 * len(corners) / 2 + len(corners) == 0  # a torus still
    assert goal - 12 <= len(corners) == result.after <= goal
    assert np.array_equal(np.concatenate(list(result.triangles())), points[corners])


@pytest.mark.parametrize(("goal", "whole"), [(6000, 1), (1500, 7000), (1500, 2400), (1500, 1)])
def test_as_good_as_in_memory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, goal: int, whole: int,
                              ring: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = ring
    result = in_cells(monkeypatch, tmp_path / "cells", Soup(vertices[faces]), goal, cell=4000, whole=whole)
    once = simplify(vertices, faces, faces_target=goal)
    there = measure(vertices, faces, *mesh_of(result), samples=40_000)
    here = measure(vertices, faces, once.vertices, once.faces, samples=40_000)
    assert there.symmetric.mean < 1.1 * here.symmetric.mean


def test_borders_are_as_good_as_elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                          ring: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = ring
    trees = []
    monkeypatch.setattr("eso_addon.farm.cells.plant", lambda *words: trees.append(plant(*words)) or trees[-1])
    points, corners = mesh_of(in_cells(monkeypatch, tmp_path / "cells", Soup(vertices[faces]), 4000, cell=3000,
                                       whole=1))
    surface = ClosestPoints(vertices, faces)
    far = np.sqrt(surface.query(points[corners].mean(axis=1))[2])
    long = np.linalg.norm(points[corners] - points[np.roll(corners, 1, axis=1)], axis=2).mean(axis=1)
    assert len(trees) > 3
    for tree in trees:
        cells = tree.cell_of(points)[corners]
        near = np.isin(corners, corners[(cells != cells[:, :1]).any(axis=1)]).any(axis=1)
        for values in (far, long):
            assert 0.85 < values[near].mean() / values[~near].mean() < 1.15


@given(before=st.integers(1, 10**9), part=st.floats(1e-4, 1), at_once=st.integers(0, 10**9),
       cell=st.integers(20_000, 10**7))
def test_rounds_go_down_in_steps(before: int, part: float, at_once: int, cell: int) -> None:
    goal = max(round(before * part), 1)
    left = [before, *_goals(before, goal, at_once, cell)]
    assert len(left) < 40
    assert all(fine >= coarse for fine, coarse in itertools.pairwise(left))
    assert left[-1] <= max(at_once, goal)
    assert goal in left or goal <= left[-1]
    for fine, coarse in itertools.pairwise(left):  # what stands along a border of a full cell is few
        assert coarse >= min(fine * min(30 / cell**0.5, 0.5), 4 * goal) * 0.99 - 1


@given(count=st.integers(1, 300), distinct=st.integers(1, 40), most=st.integers(1, 100), cut=st.sampled_from(CUTS),
       block=st.integers(1, 100), seed=st.integers(0, 999))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
def test_each_triangle_is_dealt_once(tmp_path_factory: pytest.TempPathFactory, count: int, distinct: int, most: int,
                                     cut: float, block: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.integers(-2, 3, (distinct, 3)).astype(np.float32)
    corners = points[rng.integers(0, distinct, (count, 3))]
    folder = tmp_path_factory.mktemp("cells")
    counts, size = deal(Soup(corners), folder, count, most, cut, block)
    assert size == np.ptp(corners.reshape(-1, 3), axis=0).max()
    tree = plant(corners.reshape(-1, 3), 3 * count * most / count, cut)
    found, homes = [], {}
    for cell, dealt in enumerate(counts):
        parts = {kind: np.fromfile(path, np.float32).reshape(-1, 3) if path.is_file() else np.zeros((0, 3), np.float32)
                 for kind in ("inner", "mixed", "held") for path in [folder / f"cell_{cell}.{kind}"]}
        assert len(parts["inner"]) + len(parts["mixed"]) == 3 * dealt
        assert (tree.cell_of(parts["inner"]) == cell).all()
        assert (tree.cell_of(parts["held"]) == cell).all()
        found += [*parts["inner"].reshape(-1, 9).tolist(), *parts["mixed"].reshape(-1, 9).tolist()]
        held = {tuple(point) for kind in ("mixed", "held") for point in parts[kind].tolist()}
        for point in {tuple(point) for kind in ("inner", "mixed") for point in parts[kind].tolist()}:
            homes.setdefault(point, []).append(point in held)
    assert sorted(found) == sorted(corners.reshape(-1, 9).tolist())
    assert all(all(held) for held in homes.values() if len(held) > 1)  # what several cells have, all of them hold


@given(sizes=st.lists(st.integers(1, 500), min_size=1, max_size=8), part=st.floats(0.01, 1.2), seed=st.integers(0, 99))
def test_shares_add_up(sizes: list[int], part: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    ladders = [{"left": [size, *range(size - 1, -1, -1)], "cost": np.sort(np.append(0.0, rng.random(size))).tolist()}
               for size in sizes]
    wanted = round(part * sum(sizes))
    shares = share(ladders, wanted)
    assert sum(shares) == min(wanted, sum(sizes))
    assert all(0 <= count <= size for count, size in zip(shares, sizes, strict=True))


@pytest.mark.parametrize("ending", [".ply", ".stl"])
def test_command_line(tmp_path: Path, root: Path, ending: str) -> None:
    vertices, faces = torus(300, 500)
    source, target = tmp_path / f"in{ending}", tmp_path / f"out{ending}"
    if ending == ".ply":
        write_ply(source, [vertices], [faces])
    else:
        write_stl(source, [vertices[faces]])
    # a process of its own: what this one holds counts
    words = ["--ratio", "0.05", "--memory-limit", "200M", "--workers", "1", "--json", tmp_path / "figures.json"]
    done = subprocess.run([sys.executable, "-m", "eso_addon", "simplify", source, target, *words], check=True, cwd=root,
                          capture_output=True, text=True)
    assert "300000 triangles simplified to" in done.stdout  # in cells, and not as a whole
    assert sum(len(block) for block in open_triangles(target).blocks(1000)) == 15_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figures.json", f"in{ending}", f"out{ending}"]


def test_a_run_that_is_stopped_leaves_nothing(tmp_path: Path, root: Path) -> None:
    vertices, faces = torus(300, 500)
    write_ply(tmp_path / "in.ply", [vertices], [faces])
    run = subprocess.Popen([sys.executable, "-m", "eso_addon", "simplify", tmp_path / "in.ply", tmp_path / "out.ply",
                            "--ratio", "0.05", "--memory-limit", "200M"], cwd=root, stderr=subprocess.PIPE, text=True)
    ends = time.monotonic() + 120
    while not list(tmp_path.glob(".eso_lod_*/round_0/cell_*")) and time.monotonic() < ends:
        time.sleep(0.05)
    run.terminate()
    assert run.communicate(timeout=120)[1] == "eso_lod: stopped: out.ply was not written\n"
    assert run.returncode == 1
    assert [path.name for path in tmp_path.iterdir()] == ["in.ply"]


@pytest.mark.parametrize(("words", "told"), [
    (["in.ply", "out.glb", "--ratio", "0.5", "--memory-limit", "1G"], "give a .ply or .stl"),
    (["in.obj", "out.ply", "--ratio", "0.5", "--memory-limit", "1G"], "in.obj"),
    (["in.ply", "out.ply", "--ratio", "0.5", "--memory-limit", "10M"], "too little"),
    (["in.ply", "out.ply", "--max-error", "0.5", "--memory-limit", "1G"], "--ratio or --faces"),
    (["in.ply", "out.ply", "--ratio", "0.5", "--memory-limit", "1G", "--no-weld"], "--no-weld"),
    (["in.ply", "out.ply", "--ratio", "0.5", "--memory-limit", "1G", "--prune", "1"], "--prune"),
    (["in.ply", "out.ply", "--ratio", "0.5", "--memory-limit", "1G", "--method", "feature"], "feature"),
    (["no.ply", "out.ply", "--ratio", "0.5", "--memory-limit", "1G"], "no.ply"),
    (["empty.ply", "out.ply", "--ratio", "0.5", "--memory-limit", "1G"], "no faces"),
    (["in.ply", "no/out.ply", "--ratio", "0.5", "--memory-limit", "1G"], "does not exist"),
])
def test_what_cannot_be_done_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], told: str,
                                       capsys: pytest.CaptureFixture[str]) -> None:
    from eso_addon.cli import main

    monkeypatch.chdir(tmp_path)
    write_ply("in.ply", [np.eye(3)], [np.array([[0, 1, 2]])])
    write_ply("empty.ply", [np.eye(3)], [])
    Path("in.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert main(["simplify", *words]) == 1
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1
    assert not Path("out.ply").exists()


def test_a_coordinate_that_is_not_finite(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    corners = np.zeros((100, 3, 3))
    corners[50, 1, 2] = np.nan
    with pytest.raises(MeshError, match="not finite"):
        in_cells(monkeypatch, tmp_path / "cells", Soup(corners), 10, cell=20, whole=1)


def test_joined_points_are_exact(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = rng.standard_normal((30, 3))
    for cell, some in enumerate((points[:20], points[10:])):
        np.save(tmp_path / f"points_{cell}.npy", some)
        np.save(tmp_path / f"corners_{cell}.npy", np.arange(18).reshape(-1, 3))
        np.save(tmp_path / f"held_{cell}.npy", (np.arange(20) >= 10) == (cell == 0))
    joined = Joined.of(tmp_path, [0, 1])
    vertices, faces = np.concatenate(list(joined.vertices())), np.concatenate(list(joined.faces()))
    assert len(vertices) == 30
    assert np.array_equal(vertices[faces], np.concatenate((points[:18], points[10:28])).reshape(-1, 3, 3))
