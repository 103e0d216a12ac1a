# SPDX-License-Identifier: GPL-3.0-or-later
from collections.abc import Generator

import bpy
import pytest

from eso_addon import operators
from eso_addon.jobs.worker import Worker

pytestmark = pytest.mark.usefixtures("addon")


def endless() -> Generator[float, None, None]:
    while True:
        yield 0.5


def test_threads_end_before_a_file_is_loaded() -> None:
    worker = Worker(endless())
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not worker.is_running


def test_threads_end_when_the_addon_goes() -> None:
    worker = Worker(endless())
    operators.unregister()
    assert not worker.is_running
    operators.register()
