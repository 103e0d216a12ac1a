# SPDX-License-Identifier: GPL-3.0-or-later
"""ESO LOD: meshes with fewer triangles that keep their shape, weighted by the extended shape operator.

The functions of the Python API are loaded when they are first used, so that importing the package needs neither
numpy nor Blender; `register` and `unregister` are for Blender alone.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .core.deviation import Deviation, measure
    from .core.mesh import MeshError
    from .core.simplify import SimplifyResult, lod_chain, lod_chain_steps, simplify, simplify_steps
    from .core.variation import vertex_weights
    from .progressive.progressive import Progressive, load_progressive, progressive

__version__ = "0.1.0"

__all__ = [
    "Deviation",
    "MeshError",
    "Progressive",
    "SimplifyResult",
    "lod_chain",
    "lod_chain_steps",
    "load_progressive",
    "measure",
    "progressive",
    "register",
    "simplify",
    "simplify_steps",
    "unregister",
    "vertex_weights",
]

_MODULE_OF_NAME = {
    "Deviation": "core.deviation",
    "MeshError": "core.mesh",
    "SimplifyResult": "core.levels",
    "glTF2ExportUserExtension": "bridge.gltf_lod",  # for Blender's glTF exporter, which looks for it here
    "lod_chain": "core.simplify",
    "lod_chain_steps": "core.simplify",
    "Progressive": "progressive.progressive",
    "load_progressive": "progressive.progressive",
    "measure": "core.deviation",
    "progressive": "progressive.progressive",
    "simplify": "core.simplify",
    "simplify_steps": "core.simplify",
    "vertex_weights": "core.variation",
}
_BLENDER_PARTS = ("settings", "operators", "ui")
_COMMAND = "eso_lod"
_command_handles: list[object] = []


def __getattr__(name: str) -> Any:  # noqa: ANN401 - functions, classes and exceptions alike
    """Load a name of the public API when it is first used."""
    if name not in _MODULE_OF_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULE_OF_NAME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public API, loaded or not."""
    return sorted({*globals(), *__all__})


def register() -> None:
    """Switch the add-on on: settings, operators, panels, and `blender --command eso_lod`."""
    import bpy

    for part in _BLENDER_PARTS:
        import_module(f".{part}", __name__).register()
    if hasattr(bpy.utils, "register_cli_command"):
        _command_handles.append(bpy.utils.register_cli_command(_COMMAND, _run_command))


def _run_command(argv: list[str]) -> int:
    from .cli import main

    return main(argv)


def unregister() -> None:
    """Switch the add-on off again."""
    import bpy

    while _command_handles:
        bpy.utils.unregister_cli_command(_command_handles.pop())
    for part in reversed(_BLENDER_PARTS):
        import_module(f".{part}", __name__).unregister()
