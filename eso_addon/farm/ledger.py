# SPDX-License-Identifier: GPL-3.0-or-later
"""The ledger of a batch: one row a file, in a SQLite file beside the results."""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

NAME = "ledger.sqlite"
_LOCK = ".ledger.lock"


@dataclass(frozen=True)
class Row:
    """What became of one file.

    Attributes
    ----------
    path : str
        Its place below the library's folder.
    hash, settings, version : str
        What the result was made of, how, and by which version; a change of any makes it stale.
    result : str
        "done", or "set aside".
    error : str
        Why it was set aside.
    seconds : float
        Of work, reading and writing included.
    triangles, triangles_after : int
        Of all its meshes, before and at the coarsest level.
    deviation : float
        The largest distance of any level from the original, in the file's units.
    outputs : tuple of str
        The files written, below the output's folder.
    tries : int
        How often it was begun until then.
    notes : tuple of str
        What was mended or could not be carried over.
    """

    path: str
    hash: str
    settings: str
    version: str
    result: str
    error: str = ""
    seconds: float = 0.0
    triangles: int = 0
    triangles_after: int = 0
    deviation: float = 0.0
    outputs: tuple[str, ...] = ()
    tries: int = 1
    notes: tuple[str, ...] = field(default=())


_COLUMNS = [column.name for column in fields(Row)]
_LISTS = ("outputs", "notes")
_TYPES = {"seconds": "REAL", "deviation": "REAL", "triangles": "INTEGER", "triangles_after": "INTEGER",
          "tries": "INTEGER"}


class Ledger:
    """The rows of one batch; each is on disk as soon as it is put.

    Parameters
    ----------
    folder
        Where the results are.

    Raises
    ------
    ValueError
        The file is no ledger.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._file = sqlite3.connect(folder / NAME, timeout=60)
        columns = ", ".join(f"{name} {_TYPES.get(name, 'TEXT')}" for name in _COLUMNS)
        try:
            with self._file:
                self._file.execute(f"CREATE TABLE IF NOT EXISTS files ({columns}, finished TEXT, PRIMARY KEY (path))")
            self.rows()
        except (sqlite3.DatabaseError, ValueError, TypeError):
            self.close()
            raise ValueError(f"{folder / NAME} is no ledger of this version: move it away, and all is made "
                             "again") from None

    def rows(self) -> dict[str, Row]:
        """Give all rows by their paths, in order."""
        found = self._file.execute(f"SELECT {', '.join(_COLUMNS)} FROM files ORDER BY path")
        rows = (dict(zip(_COLUMNS, values, strict=True)) for values in found)
        return {row["path"]: Row(**row | {name: tuple(json.loads(row[name])) for name in _LISTS}) for row in rows}

    def put(self, row: Row) -> None:
        """Write a row in the place of the file's last one."""
        values: dict[str, Any] = asdict(row)
        values |= {name: json.dumps(values[name]) for name in _LISTS}
        values["finished"] = time.strftime("%Y-%m-%d %H:%M:%S")
        with self._file:
            self._file.execute(f"REPLACE INTO files ({', '.join(values)}) VALUES ({', '.join('?' * len(values))})",
                               list(values.values()))

    def is_done(self, row: Row | None, digest: str, settings: str, version: str) -> bool:
        """Tell whether a row stands for a result that is there and still good."""
        return (row is not None and row.result == "done" and bool(row.outputs)
                and (row.hash, row.settings, row.version) == (digest, settings, version)
                and all((self.folder / name).is_file() for name in row.outputs))

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def sole_run(folder: Path) -> Iterator[None]:
    """Hold a folder of results for one run; the system lets go of it whatever becomes of the run.

    Raises
    ------
    ValueError
        Another run is at work there.
    """
    with closing(sqlite3.connect(folder / _LOCK, timeout=0, isolation_level=None)) as lock:
        try:
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError:
            raise ValueError(f"another batch is at work in {folder}: wait for it, or stop it first") from None
        yield
