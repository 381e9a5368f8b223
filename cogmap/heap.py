"""How the C library treats the memory of a process."""

from __future__ import annotations

import ctypes
import threading
import time
from functools import cache

# Twice what sensory memory frees with each frame; glibc takes no larger threshold of mmap.
KEPT_BYTES = 32 * 2**20
# Where threads of one process allocate at once. glibc would make eight for each processor.
ARENAS = 2
# Between two returns of freed memory, which the next arrays must get again.
RETURN_PERIOD_S = 60.0
# From glibc's malloc.h.
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_M_ARENA_MAX = -8


def keep_freed_memory() -> None:
    """Keep up to KEPT_BYTES that were freed, for the next arrays of this process.

    By itself glibc returns the arrays of one camera frame to the kernel, which then clears some
    4,000 pages for those of the next. Other C libraries stay as they are.
    """
    _set(_M_TRIM_THRESHOLD, KEPT_BYTES)
    _set(_M_MMAP_THRESHOLD, KEPT_BYTES)


def share_arenas() -> None:
    """Let all threads that start from now on allocate in ARENAS.

    Each subscription has a thread of its own, and memory that was freed in one arena serves no
    other: a recorder of 70 threads grew by 10 MB an hour, of which none was in use. Other C
    libraries stay as they are.
    """
    _set(_M_ARENA_MAX, ARENAS)


def return_freed_memory() -> None:
    """Return to the kernel all memory that was freed, also what lies between blocks in use: by
    itself glibc returns only what lies after the last of them.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


@cache
def return_freed_memory_regularly() -> None:
    """Return freed memory every RETURN_PERIOD_S from now on, on a thread of its own: nobody waits
    for it.
    """
    threading.Thread(target=_return_regularly, daemon=True).start()


def _return_regularly() -> None:
    while True:
        time.sleep(RETURN_PERIOD_S)
        return_freed_memory()


def _set(option: int, value: int) -> None:
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(option, value)
