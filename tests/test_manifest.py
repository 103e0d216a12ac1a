# SPDX-License-Identifier: GPL-3.0-or-later
"""The manifest keeps the rules of extensions.blender.org, and says the same as pyproject.toml."""

import tomllib
from pathlib import Path

import pytest

import eso_addon

ROOT = Path(__file__).parent.parent


@pytest.fixture
def manifest() -> dict:
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def test_identity(manifest: dict) -> None:
    assert manifest["id"] == "eso_lod"
    assert "blender" not in manifest["name"].lower()
    assert manifest["type"] == "add-on"
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "4.2.0"


def test_short_texts(manifest: dict) -> None:
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert 0 < len(text) <= 64
        assert not text.endswith(".")
    assert set(manifest["permissions"]) == {"files"}


def test_one_version(manifest: dict) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert manifest["version"] == project["version"] == eso_addon.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{manifest['version']}]" in changelog or "## [Unreleased]" in changelog


def test_the_licence_is_there() -> None:
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "GNU GENERAL PUBLIC LICENSE" in licence
    assert "Version 3, 29 June 2007" in licence
