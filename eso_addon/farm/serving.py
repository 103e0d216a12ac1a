# SPDX-License-Identifier: GPL-3.0-or-later
"""The other end of `child.Child`: a process that answers lines of JSON from standard input on standard output."""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from collections.abc import Callable
from typing import Any


def serve(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Answer one request after another, until standard input ends; then the process ends, whatever it is doing."""
    own = os.fdopen(os.dup(1), "wb")  # what others print must not stand between the answers
    os.dup2(2, 1)
    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def listen() -> None:
        for line in sys.stdin.buffer:
            requests.put(line)
        os._exit(1)  # whoever wanted the answer is gone

    threading.Thread(target=listen, daemon=True).start()
    while True:
        own.write((json.dumps(answer(json.loads(requests.get()))) + "\n").encode())
        own.flush()
