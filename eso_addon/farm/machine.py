# SPDX-License-Identifier: GPL-3.0-or-later
"""What this computer has."""

import os


def cores() -> int:
    """Return how many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))  # type: ignore[attr-defined, unused-ignore]
    except AttributeError:
        return os.cpu_count() or 1


def memory_of_machine() -> int:
    """Return this computer's memory in bytes; 8 GiB where it does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 8 * 2**30


def own_memory() -> int:
    """Return the bytes of memory that this process holds."""
    from .child import resident

    return resident(os.getpid())


def memory_left() -> int:
    """Return the bytes of memory that a new process could take; a container's limit counts."""
    left = memory_of_machine()
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            left = next(int(line.split()[1]) * 1024 for line in file if line.startswith("MemAvailable"))
        with open("/sys/fs/cgroup/memory.max", encoding="ascii") as file:
            left = min(left, int(file.read()))
    except (OSError, ValueError, StopIteration):
        pass
    return left
