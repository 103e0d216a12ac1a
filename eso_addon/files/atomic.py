# SPDX-License-Identifier: GPL-3.0-or-later
"""Output files that appear whole or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_output(target: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a path to write to, and put what was written in the target's place once the block has ended well.

    Parameters
    ----------
    target
        The file to write; one that exists is replaced at the end, in one step.

    Yields
    ------
    Path
        A path with the target's name in a temporary folder beside it. Files that are written next to it (an .mtl,
        a .bin, a folder of textures) move with it, before it.

    Raises
    ------
    OSError
        If the target's folder does not exist or cannot be written in, the target is a folder, or nothing was written.

    Notes
    -----
    After an exception the temporary folder is gone and the target is as it was.
    """
    check_place(target)
    target = Path(target).absolute()
    # The temporary folder is a sibling of the target because a replacement is one step only within a file system.
    try:
        folder = Path(tempfile.mkdtemp(prefix=".eso_lod_", dir=target.parent))
    except OSError as error:
        raise OSError(f"cannot write {target.name} in {target.parent}: {error.strerror}; give another folder") from None
    try:
        draft = folder / target.name
        yield draft
        if not draft.is_file():
            raise OSError(f"cannot write {target}: nothing was written")
        for companion in [path for path in folder.rglob("*") if path.is_file() and path != draft]:
            place = target.parent / companion.relative_to(folder)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(companion, place)
        os.replace(draft, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def check_place(path: str | os.PathLike[str] | None, *, unlike: Iterable[str | os.PathLike[str]] = ()) -> None:
    """Refuse a file that cannot be written: before the work, not after it.

    Parameters
    ----------
    path
        The file; None is none, and fine.
    unlike
        Files that the same run reads or writes, which are not to be written over.

    Raises
    ------
    OSError
        Its folder does not exist, it has the name of a folder, or is one of the others.
    """
    if path is None:
        return
    target = Path(path).absolute()
    if not target.parent.is_dir():
        raise FileNotFoundError(f"cannot write {target.name}: the folder {target.parent} does not exist")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {target}: it is a folder; give the name of a file")
    if any(_is_same(target, Path(other)) for other in unlike):
        raise FileExistsError(f"cannot write {target.name}: another file of this run has that name; give another")


def _is_same(one: Path, other: Path) -> bool:
    if one.exists() and other.exists():  # a file system may not tell capitals from small letters
        return one.samefile(other)
    return one.resolve() == other.resolve()
