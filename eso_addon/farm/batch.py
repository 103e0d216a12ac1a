# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch of files on the workers of a Dask scheduler: submit, gather, write each result down as it comes."""

from __future__ import annotations

import importlib.util
import logging
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .child import work_off
from .ledger import Ledger, Row
from .library import Entry

_LOST = 5  # times that a file is handed out anew after Dask gave up on the workers that had it
_STARTS = 20  # times that the workers here are started
PATIENCE = 15.0  # seconds to wait for a scheduler
_NEEDED = "a batch runs on Dask, which is not there: pip install 'eso-lod[farm]' (or pip install dask distributed)"


@dataclass(frozen=True)
class Farm:
    """Where a batch runs, and what a file may take.

    Attributes
    ----------
    scheduler : str
        Address of a Dask scheduler; a cluster on this computer is started where it is empty.
    workers : int
        Processes of that cluster.
    timeout : float
        Seconds for one file.
    memory : int
        Bytes that the process of one worker may hold.
    """

    scheduler: str
    workers: int
    timeout: float
    memory: int


def run_batch(entries: Sequence[Entry], words: Mapping[str, Any], ledger: Ledger, version: str, settings: str,
              farm: Farm, module: str, tell: Callable[[Row, int], None]) -> None:
    """Work off files, and write what became of each in the ledger.

    Parameters
    ----------
    entries
        The files that are to be done; those with trouble are set aside at once.
    words
        What `lod` is given for each.
    ledger, version, settings
        Where the results are noted, and under what.
    farm
    module
        What the workers' children run; see `child.Child`.
    tell
        Called with each new row, and the size of its file in bytes.

    Raises
    ------
    ValueError
        Dask is not installed, or no scheduler answers.
    """
    def note(entry: Entry, answer: Mapping[str, Any]) -> None:
        row = _row(entry, answer, ledger.folder, version, settings)
        ledger.put(row)
        tell(row, entry.size)

    good = []
    for entry in entries:
        if entry.trouble:
            note(entry, {"error": entry.trouble})
        else:
            good.append(entry)
    if not good:
        return
    for folder in {entry.target.parent for entry in good}:
        folder.mkdir(parents=True, exist_ok=True)
    # the largest first: at the end no worker is left alone with a long one
    good.sort(key=lambda entry: -entry.size)
    with client_of(farm) as client:
        for entry, answer in _results(client, good, words, farm, module):
            note(entry, answer)


def _results(client: Any, entries: Sequence[Entry], words: Mapping[str, Any], farm: Farm,  # noqa: ANN401 - Dask's
             module: str) -> Iterator[tuple[Entry, Mapping[str, Any]]]:
    """Give each file's answer as it comes; what Dask lost is handed out again."""
    from distributed import KilledWorker, as_completed

    def submit(entry: Entry) -> Any:  # noqa: ANN401 - a future
        request = {**words, "input": str(entry.source), "output": str(entry.target)}
        return client.submit(work_off, module, request, farm.timeout, farm.memory, pure=False, retries=0)

    pending = {future: (entry, 0) for entry in entries for future in [submit(entry)]}
    queue = as_completed(list(pending), raise_errors=False)
    for future in queue:
        entry, lost = pending.pop(future)
        error = future.exception() if future.status != "finished" else None
        if error is None and not future.cancelled():
            yield entry, future.result()
        elif isinstance(error, ImportError | AttributeError):
            raise ValueError(f"the workers cannot run this: install the same eso-lod[farm,blender] there ({error})")
        elif lost < _LOST and (error is None or isinstance(error, KilledWorker)):
            again = submit(entry)
            pending[again] = (entry, lost + 1)
            queue.add(again)
        else:
            yield entry, {"error": " ".join(f"lost with its worker: {error}".split()), "tries": lost + 1}
        future.release()


def _row(entry: Entry, answer: Mapping[str, Any], folder: Path, version: str, settings: str) -> Row:
    """Say what became of a file."""
    common: dict[str, Any] = {
        "path": entry.name, "hash": entry.digest, "settings": settings, "version": version,
        "seconds": float(answer.get("seconds", 0.0)), "tries": int(answer.get("tries", 1))}
    if answer.get("error"):
        return Row(**common, result="set aside", error=answer["error"])
    meshes = answer["meshes"]
    last = {mesh["name"]: mesh for mesh in meshes}  # the coarsest level of each
    notes = dict.fromkeys(text for mesh in meshes for text in mesh["messages"])
    outputs = tuple(Path(os.path.relpath(name, folder)).as_posix() for name in answer["output"])
    return Row(**common, result="done", outputs=outputs, notes=(*notes, *answer["not_carried_over"]),
               triangles=sum(mesh["triangles_before"] for mesh in last.values()),
               triangles_after=sum(mesh["triangles_after"] for mesh in last.values()),
               deviation=max((mesh["error"] for mesh in meshes), default=0.0))


@contextmanager
def client_of(farm: Farm) -> Iterator[Any]:
    """Give a client of a scheduler, one that is started here or one that runs somewhere.

    Raises
    ------
    ValueError
        Dask is not installed, or no scheduler answers.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import dask
            from distributed import Client, LocalCluster
    except ImportError:
        raise ValueError(_NEEDED) from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    quiet = {"logging.distributed": "critical", "distributed.scheduler.allowed-failures": 20,
             "distributed.comm.timeouts.connect": "15s",
             # a cluster drops a worker that was killed and takes longer than this to be back, and never replaces it
             "distributed.deploy.lost-worker-timeout": "1000 hours"}
    with ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        stack.enter_context(dask.config.set(quiet))
        if farm.scheduler:
            try:
                client = Client(farm.scheduler, timeout=PATIENCE)
            except (OSError, ValueError, TimeoutError) as error:
                raise ValueError(f"no Dask scheduler answers at {farm.scheduler}: start one with `dask scheduler` "
                                 f"({error})") from None
        else:
            cluster = stack.enter_context(_started(LocalCluster, farm.workers))
            client = Client(cluster)
        stack.enter_context(client)
        yield client


def _started(make: Callable[..., Any], workers: int) -> Any:  # noqa: ANN401 - Dask's cluster
    """Start workers here; one that is killed while it starts has Dask give up on all, so that it is tried again."""
    board = "127.0.0.1:0" if importlib.util.find_spec("bokeh") else None
    for _ in range(_STARTS):
        try:
            # no limit of memory: it is the child's, and watched there
            return make(n_workers=workers, threads_per_worker=1, processes=True, memory_limit=None,
                        dashboard_address=board, silence_logs=logging.CRITICAL, host="127.0.0.1")
        except (RuntimeError, OSError, TimeoutError) as error:
            last = error
    raise ValueError(f"Dask's workers do not start: {last}")


@contextmanager
def stopping_well() -> Iterator[None]:
    """Take the system's wish that this process ends for Ctrl-C, and hear the first one alone: a run ends in order."""
    if threading.current_thread() is not threading.main_thread():  # which alone hears of it
        yield
        return

    before = {wish: signal.getsignal(wish) for wish in (signal.SIGTERM, signal.SIGINT)
              if signal.getsignal(wish) is not signal.SIG_IGN}

    def stop(*_: object) -> None:
        for wish in before:  # impatience must not leave drafts and processes behind
            signal.signal(wish, lambda *_: None)
        raise KeyboardInterrupt

    try:
        for wish in before:
            signal.signal(wish, stop)
        yield
    finally:
        for wish, handler in before.items():
            signal.signal(wish, handler)
