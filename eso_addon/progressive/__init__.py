# SPDX-License-Identifier: GPL-3.0-or-later
"""Progressive meshes: patches in batches, their coder, the .esopm container, and any level of detail from it."""

import sys
from types import ModuleType
from typing import Any


class _CallablePackage(ModuleType):
    """Lets `eso_addon.progressive(...)` work: importing this folder puts it in the place of the function's name."""

    def __call__(self, *args: Any, **options: Any) -> Any:  # noqa: ANN401 - handed on as it is
        """Call `progressive.progressive`."""
        from .progressive import progressive

        return progressive(*args, **options)


sys.modules[__name__].__class__ = _CallablePackage
