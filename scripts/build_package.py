# SPDX-License-Identifier: GPL-3.0-or-later
"""Build and validate the add-on's zip with Blender's own tool: build_package.py OUTPUT_FOLDER."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent


def extension_tool() -> Path:
    """Find Blender's builder of extensions inside the bpy wheel."""
    import bpy

    return Path(bpy.utils.system_resource("SCRIPTS")) / "addons_core/bl_pkg/cli/blender_ext.py"


def build(folder: Path) -> Path:
    """Build the zip in a folder, validate it, and give its path."""
    folder.mkdir(parents=True, exist_ok=True)
    tool = [sys.executable, str(extension_tool())]
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.zip")}
    subprocess.run([*tool, "build", "--source-dir", str(ROOT), "--output-dir", str(folder)], check=True)
    package = next(path for path in folder.glob("*.zip") if before.get(path) != path.stat().st_mtime_ns)
    subprocess.run([*tool, "validate", str(package)], check=True)
    return package


if __name__ == "__main__":
    build(Path(sys.argv[1]))
