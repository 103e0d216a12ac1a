# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of meshes and the folder of its levels: what is below, where each goes, and what it is made of."""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import re
import stat
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

_DRAFTS = ".eso_lod_"  # how the folders of `files.atomic` begin


@dataclass(frozen=True)
class Entry:
    """One file of a library.

    Attributes
    ----------
    name : str
        Its place below the library's folder, with forward slashes.
    source, target : Path
        The file, and the one that its levels go to or are named after.
    size : int
        Bytes.
    digest : str
        Of its content and of the files that it names.
    trouble : str
        Why it cannot be worked on; empty where it can.
    """

    name: str
    source: Path
    target: Path
    size: int = 0
    digest: str = ""
    trouble: str = ""


def list_library(folder: Path, output: Path, endings: Sequence[str], ending: str | None = None) -> list[Entry]:
    """Find every file below a folder that has one of the endings, and where its levels go.

    Parameters
    ----------
    folder, output
        Where the files are, and where their levels go, to the same relative places.
    endings
        What mesh files end in, in small letters.
    ending
        What the levels' files end in; as the files themselves where it is not given.

    Returns
    -------
    list of Entry
        In the order of their names. A folder or a device with the name of a mesh is among them, with its trouble.

    Raises
    ------
    ValueError
        As `check_folders`.
    OSError
        The folder cannot be read.
    """
    check_folders(folder, output)
    folder, output = folder.resolve(), output.resolve()
    places = sorted(_walk(folder, output, endings), key=lambda place: place[0].as_posix())
    targets = _targets([path for path, _ in places], ending)
    return [_entry(folder, path, output / target, trouble)
            for (path, trouble), target in zip(places, targets, strict=True)]


def check_folders(folder: Path, output: Path) -> None:
    """Refuse folders that are none.

    Raises
    ------
    ValueError
        One is something else, or the output would lie among the sources.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder} is no folder: give that of the meshes")
    if output.exists() and not output.is_dir():
        raise ValueError(f"{output} is a file: give a folder for the levels")
    if folder.resolve().is_relative_to(output.resolve()):
        raise ValueError(f"{output} holds the files themselves: give another folder for the levels")


def sweep(output: Path) -> None:
    """Remove drafts that a run left behind when it was killed."""
    import shutil

    for folder, names, _ in os.walk(output):
        for name in [name for name in names if name.startswith(_DRAFTS)]:
            shutil.rmtree(Path(folder, name), ignore_errors=True)
            names.remove(name)


def _targets(paths: list[Path], ending: str | None) -> list[Path]:
    """Give each file a target of its own, also where a file system does not tell capitals from small letters."""
    targets = [path.with_suffix(ending or path.suffix.lower()) for path in paths]
    for rounds in range(len(paths) + 1):
        times = Counter(target.as_posix().casefold() for target in targets)
        clashing = [place for place, target in enumerate(targets) if times[target.as_posix().casefold()] > 1]
        if not clashing:
            break
        for number, place in enumerate(clashing):  # a.obj and a.ply become a.obj.glb and a.ply.glb
            name = paths[place].name + (f".{number}" if rounds else "")
            targets[place] = paths[place].with_name(name + targets[place].suffix)
    return targets


def _walk(folder: Path, output: Path, endings: Sequence[str]) -> Iterator[tuple[Path, str]]:
    """Give the relative path of each mesh file, and what is wrong with it."""
    unread: list[OSError] = []
    for place, folders, files in os.walk(folder, onerror=unread.append):
        here = Path(place)
        for name in folders:
            if Path(name).suffix.lower() in endings and here / name != output:
                yield (here / name).relative_to(folder), f"{name} is a folder, not a mesh"
        folders[:] = [name for name in folders if here / name != output and not name.startswith(_DRAFTS)]
        yield from (((here / name).relative_to(folder), "") for name in files if Path(name).suffix.lower() in endings)
    for error in unread:
        yield Path(error.filename).relative_to(folder), f"cannot look into the folder: {error.strerror}"


def _entry(folder: Path, path: Path, target: Path, trouble: str) -> Entry:
    source = folder / path
    name = path.as_posix().encode("utf-8", "backslashreplace").decode()
    if trouble:
        return Entry(name, source, target, trouble=trouble)
    try:
        found = source.stat()
        if not stat.S_ISREG(found.st_mode):
            return Entry(name, source, target, trouble=f"{source.name} is no regular file")
        if not found.st_size:
            return Entry(name, source, target, trouble=f"{source.name} is empty: 0 bytes")
        return Entry(name, source, target, found.st_size, _digest(source))
    except OSError as error:
        return Entry(name, source, target, trouble=f"{error.strerror or error}: {source.name}")


def _digest(path: Path) -> str:
    """Hash a file and those that it names, without which it is not the same mesh."""
    with open(path, "rb") as file:
        total = hashlib.file_digest(file, "sha256")
    for companion in _companions(path):
        if companion.is_file():
            with open(companion, "rb") as file:
                total.update(hashlib.file_digest(file, "sha256").digest())
    return total.hexdigest()


def _companions(path: Path) -> list[Path]:
    """Find the materials of an .obj file, and the buffers and pictures of a .gltf file."""
    if path.suffix.lower() == ".obj":
        with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            names = [os.fsdecode(name.strip()) for name in re.findall(rb"(?m)^mtllib[ \t]+([^\r\n]+)", data)]
    elif path.suffix.lower() == ".gltf":
        try:
            scene = json.loads(path.read_bytes())
            parts = [*scene.get("buffers", ()), *scene.get("images", ())]
            names = [unquote(part["uri"]) for part in parts if not part.get("uri", "data:").startswith("data:")]
        except (ValueError, AttributeError, TypeError):  # which the reader will tell
            names = []
    else:
        names = []
    return [path.parent / name for name in names if "\0" not in name]
