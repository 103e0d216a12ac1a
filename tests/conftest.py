# SPDX-License-Identifier: GPL-3.0-or-later
"""What all tests share."""

import os
import signal
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings

# The suite is the same at every run, so that a change is judged by what it changed. HYPOTHESIS=explore looks further:
# HYPOTHESIS_EXAMPLES (2000) random examples of every property, whatever the test itself says.
settings.register_profile("steady", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None)
EXPLORING = os.environ.get("HYPOTHESIS") == "explore"
EXAMPLES = int(os.environ.get("HYPOTHESIS_EXAMPLES", "2000"))
settings.load_profile("explore" if EXPLORING else "steady")

# a shell that runs the suite in the background has Ctrl-C ignored, and so would what the tests start and then interrupt
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let no test's own settings stand in the way of looking further."""
    for item in items if EXPLORING else []:
        test = getattr(item, "obj", None)
        own = getattr(test, "_hypothesis_internal_use_settings", None)  # where Hypothesis keeps them
        if own is not None:
            test._hypothesis_internal_use_settings = settings(own, max_examples=EXAMPLES, derandomize=False)


@pytest.fixture(scope="session")
def root() -> Path:
    """Give the project's folder."""
    return Path(__file__).parent.parent


@pytest.fixture(scope="session")
def sample_meshes() -> Path:
    """Give the folder of meshes in pymeshlab's wheel, which is not imported: it does not go well with bpy."""
    spec = find_spec("pymeshlab")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("pymeshlab is not installed")
    return Path(spec.submodule_search_locations[0]) / "tests" / "sample_meshes"
