# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser, servers, and a stream to show."""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eso_addon.progressive.progressive import progressive

from ..progressive.meshes import grid
from .sites import Site

# Software is what every machine has to draw with; a sandbox is what root does not get.
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
         "--disable-dev-shm-usage"]


@pytest.fixture(scope="session")
def torus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a stream of 5000 triangles, without attributes."""
    points, faces = grid(50, 50, np.random.default_rng(0), closed=True)
    path = tmp_path_factory.mktemp("viewer") / "torus.esopm"
    progressive(points, faces, meta={"name": "torus"}).save(path)
    return path


@pytest.fixture
def site(torus: Path) -> Iterator[Callable[..., Site]]:
    """Give a function that starts servers, which are stopped afterwards."""
    sites: list[Site] = []

    def start(path: Path = torus, **behaviour: Any) -> Site:  # noqa: ANN401 - what Site has
        sites.append(Site(path))
        for name, value in behaviour.items():
            setattr(sites[-1], name, value)
        return sites[-1]

    yield start
    for each in sites:
        each.close()


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Give a Chromium without a window."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        path = None
    if path is None:
        if os.environ.get("CI"):
            pytest.fail("CI must have Chromium and Playwright: see .ci/run")
        pytest.skip("Chromium or Playwright is not installed")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:  # noqa: ANN401 - Playwright has no types here
    """Give a page; an error that it does not handle fails the test."""
    context = browser.new_context(viewport={"width": 640, "height": 480})
    context.set_default_timeout(60_000)
    tab = context.new_page()
    wrong: list[str] = []
    tab.on("pageerror", lambda error: wrong.append(str(error)))
    yield tab
    context.close()
    assert wrong == []
