# SPDX-License-Identifier: GPL-3.0-or-later
"""Build, validate and check the add-on's zip with Blender's own tool: build_package.py OUTPUT_FOLDER [--wheels]."""

import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
# What the zip may hold at its top.
CONTENT = {"blender_manifest.toml", "__init__.py", "LICENSE", "eso_addon"}
MOST_BYTES = 2_000_000
# pymeshlab's wheels by platform, for the Pythons of Blender 4.2 to 5.0 and of 5.1 and later.
PLATFORMS = {
    "linux-x64": ("manylinux_2_35_x86_64", "manylinux_2_31_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_11_0_arm64",),
}
PYTHONS = ("3.11", "3.13")


def extension_tool() -> Path:
    """Find Blender's builder of extensions inside the bpy wheel."""
    import bpy

    return Path(bpy.utils.system_resource("SCRIPTS")) / "addons_core/bl_pkg/cli/blender_ext.py"


def build(folder: Path, source: Path, *options: str) -> list[Path]:
    """Build the zips in a folder, validate them, and give their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    tool = [sys.executable, str(extension_tool())]
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.zip")}
    command = [*tool, "build", "--source-dir", str(source), "--output-dir", str(folder), *options]
    subprocess.run(command, check=True)
    packages = [path for path in folder.glob("*.zip") if before.get(path) != path.stat().st_mtime_ns]
    for package in packages:
        subprocess.run([*tool, "validate", str(package)], check=True)
    return packages


def check(package: Path) -> None:
    """Stop with one line if the zip holds what it should not, or too much."""
    with zipfile.ZipFile(package) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    strange = [name for name in names if name.split("/")[0] not in CONTENT]
    strange += [name for name in names if "/tests/" in name or "/." in name or name.endswith((".pyc", ".pyo", ".db"))]
    if strange:
        sys.exit(f"{package.name} holds what is not the add-on's: {', '.join(strange[:5])}")
    size = package.stat().st_size
    if size > MOST_BYTES:
        sys.exit(f"{package.name} has {size:,} bytes: more than {MOST_BYTES:,}")
    print(f"{package}: {len(names)} files, {size:,} bytes")


def build_with_wheels(folder: Path, plain: Path) -> list[Path]:
    """Build one zip a platform with pymeshlab in it, from what the plain one holds."""
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch)
        with zipfile.ZipFile(plain) as archive:
            archive.extractall(source)
        found = {platform: _download(source / "wheels", tags) for platform, tags in PLATFORMS.items()}
        wheels = sorted({path.name for paths in found.values() for path in paths})
        platforms = [platform for platform, paths in found.items() if paths]
        if not wheels:
            sys.exit("no wheel of pymeshlab could be had: check the network")
        manifest = source / "blender_manifest.toml"
        text = manifest.read_text(encoding="utf-8").split("[build]")[0]
        head, _, rest = text.partition("[permissions]")
        listed = "".join(f'  "./wheels/{name}",\n' for name in wheels)
        quoted = ", ".join(f'"{platform}"' for platform in platforms)
        keys = f"platforms = [{quoted}]\nwheels = [\n{listed}]\n\n"
        manifest.write_text(f"{head}{keys}[permissions]{rest}", encoding="utf-8")
        return build(folder, source, "--split-platforms")


def _download(folder: Path, tags: tuple[str, ...]) -> list[Path]:
    """Fetch pymeshlab's wheels of one platform; those that do not exist are left out."""
    folder.mkdir(exist_ok=True)
    before = set(folder.glob("*.whl"))
    for python in PYTHONS:
        platform = [word for tag in tags for word in ("--platform", tag)]
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps",
                   "--only-binary=:all:", "--python-version", python, *platform, "--dest", str(folder),
                   "pymeshlab>=2023.12"]  # fmt: skip
        if subprocess.run(command, check=False, capture_output=True).returncode:
            print(f"pymeshlab has no wheel for Python {python} on {tags[0]}: left out")
    return sorted(set(folder.glob("*.whl")) - before)


def build_plain(folder: Path) -> list[Path]:
    """Build the zip of the add-on alone, whatever else lies about in the project's folder."""
    with tempfile.TemporaryDirectory() as scratch:
        for name in CONTENT:
            path, ignored = ROOT / name, shutil.ignore_patterns("__pycache__", "*.pyc", ".*")
            if path.is_dir():
                shutil.copytree(path, Path(scratch) / name, ignore=ignored)
            else:
                shutil.copy2(path, scratch)
        return build(folder, Path(scratch))


def main(folder: Path, *, wheels: bool = False) -> None:
    """Build the zip, and those with wheels where they are asked for."""
    for package in build_plain(folder):
        check(package)
        if wheels:
            for large in build_with_wheels(folder, package):
                print(f"{large}: {large.stat().st_size:,} bytes, with pymeshlab")


if __name__ == "__main__":
    main(Path(sys.argv[1]), wheels="--wheels" in sys.argv)
