# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of levels as each engine wants them."""

import pytest

from eso_addon.settings.profiles import PROFILES


@pytest.mark.parametrize("profile", ["plain", "unity", "unreal", "godot", "gltf"])
def test_numbered_from_the_finest(profile: str) -> None:
    assert [PROFILES[profile].name("Tree", level) for level in range(3)] == ["Tree_LOD0", "Tree_LOD1", "Tree_LOD2"]


def test_second_life_counts_from_the_coarsest() -> None:
    names = [PROFILES["secondlife"].name("Tree", level) for level in range(4)]
    assert names == ["Tree", "Tree_LOD2", "Tree_LOD1", "Tree_LOD0"]


def test_limits() -> None:
    assert PROFILES["unreal"].most_levels == 8
    assert PROFILES["secondlife"].most_levels == 4
