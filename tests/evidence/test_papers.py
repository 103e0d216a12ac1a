# SPDX-License-Identifier: GPL-3.0-or-later
"""The short form of `make papers`: the cow at two levels, against the ranges that were found before the product."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pymeshlab")

from evidence import __main__ as papers
from evidence import models, page, printed, raster, reconstruction
from evidence.context import Context
from tests.core import shapes

LEVELS = (20, 10)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory, sample_meshes: Path) -> Path:
    folder = tmp_path_factory.mktemp("papers")
    assert papers.run(None, folder, lambda _: None, short=True) == 0
    return folder


@pytest.fixture(scope="module")
def raw(out: Path) -> dict:
    return json.loads((out / "papers.json").read_text(encoding="utf-8"))


def deviation(raw: dict, variant: str, percent: int, figure: str, by: str = "pymeshlab") -> float:
    (row,) = [row for row in raw["2-deviation"] if (row["variant"], row["percent"]) == (variant, percent)]
    return row[by][figure]


def test_eso_as_printed_is_within_reach_of_the_paper(raw: dict) -> None:
    for percent in LEVELS:
        _, _, eso = printed.DISTANCES["cow"][percent]
        assert 0.7 < deviation(raw, "ESO 3", percent, "backward_max") / eso < 1.4


def test_the_other_direction_shows_more(raw: dict) -> None:
    assert 0.0045 < deviation(raw, "ESO 3", 20, "forward_max") < 0.009
    assert 0.009 < deviation(raw, "ESO 3", 10, "forward_max") < 0.02


def test_area_weights_have_the_lesser_mean(raw: dict) -> None:
    # at 20 %: as printed 104.6e-5, Decimate 86.8e-5, weighted by area 74.2e-5, and the refit takes 10 to 30 % more
    means = {name: max(deviation(raw, name, 20, f"{way}_mean") for way in ("forward", "backward"))
             for name in ("ESO 3", "ESO default")}
    assert 90e-5 < means["ESO 3"] < 125e-5
    assert means["ESO default"] < 75e-5


def test_both_measures_agree(raw: dict) -> None:
    for row in raw["2-deviation"]:
        for way in ("forward", "backward"):
            assert row["measure"][f"{way}_mean"] == pytest.approx(row["pymeshlab"][f"{way}_mean"], rel=0.04)


def test_most_vertices_move_three_times_or_less(raw: dict) -> None:
    for row in raw["1-moving-lengths"]:
        assert sum(row["moved"]) == 2904
        assert row["moved"][0] == pytest.approx(printed.MOVES["cow"][row["percent"]][0], abs=3)
        assert sum(row["moved"][:4]) > 0.95 * 2904


def test_the_stream_comes_back_and_refit_pays(raw: dict) -> None:
    assert raw["7-a-subdivided-mesh-reconstructed-figure-12"][-1] == {"mesh": "whole", "equal": True}
    assert raw["8-ablation"]["means"]["no refit"]["mean"] > 1.05
    for row in raw["5-the-second-paper-s-table-1"]:
        assert row["stream_patch"] < row["patch_text"]


def test_the_page_needs_nothing_beside_it(out: Path) -> None:
    text = (out / "index.html").read_text(encoding="utf-8")
    assert not re.search(r'(src|href)="(?!data:|#)', text)
    assert "<script" not in text
    for number in range(1, 9):
        assert f"<h2>{number}. " in text
    assert 'class="problem"' not in text
    assert text.count("<svg") >= 4
    assert text.count("data:image/webp") >= 15


def test_the_markdown_has_its_pictures(out: Path) -> None:
    text = (out / "papers.md").read_text(encoding="utf-8")
    named = re.findall(r"\]\((images/[^)]+)\)", text)
    assert len(named) >= 10
    assert all((out / name).is_file() for name in named)


def test_a_section_that_fails_is_named_and_the_rest_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                             sample_meshes: Path) -> None:
    def fail(_: object) -> page.Section:
        raise RuntimeError("no pictures today")

    def fine(_: object) -> page.Section:
        return page.Section("2. Fine", ["All is well."], raw=[1.0, float("nan")])

    monkeypatch.setattr(papers, "SECTIONS", {"Broken": fail, "Fine": fine})
    assert papers.run(None, tmp_path, lambda _: None) == 1
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "no pictures today" in text
    assert "All is well." in text
    assert "dragon_25k.obj" in text  # a model that is missing is named
    assert json.loads((tmp_path / "papers.json").read_text(encoding="utf-8"))["2-fine"] == [1.0, None]


def test_a_picture_or_a_model_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                 sample_meshes: Path) -> None:
    def draw(context: Context) -> page.Section:
        cow = context.models["cow"]
        return page.Section("1. Drawn", [page.Pictures("The cow.", [(context.picture(cow.mesh, cow.camera), "cow")])])

    def fail(*_: object, **__: object) -> None:
        raise MemoryError("no room for a picture")

    monkeypatch.setattr(papers, "SECTIONS", {"Drawn": draw})
    monkeypatch.setattr("evidence.context.render", fail)
    (tmp_path / "dragon_25k.obj").write_text("this is no mesh\n")
    assert papers.run(tmp_path, tmp_path / "out", lambda _: None) == 0
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "no room for a picture" in text
    assert "dragon (" in text


def test_the_printed_tables_agree_with_each_other() -> None:
    for name, levels in printed.MOVES.items():
        for percent, counts in levels.items():
            assert 100 * sum(counts[:4]) / sum(counts) == pytest.approx(printed.AT_MOST_THREE[name][percent], abs=0.01)
    assert printed.improvement(*printed.DISTANCES["cow"][10][1:]) == pytest.approx(61.81, abs=0.05)


def test_root_three_makes_three_of_one() -> None:
    mesh = shapes.ball(1)
    vertices, faces = models.subdivided(mesh, 2)
    assert len(faces) == 9 * len(mesh[1])
    assert len(vertices) == len(mesh[0]) + len(mesh[1]) * 4
    assert shapes.topology(faces) == shapes.topology(mesh[1])
    normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    assert ((normals * vertices[faces].mean(axis=1)).sum(axis=1) > 0).all()
    with pytest.raises(ValueError, match="closed"):
        models.subdivided(shapes.sheet(2, 2), 1)


def test_a_picture_shows_what_is_in_front() -> None:
    square = np.array([[0, 1, 2], [0, 2, 3]])
    corners = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1.0]])
    vertices = np.concatenate((corners, corners * 0.5 + [1, 0, 0]))
    colors = np.repeat([[1.0, 0, 0], [0, 0, 1.0]], 4, axis=0)
    camera = raster.Camera.around(vertices, 0, 0)
    picture = raster.render((vertices, np.concatenate((square, square + 4))), camera, 64, colors=colors, wire=False)
    assert picture[32, 32, 2] > 150 > picture[32, 32, 0]
    assert picture[8, 8, 0] > 150 > picture[8, 8, 2]
    assert (picture[0, 0] > 240).all()


def test_same_faces_in_another_order_are_the_same() -> None:
    vertices, faces = shapes.ball(1)
    order = np.random.default_rng(0).permutation(len(vertices))
    number = np.argsort(order)
    other = (vertices[order], np.roll(number[faces], 1, axis=1)[::-1])
    assert reconstruction.same_faces((vertices, faces), other)
    assert not reconstruction.same_faces((vertices, faces), (other[0], other[1][:, ::-1]))
