# SPDX-License-Identifier: GPL-3.0-or-later
"""A process of its own that works off one request after another, under the eyes of a worker.

What crashes, hangs or takes too much memory takes this process with it and not the worker, which can say what happened.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[2]
_POLL = 0.05  # seconds between two looks at the memory
_OWN_FAULT, _ANY_FAULT = 2, 6  # times that a request is begun; more where it was killed from outside
STOPPING = threading.Event()  # while it is set, children give up what they are at


class Child:
    """A process that runs a module of this package, which answers each line of JSON by another.

    Parameters
    ----------
    module : str
        Its name. It calls `serving.serve`.
    """

    def __init__(self, module: str) -> None:
        paths = [str(_ROOT), os.environ.get("PYTHONPATH", "")]
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        self._process = subprocess.Popen(
            [sys.executable, "-m", module], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env={**os.environ, **threads, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            start_new_session=True)  # Ctrl-C is for the one that started the run, who will end this process
        self.module = module
        self._answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        self.peak = 0

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                self._answers.put(line)
        self._answers.put(b"")

    @property
    def alive(self) -> bool:
        """Whether it can take a request."""
        return self._process.poll() is None

    def ask(self, request: Mapping[str, Any], timeout: float, memory: int) -> dict[str, Any]:
        """Have one request worked off.

        Parameters
        ----------
        request
            Anything that JSON can hold.
        timeout
            Seconds that it may take.
        memory
            Bytes that the process may hold.

        Returns
        -------
        dict
            The answer, or "error" with what became of the process and "fault": whose fault that is, "own" or "any".
        """
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # where it is gone, the end of its answers tells
            self._process.stdin.write((json.dumps(request) + "\n").encode())
            self._process.stdin.flush()
        ends = time.monotonic() + timeout
        while True:
            try:
                line = self._answers.get(timeout=_POLL)
            except queue.Empty:
                if STOPPING.is_set():
                    return self._give_up("stopped")
                used = resident(self._process.pid)
                self.peak = max(self.peak, used)
                if used > memory:
                    return self._give_up(f"it needs more than the {memory / 2**30:.3g} GiB of a worker: "
                                         "raise --memory-limit")
                if time.monotonic() > ends:
                    return self._give_up(f"it took longer than {timeout:g} seconds: raise --timeout")
                continue
            try:
                return json.loads(line)
            except ValueError:
                return self._last_words()

    def _give_up(self, error: str) -> dict[str, Any]:
        self.close()
        return {"error": error, "fault": "own"}

    def _last_words(self) -> dict[str, Any]:
        self.close(grace=5)
        code = self._process.returncode
        if code in (-signal.SIGTERM, -getattr(signal, "SIGKILL", signal.SIGTERM)):
            return {"error": f"its worker was killed from outside ({signal.Signals(-code).name}), perhaps for want of "
                             "memory", "fault": "any"}
        try:
            how = signal.Signals(-code).name
        except ValueError:
            how = f"exit code {code}"
        return {"error": f"it crashed its worker ({how})", "fault": "own"}

    def close(self, grace: float = 0.0) -> None:
        """End the process, at once or after so many seconds."""
        if grace:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(grace)
        if self.alive:
            self._process.kill()
        self._process.wait()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # what it has not read is lost
            self._process.stdin.close()


_mine = threading.local()


def work_off(module: str, request: Mapping[str, Any], timeout: float, memory: int, *,
             keep: bool = True) -> dict[str, Any]:
    """Have a request worked off in this thread's child; what crashes or hangs is tried again once.

    Parameters
    ----------
    module, request, timeout, memory
        As of `Child`.
    keep
        Leave the child to the next request of this thread.

    Returns
    -------
    dict
        The answer, with "tries", how often it was begun, and "seconds".
    """
    started = time.perf_counter()
    tries = own = 0
    while True:
        child: Child | None = getattr(_mine, "child", None)
        if child is not None and child.module != module:
            child.close()
        if child is None or not child.alive:
            child = _mine.child = Child(module)
        answer = child.ask(request, timeout, memory)
        tries += 1
        own += answer.get("fault") == "own"
        if "fault" not in answer or own >= _OWN_FAULT or tries >= _ANY_FAULT or STOPPING.is_set():
            break
    if not keep or answer.get("error") or resident_of(child) > memory // 2:  # the next one begins with a clean slate
        child.close()
    return {**answer, "tries": tries, "seconds": time.perf_counter() - started, "memory": child.peak}


def resident_of(child: Child) -> int:
    """Return the bytes of memory that a child holds."""
    return resident(child._process.pid) if child.alive else 0


def resident(process: int) -> int:
    """Return the bytes of memory that a process holds; 0 where that cannot be told."""
    try:
        with open(f"/proc/{process}/statm", "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        pass
    try:
        import psutil  # comes with Dask

        return int(psutil.Process(process).memory_info().rss)
    except Exception:  # not installed, or the process is gone
        return 0
