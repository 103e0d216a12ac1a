# SPDX-License-Identifier: GPL-3.0-or-later
"""Check that Blender's Python module starts; if not, say in one line which system packages it lacks."""

import sys
from pathlib import Path


def main() -> int:
    """Import bpy; give 0, or 1 after naming what to install."""
    try:
        import bpy  # noqa: F401 - only the import matters
    except ImportError as error:
        packages = " ".join((Path(__file__).parent / "debian_packages.txt").read_text().split())
        print(f"Blender's module cannot start ({error}). On Debian: apt-get install {packages}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
